"""The best duration where something has times of its own, such as via points and effects."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hovi
from hovi.errors import InputError
from samples.small_robots import arm

GRAVITY = hovi.effects.Gravity()
GUST = hovi.effects.Wrench("link2", force=("0", "3*sin(4*t)", "2*cos(3*t)"))
SWAY = hovi.effects.MovingBase(position=("0", "0.05*sin(5*t)", "0"))
START, GOAL, WEIGHT, BOUNDS = [0.3, -0.2], [1.5, 1.0], 0.03, (0.6, 6.0)
MIDDLE = hovi.Via(0.4, hovi.State([0.6, 0.2]))
SWIFT = hovi.Condition(
    lambda v: v[1], hovi.Between(-9.0, lambda t: 1.0 + t), name="swift", scale=1.0
)
HALFWAY = hovi.Condition(lambda q: q[0], hovi.Equal(0.7), hovi.AtTimes(0.4), name="halfway")
ASKED: dict[str, tuple[list[hovi.effects.Effect], dict[str, Any]]] = {
    "a via point": ([GRAVITY], {"via": [MIDDLE], "intervals": 40}),
    "a via point within limits": (
        [GRAVITY],
        {"via": [MIDDLE], "limits": {"base": "none", "v": 3.5, "tau": 6.0}},
    ),
    "a force of time": ([GRAVITY, GUST], {}),
    "a force of time within limits": ([GRAVITY, GUST], {"limits": {"base": "none", "v": 2.5}}),
    "a base that moves": ([GRAVITY, SWAY], {}),
    "a bound of time": ([GRAVITY], {"conditions": [SWIFT], "intervals": 10}),
    "a value at a time": ([GRAVITY], {"conditions": [HALFWAY]}),
}


def planned(asked: str, duration: Any, **more: Any) -> hovi.Solution:
    effects, options = ASKED[asked]
    scene = hovi.Scene(hovi.load_robot("double_pendulum"), effects)
    given = {"limits": "none", "intervals": 24, "scheme": "galerkin-4x10", "self_collision": False}
    return hovi.plan(scene, START, GOAL, duration, **(given | options), **more)


@pytest.mark.parametrize("asked", ASKED)
def test_no_other_duration_costs_less(asked: str) -> None:
    """By plans for durations that are given, from the motion that was found."""
    found = planned(asked, BOUNDS, time_weight=WEIGHT)
    T = found.trajectory.duration
    assert found.success, found.message
    durations = [T * (1 + change) for change in (-0.1, -0.03, 0.03, 0.1)]
    others = [planned(asked, each, guess=found.trajectory) for each in durations]
    costs = [x.cost + WEIGHT * x.trajectory.duration for x in others if x.success]
    inside = BOUNDS[0] * 1.02 < T < BOUNDS[1] / 1.02
    assert len(costs) == 4
    assert inside, f"{T} s is at a bound, where this shows nothing"
    assert min(costs) > found.cost


@pytest.mark.parametrize("asked", ["a force of time", "a force of time within limits"])
def test_the_derivative_in_the_duration_is_that_of_plans(asked: str) -> None:
    step = 5e-3
    here, *around = (planned(asked, 1.1 + change) for change in (0, step, -step))
    change = (around[0].cost - around[1].cost) / (2 * step)
    assert here.duration_derivative == pytest.approx(change, rel=2e-3)


def test_via_points_keep_their_times() -> None:
    found = planned("a via point", BOUNDS, time_weight=WEIGHT).trajectory
    np.testing.assert_allclose(found.sample([0.4]).q[0], [0.6, 0.2], atol=1e-8)
    late = "a via point or condition at 0.4 s is not before the least duration, 0.3 s"
    with pytest.raises(InputError, match=late):
        planned("a via point", (0.3, 3.0))


@pytest.mark.parametrize("limits", ["none", {"base": "none", "v": 100.0}], ids=["free", "limited"])
def test_a_gate_that_opens_is_waited_for(limits: Any) -> None:
    """A ball leaves the end of a way: less time would be cheaper, were it not there."""
    path = {"times": [0.0, 10.0], "positions": [[0.0, 0.9, 0.0], [0.0, 0.9, 4.0]]}
    ball = hovi.Sphere([0.0, 0.0, 0.0], 0.3, path=path, name="ball")
    scene = hovi.Scene(arm("rail", ("prismatic",)))

    def slid(duration: Any, **more: Any) -> hovi.Solution:
        given = {"scheme": "galerkin-2x8", "intervals": 30, "self_collision": False} | more
        return hovi.plan(scene, [0.0], [0.8], duration, limits=limits, obstacles=[ball], **given)

    found = slid((0.2, 9.0), time_weight=100.0)
    T = found.trajectory.duration
    alone = (18 * 0.5**2 * 0.8**2 / 100.0) ** 0.25
    assert found.success, found.message
    assert 1.2 * alone < T
    around = [slid(T * (1 + change)) for change in (-0.02, -0.005, 0.005, 0.02)]
    costs = [x.cost + 100.0 * x.trajectory.duration if x.success else np.inf for x in around]
    assert min(costs) > found.cost * (1 - 1e-6)
    assert np.isfinite(costs[2:]).all()


def test_bounds_that_come_too_late_for_short_motions_refuse_none() -> None:
    """The goal is outside its bound after 0.67 s, and within it before."""
    late = hovi.Between(upper=lambda t: 1.2 - 0.3 * t)
    bound = hovi.Condition(lambda q: q[0], late, name="closing", scale=1.0)
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [GRAVITY])
    given = {"conditions": [bound], "limits": "none", "time_weight": 5.0, "self_collision": False}
    for upper in (0.66, 5.0):
        found = hovi.plan(scene, [0.0, 0.0], [1.0, 0.3], (0.2, upper), **given)
        assert found.success, found.message
        assert found.trajectory.duration < 2 / 3
    late_only = hovi.plan(scene, [0.0, 0.0], [1.0, 0.3], (0.8, 5.0), **given)
    assert late_only.status == "infeasible"
    assert late_only.nit == 0
