"""Lengths that look like millimetres, and lengths that do not."""

from __future__ import annotations

import numpy as np
import pytest

import hovi
from hovi.effects import Payload
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.problem.presolve.frame_hints import hint_on_frame, reach_of
from hovi.planning.problem.presolve.length_slips import length_slips

HALF_MILE = hovi.Box([2000.0, 2000.0, 1.0], [0.0, 0.0, -1.0], name="floor")


@pytest.mark.parametrize("name", ["ur5", "panda", "two_link"])
def test_no_joint_is_ever_beyond_the_reach(name: str) -> None:
    robot = hovi.load_robot(hovi.example("two_link.urdf") if name == "two_link" else name)
    random, furthest = np.random.default_rng(0), 0.0
    low, high = np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0)
    joints = [str(each) for each in robot.model.names[1:]]
    for q in random.uniform(low, high, (200, robot.nq)):
        at = robot.frame_positions(joints, q[None])[0]
        furthest = max(furthest, float(np.linalg.norm(at, axis=1).max()))
    assert 0.5 < furthest / reach_of(robot) < 1 + 1e-12


def test_bases_that_float_or_slide_reach_everything() -> None:
    assert reach_of(hovi.load_robot(hovi.example("flying_body.urdf"), free_flyer=True)) == np.inf


@pytest.mark.parametrize(
    "obstacle",
    [
        hovi.Sphere([0.5, 0.2, 0.3], 0.1),
        hovi.Sphere([10.0, 0.0, 0.0], 0.1),
        hovi.Capsule([[0.0, 1.0, -500.0], [0.0, 1.0, 500.0]], 0.1),
        hovi.Box([0.1, 0.1, 0.1], [1.0, 0.0, 0.0], [0.0, 0.0, 6.0]),
        hovi.Box([0.1, 0.1, 0.1], [1.0, 0.0, 0.0], [0.0, 0.0, 2.5 * np.pi]),
        HALF_MILE,
    ],
)
def test_near_and_large_obstacles_and_short_lengths_are_not_suspected(
    obstacle: hovi.Box | hovi.Capsule | hovi.Sphere, ur5: hovi.Robot
) -> None:
    scene = hovi.Scene(ur5, [Payload("tool0", 1.0, (0.0, 0.0, 0.3))])
    q = [np.zeros(6), np.ones(6)]
    assert list(length_slips(scene, Clearance([obstacle], 0.3), q)) == []


def test_what_is_too_far_away_is_suspected(ur5: hovi.Robot) -> None:
    far = [hovi.Sphere([0.0, 600.0, 0.0], 50.0, name="ball")]
    (sentence,) = length_slips(hovi.Scene(ur5), Clearance(far), [np.zeros(6)])
    assert sentence.startswith("obstacle 'ball' is 550 m away from the robot's base")
    (margin,) = length_slips(hovi.Scene(ur5), Clearance([HALF_MILE], 5.0), [np.zeros(6)])
    assert margin == "the margin of 5 m looks like millimetres: 5 mm are 0.005 m."
    assert not list(length_slips(hovi.Scene(ur5), Clearance((), 5.0), [np.zeros(6)]))


@pytest.mark.parametrize(("moved", "suspected"), [(49.0, False), (51.0, True)])
def test_a_slide_is_suspected_by_what_it_moves(moved: float, suspected: bool) -> None:
    cart = hovi.load_robot(hovi.example("cart_pole.urdf"))
    slide = int(np.flatnonzero(cart.sliding)[0])
    q = np.zeros((2, cart.nq))
    q[:, slide] = 1000.0, 1000.0 + moved
    q[1, 1 - slide] = 2000.0  # an angle
    assert bool(list(length_slips(hovi.Scene(cart), Clearance(), list(q)))) == suspected


def test_a_goal_out_of_reach_is_only_suspected_where_millimetres_would_be_in_reach(
    ur5: hovi.Robot,
) -> None:
    for position, suspected in (
        ([457.0, 191.0, 300.0], True),
        ([1.9, 0.0, 0.3], False),
        ([9e4, 0.0, 0.0], False),
    ):
        hint = hint_on_frame(ur5, hovi.FrameGoal("tool0", position=position))
        assert ("looks like millimetres" in hint) == suspected
        assert bool(hint) == suspected


@pytest.mark.parametrize(("away", "unit"), [
    (60.0, "centimetres, which are (0.6, 0, 0) m"), (64.0, "millimetres, which are (0.064, 0, 0)"),
    (19.0, ""), (21.0, "centimetres, which are (0.21, 0, 0) m"),
])  # fmt: skip
def test_a_goal_that_millimetres_would_place_in_the_base_is_suspected_in_centimetres(
    ur5: hovi.Robot, away: float, unit: str
) -> None:
    hint = hint_on_frame(ur5, hovi.FrameGoal("tool0", position=[away, 0.0, 0.0]))
    assert bool(hint) == bool(unit)
    assert unit in hint


def test_more_equations_than_joints_are_counted_for_the_joints_that_move_the_frame(
    ur5: hovi.Robot,
) -> None:
    pose = {"position": [2.0, 2.0, 2.0], "rpy": [0.0, 0.0, 0.0]}
    assert hint_on_frame(ur5, hovi.FrameGoal("tool0", **pose)) == ""
    hint = hint_on_frame(ur5, hovi.FrameGoal("upper_arm_link", **pose))
    assert "6 coordinates of frame 'upper_arm_link', which only 2 joint coordinates move" in hint
    hint = hint_on_frame(ur5, hovi.FrameGoal("shoulder_link", position=[2.0, 2.0, 2.0]))
    assert "3 coordinates of frame 'shoulder_link', which only 1 joint coordinate moves" in hint
