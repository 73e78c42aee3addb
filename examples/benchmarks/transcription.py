"""hovi's discrete problem as an efficient nonlinear program for Ipopt.

The highest derivatives at the quadrature points are the controls: accelerations, or jerks for
costs on the jerk. All others there follow from them by the scheme's own table; k linear defects
per joint connect an interval to the next node for order k; the cost contains RNEA. The exact
Hessian is generated and interpreted by CasADi, expanded to scalars, or assembled from a point
kernel compiled by gcc.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import casadi as ca
import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse

import hovi
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.planning.solver.solver import guess_path
from hovi.schemes.scheme import regular_from_nodal

Array = npt.NDArray[np.float64]

IPOPT = {
    "print_level": 0,
    "sb": "yes",
    "tol": 1e-9,
    "max_iter": 1000,
    "linear_solver": "mumps",
    "jac_c_constant": "yes",
}
COMPILE = ("gcc", "-O2", "-march=native", "-shared", "-fPIC")


class Transcription:
    """A problem on a uniform grid over w = (q_0, v_0, a_01 .. a_0Q, q_1, v_1, ...), for order 2.

    points: ((k + 1) n P, W), q, v, ... of every quadrature point. defects: (k n N, W), zero on a
    motion. weights: quadrature weight of each point, shape (P,).
    """

    def __init__(self, problem: hovi.TrajectoryProblem) -> None:
        self.problem = problem
        grid, n = problem.grid, problem.robot.nv
        scheme, h, N = grid.schemes[0], float(grid.steps[0]), grid.intervals
        Q = len(scheme.points)
        k = grid.order
        self.n, self.k, self.stride = n, k, Q + k
        # as many controls as (Z, c): these are free @ controls
        free = h**k * np.linalg.inv(scheme.table[:, k, k - 1 :])
        powers = h ** np.arange(float(k))
        point = np.zeros((Q, k + 1, Q + 2 * k))  # columns q0, v0, ..., controls, q1, v1, ...
        point[:, 0, 0] = 1.0
        point[:, :, 1:k] = scheme.table[:, :, : k - 1] * powers[1:]
        point[:, :, k:-k] = scheme.table[:, :, k - 1 :] @ free
        point /= h ** np.arange(k + 1.0)[:, None]
        of_ends = regular_from_nodal(0, k)[k:]  # Z from (q0, h v0, ..., q1, h v1, ...)
        defect = np.zeros((k, Q + 2 * k))
        defect[:, k:-k] = free[:k]
        defect[:, :k], defect[:, -k:] = -of_ends[:, :k] * powers, -of_ends[:, k:] * powers
        self.weights = np.tile(h * scheme.weights, N)
        self.points = self._along_motion(point.reshape((k + 1) * Q, -1), N)
        self.defects = self._along_motion(defect, N)

    def _along_motion(self, rows: Array, intervals: int) -> ca.DM:
        """The rows of one interval, repeated along the motion and for every joint."""
        width = intervals * self.stride + self.k
        blocks = [
            sparse.hstack(
                [
                    sparse.coo_matrix((len(rows), k * self.stride)),
                    sparse.coo_matrix(rows),
                    sparse.coo_matrix((len(rows), width - k * self.stride - rows.shape[1])),
                ]
            )
            for k in range(intervals)
        ]
        matrix = sparse.kron(sparse.vstack(blocks), sparse.identity(self.n)).tocsc()
        matrix.sort_indices()
        pattern = ca.Sparsity(*matrix.shape, matrix.indptr.tolist(), matrix.indices.tolist())
        return ca.DM(pattern, matrix.data)

    def arguments(self, guess: object) -> dict[str, object]:
        """Initial guess and bounds for the solver: both end states are fixed, all else is free."""
        path, grid, k = guess_path(self.problem, guess), self.problem.grid, self.k
        w = np.zeros((grid.intervals * self.stride + k, self.n))
        for j in range(k):
            w[j :: self.stride] = path.nodes[:, j]
        modes = np.concatenate([path.z, path.inner], axis=1)
        controls = np.einsum("qj,kjn->kqn", grid.schemes[0].table[:, k, k - 1 :], modes)
        w[:-k].reshape(grid.intervals, self.stride, self.n)[:, k:] = controls
        lower, upper = np.full_like(w, -np.inf), np.full_like(w, np.inf)
        ends = [*range(k), *range(-k, 0)]
        lower[ends] = upper[ends] = w[ends]
        return {"x0": w.ravel(), "lbx": lower.ravel(), "ubx": upper.ravel(), "lbg": 0, "ubg": 0}

    def interpreted(self) -> ca.Function:
        """Ipopt with all derivatives generated and interpreted by CasADi."""
        w, p = self._variables()
        L = self._point_functions()[0]
        nlp = {"x": w, "f": self._cost(L, p), "g": ca.mtimes(self.defects, w)}
        return ca.nlpsol("S", "ipopt", nlp, {"print_time": 0, "expand": True, "ipopt": IPOPT})

    def compiled(self, folder: Path) -> ca.Function:
        """Ipopt with derivatives from point kernels compiled by gcc in `folder`."""
        kernels = self._point_functions()
        generator = ca.CodeGenerator("kernels.c")
        for kernel in kernels:
            generator.add(kernel)
        generator.generate(f"{folder}/")
        library = str(folder / "kernels.so")
        subprocess.check_call([*COMPILE, "-o", library, str(folder / "kernels.c"), "-lm"])
        L, gradient, hessian = (ca.external(kernel.name(), library) for kernel in kernels)
        w, p = self._variables()
        g = ca.mtimes(self.defects, w)
        options = {"print_time": 0, "ipopt": IPOPT, "no_nlp_grad": True}
        options |= self._derivatives(w, p, g, gradient, hessian)
        return ca.nlpsol("S", "ipopt", {"x": w, "f": self._cost(L, p), "g": g}, options)

    def _variables(self) -> tuple[ca.MX, ca.MX]:
        w = ca.MX.sym("w", self.points.shape[1])
        jets = ca.mtimes(self.points, w)
        return w, ca.reshape(jets, (self.k + 1) * self.n, len(self.weights))

    def _cost(self, L: ca.Function, p: ca.MX) -> ca.MX:
        return ca.dot(L.map(len(self.weights))(p).T, ca.DM(self.weights))

    def _point_functions(self) -> tuple[ca.Function, ca.Function, ca.Function]:
        """L, (L, dL) and ddL at one point p = (q, v, a), and the jerk for order 3."""
        n = self.n
        p = ca.SX.sym("p", (self.k + 1) * n)
        rnea = casadi_functions(self.problem.scene.model).inverse_dynamics
        tau = ca.cse(rnea(p[:n], p[n : 2 * n], p[2 * n : 3 * n]))
        L = ca.dot(tau, tau) / 2
        W = self.problem.scene.terms.jerk_weight
        if W is not None:
            L += ca.dot(ca.DM(W), p[3 * n :] ** 2) / 2
        H, g = ca.hessian(L, p)
        return (
            ca.Function("L", [p], [L]),
            ca.Function("dL", [p], [L, ca.cse(g)]),
            ca.Function("ddL", [p], [ca.cse(ca.densify(H))]),
        )

    def _derivatives(
        self, w: ca.MX, p: ca.MX, g: ca.MX, gradient: ca.Function, hessian: ca.Function
    ) -> dict[str, ca.Function]:
        """The derivative functions that nlpsol would otherwise generate."""
        P, m = len(self.weights), (self.k + 1) * self.n
        W = ca.DM(self.weights)
        nothing, lf, lg = ca.MX.sym("par", 0, 1), ca.MX.sym("lf"), ca.MX.sym("lg", g.shape[0])
        value, slope = gradient.map(P)(p)
        slope = ca.mtimes(self.points.T, ca.vec(slope * ca.repmat(W.T, m, 1)))
        blocks = ca.Sparsity(
            m * P,
            m * P,
            list(range(0, m * m * P + 1, m)),
            [m * k + i for k in range(P) for _ in range(m) for i in range(m)],
        )
        weighted = hessian.map(P)(p) * ca.repmat(ca.DM(np.repeat(self.weights, m)).T, m, 1)
        H = ca.mtimes(ca.mtimes(self.points.T, ca.MX(blocks, lf * ca.vec(weighted))), self.points)
        fgrad = [ca.dot(value.T, W), slope]
        jacobian = [g, ca.MX(self.defects)]
        return {
            "grad_f": ca.Function("nlp_grad_f", [w, nothing], fgrad, ["x", "p"], ["f", "grad:f:x"]),
            "jac_g": ca.Function("nlp_jac_g", [w, nothing], jacobian, ["x", "p"], ["g", "jac:g:x"]),
            "hess_lag": ca.Function(
                "nlp_hess_l",
                [w, nothing, lf, lg],
                [ca.triu(H)],
                ["x", "p", "lam:f", "lam:g"],
                ["triu:hess:gamma:x:x"],
            ),
        }
