"""
Smooth enough for a real arm
============================

A real arm rejects the motion of least effort, whose acceleration jumps at both ends. With a small
cost on the jerk it starts and ends without acceleration, and its torques are continuous.
"""

# %%
# A Panda lifts 2 kg, once with the least effort within the limits of its URDF, and once smoothly,
# within the limits that its maker publishes.

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
task = hovi.load_task(hovi.example("panda_lift"))
least = hovi.plan_task(task, smooth=False, limits="urdf")
smooth = hovi.plan_task(task, limits="panda")
print("least effort:", least.message)
print("smooth:      ", smooth.message)
assert smooth.success

# %%
# What a controller looks at first.

for name, solution in (("least effort", least), ("smooth", smooth)):
    found = hovi.extremes(solution.trajectory)
    for quantity in (found.acceleration, found.jerk):
        ends = max(np.abs(quantity.start).max(), np.abs(quantity.end).max())
        print(
            f"{name:12s}: at most {quantity.value:8.1f} {quantity.unit} ({quantity.joint}), "
            f"{ends:8.2g} at the ends"
        )
    print(f"{name:12s}: effort {solution.effort:.1f}")
assert np.abs(hovi.extremes(smooth.trajectory).acceleration.start).max() < 1e-6

# %%
# The accelerations of both.

figure, panels = plt.subplots(1, 2, figsize=(9, 3.2), sharex=True, layout="constrained")
t = np.linspace(0.0, task.duration, 801)
for panel, solution, title in zip(panels, (least, smooth), ("least effort", "smooth"), strict=True):
    panel.plot(t, solution.trajectory.sample(t).a)
    panel.set_title(title)
    panel.set_xlabel("time [s]")
panels[0].set_ylabel("acceleration [rad/s$^2$]")
panels[1].legend([f"joint {i + 1}" for i in range(7)], fontsize=7, ncols=2)
figure.savefig(folder / "smooth.png", dpi=120)
