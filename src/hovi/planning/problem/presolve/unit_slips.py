"""Durations, masses and gravity that look like other units than those of the SI: warnings."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from hovi.planning.problem.presolve.frame_hints import MILLIMETRE
from hovi.planning.problem.presolve.length_slips import payloads_of
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.scene.scene import Scene

MILLISECOND, GRAM = 1e-3, 1e-3
"""A millisecond, in [s], and a gram, in [kg]."""
MILLISECONDS_FROM = 100.0
"""Duration from which it may have been meant in milliseconds, in [s]."""
PLAUSIBLE_SPEED = 10.0
"""Speed that joints have at most where their velocity limits are larger, in [rad/s] or [m/s]."""
GRAMS_RATIO = 10.0
"""Ratio of a payload's mass to the robot's above which it may have been meant in grams."""
MILLIMETRES_GRAVITY = 1e3
"""Gravity above which it may have been meant in mm/s^2, in [m/s^2]."""


def long_durations(problem: TrajectoryProblem) -> Iterator[str]:
    """A sentence about a long duration that would suffice if it were in milliseconds.

    Of motions without via points, at the velocity limits of the problem and of the URDF.
    """
    T, robot, limits = problem.grid.duration, problem.robot, problem.limits
    if T < MILLISECONDS_FROM or problem.via:
        return
    given = robot.model.velocityLimit
    speed = np.where(given > 0.0, np.minimum(given, PLAUSIBLE_SPEED), PLAUSIBLE_SPEED)
    if limits is not None:
        speed = np.minimum(speed, limits.at_ends[0].upper[1])
    distance = np.abs(robot.difference(*problem.ends[0]))
    moving = distance > 0.0
    if not moving.any():
        return
    with np.errstate(divide="ignore"):
        least = float((distance[moving] / speed[moving]).max())
    if least <= MILLISECOND * T:
        yield (
            f"the duration of {T:g} s looks like milliseconds, which are {MILLISECOND * T:g} s: at "
            f"the velocity limits the joints take {least:.2g} s."
        )


def heavy_loads(scene: Scene) -> Iterator[str]:
    """Sentences about payloads of many times the robot's mass, and about implausible gravity."""
    own = pin.computeTotalMass(scene.robot.model)
    for payload in payloads_of(scene):
        if payload.mass > GRAMS_RATIO * own > 0.0:
            yield (
                f"the payload of {payload.mass:g} kg looks like grams, which are "
                f"{GRAM * payload.mass:g} kg: the robot's moving links weigh {own:.3g} kg."
            )
    g = float(np.linalg.norm(scene.model.gravity.linear))
    if g > MILLIMETRES_GRAVITY:
        yield f"a gravity of {g:g} m/s^2 looks like mm/s^2, which is {MILLIMETRE * g:g} m/s^2."
