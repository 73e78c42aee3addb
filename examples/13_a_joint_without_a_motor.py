"""
A joint without a motor
=======================

A cart swings up a pole that hangs on a hinge: the hinge carries no torque. The discrete motion
keeps that at every quadrature point, and an integrator that knows nothing of the plan arrives at
the same nodes.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.integrate import solve_ivp

import hovi

task = hovi.load_task(hovi.example("cart_pole_swing_up"))
scene = task.scene
print(scene.describe())

# %%
# Plan: first the hinge is helped a little, then less and less.

solution = hovi.plan(
    scene,
    task.start,
    task.goal,
    task.duration,
    intervals=task.options.intervals,
    limits=task.options.limits,
)
motion = solution.trajectory
print(solution.message)

# %%
# Drive the cart by its planned force, the hinge by nothing, from the first node to the second,
# from the second to the third, ...

model, data = scene.model, scene.model.createData()


def rates(t: float, y: np.ndarray, k: int, h: float) -> np.ndarray:
    """q' = v, v' = forward dynamics under the planned force."""
    force = motion.sample_intervals([k], [min(t / h, 1.0)]).tau[0, 0]
    return np.concatenate([y[2:], pin.aba(model, data, y[:2], y[2:], np.array([force, 0.0]))])


missed = []
for k, h in enumerate(motion.grid.steps):
    y0 = np.concatenate([motion.q[k], motion.v[k]])
    end = solve_ivp(rates, (0, h), y0, "DOP853", rtol=1e-10, atol=1e-11, args=(k, h)).y[:, -1]
    missed.append(np.abs(end[:2] - motion.q[k + 1]).max())
print(f"largest miss of a next node: {max(missed):.1e} (m or rad)")

hovi.plot(motion, "cart_pole.png")
