"""Requests of MoveIt: the goals of tasks satisfy the constraints as MoveIt defines them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
import yaml

import hovi
from hovi.errors import InputError, SceneError
from hovi.planning.problem.frame_goal import FrameGoal
from samples.world_files import JOINT_REQUEST, LINK_REQUEST, PLANNING_SCENE

Array = npt.NDArray[np.float64]

BOX = (
    '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    "</inertial>"
)
"""What a link of a URDF weighs."""
ARM = [f"panda_joint{k}" for k in range(1, 8)]


@pytest.fixture(scope="module")
def scene() -> hovi.Scene:
    """A Panda with its SRDF, of which the fingers are locked."""
    fingers = ["panda_finger_joint1", "panda_finger_joint2"]
    return hovi.Scene(hovi.load_robot("panda", locked=fingers), [hovi.effects.Gravity()])


def read(text: str, scene: hovi.Scene, folder: Path, **options: Any) -> hovi.Task:
    path = folder / "request.yaml"
    path.write_text(text)
    return hovi.load_motion_plan_request(path, scene, 1.5, **options)


def no_group(text: str) -> str:
    return text.replace("group_name: arm", "group_name: ''")


def misses(request: dict[str, Any], robot: hovi.Robot, q: Array) -> dict[str, float]:
    """By how much q misses constraints in frames that are the world, as MoveIt measures it.

    The distance from the region's center of the link's point, and the largest angle of its error
    in XYZ Euler angles about the desired axes, beyond a tolerance of pi.
    """
    data, found = robot.model.createData(), dict[str, float]()
    pin.framesForwardKinematics(robot.model, data, q)
    goal = request["goal_constraints"][0]
    for each in goal.get("position_constraints", []):
        pose = data.oMf[robot.model.getFrameId(each["link_name"])]
        offset = each.get("target_point_offset") or {}
        point = pose.act(np.array([offset.get(axis, 0.0) for axis in "xyz"]))
        center = each["constraint_region"]["primitive_poses"][0]["position"]
        found["distance"] = float(np.linalg.norm(point - [center[axis] for axis in "xyz"]))
    for each in goal.get("orientation_constraints", []):
        R = data.oMf[robot.model.getFrameId(each["link_name"])].rotation
        x = each["orientation"]
        desired = pin.Quaternion(x["w"], x["x"], x["y"], x["z"]).matrix()
        E = desired.T @ R  # = Rx(a) Ry(b) Rz(c)
        angles = [
            np.arctan2(-E[1, 2], E[2, 2]),
            np.arcsin(np.clip(E[0, 2], -1, 1)),
            np.arctan2(-E[0, 1], E[0, 0]),
        ]
        free = [each[f"absolute_{axis}_axis_tolerance"] >= np.pi for axis in "xyz"]
        found["angle"] = max(0.0 if f else abs(float(a)) for a, f in zip(angles, free, strict=True))
    return found


def test_a_request_of_joints_gives_their_positions_and_leaves_the_others_free(
    scene: hovi.Scene, tmp_path: Path
) -> None:
    task = read(no_group(JOINT_REQUEST), scene, tmp_path)
    state, _ = task.start_state.on(scene.robot, "start")
    np.testing.assert_array_equal(state, [0.1, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
    assert isinstance(task.goal, hovi.State)
    goal, _ = task.goal.on(scene.robot, "goal")
    assert goal[[0, 1, 3]].tolist() == [0.5, -0.6, -2.2]
    assert set(task.goal.free) == {ARM[k] for k in (2, 4, 5, 6)}
    assert task.duration == 1.5
    assert task.name == "request"
    assert task.note == (
        "Of request.yaml, workspace_parameters, pipeline_id, num_planning_attempts, "
        "allowed_planning_time mean nothing here."
    )


def test_a_request_may_be_in_the_goal_of_an_action_or_in_that_of_a_service(
    scene: hovi.Scene, tmp_path: Path
) -> None:
    """As they stand in commands of `ros2 action send_goal` and `ros2 service call`."""
    message = yaml.safe_load(LINK_REQUEST)
    options = {"plan_only": True, "planning_scene_diff": {"world": {"collision_objects": []}}}
    wanted = read(LINK_REQUEST, scene, tmp_path).goal
    for whole in (
        {"request": message, "planning_options": options},
        {"motion_plan_request": message},
    ):
        goal = read(yaml.safe_dump(whole), scene, tmp_path).goal
        assert isinstance(goal, FrameGoal)
        assert isinstance(wanted, FrameGoal)
        np.testing.assert_array_equal(goal.position, wanted.position)  # type: ignore[arg-type]
    options["planning_scene_diff"] = {"world": {"collision_objects": [{"id": "table"}]}}
    moved = {"request": message, "planning_options": options}
    with pytest.raises(SceneError, match="`planning_options` is not supported, as obstacles are"):
        read(yaml.safe_dump(moved), scene, tmp_path)


def test_scaling_factors_are_fractions_of_limits(scene: hovi.Scene, tmp_path: Path) -> None:
    task = read(no_group(JOINT_REQUEST), scene, tmp_path)
    assert task.options.limits == {"base": "urdf", "v": "40.0 %"}
    both = no_group(JOINT_REQUEST).replace(
        "acceleration_scaling_factor: 1.0", "acceleration_scaling_factor: 0.1"
    )
    known = read(both, scene, tmp_path, limits="panda")
    assert known.options.limits == {"base": "panda", "v": "40.0 %", "a": "10.0 %"}
    with pytest.raises(
        SceneError,
        match=r"line 4\d: `max_acceleration_scaling_factor` cannot scale the limits 'urdf'",
    ):
        read(both, scene, tmp_path)
    for factor in ("0.0", "1.5", "-1"):  # MoveIt takes these as 1
        text = no_group(JOINT_REQUEST).replace(
            "velocity_scaling_factor: 0.4", f"velocity_scaling_factor: {factor}"
        )
        assert read(text, scene, tmp_path).options.limits == "urdf"


def test_a_task_of_a_request_is_planned(scene: hovi.Scene, tmp_path: Path) -> None:
    task = read(no_group(JOINT_REQUEST), scene, tmp_path)
    solution = hovi.plan_task(task, self_collision=False)
    assert solution.success
    q = solution.trajectory.q
    np.testing.assert_allclose(q[0], [0.1, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785], atol=1e-9)
    np.testing.assert_allclose(q[-1, [0, 1, 3]], [0.5, -0.6, -2.2], atol=1e-9)
    limit = 0.4 * scene.robot.velocity_limit
    assert (np.abs(solution.trajectory.v) <= limit * (1 + 1e-6)).all()


def variants() -> dict[str, str]:
    """The request of a link, with its parts and its frames changed."""
    text = LINK_REQUEST
    start = text.index("  orientation_constraints:")
    end = text.index("group_name")
    offset = "    target_point_offset: {x: 0.0, y: 0.0, z: 0.1034}\n"
    tolerance = "absolute_{}_axis_tolerance: 0.001"
    free = {
        axis: text.replace(tolerance.format(axis), f"absolute_{axis}_axis_tolerance: 6.3")
        for axis in "xyz"
    }
    position = text[: text.index("- position_constraints")]
    tilted = text.replace(
        "{x: 0.9238795325112867, y: -0.3826834323650898, z: 0.0, w: 0.0}",
        "{x: 0.9, y: -0.38, z: 0.1, w: 0.1886796226411321}",
    )
    assert tilted != text
    return {
        "pose": text,
        "tilted": tilted,
        "tilted, y free": tilted.replace(
            "y_axis_tolerance: 0.001", "y_axis_tolerance: 6.3"
        ).replace(offset, ""),
        "position": text[:start].replace(offset, "") + text[end:],
        "orientation": position + "- " + text[start:].lstrip(),
        "z free": free["z"],
        "x free": free["x"].replace(offset, ""),
        "y free": free["y"].replace(offset, ""),
        "box": text.replace(
            "type: 2, dimensions: [0.0001]", "type: box, dimensions: [1, 0.1, 0.1]"
        ),
        "world": text.replace("frame_id: panda_link0", "frame_id: world"),
    }


@pytest.mark.parametrize("name", variants())
def test_goals_of_links_satisfy_the_constraints(
    name: str, scene: hovi.Scene, tmp_path: Path
) -> None:
    text = variants()[name]
    goal = read(text, scene, tmp_path).goal
    assert isinstance(goal, FrameGoal)
    free = {"pose": 6, "tilted": 6, "box": 6, "world": 6, "position": 3, "orientation": 3}
    assert goal.equations == free.get(name, 5)
    kinds = {"position": {"distance"}, "orientation": {"angle"}}
    for q in hovi.inverse_kinematics(scene.robot, goal, most=3):
        found = misses(yaml.safe_load(text), scene.robot, q)
        assert set(found) == kinds.get(name, {"distance", "angle"})
        assert max(found.values()) < 1e-6


def test_a_frame_that_is_fixed_to_the_base_places_the_goal(tmp_path: Path) -> None:
    """A table of which the frame is turned by 90 degrees and moved."""
    joint = '<axis xyz="0 {} {}"/><limit lower="-3" upper="3" effort="9" velocity="9"/></joint>'
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(
        f'<robot name="arm"><link name="base"/><link name="table"/><link name="a">{BOX}</link>'
        f'<link name="b">{BOX}</link><link name="c">{BOX}</link>'
        '<joint name="t" type="fixed"><parent link="base"/><child link="table"/>'
        '<origin xyz="0.2 0.1 0.5" rpy="0 0 1.5707963267948966"/></joint>'
        '<joint name="j1" type="revolute"><parent link="base"/><child link="a"/>'
        + joint.format(0, 1)
        + '<joint name="j2" type="revolute"><parent link="a"/><child link="b"/>'
        + joint.format(1, 0)
        + '<joint name="j3" type="prismatic"><parent link="b"/><child link="c"/>'
        '<origin xyz="0 0 0.3"/>' + joint.format(0, 1) + "</robot>"
    )
    scene = hovi.Scene(hovi.load_robot(urdf))
    text = (
        "start_state: {joint_state: {name: [j1, j2, j3], position: [0.1, 0.2, 0.3]}}\n"
        "goal_constraints: [{position_constraints: [{header: {frame_id: table}, link_name: c,\n"
        "  constraint_region: {primitives: [{type: 2, dimensions: [0.01]}],\n"
        "    primitive_poses: [{position: {x: 0.3, y: -0.1}}]}}],\n"
        "  orientation_constraints: [{header: {frame_id: table}, link_name: c,\n"
        "    orientation: {x: 0.6, w: 0.8}}]}]\n"
    )
    goal = read(text, scene, tmp_path).goal
    assert isinstance(goal, FrameGoal)
    turned = pin.rpy.rpyToMatrix(0, 0, np.pi / 2) @ pin.Quaternion(0.8, 0.6, 0.0, 0.0).matrix()
    np.testing.assert_allclose(np.asarray(goal.rotation), turned, atol=1e-12)
    np.testing.assert_allclose(np.asarray(goal.position), [0.3, 0.4, 0.5], atol=1e-12)
    moving = text.replace("frame_id: table", "frame_id: b")
    with pytest.raises(SceneError, match="the frame 'b' moves with the robot"):
        read(moving, scene, tmp_path)


def test_positions_that_a_request_leaves_out_are_those_of_the_start(
    scene: hovi.Scene, tmp_path: Path
) -> None:
    empty = re.sub(r"  joint_state:\n.*?(?=  is_diff)", "", LINK_REQUEST, flags=re.S)
    assert "panda_joint1" not in empty
    with pytest.raises(SceneError, match=r"start_state has no position of joint 'panda_joint1'"):
        read(empty, scene, tmp_path)
    home = [0.0, -0.6, 0.0, -2.0, 0.0, 1.6, 0.8]
    task = read(empty, scene, tmp_path, start=home)
    np.testing.assert_array_equal(task.start_state.on(scene.robot, "start")[0], home)
    named = LINK_REQUEST.replace(
        "position: [0.0, -0.785", "velocity: [0.5, 0, 0, 0, 0, 0, 0]\n    position: [0.0, -0.785"
    )
    start = read(named, scene, tmp_path, start=home).start_state
    q, v = start.on(scene.robot, "start")
    assert (q[1], v[0], v[1]) == (-0.785, 0.5, 0.0)


def test_obstacles_of_a_planning_scene_are_those_of_the_task(
    scene: hovi.Scene, tmp_path: Path
) -> None:
    (tmp_path / "kitchen.yaml").write_text(PLANNING_SCENE)
    task = read(LINK_REQUEST, scene, tmp_path, planning_scene=tmp_path / "kitchen.yaml")
    assert [each.name for each in task.options.obstacles] == ["table", "table 2", "ball", "wedge"]  # type: ignore[union-attr]


def test_a_group_moves_alone(scene: hovi.Scene, tmp_path: Path) -> None:
    """Its other joints stay where they are at the start; "hand" is another group of the SRDF."""
    robot = hovi.load_robot("panda")
    whole = hovi.Scene(robot, [hovi.effects.Gravity()])
    task = read(
        JOINT_REQUEST.replace("name: [panda_finger_joint1,", "name: [panda_finger_joint2,"),
        whole,
        tmp_path,
        start="default",
    )
    assert task.options.group == "arm"
    assert isinstance(task.goal, hovi.State)
    assert "panda_finger_joint1" not in task.goal.free
    moved = JOINT_REQUEST.replace(
        "joint_name: panda_joint4, position: -2.2",
        "joint_name: panda_finger_joint1, position: 0.03",
    )
    with pytest.raises(SceneError, match="joint 'panda_finger_joint1' is not in the group"):
        read(moved, whole, tmp_path, start="default")
    unknown = JOINT_REQUEST.replace("group_name: arm", "group_name: arms")
    with pytest.raises(SceneError, match=r"line \d+: robot .* has no group 'arms': did you"):
        read(unknown, scene, tmp_path)


CHANGES = (
    (
        "path_constraints:\n  name: ''\n  joint_constraints: []",
        "path_constraints:\n  joint_constraints: [{joint_name: panda_joint1, position: 0.0}]",
        "`path_constraints` is not supported, as it holds along the motion",
    ),
    (
        "  constraints: []",
        "  constraints: [{name: up}]",
        "`trajectory_constraints` is not supported",
    ),
    (
        "reference_trajectories: []",
        "reference_trajectories: [{}]",
        "`reference_trajectories` is not",
    ),
    (
        "max_cartesian_speed: 0.0",
        "max_cartesian_speed: 0.2",
        "`max_cartesian_speed` is not supported",
    ),
    ("limited_link: ''", "limited_link: panda_hand", "`cartesian_speed_limited_link` is not"),
    (
        "joint_names: [], transforms",
        "joint_names: [base], transforms",
        "`multi_dof_joint_state` is not",
    ),
    (
        "attached_collision_objects: []",
        "attached_collision_objects: [{link_name: x}]",
        "`attached_collision_objects` is not supported, as what the robot holds",
    ),
    (
        "visibility_constraints: []",
        "visibility_constraints: [{}]",
        "`visibility_constraints` is not",
    ),
    ("goal_constraints:\n", "goal_constraints:\n- {}\n", "there must be one goal, got 2"),
    ("planner_id: ''", "planner: ''", r"unknown key 'planner': did you mean 'planner_id'"),
    (
        "joint_name: panda_joint2",
        "joint_name: panda_joint1",
        "joint 'panda_joint1' has two constraints",
    ),
    ("joint_name: panda_joint2", "joint_name: elbow", "the robot has no joint 'elbow'"),
    ("tolerance_below: 0.002", "tolerance_below: -0.002", "`tolerance_below` must be 0 or more"),
    ("joint2, panda_joint1, panda_joint3", "joint2, panda_joint2, panda_joint3", "is there twice"),
    ("position: [0.0, -0.785", "position: [0.04, -0.785", "is locked at 0 and starts at 0.04"),
    ("1.571, 0.785]", "1.571]", "`position` must have a number per joint or none, got 7"),
    ("allowed_planning_time: 5.0", "allowed_planning_time: &a 5.0", "anchors"),
)
LINK_CHANGES = (
    ("type: 2, dimensions: [0.0001]", "type: 4, dimensions: [1, 1]", "`type` must be 1 or box"),
    (
        "[{type: 2, dimensions: [0.0001]}]",
        "[]",
        "a region must be one primitive with its pose, got 0",
    ),
    (
        "link_name: panda_link8\n    target",
        "link_name: panda_hand\n    target",
        "a goal is of one link",
    ),
    ("panda_link8", "panda_link0", "is fixed to the world"),
    ("frame_id: panda_link0", "frame_id: kitchen", "the robot has no frame 'kitchen'"),
    ("x: 0.9238795325112867", "x: 0.8", "must be a unit quaternion"),
    ("z: 0.0, w: 1.0", "z: 1.0e+308, w: 1.0", "must be a unit quaternion"),
    ("x: 0.45", "x: 1.0e+10", r"positions must be within 1e\+09 m"),
    (
        "x: 0.0, y: 0.0, z: 0.1034",
        "x: 0.1, y: .inf, z: 0.1034",
        "expected a finite number, got '.inf'",
    ),
    ("absolute_z_axis_tolerance: 0.001", "absolute_z_axis_tolerance: -1", "must be 0 or more"),
    (
        "- position_constraints:",
        "- joint_constraints: [{joint_name: panda_joint1, position: 0.0}]\n  position_constraints:",
        "a goal is of joints or of a link",
    ),
)


@pytest.mark.parametrize(("old", "new", "message"), CHANGES)
def test_what_a_task_does_not_have_is_refused_by_name(
    old: str, new: str, message: str, scene: hovi.Scene, tmp_path: Path
) -> None:
    text = no_group(JOINT_REQUEST)
    assert old in text
    with pytest.raises(SceneError, match=message) as refused:
        read(text.replace(old, new, 1), scene, tmp_path)
    assert re.match(rf"{re.escape(str(tmp_path))}/request\.yaml, line \d+: ", str(refused.value))


@pytest.mark.parametrize(("old", "new", "message"), LINK_CHANGES)
def test_goals_of_links_that_are_no_frame_goals_are_refused(
    old: str, new: str, message: str, scene: hovi.Scene, tmp_path: Path
) -> None:
    assert old in LINK_REQUEST
    with pytest.raises(SceneError, match=message):
        read(LINK_REQUEST.replace(old, new), scene, tmp_path)


def test_orientations_that_leave_the_point_open_are_refused(
    scene: hovi.Scene, tmp_path: Path
) -> None:
    free = LINK_REQUEST.replace(
        "absolute_x_axis_tolerance: 0.001", "absolute_x_axis_tolerance: 3.2"
    )
    with pytest.raises(SceneError, match="`target_point_offset` needs an orientation constraint"):
        read(free, scene, tmp_path)
    two = free.replace("absolute_y_axis_tolerance: 0.001", "absolute_y_axis_tolerance: 3.2")
    with pytest.raises(SceneError, match="the orientation is free about 2 axes, and may be about"):
        read(two, scene, tmp_path)


def test_a_start_that_is_no_configuration_is_refused(scene: hovi.Scene, tmp_path: Path) -> None:
    goal = FrameGoal("panda_hand", position=[0.3, 0.0, 0.5])
    with pytest.raises(InputError, match="`start` must be positions of joints"):
        read(LINK_REQUEST, scene, tmp_path, start=goal)
