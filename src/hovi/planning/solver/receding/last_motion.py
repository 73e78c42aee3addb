"""What comes back when time runs out: a motion that meets ends and limits, or the last motion.

A motion meets them to 1e-6: of the ranges of limits, in [rad] and [m], and relative to the largest
torque where joints are passive.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.state import Periodic
from hovi.planning.clearance.clearance_violation import near_pairs
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limit_violation import excess_along
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.augmented_lagrangian_rounds import FEASIBLE_RESIDUAL, within
from hovi.planning.solver.methods.method import MethodResult
from hovi.planning.solver.outcome.cost_with_time import cost_of
from hovi.planning.solver.status import Status

if TYPE_CHECKING:
    from hovi.planning.solver.central_path import CentralPath

Array = npt.NDArray[np.float64]

MET = 1e-6
"""Excess over a limit, as a share of its range, up to which a motion meets it."""
_NAMES = "position", "velocity", "acceleration", "jerk"


def meets(problem: TrajectoryProblem, path: DiscretePath) -> bool:
    """Whether a path with the problem's ends meets its limits, distances and equations everywhere.

    Raises OutOfTimeError when the deadline in force passes before that is known.
    """
    if problem.constrained:
        residuals = ActionObjective(problem).residuals(path)
        if not within(residuals, FEASIBLE_RESIDUAL, FEASIBLE_RESIDUAL):
            return False
    motion = problem.trajectory(path)
    limits = problem.limits
    if limits is not None and limits.bounded.any() and excess_along(motion, limits).worst > MET:
        return False
    if problem.distances is None or problem.clearance is None:
        return True
    return len(near_pairs(motion, problem.distances, float(problem.clearance.margin) - MET)) == 0


def last_motion(
    problem: TrajectoryProblem,
    path: DiscretePath,
    central: CentralPath | None,
    steps: int,
    name: str,
) -> MethodResult:
    """A motion of a similar problem as the result, where time ran out.

    path: on the problem's grid, perhaps with other ends. central: for the next solve.
    steps: of the solve that was ended. name: says what the motion is, as a clause.
    """
    missed = misses(problem, path) or "meets the ends; its limits were not checked"
    message = f"{out_of_time(steps)}; {name}, which {missed}."
    cost, status = cost_of(problem, path), Status.TIME_LIMIT
    return MethodResult(problem, path, cost, status, message, steps, central=central)


def out_of_time(steps: int) -> str:
    """That no motion was found in time, as a clause. steps: of the solve that was ended."""
    return (
        f"the time limit was reached after {steps} steps, before a motion that meets the ends and "
        "the limits was found"
    )


def starts_there(problem: TrajectoryProblem, path: DiscretePath) -> bool:
    """Whether a path starts where a problem does."""
    return not _miss(problem, path, 0, "starts")


def misses(problem: TrajectoryProblem, path: DiscretePath) -> str:
    """How far the ends of a path are from the problem's, as a clause; "" if they are the same."""
    parts = [_miss(problem, path, 0, "starts")]
    if isinstance(problem.goal, FrameGoal):
        distance, angle = problem.goal.miss(problem.robot, path.q[-1])
        if max(distance, angle) > MET:
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
        if abs(change[joint]) > MET:
            units = on.coordinate_units[joint]
            unit = units[i] if i < 3 else f"{units[0]}/s^{i}"
            name = on.coordinate_names[joint]
            what = _NAMES[i] if i < len(_NAMES) else f"derivative {i}"
            found.append(f"{abs(change[joint]):.3g} {unit} from the {what} of {name!r}")
    return f"{verb} {' and '.join(found)}" if found else ""
