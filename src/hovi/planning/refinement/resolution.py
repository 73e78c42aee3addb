"""Resolution: a motion that is called a minimum is one between the quadrature points, too.

On a coarse grid the torque may vanish at the points and swing between them. Such a motion is a
minimum of the discrete action, and of nothing else.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from hovi.discrete.curve_integral import integral_along
from hovi.discrete.grid import DiscretePath
from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.refinement.candidate import error_of_cost
from hovi.planning.refinement.error_estimate import finer_than
from hovi.planning.refinement.passive_torque import NEGLIGIBLE_SHARE, passive_torque
from hovi.planning.refinement.whirling import (
    UNUSABLE_RATIO,
    whirl,
    whirl_without_minimum,
)
from hovi.planning.solver.solver import Solution, solve_on_grid
from hovi.planning.solver.status import Status
from hovi.schemes import is_galerkin
from hovi.system.blas_threads import one_blas_thread
from hovi.system.deadline import OutOfTimeError, is_late
from hovi.system.interruption import interruptible

RESOLVED = 0.01
"""Largest relative difference of costs for a success."""
NEARBY = 0.05
"""Change of q, and of T v, in [rad] or [m], up to which a motion near one that passed is not
compared with a finer one again."""
NEGLIGIBLE = 1e-12
"""Cost that counts as none, relative to that of torques of the size of the inertial torque."""


def solve(
    problem: TrajectoryProblem, guess: str | Trajectory | DiscretePath = "cubic", **options: Any
) -> Solution:
    """A motion that makes the discrete action stationary, checked between the points.

    As `hovi.planning.solver.solver.solve_on_grid`, whose options it takes. A minimum on the grid
    that is none along the whole motion has the status UNRESOLVED: see `resolved`.
    """
    return resolved(solve_on_grid(problem, guess, **options))


@one_blas_thread
@interruptible
def resolved(solution: Solution) -> Solution:
    """A success with an error estimate, or the same motion with the status UNRESOLVED.

    A minimum is resolved if
    (a) with Galerkin tables, whose curve is their own, the action differs by at most 1 % from the
        integral of L~ along the curve, and no torque of a passive joint exceeds 1 % of the largest
        torque;
    (b) the solution on a finer grid, reached from this one, is a minimum whose cost differs by at
        most 1 %. The finer grid has two more modes per interval, of a Galerkin table for any
        scheme; under limits every interval is halved instead;
    (c) that solution was found;
    and if no light joint without limits whirls so fast that no grid can be trusted.
    Solutions of another status are returned unchanged. If the deadline in force passes before
    (a) to (c) are known, the status is TIME_LIMIT.
    """
    if not solution.success or solution.problem is None:
        return solution
    try:
        solution, reason = _checked(solution)
    except OutOfTimeError:
        return _not_checked(solution)
    if reason and is_late():  # perhaps only as the finer solve was ended
        return _not_checked(solution)
    if reason:
        return _unresolved(solution, reason)
    assert solution.error_estimate is not None
    passed = Resolution(solution.trajectory.path, solution.error_estimate)
    return dataclasses.replace(solution, check=passed)


def _checked(solution: Solution) -> tuple[Solution, str]:
    """The solution with an estimate, and why it is no minimum along its way, or ""."""
    reason = _difference_along(solution)
    if not reason and solution.error_estimate is None:
        solution, reason = _compared(solution)
    elif not reason:
        reason = _estimate_sentence(solution.error_estimate)
    return solution, reason or _whirling_sentence(solution)


def told_as_whirling(solution: Solution) -> Solution:
    """A motion at its iteration limit as an unresolved one, if a light joint whirls in it."""
    whirling = whirl_without_minimum(solution)
    if whirling is None:
        return solution
    metadata = {**solution.trajectory.metadata, "status": str(Status.UNRESOLVED)}
    return dataclasses.replace(
        solution,
        status=Status.UNRESOLVED,
        message=f"{solution.message.rstrip('.')}: {whirling}.",
        trajectory=dataclasses.replace(solution.trajectory, metadata=metadata),
    )


@dataclass(frozen=True, eq=False)
class Resolution:
    """The check of motions that are replanned from one that passed.

    path: that motion. estimate: of the relative error of its cost, which holds for motions nearby.
    """

    path: DiscretePath
    estimate: float

    def __call__(self, solution: Solution) -> Solution:
        """The solution as `resolved` returns it, without (b) for a motion NEARBY."""
        if not (solution.success and self._is_near(solution)):
            return resolved(solution)
        reason = _difference_along(solution)
        if reason:
            return _unresolved(solution, reason)
        return dataclasses.replace(_with_estimate(solution, self.estimate), check=self)

    def _is_near(self, solution: Solution) -> bool:
        problem, path = solution.problem, solution.trajectory.path
        assert problem is not None
        if path.q.shape != self.path.q.shape:
            return False
        dq = problem.robot.difference(self.path.q, path.q)
        dv = problem.grid.duration * (path.v - self.path.v)
        return bool(max(np.abs(dq).max(), np.abs(dv).max()) <= NEARBY)


def _difference_along(solution: Solution) -> str:
    """(a): why the motion differs from its values at the points; "" if it does not."""
    problem, trajectory = solution.problem, solution.trajectory
    assert problem is not None
    if not all(is_galerkin(scheme) for scheme, _ in problem.grid.groups):
        return ""
    known = solution.accuracy, solution.error_estimate
    if known[0] is not None and known[1] is not None and known[0].along + known[1] <= RESOLVED:
        return _passive_sentence(problem, trajectory)  # both are that close to the same cost
    action = problem.ld.action(trajectory.path)
    integral = integral_along(problem.ld.lagrangian, trajectory).value
    least = NEGLIGIBLE * problem.inertial_torque**2 * problem.grid.duration
    if not abs(action - integral) <= RESOLVED * max(abs(integral), least):
        return (
            f"its cost is {action:.6g} at the quadrature points, but {integral:.6g} along its own "
            "curve"
        )
    return _passive_sentence(problem, trajectory)


def _passive_sentence(problem: TrajectoryProblem, trajectory: Trajectory) -> str:
    """The torque of a passive joint between the points; "" if it is negligible."""
    found = passive_torque(problem, trajectory)
    if found is None or found.share <= NEGLIGIBLE_SHARE:
        return ""
    return (
        f"joint {found.joint!r} is passive, but carries up to {found.torque:.3g} N m between the "
        f"quadrature points, where other joints carry at most {found.largest:.3g}"
    )


def _compared(solution: Solution) -> tuple[Solution, str]:
    """(b) and (c): the solution with the estimate, and why it is no minimum, or ""."""
    try:
        finer = finer_than(solution)
    except HoviError as refused:
        return solution, f"it could not be compared with a finer one: {str(refused).rstrip('.')}"
    if finer is None:
        return solution, "from it no minimum was found on a finer grid"
    estimate, difference = error_of_cost(solution, finer), abs(finer.known - finer.cost)
    if solution.cost > finer.known:  # the cost of a free duration includes w T
        estimate *= finer.known / solution.cost
    compared = _with_estimate(solution, estimate)
    if difference <= RESOLVED * abs(solution.cost):
        return compared, ""
    return compared, _sentence(difference / abs(solution.cost))


def _whirling_sentence(solution: Solution) -> str:
    """The speed of a joint that whirls beyond UNUSABLE_RATIO; "" if none does."""
    assert solution.problem is not None
    whirling = None if solution.problem.limited else whirl(solution)
    if whirling is None or whirling.ratio <= UNUSABLE_RATIO:
        return ""
    return f"at {whirling.speed:.3g} rad/s a finer grid may find another motion"


def _estimate_sentence(estimate: float | None) -> str:
    if estimate is None:
        return "from it no minimum was found on a finer grid"
    return "" if estimate <= RESOLVED else _sentence(estimate)


def _sentence(change: float) -> str:
    return f"a finer grid changes its cost by {100 * change:.2g} %"


def _with_estimate(solution: Solution, estimate: float) -> Solution:
    metadata = {**solution.trajectory.metadata, "error_estimate": estimate}
    trajectory = dataclasses.replace(solution.trajectory, metadata=metadata)
    return dataclasses.replace(solution, trajectory=trajectory, error_estimate=estimate)


def _unresolved(solution: Solution, reason: str) -> Solution:
    """The solution as no success, with the figures and what to do."""
    assert solution.problem is not None
    message = (
        f"the motion is a minimum on {solution.problem.grid.intervals} intervals, but not along "
        f"its whole way: {reason}; {_remedy(solution)}."
    )
    return _failed(solution, Status.UNRESOLVED, message)


def _not_checked(solution: Solution) -> Solution:
    """The solution as no success, since it is not known what lies between its points."""
    assert solution.problem is not None
    message = (
        f"the motion is a minimum on {solution.problem.grid.intervals} intervals, of cost "
        f"{solution.cost:.10g}, but the time limit was reached before it was compared with one on "
        "a finer grid; allow more time."
    )
    return _failed(solution, Status.TIME_LIMIT, message)


def _failed(solution: Solution, status: Status, message: str) -> Solution:
    metadata = {**solution.trajectory.metadata, "status": str(status)}
    trajectory = dataclasses.replace(solution.trajectory, metadata=metadata)
    return dataclasses.replace(
        solution,
        success=False,
        status=status,
        message=message,
        trajectory=trajectory,
        minima=(),
        check=None,
    )


def _remedy(solution: Solution) -> str:
    """What to do, by what the motion looks like."""
    whirling = whirl(solution)
    if whirling is not None:
        return str(whirling)
    if solution.accuracy is None:
        return (
            "use more intervals or a scheme with more points, such as 'galerkin-2x8', or name "
            "neither, so that plan chooses"
        )
    return "set limits or another initial guess, or try more starts"
