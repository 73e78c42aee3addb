"""What is found about a problem before it is solved: why it has no motion, and what looks wrong."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from hovi.discrete.state import Periodic, State
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.problem.contradictions import contradiction
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import no_limits
from hovi.planning.problem.presolve.end_torques import held_still
from hovi.planning.problem.presolve.legs import Stop, frame_too_far
from hovi.planning.problem.presolve.length_slips import length_slips
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.scene.scene import Scene
from hovi.system.dataclass import dataclass

LONG, MANY_TIMES = 100.0, 500.0
"""Duration in [s], and its ratio to the time at the velocity limits, from which both may have been
meant in milliseconds."""
MANY_ROBOTS, STRONG = 10.0, 1e3
"""Mass of a payload, relative to the robot's, from which it may have been meant in grams, and the
gravity from which it may have been meant in mm/s^2, in [m/s^2]."""


@dataclass(frozen=True)
class Findings:
    """What is known before a solve.

    reason: why there is no motion, as a clause; "" if nothing is known against it.
    warnings: sentences about what is possible, but probably not what was meant.
    """

    reason: str = ""
    warnings: tuple[str, ...] = ()


def findings(
    problem: TrajectoryProblem, start: State | FrameGoal, goal: State | FrameGoal | Periodic
) -> Findings:
    """What is found about a problem of a robot, within a fraction of a second.

    start, goal: as they were given; those of the problem may be one of several configurations.
    """
    found = about_limits(problem, start, goal)
    return Findings(found.reason, (*slips(problem), *found.warnings))


def about_limits(
    problem: TrajectoryProblem, start: State | FrameGoal, goal: State | FrameGoal | Periodic
) -> Findings:
    """As `findings`, what follows from limits and obstacles alone."""
    limits = problem.limits or no_limits(problem.coordinates)
    if not problem.limited:
        return Findings()
    warnings = list[str]()
    at_frame = isinstance(start, FrameGoal)  # of which the problem has one configuration alone
    reason = "" if at_frame else contradiction(problem, limits)
    if reason or isinstance(goal, Periodic):
        return Findings(reason)
    stops = [Stop("start", 0.0, start), *(_via(problem)), Stop("goal", problem.grid.duration, goal)]
    short = frame_too_far(problem.robot, stops, limits)
    if short is not None and short.certain:
        return Findings(short.clause)
    if short is not None:
        warnings.append(f"{short.clause}.")
    if not at_frame:
        what = "the motion has to begin or end with an acceleration there, and may not exist"
        if problem.ld.k > 2 and not problem.free_ends[1, 2].any():
            what = "the motion ends without an acceleration there, and hardly exists"
        warnings += [
            f"{clause}: {what}; reduce the load, or change the ends or the limits."
            for clause in held_still(problem, limits)
        ]
    return Findings("", tuple(warnings))


def _via(problem: TrajectoryProblem) -> list[Stop]:
    stops = [Stop(f"via point at {via.time:g} s", via.time, via.goal) for via in problem.via]
    return sorted(stops, key=lambda stop: stop.time)


def slips(problem: TrajectoryProblem) -> list[str]:
    """Sentences about what looks like other units: lengths, angles, durations, masses, gravity."""
    states = [(x.goal, x.name) for x in _via(problem) if isinstance(x.goal, State)]
    inner = [state.on(problem.robot, name)[0] for state, name in states]
    q = [problem.boundary[0], *inner]
    ends = [] if isinstance(problem.goal, FrameGoal) else [problem.boundary[2]]
    lengths = length_slips(problem.scene, problem.clearance or Clearance(), [*q, *ends])
    return [*lengths, *_long_durations(problem), *_heavy_loads(problem.scene)]


def _long_durations(problem: TrajectoryProblem) -> Iterator[str]:
    """The duration, if it is long and hundreds of times what the URDF's velocities take."""
    T, robot = problem.grid.duration, problem.robot
    speed = np.where(robot.model.velocityLimit > 0.0, robot.model.velocityLimit, np.inf)
    distance = np.abs(robot.difference(problem.boundary[0], problem.boundary[2]))
    least = float((distance / speed).max())
    if least > 0.0 and max(LONG, MANY_TIMES * least) <= T:
        yield (
            f"the duration of {T:g} s looks like milliseconds, which are {1e-3 * T:g} s: at the "
            f"velocity limits of the URDF, the joints take {least:.2g} s."
        )


def _heavy_loads(scene: Scene) -> Iterator[str]:
    """Payloads that weigh many times what the robot does, and gravity that no planet has."""
    for effect in scene.effects:
        values = vars(effect)
        if effect.key == "payload":
            mass, own = values["mass"], pin.computeTotalMass(scene.robot.model)
            if mass > MANY_ROBOTS * own > 0.0:
                yield (
                    f"the payload of {mass:g} kg looks like grams, which are {1e-3 * mass:g} kg: "
                    f"the robot has {own:.3g} kg."
                )
        if effect.key == "gravity" and values["acceleration"] > STRONG:
            g = values["acceleration"]
            yield f"a gravity of {g:g} m/s^2 looks like mm/s^2, which are {1e-3 * g:g} m/s^2."
