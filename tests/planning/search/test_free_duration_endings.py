"""However a search for the best duration ends, its status and its message say the same.

The costs are functions of the duration, so that every ending is met at will.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hovi import Solution, Status
from hovi.discrete.trajectory import Trajectory
from hovi.planning.search import free_duration
from hovi.planning.search.free_duration import FreeDuration, best_duration

FAILURE = re.compile(
    r"infeasible|interrupted|diverged|saddle|limit was reached|the time limit|iteration_limit|"
    r"no motion|no minimum|none was found|best so far|the solve ended"
)
"""What a success does not say."""
Fate = Status | type[BaseException]


@dataclass(eq=False)
class Landscape:
    """Minima with J = 1/T, whose best duration is 1 s for a weight of 1, and what becomes of them.

    fate: of the solve for a duration from the motion of another. rise: what is added to the cost
    for a duration from the motion of another, and its derivative.
    """

    fate: Callable[[float, float], Fate] = lambda T, origin: Status.MINIMUM
    rise: Callable[[float, float], tuple[float, float]] = lambda T, origin: (0.0, 0.0)
    asked: list[float] = dataclasses.field(default_factory=list)

    def solve(self, T: float, guess: Trajectory) -> Solution:
        self.asked.append(T)
        origin = guess.duration
        fate = self.fate(T, origin)
        if not isinstance(fate, Status):
            raise fate
        rise, slope = self.rise(T, origin)
        cost = 1 / T + rise
        success = fate is Status.MINIMUM
        message = f"a minimum of cost {cost:.10g}." if success else f"{fate} at {T} s."
        motion: Any = SimpleNamespace(duration=T)
        found = Solution(success, fate, message, motion, cost, 7, 0)
        found.__dict__["duration_derivative"] = -1 / T**2 + slope
        return found

    def search(self, lower: float, upper: float, weight: float, first: float) -> Solution:
        guess: Any = SimpleNamespace(duration=first)
        free = FreeDuration(lower, upper, weight)
        return best_duration(free, self.solve, self.solve(first, guess)).with_time()


def agrees(solution: Solution) -> bool:
    """Whether success, status, cost and message of a solution with time say the same."""
    said = solution.message
    minimum = said.startswith("a minimum of cost ")
    return (
        solution.success == (solution.status is Status.MINIMUM) == minimum
        and minimum == ("a minimum of cost" in said)
        and not (solution.success and FAILURE.search(said) is not None)
        and f" {solution.trajectory.duration:.10g} s" in said
        and solution.minima == ((solution.cost,) if solution.success else ())
        and (not minimum or f"{solution.cost:.10g}" in said)
    )


def below(edge: float, fate: Fate) -> Callable[[float, float], Fate]:
    return lambda T, origin: fate if edge > T else Status.MINIMUM


def above(edge: float, fate: Fate) -> Callable[[float, float], Fate]:
    return lambda T, origin: fate if edge < T else Status.MINIMUM


def within(low: float, high: float, fate: Fate) -> Callable[[float, float], Fate]:
    return lambda T, origin: fate if low < T < high else Status.MINIMUM


def from_afar(edge: float) -> Callable[[float, float], Fate]:
    """Infeasible below an edge, unless the guess is near."""
    return lambda T, origin: Status.INFEASIBLE if edge > T and origin / T > 1.1 else Status.MINIMUM


def jump(at: float, by: float, slope: float = 0.0) -> Callable[[float, float], tuple[float, float]]:
    """Costlier motions below a duration, whose costs fall towards it by a slope."""
    return lambda T, origin: (by + slope * (T - at), slope) if at > T else (0.0, 0.0)


@dataclass(frozen=True)
class Ending:
    """Bounds, weight and first duration of a search, and what is to come of it."""

    free: tuple[float, float, float, float]
    landscape: Callable[[], Landscape]
    status: Status
    says: str
    duration: float
    precision: float = 1e-9


def landscape(**parts: Any) -> Callable[[], Landscape]:
    return lambda: Landscape(**parts)


MINIMUM, WIDE = Status.MINIMUM, (0.1, 10.0, 1.0, 3.0)
ENDINGS = {
    "stationary": Ending(WIDE, landscape(), MINIMUM, "The best duration is 1 s", 1.0),
    "stationary at once": Ending(
        (0.1, 10, 1, 1), landscape(), MINIMUM, "The best duration is 1 s", 1.0
    ),
    "lower bound": Ending((2, 9, 1, 4), landscape(), MINIMUM, "kept at its bound, 2 s", 2.0),
    "upper bound": Ending((0.1, 0.7, 1, 0.2), landscape(), MINIMUM, "kept at its bound", 0.7),
    "first at the bound": Ending((2, 9, 1, 2), landscape(), MINIMUM, "kept at its bound", 2.0),
    "shorter ones infeasible": Ending(
        WIDE,
        landscape(fate=below(1.7, Status.INFEASIBLE)),
        MINIMUM,
        "The best duration, to 0.1 % the shortest one found feasible, is 1.7",
        1.7,
        1e-3,
    ),
    "longer ones infeasible": Ending(
        (0.1, 10, 0, 0.3),
        landscape(fate=above(2.5, Status.INFEASIBLE)),
        MINIMUM,
        "The best duration, to 0.1 % the longest one found feasible, is 2.4",
        2.5,
        1e-3,
    ),
    "infeasible from afar alone": Ending(
        WIDE, landscape(fate=from_afar(1.7)), MINIMUM, "The best duration is 1 s", 1.0
    ),
    "a large jump to another slope": Ending(
        WIDE,
        landscape(rise=jump(1.1, 0.5, -2.0)),
        MINIMUM,
        "before motions cost more, is",
        1.1,
        1e-3,
    ),
    "infeasible within the bracket": Ending(
        WIDE,
        landscape(fate=within(0.97, 1.03, Status.INFEASIBLE)),
        MINIMUM,
        "to 0.1 % the shortest one found feasible, is",
        1.03,
        1e-3,
    ),
    "a jump that grids cause": Ending(
        WIDE,
        landscape(rise=jump(1.1, 0.005, -2.0)),
        MINIMUM,
        "next to a jump of the cost by",
        1.1,
        1e-3,
    ),
    "a costlier valley": Ending(
        WIDE,
        landscape(rise=jump(1.1, 0.5)),
        MINIMUM,
        "to 0.1 % the shortest one before motions cost more, is 1.1",
        1.1,
        1e-3,
    ),
    "a valley that goes on": Ending(
        WIDE,
        landscape(
            rise=lambda T, origin: (0.5, 0.0) if T < 1.5 and origin / T > 1.02 else (0.0, 0.0)
        ),
        MINIMUM,
        "The best duration is 1 s",
        1.0,
    ),
} | {
    f"{fate} next to it": Ending(
        WIDE, landscape(fate=below(1.7, fate)), fate, f"the solve ended in {fate}", 1.7, 1e-3
    )
    for fate in (Status.ITERATION_LIMIT, Status.SADDLE, Status.DIVERGED)
}


@pytest.mark.parametrize("name", ENDINGS)
def test_status_message_and_duration_of_every_ending_agree(name: str) -> None:
    ending = ENDINGS[name]
    costs = ending.landscape()
    found = costs.search(*ending.free)
    assert found.status is ending.status, found.message
    assert ending.says in found.message
    assert found.trajectory.duration == pytest.approx(ending.duration, rel=ending.precision)
    assert agrees(found), found.message
    assert found.nit == 7 * len(costs.asked) <= 7 * 100


@pytest.mark.parametrize("nth", [1, 2, 3, 6, 8, 9])
@pytest.mark.parametrize("fate", [Status.TIME_LIMIT, Status.INTERRUPTED, KeyboardInterrupt])
def test_what_ends_the_search_early_leaves_the_best_so_far(nth: int, fate: Fate) -> None:
    costs = Landscape()
    costs.fate = lambda T, origin: fate if len(costs.asked) == nth + 1 else Status.MINIMUM
    found = costs.search(0.1, 10.0, 1.0, 3.0)
    status = fate if isinstance(fate, Status) else Status.INTERRUPTED
    assert (found.success, found.status) == (False, status)
    assert agrees(found), found.message
    assert len(costs.asked) == nth + 1  # and nothing is solved after that
    least = min(1 / T + T for T in costs.asked[:-1])
    assert found.cost == pytest.approx(least, rel=1e-14)
    assert f"of cost {found.cost:.10g}" in found.message


def test_the_best_so_far_need_not_be_the_last() -> None:
    costs = Landscape(rise=lambda T, origin: (0.05, 0.0) if 1.0 < T < 1.03 else (0.0, 0.0))
    costs.fate = lambda T, origin: MINIMUM if len(costs.asked) <= 7 else Status.TIME_LIMIT
    found = costs.search(0.1, 10.0, 1.0, 3.0)
    assert 1.0 < costs.asked[6] < 1.03
    assert found.trajectory.duration == costs.asked[4] > 1.03
    assert agrees(found), found.message


@pytest.mark.parametrize("status", [status for status in Status if status is not Status.MINIMUM])
def test_a_first_motion_that_is_no_minimum_is_returned_as_it_is(status: Status) -> None:
    costs = Landscape(fate=lambda T, origin: status)
    found = costs.search(0.1, 10.0, 1.0, 3.0)
    assert (found.success, found.status, costs.asked) == (False, status, [3.0])
    assert agrees(found), found.message
    assert found.cost == pytest.approx(1 / 3 + 3)
    assert "Time adds 3 to the cost" in found.message


def test_the_number_of_durations_is_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(free_duration, "MAX_DURATIONS", 3)
    costs = Landscape()
    found = costs.search(0.1, 10.0, 1.0, 3.0)
    assert (found.status, len(costs.asked)) == (Status.ITERATION_LIMIT, 4)
    assert "not found among 3 durations" in found.message
    assert agrees(found), found.message


@pytest.mark.parametrize("limited", [False, True])
def test_other_durations_to_start_from_reach_both_bounds(limited: bool) -> None:
    free = FreeDuration(0.5, 8.0)
    probes = free.probes(limited)
    assert {0.5, 8.0} <= set(probes)
    assert len(probes) == 6
    assert (probes[0] > free.first) == limited
    assert np.all((np.array(probes) >= 0.5) & (np.array(probes) <= 8.0))
