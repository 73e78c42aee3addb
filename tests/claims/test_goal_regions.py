"""Regions in which frames may end, judged by Pinocchio alone."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.errors import HoviError, InputError

Array = npt.NDArray[np.float64]

FRAME, T, HELD = "tool0", 1.5, 1e-7
BEGIN = np.array([0.0, -1.2, 1.5, -1.8, -1.57, 0.0])
END = BEGIN + np.array([0.5, 0.2, -0.3, 0.2, 0.1, 0.4])
OPTIONS: dict[str, Any] = {"self_collision": False, "tolerance": 1e-6}
RADIUS, ANGLE = 0.02, np.deg2rad(10.0)


@cache
def scene() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])


def pose(q: Array, frame: str = FRAME) -> Array:
    """By Pinocchio's forward kinematics, (4, 4)."""
    model = scene().robot.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return np.array(data.oMf[model.getFrameId(frame)].homogeneous)


@cache
def planned(limits: str = "urdf", **region: Any) -> hovi.Solution:
    region = {key: list(x) if isinstance(x, tuple) else x for key, x in region.items()}
    goal = hovi.FrameGoal(FRAME, pose=pose(END), **region)
    return hovi.plan(scene(), BEGIN, goal, T, limits=limits, **OPTIONS)


def offset(found: hovi.Solution) -> Array:
    """Of the tool at the end from its goal, along the axes of the world, in [m]."""
    return np.asarray(pose(found.trajectory.q[-1])[:3, 3] - pose(END)[:3, 3])


def turned(found: hovi.Solution) -> float:
    """The angle between the tool at the end and its goal, in [rad]."""
    R = pose(END)[:3, :3].T @ pose(found.trajectory.q[-1])[:3, :3]
    return float(np.linalg.norm(pin.log3(R)))


@pytest.mark.parametrize("limits", ["none", "urdf"])
def test_a_ball_is_used_to_its_edge_where_that_costs_less(limits: str) -> None:
    exact, found = planned(limits), planned(limits, within=RADIUS)
    assert found.success, found.message
    assert np.linalg.norm(offset(found)) == pytest.approx(RADIUS, abs=HELD)
    assert turned(found) < HELD
    assert found.cost < 0.99 * exact.cost


def test_no_other_point_of_the_ball_costs_less() -> None:
    """By plans to points at and within its edge."""
    found, random = planned("none", within=RADIUS), np.random.default_rng(3)
    guess = found.trajectory.q[-1]
    for _ in range(4):
        away = random.normal(size=3)
        away *= RADIUS * random.uniform(0.5, 1.0) / np.linalg.norm(away)
        there = pose(END)
        there[:3, 3] += 0.5 * (away + offset(found))
        goal = hovi.FrameGoal(FRAME, pose=there, guess=guess)
        other = hovi.plan(scene(), BEGIN, goal, T, limits="none", **OPTIONS)
        assert other.cost > found.cost * (1.0 - 1e-6)


@pytest.mark.parametrize("limits", ["none", "urdf"])
def test_the_multiplier_of_an_edge_is_the_slope_of_the_cost(limits: str) -> None:
    found = planned(limits, within=RADIUS)
    h = 0.05 * RADIUS
    more, less = (planned(limits, within=RADIUS + step) for step in (h, -h))
    slope = (more.cost - less.cost) / (2.0 * h)
    assert found.region_prices == {"tool0 distance": pytest.approx(slope, rel=1e-2)}


def test_a_box_holds_every_axis_and_uses_those_with_room() -> None:
    box = np.array([0.02, 0.0, 0.03])
    found = planned("none", within=("20 mm", 0, 0.03))
    assert found.success, found.message
    assert (np.abs(offset(found)) <= box + HELD).all()
    assert np.abs(np.abs(offset(found)[[0, 2]]) - box[[0, 2]]).min() < HELD
    assert found.cost < planned("none").cost


def test_a_bound_that_does_not_pay_is_not_held() -> None:
    """In a box so wide along y that the best place is inside."""
    found = planned("none", within=(0.01, 2.0, 0.01))
    assert found.success, found.message
    prices = found.region_prices
    assert prices["tool0 y"] == 0.0
    assert 0.01 < abs(offset(found)[1]) < 2.0
    wider = planned("none", within=(0.01, 3.0, 0.01))
    assert wider.cost == pytest.approx(found.cost, rel=1e-6)


def test_an_edge_is_let_go_that_costs_more_than_the_inside() -> None:
    """The edge to which the multiplier at the middle points lies beyond the best place."""
    wide = planned("none", within=(0.01, 2.0, 0.01))
    room = 1.5 * abs(float(offset(wide)[1]))
    found = planned("none", within=(0.01, room, 0.01))
    assert found.region_prices["tool0 y"] == 0.0
    assert abs(float(offset(found)[1])) < room - 1e-3
    assert found.cost <= wide.cost * (1.0 + 1e-6)


def test_the_multiplier_of_an_angle_is_the_slope_of_the_cost() -> None:
    found, h = planned("none", within_angle=ANGLE), 0.05 * ANGLE
    more, less = (planned("none", within_angle=ANGLE + step) for step in (h, -h))
    slope = (more.cost - less.cost) / (2.0 * h)
    assert found.region_prices == {"tool0 angle": pytest.approx(slope, rel=1e-2)}


def test_a_miss_is_measured_from_the_region_along_its_axes() -> None:
    R = pose(END)[:3, :3]
    away = pose(END)[:3, 3] - R @ [0.0, 0.0, 0.02]
    box = [0.001, 0.001, 0.03]
    along = hovi.FrameGoal(FRAME, position=away, within=box, box_frame=FRAME)
    assert along.miss(scene().robot, END)[0] < 1e-12
    world = hovi.FrameGoal(FRAME, position=away, within=box)
    assert world.miss(scene().robot, END)[0] > 1e-3


def test_a_box_may_lie_along_another_frame() -> None:
    """Here along the tool itself, which is turned against the world."""
    found = planned("none", within=(0.0, 0.0, 0.03), box_frame=FRAME)
    R = pose(found.trajectory.q[-1])[:3, :3]
    along = R.T @ offset(found)
    assert found.success, found.message
    assert np.abs(along[:2]).max() < HELD
    assert abs(along[2]) == pytest.approx(0.03, abs=HELD)


def test_an_angle_and_a_distance_are_held_at_once() -> None:
    found = planned("none", within=RADIUS, within_angle="10 deg")
    assert found.success, found.message
    assert np.linalg.norm(offset(found)) <= RADIUS + HELD
    assert turned(found) == pytest.approx(ANGLE, abs=1e-6)
    assert found.cost < planned("none", within=RADIUS).cost


def test_an_axis_may_be_off_by_an_angle() -> None:
    world = pose(END)[:3, 2]
    goal = hovi.FrameGoal(
        FRAME, position=pose(END)[:3, 3], axis=([0, 0, 1], world), within_angle=ANGLE, guess=END
    )
    found = hovi.plan(scene(), BEGIN, goal, T, limits="none", **OPTIONS)
    assert found.success, found.message
    tilt = np.arccos(pose(found.trajectory.q[-1])[:3, 2] @ world)
    assert tilt <= ANGLE + 1e-6
    assert np.linalg.norm(offset(found)) < HELD


def test_a_region_is_reached_whose_middle_is_not() -> None:
    """The arm ends short of a point beyond its reach."""
    far = pose(np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0]))[:3, 3]
    beyond = far * (1.0 + 0.25 / np.linalg.norm(far))
    goal = hovi.FrameGoal(FRAME, position=beyond, within="300 mm")
    found = hovi.plan(scene(), BEGIN, goal, 2.0, self_collision=False)
    assert found.success, found.message
    assert np.linalg.norm(pose(found.trajectory.q[-1])[:3, 3] - beyond) <= 0.3 + HELD
    exact = hovi.FrameGoal(FRAME, position=beyond)
    refused = hovi.plan(scene(), BEGIN, exact, 2.0, self_collision=False)
    assert refused.status is hovi.Status.INFEASIBLE


def test_segments_end_in_their_regions() -> None:
    def costs(**region: Any) -> hovi.Solution:
        goal = hovi.FrameGoal(FRAME, pose=pose(END), **region)
        segments = [hovi.Segment(goal, 1.0), hovi.Segment(BEGIN, 1.0)]
        return hovi.plan_sequence(scene(), BEGIN, segments, self_collision=False)

    exact, found = costs(), costs(within=RADIUS)
    assert found.success, found.message
    away = pose(found.trajectory.sample([1.0]).q[0])[:3, 3] - pose(END)[:3, 3]
    assert np.linalg.norm(away) <= RADIUS + HELD
    assert found.cost < 0.99 * exact.cost


def test_a_free_duration_ends_in_a_region() -> None:
    goals = [hovi.FrameGoal(FRAME, pose=pose(END), **x) for x in ({}, {"within": RADIUS})]
    common = {"time_weight": 300.0, "self_collision": False}
    exact, found = (hovi.plan(scene(), BEGIN, x, (0.5, 3.0), **common) for x in goals)
    assert found.success, found.message
    assert np.linalg.norm(offset(found)) <= RADIUS + HELD
    assert found.cost < exact.cost


def test_replans_stay_in_the_region() -> None:
    found = planned("none", within=RADIUS)
    again = found.replan(start=hovi.State(BEGIN + 0.01))
    assert again.success, again.message
    assert np.linalg.norm(offset(again)) <= RADIUS + HELD


def test_two_hands_may_each_have_a_region() -> None:
    robot = scene().robot
    elbow = pose(END, "forearm_link")[:3, 3]
    goals = [
        hovi.FrameGoal(FRAME, position=pose(END)[:3, 3], within=RADIUS, guess=END),
        hovi.FrameGoal("forearm_link", position=elbow, within="5 mm"),
    ]
    found = hovi.plan(scene(), BEGIN, goals, T, limits="none", **OPTIONS)
    assert found.success, found.message
    assert np.linalg.norm(offset(found)) <= RADIUS + HELD
    at = pose(found.trajectory.q[-1], "forearm_link")[:3, 3]
    assert np.linalg.norm(at - elbow) <= 0.005 + HELD
    assert max(hovi.FrameGoal("forearm_link", position=elbow).miss(robot, END)) < 1e-12


def test_files_have_regions(tmp_path: Path) -> None:
    task = hovi.load_task(hovi.example("ur5_reach"))
    text = hovi.example("ur5_reach").read_text()
    path = tmp_path / "scene.toml"
    head = text[: text.index("[goal]")]
    path.write_text(
        head + '[goal]\nframe = "tool0"\nposition = [0.45, 0.25, 0.25]\n'
        'within = ["10 mm", 0, 0.02]\nbox_frame = "tool0"\n'
        'axis = { frame = [0, 0, 1], world = [0, 0, -1] }\nwithin_angle = "5 deg"\n'
        "[effects.gravity]\n"
    )
    goal = hovi.load_task(path).goal
    assert isinstance(goal, hovi.FrameGoal)
    assert [each.name for each in goal.bounds] == ["x", "z", "angle"]
    again = hovi.load_task(hovi.save_task(hovi.load_task(path), tmp_path / "again.toml")).goal
    assert isinstance(again, hovi.FrameGoal)
    assert [each.room for each in again.bounds] == [each.room for each in goal.bounds]
    assert again.box_frame == "tool0"
    assert task.scene.robot.name == "ur5"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"within": "10 deg"}, "`within` of a frame goal"),
        ({"within": -0.1}, "`within` of a frame goal must be a positive number of metres"),
        ({"within": [0.1, 0.1]}, "a length, or three for a box"),
        ({"within": 0.1, "position": None, "axis": ([0, 0, 1], [0, 0, 1])}, "around a position"),
        ({"within_angle": 0.1}, "around a rotation or an axis"),
        ({"within_angle": "200 deg", "rotation": np.eye(3)}, "less than half a turn"),
        ({"within": 0.1, "box_frame": FRAME}, "needs a box"),
        ({"within": [0.1, 0.1, 0.1], "box_frame": "toool"}, "toool"),
    ],
)
def test_regions_of_nothing_are_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(HoviError, match=said):
        hovi.FrameGoal(FRAME, **{"position": [0.4, 0.2, 0.3]} | given).check(scene().robot)


def test_starts_and_via_points_take_no_region() -> None:
    region = hovi.FrameGoal(FRAME, position=pose(END)[:3, 3], within=RADIUS)
    with pytest.raises(InputError, match="a start takes no region"):
        hovi.plan(scene(), region, BEGIN, T)
    with pytest.raises(InputError, match="a via point takes no region"):
        hovi.Via(0.5, region)
