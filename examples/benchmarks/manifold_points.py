"""Time per quadrature point of robots on Lie groups, compared with robots of ordinary joints.

Times are of RNEA's kernel alone, and of the discrete Lagrangian with the charts of its intervals.
The two robots of a comparison are timed in turns, so that other load affects both alike.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pinocchio as pin
from measuring import alone, print_machine, print_table

import hovi
from hovi.dynamics.inverse_dynamics_kernel import InverseDynamicsKernel
from hovi.planning.solver.solver import guess_path

INTERVALS = (16, 256)
COMPARED = {"kinova": "kinova, revolute", "free-flyer, 3 joints": "nine joints"}
"""Robots on groups, and the robots of ordinary joints that they are compared with."""
ROUNDS, SECONDS = 5, 0.5


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
        joint = model.joints[i]
        if joint.nq == 2:
            if joint.shortname() != "JointModelRUBZ":
                raise ValueError(f"{model.names[i]} is {joint.shortname()}, no turn about z.")
            joint = pin.JointModelRZ()
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


def works(name: str, intervals: int) -> tuple[Callable[[], object], ...]:
    """The kernel at all points of a motion, the action's expansion and the action."""
    robot = robots(name)
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    lagrangian = scene.effort_lagrangian()
    grid = hovi.Grid.uniform(2.0, intervals, hovi.schemes.galerkin(2))
    ld = hovi.DiscreteLagrangian(lagrangian, grid)
    start = robot.neutral()
    goal = robot.integrate(start, np.full(robot.nv, 0.3))
    path = guess_path(hovi.TrajectoryProblem(ld, hovi.State(start), hovi.State(goal)), "cubic")
    kernel = InverseDynamicsKernel(scene.model)
    d, v, a, curvature = np.random.default_rng(0).uniform(-1, 1, (4, 4 * intervals, robot.nv))
    q, weight = robot.integrate(start, d), np.ones(robot.nv)
    return (
        lambda: kernel.expand(q, v, a, weight, curvature),
        lambda: ld.expand(path),
        lambda: ld.action(path),
    )


def measure(names: tuple[str, ...], intervals: int) -> list[list[list[float]]]:
    """Time per point in microseconds of each function and round: (functions, robots, rounds)."""
    by_robot = [works(name, intervals) for name in names]
    return [
        list(zip(*(by_turns(pair) for _ in range(ROUNDS)), strict=True))
        for pair in zip(*by_robot, strict=True)
    ]


def by_turns(pair: tuple[Callable[[], object], ...]) -> list[float]:
    """The shortest processor time of each in one round, taken in turns, in [s]."""
    times: list[list[float]] = [[] for _ in pair]
    while sum(map(sum, times)) < SECONDS or len(times[0]) < 3:
        for work, found in zip(pair, times, strict=True):
            began = time.process_time()
            work()
            found.append(time.process_time() - began)
    return [min(found) for found in times]


def rows_of(name: str, intervals: int) -> list[list[object]]:
    """A row for the robot of ordinary joints, and one for the other with the ratios of times."""
    names = COMPARED[name], name
    first: list[object] = [names[0], intervals]
    second: list[object] = [names[1], intervals]
    for digits, work in zip((2, 1, 2), alone(measure, names, intervals), strict=True):
        per_point = 1e6 * np.array(work) / (4 * intervals)  # (robots, rounds)
        compared, own = np.median(per_point, axis=1)
        factors = np.sort(per_point[1] / per_point[0])
        first.append(f"{compared:.{digits}f}")
        middle = f"{np.median(factors):.1f}"
        spread = f"{factors[0]:.1f} to {factors[-1]:.1f}"
        second.append(f"{own:.{digits}f} ({middle} times; {spread})")
    return [first, second]


def main() -> None:
    """Print the table."""
    print(
        "Microseconds of processor time per quadrature point, `galerkin-2`, one thread: medians of "
        f"{ROUNDS} rounds, and how many times those of the row above, with the rounds' range.\n"
    )
    rows = [row for N in INTERVALS for name in COMPARED for row in rows_of(name, N)]
    print_table(["robot", "N", "kernel alone", "value, gradient, Hessian", "value"], rows)
    print_machine()


if __name__ == "__main__":
    main()
