"""
What a real arm can do
======================

Without limits the least-torque motion of an arm is too fast. By default `plan` uses the limits of
the URDF, and a motion with status `minimum` satisfies them everywhere, also between the nodes.
"""

# %%
# A UR5 moves from rest to rest in 1.5 seconds, first without limits.

import sys
import tempfile
from pathlib import Path

import numpy as np

import hovi

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
robot = hovi.load_robot("ur5")
scene = hovi.Scene(robot, effects=[hovi.effects.Gravity()])
start, goal = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1], [1.2, -0.6, 0.4, 0.7, -0.8, 1.0]
free = hovi.plan(scene, start, goal, duration=1.5, limits="none")

# %%
# Then with the URDF's position limits and custom limits of velocity and torque. A number applies to
# every joint and both directions, a list has one entry per joint, a dictionary names joints.
# `limits="urdf"`, the default, takes all limits from the URDF.

torque = [150.0, 150.0, 150.0, 28.0, 28.0, 28.0]
kept = hovi.plan(scene, start, goal, duration=1.5, limits={"v": 3.14, "tau": torque})
print(kept.message)
assert kept.success

# %%
# The limited motion is slower and costs more torque.

t = np.linspace(0.0, 1.5, 2001)
speeds = [abs(each.trajectory.sample(t).v).max(axis=0) for each in (free, kept)]
for name, unlimited, limited in zip(robot.coordinate_names, *speeds, strict=True):
    print(f"{name:20s} {unlimited:5.2f} rad/s without limits, {limited:5.3f} with them")
print(f"cost {free.cost:.1f} without limits, {kept.cost:.1f} with them")
assert speeds[1].max() <= 3.14 * (1 + 2e-6) < speeds[0].max()
assert kept.cost > free.cost

# %%
# In the plot a limit is a band, and a curve is wider where it is at a limit. The replay page shows
# a link in yellow while its joint is at a limit.

kept.trajectory.save(folder / "kept.npz")
hovi.plot(free.trajectory, folder / "free.png")
hovi.plot(kept.trajectory, folder / "kept.png")
hovi.replay(kept.trajectory, html=folder / "kept.html")

# %%
# An infeasible problem is reported with the reason: 0.3 seconds are too short for these joints.

short = hovi.plan(scene, start, goal, duration=0.3, limits={"v": 3.14, "tau": torque})
print(f"{short.status}: {short.message}")
assert not short.success
