"""
Seven joints
============

The machinery is the same for any robot. A Franka Panda from example-robot-data, its two
fingers locked, moves in 1.5 seconds; the result becomes one page that plays anywhere.
"""

# %%
# Robots of example-robot-data are called by their names. Locked joints leave the model.

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
# Only ends, time and torque count. Sixteen intervals, the default, would give the cost to three
# digits; the torque between the nodes is a second derivative and asks for more.

scene = hovi.Scene(robot, effects=[hovi.effects.Gravity()])
solution = hovi.plan(
    scene,
    start=[0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.7],
    goal=[0.9, 0.3, -0.4, -1.2, 0.5, 2.2, -0.3],
    duration=1.5,
    intervals=32,
    limits="none",
)
print(f"{solution.message} {solution.solve_seconds:.2f} s")
assert solution.success

# %%
# The least-torque motion uses the arm's own swing and, without limits, is wild. Compare it with
# what the URDF allows, which `plan` keeps to unless told otherwise.

trajectory = solution.trajectory
motion = trajectory.sample(np.linspace(0.0, trajectory.duration, 641))
for i, name in enumerate(robot.coordinate_names):
    speed, torque = abs(motion.v[:, i]).max(), abs(motion.tau[:, i]).max()
    print(
        f"{name}: {speed:5.1f} of {robot.velocity_limit[i]:.2f} rad/s, "
        f"{torque:5.1f} of {robot.effort_limit[i]:.0f} N m"
    )

# %%
# Weights change what "least torque" means: here the wrist's torque counts a hundred times.

careful = hovi.plan(
    scene,
    start=[0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.7],
    goal=[0.9, 0.3, -0.4, -1.2, 0.5, 2.2, -0.3],
    duration=1.5,
    intervals=32,
    limits="none",
    weight=[1, 1, 1, 1, 100, 100, 100],
)
wrist = abs(careful.trajectory.sample(np.linspace(0.0, 1.5, 641)).tau[:, 4:]).max()
print(f"peak torque in the wrist: {abs(motion.tau[:, 4:]).max():.1f} N m, weighted {wrist:.1f} N m")

# %%
# A page that plays the motion, with nothing to install.

hovi.replay(trajectory, html=folder / "panda.html", open_browser=False)
print(f"open {folder / 'panda.html'}")
