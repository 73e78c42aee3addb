"""After `advance`, effects, obstacles, conditions and segments go on with the time that they had.

Judged outside: torques by Pinocchio with what an effect adds at the time since the first motion
began, distances of balls, bounds and limits at that time.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Mapping
from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.conditions.condition import with_function
from hovi.conditions.narrow import features_of
from hovi.discrete.cells import CHANGE
from samples.asked_features import AskedFeatures, planned_with
from samples.feature_judge import distances, judged

Array = np.ndarray
START, GOAL, T = [0.0, 0.0], [1.0, 0.5], 1.2
OPTIONS = {"scheme": "galerkin-2x8", "intervals": 20, "self_collision": False}
MASS = 0.5


@pytest.fixture(scope="module")
def arm() -> hovi.Robot:
    return hovi.load_robot(hovi.example("two_link.urdf"))


def model_of(arm: hovi.Robot, acceleration: float = 0.0, mass: float = 0.0) -> pin.Model:
    """The arm on a base that accelerates along x, with a point mass at its tip."""
    model = arm.model.copy()
    model.armature = np.zeros(model.nv)
    model.gravity.linear = np.array([-acceleration, 0.0, -9.81])
    tip = model.frames[model.getFrameId("tip")]
    load = tip.placement.act(pin.Inertia(mass, np.zeros(3), np.zeros((3, 3))))
    model.appendBodyToJoint(tip.parentJoint, load, pin.SE3.Identity())
    return model


def by_wrench(arm: hovi.Robot, t: float, q: Array, v: Array, a: Array) -> Array:
    model = model_of(arm)
    data = model.createData()
    J = pin.computeFrameJacobian(model, data, q, model.getFrameId("tip"), pin.LOCAL_WORLD_ALIGNED)
    return pin.rnea(model, data, q, v, a) - J[:3].T @ [5.0 * np.sin(4.0 * t), 0.0, 0.0]


def by_base(arm: hovi.Robot, t: float, q: Array, v: Array, a: Array) -> Array:
    model = model_of(arm, -0.2 * 9.0 * np.sin(3.0 * t))
    return pin.rnea(model, model.createData(), q, v, a)


Torque = Callable[[hovi.Robot, float, Array, Array, Array], Array]
TIMED: Mapping[str, tuple[hovi.effects.Effect, Torque]] = {
    "wrench": (hovi.effects.Wrench("tip", ("5*sin(4*t)", 0.0, 0.0)), by_wrench),
    "moving base": (hovi.effects.MovingBase(position=("0.2*sin(3*t)", 0.0, 0.0)), by_base),
}


def apart(found: hovi.Solution, whole: hovi.Solution, elapsed: float) -> float:
    """Largest difference of the configurations of a rest and of its motion."""
    t = np.linspace(0.0, found.trajectory.duration, 200)
    q = whole.trajectory.sample(np.minimum(t + elapsed, whole.trajectory.duration)).q
    return float(np.abs(found.trajectory.sample(t).q - q).max())


def torque_error(motion: hovi.Trajectory, torque: Torque, arm: hovi.Robot, elapsed: float) -> float:
    """Of samples, relative to the largest torque."""
    sample = motion.sample(times := np.linspace(0.0, motion.duration, 101))
    jets = zip(times + elapsed, sample.q, sample.v, sample.a, strict=True)
    expected = np.array([torque(arm, *jet) for jet in jets])
    return float(np.abs(sample.tau - expected).max() / np.abs(expected).max())


@pytest.fixture(scope="module", params=TIMED)
def timed(request: pytest.FixtureRequest, arm: hovi.Robot) -> tuple[hovi.Solution, Torque]:
    effect, torque = TIMED[request.param]
    scene = hovi.Scene(arm, [hovi.effects.Gravity(), effect])
    found = hovi.plan(scene, START, GOAL, T, **OPTIONS)
    assert found.success, found.message
    return found, torque


@pytest.mark.parametrize("elapsed", [0.07, 0.5, 0.93])
def test_effects_see_the_time_since_the_first_motion(
    timed: tuple[hovi.Solution, Torque], arm: hovi.Robot, elapsed: float
) -> None:
    found, torque = timed
    rest = found.advance(elapsed)
    assert rest.success, rest.message
    assert apart(rest, found, elapsed) < 1e-4
    assert torque_error(rest.trajectory, torque, arm, elapsed) < 1e-9
    assert torque_error(rest.trajectory, torque, arm, 0.0) > 1e-3


def test_repeated_advances_add_up_and_disturbances_are_answered(
    timed: tuple[hovi.Solution, Torque], arm: hovi.Robot
) -> None:
    found, torque = timed
    for i in range(1, 6):
        passed = found.trajectory.sample([0.15])
        found = found.advance(0.15, hovi.State(passed.q[0] + 1e-3, passed.v[0] - 1e-3))
        assert found.success, found.message
        assert torque_error(found.trajectory, torque, arm, 0.15 * i) < 1e-9
    assert found.trajectory.scene is not None
    assert found.trajectory.scene.begin == pytest.approx(0.75)
    np.testing.assert_allclose(found.trajectory.q[-1], GOAL, atol=1e-9)


def test_the_rest_is_the_minimum_of_a_motion_that_begins_later(
    timed: tuple[hovi.Solution, Torque],
) -> None:
    """Planned anew in a scene that begins at that time."""
    found, _ = timed
    rest = found.advance(0.5)
    passed, scene = found.trajectory.sample([0.5]), found.trajectory.scene
    assert scene is not None
    later = hovi.Scene(scene.robot, scene.effects, begin=0.5)
    start = hovi.State(passed.q[0], passed.v[0])
    anew = hovi.plan(later, start, GOAL, T - 0.5, **OPTIONS)
    assert rest.cost == pytest.approx(anew.cost, rel=1e-4)


def test_saved_motions_know_when_they_begin(
    timed: tuple[hovi.Solution, Torque], arm: hovi.Robot, tmp_path: Path
) -> None:
    found, torque = timed
    rest = found.advance(0.3).advance(0.2)
    rest.trajectory.save(tmp_path / "rest.npz")
    loaded = hovi.Trajectory.load(tmp_path / "rest.npz")
    assert loaded.scene is not None
    assert loaded.scene.begin == pytest.approx(0.5)
    assert torque_error(loaded, torque, arm, 0.5) < 1e-9
    assert "begin at t = 0.5 s" in loaded.scene.describe()
    pickled = pickle.loads(pickle.dumps(rest.trajectory.scene))
    assert pickled.begin == loaded.scene.begin


def test_a_scene_file_says_when_it_begins(arm: hovi.Robot, tmp_path: Path) -> None:
    scene = hovi.Scene(arm, [hovi.effects.Gravity(), TIMED["wrench"][0]], begin=0.5)
    start, goal = hovi.State(np.array(START)), hovi.State(np.array(GOAL))
    task = hovi.Task(scene, start, goal, T, hovi.PlanOptions(), "later")
    hovi.save_task(task, tmp_path / "later.toml")
    assert hovi.load_task(tmp_path / "later.toml").scene.begin == 0.5


def test_a_cost_that_depends_on_time_goes_on(arm: hovi.Robot) -> None:
    cost = hovi.effects.RunningCost({"fast": "20*exp(-50*(t - 0.6)**2)*dot(v, v)"})
    found = hovi.plan(hovi.Scene(arm, [hovi.effects.Gravity(), cost]), START, GOAL, T, **OPTIONS)
    rest = found.advance(0.45)
    assert rest.success, rest.message
    assert apart(rest, found, 0.45) < 2e-4


def test_a_lagrangian_of_time_goes_on() -> None:
    """q'' follows 1/2 (q'' - 10 sin 5t)^2 plus a cubic: the rest of a minimum is one."""
    q, v, a, t = (ca.SX.sym(name) for name in "qvat")
    L = hovi.CasadiLagrangian([q, v, a], 0.5 * (a - 10.0 * ca.sin(5.0 * t)) ** 2, time=t)
    ld = hovi.DiscreteLagrangian(L, hovi.Grid.uniform(1.0, 10, hovi.schemes.galerkin(3)))
    found = hovi.solve(hovi.TrajectoryProblem(ld, hovi.State([0.0]), hovi.State([1.0])))
    rest = found.advance(0.13).advance(0.2).advance(0.11)
    assert rest.success, rest.message
    assert apart(rest, found, 0.44) < 1e-5


# Obstacles, conditions


@pytest.mark.parametrize("features", [("moving obstacle",), ("moving obstacle", "segments")])
def test_obstacles_go_on_moving(features: tuple[str, ...]) -> None:
    asked = AskedFeatures.of(*features)
    found, elapsed = planned_with(asked), 0.0
    for step in (0.1, 0.25, 0.2):
        before, elapsed = found, elapsed + step
        found = found.advance(step)
        assert found.success, found.message
        assert distances(asked, found.trajectory, elapsed) == ""
        assert apart(found, before, step) < 1e-2


class PowerInTime(hovi.Function):
    """dot(v, v) + 4 t, without CasADi."""

    needs = frozenset({"v", "t"})  # type: ignore[assignment]
    size = 1  # type: ignore[assignment]

    def values(self, at: hovi.Points) -> Array:
        return np.square(at.v).sum(axis=1, keepdims=True) + 4.0 * at.t[:, None]

    def slopes(self, at: hovi.Points) -> Mapping[str, Array]:
        return {"v": 2.0 * at.v[:, None]}

    def curvature(self, at: hovi.Points, weights: Array) -> Mapping[tuple[str, str], Array]:
        n = at.v.shape[1]
        return {("v", "v"): 2.0 * weights[:, :, None] * np.eye(n)}


CONDITIONS = {
    "formula": ("dot(v, v) + 4*t", hovi.Between(upper=6.0)),
    "function": (PowerInTime(), hovi.Between(upper=6.0)),
    "bound": ("dot(v, v)", hovi.Between(upper=lambda t: 6.0 - 4.0 * t)),
}


@pytest.mark.parametrize("kind", CONDITIONS)
def test_conditions_go_on_with_their_time(arm: hovi.Robot, kind: str) -> None:
    function, on = CONDITIONS[kind]
    asked = hovi.Condition(function, on, name="speed", scale=6.0)
    scene = hovi.Scene(arm, [hovi.effects.Gravity()])
    found, elapsed = hovi.plan(scene, START, GOAL, T, conditions=[asked], **OPTIONS), 0.0
    for step in (0.2, 0.35, 0.25):
        before, elapsed = found, elapsed + step
        found = (
            pickle.loads(pickle.dumps(found.advance(step)))
            if kind == "formula"
            else (found.advance(step))
        )
        assert found.success, found.message
        t = np.linspace(0.0, found.trajectory.duration, 2001)
        over = np.square(found.trajectory.sample(t).v).sum(axis=1) - (6.0 - 4.0 * (t + elapsed))
        assert -0.05 < over.max() <= 2e-5
        assert apart(found, before, step) < 2e-3


def test_a_narrow_bound_is_looked_for_at_its_own_time(arm: hovi.Robot) -> None:
    """It dips at 0.7 s for a few milliseconds, where the rest after 0.1 s and 0.2 s has 0.4 s."""

    def most(t: float) -> float:
        return 9.0 - 8.9 * np.exp(-(((t - 0.7) / 0.004) ** 2))

    asked = hovi.Condition("dot(v, v) + t", hovi.Between(upper=most), name="dip", scale=9.0)
    rest = with_function(asked, arm).from_time(0.1).from_time(0.2)
    found = features_of(rest)
    assert found.enclosed is not None
    assert found.sampled == ""
    box = [(np.full((1, n), x),) * 2 for n, x in ((2, 1.0), (1, 0.4))]
    over = found.enclosed(box, CHANGE).upper
    assert over == pytest.approx((2.7 - most(0.7)) / 9.0, abs=1e-9)
    np.testing.assert_allclose(rest.on.at(np.array([0.4]), 1)[1], most(0.7))


def test_values_at_times_go_on(arm: hovi.Robot) -> None:
    """At a time on the way and at the end, of a function of time."""
    first, last = (arm.frame_position("tip", np.array(q))[2] for q in ([0.7, 0.2], [1.2, 0.4]))
    rate = float(last - first) / 0.6
    formula, value = f'position["tip", "z"] - {rate}*t', float(first - 0.6 * rate)
    at = hovi.AtTimes([0.6, T])
    height = hovi.Condition(formula, hovi.Equal(value), at, name="height")
    goal = hovi.State(np.array([1.2, 0.0]), free=("elbow",), free_velocity=("elbow",))
    scene = hovi.Scene(arm, [hovi.effects.Gravity()])
    found = hovi.plan(scene, START, goal, T, limits="none", conditions=[height], **OPTIONS)
    assert found.success, found.message
    for elapsed in (0.3, 0.9):
        rest = found.advance(elapsed)
        assert rest.success, rest.message
        for t in (t for t in (0.6, T) if t > elapsed):
            q = rest.trajectory.sample([t - elapsed]).q[0]
            assert arm.frame_position("tip", q)[2] == pytest.approx(rate * t + value, abs=1e-6)


# Segments


@pytest.fixture(scope="module")
def sequence(arm: hovi.Robot) -> hovi.Solution:
    """Reach; carry a mass, with a velocity limit of its own that it reaches; return."""
    e = hovi.effects
    found = hovi.plan_sequence(
        hovi.Scene(arm, [e.Gravity()]),
        START,
        [
            hovi.Segment([0.4, 0.3], 0.5, name="reach"),
            hovi.Segment(
                [0.9, -0.2],
                0.8,
                effects=[e.Payload("tip", MASS)],
                limits={"base": "none", "v": 0.95},
                name="carry",
            ),
            hovi.Segment(START, 0.9, name="return"),
        ],
        limits={"base": "none", "v": 2.5},
        scheme="galerkin-2x8",
        intervals=22,
        self_collision=False,
    )
    assert found.success, found.message
    return found


@pytest.mark.parametrize("elapsed", [0.2, 0.47, 0.5, 0.75, 1.27, 1.3, 1.8])
def test_segments_that_have_passed_are_dropped(
    sequence: hovi.Solution, arm: hovi.Robot, elapsed: float
) -> None:
    rest = sequence.advance(elapsed)
    assert rest.success, rest.message
    assert apart(rest, sequence, elapsed) < 1e-4
    assert_carried(rest, arm, elapsed)
    left = sum(end > elapsed + 1e-9 for end in (0.5, 1.3, 2.2))
    segments = rest.trajectory.segments
    assert (1 if segments is None else len(segments.scenes)) == left
    if segments is not None:
        names = rest.trajectory.metadata["segment_names"]
        assert names == ["reach", "carry", "return"][-left:]


def assert_carried(motion: hovi.Solution, arm: hovi.Robot, elapsed: float) -> None:
    """Torques with the load in its segment alone, and the limits of both kinds of segments."""
    times = np.linspace(0.0, motion.trajectory.duration, 1500)
    sample, now = motion.trajectory.sample(times), times + elapsed
    carried = (now > 0.5) & (now < 1.3)
    seam = np.minimum(np.abs(now - 0.5), np.abs(now - 1.3)) < 1e-6
    for loaded in (False, True):
        model = model_of(arm, mass=MASS if loaded else 0.0)
        data, here = model.createData(), (carried == loaded) & ~seam
        jets = zip(sample.q[here], sample.v[here], sample.a[here], strict=True)
        expected = np.array([pin.rnea(model, data, *jet) for jet in jets]).reshape(-1, 2)
        np.testing.assert_allclose(sample.tau[here], expected, atol=1e-8)
        most = 0.95 if loaded else 2.5
        assert np.abs(sample.v[here]).max(initial=0.0) <= most * (1.0 + 4e-6)


def test_a_disturbed_sequence_goes_on(sequence: hovi.Solution, arm: hovi.Robot) -> None:
    found, elapsed = sequence, 0.0
    for step in (0.3, 0.3, 0.35, 0.4):
        passed, elapsed = found.trajectory.sample([step]), elapsed + step
        found = found.advance(step, hovi.State(passed.q[0] + 5e-4, 0.999 * passed.v[0]))
        assert found.success, found.message
        assert_carried(found, arm, elapsed)
    np.testing.assert_allclose(found.trajectory.q[-1], START, atol=1e-9)


def test_another_duration_stretches_the_segments(sequence: hovi.Solution) -> None:
    rest = sequence.advance(0.2, duration=4.0)
    assert rest.success, rest.message
    for end, goal in ((0.5, [0.4, 0.3]), (1.3, [0.9, -0.2])):
        passed = rest.trajectory.sample([(end - 0.2) * 2.0])
        np.testing.assert_allclose(passed.q[0], goal, atol=1e-9)
        np.testing.assert_allclose(passed.v[0], 0.0, atol=1e-9)


def test_everything_at_once_goes_on() -> None:
    asked = AskedFeatures.of("limits", "segments", "moving obstacle", "time-dependent effect")
    found = planned_with(asked)
    assert judged(asked, found) == ""
    assert judged(asked, found.advance(0.25), elapsed=0.25, before=found) == ""
