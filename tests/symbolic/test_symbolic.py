"""Public CasADi functions against Pinocchio's own numbers and hovi's compiled evaluation."""

from __future__ import annotations

from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.errors import InputError, SchemeError
from hovi.schemes import galerkin
from hovi.symbolic import RigidBody

Array = npt.NDArray[np.float64]

ROBOTS = {"ur5": {}, "kinova": {}, "solo12": {"free_flyer": True}}
"""A fixed arm, one with continuous joints, and a floating base."""


@cache
def body_of(name: str) -> RigidBody:
    robot = hovi.load_robot(name, **ROBOTS[name])
    effects = [hovi.effects.Gravity(3.7, (0.6, 0.0, -0.8)), hovi.effects.Armature(0.2)]
    return hovi.symbolic.rigid_body(hovi.Scene(robot, effects))


def state_of(body: RigidBody, seed: int = 0) -> tuple[Any, ...]:
    """The model, its data, and random q, v, a and tau."""
    model, random = body.scene.model, np.random.default_rng(seed)
    q = pin.integrate(model, pin.neutral(model), random.normal(size=model.nv))
    return model, model.createData(), q, *random.normal(size=(3, model.nv))


def close(symbolic: Any, expected: Array, size: float = 1.0) -> None:
    np.testing.assert_allclose(np.array(symbolic).squeeze(), expected, rtol=0, atol=1e-12 * size)


@pytest.mark.parametrize("name", ROBOTS)
def test_dynamics_are_pinocchios(name: str) -> None:
    body = body_of(name)
    model, data, q, v, a, tau = state_of(body)
    close(body.inverse_dynamics(q, v, a), pin.rnea(model, data, q, v, a), 100)
    close(body.bias(q, v), pin.nonLinearEffects(model, data, q, v), 100)
    close(body.generalized_gravity(q), pin.computeGeneralizedGravity(model, data, q), 100)
    accelerations = pin.aba(model, data, q, v, tau)
    close(body.forward_dynamics(q, v, tau), accelerations, 100 * np.abs(accelerations).max())
    upper = np.triu(pin.crba(model, data, q))
    close(body.mass_matrix(q), upper + np.triu(upper, 1).T, 10)


@pytest.mark.parametrize("name", ROBOTS)
def test_momenta_energies_and_the_center_of_mass_are_pinocchios(name: str) -> None:
    body = body_of(name)
    model, data, q, v, *_ = state_of(body, 1)
    momentum = pin.computeCentroidalMomentum(model, data, q, v)
    close(body.centroidal_momentum(q, v), np.r_[momentum.linear, momentum.angular], 100)
    close(body.center_of_mass(q), pin.centerOfMass(model, data, q))
    close(body.potential_energy(q), pin.computePotentialEnergy(model, data, q), 100)
    rotors = 0.5 * v @ (model.armature * v)
    kinetic = pin.computeKineticEnergy(model, data, q, v)
    assert float(body.kinetic_energy(q, v)) in (
        pytest.approx(kinetic, rel=1e-12),
        pytest.approx(kinetic + rotors, rel=1e-12),
    )


@pytest.mark.parametrize("name", ROBOTS)
def test_frames_and_their_jacobians_are_pinocchios(name: str) -> None:
    body = body_of(name)
    model, data, q, *_ = state_of(body, 2)
    frame = body.scene.robot.tip_frame
    number = model.getFrameId(frame)
    J = pin.computeFrameJacobian(model, data, q, number, pin.LOCAL_WORLD_ALIGNED)
    close(body.frame_jacobian(frame)(q), J, 10)
    pin.framesForwardKinematics(model, data, q)
    R, p = body.frame_placement(frame)(q)
    close(R, data.oMf[number].rotation)
    close(p, data.oMf[number].translation)
    with pytest.raises(InputError, match="no frame 'hand'"):
        body.frame_jacobian("hand")


def test_torques_and_the_lagrangian_have_every_effect() -> None:
    effects = [
        hovi.effects.Gravity(),
        hovi.effects.ViscousFriction(0.7),
        hovi.effects.AccelerationCost(0.3),
    ]
    scene = hovi.Scene(hovi.load_robot("ur5"), effects)
    q, v, a = np.random.default_rng(0).normal(size=(3, 6))
    rows = q[None], v[None], a[None]
    close(hovi.symbolic.torques(scene)(q, v, a, 0.0), scene.inverse_dynamics(*rows)[0], 100)
    expected = scene.effort_lagrangian().value(*rows)[0]
    assert float(hovi.symbolic.lagrangian(scene)(q, v, a, 0.0)) == pytest.approx(expected, 1e-13)


def lagrangians() -> list[Any]:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity()])
    q, v, a, t = (ca.SX.sym(name, 2) for name in "qvat")
    timed = hovi.CasadiLagrangian([q, v, a], ca.sumsqr(a) + t[0] * ca.sin(q[0]), time=t[0])
    return [scene, timed, hovi.spline(2, 3), hovi.mechanics(scene)]


@pytest.mark.parametrize("of", lagrangians(), ids=["effort", "timed", "spline-3", "mechanics"])
def test_the_discrete_lagrangian_is_that_of_the_schemes_table(of: Any) -> None:
    given = of.effort_lagrangian() if isinstance(of, hovi.Scene) else of
    k, h, t0 = given.order, 0.3, 0.4
    scheme = galerkin(2, k)
    numeric = hovi.SchemeLagrangian(given, scheme, h)
    random = np.random.default_rng(3)
    x, c = random.normal(size=(3, k, 2)), random.normal(size=(2, 2, 2))
    ends = [np.concatenate([x[i], x[i + 1]]) for i in (0, 1)]
    w = [(numeric.regularized.from_ends @ each)[None] for each in ends]
    values = [numeric.at(x[i][None], w[i], c[i][None], t0 + i * h).values[0] for i in (0, 1)]
    Ld = hovi.symbolic.discrete_lagrangian(of, scheme, h)
    for i in (0, 1):
        assert float(Ld(x[i].T, x[i + 1].T, c[i].T, t0 + i * h)) == pytest.approx(values[i], 1e-12)


@pytest.mark.parametrize("of", lagrangians()[::2], ids=["effort", "spline-3"])
def test_the_euler_lagrange_equations_vanish_along_a_discrete_flow(of: Any) -> None:
    given = of.effort_lagrangian() if isinstance(of, hovi.Scene) else of
    k, h = given.order, 0.05
    scheme = galerkin(2, k)
    ld = hovi.SchemeLagrangian(given, scheme, h)
    random = np.random.default_rng(4)
    first = ld.from_start(random.normal(size=(1, k, 2)), random.normal(size=(1, k, 2)))
    second = ld.from_start(first.x1, first.p1)
    F = hovi.symbolic.euler_lagrange(of, scheme, h)
    x = first.x0[0].T, first.x1[0].T, second.x1[0].T
    residuals = F(*x, first.inner[0].T, second.inner[0].T, 0.0)
    rounding = np.abs(first.x1).max() / h ** (2 * k - 1)
    for residual in residuals:
        np.testing.assert_allclose(np.array(residual), 0.0, atol=1e-12 * rounding)
    moved = F(x[0], x[1] + 0.01, x[2], first.inner[0].T, second.inner[0].T, 0.0)
    assert np.abs(np.array(moved[0])).max() > 1e-3


def test_a_cost_written_with_them_is_planned_with() -> None:
    """Least kinetic energy of the hand, with a little effort."""
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")))
    body = hovi.symbolic.rigid_body(scene)
    q, v, a = (ca.SX.sym(name, 2) for name in "qva")
    J = body.frame_jacobian(scene.robot.tip_frame)(q)[:3, :]
    L = 10 * ca.sumsqr(J @ v) + 1e-3 * ca.sumsqr(body.inverse_dynamics(q, v, a))
    lagrangian = hovi.CasadiLagrangian([q, v, a], L, scene=scene)
    ld = hovi.DiscreteLagrangian(lagrangian, hovi.Grid.uniform(1.0, 12, galerkin(3)))
    start, goal = hovi.State([0.0, 0.3]), hovi.State([1.0, 1.5])
    found = hovi.solve(hovi.TrajectoryProblem(ld, start, goal))
    assert found.success, found.message
    assert found.trajectory.robot is scene.robot


def test_orders_that_differ_and_groups_are_refused() -> None:
    with pytest.raises(SchemeError, match="order"):
        hovi.symbolic.discrete_lagrangian(hovi.spline(1, 3), galerkin(2), 0.1)
    scene = hovi.Scene(hovi.load_robot("kinova"))
    with pytest.raises(InputError, match="nq = nv"):
        hovi.symbolic.euler_lagrange(scene, galerkin(2), 0.1)
