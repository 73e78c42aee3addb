"""
The first motion
================

A two-link arm leaves its hanging rest and passes through a point one second later, with a
given velocity and with the least torque: the integral of 1/2 |tau|^2 is as small as it can
be nearby.

Run it with a folder to keep the results in: ``python 01_first_motion.py results``.
"""

# %%
# A robot is a URDF. This one travels with hovi; `load_robot` takes any path.

import sys
import tempfile
from math import pi
from pathlib import Path

import numpy as np

import hovi

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
robot = hovi.load_robot(hovi.example("two_link.urdf"))
print(robot.describe())

# %%
# A scene says what is simulated. What it does not name does not act, and it tells so.

scene = hovi.Scene(robot, effects=[hovi.effects.Gravity(9.8)])
print(scene.describe())

# %%
# The two ends, in radians and radians per second, and the time between them.

solution = hovi.plan(
    scene,
    start=hovi.State([-pi / 2, 0.0]),
    goal=hovi.State([0.3, 0.7], [0.5, -0.4]),
    duration=1.0,
)
print(f"{solution.status}: {solution.message}")

# %%
# `n_neg` counts the directions in which the cost falls: none, so this is a minimum.

assert solution.success
assert solution.n_neg == 0

# %%
# The motion can be read at any time, between the nodes of the grid too.

trajectory = solution.trajectory
t = np.linspace(0.0, trajectory.duration, 6)
motion = trajectory.sample(t)
print("   t      q (shoulder, elbow)      tau (shoulder, elbow)")
for time, q, tau in zip(t, motion.q, motion.tau, strict=True):
    print(f"{time:5.2f}  {q[0]:9.4f} {q[1]:9.4f}     {tau[0]:9.4f} {tau[1]:9.4f}")

# %%
# Keep it. `hovi replay motion.npz` plays it in the browser, and `hovi plot` draws it.

trajectory.save(folder / "motion.npz")
again = hovi.Trajectory.load(folder / "motion.npz")
assert np.array_equal(again.sample(t).tau, motion.tau)
print(f"written to {folder / 'motion.npz'}")
