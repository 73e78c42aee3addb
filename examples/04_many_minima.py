"""
Many minima
===========

Swinging an arm up is a landscape of many valleys. One guess finds one minimum; `starts` asks
for more guesses, drawn at random from a seed, and ranks what they find.
"""

# %%
# A motion is a minimum when no small change makes it cheaper. That says nothing about large
# changes: swing up first to the left, or first to the right, or with one more swing.

import sys
import tempfile
from math import pi
from pathlib import Path

import numpy as np

import hovi

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
robot = hovi.load_robot(hovi.example("two_link.urdf"))
scene = hovi.Scene(robot, effects=[hovi.effects.Gravity(9.8)])
hanging, upright = [-pi / 2, 0.0], [pi / 2, 0.0]

# %%
# The cubic guess alone:

one = hovi.plan(scene, hanging, upright, duration=5.0, intervals=40)
print(f"from the cubic guess: cost {one.cost:.4f}")

# %%
# And with 48 starts. The seed makes the answer repeatable, whatever the number of processes.

many = hovi.plan(scene, hanging, upright, duration=5.0, intervals=40, starts=48, seed=1)
print(f"{len(many.minima)} different minima:", *(f"{cost:.3f}" for cost in many.minima))
assert many.success
assert many.cost <= one.cost + 1e-9

# %%
# How do the two motions differ? The cheaper one takes more swings and less torque.

t = np.linspace(0.0, 5.0, 501)
for name, solution in (("one start", one), ("48 starts", many)):
    motion = solution.trajectory.sample(t)
    turns = np.count_nonzero(np.diff(np.sign(motion.v[:, 0])))
    peak = abs(motion.tau).max()
    print(f"{name}: the shoulder turns back {turns} times, peak torque {peak:.2f} N m")

# %%
# A minimum that was found on one grid is a guess for a finer one.

fine = hovi.plan(scene, hanging, upright, 5.0, intervals=80, guess=many.trajectory)
print(f"on 80 intervals: cost {fine.cost:.6f} in {fine.nit} steps")
fine.trajectory.save(folder / "swing_up.npz")
