"""A guess whose orientations turn further in an interval than its chart reaches is no start."""

from __future__ import annotations

import numpy as np
import pytest

import hovi
from hovi.errors import InputError
from oracles.path_steps import moved, random_step


@pytest.mark.parametrize("size", [1e2, 1e5, 1e8, 1e100, 1e160, 1e300])
@pytest.mark.parametrize("name", ["galerkin-1x5", "hermite-simpson"])
def test_a_path_far_beyond_its_charts_is_refused_or_diverges(name: str, size: float) -> None:
    """There, the charts hold NaN, which is neither below nor above any turn."""
    task = hovi.load_task(hovi.example("spacecraft_reorients"))
    grid = hovi.Grid.uniform(8.0, 4, hovi.schemes.by_name(name))
    ld = hovi.DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    problem = hovi.TrajectoryProblem(ld, task.start, task.goal)
    with np.errstate(over="ignore", invalid="ignore"):
        path = moved(problem, problem.guess("cubic"), size * random_step(problem, 0))
        turns = ld.turns(path)
        assert turns.max() > 2 * np.pi
        assert not np.isnan(turns).any()
        if all(np.isfinite(each).all() for each in path.arrays):
            assert hovi.solve(problem, path).status == "diverged"
        else:
            with pytest.raises(InputError, match="must be finite"):
                hovi.solve(problem, path)
