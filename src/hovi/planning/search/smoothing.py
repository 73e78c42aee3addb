"""smooth = True: a cost on the jerk whose weight follows from the robot and the duration.

A weight w rounds off what the motion of least effort does within sqrt(w) / M, with M the inertia of
the joint. Here sqrt(w) / M is SMOOTHING_SHARE of the duration for the largest inertia, and longer
for all others: lighter joints get the same weight rather than one by their own inertia, since their
torques cost so little that they would whirl at no cost.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from hovi.discrete.state import State
from hovi.effects.motion_cost import JerkCost
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.robot.mass_matrix import MassMatrix
from hovi.scene.scene import Scene

SMOOTHING_SHARE = 0.01
"""Smoothing time of the largest inertia, as a share of the duration."""


def smoothed(scene: Scene, start: State, goal: State | FrameGoal, duration: float) -> Scene:
    """The scene with a cost on the jerk, w = (SMOOTHING_SHARE T M)^2.

    M is the largest eigenvalue of the mass matrix at the ends, of its block of angles for joints
    that turn, and of its block of lengths for joints that slide.
    duration: T, in [s]. Raises InputError for a scene that has a cost on the jerk already.
    """
    if scene.order != 2:
        raise InputError(
            "smooth = true chooses the weight of a cost on the jerk, and the scene has one, "
            "jerk_cost: leave one of the two out."
        )
    robot = scene.robot
    known = [(start, "start"), *([(goal, "goal")] if isinstance(goal, State) else [])]
    q = np.stack([state.on(robot, name)[0] for state, name in known])
    M = MassMatrix(scene.model)(q)
    inertia = np.empty(robot.nv)
    for kind in (robot.sliding, ~robot.sliding):
        if kind.any():
            inertia[kind] = np.linalg.eigvalsh(M[:, kind][:, :, kind]).max()
    with np.errstate(over="ignore", under="ignore"):
        weight = (SMOOTHING_SHARE * duration * inertia) ** 2
    if not (np.isfinite(weight).all() and (weight > 0).all()):
        raise InputError(
            "smooth = true weights the jerk by the square of the duration, which is too short or "
            f"too long for that at {duration:.3g} s: change the duration."
        )
    return dataclasses.replace(scene, effects=[*scene.effects, JerkCost(tuple(weight.tolist()))])
