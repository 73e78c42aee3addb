"""Grids: times, batches of intervals, and invalid arguments."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from hovi.discrete.grid import DiscretePath, Grid
from hovi.errors import InputError
from hovi.schemes import Scheme, by_name, galerkin, hermite_simpson, taylor_midpoint

Array = npt.NDArray[np.float64]


@pytest.mark.parametrize("intervals", [1, 2, 3, 7, 49, 1000])
def test_a_uniform_grid_divides_the_duration(intervals: int) -> None:
    grid = Grid.uniform(0.7, intervals, galerkin(1))
    assert grid.intervals == intervals
    np.testing.assert_allclose(grid.t, np.linspace(0.0, 0.7, intervals + 1), rtol=1e-15)
    assert grid.duration == pytest.approx(0.7, rel=1e-15)
    assert grid.t[0] == 0.0
    assert grid.schemes == (grid.schemes[0],) * intervals


@pytest.mark.parametrize("duration", [1e-300, 1e-12, 1e12, 1e308])
def test_steps_whose_powers_overflow_are_refused(duration: float) -> None:
    with pytest.raises(InputError, match="must lie between 1e-12 and 1e\\+09 s"):
        Grid.uniform(duration, 10, galerkin(1))


def test_steps_may_differ() -> None:
    steps = np.array([0.3, 0.05, 0.9])
    grid = Grid(steps, (galerkin(0), hermite_simpson(), galerkin(2)))
    np.testing.assert_allclose(grid.t, [0.0, 0.3, 0.35, 1.25], rtol=1e-15)
    assert grid.duration == grid.t[-1]
    assert grid.inner_modes == 2


def test_a_whole_number_of_intervals_may_be_a_float() -> None:
    assert Grid.uniform(1.0, 16.0, galerkin(0)).intervals == 16  # type: ignore[arg-type]


def test_groups_hold_every_interval_once_with_its_scheme() -> None:
    names = ["galerkin-1", "taylor-midpoint", "galerkin-1", "galerkin-0", "taylor-midpoint"]
    grid = Grid(np.ones(5), tuple(by_name(name) for name in names))
    found = {i: scheme.name for scheme, index in grid.groups for i in index}
    assert found == dict(enumerate(names))
    assert len(grid.groups) == 3


def test_schemes_of_one_name_with_different_tables_are_distinguished() -> None:
    one, other = galerkin(0), taylor_midpoint()
    namesake = Scheme(one.name, other.order, other.points, other.weights, other.table)
    grid = Grid(np.ones(2), (one, namesake))
    for scheme, index in grid.groups:
        for i in index:
            np.testing.assert_array_equal(scheme.table, grid.schemes[i].table)


def test_chosen_intervals_are_bisected() -> None:
    grid = Grid(np.array([0.5, 0.25, 1.0]), (galerkin(0), hermite_simpson(), galerkin(2)))
    fine = grid.halved(np.array([True, False, True]))
    np.testing.assert_array_equal(fine.steps, [0.25, 0.25, 0.25, 0.5, 0.5])
    names = [scheme.name for scheme in fine.schemes]
    assert names == ["galerkin-0"] * 2 + ["hermite-simpson"] + ["galerkin-2"] * 2
    assert fine.duration == grid.duration
    np.testing.assert_array_equal(grid.halved(np.zeros(3, dtype=bool)).steps, grid.steps)


def test_a_grid_is_immutable() -> None:
    steps = np.array([0.5, 0.5])
    grid = Grid(steps, (galerkin(0),) * 2)
    steps[0] = 7.0
    assert grid.duration == 1.0
    with pytest.raises(ValueError, match="read-only"):
        grid.steps[0] = 7.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        grid.steps = steps  # type: ignore[misc]


@pytest.mark.parametrize("duration", [0.0, -1.0, np.nan, np.inf, -np.inf])
def test_an_invalid_duration_is_refused(duration: float) -> None:
    with pytest.raises(InputError, match="the duration must be positive and finite"):
        Grid.uniform(duration, 4, galerkin(0))


@pytest.mark.parametrize("intervals", [0, -3, 2.5, np.nan, np.inf, True, "4", None])
def test_an_invalid_number_of_intervals_is_refused(intervals: Any) -> None:
    with pytest.raises(InputError, match=r"intervals must be (from 1 to|a whole number)"):
        Grid.uniform(1.0, intervals, galerkin(0))


@pytest.mark.parametrize("bad", [0.0, -0.1, np.nan, np.inf])
def test_an_invalid_step_is_refused(bad: float) -> None:
    with pytest.raises(InputError, match="every step of a grid must be positive and finite"):
        Grid(np.array([0.1, bad, 0.1]), (galerkin(0),) * 3)


@pytest.mark.parametrize(("steps", "schemes"), [(2, 3), (3, 2), (0, 0), (1, 0)])
def test_every_interval_needs_one_step_and_one_scheme(steps: int, schemes: int) -> None:
    with pytest.raises(InputError, match="one step and one scheme per interval"):
        Grid(np.ones(steps), (galerkin(0),) * schemes)


def test_steps_must_be_one_dimensional() -> None:
    with pytest.raises(InputError, match="one step and one scheme per interval"):
        Grid(np.ones((2, 2)), (galerkin(0),) * 2)


def test_a_path_counts_its_intervals() -> None:
    path = DiscretePath(
        np.zeros((4, 2)), np.zeros((4, 2)), np.zeros((3, 2, 2)), np.zeros((3, 0, 2))
    )
    assert path.intervals == 3


def test_a_range_of_schemes_is_named_by_the_fewest_and_the_most_modes() -> None:
    steps, few, some, many = np.full(3, 0.1), galerkin(2), galerkin(3), galerkin(10)
    assert Grid.uniform(1.0, 4, few).scheme_range == "galerkin-2"
    assert Grid(steps, (many, few, some)).scheme_range == "galerkin-2 to galerkin-10"


def test_grids_are_equal_with_the_same_steps_and_schemes_alone() -> None:
    grid = Grid.uniform(1.0, 4, galerkin(2))
    assert grid.equals(Grid.uniform(1.0, 4, galerkin(2)))
    others = Grid.uniform(1.1, 4, galerkin(2)), Grid.uniform(1.0, 5, galerkin(2))
    more_points = Grid.uniform(1.0, 4, galerkin(2, points=6))
    assert not any(grid.equals(other) for other in (*others, more_points))
