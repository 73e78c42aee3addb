"""Every problem is solved by the first method that supports it; methods agree."""

from __future__ import annotations

import numpy as np
import pytest

from hovi.errors import InputError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.methods.augmented_lagrangian import AugmentedLagrangian
from hovi.planning.solver.methods.choice import all_methods, method_for
from hovi.planning.solver.methods.interior_point import InteriorPoint
from hovi.planning.solver.methods.lagrange_newton import LagrangeNewton
from hovi.planning.solver.methods.method import Method
from hovi.planning.solver.methods.trust_region import TrustRegion
from hovi.planning.solver.solver import solve_on_grid
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task_plan import plan_task
from hovi.robot.bundled_models import example

EXPECTED = {
    "two_link_reach": TrustRegion,
    "cart_pole_swing_up": LagrangeNewton,
    "ur5_reach": InteriorPoint,
}


def problem_of(name: str, **options: object) -> TrajectoryProblem:
    solution = plan_task(
        load_task(example(name)), max_iterations=1, starts=1, continuation=False, **options
    )
    assert solution.problem is not None
    return solution.problem


@pytest.mark.parametrize(("name", "kind"), EXPECTED.items())
def test_the_first_method_that_suits_is_chosen(name: str, kind: type[Method]) -> None:
    limits = "urdf" if kind is InteriorPoint else "none"
    assert isinstance(method_for(problem_of(name, limits=limits)), kind)


def test_methods_that_suit_the_same_problem_find_the_same_minimum() -> None:
    problem = problem_of("two_link_reach", limits="none")
    supporting = [method for method in all_methods() if method.supports(problem)]
    assert [type(method) for method in supporting] == [TrustRegion, AugmentedLagrangian]
    found = [solve_on_grid(problem, method=method) for method in supporting]
    assert all(solution.success for solution in found)
    assert found[1].cost == pytest.approx(found[0].cost, rel=1e-11)


def test_inactive_limits_change_nothing() -> None:
    free = solve_on_grid(problem_of("two_link_reach", limits="none"))
    wide = {"base": "none", "v": 1e3 * float(np.abs(free.trajectory.v).max())}
    between = solve_on_grid(problem_of("two_link_reach", limits=wide))
    assert between.success
    assert between.cost == pytest.approx(free.cost, rel=1e-6)


def test_an_unsuitable_method_is_refused() -> None:
    with pytest.raises(InputError, match="method TrustRegion does not support this problem"):
        solve_on_grid(problem_of("ur5_reach", limits="urdf"), method=TrustRegion())
