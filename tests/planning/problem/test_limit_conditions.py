"""Extremes of a motion between its quadrature points, against dense sampling."""

from __future__ import annotations

import re

import numpy as np
import pytest

from hovi import plan
from hovi.conditions.excess import excess_along, excess_of, worst
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.path_on_grid import path_on_grid
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.limit_conditions import (
    closeness,
    closeness_by_interval,
    limit_conditions,
)
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from samples.cubic_motion import cubic_motion


@pytest.fixture(scope="module")
def motion(arm_scene: Scene) -> Trajectory:
    """A coarse reach of the arm, without limits."""
    ends = [-np.pi / 2, 0.0], [0.3, 0.7]
    return plan(arm_scene, *ends, 1.0, intervals=5, limits="none").trajectory


def worst_sentence(motion: Trajectory, limits: Limits, robot: Robot) -> str:
    return max(worst(motion, each) for each in limit_conditions(limits, 2, None, robot))[1]


LIMITS = {"base": "none", "q": 1.5, "v": [2.0, 4.0], "a": 20.0, "tau": [8.0, 3.0]}


def test_extremes_are_those_of_dense_sampling(motion: Trajectory, two_link: Robot) -> None:
    limits = as_limits(two_link, LIMITS)
    excess = -closeness_by_interval(motion, limits)
    s = np.linspace(0.0, 1.0, 20_001)
    for k in range(motion.grid.intervals):
        outputs = np.stack(motion.sample_intervals(np.full(len(s), k), s), axis=1)
        dense = limits.excess(outputs).max(axis=0)
        found = excess[k]
        near = dense > -0.05
        assert near.any()
        np.testing.assert_allclose(found[near], dense[near], atol=1e-7)
        assert (found <= dense + 1e-7).all()


def test_closeness_is_the_smallest_distance_from_the_bounds(
    motion: Trajectory, two_link: Robot
) -> None:
    limits = as_limits(two_link, LIMITS)
    room = closeness(motion, limits)
    assert room.shape == (4, 2)
    every = [float(excess_along(motion, each).max()) for each in limit_conditions(limits, 2, None)]
    assert room.min() == -max(every)
    assert np.isinf(closeness(motion, as_limits(two_link, {"base": "none", "q": 1.5}))[1:]).all()


def test_the_worst_is_named_with_joint_time_and_numbers(
    motion: Trajectory, two_link: Robot
) -> None:
    limits = as_limits(two_link, {"base": "none", "tau": [100.0, 0.5]})
    sentence = worst_sentence(motion, limits, two_link)
    for word in ("torque", "'elbow'", "N m", "at t =", "0.5"):
        assert word in sentence


@pytest.mark.parametrize(("kind", "unit"), [("q", "rad"), ("v", "rad/s"), ("tau", "N m")])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_sentence_has_the_time_and_the_value_of_dense_sampling(
    motion: Trajectory, two_link: Robot, kind: str, unit: str, sign: float
) -> None:
    """The bound is met by the elbow at most of the motion and exceeded once, on one side."""
    t = np.linspace(0.0, motion.duration, 100_001)
    values = sign * getattr(motion.sample(t), kind)[:, 1]
    bound = float(values.max()) - 0.05 * float(np.ptp(values))
    sides = [-6.0, 6.0] if kind == "q" else [-100.0, 100.0]
    sides[int(sign > 0)] = sign * bound
    limits = as_limits(two_link, {"base": "none", kind: {"elbow": sides}})
    said = re.search(
        rf"joint 'elbow' reaches (\S+) {unit} at t = (\S+) s, its limit is (\S+)$",
        worst_sentence(motion, limits, two_link),
    )
    assert said is not None
    assert float(said[1]) == pytest.approx(sign * values.max(), rel=1e-3)
    assert float(said[2]) == pytest.approx(t[np.argmax(values)], abs=2e-3)
    assert float(said[3]) == pytest.approx(sign * bound, rel=1e-3)


def test_an_excess_between_samples_is_named_and_not_a_start_at_its_bound(
    arm_scene: Scene, two_link: Robot
) -> None:
    """Of the samples, the start is the worst one: exactly at its bound, which it leaves inwards."""
    motion, t = cubic_motion(arm_scene, seed=23)[0], np.linspace(0.0, 2.0, 100_001)
    dense = motion.sample(t)
    assert np.argmax(dense.q[:, 0]) == 0
    peak = int(np.argmax(dense.v[:, 1]))
    assert 0 < peak < len(t) - 1
    upper = {"shoulder": [-10.0, float(motion.q[0, 0])]}
    bound = float(dense.v[peak, 1]) - 1e-6
    limits = as_limits(two_link, {"base": "none", "q": upper, "v": {"elbow": [-10.0, bound]}})
    sentence = worst_sentence(motion, limits, two_link)
    at = f" rad/s at t = {t[peak]:.3g} s, its limit is {bound:.6g}"
    assert f"velocity of joint 'elbow' reaches {bound + 1e-6:.6g}{at}" in sentence


def test_sliding_joints_are_measured_in_metres(panda: Robot) -> None:
    hand = load_robot("panda")  # with its two sliding fingers
    assert hand.coordinate_units[8].v == "m/s"
    assert hand.coordinate_units[8].tau == "N"
    assert panda.coordinate_units[0].tau == "N m"


@pytest.mark.parametrize("tilt", [-2e-4, 2e-4])
def test_the_highest_of_several_extremes_along_a_bound_is_found(
    arm_scene: Scene, two_link: Robot, tilt: float
) -> None:
    """v = 0.9 + 0.1 T_9 + tilt: extremes of nearly one height, the highest between samples."""
    T9 = np.polynomial.Chebyshev.basis(9, domain=[0, 1])
    v = 0.9 + 0.1 * T9 + tilt * np.polynomial.Chebyshev.basis(1, domain=[0, 1])
    _require_the_highest(v, arm_scene, two_link)


def test_an_extreme_next_to_no_extreme_of_the_samples_is_found(
    arm_scene: Scene, two_link: Robot
) -> None:
    """Of samples every 1/32 those at 15/16, 31/32 and 1 ascend, and the peak is before 31/32."""
    x = np.polynomial.Polynomial([0.0, 1.0])
    v = 1.0 + 5e-6 - 100.0 * (x - 0.955) ** 2 * ((x - 1.0) ** 2 + 4e-5)
    samples = v(np.array([15, 30, 31, 32]) / [16, 32, 32, 32])
    assert samples[1] < samples[2] < samples[3] < 1.0 < v(0.955)
    _require_the_highest(v, arm_scene, two_link)


def _require_the_highest(
    v: np.polynomial.Chebyshev | np.polynomial.Polynomial, scene: Scene, robot: Robot
) -> None:
    """The excess of a motion with this velocity in one interval is that of dense sampling."""
    q, a = v.integ(), v.deriv()

    def curve(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return tuple(np.stack([f(t), 0 * t], axis=1) for f in (q, v, a))  # type: ignore[return-value]

    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, 1, galerkin(9)))
    problem = TrajectoryProblem(ld, State([q(0.0), 0.0]), State([q(1.0), 0.0]))
    ends = curve(np.array([0.0, 1.0]))
    motion = problem.trajectory(path_on_grid(curve, ld.grid, ends[:2], robot))
    s = np.linspace(0.0, 1.0, 100_001)
    np.testing.assert_allclose(motion.sample(s).v[:, 0], v(s), atol=1e-10)
    limits = as_limits(robot, {"base": "none", "v": [1.0, 1.0]})
    (velocity,) = limit_conditions(limits, 2, None)
    upper = excess_along(motion, velocity)[1]
    assert 2 * upper[0, 0] == pytest.approx(v(s).max() - 1.0, abs=1e-8)


def test_extremes_next_to_the_ends_of_a_polynomial_of_high_degree_are_found(
    arm_scene: Scene, two_link: Robot
) -> None:
    """Near the ends it oscillates faster than samples at equal distances tell."""
    T = np.polynomial.Chebyshev.basis(11, domain=[0, 1])
    at = (1 + np.cos(np.pi * 2 / 11)) / 2  # the third extreme from the end, where T = 1
    for tilt in np.linspace(-0.004, 0.004, 9):
        line = tilt * np.polynomial.Chebyshev([-(2 * at - 1), 1.0], domain=[0, 1])
        _require_the_highest(0.95 + 0.05 * T + 4e-5 + line, arm_scene, two_link)


@pytest.mark.parametrize("tau", [0.6, 0.95, 0.999, 1.1])
def test_a_first_look_finds_the_same_excess_where_a_bound_may_be_exceeded(
    motion: Trajectory, two_link: Robot, tau: float
) -> None:
    peak = np.abs(motion.sample(np.linspace(0.0, motion.duration, 5001)).tau).max(axis=0)
    limits = as_limits(two_link, LIMITS | {"tau": (tau * peak).tolist()})
    torques = limit_conditions(limits, 2, None)[-1]
    some, every = excess_of(motion, torques), excess_along(motion, torques)
    near = every > -0.02
    np.testing.assert_array_equal(some[near], every[near])
    assert (some <= every).all()
    assert (some[~near] <= -0.02).all()
    assert (some.max() > 0.0) == (tau < 1.0)
