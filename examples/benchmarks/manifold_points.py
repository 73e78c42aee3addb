"""Time per quadrature point where configurations are no vectors, beside ordinary joints."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from measuring import alone, best_time, print_machine, print_table

import hovi
from hovi.solver import guess_path
from hovi.twin_kernel import twin_model

INTERVALS = (16, 256)


def robots(name: str) -> hovi.Robot:
    """Kinova as it is and with revolute joints; a free-flyer with three joints; nine joints."""
    if name == "kinova":
        return hovi.load_robot("kinova")
    if name == "kinova, revolute":
        model = twin_model(hovi.load_robot("kinova").model)
        model.name = "revolute"
        return hovi.load_robot(model)
    base = [pin.JointModelFreeFlyer()] if name == "free-flyer, 3 joints" else []
    return hovi.load_robot(_chain([*base, *[pin.JointModelRX()] * (3 if base else 9)]))


def _chain(joints: list[pin.JointModel]) -> pin.Model:
    model, parent = pin.Model(), 0
    model.name = "chain"
    for i, joint in enumerate(joints):
        turn = pin.exp3(np.array([0.3 * i, 0.5, 0.2]))
        place = pin.SE3(turn, np.array([0.0, 0.0, 0.4]))
        parent = model.addJoint(parent, joint, place, f"j{i}")
        model.appendBodyToJoint(parent, pin.Inertia.FromSphere(1.0, 0.3), pin.SE3.Identity())
        frame = pin.Frame(f"b{i}", parent, 0, pin.SE3.Identity(), pin.FrameType.BODY)
        model.addFrame(frame)
    return model


def measure(name: str, intervals: int) -> tuple[float, float]:
    """Microseconds per point of the expansion and of the action."""
    robot = robots(name)
    lagrangian = hovi.Scene(robot, [hovi.effects.Gravity()]).effort_lagrangian()
    grid = hovi.Grid.uniform(2.0, intervals, hovi.schemes.galerkin(2))
    ld = hovi.DiscreteLagrangian(lagrangian, grid)
    start = robot.neutral()
    goal = robot.integrate(start, np.full(robot.nv, 0.3))
    path = guess_path(hovi.TrajectoryProblem(ld, hovi.State(start), hovi.State(goal)), "cubic")
    points = 4 * intervals
    expand, action = best_time(lambda: ld.expand(path)), best_time(lambda: ld.action(path))
    return 1e6 * expand / points, 1e6 * action / points


def main() -> None:
    """One table."""
    print("Microseconds per quadrature point, `galerkin-2`, one thread.\n")
    rows = []
    for N in INTERVALS:
        names = ("kinova, revolute", "kinova", "nine joints", "free-flyer, 3 joints")
        for name in names:
            expand, action = alone(measure, name, N)
            rows.append([name, N, f"{expand:.1f}", f"{action:.2f}"])
    print_table(["robot", "N", "value, gradient, Hessian", "value"], rows)
    print_machine()


if __name__ == "__main__":
    main()
