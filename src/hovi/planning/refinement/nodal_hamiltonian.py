"""Pontryagin's Hamiltonian at the nodes of a motion: constant along exact solutions.

H = p.v + p~.a - L~, with the discrete momenta p and p~, and a from p~ = dL~/da, all of the order of
the nodes. The interpolant's acceleration has a lower order, which would dominate the spread of H.
"""

from __future__ import annotations

from dataclasses import field

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.optimize.batched_newton import newton
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.scene.lagrangian import Lagrangian
from hovi.system.dataclass import dataclass

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
    if problem.ld.segments is not None:
        raise InputError("H changes where the Lagrangian does, from segment to segment")
    if problem.ld.lagrangian.timed:
        raise InputError("the cost or the torques depend on time, and so does H")
    lagrangian, p, path = problem.ld.lagrangian, trajectory.momenta, trajectory.path
    jet = path.q, *np.moveaxis(path.rates, 1, 0)
    top = _highest(lagrangian, jet, p[:, -1])
    L = lagrangian.value(*jet, top)
    terms = [np.vecdot(p[:, j], x) for j, x in enumerate((*jet[1:], top))]
    sizes = np.sum(np.abs(terms), axis=0) + np.abs(L)
    return NodalHamiltonian(np.sum(terms, axis=0) - L, float(np.max(sizes)))


def _highest(lagrangian: Lagrangian, jet: tuple[Array, ...], momentum: Array) -> Array:
    """q^(k) of p_(k-1) = dL/dq^(k) at the nodes, shape (N + 1, nv)."""

    def system(x: Array) -> tuple[Array, Array]:
        _, gradient, hessian = lagrangian.evaluate(*jet, x)
        return gradient[:, -1] - momentum, hessian[:, -1, :, -1]

    x, found = newton(system, np.zeros_like(momentum))
    if not found.all():
        raise InputError("the cost does not determine a from p~ at every node")
    return x
