"""Cylinders, half-spaces and hulls: their distances by other shapes of Coal, and refused input."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.errors import InputError
from hovi.planning.clearance.convex_shapes import convex_geometry
from hovi.planning.clearance.distances import Distances
from hovi.planning.obstacles.obstacle import Obstacle
from oracles.world_distances import Placed, from_world, shape_distance

NORMAL = np.array([0.2, -0.3, 1.0]) / np.linalg.norm([0.2, -0.3, 1.0])
CORNERS = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0.1, 0.1, 0.4], [0.05, 0.05, 0.1]])
AT, RPY = [0.3, -0.2, 0.4], [0.3, -0.4, 0.5]
ANGLES = np.linspace(0.0, 2 * np.pi, 200, endpoint=False)


def prism(angles: np.ndarray) -> np.ndarray:
    """The corners of a prism inside a cylinder."""
    return np.array([[0.1 * np.cos(a), 0.1 * np.sin(a), z] for a in angles for z in (-0.3, 0.3)])


ROD = prism(ANGLES)
"""A prism up to 13 micrometres from its cylinder."""
FINE_ROD = prism(np.linspace(0.0, 2 * np.pi, 400, endpoint=False))
"""One with more corners than a vertex may have neighbours in Coal."""
PLACED = pin.SE3(pin.rpy.rpyToMatrix(*RPY), np.array(AT))


def hull_of(points: np.ndarray) -> coal.ConvexBase:
    listed = coal.StdVec_Vec3s()
    listed.extend(list(points))
    return coal.Convex.convexHull(listed, True, "Qt")


def column(robot: hovi.Robot, obstacle: Obstacle, q: np.ndarray) -> np.ndarray:
    """Distances of the moving shapes from one obstacle of one body."""
    return Distances(robot, hovi.Clearance([obstacle])).values(q)


CASES: list[tuple[Obstacle, Placed]] = [
    (
        hovi.HalfSpace(3.0 * NORMAL, [0.1, 0.0, -0.2]),
        (coal.Halfspace(NORMAL, float(NORMAL @ [0.1, 0.0, -0.2])), pin.SE3.Identity()),
    ),
    (hovi.Cylinder(0.1, 0.6, AT, RPY), (hull_of(ROD), PLACED)),
    (hovi.ConvexHull(CORNERS, AT, RPY), (hull_of(CORNERS[:4]), PLACED)),
    (hovi.ConvexHull(FINE_ROD, AT, RPY), (coal.Cylinder(0.1, 0.6), PLACED)),
]


@pytest.mark.parametrize(("obstacle", "same"), CASES, ids=lambda each: getattr(each, "kind", ""))
def test_a_shape_is_as_far_as_coals_own(
    obstacle: Obstacle, same: Placed, panda: hovi.Robot
) -> None:
    """At 200 random configurations, with the robot's shapes as planned with."""
    pin.seed(1)
    q = np.array([pin.randomConfiguration(panda.model) for _ in range(200)])
    found = column(panda, obstacle, q)
    expected = from_world(panda, q, [same], convex_geometry(panda))[:, :, 0]
    assert (found < 0).any()
    assert (found > 0.3).any()
    np.testing.assert_allclose(found, expected, atol=2e-5)


def test_a_half_space_has_the_derivatives_of_a_plane(panda: hovi.Robot) -> None:
    """d' by differences of distances, a hundred metres from the position, too."""
    far = np.array([60.0, 80.0, 0.0])
    distances = Distances(panda, hovi.Clearance([hovi.HalfSpace([0, 0, 1], far)]))
    pin.seed(2)
    q = np.array([pin.randomConfiguration(panda.model) for _ in range(20)])
    d, slopes = distances.expand(q)
    near = Distances(panda, hovi.Clearance([hovi.HalfSpace([0, 0, 1])])).values(q)
    np.testing.assert_allclose(d, near, atol=1e-11)
    h = 1e-5
    for i, row in enumerate(h * np.eye(panda.nv)):
        up, down = (
            distances.values(panda.integrate(q, np.tile(s * row, (20, 1)))) for s in (1, -1)
        )
        np.testing.assert_allclose(slopes[:, :, i], (up - down) / (2 * h), atol=1e-6)


def test_a_half_space_is_drawn_as_a_slab_under_its_plane() -> None:
    floor = hovi.HalfSpace([0, 0, 2.0], [0.0, 0.0, 0.1])
    ((slab, at),) = floor.drawn()
    assert at.translation[2] + slab.halfSide[2] == pytest.approx(0.1)
    assert max(slab.halfSide) < 10.0
    assert shape_distance((coal.Sphere(0.0), pin.SE3.Identity()), (slab, at)) == pytest.approx(0.09)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: hovi.Cylinder(0.0, 1.0, AT), "`radius` of a cylinder must be positive"),
        (lambda: hovi.Cylinder(1.0, "long", AT), "`length` of a cylinder must be a number"),
        (lambda: hovi.Sphere(AT, 1e-300), r"must be at least 1e-09, in metres, got 1e-300"),
        (lambda: hovi.Box([1, 1e-10, 1], AT), r"must be at least 1e-09, in metres"),
        (lambda: hovi.Box([1, True, 1], AT), "`size` of a box must be 3 finite numbers"),
        (lambda: hovi.Sphere([0.0, False, 0.0], 1.0), "`position` of a sphere must be 3 finite"),
        (lambda: hovi.ConvexHull([*CORNERS, [True, 0, 0]]), "`points` of a convex hull must be"),
        (lambda: hovi.Sphere(AT, 1.0, name="a\0b"), "name of a sphere must be printable"),
        (lambda: hovi.Segment([0.0], 1.0, name="\x1b[2J"), "name of a segment must be printable"),
        (lambda: hovi.HalfSpace([0, 0, 0]), "`normal` of a half space must be a direction"),
        (lambda: hovi.HalfSpace([0, 1]), "`normal` of a half space must be 3 finite numbers"),
        (lambda: hovi.ConvexHull([[0, 0, 0]] * 9), "must span a volume"),
        (lambda: hovi.ConvexHull([[0, 0], [1, 1]]), "must be any number of x 3 finite numbers"),
        (lambda: hovi.ConvexHull(np.zeros((10_001, 3))), "at most 10,000 points"),
        (lambda: hovi.ConvexHull(1e10 * CORNERS), r"finite numbers up to 1e\+09"),
    ],
)
def test_an_invalid_shape_is_refused_in_one_sentence(make: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()  # type: ignore[operator]
