"""The analytic batch kernel against CasADi's derivatives of the same inverse dynamics."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor

import casadi
import numpy as np
import pinocchio as pin
import pytest

from hovi._native import dynamics as native
from hovi.dynamics.inverse_dynamics_kernel import InverseDynamicsKernel, joints_without_kernel
from hovi.dynamics.joint_tree import read_joint_tree
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.errors import InputError, ModelError

FINGERS = ("panda_finger_joint1", "panda_finger_joint2")
ROBOTS = [  # name, joints locked, n
    ("asr_twodof", (), 2),
    ("double_pendulum", (), 2),
    ("finger_edu", (), 3),
    ("ur5", (), 6),
    ("talos_arm", (), 7),
    ("panda", FINGERS, 7),
    ("panda", (), 9),
    ("xarm7", (), 7),
    ("z1", (), 7),
    ("hyq", (), 12),
    ("allegro_left_hand", (), 16),
]
LARGE_ROBOTS = [("baxter", (), 19), ("simple_humanoid", (), 29), ("talos", (), 32)]


class Oracle:
    """tau, J and H of one model by CasADi's automatic differentiation."""

    def __init__(self, model: pin.Model, weight: np.ndarray) -> None:
        n = model.nv
        x, curvature = casadi.SX.sym("x", 3 * n), casadi.SX.sym("curvature", n)
        tau = casadi_functions(model).inverse_dynamics(*casadi.vertsplit(x, n))
        J = casadi.jacobian(tau, x)
        second = casadi.hessian(casadi.dot(curvature, tau), x)[0]
        self._function = casadi.Function("oracle", [x, curvature], [tau, J, second])
        self._weight = np.diag(weight)

    def __call__(self, point: np.ndarray, curvature: np.ndarray) -> tuple[np.ndarray, ...]:
        tau, J, second = (out.full() for out in self._function(point.ravel(), curvature))
        return tau.ravel(), J, J.T @ self._weight @ J + second


def random_points(n: int, points: int) -> np.ndarray:  # q, v, a, curvature, each (points, n)
    return np.random.default_rng(n).normal(size=(4, points, n))


def assert_kernel_matches_oracle(model: pin.Model, points: int) -> None:
    n = model.nv
    q, v, a, curvature = random_points(n, points)
    weight = np.random.default_rng(1).uniform(0.5, 2.0, n)
    results = InverseDynamicsKernel(model).expand(q, v, a, weight, curvature)
    oracle = Oracle(model, weight)
    for k in range(points):
        expected = oracle(np.stack([q[k], v[k], a[k]]), curvature[k])
        for ours, theirs in zip(results, expected, strict=True):
            scale = np.abs(theirs).max()
            np.testing.assert_allclose(ours[k], theirs, rtol=0, atol=1e-11 * scale)


@pytest.mark.parametrize(("name", "locked", "n"), ROBOTS)
def test_expansion_matches_casadi(load_model, name, locked, n) -> None:
    model = load_model(name, locked=locked, armature=True)
    assert model.nv == n
    assert_kernel_matches_oracle(model, points=5)


@pytest.mark.long
@pytest.mark.parametrize(("name", "locked", "n"), ROBOTS + LARGE_ROBOTS)
def test_expansion_matches_casadi_at_many_points(load_model, name, locked, n):
    assert_kernel_matches_oracle(load_model(name, locked=locked, armature=True), points=1000)


@pytest.mark.parametrize("links", [1, 30])
def test_expansion_of_chains_matches_casadi(links) -> None:
    assert_kernel_matches_oracle(chain(links), points=2)


@pytest.mark.parametrize(
    "joint",
    [
        pin.JointModelPX(),
        pin.JointModelPrismaticUnaligned(np.array([0.6, 0.0, 0.8])),
        pin.JointModelRevoluteUnaligned(np.array([0.6, 0.0, 0.8])),
        pin.JointModelHZ(0.3),
        pin.JointModelHelicalUnaligned(np.array([0.6, 0.0, 0.8]), 0.3),
        pin.JointModelTranslation(),
    ],
    ids=lambda joint: joint.shortname(),
)
def test_every_supported_kind_of_joint_agrees_with_casadi(joint) -> None:
    model = chain(2)
    tip = model.addJoint(2, joint, pin.SE3.Random(), "odd")
    model.appendBodyToJoint(tip, pin.Inertia.Random(), pin.SE3.Identity())
    last = model.addJoint(tip, pin.JointModelRY(), pin.SE3.Random(), "last")
    model.appendBodyToJoint(last, pin.Inertia.Random(), pin.SE3.Identity())
    assert joints_without_kernel(model) == ()
    assert_kernel_matches_oracle(model, points=5)


def chain(links: int) -> pin.Model:
    model = pin.Model()
    parent = 0
    for i in range(links):
        placement = pin.SE3(np.eye(3), np.array([0.3 * (i > 0), 0.0, 0.0]))
        kind = pin.JointModelRY() if i % 3 else pin.JointModelRZ()
        parent = model.addJoint(parent, kind, placement, f"joint{i}")
        body = pin.Inertia.FromCylinder(0.5, 0.05, 0.3)
        model.appendBodyToJoint(parent, body, pin.SE3(np.eye(3), np.array([0.15, 0.0, 0.0])))
    return model


AXIS = np.array([0.48, -0.6, 0.64])
KINDS = [
    *(pin.JointModelRX(), pin.JointModelRY(), pin.JointModelRZ()),
    *(pin.JointModelPX(), pin.JointModelPY(), pin.JointModelPZ()),
    *(pin.JointModelHX(0.2), pin.JointModelHY(-0.3), pin.JointModelHZ(0.1)),
    pin.JointModelRevoluteUnaligned(AXIS),
    pin.JointModelPrismaticUnaligned(AXIS),
    pin.JointModelHelicalUnaligned(AXIS, 0.3),
    pin.JointModelTranslation(),
]


def random_tree(joints: int, seed: int, roots: int) -> pin.Model:
    """A tree of joints of every kind in any order; gravity points anywhere."""
    rng = np.random.default_rng(seed)
    pin.seed(seed)
    model = pin.Model()
    for i in range(joints):
        parent = 0 if i < roots else int(rng.integers(1, i + 1))
        kind = KINDS[rng.integers(len(KINDS))]
        index = model.addJoint(parent, kind, pin.SE3.Random(), f"joint{i}")
        model.appendBodyToJoint(index, pin.Inertia.Random(), pin.SE3.Random())
    model.gravity.linear = rng.normal(size=3)
    model.armature = rng.uniform(0.1, 1.0, model.nv)
    return model


@pytest.mark.parametrize(("joints", "roots"), [(1, 1), (4, 1), (7, 2), (12, 1), (12, 3)])
@pytest.mark.parametrize("seed", range(3))
def test_branching_trees_of_every_kind_of_joint_agree_with_casadi(joints, roots, seed) -> None:
    assert_kernel_matches_oracle(random_tree(joints, seed, roots), points=5)


def core_expansion(core: native.InverseDynamicsKernel, n: int, points: int) -> list[np.ndarray]:
    q, v, a, curvature = random_points(n, points)
    shapes = (points, n), (points, n, 3 * n), (points, 3 * n, 3 * n)
    out = [np.empty(shape) for shape in shapes]
    core.expand(q, v, a, np.ones_like(q), curvature, *out, 1)
    return out


@pytest.mark.parametrize("model", [chain(7), random_tree(12, 5, 2)], ids=["chain", "tree"])
def test_both_instruction_sets_agree_to_rounding(model) -> None:
    tree, n = read_joint_tree(model), model.nv
    fast = core_expansion(tree.compiled(), n, 7)
    portable = core_expansion(tree.compiled(portable=True), n, 7)
    for one, other in zip(fast, portable, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * np.abs(other).max())


# Enough points that it is worth starting threads.
@pytest.mark.parametrize(("name", "locked", "n"), [ROBOTS[3], ROBOTS[9]])
def test_all_methods_and_thread_counts_give_the_same_bytes(load_model, name, locked, n) -> None:
    kernel = InverseDynamicsKernel(load_model(name, locked=locked))
    q, v, a, curvature = random_points(n, 4003)
    weight = np.ones(n)
    expected = kernel.expand(q, v, a, weight, curvature, threads=1)
    for threads in (2, 5, 40):
        results = kernel.expand(q, v, a, weight, curvature, threads=threads)
        for one, many in zip(expected, results, strict=True):
            assert one.tobytes() == many.tobytes()
    for one, linear in zip(expected, kernel.linearize(q, v, a, threads=2), strict=False):
        assert one.tobytes() == linear.tobytes()
    assert kernel.torque(q, v, a).tobytes() == kernel.torque(q, v, a, threads=2).tobytes()


@pytest.mark.parametrize("points", range(1, 10))
@pytest.mark.parametrize("portable", [False, True])
def test_a_point_has_the_same_bytes_in_every_batch(load_model, points, portable) -> None:
    core = read_joint_tree(load_model("panda")).compiled(portable)
    q, v, a, curvature = random_points(9, 9)

    def expand(rows: slice) -> list[np.ndarray]:
        inputs = [np.ascontiguousarray(x[rows]) for x in (q, v, a, np.ones_like(q), curvature)]
        count = len(inputs[0])
        out = [np.full((count, *shape), np.nan) for shape in ((9,), (9, 27), (27, 27))]
        core.expand(*inputs, *out, 1)
        return out

    whole, head, tail = (expand(rows) for rows in (slice(9), slice(points), slice(-points, None)))
    for all_points, first, last in zip(whole, head, tail, strict=True):
        assert all_points[:points].tobytes() == first.tobytes()
        assert all_points[-points:].tobytes() == last.tobytes()


def test_hessians_are_bitwise_symmetric(load_model) -> None:
    kernel = InverseDynamicsKernel(load_model("panda"))
    q, v, a, curvature = random_points(9, 6)
    H = kernel.expand(q, v, a, np.ones(9), curvature)[2]
    np.testing.assert_array_equal(H, H.transpose(0, 2, 1))


def test_without_curvature_the_hessian_is_gauss_newton(load_model) -> None:
    kernel = InverseDynamicsKernel(load_model("z1"))
    q, v, a, _ = random_points(7, 6)
    weight = np.arange(7.0)
    _, J, H = kernel.expand(q, v, a, weight)
    expected = np.einsum("pik,i,pil->pkl", J, weight, J)
    np.testing.assert_allclose(H, expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    zero = kernel.expand(q, v, a, weight, np.zeros_like(q))[2]
    np.testing.assert_array_equal(H, zero)


def test_torque_is_rnea(load_model) -> None:
    model = load_model("panda", armature=True)
    data = model.createData()
    q, v, a, _ = random_points(9, 6)
    expected = np.stack([pin.rnea(model, data, *point) for point in zip(q, v, a, strict=True)])
    tau = InverseDynamicsKernel(model).torque(q, v, a)
    np.testing.assert_allclose(tau, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_python_threads_can_share_a_kernel(load_model) -> None:
    kernel = InverseDynamicsKernel(load_model("ur5"))
    q, v, a, curvature = random_points(6, 50)
    expected = kernel.expand(q, v, a, np.ones(6), curvature)[2]
    with ThreadPoolExecutor(4) as pool:
        jobs = [
            pool.submit(kernel.expand, q, v, a, np.ones(6), curvature, threads=1 + i % 2)
            for i in range(12)
        ]
    for job in jobs:
        np.testing.assert_array_equal(job.result()[2], expected)


def test_a_kernel_survives_pickling(load_model) -> None:
    kernel = InverseDynamicsKernel(load_model("ur5", armature=True))
    q, v, a, _ = random_points(6, 3)
    copy = pickle.loads(pickle.dumps(kernel))
    np.testing.assert_array_equal(kernel.torque(q, v, a), copy.torque(q, v, a))


def test_an_empty_batch_gives_empty_arrays(load_model) -> None:
    empty = np.empty((0, 6))
    tau, J, H = InverseDynamicsKernel(load_model("ur5")).expand(empty, empty, empty, np.ones(6))
    assert (tau.shape, J.shape, H.shape) == ((0, 6), (0, 6, 18), (0, 18, 18))


def test_strided_and_integer_arrays_are_accepted(load_model) -> None:
    kernel = InverseDynamicsKernel(load_model("ur5"))
    q, _, a, _ = random_points(6, 8)
    zeros = np.zeros((4, 6), dtype=int)
    strided = kernel.torque(q[::2], zeros, a[::2])
    plain = kernel.torque(q[::2].copy(), zeros.astype(float), a[::2].copy())
    np.testing.assert_array_equal(strided, plain)


def test_joints_with_axes_that_change_with_their_own_motion_are_refused() -> None:
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelSphericalZYX(), pin.SE3.Identity(), "wrist")
    model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Identity())
    assert model.nq == model.nv
    with pytest.raises(ModelError, match="'wrist'"):
        InverseDynamicsKernel(model)


@pytest.mark.parametrize(
    ("name", "shapes"),
    [
        ("q", [(4, 5), (4, 6), (4, 6), (6,), (4, 6)]),
        ("v", [(4, 6), (3, 6), (4, 6), (6,), (4, 6)]),
        ("a", [(4, 6), (4, 6), (6,), (6,), (4, 6)]),
        ("weight", [(4, 6), (4, 6), (4, 6), (1, 6), (4, 6)]),
        ("curvature", [(4, 6), (4, 6), (4, 6), (6,), (6,)]),
    ],
)
def test_a_wrong_shape_is_refused_by_name(load_model, name, shapes) -> None:
    kernel = InverseDynamicsKernel(load_model("ur5"))
    with pytest.raises(InputError, match=f"^{name} must have shape"):
        kernel.expand(*(np.zeros(shape) for shape in shapes))


def test_fewer_than_one_thread_is_refused(load_model) -> None:
    kernel = InverseDynamicsKernel(load_model("ur5"))
    with pytest.raises(InputError, match="threads"):
        kernel.torque(*np.zeros((3, 2, 6)), threads=0)
