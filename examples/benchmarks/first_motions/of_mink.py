"""The motion of `task.py` by mink: inverse kinematics, step by step."""

import mink
import mujoco
import numpy as np
from task import GOAL, HOME, URDF, T

spec = mujoco.MjSpec.from_file(URDF)
spec.compiler.fusestatic = False  # else the tool is a part of the hand
model = spec.compile()
arm = mink.Configuration(model, np.array(HOME))
task = mink.FrameTask("tool", "body", position_cost=1.0, orientation_cost=0.0)
task.set_target(mink.SE3.from_translation(np.array(GOAL)))
speeds = {"base_yaw": 3.0, "shoulder": 2.6, "elbow": 2.6, "wrist": 4.0}
limits = [mink.ConfigurationLimit(model), mink.VelocityLimit(model, speeds)]
dt, q = 0.005, [arm.q.copy()]
for _ in range(round(T / dt)):
    velocity = mink.solve_ik(arm, [task], dt, solver="daqp", limits=limits)
    arm.integrate_inplace(velocity, dt)
    q.append(arm.q.copy())
t = dt * np.arange(len(q))
