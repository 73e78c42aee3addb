"""Peers on the stage-wise form of a problem: Fatrop, and HPIPM as the QP of CasADi's SQP.

The state of a stage is (q, v) at a node and its control the accelerations at the points of the
interval, from which the next state follows linearly. Both solvers eliminate stage by stage. Costs,
limits at the quadrature points and the guess are hovi's; functions are interpreted by CasADi, and
the time that they take is counted apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
from random_arms import timed
from transcription import Transcription

import hovi
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.planning.solver.solver import guess_path

Array = npt.NDArray[np.float64]

FATROP: dict[str, Any] = {
    "structure_detection": "manual",
    "fatrop": {"print_level": 0, "tol": 1e-8, "max_iter": 300},
}
HPIPM: dict[str, Any] = {
    "qpsol": "hpipm",
    "qpsol_options": {"hpipm": {"iter_max": 200, "mode": "robust"}, "error_on_fail": False},
    "convexify_strategy": "regularize",
    "tol_du": 1e-6,
    "tol_pr": 1e-6,
    "max_iter": 100,
    "print_header": False,
    "print_iteration": False,
    "print_status": False,
}
ROUNDING = 1e-11
"""Entries of the linear dynamics below which they are zero."""
PEERS = {"Fatrop": ("fatrop", FATROP), "SQP by HPIPM": ("sqpmethod", HPIPM)}
"""The solver of CasADi and its options, by the name in tables."""


@dataclass(frozen=True)
class StageRun:
    """A solve. seconds: processor time; evaluations: of it in functions; excess: at the points."""

    success: bool
    status: str
    steps: int
    cost: float
    seconds: float
    evaluations: float
    excess: float


class StageProgram:
    """The nonlinear program of a problem, with limits on q, v and tau if any, stage by stage."""

    def __init__(self, problem: hovi.TrajectoryProblem) -> None:
        self.problem, self.it = problem, Transcription(problem)
        grid, limits = problem.grid, problem.limits
        n, Q, N = self.it.n, len(grid.schemes[0].points), grid.intervals
        rnea = casadi_functions(problem.scene.model).inverse_dynamics
        point = [ca.SX.sym(name, n) for name in "qva"]
        tau = ca.Function("tau", [ca.vertcat(*point)], [rnea(*point)])
        points = self.it.points
        stride, h = self.it.stride * n, float(grid.steps[0])
        # q, h v and h^2 a, as the others scale
        of_stage = np.concatenate([np.ones(n), np.full(n, 1 / h), np.full(Q * n, 1 / h**2)])
        self.scale = np.concatenate([np.tile(of_stage, N), of_stage[: 2 * n]])
        unscaled = ca.MX.sym("w", points.shape[1])
        w = unscaled * ca.DM(self.scale)
        defects = self._explicit()
        rows, lower, upper, equal, cost = [], [], [], [], 0
        kinds = [] if limits is None else [0, 1, 3]
        kinds = [row for row in kinds if np.isfinite(limits.lower[row]).any()]
        for k in range(N + 1):
            own = w[k * stride : min((k + 1) * stride, w.shape[0])]
            if k < N:
                gap = ca.mtimes(defects[2 * n * k : 2 * n * (k + 1), :], unscaled)
                rows.append(gap)
                equal += [True] * 2 * n
                lower.append(np.zeros(2 * n))
                upper.append(np.zeros(2 * n))
            if k in (0, N):
                rows.append(own[: 2 * n] / of_stage[: 2 * n])
                equal += [True] * 2 * n
                end = np.concatenate([pair[int(k == N)] for pair in problem.ends])
                lower.append(end / of_stage[: 2 * n])
                upper.append(end / of_stage[: 2 * n])
            for j in range(k * Q, (k + 1) * Q if k < N else k * Q):
                p = ca.mtimes(points[3 * n * j : 3 * n * (j + 1), :], w)
                torque = tau(p)
                cost += float(self.it.weights[j]) * ca.sumsqr(torque) / 2
                for row in kinds:
                    y = torque if row == 3 else p[n * row : n * (row + 1)]
                    size = limits.upper[row] - limits.lower[row]
                    rows.append(y / size)
                    equal += [False] * n
                    lower.append(limits.lower[row] / size)
                    upper.append(limits.upper[row] / size)
        self.nlp = {"x": unscaled, "f": cost / self._first_cost(), "g": ca.vertcat(*rows)}
        self.bounds = {"lbg": np.concatenate(lower), "ubg": np.concatenate(upper)}
        self.equal = equal
        size, per_point = 2 * n, n * len(kinds)
        path = [Q * per_point] * N + [0]
        path[0], path[N] = path[0] + size, path[N] + size
        self.stages = {"N": N, "nx": [size] * (N + 1), "nu": [Q * n] * N + [0], "ng": path}

    def _first_cost(self) -> float:
        """The cost of the guess, to which the objective is relative."""
        self.unit = float(self.problem.ld.action(guess_path(self.problem, "cubic")))
        return self.unit

    def _explicit(self) -> ca.DM:
        """The defects, with the identity for the next state."""
        n, N = self.it.n, self.problem.grid.intervals
        last = self.it.defects[: 2 * n, self.it.stride * n : self.it.stride * n + 2 * n].full()
        inverse = np.linalg.inv(last)
        size = np.diag(1 / self.scale[: 2 * n]) @ inverse
        product = ca.mtimes(ca.sparsify(ca.DM(np.kron(np.eye(N), size))), self.it.defects)
        product = ca.mtimes(product, ca.diag(ca.DM(self.scale)))
        product = ca.sparsify(product, ROUNDING)
        entries = np.array(product.nonzeros())
        near = np.abs(entries - 1.0) < ROUNDING
        return ca.DM(product.sparsity(), np.where(near, 1.0, entries))

    def solved(self, name: str, guess: object = "cubic") -> StageRun:
        """A solve by one of PEERS."""
        plugin, options = PEERS[name]
        options = options | {"print_time": False, "record_time": True}
        if plugin == "fatrop":
            options |= self.stages | {"equality": self.equal}
        else:
            inner = options["qpsol_options"]
            options["qpsol_options"] = inner | self.stages
        solver = ca.nlpsol("S", plugin, self.nlp, options)
        first = np.asarray(self.it.arguments(guess)["x0"]) / self.scale
        seconds, found = timed(lambda: solver(x0=first, **self.bounds))
        stats, g = solver.stats(), found["g"].full().ravel()
        inner = [key for key in stats if key.startswith("t_proc_nlp_")]
        return StageRun(
            success=bool(stats["success"]),
            status=str(stats["unified_return_status"]),
            steps=int(stats.get("iter_count", -1)),
            cost=self.unit * float(found["f"]),
            seconds=seconds,
            evaluations=float(sum(stats[key] for key in inner)),
            excess=float(np.max(np.maximum(self.bounds["lbg"] - g, g - self.bounds["ubg"]))),
        )
