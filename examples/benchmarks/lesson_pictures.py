"""The pictures of the lessons, from what their code plans; those of motions in a headless Chromium.

python lesson_pictures.py            all of them
python lesson_pictures.py 1_ 4_      those of the lessons that begin so
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import chdir
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pictures import IMAGES, TOP, page, seek
from PIL import Image

import hovi
from oracles.documents import script

LESSONS = TOP / "docs" / "lessons"
INSTANT = (400, 340)
"""Size of one of the instants that stand side by side, in pixels."""


def names_of(lesson: Path, folder: str) -> dict[str, Any]:
    """What the code of a lesson defines, after it has run in a folder."""
    names: dict[str, Any] = {}
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    with chdir(folder):
        exec(compile(script(lesson), lesson.name, "exec"), names)
    return names


def instants(motion: hovi.Trajectory, times: Sequence[float], name: str) -> None:
    """The scene alone at some times, from left to right."""
    with page(INSTANT, motion) as tab:
        tab.value("document.body.classList.add('bare'); stage.resize(); 1")
        frames = []
        for t in times:
            seek(tab, t)
            frames.append(Image.fromarray(tab.screenshot().astype("uint8")))
    width, height = INSTANT
    row = Image.new("RGB", (width * len(frames), height))
    for k, frame in enumerate(frames):
        row.paste(frame, (k * width, 0))
    row.save(IMAGES / name, optimize=True)


def first_motion(names: dict[str, Any], folder: str) -> None:
    instants(names["solution"].trajectory, (0.0, 0.6, 1.5), "lesson_first_motion.png")


def your_own_robot(names: dict[str, Any], folder: str) -> None:
    instants(names["reach"].trajectory, (0.0, 0.6, 1.2), "lesson_your_own_robot.png")


def pick(names: dict[str, Any], folder: str) -> None:
    instants(names["bring"].trajectory, (0.0, 1.2, 2.4), "lesson_pick.png")


def accuracy(names: dict[str, Any], folder: str) -> None:
    """Estimated and true errors of the cost against the tolerance, with the points of each."""
    plans, truth = names["plans"].values(), names["truth"]
    points = [plan.accuracy.rounds[-1].points for plan in plans]
    true = [abs(plan.cost / truth.cost - 1) for plan in plans]
    figure = Figure(figsize=(7.0, 3.6), layout="constrained")
    ax = figure.subplots()
    asked, estimated = list(names["plans"]), [plan.error_estimate for plan in plans]
    ax.loglog(asked, asked, color="0.6", label="tolerance")
    ax.loglog(asked, true, "o-", color="#0072b2", label="true error")
    ax.loglog(asked, estimated, "x--", color="#d55e00", label="estimated")
    for x, y, count in zip(asked, true, points, strict=True):
        ax.annotate(f"{count} points", (x, y), (-4, -16), textcoords="offset points", ha="right")
    ax.set(xlabel="tolerance", ylabel="error of the cost, relative")
    ax.set_xlim(2e-1, 2e-9)
    ax.set_yticks(10.0 ** np.arange(-12, 0, 2))
    ax.spines[["top", "right"]].set_visible(False)
    ax.grid(axis="y", alpha=0.3)
    ax.legend(frameon=False)
    figure.savefig(IMAGES / "lesson_accuracy.png", dpi=110)


def effects(names: dict[str, Any], folder: str) -> None:
    """The picture that `hovi effects` draws in the lesson, in few colors."""
    with Image.open(Path(folder) / "effects.png") as drawn:
        drawn.convert("RGB").quantize(32).save(IMAGES / "lesson_effects.png", optimize=True)


PICTURES: dict[str, Callable[[dict[str, Any], str], None]] = {
    "1_first_motion": first_motion,
    "2_your_own_robot": your_own_robot,
    "3_pick_around_a_table": pick,
    "4_what_accuracy_costs": accuracy,
    "5_what_the_scene_leaves_out": effects,
}


def main() -> None:
    chosen = tuple(sys.argv[1:])
    for lesson, draw in PICTURES.items():
        if not chosen or lesson.startswith(chosen):
            with tempfile.TemporaryDirectory() as folder:
                draw(names_of(LESSONS / f"{lesson}.md", folder), folder)
            print(f"drew the picture of {lesson}")


if __name__ == "__main__":
    main()
