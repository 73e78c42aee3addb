"""Bounds that hold at points are tightened while a solve runs, and their slacks move with them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.optimize.barrier import Barrier, Bounds
from hovi.optimize.interior_point import minimize_bounded
from hovi.planning.solver.between_points import LARGEST_MARGIN, MarginsBetweenPoints

START = np.array([0.0, -1.2, 1.5, -1.8, -1.57, 0.0])
NOTHING: Any = None  # the motion of an excess that depends on none
GOAL = np.array([1.2, -0.8, 1.1, -1.8, -1.57, 0.8])  # with the tool's axis as at the start


def test_a_slack_moves_with_its_bound_and_keeps_its_product() -> None:
    random, R = np.random.default_rng(3), 12
    lower, upper = -random.uniform(0.5, 1.0, R), random.uniform(0.5, 1.0, R)
    y = random.uniform(-0.4, 0.4, R)
    before = Barrier.central(Bounds(lower, upper, np.ones(R)), y, 0.01)
    margin = np.where(np.arange(R) % 2 == 0, 0.2, 0.0)  # moves beyond the outputs that are near it
    tighter = Bounds(lower + margin, upper - margin, np.ones(R))
    held_above = before.zu > before.zl
    known = np.where(held_above, upper - before.s, before.s - lower)
    for after in (before.within(tighter), before.refined(tighter, y, *none_of(R), y)):
        gap = np.where(held_above, tighter.upper - after.s, after.s - tighter.lower)
        np.testing.assert_allclose(gap, known, atol=1e-12)
        np.testing.assert_allclose(after.zu[held_above], before.zu[held_above])
        np.testing.assert_allclose(after.zl[~held_above], before.zl[~held_above])


def none_of(size: int) -> tuple[Any, Any]:
    return np.arange(size), np.zeros(0, dtype=np.intp)


@pytest.mark.parametrize("slope", [0.3, 0.0, -0.5, -1.0, -1.5])
def test_margins_settle_where_a_larger_one_needs_a_smaller_one(slope: float) -> None:
    """Of motions whose bulge between the points is 0.01 + slope times the margin."""
    margins = MarginsBetweenPoints(lambda problem, path: sides(), 1e-6, (2, 1, 1))

    def at_points() -> np.ndarray:
        return -margins.values

    def sides() -> np.ndarray:
        return np.maximum(0.01 + slope * margins.values, 0.0) - margins.values

    for _ in range(12):
        if not margins.follow(NOTHING, NOTHING, at_points(), 1e-8):
            break
    assert -5.5e-6 <= sides().max() <= 1e-6
    np.testing.assert_allclose(margins.values, 0.01 / (1.0 - slope), atol=1e-5)


def test_margins_of_bounds_that_are_not_reached_are_none() -> None:
    margins = MarginsBetweenPoints(lambda problem, path: np.full((2, 3, 1), -0.2), 1e-6, (2, 3, 1))
    near = np.full((2, 3, 1), -0.21)
    assert not margins.follow(NOTHING, NOTHING, near, 1e-3)
    margins.values = margins.values + LARGEST_MARGIN
    assert margins.follow(NOTHING, NOTHING, near + 0.2, 1e-3)
    assert margins.values.max() < 0.011


@pytest.mark.parametrize("kept", ["speed", "upright"])
def test_one_solve_ends_within_bounds_between_the_points(
    kept: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And one compares it with a finer grid; each time that bounds are tightened took another."""
    name = "hovi.planning.solver.methods.bounded_search.minimize_bounded"
    solves = list[int]()

    def counted(*given: Any) -> Any:
        ended = minimize_bounded(*given)
        solves.append(len(ended.steps))
        return ended

    monkeypatch.setattr(name, counted)
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    axis = scene.robot.frame_pose("tool0", START)[:3, 2]
    keep = {
        "speed": hovi.conditions.ToolSpeed("tool0", 0.7),
        "upright": hovi.conditions.Upright("tool0", axis=([0, 0, 1], axis), within="5 deg"),
    }[kept]
    given: dict[str, Any] = {
        "keep": [keep],
        "scheme": "galerkin-2x8",
        "intervals": 12,
        "self_collision": False,
    }
    found = hovi.plan(scene, START, GOAL, 2.0, **given)
    q, v = (getattr(found.trajectory.sample(np.linspace(0.0, 2.0, 4001)), name) for name in "qv")
    if kept == "speed":
        model, data = scene.robot.model, scene.robot.model.createData()
        frame = model.getFrameId("tool0")
        speeds = [linear_speed(model, data, frame, *state) for state in zip(q, v, strict=True)]
        assert 0.699 < max(speeds) < 0.7 + 1e-4
    else:
        turns = [scene.robot.frame_pose("tool0", each)[:3, 2] @ axis for each in q]
        assert 4.9 < np.degrees(np.arccos(min(turns))) < 5.01
    assert found.success
    assert len(solves) == 2


def linear_speed(model: Any, data: Any, frame: int, q: Any, v: Any) -> float:
    pin.forwardKinematics(model, data, q, v)
    return float(np.linalg.norm(pin.getFrameVelocity(model, data, frame).linear))
