"""The choice of a method: the first one that supports the problem."""

from __future__ import annotations

from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.methods.augmented_lagrangian import AugmentedLagrangian
from hovi.planning.solver.methods.interior_point import InteriorPoint
from hovi.planning.solver.methods.lagrange_newton import LagrangeNewton
from hovi.planning.solver.methods.method import Method
from hovi.planning.solver.methods.trust_region import TrustRegion

METHODS: tuple[Method, ...] = (
    TrustRegion(),
    LagrangeNewton(),
    AugmentedLagrangian(),
    InteriorPoint(),
)
"""In order of cost; every problem is supported by one of them."""


def method_for(problem: TrajectoryProblem) -> Method:
    """The first method that supports a problem."""
    return next(method for method in METHODS if method.supports(problem))
