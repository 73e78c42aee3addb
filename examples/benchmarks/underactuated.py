"""Swing-ups with a passive joint: orders of hovi, and the same problems solved by Ipopt.

Ipopt solves the same discrete problem, which is collocation at the Gauss points: accelerations are
controls, the passive row of RNEA is an equality at every point, and the exact Hessian is CasADi's,
expanded to scalars. Both start from the cubic guess.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from measuring import alone, best_time, exponent, print_machine, print_table
from transcription import IPOPT, Transcription

import hovi
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.planning.solver.action_objective import ActionObjective

SCENES = ("acrobot_swing_up", "pendubot_swing_up", "cart_pole_swing_up")
INTERVALS, SCHEME = 40, "galerkin-2"
SCHEMES = ("galerkin-0", "galerkin-1", "galerkin-1x5", "galerkin-2", "galerkin-2x8")
GRIDS = (40, 80, 160)
FINE = 320


def problem_on(scene: str, intervals: int, scheme: str) -> hovi.TrajectoryProblem:
    """The swing-up without limits."""
    task = hovi.load_task(hovi.example(scene))
    grid = hovi.Grid.uniform(task.duration, intervals, hovi.schemes.by_name(scheme))
    ld = hovi.DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    return hovi.TrajectoryProblem(ld, task.start, task.goal)


def collocation(problem: hovi.TrajectoryProblem) -> ca.Function:
    """An Ipopt solver for the same discrete problem."""
    it = Transcription(problem)
    n, passive = it.n, [int(i) for i in problem.passive]
    active = [i for i in range(n) if i not in passive]
    rnea = casadi_functions(problem.scene.model).inverse_dynamics
    w = ca.MX.sym("w", it.points.shape[1])
    P = len(it.weights)
    p = ca.reshape(ca.mtimes(it.points, w), 3 * n, P)
    tau = rnea.map(P)(*ca.vertsplit(p, n))  # (n, P)
    cost = ca.dot(ca.sum1(tau[active, :] ** 2).T, ca.DM(it.weights)) / 2
    g = ca.vertcat(ca.mtimes(it.defects, w), ca.vec(tau[passive, :]))
    options = {"print_time": 0, "expand": True, "ipopt": IPOPT | {"jac_c_constant": "no"}}
    return ca.nlpsol("S", "ipopt", {"x": w, "f": cost, "g": g}, options)


def compare(scene: str) -> list[list[object]]:
    """One row for hovi and one for Ipopt."""
    problem = problem_on(scene, INTERVALS, SCHEME)
    ours = hovi.solve(problem)
    residuals = ActionObjective(problem).residuals(ours.trajectory.path)
    seconds = best_time(lambda: hovi.solve(problem))
    rows = [_row(scene, "hovi", ours.nit, seconds, seconds, ours.cost, ours.status)]
    rows[0].append(f"{residuals.torque_share:.0e}")
    guess = Transcription(problem).arguments("cubic")
    solver = collocation(problem)
    found = solver(**guess)
    stats = solver.stats()
    taken = best_time(lambda: solver(**guess), least=1)
    word = "minimum" if stats["success"] else stats["return_status"]
    cost, steps = float(found["f"]), stats["iter_count"]
    row = _row(scene, "Ipopt", steps, taken, seconds, cost, word)
    rows.append([*row, f"{IPOPT['tol']:.0e}"])
    return rows


def _row(
    scene: str, solver: str, steps: int, seconds: float, ours: float, cost: float, status: str
) -> list[object]:
    times = f"{1e3 * seconds:.0f}", f"{seconds / ours:.1f}"
    return [f"`{scene}`, {solver}", steps, *times, f"{cost:.7g}", status]


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
    print(f"`{SCHEME}` on {INTERVALS} intervals, from the cubic guess, warm.\n")
    rows = [row for scene in SCENES for row in alone(compare, scene)]
    columns = ["scene, solver", "steps", "ms", "of hovi's", "cost", "status", "passive torque"]
    print_table(columns, rows)
    print("Passive torque at the quadrature points, as a share of the largest torque; for Ipopt")
    print("its tolerance.\n")
    rows = [row for scene in SCENES[::2] for row in alone(convergence, scene)]
    print(f"Least-squares orders over {', '.join(map(str, GRIDS))} intervals, and errors on the")
    print(f"last, against `galerkin-3` on {FINE}:\n")
    names = ["scene, scheme", "order", "cost, observed", "q, observed", "cost error", "q [rad, m]"]
    print_table(names, rows)
    print_machine(threads=1)


if __name__ == "__main__":
    main()
