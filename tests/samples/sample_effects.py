"""One of every effect for any robot, with nonzero and with zero strength."""

from __future__ import annotations

from hovi.effects import (
    AccelerationCost,
    Armature,
    Custom,
    Drag,
    DryFriction,
    Effect,
    EffortWeight,
    Gravity,
    JerkCost,
    JointLimitPotential,
    JointSprings,
    MovingBase,
    Payload,
    PowerCost,
    ReferenceCost,
    RunningCost,
    VelocityCost,
    ViscousFriction,
    Wrench,
)
from hovi.effects.expressions.joint_positions import positioned
from hovi.robot.robot import Robot


def sample_effects(robot: Robot) -> dict[str, Effect]:
    """Nontrivial effects by key."""
    placed = [robot.coordinate_names[i] for i in positioned(robot)]
    first, last, tip = placed[0], placed[-1], robot.tip_frame
    effects: list[Effect] = [
        Gravity(3.7, (0.3, -0.2, -1.0)),
        ViscousFriction({first: 0.4, last: 0.1}),
        DryFriction(0.3, dict.fromkeys(robot.coordinate_names, 0.5), 0.3, 0.2),
        Armature(0.07),
        JointSprings({first: 2.0, last: 1.0}, {last: 0.4}),
        JointLimitPotential({first: (-0.1, 0.1)}, 30.0, 0.5, stops=True),
        Payload(tip, 0.8, (0.02, 0.01, 0.1), (2e-3, 3e-3, 4e-3, 1e-4, 0.0, 2e-4)),
        Wrench(tip, (3.0, "2*sin(3*t)", -1.0), ("t", 0.5, 0.0), "frame"),
        Drag(tip, 0.2, linear=0.3, wind=(2.0, "cos(t)", 0.0), width=0.1),
        MovingBase((0.0, "0.1*sin(3*t)", "0.05*t**2"), ("0.2*sin(t)", 0.1, "0.5*t")),
        Custom({first: f'0.2*v["{first}"]**3 + tanh(q["{last}"])'}, f'a["{last}"]**2*cos(t)'),
        EffortWeight({first: 2.0}),
        VelocityCost(0.7),
        AccelerationCost({last: 0.2}),
        JerkCost(0.3),
        ReferenceCost({last: "0.3*t"}, 4.0),
        PowerCost(0.5, 0.4),
        RunningCost(
            {
                "drives": f'0.3*dot(tau, tau) + exp(-t)*tau["{first}"]*v["{first}"]',
                "tip": f'0.1*acceleration["{tip}", "z"]**2 + 0.2*a["{last}"]*tau["{first}"]',
            }
        ),
    ]
    return {effect.key: effect for effect in effects}


def zero_strength_effects(robot: Robot) -> dict[str, Effect]:
    """The same effects with zero strength, if they have one; a cost on the jerk needs a weight."""
    first, tip = robot.coordinate_names[0], robot.tip_frame
    effects: list[Effect] = [
        Gravity(0.0),
        ViscousFriction(0.0),
        DryFriction(0.0),
        Armature(0.0),
        JointSprings(0.0, 0.3),
        JointLimitPotential({first: (-1e3, 1e3)}, stops=True),
        Payload(tip, 0.0, (0.1, 0.0, 0.0)),
        Wrench(tip),
        Drag(tip, wind=(5.0, 0.0, 0.0)),
        MovingBase(("2*t", 1.0, 0.0), (0.0, 0.0, 0.3)),  # steady, and turned about the vertical
        Custom({first: "0*t"}, 0.0),
        EffortWeight(1.0),
        VelocityCost(0.0),
        AccelerationCost(0.0),
        ReferenceCost({first: 1.0}, 0.0),
        PowerCost(0.0),
        RunningCost({"nothing": "0*dot(tau, v)"}),
    ]
    return {effect.key: effect for effect in effects}
