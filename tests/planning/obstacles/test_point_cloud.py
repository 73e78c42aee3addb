"""Point clouds: spheres around all points, and no more of them than can be planned with."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.errors import InputError
from hovi.planning.clearance.distances import Distances

RPY, AT = [0.4, -0.2, 0.7], [0.4, 0.1, 0.3]
PLACED = pin.SE3(pin.rpy.rpyToMatrix(*RPY), np.array(AT))


def wall(count: int) -> np.ndarray:
    return np.random.default_rng(0).uniform([0, -0.3, 0], [0.01, 0.3, 0.6], (count, 3))


def test_without_cells_every_point_has_a_ball(two_link: hovi.Robot) -> None:
    """As near as the nearest of hovi's spheres at the same points."""
    points = wall(40)
    cloud = hovi.PointCloud(points, 0.02, position=AT, rpy=RPY, name="wall")
    balls = [hovi.Sphere(PLACED.act(x), 0.02) for x in points]
    q = np.random.default_rng(1).uniform(-3, 3, (50, 2))
    distances = Distances(two_link, hovi.Clearance([cloud]))
    assert {pair.other for pair in distances.pairs} == {"wall"}
    expected = Distances(two_link, hovi.Clearance(balls)).values(q)
    sizes = (50, 40, -1)
    found, wanted = (np.sort(d.reshape(sizes), axis=1) for d in (distances.values(q), expected))
    np.testing.assert_allclose(found, wanted, atol=1e-12)


def test_the_ball_of_a_cell_contains_those_of_its_points() -> None:
    points = wall(5_000)
    cloud = hovi.PointCloud(points, 0.005, cell=0.05)
    centers, radii = cloud.spheres[:, :3], cloud.spheres[:, 3]
    assert len(centers) < 400
    reach = np.linalg.norm(points[:, None] - centers, axis=2) + 0.005 - radii
    assert (reach.min(axis=1) < 1e-12).all()
    assert (radii < 0.05).all()


def test_a_cloud_of_too_many_balls_is_refused_with_cells_that_are_enough() -> None:
    points = wall(20_000)
    with pytest.raises(InputError, match=r"at most 1,000 spheres, got 20,000.*cell=") as refused:
        hovi.PointCloud(points, 0.005)
    cell = float(str(refused.value).rpartition("cell=")[2].rstrip("."))
    assert len(hovi.PointCloud(points, 0.005, cell=1.05 * cell).spheres) <= 1_000


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: hovi.PointCloud(np.zeros((0, 3)), 0.1), "1 to 1,000,000 points, got 0"),
        (lambda: hovi.PointCloud([[0, 0, 0]], 0.0), "`radius` of a point cloud must be positive"),
        (lambda: hovi.PointCloud([[0, 0, 0]], 0.1, cell=-1.0), "`cell` of a point cloud must be"),
        (lambda: hovi.PointCloud([0, 0, 0], 0.1), "`points` of a point cloud must be any number"),
    ],
)
def test_an_invalid_cloud_is_refused_in_one_sentence(make: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()  # type: ignore[operator]
