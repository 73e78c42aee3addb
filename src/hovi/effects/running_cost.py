"""A user-defined cost from formulas."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import casadi as ca

from hovi.effects.effect import Effect, Touch
from hovi.effects.expressions.formula import Number, expression
from hovi.effects.expressions.formula_symbols import cost_symbols
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class RunningCost(Effect):
    """C(q, v, a, tau, t), the sum of named formulas.

    It is added to the effort 1/2 tau^T R tau, which the effort weight 0 leaves out. A formula names
    joints, as in tau["elbow"], or columns of all joints, as in sum(tau * v) and dot(a, a); the
    motion of a frame, as in acceleration["hand", "z"] or dot(velocity["hand"], velocity["hand"]);
    the force and moment of the ground on the base, as in base_force["x"]; and the time t. See
    `hovi.effects.CasadiCost` for other expressions.

    terms: formulas by name, in units of the cost.
    """

    terms: Mapping[str, Number]
    key: ClassVar[str] = "running_cost"
    touches: ClassVar[tuple[Touch, ...]] = (Touch.COST,)

    def check(self, robot: Robot) -> None:
        """Raise SceneError for invalid formulas."""
        self.running_cost(robot, SceneSymbols.of(robot), ca.SX.sym("tau", robot.nv))

    def running_cost(self, robot: Robot, symbols: SceneSymbols, tau: ca.SX) -> ca.SX | None:
        """The sum of the formulas."""
        named = cost_symbols(robot, symbols, tau)
        total = ca.SX(0)
        for name, given in self.terms.items():
            total += expression(f"effect 'running_cost': the term {name!r}", given, named)
        return None if total.is_zero() else total

    def describe(self) -> str:
        """One line for the description of a scene."""
        terms = (f"{name} = {given}" for name, given in self.terms.items())
        return "running_cost: " + ("; ".join(terms) or "nothing")
