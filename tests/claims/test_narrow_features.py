"""No success claims a cost that narrow features of its effects refute by more than its estimate.

Pulses, steps and walls of t, q and v, from 1e-2 s down to 1e-5 s. What a motion costs is the
integral along its curve by Gauss points in parts that are graded to the feature, with torques by
pin.rnea and effects in NumPy.
"""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

import hovi

E = hovi.effects
ROBOT = hovi.load_robot(hovi.example("two_link.urdf"))
GRAVITY = 9.8
T = 1.5
START, GOAL = [-1.2, 0.3], [0.9, 0.8]
ORACLE = 2e-6
"""Relative accuracy of the integral."""
Array = np.ndarray


@dataclass(frozen=True)
class Case:
    """An effect that changes where y(t, q, v) is within a few widths of a center.

    density: (t, sample, tau of gravity and inertia) -> the Lagrangian at those times.
    """

    name: str
    effect: object
    y: Callable[[Array, Any], Array]
    center: float
    width: float
    density: Callable[[Array, Any, Array], Array]


def gauss(y: Array, c: float, w: float) -> Array:
    return np.exp(-(((y - c) / w) ** 2))


def time(t: Array, z: Any) -> Array:
    return t


def shoulder(t: Array, z: Any) -> Array:
    return z.q[:, 0]


def speed(t: Array, z: Any) -> Array:
    return z.v[:, 0]


def half_square(tau: Array) -> Array:
    return 0.5 * np.sum(tau**2, axis=1)


def tip_torque(q: Array, force: Array) -> Array:
    """J^T f of a force (M,) along z at the tip."""
    model, data = ROBOT.model, ROBOT.model.createData()
    frame = model.getFrameId("tip")
    rows = [
        pin.computeFrameJacobian(model, data, x, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)[2]
        for x in q
    ]
    return np.array(rows) * force[:, None]


def force(c: float, w: float, shape: str, f: Callable[[Array], Array], name: str) -> Case:
    return Case(
        name,
        E.Wrench("tip", force=["0", "0", shape]),
        time,
        c,
        w,
        lambda t, z, tau: half_square(tau - tip_torque(z.q, f(t))),
    )


def pulse(c: float, w: float) -> Case:
    A = 0.4 / w
    return force(
        c, w, f"{A}*exp(-((t-{c})/{w})**2)", lambda t: A * gauss(t, c, w), "pulse of force"
    )


def step(c: float, w: float) -> Case:
    return force(c, w, f"6*tanh((t-{c})/{w})", lambda t: 6 * np.tanh((t - c) / w), "step of force")


def two_pulses(c: float, w: float) -> Case:
    other = T - c
    A = 0.2 / w
    found = force(
        c,
        w,
        f"{A}*exp(-((t-{c})/{w})**2) - {A}*exp(-((t-{other})/{w})**2) + 3*sin(2*pi*t)",
        lambda t: A * (gauss(t, c, w) - gauss(t, other, w)) + 3 * np.sin(2 * np.pi * t),
        "two pulses of force",
    )
    return Case(
        found.name,
        found.effect,
        lambda t, z: np.where(np.abs(t - c) < np.abs(t - other), t, t - other + c),
        c,
        w,
        found.density,
    )


def jolt(c: float, w: float) -> Case:
    A = 0.02 * w

    def density(t: Array, z: Any, tau: Array) -> Array:
        u = (t - c) / w
        lift = A / w**2 * (4 * u**2 - 2) * np.exp(-(u**2))
        weight = [pin.computeGeneralizedGravity(MODEL, MODEL.createData(), q) for q in z.q]
        return half_square(tau + np.array(weight) * lift[:, None] / GRAVITY)

    effect = E.MovingBase(position=["0", "0", f"{A}*exp(-((t-{c})/{w})**2)"])
    return Case("jolt of the base", effect, time, c, w, density)


def cost(
    name: str, y: Callable[[Array, Any], Array], formula: str, c: float, w: float, A: float
) -> Case:
    more = "*v['shoulder']**2" if y is time else ""
    text = f"{A}*exp(-(({formula}-{c})/{w})**2){more}"

    def density(t: Array, z: Any, tau: Array) -> Array:
        factor = z.v[:, 0] ** 2 if y is time else 1.0
        return half_square(tau) + A * gauss(y(t, z), c, w) * factor

    return Case(name, E.RunningCost({"x": text}), y, c, w, density)


def reference(c: float, w: float) -> Case:
    def density(t: Array, z: Any, tau: Array) -> Array:
        r = 0.4 * np.tanh((t - c) / w)
        return half_square(tau) + 20 * (z.q[:, 0] - r) ** 2

    effect = E.ReferenceCost({"shoulder": f"0.4*tanh((t-{c})/{w})"}, 40.0)
    return Case("step of a reference", effect, time, c, w, density)


def friction(c: float, w: float) -> Case:
    def density(t: Array, z: Any, tau: Array) -> Array:
        return half_square(tau + 3.0 * np.tanh(z.v / w))

    def slower(t: Array, z: Any) -> Array:
        """The velocity of the joint that is nearest to standing still."""
        return np.take_along_axis(z.v, np.abs(z.v).argmin(axis=1)[:, None], axis=1)[:, 0]

    effect = E.DryFriction(coulomb=3.0, width=w)
    return Case("dry friction", effect, slower, 0.0, w, density)


def wall(c: float, w: float) -> Case:
    def density(t: Array, z: Any, tau: Array) -> Array:
        return half_square(tau) + 8 * (1 + np.tanh((z.q[:, 0] - c) / w))

    text = f"8*(1+tanh((q['shoulder']-{c})/{w}))"
    return Case("step of a cost in q", E.Custom(cost=text), shoulder, c, w, density)


MODEL = ROBOT.model.copy()
MODEL.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
OF_TIME: list[Callable[[float, float], Case]] = [
    pulse,
    step,
    two_pulses,
    jolt,
    reference,
    lambda c, w: cost("cost in t", time, "t", c, w, 10 / w),
]
OF_STATE: list[Callable[[float, float], Case]] = [
    lambda c, w: cost("cost in q", shoulder, "q['shoulder']", c, w, 60 / w),
    lambda c, w: cost("cost in v", speed, "v['shoulder']", 0.5 + 0.3 * c, w, 60 / w),
    friction,
    wall,
]


def parts(case: Case, motion: hovi.Trajectory) -> Array:
    """Ends of parts of time in which y changes by at most half a width near the center."""
    nodes = np.unique(np.concatenate([motion.t, np.linspace(0, T, 4001)]))
    for _ in range(30):
        y = case.y(nodes, motion.sample(nodes))
        low, high = np.minimum(y[1:], y[:-1]), np.maximum(y[1:], y[:-1])
        near = (high > case.center - 9 * case.width) & (low < case.center + 9 * case.width)
        cut = near & (high - low > case.width / 2)
        if not cut.any():
            break
        nodes = np.sort(np.concatenate([nodes, 0.5 * (nodes[1:] + nodes[:-1])[cut]]))
    return nodes


def along(case: Case, motion: hovi.Trajectory) -> float:
    """The integral of the Lagrangian along the curve."""
    nodes = parts(case, motion)
    x, weights = np.polynomial.legendre.leggauss(6)
    h = np.diff(nodes)
    t = (nodes[:-1, None] + h[:, None] * (x + 1) / 2).ravel()
    z, data = motion.sample(t), MODEL.createData()
    tau = np.array([pin.rnea(MODEL, data, *row) for row in zip(z.q, z.v, z.a, strict=True)])
    values = case.density(t, z, tau).reshape(len(h), -1)
    return float(h @ (values @ weights) / 2)


def planned(case: Case, **options: object) -> hovi.Solution:
    scene = hovi.Scene(ROBOT, [E.Gravity(GRAVITY), case.effect])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        given = {"limits": "none", "self_collision": False, "time_limit": 20.0} | options
        return hovi.plan(scene, START, GOAL, T, **given)


def assert_honest(case: Case, found: hovi.Solution) -> None:
    """A success costs what it claims; anything else has a sentence."""
    if not found.success:
        assert found.message
        return
    true = along(case, found.trajectory)
    assert found.error_estimate is not None
    allowed = max(found.error_estimate, ORACLE) * abs(found.cost)
    assert abs(true - found.cost) <= allowed, (case.name, case.width, found.cost, true)


def family(seed: int, count: int) -> Iterator[tuple[Case, dict[str, object]]]:
    """Cases of all kinds and widths, with options."""
    random = np.random.default_rng(seed)
    kinds = OF_TIME + OF_STATE
    for i in range(count):
        width = float(10 ** random.uniform(-5, -2))
        case = kinds[i % len(kinds)](float(random.uniform(0.2, 0.6)), width)
        limits = {"limits": "none" if random.random() < 0.6 else "urdf"}
        more = [{}, {"tolerance": 1e-6}, {"intervals": 24}, {}][int(random.integers(4))]
        yield case, limits | more


@pytest.mark.parametrize("make", OF_TIME)
@pytest.mark.parametrize("width", [2e-3, 3e-5])
def test_features_of_time_are_found_and_paid_for(
    make: Callable[[float, float], Case], width: float
) -> None:
    case = make(0.4231, width)
    found = planned(case)
    assert found.success, found.message
    assert_honest(case, found)


@pytest.mark.parametrize(
    ("make", "width", "tolerance"), [(pulse, 2e-4, 1e-6), (jolt, 2e-4, 1e-6), (friction, 0.3, 1e-5)]
)
def test_a_smaller_tolerance_holds_along_the_curve(
    make: Callable[[float, float], Case], width: float, tolerance: float
) -> None:
    case = make(0.7123, width)
    found = planned(case, tolerance=tolerance)
    assert found.success, found.message
    assert found.accuracy.reached
    assert abs(along(case, found.trajectory) / found.cost - 1) <= tolerance + ORACLE


@pytest.mark.parametrize("make", OF_TIME + OF_STATE)
def test_a_given_grid_without_nodes_there_claims_no_more(
    make: Callable[[float, float], Case],
) -> None:
    case = make(0.4231, 1e-4)
    found = planned(case, intervals=16)
    assert_honest(case, found)
    if case.name.split()[0] in ("pulse", "two", "jolt", "cost"):
        assert not found.success


@pytest.mark.parametrize("make", OF_STATE)
@pytest.mark.parametrize("width", [1e-1, 1e-3])
def test_features_of_the_state_are_paid_for_or_said(
    make: Callable[[float, float], Case], width: float
) -> None:
    case = make(0.4231, width)
    assert_honest(case, planned(case))


@pytest.mark.parametrize(("height", "weight"), [(0.1, 1.0), (-0.1, 1.0), (0.1, 1e-4)])
def test_a_thin_wall_in_q_that_the_first_grid_misses_gets_nodes(
    height: float, weight: float
) -> None:
    """Also where it costs hardly more than the tolerance, or less than nothing, in any unit."""
    width, center = 1e-3, 0.4231
    of_unit, weighted = (
        cost("cost in q", shoulder, "q['shoulder']", center, width, height * unit / width)
        for unit in (1.0, weight)
    )
    found = planned(weighted, weight=[weight, weight])
    assert found.success, found.message
    assert found.error_estimate is not None
    assert found.error_estimate < 1e-3
    true = weight * along(of_unit, found.trajectory)
    assert found.cost == pytest.approx(true, rel=max(found.error_estimate, ORACLE))
    near = np.abs(found.trajectory.q[:, 0] - center) < 9 * width
    assert near.sum() > 0.75 * len(near)


def test_what_no_grid_resolves_is_said_at_once() -> None:
    fast = E.Wrench("tip", force=["0", "0", "5*sin(2*pi*10000*t)"])
    thin = E.Wrench("tip", force=["0", "0", "9e6*exp(-((t-0.3331)/1e-8)**2)"])
    for effect in (fast, thin):
        scene = hovi.Scene(ROBOT, [E.Gravity(GRAVITY), effect])
        found = hovi.plan(scene, START, GOAL, T, limits="none", self_collision=False)
        assert not found.success
        assert found.status == "unresolved"
        assert "'wrench' changes within less than" in found.message
    segments = [hovi.Segment([0.2, 0.5], 0.8), hovi.Segment(GOAL, 0.7, effects=[fast])]
    scene = hovi.Scene(ROBOT, [E.Gravity(GRAVITY)])
    found = hovi.plan_sequence(scene, START, segments, limits="none", self_collision=False)
    assert found.status == "unresolved"
    assert "'wrench' changes within less than" in found.message


def test_replanned_motions_are_looked_at_again() -> None:
    """A motion that does not reach a wall is a guess for one that does."""
    case = cost("cost in q", shoulder, "q['shoulder']", 1.2, 1e-3, 6e4)
    found = planned(case)
    assert found.success
    again = found.replan(goal=[1.4, 0.8])
    assert_honest(case, again)
    assert not again.success


def test_motions_near_one_that_was_resolved_are_looked_at_again() -> None:
    case = cost("cost in q", shoulder, "q['shoulder']", 0.91, 1e-3, 6e4)
    found = planned(case)
    assert found.success
    near = found.replan(goal=[0.93, 0.8])
    assert_honest(case, near)
    assert not near.success


def test_a_pulse_in_a_segment_of_a_sequence_is_paid_for() -> None:
    case, end = pulse(1.1, 1e-4), 0.8
    scene = hovi.Scene(ROBOT, [E.Gravity(GRAVITY)])
    segments = [
        hovi.Segment([0.2, 0.5], end),
        hovi.Segment(GOAL, T - end, effects=[case.effect]),
    ]
    options = {"limits": "none", "self_collision": False}
    found = hovi.plan_sequence(scene, START, segments, **options)
    assert found.success
    assert_honest(case, found)
    assert not hovi.plan_sequence(scene, START, segments, intervals=20, **options).success


def test_motions_in_a_scene_of_pulses_are_replanned_on_their_nodes() -> None:
    case = pulse(0.7123, 1e-4)
    again = planned(case).replan(goal=[1.4, 0.8])
    assert again.success
    assert_honest(case, again)


def test_an_expression_without_bounds_is_said_to_be_sampled() -> None:
    case = cost("cost in q", shoulder, "q['shoulder']", 0.1, 1e-3, 6e4)
    formula = E.CasadiCost(lambda q, v, a, tau, t: 6e4 * ca.exp(-(((q[0] - 0.1) / 1e-3) ** 2)))
    unbounded = E.CasadiCost(lambda q, v, a, tau, t: ca.erf(q[0] / 0.3) ** 2)
    thin = planned(dataclasses.replace(case, effect=formula), intervals=16)
    assert not thin.success
    assert "has no bounds" not in thin.message
    smooth = planned(dataclasses.replace(case, effect=unbounded))
    assert smooth.success
    assert "Between 2,000 instants effect 'casadi_cost' has no bounds" in smooth.message


@pytest.mark.long
@pytest.mark.parametrize("number", range(40))
def test_no_success_of_the_family_is_off_by_more_than_its_estimate(number: int) -> None:
    case, options = list(family(40, 40))[number]
    assert_honest(case, planned(case, **options))


@pytest.mark.parametrize("seconds", [0.3, 0.6, 1.0, 1.5])
def test_a_time_limit_during_another_look_is_no_error(seconds: float) -> None:
    case = cost("cost in v", speed, "v['shoulder']", 0.6, 1e-3, 6e4)
    assert_honest(case, planned(case, limits="urdf", time_limit=seconds))
