"""Configuration spaces as products of groups, built from Pinocchio's joints."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from hovi.errors import InputError
from hovi.robot.loading import load_robot
from hovi.robot.space.configuration_space import ConfigurationSpace, configuration_space
from samples.manifold_robots import configurations, with_arm


def test_parts_follow_from_the_joints() -> None:
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
def test_products_integrate_as_in_pinocchio(base: str) -> None:
    robot = load_robot(with_arm(base))
    q0, q1 = configurations(robot, 5, 1), configurations(robot, 5, 2)
    d = np.array([pin.difference(robot.model, x, y) for x, y in zip(q0, q1, strict=True)])
    np.testing.assert_allclose(robot.difference(q0, q1), d, atol=1e-12)
    np.testing.assert_allclose(robot.difference(q0[0], robot.integrate(q0[0], d)), d, atol=1e-12)
    np.testing.assert_allclose(np.abs(robot.integrate(q0, d)), np.abs(q1), atol=1e-12)


def test_full_turns_are_closest_to_the_expected_difference() -> None:
    space = ConfigurationSpace((1, "SO(2)", "SE(2)", "SO(3)", "SE(3)"))
    random = np.random.default_rng(0)
    q0 = space.normalized(random.normal(size=(20, space.nq)))
    x = random.normal(size=(20, space.nv))
    x[:, 1] *= 20.0
    for factor in space.curved:
        turn = [factor.v.start + i for i in factor.group.angular]
        x[:, turn] *= random.uniform(3.2, 5.0, (20, 1)) / np.linalg.norm(
            x[:, turn], axis=1, keepdims=True
        )
    q1 = space.integrate(q0, x)
    expected = x + 0.3 * random.uniform(-1, 1, x.shape)
    np.testing.assert_allclose(space.difference_near(q0, q1, expected), x, atol=1e-12)
    assert np.abs(space.difference(q0, q1) - x).max() > 1.0
    still = np.zeros((1, space.nv))
    still[0, 1] = 8 * np.pi
    np.testing.assert_allclose(space.difference_near(q0[:1], q0[:1], still), still, atol=1e-12)


@pytest.mark.parametrize(
    ("parts", "q", "dq"),
    [
        (("SO(3)", 1), 5, 2),
        (("SO(3)", 1), 4, 4),
        (("SE(3)",), 8, 6),
        ((1, "SO(2)"), 3, 1),
        ((1, "SE(2)"), 5, 5),
        ((2, "SO(2)", 1), 4, 4),
    ],
)
def test_vectors_of_the_wrong_length_are_refused(
    parts: tuple[int | str, ...], q: int, dq: int
) -> None:
    space = ConfigurationSpace(parts)
    right, by = np.ones((2, space.nq)), np.zeros((2, space.nv))
    with pytest.raises(InputError, match=rf"numbers here, got {q if q != space.nq else dq} in"):
        space.integrate(np.ones((2, q)), np.zeros((2, dq)))
    with pytest.raises(InputError, match=f"a configuration has {space.nq} numbers here, got 0 "):
        space.integrate(np.array(1.0), by)
    for pair in ((right[:, 1:], right), (right, right[:, 1:])):
        with pytest.raises(InputError, match=f"a configuration has {space.nq} numbers here"):
            space.difference(*pair)
    with pytest.raises(InputError, match=f"a tangent vector has {space.nv} numbers here"):
        space.difference_near(right, right, by[:, 1:])


def test_entries_of_a_configuration_are_named() -> None:
    robot = load_robot(with_arm("free-flyer"))
    base, arm = ("x", "y", "z", "qx", "qy", "qz", "qw"), ("j1", "j2[cos]", "j2[sin]", "j3")
    assert robot.space.names(robot.coordinate_names) == (*(f"j0[{part}]" for part in base), *arm)


@pytest.mark.parametrize("parts", [(0,), (-1,), ("SO(4)",), (1.5,), (True,)])
def test_an_invalid_part_is_refused(parts: tuple) -> None:  # type: ignore[type-arg]
    with pytest.raises(InputError, match="a part of a configuration space"):
        ConfigurationSpace(parts)
