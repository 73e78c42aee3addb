"""The paper's motions: solved as their scenes say, checked, and drawn for the README and the docs."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.integrate import solve_ivp

import hovi
from hovi.plotting import angles_figure, plot_angles, plot_swept_surface
from hovi.schemes import by_name
from measuring import print_machine, print_table

Array = npt.NDArray[np.float64]

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"
EXACT = ("galerkin-4", 400)
"""A grid on which the same minimum is converged to round-off."""
BETWEEN = np.array([0.2, 0.37, 0.5, 0.71, 0.9])


def solve(name: str, scheme: str = "", intervals: int = 0) -> tuple[hovi.Solution, float]:
    """The scene's own solution, or with another scheme and grid; and the seconds it took."""
    task = hovi.load_task(hovi.example(name))
    began = time.perf_counter()
    solution = hovi.plan(
        task.scene,
        task.start,
        task.goal,
        task.duration,
        scheme=scheme or task.scheme,
        intervals=intervals or task.intervals,
        starts=task.starts,
        seed=task.seed,
    )
    return solution, time.perf_counter() - began


def same_minimum(motion: hovi.Solution) -> hovi.Solution:
    """The minimum that a motion approximates, on a grid that resolves it."""
    scene, t = motion.trajectory.scene, motion.trajectory
    ends = hovi.State(t.q[0], t.v[0]), hovi.State(t.q[-1], t.v[-1])
    grid = hovi.Grid.uniform(t.duration, EXACT[1], by_name(EXACT[0]))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    solution = hovi.solve(hovi.TrajectoryProblem(ld, *ends), t)
    assert solution.success, solution.message
    return solution


def errors(motion: hovi.Solution, exact: hovi.Solution) -> list[float]:
    """Cost (relative), q and v at the nodes, then q, v and tau at five places of each interval."""
    mine, true = motion.trajectory, exact.trajectory
    at_nodes = true.sample(mine.t)
    t = (mine.t[:-1, None] + mine.grid.steps[:, None] * BETWEEN).ravel()
    found, wanted = mine.sample(t), true.sample(t)
    pairs = [(mine.q, at_nodes.q), (mine.v, at_nodes.v)]
    pairs += [(found.q, wanted.q), (found.v, wanted.v), (found.tau, wanted.tau)]
    return [abs(motion.cost / exact.cost - 1), *(float(np.abs(x - y).max()) for x, y in pairs)]


def replay_error(trajectory: hovi.Trajectory) -> float:
    """How far from its next node the arm is when SciPy drives it from each node with tau(t).

    The motion is unstable, so the integration starts again at every node. In [rad].
    """
    model = trajectory.scene.model
    data, n = model.createData(), model.nv

    def rhs(t: float, x: Array) -> Array:
        tau = trajectory.sample(t).tau[0]
        return np.concatenate([x[n:], pin.aba(model, data, x[:n], x[n:], tau)])

    worst = 0.0
    for k in range(trajectory.grid.intervals):
        ends = trajectory.t[k], np.nextafter(trajectory.t[k + 1], 0.0)
        x0 = np.concatenate([trajectory.q[k], trajectory.v[k]])
        x1 = solve_ivp(rhs, ends, x0, method="DOP853", rtol=1e-8, atol=1e-10).y[:n, -1]
        worst = max(worst, float(np.abs(x1 - trajectory.q[k + 1]).max()))
    return worst


def draw(swing_up: hovi.Trajectory, elbow: hovi.Trajectory) -> None:
    """The paper's two figures, and the elbow's angles within their range."""
    IMAGES.mkdir(exist_ok=True)
    plot_angles(swing_up, IMAGES / "swing_up_angles.png")
    plot_swept_surface(swing_up, IMAGES / "swing_up_surface.png", window=(3.0, 6.0))
    figure = angles_figure(elbow)
    (axes,) = figure.axes
    axes.axhspan(0.0, 170.0, color="0.93", zorder=0)
    figure.savefig(IMAGES / "elbow_angles.png", dpi=150, metadata={"Software": None})


def main() -> None:
    runs = {
        "the paper's scheme": solve("two_link_swing_up"),
        "Galerkin": solve("two_link_swing_up", "galerkin-2", 100),
        "elbow kept in [0, 170] degrees": solve("two_link_elbow"),
    }
    (swing_up, _), (galerkin, _), (elbow, _) = runs.values()
    draw(swing_up.trajectory, elbow.trajectory)
    columns = ["motion", "scheme", "intervals", "cost", "n_neg", "status", "minima", "seconds"]
    rows = []
    for name, (solution, seconds) in runs.items():
        assert solution.success, solution.message
        grid = solution.trajectory.grid
        rows.append(
            [name, f"`{grid.schemes[0].name}`", grid.intervals, f"{solution.cost:.7f}"]
            + [solution.n_neg, solution.status, len(solution.minima), f"{seconds:.0f}"]
        )
    print_table(columns, rows)
    angle = np.degrees(elbow.trajectory.sample(np.linspace(0.0, 10.0, 20_001)).q[:, 1])
    print(f"The kept elbow moves between {angle.min():.2f} and {angle.max():.2f} degrees.\n")
    print("How accurate the two swing-ups are, against the same minimum resolved to round-off:\n")
    rows = []
    for solution in (swing_up, galerkin):
        cost, *absolute = errors(solution, same_minimum(solution))
        found = [f"{error:.0e}" for error in (cost, *absolute)]
        name = solution.trajectory.grid.schemes[0].name
        rows.append([f"`{name}`", *found, f"{replay_error(solution.trajectory):.0e}"])
    columns = ["scheme", "cost (relative)", "q at nodes [rad]", "v at nodes [rad/s]"]
    columns += ["q between [rad]", "v between [rad/s]", "tau between [N m]"]
    print_table([*columns, "SciPy's replay, node to node [rad]"], rows)
    print_machine()


if __name__ == "__main__":
    main()
