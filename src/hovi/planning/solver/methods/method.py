"""The interface of methods that minimise the action, and their result."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import field
from typing import TYPE_CHECKING

from hovi.discrete.grid import DiscretePath
from hovi.discrete.instants import Instants
from hovi.discrete.interval_batch import Jet
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Iteration
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.optimize.start import Start
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.status import Status
from hovi.scene.lagrangian import PointTerms
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.planning.solver.central_path import CentralPath

Guess = Start[DiscretePath, "CentralPath"]
"""A motion on the grid of a problem, with the central path of a similar one if it is known."""
Report = Callable[[int, float], None]
"""Called with the number of each step and the least cost so far."""


@dataclass(frozen=True, eq=False)
class MethodResult:
    """The result of a method.

    problem: as solved; a method may split intervals. path, cost: the motion and its action.
    status, message: the outcome, as a word and in a sentence.
    nit: steps. n_neg: negative eigenvalues of the action's Hessian; -1 if they were not counted.
    history: one record per step.
    forces: multipliers of limits and constraints at the quadrature points, then of limits at
        instants between them; None without any.
    instants: these instants; None without any.
    jets: (q, v, a) of the path at the quadrature points, if they were computed.
    model: the quadratic model of the last step of a solve without bounds or equations.
    central: the path of a barrier method towards the motion, for warm starts.
    locally_infeasible: whether the violation of limits has minima that are not zero from several
        guesses.
    """

    problem: TrajectoryProblem
    path: DiscretePath
    cost: float
    status: Status
    message: str
    nit: int = 0
    n_neg: int = -1
    history: list[Iteration] = field(default_factory=list)
    forces: list[PointTerms] | None = None
    instants: Instants | None = None
    jets: list[Jet] | None = None
    model: QuadraticModel | None = None
    central: CentralPath | None = None
    locally_infeasible: bool = False


class Method(ABC):
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
    ) -> MethodResult:
        """A motion of least action, from a guess.

        start: the guess, on the problem's grid and with its boundary data. It may violate limits.
        criteria: tolerances, and limits on steps and time. report: see Report.
        A KeyboardInterrupt during the iterations ends the method with the best motion so far.
        """
