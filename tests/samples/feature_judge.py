"""The judge of motions with two features: Pinocchio, formulas of effects, balls and dense samples.

Clearances are distances of balls by their centers, and torques those of Pinocchio's recursion with
what each effect adds at the time since the first motion began.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping

import numpy as np
import pinocchio as pin

import hovi
from samples.asked_features import (
    COULOMB,
    HELD_MASS,
    HELD_RADIUS,
    LOAD,
    MARGIN,
    OBSTACLE,
    VISCOUS,
    WIDTH,
    AskedFeatures,
    planned_with,
)
from samples.asked_motions import TIME, Array
from samples.motion_judge import SAME, SAMPLES, over_limits

ELAPSED = 0.25
"""Time after which motions go on, in [s]."""
PASSED = 2e-3
"""How far, in [rad] or [m], a sample of a motion through a point is at most, at any time."""
CLOSER = 1e-6
"""Of distances, in [m]."""


def outcome(features: tuple[str, ...]) -> tuple[str, str]:
    """Why motions with these features are refused, and what is wrong with one; "" for none.

    Raises whatever hovi raises but a HoviError.
    """
    asked = AskedFeatures.of(*features)
    try:
        found, goal, elapsed = planned_with(asked), None, 0.0
        wrong = judged(asked, found, goal, elapsed)
        if asked.has("replan") and not wrong:
            goal = asked.robot.integrate(asked.q1, 0.0625 * np.sign(asked.d))
            found = found.replan(asked.q0, goal)
            wrong = judged(asked, found, goal, elapsed)
        if asked.has("advance") and not wrong:
            before, elapsed = found, ELAPSED
            found = found.advance(elapsed)
            wrong = judged(asked, found, goal, elapsed, before)
    except hovi.HoviError as error:
        return str(error), ""
    return "", wrong


def judged(
    asked: AskedFeatures,
    found: hovi.Solution,
    goal: Array | None = None,
    elapsed: float = 0.0,
    before: hovi.Solution | None = None,
) -> str:
    """What a motion does not satisfy of what is asked for; "" if nothing.

    goal: of a replan. elapsed: of the motion `before`, in [s].
    """
    if not found.success:
        return f"{found.status}: {found.message}"
    motion = found.trajectory
    sample = motion.sample(np.linspace(0.0, motion.duration, SAMPLES))
    series = {"q": sample.q, "v": sample.v, "a": sample.a, "tau": sample.tau}
    if not all(np.isfinite(x).all() for x in (*series.values(), [found.cost])):
        return "samples or the cost are not finite"
    checks: Mapping[str, Callable[[], str]] = {
        "duration": lambda: _duration(asked, motion.duration + elapsed),
        "start": lambda: _start(asked, series, before),
        "goal": lambda: _goal(asked, series, goal),
        "via": lambda: _points(asked, motion, elapsed),
        "limits": lambda: over_limits(asked, series),
        "distances": lambda: distances(asked, motion, elapsed),
        "torques": lambda: _torques(asked, motion, elapsed),
        "tolerance": lambda: _error(asked, found),
    }
    wrong = ((name, check()) for name, check in checks.items())
    return next((f"{name}: {what}" for name, what in wrong if what), "")


def _duration(asked: AskedFeatures, T: float) -> str:
    low, high = (0.5 * TIME, 2.0 * TIME) if asked.has("free duration") else (TIME, TIME)
    if asked.sequence:
        low, high = 1.5 * low, 1.5 * high
    return "" if low - 1e-9 <= T <= high + 1e-9 else f"{T} s"


def _start(asked: AskedFeatures, series: Mapping[str, Array], before: hovi.Solution | None) -> str:
    q, v = asked.q0, np.zeros(asked.robot.nv)
    if before is not None:
        passed = before.trajectory.sample([ELAPSED])
        q, v = passed.q[0], passed.v[0]
    apart = np.abs(asked.robot.difference(q, series["q"][0])).max()
    missed = max(apart, np.abs(series["v"][0] - v).max())
    return "" if missed < SAME else f"missed by {missed:.3g}"


def _goal(asked: AskedFeatures, series: Mapping[str, Array], goal: Array | None) -> str:
    robot, q, speed = asked.robot, series["q"][-1], series["v"][-1].copy()
    apart = robot.difference(q, asked.q1 if goal is None else goal)
    if goal is None and asked.has("free velocity"):
        speed[-1] = 0.0
    if goal is None and asked.has("frame goal"):
        here, there = (robot.frame_position(asked.aim, x) for x in (q, asked.q1))
        apart = here - there
    missed = max(np.abs(apart).max(), np.abs(speed).max())
    return "" if missed < SAME else f"missed by {missed:.3g}"


def _points(asked: AskedFeatures, motion: hovi.Trajectory, elapsed: float) -> str:
    """Whether via points and the ends of segments are passed, at any time of a free duration."""
    points = [(0.5 * TIME, asked.middle)] if asked.sequence else []
    if asked.has("via"):
        points.append((asked.via_time, asked.via_configuration))
    for time, expected in points:
        free = asked.has("free duration")
        times = np.linspace(0.0, motion.duration, SAMPLES) if free else [time - elapsed]
        missed = min(
            np.abs(asked.robot.difference(q, expected)).max() for q in motion.sample(times).q
        )
        if not missed < (PASSED if free else SAME):
            return f"a point is missed by {missed:.3g}"
    return ""


def distances(asked: AskedFeatures, motion: hovi.Trajectory, elapsed: float) -> str:
    """Of balls to each other and to obstacles, at the time since the first motion began."""
    apart = [np.inf]
    times = np.linspace(0.0, motion.duration, 301)
    for t, q in zip(times, motion.sample(times).q, strict=True):
        balls = _balls(asked, q)
        for x in asked.obstacles_at(t + elapsed):
            apart += [float(np.linalg.norm(x - each)) - r - OBSTACLE for _, each, r in balls]
        if asked.has("self-collision"):
            for (i, x, r), (j, y, s) in itertools.combinations(balls, 2):
                if abs(i - j) > 1:
                    apart.append(float(np.linalg.norm(x - y)) - r - s)
    least = min(apart)
    return "" if least > MARGIN - CLOSER else f"{least:.6g} m is less than {MARGIN} m"


def _balls(asked: AskedFeatures, q: Array) -> list[tuple[int, Array, float]]:
    """(number of the link, center, radius) of each ball, with what is grasped."""
    balls = [(i, x, r) for i, (_, x, r) in enumerate(asked.balls(q))]
    if asked.has("grasped"):
        held = asked.robot.frame_pose(asked.robot.tip_frame, q) @ [*asked.held_at, 1.0]
        balls.append((len(balls), held[:3], HELD_RADIUS))
    return balls


def _torques(asked: AskedFeatures, motion: hovi.Trajectory, elapsed: float) -> str:
    sample = motion.sample(times := np.linspace(0.0, motion.duration, 101)[:-1])
    model, data = _model(asked), _model(asked).createData()
    jets = zip(times + elapsed, sample.q, sample.v, sample.a, strict=True)
    expected = np.array([_torque(asked, model, data, *jet) for jet in jets])
    largest = max(float(np.abs(sample.tau).max()), 1e-3)
    wrong = np.abs(sample.tau - expected).max() / largest
    if not wrong < 1e-8:
        return f"torques are off by {wrong:.3g} of the largest"
    if not asked.has("passive joint"):
        return ""
    passive = np.abs(expected[:, -1]).max() / largest
    return "" if passive < 0.02 else f"a passive joint has {passive:.3g} of the largest"


def _model(asked: AskedFeatures) -> pin.Model:
    """The arm with its load and what is grasped, under gravity and without rotors."""
    model = asked.robot.model.copy()
    model.gravity.linear, model.armature = np.array([0.0, 0.0, -9.81]), np.zeros(model.nv)
    tip = model.frames[model.getFrameId(asked.robot.tip_frame)]
    held = pin.SE3(np.eye(3), asked.held_at).act(pin.Inertia.FromSphere(HELD_MASS, HELD_RADIUS))
    load = pin.Inertia(LOAD, np.zeros(3), np.zeros((3, 3)))
    for feature, body in {"grasped": held, "payload": load}.items():
        if asked.has(feature):
            model.appendBodyToJoint(tip.parentJoint, tip.placement.act(body), pin.SE3.Identity())
    return model


def _torque(
    asked: AskedFeatures, model: pin.Model, data: pin.Data, t: float, q: Array, v: Array, a: Array
) -> Array:
    tau = np.array(pin.rnea(model, data, q, v, a))
    if asked.has("friction"):
        tau += VISCOUS * v + COULOMB * np.tanh(v / WIDTH)
    if asked.has("time-dependent effect"):
        tip = model.getFrameId(asked.robot.tip_frame)
        J = pin.computeFrameJacobian(model, data, q, tip, pin.LOCAL_WORLD_ALIGNED)
        tau -= J[:3].T @ [2.0 * np.sin(4.0 * t), 0.0, -1.5 * np.cos(3.0 * t)]
    return tau


def _error(asked: AskedFeatures, found: hovi.Solution) -> str:
    if not asked.has("tolerance") or asked.has("replan") or asked.has("advance"):
        return ""
    if found.accuracy is None:
        return "it was not sought"
    error = found.error_estimate
    return "" if error is not None and error <= 1e-2 else f"the estimated error is {error}"
