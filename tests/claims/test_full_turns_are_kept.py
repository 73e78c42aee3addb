"""Full turns of continuous joints are kept: from a measured start to what other programs read.

The oracle for an angle is the one at the start plus the integral of the velocity.
"""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.cli.application import main
from hovi.errors import HoviError, InputError, TrajectoryFileError

Array = npt.NDArray[np.float64]

TURN = 2 * np.pi
LINK = """<link name="{name}"><collision><origin xyz="0 0 0.15"/><geometry>
<box size="0.05 0.05 0.3"/></geometry></collision>
<inertial><mass value="{mass}"/><origin xyz="0.1 0 0.1"/>
<inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="0 0 0.3"/><axis xyz="{axis}"/>
<limit effort="80" velocity="12" lower="-3" upper="3"/></joint>"""


@pytest.fixture(scope="module")
def urdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A continuous joint, a hinge, and another continuous joint."""
    links = [LINK.format(name=f"l{i}", mass=1.0 - 0.3 * i) for i in range(3)]
    joints = [
        JOINT.format(name="wheel", kind="continuous", parent="base", child="l0", axis="0 0 1"),
        JOINT.format(name="arm", kind="revolute", parent="l0", child="l1", axis="0 1 0"),
        JOINT.format(name="drill", kind="continuous", parent="l1", child="l2", axis="0 0 1"),
    ]
    path = tmp_path_factory.mktemp("robots") / "driller.urdf"
    path.write_text(f'<robot name="driller"><link name="base"/>{"".join(links + joints)}</robot>')
    return path


@pytest.fixture(scope="module")
def scene(urdf: Path) -> hovi.Scene:
    return hovi.Scene(hovi.load_robot(urdf), [hovi.effects.Gravity()])


@pytest.fixture(scope="module")
def solution(scene: hovi.Scene) -> hovi.Solution:
    return hovi.plan(scene, [9.28, 0.2, -20.0], [9.9, 0.9, -0.7], 2.0)


def integrated(motion: hovi.Trajectory, t: Array, start: npt.ArrayLike) -> Array:
    """Angles at times: those of the start plus the integral of the velocity."""
    x, w = np.polynomial.legendre.leggauss(6)
    angles, last = [np.asarray(start, dtype=float)], 0.0
    for time in t[1:]:
        ends = np.linspace(last, time, 40)
        h = np.diff(ends)[:, None]
        inner = ends[:-1, None] + h * (x + 1) / 2
        v = motion.sample(inner.ravel()).v.reshape(*inner.shape, -1)
        angles.append(angles[-1] + np.einsum("ij,j,ijn->n", h / 2 * np.ones_like(inner), w, v))
        last = float(time)
    return np.array(angles)


def test_a_start_begins_at_its_angle(solution: hovi.Solution) -> None:
    assert solution.success, solution.message
    t = np.linspace(0.0, 2.0, 9)
    expected = integrated(solution.trajectory, t, [9.28, 0.2, -20.0])
    np.testing.assert_allclose(solution.trajectory.positions(t), expected, atol=1e-3)
    # to 9.9 as that says its turns, to -0.7 the shortest way
    np.testing.assert_allclose(expected[-1], [9.9, 0.9, -0.7 - 3 * TURN], atol=1e-3)


def test_a_start_by_name_or_as_cosine_and_sine_is_the_same_motion(
    scene: hovi.Scene, solution: hovi.Solution
) -> None:
    table = {"wheel": 9.28, "arm": 0.2, "drill": -20.0}
    for start in (table, hovi.State([9.28, 0.2, -20.0])):
        found = hovi.plan(scene, start, solution.trajectory.q[-1], 2.0)
        np.testing.assert_array_equal(found.trajectory.q, solution.trajectory.q)
        np.testing.assert_allclose(found.trajectory.positions(0.0)[0], [9.28, 0.2, -20.0])
    pairs = [np.cos(9.28), np.sin(9.28), 0.2, np.cos(20.0), -np.sin(20.0)]
    found = hovi.plan(scene, pairs, solution.trajectory.q[-1], 2.0)
    np.testing.assert_allclose(found.trajectory.q, solution.trajectory.q, atol=1e-9)
    np.testing.assert_allclose(
        found.trajectory.positions(0.0)[0], [9.28 - TURN, 0.2, -20.0 + 3 * TURN]
    )


@pytest.mark.parametrize(
    ("start", "goal", "end"),
    [
        (0.0, 9.28, 9.28),  # an angle beyond half a turn says its turns
        (9.28, -9.28, -9.28),
        (0.0, 4.0, 4.0),
        (9.28, 9.0, 9.0),
        (9.28, 0.5, 0.5 + TURN),  # another one is a direction: the shortest way
        (-3.0, 3.0, 3.0 - TURN),
        (100.0, 1.0, 1.0 + 16 * TURN),
    ],
)
def test_goals_are_reached_at_their_angle(
    scene: hovi.Scene, start: float, goal: float, end: float
) -> None:
    for starts in (1, 3):  # of which others try further turns of the drill, whose goal says none
        given = [start, 0.1, 0.0], [goal, 0.4, 0.3], 4.0
        found = hovi.plan(scene, *given, starts=starts, tolerance=1e-2)
        assert found.success, found.message
        reached = integrated(found.trajectory, np.array([0.0, 4.0]), [start, 0.1, 0.0])[-1]
        np.testing.assert_allclose(found.trajectory.positions(4.0)[0], reached, atol=1e-3)
        np.testing.assert_allclose(reached[:2], [end, 0.4], atol=1e-3)
        farther = abs(end - start) > np.pi
        assert ("beyond the shortest way, as its goal" in found.message) == farther
        assert np.cos(reached[2] - 0.3) == pytest.approx(1.0)


def test_a_guess_of_other_turns_is_turned_on(scene: hovi.Scene) -> None:
    near = hovi.plan(scene, [9.28, 0.1, 0.0], [9.0, 0.4, 0.3], 3.0).trajectory
    for goal in ([15.0, 0.4, 0.3], [9.1, 0.4, 7.0], [-4.0, 0.4, 0.3]):
        found = hovi.plan(scene, [9.28, 0.1, 0.0], goal, 3.0, guess=near)
        assert found.success, found.message
        np.testing.assert_allclose(found.trajectory.positions(3.0)[0], goal, atol=1e-9)
    smooth = {"smooth": True, "tolerance": 1e-2}
    near = hovi.plan(scene, [9.28, 0.1, 0.0], [9.0, 0.4, 0.3], 3.0, **smooth).trajectory
    found = hovi.plan(scene, [9.28, 0.1, 0.0], [15.0, 0.4, 0.3], 3.0, guess=near, **smooth)
    assert found.success, found.message


def test_a_floating_robot_keeps_them(urdf: Path) -> None:
    robot = hovi.load_robot(urdf, free_flyer=True)
    scene = hovi.Scene(robot, [hovi.effects.Armature(0.5)])
    base = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    start = {"root_joint": base, "wheel": 9.28, "arm": 0.1, "drill": -20.0}
    goal = {"root_joint": base, "wheel": 15.0, "arm": 0.3, "drill": -19.0}
    found = hovi.plan(scene, start, goal, 3.0, limits="none")
    assert found.success, found.message
    rest = found.advance(1.0)
    for motion in (found.trajectory, rest.trajectory):
        end = motion.positions(motion.duration)[0]
        np.testing.assert_allclose(end[6:], [15.0, 0.3, -19.0], atol=1e-9)
    np.testing.assert_allclose(found.trajectory.positions(0.0)[0, 6:], [9.28, 0.1, -20.0])
    np.testing.assert_allclose(rest.trajectory.positions(0.0), found.trajectory.positions(1.0))


def test_turns_of_a_goal_unwind(scene: hovi.Scene) -> None:
    home = hovi.State([0.0, 0.0, 0.0], turns={"wheel": -1})
    found = hovi.plan(scene, [9.28 - 1.0, 0.1, 0.0], home, 4.0)
    assert found.success
    np.testing.assert_allclose(found.trajectory.positions(4.0)[0], 0.0, atol=1e-9)


def test_angles_of_free_joints_are_guesses(scene: hovi.Scene) -> None:
    start, goal = [9.28, 0.1, 0.0], [15.0, 0.4, 0.3]
    for ends in (
        (start, hovi.State(goal, free=("wheel",))),
        (hovi.State(start, free=("wheel",)), goal),
        (hovi.State([9.4, 0.1, 0.0], free=("wheel",)), hovi.State([9.5, 0.4, 0.3])),
    ):
        found = hovi.plan(scene, *ends, 3.0)
        assert found.success, found.message
        assert abs(found.trajectory.positions(0.0)[0, 0] - 9.28) < np.pi
    assert found.trajectory.positions(3.0)[0, 0] == pytest.approx(9.5)


@pytest.mark.parametrize("turns", [-3, -1, 1, 2])
def test_half_turns_are_no_edge(scene: hovi.Scene, tmp_path: Path, turns: int) -> None:
    for near in (0.0, 1e-16, -1e-16, 1e-9, -1e-9):
        start = [np.pi + TURN * turns + near, 0.1, -np.pi]
        found = hovi.plan(scene, start, [start[0] + 0.5, 0.4, -np.pi], 2.0, tolerance=1e-2)
        assert found.success, found.message
        found.trajectory.save(tmp_path / "motion.npz")
        for motion in (found.trajectory, hovi.Trajectory.load(tmp_path / "motion.npz")):
            np.testing.assert_allclose(motion.positions(0.0)[0], start, atol=1e-8)
            np.testing.assert_allclose(motion.positions(2.0)[0, 0], start[0] + 0.5, atol=1e-8)
        rest = found.advance(0.0)
        np.testing.assert_allclose(rest.trajectory.positions(0.0)[0], start, atol=1e-8)


@pytest.mark.parametrize("goal", [10.3, 7.0 + TURN])
def test_a_path_around_an_obstacle_ends_at_the_angle(scene: hovi.Scene, goal: float) -> None:
    pytest.importorskip("ompl")
    post = hovi.Box((0.06, 0.06, 1.2), position=(0.0, 0.4, 0.6))
    ends = [7.0, 1.6, 0.0], [goal, 1.6, 0.0]
    found = hovi.plan(scene, *ends, 4.0, obstacles=[post], margin=0.01)
    assert found.success, found.message
    assert "by OMPL" in found.message
    np.testing.assert_allclose(found.trajectory.positions([0.0, 4.0]), ends, atol=1e-6)


def test_whatever_is_exported_begins_there_and_does_not_jump(
    solution: hovi.Solution, tmp_path: Path
) -> None:
    t = np.append(np.arange(200) / 100, 2.0)
    expected = integrated(solution.trajectory, t[::20], [9.28, 0.2, -20.0])
    for name, read in READERS.items():
        path = tmp_path / f"motion.{name}"
        hovi.export(solution, path, rate=100.0)
        found = read(path)
        assert len(found) == 201, name
        np.testing.assert_allclose(found[::20], expected, atol=1e-3, err_msg=name)


def _from_csv(path: Path) -> Array:
    rows = list(csv.DictReader(path.read_text().splitlines()))
    return np.array([[float(row[key]) for key in COLUMNS] for row in rows])


def _from_json(path: Path) -> Array:
    return np.array([each["positions"] for each in json.loads(path.read_text())["points"]])


def _from_xml(path: Path) -> Array:
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(path))
    return np.array(model.key_qpos)


def _from_parquet(path: Path) -> Array:
    table = pytest.importorskip("pyarrow.parquet").read_table(path)
    return np.array([table[key].to_numpy() for key in COLUMNS]).T


COLUMNS = "angle_wheel", "q_arm", "angle_drill"
READERS: dict[str, Any] = {
    "csv": _from_csv,
    "json": _from_json,
    "xml": _from_xml,
    "parquet": _from_parquet,
    "npz": lambda path: np.load(path)["positions"],
}


def test_coarse_samples_of_a_fast_joint_count_every_turn(scene: hovi.Scene, tmp_path: Path) -> None:
    found = hovi.plan(scene, [0.0, 0.0, 0.0], [0.0, 0.0, 29.3], 4.0)
    assert found.success, found.message
    found.trajectory.to_joint_trajectory(tmp_path / "coarse.json", rate=0.5)
    positions = _from_json(tmp_path / "coarse.json")
    expected = integrated(found.trajectory, np.linspace(0.0, 4.0, 3), [0.0, 0.0, 0.0])
    np.testing.assert_allclose(positions, expected, atol=1e-3)
    assert abs(np.diff(positions[:, 2])).max() > 2 * TURN
    rough = hovi.plan(scene, [0.0, 0.0, 0.0], [0.0, 0.0, 29.3], 4.0, intervals=3).trajectory
    t = np.linspace(0.0, 4.0, 25)  # in intervals of more than a turn each
    expected = integrated(rough, t, [0.0, 0.0, 0.0])
    np.testing.assert_allclose(rough.positions(t), expected, atol=1e-2)


def test_a_file_keeps_them_and_one_without_has_none(
    solution: hovi.Solution, scene: hovi.Scene, tmp_path: Path
) -> None:
    solution.trajectory.save(tmp_path / "motion.npz")
    loaded = hovi.Trajectory.load(tmp_path / "motion.npz")
    np.testing.assert_array_equal(loaded.positions(1.0), solution.trajectory.positions(1.0))
    plain = hovi.plan(scene, [0.3, 0.2, 0.1], [0.4, 0.3, 0.2], 2.0).trajectory
    plain.save(tmp_path / "plain.npz")
    header = json.loads(np.load(tmp_path / "plain.npz")["header"].tobytes())
    assert "turns" not in header  # the same bytes as before
    np.testing.assert_allclose(
        hovi.Trajectory.load(tmp_path / "plain.npz").positions(0.0)[0, 0], 0.3
    )


@pytest.mark.parametrize(
    "turns", [{"arm": 1}, {"nobody": 1}, {"wheel": 0.5}, {"wheel": True}, {"wheel": 10**30}, [1], 3]
)
def test_turns_that_make_no_sense_are_refused(
    solution: hovi.Solution, tmp_path: Path, turns: Any
) -> None:
    solution.trajectory.save(tmp_path / "motion.npz")
    with np.load(tmp_path / "motion.npz") as file:
        arrays = dict(file)
    header = json.loads(arrays["header"].tobytes()) | {"turns": turns}
    header.pop("sha256")
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    np.savez(tmp_path / "motion.npz", **arrays)
    with pytest.raises(TrajectoryFileError, match="is inconsistent"):
        hovi.Trajectory.load(tmp_path / "motion.npz")


def test_replan_and_advance_go_on_from_them(solution: hovi.Solution) -> None:
    motion = solution.trajectory
    q, v, *_ = motion.jet(0.5)
    passed = motion.positions(0.5)[0]
    for start in (None, hovi.State(passed, v[0]), hovi.State(q[0], v[0])):
        rest = solution.advance(0.5, start)
        assert rest.success, rest.message
        np.testing.assert_allclose(rest.trajectory.positions(0.0)[0], passed, atol=1e-9)
        end = rest.trajectory.positions(rest.trajectory.duration)[0]
        np.testing.assert_allclose(end, motion.positions(2.0)[0], atol=1e-9)
    again = solution.replan(start=[9.3, 0.2, -20.1])
    assert again.success
    np.testing.assert_allclose(again.trajectory.positions(0.0)[0], [9.3, 0.2, -20.1])
    np.testing.assert_allclose(solution.replan().trajectory.positions(0.0), motion.positions(0.0))


@pytest.mark.parametrize(
    ("start", "goal"),
    [
        ([9.28 - TURN, 0.2, -20.0], None),
        ([9.5, 0.5, -3.0], None),
        (None, [15.0, 0.9, -0.7]),
        (None, [-3.5, 0.9, -13.0]),
    ],
)
def test_replan_turns_as_far_as_angles_say(
    solution: hovi.Solution, start: list[float] | None, goal: list[float] | None
) -> None:
    """-0.7 rad says no turns: the joint ends there or a turn off, as the last motion goes."""
    again = solution.replan(start, goal)
    assert again.success, again.message
    begun, ended = again.trajectory.positions([0.0, 2.0])
    np.testing.assert_allclose(begun, start or [9.28, 0.2, -20.0], atol=1e-9)
    wanted = goal or [9.9, 0.9, -0.7]
    np.testing.assert_allclose(ended[0], wanted[0], atol=1e-9)
    if goal is not None and abs(goal[2]) > np.pi:
        np.testing.assert_allclose(ended[2], goal[2], atol=1e-9)
    t = np.linspace(0.0, 2.0, 9)
    expected = integrated(again.trajectory, t, begun)
    np.testing.assert_allclose(again.trajectory.positions(t), expected, atol=1e-3)


def test_a_measured_start_that_was_wrapped_is_no_reason_for_a_turn(
    solution: hovi.Solution,
) -> None:
    passed = solution.trajectory.positions(0.5)[0] - [TURN, 0.0, 0.0]
    rest = solution.advance(0.5, hovi.State(passed, solution.trajectory.jet(0.5)[1][0]))
    assert not rest.success
    assert "ends a full turn from the goal of 'wheel', 9.9 rad" in rest.message


def test_simulations_and_replays_of_plans_begin_there(
    scene: hovi.Scene, solution: hovi.Solution
) -> None:
    start = hovi.State([9.28, 0.2, -20.0], [3.0, 0.0, -8.0])
    simulated = hovi.simulate(scene, start, 2.0, intervals=200).trajectory
    t = np.linspace(0.0, 2.0, 5)
    np.testing.assert_allclose(
        simulated.positions(t), integrated(simulated, t, [9.28, 0.2, -20.0]), atol=1e-3
    )
    played = hovi.play(scene, solution.trajectory, "none", intervals=100).simulation.trajectory
    np.testing.assert_allclose(played.positions(t), solution.trajectory.positions(t), atol=0.05)


def test_a_group_keeps_those_of_all_joints(urdf: Path) -> None:
    srdf = urdf.with_name("driller.srdf")
    srdf.write_text(
        '<robot name="driller"><group name="base"><joint name="wheel"/></group></robot>'
    )
    robot = hovi.load_robot(urdf, srdf=srdf)
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    start = {"wheel": 9.28, "arm": 0.2, "drill": -20.0}
    found = hovi.plan(scene, start, start | {"wheel": 9.9}, 2.0, group="base")
    assert found.success, found.message
    np.testing.assert_allclose(found.trajectory.positions([0.0, 2.0]), [[9.28], [9.9]])
    held = found.trajectory.robot
    assert held is not None
    assert held.source.held["drill"] == pytest.approx(-20.0)


def test_scene_files_and_the_command_line_keep_them(
    urdf: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene, motion = urdf.with_name("drill.toml"), tmp_path / "motion.npz"
    scene.write_text(
        'robot = "driller.urdf"\nstart = [9.28, 0.2, -20.0]\nduration = 4.0\n'
        "goal = { wheel = 15.0, arm = 0.9, drill = -19.0 }\n[effects.gravity]\n"
    )
    assert main(["plan", str(scene), "--out", str(motion)]) == 0
    out = tmp_path / "motion.json"
    given = ["export", str(motion), "--format", "joint-trajectory", "--out", str(out)]
    assert main(given) == 0
    positions = _from_json(out)
    np.testing.assert_allclose(positions[[0, -1]], [[9.28, 0.2, -20.0], [15.0, 0.9, -19.0]])
    task = hovi.load_task(scene)
    hovi.save_task(task, scene.with_name("again.toml"))
    again = hovi.load_task(scene.with_name("again.toml"))
    for one, other in ((task.start, again.start), (task.goal, again.goal)):
        assert isinstance(one, hovi.State)
        assert isinstance(other, hovi.State)
        np.testing.assert_array_equal(
            one.angles_on(task.scene.robot), other.angles_on(task.scene.robot)
        )
    capsys.readouterr()
    assert main(["simulate", str(scene), "--duration", "0.1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["positions"][0] == pytest.approx(9.28, abs=0.1)
    assert main(["info", str(scene)]) == 0
    assert "start angle of drill = -20 rad" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("q", "said"),
    [
        ([9.28, 0.2], "one number"),
        ([np.nan, 0.2, 0.0], "nan"),
        ([1e300, 0.2, 0.0], "up to 1e"),
        ([[9.28], 0.2, 0.0], "numbers"),
        ({"wheel": np.inf, "arm": 0.0, "drill": 0.0}, "inf"),
        ({"wheel": "9.28", "arm": 0.0, "drill": 0.0}, "'9.28'"),
    ],
)
def test_what_is_no_angle_is_refused_in_one_sentence(scene: hovi.Scene, q: Any, said: str) -> None:
    with pytest.raises(HoviError, match=said) as refused:
        hovi.plan(scene, q, [0.1, 0.2, 0.3], 2.0)
    assert isinstance(refused.value, InputError)
    assert "\n" not in str(refused.value)


def test_turns_are_given_once(scene: hovi.Scene) -> None:
    goal = hovi.State([9.28, 0.2, 0.0], turns={"wheel": 1})
    with pytest.raises(InputError, match=r"'wheel', 9\.28 rad, says its full turns"):
        hovi.plan(scene, [0.0, 0.2, 0.0], goal, 2.0)


def test_degrees_of_continuous_joints_are_noticed(scene: hovi.Scene) -> None:
    with pytest.warns(UserWarning, match="wheel is 90 rad in a given configuration, which looks"):
        hovi.plan(scene, [0.0, 0.2, 0.0], [90.0, 0.3, 0.0], 30.0, limits="none", intervals=40)


@pytest.mark.parametrize(
    ("limits", "needed"),
    [
        ({"base": "none", "v": 4.0}, 8.4 / 4.0),
        ({"base": "none", "a": 9.0}, 2 * np.sqrt(8.4 / 9.0)),
        ({"base": "none", "v": 4.0, "a": 9.0}, 8.4 / 4.0 + 4.0 / 9.0),
    ],
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_too_little_time_for_full_turns_is_said_before_the_solve(
    scene: hovi.Scene, limits: dict[str, Any], needed: float, side: float
) -> None:
    """Rest to rest by 8.4 rad, of which the shortest way would be 2.1."""
    ends = [0.0, 0.2, 4.2 * side], [0.0, 0.2, -4.2 * side]
    short = hovi.plan(scene, *ends, 0.97 * needed, limits=limits)
    assert short.status == "infeasible"
    said = re.search(r"'drill' has to move by 8\.4 rad, which takes ([\d.]+) s", short.message)
    assert said, short.message
    assert float(said[1]) == pytest.approx(needed, rel=5e-3)
    enough = hovi.plan(scene, *ends, 1.05 * needed, limits=limits)
    assert enough.success, enough.message
    # a direction is reached the shortest way, by 2.1 rad, and no turns are missing
    direction = [0.0, 0.2, -4.2 * side + side * TURN]
    assert hovi.plan(scene, ends[0], direction, 0.97 * needed, limits=limits).success
