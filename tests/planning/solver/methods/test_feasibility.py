"""Motions that a search falls back on."""

from __future__ import annotations

import numpy as np

import hovi
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.optimize.trust_region import Options, Stop
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.methods.bounded_search import BoundedSearch
from hovi.planning.solver.methods.feasibility import unlimited_minimum
from hovi.planning.solver.solver import solve_on_grid
from hovi.schemes import galerkin


def test_a_minimum_that_no_limit_touches_is_one_within_them(two_link: hovi.Robot) -> None:
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, 12, galerkin(2)))
    ends = hovi.State([0.0, 0.0]), hovi.State([0.5, 0.4])
    free = solve_on_grid(TrajectoryProblem(ld, *ends))
    limits = as_limits(two_link, {"base": "none", "v": 40.0, "tau": 500.0})
    problem = TrajectoryProblem(ld, *ends, limits)
    search = BoundedSearch(problem, limits, Options(), None, free.trajectory.path)
    found = unlimited_minimum(search, free.trajectory.path)
    assert found.stop is Stop.STATIONARY
    assert found.feasible
    assert found.outputs.value == free.cost
    assert search.negative_eigenvalues(found) == 0
    assert not found.barrier.multipliers.any()
    assert np.array_equal(found.x.q, free.trajectory.q)
