"""The interface of methods that minimise the action."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

from hovi.discrete.grid import DiscretePath
from hovi.optimize.criteria import Criteria
from hovi.optimize.start import Start
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.answer import Answer

if TYPE_CHECKING:
    from hovi.planning.solver.central_path import CentralPath

Guess: TypeAlias = "Start[DiscretePath, CentralPath]"
"""A motion on the grid of a problem, with the central path of a similar one if it is known."""
Report = Callable[[int, float], None]
"""Called with the number of each step and the least cost so far."""


class ProblemMethod(ABC):
    """A method that minimises the action, for some kinds of problems."""

    @abstractmethod
    def supports(self, problem: TrajectoryProblem) -> bool:
        """Whether the method supports the problem's limits, obstacles and constraints."""

    @abstractmethod
    def minimize(
        self,
        problem: TrajectoryProblem,
        start: Guess,
        criteria: Criteria,
        report: Report | None = None,
    ) -> Answer:
        """A motion of least action, from a guess.

        start: the guess, on the problem's grid and with its boundary data. It may violate limits.
        criteria: tolerances, and limits on steps and time. report: see Report.
        A KeyboardInterrupt during the iterations ends the method with the best motion so far.
        """
