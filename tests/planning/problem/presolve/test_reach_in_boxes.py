"""Proofs that a frame is out of reach: never where a configuration is known, against samples."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import hovi
from hovi.dynamics.kinematic_chain import KinematicChain, read_kinematic_chain
from hovi.planning.problem.presolve.reach_in_boxes import proven_out_of_reach

ARMS = {"ur5": "tool0", "panda": "panda_hand_tcp", "kinova": "j2s6s200_end_effector"}


def chain_of(robot: hovi.Robot, frame: str) -> KinematicChain:
    chain = read_kinematic_chain(robot.model, frame)
    assert chain is not None
    return chain


def goals(robot: hovi.Robot, frame: str, q: np.ndarray) -> list[hovi.FrameGoal]:
    """What the frame meets at q: a pose, a position, a rotation, a position with an axis."""
    pose = robot.frame_pose(frame, q)
    p, R = pose[:3, 3], pose[:3, :3]
    inner = np.array([0.6, 0.0, 0.8])
    return [
        hovi.FrameGoal(frame, pose),
        hovi.FrameGoal(frame, position=p),
        hovi.FrameGoal(frame, rotation=R),
        hovi.FrameGoal(frame, position=p, axis=(inner, R @ inner)),
    ]


@pytest.mark.parametrize("name", ARMS)
def test_what_a_configuration_of_the_box_meets_is_never_out_of_reach(name: str) -> None:
    robot, random = hovi.load_robot(name), np.random.default_rng(1)
    chain = chain_of(robot, ARMS[name])
    for _ in range(4):
        center = random.uniform(-2.0, 2.0, chain.n)
        width = random.choice([0.02, 0.2, 1.0]) * random.uniform(0.2, 1.0, chain.n)
        inside = center + width * random.choice([-1.0, 1.0, 0.3], chain.n)
        q = chain.configurations(inside[None], robot.neutral())[0]
        for goal in goals(robot, ARMS[name], q):
            assert not proven_out_of_reach(chain, goal, center - width, center + width)


@pytest.mark.parametrize("name", ARMS)
def test_a_frame_that_is_far_from_a_narrow_box_is_out_of_reach(name: str) -> None:
    robot, random = hovi.load_robot(name), np.random.default_rng(2)
    chain = chain_of(robot, ARMS[name])
    for _ in range(5):
        center, elsewhere = random.uniform(-2.0, 2.0, (2, chain.n))
        q = chain.configurations(elsewhere[None], robot.neutral())[0]
        for goal in goals(robot, ARMS[name], q):
            assert proven_out_of_reach(chain, goal, center - 0.02, center + 0.02)


def test_a_proof_for_two_joints_exists_exactly_where_samples_miss_the_goal(
    two_link: hovi.Robot,
) -> None:
    chain = chain_of(two_link, "tip")
    lower, upper = np.array([0.2, -1.0]), np.array([1.0, 0.4])
    grid = itertools.product(*(np.linspace(a, b, 81) for a, b in zip(lower, upper, strict=True)))
    reached = two_link.frame_position("tip", np.array(list(grid)))
    random = np.random.default_rng(4)
    seen = set()
    for q in random.uniform(-2.0, 2.0, (400, 2)):
        position = two_link.frame_position("tip", q[None])[0]
        nearest = np.linalg.norm(reached - position, axis=1).min()
        if not 1e-2 < nearest < 5e-2:  # else samples are too few, or the case is easy
            continue
        goal = hovi.FrameGoal("tip", position=position)
        assert proven_out_of_reach(chain, goal, lower, upper)
        seen.add(bool((q > lower).all() and (q < upper).all()))
    assert seen == {False}


def test_there_is_no_proof_for_joints_without_bounds(two_link: hovi.Robot) -> None:
    chain, far = chain_of(two_link, "tip"), hovi.FrameGoal("tip", position=[9.0, 9.0, 9.0])
    bounds = np.array([0.0, -np.inf]), np.array([1.0, np.inf])
    assert not proven_out_of_reach(chain, far, *bounds)


def test_sliding_joints_count_with_their_length() -> None:
    robot = hovi.load_robot(hovi.example("cart_pole.urdf"))
    frame = robot.tip_frame
    chain = chain_of(robot, frame)
    q = robot.neutral()
    here = robot.frame_position(frame, q[None])[0]
    slide = int(np.flatnonzero(chain.linear)[0])
    along = robot.integrate(q, np.eye(robot.nv)[chain.velocities[slide]])
    ahead = robot.frame_position(frame, along[None])[0] - here
    for shift, proven in ((0.49, False), (0.55, True)):
        goal = hovi.FrameGoal(frame, position=here + shift * ahead)
        lower, upper = np.full(chain.n, -1e-3), np.full(chain.n, 1e-3)
        lower[slide], upper[slide] = -0.5, 0.5
        assert proven_out_of_reach(chain, goal, lower, upper) == proven
