"""
An elbow that stays in its range
================================

Effects are forces and cost terms that a scene has beyond inertia. This one is a potential in the
cost: zero while the elbow is between 0 and 170 degrees, steep outside.
"""

# %%
# This is the bundled scene `two_link_elbow`, built step by step.

import sys
import tempfile
from math import pi, radians
from pathlib import Path

import numpy as np

import hovi
from hovi.effects import Gravity, JointLimitPotential

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
robot = hovi.load_robot(hovi.example("two_link.urdf"))
free = hovi.Scene(robot, effects=[Gravity(9.8)])
elbow = JointLimitPotential({"elbow": (0.0, radians(170.0))}, slope=1000.0, width=1e-3)
kept = hovi.Scene(robot, effects=[Gravity(9.8), elbow])
print(kept.describe())

# %%
# The same task in both scenes: from hanging to upright in ten seconds, by the scheme and the
# grid of the paper.

t = np.linspace(0.0, 10.0, 2001)
solutions = {}
for name, scene in (("free", free), ("kept", kept)):
    solution = hovi.plan(
        scene,
        start=[-pi / 2, 0.0],
        goal=[pi / 2, 0.0],
        duration=10.0,
        scheme="taylor-midpoint",
        intervals=200,
        starts=4,
    )
    angle = np.degrees(solution.trajectory.sample(t).q[:, 1])
    print(
        f"{name}: {solution.status}, cost {solution.cost:.4f}, "
        f"elbow from {angle.min():.1f} to {angle.max():.1f} degrees"
    )
    solutions[name] = solution

# %%
# Keeping the elbow in its range costs torque. The potential is soft: where it acts, the elbow is a
# fraction of a degree outside, less with a larger slope.

assert solutions["kept"].success
assert solutions["kept"].cost > solutions["free"].cost
solutions["kept"].trajectory.save(folder / "elbow.npz")
