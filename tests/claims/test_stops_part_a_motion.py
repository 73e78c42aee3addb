"""Between ends of segments that are given wholly, a motion in segments is one of its own."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest

import hovi
from hovi.discrete.state import State
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.seams import Seam

MIDDLE, TURN, END = [0.7, 0.9], [1.3, 1.9], State([0.1, -0.2])
FASTEST = 2.4, 3.0, 6.0
TIMES, STEPS = (0.6, 0.9, 0.8), (8, 12, 10)


@cache
def scenes(smooth: bool) -> tuple[hovi.Scene, ...]:
    """Without, with, and without a payload."""
    robot, gravity = hovi.load_robot(hovi.example("two_link.urdf")), hovi.effects.Gravity(9.8)
    payload = hovi.effects.Payload(frame="tip", mass=0.5)
    jerk = [hovi.effects.JerkCost(1e-3)] if smooth else []
    bare = hovi.Scene(robot, [gravity, *jerk])
    return bare, hovi.Scene(robot, [gravity, payload, *jerk]), bare


def parts(smooth: bool) -> list[hovi.DiscreteLagrangian]:
    scheme = hovi.schemes.galerkin(2, 3 if smooth else 2)
    return [
        hovi.DiscreteLagrangian(scene.effort_lagrangian(), hovi.Grid.uniform(T, N, scheme))
        for scene, T, N in zip(scenes(smooth), TIMES, STEPS, strict=True)
    ]


def limits() -> list[Limits]:
    robot = scenes(False)[0].robot
    return [as_limits(robot, {"base": "none", "v": v}) for v in FASTEST]


def solved(problem: hovi.TrajectoryProblem) -> hovi.Solution:
    found = hovi.solve(problem)
    assert found.usable, found.message
    assert found.n_neg == 0
    return found


def assert_joined(whole: hovi.Solution, pieces: Sequence[hovi.Solution], rel: float) -> None:
    assert whole.cost == pytest.approx(sum(piece.cost for piece in pieces), rel=rel)
    begin = 0.0
    for piece in pieces:
        t = np.linspace(0.0, piece.trajectory.duration, 60)[1:-1]
        here, there = whole.trajectory.configurations(begin + t), piece.trajectory.configurations(t)
        np.testing.assert_allclose(here, there, rtol=0, atol=1e-8 if rel < 1e-9 else 2e-3)
        begin += piece.trajectory.duration


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("limited", [False, True])
def test_costs_of_the_legs_add_up_and_their_paths_join(smooth: bool, limited: bool) -> None:
    """Each has its ends, its limits, and what acts in it."""
    bounds = limits() if limited else [None] * 3
    given = State(MIDDLE, [0.5, -0.5]), State(TURN)
    via = [Seam(time, state) for time, state in zip((0.6, 1.5), given, strict=True)]
    ends = State([0.0, 0.0]), END
    whole = hovi.TrajectoryProblem.of_segments(parts(smooth), *ends, bounds, tuple(via))
    states = [ends[0], *given, END]
    pieces = [
        hovi.TrajectoryProblem(ld, states[i], states[i + 1], bounds[i])
        for i, ld in enumerate(parts(smooth))
    ]
    found = [solved(piece) for piece in pieces]
    if smooth:  # a piece of its own begins and ends without acceleration
        assert solved(whole).cost < 0.99 * sum(piece.cost for piece in found)
        return
    assert_joined(solved(whole), found, 1e-4 if limited else 1e-10)
    if limited:
        fastest = [np.abs(piece.trajectory.sample(np.linspace(0, T, 2001)).v).max()
                   for piece, T in zip(found, TIMES, strict=True)]  # fmt: skip
        assert (np.array(fastest) <= np.array(FASTEST) * (1 + 2e-6)).all()
        assert sum(v > 0.999 * most for v, most in zip(fastest, FASTEST, strict=True)) >= 2


def test_a_velocity_that_is_free_joins_two_segments() -> None:
    via = Seam(0.6, State(MIDDLE, free_velocity=["all"])), Seam(1.5, State(TURN))
    start, segments = State([0.0, 0.0]), parts(False)
    whole = solved(hovi.TrajectoryProblem.of_segments(segments, start, END, None, via))
    first = hovi.TrajectoryProblem.of_segments(segments[:2], start, State(TURN), None, via[:1])
    last = hovi.TrajectoryProblem(segments[2], State(TURN), END)
    pieces = [solved(first), solved(last)]
    assert_joined(whole, pieces, 1e-10)
    assert np.abs(whole.trajectory.v[STEPS[0]]).max() > 0.1
