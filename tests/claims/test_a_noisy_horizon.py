"""A UR5 along its velocity limits is advanced from noisy states: each time a new, usable motion."""

from __future__ import annotations

import numpy as np
import pytest

import hovi

HOME = np.array([0.0, -1.2, 1.5, -0.3, 0.5, 0.0])
AWAY = HOME + np.array([2.6, 1.0, -1.5, 2.0, 1.0, 2.6])
DURATION, STEP, REST = 1.2, 0.01, 0.3
"""Of a motion from side to side, of a call, and what is left when the next begins, in [s]."""


@pytest.mark.parametrize(("calls", "seed"), [(60, 1), pytest.param(500, 3, marks=pytest.mark.long)])
def test_every_call_ends_with_a_new_motion(calls: int, seed: int) -> None:
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    ends = [(HOME, AWAY), (AWAY, HOME)]
    sides = [hovi.plan(scene, *each, DURATION, self_collision=False) for each in ends]
    rng, side, motion, passed, led_back = np.random.default_rng(seed), 0, sides[0], 0.0, 0
    for _ in range(calls):
        if motion.trajectory.duration - passed < REST:
            side, passed = 1 - side, 0.0
            motion = sides[side]
        passed += STEP
        at = motion.trajectory.sample([passed])
        q = at.q[0] + 1e-5 * rng.standard_normal(6)
        v = at.v[0] + 1e-3 * rng.standard_normal(6)
        motion = motion.advance(passed, hovi.State(q, v), hovi.State(ends[side][1]))
        passed, led_back = 0.0, led_back + bool(motion.excused)
        assert motion.success, motion.message
        assert motion.usable
        assert np.abs(motion.trajectory.q[0] - q).max() < 1e-9
        assert np.abs(motion.trajectory.q[-1] - ends[side][1]).max() < 1e-9
    assert led_back > calls / 2
