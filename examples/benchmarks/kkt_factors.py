"""Two factors of the KKT matrix of motions under equations, at the end of a swing-up.

    python kkt_factors.py

L S L^T of [H, A^T; A, -delta I] with an interval's multipliers after its last unknown, and Cholesky
of H + A^T A / delta, both refined to delta = 0 [NocedalWright2006, section 16.2]: residual after
refinements, and the number of negative eigenvalues on A s = 0, against dense linear algebra, where
saddles were put in by negative curvature of a few intervals. delta: relative to |A|^2 / |H|.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.linalg
from measuring import print_table
from underactuated import SCENES, problem_on

from hovi.optimize.banded_model import BandModel
from hovi.optimize.kkt_model import KktFactor, KktModel
from hovi.optimize.quadratic_model import IntervalSum
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.first_multipliers import least_squares_multipliers
from hovi.planning.solver.solver import solve_on_grid

Array = np.ndarray
Solve = Callable[[Array], Array]
SCHEMES, INTERVALS = ("galerkin-1", "galerkin-3"), (30, 200)
DELTAS = 1e-2, 1e-4, 1e-6, 1e-8, 1e-10
REFINEMENTS = 4
CONVERGED = 1e-15
"""Residual, relative to |matrix| |solution|, that counts as solved: rounding errors."""


def model_at_minimum(scene: str, scheme: str, intervals: int) -> KktModel:
    """The model at the minimum of a swing-up, with its multipliers."""
    problem = problem_on(scene, intervals, scheme)
    found = solve_on_grid(problem)
    path = found.trajectory.path
    known = least_squares_multipliers(problem, path)
    action = ActionObjective(problem, "band", multipliers=known)
    model = action.model(path, None, None)
    assert isinstance(model, BandModel)
    return action.kkt(path, model)


def dense(model: KktModel) -> tuple[Array, Array]:
    """H and A."""
    units = np.eye(len(model.gradient))
    A = np.stack([model.jacobian_product(e) for e in units], axis=1)
    columns = np.stack([model.plain.gather(e) for e in units])
    size = len(units)
    flat = columns.reshape(size, len(columns[0]), -1)
    N, m, n = columns.shape[1:]
    blocks = model.plain.intervals.hessian.transpose(0, 1, 3, 2, 4).reshape(N, m * n, m * n)
    H = np.zeros((size, size))
    for k in range(N):
        H += flat[:, k] @ blocks[k] @ flat[:, k].T
    return H, A


def with_saddles(model: KktModel, saddles: int) -> KktModel:
    """Negative curvature of some inner modes, in that many intervals."""
    own, rng = model.plain.intervals, np.random.default_rng(saddles)
    hessian = own.hessian.copy()
    for k in rng.choice(len(hessian) - 2, saddles, replace=False) + 1:
        hessian[k, -1, -1] -= 3.0 * np.abs(hessian[k, -1, -1]).max() * np.eye(hessian.shape[3])
    other = IntervalSum(own.gradient, hessian, own.metric)
    band = np.zeros(model.layout.plain.shape)
    return KktModel(other, model.rows, model.layout, band, model.metric)


def refined(solve: Solve, matrix: Array, size: float, rhs: Array) -> int | None:
    """Number of refinements until the residual is CONVERGED; None for more than REFINEMENTS.

    size: |matrix|.
    """
    x = np.zeros_like(rhs)
    for count in range(REFINEMENTS + 1):
        x = x + solve(rhs - matrix @ x)
        if np.linalg.norm(rhs - matrix @ x) <= CONVERGED * size * np.linalg.norm(x):
            return count
    return None


def signed(factor: KktFactor, size: int) -> Solve:
    """Steps by L S L^T; size: number of unknowns."""
    return lambda r: np.concatenate(factor.solve(r[:size], r[size:]))


def penalized(H: Array, A: Array, delta: float) -> Solve:
    """Steps of [H, A^T; A, -delta I] by the factor of H + A^T A / delta."""
    K, n = H + A.T @ A / delta, len(H)
    lu = scipy.linalg.lu_factor(K)

    def solve(r: Array) -> Array:
        s = scipy.linalg.lu_solve(lu, r[:n] + A.T @ r[n:] / delta)
        return np.concatenate([s, (A @ s - r[n:]) / delta])

    return solve


def row(scene: str, scheme: str, intervals: int) -> list[object]:
    """Refinements of both factors by delta, and counts of n_neg that are right."""
    model = model_at_minimum(scene, scheme, intervals)
    H, A = dense(model)
    rhs = np.random.default_rng(1).standard_normal(len(H) + len(A))
    matrix = np.block([[H, A.T], [A, np.zeros((len(A), len(A)))]])
    unit = np.abs(A).max() ** 2 / np.abs(H).max()
    size, by_signs, plain = float(np.linalg.norm(matrix, 2)), [], []
    for delta in DELTAS:
        factor = model.factor(0.0, delta * unit)
        solve = None if factor is None else signed(factor, len(H))
        by_signs.append("-" if solve is None else refined(solve, matrix, size, rhs))
        plain.append(refined(penalized(H, A, delta * unit), matrix, size, rhs))
    Z, counts = scipy.linalg.null_space(A), []
    for saddles in range(4 if intervals < 100 else 0):
        other = with_saddles(model, saddles)
        right = int((np.linalg.eigvalsh(Z.T @ dense(other)[0] @ Z) < 0).sum())
        counts.append((right, other.negative_eigenvalues()))
    said = ", ".join(f"{right} ({mine})" for right, mine in counts) or "-"
    words = [" ".join("no" if x is None else str(x) for x in each) for each in (by_signs, plain)]
    return [scene, f"{scheme}, {intervals}", *words, said]


def main() -> None:
    """Print the table."""
    rows = [row(a, b, N) for a in SCENES for b in SCHEMES for N in INTERVALS]
    deltas = ", ".join(f"{delta:.0e}" for delta in DELTAS)
    print(
        f"Refinements to a residual of {CONVERGED:g} for delta = {deltas}; n_neg: dense (signs).\n"
    )
    print_table(["scene", "grid", "L S Lᵀ", "H + Aᵀ A / delta", "n_neg"], rows)


if __name__ == "__main__":
    main()
