"""Swing-ups with a passive joint: steps, time and cost of hovi and of Ipopt, and orders of hovi.

Ipopt solves the same discrete problem, which is collocation at the Gauss points: accelerations are
controls, and the passive row of RNEA is an equality at every point, which with r + 2 points is the
same as r + 2 moments. Its exact derivatives are assembled from kernels of one point compiled by
gcc. Both start from the cubic guess. Times are processor times, the best of runs in turn.
"""

from __future__ import annotations

import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from measuring import alone, exponent, print_machine, print_table
from transcription import COMPILE, IPOPT, Transcription

import hovi
from hovi.discrete.guess import stretched, with_bump
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.solver import solve_on_grid

SCENES = ("acrobot_swing_up", "pendubot_swing_up", "cart_pole_swing_up")
INTERVALS, SCHEME = 40, "galerkin-2"
SCHEMES = ("galerkin-0", "galerkin-1", "galerkin-1x5", "galerkin-2", "galerkin-2x8")
GRIDS = (40, 80, 160)
FINE = 320
SAME_COST = 1e-6
"""Relative difference in cost up to which two minima are the same."""
RUNS = 10
"""Runs of both, in turn, of which the fastest counts."""


def problem_on(scene: str, intervals: int, scheme: str) -> hovi.TrajectoryProblem:
    """The swing-up without limits."""
    task = hovi.load_task(hovi.example(scene))
    grid = hovi.Grid.uniform(task.duration, intervals, hovi.schemes.by_name(scheme))
    ld = hovi.DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    return hovi.TrajectoryProblem(ld, task.start, task.goal)


class PassiveProgram(Transcription):
    """The transcription with the passive torques at the points as equations."""

    def solver(self, folder: Path) -> ca.Function:
        """Ipopt with derivatives from point kernels compiled by gcc in `folder`."""
        L, tau, dL, dtau, ddL = self._compiled(folder)
        w, p = self._variables()
        P, m = len(self.weights), (self.k + 1) * self.n
        W, none, lf = ca.DM(self.weights).T, ca.MX.sym("par", 0, 1), ca.MX.sym("lf")
        linear = ca.mtimes(self.defects, w)
        g = ca.vertcat(linear, ca.vec(tau.map(P)(p)))
        value, slope = dL.map(P)(p)
        slope = ca.mtimes(self.points.T, ca.vec(slope * ca.repmat(W, m, 1)))
        torque, rows = dtau.map(P)(p)
        count = tau.size1_out(0)
        J = ca.mtimes(ca.MX(_blocks(count, m, P), ca.vec(rows)), self.points)
        lg = ca.MX.sym("lg", g.shape[0])
        curvature = ddL.map(P)(p, lf * W, ca.reshape(lg[linear.shape[0] :], count, P))
        H = ca.mtimes(self.points.T, ca.MX(_blocks(m, m, P), ca.vec(curvature)))
        H = ca.triu(ca.mtimes(H, self.points))
        jacobian = [ca.vertcat(linear, ca.vec(torque)), ca.vertcat(ca.MX(self.defects), J)]
        derivatives = {
            "grad_f": ([w, none], [ca.dot(value, W), slope], ["x", "p"], ["f", "grad:f:x"]),
            "jac_g": ([w, none], jacobian, ["x", "p"], ["g", "jac:g:x"]),
            "hess_lag": (
                [w, none, lf, lg],
                [H],
                ["x", "p", "lam:f", "lam:g"],
                ["triu:hess:gamma:x:x"],
            ),
        }
        options: dict[str, Any] = {"print_time": 0, "no_nlp_grad": True}
        options["ipopt"] = IPOPT | {"jac_c_constant": "no"}
        for (option, parts), name in zip(
            derivatives.items(), ("nlp_grad_f", "nlp_jac_g", "nlp_hess_l"), strict=True
        ):
            options[option] = ca.Function(name, *parts)
        return ca.nlpsol("S", "ipopt", {"x": w, "f": self._cost(L, p), "g": g}, options)

    def _compiled(self, folder: Path) -> list[ca.Function]:
        """L and the passive torques at one point, their slopes, and the Lagrangian's Hessian."""
        n = self.n
        passive = [int(i) for i in self.problem.passive]
        active = [i for i in range(n) if i not in passive]
        p, lf, lam = ca.SX.sym("p", 3 * n), ca.SX.sym("lf"), ca.SX.sym("lam", len(passive))
        rnea = casadi_functions(self.problem.scene.model).inverse_dynamics
        tau = ca.cse(rnea(p[:n], p[n : 2 * n], p[2 * n :]))
        L, zero = ca.sumsqr(tau[active]) / 2, tau[passive]
        H = ca.densify(ca.hessian(lf * L + ca.dot(lam, zero), p)[0])
        kernels = [
            ca.Function("L", [p], [L]),
            ca.Function("tau", [p], [zero]),
            ca.Function("dL", [p], [L, ca.cse(ca.gradient(L, p))]),
            ca.Function("dtau", [p], [zero, ca.cse(ca.densify(ca.jacobian(zero, p)))]),
            ca.Function("ddL", [p, lf, lam], [ca.cse(H)]),
        ]
        generator = ca.CodeGenerator("kernels.c")
        for kernel in kernels:
            generator.add(kernel)
        generator.generate(f"{folder}/")
        library = str(folder / "kernels.so")
        subprocess.check_call([*COMPILE, "-o", library, str(folder / "kernels.c"), "-lm"])
        return [ca.external(kernel.name(), library) for kernel in kernels]


def _blocks(rows: int, columns: int, count: int) -> ca.Sparsity:
    """The pattern of equal dense blocks along a diagonal."""
    starts = list(range(0, rows * columns * count + 1, rows))
    inside = [rows * k + i for k in range(count) for _ in range(columns) for i in range(rows)]
    return ca.Sparsity(rows * count, columns * count, starts, inside)


def compare(scene: str) -> list[list[object]]:
    """One row for hovi, one for Ipopt, and one for hovi with more starts in Ipopt's time."""
    problem = problem_on(scene, INTERVALS, SCHEME)
    program = PassiveProgram(problem)
    arguments = program.arguments("cubic")
    with tempfile.TemporaryDirectory() as folder:
        solver = program.solver(Path(folder))
        ours, theirs = fastest(lambda: solve_on_grid(problem), lambda: solver(**arguments))
        found, stats = solver(**arguments), solver.stats()
    solution = solve_on_grid(problem)
    residuals = ActionObjective(problem).residuals(solution.trajectory.path)
    passive, tolerance = f"{residuals.torque_fraction:.0e}", f"{IPOPT['tol']:.0e}"
    steps, cost = stats["iter_count"], float(found["f"])
    word = "minimum" if stats["success"] else stats["return_status"]
    starts, spent, least = within(problem, theirs)
    mine = _row(scene, "hovi", solution.nit, steps, ours, theirs, solution.cost, cost)
    other = _row(scene, "Ipopt", steps, steps, theirs, theirs, cost, cost)
    more = _row(scene, f"hovi, {starts} starts", "", steps, spent, theirs, least, cost)
    return [[*mine, solution.status, passive], [*other, word, tolerance], [*more, "minimum", ""]]


def _row(
    scene: str, solver: str, nit: object, steps: int, mine: float, ipopt: float, f: float, g: float
) -> list[object]:
    ratio = f"{nit / steps:.2f}" if isinstance(nit, int) else ""
    times = f"{1e3 * mine:.1f}", f"{mine / ipopt:.2f}"
    return [f"`{scene}`, {solver}", nit, ratio, *times, f"{f:.7g}", f"{f / g:.3f}"]


def fastest(*works: Callable[[], object]) -> list[float]:
    """The shortest processor times of works that run in turn, in [s]."""
    times = []
    for _ in range(RUNS):
        times.append([_seconds(work) for work in works])
    return [float(each) for each in np.min(times, axis=0)]


def _seconds(work: Callable[[], object]) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began


def within(problem: hovi.TrajectoryProblem, seconds: float) -> tuple[int, float, float]:
    """Starts that end within a processor time, their time, and the lowest cost of their minima.

    The first is the cubic guess; each further one a bump on the best minimum so far, as in later
    rounds of hovi.plan's multi-start.
    """
    began = time.process_time()
    best = solve_on_grid(problem)
    count, spent = 1, time.process_time() - began
    on, T = problem.coordinates, problem.grid.duration
    while True:
        bump = with_bump(stretched(best.trajectory, T), on, T, seed=count)
        found = solve_on_grid(problem, problem.path(bump))
        now = time.process_time() - began
        if now > seconds:
            return count, spent, best.cost
        count, spent = count + 1, now
        if found.success and found.cost < (1.0 - SAME_COST) * best.cost:
            best = found


def convergence(scene: str) -> list[list[object]]:
    """Observed orders of the cost and of q at the nodes, for every scheme."""
    near = hovi.solve(problem_on(scene, 80, SCHEME)).trajectory
    fine = hovi.solve(problem_on(scene, FINE, "galerkin-3"), near)
    rows = []
    for scheme in SCHEMES:
        costs, nodes = [], []
        for N in GRIDS:
            coarse = hovi.solve(problem_on(scene, N, scheme), fine.trajectory)
            costs.append(abs(coarse.cost / fine.cost - 1))
            gap = coarse.trajectory.q - fine.trajectory.q[:: FINE // N]
            nodes.append(float(np.max(np.abs(gap))))
        orders = [f"{exponent(1 / np.array(GRIDS), each):.1f}" for each in (costs, nodes)]
        errors = [f"{each[-1]:.0e}" for each in (costs, nodes)]
        order = hovi.schemes.by_name(scheme).order
        rows.append([f"`{scene}`, `{scheme}`", order, *orders, *errors])
    return rows


def main() -> None:
    print(f"`{SCHEME}` on {INTERVALS} intervals, from the cubic guess; ratios to Ipopt.\n")
    rows = [row for scene in SCENES for row in alone(compare, scene)]
    columns = ["scene, solver", "steps", "ratio", "CPU ms", "ratio", "cost", "ratio", "status"]
    print_table([*columns, "passive torque"], rows)
    print("Passive torque at the quadrature points, as a fraction of the largest torque; for Ipopt")
    print(
        "its tolerance. The third rows: within Ipopt's time, with more starts, the lowest cost.\n"
    )
    rows = [row for scene in SCENES[::2] for row in alone(convergence, scene)]
    print(f"Least-squares orders over {', '.join(map(str, GRIDS))} intervals, and errors on the")
    print(f"last, against `galerkin-3` on {FINE}:\n")
    names = ["scene, scheme", "order", "cost, observed", "q, observed", "cost error", "q [rad, m]"]
    print_table(names, rows)
    print_machine(threads=1)


if __name__ == "__main__":
    main()
