"""Time per quadrature point where configurations are no vectors, beside ordinary joints.

Of RNEA's kernel alone, and of the discrete Lagrangian with the charts of its intervals.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from measuring import alone, best_time, print_machine, print_table

import hovi
from hovi.rigid_body import InverseDynamicsKernel
from hovi.solver import guess_path

INTERVALS = (16, 256)


def robots(name: str) -> hovi.Robot:
    """Kinova as it is and with revolute joints; a free-flyer with three joints; nine joints."""
    if name == "kinova":
        return hovi.load_robot("kinova")
    if name == "kinova, revolute":
        return hovi.load_robot(_revolute(hovi.load_robot("kinova").model))
    base = [pin.JointModelFreeFlyer()] if name == "free-flyer, 3 joints" else []
    return hovi.load_robot(_chain([*base, *[pin.JointModelRX()] * (3 if base else 9)]))


def _revolute(model: pin.Model) -> pin.Model:
    twin = pin.Model()
    twin.name = "revolute"
    for i in range(1, model.njoints):
        joint = pin.JointModelRZ() if model.joints[i].nq == 2 else model.joints[i]  # RUBZ in Kinova
        twin.addJoint(model.parents[i], joint, model.jointPlacements[i], str(model.names[i]))
        twin.appendBodyToJoint(i, model.inertias[i], pin.SE3.Identity())
    return twin


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


def measure(name: str, intervals: int) -> tuple[float, ...]:
    """Microseconds per point of the kernel, of the action's expansion and of the action."""
    robot = robots(name)
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    lagrangian = scene.effort_lagrangian()
    grid = hovi.Grid.uniform(2.0, intervals, hovi.schemes.galerkin(2))
    ld = hovi.DiscreteLagrangian(lagrangian, grid)
    start = robot.neutral()
    goal = robot.integrate(start, np.full(robot.nv, 0.3))
    path = guess_path(hovi.TrajectoryProblem(ld, hovi.State(start), hovi.State(goal)), "cubic")
    points = 4 * intervals
    kernel = InverseDynamicsKernel(scene.model)
    d, v, a, curvature = np.random.default_rng(0).uniform(-1, 1, (4, points, robot.nv))
    q, weight = robot.integrate(start, d), np.ones(robot.nv)
    work = (
        lambda: kernel.expand(q, v, a, weight, curvature),
        lambda: ld.expand(path),
        lambda: ld.action(path),
    )
    return tuple(1e6 * best_time(each) / points for each in work)


def main() -> None:
    """One table."""
    print("Microseconds per quadrature point, `galerkin-2`, one thread.\n")
    rows = []
    for N in INTERVALS:
        names = ("kinova, revolute", "kinova", "nine joints", "free-flyer, 3 joints")
        for name in names:
            kernel, expand, action = alone(measure, name, N)
            rows.append([name, N, f"{kernel:.2f}", f"{expand:.1f}", f"{action:.2f}"])
    print_table(["robot", "N", "kernel alone", "value, gradient, Hessian", "value"], rows)
    print_machine()


if __name__ == "__main__":
    main()
