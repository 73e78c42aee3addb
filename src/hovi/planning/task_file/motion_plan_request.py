"""A planning task from MoveIt's message moveit_msgs/MotionPlanRequest, as YAML."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hovi.checks.arguments import check_arguments_except
from hovi.checks.units import Duration
from hovi.discrete.state import State
from hovi.errors import HoviError, InputError
from hovi.planning.obstacles.obstacle_files import load_obstacles
from hovi.planning.obstacles.yaml_text import YamlMapping, YamlNode, read_yaml
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.notation.ends import End, as_end
from hovi.planning.search.options import PlanOptions
from hovi.planning.task_file.goal_constraints import MOVED, Given, goal_in, refuse
from hovi.planning.task_file.task import Task
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene

_UNUSED = (
    *("workspace_parameters", "pipeline_id", "planner_id", "num_planning_attempts"),
    "allowed_planning_time",
)
"""Fields that choose how MoveIt plans, or where a mobile base may go."""
_REFUSED = {
    "path_constraints": "it holds along the motion: give hovi.plan `conditions`",
    "trajectory_constraints": "it holds along the motion: give hovi.plan `conditions`",
    "reference_trajectories": "a motion to begin with is the `guess` of hovi.plan",
    "max_cartesian_speed": "speeds of links are bounded by `conditions` of hovi.plan",
    "cartesian_speed_limited_link": "speeds of links are bounded by `conditions` of hovi.plan",
    "cartesian_speed_end_effector_link": "speeds of links are bounded by `conditions` of hovi.plan",
}
_SCALING = {"v": "max_velocity_scaling_factor", "a": "max_acceleration_scaling_factor"}
_READ = "start_state", "goal_constraints", "group_name", *_SCALING.values()
_STATE = "joint_state", "multi_dof_joint_state", "attached_collision_objects", "is_diff"
MAX_JOINTS = 10_000
"""Maximum number of joints of a state."""


@check_arguments_except("start", "duration")
def load_motion_plan_request(
    file: str | Path,
    scene: Scene,
    duration: Duration,
    *,
    start: End | None = None,
    limits: str = "urdf",
    planning_scene: str | Path | None = None,
) -> Task:
    """The task of a MotionPlanRequest: `start_state` to the goal of `goal_constraints`.

    The goal is of joints, or of the position and the orientation of a link: the center of each
    region, since a motion of hovi ends at a point. `group_name` is the group that moves, and the
    scaling factors are fractions of the limits on velocities and accelerations. The task's note
    names what chooses how MoveIt plans and means nothing here, such as `allowed_planning_time`.

    file: YAML, as `ros2 topic echo` prints it; or the goal of the action MoveGroup or the request
        of the service GetMotionPlan, which have it as a field.
    scene: the robot, and the effects that act on it.
    duration: of the motion, which no request has, in [s], or bounds of a free one.
    start: positions of the joints that `start_state` leaves out, as for `hovi.plan`.
    limits: those that are scaled: "urdf", or the name of an arm for limits on accelerations.
    planning_scene: YAML with obstacles, as for `hovi.load_obstacles`.
    Raises SceneError with file and line for an invalid file and for what is not supported, such as
    constraints of the path; InputError for other arguments.
    """
    root, robot = _request(read_yaml(Path(file))), scene.robot
    keys = root.mapping(*_READ, *_REFUSED, *_UNUSED)
    for name, why in _REFUSED.items():
        refuse(keys, name, why)
    positions, rates, measured = _start(keys.get("start_state"), robot, start)
    group, moving = _group(keys.get("group_name"), robot)
    goals = keys.need("goal_constraints")
    listed = goals.items()
    if len(listed) != 1:
        raise goals.error(f"there must be one goal, got {len(listed)}: leave the others out")
    goal = goal_in(listed[0], Given(robot, positions, moving))
    obstacles = () if planning_scene is None else load_obstacles(planning_scene)
    options = PlanOptions(limits=_limits(keys, robot, limits), group=group, obstacles=obstacles)
    note = _note(Path(file).name, keys, measured)
    return _task(root, scene, State(positions, rates or None), goal, duration, options, note)


def _request(root: YamlNode) -> YamlNode:
    """The request itself, which an action has as `request`, and a service by its own name."""
    if not root.is_mapping:
        return root
    names = {YamlNode(key, root.path).text() for key, _ in root.node.value}
    if names & {"motion_plan_request"}:
        return root.mapping("motion_plan_request").need("motion_plan_request")
    if names & {"request", "planning_options"}:
        keys = root.mapping("request", "planning_options")
        refuse(keys, "planning_options", "obstacles are read from `planning_scene`")
        return keys.need("request")
    return root


def _task(
    root: YamlNode,
    scene: Scene,
    start: State,
    goal: State | FrameGoal,
    duration: Any,
    options: PlanOptions,
    note: str,
) -> Task:
    """The task; errors in its ends name the file."""
    for end, name in ((start, "start"), (goal, "goal")):
        try:
            as_end(end, scene.robot, name)
        except HoviError as wrong:
            raise root.error(str(wrong).removesuffix(".")) from None
    return Task(scene, start, goal, duration, options, root.path.stem, note=note)


def _start(
    node: YamlNode | None, robot: Robot, given: End | None
) -> tuple[dict[str, Any], dict[str, float], bool]:
    """Positions of all joints, velocities of some, and whether the message has efforts."""
    positions = {} if given is None else _positions(robot, given)
    rates = dict[str, float]()
    measured = False
    if node is not None:
        keys = node.mapping(*_STATE)
        refuse(keys, _STATE[1], "its joints have several coordinates: pass them as `start`")
        refuse(keys, _STATE[2], "what the robot holds is given by `grasped` to hovi.plan")
        state = keys.get("joint_state")
        if state is not None:
            at, rates, measured = _joint_state(state, robot)
            positions |= at
    for name in robot.joint_names:
        if name not in positions:
            what = "the request" if node is None else "start_state"
            message = (
                f"{what} has no position of joint {name!r}: pass those it leaves out as `start`"
            )
            raise InputError(f"{message}.") if node is None else node.error(message)
    return positions, rates, measured


def _positions(robot: Robot, given: End) -> dict[str, Any]:
    """The joints of a start that was passed. Raises InputError."""
    state = as_end(given, robot, "start")
    if not isinstance(state, State):
        raise InputError("`start` must be positions of joints, not the pose of a frame.")
    if isinstance(state.q, Mapping):
        return dict(state.q)
    q = state.on(robot, "start")[0]
    found = {}
    for name in robot.joint_names:
        joint = robot.model.joints[robot.model.getJointId(name)]
        entries = q[joint.idx_q : joint.idx_q + joint.nq].tolist()
        found[name] = entries[0] if len(entries) == 1 else entries
    return found


def _joint_state(node: YamlNode, robot: Robot) -> tuple[dict[str, Any], dict[str, float], bool]:
    """Positions and velocities by joint of a sensor_msgs/JointState, and whether it has efforts."""
    keys = node.mapping("header", "name", "position", "velocity", "effort")
    names = [] if keys.get("name") is None else keys.need("name").items()
    columns = [_numbers(keys, key, len(names)) for key in ("position", "velocity", "effort")]
    if len(names) > MAX_JOINTS:
        raise names[0].error(f"there may be at most {MAX_JOINTS:,} joints")
    positions, rates = dict[str, Any](), dict[str, float]()
    seen = set[str]()
    held, followers = robot.source.held, {each.follower: each for each in robot.couplings}
    for k, each in enumerate(names):
        name = each.text()
        if name in seen:
            raise each.error(f"joint {name[:80]!r} is there twice: leave one of them out")
        seen.add(name)
        value = columns[0][k] if columns[0] else None
        if name in followers:  # where its leader is says where it is
            continue
        if name in held:
            if value is not None and abs(value - held[name]) > MOVED:
                raise each.error(
                    f"joint {name!r} is locked at {held[name]:g} and starts at {value:g}: load the "
                    "robot with it locked there"
                )
            continue
        if name not in robot.joint_names:
            known = robot.hint(name[:80]).removesuffix(".")
            raise each.error(f"the robot has no joint {name[:80]!r}: {known}")
        if value is not None:
            positions[name] = value
        if columns[1] and columns[1][k] != 0.0:
            rates[name] = columns[1][k]
    return positions, rates, any(columns[2])


def _numbers(keys: YamlMapping, key: str, count: int) -> list[float]:
    """As many numbers as joints, or none. Raises SceneError."""
    node = keys.get(key)
    numbers = [] if node is None else [each.number() for each in node.items()]
    if node is not None and len(numbers) not in (0, count):
        raise node.error(f"`{key}` must have a number per joint or none, got {len(numbers)}")
    return numbers


def _group(node: YamlNode | None, robot: Robot) -> tuple[str | None, tuple[str, ...]]:
    """The group, None where there is none, and the joints that move. Raises SceneError."""
    name = "" if node is None else node.text()
    if node is None or not name:
        return None, robot.joint_names
    try:
        found = robot.semantics.joints_of(name, robot.model)
    except HoviError as wrong:
        hint = "" if robot.semantics.groups else "; load it with srdf=..., or clear group_name"
        raise node.error(f"{str(wrong).removesuffix('.')}{hint}") from None
    moving = tuple(joint for joint in robot.joint_names if joint in found)
    if not moving:
        raise node.error(f"group {name[:80]!r} has no joint that moves: name another one")
    return (None if len(moving) == len(robot.joint_names) else name), moving


def _limits(keys: YamlMapping, robot: Robot, base: str) -> str | dict[str, Any]:
    """The limits, scaled by the factors in (0, 1); others count as 1, as in MoveIt."""
    scaled = dict[str, Any]()
    for kind, name in _SCALING.items():
        node = keys.get(name)
        factor = 1.0 if node is None else node.number()
        if node is None or not 0.0 < factor < 1.0:
            continue
        scaled[kind] = f"{100 * factor!r} %"
        try:
            as_limits(robot, {"base": base, kind: scaled[kind]})
        except InputError as wrong:
            raise node.error(
                f"`{name}` cannot scale the limits {base!r} ({str(wrong).removesuffix('.')}): set "
                "it to 1, and give others to the task by with_options(limits=...)"
            ) from None
    return {"base": base, **scaled} if scaled else base


def _note(name: str, keys: YamlMapping, measured: bool) -> str:
    """Fields that are there and mean nothing here, as a sentence; "" if there are none."""
    unused = [key for key in _UNUSED if _says(keys.get(key))] + ["effort"] * measured
    return f"Of {name}, {', '.join(unused)} mean nothing here." if unused else ""


def _says(node: YamlNode | None) -> bool:
    if node is None:
        return False
    return node.is_mapping or node.node.id != "scalar" or node.text() not in ("", "0", "0.0")
