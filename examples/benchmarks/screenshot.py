"""The screenshot of the replay page in the README: a Panda's motion in a headless Chromium."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

import hovi

PICTURE = Path(__file__).resolve().parents[2] / "docs" / "images" / "replay.png"
FLAGS = (
    "--headless --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader --hide-scrollbars "
    "--disable-dev-shm-usage --window-size=900,560 --virtual-time-budget=1200"
)


def main() -> None:
    task = hovi.load_task(hovi.example("panda_reach_limited"))
    solution = hovi.plan(
        task.scene, task.start, task.goal, task.duration, limits=task.options.limits
    )
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "panda.html"
        hovi.replay(solution.trajectory, html=page)
        command = ["chromium", *FLAGS.split(), f"--user-data-dir={folder}/profile"]
        subprocess.run(
            [*command, f"--screenshot={PICTURE}", page.as_uri()],
            check=True,
            stderr=subprocess.DEVNULL,
        )
    print(f"wrote {PICTURE.name}: {solution.message}")


if __name__ == "__main__":
    main()
