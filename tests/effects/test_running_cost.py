"""Costs C(q, v, a, tau, t): values by Pinocchio, exact derivatives, minima by Ipopt."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi.symbolic
from hovi import plan
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.effects import (
    AccelerationCost,
    CasadiCost,
    Effect,
    EffortWeight,
    Gravity,
    MovingBase,
    Payload,
    PowerCost,
    RunningCost,
)
from hovi.errors import SceneError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from oracles.ipopt_oracle import least_action
from oracles.on_grid import solve_on_grid

Array = npt.NDArray[np.float64]
POINTS = 5


def points(robot: Robot) -> tuple[Array, Array, Array, Array]:
    random = np.random.default_rng(robot.nv)
    dq, v, a = random.normal(size=(3, POINTS, robot.nv))
    q = robot.integrate(np.tile(robot.neutral(), (POINTS, 1)), dq)
    return q, v, a, random.uniform(0.1, 2.0, POINTS)


def cost_alone(robot: Robot, *effects: Effect) -> Array:
    """C at the points, without the effort."""
    q, v, a, t = points(robot)
    scene = Scene(robot, [EffortWeight(0.0), *effects])
    return scene.effort_lagrangian(regular=False).value(q, v, a, t=t)


# Values


@pytest.mark.parametrize("name", ["two_link", "ur5", "panda"])
def test_the_force_and_moment_on_the_base_change_the_momenta_of_the_robot(
    request: pytest.FixtureRequest, name: str
) -> None:
    """f = m (c'' - g) and moment = L' + c x f, and the weight of the base link at rest."""
    robot: Robot = request.getfixturevalue(name)
    effects = [Gravity(3.7, (0.3, -0.2, -1.0)), Payload(robot.tip_frame, 0.8, (0.02, 0.01, 0.1))]
    model = Scene(robot, effects).model
    data, expected = model.createData(), []
    for q, v, a in zip(*points(robot)[:3], strict=True):
        rate = pin.computeCentroidalMomentumTimeVariation(model, data, q, v, a)
        center = pin.centerOfMass(model, data, q, v, a)
        base, *moving = list(model.inertias)
        force = rate.linear - sum(each.mass for each in moving) * model.gravity.linear
        moment = rate.angular + np.cross(center, force)
        held = -base.mass * model.gravity.linear
        expected.append([*(force + held), *(moment + np.cross(base.lever, held))])
    for i, axis in enumerate("xyz"):
        for j, part in enumerate(("force", "moment")):
            found = cost_alone(robot, *effects, RunningCost({"r": f'base_{part}["{axis}"]'}))
            np.testing.assert_allclose(found, np.array(expected)[:, i + 3 * j], atol=1e-9)


@pytest.mark.parametrize("name", ["ur5", "kinova"])
def test_frames_move_as_in_pinocchio(name: str) -> None:
    robot = load_robot(name)
    model, tip = robot.model, robot.tip_frame
    data, frame, expected = model.createData(), model.getFrameId(tip), []
    for q, v, a in zip(*points(robot)[:3], strict=True):
        pin.forwardKinematics(model, data, q, v, a)
        axes = pin.LOCAL_WORLD_ALIGNED
        velocity = pin.getFrameVelocity(model, data, frame, axes).linear
        acceleration = pin.getFrameClassicalAcceleration(model, data, frame, axes).linear
        position = pin.updateFramePlacement(model, data, frame).translation
        expected.append([position.copy(), velocity.copy(), acceleration.copy()])
    for k, quantity in enumerate(("position", "velocity", "acceleration")):
        for i, axis in enumerate("xyz"):
            found = cost_alone(robot, RunningCost({"tip": f'{quantity}["{tip}", "{axis}"]'}))
            np.testing.assert_allclose(found, np.array(expected)[:, k, i], atol=1e-10)


def test_the_acceleration_of_a_frame_includes_that_of_a_moving_base(two_link: Robot) -> None:
    base = MovingBase(("0.3*sin(2*t)", 0.0, 0.0))
    formula = RunningCost({"tip": f'acceleration["{two_link.tip_frame}", "x"]'})
    t = points(two_link)[3]
    added = cost_alone(two_link, base, formula) - cost_alone(two_link, formula)
    np.testing.assert_allclose(added, -1.2 * np.sin(2 * t), atol=1e-12)


def test_columns_stand_for_all_joints(ur5: Robot) -> None:
    q, v, a, t = points(ur5)
    tau = Scene(ur5).inverse_dynamics(q, v, a)
    terms = {
        "power": "dot(tau, v)",
        "more": "sum(q*a) + 2*dot(a, 1) - sum(max(tau, 0))",
        "one": 'v["elbow_joint"]*t',
    }
    expected = np.vecdot(tau, v) + np.vecdot(q, a) + 2 * a.sum(axis=1)
    expected += v[:, 2] * t - np.maximum(tau, 0).sum(axis=1)
    np.testing.assert_allclose(cost_alone(ur5, RunningCost(terms)), expected, rtol=1e-12)


def test_a_full_matrix_weighs_products_of_torques(two_link: Robot) -> None:
    q, v, a, t = points(two_link)
    tau = Scene(two_link).inverse_dynamics(q, v, a)
    bent = '0.4 + 0.2*sin(q["elbow"]) + 0.1*t'
    R = EffortWeight(matrix=((2.0, bent), (bent, '1 + v["shoulder"]**2')))
    found = Scene(two_link, [R]).effort_lagrangian().value(q, v, a, t=t)
    off = 0.4 + 0.2 * np.sin(q[:, 1]) + 0.1 * t
    expected = tau[:, 0] ** 2 + off * tau[:, 0] * tau[:, 1]
    expected += 0.5 * (1 + v[:, 0] ** 2) * tau[:, 1] ** 2
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_a_diagonal_matrix_and_a_column_of_weights_lead_to_the_same_motion(
    two_link: Robot,
) -> None:
    one, other = (
        plan(Scene(two_link, [Gravity(), weight]), [0.0, 0.0], [1.0, 0.5], 1.0, limits="none")
        for weight in (EffortWeight((0.5, 2.0)), EffortWeight(matrix=((0.5, 0.0), (0.0, 2.0))))
    )
    assert one.success
    assert other.cost == pytest.approx(one.cost, rel=1e-10)
    np.testing.assert_allclose(other.trajectory.q, one.trajectory.q, atol=1e-6)


# Derivatives

SmallEffects = Callable[[Robot], list[Effect]]


def rich_formulas(robot: Robot) -> list[Effect]:
    first, last, tip = robot.coordinate_names[0], robot.coordinate_names[-1], robot.tip_frame
    terms = {
        "drives": f'0.3*dot(tau, tau) + exp(-t)*tau["{first}"]*v["{first}"]',
        "tip": f'0.1*dot(acceleration["{tip}"], acceleration["{tip}"])*tau["{last}"]',
        "base": f'0.01*dot(base_moment, base_moment) + base_force["z"]*a["{last}"]',
    }
    return [EffortWeight(0.0), RunningCost(terms)]


def bent_matrix(robot: Robot) -> list[Effect]:
    last, n = robot.coordinate_names[-1], robot.nv
    off = f'0.1*sin(q["{last}"])' if robot.nq == n else f'0.1*tanh(v["{last}"])'
    rows = tuple(tuple(2.0 if i == j else off for j in range(n)) for i in range(n))
    return [EffortWeight(matrix=rows)]


def any_function(robot: Robot) -> list[Effect]:
    return [
        CasadiCost(lambda q, v, a, tau, t: ca.sumsqr(q) * ca.dot(tau, a) + t * tau[0] ** 2 * v[-1])
    ]


CASES: dict[str, SmallEffects] = {
    "formulas": rich_formulas,
    "matrix": bent_matrix,
    "function": any_function,
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("name", ["two_link", "ur5", "kinova"])
def test_derivatives_match_finite_differences(name: str, case: str, models: Path) -> None:
    robot = load_robot(models / "two_link.urdf" if name == "two_link" else name)
    scene = Scene(robot, [Gravity(), *CASES[case](robot)])
    lagrangian, n = scene.effort_lagrangian(), robot.nv
    q, v, a, t = points(robot)
    value, gradient, hessian = lagrangian.evaluate(q, v, a, t=t)
    np.testing.assert_allclose(value, lagrangian.value(q, v, a, t=t), rtol=1e-12)
    np.testing.assert_allclose(gradient, lagrangian.gradient(q, v, a, t=t), rtol=1e-10)
    e, m = 1e-5, 3 * n
    for i in range(m):
        d = np.split(np.tile(e * np.eye(m)[i], (POINTS, 1)), 3, axis=1)
        sides = [(robot.integrate(q, s * d[0]), v + s * d[1], a + s * d[2]) for s in (1, -1)]
        slope = np.subtract(*(lagrangian.value(*side, t=t) for side in sides)) / (2 * e)
        bend = np.subtract(*(lagrangian.gradient(*side, t=t) for side in sides)) / (2 * e)
        found = gradient.reshape(POINTS, m)[:, i], hessian.reshape(POINTS, m, m)[:, i]
        for exact, difference, scale in zip(found, (slope, bend), (gradient, hessian), strict=True):
            atol = 1e-7 * np.abs(scale).max()
            np.testing.assert_allclose(exact, difference.reshape(exact.shape), rtol=0, atol=atol)


# Singular costs

NOT_SINGULAR: dict[str, list[Effect]] = {
    "acceleration": [EffortWeight({"elbow": 0.0}), AccelerationCost({"elbow": 1e-6})],
    "small": [EffortWeight({"elbow": 1e-9}), PowerCost(1.0)],
    "formula": [EffortWeight(0.0), RunningCost({"all": "1e-4*dot(tau, tau)"})],
    "coupled": [
        EffortWeight(0.0),
        AccelerationCost({"shoulder": 1.0}),
        RunningCost({"x": "sum(tau)**2"}),
    ],
}
SINGULAR: dict[str, tuple[list[Effect], str]] = {
    "one weight": ([EffortWeight({"elbow": 0.0})], "acceleration of joint 'elbow'"),
    "no weight": ([EffortWeight(0.0)], "acceleration of joint '(shoulder|elbow)'"),
    "power": ([EffortWeight(0.0), PowerCost(1.0)], "at rest the acceleration of joint '"),
    "a sum": ([EffortWeight(0.0), RunningCost({"x": "sum(tau)**2"})], "acceleration of joint"),
    "flat matrix": ([EffortWeight(matrix=((0.0, 0.0), (0.0, 1.0)))], "of joint 'shoulder'"),
    "one of two": ([EffortWeight(0.0), AccelerationCost({"elbow": 1.0})], "acceleration of joint"),
    "linear": ([EffortWeight(0.0), RunningCost({"x": "dot(tau, v)"})], "acceleration of joint"),
    "cancelled": ([RunningCost({"x": "-0.5*dot(tau, tau)"})], "acceleration of joint"),
}


@pytest.mark.parametrize("case", SINGULAR)
def test_a_cost_that_is_singular_in_the_acceleration_is_refused(two_link: Robot, case: str) -> None:
    effects, sentence = SINGULAR[case]
    scene = Scene(two_link, [Gravity(), *effects])
    with pytest.raises(SceneError, match=sentence) as refused:
        plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0)
    assert "effort_weight" in str(refused.value)
    assert "acceleration or jerk" in str(refused.value)
    scene.describe()
    scene.effort_lagrangian(regular=False)


@pytest.mark.parametrize("case", NOT_SINGULAR)
def test_a_cost_that_bounds_every_acceleration_is_accepted(two_link: Robot, case: str) -> None:
    Scene(two_link, NOT_SINGULAR[case]).effort_lagrangian()


def test_least_time_alone_is_refused(two_link: Robot) -> None:
    scene = Scene(two_link, [Gravity(), EffortWeight(0.0)])
    with pytest.raises(SceneError, match="singular in its highest derivative"):
        plan(scene, [0.0, 0.0], [1.0, 0.5], (0.5, 3.0), time_weight=1.0, limits={"tau": 50.0})


def test_a_weight_of_an_argument_may_be_zero_where_an_acceleration_cost_holds(
    two_link: Robot,
) -> None:
    scene = Scene(two_link, [Gravity(), AccelerationCost({"elbow": 1.0})])
    found = plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, limits="none", weight=[1.0, 0.0])
    assert found.success
    with pytest.raises(SceneError, match="singular in its highest"):
        plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, limits="none", weight=[0.0, 0.0])


def test_a_weight_does_not_replace_a_matrix(two_link: Robot) -> None:
    scene = Scene(two_link, [EffortWeight(matrix=((1.0, 0.2), (0.2, 1.0)))])
    with pytest.raises(SceneError, match="weight cannot replace the matrix"):
        scene.effort_lagrangian([1.0, 1.0])


def test_a_base_that_moves_has_no_reaction(two_link: Robot) -> None:
    scene = Scene(two_link, [MovingBase(("t", 0.0, 0.0)), RunningCost({"x": 'base_force["x"]'})])
    with pytest.raises(SceneError, match="those on a base at rest"):
        scene.effort_lagrangian()


def test_a_joint_without_a_motor_has_no_torque_to_pay_for(two_link: Robot) -> None:
    scenes = [
        Scene(two_link, [Gravity(), RunningCost({"x": f"dot(tau, tau){more}"})], passive=["elbow"])
        for more in ("", ' + 3*tau["elbow"]**2')
    ]
    q, v, a, t = points(two_link)
    one, other = (scene.effort_lagrangian().evaluate(q, v, a, t=t) for scene in scenes)
    for found, expected in zip(one, other, strict=True):
        np.testing.assert_array_equal(found, expected)


def test_a_joint_without_a_motor_swings_where_no_torque_has_a_weight(two_link: Robot) -> None:
    """Its torque is an equation."""
    more = [EffortWeight(0.0), RunningCost({"x": "0.5*dot(tau, tau)"})]
    ends = np.array([-1.5, 0.0]), np.array([-1.2, 0.0])
    known, found = (
        plan(Scene(two_link, [Gravity(), *added], passive=["elbow"]), *ends, 1.0, limits="none")
        for added in ([], more)
    )
    assert known.success
    assert found.success
    assert found.cost == pytest.approx(known.cost, rel=1e-6)


# Minima


def electrical(q: ca.SX, v: ca.SX, a: ca.SX, tau: ca.SX, t: ca.SX) -> ca.SX:
    """Copper losses and mechanical power, which the drives recover."""
    return 0.05 * ca.sumsqr(tau) + ca.dot(tau, v)


def drifting(q: ca.SX, v: ca.SX, a: ca.SX, tau: ca.SX, t: ca.SX) -> ca.SX:
    """A full R(q) that changes in time, and an acceleration cost at a joint without a weight."""
    return 0.5 * tau[0] ** 2 * (1 + 0.5 * ca.cos(q[1])) + 0.1 * a[1] ** 2 + t * ca.sumsqr(v)


@pytest.mark.parametrize("cost", [electrical, drifting])
def test_the_minimum_is_that_of_ipopt_on_the_same_discrete_problem(
    two_link: Robot, cost: Callable[..., ca.SX]
) -> None:
    scene = Scene(two_link, [Gravity(), EffortWeight(0.0), CasadiCost(cost)])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, 12, galerkin(2)))
    problem = TrajectoryProblem(ld, State([0.0, 0.0]), State([1.2, 0.6]))
    solution = solve_on_grid(problem)
    assert solution.success
    expected, nodes = least_action(problem, solution.trajectory.path, cost=cost)
    assert solution.cost == pytest.approx(expected, rel=1e-9)
    found = solution.trajectory
    np.testing.assert_allclose(np.hstack([found.q, found.v])[1:-1], nodes, atol=1e-5)


def test_formulas_and_functions_lead_to_the_same_motion(two_link: Robot) -> None:
    """The formulas of a file, and a function with a casadi.Function inside."""
    body = hovi.symbolic.rigid_body(Scene(two_link))
    jacobian, tip = body.frame_jacobian(two_link.tip_frame), two_link.tip_frame

    def cost(q: ca.SX, v: ca.SX, a: ca.SX, tau: ca.SX, t: ca.SX) -> ca.SX:
        return ca.sumsqr(jacobian(q)[:3, :] @ v) + 0.1 * ca.dot(tau, v) ** 2

    formula = f'dot(velocity["{tip}"], velocity["{tip}"]) + 0.1*dot(tau, v)**2'
    one, other = (
        plan(Scene(two_link, [Gravity(), effect]), [0.0, 0.0], [1.0, 0.5], 1.0, limits="none")
        for effect in (RunningCost({"x": formula}), CasadiCost(cost))
    )
    assert one.success
    assert other.cost == pytest.approx(one.cost, rel=1e-10)


def test_a_function_reaches_worker_processes(two_link: Robot) -> None:
    q, v, a, tau = (ca.SX.sym(name, 2) for name in "qvau")
    function = ca.Function("losses", [q, v, a, tau, ca.SX.sym("t")], [ca.sumsqr(tau) * 0.1])
    scene = Scene(two_link, [Gravity(), EffortWeight(0.0), CasadiCost(function)])
    assert pickle.loads(pickle.dumps(scene)).effects[2].describe().startswith("casadi_cost: losses")
    found = plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, limits="none", starts=3, processes=2)
    alone = plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, limits="none", starts=3, processes=1)
    assert found.cost == alone.cost


# Files


def test_motions_keep_the_formulas_of_their_cost(two_link: Robot, tmp_path: Path) -> None:
    scene = Scene(two_link, [Gravity(), RunningCost({"losses": "0.1*dot(tau, tau) + t*sum(v)"})])
    motion = plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, intervals=4, limits="none").trajectory
    motion.save(tmp_path / "motion.npz")
    loaded = Trajectory.load(tmp_path / "motion.npz").scene
    assert loaded is not None
    assert loaded.effects == scene.effects


def test_files_do_not_contain_functions(two_link: Robot, tmp_path: Path) -> None:
    scene = Scene(two_link, [Gravity(), CasadiCost(electrical)])
    motion = plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, intervals=4, limits="none").trajectory
    with pytest.raises(SceneError, match=r"'casadi_cost' holds a function.*RunningCost") as refused:
        motion.save(tmp_path / "motion.npz")
    assert "\n" not in str(refused.value)
    data = json.loads(json.dumps(Scene(two_link).to_dict()))
    data["effects"]["casadi_cost"] = {"function": "electrical"}
    with pytest.raises(SceneError, match="there is no effect 'casadi_cost'"):
        Scene.from_dict(data)
