"""A motion of the discrete problem itself, whatever happens between the points of its grid.

For claims about that problem: its equations, its momenta, its costs. Only here do tests know how a
problem is solved on one grid; all others go through `hovi.solve` and `hovi.plan`.
"""

import dataclasses
from typing import Any

import numpy as np

from hovi.optimize.criteria import Criteria
from hovi.optimize.interior_point import minimize_bounded
from hovi.optimize.start import Start
from hovi.planning.solver.solver import solve_on_grid

__all__ = ["cost_with_bounds", "solve_on_grid"]


def cost_with_bounds(known: Any, **moved: np.ndarray) -> float:
    """The least cost near a solution within limits, on the same rows with other bounds."""
    path, solved = known.solved_bounds.sharpened(known.trajectory.path)
    objective = solved.objective.with_fixed_rows()
    objective.bounds = dataclasses.replace(objective.bounds, **moved)
    ended = minimize_bounded(objective, Start(path), Criteria(barrier=1e-12, max_iterations=200))
    assert ended.why == "stationary"
    return float(ended.value)
