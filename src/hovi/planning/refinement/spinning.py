"""Spinning joints: without limits and rotors a light joint spins, faster on every finer grid.

Valleys without a minimum are also recognized without such a joint: see `fault_of_valley`.

Spinning a link of inertia I up costs a torque of the order of I, while its reaction on the other
joints grows with the square of its velocity. For small I the least torque is found at velocities
that no joint of a robot reaches, if there is a minimum at all.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.measures.motion_error import relative_difference
from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.refinement.error_estimate import MAX_FINER_STEPS, FinerSolution, finer_than
from hovi.planning.solver.solver import Solution, solved_on_grid
from hovi.robot.mass_matrix import MassMatrix
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

SAMPLES = 33
"""Samples per interval of the velocity, both ends included."""
SPINNING_RATIO = 10.0
"""Ratio of a joint's largest velocity and (half a turn + its distance) / T above which it spins:
2 for a smooth motion from rest to rest."""
MAX_INERTIA_FRACTION = 0.03
"""Largest inertia of a joint that counts as spinning, relative to that of the heaviest: the torque
that spins a heavier one shows in the cost. `hovi info` warns of far lighter ones only."""
CLOSE = 1e-3
"""Relative difference of costs on two grids at which one confirms the other."""
FAR = 1.0
"""Distance from a motion to the finer solution in a coordinate, in [rad] or [m], above which the
two may be different motions along a valley, whose costs say little about the error."""
MOVED = 0.1
"""Distance from a motion to the finer solution in a coordinate, in [rad] or [m], above which halves
of the intervals have to confirm a tolerance: along a flat valley both grids may be too coarse."""
CONTRACTION = 0.5
"""Distance from the finer solution to a still finer one, relative to that from the motion to the
finer one, up to which the grids converge."""


@dataclass(frozen=True)
class Spin:
    """The joint that spins most.

    speed: its largest, in [rad/s]. inertia: about its axis with all other joints held, the least
    along the motion, in [kg m^2].
    """

    joint: str
    speed: float
    inertia: float

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
    return Spin(name, speed, inertia)


def spin_without_limits(solution: Solution) -> Spin | None:
    """The joint that spins most; None if none does, and within limits. Distances are no limits."""
    assert solution.problem is not None
    return None if solution.problem.has_limits else spin(solution)


def fault_of_valley(
    solution: Solution, error: float | None, finer: FinerSolution | None = None
) -> str:
    """Why a minimum without limits is not trusted as it may lie in a valley; "" if it is.

    Where a joint spins, or the finer solution is FAR away and the costs are not CLOSE, the two may
    be different motions along a valley without a minimum, whose costs say little about the error.
    Then a still finer grid, of intervals of half the length, has to confirm the finer one: by a
    CLOSE cost where a joint spins, else by a solution much nearer to it. Among obstacles that is
    asked for only where a joint spins and the costs are not CLOSE.
    error: relative error of the cost; None if the cost is only rounding. finer: the finer solution
        that it was compared with; None to compute it.
    """
    problem = solution.problem
    assert problem is not None
    if problem.has_limits or error is None:
        return ""
    spinning = spin(solution)
    doubts = spinning is not None, error > CLOSE
    if not (all(doubts) if problem.limited else any(doubts)):
        return ""
    where = "" if spinning is None else f"at {spinning.speed:.3g} rad/s "
    try:
        finer = finer or finer_than(solution)
        far = 0.0 if finer is None else _apart(solution, finer.path.q)
        if spinning is None and far <= FAR:
            return ""
        known = None if finer is None else _finished(finer)
        if known is None:
            return f"{where}no minimum was found near it on a finer grid"
        if _is_confirmed(known, spinning is not None, far):
            return ""
    except HoviError:
        return "" if spinning is None else f"{where}no finer grid could be tried"
    if spinning is None:
        return (
            f"a finer grid moves it by up to {far:.2g}, and a still finer one does not confirm that"
        )
    return f"{where}a finer grid confirms it, but a still finer one does not"


def solved_on_halves(solution: Solution, finer: FinerSolution) -> Solution | None:
    """A solve on halves of the finer solution's intervals, from there, to confirm its cost.

    None within limits, and where the finer solution has not MOVED.
    """
    assert solution.problem is not None
    if solution.problem.limited or _apart(solution, finer.path.q) <= MOVED:
        return None
    return _on_halves(finer.problem, finer.trajectory)


def _on_halves(problem: TrajectoryProblem, guess: Trajectory) -> Solution:
    halves = problem.on(problem.grid.halved())
    return solved_on_grid(halves, guess, max_iterations=MAX_FINER_STEPS)


def _is_confirmed(known: Solution, spins: bool, far: float) -> bool:
    """Whether halves of the intervals confirm a finer solution.

    far: its distance from the motion, see `_apart`.
    """
    assert known.problem is not None
    found = _on_halves(known.problem, known.trajectory)
    if not found.success:
        return False
    if spins:
        return relative_difference(known.cost, found.cost) <= CLOSE
    return _apart(known, found.trajectory.q[::2]) <= CONTRACTION * far


def _finished(finer: FinerSolution) -> Solution | None:
    """The minimum that the finer solution is, or leads to; None if there is none."""
    known = finer.finish()
    if known is None:
        known = solved_on_grid(finer.problem, finer.path, max_iterations=MAX_FINER_STEPS)
    return known if known.success else None


def _apart(solution: Solution, q: Array) -> float:
    """Largest difference of a coordinate at the nodes, in [rad] or [m]; 0 if the nodes differ."""
    own, problem = solution.trajectory.q, solution.problem
    assert problem is not None
    if own.shape != q.shape:
        return 0.0
    return float(np.abs(problem.coordinates.difference(own, q)).max())


def _unlimited_angles(problem: TrajectoryProblem) -> npt.NDArray[np.bool_]:
    """Which coordinates are angles without a bound on their velocity, shape (nv,)."""
    limits, sliding = problem.limits, problem.robot.sliding
    return ~sliding if limits is None else ~sliding & ~limits.bounded[1]
