"""
Planning to a tolerance
=======================

Give the accuracy of a plan as a tolerance, in the unit of your choice; a certificate verifies it.
"""

# %%
# A UR5 whose tool position must be accurate to 0.1 mm at any time.

import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import hovi

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
scene = hovi.Scene(hovi.load_robot("ur5"), effects=[hovi.effects.Gravity()])
ends = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1], [1.2, -0.6, 0.4, 0.7, -0.8, 1.0]
free = {"limits": "none", "self_collision": False}
plan = hovi.plan(scene, *ends, duration=1.5, tolerance="0.1 mm at tool0", **free)
print(plan.message)
assert plan.accuracy.reached
assert plan.accuracy.estimate.largest_tip <= 1e-4

# %%
# A number is a relative tolerance of the cost. Each further digit needs a few more points.

for tolerance in (1e-2, 1e-4, 1e-6, 1e-8):
    plan = hovi.plan(scene, *ends, duration=1.5, tolerance=tolerance, **free)
    last = plan.accuracy.rounds[-1]
    print(f"{tolerance:.0e}: estimate {plan.error_estimate:.1e}, {last.points} points")
    assert plan.error_estimate <= tolerance

# %%
# The certificate lists checks of the plan. The replay integrates the arm under the planned torques
# with SciPy and Pinocchio: it certifies dynamics and torques, not optimality.

certificate = hovi.certify(plan)
print(f"spread of Pontryagin's Hamiltonian: {certificate.hamiltonian.spread:.1e}")
print(f"action {certificate.action:.9g}, integral {certificate.integral:.9g}")
print(f"the replay deviates at the next node by {certificate.replay.angle:.1e} rad at most")
assert certificate.n_neg == 0
assert certificate.hamiltonian.spread < 1e-6
assert certificate.replay.angle < 1e-9

# %%
# Intervals become short where a motion turns sharply, and get more inner modes where it is smooth.

task = hovi.load_task(hovi.example("two_link_swing_up"))
swing = {"duration": task.duration, "limits": "none"}
coarse = hovi.plan(task.scene, task.start, task.goal, intervals=60, **swing)
fine = hovi.plan(
    task.scene,
    task.start,
    task.goal,
    intervals=24,
    guess=coarse.trajectory,
    tolerance=1e-7,
    **swing,
)
grid = fine.trajectory.grid
t = np.linspace(0.0, task.duration, 2001)
figure, (above, below) = plt.subplots(2, 1, sharex=True)
above.plot(t, np.linalg.norm(fine.trajectory.sample(t).a, axis=1))
above.set_ylabel("|a| [rad/s²]")
below.step(grid.t, np.append(grid.steps, grid.steps[-1]), where="post")
below.set_ylabel("length of the interval [s]")
below.set_xlabel("t [s]")
figure.savefig(folder / "interval_lengths.png")
assert grid.steps.max() > 2 * grid.steps.min()
