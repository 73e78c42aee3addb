"""Segments of a sequence that no motion satisfies, as is seen without a solve."""

from __future__ import annotations

from collections.abc import Sequence

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import ALL, State
from hovi.planning.problem.contradictions import contradiction
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.search.job import Job
from hovi.planning.sequence.branches import End, Leg
from hovi.schemes import galerkin


def contradictory_segment(
    job: Job, legs: Sequence[Leg], limits: Sequence[Limits], names: Sequence[str]
) -> str:
    """Why no motion of a segment is within its limits and clear of obstacles; "" if unknown.

    legs: of the sequence; those over several segments are not looked at. limits, names: of the
    segments.
    """
    if not job.options.clearance.wanted and not any(each.bounded.any() for each in limits):
        return ""
    before: End = job.start
    for leg in legs:
        if isinstance(before, FrameGoal) and before.guess is None:
            return ""  # it cannot be met, as the problem itself says
        if len(leg.numbers) == 1:
            number = leg.numbers[0]
            problem = _alone(job, leg, _as_start(before), limits[number])
            reason = contradiction(problem, limits[number])
            if reason:
                return f"in {names[number]!r} {reason}"
        before = leg.goal
    return ""


def _alone(job: Job, leg: Leg, start: State, limits: Limits) -> TrajectoryProblem:
    """The problem of a segment alone, on one interval; only its ends are looked at."""
    scene = job.parts[leg.numbers[0]].acting.on(job.scene)
    grid = Grid.uniform(leg.end - leg.begin, 1, galerkin(2, scene.order))
    ld = DiscreteLagrangian(scene.effort_lagrangian(job.options.weight), grid)
    return TrajectoryProblem(ld, start, leg.goal, limits, (), job.options.clearance)


def _as_start(goal: End) -> State:
    """The goal of a segment as the start of the next one, free where the target of a frame is."""
    if isinstance(goal, State):
        return goal
    assert goal.guess is not None
    return State(goal.guess, free=(ALL,), free_velocity=tuple(goal.free_velocity))
