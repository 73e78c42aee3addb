"""Distances against closed forms, and their derivatives against finite differences."""

from __future__ import annotations

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.errors import ModelError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.convex_shapes import convex_geometry
from hovi.planning.clearance.distances import Distances
from hovi.planning.clearance.obstacles import Box, Capsule, Obstacle, Sphere
from hovi.planning.clearance.pair_distances import PairDistances
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from oracles.finite_differences import derivative_per_point

Array = npt.NDArray[np.float64]
TIP = 0.06
"""Radius of the ball at the two-link arm's tip, in [m]."""
OBSTACLES = [
    Sphere([0.4, 0.1, 0.5], 0.1),
    Capsule([[0.3, 0.0, 0.4], [0.5, 0.2, 0.6]], 0.05),
    Box([0.2, 0.1, 0.15], [0.4, 0.1, 0.5], rpy=[0.3, 0.2, 0.1]),
]


def around(q: npt.ArrayLike, count: int = 40, width: float = 0.7) -> Array:
    """Random configurations around one, (count, nq)."""
    return np.asarray(q) + np.random.default_rng(0).uniform(-width, width, (count, np.size(q)))


def tip_column(distances: Distances) -> int:
    return [pair.link for pair in distances.pairs].index("tip")


def test_the_distance_of_two_balls_is_that_of_their_centers(two_link: Robot) -> None:
    """Overlapping or not."""
    center = np.array([1.2, 0.3, 0.8])
    distances = Distances(two_link, Clearance(Sphere(center, 0.4)))
    q = around([0.5, 0.5], width=2.0)
    tip = two_link.frame_position("tip", q)
    expected = np.linalg.norm(tip - center, axis=1) - 0.4 - TIP
    assert expected.min() < 0 < expected.max()
    measured = distances.values(q)[:, tip_column(distances)]
    np.testing.assert_allclose(measured, expected, atol=1e-9)


def test_the_distance_to_a_floor_is_the_height(two_link: Robot) -> None:
    floor = Box([8.0, 8.0, 1.0], [0.0, 0.0, -3.5])
    distances = Distances(two_link, Clearance(floor))
    q = around([-1.2, 0.3], width=0.5)
    height = two_link.frame_position("tip", q)[:, 2] + 3.0 - TIP
    measured = distances.values(q)[:, tip_column(distances)]
    np.testing.assert_allclose(measured, height, atol=1e-9)


@pytest.mark.parametrize("obstacle", OBSTACLES, ids=lambda each: each.kind)
def test_derivatives_are_those_of_finite_differences(panda: Robot, obstacle: Obstacle) -> None:
    """For meshes and boxes, separate and overlapping."""
    distances = Distances(panda, Clearance(obstacle))
    q = around([0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.7])
    d, jacobian = distances.expand(q)
    assert d.min() < -0.02
    np.testing.assert_allclose(d, distances.values(q), atol=1e-14)
    numeric = derivative_per_point(distances.values, q, 1e-6)
    np.testing.assert_allclose(jacobian, numeric, atol=2e-5)


def test_derivatives_of_links_against_each_other(ur5: Robot) -> None:
    distances = Distances(ur5, Clearance(self_collision=True))
    q = around([0.0, -1.2, 1.2, -0.5, 0.3, 0.1])
    numeric = derivative_per_point(distances.values, q, 1e-6)
    np.testing.assert_allclose(distances.expand(q)[1], numeric, atol=2e-5)


def test_derivatives_on_a_floating_base_are_along_integrate() -> None:
    robot = load_robot("anymal")
    distances = Distances(robot, Clearance(Sphere([0.5, 0.2, 0.1], 0.15)))
    q = robot.integrate(
        np.tile(robot.pose("standing"), (6, 1)),
        np.random.default_rng(1).uniform(-0.3, 0.3, (6, robot.nv)),
    )
    numeric = derivative_per_point(
        lambda dq: distances.values(robot.integrate(q, dq)), np.zeros((6, robot.nv)), 1e-6
    )
    np.testing.assert_allclose(distances.expand(q)[1], numeric, atol=2e-5)


def test_curvature_is_the_derivative_of_the_derivative(two_link: Robot) -> None:
    distances = Distances(two_link, Clearance(Sphere([1.2, 0.3, 0.8], 0.2)))
    q = around([0.5, 0.5], width=1.0)
    force = np.random.default_rng(2).standard_normal(distances.values(q).shape)

    def slope(q: Array) -> Array:
        return np.einsum("pk,pki->pi", force, distances.expand(q)[1])

    numeric = derivative_per_point(slope, q, 1e-5)
    scale = np.abs(numeric).max()
    curvature = distances.curvature(q, force)
    wrong = np.abs(curvature - numeric).max(axis=(1, 2)) > 1e-3 * scale
    assert wrong.mean() <= 0.05  # where the nearest points slide over the rim of a cylinder
    np.testing.assert_array_equal(curvature, curvature.transpose(0, 2, 1))


def test_results_do_not_depend_on_earlier_queries(panda: Robot) -> None:
    clearance = Clearance(OBSTACLES)
    q = around([0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.7], 6)
    used, new = Distances(panda, clearance), Distances(panda, clearance)
    used.values(q[::-1])
    used.expand(q + 0.3)
    np.testing.assert_array_equal(used.values(q), new.values(q))
    np.testing.assert_array_equal(used.expand(q)[1], new.expand(q)[1])


def test_fixed_shapes_are_not_paired_with_obstacles(panda: Robot) -> None:
    distances = Distances(panda, Clearance(OBSTACLES[0]))
    links = {pair.link for pair in distances.pairs}
    assert "panda_link0" not in links
    assert {"panda_link1", "panda_hand"} <= links


def test_a_robot_without_collision_shapes_is_refused(pendulum: Robot) -> None:
    with pytest.raises(ModelError, match=r"no collision shapes.*<collision>"):
        Distances(pendulum, Clearance(OBSTACLES))


def test_a_flat_mesh_is_refused_by_name() -> None:
    model = pin.buildSampleModelManipulator()
    flat = coal.BVHModelOBBRSS()
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    flat.beginModel(2, 4)
    for corner in corners:
        flat.addVertex(corner)
    flat.addTriangle(*corners[:3])
    flat.endModel()
    geometry = pin.GeometryModel()
    geometry.addGeometryObject(pin.GeometryObject("sheet", 1, 0, pin.SE3.Identity(), flat))
    robot = load_robot(model, collision=geometry)
    with pytest.raises(ModelError, match=r"'sheet'.*no convex hull"):
        convex_geometry(robot)


def test_second_derivatives_include_those_by_coal(two_link: Robot) -> None:
    """Of a cone, of which the compiled part knows no distances, beside a sphere."""
    distances = Distances(two_link, Clearance(Sphere([1.9, 0.0, 0.6], 0.1)))
    cone = pin.GeometryObject("cone", 2, 0, pin.SE3.Identity(), coal.Cone(0.1, 0.2))
    geometry = distances.geometry.copy()
    number = geometry.addGeometryObject(cone)
    geometry.addCollisionPair(pin.CollisionPair(number, distances.ends[0][1]))
    measured = PairDistances(two_link, geometry)
    pairs = np.arange(len(geometry.collisionPairs))
    q = around([0.1, 0.3], width=0.05)
    d, jacobian, curvature = measured.expand(q, pairs, np.inf, np.ones((len(q), len(pairs))))
    numeric = derivative_per_point(lambda q: measured.values(q, pairs, np.inf), q, 1e-5)
    np.testing.assert_allclose(jacobian, numeric, atol=1e-5)
    assert d[:, -1].min() > 0.0
    bend = derivative_per_point(
        lambda q: measured.expand(q, pairs, np.inf, None)[1].sum(axis=1), q, 1e-4
    )
    np.testing.assert_allclose(curvature, bend, atol=2e-3 * np.abs(bend).max())
