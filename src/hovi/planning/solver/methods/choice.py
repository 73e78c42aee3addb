"""Which method solves a problem: the first that suits it."""

from __future__ import annotations

from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.methods.augmented_lagrangian import AugmentedLagrangian
from hovi.planning.solver.methods.interior_point import InteriorPoint
from hovi.planning.solver.methods.method import Method
from hovi.planning.solver.methods.trust_region import TrustRegion

METHODS: tuple[Method, ...] = (TrustRegion(), AugmentedLagrangian(), InteriorPoint())
"""From the one that costs least; every problem is suited by one of them."""


def method_for(problem: TrajectoryProblem) -> Method:
    """The first method that suits a problem."""
    return next(method for method in METHODS if method.suits(problem))
