"""The last check of a motion: no success that exceeds a limit, misses an end or comes too close."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar, cast

from hovi.planning.problem.way_back.excused import excused_sentence
from hovi.planning.solver.outcome.solution_summary import SolutionSummary
from hovi.planning.solver.status import Status

Judged = TypeVar("Judged", bound=SolutionSummary)


def judged(solution: Judged) -> Judged:
    """The solution, as UNRESOLVED if it says success and is not usable.

    One whose start is led back says so.
    Raises OutOfTimeError when the deadline in force passes before that is known.
    """
    if not solution.success or solution.problem is None:
        return solution
    if solution.usable:
        return _saying(solution, excused_sentence(solution.excused))
    what = "a minimum" if solution.status is Status.MINIMUM else "stationary"
    message = (
        f"the motion is {what} on {solution.trajectory.grid.intervals} intervals, but "
        f"{solution.violation}; use more intervals, or change the ends or the duration."
    )
    return without_success(solution, Status.UNRESOLVED, message)


def _saying(solution: Judged, sentence: str) -> Judged:
    """The solution with a sentence at the end of its message."""
    if not sentence or sentence in solution.message:
        return solution
    message = f"{solution.message} {sentence}"
    return cast(Judged, dataclasses.replace(cast(Any, solution), message=message))


def without_success(solution: Judged, status: Status, message: str) -> Judged:
    """The solution with another status, which is no success, and what it says."""
    motion = solution.trajectory
    metadata = {**motion.metadata, "status": str(status)}
    changes: dict[str, Any] = {
        "success": False,
        "status": status,
        "message": message,
        "trajectory": dataclasses.replace(motion, metadata=metadata),
        "minima": (),
        "check": None,
    }
    return cast(Judged, dataclasses.replace(cast(Any, solution), **changes))
