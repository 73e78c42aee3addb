"""Reaches under limits compared with Ipopt, and the time to detect infeasible problems.

Both solvers have the same discrete problem, guess and thread in one run: q, v and tau are bounded
at the quadrature points. hovi then continues until the limits hold between the points too. Ipopt
has CasADi's exact Hessian, expanded to scalars; building it is not counted.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from measuring import alone, best_time, print_machine, print_table
from transcription import IPOPT, Transcription

import hovi
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.optimize.interior_point import minimize_bounded
from hovi.optimize.trust_region import Options
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.solver import guess_path

SCENES = ("ur5_reach_limited", "panda_reach_limited")
SCHEME, INTERVALS = "galerkin-2", 16


def reach(scene: str, **changes: object) -> hovi.TrajectoryProblem:
    """The problem of a scene file, with other limits, start or duration."""
    task = hovi.load_task(hovi.example(scene))
    limits = as_limits(task.scene.robot, changes.get("limits", task.options.limits))
    start = hovi.State(changes["start"]) if "start" in changes else task.start
    return _problem(task.scene, start, task.goal, changes.get("duration", task.duration), limits)


def held(torque: float | None) -> hovi.TrajectoryProblem:
    """A two-link arm held horizontal within 0.05 rad, by at most this torque in [N m]."""
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity()])
    given = {"base": "none", "q": 0.05} | ({} if torque is None else {"tau": torque})
    rest = hovi.State(np.zeros(2))
    return _problem(scene, rest, rest, 1.0, as_limits(scene.robot, given))


def _problem(
    scene: hovi.Scene, start: hovi.State, goal: hovi.State, duration: float, limits: Limits
) -> hovi.TrajectoryProblem:
    grid = hovi.Grid.uniform(duration, INTERVALS, hovi.schemes.by_name(SCHEME))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    return hovi.TrajectoryProblem(ld, start, goal, limits=limits)


def measure(scene: str) -> list[dict[str, object]]:
    """The interior point, the whole solve, and Ipopt."""
    problem = reach(scene)
    path = guess_path(problem, "cubic")

    def first() -> object:
        return minimize_bounded(BoundedAction(problem, problem.limits), path, Options())

    outcome = first()
    assert outcome.feasible, outcome.stop
    assert outcome.stop == "stationary", outcome.stop
    point = {"solver": "hovi, at the points", "steps": outcome.iterations}
    point |= {"cost": outcome.outputs.value, "seconds": best_time(first, 1.0)}
    solution = hovi.solve(problem)
    whole = {"solver": "hovi, everywhere", "steps": solution.nit, "cost": solution.cost}
    whole |= {"seconds": best_time(lambda: hovi.solve(problem), 1.0)}
    whole |= {"message": solution.message}
    transcription = Transcription(problem)
    solver, bounds = ipopt(transcription)
    arguments = transcription.arguments("cubic") | bounds
    found = solver(**arguments)
    stats = solver.stats()
    peer = {"solver": f"Ipopt ({stats['return_status']})", "steps": stats["iter_count"]}
    peer |= {"cost": float(found["f"]), "seconds": best_time(lambda: solver(**arguments), 0.5, 2)}
    near = solver(**transcription.arguments(outcome.x) | bounds)
    again = {"solver": "Ipopt, from hovi's motion", "steps": solver.stats()["iter_count"]}
    return [point, whole, peer, again | {"cost": float(near["f"]), "seconds": None}]


def ipopt(it: Transcription) -> tuple[ca.Function, dict[str, object]]:
    """An Ipopt solver for a transcription with limits, and its bounds."""
    n, P = it.n, len(it.weights)
    x = ca.SX.sym("x", 3 * n)
    rnea = casadi_functions(it.problem.scene.model).inverse_dynamics
    torque = ca.Function("tau", [x], [ca.cse(rnea(x[:n], x[n : 2 * n], x[2 * n :]))])
    w = ca.MX.sym("w", it.points.shape[1])
    p = ca.reshape(ca.mtimes(it.points, w), 3 * n, P)
    tau = torque.map(P)(p)
    cost = ca.dot(ca.sum1(tau**2).T, ca.DM(it.weights)) / 2
    outputs = ca.vec(ca.vertcat(p[: 2 * n, :], tau))
    nlp = {"x": w, "f": cost, "g": ca.vertcat(ca.mtimes(it.defects, w), outputs)}
    solver = ca.nlpsol("S", "ipopt", nlp, {"print_time": 0, "expand": True, "ipopt": IPOPT})
    defects, rows = np.zeros(it.defects.shape[0]), [0, 1, 3]
    limits = it.problem.limits
    lower = np.concatenate([defects, np.tile(limits.lower[rows].ravel(), P)])
    upper = np.concatenate([defects, np.tile(limits.upper[rows].ravel(), P)])
    return solver, {"lbg": lower, "ubg": upper}


def measure_infeasible() -> list[tuple[str, float, float, str, str]]:
    """Per infeasible problem: its time, that of a similar feasible problem, status, reason."""
    ur5 = "ur5_reach_limited"
    feasible = reach(ur5)
    outside = np.add(feasible.start.q, [7.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    weak = {"v": 3.14, "tau": [20.0, 20.0, 20.0, 5.0, 5.0, 5.0]}
    cases = {
        "UR5, start outside": (reach(ur5, start=outside), feasible),
        "UR5, 0.3 s": (reach(ur5, duration=0.3), feasible),
        "UR5, torques of 20 and 5 N m": (reach(ur5, limits=weak), feasible),
        "two links held by 2 N m": (held(2.0), held(None)),
    }
    rows = []
    for name, (problem, like) in cases.items():
        possible = hovi.solve(like)
        assert possible.success, possible.message
        solution = hovi.solve(problem)
        ours = min(solution.solve_seconds, hovi.solve(problem).solve_seconds)
        other = best_time(lambda like=like: hovi.solve(like), 0.3)
        rows.append((name, ours, other, str(solution.status), solution.message))
    return rows


def main() -> None:
    print(f"`{SCHEME}` on {INTERVALS} intervals, from the cubic guess, one thread, when warm.\n")
    table, notes = [], []
    for scene in SCENES:
        runs = alone(measure, scene)
        ours = runs[0]
        for run in runs:
            timed = run["seconds"] is not None
            table.append(
                [
                    f"`{scene}`, {run['solver']}",
                    run["steps"],
                    f"{run['steps'] / ours['steps']:.2f}",
                    f"{1e3 * run['seconds']:.1f}" if timed else "",
                    f"{run['seconds'] / ours['seconds']:.1f}" if timed else "",
                    f"{run['cost']:.10g}",
                    f"{run['cost'] / ours['cost'] - 1:.1e}",
                ]
            )
        notes.append(f"- `{scene}`, hovi everywhere: {runs[1]['message']}")
    columns = ["scene, solver", "steps", "steps / hovi's", "ms", "time / hovi's", "cost"]
    print_table([*columns, "cost / hovi's - 1"], table)
    print("\n".join(notes) + "\n")
    print("Problems without a motion, against one like it that has one:\n")
    rows = alone(measure_infeasible)
    columns = ["problem", "ms", "ms of a feasible one", "ratio", "status"]
    print_table(
        columns,
        [[n, f"{1e3 * a:.1f}", f"{1e3 * b:.1f}", f"{a / b:.2g}", s] for n, a, b, s, _ in rows],
    )
    print("\n".join(f"- {name}: {message}" for name, *_, message in rows) + "\n")
    print_machine(threads=1)


if __name__ == "__main__":
    main()
