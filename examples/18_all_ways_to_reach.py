"""
All ways to reach a pose
========================

A UR5 reaches a pose in eight ways. Inverse kinematics finds them, within limits and clear of
obstacles, and a plan takes the one whose motion costs least.
"""

from __future__ import annotations

import dataclasses

import numpy as np

import hovi
from hovi.errors import UnreachableError

robot = hovi.load_robot("ur5")
scene = hovi.Scene(robot, [hovi.effects.Gravity()])
start = np.array([-0.6, -1.0, -1.5, 1.0, 1.5, 0.0])
goal = hovi.FrameGoal("tool0", position=[0.4, 0.35, 0.3], rpy=[np.pi, 0.0, 0.4])

# %%
# The configurations, those nearest to the start first. All of them bring the tool to the pose.

ways = hovi.inverse_kinematics(robot, goal, near=start)
for q in ways:
    print(np.round(q, 2), f"{np.linalg.norm(q - start):.2f} rad from the start")
poses = robot.frame_pose("tool0", ways)
print(f"{len(ways)} configurations, poses equal to {np.ptp(poses, axis=0).max():.0e}")

# %%
# A ball where the elbow of the nearest one would be: the ways that are clear of it remain.

elbow = robot.frame_position("forearm_link", ways[:1])[0]
clear = hovi.inverse_kinematics(
    robot, goal, near=start, obstacles=[hovi.Sphere(elbow, 0.05)], margin=0.02
)
print(f"{len(clear)} of them are clear of the ball")

# %%
# A plan compares them by the cost of the motion. A guess decides for one of them.

best = hovi.plan(scene, start, goal, duration=1.5)
print(f"chosen: cost {best.cost:.0f}, ends at {np.round(best.trajectory.q[-1], 2)}")
nearest = hovi.plan(scene, start, dataclasses.replace(goal, guess=ways[0]), duration=1.5)
print(f"nearest: cost {nearest.cost:.0f}")

# %%
# A pose out of reach is refused, with the configuration that comes nearest to it.

try:
    hovi.inverse_kinematics(robot, hovi.FrameGoal("tool0", position=[1.2, 0.0, 0.3]))
except UnreachableError as refused:
    print(refused)
    print("nearest:", np.round(refused.q, 2))

hovi.plot(best.trajectory, "all_ways_to_reach.png")
