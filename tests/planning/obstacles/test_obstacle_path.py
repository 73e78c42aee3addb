"""Obstacles that move: their poses over time, distances to them, and motions that avoid them."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
import umsgpack

import hovi
from hovi.cli.reports.limit_margins import nearest_pair
from hovi.errors import InputError
from hovi.planning.clearance.convex_shapes import convex_geometry
from hovi.planning.clearance.distances import Distances
from hovi.planning.obstacles.obstacle import Obstacle
from hovi.viewing.replay_session import write_html
from oracles.world_distances import Placed, from_world

Array = npt.NDArray[np.float64]

TIMES = [0.5, 1.0, 2.5]
POSITIONS = [[0.4, -0.6, 0.3], [0.5, 0.1, 0.5], [0.3, 0.6, 0.2]]
TURNS = [[0.0, 0.0, 0.1], [0.5, -0.3, 1.2], [0.2, 0.4, 3.0]]
PATH = hovi.ObstaclePath(TIMES, POSITIONS, TURNS)


def test_a_path_has_its_poses_at_its_times_and_stands_still_before_and_after() -> None:
    for t, position, rpy in zip(TIMES, POSITIONS, TURNS, strict=True):
        expected = pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.array(position))
        assert PATH.pose(t).isApprox(expected, 1e-12)
    assert PATH.pose(0.0).isApprox(PATH.pose(0.5))
    assert PATH.pose(9.0).isApprox(PATH.pose(2.5))


def test_a_path_has_continuous_accelerations_between_its_ends() -> None:
    """The second difference across a time equals those on both sides."""
    h = 1e-3
    for t in (1.0 - 2 * h, 1.0, 1.0 + 2 * h, 1.7):
        rows = PATH.poses(t + h * np.array([-1.0, 0.0, 1.0]))
        curve = (rows[0] - 2 * rows[1] + rows[2]) / h**2
        if t == 1.0:
            middle = curve
    sides = [np.diff(PATH.poses(1.0 + s * h * np.arange(3)), 2, axis=0)[0] / h**2 for s in (-1, 1)]
    np.testing.assert_allclose(sides[0], sides[1], atol=0.05)
    np.testing.assert_allclose(middle, sides[0], atol=0.05)


def test_two_poses_are_a_straight_line_at_constant_speed() -> None:
    path = hovi.ObstaclePath([1.0, 3.0], [[0, 0, 0], [1, 2, 4]])
    np.testing.assert_allclose(path.poses([1.5])[0], [0.25, 0.5, 1.0, 0, 0, 0, 1], atol=1e-15)


def test_a_turn_takes_the_short_way() -> None:
    """From -2.4 to -1.6 rad, between which the quaternions of Eigen change their signs."""
    path = hovi.ObstaclePath([0.0, 1.0], np.zeros((2, 3)), [[0, 0, -2.4], [0, 0, -1.6]])
    x, y, _ = path.pose(0.5).rotation[:, 0]
    assert np.arctan2(y, x) == pytest.approx(-2.0)


CASES: list[tuple[Obstacle, coal.CollisionGeometry, pin.SE3]] = [
    (
        hovi.Box([0.2, 0.3, 0.1], [0.1, 0.0, 0.0], [0.0, 0.0, 0.4], path=PATH),
        coal.Box(0.2, 0.3, 0.1),
        pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, 0.4), np.array([0.1, 0.0, 0.0])),
    ),
    (
        hovi.Cylinder(0.1, 0.5, [0, 0, 0.1], path=PATH),
        coal.Cylinder(0.1, 0.5),
        pin.SE3(np.eye(3), np.array([0, 0, 0.1])),
    ),
]


def samples(robot: hovi.Robot) -> tuple[Array, Array]:
    pin.seed(4)
    q = np.array([pin.randomConfiguration(robot.model) for _ in range(60)])
    return q, np.random.default_rng(0).uniform(0.0, 3.0, 60)


@pytest.mark.parametrize(("obstacle", "shape", "at"), CASES, ids=["box", "cylinder"])
@pytest.mark.parametrize("compiled", [True, False], ids=["compiled", "coal"])
def test_distances_are_those_of_shapes_at_their_poses(
    obstacle: Obstacle,
    shape: coal.CollisionGeometry,
    at: pin.SE3,
    compiled: bool,
    panda: hovi.Robot,
) -> None:
    q, t = samples(panda)
    distances = Distances(panda, hovi.Clearance([obstacle]))
    if not compiled:
        distances._measured._compiled = None

    def world(p: int) -> list[Placed]:
        return [(shape, PATH.pose(float(t[p])) * at)]

    expected = from_world(panda, q, world, convex_geometry(panda))[:, :, 0]
    found = distances.values(distances.at(q, t))
    apart = expected > 0
    assert np.count_nonzero(~apart) > 0
    np.testing.assert_allclose(found[apart], expected[apart], atol=1e-5)
    assert (found[~apart] < 1e-5).all()


@pytest.mark.parametrize("compiled", [True, False], ids=["compiled", "coal"])
def test_derivatives_are_those_of_an_obstacle_that_stands_there(
    compiled: bool, panda: hovi.Robot
) -> None:
    """First and second ones in q, at each of 20 times."""
    q, t = samples(panda)
    moving = Distances(panda, hovi.Clearance([hovi.Sphere([0.1, 0, 0], 0.1, path=PATH)]))
    if not compiled:
        moving._measured._compiled = None
    random = np.random.default_rng(1)
    for one, time in zip(q[:20], t, strict=False):
        place = PATH.pose(float(time)).act(np.array([0.1, 0.0, 0.0]))
        still = Distances(panda, hovi.Clearance([hovi.Sphere(place, 0.1)]))
        force = random.uniform(size=(1, len(still.pairs)))
        given = moving.expansion(moving.at(one[None], time), force)
        expected = still.expansion(one[None], force)
        outside = expected[0][0] > 0
        np.testing.assert_allclose(given[0], expected[0], atol=1e-7)
        np.testing.assert_allclose(given[1][:, outside], expected[1][:, outside], atol=1e-6)
        if outside.all():
            np.testing.assert_allclose(given[2], expected[2], atol=2e-3)


HANG, REACH = [-np.pi / 2, 0.0], [0.3, 0.7]
CROSSING = {"times": [0.0, 1.5], "positions": [[2.1, 0.0, -2.2], [-0.9, 0.0, 1.4]]}
"""A ball flies towards the arm, and through where the forearm would pass."""


def reach(scene: hovi.Scene, *obstacles: Obstacle, **options: Any) -> hovi.Solution:
    given = {"limits": "none", "margin": 0.05, **options}
    return hovi.plan(scene, HANG, REACH, 1.5, obstacles=obstacles, **given, self_collision=False)


def crossing(path: object = CROSSING) -> hovi.Sphere:
    return hovi.Sphere([0, 0, 0], 0.15, name="ball", path=path)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def avoiding(arm_scene: hovi.Scene) -> hovi.Solution:
    solution = reach(arm_scene, crossing())
    assert solution.success, solution.message
    return solution


def test_a_ball_that_flies_by_is_avoided_at_all_times(
    arm_scene: hovi.Scene, avoiding: hovi.Solution
) -> None:
    """At 5,000 samples by Coal's own calls; a ball that stays where it begins changes nothing."""
    t = np.linspace(0.0, 1.5, 5_001)
    q = avoiding.trajectory.configurations(t)
    begin, end = np.array(CROSSING["positions"])

    def world(p: int) -> list[Placed]:
        return [(coal.Sphere(0.15), pin.SE3(np.eye(3), begin + (end - begin) * t[p] / 1.5))]

    d = from_world(arm_scene.robot, q, world)
    assert 0.05 - 2e-6 < d.min() < 0.0505
    free = reach(arm_scene)
    still = reach(arm_scene, hovi.Sphere(begin, 0.15))
    assert still.cost == pytest.approx(free.cost, rel=1e-3)
    assert avoiding.cost > 2.0 * free.cost
    assert nearest_pair(avoiding.trajectory)[0] == pytest.approx(d.min(), abs=1e-6)


def test_the_replay_moves_the_ball(avoiding: hovi.Solution, tmp_path: Path) -> None:
    """The keyframes of its positions are on the line, and a saved motion has it, too."""
    avoiding.trajectory.save(tmp_path / "motion.npz")
    again = hovi.Trajectory.load(tmp_path / "motion.npz")
    page = write_html(again, tmp_path / "page.html").page
    (message,) = (m for m in page.messages.all() if m.kind == "set_animation")
    animations = umsgpack.unpackb(message.packed)["animations"]
    (clip,) = (each["clip"] for each in animations if "obstacle" in each["path"])
    (track,) = (each for each in clip["tracks"] if "position" in each["name"])
    begin, end = np.array(CROSSING["positions"])
    keys = {round(float(k["time"]), 9): k["value"] for k in track["keys"]}
    for t in (0.0, 0.75, 1.5):
        np.testing.assert_allclose(keys[t], begin + (end - begin) * t / 1.5, atol=1e-12)
    from hovi.viewing.recorded_limits import with_obstacles

    shown = with_obstacles(pin.GeometryModel(), again).geometryObjects[0]
    np.testing.assert_allclose(shown.placement.translation, begin)


def test_an_end_in_the_way_of_the_ball_is_told_with_its_time(arm_scene: hovi.Scene) -> None:
    """At the goal only, where the ball arrives with the arm; at the start it is far."""
    tip = arm_scene.robot.frame_position("tip", np.array([REACH]))[0]
    path = {"times": [0.0, 1.5], "positions": [tip + np.array([0.0, 0.0, 1.0]), tip]}
    solution = reach(arm_scene, crossing(path))
    assert not solution.success
    assert "at the goal link" in solution.message
    assert "'ball' overlap" in solution.message


def test_inverse_kinematics_looks_at_what_stands_still_only(panda: hovi.Robot) -> None:
    goal = hovi.FrameGoal("panda_hand_tcp", position=[0.45, 0.2, 0.4])
    options = {"obstacles": [hovi.Sphere([0.45, 0.2, 0.4], 0.3, path=CROSSING)]}
    assert len(hovi.inverse_kinematics(panda, goal, **options)) > 0  # type: ignore[arg-type]


def test_times_have_to_be_given_where_obstacles_move(arm_scene: hovi.Scene) -> None:
    distances = Distances(arm_scene.robot, hovi.Clearance([crossing()]))
    with pytest.raises(InputError, match="need times"):
        distances.values(np.zeros((1, 2)))
    few = distances.restricted([0])
    assert few.values(few.at(np.zeros((1, 2)), 0.3)).shape == (1, 1)


def test_a_path_comes_back_from_its_data() -> None:
    again = dataclasses.replace(CASES[0][0], path=PATH.to_dict())
    assert again == CASES[0][0]
    assert again.to_dict()["path"]["times"] == TIMES


@pytest.mark.parametrize(
    ("path", "words"),
    [
        (3, "must have times and positions"),
        ({"times": [0, 1]}, "needs `positions`"),
        ({"time": [0, 1], "positions": []}, "has no `time`: did you mean 'times'"),
        ({"times": [0], "positions": [[0, 0, 0]]}, "needs 2 to 10,000 times"),
        ({"times": [0, 1], "positions": [[0, 0, 0]]}, "and as many positions and rpy, got 2, 1"),
        ({"times": [1, 0], "positions": [[0, 0, 0]] * 2}, "must ascend"),
        ({"times": [0, np.nan], "positions": [[0, 0, 0]] * 2}, "a list of finite numbers"),
        ({"times": [0, 1], "positions": [[0, 0]] * 2}, "rows of three finite numbers"),
        (
            {"times": [0, 1], "positions": [[0, 0, 0]] * 2, "rpy": [[0, 0, 0], [0, 0, 3.14]]},
            "less than half a turn apart",
        ),
    ],
)
def test_an_invalid_path_is_refused_in_one_sentence(path: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        hovi.Sphere([0, 0, 0], 0.1, path=path)  # type: ignore[arg-type]
