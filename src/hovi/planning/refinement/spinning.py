"""Spinning joints: without limits and rotors a light joint spins, faster on every finer grid.

Spinning a link of inertia I up costs a torque of the order of I, while its reaction on the other
joints grows with the square of its velocity. For small I the least torque is found at velocities
that no joint of a robot reaches, if there is a minimum at all.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.measures.motion_error import relative_difference
from hovi.errors import HoviError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.refinement.error_estimate import MAX_FINER_STEPS, FinerSolution, finer_than
from hovi.planning.solver.solver import Solution, solve_on_grid
from hovi.planning.solver.status import Status
from hovi.robot.mass_matrix import MassMatrix
from hovi.system.dataclass import dataclass

SAMPLES = 33
"""Samples per interval of the velocity, both ends included."""
SPINNING_RATIO = 10.0
"""Ratio of a joint's largest velocity and (half a turn + its distance) / T above which it spins:
2 for a smooth motion from rest to rest."""
MAX_GRIDS = 6
"""Maximum number of grids that are tried for a spinning motion."""
MAX_GRIDS_ALONE = 3
"""The same for grids in a row with no solution near theirs on a finer grid."""
MAX_INERTIA_FRACTION = 0.03
"""Largest inertia of a joint that counts as spinning, relative to that of the heaviest: the torque
that spins a heavier one shows in the cost. `hovi info` warns of far lighter ones only."""
MAX_WORK = 20_000
"""Maximum number of steps times intervals of a solve that follows a spinning motion."""
HOPELESS_RATIO = 40.0
"""The same ratio above which finer grids are not tried for a motion that is not resolved."""
DOUBTFUL_RATIO = 20.0
"""The same ratio above which a grid is trusted only with an error below MAX_SPINNING_ERROR, and if
the finer solution is near a minimum on a still finer grid, too."""
UNUSABLE_RATIO = 60.0
"""The same ratio above which no grid is trusted: a minimum on one grid is none on a finer one."""
MAX_SPINNING_ERROR = 1e-3
"""Largest relative error of the cost where a joint spins fast: with more, grids finer than the one
that it was compared with tend to find another motion."""
MAX_HOPELESS_ERROR = 3e-4
"""The same beyond HOPELESS_RATIO."""
FAR = 1.0
"""Distance from a motion to the finer solution in a coordinate, in [rad] or [m], above which the
two may be different motions along a valley, whose costs say little about the error."""
CONTRACTION = 0.5
"""Distance from the finer solution to a still finer one, relative to that from the motion to the
finer one, up to which the grids converge."""


@dataclass(frozen=True)
class Spin:
    """The joint that spins most.

    speed: its largest, in [rad/s]. ratio: see SPINNING_RATIO. inertia: about its axis with all
    other joints held, the least along the motion, in [kg m^2].
    """

    joint: str
    speed: float
    ratio: float
    inertia: float

    def is_hopeless(self, *, grids: int, alone: int, nearly_resolved: bool) -> bool:
        """Whether no finer grid is to be tried.

        grids: number of those that were tried. alone: of the last ones in a row with no solution
        nearby on a finer grid. nearly_resolved: whether the costs on the last one and a finer one
        are close.
        """
        largest = UNUSABLE_RATIO if nearly_resolved else HOPELESS_RATIO
        return self.ratio > largest or grids >= MAX_GRIDS or alone >= MAX_GRIDS_ALONE

    def is_trusted(self, error: float | None) -> bool:
        """Whether a grid resolves it. error: of the cost, relative; None for a cost of rounding."""
        if self.ratio > UNUSABLE_RATIO:
            return False
        return error is None or not self.is_doubtful or error <= self.largest_error

    @property
    def is_doubtful(self) -> bool:
        """Whether it is so fast that a motion on one finer grid does not confirm a minimum."""
        return self.ratio > DOUBTFUL_RATIO

    @property
    def largest_error(self) -> float:
        """Largest relative error of the cost with which a doubtful motion is trusted."""
        return MAX_SPINNING_ERROR if self.ratio <= HOPELESS_RATIO else MAX_HOPELESS_ERROR

    def __str__(self) -> str:
        """What it does, and what helps."""
        return (
            f"joint {self.joint!r} spins at up to {self.speed:.3g} rad/s with an inertia of "
            f"{self.inertia:.2g} kg m^2, and without limits faster on finer grids: set limits, or "
            "add the effect armature or acceleration_cost to the scene"
        )


def spin(solution: Solution) -> Spin | None:
    """The light joint without a velocity limit that spins most; None if none does."""
    problem, trajectory = solution.problem, solution.trajectory
    assert problem is not None
    if not (problem.about_robot and problem.ld.lagrangian.needs_torques):
        return None
    joints, q = np.flatnonzero(_unlimited_angles(problem)), trajectory.q
    if len(joints) == 0:
        return None
    distance = np.abs(problem.robot.difference(q[:-1], q[1:]).sum(axis=0))  # with full turns
    unit = (np.pi + distance) / trajectory.duration
    if np.max(np.abs(trajectory.v) / unit) < SPINNING_RATIO / 2:  # too slow between nodes, too
        return None
    N = trajectory.grid.intervals
    k, s = np.repeat(np.arange(N), SAMPLES), np.tile(np.linspace(0.0, 1.0, SAMPLES), N)
    v = np.abs(trajectory.jet_intervals(k, s)[1])
    ratio = v.max(axis=0) / unit
    worst = int(joints[np.argmax(ratio[joints])])
    if ratio[worst] <= SPINNING_RATIO:
        return None
    diagonal = np.diagonal(MassMatrix(problem.scene.model)(q), axis1=1, axis2=2)
    inertia = float(diagonal[:, worst].min())
    if inertia > MAX_INERTIA_FRACTION * diagonal[:, joints].max():
        return None
    name, speed = trajectory.coordinate_names[worst], float(v[:, worst].max())
    return Spin(name, speed, float(ratio[worst]), inertia)


def spin_without_limits(solution: Solution) -> Spin | None:
    """The joint that spins most; None if none does, and within limits. Distances are no limits."""
    assert solution.problem is not None
    return None if solution.problem.has_limits else spin(solution)


def fault_of_spinning(
    solution: Solution, error: float | None, finer: FinerSolution | None = None
) -> str:
    """Why a minimum in which a joint spins is not trusted; "" if it is, or if no joint spins.

    error: relative error of the cost; None if the cost is only rounding. finer: the finer solution
        that it was compared with; None to compute it.
    """
    spinning = spin_without_limits(solution)
    if spinning is None:
        return ""
    if not spinning.is_trusted(error):
        known = "" if error is None else f", with an error of {100 * error:.2g} % of the cost,"
        return f"at {spinning.speed:.3g} rad/s{known} a finer grid may find another motion"
    if error is None or not spinning.is_doubtful:
        return ""
    if _is_confirmed(solution, finer, spinning.largest_error):
        return ""
    return f"at {spinning.speed:.3g} rad/s a finer grid confirms it, but a still finer one does not"


def fault_of_distance(
    solution: Solution, error: float | None, finer: FinerSolution | None = None
) -> str:
    """Why a minimum without limits whose finer solution is FAR away is not trusted; "" if it is.

    It is trusted if a still finer solution is much closer to the finer one than that is to it, or
    if its error is at most MAX_SPINNING_ERROR. The arguments are those of `fault_of_spinning`.
    """
    problem = solution.problem
    assert problem is not None
    if problem.limited or error is None or error <= MAX_SPINNING_ERROR:
        return ""
    try:
        finer = finer or finer_than(solution)
        if finer is None:
            return ""
        far = _distance(solution, finer)
        if far <= FAR:
            return ""
        known, finest = _still_finer(finer)
    except HoviError:
        return ""
    if known is not None and finest is not None and _distance(known, finest) <= CONTRACTION * far:
        return ""
    return f"a finer grid moves it by up to {far:.2g}, and a still finer one does not confirm that"


def _is_confirmed(solution: Solution, finer: FinerSolution | None, largest: float) -> bool:
    """Whether the finer solution of a minimum has one nearby on a still finer grid.

    A valley along which a joint spins may have a minimum on one grid and on the next, but none on
    finer ones. largest: relative difference of the costs on the two finer grids.
    """
    try:
        finer = finer or finer_than(solution)
        finest = None if finer is None else _still_finer(finer)[1]
    except HoviError:
        return False
    return finest is not None and relative_difference(finest.known, finest.cost) <= largest


def _still_finer(finer: FinerSolution) -> tuple[Solution | None, FinerSolution | None]:
    """The finer solution as a minimum, and one near it on a still finer grid; None if not found."""
    known = _finished(finer)
    return known, None if known is None else finer_than(known)


def _finished(finer: FinerSolution) -> Solution | None:
    """The minimum that the finer solution is, or leads to; None if there is none."""
    known = finer.finish()
    if known is None:
        known = solve_on_grid(finer.problem, finer.path, max_iterations=MAX_FINER_STEPS)
    return known if known.success else None


def _distance(solution: Solution, finer: FinerSolution) -> float:
    """Largest difference of a coordinate at the nodes, in [rad] or [m]; 0 if the nodes differ."""
    q, other = solution.trajectory.q, finer.path.q
    if q.shape != other.shape:
        return 0.0
    return float(np.abs(finer.problem.coordinates.difference(q, other)).max())


def spin_without_minimum(solution: Solution) -> Spin | None:
    """The joint that spins hopelessly in a motion at its iteration limit; None if none does."""
    problem = solution.problem
    if solution.status is not Status.ITERATION_LIMIT or problem is None:
        return None
    found = spin_without_limits(solution)
    hopeless = found is not None and found.is_hopeless(grids=0, alone=0, nearly_resolved=False)
    return found if hopeless else None


def _unlimited_angles(problem: TrajectoryProblem) -> npt.NDArray[np.bool_]:
    """Which coordinates are angles without a bound on their velocity, shape (nv,)."""
    limits, sliding = problem.limits, problem.robot.sliding
    return ~sliding if limits is None else ~sliding & ~limits.bounded[1]
