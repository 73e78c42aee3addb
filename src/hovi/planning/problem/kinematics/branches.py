"""Several configurations in which a frame reaches its goal, by the compiled search where it can.

The compiled search runs Levenberg and Marquardt's method within the limits, first from the given
configuration, then from those of a table whose poses are the nearest to the goal, then from random
ones; and ends when a number of seeds in a row have led to no new configuration.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from hovi._native import kinematics as native
from hovi.dynamics.kinematic_chain import KinematicChain, read_kinematic_chain
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.kinematics.damped_newton import candidates, inside
from hovi.robot.robot import Robot
from hovi.robot.tip_frame import moves_frame
from hovi.system.dataclass import dataclass
from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

PATIENCE = 60
"""Seeds in a row without a new configuration after which the search ends."""
PYTHON_PATIENCE = 8
"""Seeds in a row without a new configuration after which a search in Python ends."""
GOAL_TOLERANCE = 1e-9
"""Largest distance [m] and angle [rad] of a configuration that reaches a goal."""
PYTHON_TOLERANCE = 1e-6
"""Largest distance [m] and angle [rad] of a configuration that a search in Python reaches a goal
with; it may not come closer where J is singular."""
ISOLATED = 1e-3
"""Difference of every joint below which two configurations are one, in [rad] or [m]."""
IN_A_FAMILY = 0.3
"""Difference of every joint below which two configurations are one, in [rad] or [m], where the
joints are more than the equations, so that configurations form families."""
LENGTH = 0.5
"""A distance by it counts as an angle of 1 rad in the search, in [m]."""
BEYOND_REACH = 64
"""Number of seeds where the goal is farther away than the joints can reach."""


@dataclass(frozen=True, eq=False)
class Branches:
    """What a search found.

    q: distinct configurations that reach the goal, in the order in which they were found, (K, nq).
    best: the configuration that comes nearest to the goal, (nq,).
    """

    q: Array
    best: Array


@dataclass(frozen=True, eq=False)
class _CompiledChain:
    chain: KinematicChain
    kernel: native.InverseKinematicsKernel


def find_branches(
    robot: Robot, goal: FrameGoal, near: Array, bounds: tuple[Array, Array], most: int, seeds: int
) -> Branches:
    """Up to `most` configurations that reach a goal, from at most `seeds` seeds.

    near: the first seed, shape (nq,); joints that do not move the frame keep its values.
    bounds: lower and upper position limits, shape (nv,).
    """
    raise_if_late()
    near = inside(robot, near, *bounds)
    if any(each.sides for each in goal.parts) and max(goal.miss(robot, near)) <= PYTHON_TOLERANCE:
        return Branches(near[None], near)  # where a plan before ended
    if goal.also:
        return _of_several(robot, goal.middle, near, bounds, most, seeds)
    lower, upper = bounds
    compiled = _compiled(robot, goal.frame, lower.tobytes(), upper.tobytes())
    if compiled is None:
        return _in_python(robot, goal, near, bounds, most, seeds)
    chain, size = compiled.chain, goal.equations
    if _beyond_reach(chain, goal):
        seeds = min(seeds, BEYOND_REACH)
    found, best = np.empty((most, chain.n)), np.empty(chain.n)
    count, _ = compiled.kernel.search(
        position=_contiguous(goal.position),
        rotation=_contiguous(goal.rotation),
        axis=None if goal.directions is None else np.array(goal.directions),
        weight=1 / LENGTH,
        near=chain.angles(near),
        apart=ISOLATED if chain.n <= size else IN_A_FAMILY,
        seeds=seeds,
        patience=PATIENCE,
        configurations=found,
        best=best,
    )
    q = chain.configurations(np.vstack([found[:count], best]), near)
    within = count == 0 and goal.regional and max(goal.miss(robot, q[-1])) == 0.0
    return Branches(q if within else q[:-1], q[-1])


def _of_several(
    robot: Robot, goal: FrameGoal, near: Array, bounds: tuple[Array, Array], most: int, seeds: int
) -> Branches:
    """Those of several frames: all pairs of what frames reach that have no joint in common.

    Frames that joints move together are searched for together, in Python, first from where each of
    them is at its own goal.
    """
    best = np.zeros(robot.nv)
    moves: Array = np.zeros((1, robot.nv))
    for parts in _apart(robot, goal.parts):
        if len(parts) == 1:
            alone = parts[0].alone
            found = find_branches(robot, alone, near, bounds, most, seeds)
        else:
            each = (part.alone for part in parts)
            known = [q for x in each for q in find_branches(robot, x, near, bounds, most, seeds).q]
            together = replace(parts[0], also=parts[1:])
            found = _in_python(robot, together, near, bounds, most, seeds, known)
        own = robot.difference(near, found.q)
        moves = (moves[:, None] + own[None]).reshape(-1, robot.nv)
        moves = moves[np.argsort(np.linalg.norm(moves, axis=1), kind="stable")][:most]
        best += own[0] if len(own) else robot.difference(near, found.best)
    q = np.array([robot.integrate(near, each) for each in moves]).reshape(-1, robot.nq)
    return Branches(q, q[0] if len(q) else robot.integrate(near, best))


def _apart(robot: Robot, parts: Sequence[FrameGoal]) -> list[list[FrameGoal]]:
    """The goals, those whose frames a joint moves together in one list."""
    groups = list[tuple[list[FrameGoal], Mask]]()
    for part in parts:
        own, moved = [part], moves_frame(robot.model, part.frame)
        common = [each for each in groups if (each[1] & moved).any()]
        groups = [each for each in groups if not (each[1] & moved).any()]
        for others, mask in common:
            own, moved = [*others, *own], moved | mask
        groups.append((own, moved))
    return [own for own, _ in groups]


@lru_cache(maxsize=64)
def _compiled(robot: Robot, frame: str, lower: bytes, upper: bytes) -> _CompiledChain | None:
    """The compiled search for a frame, with the table of its seeds; None where there is none."""
    chain = read_kinematic_chain(robot.model, frame)
    if chain is None:
        return None
    bounds = (np.frombuffer(each)[chain.velocities] for each in (lower, upper))
    return _CompiledChain(chain, chain.compiled(*bounds))


def _contiguous(value: npt.ArrayLike | None) -> Array | None:
    return None if value is None else np.ascontiguousarray(value)


def _beyond_reach(chain: KinematicChain, goal: FrameGoal) -> bool:
    if goal.position is None:
        return False
    first = chain.translations[0]
    return math.dist(np.asarray(goal.position), first) > chain.reach + GOAL_TOLERANCE


def _in_python(
    robot: Robot,
    goal: FrameGoal,
    near: Array,
    bounds: tuple[Array, Array],
    most: int,
    seeds: int,
    known: Sequence[Array] = (),
) -> Branches:
    """The same without the compiled search. known: configurations to begin from after `near`."""
    apart = ISOLATED if robot.nv <= goal.equations else IN_A_FAMILY
    found: list[Array] = []
    best, least, since = near, np.inf, 0
    for q in itertools.islice(candidates(robot, goal, near, *bounds, known), seeds):
        error, since = sum(goal.miss(robot, q)), since + 1
        if error < least:
            best, least = q, error
        if error <= PYTHON_TOLERANCE and _is_new(robot, q, found, apart):
            found.append(q)
            since = 0
        if len(found) == most or (found and since > PYTHON_PATIENCE):
            break
    return Branches(np.array(found).reshape(-1, robot.nq), best)


def _is_new(robot: Robot, q: Array, found: list[Array], apart: float) -> bool:
    return all(np.abs(robot.difference(other, q)).max() >= apart for other in found)
