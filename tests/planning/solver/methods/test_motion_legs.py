"""The legs of a motion between seams: their actions add up to that of the whole."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import hovi
from hovi.discrete.state import State
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.seams import Seam
from hovi.planning.solver.initial_path import guess_path
from hovi.planning.solver.methods.motion_legs import joined, legs_of

MIDDLE, TURN = [0.7, 0.9], [1.3, 1.9]


@cache
def scenes() -> tuple[hovi.Scene, hovi.Scene]:
    """Without and with a payload."""
    robot, gravity = hovi.load_robot(hovi.example("two_link.urdf")), hovi.effects.Gravity(9.8)
    payload = hovi.effects.Payload(frame="tip", mass=0.5)
    return hovi.Scene(robot, [gravity]), hovi.Scene(robot, [gravity, payload])


def problem_of(first: State, smooth: bool = False) -> hovi.TrajectoryProblem:
    """Three segments, with a stop at the end of the second and a given seam before it."""
    jerk = [hovi.effects.JerkCost(1e-3)] if smooth else []
    bare, loaded = (hovi.Scene(x.robot, [*x.effects, *jerk]) for x in scenes())
    scheme = hovi.schemes.galerkin(2, 3 if smooth else 2)
    segments = [
        hovi.DiscreteLagrangian(x.effort_lagrangian(), hovi.Grid.uniform(T, N, scheme))
        for x, T, N in ((bare, 0.6, 4), (loaded, 0.9, 6), (bare, 0.8, 5))
    ]
    bounds = [as_limits(bare.robot, {"base": "none", "v": v}) for v in (4.0, 5.0, 6.0)]
    via = Seam(0.6, first), Seam(1.5, State(TURN))
    ends = State([0.0, 0.0]), State([0.1, -0.2])
    return hovi.TrajectoryProblem.of_segments(segments, *ends, bounds, via)


@pytest.mark.parametrize("smooth", [False, True])
def test_actions_of_legs_add_up_and_paths_join_to_the_whole(smooth: bool) -> None:
    problem = problem_of(State(MIDDLE, [0.5, -0.5]), smooth)
    legs = legs_of(problem)
    assert [(leg.first, leg.last) for leg in legs] == [(0, 4), (4, 10), (10, 15)]
    random = np.random.default_rng(0)
    parts = []
    for leg in legs:  # the accelerations at seams are zero
        path = guess_path(leg.problem, "cubic")
        object.__setattr__(path, "inner", random.normal(size=path.inner.shape))
        parts.append(path)
    whole = joined(legs, parts)
    problem.grid.require_path(whole, 2, 2)
    total = sum(leg.problem.ld.action(part) for leg, part in zip(legs, parts, strict=True))
    assert problem.ld.action(whole) == pytest.approx(total, rel=1e-12)
    for leg, part in zip(legs, parts, strict=True):
        again = leg.path(whole)
        for name in ("q", "v", "z", "inner", "higher"):
            np.testing.assert_allclose(getattr(again, name), getattr(part, name), atol=1e-9)


def test_each_leg_has_its_ends_its_limits_and_what_acts_in_it() -> None:
    problem = problem_of(State(MIDDLE, [0.5, -0.5]))
    legs = legs_of(problem)
    for leg, v in zip(legs, (4.0, 5.0, 6.0), strict=True):
        assert isinstance(leg.problem.limits, Limits)
        np.testing.assert_allclose(leg.problem.limits.upper[1], v)
    np.testing.assert_allclose(legs[0].problem.ends[0][1], MIDDLE)
    np.testing.assert_allclose(legs[1].problem.ends[1][0], [0.5, -0.5])
    np.testing.assert_allclose(legs[2].problem.ends[1][1], 0.0)
    assert legs[1].problem.scene is scenes()[1] or len(legs[1].problem.scene.effects) == 2


def test_a_velocity_that_is_free_joins_two_segments_in_one_leg() -> None:
    problem = problem_of(State(MIDDLE, free_velocity=["all"]))
    legs = legs_of(problem)
    assert [(leg.first, leg.last) for leg in legs] == [(0, 10), (10, 15)]
    first = legs[0].problem
    assert first.ld.segments is not None
    assert first.limits is not None
    assert [each.node for each in first.holds] == [4]
    np.testing.assert_allclose([each.upper[1, 0] for each in first.limits.parts], [4.0, 5.0])
    assert first.limits.ends == pytest.approx((0.6,))


def test_a_motion_without_seams_has_no_legs() -> None:
    scene = scenes()[0]
    grid = hovi.Grid.uniform(1.0, 4, hovi.schemes.galerkin(2))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    assert legs_of(hovi.TrajectoryProblem(ld, State([0.0, 0.0]), State([1.0, 0.0]))) == []


def test_the_metric_of_a_held_motion_is_that_of_its_legs() -> None:
    problem = problem_of(State(MIDDLE))
    whole = problem.structure.metric["nodal"]
    for leg in legs_of(problem):
        own = leg.problem.structure.metric["nodal"]
        np.testing.assert_allclose(whole[leg.first : leg.last], own, rtol=1e-12)
