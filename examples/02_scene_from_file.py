"""
A scene from a file
===================

A scene file holds all of a task: the robot, what acts on it, the two ends and how to plan.
``hovi plan two_link_reach`` plans it from the shell; this is the same from Python, with a
change to the task that is then written back.
"""

# %%
# Five scenes travel with hovi. A path to your own file works as well.

import dataclasses
import sys
import tempfile
from pathlib import Path

import hovi
from hovi.errors import SceneError
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task import Task
from hovi.planning.task_file.writing import save_task

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
print(hovi.example("two_link_reach").read_text())
task = load_task(hovi.example("two_link_reach"))


# %%
# Planning a task is handing its parts to `hovi.plan`, which is what `hovi.plan_task` does.


def plan(task: Task) -> hovi.Solution:
    return hovi.plan(
        task.scene,
        task.start,
        task.goal,
        task.duration,
        options=task.options,
    )


# %%
# How long may it take? Shorter motions need more torque: the cost grows like T^-3 when T is
# short.

for duration in (1.0, 0.5, 0.25, 0.125):
    solution = plan(dataclasses.replace(task, duration=duration))
    print(f"T = {duration:5.3f} s   cost {solution.cost:12.2f}   {solution.status}")
    assert solution.success

# %%
# A changed task becomes a file of its own, its URDF beside it, so that the folder can be
# given away as it is.

slower = dataclasses.replace(task, duration=1.5).with_options(intervals=24)
path = save_task(slower, folder / "slower_reach.toml")
print(path.read_text())
assert load_task(path).duration == 1.5

# %%
# A mistake in a file is answered by a sentence that names the place and the nearest name.

path.write_text(path.read_text().replace("intervals", "intervalls"))
try:
    load_task(path)
except SceneError as mistake:
    print(mistake)
