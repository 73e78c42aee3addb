"""The numbering of unknowns, on which the width of the band depends."""

from __future__ import annotations

import numpy as np
import pytest

from hovi.discrete.grid import Grid
from hovi.planning.problem.hessian_structure import ActionStructure, unknowns
from hovi.schemes import galerkin


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
