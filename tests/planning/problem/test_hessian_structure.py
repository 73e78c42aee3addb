"""The numbering of unknowns, on which the width of the band depends."""

from __future__ import annotations

import numpy as np
import pytest

import hovi
from hovi.discrete.grid import Grid
from hovi.planning.problem.hessian_structure import ActionStructure, unknowns
from hovi.schemes import by_name, galerkin
from oracles.path_steps import moved, random_step
from samples.random_paths import random_path

NAMES = "galerkin-2", "taylor-midpoint", "galerkin-0", "galerkin-3", "hermite-simpson"
GRIDS = {
    "one interval": Grid.uniform(0.4, 1, by_name("galerkin-2")),
    "uniform": Grid.uniform(1.0, 6, by_name("galerkin-1")),
    "uneven": Grid(np.array([0.1, 0.3, 0.05, 0.2, 0.35]), tuple(map(by_name, NAMES))),
}


def free(n: int) -> np.ndarray:
    return np.ones((2, 2, n), dtype=bool)


@pytest.mark.parametrize("N", [1, 2, 5, 8])
def test_the_unknowns_of_a_period_are_numbered_once_and_shared_by_its_ends(N: int) -> None:
    numbers = unknowns(Grid.uniform(1.0, N, galerkin(3)), 2, free(2), periodic=True)
    assert numbers.shape == (N, 7, 2)
    np.testing.assert_array_equal(np.unique(numbers), np.arange(N * (2 + 3) * 2))
    np.testing.assert_array_equal(numbers[:, 2:4], np.roll(numbers[:, :2], -1, axis=0))


def test_a_held_coordinate_is_no_unknown_at_either_end() -> None:
    held = free(2)
    held[:, 0, 1] = False
    numbers = unknowns(Grid.uniform(1.0, 3, galerkin(1)), 2, held, periodic=True)
    assert numbers[0, 0, 1] == numbers[-1, 2, 1] == -1
    np.testing.assert_array_equal(np.unique(numbers), np.arange(-1, 3 * 3 * 2 - 1))


def test_the_band_of_a_period_is_twice_as_wide_whatever_its_length() -> None:
    widths = [
        ActionStructure(Grid.uniform(1.0, N, galerkin(3)), 2, free(2), periodic).layout.shape[1]
        for N, periodic in ((50, False), (50, True), (100, True))
    ]
    assert widths[1] == widths[2]
    assert widths[1] <= 2 * widths[0]


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
def test_every_inner_node_and_every_mode_is_one_unknown(grid: Grid) -> None:
    n, N = 2, grid.intervals
    layout = ActionStructure(grid, n).layout
    modes = sum(scheme.inner_modes for scheme in grid.schemes)
    assert layout.size == n * (2 * (N - 1) + modes)
    numbers = layout.unknowns[layout.unknowns >= 0]
    np.testing.assert_array_equal(np.unique(numbers), np.arange(layout.size))


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
def test_the_metric_is_the_square_of_the_change_of_the_acceleration(
    arm_scene: hovi.Scene, grid: Grid
) -> None:
    """T^3 int |da|^2, so that it does not depend on the grid."""
    path = random_path(grid, 2, seed=4)
    ends = [hovi.State(path.q[i], path.v[i]) for i in (0, -1)]
    ld = hovi.DiscreteLagrangian(arm_scene.effort_lagrangian(), grid)
    problem = hovi.TrajectoryProblem(ld, *ends)
    step = random_step(problem, 0)
    after = moved(problem, path, step)
    total = 0.0
    for (*_, a), (*_, b), w in zip(ld.jets(path), ld.jets(after), ld.point_weights, strict=True):
        total += float(w @ ((b - a) ** 2).sum(axis=1))
    found = np.einsum("kin,kij,kjn->", step, problem.structure.metric["nodal"], step)
    assert found == pytest.approx(grid.duration**3 * total, rel=1e-9)
