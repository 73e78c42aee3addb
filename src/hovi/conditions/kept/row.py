"""Conditions of one's own: a formula, or a function of CasADi symbols."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy.typing as npt

from hovi.conditions.condition import TOLERANCE, Condition, with_function
from hovi.conditions.kept.keep import Conditions, Keep
from hovi.conditions.places import Along
from hovi.conditions.sets import Between, Equal
from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class Formula(Keep):
    """y(q, v, a, t) = equals, or lower <= y(q, v, a, tau, t) <= upper, for a formula y.

    formula: as of the effect RunningCost, such as 'z_axis["tool0", "z"]'; a column for several.
    equals, lower, upper: one number, or one for each entry of y; `equals` or bounds.
    scale, tolerance, unit: as of `hovi.Condition`.
    """

    formula: str
    equals: npt.ArrayLike | None = None
    lower: npt.ArrayLike | None = None
    upper: npt.ArrayLike | None = None
    scale: npt.ArrayLike | None = None
    tolerance: float = TOLERANCE
    unit: str = ""
    kind: ClassVar[str] = "formula"

    def check_values(self) -> None:
        """See Keep."""
        _ = self._condition

    def check(self, robot: Robot) -> None:
        """Raise InputError or SceneError for a formula that names what the robot does not have."""
        with_function(self._condition, robot)

    @property
    def title(self) -> str:
        """Its name, or the formula."""
        return self.name or self.formula

    @property
    def _condition(self) -> Condition[Any, Any]:
        return Condition(
            self.formula,
            _values_in(self.subject, self.equals, self.lower, self.upper),
            name=self.title,
            unit=self.unit,
            scale=self.scale,
            tolerance=self.tolerance,
        )

    def conditions(self, robot: Robot) -> Conditions:
        """See Keep."""
        return (with_function(self._condition, robot),)


@dataclass(frozen=True, eq=False)
class CasadiRow(Keep):
    """The same of a function y that returns a CasADi expression, which files do not contain.

    expression: a function of those of q, v, a, tau and t that it names.
    level: of an equation, that of the highest derivative of q in it, 0 to 2: checked if given.
    equals, lower, upper, scale, tolerance, unit: as of a Formula; `equals` is 0 without bounds.
    """

    expression: Callable[..., Any]
    level: int | None = None
    equals: npt.ArrayLike | None = None
    lower: npt.ArrayLike | None = None
    upper: npt.ArrayLike | None = None
    scale: npt.ArrayLike | None = None
    tolerance: float = TOLERANCE
    unit: str = ""
    kind: ClassVar[str] = "casadi_row"

    def check_values(self) -> None:
        """See Keep."""
        _ = self._condition

    def check(self, robot: Robot) -> None:
        """Raise InputError for a function that fails, or of another level."""
        self._on(robot)

    @property
    def _condition(self) -> Condition[Any, Any]:
        value = 0.0 if self.lower is None and self.upper is None else None
        equals = value if self.equals is None else self.equals
        return Condition(
            self.expression,
            _values_in(self.subject, equals, self.lower, self.upper),
            name=self.title,
            unit=self.unit,
            scale=self.scale,
            tolerance=self.tolerance,
        )

    def conditions(self, robot: Robot) -> Conditions:
        """See Keep."""
        return (self._on(robot),)

    def _on(self, robot: Robot) -> Condition[Any, Any]:
        made = with_function(self._condition, robot)
        if self.level is not None and made.where != Along(self.level):
            is_of = str(made.where.level) if isinstance(made.where, Along) else "none, with bounds"
            raise InputError(f"{self.subject} says level {self.level}, but its level is {is_of}.")
        return made


def _values_in(subject: str, equals: Any, lower: Any, upper: Any) -> Equal | Between:
    bounds = {x: y for x, y in (("lower", lower), ("upper", upper)) if y is not None}
    if (equals is None) is not bool(bounds):
        raise InputError(f"{subject} needs either `equals`, or `lower` or `upper` or both.")
    return Between(**bounds) if bounds else Equal(equals)
