"""A way to minimise the action of a trajectory problem, and what it answers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field

from hovi.discrete.grid import DiscretePath
from hovi.discrete.interval_batch import Jet
from hovi.optimize.trust_region import Iteration, Options
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.status import Status
from hovi.scene.lagrangian import PointTerms

Report = Callable[[int, float], None]
"""Called with the number of each step and the least cost so far."""


@dataclass(frozen=True, eq=False)
class Answer:
    """Where a method ended.

    problem: as solved; a method may split intervals. path, cost: the motion and its action.
    status, message: what happened, in a word and in a sentence.
    nit: steps. n_neg: negative eigenvalues of the action's Hessian; -1 where it was not counted.
    history: what each step did.
    forces: what limits and equations exert at the quadrature points; None without any.
    jets: (q, v, a) of the path at the quadrature points, where they are known already.
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
    jets: list[Jet] | None = None


class Method(ABC):
    """A way to minimise the action, for the problems that it suits."""

    @abstractmethod
    def suits(self, problem: TrajectoryProblem) -> bool:
        """Whether the method can meet all that the problem asks for."""

    @abstractmethod
    def minimize(
        self,
        problem: TrajectoryProblem,
        path: DiscretePath,
        options: Options,
        report: Report | None = None,
    ) -> Answer:
        """A motion of least action, from a guess.

        path: the guess, on the problem's grid and with its boundary data.
        options: tolerances and budgets. report: see Report.
        A KeyboardInterrupt inside its iterations ends the method with the best motion so far.
        """
