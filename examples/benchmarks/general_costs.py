"""Twelve costs C(q, v, a, tau, t): hovi against CasADi and Ipopt on the same discrete problem.

The formulas are those of the scene; hovi carries their derivatives through the analytic ones of the
torques, Ipopt's are CasADi's of the whole expression, RNEA included, evaluated by CasADi's
interpreter or, with the argument `compiled`, by code of gcc. Both start from the cubic guess;
since a cost may have several minima, Ipopt starts at hovi's motion once more and must stay.

Times are those of the processor, which depend little on other load: one thread does all the work.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
from measuring import alone, print_machine, print_table
from transcription import Transcription

import hovi
from hovi.effects import AccelerationCost, CasadiCost, Effect, EffortWeight, PowerCost, RunningCost
from hovi.planning.solver.solver import solve_on_grid

Effects = Callable[[hovi.Robot], list[Effect]]

ARMS = {
    "two_link": (hovi.example("two_link.urdf"), [0.0, 0.0], [1.2, 0.6]),
    "ur5": ("ur5", [0.0, -1.2, 1.2, 0.0, 0.3, 0.0], [0.8, -0.9, 0.7, 0.4, 0.5, 1.0]),
}
"""Robots, and the configurations between which they move in a second, at rest at both ends."""
INTERVALS = 16
SCHEME = "galerkin-2"
NO_EFFORT = EffortWeight(0.0)


def formula(text: str, *more: Effect) -> Effects:
    """A cost of one formula, in which TIP and JOINT are the robot's."""

    def effects(robot: hovi.Robot) -> list[Effect]:
        joint, tip = robot.coordinate_names[1], robot.tip_frame
        cost = text.replace("TIP", f'"{tip}"').replace("JOINT", f'"{joint}"')
        return [RunningCost({"cost": cost}), *more]

    return effects


def full_matrix(robot: hovi.Robot) -> list[Effect]:
    """R = 0.4 + 1 on the diagonal."""
    rows = 0.4 + np.eye(robot.nv)
    return [EffortWeight(matrix=tuple(tuple(float(x) for x in row) for row in rows))]


def bent_matrix(robot: hovi.Robot) -> list[Effect]:
    """Couplings that change with the second joint."""
    off = f'0.3*cos(q["{robot.coordinate_names[1]}"])'
    n = robot.nv
    rows = ((f"1 + {off}**2" if i == j else off for j in range(n)) for i in range(n))
    return [EffortWeight(matrix=tuple(map(tuple, rows)))]


def weightless_joint(robot: hovi.Robot) -> list[Effect]:
    """No weight on the torque of the second joint, but on its acceleration."""
    joint = robot.coordinate_names[1]
    return [EffortWeight({joint: 0.0}), AccelerationCost({joint: 1.0})]


def torque_peaks(robot: hovi.Robot) -> list[Effect]:
    """Fourth powers, which lower the peaks."""
    return [CasadiCost(lambda q, v, a, tau, t: ca.sumsqr(tau**2) / 200)]


COSTS: dict[str, Effects] = {
    "copper losses, mechanical power recovered": formula(
        "0.05*dot(tau, tau) + dot(tau, v)", NO_EFFORT
    ),
    "copper losses, bus without recovery": formula(
        "0.05*dot(tau, tau) + (sqrt(dot(tau, v)**2 + 25) + dot(tau, v))/2", NO_EFFORT
    ),
    "moment on the base": formula("0.02*dot(base_moment, base_moment)"),
    "horizontal force on the base": formula('0.1*(base_force["x"]**2 + base_force["y"]**2)'),
    "tip acceleration": formula("2*dot(acceleration[TIP], acceleration[TIP])"),
    "tip speed": formula("20*dot(velocity[TIP], velocity[TIP])"),
    "full matrix R": full_matrix,
    "full matrix R(q)": bent_matrix,
    "a joint of weight zero, its acceleration": weightless_joint,
    "smoothed abs(tau v)": lambda robot: [EffortWeight(0.1), PowerCost(1.0, 5.0)],
    "weights that change in time": formula("(0.1 + t**2)*dot(tau, tau)", NO_EFFORT),
    "torque peaks": torque_peaks,
}


class CostTranscription(Transcription):
    """The transcription with the cost of a scene, which may depend on time."""

    def _variables(self) -> tuple[ca.MX, ca.MX]:
        w, p = super()._variables()
        times = np.concatenate(self.problem.ld.point_times)
        return w, ca.vertcat(p, ca.DM(times).T)

    def _point_functions(self) -> tuple[ca.Function, ca.Function, ca.Function]:
        n = self.n
        p = ca.SX.sym("p", 3 * n + 1)
        jet = p[: 3 * n]
        L = ca.cse(hovi.symbolic.lagrangian(self.problem.scene)(*ca.vertsplit(jet, n), p[3 * n]))
        H, g = ca.hessian(L, jet)
        return (
            ca.Function("L", [p], [L]),
            ca.Function("dL", [p], [L, ca.cse(g)]),
            ca.Function("ddL", [p], [ca.cse(ca.densify(H))]),
        )


def measure(arm: str, cost: str, compiled: bool) -> dict[str, float]:
    """Steps and times of warm solves, and differences of the costs."""
    source, start, goal = ARMS[arm]
    robot = hovi.load_robot(source)
    problem = _problem(robot, COSTS[cost](robot), start, goal)
    ours = solve_on_grid(problem)
    assert ours.success, ours.message
    row = {"steps": ours.nit, "seconds": _seconds(lambda: solve_on_grid(problem), 3)}
    transcription = CostTranscription(problem)
    with tempfile.TemporaryDirectory() as folder:
        solver = transcription.compiled(Path(folder)) if compiled else transcription.interpreted()
        near = solver(**transcription.arguments(ours.trajectory))
        row["stays"] = abs(float(near["f"]) / ours.cost - 1)
        guess = transcription.arguments("cubic")
        found: list[dict[str, ca.DM]] = []
        row["ipopt"] = _seconds(lambda: found.append(solver(**guess)), 2)
        stats = solver.stats()
        assert stats["success"], stats["return_status"]
    other = float(found[-1]["f"]) / ours.cost - 1
    return row | {"ipopt steps": stats["iter_count"], "other": other}


def _seconds(work: Callable[[], object], runs: int) -> float:
    """The least processor time of some runs, in [s]."""
    times = []
    for _ in range(runs):
        began = time.process_time()
        work()
        times.append(time.process_time() - began)
    return min(times)


def _problem(
    robot: hovi.Robot, effects: list[Effect], start: list[float], goal: list[float]
) -> hovi.TrajectoryProblem:
    scene = hovi.Scene(robot, [hovi.effects.Gravity(), *effects])
    grid = hovi.Grid.uniform(1.0, INTERVALS, hovi.schemes.by_name(SCHEME))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    return hovi.TrajectoryProblem(ld, hovi.State(start), hovi.State(goal))


def _row(arm: str, cost: str, run: dict[str, float]) -> list[object]:
    other = run["other"]
    return [
        f"`{arm}`, {cost}",
        f"{run['steps']:.0f}, {run['ipopt steps']:.0f}",
        f"{1e3 * run['seconds']:.1f}",
        f"{1e3 * run['ipopt']:.1f}",
        f"{run['ipopt'] / run['seconds']:.1f}",
        f"{run['stays']:.0e}",
        f"{other:.0e}" if abs(other) < 1e-6 else f"another minimum, {100 * other:+.1f} %",
    ]


def main() -> None:
    compiled = "compiled" in sys.argv[1:]
    how = "compiled by gcc" if compiled else "interpreted by CasADi"
    print(f"`{SCHEME}`, {INTERVALS} intervals, one second, {how}, one thread, when warm.\n")
    rows = [_row(arm, cost, alone(measure, arm, cost, compiled)) for arm in ARMS for cost in COSTS]
    columns = [
        "robot, cost",
        "steps of hovi, Ipopt",
        "hovi, ms",
        "Ipopt, ms",
        "Ipopt's time / hovi's",
    ]
    columns += ["Ipopt from hovi's motion: change of cost", "from the cubic guess"]
    print_table(columns, rows)
    print_machine(threads=1)


if __name__ == "__main__":
    main()
