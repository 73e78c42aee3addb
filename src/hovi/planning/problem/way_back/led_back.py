"""Starts that are led back inside their limits, and ends that are refused."""

from __future__ import annotations

from hovi.conditions.joint_quantity import QUANTITIES
from hovi.planning.problem.limits import KINDS
from hovi.planning.problem.way_back.end_state import SHORTEST, STRIDE, EndState, Over
from hovi.planning.problem.way_back.excused import Excused
from hovi.robot.space.angle_ranges import beyond_in_degrees

AVAILABLE_FRACTION = 0.5
"""Fraction of the accelerations available at the start that leading it back may ask for."""
MOST_EXCESS = 0.02
"""Largest excess that is led back, as a fraction of the range of positions or of another bound."""


def led_back(start: EndState, strict: bool) -> tuple[tuple[Excused, ...], str]:
    """What is excused of a start, or why it is refused, as a clause.

    strict: whether nothing is excused.
    """
    excused = list[Excused]()
    outside_first = sorted(start.over(), key=lambda over: over.now <= start.slack(over))
    for over in outside_first:
        if not start.is_forced(over, AVAILABLE_FRACTION):
            continue
        found = None if strict else _excused(start, over)
        if found is None and KINDS[over.kind] == "tau":
            continue  # which `unavoidable_torque` refuses
        if found is None:
            beyond = (
                ""
                if strict
                else f", and a start is led back from up to {_most(start, over):.3g} beyond"
            )
            return (), _refusal(start, over, "start", 1, beyond)
        excused.append(found)
    return tuple(excused), ""


def refused(end: EndState, name: str, passed: bool = False) -> str:
    """What of a goal is outside its limits, or cannot but come from or lead outside; "" if nothing.

    A clause. A goal inside its limits may be on its way out of them, one at a bound may not.
    name: of the state. passed: whether the motion goes on after it.
    """
    for direction in (-1, 1):
        for over in end.over(direction):
            inside = over.now < -end.slack(over)
            if over.kind >= len(end.jet) or (inside and direction > 0 and not passed):
                continue
            if end.is_forced(over, 1.0, direction):
                return _refusal(end, over, name, direction)
    return ""


def _excused(start: EndState, over: Over) -> Excused | None:
    """How it is led back, within the window if the excess allows; None if it is too large."""
    least = start.least_time(over, AVAILABLE_FRACTION, 1, SHORTEST * start.window)
    until = start.least_time(over, AVAILABLE_FRACTION, 1, start.window)
    if until is None or least is None:
        return None
    most = _most(start, over)
    while until > least and start.peak(over, until) > most:
        until = max(until / STRIDE, least)
    peak = start.peak(over, until)
    if peak > most:
        return None
    name = start.coordinates.coordinate_names[over.coordinate]
    kind = KINDS[over.kind]
    return Excused(kind, name, peak, until, over.coordinate, over.side, over.powers(until))


def _most(start: EndState, over: Over) -> float:
    """The largest excess that is led back, in the unit of the limit."""
    size = abs(start.bound(over))
    if KINDS[over.kind] == "q" or size == 0.0:
        size = float(start.limits.ranges[over.kind, over.coordinate])
    return MOST_EXCESS * size


def _refusal(end: EndState, over: Over, name: str, direction: int, most: str = "") -> str:
    """The value of an end, its limit, and what leads out of it. most: what would be excused."""
    kind, i = over.kind, over.coordinate
    joint, units = end.coordinates.coordinate_names[i], end.coordinates.coordinate_units[i]
    value = end.bound(over) + over.side * over.now
    lower, upper = end.limits.lower[kind, i], end.limits.upper[kind, i]
    what = f"the {QUANTITIES[KINDS[kind]]} of joint {joint!r} at the {name} is {value:.6g}"
    if over.now > end.slack(over):
        slip = beyond_in_degrees(value, lower, upper) if kind == 0 and units[0] == "rad" else ""
        return f"{what} {units[kind]}, outside its limits [{lower:.6g}, {upper:.6g}]" + (
            f", {slip}" if slip else f"{most}; change the {name} or widen the limits"
        )
    rate, order = next((x, j) for j, x in enumerate(over.rates, 1) if x > 0.0)
    leaves = "takes it beyond" if direction > 0 else "means that it came from beyond"
    return (
        f"{what} {units[kind]}, and its {QUANTITIES[KINDS[kind + order]]} of "
        f"{over.side * direction**order * rate:.6g} {units[kind + order]} {leaves} its limit of "
        f"{end.bound(over):.6g}{most}; change the {name} or widen the limits"
    )
