"""
Many minima
===========

Swinging up an arm has many local minima. One guess leads to one minimum; `starts` adds random
guesses, drawn from a seed, and ranks the minima by cost.
"""

# %%
# At a local minimum no small change lowers the cost. A large change may: swing first to the other
# side, or once more.

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
# And with 48 starts. For a given seed the result is the same for any number of processes.

many = hovi.plan(scene, hanging, upright, duration=5.0, intervals=40, starts=48, seed=1)
print(f"{len(many.minima)} different minima:", *(f"{cost:.3f}" for cost in many.minima))
assert many.success
assert many.cost <= one.cost + 1e-9

# %%
# The cheaper motion takes more swings and less torque.

t = np.linspace(0.0, 5.0, 501)
for name, solution in (("one start", one), ("48 starts", many)):
    motion = solution.trajectory.sample(t)
    turns = np.count_nonzero(np.diff(np.sign(motion.v[:, 0])))
    peak = abs(motion.tau).max()
    print(f"{name}: the shoulder reverses {turns} times, peak torque {peak:.2f} N m")

# %%
# A minimum on one grid is a guess for a finer grid.

fine = hovi.plan(scene, hanging, upright, 5.0, intervals=80, guess=many.trajectory)
print(f"on 80 intervals: cost {fine.cost:.6f} in {fine.nit} steps")
fine.trajectory.save(folder / "swing_up.npz")
