"""The two-link arm of [ColomboFerraroMartin2016, sec. 5]: its printed torques.

The printed equations add m l^2 / 4 to J_i, so J_i = m_i l_i^2 / 3 is about the centre of mass.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from hovi.dynamics.inverse_dynamics_kernel import InverseDynamicsKernel
from hovi.dynamics.symbolic_dynamics import casadi_functions

MODELS = Path(__file__).parents[2] / "models"
m1, m2, l1, l2, g = 0.375, 0.25, 1.5, 1.0, 9.8
J1, J2 = m1 * l1**2 / 3, m2 * l2**2 / 3


def printed_torques(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    (t1, t2), (v1, v2), (a1, a2) = q.T, v.T, a.T
    u1 = (
        -np.sin(t2) * l1 * l2 * m2 * v2 * v1
        - np.sin(t2) * v2**2 * l1 * l2 * m2 / 2
        + m2 * l2 * np.cos(t1 + t2) * g / 2
        + (m2 * g * np.cos(t1) + g * np.cos(t1) * m1 / 2) * l1
        + (m2 * l2**2 / 4 + J2 + np.cos(t2) * l1 * l2 * m2 / 2) * a2
        + (np.cos(t2) * l1 * l2 * m2 + (m1 / 4 + m2) * l1**2 + m2 * l2**2 / 4 + J1 + J2) * a1
    )
    u2 = (
        np.sin(t2) * l1 * l2 * m2 * v1**2 / 2
        + (m2 * l2**2 / 4 + J2 + np.cos(t2) * l1 * l2 * m2 / 2) * a1
        + m2 * l2 * np.cos(t1 + t2) * g / 2
        + (m2 * l2**2 / 4 + J2) * a2
    )
    return np.stack([u1, u2], axis=-1)


@pytest.fixture
def arm() -> pin.Model:
    model = pin.buildModelFromUrdf(str(MODELS / "two_link.urdf"))
    model.gravity = pin.Motion(np.array([0.0, 0.0, -g, 0.0, 0.0, 0.0]))
    return model


@pytest.fixture
def points() -> np.ndarray:  # q, v, a, each (100, 2)
    return np.random.default_rng(0).uniform(-3.0, 3.0, size=(3, 100, 2))


def test_the_kernel_gives_the_printed_torques(arm, points) -> None:
    tau = InverseDynamicsKernel(arm).torque(*points)
    np.testing.assert_allclose(tau, printed_torques(*points), rtol=0, atol=1e-12)


def test_the_casadi_function_gives_the_printed_torques(arm, points) -> None:
    q, v, a = points
    tau = casadi_functions(arm).inverse_dynamics(q.T, v.T, a.T).full().T
    np.testing.assert_allclose(tau, printed_torques(q, v, a), rtol=0, atol=1e-12)
