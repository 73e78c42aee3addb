"""How accurate a plan has to be, in a unit that a person has."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import Self

import numpy as np

from hovi.discrete.motion_error import MotionError
from hovi.errors import InputError, nearest
from hovi.planning.problem.values import ANGLES, LENGTHS, SHARES, number_and_unit
from hovi.robot.robot import Robot


class Quantity(StrEnum):
    """What is accurate: the cost, the joints or a frame."""

    COST = "cost"
    JOINTS = "joints"
    FRAME = "frame"


@dataclass(frozen=True)
class Tolerance:
    """The largest error that a plan may have, over the whole motion.

    size: relative in the cost, in [rad] in the joints (a sliding joint may be off by as many
        metres), in [m] at a frame.
    quantity: which of the three. frame: name of the frame; the robot's tip_frame when None.
    unit: in which sentences state it: of LENGTHS, ANGLES or SHARES; "" stands for mm, rad or 1.
    """

    size: float
    quantity: Quantity = Quantity.COST
    frame: str | None = None
    unit: str = field(default="", compare=False)

    @classmethod
    def of(cls, tolerance: float | str | Tolerance, robot: Robot) -> Self:
        """A tolerance from what a person says.

        tolerance: a bare number (or percentage) is relative in the cost; "0.1 mm" is an error of
            the robot's tip_frame, "0.1 mm at tool0" of another frame; "0.01 deg" or "1e-4 rad" are
            of the joints.
        Raises InputError for anything else.
        """
        if isinstance(tolerance, Tolerance):
            parts = tolerance.size, tolerance.quantity, tolerance.frame, tolerance.unit
            return cls(*parts)._checked(robot)
        if isinstance(tolerance, str):
            return cls._parsed(tolerance)._checked(robot)
        if isinstance(tolerance, bool) or not isinstance(tolerance, float | int | np.number):
            raise InputError(_expected(tolerance))
        return cls(float(tolerance))._checked(robot)

    @classmethod
    def _parsed(cls, text: str) -> Self:
        quantity, *rest = re.split(r"\sat\s", text, maxsplit=1)
        frame = rest[0].strip() if rest else None
        parsed = number_and_unit(quantity)
        if parsed is None or frame == "":
            raise InputError(_expected(text))
        size, unit = parsed
        if unit in LENGTHS:
            return cls(size * LENGTHS[unit], Quantity.FRAME, frame, unit)
        if frame is not None:
            raise InputError(f"tolerance {text!r}: only a length, such as '0.1 mm', is at a frame.")
        if unit in ANGLES:
            return cls(size * ANGLES[unit], Quantity.JOINTS, unit=unit)
        if unit in SHARES:
            return cls(size * SHARES[unit], unit=unit)
        units = [unit for unit in (*LENGTHS, *ANGLES, *SHARES) if unit]
        raise InputError(f"tolerance {text!r} has the unit {unit!r}: {nearest(unit, units)}")

    def _checked(self, robot: Robot) -> Self:
        if not (np.isfinite(self.size) and self.size > 0):
            raise InputError(f"a tolerance must be positive and finite, got {self.size:g}.")
        if self.frame is not None and self.frame not in robot.frame_names:
            raise InputError(
                f"tolerance at frame {self.frame!r}: robot {robot.name!r} has no such frame; "
                f"{nearest(self.frame, robot.frame_names)}"
            )
        return self

    def measure(self, error: MotionError) -> float:
        """The error in the tolerance's quantity, as a number to compare with `size`."""
        if self.quantity is Quantity.COST:
            return error.cost
        if self.quantity is Quantity.JOINTS:
            return max(error.angle, error.slide)
        return error.largest_tip

    def in_words(self, size: float) -> str:
        """A size of this quantity with its unit."""
        if self.quantity is Quantity.COST:
            number = f"{size / SHARES[self.unit]:.2g}"
            return f"{number} {self.unit} of the cost".replace("  ", " ")
        if self.quantity is Quantity.JOINTS:
            unit = self.unit or "rad"
            return f"{size / ANGLES[unit]:.2g} {unit} in the joints"
        unit, at = self.unit or "mm", "the tip" if self.frame is None else self.frame
        return f"{size / LENGTHS[unit]:.2g} {unit} at {at}"


def as_number_or_text(tolerance: float | str | Tolerance | None) -> float | str | None:
    """A number or a text that `Tolerance.of` takes for the same tolerance; None for None."""
    if not isinstance(tolerance, Tolerance):
        return tolerance
    size = float(tolerance.size)
    if tolerance.quantity is Quantity.COST:
        return size
    if tolerance.quantity is Quantity.JOINTS:
        return f"{size!r} rad"
    return f"{size!r} m" if tolerance.frame is None else f"{size!r} m at {tolerance.frame}"


def _expected(tolerance: object) -> str:
    return (
        "a tolerance is a number, relative in the cost, or a text such as '0.1 mm', "
        f"'0.1 mm at tool0' or '0.01 deg', got {tolerance!r}."
    )


@dataclass(frozen=True)
class Round:
    """One grid on the way to a tolerance.

    intervals: N. points: quadrature points of all of them. cost: of the solution.
    error: estimated, in the tolerance's unit; not a number where none could be estimated.
    nit: steps of the optimiser. seconds: wall time of the solve and of the estimate.
    """

    intervals: int
    points: int
    cost: float
    error: float
    nit: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Accuracy:
    """How accurate a plan is, as far as that was estimated.

    tolerance: what was asked for. error: the estimate of the plan that is returned, in the same
        unit; not a number where none could be made.
    reached: whether error <= tolerance. reason: why the search ended before, in a sentence; ""
        where it did not.
    rounds: the grids on the way. compare: what `estimate` calls.
    """

    tolerance: Tolerance
    error: float
    reached: bool
    reason: str
    rounds: tuple[Round, ...] = ()
    compare: Callable[[], MotionError] | None = field(default=None, repr=False)

    @cached_property
    def estimate(self) -> MotionError | None:
        """The estimate in every unit, worked out when first asked for; None where there is none."""
        return None if self.compare is None else self.compare()

    def __str__(self) -> str:
        """One sentence."""
        wanted = self.tolerance.in_words(self.tolerance.size)
        if np.isnan(self.error):
            return f"{self.reason}; nothing was estimated ({wanted} asked for)."
        found = f"estimated error {self.tolerance.in_words(self.error)}, {wanted} asked for"
        return f"{found}." if self.reached else f"stopped early: {self.reason}; {found}."
