"""objective = "time": the least duration between two bounds, by solves for growing weights of time.

With J the cost without time, J + w T has its minimum at the least duration that limits allow, to an
error that vanishes as w grows: relative to the time, the effort J has the weight 1/w, which is
halved until that no longer changes the duration.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.search.final_stages import ended_early
from hovi.planning.search.free_duration import action_of
from hovi.planning.search.options import PlanOptions
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import Status
from hovi.system.deadline import Deadline

UNCHANGED = 1e-3
"""Relative change of the duration that counts as none, twice in a row."""
EFFORT_FRACTION = 1e-2
"""Once the effort is less than this fraction of w T, its weight is only halved."""
LARGEST_JUMP, LEAST_JUMP = 30.0, 2.0
"""Largest factor from one weight of time to the next while the effort is more than EFFORT_FRACTION
of w T, and the least one, which halves the weight of effort."""
ROUNDING = 1e-9
"""Relative rounding error of a factor of the weight of time."""
NO_TIME = 1e-3
"""Time limit of a solve for which no time is left, in [s]: it ends with its status."""
MAX_SOLVES = 60
"""Maximum number of weights."""


def least_duration(
    planned: Callable[[PlanOptions], Solution],
    duration: float | tuple[float, float],
    options: PlanOptions,
) -> Solution:
    """The motion of least duration, by the smallest weight of effort that is resolved.

    planned: solves with given options. duration: the bounds. options: with objective = "time".
    Raises InputError for a given duration, or a given weight of time.
    """
    if not isinstance(duration, tuple):
        raise InputError(
            'objective = "time" needs a free duration: give a pair (lower, upper) instead of '
            f"{duration:g} s."
        )
    if options.time_weight != 0:
        raise InputError('objective = "time" chooses time_weight: leave one of the two out.')
    return _Search(planned, options, Deadline(options.time_limit_seconds)).run()


class _Search:
    """Solves for one weight of time after the other, each from the motion before.

    planned, options: see `least_duration`. weight: that of the best motion so far.
    changes: relative changes of the duration by the last successes that halved the effort's weight.
    steps, seconds: sums over all solves.
    """

    def __init__(
        self,
        planned: Callable[[PlanOptions], Solution],
        options: PlanOptions,
        deadline: Deadline,
    ) -> None:
        self.planned, self.options, self.deadline = planned, options, deadline
        self.weight, self.steps, self.seconds = 0.0, 0, 0.0
        self.changes: list[float] = []

    def run(self) -> Solution:
        """The motion, or that of the first solve if it is no success."""
        best = self._solved(0.0, None)
        if not best.success:
            return best
        factor = LARGEST_JUMP
        for _ in range(MAX_SOLVES):
            weight = self._next(best, factor)
            tried = self._solved(weight, best.trajectory)
            if tried.status in (Status.TIME_LIMIT, Status.INTERRUPTED):
                return self._stopped(best, tried.status)
            halved = 0 < weight <= LEAST_JUMP * self.weight * (1 + ROUNDING)
            if tried.success:
                change = abs(tried.trajectory.duration / best.trajectory.duration - 1)
                self.changes = [*self.changes, change] if halved else []
                best, self.weight = tried, weight
            elif halved:
                return self._ended(best, f"a smaller one was not resolved ({tried.status})")
            else:
                factor = max(LEAST_JUMP, np.sqrt(factor))
            if len(self.changes) > 1 and max(self.changes[-2:]) < UNCHANGED:
                break
        return self._ended(best, "")

    def _next(self, best: Solution, factor: float) -> float:
        """The next weight of time: doubled, or larger while the effort is much of the cost."""
        T, J = best.trajectory.duration, abs(action_of(best))
        if self.weight == 0:
            return float(J / T) or 1.0
        wanted = J / (EFFORT_FRACTION * T)
        return float(np.clip(wanted, LEAST_JUMP * self.weight, factor * self.weight))

    def _solved(self, weight: float, guess: Trajectory | None) -> Solution:
        changes: dict[str, object] = {"objective": "effort", "time_weight": weight}
        changes["time_limit"] = left = self.deadline.seconds_left
        if left is not None and left <= 0:
            changes["time_limit"] = NO_TIME
        if guess is not None:
            changes |= {"guess": guess, "starts": 1}
        found = self.planned(self.options.with_changes(**changes))
        self.steps += found.nit
        self.seconds += found.solve_seconds
        return found

    def _stopped(self, best: Solution, status: Status) -> Solution:
        why = "the time limit was reached" if status is Status.TIME_LIMIT else "interrupted"
        return self._summed(ended_early(best, status, f"{why} before the duration was the least"))

    def _ended(self, best: Solution, why: str) -> Solution:
        """The best motion, which says its weight, and how much the duration changed."""
        message = f"{best.message} {_said(self.weight, self.changes, why)}"
        return self._summed(dataclasses.replace(best, message=message))

    def _summed(self, best: Solution) -> Solution:
        return dataclasses.replace(best, nit=self.steps, solve_seconds=self.seconds)


def _said(weight: float, changes: Sequence[float], why: str) -> str:
    """The weight of the effort, and the changes of the duration by halving it, as a sentence."""
    by = f"The least time is that by an effort of weight {1 / weight:.3g} per second of time"
    last = " and ".join(f"{each:.1g}" for each in changes[-2:])
    halved = f"halving it changed the duration by {last} of it" if changes else ""
    return f"{'; '.join(each for each in (by, halved, why) if each)}."
