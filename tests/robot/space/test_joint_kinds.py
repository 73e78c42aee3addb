"""The table of joint kinds against Pinocchio's joints."""

from __future__ import annotations

import re
from pathlib import Path

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.errors import ModelError
from hovi.robot.loading import load_robot
from hovi.robot.space import joint_kinds
from hovi.robot.space.configuration_rate import configuration_rate
from hovi.robot.space.configuration_space import configuration_space
from hovi.robot.space.joint_kinds import COMPOSITE, JOINT_KINDS, coordinate_units, kind_of
from hovi.scene.scene import Scene
from samples.joints import JOINTS, TYPES
from samples.manifold_robots import chain, mimicking

Array = npt.NDArray[np.float64]
EVERY_TYPE = pytest.mark.parametrize("name", JOINTS)


def alone(name: str) -> pin.Model:
    model = pin.Model()
    model.addJoint(0, JOINTS[name], pin.SE3.Identity(), "j")
    return model


def random_configuration(model: pin.Model) -> Array:
    d = np.random.default_rng(4).uniform(-1, 1, model.nv)
    return np.array(pin.integrate(model, pin.neutral(model), d))


def motion_subspace(model: pin.Model, q: Array) -> Array:
    """S of the only joint at q, in its own frame, shape (6, nv)."""
    joint = model.joints[1]
    data = joint.createData()
    joint.calc(data, q)
    return np.array(data.S).reshape(6, -1)


# What is in the table


def test_every_joint_type_of_pinocchio_has_one_kind() -> None:
    names = [name for kind in JOINT_KINDS for name in kind.names]
    assert sorted(names) == sorted(TYPES)


@EVERY_TYPE
def test_coordinates_without_rotation_are_lengths(name: str) -> None:
    model = alone(name)
    S = motion_subspace(model, pin.neutral(model))
    slides = [bool(column[:3].any() and not column[3:].any()) for column in S.T]
    units = coordinate_units(model)
    assert [each.q for each in units] == ["m" if slide else "rad" for slide in slides]
    assert [each.tau for each in units] == ["N" if slide else "N m" for slide in slides]


@EVERY_TYPE
def test_dimensions_match_the_joint(name: str) -> None:
    joint = alone(name).joints[1]
    kind = kind_of(joint)
    assert kind.units is not None
    nv = len(kind.units)
    assert (nv if kind.group is None else kind.group.nq, nv) == (joint.nq, joint.nv)


@EVERY_TYPE
def test_configurations_integrate_as_in_pinocchio(name: str) -> None:
    model = alone(name)
    space, unknown = configuration_space(model)
    assert unknown == ()
    q, d = random_configuration(model), np.linspace(-0.7, 1.1, model.nv)
    np.testing.assert_allclose(space.integrate(q, d), pin.integrate(model, q, d), atol=1e-14)


@EVERY_TYPE
def test_the_configuration_rate_is_the_derivative_of_integrate(name: str) -> None:
    model, h = alone(name), 1e-5
    q, v = random_configuration(model), np.linspace(-0.7, 1.1, model.nv)
    symbols = ca.SX.sym("q", model.nq), ca.SX.sym("v", model.nv)
    rate = ca.Function("rate", symbols, [configuration_rate(model, *symbols)])
    ahead, behind = (np.array(pin.integrate(model, q, s * h * v)) for s in (1, -1))
    np.testing.assert_allclose(rate(q, v).full()[:, 0], (ahead - behind) / (2 * h), atol=1e-9)


@EVERY_TYPE
def test_the_kernel_supports_axes_unchanged_by_their_own_motion(name: str) -> None:
    """Anywhere if constant, as a base if not, else nowhere."""
    model = alone(name)
    S = motion_subspace(model, pin.neutral(model))
    fixed = np.allclose(S, motion_subspace(model, random_configuration(model)), atol=1e-12)
    axes = [pin.Motion(column) for column in S.T]
    commute = all(np.allclose((a ^ b).vector, 0.0) for a in axes for b in axes)
    expected = ("anywhere" if commute else "as base") if fixed else "nowhere"
    assert kind_of(model.joints[1]).kernel == expected


@pytest.mark.parametrize("label", ["revolute", "continuous", "prismatic", "floating", "planar"])
@pytest.mark.parametrize("axis", ["0 0 1", "0.6 0 0.8"])
def test_reports_use_the_joint_types_of_urdf(label: str, axis: str) -> None:
    model = pin.buildModelFromXML(
        f'<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="{label}">'
        f'<parent link="a"/><child link="b"/><axis xyz="{axis}"/>'
        '<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>'
    )
    assert kind_of(model.joints[1]).label == label


# What is no joint on its own, or unknown


def test_followers_have_no_coordinates() -> None:
    model = mimicking()
    assert kind_of(model.joints[2]).label == "mimic"
    assert [each.q for each in coordinate_units(model)] == ["rad"]


def test_a_composite_has_the_properties_of_its_members(monkeypatch: pytest.MonkeyPatch) -> None:
    composite = pin.JointModelComposite()
    for name in ("PX", "HZ", "RUBZ"):
        composite.addJoint(JOINTS[name])
    model = chain([composite])
    assert kind_of(model.joints[1]) is COMPOSITE
    assert configuration_space(model)[0].parts == (2, "SO(2)")
    remove_kind(monkeypatch, "HZ")
    assert configuration_space(model)[1] == ("j0",)


def remove_kind(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.delitem(joint_kinds._BY_NAME, f"JointModel{name}")


def test_a_joint_type_missing_from_the_table_is_refused_by_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    remove_kind(monkeypatch, "HX")
    robot = load_robot(chain([JOINTS["RX"], JOINTS["HX"], JOINTS["PY"]]))
    assert "JointModelHX" in robot.describe()
    assert [each.q for each in robot.coordinate_units] == ["rad", "rad", "m"]
    with pytest.raises(
        ModelError, match=r"does not support planning: .* unknown kind, 'j1'; .* lock"
    ):
        Scene(robot).effort_lagrangian()


# The only place


def test_no_other_file_compares_the_names_of_joint_types() -> None:
    """Elsewhere joint types are only constructed, as in pin.JointModelRX()."""
    asks = re.compile(r"shortname|classname|(?<!pin\.)JointModel[A-Z]|isinstance\([^)]*JointModel")
    source = Path(hovi.__file__).parent
    files = {path for path in source.rglob("*.py") if asks.search(path.read_text())}
    assert files == {Path(joint_kinds.__file__)}
