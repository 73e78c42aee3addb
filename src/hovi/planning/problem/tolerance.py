"""Accuracy of a plan: a tolerance for the cost, the joints or a frame, and what was reached."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import field, replace
from enum import StrEnum
from functools import cached_property
from typing import Self

import numpy as np

from hovi.checks.arguments import check_arguments_except
from hovi.checks.kinds import is_number, shown
from hovi.checks.units import ANGLES, FRACTIONS, LENGTHS, number_and_unit
from hovi.discrete.measures.motion_error import MotionError
from hovi.errors import InputError, nearest
from hovi.robot.robot import Robot
from hovi.robot.tip_frame import names_in_words
from hovi.system.dataclass import dataclass

CURVE_TOLERANCE = 1e-3
"""Relative error of the integral along the curve that no tolerance of another kind, and no smaller
one of the cost, asks to improve."""

LAST_BARRIER = 1e-8
"""Last barrier parameter within limits where nothing else is asked for, relative to the mean
density of the cost, which exceeds its minimum by some ten times as much."""
BARRIER_FRACTION, LARGEST_BARRIER = 3e-3, 3e-6
"""Last barrier parameter within limits for a tolerance of the cost, as a fraction of the tolerance,
and at most."""
FINER_FRACTIONS = 1 / 30, 1e-3, 1e-5
"""Fractions of a tolerance that are tried if a minimum satisfies it and is still not resolved."""
REMAINING_FRACTION = 0.5
"""Predicted relative decrease of the last step within limits, as a fraction of the last barrier."""


class Quantity(StrEnum):
    """The quantity whose error is bounded."""

    COST = "cost"
    JOINTS = "joints"
    FRAME = "frame"


@check_arguments_except("tolerance")
@dataclass(frozen=True)
class Tolerance:
    """The largest allowed error of a plan, over the whole motion.

    size: relative for the cost, in [rad] for the joints ([m] for sliding ones), in [m] for a
        frame.
    quantity: which of the three. frame: name of the frame; all of the robot's tip_frames if None.
    unit: used in messages: of LENGTHS, ANGLES or FRACTIONS; "" stands for mm, rad or 1.
    tips: the robot's tip_frames, used in messages.
    """

    size: float
    quantity: Quantity = Quantity.COST
    frame: str | None = None
    unit: str = field(default="", compare=False)
    tips: tuple[str, ...] = field(default=(), compare=False, repr=False)

    @classmethod
    def of(cls, tolerance: float | str | Tolerance, robot: Robot) -> Self:
        """A tolerance from a number or a text.

        tolerance: a number or a percentage is relative to the cost; "0.1 mm" is an error of the
            robot's tip_frames, "0.1 mm at tool0" of another frame; "0.01 deg" or "1e-4 rad" of the
            joints.
        Raises InputError for anything else, and for a frame that does not move.
        """
        if isinstance(tolerance, Tolerance):
            parts = tolerance.size, tolerance.quantity, tolerance.frame, tolerance.unit
            return cls(*parts)._checked(robot)
        if isinstance(tolerance, str):
            return cls._parsed(tolerance)._checked(robot)
        if not is_number(tolerance):
            raise InputError(_expected(tolerance))
        try:
            return cls(float(tolerance))._checked(robot)
        except OverflowError:
            raise InputError(_expected(tolerance)) from None

    @property
    def barrier(self) -> float:
        """The last barrier parameter of solves within limits, relative to the mean density."""
        if self.quantity is not Quantity.COST:
            return LAST_BARRIER
        return min(max(LAST_BARRIER, BARRIER_FRACTION * self.size), LARGEST_BARRIER)

    @property
    def finer(self) -> tuple[Tolerance, ...]:
        """Smaller tolerances of the same quantity, the largest first."""
        return tuple(replace(self, size=fraction * self.size) for fraction in FINER_FRACTIONS)

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
            raise InputError(
                f"tolerance {text!r}: only a length, such as '0.1 mm', can be at a frame."
            )
        if unit in ANGLES:
            return cls(size * ANGLES[unit], Quantity.JOINTS, unit=unit)
        if unit in FRACTIONS:
            return cls(size * FRACTIONS[unit], unit=unit)
        units = [unit for unit in (*LENGTHS, *ANGLES, *FRACTIONS) if unit]
        raise InputError(f"tolerance {text!r} has the unit {unit!r}: {nearest(unit, units)}")

    def _checked(self, robot: Robot) -> Self:
        if not (np.isfinite(self.size) and self.size > 0):
            raise InputError(f"a tolerance must be positive and finite, got {self.size:g}.")
        if self.frame is not None and self.frame not in robot.frame_names:
            raise InputError(
                f"tolerance at frame {self.frame!r}: robot {robot.name!r} has no such frame; "
                f"{nearest(self.frame, robot.frame_names)}"
            )
        if self.quantity is not Quantity.FRAME:
            return self
        robot.check_frame_moves(self.frame or robot.tip_frame)
        return replace(self, tips=robot.tip_frames)

    def measure(self, error: MotionError) -> float:
        """The error in the tolerance's quantity and SI unit, to compare with `size`."""
        if self.quantity is Quantity.COST:
            return error.cost
        if self.quantity is Quantity.JOINTS:
            return max(error.angle, error.slide)
        return error.largest_tip

    @property
    def subject(self) -> str:
        """The quantity, in a sentence."""
        if self.quantity is Quantity.FRAME:
            return f"the position of {self.frame or names_in_words(self.tips) or 'the tip'}"
        return f"the {self.quantity}"

    def in_words(self, size: float, at: str = "", cost: str = "the cost") -> str:
        """An error of this quantity, with its unit.

        at: its frame; "" names all frames measured. cost: what relative errors are relative to.
        """
        if self.quantity is Quantity.COST:
            number = f"{size / FRACTIONS[self.unit]:.2g}"
            return f"{number} {self.unit} of {cost}".replace("  ", " ")
        if self.quantity is Quantity.JOINTS:
            unit = self.unit or "rad"
            return f"{size / ANGLES[unit]:.2g} {unit} in the joints"
        unit, frame = self.unit or "mm", at or self.frame or names_in_words(self.tips) or "the tip"
        return f"{size / LENGTHS[unit]:.2g} {unit} at {frame}"


def as_number_or_text(tolerance: float | str | Tolerance | None) -> float | str | None:
    """The inverse of `Tolerance.of`: a number or a text; None for None."""
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
        "a tolerance must be a number, relative to the cost, or a text such as '0.1 mm', "
        f"'0.1 mm at tool0' or '0.01 deg', got {shown(tolerance)}."
    )


@dataclass(frozen=True)
class Round:
    """One round of the refinement to a tolerance: a grid and its solution.

    intervals: N. points: total number of quadrature points. cost: of the solution.
    error: estimate, in the tolerance's SI unit; NaN if there is none.
    nit: steps of the optimiser. seconds: wall time of the solve and the estimate.
    asked_by: what asked for its grid, such as the cost or a condition; "" for the first one.
    """

    intervals: int
    points: int
    cost: float
    error: float
    nit: int
    seconds: float
    asked_by: str = ""


@dataclass(frozen=True, eq=False)
class Accuracy:
    """The estimated accuracy of a plan.

    tolerance: the requested one. error: estimate for the returned plan, in the same unit; NaN if
        there is none.
    reached: whether error <= tolerance. reason: why the refinement ended early; "" if it did not.
    rounds: the grids that were solved on. compare: computes `estimate`.
    along: relative error of the integral of L~ along the curve; NaN if unknown.
    timed: whether the cost, to which errors are relative, is J + w T, with the price of time.
    """

    tolerance: Tolerance
    error: float
    reached: bool
    reason: str
    rounds: tuple[Round, ...] = ()
    compare: Callable[[], MotionError] | None = field(default=None, repr=False)
    along: float = np.nan
    timed: bool = False

    @property
    def fixed_by(self) -> str:
        """What made the last refinement, such as the cost or a condition; "" if there was none."""
        return next((each.asked_by for each in reversed(self.rounds) if each.asked_by), "")

    @property
    def grows(self) -> bool:
        """Whether the error is no smaller on the last known grid than on the first."""
        errors = [each.error for each in self.rounds if np.isfinite(each.error)]
        return len(errors) > 1 and errors[-1] >= errors[0]

    @cached_property
    def estimate(self) -> MotionError | None:
        """The estimated errors of all quantities, computed on first use; None if unknown."""
        return None if self.compare is None else self.compare()

    def __str__(self) -> str:
        """One sentence."""
        cost = "the cost J + w T" if self.timed else "the cost"
        wanted = self.tolerance.in_words(self.tolerance.size, cost=cost)
        if np.isnan(self.error):
            return f"{self.reason}; no error was estimated (tolerance {wanted})."
        error = self.tolerance.in_words(self.error, self._frame, cost)
        found = f"estimated error {error}, tolerance {wanted}"
        if not self.reached and self.along > CURVE_TOLERANCE:
            found = f"the integral along the curve differs by {self.along:.1e}; {found}"
        return f"{found}." if self.reached else f"stopped early: {self.reason}; {found}."

    @property
    def _frame(self) -> str:
        """The frame with the largest error, of several; "" for a single or an unknown one."""
        several = self.tolerance.frame is None and len(self.tolerance.tips) > 1
        return self.estimate.frame if several and self.estimate is not None else ""
