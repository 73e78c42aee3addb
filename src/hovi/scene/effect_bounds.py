"""Bounds on what the effects of a scene add to torques and costs, along any motion."""

from __future__ import annotations

from functools import lru_cache

import casadi as ca

from hovi.effects import Effect
from hovi.effects.expressions.enclosure import Enclosure
from hovi.robot.space.configuration_rate import configuration_rate
from hovi.scene.scene import Scene
from hovi.system.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class EffectBounds:
    """A term f(q, v, a, tau, t) of an effect, with bounds on it and on df/dt along a motion.

    name: of the effect, for messages. is_torque: whether f is a column of joint torques, else a
        cost. rate: df/dt, of da/dt and dtau/dt too.
    """

    name: str
    is_torque: bool
    value: Enclosure
    rate: Enclosure


@lru_cache(maxsize=64)
def effect_bounds(scene: Scene) -> tuple[EffectBounds, ...]:
    """The terms of a scene's effects that are more than sums and products."""
    return tuple(bounds for effect in scene.effects for bounds in _bounds_of(scene, effect))


def _bounds_of(scene: Scene, effect: Effect) -> list[EffectBounds]:
    symbols, robot = scene.terms.symbols, scene.robot
    tau = ca.SX.sym("tau", robot.nv)
    terms = [
        (True, effect.torque(robot, symbols)),
        (False, effect.potential(robot, symbols)),
        (False, effect.running_cost(robot, symbols, tau)),
    ]
    q, v, a, t = symbols.columns()
    da, dtau = ca.SX.sym("da", robot.nv), ca.SX.sym("dtau", robot.nv)
    rates = [
        (q, configuration_rate(robot.model, q, v)),
        (v, a),
        (a, da),
        (tau, dtau),
        (t, ca.SX(1)),
    ]
    found = []
    for is_torque, own in terms:
        if own is None:
            continue
        term = scene.terms.at_times(own)
        value = Enclosure(ca.Function("value", [q, v, a, tau, t], [ca.densify(term)]))
        if value.bends:
            along = sum(ca.jtimes(term, x, dx) for x, dx in rates)
            rate = ca.Function("rate", [q, v, a, tau, t, da, dtau], [ca.densify(along)])
            name = f"effect {effect.key!r}"
            found.append(EffectBounds(name, is_torque, value, Enclosure(rate)))
    return found
