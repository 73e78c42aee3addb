"""What is planned to a fine tolerance is planned to a coarser one, too."""

from __future__ import annotations

import numpy as np
import pytest

import hovi


@pytest.mark.parametrize("limits", ["none", "urdf"])
@pytest.mark.parametrize("seed", range(3))
def test_no_coarser_tolerance_fails(seed: int, limits: str) -> None:
    """Without limits seed 0 meets 1e-2 on a grid whose motion a finer one moves by 1.4 rad."""
    arm, rng = hovi.load_robot("ur5"), np.random.default_rng(seed)
    start, goal = 1.75 * rng.uniform(-1, 1, (2, arm.nq))
    scene, T = hovi.Scene(arm, [hovi.effects.Gravity()]), rng.uniform(0.8, 2.5)
    wanted = 1e-2, 1e-3, 1e-5
    found = [
        hovi.plan(scene, start, goal, T, tolerance=x, limits=limits, self_collision=False)
        for x in wanted
    ]
    succeeds = [each.success for each in found]
    assert succeeds == sorted(succeeds, reverse=True)
    if all(succeeds):
        finest = found[-1].cost
        for each, tolerance in zip(found, wanted, strict=True):
            assert abs(each.cost - finest) <= 2 * tolerance * finest
            assert each.accuracy is not None
            assert each.accuracy.tolerance.size == tolerance
            assert f"tolerance {tolerance:.2g} of the cost" in each.message
