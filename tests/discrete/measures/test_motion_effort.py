"""The effort of a motion against SciPy's integral of the sampled torques."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
from scipy.integrate import quad_vec

import hovi
from hovi.discrete.measures.motion_effort import effort_of
from hovi.discrete.trajectory import Trajectory
from hovi.effects import AccelerationCost, EffortWeight, Gravity
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from samples.cubic_motion import cubic_motion
from samples.manifold_robots import configurations, with_arm

Array = npt.NDArray[np.float64]


def integrated(trajectory: Trajectory, active: Array | slice = slice(None)) -> float:
    """1/2 integral |tau|^2 dt of `sample`, interval by interval."""

    def power(t: float) -> float:
        return 0.5 * float(np.sum(trajectory.sample(t).tau[0, active] ** 2))

    inner = trajectory.t[1:-1]
    return float(quad_vec(power, 0.0, trajectory.duration, points=inner, epsrel=1e-11)[0])


def reach(robot: Robot, *effects: hovi.effects.Effect, **options: object) -> hovi.Solution:
    scene = Scene(robot, [Gravity(9.8), *effects])
    options = {"duration": 1.0, "limits": "none", "intervals": 24} | options
    return hovi.plan(scene, [-1.5, 0.0], [0.3, 0.7], **options)


def test_effort_is_the_cost_where_nothing_else_is(two_link: Robot) -> None:
    found = reach(two_link)
    assert found.effort == pytest.approx(found.cost, rel=1e-13)


def test_effort_is_not_computed_until_it_is_asked_for(two_link: Robot) -> None:
    found = reach(two_link)
    assert "effort" not in found.__dict__
    assert found.effort is not None
    assert "effort" in found.__dict__


def test_other_costs_and_weights_are_not_in_the_effort(two_link: Robot) -> None:
    for effect in (AccelerationCost(0.05), EffortWeight([3.0, 0.5])):
        found = reach(two_link, effect)
        assert found.effort == pytest.approx(integrated(found.trajectory), rel=1e-6)
        assert abs(found.effort - found.cost) > 0.05 * found.cost


def test_the_price_of_a_free_duration_is_not_in_the_effort(two_link: Robot) -> None:
    found = reach(two_link, duration=(0.5, 2.0), time_weight=30.0)
    T = found.trajectory.duration
    assert found.effort == pytest.approx(found.cost - 30.0 * T, rel=1e-9)
    assert found.effort == pytest.approx(integrated(found.trajectory), rel=1e-6)


def test_passive_joints_have_no_effort(two_link: Robot) -> None:
    """Of a motion that is none of a passive elbow, so that its torque is not small."""
    motion, _ = cubic_motion(Scene(two_link, [Gravity(9.8)], passive=["elbow"]))
    assert effort_of(motion) == pytest.approx(integrated(motion, np.array([0])), rel=1e-4)
    assert effort_of(motion) < 0.99 * integrated(motion)


def test_effort_of_a_robot_on_groups() -> None:
    robot = hovi.load_robot(with_arm("spherical"))
    q0, q1 = configurations(robot, 2)
    found = hovi.plan(
        Scene(robot, [Gravity()]), q0, robot.integrate(q0, 0.1 * robot.difference(q0, q1)),
        duration=1.0, limits="none", intervals=16,
    )  # fmt: skip
    assert found.effort == pytest.approx(found.cost, rel=1e-12)
    assert found.effort == pytest.approx(integrated(found.trajectory), rel=1e-5)


def test_effort_of_a_loaded_motion_is_that_of_its_stored_torques(
    two_link: Robot, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("motions") / "motion.npz"
    model = pin.Model(two_link.model)
    found = reach(hovi.load_robot(model))
    found.trajectory.save(path)
    loaded = Trajectory.load(path)
    assert loaded.scene is None
    assert effort_of(loaded) == pytest.approx(found.effort, rel=1e-10)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_motion_without_torques_has_no_effort(order: int) -> None:
    grid = hovi.Grid.uniform(1.0, 4, hovi.schemes.galerkin(1, order))
    ld = hovi.DiscreteLagrangian(hovi.spline(2, order), grid)
    problem = hovi.TrajectoryProblem(ld, hovi.State([0.0, 0.0]), hovi.State([1.0, 0.5]))
    assert hovi.solve(problem).effort is None
