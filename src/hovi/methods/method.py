"""Methods that minimise programs: what they are given, and what they return."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.barrier import Bounds
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Ended, Iteration, Outputs, Reason
from hovi.optimize.program import Program
from hovi.optimize.quadratic_program import QuadraticProgram
from hovi.optimize.start import Start

__all__ = [
    "Bounds",
    "Criteria",
    "Ended",
    "Iteration",
    "Method",
    "Outputs",
    "Program",
    "QuadraticProgram",
    "Reason",
    "Report",
    "Start",
]

Array = npt.NDArray[np.float64]
X = TypeVar("X")
Report = Callable[[int, float], None]
"""Called with the number of each step and the objective after it."""


class Method(ABC):
    """A method that minimises programs: an objective with bounded outputs and equations.

    What it returns is judged apart from it: a motion counts as a minimum only if the conditions of
    Karush, Kuhn and Tucker hold there with its forces, whatever the method says. What a program
    bounds may change between two calls: rows of limits at all times become finer, and bounds are
    tightened where a limit does not hold between the points.
    """

    @abstractmethod
    def minimize(
        self,
        program: Program[X],
        start: Start[X, Array],
        criteria: Criteria,
        report: Report | None = None,
    ) -> Ended[X, Array]:
        """A minimum of the objective within its bounds, or the best point that was found.

        start: the first point x, which may violate bounds and equations, and the forces z of a
            similar program, shape (R,), or None.
        criteria: `decrease` at which to end, relative to the objective, and `max_iterations`. The
            time limit is in force where `program` is evaluated, and raises what ends a solve.
        Returns x, the outputs there, and the forces z of the bounds, (R,), with one record per
        step in `steps` and the reason in `why`: STATIONARY where it is to be judged as a minimum.
        z > 0 holds an upper bound and z < 0 a lower one: the gradient of

            objective + sum weights z y

        vanishes, that of equations included, whose multipliers are those of the program.
        """
