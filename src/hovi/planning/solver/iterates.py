"""Iterates: the motions that a plan passes through, for who observes it or ends it from outside."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import cached_property
from typing import Any, TypeVar

from hovi.errors import CancelledError
from hovi.optimize.ended import STOPS, Reason
from hovi.optimize.observed import observed
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.solver import Solution, solution_of
from hovi.planning.solver.status import unfinished
from hovi.system.dataclass import dataclass
from hovi.system.interruption import cancelled_by

Returned = TypeVar("Returned")


@dataclass(frozen=True, eq=False)
class Iterate:
    """The motion of a plan after one of its steps: what an interrupt at this moment leaves.

    number: 0 for the first guess, counted over all solves of the plan. It may be off its limits,
    and costs more than what the plan returns.
    """

    number: int
    _objective: Any
    _x: Any

    @cached_property
    def solution(self) -> Solution:
        """The motion as a solution of status `interrupted`, computed when asked, in [ms].

        Its `violation` says what it does not keep.
        """
        problem, path = self._objective.motion(self._x)
        status, reason = unfinished(Reason.INTERRUPTED)
        message = f"{reason} after {self.number} steps; the motion is the last one."
        return solution_of(Answer.at(problem, path, status, message, self.number))


OnIterate = Callable[[Iterate], object]
"""Called with every motion that a plan passes through."""
Cancel = Callable[[], bool]
"""Whether a plan is to end, such as the `is_set` of a threading.Event."""


class _CarriedError(BaseException):
    """An error of a user's function, which no solver takes for its own."""


@contextmanager
def watched(on_iterate: OnIterate | None, cancel: Cancel | None) -> Iterator[None]:
    """A plan whose iterates are shown, and which ends with its best motion once it is cancelled.

    Errors of the two functions leave it as they are. Raises CancelledError before there is a
    motion.
    """
    with ExitStack() as stack:
        if on_iterate is not None:
            stack.enter_context(observed(_numbered(on_iterate)))
        if cancel is not None:
            stack.enter_context(cancelled_by(lambda: bool(_carried(cancel))))
        try:
            yield
        except _CarriedError as carried:
            raise carried.args[0] from None
        except KeyboardInterrupt:
            if cancel is not None and cancel():
                raise CancelledError("the plan was cancelled before it had a motion.") from None
            raise


def _numbered(on_iterate: OnIterate) -> Callable[[Any, Any], None]:
    number, last = 0, None

    def shown(objective: Any, x: Any) -> None:
        nonlocal number, last
        if x is not last:  # after a step that was refused it is
            _carried(lambda: on_iterate(Iterate(number, objective, x)))
            number, last = number + 1, x

    return shown


def _carried(function: Callable[[], Returned]) -> Returned:
    try:
        return function()
    except STOPS:  # as if they came in the solve
        raise
    except Exception as error:
        raise _CarriedError(error) from error
