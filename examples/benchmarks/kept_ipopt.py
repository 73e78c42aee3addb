"""What motions keep: hovi against CasADi and Ipopt on the same discrete problem, row by row.

Straight lines and lines with the tool upright, to a place, on 16 intervals without limits. The
curves, quadrature points, rows at nodes and moments are hovi's, the kernels of Ipopt are compiled
by gcc (not timed), and both begin at the same cubic. A solve is one on this grid; a plan is hovi's
with its checks between the nodes and its comparison with a finer grid, next to Ipopt's solves on
both grids, the second one from hovi's motion. Times are those of one thread.

    python kept_ipopt.py [ARM ...] [--count 3] [--seed 0]
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse
from kept_paths import KINDS, KeptTask, random_tasks
from measuring import alone, print_machine, print_table
from numpy.polynomial import legendre
from random_arms import arm_scene, middle_and_most, timed

import hovi
from hovi.accuracy.peers.collocation import Collocation
from hovi.accuracy.peers.collocation_table import collocation_table, with_points
from hovi.accuracy.peers.point_program import (
    IPOPT,
    block_diagonal,
    casadi_matrix,
    compiled_functions,
)
from hovi.conditions.places import Along
from hovi.discrete.guess import cubic
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.planning.solver.solver import solve_on_grid

Array = npt.NDArray[np.float64]

ARMS, ASKED = ("ur5", "panda", "kinova"), ("line", "line and upright")
INTERVALS, MODES = 16, 2


@dataclass(frozen=True)
class IpoptSolve:
    """One solve by Ipopt. seconds: processor time."""

    seconds: float
    steps: int
    cost: float
    status: str


@dataclass(frozen=True)
class KeptProgram:
    """min sum w L(p) with C y(p) = c, for outputs y of the points p = (q, v, a) of a collocation.

    problem: hovi's, whose grid and rows these are. known: the kernels, which all grids have in
        common; compiled in a folder if None.
    """

    problem: hovi.TrajectoryProblem
    folder: Path
    known: tuple[ca.Function, ca.Function, ca.Function] | None = None

    @cached_property
    def method(self) -> Collocation:
        """hovi's table, with the node before every interval as a point without weight."""
        grid, scheme = self.problem.grid, self.problem.grid.schemes[0]
        points, weights = np.append(scheme.points, 0.0), np.append(scheme.weights, 0.0)
        table = with_points(collocation_table(f"lg-{scheme.inner_modes + 2}"), points, weights)
        return Collocation(table, grid.intervals, grid.duration, self.problem.robot.nv)

    @cached_property
    def kept(self) -> list[tuple[ca.Function, ca.Function, Array]]:
        """Functions of q, their rates of (q, v), and the values that are kept."""
        asked = [each for each in self.problem.conditions if each.where == Along(0)]
        return [(x.y.function, x.y.rate.function, np.asarray(x.on.value)) for x in asked]

    @cached_property
    def kernels(self) -> tuple[ca.Function, ca.Function, ca.Function]:
        """p -> (L, y), p -> (L, dL, y, J), (p, s, l) -> Hessian of s L + l y; compiled."""
        if self.known is not None:
            return self.known
        n = self.method.joints
        p, s = ca.SX.sym("p", 3 * n), ca.SX.sym("s")
        q, v, a = p[:n], p[n : 2 * n], p[2 * n :]
        tau = casadi_functions(self.problem.scene.model).inverse_dynamics(q, v, a)
        y = ca.vertcat(
            *(f(q) - ca.DM(c) for f, _, c in self.kept), *(g(q, v) for _, g, _ in self.kept)
        )
        multipliers = ca.SX.sym("l", y.numel())
        L, J = ca.sumsqr(tau) / 2, ca.densify(ca.jacobian(y, p))
        H = ca.hessian(s * L + ca.dot(multipliers, y), p)[0]
        made = [
            ca.Function("value", [p], [L, y]),
            ca.Function("first", [p], ca.cse([L, ca.gradient(L, p), y, J])),
            ca.Function("second", [p, s, multipliers], [ca.cse(ca.densify(H))]),
        ]
        value, first, second = compiled_functions(made, self.folder)
        return value, first, second

    @cached_property
    def rows(self) -> ca.DM:
        """C: moments of every interval, then values and rates at the nodes between both ends."""
        size = sum(f.numel_out(0) for f, _, _ in self.kept)
        table, N = self.problem.grid.schemes[0], self.method.intervals
        modes = range(table.inner_modes)
        tests = np.array([legendre.Legendre.basis(j, [0, 1])(table.points) for j in modes])
        moment = np.hstack([tests * table.weights, np.zeros((len(modes), 1))])
        node = np.append(np.zeros(len(table.points)), 1.0)[None]
        values = np.hstack([np.eye(size), np.zeros((size, size))])
        own = np.vstack([np.kron(moment, values), np.kron(node, np.eye(2 * size))])
        every = sparse.kron(sparse.identity(N), sparse.csr_matrix(own)).tocsr()
        first = len(moment) * size  # the first node is the start, which is given
        return casadi_matrix(
            every[np.setdiff1d(np.arange(every.shape[0]), first + np.arange(2 * size))]
        )

    def solve(self, goal: Array, near: hovi.Trajectory | None = None) -> IpoptSolve:
        """From the cubic to a goal, or from a motion."""
        problem, method, program = self.problem, self.method, self.method.program
        value, first, second = self.kernels
        P, n = len(program.weights), method.joints
        w, W = ca.MX.sym("w", program.points.shape[1]), ca.DM(program.weights)
        p = ca.reshape(ca.mtimes(program.points, w), -1, P)
        L, y = value.map(P)(p)
        L1, slope, y1, J = first.map(P)(p)
        slope = ca.mtimes(program.points.T, ca.vec(slope * ca.repmat(W.T, 3 * n, 1)))
        linear = ca.mtimes(program.defects, w)
        g = [ca.vertcat(linear, ca.mtimes(self.rows, ca.vec(each))) for each in (y, y1)]
        C = ca.mtimes(ca.mtimes(self.rows, block_diagonal(J, P)), program.points)
        jacobian = ca.vertcat(ca.MX(program.defects), C)
        none, lf, lg = ca.MX.sym("par", 0, 1), ca.MX.sym("lf"), ca.MX.sym("lg", g[0].shape[0])
        forces = ca.mtimes(self.rows.T, lg[program.defects.shape[0] :])
        H = block_diagonal(second.map(P)(p, lf * W.T, ca.reshape(forces, -1, P)), P)
        H = ca.triu(ca.mtimes(ca.mtimes(program.points.T, H), program.points))
        curved = IPOPT | {"jac_c_constant": "no"}
        options: dict[str, Any] = {"print_time": 0, "ipopt": curved, "no_nlp_grad": True}
        names, hessian = ["x", "p"], ["x", "p", "lam:f", "lam:g"]
        options["grad_f"] = ca.Function(
            "nlp_grad_f", [w, none], [ca.dot(L1.T, W), slope], names, ["f", "grad:f:x"]
        )
        options["jac_g"] = ca.Function(
            "nlp_jac_g", [w, none], [g[1], jacobian], names, ["g", "jac:g:x"]
        )
        options["hess_lag"] = ca.Function(
            "nlp_hess_l", [w, none, lf, lg], [H], hessian, ["triu:hess:gamma:x:x"]
        )
        solver = ca.nlpsol("S", "ipopt", {"x": w, "f": ca.dot(L.T, W), "g": g[0]}, options)
        ends = np.stack([problem.ends[0][0], goal]), np.zeros((2, n))
        first = cubic(problem.robot, ends, method.duration) if near is None else near.jet
        guess = method.unknowns(first, ends)
        free = np.where(method.fixed[:, None], 0.0, np.inf)
        bounds = {
            "lbx": (guess - free).ravel(),
            "ubx": (guess + free).ravel(),
            "lbg": 0.0,
            "ubg": 0.0,
        }
        seconds, found = timed(lambda: solver(x0=guess.ravel(), **bounds))
        stats = solver.stats()
        return IpoptSolve(
            seconds, int(stats["iter_count"]), float(found["f"]), str(stats["return_status"])
        )


@dataclass(frozen=True)
class Comparison:
    """One task: hovi's solve on a grid and its plan, and Ipopt's solves on that and a finer grid.

    seconds: of a solve, and of a plan. cost: of hovi's solve; NaN where one of them is no minimum.
    """

    seconds: tuple[float, float]
    steps: int
    cost: float
    ipopt: tuple[IpoptSolve, IpoptSolve]


def compare(arm: str, kind: str, count: int, seed: int) -> list[Comparison]:
    """Every task of an arm, to the configuration in which hovi's plan to the place ends."""
    scene, rows = arm_scene(arm), []
    for task in random_tasks(scene, kind, count, seed):
        planned = partial(_plan, scene, task, kind)
        there = planned(hovi.FrameGoal(scene.robot.tip_frames[0], position=task.place))
        goal = there.trajectory.q[-1]
        problem = planned(goal).problem  # also loads everything
        whole, plan = timed(partial(planned, goal))
        solve_on_grid(problem)
        seconds, found = timed(partial(solve_on_grid, problem))
        with tempfile.TemporaryDirectory() as folder:
            program = KeptProgram(problem, Path(folder))
            finer = KeptProgram(problem.finer, Path(folder), program.kernels)
            first, second = program.solve(goal), finer.solve(goal, found.trajectory)
        cost = found.cost if found.success and plan.success else np.nan
        rows.append(Comparison((seconds, whole), found.nit, cost, (first, second)))
    return rows


def _plan(scene: hovi.Scene, task: KeptTask, kind: str, goal: Any) -> hovi.Solution:
    return hovi.plan(
        scene,
        task.start,
        goal,
        task.duration,
        keep=KINDS[kind](scene.robot.tip_frames[0]),
        limits="none",
        self_collision=False,
        intervals=INTERVALS,
        scheme=f"galerkin-{MODES}",
        processes=1,
    )


def _succeeded(solve: IpoptSolve) -> bool:
    return solve.status == "Solve_Succeeded"


def main() -> None:
    """Print a row for each arm and kind, and every solve that did not succeed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("arms", nargs="*", metavar="ARM")
    parser.add_argument("--count", type=int, default=3)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    table = []
    for arm in given.arms or ARMS:
        for kind in ASKED:
            runs = alone(compare, arm, kind, given.count, given.seed)
            both = [r for r in runs if np.isfinite(r.cost) and all(map(_succeeded, r.ipopt))]
            gaps = [r.cost / r.ipopt[0].cost - 1.0 for r in both]
            same = [abs(gap) for gap in gaps if abs(gap) < 1e-4]
            solve = [r.ipopt[0].seconds / r.seconds[0] for r in both]
            plan = [sum(each.seconds for each in r.ipopt) / r.seconds[1] for r in both]
            table.append(
                [
                    f"`{arm}`, {kind}",
                    f"{sum(np.isfinite(r.cost) for r in runs)}, {len(both)} of {len(runs)}",
                    f"{len(same)} of {len(both)}",
                    middle_and_most(same, ".0e"),
                    f"{sum(gap <= -1e-4 for gap in gaps)}, {sum(gap >= 1e-4 for gap in gaps)}",
                    middle_and_most([r.steps for r in both], ".0f"),
                    middle_and_most([r.ipopt[0].steps for r in both], ".0f"),
                    middle_and_most(solve),
                    middle_and_most(plan),
                ]
            )
    columns = ["", "minima: hovi, Ipopt", "the same minimum", "difference of costs: median, max"]
    columns += ["cheaper: hovi, Ipopt", "steps: median, max", "Ipopt's steps"]
    columns += ["a solve: Ipopt's CPU s / hovi's: median, max"]
    print_table([*columns, "a plan: the same"], table)
    print_machine(threads=1)


if __name__ == "__main__":
    main()
