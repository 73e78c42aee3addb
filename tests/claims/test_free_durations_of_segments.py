"""The best durations of segments, against sequences of given durations around them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

import hovi
from hovi.effects import Armature, Gravity, Payload

WEIGHT = 20.0
FREE = 0.3, 6.0
GRID = {"scheme": "galerkin-2", "intervals": 24, "self_collision": False, "processes": 1}
Q = np.array([[-1.5, 0.0], [-0.8, 0.9], [0.2, 0.2], [0.6, -0.4]])
ALL = {"free_velocity": ["shoulder", "elbow"]}
TORQUES = {"base": "none", "v": 4.0, "tau": [8.0, 3.0]}
Asked = list[dict[str, Any]]


def arm() -> hovi.Scene:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    return hovi.Scene(robot, [Gravity(9.8), Armature(0.05)])


def stops(**velocity: Any) -> Asked:
    """Three segments, with this at the two goals on the way."""
    inner = [{"goal": hovi.State(q, **velocity), "duration": FREE} for q in Q[1:3]]
    return [*inner, {"goal": hovi.State(Q[3]), "duration": FREE}]


def changed(segments: Asked, **changes: Any) -> Asked:
    """With another second segment."""
    return [segments[0], segments[1] | changes, segments[2]]


def aimed() -> Asked:
    """The second goal is a position of the tip."""
    robot = arm().robot
    position = robot.frame_position(robot.tip_frame, Q[2])
    return changed(stops(), goal=hovi.FrameGoal(robot.tip_frame, position=position, guess=Q[2]))


KINDS: dict[str, tuple[Callable[[], Asked], dict[str, Any]]] = {
    "stops": (stops, {}),
    "passes": (lambda: stops(**ALL), {}),
    "one given": (lambda: changed(stops(**ALL), duration=1.0), {}),
    "carried": (lambda: changed(stops(**ALL), effects=[Payload(arm().robot.tip_frame, 0.5)]), {}),
    "within limits": (lambda: stops(**ALL), {"limits": TORQUES}),
    "limits of one": (lambda: changed(stops(**ALL), limits=TORQUES), {}),
    "at a bound": (lambda: changed(stops(**ALL), duration=(2.5, 4.0)), {"limits": TORQUES}),
    "a frame on the way": (aimed, {}),
}


def planned(segments: Asked, options: dict[str, Any], **more: Any) -> hovi.Solution:
    given = GRID | {"limits": "none"} | options | more
    return hovi.plan_sequence(arm(), hovi.State(Q[0]), segments, **given)


def lasting(segments: Asked, durations: np.ndarray) -> Asked:
    return [each | {"duration": float(T)} for each, T in zip(segments, durations, strict=True)]


def durations_of(found: hovi.Solution) -> np.ndarray:
    motion = found.trajectory
    assert motion.segments is not None
    durations = np.diff(motion.grid.t[np.cumsum([0, *motion.segments.intervals])])
    said = ", ".join(f"{T:.10g}" for T in durations[:-1])
    assert f"The segments last {said} and {durations[-1]:.10g} s." in found.message
    return durations


@pytest.mark.parametrize("kind", KINDS)
def test_no_other_durations_cost_less(kind: str) -> None:
    asked, options = KINDS[kind]
    segments = asked()
    found = planned(segments, options, time_weight=WEIGHT)
    assert found.success, found.message
    T = durations_of(found)
    bounds = [x if isinstance(x := each["duration"], tuple) else (x, x) for each in segments]
    free = [i for i, (lower, upper) in enumerate(bounds) if lower < upper]

    def total(scaled: np.ndarray) -> float:
        durations = T.copy()
        durations[free] = np.clip(T[free] * scaled, *np.array(bounds)[free].T)
        again = planned(lasting(segments, durations), options, guess=found.trajectory)
        assert again.success, again.message
        return again.cost + WEIGHT * float(durations.sum())

    simplex = np.vstack([np.ones(len(free)), 1.0 + 0.03 * np.eye(len(free))])
    search = {"initial_simplex": simplex, "maxfev": 40, "xatol": 1e-4, "fatol": 1e-9}
    best = minimize(total, np.ones(len(free)), method="Nelder-Mead", options=search)
    limited = bool(options) or kind == "limits of one"
    close = 1e-4 if limited else 1e-5  # other durations have other grids
    assert total(np.ones(len(free))) == pytest.approx(found.cost, rel=close)
    assert best.fun >= found.cost * (1.0 - close)
    if not limited:
        for i, number in enumerate(free):
            step = 1e-3 * np.eye(len(free))[i]
            slope = (total(1.0 + step) - total(1.0 - step)) / (2e-3 * T[number])
            assert abs(slope) <= 1e-3 * WEIGHT


@pytest.mark.parametrize("kind", KINDS)
def test_free_durations_take_few_steps(kind: str) -> None:
    """At most four times those of the same sequence with given durations, their means."""
    asked, options = KINDS[kind]
    segments = asked()
    found = planned(segments, options, time_weight=WEIGHT)
    means = [np.sqrt(np.prod(x)) if isinstance(x := s["duration"], tuple) else x for s in segments]
    given = planned(lasting(segments, np.array(means)), options)
    assert found.success, found.message
    assert given.success, given.message
    assert found.nit <= 4 * given.nit


def test_a_duration_at_its_bound_is_exactly_there() -> None:
    asked, options = KINDS["at a bound"]
    found = planned(asked(), options, time_weight=WEIGHT)
    assert abs(durations_of(found)[1] / 2.5 - 1.0) <= 1e-12


def test_two_starts_begin_at_the_longest_durations_too() -> None:
    """With a valley of quick motions, and a cheaper one of slow ones."""
    scene = hovi.Scene(hovi.load_robot("ur5"), [Gravity()])
    home, way = [-0.3, 1.3, 1.1, -0.3, 0.2, -1.3], [0.2, 1.9, 1.7, -0.2, 1.0, -1.6]
    segments = [hovi.Segment(q, (0.3, 3.0)) for q in (way, [0.8, 2.1, 1.6, 0.3, 0.8, -1.4])]
    given = {"time_weight": 10.0, "limits": "none"} | GRID
    one, two = (hovi.plan_sequence(scene, home, segments, starts=n, **given) for n in (1, 2))
    assert one.success, one.message
    assert two.success, two.message
    assert two.cost < 0.9 * one.cost


def test_a_stopped_search_keeps_the_best_motion() -> None:
    found = planned(stops(**ALL), {"limits": TORQUES}, time_weight=WEIGHT, max_iterations=3)
    assert found.status == "iteration_limit"
    assert "the best so far" in found.message


def test_durations_that_change_much_within_limits_are_stationary() -> None:
    """With a payload and a high price of time; bounds cut the first steps of the joint solve."""
    segments = changed(stops(**ALL), effects=[Payload(arm().robot.tip_frame, 0.5)])
    options = {
        "limits": TORQUES,
        "intervals": 96,
    }  # on fewer, other durations cost 1e-3 less or more
    found = planned(segments, options, time_weight=100.0)
    assert found.success, found.message
    T = durations_of(found)
    for fraction in (0.99, 1.01):
        near = T * np.array([fraction, 1.0, 1.0])
        again = planned(lasting(segments, near), options, guess=found.trajectory)
        assert not again.success or again.cost + 100.0 * near.sum() > found.cost * (1 - 1e-4)


def test_the_motions_from_which_others_start_are_those_of_its_durations() -> None:
    """Also where one is at a bound, so that the others are solved for again."""
    asked, options = KINDS["at a bound"]
    found = planned(asked(), options | {"time_weight": WEIGHT})
    assert found.success, found.message
    assert found.trajectory.segment_durations[1] == pytest.approx(2.5, rel=1e-9)
    assert found.central is not None
    h = found.trajectory.grid.steps[:, None]
    for _, x in found.central.points:
        np.testing.assert_allclose(x.q[1:] - x.q[:-1] - h * x.v[:-1], h**2 * x.z[:, 0], atol=1e-10)
