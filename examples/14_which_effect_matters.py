"""
Which effect matters?
=====================

A scene simulates what it names and nothing else. Plan simply, check richly: the torques of a plan
are played on a scene with more effects, and what goes wrong says which of them the plan has to
know of.
"""

# %%
# A plan for the two-link arm that knows gravity alone.

import math
import sys
import tempfile
from pathlib import Path

import hovi
from hovi.accuracy.effect_study.study import study_effects
from hovi.accuracy.effect_study.tables import plot_study
from hovi.discrete.state import State
from hovi.effects import Armature, DryFriction, Gravity, Payload, ViscousFriction, Wrench
from hovi.planning.task_file.task import Task

robot = hovi.load_robot(hovi.example("two_link.urdf"))
simple = hovi.Scene(robot, [Gravity(9.8)])
start, goal = State([-math.pi / 2, 0.0]), State([0.3, 0.7])
plan = hovi.plan(simple, start, goal, 1.0, limits="none")
print(f"planned with gravity alone: cost {plan.cost:.3f}")

# %%
# The world has more in it. `describe` says what a scene simulates, what it leaves out, and what
# each effect costs: instructions in the expression graph, and time with and without it.

rich = hovi.Scene(
    robot,
    [
        Gravity(9.8),
        ViscousFriction(0.1),  # N m s/rad
        DryFriction(0.05, width=0.1),  # N m, its sign smoothed over 0.1 rad/s
        Armature(0.01),  # kg m^2
        Payload(robot.tip_frame, 0.05),  # kg
        Wrench(robot.tip_frame, ("0.2*sin(2*pi*t)", 0.0, 0.0)),  # N, a push that comes and goes
    ],
)
print(rich.describe())

# %%
# Played open loop on the rich scene, the plan misses. A feedback holds it, at a price in torque;
# computed torques believe in the plan's own scene.

for feedback in ("none", "pd", "computed-torque"):
    played = hovi.play(rich, plan.trajectory, feedback, bandwidth=10.0)
    print(
        f"feedback {feedback:15s}  tip off by {1e3 * played.tip_deviation[-1]:7.2f} mm at the end, "
        f"largest correction {abs(played.feedback_torque).max():.3f} N m"
    )

# %%
# Which effect is to blame? Each one alone: what it changes against what it costs.

task = Task(simple, start, goal, 1.0, hovi.PlanOptions(limits="none"), "two_link_reach")
study = study_effects(task, rich.effects[1:])
for trial in study.trials:
    loose, held = 1e3 * (trial.open_loop or 0.0), 1e3 * (trial.held or 0.0)
    print(f"{trial.name:20s} cost {100 * study.change(trial):+7.2f} %, tip off by {loose:.1f} mm")
    print(f"{'':20s} held by a feedback, by {held:.2f} mm")

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
plot_study(study, folder / "effects.png")

# %%
# A plan that knows them arrives where it should, with the torques that it takes.

informed = hovi.plan(rich, start, goal, 1.0, limits="none", guess=plan.trajectory)
played = hovi.play(rich, informed.trajectory)
print(f"planned with all of them: cost {informed.cost:.3f}")
print(f"open loop, the tip ends {1e3 * played.tip_deviation[-1]:.3f} mm off")
assert played.tip_deviation[-1] < 1e-3
