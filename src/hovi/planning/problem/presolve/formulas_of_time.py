"""Where the formulas of a scene change in time, so that a grid has nodes there."""

from __future__ import annotations

import dataclasses
from functools import lru_cache

import casadi as ca
import numpy as np

from hovi.discrete.grid import Grid
from hovi.dynamics.moving_base_torque import base_jet
from hovi.effects.expressions.time_parts import Bisection, TimePart, bisected, time_parts
from hovi.scene.scene import Scene


def graded(grid: Grid, scenes: tuple[tuple[Scene, float], ...]) -> tuple[Grid, str]:
    """The grid with intervals bisected where formulas of time change, and what that cannot resolve.

    The latter is a clause, "" if there is nothing. The grid is the same one if nothing changes
    faster than its intervals. scenes: of the segments, with the times at which they end, ascending.
    """
    if not any(functions_of_time(scene) for scene, _ in scenes):
        return grid, ""
    begin, nodes, fault = 0, [grid.t[:1]], ""
    for scene, end in scenes:
        last = int(np.argmin(np.abs(grid.t - end)))
        found = _bisected(scene, grid.t[begin : last + 1].tobytes())
        nodes.append(found.nodes[1:])
        fault, begin = fault or found.fault, last
    return grid.split_at(np.concatenate(nodes)), fault


@lru_cache(maxsize=64)
def _bisected(scene: Scene, nodes: bytes) -> Bisection:
    """As `bisected`, once for a scene and a grid."""
    parts, t = functions_of_time(scene), np.frombuffer(nodes)
    return bisected(parts, t) if parts else Bisection(t)


@lru_cache(maxsize=64)
def base_parts(scene: Scene) -> tuple[TimePart, ...]:
    """The functions of time in the position, velocity and acceleration of a moving base."""
    base, t = scene.terms.base, scene.terms.symbols.t
    return () if base is None else tuple(time_parts("effect 'moving_base'", base_jet(base, t), t))


@lru_cache(maxsize=64)
def functions_of_time(scene: Scene) -> tuple[TimePart, ...]:
    """The functions of time alone in the effects of a scene that are more than powers of it."""
    timed, robot, found = scene.terms.timed, scene.robot, list[TimePart]()
    resting = dataclasses.replace(scene.terms.symbols, base=None)
    tau, t = ca.SX.sym("tau", robot.nv), resting.t
    for effect in scene.effects if timed else ():
        if effect.key not in timed:
            continue
        base = effect.base(robot, resting)
        terms = [
            effect.torque(robot, resting),
            effect.potential(robot, resting),
            effect.running_cost(robot, resting, tau),
            *(() if base is None else base_jet(base, t)),
        ]
        given = [scene.terms.at_times(each) for each in terms if each is not None]
        found += time_parts(f"effect {effect.key!r}", given, t)
    return tuple(found)
