"""The choice of a method: the first one that supports the problem."""

from __future__ import annotations

from collections.abc import Iterator

from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.methods.method import ProblemMethod
from hovi.planning.solver.methods.trust_region import TrustRegion


def all_methods() -> Iterator[ProblemMethod]:
    """In order of cost; every problem is supported by one of them.

    Each is imported when it is its turn: most problems need the first one only.
    """
    yield TrustRegion()
    from hovi.planning.solver.methods.middle_first import MiddleFirst

    yield MiddleFirst()
    from hovi.planning.solver.methods.free_first import FreeFirst

    yield FreeFirst()
    from hovi.planning.solver.methods.interior_point import InteriorPoint

    yield InteriorPoint()


def method_for(problem: TrajectoryProblem) -> ProblemMethod:
    """The first method that supports a problem."""
    return next(method for method in all_methods() if method.supports(problem))
