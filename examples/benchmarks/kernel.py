"""The evaluation of one point: tau, J and the Hessian of 1/2 |tau|^2.

Against Pinocchio's own two calls in C++ (first and second derivatives of RNEA, without the
products that a Hessian needs), and against CasADi's interpreter.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from measuring import alone, best_time, print_machine, print_table

import hovi
from hovi.dynamics.extension import archive
from hovi.dynamics.inverse_dynamics_kernel import InverseDynamicsKernel
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.dynamics.torque_model import CasadiTorque

try:
    import hovi_benchmarks
except ImportError as error:
    raise SystemExit(
        "Pinocchio's own derivatives are not compiled: run `pip install -C "
        "cmake.define.HOVI_BENCHMARKS=ON .` in hovi's folder."
    ) from error

ROBOTS = {
    "UR5": ("ur5", ()),
    "Panda": ("panda", ("panda_finger_joint1", "panda_finger_joint2")),
    "Talos": ("talos", ()),
}
POINTS = 256


def measure(robot: str, threads: int) -> dict[str, float]:
    """Time per point in microseconds, the shortest of many runs over a batch."""
    name, locked = ROBOTS[robot]
    model = hovi.load_robot(name, locked=locked, free_flyer=False).model
    kernel = InverseDynamicsKernel(model)
    n = model.nv
    q, v, a = np.random.default_rng(0).uniform(-1, 1, (3, POINTS, n))
    weight = np.ones(n)
    curvature = weight * kernel.torque(q, v, a)
    ours = best_time(lambda: kernel.expand(q, v, a, weight, curvature, threads), seconds=1.0)
    result = {"n": n, "hovi": 1e6 * ours / POINTS}
    text = archive(model)
    yardsticks = [hovi_benchmarks.time_pinocchio_calls(text, q, v, a, 4) for _ in range(20)]
    result["Pinocchio"] = 1e6 * min(yardsticks)
    if threads == 1:
        result |= _casadi(model, kernel, (q[:64], v[:64], a[:64]))
    return result


def _casadi(model: object, kernel: InverseDynamicsKernel, jet: tuple) -> dict[str, float]:
    n = kernel.n
    symbols = (*(ca.SX.sym(name, n) for name in "qva"), ca.SX.sym("t"))
    tau = casadi_functions(model).inverse_dynamics(*symbols[:3])
    interpreted = CasadiTorque(symbols, tau)
    weight = np.ones(n)
    work = best_time(lambda: interpreted.expand(*jet, None, weight, None), seconds=1.0)
    theirs = interpreted.expand(*jet, None, weight, None)
    ours = kernel.expand(*jet, weight, kernel.torque(*jet))
    errors = [np.max(abs(x - y)) / np.max(abs(x)) for x, y in zip(theirs, ours, strict=True)]
    return {"CasADi": 1e6 * work / len(jet[0]), "difference": float(max(errors))}


def main() -> None:
    columns = ["robot", "n", "Pinocchio's calls [us]", "kernel [us]", "ratio"]
    columns += ["2 threads [us]", "CasADi [us]", "CasADi / kernel", "largest difference"]
    rows = []
    for robot in ROBOTS:
        one, two = (alone(measure, robot, threads, threads=threads) for threads in (1, 2))
        rows.append(
            [
                robot,
                one["n"],
                f"{one['Pinocchio']:.1f}",
                f"{one['hovi']:.1f}",
                f"{one['hovi'] / one['Pinocchio']:.2f}",
                f"{two['hovi']:.1f}",
                f"{one['CasADi']:.0f}",
                f"{one['CasADi'] / one['hovi']:.0f}",
                f"{one['difference']:.0e}",
            ]
        )
    print("Microseconds per point of a batch, the shortest of many runs.\n")
    print_table(columns, rows)
    print_machine()


if __name__ == "__main__":
    main()
