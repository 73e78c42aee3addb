"""The figure of docs/tolerance.md: intervals chosen by a tolerance along two motions."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import hovi
from hovi import Solution

IMAGE = Path(__file__).resolve().parents[2] / "docs" / "images" / "interval_lengths.png"
TOLERANCE = 1e-7
BLUE, ORANGE = "#0072b2", "#d55e00"


def swing_up() -> Solution:
    """From hanging to upright: smooth, with sharp turns."""
    task = hovi.load_task(hovi.example("two_link_swing_up"))
    ends = task.scene, task.start, task.goal, task.duration
    guess = hovi.plan(*ends, limits="none", intervals=60).trajectory
    return hovi.plan(*ends, limits="none", intervals=24, guess=guess, tolerance=TOLERANCE)


def elbow() -> Solution:
    """The same with an elbow kept in its range by a potential with two kinks, 1e-3 rad wide."""
    task = hovi.load_task(hovi.example("two_link_elbow"))
    ends = task.scene, task.start, task.goal, task.duration
    return hovi.plan(*ends, limits="none", intervals=60, starts=8, tolerance=TOLERANCE)


def draw(column: np.ndarray, solution: Solution, values: str, title: str) -> None:
    """A motion above the lengths of its intervals."""
    motion, grid = solution.trajectory, solution.trajectory.grid
    t = np.linspace(0.0, motion.duration, 4001)
    sample = motion.sample(t)
    above, below = column
    if values == "a":
        above.plot(t, np.linalg.norm(sample.a, axis=1), color=BLUE)
        above.set_ylabel("|a| [rad/s²]")
    else:
        above.plot(t, np.rad2deg(sample.q[:, 1]), color=BLUE)
        for bound in (0.0, 170.0):
            above.axhline(bound, color="0.6", linewidth=0.8)
        above.set_ylabel("elbow [degrees]")
    above.set_title(f"{title}: {grid.intervals} intervals", fontsize=10)
    below.set_yscale("log")
    below.step(grid.t, np.append(grid.steps, grid.steps[-1]), where="post", color=BLUE)
    below.set_ylabel("length [s]", color=BLUE)
    below.set_xlabel("t [s]")
    modes = np.array([scheme.inner_modes for scheme in grid.schemes])
    right = below.twinx()
    right.plot(grid.t[:-1] + grid.steps / 2, modes, ".", markersize=4, color=ORANGE)
    right.set_ylabel("inner modes", color=ORANGE)
    right.set_ylim(0, modes.max() + 1)


def main() -> None:
    figure, axes = plt.subplots(2, 2, figsize=(10, 5.2), sharex="col", layout="constrained")
    for column, (solution, values, title) in zip(
        axes.T,
        ((swing_up(), "a", "swing-up"), (elbow(), "q", "elbow kept in 0 to 170°")),
        strict=True,
    ):
        print(f"{title}: {solution.message}")
        draw(column, solution, values, title)
    figure.savefig(IMAGE, dpi=110)


if __name__ == "__main__":
    main()
