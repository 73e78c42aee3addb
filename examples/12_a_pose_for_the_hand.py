"""
A pose for the hand
===================

A goal need not be a configuration. Here a UR5 brings its tool to a pose, then merely to a place
above the table with the tool pointing down, and takes its time for it: the duration is free, and
a second costs something.
"""

from __future__ import annotations

import numpy as np

import hovi

task = hovi.load_task(hovi.example("ur5_reach"))
scene, start = task.scene, task.start

# %%
# A pose: six equations for six joints. The optimiser still chooses among the configurations
# that meet it.

pose = np.eye(4)
pose[:3, :3] = np.diag([1.0, -1.0, -1.0])  # the tool's z axis points down
pose[:3, 3] = [0.45, 0.25, 0.25]
solution = hovi.plan(scene, start, hovi.FrameGoal("tool0", pose), duration=2.0)
print(solution.message)
print("ends at q =", np.round(solution.trajectory.q[-1], 3))

# %%
# A place and a direction: how the tool is turned about its own axis does not matter, which
# leaves more freedom and costs less.

down = hovi.FrameGoal("tool0", position=pose[:3, 3], axis=([0, 0, 1], [0, 0, -1]))
cheaper = hovi.plan(scene, start, down, duration=2.0)
print(f"cost {cheaper.cost:.1f} instead of {solution.cost:.1f}")

# %%
# On the way, half a second before the end, the tool passes twenty centimetres above the place.

above = hovi.FrameGoal("tool0", position=pose[:3, 3] + np.array([0, 0, 0.2]))
approach = hovi.plan(scene, start, down, duration=2.0, via=[hovi.Via(1.5, above)])
tip = scene.robot.frame_position("tool0", approach.trajectory.sample([1.5, 2.0]).q)
print("height at 1.5 s and at the end:", np.round(tip[:, 2], 6))

# %%
# A second costs 100: the best duration balances haste and torque.

free = hovi.plan(scene, start, down, duration=(1.0, 4.0), time_weight=100.0)
print(free.message)

hovi.plot(free.trajectory, "pose_for_the_hand.png")
