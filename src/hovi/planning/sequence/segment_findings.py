"""What is found about the segments of a sequence before it is solved, each looked at alone."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import ALL, State
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.notation.goal_turns import keeping_turns
from hovi.planning.problem.presolve.findings import Findings, about_limits, slips
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.search.job import Job
from hovi.planning.sequence.branches import End, MoveToGoal
from hovi.schemes import galerkin


def segment_findings(
    job: Job, moves: Sequence[MoveToGoal], limits: Sequence[Limits], names: Sequence[str]
) -> Findings:
    """What is found about the segments of a sequence before it is solved, with their names.

    moves: of the sequence; limits are not looked at in those over several segments, nor after a
    goal that cannot be reached, which the problem itself names. limits, names: of the segments.
    """
    reported, looked_like = list[str](), list[str]()
    before: State | None = job.start
    for move in moves:
        number = move.numbers[0]
        if before is None:
            break
        bounds = limits[number] if number == 0 else dataclasses.replace(limits[number], strict=True)
        problem = _alone(job, move, before, bounds)
        looked_like += slips(problem)
        if len(move.numbers) == 1:
            found = about_limits(problem, before, move.goal)
            reported += [f"in {names[number]!r} {sentence}" for sentence in found.warnings]
            if found.reason:
                reason = f"in {names[number]!r} {found.reason}"
                return Findings(reason, (*dict.fromkeys(looked_like), *reported))
        before = _as_start(move.goal, problem)
    return Findings("", (*dict.fromkeys(looked_like), *reported))


def _alone(job: Job, move: MoveToGoal, start: State, limits: Limits) -> TrajectoryProblem:
    """The problem of a segment alone, on one interval; only its ends are looked at."""
    scene = job.segments[move.numbers[0]].acting.on(job.scene)
    grid = Grid.uniform(move.end - move.begin, 1, galerkin(2, scene.order))
    ld = DiscreteLagrangian(scene.effort_lagrangian(job.options.weight), grid)
    clearance = job.options.clearance.from_time(move.begin)
    return TrajectoryProblem(ld, start, move.goal, limits, (), clearance)


def _as_start(goal: End, problem: TrajectoryProblem) -> State | None:
    """The goal of a segment as the start of the next one, free where the target of a frame is.

    None where no configuration reaches it. problem: of the segment, whose full turns it keeps.
    """
    if isinstance(goal, FrameGoal) and goal.guess is None:
        return None
    known = problem.start, problem.coordinates, *problem.ends[0], problem.turns
    q = keeping_turns(*known).q
    if isinstance(goal, State):
        return dataclasses.replace(goal, q=q, turns={})
    free = goal.free_velocities(problem.robot)
    return State(q, problem.ends[1][1], free=(ALL,), free_velocity=free)
