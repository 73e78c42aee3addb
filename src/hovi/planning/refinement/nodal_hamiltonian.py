"""Pontryagin's Hamiltonian at the nodes of a motion: constant along exact solutions.

H = p.v + p~.a - L~, with the discrete momenta p and p~, and a from p~ = dL~/da, all of the order of
the nodes. The interpolant's acceleration has a lower order, which would dominate the spread of H.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.optimize.batched_newton import newton
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.scene.lagrangian import Lagrangian

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class NodalHamiltonian:
    """H at the nodes.

    values: shape (N + 1,), in the cost's unit per [s]. scale: the largest |p.v| + |p~.a| + |L~|.
    """

    values: Array = field(repr=False)
    scale: float

    @property
    def mean(self) -> float:
        """The mean of the values."""
        return float(np.mean(self.values))

    @property
    def spread(self) -> float:
        """Largest minus smallest value, relative to the scale; 0 for zero scale."""
        return float(np.ptp(self.values)) / self.scale if self.scale > 0 else 0.0


def nodal_hamiltonian(problem: TrajectoryProblem, trajectory: Trajectory) -> NodalHamiltonian:
    """H at the nodes of a solution.

    Raises InputError if H is not constant, for a cost or torques that depend on time, or if p~
    does not determine a, with limits or equality constraints.
    """
    if problem.limited:
        raise InputError("with limits a does not follow from p~ alone")
    if problem.constrained:
        raise InputError("with equality constraints a does not follow from p~ alone")
    if problem.ld.lagrangian.timed:
        raise InputError("the cost or the torques depend on time, and so does H")
    lagrangian, p = problem.ld.lagrangian, trajectory.momenta
    a = _accelerations(lagrangian, trajectory)
    L = lagrangian.value(trajectory.q, trajectory.v, a)
    pv, pa = np.vecdot(p[:, 0], trajectory.v), np.vecdot(p[:, 1], a)
    return NodalHamiltonian(pv + pa - L, float(np.max(np.abs(pv) + np.abs(pa) + np.abs(L))))


def _accelerations(lagrangian: Lagrangian, trajectory: Trajectory) -> Array:
    """a of p~ = dL~/da at the nodes, shape (N + 1, nv)."""
    q, v, pt = trajectory.q, trajectory.v, trajectory.momenta[:, 1]

    def system(a: Array) -> tuple[Array, Array]:
        _, gradient, hessian = lagrangian.evaluate(q, v, a)
        return gradient[:, -1] - pt, hessian[:, -1, :, -1]

    a, found = newton(system, np.zeros_like(v))
    if not found.all():
        raise InputError("the cost does not determine a from p~ at every node")
    return a
