"""Motions one after the other, compared with closed forms on either side of their gaps."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
import yaml

import hovi
from hovi.discrete.joined_motion import JoinedMotion, joined
from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviWarning, InputError
from hovi.viewing.csv_table import column_names
from oracles.programs import read_franka, read_urscript
from samples.cubic_motion import Cubic, cubic_motion

Array = npt.NDArray[np.float64]

ENDS = [[0.1, -1.5, 1.4, -0.3, 0.2, 0.0], [1.0, -0.7, 0.9, -1.3, 0.4, 2.5], [0.3] * 6]
LENGTHS, GAP = (0.7, 0.45), 0.25


def resting(robot: hovi.Robot, start: object, end: object, T: float) -> tuple[Trajectory, Cubic]:
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    cubic = Cubic.resting(np.array(start), np.array(end), T)
    return cubic_motion(scene, T, ["galerkin-2"] * 3, cubic=cubic)


@pytest.fixture(scope="module")
def parts(ur5: hovi.Robot) -> list[tuple[Trajectory, Cubic]]:
    pairs = zip(ENDS[:-1], ENDS[1:], LENGTHS, strict=True)
    return [resting(ur5, *each) for each in pairs]


def closed_form(parts: list[tuple[Trajectory, Cubic]], t: Array, gap: float) -> tuple[Array, ...]:
    """q, v and a of the parts with rests between them, one time after the other."""
    rows = []
    for each in t.tolist():
        for k, (_, cubic) in enumerate(parts):
            if each <= LENGTHS[k] or k == len(parts) - 1:
                rows.append([x[0] for x in cubic(min(each, LENGTHS[k]))])
                break
            each -= LENGTHS[k]
            if each < gap:
                rows.append([np.array(ENDS[k + 1]), np.zeros(6), np.zeros(6)])
                break
            each -= gap
    return tuple(np.array(x) for x in zip(*rows, strict=True))


@pytest.mark.parametrize("gap", [0.0, GAP])
def test_joined_motions_are_each_of_them_and_rest_between(
    parts: list[tuple[Trajectory, Cubic]], gap: float
) -> None:
    motion = JoinedMotion(tuple(each for each, _ in parts), gap)
    assert motion.duration == pytest.approx(sum(LENGTHS) + gap, abs=1e-15)
    t = np.linspace(0.0, motion.duration, 334)
    found = motion.sample(t)
    for x, wanted in zip(found, closed_form(parts, t, gap), strict=False):
        np.testing.assert_allclose(x, wanted, atol=1e-11)
    np.testing.assert_allclose(motion.positions(t), found.q, atol=0)
    assert found.q[-1].tolist() == pytest.approx(ENDS[-1])


def test_efforts_hold_the_robot_in_a_gap(
    parts: list[tuple[Trajectory, Cubic]], ur5: hovi.Robot
) -> None:
    motion = JoinedMotion(tuple(each for each, _ in parts), GAP)
    t = LENGTHS[0] + np.array([1e-9, 0.1, GAP - 1e-9])
    still = pin.computeGeneralizedGravity(ur5.model, ur5.model.createData(), np.array(ENDS[1]))
    np.testing.assert_allclose(motion.sample(t).tau, np.tile(still, (3, 1)), atol=1e-9)


def test_a_program_of_joined_motions_follows_each_of_them(
    parts: list[tuple[Trajectory, Cubic]], tmp_path: Path
) -> None:
    motions = [each for each, _ in parts]
    hovi.export(motions, tmp_path / "cycle.script", gap=GAP)
    program = read_urscript((tmp_path / "cycle.script").read_bytes())
    t = np.minimum(program.times, sum(LENGTHS) + GAP)
    np.testing.assert_allclose(program.targets, closed_form(parts, t, GAP)[0], atol=1e-9)
    marks = [(88, "0.7 s: rest"), (119, "0.95 s: motion 2")]
    assert program.marks == [(0, "0 s: motion 1"), *[(k - 1, text) for k, text in marks]]
    assert program.comments[0] == "ur5: 1.4 s, 2 motions, 0.25 s between, 175 steps of 0.008 s"


@pytest.mark.parametrize(
    ("name", "format"),
    [("m.csv", None), ("m.npz", None), ("m.yaml", None), ("m.yaml", "robot-trajectory")],
)
def test_joined_motions_are_written_in_formats_of_samples(
    name: str, format: str | None, parts: list[tuple[Trajectory, Cubic]], tmp_path: Path
) -> None:
    motions, path = [each for each, _ in parts], tmp_path / name
    hovi.export(motions, path, format, 100.0, gap=GAP)
    if path.suffix == ".csv":
        table = np.genfromtxt(path, delimiter=",", names=True)
        t = table["t"]
        q = np.column_stack([table[each] for each in column_names(motions[0])[1:7]])
    elif path.suffix == ".npz":
        with np.load(path) as archive:
            t, q = archive["t"], archive["positions"]
    else:
        read = yaml.safe_load(path.read_text())
        message = read["joint_trajectory"] if format else read
        stamps = [each["time_from_start"] for each in message["points"]]
        t = np.array([each["sec"] + 1e-9 * each["nanosec"] for each in stamps])
        q = np.array([each["positions"] for each in message["points"]])
    assert len(t) == 141
    np.testing.assert_allclose(q, closed_form(parts, t, GAP)[0], atol=1e-11)


def test_joined_motions_are_a_franka_table(panda: hovi.Robot, tmp_path: Path) -> None:
    a, b = [0.0, -0.8, 0.0, -2.3, 0.0, 1.5, 0.7], [0.4, -0.6, 0.2, -2.0, 0.1, 1.7, -0.7]
    (there, way), (back, home) = resting(panda, a, b, 0.5), resting(panda, b, a, 0.4)
    with pytest.warns(HoviWarning, match="acceleration"):
        hovi.export([there, back], tmp_path / "m.csv", "franka", gap=0.1)
    rows = read_franka((tmp_path / "m.csv").read_bytes())
    assert len(rows) == 1001
    np.testing.assert_allclose(rows[200], way(0.2)[0][0], atol=1e-12)
    np.testing.assert_allclose(rows[500:601], np.tile(b, (101, 1)), atol=1e-12)
    np.testing.assert_allclose(rows[700], home(0.1)[0][0], atol=1e-12)


def test_angles_go_on_where_a_motion_begins_with_other_full_turns() -> None:
    robot = hovi.load_robot("kinova")
    scene, T = hovi.Scene(robot), 0.5
    grid = hovi.Grid.uniform(T, 3, hovi.schemes.galerkin(0))

    def turning(start: float, end: float) -> Trajectory:
        first = np.eye(robot.nv)[0]
        x, v, a = Cubic.resting(start * first, end * first, T)(grid.t)
        h, jerk = T / 3, np.diff(a, axis=0) / (T / 3)
        z = np.stack([a[:-1] / 2 + jerk * h / 6, a[:-1] + jerk * h / 2], axis=1)
        q = robot.integrate(np.tile(robot.neutral(), (4, 1)), x)
        path = hovi.DiscretePath(q, v, z, np.zeros((3, 0, robot.nv)))
        return Trajectory(grid, path, np.zeros((4, 2, robot.nv)), scene)

    motion = joined([turning(0.0, 3.0), turning(3.0, 6.0), turning(6.0, 4.0)], gap=0.1)
    found = motion.positions(np.array([0.0, 0.5, 0.55, 0.6, 1.1, 1.2, 1.7]))[:, 0]
    np.testing.assert_allclose(found, [0.0, 3.0, 3.0, 3.0, 6.0, 6.0, 4.0], atol=1e-9)


def test_motions_that_do_not_follow_each_other_are_refused_with_the_gap(
    parts: list[tuple[Trajectory, Cubic]], ur5: hovi.Robot, panda: hovi.Robot, tmp_path: Path
) -> None:
    first, second = (each for each, _ in parts)
    with pytest.raises(
        InputError, match=r"motion 2 begins 2\.5 rad or m of 'wrist_3_joint' from where motion 1"
    ):
        joined([first, first])
    apart = ENDS[1] + 2e-6 * np.eye(6)[2]
    with pytest.raises(InputError, match=r"motion 3 begins 2e-06 rad or m of 'elbow_joint' from"):
        joined(
            [
                resting(ur5, apart, ENDS[1], 0.5)[0],
                resting(ur5, ENDS[1], apart, 0.5)[0],
                resting(ur5, ENDS[1], apart, 0.5)[0],
            ]
        )
    near = ENDS[1] + 0.9e-6 * np.eye(6)[2]
    joined([first, resting(ur5, near, ENDS[2], 0.5)[0]])
    half, _ = cubic_motion(hovi.Scene(ur5), 0.7, cubic=Cubic.resting(ENDS[0], ENDS[1], 1.4))
    rest = resting(ur5, half.q[-1], ENDS[1], 0.5)[0]
    with pytest.raises(InputError, match=r"motion 1 ends at .* of 'wrist_3_joint', and must be at"):
        joined([half, rest])
    with pytest.raises(InputError, match="motion 2 moves other joints than motion 1"):
        joined([first, resting(panda, [0.0] * 7, [0.1] * 7, 0.5)[0]])
    for gap in (-0.1, float("nan"), 1e9):
        with pytest.raises(InputError, match="the gap must be 0 to 3600 s"):
            joined([first, second], gap)
    with pytest.raises(InputError, match="the format 'mcap' holds one motion: export each by"):
        hovi.export([first, second], tmp_path / "m.mcap")
    assert not list(tmp_path.iterdir())


def test_a_motion_without_its_robot_has_no_torques_in_a_gap(
    parts: list[tuple[Trajectory, Cubic]], tmp_path: Path
) -> None:
    first, second = (each for each, _ in parts)
    assert first.scene is not None
    given = hovi.load_robot(first.scene.robot.model)
    bare = replace(first, scene=replace(first.scene, robot=given))
    bare.save(tmp_path / "bare.npz")
    loaded = Trajectory.load(tmp_path / "bare.npz")
    with pytest.raises(InputError, match="no torques that hold it in a gap: use a gap of 0"):
        joined([loaded, second], 0.1)
    assert joined([loaded, second]).sample([0.1]).tau.shape == (1, 6)


def test_the_cautions_of_all_motions_are_those_of_the_joined_one(
    parts: list[tuple[Trajectory, Cubic]], tmp_path: Path
) -> None:
    first, second = (each for each, _ in parts)
    bad = replace(second, metadata={"status": "infeasible"})
    with pytest.warns(HoviWarning, match="violates its ends, limits or distances"):
        hovi.export([first, bad], tmp_path / "m.yaml")
    assert "# status: This motion violates" in (tmp_path / "m.yaml").read_text()
