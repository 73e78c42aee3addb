"""The motion of `task.py` by hovi."""

import numpy as np
from task import GOAL, HOME, URDF, T

import hovi

arm = hovi.load_robot(URDF)
scene = hovi.Scene(arm, [hovi.effects.Gravity()])
solution = hovi.plan(scene, HOME, hovi.FrameGoal("tool", position=GOAL), T)
t = np.linspace(0.0, T, 601)
q = solution.trajectory.sample(t).q
