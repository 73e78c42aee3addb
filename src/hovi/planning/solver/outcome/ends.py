"""Both ends of a motion: the states, the goal of a frame, and full turns."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.state import Periodic, State
from hovi.discrete.trajectory import Trajectory
from hovi.planning.conditions.condition import TOLERANCE
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.notation.goal_turns import turns_missed
from hovi.planning.problem.problem import TrajectoryProblem

Array = npt.NDArray[np.float64]

_NAMES = "position", "velocity", "acceleration", "jerk"


def ends_missed(problem: TrajectoryProblem, motion: Trajectory) -> str:
    """How far a motion's ends are from the problem's, or why these cannot be reached, or ""."""
    missed = misses(problem, motion.path) or _turns_missed(problem, motion)
    return f"the motion {missed}" if missed else problem.unreachable


def _turns_missed(problem: TrajectoryProblem, motion: Trajectory) -> str:
    """By how many full turns the motion ends away from its goal, as a clause; "" if by none."""
    goal, on = problem.goal, problem.coordinates
    if not isinstance(goal, State) or not on.space.angles:
        return ""
    free = np.asarray(problem.free_ends[:, 0].any(axis=0))
    return turns_missed(goal, on, motion.positions(motion.duration)[0], free)


def starts_there(problem: TrajectoryProblem, path: DiscretePath) -> bool:
    """Whether a path starts where a problem does."""
    return not _miss(problem, path, 0, "starts")


def misses(problem: TrajectoryProblem, path: DiscretePath) -> str:
    """How far the ends of a path are from the problem's, as a clause; "" if they are the same."""
    parts = [_miss(problem, path, 0, "starts")]
    if isinstance(problem.goal, FrameGoal):
        distance, angle = problem.goal.miss(problem.robot, path.q[-1])
        if max(distance, angle) > TOLERANCE:
            parts.append(f"ends {distance:.3g} m and {angle:.3g} rad from the goal of its frame")
    elif not isinstance(problem.goal, Periodic):
        parts.append(_miss(problem, path, 1, "ends"))
    return " and ".join(part for part in parts if part)


def _miss(problem: TrajectoryProblem, path: DiscretePath, end: int, verb: str) -> str:
    """The largest differences of position and rates at one end, as a clause; "" if there are none.

    end: 0 for the start, 1 for the goal.
    """
    on, k = problem.coordinates, problem.ld.k
    place, found = (0, -1)[end], []
    wanted = [x[end] for x in problem.ends]
    given = [path.q[place], *path.rates[place]]
    for i in range(k):
        change = on.difference(wanted[0], given[0]) if i == 0 else given[i] - wanted[i]
        change = np.where(problem.free_ends[end, i], 0.0, change)
        joint = int(np.argmax(np.abs(change)))
        if abs(change[joint]) > TOLERANCE:
            units = on.coordinate_units[joint]
            unit = units[i] if i < 3 else f"{units[0]}/s^{i}"
            name = on.coordinate_names[joint]
            what = _NAMES[i] if i < len(_NAMES) else f"derivative {i}"
            found.append(f"{abs(change[joint]):.3g} {unit} from the {what} of {name!r}")
    return f"{verb} {' and '.join(found)}" if found else ""
