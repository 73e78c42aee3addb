"""Problems within limits that have no motion: the time to say so, against one that has a motion.

Both are solved on 16 intervals, without the comparison with a finer grid that follows a minimum.
That there is no motion follows from the start, the mean velocity, the torques that hold the ends,
the work that the torques can do, or the time that a bounded acceleration needs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from measuring import alone, print_machine, print_table
from random_arms import timed

import hovi
from hovi.planning.solver.solver import solve_on_grid

UR5 = "ur5_reach_limited"
SCHEME, INTERVALS = "galerkin-2", 16
REPEATS = 2


def reach(
    duration: float | None = None, goal: object = None, **bounds: object
) -> hovi.TrajectoryProblem:
    """The reach of the UR5 with another duration or goal, and with other bounds besides."""
    task = hovi.load_task(hovi.example(UR5))
    own = {"base": "urdf", "v": 3.14, "tau": [150.0] * 3 + [28.0] * 3}
    end = task.goal if goal is None else hovi.State(goal)
    return _problem(task.scene, task.start, end, duration or task.duration, own | bounds)


def arm(start: float, goal: float, **bounds: object) -> hovi.TrajectoryProblem:
    """The two-link arm, nearly stretched, from one angle of the shoulder to another in 1.5 s.

    It may not go beyond its ends by more than 0.05 rad, and so has no room to swing.
    """
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity()])
    low, high = sorted((start, goal))
    ends = [hovi.State([angle, 0.0]) for angle in (start, goal)]
    q = [[low - 0.05, high + 0.05], [-0.05, 0.05]]
    return _problem(scene, *ends, 1.5, {"base": "none", "q": q} | bounds)


def _problem(
    scene: hovi.Scene,
    start: hovi.State,
    goal: hovi.State,
    duration: float,
    limits: Mapping[str, object],
) -> hovi.TrajectoryProblem:
    grid = hovi.Grid.uniform(duration, INTERVALS, hovi.schemes.by_name(SCHEME))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    bounds = hovi.as_limits(scene.robot, limits)
    return hovi.TrajectoryProblem(ld, start, goal, limits=bounds)


def holding_torque() -> float:
    """The torque that holds the shoulder of the stretched two-link arm, horizontal, in [N m]."""
    scene, zero = arm(0.0, 0.1).scene, np.zeros((1, 2))
    return float(scene.inverse_dynamics(zero, zero, zero)[0, 0])


def cases() -> dict[str, tuple[Callable[[], object], Callable[[], object]]]:
    """By name: a problem without a motion, and one like it that has one.

    Lifted from -1.2 to 1.2 rad, the arm gains 2 sin(1.2) = 1.86 in units of its holding torque, and
    0.6 of it does a work of 0.6 * 2.4 = 1.44. From rest to rest over d = 1.2 rad in T = 1.5 s, the
    acceleration has to reach 4 d / T^2 = 2.13 rad/s^2 and the velocity 0.8 rad/s.
    """
    G, outside = holding_torque(), [7.0, -0.6, 0.4, 0.7, -0.8, 1.0]
    weak = {"tau": [20.0] * 3 + [5.0] * 3}
    return {
        "UR5, goal outside": (lambda: reach(goal=outside), reach),
        "UR5, 0.3 s, less than the velocities take": (lambda: reach(0.3), reach),
        "UR5, 0.39 s, less than the torques take": (lambda: reach(0.39), lambda: reach(0.8)),
        "UR5, torques that do not hold it": (lambda: reach(**weak), reach),
        "UR5, velocities of 0.801 rad/s": (lambda: reach(v=0.801), lambda: reach(v=1.0)),
        "UR5, accelerations of 2 rad/s²": (lambda: reach(a=2.0), lambda: reach(a=8.0)),
        "two links, held by half the torque": (
            lambda: arm(0.0, 0.0, tau=0.5 * G),
            lambda: arm(0.0, 0.0, tau=1.5 * G),
        ),
        "two links, too heavy in the middle": (
            lambda: arm(-1.2, 1.2, tau=0.6 * G),
            lambda: arm(-1.2, 1.2, tau=3.0 * G),
        ),
    }


def measure(name: str) -> list[str]:
    """A row of the table: processor times of both, status and reason."""
    bad, good = (make() for make in cases()[name])
    feasible = solve_on_grid(good)
    assert feasible.success, feasible.message
    runs = [timed(lambda: solve_on_grid(bad)) for _ in range(REPEATS)]
    other = min(timed(lambda: solve_on_grid(good))[0] for _ in range(REPEATS))
    seconds, found = min(runs, key=lambda run: run[0])
    numbers = [f"{1e3 * seconds:.3g}", f"{1e3 * other:.3g}", f"{seconds / other:.2g}"]
    return [name, *numbers, str(found.nit), str(feasible.nit), str(found.status), found.message]


def print_cases() -> None:
    """Print the table, and the reasons."""
    rows = [alone(measure, name) for name in cases()]
    columns = ["problem", "CPU ms", "of a feasible one", "ratio", "steps", "of the feasible one"]
    print_table([*columns, "status"], [row[:-1] for row in rows])
    print("\n".join(f"- {name}: {message}" for name, *_, message in rows) + "\n")


def main() -> None:
    """Print the table."""
    print_cases()
    print_machine(threads=1)


if __name__ == "__main__":
    main()
