"""smooth = True: a cost on the jerk whose weight follows from the robot and the duration.

A weight w rounds off what the motion of least effort does within sqrt(w) / M, with M the inertia of
the joint. Here sqrt(w) / M is SMOOTHING_FRACTION of the duration for the largest inertia, and more
for all others: lighter joints get the same weight rather than one by their own inertia, since their
torques cost so little that they would spin for free.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from hovi.discrete.state import State
from hovi.effects.motion_cost import AccelerationCost, JerkCost
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.robot.mass_matrix import MassMatrix
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene, require_plannable

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

SMOOTHING_FRACTION = 0.01
"""Smoothing time of the largest inertia, as a fraction of the duration."""


def smoothed(scene: Scene, start: State, goal: State | FrameGoal, duration: float) -> Scene:
    """The scene with a cost on the jerk, w = (SMOOTHING_FRACTION T M)^2.

    M is the largest eigenvalue of the mass matrix at the ends, of its block of angles for joints
    that turn, and of its block of lengths for joints that slide. Where torques are free and
    accelerations have weights, M^2 is the largest of these.
    duration: T, in [s]. Raises InputError for a scene that has a cost on the jerk already,
    ModelError for torques of a robot without inertia.
    """
    if scene.order != 2:
        raise InputError(
            "smooth = true chooses the weight of a cost on the jerk, and the scene has one, "
            'jerk_cost, or by objective = "jerk": leave one of the two out.'
        )
    squared = _acceleration_weights(scene)
    if squared is None:
        squared = _squared_inertias(scene, start, goal)
    with np.errstate(over="ignore", under="ignore"):
        weight = (SMOOTHING_FRACTION * duration * np.sqrt(squared)) ** 2
    if not (np.isfinite(weight).all() and (weight > 0).all()):
        raise InputError(
            "smooth = true weights the jerk by the square of the duration, which is too short or "
            f"too long for that at {duration:.3g} s: change the duration."
        )
    return dataclasses.replace(scene, effects=[*scene.effects, JerkCost(tuple(weight.tolist()))])


def _acceleration_weights(scene: Scene) -> Array | None:
    """M^2 as the largest weight of an acceleration, (nv,); None unless torques are free."""
    own = next((each for each in scene.effects if isinstance(each, AccelerationCost)), None)
    if own is None or scene.effort_lagrangian(regular=False).needs_torques:
        return None
    weights = own.weights(scene.robot)
    return _largest_of_each_kind(scene.robot, lambda kind: float(weights[kind].max()))


def _squared_inertias(scene: Scene, start: State, goal: State | FrameGoal) -> Array:
    """M^2 as the largest squared eigenvalue of the mass matrix at the ends, (nv,)."""
    require_plannable(scene)  # raises where a joint has no inertia
    robot = scene.robot
    known = [(start, "start"), *([(goal, "goal")] if isinstance(goal, State) else [])]
    q = np.stack([state.on(robot, name)[0] for state, name in known])
    M = MassMatrix(scene.model)(q)
    with np.errstate(over="ignore", under="ignore"):
        return _largest_of_each_kind(
            robot, lambda kind: float(np.linalg.eigvalsh(M[:, kind][:, :, kind]).max() ** 2)
        )


def _largest_of_each_kind(robot: Robot, largest: Callable[[Mask], float]) -> Array:
    """One number for the joints that turn and one for those that slide, shape (nv,)."""
    found = np.empty(robot.nv)
    for kind in (robot.sliding, ~robot.sliding):
        if kind.any():
            found[kind] = largest(kind)
    return found
