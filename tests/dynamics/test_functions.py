"""The CasADi functions against Pinocchio itself."""

from __future__ import annotations

import pickle
from typing import NamedTuple

import casadi
import numpy as np
import pinocchio as pin
import pytest

from hovi.dynamics import symbolic_dynamics
from hovi.dynamics.extension import check_version
from hovi.errors import HoviError, ModelError
from hovi.robot.model import frame_id

FIXED_BASE = [
    "double_pendulum",
    "double_pendulum_continuous",
    "finger_edu",
    "kinova",
    "panda",
    "talos_arm",
    "tiago_no_hand",
    "ur5",
    "xarm7",
    "z1",
]
FREE_FLYER = ["anymal", "solo12", "talos"]
ROBOTS = [(name, False) for name in FIXED_BASE] + [(name, True) for name in FREE_FLYER]


class Case(NamedTuple):
    model: pin.Model
    functions: symbolic_dynamics.RigidBodyFunctions
    points: list[tuple[np.ndarray, np.ndarray, np.ndarray]]


@pytest.fixture(scope="module", params=ROBOTS, ids=lambda p: p[0] + "-floating" * p[1])
def case(request, load_model) -> Case:
    name, free_flyer = request.param
    model = load_model(name, free_flyer=free_flyer, armature=True)
    rng = np.random.default_rng(0)
    neutral = pin.neutral(model)
    points = [
        (pin.integrate(model, neutral, rng.normal(size=model.nv)), *rng.normal(size=(2, model.nv)))
        for _ in range(3)
    ]
    return Case(model, symbolic_dynamics.casadi_functions(model), points)


def assert_equal(actual: casadi.DM, expected: np.ndarray | float) -> None:
    expected = np.asarray(expected)
    scale = max(1.0, np.abs(expected).max())
    np.testing.assert_allclose(
        actual.full().reshape(expected.shape), expected, rtol=0, atol=1e-12 * scale
    )


def test_inverse_dynamics_is_rnea(case: Case) -> None:
    for q, v, a in case.points:
        tau = pin.rnea(case.model, case.model.createData(), q, v, a)
        assert_equal(case.functions.inverse_dynamics(q, v, a), tau)


def test_mass_matrix_is_crba_in_both_triangles(case: Case) -> None:
    for q, _, _ in case.points:
        upper = np.triu(pin.crba(case.model, case.model.createData(), q))
        assert_equal(case.functions.mass_matrix(q), upper + np.triu(upper, 1).T)


def test_generalized_gravity_matches_pinocchio(case: Case) -> None:
    for q, _, _ in case.points:
        gravity = pin.computeGeneralizedGravity(case.model, case.model.createData(), q)
        assert_equal(case.functions.generalized_gravity(q), gravity)


def test_kinetic_energy_matches_pinocchio_plus_rotors(case: Case) -> None:
    # Pinocchio's own count of the armature forgets it at revolute joints with an oblique axis.
    bare = case.model.copy()
    bare.armature = np.zeros(bare.nv)
    for q, v, _ in case.points:
        kinetic = pin.computeKineticEnergy(bare, bare.createData(), q, v)
        rotors = case.model.armature @ v**2 / 2
        assert_equal(case.functions.kinetic_energy(q, v), kinetic + rotors)


def test_potential_energy_matches_pinocchio(case: Case) -> None:
    data = case.model.createData()
    for q, _, _ in case.points:
        potential = pin.computePotentialEnergy(case.model, data, q)
        assert_equal(case.functions.potential_energy(q), potential)


def test_frame_placements_match_pinocchio(case: Case) -> None:
    data = case.model.createData()
    for index in (1, case.model.nframes // 2, case.model.nframes - 1):
        placement = case.functions.frame_placement(case.model.frames[index].name)
        for q, _, _ in case.points:
            pin.framesForwardKinematics(case.model, data, q)
            R, p = placement(q)
            # names may repeat
            index = frame_id(case.model, case.model.frames[index].name)
            assert_equal(R, data.oMf[index].rotation)
            assert_equal(p, data.oMf[index].translation)


def test_functions_use_the_gravity_of_their_model(load_model) -> None:
    model = load_model("ur5")
    model.gravity = pin.Motion(np.array([0.0, 0.0, -1.6, 0.0, 0.0, 0.0]))
    functions = symbolic_dynamics.casadi_functions(model)
    q = np.linspace(-1.0, 1.0, 6)
    expected = pin.computeGeneralizedGravity(model, model.createData(), q)
    model.gravity = pin.Motion.Zero()
    assert_equal(functions.generalized_gravity(q), expected)


def test_inputs_and_outputs_are_named(load_model) -> None:
    functions = symbolic_dynamics.casadi_functions(load_model("ur5"))
    assert functions.inverse_dynamics.name_in() == ["q", "v", "a"]
    assert functions.inverse_dynamics.name_out() == ["tau"]
    assert functions.kinetic_energy.name_in() == ["q", "v"]
    assert functions.frame_placement("tool0").name_out() == ["R", "p"]


def test_functions_survive_pickling(load_model) -> None:
    functions = symbolic_dynamics.casadi_functions(load_model("ur5"))
    point = np.random.default_rng(0).normal(size=(3, 6))
    before = functions.inverse_dynamics(*point).full()
    after = pickle.loads(pickle.dumps(functions)).inverse_dynamics(*point).full()
    np.testing.assert_array_equal(before, after)


def test_an_unknown_frame_is_refused_with_the_nearest_names(load_model) -> None:
    functions = symbolic_dynamics.casadi_functions(load_model("ur5"))
    with pytest.raises(ModelError, match=r"'tool'.*'tool0'"):
        functions.frame_placement("tool")


def test_functions_of_a_model_with_a_mimic_joint_match_pinocchio() -> None:
    model = pin.buildModelFromXML(MIMIC_URDF, True)
    functions, data = symbolic_dynamics.casadi_functions(model), model.createData()
    q, v, a = np.array([0.3]), np.array([-0.7]), np.array([1.1])
    tau = functions.inverse_dynamics(q, v, a).full().ravel()
    np.testing.assert_allclose(tau, pin.rnea(model, data, q, v, a), rtol=1e-14)
    mass = functions.mass_matrix(q).full()
    np.testing.assert_allclose(mass, pin.crba(model, data, q), rtol=1e-14)
    held = functions.generalized_gravity(q).full().ravel()
    np.testing.assert_allclose(held, pin.computeGeneralizedGravity(model, data, q), atol=1e-14)
    assert float(functions.kinetic_energy(q, v)) == pytest.approx(
        0.5 * mass[0, 0] * 0.49, rel=1e-14
    )
    pin.framesForwardKinematics(model, data, q)
    frame = model.getFrameId("right")
    R, p = functions.frame_placement("right")(q)
    np.testing.assert_allclose(R.full(), data.oMf[frame].rotation, atol=1e-15)
    np.testing.assert_allclose(p.full().ravel(), data.oMf[frame].translation, atol=1e-15)


def test_another_version_of_pinocchio_is_refused_with_advice() -> None:
    check_version("4.1.0", "4.1.0")
    with pytest.raises(HoviError, match=r"against pin 4\.1\.0, but pin 4\.0\.0.*pip install"):
        check_version("4.0.0", "4.1.0")


MIMIC_URDF = """<robot name="gripper">
  <link name="base"/>
  <link name="left"><inertial><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="right"><inertial><mass value="1"/><origin xyz="0.2 0.3 0"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="first" type="revolute"><parent link="base"/><child link="left"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="second" type="revolute"><parent link="left"/><child link="right"/>
    <origin xyz="0.4 0.1 0.2" rpy="1.2 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/>
    <mimic joint="first" multiplier="-1"/></joint>
</robot>"""
