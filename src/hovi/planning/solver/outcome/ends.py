"""Whether a motion has the ends of its problem."""

from __future__ import annotations

from hovi.conditions.condition import missed
from hovi.discrete.grid import DiscretePath
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.conditions_of import ends_of
from hovi.planning.problem.notation.goal_turns import turns_missed
from hovi.planning.problem.problem import TrajectoryProblem


def starts_there(problem: TrajectoryProblem, path: DiscretePath) -> bool:
    """Whether a path starts where a problem does."""
    return not missed(next(ends_of(problem)), path)


def misses(problem: TrajectoryProblem, path: DiscretePath) -> str:
    """How far the ends of a path are from the problem's, as a clause; "" if they are the same."""
    parts = [missed(each, path) for each in ends_of(problem)]
    own = [each for each in problem.equations if each.where.node == path.intervals]
    parts += [clause and f"misses its goal: {clause}" for clause in (missed(x, path) for x in own)]
    return " and ".join(filter(None, parts))


def turns_missed_by(problem: TrajectoryProblem, motion: Trajectory) -> str:
    """By how many full turns a motion is away from a goal, as a clause; "" if by none."""
    on, at_ends = problem.coordinates, problem.free_ends[:, 0]
    if not on.space.angles:
        return ""
    free = [at_ends[0] | ~each.fixed[0] for each in problem.holds] + [at_ends.any(axis=0)]
    times = [*(each.time for each in problem.holds), motion.duration]
    stops = zip(problem.goals, motion.positions(times), free, strict=False)
    clause = next(filter(None, (turns_missed(x, on, q, left) for x, q, left in stops)), "")
    return clause and f"the motion {clause}"
