"""Angles and ranges of angles that were probably meant in degrees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

MIN_SUSPICIOUS, MAX_SUSPICIOUS = 8 * np.pi, 720.0
"""Bounds of angles in this range, in [rad], look like degrees: few joints make four turns, and a
number beyond two turns in degrees, such as 1000, usually stands for no bound."""

DEGREE_STEP = 0.5
"""Angles in degrees are mostly whole numbers, or halves."""


LOOKS_LIKE_DEGREES = "looks like degrees"
"""What every clause about an angle says."""


def which_in_degrees(
    angles: npt.NDArray[np.bool_], lower: Array, upper: Array
) -> npt.NDArray[np.intp]:
    """The indices of ranges that look like degrees; arguments as for `ranges_in_degrees`."""
    sizes = np.abs(np.stack([lower, upper]))
    suspicious = (sizes > MIN_SUSPICIOUS) & (sizes <= MAX_SUSPICIOUS)
    return np.flatnonzero(angles & suspicious.any(axis=0))


def ranges_in_degrees(
    names: Sequence[str], angles: npt.NDArray[np.bool_], lower: Array, upper: Array
) -> str:
    """The ranges that look like degrees, as a clause; "" if none does.

    names: of the coordinates, (nv,). angles: which are angles, (nv,). lower, upper: in [rad].
    """
    found = which_in_degrees(angles, lower, upper)
    if not len(found):
        return ""
    i = int(found[0])
    more = f" and of {len(found) - 1} more" if len(found) > 1 else ""
    return (
        f"the position range of {names[i]}{more}, {lower[i]:g} to {upper[i]:g} rad, looks like "
        f"degrees: {lower[i]:g} to {upper[i]:g} degrees are {np.radians(lower[i]):.4g} to "
        f"{np.radians(upper[i]):.4g} rad"
    )


def speeds_in_degrees(
    names: Sequence[str], angles: npt.NDArray[np.bool_], speeds: Array, known: Array
) -> str:
    """The velocity limits that look like degrees per second, as a clause; "" if none does.

    Those which are ten times what the robot can do, and would not be in degrees.
    names: of the coordinates, (nv,). angles: which are angles, (nv,). speeds: limits, (nv,).
    known: what the robot states, (nv,), 0 where it states nothing. All in [rad/s].
    """
    suspicious = (speeds / 10 > known) & (np.radians(speeds) / 2 <= known) & (known > 0)
    found = np.flatnonzero(angles & suspicious & (speeds > MIN_SUSPICIOUS))
    if not len(found):
        return ""
    i = int(found[0])
    more = f" and of {len(found) - 1} more" if len(found) > 1 else ""
    return (
        f"the velocity limit of {names[i]}{more}, {speeds[i]:g} rad/s, looks like degrees: "
        f"{speeds[i]:g} degrees per second are {np.radians(speeds[i]):.4g} rad/s, and the robot "
        f"states {known[i]:.4g} rad/s"
    )


def angles_in_degrees(
    names: Sequence[str], angles: npt.NDArray[np.bool_], q: Array, lower: Array, upper: Array
) -> str:
    """The coordinates that look like degrees, as a clause; "" if none does.

    Those which are more than a turn beyond a range that they would meet in degrees, and those which
    move by a suspicious angle between multiples of DEGREE_STEP: joints without a range may be wound
    up, and may make some turns, but that is a multiple of pi.

    names: of the coordinates, (nv,). angles: which are angles, (nv,).
    q: successive configurations, shape (M, nv). lower, upper: position ranges. All in [rad].
    """
    degrees = np.radians(q)
    bounded = (lower < upper) & (np.maximum(np.abs(lower), np.abs(upper)) <= MAX_SUSPICIOUS)
    beyond = (q > upper + 2 * np.pi) | (q < lower - 2 * np.pi)
    beyond &= bounded & (degrees >= lower) & (degrees <= upper)
    moved = np.abs(np.diff(q, axis=0)).max(axis=0, initial=0.0) > MIN_SUSPICIOUS
    moved &= (np.abs(np.remainder(q / DEGREE_STEP + 0.5, 1.0) - 0.5) < 1e-9).all(axis=0)
    possible = angles & (np.abs(q) <= MAX_SUSPICIOUS).all(axis=0)
    found = np.flatnonzero(possible & (beyond.any(axis=0) | moved))
    if not len(found):
        return ""
    i = int(found[0])
    largest = float(q[np.argmax(np.abs(q[:, i])), i])
    count = len(found) - 1
    more = f" ({count} more {'joint' if count == 1 else 'joints'} too)" if count else ""
    return (
        f"{names[i]} is {largest:g} rad in a given configuration{more}, "
        f"which {LOOKS_LIKE_DEGREES}: {largest:g} degrees are {np.radians(largest):.4g} rad"
    )


def beyond_in_degrees(angle: float, lower: float, upper: float) -> str:
    """A clause about an angle more than a turn beyond a range that it meets in degrees; or "".

    All in [rad].
    """
    if -2 * np.pi <= angle - lower and angle - upper <= 2 * np.pi:
        return ""
    if not (abs(angle) <= MAX_SUSPICIOUS and lower <= np.radians(angle) <= upper):
        return ""
    return f"which {LOOKS_LIKE_DEGREES}: {angle:g} degrees are {np.radians(angle):.4g} rad"


def rpy_in_degrees(rpy: Array) -> str:
    """Roll, pitch and yaw that look like degrees, as a clause; "" if they do not.

    Each is a multiple of DEGREE_STEP, and one is more than a turn.
    """
    largest = float(np.abs(rpy).max())
    if not 2 * np.pi < largest <= MAX_SUSPICIOUS:
        return ""
    whole = np.abs(np.remainder(rpy / DEGREE_STEP + 0.5, 1.0) - 0.5) < 1e-9
    if not whole.all():
        return ""
    shown, radians = (", ".join(f"{x:.4g}" for x in each) for each in (rpy, np.radians(rpy)))
    return f"rpy = ({shown}) rad {LOOKS_LIKE_DEGREES}: these degrees are ({radians}) rad"
