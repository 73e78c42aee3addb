"""
A cup that stays upright
========================

An equation that holds at all times takes a degree of freedom from the motion: the cup in a hand
stays upright, or a tool moves on a line.
"""

# %%
# The hand of a Panda moves to a place at its side. The least-torque motion tilts it on the way.

import sys
import tempfile
from pathlib import Path

import casadi
import numpy as np

import hovi

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
robot = hovi.load_robot("panda", locked=["panda_finger_joint1", "panda_finger_joint2"])
scene = hovi.Scene(robot, effects=[hovi.effects.Gravity()])
start = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]
goal = hovi.FrameGoal("panda_hand", position=[0.4, 0.3, 0.5], axis=([0, 0, 1], [0, 0, -1]))
free = hovi.plan(scene, start, goal, duration=2.0)

# %%
# The condition is a function of q: x and y of the hand's z axis, which points down.

placement = hovi.symbolic.rigid_body(scene).frame_placement("panda_hand")


def tilt(q: casadi.SX) -> casadi.SX:
    """Of the hand's z axis in the world, x and y."""
    return placement(q)[0][:2, 2]


first = np.array(placement(start)[0])[:2, 2].ravel()
upright = hovi.Condition(tilt, hovi.Equal(first), name="upright")
there = hovi.FrameGoal("panda_hand", position=[0.4, 0.3, 0.5])
kept = hovi.plan(scene, start, there, duration=2.0, conditions=[upright])
print(kept.message)
print(kept.margins())
assert kept.success

# %%
# How far the cup is tilted, by the robot's own kinematics at 2001 instants, and what that costs.

t = np.linspace(0.0, 2.0, 2001)
down = np.append(first, -np.sqrt(1.0 - first @ first))
tilts = {}
for name, motion in (("without", free), ("with", kept)):
    axes = [robot.frame_pose("panda_hand", q)[:3, 2] for q in motion.trajectory.configurations(t)]
    tilts[name] = np.degrees(np.arccos(np.clip(axes @ down, -1.0, 1.0))).max()
    print(f"{name} the condition: tilted by {tilts[name]:.2g} degrees, cost {motion.cost:.1f}")
assert tilts["with"] < 1e-3

# %%
# The replay page.

hovi.replay(kept.trajectory, html=folder / "kept.html")
