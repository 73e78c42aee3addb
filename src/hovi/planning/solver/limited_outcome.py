"""What became of a problem with limits."""

from __future__ import annotations

from dataclasses import dataclass

from hovi.discrete.grid import DiscretePath
from hovi.optimize.trust_region import Iteration, Stop
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.scene.lagrangian import PointTerms


@dataclass(frozen=True, eq=False)
class LimitedOutcome:
    """How a search between limits ended.

    problem: the problem as solved, with the intervals that had to be split.
    forces: of the limits and equations on the motion, at the quadrature points.
    reason: why there is no motion, in a sentence without its end; "" where there is one.
    excess: largest share of a range by which a limit is exceeded anywhere.
    """

    problem: TrajectoryProblem
    x: DiscretePath
    value: float
    stop: Stop
    iterations: int
    history: list[Iteration]
    n_neg: int
    forces: list[PointTerms] | None = None
    reason: str = ""
    excess: float = 0.0
