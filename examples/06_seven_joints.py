"""
Seven joints
============

A Franka Panda from example-robot-data, with its two fingers locked, moves in 1.5 seconds. The
result is written as one page that plays in any browser.
"""

# %%
# Robots of example-robot-data are loaded by name. Locked joints are removed from the model.

import sys
import tempfile
from pathlib import Path

import numpy as np

import hovi

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
robot = hovi.load_robot("panda", locked=["panda_finger_joint1", "panda_finger_joint2"])
print(robot.describe())

# %%
# Without a scheme or a number of intervals the grid is chosen for a cost within 1e-3 of the
# minimum's. The torque between the nodes depends on second derivatives and needs a finer grid.

scene = hovi.Scene(robot, effects=[hovi.effects.Gravity()])
solution = hovi.plan(
    scene,
    start=[0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.7],
    goal=[0.9, 0.3, -0.4, -1.2, 0.5, 2.2, -0.3],
    duration=1.5,
    tolerance=1e-5,
    limits="none",
)
print(f"{solution.message} {solution.solve_seconds:.2f} s")
assert solution.success

# %%
# Without limits the least-torque motion swings fast. Compare its peaks with the limits of the URDF,
# which `plan` respects by default.

trajectory = solution.trajectory
motion = trajectory.sample(np.linspace(0.0, trajectory.duration, 641))
for i, name in enumerate(robot.coordinate_names):
    speed, torque = abs(motion.v[:, i]).max(), abs(motion.tau[:, i]).max()
    print(
        f"{name}: {speed:5.1f} of {robot.velocity_limit[i]:.2f} rad/s, "
        f"{torque:5.1f} of {robot.effort_limit[i]:.0f} N m"
    )

# %%
# Weights scale the squared torques: here those of the wrist count a hundred times.

weighted = hovi.plan(
    scene,
    start=[0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.7],
    goal=[0.9, 0.3, -0.4, -1.2, 0.5, 2.2, -0.3],
    duration=1.5,
    tolerance=1e-5,
    limits="none",
    weight=[1, 1, 1, 1, 100, 100, 100],
)
wrist = abs(weighted.trajectory.sample(np.linspace(0.0, 1.5, 641)).tau[:, 4:]).max()
print(f"peak torque in the wrist: {abs(motion.tau[:, 4:]).max():.1f} N m, weighted {wrist:.1f} N m")

# %%
# Write a self-contained page that plays the motion.

hovi.replay(trajectory, html=folder / "panda.html", open_browser=False)
print(f"open {folder / 'panda.html'}")
