"""The error of a solution, from a finer solution next to it."""

from __future__ import annotations

from hovi.discrete.motion_error import MotionError, deviation
from hovi.errors import InputError
from hovi.planning.refinement.finer_solution import FinerSolution, finer_solution
from hovi.planning.solver.solver import Solution


def estimate_error(solution: Solution, frame: str | None = None) -> MotionError | None:
    """How far a solution is from the motion that it approximates, over the whole motion.

    It is compared with the solution nearby on the same intervals with two more inner modes each,
    whose own error is smaller by orders where the motion is resolved.
    frame: whose origin is followed, by default the robot's tip_frame.
    None where no such solution was found nearby: nothing is known of the error then.
    Raises InputError for what is no minimum.
    """
    finer = finer_than(solution)
    return None if finer is None else estimate_against(solution, finer, frame)


def estimate_against(
    solution: Solution, finer: FinerSolution, frame: str | None = None
) -> MotionError:
    """The error of a solution from a finer one that is known already; frame as above."""
    costs = finer.known, finer.cost
    return deviation(solution.trajectory, finer.trajectory, costs, frame)


def finer_than(solution: Solution) -> FinerSolution | None:
    """The finer solution that `estimate_error` compares with."""
    problem = solution.problem
    if problem is None:
        raise InputError("this solution does not know its problem; plan again instead.")
    if not solution.success:
        raise InputError(f"errors of minima are estimated, and this ended in {solution.status}.")
    return finer_solution(problem, solution.trajectory.path)
