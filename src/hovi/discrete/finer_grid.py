"""The grid of the solution that errors are estimated by: more inner modes on the same intervals."""

from __future__ import annotations

from hovi.discrete.grid import Grid
from hovi.errors import InputError
from hovi.schemes import galerkin
from hovi.schemes.galerkin_table import MAX_INNER_MODES

MORE_MODES = 2
"""Inner modes that the finer solution has more: with one more the costs of both may be off by as
much to the same side, and their difference would say nothing."""


def finer_grid(grid: Grid) -> Grid:
    """The same intervals, each with two more inner modes than its scheme has.

    Raises InputError where the scheme has too many already.
    """
    if grid.inner_modes + MORE_MODES > MAX_INNER_MODES:
        raise InputError(
            f"errors are estimated for schemes of up to {MAX_INNER_MODES - MORE_MODES} inner "
            f"modes, not {grid.inner_modes}; use more intervals instead."
        )
    tables = {id(s): galerkin(s.inner_modes + MORE_MODES) for s in set(grid.schemes)}
    return Grid(grid.steps, tuple(tables[id(s)] for s in grid.schemes))
