"""
Which effect matters?
=====================

A scene simulates only the effects that it lists. Here the torques of a simple plan are applied in a
scene with more effects, and the deviations show which of them the plan must include.
"""

# %%
# A plan for the two-link arm with gravity only.

import math
import sys
import tempfile
from pathlib import Path

import hovi
from hovi.accuracy.effect_study.study import study_effects
from hovi.accuracy.effect_study.tables import plot_study
from hovi.effects import Armature, DryFriction, Gravity, Payload, ViscousFriction, Wrench

robot = hovi.load_robot(hovi.example("two_link.urdf"))
gravity_scene = hovi.Scene(robot, [Gravity(9.8)])
start, goal = hovi.State([-math.pi / 2, 0.0]), hovi.State([0.3, 0.7])
plan = hovi.plan(gravity_scene, start, goal, 1.0, limits="none")
print(f"planned with gravity alone: cost {plan.cost:.3f}")

# %%
# A scene with more effects. `describe` lists the effects of a scene, those that it leaves out, and
# what each one costs: instructions in the expression graph, and time with and without it.

full_scene = hovi.Scene(
    robot,
    [
        Gravity(9.8),
        ViscousFriction(0.1),  # N m s/rad
        DryFriction(0.05, width=0.1),  # N m, its sign smoothed over 0.1 rad/s
        Armature(0.01),  # kg m^2
        Payload(robot.tip_frame, 0.05),  # kg
        Wrench(robot.tip_frame, ("0.2*sin(2*pi*t)", 0.0, 0.0)),  # N, an oscillating force
    ],
)
print(full_scene.describe())

# %%
# Applied open loop in this scene, the torques of the plan miss the goal. A feedback corrects that,
# with extra torque; computed torque uses the model of the plan's own scene.

for feedback in ("none", "pd", "computed-torque"):
    played = hovi.play(full_scene, plan.trajectory, feedback, bandwidth=10.0)
    print(
        f"feedback {feedback:15s}  tip off by {1e3 * played.tip_deviation[-1]:7.2f} mm at the end, "
        f"largest correction {abs(played.feedback_torque).max():.3f} N m"
    )

# %%
# Each effect alone: how much it changes, and how much time it costs.

task = hovi.Task(gravity_scene, start, goal, 1.0, hovi.PlanOptions(limits="none"), "two_link_reach")
study = study_effects(task, full_scene.effects[1:])
for trial in study.trials:
    open_loop, held = 1e3 * (trial.open_loop or 0.0), 1e3 * (trial.held or 0.0)
    print(
        f"{trial.name:20s} cost {100 * study.change(trial):+7.2f} %, tip off by {open_loop:.1f} mm"
    )
    print(f"{'':20s} held by a feedback, by {held:.2f} mm")

folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
folder.mkdir(parents=True, exist_ok=True)
plot_study(study, folder / "effects.png")

# %%
# A plan with all effects reaches the goal open loop.

informed = hovi.plan(full_scene, start, goal, 1.0, limits="none", guess=plan.trajectory)
played = hovi.play(full_scene, informed.trajectory)
print(f"planned with all of them: cost {informed.cost:.3f}")
print(f"open loop, the tip ends {1e3 * played.tip_deviation[-1]:.3f} mm off")
assert played.tip_deviation[-1] < 1e-3
