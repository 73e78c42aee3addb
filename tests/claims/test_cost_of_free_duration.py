"""The cost of a motion with a free duration is J + w T, wherever it is reported."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.effects import EffortWeight, Gravity

WEIGHT = 1e-4
PRICE = 1.0
NEARLY_LEAST = (0.1, 5.0)
A, B = np.array([0.0, -1.2, 1.0, -0.6, -0.8, 0.2]), np.array([0.4, -0.8, 1.4, -0.2, -0.4, 0.6])


@pytest.fixture(scope="module")
def scene() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [Gravity(), EffortWeight(WEIGHT)])


def planned(scene: hovi.Scene, start: np.ndarray, goal: np.ndarray, **options) -> hovi.Solution:
    return hovi.plan(
        scene, start, goal, NEARLY_LEAST, time_weight=PRICE, self_collision=False, **options
    )


@pytest.fixture(scope="module")
def motion(scene: hovi.Scene) -> hovi.Solution:
    found = planned(scene, A, B)
    assert found.success
    return found


def effort_by_pinocchio(robot: hovi.Robot, trajectory: hovi.Trajectory) -> float:
    """1/2 w int |tau|^2 by Gauss points in every interval, with torques of pin.rnea."""
    model = robot.model.copy()
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    model.armature[:] = 0.0
    data = model.createData()
    x, weights = np.polynomial.legendre.leggauss(8)
    total = 0.0
    for begin, end in zip(trajectory.t[:-1], trajectory.t[1:], strict=True):
        sample = trajectory.sample(begin + (end - begin) * (x + 1) / 2)
        tau = [pin.rnea(model, data, *each) for each in zip(*sample_of(sample), strict=True)]
        total += (end - begin) / 2 * weights @ np.square(tau).sum(axis=1)
    return 0.5 * WEIGHT * float(total)


def sample_of(sample) -> tuple[np.ndarray, ...]:
    return sample.q, sample.v, sample.a


@pytest.mark.parametrize("way", ["plan", "replan", "far replan", "advance", "other duration"])
def test_the_cost_is_effort_and_price_of_time(motion: hovi.Solution, way: str) -> None:
    found = {
        "plan": lambda: motion,
        "replan": lambda: motion.replan(goal=B + 1e-3),
        "far replan": lambda: motion.replan(goal=B + 0.05),
        "advance": lambda: motion.advance(0.05),
        "other duration": lambda: motion.advance(0.05, duration=0.6),
    }[way]()
    assert found.success
    T = found.trajectory.duration
    expected = effort_by_pinocchio(found.problem.robot, found.trajectory) + PRICE * T
    assert found.cost == pytest.approx(expected, rel=2e-3)
    assert f"of cost {found.cost:.10g}" in found.message
    assert found.minima == (found.cost,)


def test_a_saved_motion_has_the_same_cost(motion: hovi.Solution, tmp_path: Path) -> None:
    motion.trajectory.save(tmp_path / "m.npz")
    assert hovi.Trajectory.load(tmp_path / "m.npz").metadata["cost"] == motion.cost


def test_without_limits_the_cost_is_the_same_sum(scene: hovi.Scene) -> None:
    found = planned(scene, A, B, limits="none")
    again = found.replan(goal=B + 1e-4)
    assert found.success
    assert again.success
    assert again.cost == pytest.approx(found.cost, rel=1e-3)


@pytest.mark.parametrize("seed", [1, 3, 7, 20])
def test_near_least_time_the_error_is_one_of_the_whole_cost(scene: hovi.Scene, seed: int) -> None:
    """The estimate bounds the difference from a motion of a hundred times the accuracy."""
    start, goal = np.random.default_rng(seed).uniform(-1.5, 1.5, (2, 6))
    found = planned(scene, start, goal)
    assert found.success, found.message
    assert "J + w T" in found.message
    T = found.trajectory.duration
    again = {"tolerance": 1e-5, "guess": found.trajectory, "self_collision": False}
    better = hovi.plan(scene, start, goal, T, **again)
    assert better.success
    cost = better.cost + PRICE * T
    assert abs(found.cost - cost) <= found.error_estimate * cost
    assert found.trajectory.q[0] == pytest.approx(start, abs=0.0)
    assert found.trajectory.q[-1] == pytest.approx(goal, abs=0.0)


def test_a_motion_of_a_free_duration_is_the_curve_of_its_nodes() -> None:
    """q is continuous at the nodes: a search once took a guess of one duration for another."""
    robot = hovi.load_robot("panda")
    start, goal = np.random.default_rng(8).uniform(-1.5, 1.5, (2, robot.nq))
    lower, upper = robot.model.lowerPositionLimit, robot.model.upperPositionLimit
    room = 0.05 * (upper - lower)
    start, goal = (np.clip(q, lower + room, upper - room) for q in (start, goal))
    trajectory = planned(
        hovi.Scene(robot, [Gravity(), EffortWeight(WEIGHT)]), start, goal
    ).trajectory
    k = np.arange(trajectory.grid.intervals - 1)
    end = trajectory.sample_intervals(k, np.ones(len(k)))
    begin = trajectory.sample_intervals(k + 1, np.zeros(len(k)))
    assert np.abs(end.q - begin.q).max() < 1e-9
    assert np.abs(end.v - begin.v).max() < 1e-7


def test_a_braking_motion_has_the_price_of_its_time(motion: hovi.Solution) -> None:
    """Where no motion reaches a goal in the duration, one brakes from a start that is another."""
    found = motion.replan(start=hovi.State(A, [0.1, 0, 0, 0, 0, 0]), goal=B + 3.0)
    assert "brakes to rest" in found.message
    T = found.trajectory.duration
    expected = effort_by_pinocchio(found.problem.robot, found.trajectory) + PRICE * T
    assert found.cost == pytest.approx(expected, rel=5e-2)
