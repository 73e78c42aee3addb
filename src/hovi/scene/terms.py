"""The terms that the effects of a scene add, as expressions of the same symbols."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.effects import Effect, SceneSymbols, Touch
from hovi.errors import SceneError
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SceneTerms:
    """The sums of the terms that effects add to RNEA and to the cost.

    robot: of the scene. effects: its effects. model: its own, with gravity, armature and payload.
    begin: what the effects' time is at t = 0, in [s].
    Properties raise SceneError for an effect that modifies more than its `touches`.
    """

    robot: Robot
    effects: Sequence[Effect]
    model: pin.Model
    begin: float = 0.0

    def at_times(self, term: ca.SX) -> ca.SX:
        """What effects return, by their own time, as an expression of the time t of a motion."""
        t = self.symbols.t
        return ca.substitute(term, t, t + self.begin) if self.begin else term

    @cached_property
    def base(self) -> ca.SX | None:
        """The pose of a moving base at t, as in `SceneSymbols`; None if it is fixed."""
        moved = self.symbols.base
        return None if moved is None else self.at_times(moved)

    @cached_property
    def symbols(self) -> SceneSymbols:
        """The symbols of the expressions, with the motion of the base by the effects' time."""
        symbols = SceneSymbols.of(self.robot, self.model)
        motions = [effect.base(self.robot, symbols) for effect in self.effects]
        named = [motion for motion in motions if motion is not None]
        return dataclasses.replace(symbols, base=named[0]) if named else symbols

    @cached_property
    def torque(self) -> ca.SX | None:
        """The torque that effects add to RNEA, a column of nv; or None."""
        return self._sum(Touch.TORQUE, "torque", self.symbols)

    @cached_property
    def potential(self) -> ca.SX | None:
        """V of the effects, a scalar; or None."""
        return self._sum(Touch.COST, "potential", self.symbols)

    def running_cost(self, tau: ca.SX) -> ca.SX | None:
        """C(q, v, a, tau, t) of the effects, a scalar; or None. tau: shape (nv,)."""
        return self._sum(Touch.COST, "running_cost", self.symbols, tau)

    @cached_property
    def effort_weight(self) -> Array:
        """R of the effect that defines it, or ones, shape (nv,)."""
        weights = [effect.effort_weight(self.robot) for effect in self.effects]
        named = [weight for weight in weights if weight is not None]
        return named[0] if named else np.ones(self.robot.nv)

    @cached_property
    def jerk_weight(self) -> Array | None:
        """W of the effect that defines it, shape (nv,); None without a cost on the jerk."""
        weights = [effect.jerk_weight(self.robot) for effect in self.effects]
        return next((weight for weight in weights if weight is not None), None)

    @cached_property
    def timed(self) -> tuple[str, ...]:
        """Keys of the effects whose torque, cost or base motion depends on time."""
        resting, robot = dataclasses.replace(self.symbols, base=None), self.robot
        tau = ca.SX.sym("tau", robot.nv)
        timed = []
        for effect in self.effects:
            terms = (
                effect.torque(robot, resting),
                effect.potential(robot, resting),
                effect.running_cost(robot, resting, tau),
                effect.base(robot, resting),
            )
            if any(term is not None and ca.depends_on(term, resting.t) for term in terms):
                timed.append(effect.key)
        return tuple(timed)

    def _sum(self, touch: Touch, term: str, *symbols: Any) -> ca.SX | None:
        named = list(self._touching(touch, term, *symbols))
        return self.at_times(sum(named[1:], named[0])) if named else None

    def _touching(self, touch: Touch, term: str, *symbols: Any) -> Iterator[ca.SX]:
        """The terms of one kind that effects add."""
        for effect in self.effects:
            added = getattr(effect, term)(self.robot, *symbols)
            if added is None:
                continue
            if touch not in effect.touches:
                raise SceneError(
                    f"effect {effect.key!r} adds to the {touch} without declaring it: add "
                    f"Touch.{touch.name} to its `touches`."
                )
            yield added
