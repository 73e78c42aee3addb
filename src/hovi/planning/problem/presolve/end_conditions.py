"""Conditions that the start or the goal violates, whatever the motion between them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import Inequality, scales
from hovi.conditions.excess import in_words
from hovi.conditions.expression import Expression
from hovi.conditions.function import Points
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.space.coordinates import Coordinates

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Bound = tuple[Array, Array]


def violated_at_end(problem: TrajectoryProblem) -> str:
    """The condition that an end violates, as a clause; "" if none does.

    With all that the end leaves free anywhere: as accelerations and torques, unless they are given.
    """
    if not problem.bounds:
        return ""
    for end, name in enumerate(("start", "goal")):
        box = _box(problem, end)
        for each in problem.bounds:
            if not each.holds_in(problem.grid)[-end]:
                continue
            sentence = _outside(each, box, name)
            if sentence:
                return sentence
    return ""


def _box(problem: TrajectoryProblem, end: int) -> dict[str, Bound]:
    """Bounds of q, v, a, tau and t at an end, (1, size) each, infinite for what is free."""
    on, k, n = problem.coordinates, problem.ld.k, problem.coordinates.nv
    free = problem.free_ends[end]
    jet = [x[end][None] for x in problem.ends]
    t = np.array([end * problem.grid.duration])
    box = {"q": _between(jet[0], _free_entries(on, free[0])), "t": (t[None], t[None])}
    for order, name in ((1, "v"), (2, "a")):
        known = order < k
        value = jet[order] if known else np.zeros((1, n))
        box[name] = _between(value, free[order] if known else np.ones(n, dtype=bool))
    box["tau"] = _between(np.zeros((1, n)), np.ones(n, dtype=bool))
    if k > 2 and problem.about_robot and not free[:3].any():
        tau = problem.scenes[-end].inverse_dynamics(jet[0], jet[1], jet[2], t)
        box["tau"] = tau, tau
    return box


def _free_entries(on: Coordinates, free: Mask) -> Mask:
    """Which entries of q are free, (nq,): of groups all where one of their coordinates is."""
    if on.vector_joints:
        return free
    entries, (rows, columns) = np.zeros(on.nq, dtype=bool), on.space.plain
    entries[rows] = free[columns]
    for factor in on.space.factors:
        entries[factor.q] = free[factor.v].any()
    return entries


def _between(value: Array, free: Mask) -> Bound:
    return np.where(free, -np.inf, value), np.where(free, np.inf, value)


def _outside(given: Inequality, box: dict[str, Bound], end: str) -> str:
    """How a condition is violated for certain, as a clause; "" if it may hold."""
    known = _values(given, box)
    if known is None:
        return ""
    low, high = (side[0] for side in given.on.at(box["t"][0][0], given.y.size))
    least, most = (side[0] for side in known)
    over = np.maximum(low - most, least - high) / scales(given)
    entry = int(np.argmax(over))
    if not over[entry] > given.tolerance:
        return ""
    value = given.shown(least[entry])
    if most[entry] > least[entry]:
        value = f"between {value} and {given.shown(most[entry])}"
    unit = f" {given.unit}" if given.unit else ""
    lower, upper = given.shown(low[entry]), given.shown(high[entry])
    return (
        f"{in_words(given, entry)} is {value}{unit} at the {end}, outside its bounds "
        f"[{lower}, {upper}]; change the {end} or widen the bounds"
    )


def _values(given: Inequality, box: dict[str, Bound]) -> Bound | None:
    """Bounds of y, (1, size) each; None where none are known."""
    y = given.y
    if isinstance(y, Expression):
        bounds = y.enclosure(box)
        return None if bounds is None else (bounds.lower, bounds.upper)
    if not all(np.isfinite(box[name][0]).all() for name in y.needs):
        return None
    at = {name: low if np.isfinite(low).all() else None for name, (low, _) in box.items()}
    values = y.values(Points(box["q"][0], box["v"][0], box["t"][0][0], at["a"], at["tau"]))
    return values, values
