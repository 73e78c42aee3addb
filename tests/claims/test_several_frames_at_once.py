"""Goals of several frames that a motion reaches at once, judged by Pinocchio alone."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.cli.application import main
from hovi.errors import InputError

Array = npt.NDArray[np.float64]

SIDES = {"left": "0 0.5 0", "right": "0 -0.5 0"}
"""Names of two arms, and where their bases are, in [m]."""
T, REACHED = 1.2, 1e-7
EFFECTS = hovi.effects.Gravity(), hovi.effects.Armature(0.5)
"""With rotors, without which a light wrist would spin where it has no limits."""
FREE = {"limits": "none", "self_collision": False}
HOME = np.array([0.3, 0.4, -0.8, 0.2])
MOVED = np.array([0.9, 0.7, -1.3, 0.5])


def arm() -> Path:
    return hovi.example("two_link_reach").parent / "four_axis_arm.urdf"


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A URDF of two arms with a common base."""
    robot = ET.Element("robot", name="two_arms")
    ET.SubElement(robot, "link", name="world")
    for side, place in SIDES.items():
        for each in ET.parse(arm()).getroot():
            if each.tag == "material":
                continue
            for named in each.iter():
                if named.tag in ("link", "joint", "parent", "child"):
                    key = "link" if named.tag in ("parent", "child") else "name"
                    named.set(key, f"{side}_{named.get(key)}")
                if named.tag == "material":
                    named.attrib = {"name": f"{side}_{named.get('name')}"}
            robot.append(each)
        joint = ET.SubElement(robot, "joint", name=f"{side}_mount", type="fixed")
        ET.SubElement(joint, "parent", link="world")
        ET.SubElement(joint, "child", link=f"{side}_base")
        ET.SubElement(joint, "origin", xyz=place, rpy="0 0 0")
    path = tmp_path_factory.mktemp("robot") / "two_arms.urdf"
    ET.ElementTree(robot).write(path)
    return path


@pytest.fixture(scope="module")
def scene(file: Path) -> hovi.Scene:
    return hovi.Scene(hovi.load_robot(file), EFFECTS)


@cache
def ur5() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])


def pose(robot: hovi.Robot, frame: str, q: Array) -> Array:
    """By Pinocchio's forward kinematics, (4, 4)."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return np.array(data.oMf[robot.model.getFrameId(frame)].homogeneous)


def missed(robot: hovi.Robot, goals: list[hovi.FrameGoal], q: Array) -> float:
    """The largest distance of a frame from the position of its goal, in [m]."""
    found = [pose(robot, each.frame, q)[:3, 3] - each.position for each in goals]
    return float(np.abs(found).max())


def tips(scene: hovi.Scene, q: Array) -> list[hovi.FrameGoal]:
    """The places of both tips at a configuration as goals."""
    frames = [f"{side}_tool" for side in SIDES]
    return [
        hovi.FrameGoal(each, position=pose(scene.robot, each, q)[:3, 3], guess=q) for each in frames
    ]


def both(q: Array, other: Array) -> Array:
    return np.concatenate([q, other])


def test_two_arms_cost_what_each_of_them_does_alone(scene: hovi.Scene) -> None:
    """The arms stand apart, and share no joint: the least cost is the sum of both."""
    targets = MOVED, HOME + np.array([-0.5, 0.3, 0.4, 0.2])
    goals = tips(scene, both(*targets))
    found = hovi.plan(scene, both(HOME, HOME), goals, T, tolerance=1e-6, **FREE)
    alone = hovi.Scene(hovi.load_robot(arm()), EFFECTS)
    costs = []
    for q in targets:
        goal = hovi.FrameGoal("tool", position=pose(alone.robot, "tool", q)[:3, 3], guess=q)
        costs.append(hovi.plan(alone, HOME, goal, T, tolerance=1e-6, **FREE).cost)
    assert found.success, found.message
    assert missed(scene.robot, goals, found.trajectory.q[-1]) < REACHED
    assert found.cost == pytest.approx(sum(costs), rel=3e-6)


def test_both_hands_of_baxter_reach_their_poses() -> None:
    scene = hovi.Scene(hovi.load_robot("baxter"), EFFECTS)
    robot, shift = scene.robot, np.linspace(-0.4, 0.4, scene.robot.nv)
    middle = (robot.lower + robot.upper) / 2
    there = middle + shift * (robot.upper - robot.lower) / 4
    frames = "left_gripper", "right_gripper"
    goals = [hovi.FrameGoal(each, pose=pose(robot, each, there), guess=there) for each in frames]
    found = hovi.plan(scene, middle, goals, 2.0, **FREE)
    assert found.success, found.message
    for goal in goals:
        reached = pose(robot, goal.frame, found.trajectory.q[-1])
        assert np.abs(reached[:3, 3] - goal.position).max() < REACHED
        assert np.abs(reached[:3, :3] - goal.rotation).max() < REACHED


def test_inverse_kinematics_reaches_both_frames_in_every_pair_of_branches(
    scene: hovi.Scene,
) -> None:
    goals = tips(scene, both(MOVED, HOME))
    found = hovi.inverse_kinematics(scene.robot, goals, near=both(HOME, HOME))
    assert len(found) > 1
    assert max(missed(scene.robot, goals, q) for q in found) < 1e-8
    away = [np.linalg.norm(scene.robot.difference(both(HOME, HOME), q)) for q in found]
    assert away == sorted(away)


def test_frames_that_joints_move_together_are_reached_at_once() -> None:
    robot, q = ur5().robot, np.array([0.5, -1.0, 1.2, -1.6, -1.47, 0.4])
    frames = "forearm_link", "tool0"
    goals = [hovi.FrameGoal(each, position=pose(robot, each, q)[:3, 3]) for each in frames]
    found = hovi.inverse_kinematics(robot, goals, near=q + 0.1)
    assert max(missed(robot, goals, each) for each in found) < 1e-6


BEGIN = np.array([0.0, -1.2, 1.5, -1.8, -1.57, 0.0])
END = BEGIN + np.array([0.5, 0.2, -0.3, 0.2, 0.1, 0.4])


def of_wrist(frame: str, shift: float = 0.0) -> hovi.FrameGoal:
    there = pose(ur5().robot, frame, END)
    there[2, 3] += shift
    return hovi.FrameGoal(frame, pose=there)


def test_goals_of_one_link_that_agree_are_one() -> None:
    one = hovi.plan(ur5(), BEGIN, of_wrist("tool0"), T, **FREE)
    two = hovi.plan(ur5(), BEGIN, [of_wrist("tool0"), of_wrist("wrist_3_link")], T, **FREE)
    assert two.success, two.message
    assert two.cost == pytest.approx(one.cost, rel=1e-9)
    problem = two.problem
    assert problem is not None
    assert sum(each.y.size for each in problem.equations) <= 6


def test_equations_that_follow_from_others_are_left_out() -> None:
    """Three points on a line of a link fix all of its pose but a turn about that line."""
    goals = [
        hovi.FrameGoal(each, position=pose(ur5().robot, each, END)[:3, 3], guess=END)
        for each in ("tool0", "ee_link", "wrist_3_link")
    ]
    found = hovi.plan(ur5(), BEGIN, goals, T, **FREE)
    assert found.success, found.message
    assert missed(ur5().robot, goals, found.trajectory.q[-1]) < REACHED
    assert found.problem is not None
    assert sum(each.y.size for each in found.problem.equations) == 5


@pytest.mark.parametrize("shift", [1e-5, -0.02])
def test_goals_of_one_link_that_contradict_each_other_are_refused(shift: float) -> None:
    goals = [of_wrist("tool0"), of_wrist("wrist_3_link", shift)]
    with pytest.raises(InputError, match=r"'tool0' and 'wrist_3_link'.* contradict"):
        hovi.plan(ur5(), BEGIN, goals, T)


def test_goals_that_only_a_longer_arm_reaches_at_once_are_infeasible() -> None:
    goals = [of_wrist("tool0"), hovi.FrameGoal("forearm_link", position=[0.9, 0.9, 0.9])]
    found = hovi.plan(ur5(), BEGIN, goals, T, **FREE)
    assert found.status is hovi.Status.INFEASIBLE
    assert "frame 'tool0' misses it" in found.message
    assert "frame 'forearm_link' misses it" in found.message


def test_segments_end_where_both_frames_have_their_goals(scene: hovi.Scene) -> None:
    goals = tips(scene, both(MOVED, HOME + 0.3))
    segments = [hovi.Segment(goals, 0.8), hovi.Segment(both(HOME, HOME), 0.8)]
    found = hovi.plan_sequence(scene, both(HOME, HOME), segments, **FREE)
    assert found.success, found.message
    assert missed(scene.robot, goals, found.trajectory.sample([0.8]).q[0]) < REACHED
    assert np.abs(found.trajectory.sample([0.8]).v).max() < REACHED


def test_replans_take_goals_of_several_frames(scene: hovi.Scene) -> None:
    q = both(MOVED, HOME + 0.3)
    found = hovi.plan(scene, both(HOME, HOME), tips(scene, q), T, **FREE)
    goals = tips(scene, q + 0.03)
    again = found.replan(goal=goals)
    assert again.success, again.message
    assert missed(scene.robot, goals, again.trajectory.q[-1]) < REACHED


def test_a_via_point_of_two_frames_is_passed(scene: hovi.Scene) -> None:
    goals = tips(scene, both(MOVED, HOME + 0.3))
    via = hovi.Via(0.5, goals)
    found = hovi.plan(scene, both(HOME, HOME), both(HOME, MOVED), T, via=[via], **FREE)
    assert found.success, found.message
    assert missed(scene.robot, goals, found.trajectory.sample([0.5]).q[0]) < REACHED


SCENE = """
robot = "two_arms.urdf"
duration = 1.2
limits = "none"
self_collision = false

[start]
q = [0.3, 0.4, -0.8, 0.2, 0.3, 0.4, -0.8, 0.2]

[[goal]]
frame = "left_tool"
position = [0.3, 0.8, 0.4]

[[goal]]
frame = "right_tool"
position = [0.4, -0.7, 0.3]

[effects.gravity]

[effects.armature]
inertia = 0.5
"""


def test_a_file_has_a_table_for_each_frame(file: Path, tmp_path: Path) -> None:
    path = file.parent / "scene.toml"
    path.write_text(SCENE)
    task = hovi.load_task(path)
    goal = task.goal
    assert isinstance(goal, hovi.FrameGoal)
    assert [each.frame for each in goal.parts] == ["left_tool", "right_tool"]
    found = hovi.plan_task(task)
    assert found.success, found.message
    assert missed(task.scene.robot, list(goal.parts), found.trajectory.q[-1]) < REACHED
    again = hovi.load_task(hovi.save_task(task, tmp_path / "again.toml"))
    assert hovi.plan_task(again).cost == found.cost


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('frame = "right_tool"\n', "", r"line 1\d: `position` needs a `frame`"),
        ('frame = "right_tool"\nposition', "q", r"goal\[1\]"),
        ("right_tool", "right_toolp", r"line 1\d: .*right_toolp"),
        ("position = [0.4, -0.7, 0.3]", "position = [0.4, -0.7]", r"goal\[1\].position"),
    ],
)
def test_a_wrong_table_of_a_frame_is_named(file: Path, old: str, new: str, said: str) -> None:
    path = file.parent / "wrong.toml"
    path.write_text(SCENE.replace(old, new))
    with pytest.raises(hovi.HoviError, match=said) as wrong:
        hovi.load_task(path)
    assert "wrong.toml" in str(wrong.value)


def test_a_study_varies_the_goal_of_one_frame(
    scene: hovi.Scene, file: Path, tmp_path: Path
) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    (file.parent / "scene.toml").write_text(SCENE)
    study = file.parent / "study.toml"
    study.write_text(
        'scene = "scene.toml"\n[[vary]]\nfield = "goal[1].position[2]"\nvalues = [0.3, 0.35]\n'
    )
    options = ["--out", str(tmp_path), "--workers", "1"]
    assert main(["study", "run", str(study), *options]) == 0
    rows = pq.read_table(tmp_path / "plans.parquet").to_pylist()
    assert [row["success"] for row in rows] == [True, True]
    heights = [pose(scene.robot, "right_tool", np.array(row["q_goal"]))[2, 3] for row in rows]
    assert heights == pytest.approx([0.3, 0.35], abs=REACHED)


@pytest.mark.parametrize("goals", [[of_wrist, 1], ["home", of_wrist]])
def test_a_list_with_other_entries_is_refused(goals: list[object]) -> None:
    given = [each("tool0") if callable(each) else each for each in goals]
    with pytest.raises(InputError, match=r"list of hovi\.FrameGoal"):
        hovi.plan(ur5(), BEGIN, given, T)
