"""What limits cost is what wider ones save; what is kept has a tolerance of its own."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import hovi

BEGIN = np.array([0.0, -1.2, 1.5, -0.3 - np.pi / 2, -np.pi / 2, 0.0])
THERE = np.array([1.2, -0.8, 1.1, -0.3 - np.pi / 2, -np.pi / 2, 0.8])
GRID: dict[str, Any] = {"scheme": "galerkin-2x8", "intervals": 12, "self_collision": False}


def scene() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])


def wider(limits: hovi.Limits, fraction: float) -> hovi.Limits:
    """Limits that are wider at both sides by a fraction of their ranges."""
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    held = np.isfinite(upper - lower)
    more = fraction * (upper - lower)[held]
    lower[held] -= more
    upper[held] += more
    return dataclasses.replace(limits, lower=lower, upper=upper)


@pytest.mark.parametrize("kept", [False, True])
@pytest.mark.parametrize("tight", ["v", "tau"])
def test_prices_of_limits_are_what_wider_ones_save(kept: bool, tight: str) -> None:
    given = {"v": {"v": 1.3}, "tau": {"tau": {"shoulder_lift_joint": 62.0}}}[tight]
    limits = hovi.as_limits(scene().robot, {"base": "urdf", **given})
    keep = [hovi.conditions.Upright("tool0", axis=([0, 0, 1], [0, 0, -1]))] if kept else []

    def planned(limits: hovi.Limits) -> hovi.Solution:
        found = hovi.plan(scene(), BEGIN, THERE, 1.6, limits=limits, keep=keep, **GRID)
        assert found.success, found.message
        return found

    base, step = planned(limits), 3e-4
    assert base.prices is not None
    saved = (planned(wider(limits, -step)).cost - planned(wider(limits, step)).cost) / (2 * step)
    assert saved > 0.05 * base.cost
    assert base.prices.sum() == pytest.approx(saved, rel=0.03)


def test_a_kept_line_leaves_estimates_as_small_as_any() -> None:
    """Its force is large: as the price of a limit it was 1e-3 of the cost."""
    p = scene().robot.frame_position("tool0", BEGIN[None])[0] + [0.0, 0.4, 0.0]
    goal, line = hovi.FrameGoal("tool0", position=p), hovi.conditions.OnLine("tool0")
    given: dict[str, Any] = {"limits": "urdf", "keep": [line], "self_collision": False}
    found = hovi.plan(scene(), BEGIN, goal, 1.5, tolerance=1e-4, **given)
    finer = {"scheme": "galerkin-2x10", "intervals": 48}
    best = hovi.plan(scene(), BEGIN, found.trajectory.q[-1], 1.5, **given, **finer)
    assert found.success, found.message
    assert best.success, best.message
    assert found.error_estimate is not None
    assert abs(found.cost - best.cost) <= found.error_estimate * best.cost
    assert found.error_estimate <= 1e-4
