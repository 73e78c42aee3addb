"""What comes back when time runs out: a motion that satisfies ends and limits, or the last motion.

A motion satisfies them to 1e-6: of the ranges of limits, in [rad] and [m], and relative to the
largest torque where joints are passive.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hovi.discrete.grid import DiscretePath
from hovi.planning.problem.conditions_of import between_ends
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.outcome.ends import misses
from hovi.planning.solver.outcome.violation import first_violated
from hovi.planning.solver.status import Status

if TYPE_CHECKING:
    from hovi.planning.solver.central_path import CentralPath


def satisfies(problem: TrajectoryProblem, path: DiscretePath) -> bool:
    """Whether a path with the problem's ends satisfies its limits, distances and equations
    everywhere.

    Raises OutOfTimeError when the deadline in force passes before that is known.
    """
    motion = problem.trajectory(path)
    return not first_violated(between_ends(problem), problem, motion)


def last_motion(
    problem: TrajectoryProblem,
    path: DiscretePath,
    central: CentralPath | None,
    steps: int,
    name: str,
) -> Answer:
    """A motion of a similar problem as the result, where time ran out.

    path: on the problem's grid, perhaps with other ends. central: for the next solve.
    steps: of the solve that was ended. name: says what the motion is, as a clause.
    """
    missed = misses(problem, path) or "meets the ends; its limits were not checked"
    message = f"{out_of_time(steps)}; {name}, which {missed}."
    return Answer.at(problem, path, Status.TIME_LIMIT, message, steps, central)


def out_of_time(steps: int) -> str:
    """That no motion was found in time, as a clause. steps: of the solve that was ended."""
    return (
        f"the time limit was reached after {steps} steps, before a motion that meets the ends and "
        "the limits was found"
    )
