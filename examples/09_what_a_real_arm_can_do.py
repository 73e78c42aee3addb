"""
What a real arm can do
======================

Without limits the least-torque motion of an arm is wild. `plan` takes the limits of the URDF
unless told otherwise, and a motion that it calls a minimum keeps them everywhere, between the
nodes too.
"""

# %%
# A UR5 moves from rest to rest in 1.5 seconds, first without any limit.

import sys
import tempfile
from pathlib import Path

import numpy as np

import hovi
from hovi.viewing import plotting

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
robot = hovi.load_robot("ur5")
scene = hovi.Scene(robot, effects=[hovi.effects.Gravity()])
start, goal = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1], [1.2, -0.6, 0.4, 0.7, -0.8, 1.0]
free = hovi.plan(scene, start, goal, duration=1.5, limits="none")

# %%
# Then with the URDF's limits of position, and velocities and torques of our own. A number holds
# for every joint and both directions, a list has one entry per joint, a table names joints.
# `limits="urdf"`, the default, would take all from the URDF.

torque = [150.0, 150.0, 150.0, 28.0, 28.0, 28.0]
kept = hovi.plan(scene, start, goal, duration=1.5, limits={"v": 3.14, "tau": torque})
print(kept.message)
assert kept.success

# %%
# How fast is each joint? The price is torque: the limited motion costs more.

t = np.linspace(0.0, 1.5, 2001)
speeds = [abs(each.trajectory.sample(t).v).max(axis=0) for each in (free, kept)]
for name, wild, tame in zip(robot.coordinate_names, *speeds, strict=True):
    print(f"{name:20s} {wild:5.2f} rad/s without limits, {tame:5.3f} with them")
print(f"cost {free.cost:.1f} without limits, {kept.cost:.1f} with them")
assert speeds[1].max() <= 3.14 * (1 + 2e-6) < speeds[0].max()
assert kept.cost > free.cost

# %%
# In the picture a limit is a band, and a curve is wider where it leans on one. The page that
# plays the motion shows a link in yellow while its joint is at a limit.

kept.trajectory.save(folder / "kept.npz")
plotting.plot(free.trajectory, folder / "free.png")
plotting.plot(kept.trajectory, folder / "kept.png")
hovi.replay(kept.trajectory, html=folder / "kept.html")

# %%
# What cannot be done is said, with the reason: 0.3 seconds are too short for these joints.

hasty = hovi.plan(scene, start, goal, duration=0.3, limits={"v": 3.14, "tau": torque})
print(f"{hasty.status}: {hasty.message}")
assert not hasty.success
