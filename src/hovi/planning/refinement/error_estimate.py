"""The error of a solution, estimated by comparison with a nearby solution on a finer grid.

The finer grid has the same intervals with two more inner modes each. Under limits it has every
interval halved instead: where a limit becomes active the motion has a kink, whose error more inner
modes would hardly reveal.

Prolonged to the finer grid the solution is near the finer one, and one or two Newton steps suffice.
The Hessian of the first step gives the contribution of each interval to the error of the cost.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.discrete.contraction import Expansion
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import stretched
from hovi.discrete.measures.motion_error import MotionError, deviation, sample_points, times_of
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.optimize.start import Start
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.refinement.interpolated_outputs import interpolated_slopes
from hovi.planning.refinement.nearby_minimum import nearby_minimum
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.central_path import CentralPath
from hovi.planning.solver.outcome.cost_with_time import cost_of, price_of_time
from hovi.planning.solver.receding.last_motion import satisfies
from hovi.planning.solver.solver import Solution, solved_on_grid
from hovi.system.blas_threads import one_blas_thread
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

LIMITED_SAFETY_FACTOR = 3.0
"""Factor on estimates under limits, where the finer solution is not much better."""
LEAST_SAFETY_FACTOR = 2.25
"""Least factor on estimates of costs under limits, where their decay is known: see
FinerSolution.safety_factor. Larger than the 2 of a decay by one half, since kinks slow the decay
down."""
SAME_COST = 0.1
"""Largest change of a finer solution's cost when it is finished, relative to its difference from
the coarser one, with which that difference is still used."""
RICHER_LEVEL = 3e-4
"""Barrier parameter at which a solve with more modes begins within limits."""
RICHER_BARRIER = 1e-7
"""Least last barrier parameter of a solve with more modes, which adds less to the cost than errors
that can be resolved."""
SAME_LEVEL = 1.1
"""Ratio of the last barrier parameter of a solve with more modes to the wanted one up to which it
needs no further steps."""
MAX_FINER_STEPS = 80
"""Maximum number of steps to a finer solution: one that takes more is not near."""


@check_arguments
@one_blas_thread
def estimate_error(solution: Solution, frame: str | None = None) -> MotionError | None:
    """The estimated error of a solution, over the whole motion.

    Compared with the nearby solution on a finer grid, whose own error is smaller by orders of
    magnitude where the motion is resolved.
    frame: whose origin is compared, by default those of the robot's tip_frames.
    None if no such solution was found. Raises InputError unless the solution is a minimum, and for
    a frame that is unknown or does not move.
    """
    finer = finer_than(solution)
    return None if finer is None else estimate_against(solution, finer, frame)


def estimate_against(
    solution: Solution, finer: FinerSolution, frame: str | None = None
) -> MotionError:
    """The error of a solution relative to a given finer one; frame as above.

    Within limits times LIMITED_SAFETY_FACTOR, or that of the cost times the finer solution's
    safety_factor; that of the cost is at least the solution's error_estimate.
    """
    error = deviation(solution.trajectory, finer.trajectory, (finer.known, finer.cost), frame)
    if finer.problem.limited:
        cost = finer.safety_factor * error.cost
        error = dataclasses.replace(error.scaled(LIMITED_SAFETY_FACTOR), cost=cost)
    known = solution.error_estimate
    return error if known is None else dataclasses.replace(error, cost=max(error.cost, known))


def with_estimate(solution: Solution, estimate: float | None) -> Solution:
    """The solution with the estimate of its cost's relative error, also in the metadata."""
    trajectory = with_metadata(solution.trajectory, error_estimate=estimate)
    return dataclasses.replace(solution, trajectory=trajectory, error_estimate=estimate)


def with_metadata(trajectory: Trajectory, **entries: object) -> Trajectory:
    """The motion with more entries in its metadata, or with others."""
    return dataclasses.replace(trajectory, metadata={**trajectory.metadata, **entries})


def finer_than(solution: Solution, time_limit: float | None = None) -> FinerSolution | None:
    """The finer solution that `estimate_error` compares with. time_limit: in [s]."""
    problem = solution.problem
    if problem is None:
        raise InputError("this solution has no problem; call plan again instead.")
    if not solution.success:
        raise InputError(
            f"only errors of minima can be estimated, and this solve ended in {solution.status}; "
            "plan again with more time or another initial guess."
        )
    within = problem.limited and solution.central is not None
    richer = richer_within_limits(solution, time_limit) if within else None
    return richer or finer_solution(problem, solution.trajectory.path, time_limit)


@dataclass(frozen=True, eq=False)
class FinerSolution:
    """A solution of a problem on a finer grid.

    problem: on the finer grid; limits may have split its intervals.
    path: its solution, up to a small fraction of its distance from the coarser one. cost: its
        discrete action and the price of time. known: the cost of the coarser solution.
    gains: L_d of each interval of the coarser solution minus L_d with the modes of the finer grid
        and the same end data, shape (N,): the interval's contribution to the error of the cost.
        Their sum is the difference of costs to first order.
    finish: returns the converged finer solution; None if that fails.
    central: of the finer solution within limits, which that of another motion may follow.
    previous_decrease: of the cost in the previous step by two modes, when the coarser solution was
        itself the finer one; None if there was none.
    """

    problem: TrajectoryProblem
    path: DiscretePath
    cost: float
    known: float
    gains: Array
    finish: Callable[[], Solution | None]
    central: CentralPath | None = None
    previous_decrease: float | None = None

    @property
    def safety_factor(self) -> float:
        """Factor on the difference of costs within limits.

        1 / (1 - rho) for a geometric decay, with rho the ratio of the last two decreases, but at
        least LEAST_SAFETY_FACTOR; LIMITED_SAFETY_FACTOR at most, and if rho is unknown.
        """
        before = self.previous_decrease
        rho = 1.0 if before is None else (self.known - self.cost) / before
        factor = 1.0 / (1.0 - rho) if 0.0 <= rho < 1.0 else LIMITED_SAFETY_FACTOR
        return float(np.clip(factor, LEAST_SAFETY_FACTOR, LIMITED_SAFETY_FACTOR))

    def cost_decrease(self, finished: Solution) -> float | None:
        """Decrease of the cost from the coarser solution to this one.

        None if it is not positive, or if finishing changed the cost by more than SAME_COST of it.
        """
        gain = self.known - self.cost
        same = abs(finished.cost - self.cost) <= SAME_COST * gain
        return gain if gain > 0.0 and same else None

    @property
    def trajectory(self) -> Trajectory:
        """The motion without momenta, for sampling."""
        return self.problem.trajectory(self.path)


def richer_within_limits(
    solution: Solution, time_limit: float | None = None
) -> FinerSolution | None:
    """The solution with two more modes per interval, within the same limits at the same instants.

    It starts from the solution's central path, and torques are not checked between the points.
    Finished, it is a solution within limits everywhere. time_limit: in [s].
    """
    problem, central = solution.problem, solution.central
    assert problem is not None
    assert central is not None
    fine, path = problem.finer, solution.trajectory.path
    paths = tuple(prolonged(point, fine.grid) for _, point in central.points)
    along = central.on(fine.grid, paths)
    start = Start(prolonged(path, fine.grid), along, RICHER_LEVEL, near=True)
    barrier = max(RICHER_BARRIER, central.level)
    found = _solved(fine, start, problem, path, time_limit, barrier)
    if found is None:
        return None
    return dataclasses.replace(found, finish=partial(_finished, found, central.level))


def _finished(found: FinerSolution, barrier: float) -> Solution | None:
    """A motion that is no minimum yet, or whose limits were not checked, solved to the end.

    It is returned as it is if it was solved to the end and satisfies its limits between the points.
    barrier: last barrier parameter, relative to the mean density of the cost.
    """
    known = found.finish()
    if known is None or known.central is None or known.problem is None:
        return None
    if known.central.level <= SAME_LEVEL * barrier and satisfies(
        known.problem, known.trajectory.path
    ):
        return dataclasses.replace(known, central=known.central.freed())
    start = Start(known.trajectory.path, known.central.freed(), near=True)
    solution = solved_on_grid(known.problem, start, barrier=barrier)
    return solution if solution.success else None


def finer_solution(
    problem: TrajectoryProblem, path: DiscretePath, time_limit: float | None = None
) -> FinerSolution | None:
    """The solution on a finer grid near a given one; None if none was found.

    time_limit: of a full solve, in [s].
    """
    if problem.limited:
        halves = problem.on(problem.grid.halved())
        curve = stretched(problem.trajectory(path), problem.grid.duration, problem.ld.k)
        return _solved(halves, Start(halves.path(curve), near=True), problem, path, time_limit)
    fine = problem.finer
    start = prolonged(path, fine.grid)
    if problem.constrained:
        return _solved(fine, Start(start, near=True), problem, path, time_limit)
    values = problem.ld.values(path)
    objective, known = ActionObjective(fine), float(np.sum(values))
    efforts = interpolated_slopes(problem.ld, path, fine.ld)
    model = objective.model_with(start, efforts, None)
    gains = _gains(objective.expansion, values, 2 * fine.ld.k)
    found = nearby_minimum(objective, start, model, known)
    price = price_of_time(problem)
    if found is not None:
        costs = found.value + price, known + price
        return FinerSolution(fine, found.path, *costs, gains, found.solution)
    solution = solved_on_grid(fine, start, max_iterations=MAX_FINER_STEPS, time_limit=time_limit)
    if not solution.success:
        return None
    path, cost = solution.trajectory.path, solution.cost
    return FinerSolution(fine, path, cost, known + price, gains, partial(_itself, solution))


def _solved(
    fine: TrajectoryProblem,
    start: Start[DiscretePath, CentralPath],
    problem: TrajectoryProblem,
    path: DiscretePath,
    time_limit: float | None,
    barrier: float = RICHER_BARRIER,
) -> FinerSolution | None:
    """The finer solution by a full solve, which may split intervals for limits.

    Its gains are the cost of the difference of the torques: see `_cost_of_difference`.
    """
    solution = solved_on_grid(fine, start, time_limit=time_limit, barrier=barrier)
    if not solution.success or solution.problem is None:
        return None
    finer = solution.trajectory
    known, cost = cost_of(problem, path), solution.cost
    gains = _cost_of_difference(problem, path, finer, abs(known - cost))
    return FinerSolution(
        solution.problem,
        finer.path,
        cost,
        known,
        gains,
        partial(_itself, solution),
        solution.central,
    )


def _itself(solution: Solution) -> Solution:
    """A solution that is known; with it as an argument, a function that can be pickled."""
    return solution


def _cost_of_difference(
    problem: TrajectoryProblem, path: DiscretePath, finer: Trajectory, difference: float
) -> Array:
    """1/2 int dtau^T R dtau over each interval, shape (N,), with dtau the difference of torques.

    If no torque has a weight: `difference`, shared out in proportion to the same integrals of the
    accelerations.
    difference: of the two costs.
    """
    ld, coarse = problem.ld, problem.trajectory(path)
    N = coarse.grid.intervals
    k, s = sample_points(coarse)
    t = np.clip(times_of(coarse, k, s), 0.0, finer.duration)
    one, other = coarse.sample_intervals(k, s), finer.sample(t)
    a, parts = (
        (x**2).reshape(N, len(x) // N, x.shape[1]).mean(axis=1)
        for x in (one.a - other.a, one.tau - other.tau)
    )
    by_joint, weights = 0.5 * coarse.grid.steps[:, None] * parts, np.zeros_like(parts)
    for batch, lagrangian in zip(ld.interval_batches, ld.lagrangians, strict=False):
        R = lagrangian.output_weight[: parts.shape[1]]  # of torques, before those of their rates
        weights[batch.numbers, : len(R)] = R
    if weights.any():
        return np.asarray(np.vecdot(by_joint, weights))
    gains = coarse.grid.steps * a.sum(axis=1)
    fractions = gains / max(float(gains.sum()), np.finfo(float).tiny)
    return np.asarray(difference * fractions)


def prolonged(path: DiscretePath, fine: Grid) -> DiscretePath:
    """The same curve on a grid of the same intervals with at least as many inner modes."""
    N, r, n = path.inner.shape
    inner = np.zeros((N, fine.inner_modes, n))
    inner[:, :r] = path.inner
    return DiscretePath(path.q, path.v, path.z, inner, path.higher)


def _gains(expansion: Expansion, values: Array, ends: int) -> Array:
    """L_d of the coarse path, minus the extremum of the finer L_d over the inner modes alone.

    ends: 2 k, the number of columns of an interval's ends.
    """
    N, m, n = expansion.gradient.shape
    size = (m - ends) * n
    g = expansion.gradient[:, ends:].reshape(N, size, 1)
    H = expansion.hessian[:, ends:, ends:].transpose(0, 1, 3, 2, 4).reshape(N, size, size)
    # inner modes that an interval does not have are rows of zeros
    absent = np.asarray(~H.any(axis=2))
    H = H + absent[:, :, None] * np.eye(size)
    decrease = 0.5 * np.sum(g * np.linalg.solve(H, g), axis=(1, 2))
    return np.asarray(values - expansion.values + decrease)
