"""Programs: an objective with bounds on outputs and with equations, as methods see it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.barrier import Bounds
from hovi.optimize.ended import Outputs
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.optimize.quadratic_program import QuadraticProgram

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
X = TypeVar("X")


class Refinement(NamedTuple):
    """Outputs that took the place of others.

    kept: numbers of those that remain, ascending; the new ones follow them.
    origin: number of the former output at the place of each new one; -1 for none.
    """

    kept: Index
    origin: Index


class Program(ABC, Generic[X]):
    """An objective f(x) with bounded outputs, lower <= y(x) <= upper, and equations c(x) = 0.

    x: a point, such as a motion on a grid. A step s has the unknowns of a model as its entries, and
        `retract` says where it leads.
    bounds: of the R outputs, in units of their ranges, with their weights w in the Lagrangian
        f + sum w z y + l.c. The multipliers l of equations are a part of the program: `outputs` and
        models have the terms l.c, and `hold` changes l.
    """

    bounds: Bounds
    blocked: bool = False
    """Whether refining found outputs so far from their bounds that the iteration is to end."""
    reopens: bool = False
    """Whether new outputs may be outside their bounds, which an iteration then recovers from."""
    radii: tuple[float, float] = 50.0, 1000.0
    """First radius of the trust region, as the norm of a step in the metric, in a cold start and in
    a warm one, which is near to a solution of a similar problem."""

    @abstractmethod
    def outputs(self, x: X) -> Outputs:
        """The objective and the outputs at x."""

    @abstractmethod
    def model(self, x: X, sigma: Array, rho: Array, multipliers: Array) -> QuadraticModel:
        """The objective's quadratic model plus sum of weights (rho dy + sigma dy^2/2).

        multipliers: weights of the outputs' curvature, shape (R,).
        """

    @property
    def may_be_concave(self) -> bool:
        """Whether models may leave out negative curvature of outputs."""
        return False

    def model_without_concavity(self, x: X) -> QuadraticModel | None:
        """The last model, at x, without negative curvature of outputs; None if it has none.

        It takes the place of the last model, and need not be convex: the objective may not be.
        """
        return None

    @abstractmethod
    def push(self, step: Array, model: QuadraticModel) -> Array:
        """First-order change of the outputs in a step of the last model, shape (R,)."""

    @abstractmethod
    def pull(self, forces: Array, model: QuadraticModel) -> Array:
        """Gradient of sum of weights (forces y) in the unknowns of the last model."""

    @abstractmethod
    def accept(self, step: Array, model: QuadraticModel) -> None:
        """Take note of a step of the last model, for lifted variables, if any."""

    @abstractmethod
    def retract(self, x: X, step: Array, model: QuadraticModel) -> X:
        """The point that a step of a model leads to."""

    def quadratic(
        self, x: X, forces: Array, sigma: Array | None = None, rho: Array | None = None
    ) -> QuadraticProgram:
        """The quadratic program at x, with the exact Hessian of the Lagrangian.

        forces: z of the outputs, shape (R,), whose curvature the Hessian has. sigma, rho: of terms
        as in `model` that are added to it, (R,); none if None.
        """
        raise NotImplementedError

    def hold(self, change: Array) -> None:
        """Add a change to the multipliers of equations, shape (E,)."""

    def let_go(self) -> None:
        """Take the last change of `hold` back, exactly."""

    def residual(self, x: X) -> Array:
        """c of equations at x, shape (E,)."""
        return np.zeros(0)

    def satisfies_equations(self, x: X) -> bool:
        """Whether equations hold at x to their tolerance; true without any."""
        return True

    def refine(self, x: X, level: float, forces: Array | None = None) -> Refinement | None:
        """Replace outputs by others, which come after those that remain and bound x less.

        Returns None if nothing changed.
        level: mean product z gap at x, relative to the mean density of the objective.
        forces: |z| of the outputs, relative to the same; None for the level over their gaps.
        """
        return None

    def tighten(self, x: X, level: float) -> bool:
        """Change bounds for what x violates that outputs do not show; whether any changed.

        level: barrier parameter at x, relative to the mean density of the objective.
        """
        return False

    def refine_at_once(self, x: X) -> Refinement | None:
        """The same after any step, for outputs that cannot wait for a smaller product."""
        return None
