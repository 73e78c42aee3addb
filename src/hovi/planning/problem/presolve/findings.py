"""What is found about a problem before it is solved: why it has no motion, and what looks wrong."""

from __future__ import annotations

from hovi.discrete.state import Periodic, State
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.problem.contradictions import contradiction
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import no_limits
from hovi.planning.problem.presolve.end_torques import held_still_at
from hovi.planning.problem.presolve.length_slips import length_slips
from hovi.planning.problem.presolve.moves import Waypoint, frame_too_far
from hovi.planning.problem.presolve.unit_slips import heavy_loads, long_durations
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.system.dataclass import dataclass


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
    waypoints = [
        Waypoint("start", 0.0, start),
        *(_via(problem)),
        Waypoint("goal", problem.grid.duration, goal),
    ]
    short = frame_too_far(problem.robot, waypoints, limits)
    if short is not None and short.certain:
        return Findings(short.clause)
    if short is not None:
        warnings.append(f"{short.clause}.")
    if not at_frame:
        for end in (0, 1):
            what = "the motion has to begin or end with an acceleration there, and may not exist"
            if problem.ld.k > 2 and not problem.free_ends[end, 2].any():
                if problem.ends[2][end].any():
                    continue  # `contradiction` knows its torque
                what = "its acceleration has to be zero there, so that probably no motion exists"
            warnings += [
                f"{clause}: {what}; reduce the load, or change the ends or the limits."
                for clause in held_still_at(problem, limits, end)
            ]
    return Findings("", tuple(warnings))


def _via(problem: TrajectoryProblem) -> list[Waypoint]:
    waypoints = [
        Waypoint(f"via point at {via.time:g} s", via.time, via.goal) for via in problem.via
    ]
    return sorted(waypoints, key=lambda waypoint: waypoint.time)


def slips(problem: TrajectoryProblem) -> list[str]:
    """Sentences about what looks like other units: lengths, angles, durations, masses, gravity."""
    states = [(x.goal, x.name) for x in _via(problem) if isinstance(x.goal, State)]
    inner = [state.on(problem.robot, name)[0] for state, name in states]
    q = [problem.ends[0][0], *inner]
    ends = [] if isinstance(problem.goal, FrameGoal) else [problem.ends[0][1]]
    lengths = length_slips(problem.scene, problem.clearance or Clearance(), [*q, *ends])
    return [*lengths, *long_durations(problem), *heavy_loads(problem.scene)]
