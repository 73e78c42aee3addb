"""Conditions at all times as outputs y(q, v, a, tau, t) at the quadrature points.

With x = (q, v, a), J = d tau / dx and y = y(x, tau, t) the chain rule gives dy = y_x + y_tau J, and
for weights w of the outputs the second derivatives w y_xx + S + S^T + J^T (w y_tautau) J with
S = (w y_xtau) J, next to those of tau with the weights w y_tau, which are the torque model's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hovi.conditions.asked import need_torques
from hovi.conditions.condition import scales
from hovi.conditions.excess import excess_of, worst
from hovi.conditions.function import Curvature, Points, Slopes
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.problem import TrajectoryProblem

Array = npt.NDArray[np.float64]

Range = tuple[Array, Array]

JET = "q", "v", "a"


class ExpandedOutputs(NamedTuple):
    """The derivatives of outputs in the jet (q, v, a).

    jacobian: shape (P, K, 3 nv). curvature: sum_k force_k d2 y_k at fixed second derivatives of the
    torques, shape (P, 3 nv, 3 nv). torques: weights of these second derivatives, (P, nv).
    """

    jacobian: Array
    curvature: Array
    torques: Array


class ConditionOutputs:
    """The values of conditions over their scales, between their bounds, in the tangent space.

    problem: on the grid whose points they are evaluated at.
    """

    def __init__(self, problem: TrajectoryProblem) -> None:
        self.problem, self.given = problem, problem.bounds
        self._scales = [scales(each) for each in self.given]

    @property
    def size(self) -> int:
        """K, the number of values."""
        return sum(each.y.size for each in self.given)

    def bounds(self, t: Array) -> Range:
        """Bounds of the outputs at times, (P, K) each."""
        parts = list[Range]()
        for each, scale in zip(self.given, self._scales, strict=True):
            low, high = (side / scale for side in each.on.at(t, each.y.size))
            holds = each.holds_at(t)[:, None]
            parts.append((np.where(holds, low, -np.inf), np.where(holds, high, np.inf)))
        lower, upper = (np.concatenate(side, axis=1) for side in zip(*parts, strict=True))
        return lower, upper

    def values(self, at: Points) -> Array:
        """y over its scale, (P, K)."""
        found = zip(self.given, self._scales, strict=True)
        return np.concatenate([each.y.values(at) / scale for each, scale in found], axis=1)

    def by_name(self, slopes: Array) -> dict[str, Array]:
        """Derivatives in the values, (..., K), as those in y, by the names of conditions."""
        found, first = dict[str, Array](), 0
        for each, scale in zip(self.given, self._scales, strict=True):
            found[each.name] = slopes[..., first : first + each.y.size] / scale
            first += each.y.size
        return found

    def excess(self, trajectory: Trajectory, tolerance: float) -> Array:
        """The excess over lower and upper bounds in every interval, (2, N, K); -inf for none.

        Between the points, too. What is tolerated is at most the tolerance, for which the
        conditions' own ones are taken.
        """
        parts = [excess_of(trajectory, each) - (each.tolerance - tolerance) for each in self.given]
        return np.concatenate(parts, axis=2)

    def worst(self, trajectory: Trajectory, tolerance: float) -> tuple[float, str]:
        """The largest excess, as by `excess`, and what exceeds its bound then, as a clause."""
        found = [(worst(trajectory, each), each.tolerance) for each in self.given]
        return max((over - (own - tolerance), clause) for (over, clause), own in found)

    def expand(self, at: Points, force: Array) -> ExpandedOutputs:
        """Derivatives in (q, v, a): see the module. force: weights of the curvature, (P, K)."""
        n = at.v.shape[1]
        J = self._torque_slopes(at) if need_torques(self.given) else None
        slopes, first = [], 0
        curvature, torques = np.zeros((len(at.q), 3 * n, 3 * n)), np.zeros((len(at.q), n))
        for each, scale in zip(self.given, self._scales, strict=True):
            own = force[:, first : first + each.y.size] / scale
            first += each.y.size
            dy = each.y.slopes(at)
            slopes.append(jet_slopes(dy, J, each.y.size, at) / scale[:, None])
            add_curvature(curvature, each.y.curvature(at, own), J)
            if "tau" in dy:
                torques += np.matmul(own[:, None], dy["tau"])[:, 0]
        return ExpandedOutputs(np.concatenate(slopes, axis=1), curvature, torques)

    def _torque_slopes(self, at: Points) -> Array:
        """J at the points, (P, nv, 3 nv)."""
        ld, first, parts = self.problem.ld, 0, []
        n = at.v.shape[1]
        assert at.a is not None
        for lagrangian, t in zip(ld.lagrangians, ld.point_times, strict=True):
            here = slice(first, first + len(t))
            jet = at.q[here], at.v[here], at.a[here]
            parts.append(lagrangian.torque_slopes(*jet, t=t))
            first += len(t)
        return np.concatenate(parts)[:, :n]


def jet_slopes(dy: Slopes, J: Array | None, size: int, at: Points) -> Array:
    """dy / d(q, v, a) with what comes through the torques, (P, size, 3 nv).

    J: d tau / d(q, v, a), (P, nv, 3 nv); None where y depends on no torques.
    """
    n = at.v.shape[1]
    total = np.zeros((len(at.q), size, 3 * n))
    for x, slope in dy.items():
        if x in JET:
            total[:, :, _columns(x, n)] += slope
        else:
            assert J is not None
            total += np.matmul(slope, J)
    return total


def add_curvature(total: Array, parts: Curvature, J: Array | None) -> None:
    """Add weighted second derivatives in (q, v, a), torques included, in place; J: as above."""
    n = total.shape[1] // 3
    for (x, z), block in parts.items():
        if "tau" not in (x, z):
            total[:, _columns(x, n), _columns(z, n)] += block
            if x != z:
                total[:, _columns(z, n), _columns(x, n)] += block.transpose(0, 2, 1)
            continue
        assert J is not None
        if x == z:
            total += np.matmul(J.transpose(0, 2, 1), np.matmul(block, J))
            continue
        rows = block if z == "tau" else block.transpose(0, 2, 1)
        S = np.matmul(rows, J)
        here = _columns(x if z == "tau" else z, n)
        total[:, here] += S
        total[:, :, here] += S.transpose(0, 2, 1)


def _columns(name: str, n: int) -> slice:
    first = JET.index(name) * n
    return slice(first, first + n)
