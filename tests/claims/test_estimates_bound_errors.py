"""Estimated errors are at least the true ones, and not far above: of costs, joints and tips.

True errors are distances from the same motion planned to a tolerance of 1e-9, or of 1e-6 and
tighter bounds within limits. Half an estimate, or one without its factor, is less than many errors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi

Array = npt.NDArray[np.float64]
SAMPLES = 2001
LEAST = 2e-9
"""Relative error of a cost from which it is told from rounding and from the reference's own."""


@dataclass(frozen=True)
class Judged:
    """What a plan claims of its errors, over what they are.

    cost: of the relative error. angle: of any joint. tip: of the robot's tip.
    """

    cost: float
    angle: float
    tip: float


def judged(
    solution: hovi.Solution, reference: hovi.Solution, errors: hovi.MotionError | None
) -> Judged:
    assert solution.success, solution.message
    assert reference.success, reference.message
    assert solution.error_estimate is not None
    true = abs(solution.cost / reference.cost - 1.0)
    one, other = positions(solution), positions(reference)
    cost = solution.error_estimate / true if true > LEAST else np.inf
    if errors is None:
        return Judged(cost, np.inf, np.inf)
    angle = np.abs(one - other).max()
    robot = solution.trajectory.robot
    assert robot is not None
    tips = np.linalg.norm(tip_path(robot, one) - tip_path(robot, other), axis=1).max()
    return Judged(cost, errors.angle / angle, errors.largest_tip / tips)


def positions(solution: hovi.Solution) -> Array:
    t = np.linspace(0.0, solution.trajectory.duration, SAMPLES)
    return solution.trajectory.sample(t).q


def tip_path(robot: hovi.Robot, q: Array) -> Array:
    """The tip along configurations (M, nq), shape (M, 3), by Pinocchio alone."""
    model, data = robot.model, robot.model.createData()
    frame, points = model.getFrameId(robot.tip_frame), []
    for each in q:
        pin.framesForwardKinematics(model, data, each)
        points.append(data.oMf[frame].translation.copy())
    return np.array(points)


# Within limits


@pytest.fixture(scope="module")
def limited(ur5: hovi.Robot) -> list[Judged]:
    """Reaches of a UR5 that take little longer than its velocity limits allow."""
    scene, rng, found = hovi.Scene(ur5, [hovi.effects.Gravity()]), np.random.default_rng(0), []
    for _ in range(6):
        ends = [
            np.clip(x, ur5.lower + 0.1, ur5.upper - 0.1) for x in rng.uniform(-1.5, 1.5, (2, 6))
        ]
        T = 1.15 * np.max(1.5 * np.abs(ends[1] - ends[0]) / ur5.velocity_limit) + 0.3
        for tolerance in (1e-2, 1e-3):
            solution = hovi.plan(scene, *ends, T, tolerance=tolerance, self_collision=False)
            tight: dict[str, Any] = {"base": "urdf", "tolerance": 1e-8}
            options = {"limits": tight, "tolerance": 1e-6, "guess": solution.trajectory}
            reference = hovi.plan(scene, *ends, T, self_collision=False, **options)
            assert solution.accuracy is not None
            found.append(judged(solution, reference, solution.accuracy.estimate))
    return found


def test_costs_within_limits_are_as_near_as_estimated(limited: list[Judged]) -> None:
    ratios = np.array([each.cost for each in limited])
    assert ratios.min() >= 1.0
    assert np.median(ratios) <= 5.0


@pytest.mark.parametrize("what", ["angle", "tip"])
def test_joints_and_tips_within_limits_are_as_near_as_estimated(
    limited: list[Judged], what: str
) -> None:
    ratios = np.array([getattr(each, what) for each in limited])
    assert np.mean(ratios >= 1.0) >= 0.8
    assert ratios.min() >= 0.5
    assert np.median(ratios) <= 8.0


# Without limits


def sharp(solution: hovi.Solution, reference: hovi.Solution) -> Judged:
    """By the errors that `estimate_error` finds, for a grid that is given."""
    return judged(solution, reference, hovi.estimate_error(solution))


@pytest.fixture(scope="module")
def free(ur5: hovi.Robot) -> list[Judged]:
    """Reaches of a UR5 without limits on coarse grids of several schemes."""
    scene, rng, found = hovi.Scene(ur5, [hovi.effects.Gravity()]), np.random.default_rng(1), []
    options: dict[str, Any] = {"limits": "none", "self_collision": False}
    for scheme, intervals in (("galerkin-1", 20), ("galerkin-2", 12), ("galerkin-3", 10)) * 2:
        ends = rng.uniform(-0.8, 0.8, (2, 6))
        solution = hovi.plan(scene, *ends, 1.0, scheme=scheme, intervals=intervals, **options)
        guess = {"guess": solution.trajectory, "tolerance": 1e-9}
        found.append(sharp(solution, hovi.plan(scene, *ends, 1.0, **guess, **options)))
    return found


def test_estimates_without_limits_are_the_errors(free: list[Judged]) -> None:
    for what in ("cost", "angle", "tip"):
        ratios = np.array([getattr(each, what) for each in free])
        assert ratios.min() >= 0.9, what
        assert np.median(ratios) <= 3.5, what


@pytest.mark.parametrize("limits", ["none", {"base": "none", "v": [1.6, 2.0]}])
def test_the_estimate_of_a_sequence_is_the_error_of_its_cost(
    arm_scene: hovi.Scene, limits: Any
) -> None:
    """Of two segments whose goals are given, so that each could be planned alone."""
    parts = [{"goal": [0.9, -0.4], "duration": 0.8}, {"goal": [-0.5, 0.6], "duration": 1.2}]
    options: dict[str, Any] = {"limits": limits, "self_collision": False}

    def planned(**more: Any) -> hovi.Solution:
        return hovi.plan_sequence(arm_scene, [0.0, 0.0], parts, **options, **more)

    coarse = planned(scheme="galerkin-1", intervals=10)
    if limits != "none":
        options["limits"] = {**limits, "tolerance": 1e-8}
    fine = planned(scheme="galerkin-6", intervals=40, guess=coarse.trajectory)
    found = sharp(coarse, fine)
    assert 0.9 <= found.cost <= 5.0


@pytest.mark.parametrize("limits", ["none", {"base": "none", "v": [2.2, 2.6]}])
@pytest.mark.parametrize("move", [0.02, 0.3])
def test_the_estimate_of_a_replanned_motion_is_at_least_its_error(
    arm_scene: hovi.Scene, limits: Any, move: float
) -> None:
    options: dict[str, Any] = {"limits": limits, "self_collision": False}
    grid = {"scheme": "galerkin-1", "intervals": 8}
    solution = hovi.plan(arm_scene, [-0.8, 0.2], [0.7, 0.5], 1.0, **grid, **options)
    goal = [0.7 - move, 0.5 + move]
    again = solution.replan(goal=goal)
    if limits != "none":
        options["limits"] = {**limits, "tolerance": 1e-8}
    grid = {"scheme": "galerkin-6", "intervals": 32}
    guess = {"guess": again.trajectory}
    fine = hovi.plan(arm_scene, [-0.8, 0.2], goal, 1.0, **grid, **guess, **options)
    found = judged(again, fine, None)
    assert 0.9 <= found.cost <= 30.0
