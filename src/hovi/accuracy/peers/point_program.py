"""An efficient direct transcription for Ipopt.

The points p = (q, v, a) and the defects are linear in the unknowns w; the cost is a weighted sum of
1/2 |tau(p)|^2. Gradient and exact Hessian are assembled from kernels of one point, which are
compiled by gcc or interpreted by CasADi.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse

from hovi.errors import UnmeasurableError
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

IPOPT = {
    "print_level": 0,
    "sb": "yes",
    "tol": 1e-9,
    "max_iter": 1000,
    "linear_solver": "mumps",
    "jac_c_constant": "yes",
}
LIBRARY = "kernels.so"
COMPILE = ("gcc", "-O2", "-march=native", "-shared", "-fPIC")


@dataclass(frozen=True, eq=False)
class PointKernels:
    """1/2 |tau|^2 at one point p = (q, v, a), shape (3 n,): CasADi functions of p.

    value: L. gradient: (L, dL). hessian: ddL, dense.
    """

    value: ca.Function
    gradient: ca.Function
    hessian: ca.Function


def point_kernels(inverse_dynamics: ca.Function) -> PointKernels:
    """The kernels of an inverse dynamics function (q, v, a) -> tau, for CasADi's interpreter."""
    n = int(inverse_dynamics.size1_in(1))
    p = ca.SX.sym("p", 3 * n)
    tau = ca.cse(inverse_dynamics(p[:n], p[n : 2 * n], p[2 * n :]))
    L = ca.sumsqr(tau) / 2
    H, g = ca.hessian(L, p)
    return PointKernels(
        ca.Function("L", [p], [L]),
        ca.Function("dL", [p], [L, ca.cse(g)]),
        ca.Function("ddL", [p], [ca.cse(ca.densify(H))]),
    )


def compiled(kernels: PointKernels, folder: Path) -> PointKernels:
    """The kernels compiled by gcc into a library in `folder`.

    Raises UnmeasurableError if gcc is missing or fails.
    """
    functions = (kernels.value, kernels.gradient, kernels.hessian)
    return PointKernels(*compiled_functions(functions, folder))


def compiled_functions(functions: Sequence[ca.Function], folder: Path) -> list[ca.Function]:
    """The functions compiled by gcc into a library in `folder`. Raises as `compiled` does."""
    if shutil.which(COMPILE[0]) is None:
        raise UnmeasurableError("compiled kernels need gcc, which was not found; install gcc.")
    generator = ca.CodeGenerator("kernels.c")
    for function in functions:
        generator.add(function)
    generator.generate(f"{folder}/")
    command = [*COMPILE, "-o", str(folder / LIBRARY), str(folder / "kernels.c"), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise UnmeasurableError(f"gcc did not compile the kernels: {done.stderr.strip()[:200]}")
    return loaded_functions(functions, folder)


def loaded_functions(functions: Sequence[ca.Function], folder: Path) -> list[ca.Function]:
    """The functions from the library that `compiled_functions` wrote into `folder`."""
    return [ca.external(function.name(), str(folder / LIBRARY)) for function in functions]


@dataclass(frozen=True, eq=False)
class PointProgram:
    """min sum_j weights_j L(p_j) over w, with p = points w and defects w = 0.

    points: shape (3 n P, W). defects: shape (E, W). weights: shape (P,).
    """

    points: ca.DM
    defects: ca.DM
    weights: Array

    def solver(self, kernels: PointKernels) -> ca.Function:
        """An Ipopt solver for this program."""
        P = len(self.weights)
        m = self.points.shape[0] // P
        w = ca.MX.sym("w", self.points.shape[1])
        p = ca.reshape(ca.mtimes(self.points, w), m, P)
        f = ca.dot(kernels.value.map(P)(p).T, ca.DM(self.weights))
        g = ca.mtimes(self.defects, w)
        options: dict[str, Any] = {"print_time": 0, "ipopt": IPOPT, "no_nlp_grad": True}
        options |= self._derivatives(w, p, g, kernels)
        return ca.nlpsol("S", "ipopt", {"x": w, "f": f, "g": g}, options)

    def _derivatives(
        self, w: ca.MX, p: ca.MX, g: ca.MX, kernels: PointKernels
    ) -> dict[str, ca.Function]:
        """The functions that nlpsol would otherwise generate, by their option names."""
        m, P = p.shape
        W = ca.DM(self.weights)
        no_parameters, lf, lg = ca.MX.sym("par", 0, 1), ca.MX.sym("lf"), ca.MX.sym("lg", g.shape[0])
        value, slope = kernels.gradient.map(P)(p)
        slope = ca.mtimes(self.points.T, ca.vec(slope * ca.repmat(W.T, m, 1)))
        scale = ca.repmat(ca.DM(np.repeat(self.weights, m)).T, m, 1)
        H = block_diagonal(lf * kernels.hessian.map(P)(p) * scale, P)
        H = ca.mtimes(ca.mtimes(self.points.T, H), self.points)
        fgrad, jacobian = [ca.dot(value.T, W), slope], [g, ca.MX(self.defects)]
        hessian_of = ["x", "p", "lam:f", "lam:g"]
        upper = ["triu:hess:gamma:x:x"]
        return {
            "grad_f": ca.Function(
                "nlp_grad_f", [w, no_parameters], fgrad, ["x", "p"], ["f", "grad:f:x"]
            ),
            "jac_g": ca.Function(
                "nlp_jac_g", [w, no_parameters], jacobian, ["x", "p"], ["g", "jac:g:x"]
            ),
            "hess_lag": ca.Function(
                "nlp_hess_l", [w, no_parameters, lf, lg], [ca.triu(H)], hessian_of, upper
            ),
        }


def block_diagonal(blocks: ca.MX, count: int) -> ca.MX:
    """The block-diagonal matrix of `count` dense blocks of one size, given side by side."""
    m, n = blocks.shape[0], blocks.shape[1] // count
    columns = list(range(0, m * n * count + 1, m))
    rows = [m * k + i for k in range(count) for _ in range(n) for i in range(m)]
    return ca.MX(ca.Sparsity(m * count, n * count, columns, rows), ca.vec(blocks))


def casadi_matrix(matrix: sparse.spmatrix) -> ca.DM:
    """A sparse matrix as a CasADi DM."""
    columns = sparse.csc_matrix(matrix)
    columns.sum_duplicates()
    columns.sort_indices()
    rows, width = (int(size) for size in columns.shape)
    pattern = ca.Sparsity(rows, width, columns.indptr.tolist(), columns.indices.tolist())
    return ca.DM(pattern, columns.data)
