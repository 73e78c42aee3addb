"""The arrays of a joint tree, and their checks in compiled code."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from hovi.dynamics.joint_tree import JointTree, read_joint_tree
from samples.manifold_robots import BASES, chain, with_arm

AXIS = np.array([0.48, -0.6, 0.64])


def tree_of(*joints: pin.JointModel) -> JointTree:
    return read_joint_tree(chain(joints))


@pytest.mark.parametrize(
    ("joint", "angular", "linear"),
    [
        (pin.JointModelRY(), 1.0, 0.0),
        (pin.JointModelRevoluteUnaligned(AXIS), 1.0, 0.0),
        (pin.JointModelRUBZ(), 1.0, 0.0),
        (pin.JointModelPX(), 0.0, 1.0),
        (pin.JointModelPrismaticUnaligned(AXIS), 0.0, 1.0),
        (pin.JointModelHY(-0.3), 1.0, -0.3),
        (pin.JointModelHelicalUnaligned(AXIS, 0.2), 1.0, 0.2),
    ],
    ids=lambda x: x.shortname() if hasattr(x, "shortname") else str(x),
)
def test_a_joint_rotates_about_and_translates_along_its_z_axis(joint, angular, linear) -> None:
    model = chain([joint])
    tree = read_joint_tree(model)
    data = model.joints[1].createData()
    model.joints[1].calc(data, pin.neutral(model))
    axis = np.asarray(data.S).ravel()
    z = model.jointPlacements[1].rotation.T @ tree.rotations[0][:, 2]
    np.testing.assert_allclose(np.concatenate([linear * z, angular * z]), axis, atol=1e-15)
    np.testing.assert_allclose([tree.angular[0], tree.linear[0]], [angular, linear], atol=1e-15)


def test_a_joint_of_three_coordinates_becomes_a_chain_of_three() -> None:
    model = chain([pin.JointModelTranslation(), pin.JointModelRX()])
    tree = read_joint_tree(model)
    assert tree.parents.tolist() == [-1, 0, 1, 2]
    assert tree.coordinates.tolist() == [0, 1, 2, 3]
    assert tree.masses.tolist() == [0.0, 0.0, 1.0, 1.0]


@pytest.mark.parametrize("base", ["free-flyer", "spherical", "planar"])
def test_the_components_of_a_base_come_first(base: str) -> None:
    model = with_arm(base)
    tree = read_joint_tree(model)
    size = model.joints[1].nv
    assert len(tree.base_twist_indices) == size
    assert tree.parents.tolist() == list(range(-1, model.nv - 1))
    expected = model.jointPlacements[1].actInv(model.gravity).vector
    np.testing.assert_array_equal(tree.gravity, expected)


@pytest.mark.parametrize("base", BASES)
def test_a_pickled_tree_has_the_same_bytes(base: str) -> None:
    tree = read_joint_tree(with_arm(base))
    for name, value in vars(pickle.loads(pickle.dumps(tree))).items():
        assert np.asarray(value).tobytes() == np.asarray(getattr(tree, name)).tobytes()


def changed(array: np.ndarray, index: int, value: Any) -> np.ndarray:
    copy = array.copy()
    copy[index] = value
    return copy


ARM = tree_of(pin.JointModelRX(), pin.JointModelRUBY(), pin.JointModelPZ())
FLYER = read_joint_tree(with_arm("free-flyer"))


@pytest.mark.parametrize(
    ("tree", "change", "reason"),
    [
        (ARM, {"parents": changed(ARM.parents, 1, 1)}, "joint 1 must come after its parent"),
        (ARM, {"parents": changed(ARM.parents, 0, 2)}, "joint 0 must come after its parent"),
        (ARM, {"parents": changed(ARM.parents, 0, -2)}, "out of bounds: -2"),
        (ARM, {"parents": changed(ARM.parents, 2, 2**32)}, "out of bounds"),
        (ARM, {"coordinates": changed(ARM.coordinates, 2, 4)}, "joint 2 must have its coordinate"),
        (ARM, {"coordinates": changed(ARM.coordinates, 1, 3)}, "joint 1 must have its coordinate"),
        (ARM, {"coordinates": changed(ARM.coordinates, 1, -1)}, "joint 1 must have"),
        (ARM, {"nq": 3}, "joint 2 must have its coordinate within"),
        (ARM, {"nq": 7}, "one or two numbers"),
        (ARM, {"nq": -1}, "one or two numbers"),
        (ARM, {"nq": 2**40}, "out of bounds"),
        (ARM, {"masses": np.zeros(2)}, r"masses must have shape \(3,\), got \(2,\)"),
        (ARM, {"rotations": np.zeros((4, 3, 3))}, r"rotations must have shape \(3, 3, 3\)"),
        (ARM, {"centers": np.zeros((3, 2))}, r"centers must have shape \(3, 3\), got \(3, 2\)"),
        (ARM, {"moments": np.zeros((3, 9))}, "moments must have shape"),
        (ARM, {"gravity": np.zeros(3)}, "gravity must have shape"),
        (ARM, {"base_twist_indices": np.arange(4)}, "components"),
        (ARM, {"base_twist_indices": np.arange(7)}, "six"),
        (FLYER, {"base_coordinate": 8}, "rotation within a configuration"),
        (FLYER, {"base_coordinate": -1}, "rotation within a configuration"),
        (FLYER, {"base_twist_indices": np.array([0, 1, 2, 3, 4, 6])}, "numbered from 0 to 5"),
        (FLYER, {"parents": changed(FLYER.parents, 3, 1)}, "joint 3 must be a component"),
        (FLYER, {"parents": changed(FLYER.parents, 6, -1)}, "joint 6 must be a component"),
    ],
    ids=str,
)
def test_compiled_code_refuses_inconsistent_arrays(tree, change, reason) -> None:
    with pytest.raises(ValueError, match=reason):
        replace(tree, **change).compiled()


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        ({"parents": ARM.parents.astype(np.int32)}, "int64 with 1 dimension, got: int32 array"),
        ({"masses": ARM.masses.astype(np.float32)}, "float64"),
        ({"rotations": np.zeros((3, 3))}, "3 dimensions"),
        ({"translations": np.zeros((3, 6))[:, ::2]}, "not contiguous"),
        ({"continuous": ARM.continuous.astype(np.int8)}, "bool"),
        ({"armatures": [0.0, 0.0, 0.0]}, "got: list"),
    ],
    ids=lambda each: next(iter(each)),
)
def test_compiled_code_refuses_other_types(change, kind) -> None:
    with pytest.raises(TypeError, match=kind) as refusal:
        replace(ARM, **change).compiled()
    assert str(refusal.value).startswith(next(iter(change)))


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        *(("q", (2, 3)), ("v", (1, 3)), ("a", (2, 4)), ("weight", (2, 2)), ("curvature", (3, 3))),
        *(("tau", (2, 2)), ("jacobian", (2, 3, 8)), ("hessian", (2, 9, 8))),
    ],
)
def test_compiled_code_refuses_points_of_a_wrong_shape(name, shape) -> None:
    rows = dict.fromkeys(("v", "a", "weight", "curvature", "tau"), (2, 3))
    shapes = {"q": (2, 4), **rows, "jacobian": (2, 3, 9), "hessian": (2, 9, 9)}
    arrays = {key: np.zeros(size) for key, size in {**shapes, name: shape}.items()}
    with pytest.raises(ValueError, match=f"{name} must have shape"):
        ARM.compiled().expand(**arrays, threads=1)
