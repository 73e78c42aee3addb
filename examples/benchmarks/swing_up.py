"""The motions of the paper: solved as in their scenes, checked, and plotted for the README."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from measuring import print_machine, print_table
from scipy.integrate import solve_ivp

import hovi
from hovi.schemes import by_name
from hovi.viewing.plotting import angles_figure, plot_angles, plot_swept_surface

Array = npt.NDArray[np.float64]

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"
EXACT = ("galerkin-4", 400)
"""Scheme and intervals on which a minimum is converged to round-off."""
BETWEEN = np.array([0.2, 0.37, 0.5, 0.71, 0.9])


def solve(name: str, scheme: str = "", intervals: int = 0) -> tuple[hovi.Solution, float]:
    """The solution of a scene, optionally with another scheme and grid, and its time in [s]."""
    task = hovi.load_task(hovi.example(name))
    began = time.perf_counter()
    solution = hovi.plan_task(
        task,
        scheme=scheme or task.options.scheme,
        intervals=intervals or task.options.interval_count,
    )
    return solution, time.perf_counter() - began


def on_grid(motion: hovi.Solution, scheme: str, intervals: int) -> hovi.Solution:
    """The minimum approximated by a motion, on another grid."""
    scene, t = motion.trajectory.scene, motion.trajectory
    ends = hovi.State(t.q[0], t.v[0]), hovi.State(t.q[-1], t.v[-1])
    grid = hovi.Grid.uniform(t.duration, intervals, by_name(scheme))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    solution = hovi.solve(hovi.TrajectoryProblem(ld, *ends), t)
    assert solution.success, solution.message
    return solution


def errors(motion: hovi.Solution, exact: hovi.Solution) -> list[float]:
    """Errors of the cost (relative), of q and v at the nodes, of q, v and tau between them."""
    mine, true = motion.trajectory, exact.trajectory
    at_nodes = true.sample(mine.t)
    t = (mine.t[:-1, None] + mine.grid.steps[:, None] * BETWEEN).ravel()
    found, wanted = mine.sample(t), true.sample(t)
    pairs = [(mine.q, at_nodes.q), (mine.v, at_nodes.v)]
    pairs += [(found.q, wanted.q), (found.v, wanted.v), (found.tau, wanted.tau)]
    return [abs(motion.cost / exact.cost - 1), *(float(np.abs(x - y).max()) for x, y in pairs)]


def effort(trajectory: hovi.Trajectory) -> float:
    """1/2 integral |tau|^2 of the torque between the nodes, as `sample` gives it."""
    x, w = np.polynomial.legendre.leggauss(8)
    N = trajectory.grid.intervals
    tau = trajectory.sample_intervals(np.repeat(np.arange(N), 8), np.tile((x + 1) / 2, N)).tau
    weights = (trajectory.grid.steps[:, None] * w / 2).ravel()
    return float(0.5 * weights @ np.sum(tau**2, axis=1))


def replay_error(trajectory: hovi.Trajectory) -> float:
    """Largest deviation at the next node after integration by SciPy under tau(t), in [rad].

    The integration restarts at every node, since the motion is unstable.
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


def draw(swing_up: hovi.Trajectory, resolved: hovi.Trajectory, elbow: hovi.Trajectory) -> None:
    """Plot the paper's two figures, the torque, and the elbow's angle within its range."""
    IMAGES.mkdir(exist_ok=True)
    plot_angles(swing_up, IMAGES / "swing_up_angles.png")
    plot_swept_surface(swing_up, IMAGES / "swing_up_surface.png", window=(3.0, 6.0))
    hovi.plot(resolved, IMAGES / "swing_up_torque.png")
    figure = angles_figure(elbow)
    (axes,) = figure.axes
    axes.axhspan(0.0, 170.0, color="0.93", zorder=0)
    figure.savefig(IMAGES / "elbow_angles.png", dpi=150, metadata={"Software": None})


def print_solutions(runs: dict[str, tuple[hovi.Solution, float]]) -> None:
    """Print the solutions."""
    columns = ["motion", "scheme", "intervals", "cost", "n_neg", "minima found", "steps", "seconds"]
    rows = []
    for name, (solution, seconds) in runs.items():
        assert solution.success, solution.message
        grid = solution.trajectory.grid
        cells = [f"`{grid.schemes[0].name}`", grid.intervals, f"{solution.cost:.7f}"]
        cells += [solution.n_neg, len(solution.minima), solution.nit, f"{seconds:.1f}"]
        rows.append([name, *cells])
    print_table(columns, rows)


def print_accuracy(solutions: list[hovi.Solution]) -> None:
    """Print errors against the resolved minimum; one column per solution."""
    found = []
    for solution in solutions:
        motion = solution.trajectory
        cost, *absolute = (f"{x:.0e}" for x in errors(solution, on_grid(solution, *EXACT)))
        ratio = f"{effort(motion) / solution.cost:.4f}"
        found.append([cost, *absolute, ratio, f"{replay_error(motion):.0e}"])
    rows = ["cost, relative", "q at the nodes [rad]", "v at the nodes [rad/s]"]
    rows += ["q between them [rad]", "v between them [rad/s]", "tau between them [N m]"]
    rows += ["1/2 integral of the sampled tau^2 over the cost"]
    rows += ["next node when SciPy drives the arm with the sampled tau [rad]"]
    grids = [solution.trajectory.grid for solution in solutions]
    columns = ["error", *(f"`{g.schemes[0].name}`, N = {g.intervals}" for g in grids)]
    print_table(columns, list(zip(rows, *found, strict=True)))


def main() -> None:
    paper, seconds = solve("two_link_swing_up")
    began = time.perf_counter()
    resolved = on_grid(paper, "galerkin-2", 200)
    runs = {
        "swing-up, the paper's scheme": (paper, seconds),
        "the same, refined from it": (resolved, time.perf_counter() - began),
        "swing-up, Galerkin": solve("two_link_swing_up", "galerkin-2", 100),
        "elbow kept in 0 to 170 degrees": solve("two_link_elbow"),
    }
    elbow = runs["elbow kept in 0 to 170 degrees"][0]
    draw(paper.trajectory, resolved.trajectory, elbow.trajectory)
    print_solutions(runs)
    angle = np.degrees(elbow.trajectory.sample(np.linspace(0.0, 10.0, 20_001)).q[:, 1])
    peak = np.abs(resolved.trajectory.sample(np.linspace(0.0, 10.0, 20_001)).tau).max()
    print(
        f"The kept elbow moves between {angle.min():.2f} and {angle.max():.2f} degrees. The "
        f"refined swing-up's largest torque is {peak:.3f} N m. Errors against the same minimum "
        "resolved to round-off:\n"
    )
    print_accuracy([paper, resolved])
    print_machine()


if __name__ == "__main__":
    main()
