"""Configuration spaces: products of groups, told from Pinocchio's joints."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from hovi.configuration_space import ConfigurationSpace, configuration_space
from hovi.errors import InputError
from hovi.robot import load_robot
from manifold_robots import configurations, with_arm


def test_parts_are_told_from_the_joints() -> None:
    assert configuration_space(with_arm("free-flyer"))[0].parts == ("SE(3)", 1, "SO(2)", 1)
    assert load_robot("kinova").space.parts == ("SO(2)", 2, "SO(2)", 1, "SO(2)")
    assert load_robot("ur5").space.parts == (6,)
    composite = pin.JointModelComposite()
    for joint in (pin.JointModelPX(), pin.JointModelRUBZ()):
        composite.addJoint(joint)
    model = pin.Model()
    model.addJoint(0, composite, pin.SE3.Identity(), "both")
    space, unknown = configuration_space(model)
    assert (space.parts, unknown) == ((1, "SO(2)"), ())
    q, d = pin.integrate(model, pin.neutral(model), np.array([0.3, 2.0])), np.array([-1.0, 0.5])
    np.testing.assert_allclose(space.integrate(q, d), pin.integrate(model, q, d), atol=1e-15)


@pytest.mark.parametrize("base", ["free-flyer", "spherical", "planar", "continuous"])
def test_products_move_as_in_pinocchio(base: str) -> None:
    robot = load_robot(with_arm(base))
    q0, q1 = configurations(robot, 5, 1), configurations(robot, 5, 2)
    d = np.array([pin.difference(robot.model, x, y) for x, y in zip(q0, q1, strict=True)])
    np.testing.assert_allclose(robot.difference(q0, q1), d, atol=1e-12)
    np.testing.assert_allclose(robot.difference(q0[0], robot.integrate(q0[0], d)), d, atol=1e-12)
    np.testing.assert_allclose(np.abs(robot.integrate(q0, d)), np.abs(q1), atol=1e-12)


def test_full_turns_are_those_nearest_to_what_is_expected() -> None:
    space = ConfigurationSpace((1, "SO(2)"))
    x = space.unwound(np.array([9.0, -3.0]), np.array([0.0, 10.0]))
    np.testing.assert_allclose(x, [9.0, -3.0 + 4 * np.pi])


@pytest.mark.parametrize("parts", [(0,), (-1,), ("SO(4)",), (1.5,), (True,)])
def test_what_is_no_part_is_refused(parts: tuple) -> None:  # type: ignore[type-arg]
    with pytest.raises(InputError, match="a part of a configuration space"):
        ConfigurationSpace(parts)
