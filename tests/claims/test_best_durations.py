"""The best duration of a sliding mass is that of a formula, and its message says which one it is.

From rest to rest over a way d the cost of m a is J = 6 m^2 d^2 / T^3, so that J + w T is least at
T^4 = 18 m^2 d^2 / w; a force of at most f needs T >= 2 sqrt(m d / f).
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import hovi
from hovi import Solution, Status
from samples.small_robots import arm
from samples.stopped_searches import InterruptedEvaluations

MASS, WAY = 0.5, 0.8
FAILURE = re.compile(
    r"infeasible|interrupted|diverged|saddle|limit was reached|the time limit|iteration_limit|"
    r"no motion|no minimum|none was found|best so far|the solve ended"
)
"""What a success does not say."""


def slid(
    bounds: tuple[float, float], weight: float, force: float | None = None, **options: Any
) -> Solution:
    limits = "none" if force is None else {"base": "none", "tau": force}
    given: dict[str, Any] = {"scheme": "galerkin-2", "intervals": 10, "self_collision": False}
    scene = hovi.Scene(arm("rail", ("prismatic",)))
    given |= {"limits": limits, "time_weight": weight} | options
    return hovi.plan(scene, [0.0], [WAY], bounds, **given)


def agrees(found: Solution) -> bool:
    """Whether success, status, cost and message say the same."""
    said = found.message
    minimum = said.startswith("a minimum of cost ")
    return (
        found.success == (found.status is Status.MINIMUM) == minimum
        and not (found.success and FAILURE.search(said) is not None)
        and (f" {found.trajectory.duration:.10g} s" in said or not found.success)
        and found.minima == ((found.cost,) if found.success else ())
        and (not minimum or f"{found.cost:.10g}" in said)
    )


WALL = hovi.HalfSpace([0.0, -1.0, 0.0], [0.0, WAY + 0.3, 0.0])
"""Near its way, and not touched: with distances a duration is no unknown of a motion."""


def best(weight: float) -> float:
    return float((18 * MASS**2 * WAY**2 / weight) ** 0.25)


@pytest.mark.parametrize("walls", [(), (WALL,)], ids=["free", "beside a wall"])
@pytest.mark.parametrize("weight", [1e-3, 0.1, 1.0, 30.0, 1e3])
def test_a_stationary_duration_is_found(weight: float, walls: tuple[hovi.HalfSpace, ...]) -> None:
    found, T = slid((0.05, 40.0), weight, obstacles=walls), best(weight)
    near = 1e-3 if walls else 1e-7
    assert found.success, found.message
    assert found.trajectory.duration == pytest.approx(T, rel=near)
    assert found.cost == pytest.approx(6 * MASS**2 * WAY**2 / T**3 + weight * T, rel=near**1.5)
    assert found.duration_derivative == pytest.approx(-weight, rel=1e-7)
    assert "The best duration is" in found.message
    assert agrees(found), found.message


@pytest.mark.parametrize(
    ("bounds", "weight", "kept"),
    [
        ((2.0, 9.0), 1.0, 2.0),
        ((0.1, 0.7), 1.0, 0.7),
        ((0.4, 3.0), 0.0, 3.0),
        ((1.4, 2.0), 1.0, 1.4),
    ],
)
def test_a_duration_beyond_which_it_would_be_is_kept_at_its_bound(
    bounds: tuple[float, float], weight: float, kept: float
) -> None:
    found = slid(bounds, weight)
    assert found.success, found.message
    assert found.trajectory.duration == pytest.approx(kept, rel=1e-12)
    assert "kept at its bound" in found.message
    assert agrees(found), found.message


@pytest.mark.parametrize("force", [2.0, 5.0])
def test_where_time_is_dear_it_is_the_shortest_feasible_one(
    force: float,
) -> None:
    """Up to the tolerance of the edge, and what limits at all times cost on 10 intervals."""
    least = 2 * np.sqrt(MASS * WAY / force)
    found = slid((0.1, 10.0), 100.0, force)
    assert found.success, found.message
    T = found.trajectory.duration
    assert least * (1 - 1e-4) <= T <= 1.06 * least
    assert "The best duration" in found.message
    assert agrees(found), found.message
    tau = found.trajectory.sample(np.linspace(0.0, T, 2_001)).tau
    assert np.abs(tau).max() <= force * (1 + 1e-5)
    shorter = slid((0.1, 10.0), 100.0, force, intervals=40).trajectory.duration
    assert least * (1 - 1e-4) <= shorter <= T * (1 + 1e-3)


@pytest.mark.parametrize("force", [2.2, 4.0])
def test_a_limit_that_is_not_reached_leaves_the_best_duration(force: float) -> None:
    """The largest force of the cubic is 6 m d / T^2."""
    weight = 18 * MASS**2 * WAY**2 / np.sqrt(6 * MASS * WAY / (0.8 * force)) ** 4
    found = slid((0.1, 10.0), weight, force)
    assert found.success, found.message
    assert found.trajectory.duration == pytest.approx(best(weight), rel=1e-3)
    assert agrees(found), found.message


@pytest.mark.parametrize("force", [None, 2.0])
@pytest.mark.parametrize("share", [0.1, 0.4, 0.7, 0.75, 0.8, 0.9])
def test_what_ends_the_search_early_leaves_the_best_so_far(
    share: float, force: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluations = InterruptedEvaluations(monkeypatch)
    slid((0.1, 10.0), 1.0, force)
    evaluations.restart(max(2, int(share * evaluations.calls)))
    found = slid((0.1, 10.0), 1.0, force)
    assert (found.success, found.status) == (False, Status.INTERRUPTED)
    assert evaluations.calls <= evaluations.last + 60  # and nothing is solved after that
    assert agrees(found), found.message
    assert np.isfinite(found.cost)
    assert 0.1 <= found.trajectory.duration <= 10.0


@pytest.mark.parametrize("most", [1, 2, 3])
def test_too_few_steps_are_told(most: int) -> None:
    found = slid((0.1, 10.0), 100.0, 2.0, max_iterations=most, continuation=False)
    assert not found.success
    assert agrees(found), found.message
    assert "adds" in found.message or "duration" in found.message
