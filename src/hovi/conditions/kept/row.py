"""Conditions of one's own: a formula, or a function of CasADi symbols."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import field
from typing import Any, ClassVar

import numpy.typing as npt

from hovi.conditions.condition import TOLERANCE, Condition, with_function
from hovi.conditions.expression import FunctionLike
from hovi.conditions.kept.keep import Conditions, Keep
from hovi.conditions.places import Along
from hovi.conditions.sets import Between, Equal
from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class Row(Keep):
    """y(q, v, a, t) = equals, or lower <= y(q, v, a, tau, t) <= upper.

    equals, lower, upper: one number, or one for each entry of y; a value, 0 by default, or bounds.
    scale, tolerance, unit: as of `hovi.Condition`.
    """

    equals: npt.ArrayLike | None = field(default=None, kw_only=True)
    lower: npt.ArrayLike | None = field(default=None, kw_only=True)
    upper: npt.ArrayLike | None = field(default=None, kw_only=True)
    scale: npt.ArrayLike | None = field(default=None, kw_only=True)
    tolerance: float = field(default=TOLERANCE, kw_only=True)
    unit: str = field(default="", kw_only=True)

    @property
    @abstractmethod
    def function(self) -> FunctionLike:
        """y, as of `hovi.Condition`."""

    def check_values(self) -> None:
        """See Keep."""
        _ = self._condition

    def check(self, robot: Robot) -> None:
        """Raise InputError or SceneError for a y that the robot does not have."""
        self.conditions(robot)

    def conditions(self, robot: Robot) -> Conditions:
        """See Keep."""
        return (with_function(self._condition, robot),)

    @property
    def _condition(self) -> Condition[Any, Any]:
        bounds = {"lower": self.lower, "upper": self.upper}
        given = {side: bound for side, bound in bounds.items() if bound is not None}
        if self.equals is not None and given:
            raise InputError(f"{self.subject} takes `equals` or bounds, not both.")
        value = Equal(0.0 if self.equals is None else self.equals)
        return Condition(
            self.function,
            Between(**given) if given else value,
            name=self.title,
            unit=self.unit,
            scale=self.scale,
            tolerance=self.tolerance,
        )


@dataclass(frozen=True, eq=False)
class Formula(Row):
    """A Row whose y is a formula.

    formula: as of the effect RunningCost, such as 'z_axis["tool0", "z"]'; a column for several.
    equals, lower, upper, scale, tolerance, unit: see `hovi.Condition`, of which they are a part.
    """

    formula: str
    kind: ClassVar[str] = "formula"

    @property
    def function(self) -> FunctionLike:
        """The formula."""
        return self.formula

    @property
    def title(self) -> str:
        """Its name, or the formula."""
        return self.name or self.formula


@dataclass(frozen=True, eq=False)
class CasadiRow(Row):
    """A Row whose y returns a CasADi expression, which files do not contain.

    expression: a function of those of q, v, a, tau and t that it names.
    level: of an equation, that of the highest derivative of q in it, 0 to 2: checked if given.
    equals, lower, upper, scale, tolerance, unit: see `hovi.Condition`, of which they are a part.
    """

    expression: Callable[..., Any]
    level: int | None = None
    kind: ClassVar[str] = "casadi_row"

    @property
    def function(self) -> FunctionLike:
        """The expression."""
        return self.expression

    def conditions(self, robot: Robot) -> Conditions:
        """See Keep."""
        (made,) = super().conditions(robot)
        if self.level is not None and made.where != Along(self.level):
            is_of = str(made.where.level) if isinstance(made.where, Along) else "none, with bounds"
            raise InputError(f"{self.subject} says level {self.level}, but its level is {is_of}.")
        return (made,)
