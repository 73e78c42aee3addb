"""The parts of expressions that are functions of time alone, and where they change."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from hovi.effects.expressions.enclosure import Enclosed, Enclosure
from hovi.effects.expressions.interval_rules import Array, Mask
from hovi.system.dataclass import dataclass

CHANGE = 2.0
"""Largest change of the argument of a function of time in an interval, as in exp(x) or sin(x)."""
LEAST_FRACTION = 2.0**-20
"""Shortest part of a motion that is looked at, relative to its duration."""
SMALL_PART = 1e-5
"""What a function may deviate from a line within a part of time, integrated, relative to the
integral of its absolute value."""
MAX_PARTS = 1000
"""Maximum number of parts into which intervals are split."""


@dataclass(frozen=True, eq=False)
class TimePart:
    """A function f(t), with bounds on it and its derivative over intervals of time.

    name: of what it belongs to, for messages.
    """

    name: str
    value: Enclosure
    rate: Enclosure

    def deviation(self, begin: Array, end: Array, peaks: Array) -> tuple[Array, Array]:
        """How far f may be from a line in each interval, and its largest absolute value, (P,) each.

        0 where it changes so little that an interval resolves it. peaks: see Enclosure.
        """
        box = [(begin[:, None], end[:, None])]
        bounds = self.value(box, CHANGE, peaks)
        size = np.maximum(np.abs(bounds.lower), np.abs(bounds.upper))[:, 0]
        away = from_line(bounds, self.rate(box, CHANGE), (end - begin)[:, None])[:, 0]
        return np.where(bounds.calm, 0.0, away), size


def from_line(bounds: Enclosed, rates: Enclosed, steps: Array) -> Array:
    """How far a function may be from the line between its ends within boxes, shape (P, m).

    h (max f' - min f') / 4 where it is continuous, and max f - min f. rates: bounds of f' along the
    boxes. steps: h, shape (P, 1).
    """
    smooth = np.where(bounds.jumps[:, None], np.inf, 0.25 * steps * rates.width)
    return np.asarray(np.minimum(bounds.width, smooth))


def time_parts(name: str, expressions: Sequence[ca.SX], t: ca.SX) -> list[TimePart]:
    """The largest parts of expressions that depend on t alone, and on more than its powers."""
    whole = ca.vertcat(*(ca.vec(each) for each in expressions))
    if not ca.depends_on(whole, t):
        return []
    parts = []
    for part in ca.extract_parametric(whole, t)[2]:
        value = Enclosure(ca.Function("part", [t], [part]))
        if value.bends and value.known and ca.depends_on(part, t):
            rate = Enclosure(ca.Function("rate", [t], [ca.densify(ca.jacobian(part, t))]))
            parts.append(TimePart(name, value, rate))
    return parts


@dataclass(frozen=True, eq=False)
class Bisection:
    """Intervals of time in which functions are resolved.

    nodes: their ends, ascending, in [s]. fault: what is not resolved, as a clause; "" if nothing.
    """

    nodes: Array
    fault: str = ""


def bisected(parts: Sequence[TimePart], nodes: Array) -> Bisection:
    """Bisect intervals of time until functions change little in each.

    nodes: ends of the intervals, ascending, in [s].
    """
    peaks = [np.zeros(part.value.size) for part in parts]
    least, known = LEAST_FRACTION * float(nodes[-1] - nodes[0]), len(nodes)
    while True:
        wrong = np.array([_unresolved(*each, nodes) for each in zip(parts, peaks, strict=True)])
        cut = wrong.any(axis=0)
        short = cut & (np.diff(nodes) < 2 * least)
        if short.any():
            return Bisection(nodes, _too_fast(parts, wrong, nodes, int(np.argmax(short))))
        if not cut.any():
            return Bisection(nodes)
        if len(nodes) + np.count_nonzero(cut) > known + MAX_PARTS:
            return Bisection(nodes, _too_often(parts, wrong, nodes))
        middle = 0.5 * (nodes[:-1] + nodes[1:])
        nodes = np.sort(np.concatenate([nodes, middle[cut]]))


def _unresolved(part: TimePart, peaks: Array, nodes: Array) -> Mask:
    """In which intervals a function changes too much, shape (N,)."""
    steps = np.diff(nodes)
    away, size = part.deviation(nodes[:-1], nodes[1:], peaks)
    with np.errstate(invalid="ignore", over="ignore"):
        whole = float(np.sum(steps * np.where(np.isfinite(size), size, 0.0)))
        return np.asarray(away * steps > SMALL_PART * whole)


def _too_fast(parts: Sequence[TimePart], wrong: Array, nodes: Array, i: int) -> str:
    name = parts[int(np.argmax(wrong[:, i]))].name
    return (
        f"{name} changes within less than {nodes[i + 1] - nodes[i]:.2g} s at t = {nodes[i]:.6g} s"
    )


def _too_often(parts: Sequence[TimePart], wrong: Array, nodes: Array) -> str:
    which = int(np.argmax(wrong.sum(axis=1)))
    i = int(np.argmax(wrong[which]))
    return (
        f"{parts[which].name} changes within less than {nodes[i + 1] - nodes[i]:.2g} s too often "
        f"for {MAX_PARTS:,} intervals"
    )
