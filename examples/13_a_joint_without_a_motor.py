"""
A joint without a motor
=======================

A cart swings up a pole on a passive hinge. The torque of the hinge vanishes in every interval of
the discrete motion, and an independent integrator arrives at the same nodes.
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
# Plan. Early iterations admit some torque at the hinge; it is then driven to zero.

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
# Integrate from every node to the next with the planned force of the cart and no torque at the
# hinge.

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
print(f"largest deviation at the next node: {max(missed):.1e} (m or rad)")

hovi.plot(motion, "cart_pole.png")
