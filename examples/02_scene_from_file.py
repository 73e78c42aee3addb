"""
A scene from a file
===================

A scene file describes a task: the robot, the effects, start and goal, and the options of the plan.
``hovi plan two_link_reach`` plans it from the shell. This example does the same in Python, changes
the task, and saves it to a new file.
"""

# %%
# `example` gives the path of a bundled scene; the path of your own file works as well.

import dataclasses
import sys
import tempfile
from pathlib import Path

import hovi
from hovi.errors import SceneError

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
print(hovi.example("two_link_reach").read_text())
task = hovi.load_task(hovi.example("two_link_reach"))


# %%
# Planning a task is handing its parts to `hovi.plan`, which is what `hovi.plan_task` does.


def plan(task: hovi.Task) -> hovi.Solution:
    return hovi.plan(
        task.scene,
        task.start,
        task.goal,
        task.duration,
        options=task.options,
    )


# %%
# Shorter motions need more torque: for short durations T the cost grows like T^-3.

for duration in (1.0, 0.5, 0.25, 0.125):
    solution = plan(dataclasses.replace(task, duration=duration))
    print(f"T = {duration:5.3f} s   cost {solution.cost:12.2f}   {solution.status}")
    assert solution.success

# %%
# Save a changed task. Its URDF is copied next to it, so the folder is self-contained.

slower = dataclasses.replace(task, duration=1.5).with_options(intervals=24)
path = hovi.save_task(slower, folder / "slower_reach.toml")
print(path.read_text())
assert hovi.load_task(path).duration == 1.5

# %%
# The error for a mistake in a file names the line and the nearest valid name.

path.write_text(path.read_text().replace("intervals", "intervalls"))
try:
    hovi.load_task(path)
except SceneError as error:
    print(error)
