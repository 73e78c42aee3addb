"""
The first motion
================

A two-link arm starts from hanging at rest and reaches a configuration with a given velocity one
second later, with the least torque: the integral of 1/2 |tau|^2 has a local minimum.

Give a folder to keep the results: ``python 01_first_motion.py results``.
"""

# %%
# A robot is loaded from a URDF. This one is bundled with hovi; `load_robot` takes any path.

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
# A scene lists the simulated effects. `describe` also lists those that it leaves out.

scene = hovi.Scene(robot, effects=[hovi.effects.Gravity(9.8)])
print(scene.describe())

# %%
# Start and goal, in radians and radians per second, and the duration in seconds.

solution = hovi.plan(
    scene,
    start=hovi.State([-pi / 2, 0.0]),
    goal=hovi.State([0.3, 0.7], [0.5, -0.4]),
    duration=1.0,
)
print(f"{solution.status}: {solution.message}")

# %%
# `n_neg` is the number of negative eigenvalues of the Hessian: zero at a minimum.

assert solution.success
assert solution.n_neg == 0

# %%
# The motion can be sampled at any time, also between the nodes of the grid.

trajectory = solution.trajectory
t = np.linspace(0.0, trajectory.duration, 6)
motion = trajectory.sample(t)
print("   t      q (shoulder, elbow)      tau (shoulder, elbow)")
for time, q, tau in zip(t, motion.q, motion.tau, strict=True):
    print(f"{time:5.2f}  {q[0]:9.4f} {q[1]:9.4f}     {tau[0]:9.4f} {tau[1]:9.4f}")

# %%
# Save it. `hovi replay motion.npz` plays it in the browser, and `hovi plot motion.npz` plots it.

trajectory.save(folder / "motion.npz")
loaded = hovi.Trajectory.load(folder / "motion.npz")
assert np.array_equal(loaded.sample(t).tau, motion.tau)
print(f"wrote {folder / 'motion.npz'}")
