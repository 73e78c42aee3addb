"""
A pose for the hand
===================

A goal can be given in task space. A UR5 brings its tool to a pose, then to a position with the tool
pointing down, passes a via point, and finally chooses its duration at a cost per second.
"""

from __future__ import annotations

import numpy as np

import hovi

task = hovi.load_task(hovi.example("ur5_reach"))
scene, start = task.scene, task.start

# %%
# A pose: six equations for six joints. The optimiser chooses among the configurations that satisfy
# them.

pose = np.eye(4)
pose[:3, :3] = np.diag([1.0, -1.0, -1.0])  # the tool's z axis points down
pose[:3, 3] = [0.45, 0.25, 0.25]
solution = hovi.plan(scene, start, hovi.FrameGoal("tool0", pose), duration=2.0)
print(solution.message)
print("ends at q =", np.round(solution.trajectory.q[-1], 3))

# %%
# A position and an axis: the rotation of the tool about its own axis is free, which costs less.

down = hovi.FrameGoal("tool0", position=pose[:3, 3], axis=([0, 0, 1], [0, 0, -1]))
cheaper = hovi.plan(scene, start, down, duration=2.0)
print(f"cost {cheaper.cost:.1f} instead of {solution.cost:.1f}")

# %%
# A via point: half a second before the end, the tool passes 20 cm above the goal.

above = hovi.FrameGoal("tool0", position=pose[:3, 3] + np.array([0, 0, 0.2]))
approach = hovi.plan(scene, start, down, duration=2.0, via=[hovi.Via(1.5, above)])
tip = scene.robot.frame_position("tool0", approach.trajectory.sample([1.5, 2.0]).q)
print("height at 1.5 s and at the end:", np.round(tip[:, 2], 6))

# %%
# With a cost of 100 per second, the best duration balances time and torque.

free = hovi.plan(scene, start, down, duration=(1.0, 4.0), time_weight=100.0)
print(free.message)

hovi.plot(free.trajectory, "pose_for_the_hand.png")
