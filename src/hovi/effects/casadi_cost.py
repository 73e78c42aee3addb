"""A user-defined cost from a CasADi function."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

import casadi as ca

from hovi.effects.effect import Effect, Touch
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.errors import SceneError, reason
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class CasadiCost(Effect):
    """C(q, v, a, tau, t) from a CasADi function of the scene's symbols.

    It is added to the effort 1/2 tau^T R tau, which the effort weight 0 leaves out. Derivatives
    with respect to tau are carried through the analytic ones of the torques, so that an expression
    should use tau and not repeat RNEA. Files do not contain it: `hovi.effects.RunningCost` has
    formulas instead.

    cost: a casadi.Function, or a Python function, of (q, v, a, tau, t), shapes (nq,), (nv,),
        (nv,), (nv,) and (), with one number as its result.
    """

    cost: Callable[..., Any]
    key: ClassVar[str] = "casadi_cost"
    touches: ClassVar[tuple[Touch, ...]] = (Touch.COST,)
    storable: ClassVar[bool] = False

    def check(self, robot: Robot) -> None:
        """Raise SceneError unless the function has a number as its result."""
        self.running_cost(robot, SceneSymbols.of(robot), ca.SX.sym("tau", robot.nv))

    def running_cost(self, robot: Robot, symbols: SceneSymbols, tau: ca.SX) -> ca.SX | None:
        """The function's result."""
        q, v, a, t = symbols.columns()
        try:
            found = ca.SX(self.cost(q, v, a, tau, t))
        except Exception as error:
            raise SceneError(
                "effect 'casadi_cost': cost must map the SX symbols (q, v, a, tau, t), of "
                f"{q.numel()}, {v.numel()}, {a.numel()}, {tau.numel()} and 1 rows, to one number, "
                f"but it failed: {reason(error)}."
            ) from error
        _require_number(found, [q, v, a, tau, t])
        return None if found.is_zero() else found

    def describe(self) -> str:
        """One line for the description of a scene."""
        name = self.cost.name() if isinstance(self.cost, ca.Function) else self.cost
        return f"casadi_cost: {getattr(name, '__name__', name)} of (q, v, a, tau, t)"


def _require_number(cost: ca.SX, symbols: list[ca.SX]) -> None:
    """Raise SceneError unless a cost is one number of these symbols alone."""
    if not cost.is_scalar():
        raise SceneError(
            f"effect 'casadi_cost': cost must have one number as its result, got {cost.shape}."
        )
    known = {each.element_hash() for x in symbols for each in ca.vertsplit(x)}
    foreign = [str(each) for each in ca.symvar(cost) if each.element_hash() not in known]
    if foreign:
        raise SceneError(
            f"effect 'casadi_cost': the result contains {', '.join(foreign[:3])}, which is not "
            "among (q, v, a, tau, t): give it a value."
        )
