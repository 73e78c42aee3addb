"""The kernel on manifolds: Pinocchio's torques, CasADi's derivatives."""

from __future__ import annotations

import pickle

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.dynamics.inverse_dynamics_kernel import InverseDynamicsKernel, joints_without_kernel
from hovi.dynamics.joint_tree import read_joint_tree
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.dynamics.torque_model import CasadiTorque
from hovi.errors import InputError, ModelError
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from samples.manifold_robots import BASES, chain, configurations, mimicking, with_arm

Array = npt.NDArray[np.float64]

POINTS = 6


def slanted(model: pin.Model) -> pin.Model:
    """A model with gravity in a general direction and a different armature per coordinate."""
    model.gravity.linear = np.array([1.0, 2.0, -9.0])
    model.armature = np.linspace(0.1, 1.0, model.nv)
    return model


def slanted_continuous() -> pin.JointModel:
    """A continuous joint about a general axis, which only a URDF can define."""
    joint = (
        '<joint name="j" type="continuous"><parent link="a"/><child link="b"/>'
        '<axis xyz="0.48 -0.6 0.64"/></joint>'
    )
    urdf = f'<robot name="r"><link name="a"/><link name="b"/>{joint}</robot>'
    return pin.buildModelFromXML(urdf).joints[1]


def branching(base: pin.JointModel, seed: int) -> pin.Model:
    """A base with two branching arms of continuous, revolute, helical and prismatic joints."""
    random = np.random.default_rng(seed)
    kinds = [
        *(slanted_continuous(), pin.JointModelRUBX(), pin.JointModelRY()),
        *(pin.JointModelHZ(0.2), pin.JointModelRUBZ(), pin.JointModelTranslation()),
    ]
    pin.seed(seed)
    model = pin.Model()
    model.name = "branching"
    for i, joint in enumerate([base, *kinds]):
        parent = int(random.integers(1, i + 1)) if i else 0
        index = model.addJoint(parent, joint, pin.SE3.Random(), f"j{i}")
        model.appendBodyToJoint(index, pin.Inertia.Random(), pin.SE3.Random())
        frame = pin.Frame(f"b{i}", index, 0, pin.SE3.Identity(), pin.FrameType.BODY)
        model.addFrame(frame)
    return model


def casadi_torque(robot: Robot) -> CasadiTorque:
    q, t = ca.SX.sym("q", robot.nq), ca.SX.sym("t")
    v, a = (ca.SX.sym(name, robot.nv) for name in "va")
    tau = casadi_functions(robot.model).inverse_dynamics(q, v, a)
    return CasadiTorque((q, v, a, t), tau, space=robot.space)


def jets(robot: Robot, points: int) -> tuple[Array, Array, Array, Array]:
    """Random q, v, a and curvature."""
    v, a, curvature = np.random.default_rng(1).normal(size=(3, points, robot.nv))
    return configurations(robot, points), v, a, curvature


def assert_kernel_is_rnea(model: pin.Model) -> None:
    robot = load_robot(slanted(model))
    q, v, a, curvature = jets(robot, POINTS)
    weight = np.random.default_rng(2).uniform(size=robot.nv)
    kernel, reference = InverseDynamicsKernel(robot.model), casadi_torque(robot)
    data = robot.model.createData()
    rnea = np.array([pin.rnea(robot.model, data, *jet) for jet in zip(q, v, a, strict=True)])
    expected = reference.expand(q, v, a, None, weight, curvature)
    found = kernel.expand(q, v, a, weight, curvature)
    pairs = [(kernel.torque(q, v, a), rnea), (found[0], rnea), *zip(found, expected, strict=True)]
    for one, other in (*pairs, (kernel.linearize(q, v, a)[1], expected[1])):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-13 * np.abs(other).max())
    np.testing.assert_array_equal(found[2], found[2].transpose(0, 2, 1))


@pytest.mark.parametrize("base", BASES)
def test_torques_and_derivatives_match_rnea_on_the_manifold(base: str) -> None:
    assert_kernel_is_rnea(with_arm(base))


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("seed", range(3))
def test_branching_arms_on_a_base_match_rnea(base: str, seed: int) -> None:
    assert_kernel_is_rnea(branching(BASES[base](), seed))


@pytest.mark.parametrize("base", BASES)
def test_a_base_alone_matches_rnea(base: str) -> None:
    assert_kernel_is_rnea(chain([BASES[base]()]))


def test_without_curvature_the_hessian_is_gauss_newton() -> None:
    robot = load_robot(slanted(with_arm("free-flyer")))
    q, v, a, _ = jets(robot, POINTS)
    weight = np.arange(float(robot.nv))
    _, J, H = InverseDynamicsKernel(robot.model).expand(q, v, a, weight)
    expected = np.einsum("pik,i,pil->pkl", J, weight, J)
    np.testing.assert_allclose(H, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


# Enough points that it is worth starting threads.
@pytest.mark.parametrize("base", BASES)
def test_batches_methods_and_thread_counts_give_the_same_bytes(base: str) -> None:
    robot = load_robot(with_arm(base))
    kernel, weight = InverseDynamicsKernel(robot.model), np.ones(robot.nv)
    q, v, a, curvature = jets(robot, 2003)
    expected = kernel.expand(q, v, a, weight, curvature)
    threaded = kernel.expand(q, v, a, weight, curvature, threads=2)
    part = kernel.expand(q[5:12], v[5:12], a[5:12], weight, curvature[5:12])
    for one, many, few in zip(expected, threaded, part, strict=True):
        assert one.tobytes() == many.tobytes()
        assert one[5:12].tobytes() == few.tobytes()
    for one, linear in zip(expected, kernel.linearize(q, v, a, threads=2), strict=False):
        assert one.tobytes() == linear.tobytes()
    assert kernel.torque(q, v, a).tobytes() == expected[0].tobytes()


@pytest.mark.parametrize("base", BASES)
def test_both_instruction_sets_agree_to_rounding(base: str) -> None:
    robot = load_robot(with_arm(base))
    n, tree = robot.nv, read_joint_tree(robot.model)
    q, v, a, curvature = jets(robot, 7)
    shapes = (7, n), (7, n, 3 * n), (7, 3 * n, 3 * n)
    fast, portable = ([np.empty(shape) for shape in shapes] for _ in range(2))
    for out, portably in ((fast, False), (portable, True)):
        core = tree.compiled(portable=portably)
        core.expand(q, v, a, np.ones_like(v), curvature, *out, 1)
    for one, other in zip(fast, portable, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * np.abs(other).max())


def test_casadi_second_derivatives_are_along_integrate() -> None:
    robot = load_robot(chain([pin.JointModelRX(), pin.JointModelSpherical(), pin.JointModelRUBX()]))
    reference, n = casadi_torque(robot), robot.nv
    q = configurations(robot, POINTS)
    v, a, weight = np.random.default_rng(2).normal(size=(3, POINTS, n))
    h = 1e-3

    def along(d: Array) -> Array:
        tau = reference.torque(robot.integrate(q, d[:n]), v + d[n : 2 * n], a + d[2 * n :])
        return np.asarray(np.sum(weight * tau, axis=1))

    e = h * np.eye(3 * n)
    second = np.array(
        [[along(x + y) - along(x - y) - along(y - x) + along(-x - y) for y in e] for x in e]
    ) / (4 * h * h)
    found = reference.curvature(q, v, a, None, weight)
    np.testing.assert_allclose(found, second.transpose(2, 0, 1), atol=1e-3)


def test_a_kernel_survives_pickling() -> None:
    robot = load_robot(slanted(with_arm("free-flyer")))
    kernel = InverseDynamicsKernel(robot.model)
    q, v, a, _ = jets(robot, 3)
    again = pickle.loads(pickle.dumps(kernel))
    np.testing.assert_array_equal(again.torque(q, v, a), kernel.torque(q, v, a))


def test_configurations_of_a_wrong_length_are_refused() -> None:
    kernel = InverseDynamicsKernel(with_arm("free-flyer"))
    with pytest.raises(InputError, match=r"^q must have shape \(2, 11\), got \(2, 9\)"):
        kernel.torque(*np.zeros((3, 2, 9)))


def two_bases() -> pin.Model:
    model = pin.Model()
    for name in ("one", "other"):
        model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), name)
    return model


@pytest.mark.parametrize(
    ("model", "names"),
    [
        (chain([pin.JointModelRX(), pin.JointModelSpherical()]), ("j1",)),
        (two_bases(), ("one", "other")),
        (mimicking(), ("last",)),
    ],
    ids=["inside a chain", "two bases", "mimicking"],
)
def test_joints_without_kernel_are_refused_by_name(
    model: pin.Model, names: tuple[str, ...]
) -> None:
    assert joints_without_kernel(model) == names
    with pytest.raises(ModelError, match=f"'{names[0]}'.*casadi_functions"):
        InverseDynamicsKernel(model)
