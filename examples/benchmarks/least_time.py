"""Nearly least time by hovi, and TOPP-RA's least time on the same path (`pip install toppra`).

hovi minimises T + w/2 integral |tau|^2 with a small w within bounds on v and tau, and finds the
path as well; TOPP-RA, which is given that path, minimises T alone.
"""

from __future__ import annotations

import logging
import time

import numpy as np
import numpy.typing as npt
import toppra
from measuring import alone, print_machine, print_table
from toppra.algorithm import TOPPRA
from toppra.constraint import DiscretizationType, JointTorqueConstraint, JointVelocityConstraint

import hovi
from hovi.effects import EffortWeight, Gravity

Array = npt.NDArray[np.float64]

CASES = {
    "two_link": (
        *(hovi.example("two_link.urdf"), [0.0, 0.0], [1.2, 0.6]),
        *([5.0, 5.0], [25.0, 10.0], 1e-4),
    ),
    "ur5": (
        *("ur5", [0.0, -1.2, 1.2, 0.0, 0.3, 0.0], [0.8, -0.9, 0.7, 0.4, 0.5, 1.0]),
        *([2.0] * 6, [100.0, 100.0, 60.0, 15.0, 15.0, 15.0], 1e-5),
    ),
}
"""Robot, start, goal, bounds on v [rad/s] and on tau [N m], weight of the squared torque."""
INTERVALS = 16
TIME_LIMIT = 100.0
PATH_POINTS = 401
GRIDS = 1001, 4001


def measure(name: str) -> list[float]:
    """hovi's duration and time of computing, and TOPP-RA's durations on the grids, in [s]."""
    source, start, goal, v, tau, weight = CASES[name]
    scene = hovi.Scene(hovi.load_robot(source), [Gravity(), EffortWeight(weight)])
    began = time.perf_counter()
    found = hovi.plan(
        *(scene, start, goal, (0.1, 3.0)),
        **{"time_weight": 1.0, "intervals": INTERVALS, "processes": 1, "time_limit": TIME_LIMIT},
        limits={"base": "none", "v": v, "tau": tau},
        self_collision=False,
    )
    seconds = time.perf_counter() - began
    path = _path(found.trajectory)
    times = [least_time(scene, path, np.array(v), np.array(tau), grid) for grid in GRIDS]
    return [found.trajectory.duration, seconds, *times]


def least_time(
    scene: hovi.Scene, path: toppra.SplineInterpolator, v: Array, tau: Array, grid: int
) -> float:
    """TOPP-RA's duration between bounds -v .. v and -tau .. tau."""
    logging.getLogger("toppra").setLevel(logging.ERROR)

    def torque(q: Array, v: Array, a: Array) -> Array:
        return scene.inverse_dynamics(q[None], v[None], a[None])[0]

    held = JointTorqueConstraint(
        torque,
        np.stack([-tau, tau], axis=1),
        np.zeros(len(tau)),
        discretization_scheme=DiscretizationType.Interpolation,
    )
    constraints = [JointVelocityConstraint(np.stack([-v, v], axis=1)), held]
    method = TOPPRA(constraints, path, gridpoints=np.linspace(0, 1, grid), solver_wrapper="seidel")
    return float(method.compute_trajectory(0, 0).duration)


def _path(motion: hovi.Trajectory) -> toppra.SplineInterpolator:
    """The path of a motion by its arc length."""
    q = motion.sample(np.linspace(0.0, motion.duration, 20_001)).q
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
    s = np.linspace(0.0, 1.0, PATH_POINTS)
    return toppra.SplineInterpolator(
        s, np.stack([np.interp(s, arc / arc[-1], column) for column in q.T], axis=1)
    )


def main() -> None:
    rows = []
    for name in CASES:
        T, seconds, *times = alone(measure, name)
        rows.append([f"`{name}`", f"{T:.5f}", f"{seconds:.0f}", *(f"{each:.5f}" for each in times)])
    grids = [f"TOPP-RA, {grid} points: s" for grid in GRIDS]
    print_table(["robot", "hovi: s", "to find it, s", *grids], rows)
    print_machine(threads=1)


if __name__ == "__main__":
    main()
