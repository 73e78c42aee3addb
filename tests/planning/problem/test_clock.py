"""Clocks move times with the parts they belong to, and back."""

from __future__ import annotations

import numpy as np
import pytest

from hovi.discrete.grid import Grid
from hovi.planning.problem.clock import Clock
from hovi.schemes import galerkin

CLOCK = Clock((0.5, 0.0, 0.25))
NOW, LENGTHS = np.array([1.0, 2.0]), np.array([3.0, 0.5])
GRID = Grid(np.array([0.25, 0.25, 0.5, 0.5, 1.0, 1.0, 0.25]), (galerkin(2),) * 7)


def test_times_move_with_the_ends_of_the_parts_and_back() -> None:
    knots, moved = CLOCK.knots(NOW), CLOCK.knots(LENGTHS)
    np.testing.assert_allclose(knots, [0.0, 0.5, 1.5, 1.5, 3.5, 3.75])
    np.testing.assert_array_equal(CLOCK.times(knots, NOW, LENGTHS), moved)
    t = np.linspace(0.0, 3.75, 41)
    there = CLOCK.times(t, NOW, LENGTHS)
    assert (np.diff(there) > 0).all()
    np.testing.assert_allclose(CLOCK.times(there, LENGTHS, NOW), t, atol=1e-15)
    assert CLOCK.duration(LENGTHS) == 4.25


def test_intervals_belong_to_parts_and_stretch_with_them() -> None:
    np.testing.assert_array_equal(CLOCK.nodes(GRID, NOW), [[2, 4], [4, 6]])
    np.testing.assert_array_equal(CLOCK.parts(GRID, NOW), [-1, -1, 0, 0, 1, 1, -1])
    ratios = CLOCK.ratios(GRID, NOW, LENGTHS)
    np.testing.assert_allclose(ratios, [1.0, 1.0, 3.0, 3.0, 0.25, 0.25, 1.0])
    longer = CLOCK.grid(GRID, NOW, LENGTHS)
    np.testing.assert_allclose(longer.t, CLOCK.times(GRID.t, NOW, LENGTHS))


@pytest.mark.parametrize("given", [(True, False), (False, True), (True, True), (False, False)])
def test_a_length_that_is_given_leaves_all_times_where_they_are(given: tuple[bool, bool]) -> None:
    fixed = np.array(given)
    fewer = CLOCK.with_given(NOW, fixed)
    assert len(fewer.given) == 3 - fixed.sum()
    lengths = np.where(fixed, NOW, LENGTHS)
    t = np.linspace(0.0, 3.75, 41)
    moved = fewer.times(t, NOW[~fixed], lengths[~fixed])
    np.testing.assert_allclose(moved, CLOCK.times(t, NOW, lengths), atol=1e-15)
    assert fewer.duration(lengths[~fixed]) == pytest.approx(CLOCK.duration(lengths))


def test_the_times_of_a_single_part_grow_with_it_as_its_rates_say() -> None:
    clock = Clock((0.5, 0.25))
    length = clock.length(GRID)
    assert length == pytest.approx(3.0)
    step = 1e-6
    later, sooner = (clock.grid(GRID, length, length + e).t for e in (step, -step))
    np.testing.assert_allclose((later - sooner) / (2 * step), clock.rates(GRID), atol=1e-9)


def test_a_single_part_may_be_the_whole_motion() -> None:
    assert Clock().whole
    assert not Clock.of_parts(2).whole
    np.testing.assert_allclose(Clock().grid(GRID, 3.75, 7.5).steps, 2.0 * GRID.steps)
