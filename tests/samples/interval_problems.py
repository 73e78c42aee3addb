"""Random sums over intervals as dense matrices, the reference of all block solvers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.optimize.quadratic_model import IntervalSum

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

SIZES = [  # components n, inner modes of each of the N intervals
    (1, (1,)),
    (3, (2,)),
    (2, (0, 0)),
    (1, (0, 2, 1)),
    (2, (1,) * 5),
    (3, (0,) * 8),
    (2, (2, 0, 3, 1, 1, 0, 2, 2, 0, 0, 1, 3, 0)),
]
"""N = 1, 1, 2, 3, 5, 8, 13."""


@dataclass(frozen=True, eq=False)
class IntervalProblem:
    """One quadratic model in three forms: in nodal columns, in regularized columns, and dense.

    The unknowns are (q, v) of the inner nodes and the inner modes that exist, along the motion.

    steps: lengths of the intervals, (N,): an interval sees them times the velocities.
    """

    steps: Array
    modes: tuple[int, ...]
    n: int
    nodal: IntervalSum

    @property
    def inner_modes(self) -> int:
        return max(self.modes)

    @property
    def present(self) -> npt.NDArray[np.bool_]:
        """Which inner modes exist, (N, r)."""
        return np.arange(self.inner_modes) < np.array(self.modes)[:, None]

    @cached_property
    def unknowns(self) -> Index:
        """Number of the unknown of every column (q0, h v0, q1, h v1, c), -1 where fixed."""
        N, n = len(self.modes), self.n
        index = np.full((N, 4 + self.inner_modes, n), -1)
        count = 0
        for k in range(N):
            if k > 0:
                index[k, :2] = index[k - 1, 2:4] = count + np.arange(2 * n).reshape(2, n)
                count += 2 * n
            for j in range(self.modes[k]):
                index[k, 4 + j] = count + np.arange(n)
                count += n
        return index

    @cached_property
    def nodal_map(self) -> Array:
        """Columns of the intervals from the unknowns: shape (N, m, n, size)."""
        P = np.zeros((*self.unknowns.shape, int(self.unknowns.max()) + 1))
        for place, unknown in np.ndenumerate(self.unknowns):
            if unknown >= 0:
                P[(*place, unknown)] = self.steps[place[0]] if place[1] in (1, 3) else 1.0
        return P

    @cached_property
    def regular_map(self) -> Array:
        """The same in regularized columns (q0, h v0, Z0, Z1, c)."""
        return np.einsum("ij,kjnu->kinu", self._regular, self.nodal_map)

    @cached_property
    def regular(self) -> IntervalSum:
        """The model in regularized columns."""
        back = np.linalg.inv(self._regular)
        return IntervalSum(
            np.einsum("ij,kin->kjn", back, self.nodal.gradient),
            np.einsum("ai,bj,kabnm->kijnm", back, back, self.nodal.hessian),
            np.einsum("ai,bj,kab->kij", back, back, self.nodal.metric),
        )

    @property
    def _regular(self) -> Array:
        R = np.eye(4 + self.inner_modes)
        R[2, :2], R[3, 1] = -1.0, -1.0
        return R

    @cached_property
    def gradient(self) -> Array:
        return np.einsum("kin,kinu->u", self.nodal.gradient, self.nodal_map)

    @cached_property
    def hessian(self) -> Array:
        P = self.nodal_map
        return np.einsum("kiau,kijab,kjbw->uw", P, self.nodal.hessian, P, optimize=True)

    @cached_property
    def metric(self) -> Array:
        P = self.nodal_map
        return np.einsum("kiau,kij,kjaw->uw", P, self.nodal.metric, P, optimize=True)

    def newton_step(self, shift: float) -> Array:
        """-(H + shift D)^-1 g by a dense solve."""
        return np.linalg.solve(self.hessian + shift * self.metric, -self.gradient)

    def eigenvalues(self) -> Array:
        """Eigenvalues of H relative to D: H + shift D is definite if shift > -eigenvalues()[0]."""
        inverse = np.linalg.inv(np.linalg.cholesky(self.metric))
        return np.linalg.eigvalsh(inverse @ self.hessian @ inverse.T)


def random_problem(
    n: int, modes: tuple[int, ...], steps: Array, curvature: float, seed: int = 0
) -> IntervalProblem:
    """Random blocks; `curvature` is the mean of the Hessians' diagonals.

    The columns of inner modes that an interval does not have are zero, as a discrete Lagrangian
    leaves them.
    """
    N, m = len(modes), 4 + max(modes)
    random = np.random.default_rng(seed + 1000 * N + n)
    A = random.normal(size=(N, m, n, m, n))
    hessian = (A + A.transpose(0, 3, 4, 1, 2)).transpose(0, 1, 3, 2, 4).copy()
    for i in range(m):
        hessian[:, i, i] += curvature * np.eye(n)
    B = random.normal(size=(N, m, m))
    metric = np.matmul(B, B.transpose(0, 2, 1)) + np.eye(m)
    gradient = random.normal(size=(N, m, n))
    for k, r in enumerate(modes):
        gradient[k, 4 + r :] = 0.0
        hessian[k, 4 + r :] = hessian[k, :, 4 + r :] = 0.0
        metric[k, 4 + r :] = metric[k, :, 4 + r :] = 0.0
    return IntervalProblem(steps, modes, n, IntervalSum(gradient, hessian, metric))
