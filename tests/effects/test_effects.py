"""Gravity is Pinocchio's; the joint limit potential is a smooth ramp."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.effects import Gravity, JointLimitPotential, SceneSymbols
from hovi.effects.joint_limit_potential import smooth_ramp
from hovi.errors import SceneError
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.cost_terms import PotentialTerm
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]

WIDTHS = [1e-3, 0.1, 2.0]
RANGE = (0.0, 2.9)


def ramp_and_derivatives(width: float, x: Array) -> Array:
    """r, r' and r'' at x, (3, M)."""
    s = ca.SX.sym("s")
    r = smooth_ramp(s, width)
    slope = ca.gradient(r, s)
    function = ca.Function("ramp", [s], [ca.vertcat(r, slope, ca.gradient(slope, s))])
    return np.asarray(function(x[None]).full())


def potential_of(robot: Robot, effect: JointLimitPotential) -> PotentialTerm:
    term = Scene(robot, [effect]).effort_lagrangian().potential
    assert term is not None
    return term


def jet_with_elbow_at(x: Array) -> tuple[Array, Array, Array]:
    q = np.zeros((len(x), 2))
    q[:, 1] = x
    return q, np.ones_like(q), np.ones_like(q)


# The ramp


@pytest.mark.parametrize("w", WIDTHS)
def test_outside_its_width_the_ramp_is_piecewise_linear(w: float) -> None:
    x = np.concatenate([-w * np.geomspace(1, 1e4, 30), w * np.geomspace(1, 1e4, 30)])
    r, slope, bend = ramp_and_derivatives(w, x)
    np.testing.assert_allclose(r, np.maximum(x, 0.0), rtol=1e-15, atol=0)
    np.testing.assert_array_equal(slope[np.abs(x) > w], x[np.abs(x) > w] > 0)
    np.testing.assert_array_equal(bend[np.abs(x) > w], 0.0)


@pytest.mark.parametrize("w", WIDTHS)
def test_within_its_width_the_ramp_is_the_quartic_of_its_docstring(w: float) -> None:
    x = w * np.linspace(-1, 1, 41)
    r, slope, bend = ramp_and_derivatives(w, x)
    np.testing.assert_allclose(r, (x + w) ** 3 * (3 * w - x) / (16 * w**3), atol=1e-15 * w)
    np.testing.assert_allclose(slope, (x + w) ** 2 * (2 * w - x) / (4 * w**3), atol=1e-14)
    inside = slice(1, -1)
    expected = 3 * (w**2 - x**2) / (4 * w**3)
    np.testing.assert_allclose(bend[inside], expected[inside], atol=1e-13 / w)


@pytest.mark.parametrize("w", WIDTHS)
def test_the_ramp_is_twice_continuously_differentiable(w: float) -> None:
    e = 1e-9
    for joint in (-w, w):
        sides = ramp_and_derivatives(w, np.array([joint * (1 - e), joint * (1 + e)]))
        scale = np.array([w, 1.0, 1.0 / w])
        np.testing.assert_allclose((sides[:, 1] - sides[:, 0]) / scale, 0.0, atol=10 * e)


@pytest.mark.parametrize("w", WIDTHS)
def test_the_ramp_is_increasing_convex_and_above_the_sharp_ramp(w: float) -> None:
    x = w * np.linspace(-2, 2, 401)
    r, slope, bend = ramp_and_derivatives(w, x)
    assert (r >= np.maximum(x, 0.0) - 1e-15 * w).all()
    assert (np.diff(r) >= 0).all()
    assert ((slope >= 0) & (slope <= 1 + 1e-15)).all()
    assert (bend >= 0).all()


# The potential


@pytest.mark.parametrize("slope", [1.0, 1000.0])
def test_the_potential_has_its_slope_outside_the_range_and_is_zero_inside(
    two_link: Robot, slope: float
) -> None:
    V = potential_of(two_link, JointLimitPotential({"elbow": RANGE}, slope=slope, width=0.01))
    x = np.array([-3.0, -0.5, -0.011, 0.011, 1.0, 2.88, 2.92, 4.0])
    outside = np.maximum(RANGE[0] - x, 0) + np.maximum(x - RANGE[1], 0)
    np.testing.assert_allclose(V.value(*jet_with_elbow_at(x)), slope * outside, rtol=1e-13)


def test_gradient_and_hessian_of_the_potential_match_finite_differences(two_link: Robot) -> None:
    effect = JointLimitPotential({"elbow": RANGE, "shoulder": (-1.0, 1.0)}, slope=30.0, width=0.5)
    V = potential_of(two_link, effect)
    random = np.random.default_rng(0)
    q = np.column_stack([random.uniform(-2, 2, 200), random.uniform(-1, 4, 200)])
    v, a = random.normal(size=(2, 200, 2))
    _, gradient, hessian = V.expand(q, v, a)
    np.testing.assert_array_equal(gradient[:, 2:], 0.0)
    np.testing.assert_array_equal(hessian[:, 2:], 0.0)
    e = 1e-5
    for i in range(2):
        d = e * np.eye(2)[i]
        slope = (V.value(q + d, v, a) - V.value(q - d, v, a)) / (2 * e)
        np.testing.assert_allclose(gradient[:, i], slope, rtol=0, atol=1e-7)
        bend = (V.expand(q + d, v, a)[1] - V.expand(q - d, v, a)[1]) / (2 * e)
        np.testing.assert_allclose(hessian[:, :, i], bend, rtol=0, atol=1e-3)


def test_the_potential_adds_to_the_cost_and_not_to_the_torque(two_link: Robot) -> None:
    without, within = Scene(two_link), Scene(two_link, [JointLimitPotential({"elbow": RANGE})])
    jet = jet_with_elbow_at(np.array([-1.0, 1.0, 3.9]))
    np.testing.assert_array_equal(without.inverse_dynamics(*jet), within.inverse_dynamics(*jet))
    added = within.effort_lagrangian().value(*jet) - without.effort_lagrangian().value(*jet)
    np.testing.assert_allclose(added, [1000.0, 0.0, 1000.0], rtol=1e-10, atol=1e-10)


def test_a_range_may_be_open_on_one_side(two_link: Robot) -> None:
    V = potential_of(two_link, JointLimitPotential({"elbow": (-np.inf, 1.0)}))
    value, gradient, hessian = V.expand(*jet_with_elbow_at(np.array([-50.0, 0.0, 3.0])))
    np.testing.assert_allclose(value, [0.0, 0.0, 2000.0])
    np.testing.assert_allclose(gradient[:, 1], [0.0, 0.0, 1000.0])
    np.testing.assert_array_equal(hessian, 0.0)


def test_the_potential_acts_on_the_right_joint_after_a_continuous_one() -> None:
    model = pin.Model()
    model.name = "wheel and elbow"
    wheel = model.addJoint(0, pin.JointModelRUBY(), pin.SE3.Identity(), "wheel")  # nq = 2, nv = 1
    model.addJoint(wheel, pin.JointModelRY(), pin.SE3.Identity(), "elbow")
    robot, effect = load_robot(model), JointLimitPotential({"elbow": (0.0, 1.0)})
    effect.check(robot)
    q, v, a, t = ca.SX.sym("q", 3), ca.SX.sym("v", 2), ca.SX.sym("a", 2), ca.SX.sym("t")
    V = ca.Function("V", [q], [effect.potential(robot, SceneSymbols(q, v, a, t))])
    for elbow, expected in ((0.5, 0.0), (3.0, 2000.0)):
        assert float(V([0.6, 0.8, elbow])) == pytest.approx(expected)  # cos, sin, elbow


def test_without_ranges_the_potential_is_zero(two_link: Robot) -> None:
    jet = jet_with_elbow_at(np.array([-50.0, 3.0]))
    bare, empty = Scene(two_link), Scene(two_link, [JointLimitPotential({})])
    expected = bare.effort_lagrangian().evaluate(*jet)
    for found, wanted in zip(empty.effort_lagrangian().evaluate(*jet), expected, strict=True):
        np.testing.assert_array_equal(found, wanted)


# Refusals and accounts


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"ranges": {"elbow": (1.0, 1.0)}}, "the range of 'elbow' must rise"),
        ({"ranges": {"elbow": (2.0, 1.0)}}, "the range of 'elbow' must rise"),
        ({"ranges": {"elbow": (np.nan, 1.0)}}, "the range of 'elbow' must rise"),
        ({"ranges": {"elbow": (0.0, np.nan)}}, "the range of 'elbow' must rise"),
        ({"ranges": {"elbwo": RANGE}}, "has no joint 'elbwo'.*did you mean 'elbow'"),
        ({"ranges": {"elbow": RANGE}, "slope": 0.0}, "slope must be positive and finite, got 0"),
        ({"ranges": {"elbow": RANGE}, "slope": np.nan}, "slope must be positive and finite"),
        ({"ranges": {"elbow": RANGE}, "width": -1e-3}, "width must be positive and finite"),
        ({"ranges": {"elbow": RANGE}, "width": np.inf}, "width must be positive and finite"),
    ],
)
def test_invalid_ramp_parameters_are_refused(
    two_link: Robot, values: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(SceneError, match=sentence):
        Scene(two_link, [JointLimitPotential(**values)])


@pytest.mark.parametrize("joint", ["root_joint", "root_joint[3]"])
def test_a_joint_with_several_coordinates_cannot_have_a_range(joint: str) -> None:
    robot = load_robot("simple_humanoid")  # its base floats
    with pytest.raises(SceneError, match=r"no joint 'root_joint.*' with one coordinate"):
        Scene(robot, [JointLimitPotential({joint: RANGE})])


@pytest.mark.parametrize("acceleration", [np.nan, np.inf, -np.inf])
def test_non_finite_gravity_is_refused(two_link: Robot, acceleration: float) -> None:
    with pytest.raises(SceneError, match="acceleration must be finite"):
        Scene(two_link, [Gravity(acceleration)])
