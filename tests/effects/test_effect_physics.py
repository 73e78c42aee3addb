"""Effects against oracles: Pinocchio's own algorithms, welded URDFs, SciPy's integrators."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

from hovi import plan
from hovi.discrete.state import State
from hovi.effects import (
    AccelerationCost,
    Armature,
    Custom,
    Drag,
    DryFriction,
    Effect,
    EffortWeight,
    Gravity,
    JointLimitPotential,
    JointSprings,
    MovingBase,
    Payload,
    PowerCost,
    ReferenceCost,
    ViscousFriction,
    Wrench,
)
from hovi.flows.execution.tracking import play
from hovi.flows.simulator import simulate
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]
Jet = tuple[Array, Array, Array, Array]


def points(model: pin.Model, count: int = 6) -> Jet:
    random = np.random.default_rng(model.nv)
    dq, v, a = random.normal(size=(3, count, model.nv))
    q = np.stack([pin.integrate(model, pin.neutral(model), x) for x in dq])
    return q, v, a, random.uniform(0.1, 2.0, count)


def earthly(robot: Robot) -> pin.Model:
    """Pinocchio's model with its default gravity, without armature."""
    model = robot.model.copy()
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    model.armature = np.zeros(model.nv)
    return model


def assert_close(found: Array, expected: Array, tolerance: float = 1e-12) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * np.abs(expected).max())


# What becomes part of the model


def welded(urdf: str, parent: str, payload: Payload, place: pin.SE3) -> str:
    """The URDF with a body of the payload's mass on a fixed joint."""
    root = ElementTree.fromstring(urdf)
    xyz = " ".join(f"{x:.17g}" for x in place.translation)
    rpy = " ".join(f"{x:.17g}" for x in pin.rpy.matrixToRpy(place.rotation))
    xx, yy, zz, xy, xz, yz = payload.inertia
    center = " ".join(str(x) for x in payload.center)
    root.append(
        ElementTree.fromstring(
            f'<link name="weight"><inertial><origin xyz="{center}" rpy="0 0 0"/>'
            f'<mass value="{payload.mass}"/><inertia ixx="{xx}" iyy="{yy}" izz="{zz}" '
            f'ixy="{xy}" ixz="{xz}" iyz="{yz}"/></inertial></link>'
        )
    )
    root.append(
        ElementTree.fromstring(
            f'<joint name="weld" type="fixed"><parent link="{parent}"/><child link="weight"/>'
            f'<origin xyz="{xyz}" rpy="{rpy}"/></joint>'
        )
    )
    return ElementTree.tostring(root, encoding="unicode")


@pytest.mark.parametrize("name", ["two_link", "ur5", "panda"])
def test_a_payload_is_a_mass_welded_to_the_urdf(request: pytest.FixtureRequest, name: str) -> None:
    robot: Robot = request.getfixturevalue(name)
    payload = Payload(
        robot.tip_frame, 1.7, (0.02, -0.03, 0.1), (5e-3, 6e-3, 7e-3, 1e-3, -2e-3, 5e-4)
    )
    assert robot.source.urdf is not None
    text = welded(robot.source.urdf, robot.tip_frame, payload, pin.SE3.Identity())
    model = pin.buildModelFromXML(text)
    locked = [model.getJointId(joint) for joint in robot.source.locked]
    model = pin.buildReducedModel(model, locked, pin.neutral(model))
    model.armature = np.zeros(model.nv)
    data = model.createData()
    q, v, a, _ = points(model)
    expected = np.stack([pin.rnea(model, data, *x) for x in zip(q, v, a, strict=True)])
    assert_close(Scene(robot, [Gravity(), payload]).inverse_dynamics(q, v, a), expected)
    bare = Scene(robot, [Gravity()]).inverse_dynamics(q, v, a)
    assert np.abs(bare - expected).max() > 1


def test_armature_matches_the_model(panda: Robot) -> None:
    inertia = np.linspace(0.05, 0.2, panda.nv)
    model = earthly(panda)
    model.armature = inertia
    data = model.createData()
    q, v, a, _ = points(model)
    expected = np.stack([pin.rnea(model, data, *x) for x in zip(q, v, a, strict=True)])
    scene = Scene(panda, [Gravity(), Armature(tuple(inertia))])
    assert_close(scene.inverse_dynamics(q, v, a), expected)
    from_model = Scene(load_robot(model), [Gravity(), Armature(from_urdf=True)])
    assert_close(from_model.inverse_dynamics(q, v, a), expected)


def test_gravity_acts_in_any_direction(ur5: Robot) -> None:
    model = earthly(ur5)
    model.gravity.linear = 2.0 * np.array([0.6, 0.0, -0.8])
    data = model.createData()
    q, v, a, _ = points(model)
    expected = np.stack([pin.rnea(model, data, *x) for x in zip(q, v, a, strict=True)])
    found = Scene(ur5, [Gravity(2.0, (3.0, 0.0, -4.0))]).inverse_dynamics(q, v, a)
    assert_close(found, expected)


# Forces on frames


@pytest.mark.parametrize("axes", ["world", "frame"])
@pytest.mark.parametrize(("name", "floats"), [("panda", False), ("kinova", False), ("solo8", True)])
def test_a_wrench_matches_an_external_force_of_rnea(name: str, floats: bool, axes: str) -> None:
    robot = load_robot(name, free_flyer=floats)
    frame = robot.tip_frame
    scene = Scene(
        robot, [Gravity(), Wrench(frame, (3.0, "10*t", -2.0), (0.5, "cos(t)", "t**2"), axes)]
    )
    model = earthly(robot)
    data, index = model.createData(), model.getFrameId(frame)
    q, v, a, t = points(model)
    expected = []
    for qi, vi, ai, ti in zip(q, v, a, t, strict=True):
        f, m = np.array([3.0, 10 * ti, -2.0]), np.array([0.5, np.cos(ti), ti**2])
        pin.framesForwardKinematics(model, data, qi)
        R = data.oMf[index].rotation if axes == "world" else np.eye(3)
        outside = [pin.Force.Zero() for _ in range(model.njoints)]
        at_frame = pin.Force(R.T @ f, R.T @ m)
        joint = model.frames[index].parentJoint
        outside[joint] = model.frames[index].placement.act(at_frame)
        expected.append(pin.rnea(model, data, qi, vi, ai, outside))
    assert_close(scene.inverse_dynamics(q, v, a, t), np.stack(expected))


@pytest.mark.parametrize("name", ["panda", "kinova"])
def test_drag_matches_its_formula_and_the_frame_jacobian(name: str) -> None:
    robot = load_robot(name)
    frame, model = robot.tip_frame, earthly(load_robot(name))
    effect = Drag(frame, 0.3, 1.2, 0.4, (1.0, "t", -2.0), width=0.05)
    data, index = model.createData(), model.getFrameId(frame)
    q, v, a, t = points(model)
    expected = []
    for qi, vi, ai, ti in zip(q, v, a, t, strict=True):
        tau = pin.rnea(model, data, qi, vi, ai)
        J = pin.computeFrameJacobian(model, data, qi, index, pin.LOCAL_WORLD_ALIGNED)[:3]
        u = J @ vi - np.array([1.0, ti, -2.0])
        speed = np.sqrt(u @ u + 0.05**2) - 0.05
        expected.append(tau + J.T @ ((0.5 * 1.2 * 0.3 * speed + 0.4) * u))
    found = Scene(robot, [Gravity(), effect]).inverse_dynamics(q, v, a, t)
    assert_close(found, np.stack(expected), 1e-11)


# A moving base


def base_motion(t: float) -> pin.SE3:
    """The motion that MOVED prescribes, implemented independently."""
    position = np.array([0.2 * np.sin(2 * t), 0.1 * t**2, 0.05 * np.cos(3 * t)])
    return pin.SE3(pin.rpy.rpyToMatrix(0.3 * np.sin(t), -0.2 * t, 0.5 * t), position)


MOVED = MovingBase(("0.2*sin(2*t)", "0.1*t**2", "0.05*cos(3*t)"), ("0.3*sin(t)", "-0.2*t", "0.5*t"))
STENCIL = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])


def slope(f: Callable[[float], Array], t: float, h: float = 0.02) -> Array:
    """df/dt by finite differences of eighth order."""
    values = [f(t + k * h) for k in range(-4, 5)]
    return np.asarray(np.tensordot(STENCIL, np.stack(values), 1) / h)


def base_twist(t: float) -> Array:
    """Velocity of the base in its own frame."""
    here = base_motion(t)
    return slope(lambda s: pin.log6(here.actInv(base_motion(s))).vector, t)


def floating_jet(t: float, q: Array, v: Array, a: Array) -> Jet:
    """The state of the robot on a floating base that follows the motion."""
    qb = pin.SE3ToXYZQUAT(base_motion(t))
    return (
        np.concatenate([qb, q]),
        np.concatenate([base_twist(t), v]),
        np.concatenate([slope(base_twist, t), a]),
        np.array(t),
    )


@pytest.mark.parametrize("name", ["two_link", "panda", "kinova", "z1"])
def test_a_moving_base_matches_a_driven_floating_robot(name: str, models: Path) -> None:
    place = models / "two_link.urdf" if name == "two_link" else name
    robot, floating = load_robot(place), load_robot(place, free_flyer=True)
    model = earthly(floating)
    data = model.createData()
    q, v, a, t = points(robot.model)
    rows = []
    for one in zip(t, q, v, a, strict=True):
        rows.append(pin.rnea(model, data, *floating_jet(*one)[:3])[6:])
    assert_close(
        Scene(robot, [Gravity(), MOVED]).inverse_dynamics(q, v, a, t), np.stack(rows), 1e-8
    )


@pytest.mark.parametrize("effect", ["wrench", "drag"])
def test_frame_forces_include_the_moving_base(panda: Robot, effect: str) -> None:
    tip = panda.tip_frame
    acting: dict[str, Effect] = {
        "wrench": Wrench(tip, (3.0, -2.0, 1.0), (0.3, 0.0, 0.2), "frame"),
        "drag": Drag(tip, 0.3, wind=(1.0, 0.0, 2.0)),
    }
    floating = load_robot("panda", free_flyer=True, locked=panda.source.locked)
    q, v, a, t = points(panda.model)
    found = Scene(panda, [MOVED, acting[effect]]).inverse_dynamics(q, v, a, t)
    jets = [floating_jet(*one) for one in zip(t, q, v, a, strict=True)]
    columns = [np.stack(column) for column in zip(*jets, strict=True)]
    expected = Scene(floating, [acting[effect]]).inverse_dynamics(*columns)[:, 6:]
    assert_close(found, expected, 1e-8)


def test_a_simulation_on_a_moving_base_matches_a_driven_floating_robot(
    two_link: Robot, models: Path
) -> None:
    scene = Scene(two_link, [Gravity(), MOVED, ViscousFriction(0.2)])
    motion = simulate(scene, State([0.3, -0.2], [0.1, 0.4]), 1.0, intervals=100, inner_modes=1)
    model = earthly(load_robot(models / "two_link.urdf", free_flyer=True))
    data = model.createData()

    def rate(t: float, y: Array) -> Array:
        q, v = np.split(y, 2)
        qb, vb, ab, _ = floating_jet(t, q, v, np.zeros(2))
        bias = pin.rnea(model, data, qb, vb, ab)[6:] + 0.2 * v
        M = np.array(pin.crba(model, data, qb))[6:, 6:]
        M = np.triu(M) + np.triu(M, 1).T
        return np.concatenate([v, np.linalg.solve(M, -bias)])

    end = solve_ivp(rate, (0, 1), [0.3, -0.2, 0.1, 0.4], "DOP853", rtol=1e-9, atol=1e-9).y[:, -1]
    np.testing.assert_allclose(np.concatenate([motion.q[-1], motion.v[-1]]), end, atol=1e-6)


# Friction, springs, stops


def falling(robot: Robot, resistance: Callable[[Array, Array], Array], y0: Array) -> Array:
    """(q, v) after one second, by SciPy and Pinocchio's articulated-body algorithm."""
    model = earthly(robot)
    data = model.createData()

    def rate(t: float, y: Array) -> Array:
        q, v = np.split(y, 2)
        return np.concatenate([v, pin.aba(model, data, q, v, -resistance(q, v))])

    return np.asarray(solve_ivp(rate, (0, 1), y0, "DOP853", rtol=1e-11, atol=1e-11).y[:, -1])


FRICTIONS: dict[str, tuple[Effect, Callable[[Array, Array], Array]]] = {
    "viscous": (
        ViscousFriction((0.3, 0.1)),
        lambda q, v: np.array([0.3, 0.1]) * v,
    ),
    "dry": (
        DryFriction(0.4, (0.6, 0.5), 0.3, 0.1),
        lambda q, v: (0.4 + np.array([0.2, 0.1]) * np.exp(-((v / 0.3) ** 2))) * np.tanh(v / 0.1),
    ),
    "springs": (
        JointSprings((3.0, 1.0), {"elbow": 0.7}),
        lambda q, v: np.array([3.0 * q[0], q[1] - 0.7]),
    ),
    "custom": (
        Custom({"elbow": '(2 + sin(q["shoulder"]))*v["elbow"]'}),
        lambda q, v: np.array([0.0, (2 + np.sin(q[0])) * v[1]]),
    ),
}


@pytest.mark.parametrize("kind", FRICTIONS)
def test_a_resisted_fall_matches_scipy(two_link: Robot, kind: str) -> None:
    effect, resistance = FRICTIONS[kind]
    y0 = np.array([0.2, -0.4, 0.5, 0.3])
    scene = Scene(two_link, [Gravity(), effect])
    motion = simulate(scene, State(y0[:2], y0[2:]), 1.0, intervals=200, inner_modes=2)
    found = np.concatenate([motion.q[-1], motion.v[-1]])
    np.testing.assert_allclose(found, falling(two_link, resistance, y0), rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("effect", "inertia"),
    [
        (Armature(0.3), lambda q: 0.3 * np.eye(2)),
        (Custom({"shoulder": '0.3*a["shoulder"]'}), lambda q: np.diag([0.3, 0.0])),
        (
            Custom({"elbow": '(1 + cos(q["shoulder"]))*a["elbow"]'}),
            lambda q: np.diag([0.0, 1 + np.cos(q[0])]),
        ),
    ],
    ids=["armature", "constant", "of the angle"],
)
def test_torque_terms_in_the_acceleration_are_added_to_the_mass_matrix(
    two_link: Robot, effect: Effect, inertia: Callable[[Array], Array]
) -> None:
    model = earthly(two_link)
    data = model.createData()

    def rate(t: float, y: Array) -> Array:
        q, v = np.split(y, 2)
        bias = pin.nonLinearEffects(model, data, q, v)
        M = np.triu(pin.crba(model, data, q))
        M = M + np.triu(M, 1).T + inertia(q)
        return np.concatenate([v, np.linalg.solve(M, -bias)])

    y0 = [0.2, -0.4, 0.5, 0.3]
    expected = solve_ivp(rate, (0, 1), y0, "DOP853", rtol=1e-11, atol=1e-11).y[:, -1]
    scene = Scene(two_link, [Gravity(), effect])
    motion = simulate(scene, State(y0[:2], y0[2:]), 1.0, intervals=100, inner_modes=2)
    found = np.concatenate([motion.q[-1], motion.v[-1]])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7)


def test_a_spring_oscillates_at_its_natural_frequency(pendulum: Robot) -> None:
    (joint,) = pendulum.joint_names
    model = earthly(pendulum)
    inertia = float(pin.crba(model, model.createData(), np.zeros(1))[0, 0])
    scene = Scene(pendulum, [JointSprings(5.0, {joint: 0.4})])
    period = 2 * np.pi * np.sqrt(inertia / 5.0)
    motion = simulate(scene, State([1.0]), period, intervals=200, inner_modes=2)
    expected = 0.4 + 0.6 * np.cos(2 * np.pi * motion.t / period)
    np.testing.assert_allclose(motion.q[:, 0], expected, atol=1e-9)


def test_stops_act_with_the_gradient_of_their_potential(two_link: Robot) -> None:
    ranges, e = {"elbow": (0.0, 1.0), "shoulder": (-0.5, 0.5)}, 1e-6
    stops = Scene(two_link, [JointLimitPotential(ranges, 20.0, 0.3, stops=True)])
    V = Scene(two_link, [JointLimitPotential(ranges, 20.0, 0.3)]).effort_lagrangian().potential
    assert V is not None
    q = np.random.default_rng(0).uniform(-1.5, 1.5, (50, 2))
    still = np.zeros_like(q)
    for i in range(2):
        d = e * np.eye(2)[i]
        slope = (V.value(q + d, still, still) - V.value(q - d, still, still)) / (2 * e)
        tau = stops.inverse_dynamics(q, still, still)[:, i]
        np.testing.assert_allclose(tau, slope, atol=1e-7)


def test_stops_hold_a_falling_arm(two_link: Robot) -> None:
    stop = JointLimitPotential({"shoulder": (-0.3, 0.3)}, 400.0, 0.02, stops=True)
    scene = Scene(two_link, [Gravity(), stop, ViscousFriction(0.5)])
    motion = simulate(scene, State([0.0, 0.0]), 1.0, intervals=500)
    assert motion.q[:, 0].min() > -0.35
    loose = simulate(scene.without(stop.key), State([0.0, 0.0]), 1.0, intervals=50)
    assert loose.q[:, 0].min() < -0.5


# Costs


def test_the_power_cost_is_the_energy_of_drives_without_recovery(two_link: Robot) -> None:
    scene = Scene(two_link, [Gravity(), PowerCost((1.0, 3.0), width=1e-3)])
    ends: tuple[Array, Array] = np.zeros(2), np.array([1.0, 0.5])
    solution = plan(scene, *ends, 1.0, limits="none")
    plain = plan(scene.without("power_cost"), *ends, 1.0, limits="none")
    t = np.linspace(0, 1, 20001)
    motion, other = (found.trajectory.sample(t) for found in (solution, plain))
    power, spent = (np.abs(x.tau * x.v) @ np.array([1.0, 3.0]) for x in (motion, other))
    integral = np.trapezoid(0.5 * np.sum(motion.tau**2, axis=1) + power, t)
    assert solution.success
    assert solution.cost == pytest.approx(integral, rel=3e-3)
    assert np.trapezoid(power, t) < 0.9 * np.trapezoid(spent, t)


def test_a_joint_without_a_motor_has_no_power_to_pay_for(two_link: Robot) -> None:
    """Its torque is zero on average only: at single points some of it may be left."""
    random = np.random.default_rng(4)
    q, v, a = random.normal(size=(3, 5, 2))
    scenes = [
        Scene(two_link, [Gravity(), PowerCost(weight)], passive=["elbow"])
        for weight in ((2.0, 7.0), (2.0, 0.0))
    ]
    one, other = (scene.effort_lagrangian().evaluate(q, v, a) for scene in scenes)
    for charged, free in zip(one, other, strict=True):
        np.testing.assert_array_equal(charged, free)
    t = np.zeros(5)
    costs = [scene.graph()(q.T, v.T, a.T, t[None])[1].full() for scene in scenes]
    np.testing.assert_allclose(costs[0].ravel(), one[0], rtol=1e-12)
    np.testing.assert_array_equal(*costs)


def test_effort_weights_match_those_of_the_planner(two_link: Robot) -> None:
    ends: tuple[Array, Array] = np.zeros(2), np.array([1.0, 0.5])
    plain, weighted = (
        Scene(two_link, [Gravity()]),
        Scene(two_link, [Gravity(), EffortWeight({"elbow": 25.0})]),
    )
    asked = plan(plain, *ends, 1.0, limits="none", weight=[1.0, 25.0])
    named = plan(weighted, *ends, 1.0, limits="none")
    assert named.cost == pytest.approx(asked.cost, rel=1e-12)
    np.testing.assert_array_equal(named.trajectory.q, asked.trajectory.q)
    assert named.cost > 1.1 * plan(plain, *ends, 1.0, limits="none").cost


def test_a_heavy_cost_on_accelerations_leads_to_a_cubic_spline(two_link: Robot) -> None:
    scene = Scene(two_link, [Gravity(), AccelerationCost(1e7)])
    motion = plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, limits="none").trajectory
    cubic = (3 * motion.t**2 - 2 * motion.t**3)[:, None] * np.array([1.0, 0.5])
    np.testing.assert_allclose(motion.q, cubic, atol=1e-5)


def test_a_heavy_cost_on_distance_follows_its_reference(two_link: Robot) -> None:
    scene = Scene(two_link, [Gravity(), ReferenceCost({"elbow": "0.3*sin(3*t)"}, 1e8)])
    ends = State([0.0, 0.0], [0.0, 0.9]), State([0.5, 0.3 * np.sin(3.0)], [0.0, 0.9 * np.cos(3.0)])
    motion = plan(scene, *ends, 1.0, limits="none").trajectory
    np.testing.assert_allclose(motion.q[:, 1], 0.3 * np.sin(3 * motion.t), atol=1e-3)


# Plans and simulations read the same scene


def test_replayed_torques_reach_the_goal(two_link: Robot) -> None:
    tip = two_link.tip_frame
    effects = [
        Gravity(),
        MOVED,
        DryFriction(0.1, width=0.3),
        JointSprings(0.5, 0.2),
        Armature(0.02),
        Payload(tip, 0.1),
        Wrench(tip, ("sin(3*t)", 0.0, 0.5), axes="frame"),
        Drag(tip, 0.1, wind=(2.0, 0.0, 0.0), width=0.1),
    ]
    scene = Scene(two_link, effects)
    found = plan(scene, [0.0, 0.0], [0.6, 0.3], 1.0, intervals=32, limits="none")
    assert found.success
    played = play(scene, found.trajectory, intervals=192, inner_modes=2)
    assert np.abs(played.joint_deviation).max() < 1e-4
    for effect in effects:
        without = play(scene.without(effect.key), found.trajectory, intervals=32)
        assert np.abs(without.joint_deviation).max() > 1e-3, effect.key


@pytest.mark.parametrize(
    "limits", [{"base": "none", "v": 2.2}, {"base": "none", "tau": {"shoulder": 14.0}}], ids=str
)
def test_limits_hold_for_any_cost(two_link: Robot, limits: dict[str, Any]) -> None:
    scene = Scene(two_link, [Gravity(), PowerCost(1.0, 0.5), ViscousFriction(0.1)])
    free = plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, limits="none")
    held = plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, limits=limits)
    assert held.success
    assert held.cost > free.cost
    motion = held.trajectory.sample(np.linspace(0, 1, 2001))
    if "v" in limits:
        assert np.abs(motion.v).max() <= 2.2 * (1 + 1e-5)
    else:
        assert np.abs(motion.tau[:, 0]).max() <= 14.0 * (1 + 1e-5)


def test_a_reference_cost_is_the_weighted_square_of_the_distance(two_link: Robot) -> None:
    """Zero along the reference itself."""
    t = np.array([0.0, 0.4, 1.1])
    reference = np.stack([0.2 * np.ones(3), 0.3 * np.sin(3 * t)], axis=1)
    cost = ReferenceCost({"shoulder": 0.2, "elbow": "0.3*sin(3*t)"}, 5.0)
    L, still = Scene(two_link, [cost]).effort_lagrangian(), Scene(two_link).effort_lagrangian()
    v = a = np.zeros((3, 2))
    np.testing.assert_allclose(L.value(reference, v, a, t=t), 0.0, atol=1e-14)
    off = np.array([[0.1, -0.2], [0.0, 0.3], [1.0, 0.0]])
    value = L.value(reference + off, v, a, t=t) - still.value(reference + off, v, a, t=t)
    np.testing.assert_allclose(value, 2.5 * np.sum(off**2, axis=1), rtol=1e-12)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (0.5, "0.5 N m s/rad (N s/m) at every joint"),
        ((0.5, 0.25), "0.5, 0.25 N m s/rad (N s/m)"),
        ({"elbow": 0.25}, "elbow 0.25 N m s/rad (N s/m)"),
    ],
)
def test_coefficients_are_described_as_they_are_given(given: Any, words: str) -> None:
    assert ViscousFriction(given).describe() == f"viscous_friction: {words}"


@pytest.mark.parametrize(
    ("effect", "words"),
    [
        (Custom(torque_of={"elbow": "0.1*q"}), "tau of elbow += 0.1*q"),
        (Custom(cost="v^2"), "cost += v^2"),
        (Custom(torque_of={"elbow": "0.1*q"}, cost=2.0), "tau of elbow += 0.1*q; cost += 2.0"),
        (Custom(), "nothing"),
    ],
)
def test_a_custom_effect_is_described_by_its_formulas(effect: Custom, words: str) -> None:
    assert effect.describe() == f"custom: {words}"
