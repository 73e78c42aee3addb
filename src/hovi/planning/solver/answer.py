"""The answer of a solve on a grid: a motion, and how it was found."""

from __future__ import annotations

import dataclasses
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from hovi.conditions.excess import undecided
from hovi.discrete.grid import DiscretePath
from hovi.discrete.instants import Instants
from hovi.discrete.interval_batch import Jet
from hovi.discrete.output.caution import SAMPLED, Caution, with_cautions
from hovi.discrete.trajectory import Trajectory
from hovi.optimize.ended import Iteration
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.limits.row_forces import at_instants
from hovi.planning.solver.nodal_momenta import accumulated_momenta
from hovi.planning.solver.outcome.cost_with_time import cost_of
from hovi.planning.solver.status import Status
from hovi.scene.lagrangian import PointTerms
from hovi.system.dataclass import dataclass
from hovi.system.deadline import OutOfTimeError

if TYPE_CHECKING:
    from hovi.planning.solver.central_path import CentralPath
    from hovi.planning.solver.outcome.solution_factor import SolvedBounds

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Answer:
    """The last motion of a method, or one that no solve has found.

    problem: as solved; a method may split intervals. path, cost: the motion and its action with the
        price of time.
    status, message: how the solve ended, as a word and in a sentence.
    nit: steps. n_neg: negative eigenvalues of the action's Hessian; -1 if they were not counted.
    history: one record per step.
    forces: multipliers of limits and constraints at the quadrature points, then of limits at
        instants between them; None without any.
    instants: these instants; None without any.
    prices: how far every bound moves the cost, per range, (2, kinds): see BoundedAction.prices;
        None without bounds.
    jets: (q, v, a) of the path at the quadrature points, if they were computed.
    model: the quadratic model of the last step of a solve without bounds or equations.
    central: the path of a barrier method towards the motion, for warm starts.
    solved_bounds: where a solve within limits ended; None for others.
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
    prices: Array | None = None
    jets: list[Jet] | None = None
    model: QuadraticModel | None = None
    central: CentralPath | None = None
    solved_bounds: SolvedBounds | None = None

    @classmethod
    def at(
        cls,
        problem: TrajectoryProblem,
        path: DiscretePath,
        status: Status,
        message: str,
        nit: int = 0,
        central: CentralPath | None = None,
    ) -> Answer:
        """A path with its cost and no more, where a solve has no more to say."""
        return cls(problem, path, cost_of(problem, path), status, message, nit, central=central)

    @property
    def motion(self) -> Trajectory:
        """The motion with its momenta and metadata."""
        problem = self.problem
        metadata: dict[str, Any] = {
            "cost": self.cost,
            "status": str(self.status),
            "n_neg": self.n_neg,
        }
        if problem.limits is not None and problem.limited:
            parts = problem.limits.with_excused_parts.parts
            if parts:  # under another name: `limits` are those of the whole motion
                metadata["segment_limits"] = [each.to_dict() for each in parts]
            else:
                metadata["limits"] = problem.limits.to_dict()
        if problem.conditions:
            metadata["conditions"] = [each.name for each in problem.conditions]
        clearance = problem.clearance
        if clearance is not None and (clearance.wanted or clearance.during):
            metadata["clearance"] = clearance.to_dict()
        ld = at_instants(problem, self.instants).ld
        momenta = accumulated_momenta(ld.derivatives(self.path, self.forces, self.jets))
        motion = problem.motion(self.path, momenta, metadata)
        metadata = with_cautions(metadata, _undecided(problem, motion))
        return dataclasses.replace(motion, metadata=metadata) if problem.bounds else motion


def _undecided(problem: TrajectoryProblem, motion: Trajectory) -> list[Caution]:
    """The conditions of which features may be missed along a motion."""
    try:
        sentences = [undecided(motion, each) for each in problem.bounds]
    except OutOfTimeError:  # of a motion that is no success
        return []
    return [Caution(SAMPLED, each) for each in sentences if each]
