"""What a scene leaves unsaid is said, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

import hovi
from hovi.effects import EffortWeight, Gravity
from hovi.planning.problem.presolve.assumptions import assumptions


def test_gravity_is_named_also_where_there_is_none(two_link: hovi.Robot) -> None:
    assert assumptions(hovi.Scene(two_link, [Gravity(0.0)])) == []
    (sentence,) = assumptions(hovi.Scene(two_link))
    assert sentence == "Gravity is left out, as the scene does not name it."


def test_forces_beside_torques_are_told_unless_weighted_or_undriven() -> None:
    cart = hovi.load_robot(hovi.example("cart_pole.urdf"))
    (sentence,) = assumptions(hovi.Scene(cart, [Gravity()]))
    slide, hinge = (cart.coordinate_names[int(cart.sliding.argmax())], cart.joint_names[1])
    assert f"of forces in N, as of {slide!r}, and of torques in N m, as of {hinge!r}" in sentence
    assert assumptions(hovi.Scene(cart, [Gravity()], passive=[hinge])) == []
    assert assumptions(hovi.Scene(cart, [Gravity(), EffortWeight(1.0)])) == []
    assert assumptions(hovi.Scene(cart, [Gravity()]), weighted=True) == []


def test_a_hand_beside_an_arm_gets_the_weights_of_its_urdf() -> None:
    panda = hovi.load_robot("panda")
    (sentence,) = assumptions(hovi.Scene(panda, [Gravity()]))
    assert "'panda_finger_joint1'" in sentence
    assert "[effects.effort_weight] from_urdf = true divides each by its effort limit" in sentence


def test_the_force_on_a_driven_base_is_that_of_the_motion() -> None:
    robot = hovi.load_robot(hovi.example("flying_body.urdf"), free_flyer=True)
    scene, q = hovi.Scene(robot, [Gravity()]), robot.neutral()
    (before,) = assumptions(scene)
    assert "has no motor that a URDF could name, but a force and a moment act on it" in before
    goal = robot.integrate(q, np.array([0.2, 0.0, 0.1, 0.0, 0.3, 0.0]))
    found = hovi.plan(scene, q, goal, 1.0, limits="none", intervals=8)
    tau = found.trajectory.sample(np.linspace(0.0, 1.0, 257)).tau
    force, moment = (np.linalg.norm(tau[:, part], axis=1).max() for part in ([0, 1, 2], [3, 4, 5]))
    assert f"of up to {force:.3g} N and {moment:.3g} N m act on it" in found.message
    assert found.message.count("root_joint") == 1


@pytest.mark.parametrize("name", ["root_joint"])
def test_a_passive_base_is_not_driven(name: str) -> None:
    robot = hovi.load_robot(hovi.example("two_link.urdf"), free_flyer=True)
    assert assumptions(hovi.Scene(robot, [Gravity()], passive=[name])) == []
