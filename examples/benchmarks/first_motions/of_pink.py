"""The motion of `task.py` by Pink: inverse kinematics, step by step."""

import numpy as np
import pink
import pinocchio as pin
from task import GOAL, HOME, URDF, T

model = pin.buildModelFromUrdf(URDF)
arm = pink.Configuration(model, model.createData(), np.array(HOME))
task = pink.FrameTask("tool", position_cost=1.0, orientation_cost=0.0)
task.set_target(pin.SE3(np.eye(3), np.array(GOAL)))
dt, q = 0.005, [arm.q]
for _ in range(round(T / dt)):
    velocity = pink.solve_ik(arm, [task], dt, solver="quadprog")
    arm.integrate_inplace(velocity, dt)
    q.append(arm.q)
t = dt * np.arange(len(q))
