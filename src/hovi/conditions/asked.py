"""The conditions that a problem is given: checked, at nodes, and at all times."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from hovi.conditions.condition import (
    Condition,
    Equation,
    EquationAlong,
    Inequality,
    with_function,
)
from hovi.conditions.places import Along, AtNode, AtTimes
from hovi.conditions.sets import Between
from hovi.discrete.cells import INSTANTS
from hovi.discrete.grid import Grid
from hovi.errors import InputError
from hovi.robot.space.coordinates import Coordinates
from hovi.scene.segmented_lagrangian import NODE_TOLERANCE

Conditions = Sequence[Condition[Any, Any]]


def as_conditions(given: Any) -> tuple[Condition[Any, Any], ...]:
    """A condition, or several, as a tuple. Raises InputError for others, or two of one name."""
    several = (given,) if isinstance(given, Condition) else given
    if not isinstance(several, Sequence) or not all(isinstance(x, Condition) for x in several):
        raise InputError(f"conditions must be a list of hovi.Condition, got {given!r:.200}.")
    names = [each.name for each in several]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two conditions have the name {name!r}; give each its own `name`.")
    return tuple(several)


def checked(given: Any, coordinates: Coordinates) -> tuple[Condition[Any, Any], ...]:
    """The conditions, each `with_function` of a robot's coordinates, whose errors it raises."""
    return tuple(with_function(each, coordinates) for each in as_conditions(given))


def require_ranges(given: Conditions, duration: float) -> None:
    """Raise InputError for bounds that leave no value at a time of a motion, or fail there."""
    for each in given:
        if isinstance(each.on, Between) and each.on.varies:
            empty = empty_range(each.on, duration)
            if empty is not None:
                t, low, high = empty
                raise InputError(
                    f"condition {each.name!r} has an empty range at t = {t:.4g} s: [{low:.6g}, "
                    f"{high:.6g}]; lower must be less than upper all along the motion."
                )


def require_parts(given: Conditions, grid: Grid) -> None:
    """Raise InputError for a condition on a part of a motion that begins or ends at no node."""
    T = grid.duration
    for each in given:
        for time in each.during or ():
            nearest = float(grid.t[np.argmin(np.abs(grid.t - time))])
            if 0.0 < time < T and abs(nearest - time) > NODE_TOLERANCE * T:
                raise InputError(
                    f"condition {each.name!r} holds from or until {time:g} s, where the grid needs "
                    f"a node, and the nearest is at {nearest:g} s of {T:g} s: move a node there by "
                    "`grid.with_nodes`."
                )


@lru_cache(maxsize=64)
def empty_range(on: Between, duration: float) -> tuple[float, float, float] | None:
    """The first time at which a range is empty, and its bounds, of INSTANTS; None if none is."""
    t = np.linspace(0.0, duration, INSTANTS + 1)
    low, high = np.broadcast_arrays(*on.at(t, None))
    found = np.argwhere(low >= high)
    if len(found) == 0:
        return None
    i, entry = found[0]
    return float(t[i]), float(low[i, entry]), float(high[i, entry])


def asked_at_nodes(given: Conditions, grid: Grid) -> tuple[Equation, ...]:
    """The equations at the nodes of a grid. Raises InputError where the grid has no such node."""
    found = []
    for each in given:
        nodes = set[int]()
        for time in times_of([each]):
            node = int(np.argmin(np.abs(grid.t - time)))
            nearest = float(grid.t[node])
            if abs(nearest - time) > NODE_TOLERANCE * grid.duration:
                raise InputError(
                    f"condition {each.name!r} is asked at {time:g} s, where the grid needs a node, "
                    f"and the nearest is at {nearest:g} s of {grid.duration:g} s: choose a time "
                    "within the motion, or move a node there by `grid.with_nodes`."
                )
            if node not in nodes:  # times of one node are one
                nodes.add(node)
                found.append(dataclasses.replace(each, where=AtNode(node, nearest)))
    return tuple(found)


def times_of(given: Conditions) -> list[float]:
    """The times at which grids need nodes, in [s]."""
    places = (each.where for each in given if isinstance(each.where, AtTimes))
    return [float(time) for place in places for time in np.asarray(place.times)]


def bounded_of(given: Conditions) -> tuple[Inequality, ...]:
    """Those that hold at all times."""
    return tuple(each for each in given if isinstance(each.on, Between))


def along_of(given: Conditions) -> tuple[EquationAlong, ...]:
    """The equations that hold at all times."""
    return tuple(each for each in given if isinstance(each.where, Along))


def need_torques(bounded: Sequence[Inequality]) -> bool:
    """Whether one of them depends on torques."""
    return any("tau" in each.y.needs for each in bounded)
