"""Replans of motions that were planned with all defaults take a few steps, as accurate as these."""

from __future__ import annotations

import numpy as np
import pytest

import hovi

REACHES = {
    "ur5": ([0.0, -1.2, 1.4, -1.8, -1.5, 0.0], [1.1, -0.9, 1.0, -1.2, -1.0, 0.5], 1.2),
    "z1": ([0.0, 1.0, -1.2, 0.3, 0.0, 0.0, 0.0], [0.8, 1.6, -0.9, -0.4, 0.5, 0.3, 0.0], 0.8),
}


@pytest.mark.parametrize("arm", REACHES)
def test_a_start_that_moves_by_a_milliradian_takes_a_few_steps(arm: str) -> None:
    """And costs no more than a new plan of the same accuracy, within a tenth of the tolerance."""
    scene = hovi.Scene(hovi.load_robot(arm), [hovi.effects.Gravity()])
    start, goal, T = REACHES[arm]
    known = hovi.plan(scene, start, goal, T, self_collision=False)
    assert known.success, known.message
    random = np.random.default_rng(3)
    steps = []
    for _ in range(5):
        moved = np.add(start, random.uniform(-1e-3, 1e-3, len(start)))
        again = known.replan(start=moved)
        assert again.success, again.message
        anew = hovi.plan(scene, moved, goal, T, guess=known.trajectory, self_collision=False)
        assert anew.success, anew.message
        assert again.cost == pytest.approx(anew.cost, rel=1e-4)
        steps.append(again.nit)
    assert np.median(steps) <= 4, steps
