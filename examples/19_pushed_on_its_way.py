"""
Pushed on its way
=================

A receding horizon: an arm is planned again 50 times a second, from the state that is measured,
while somebody pushes it. `Solution.advance` shifts the last motion along its time and solves again
from there, within a budget of time per call.
"""

# %%
# A UR5, with the rotors of its motors, reaches within the limits of its URDF. The plans keep a
# tenth of the velocities and torques in reserve, for what a push adds.

import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import hovi

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
robot = hovi.load_robot("ur5")
scene = hovi.Scene(robot, effects=[hovi.effects.Gravity(), hovi.effects.Armature(0.1)])
start, goal = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1], np.array([1.0, -0.8, 0.7, 0.2, -0.4, 0.7])
limits = {"v": 0.9 * robot.velocity_limit, "tau": 0.9 * robot.effort_limit}
plan = first = hovi.plan(scene, start, goal, duration=1.5, limits=limits, intervals=12)
print(plan.message)
assert plan.success

# %%
# Every cycle lasts 20 ms. Hovi's own simulator moves the arm by the planned torques and a push:
# random torques that change every 0.1 s. There is no feedback but the next plan, up to the last
# tenth of a second. A plan that fails is followed further, and the next one gets more time. The
# simulator waits for plans; an arm would need them within the cycle.

CYCLE, LAST, BUDGET = 0.02, 0.1, 1.0  # s
largest = np.array([4.0, 4.0, 2.0, 0.5, 0.5, 0.25])  # N m
pushes = largest * np.random.default_rng(0).uniform(-1, 1, (30, robot.nv))
state, measured, planned, seconds, counts = hovi.State(start), [], [], [], Counter()
elapsed, more = 0.0, 0.0
while plan.trajectory.duration - elapsed > CYCLE / 2 and len(measured) < 125:
    now, motion, begun = CYCLE * len(measured), plan.trajectory, elapsed
    push = pushes[int(now / 0.1 + 1e-9)]

    def torque(t, motion=motion, begun=begun, push=push):
        return motion.sample(np.minimum(begun + t, motion.duration)).tau + push

    moved = hovi.simulate(scene, state, CYCLE, torque, intervals=8)
    state, elapsed = hovi.State(moved.q[-1], moved.v[-1]), elapsed + CYCLE
    left = motion.duration - elapsed + more
    if left >= LAST:
        inside = hovi.State(state.q, np.clip(state.v, -limits["v"], limits["v"]))
        began = time.perf_counter()
        again = plan.advance(elapsed, inside, duration=left, time_limit=BUDGET)
        seconds.append(time.perf_counter() - began)
        counts[str(again.status)] += 1
        print(f"{now:4.2f} s: {1e3 * seconds[-1]:5.0f} ms, {again.nit:3d} steps, {again.status}")
        more += 0.1
        if again.success or again.status == "time_limit":
            plan, elapsed, more = again, 0.0, 0.0
    measured.append(np.concatenate([state.q, state.v]))
    planned.append(plan.trajectory.sample(min(elapsed, plan.trajectory.duration)).tau[0])

# %%
# What came of it.

measured, planned = np.array(measured), np.array(planned)
q, v = np.split(measured, 2, axis=1)
print(", ".join(f"{count} x {status}" for status, count in counts.items()))
print(
    f"cycle: {1e3 * np.median(seconds):.0f} ms in the middle, {1e3 * max(seconds):.0f} ms at most"
)
print(f"deviation at the goal: {abs(q[-1] - goal).max():.1e} rad, {abs(v[-1]).max():.1e} rad/s")
print(f"largest velocity: {abs(v / robot.velocity_limit).max():.1%} of the URDF's limit")
figure, panels = plt.subplots(3, 1, figsize=(8, 8), sharex=True, layout="constrained")
t = CYCLE * np.arange(1, len(q) + 1)
whole = first.trajectory.sample(np.minimum(t, first.trajectory.duration))
labels = "q [rad]", "v [rad/s]", "tau [N m]"
pairs = (q, whole.q), (v, whole.v), (planned, whole.tau)
for panel, label, (ours, theirs) in zip(panels, labels, pairs, strict=True):
    for i in range(robot.nv):
        panel.plot(t, ours[:, i], color=f"C{i}", label=robot.coordinate_names[i])
        panel.plot(t, theirs[:, i], color=f"C{i}", linestyle=":", linewidth=0.8)
    panel.set_ylabel(label)
panels[0].legend(
    ncols=3, fontsize=7, title="pushed, and as first planned (dotted)", title_fontsize=7
)
panels[2].set_xlabel("time [s]")
figure.savefig(folder / "pushed.png", dpi=120)
