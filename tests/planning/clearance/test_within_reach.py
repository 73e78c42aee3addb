"""Obstacles beyond a robot's reach: they change nothing, and others are kept."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.convex_shapes import convex_geometry
from hovi.planning.clearance.within_reach import distances_within_reach, reach_of

NEAR = hovi.Sphere([0.8, 0.0, 0.4], 0.1, name="near")
FAR = hovi.Sphere([9.0, 0.0, 0.0], 0.1, name="far")
FLOOR = hovi.HalfSpace([0.0, 0.0, 1.0], [0.0, 0.0, -9.0], name="floor")
HUGE = hovi.Box([10.0, 10.0, 0.1], [6.0, 0.0, -1.0], name="huge")
PASSING = hovi.Sphere(
    [9.0, 0.0, 0.0],
    0.1,
    name="passing",
    path={"times": [0, 1], "positions": [[9, 0, 0], [0, 0, 2]]},
)


def others(
    robot: hovi.Robot, obstacles: list[hovi.planning.obstacles.obstacle.Obstacle]
) -> set[str]:
    """The obstacles whose distances are bounded."""
    found = distances_within_reach(robot, Clearance(obstacles, 0.01))
    return set() if found is None else {pair.other for pair in found.pairs}


def test_no_shape_of_an_arm_leaves_its_reach(panda: hovi.Robot) -> None:
    """By Coal, in 300 random configurations."""
    model, geometry = panda.model, convex_geometry(panda)
    data, placed = model.createData(), geometry.createData()
    origin = coal.Sphere(0.0)
    farthest = 0.0
    pin.seed(3)
    for _ in range(300):
        q = pin.randomConfiguration(model)
        pin.updateGeometryPlacements(model, data, geometry, placed, q)
        for i, shape in enumerate(geometry.geometryObjects):
            result = coal.DistanceResult()
            coal.distance(
                shape.geometry,
                coal.Transform3s(placed.oMg[i].rotation, placed.oMg[i].translation),
                origin,
                coal.Transform3s(),
                coal.DistanceRequest(),
                result,
            )
            farthest = max(farthest, result.min_distance)
    assert 0.5 < farthest <= reach_of(panda) < 2.5


def test_obstacles_that_may_come_near_are_kept(panda: hovi.Robot) -> None:
    assert others(panda, [NEAR, FAR]) == {"near"}
    assert others(panda, [FAR]) == set()
    assert others(panda, [FLOOR, HUGE, FAR]) == {"floor", "huge"}
    assert others(panda, [PASSING, FAR]) == {"passing"}


@pytest.mark.parametrize("name", ["tiago", "panda"])
def test_a_robot_with_joints_that_slide_has_no_reach(name: str) -> None:
    """A torso on a column, and a hand with its fingers."""
    robot = hovi.load_robot(name)
    assert reach_of(robot) == np.inf
    assert others(robot, [FAR]) == {"far"}


def test_pairs_that_may_touch_are_those_of_obstacles_that_are_left(panda: hovi.Robot) -> None:
    touching = [("panda_hand", "far"), ("panda_hand", "near")]
    found = distances_within_reach(panda, Clearance([NEAR, FAR], 0.01, may_touch=touching))
    assert found is not None
    marked = {(pair.link, pair.other) for pair in found.pairs if pair.touching}
    assert marked == {("panda_hand", "near")}


def test_the_least_distance_of_a_motion_is_that_of_all_obstacles() -> None:
    task = hovi.load_task(hovi.example("ur5_around_sphere"))
    alone = hovi.plan_task(task, obstacles=[])
    found = hovi.plan_task(task, obstacles=[FAR])
    assert found.problem is not None
    assert found.problem.distances is None
    assert (found.cost, found.nit) == (alone.cost, alone.nit)
    margins = found.margins()
    assert margins.distance == pytest.approx(8.0, abs=1.0)
    assert margins.nearest_pair is not None
    assert margins.nearest_pair.endswith("and obstacle 'far'")
    assert f"of {margins.nearest_pair}" in str(margins)
    assert found.trajectory.metadata["clearance"]["obstacles"][0]["name"] == "far"
