"""Pontryagin's Hamiltonian at the nodes of a motion: constant along exact solutions.

H = p.v + p~.a - L~, with p and p~ the discrete momenta and a from p~ = dL~/da: all of the nodes'
own order. With the interpolant's own acceleration its spread would say nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError
from hovi.lagrangian import Lagrangian
from hovi.legendre_transforms import highest_derivative
from hovi.problem import TrajectoryProblem
from hovi.trajectory import Trajectory

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
        """Largest less smallest value, relative to the scale; 0 where nothing moves."""
        return float(np.ptp(self.values)) / self.scale if self.scale > 0 else 0.0


def nodal_hamiltonian(problem: TrajectoryProblem, trajectory: Trajectory) -> NodalHamiltonian:
    """H at the nodes of a solution.

    Raises InputError where H is not constant, or its acceleration is not known: for a cost or
    torques that depend on time, under limits, and where equations have to be met.
    """
    if problem.limited:
        raise InputError("under limits a does not follow from p~ alone")
    if problem.constrained:
        raise InputError("where equations are met a does not follow from p~ alone")
    lagrangian = problem.ld.lagrangian
    if depends_on_time(lagrangian, trajectory):
        raise InputError("the cost or the torques depend on time, and so does H")
    x = np.stack([trajectory.q, trajectory.v], axis=1)
    p = trajectory.momenta
    a = highest_derivative(lagrangian, x, p)
    L = lagrangian.value(trajectory.q, trajectory.v, a)
    pv, pa = np.vecdot(p[:, 0], trajectory.v), np.vecdot(p[:, 1], a)
    return NodalHamiltonian(pv + pa - L, float(np.max(np.abs(pv) + np.abs(pa) + np.abs(L))))


def depends_on_time(lagrangian: Lagrangian, trajectory: Trajectory) -> bool:
    """Whether L~ at the middles of the intervals is another at other times."""
    N = trajectory.grid.intervals
    t = trajectory.t[:-1] + 0.5 * trajectory.grid.steps
    jet = trajectory.jet(t)
    others = t[::-1] + 0.37 * trajectory.duration
    here, there = (lagrangian.value(*jet, t=times) for times in (t, others))
    return bool(np.max(np.abs(here - there), initial=0.0) > 1e-12 * np.max(np.abs(here))) and N > 0
