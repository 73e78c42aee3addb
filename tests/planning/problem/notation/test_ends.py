"""Ends, via points and options in Python in the words of a scene file."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit

import hovi
from hovi.discrete.state import State
from hovi.errors import HoviWarning, InputError, SceneError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via
from hovi.planning.problem.notation.ends import EndError, as_end
from hovi.planning.problem.notation.via_points import as_via
from hovi.planning.task_file.reading import load_task
from samples.meshes import channel
from samples.world_files import CUPBOARD, PLANNING_SCENE

POSITION, RPY = [0.45, 0.25, 0.25], [3.0, 0.1, 0.2]
QUATERNION = [0.6, 0.0, 0.0, 0.8]
AXIS = {"frame": [0.0, 0.0, 1.0], "world": [0.0, 0.0, -1.0]}
Q = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1]
ENDS: dict[str, dict[str, Any]] = {
    "a configuration": {"q": Q},
    "a moving state": {"q": Q, "v": {"wrist_1_joint": 0.3}, "free": ["elbow_joint"]},
    "a free velocity": {"q": Q, "free_velocity": ["all"]},
    "a position": {"frame": "tool0", "position": POSITION},
    "a position with rpy": {"frame": "tool0", "position": POSITION, "rpy": RPY},
    "a quaternion": {"frame": "tool0", "quaternion_xyzw": QUATERNION},
    "another quaternion": {"frame": "tool0", "position": POSITION, "quaternion_wxyz": QUATERNION},
    "an axis": {"frame": "tool0", "position": POSITION, "axis": AXIS},
    "a moving frame": {"frame": "tool0", "position": POSITION, "free_velocity": ["all"]},
}


def fields(end: State | FrameGoal, robot: hovi.Robot) -> list[Any]:
    """What an end says, for comparison."""
    if isinstance(end, State):
        free = end.free_on(robot, "end", 3).tolist()
        return [*(each.tolist() for each in end.jet_on(robot, "end")), free]
    parts = (end.position, end.rotation, *(end.axis or ()))
    numbers = [None if each is None else np.asarray(each).tolist() for each in parts]
    return [end.frame, *numbers, list(end.free_velocity)]


def task(**keys: Any) -> dict[str, Any]:
    return {"robot": "ur5", "duration": "2 s", "start": {"q": Q}, "goal": {"q": Q}} | keys


def loaded(folder: Path, **keys: Any) -> hovi.Task:
    path = folder / "scene.toml"
    path.write_text(tomlkit.dumps(task(**keys)))
    return load_task(path)


@pytest.mark.parametrize("name", ENDS)
def test_a_table_means_the_same_in_python_and_in_a_file(
    name: str, ur5: hovi.Robot, tmp_path: Path
) -> None:
    for end in ("start", "goal"):
        read = getattr(loaded(tmp_path, **{end: ENDS[name]}), end)
        assert fields(as_end(ENDS[name], ur5, end), ur5) == fields(read, ur5)


def test_all_ways_to_give_a_configuration_are_the_same(panda: hovi.Robot) -> None:
    q = panda.pose("default")
    table = dict(zip(panda.joint_names, q, strict=True))
    for given in (q, list(q), "default", table, {"q": "default"}, State("default"), State(table)):
        assert np.array_equal(as_end(given, panda, "start").on(panda, "start")[0], q)


def test_a_joint_may_be_called_as_a_key_is(tmp_path: Path) -> None:
    urdf = hovi.example("two_link.urdf").read_text()
    path = tmp_path / "odd.urdf"
    path.write_text(urdf.replace('"shoulder"', '"q"').replace('"elbow"', '"v"'))
    state = as_end({"q": 0.1, "v": 0.2}, hovi.load_robot(path), "start")
    assert np.asarray(state.q).tolist() == [0.1, 0.2]


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ({"q": Q, "position": POSITION}, "`position` needs a `frame`."),
        ({"frame": "tool0", "q": Q}, "a goal of a `frame` takes no `q`: leave it out."),
        ({"v": Q}, "`goal` needs q, or a frame and its target."),
        ({"q": Q, "speed": Q}, "unknown key `goal.speed`"),
        ({"q": Q, "velocity": Q}, "`velocity` needs a `frame`: velocities of joints are `v`"),
        ({"frame": "tool0", "axis": {"frame": [0, 0, 1]}}, "`goal.axis` needs two directions"),
        ({"frame": "tool0"}, "a frame goal needs a pose, a position, a rotation or an axis."),
        ({"frame": "tool1", "position": POSITION}, "has no frame 'tool1'"),
        ({"q": {"elbow_joint": 1.0}}, "`goal.q` leaves out joint 'shoulder_pan_joint'"),
        ({"wrist": 1.0}, "`goal.q` names joint 'wrist'"),
    ],
)
def test_a_wrong_table_is_refused(ur5: hovi.Robot, table: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError) as raised:
        as_end(table, ur5, "goal")
    assert sentence in str(raised.value)


def test_via_points_are_tables_or_objects(ur5: hovi.Robot) -> None:
    via = as_via({"time": "500 ms", "q": Q, "v": Q}, 0)
    assert (via.time, fields(via.goal, ur5)) == (0.5, fields(State(Q, Q), ur5))
    own = Via(0.5, State(Q))
    assert as_via(own, 0) is own
    frame = as_via({"time": 1, "frame": "tool0", "axis": AXIS}, 0)
    assert isinstance(frame.goal, FrameGoal)
    for wrong, sentence in (
        ({"q": Q}, "`via[3].time` is missing; it must be a positive number of seconds, or a text"),
        ({"time": 1.0, "q": Q, "a": Q}, "a via point takes no `a`: leave it out."),
        ({"time": 1.0}, "`via[3]` needs q, or a frame and its target."),
        (3, "via must be a list of hovi.Via(time, goal), or of tables"),
    ):
        with pytest.raises(InputError) as raised:
            as_via(wrong, 3)
        assert sentence in str(raised.value)
    error = EndError("a sentence.", "q")
    copy = pickle.loads(pickle.dumps(error))
    assert (str(copy), copy.key) == ("a sentence.", "q")


def test_options_are_the_same_in_python_and_in_a_file(tmp_path: Path) -> None:
    ball = {"kind": "sphere", "name": "ball", "position": [1.0, 1.0, 1.0], "radius": 0.1}
    given: dict[str, Any] = {
        "via": [{"time": "500 ms", "q": Q}],
        "obstacles": [ball],
        "scheme": {"name": "galerkin-3", "intervals": 9},
        "guess": "minimum-jerk",
        "time_limit": "2 min",
        "max_iterations": 77,
        "continuation": False,
    }
    read, options = loaded(tmp_path, **given).options, hovi.PlanOptions(**given)
    for each in (read, options):
        assert (each.scheme, each.intervals, each.guess) == ("galerkin-3", 9, "minimum-jerk")
        assert (each.time_limit_seconds, each.max_iterations, each.continuation) == (120, 77, False)
        assert each.obstacles == (hovi.Sphere([1.0, 1.0, 1.0], 0.1, name="ball"),)
        assert [via.time for via in each.via] == [0.5]
    again = load_task(hovi.save_task(loaded(tmp_path, **given), tmp_path / "again.toml")).options
    assert again.time_limit_seconds == 120
    assert (again.guess, again.max_iterations, again.continuation) == ("minimum-jerk", 77, False)


def test_a_scheme_may_be_named_alone_and_intervals_beside_it(tmp_path: Path) -> None:
    read = loaded(tmp_path, scheme="galerkin-3", intervals=9).options
    assert (read.scheme, read.intervals) == ("galerkin-3", 9)
    read = loaded(tmp_path, scheme={"name": "galerkin-3"}, intervals=9).options
    assert (read.scheme, read.intervals) == ("galerkin-3", 9)
    with pytest.raises(SceneError, match=r"line \d+: no scheme 'galrkin'|no scheme 'galrkin'"):
        loaded(tmp_path, scheme="galrkin")
    with pytest.raises(InputError, match=r"unknown key `scheme.interval`"):
        hovi.PlanOptions(scheme={"interval": 3})  # type: ignore[arg-type]


def test_effects_may_be_a_table(ur5: hovi.Robot) -> None:
    tables = {"gravity": {}, "payload": {"frame": "tool0", "mass": 2.0, "center": [0, 0, 0.1]}}
    scene = hovi.Scene(ur5, tables)  # type: ignore[arg-type]
    objects = [hovi.effects.Gravity(), hovi.effects.Payload("tool0", 2.0, (0, 0, 0.1))]
    tau = [each.inverse_dynamics([Q], [Q], [Q]) for each in (scene, hovi.Scene(ur5, objects))]
    assert np.array_equal(*tau)


def test_a_plan_takes_the_tables_of_its_file(two_link: hovi.Robot) -> None:
    scene = hovi.Scene(two_link, {"gravity": {"acceleration": 9.8}})  # type: ignore[arg-type]
    plain = hovi.plan(scene, [0.0, 0.0], [0.4, 0.3], 1.0, intervals=6)
    tables = {"q": {"elbow": 0.0, "shoulder": 0.0}}, {"shoulder": 0.4, "elbow": 0.3}
    assert hovi.plan(scene, *tables, "1 s", intervals=6).cost == plain.cost


def test_tables_of_obstacles_are_those_of_a_file(tmp_path: Path) -> None:
    for name, text in (("cupboard.urdf", CUPBOARD), ("kitchen.yaml", PLANNING_SCENE)):
        (tmp_path / name).write_text(text)
    (tmp_path / "channel.obj").write_text(channel())
    tables = [
        {"kind": "box", "size": [0.1, 0.1, 0.1], "position": [5.0, 0.0, 0.0]},
        {"kind": "file", "name": "a", "file": "cupboard.urdf", "joints": {"hinge": 0.7}},
        {"kind": "file", "name": "b", "file": "kitchen.yaml", "position": [0.0, 5.0, 0.0]},
    ]
    with pytest.warns(HoviWarning, match="convex hull"):
        read = loaded(tmp_path, obstacles=tables).options.obstacles
    here = [
        each | ({"file": str(tmp_path / str(each["file"]))} if "file" in each else {})
        for each in tables
    ]
    given = hovi.PlanOptions(obstacles=here).obstacles  # type: ignore[arg-type]
    assert [each.name for each in given] == [each.name for each in read]
    assert "a/door" in {each.name for each in given}
    assert given == read


def test_tables_of_grasped_objects_are_those_of_a_file(tmp_path: Path) -> None:
    box = {"kind": "box", "size": [0.1, 0.1, 0.2], "position": [0.0, 0.0, 0.0]}
    ball = {"kind": "sphere", "radius": 0.1, "position": [0.0, 0.0, 0.1]}
    for shape in (box, [box, ball]):
        table = {"name": "crate", "frame": "tool0", "mass": 2.0, "shape": shape, "rpy": [0, 0, 1.0]}
        read = loaded(tmp_path, grasped=[table]).options.grasped
        assert hovi.PlanOptions(grasped=[table]).grasped == read  # type: ignore[arg-type]
        assert (hovi.Grasped(**table),) == read  # type: ignore[arg-type]
    robot = hovi.load_robot("ur5")
    assert hovi.holding(robot, table).frame_names == hovi.holding(robot, read).frame_names


def test_tables_of_segments_are_those_of_a_file(tmp_path: Path) -> None:
    load = {"payload": {"frame": "tool0", "mass": 2.0}}
    tables: list[dict[str, Any]] = [
        {"name": "reach", "duration": "800 ms", "goal": {"frame": "tool0", "position": POSITION}},
        {"duration": 1.5, "goal": {"q": Q}, "effects": load, "limits": {"v": 1e-3}},
    ]
    text = {"robot": "ur5", "start": {"q": Q}, "segments": tables}
    path = tmp_path / "scene.toml"
    path.write_text(tomlkit.dumps(text))
    robot = hovi.load_robot("ur5")
    read = load_task(path).segments
    given = hovi.Task.of_segments(hovi.Scene(robot, []), State(Q), tables).segments
    for one, other in zip(read, given, strict=True):
        assert (one.name, one.duration) == (other.name, other.duration)
        assert (one.effects, one.limits) == (other.effects, other.limits)
        ends = [fields(as_end(each.goal, robot, "goal"), robot) for each in (one, other)]  # type: ignore[arg-type]
        assert ends[0] == ends[1]


def test_a_goal_of_inverse_kinematics_may_be_a_table(ur5: hovi.Robot) -> None:
    near = dict(zip(ur5.joint_names, Q, strict=True))
    table = {"frame": "tool0", "position": POSITION, "axis": AXIS}
    goal = FrameGoal("tool0", position=POSITION, axis=AXIS)
    assert fields(goal, ur5) == fields(as_end(table, ur5, "goal"), ur5)
    found = hovi.inverse_kinematics(ur5, table, near=near)
    assert np.array_equal(found, hovi.inverse_kinematics(ur5, goal, near=Q))
    for wrong in ({"q": Q}, {"frame": "tool0", "axis": {"frame": [0, 0, 1]}}, {"position": Q[:3]}):
        with pytest.raises(InputError):
            hovi.inverse_kinematics(ur5, wrong)
