"""The exact discrete Lagrangian: its regularity as h tends to zero, and its limit in h."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi.effects import Gravity
from hovi.errors import InputError
from hovi.flows.euler_lagrange import regularity
from hovi.flows.exact_lagrangian import ExactDiscreteLagrangian, conjugate_time
from hovi.flows.legendre_transforms import legendre
from hovi.robot.robot import Robot
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]

STEPS = np.array([0.04, 0.02, 0.01, 0.005])


@pytest.fixture(scope="module")
def arm(arm_scene: Scene) -> EffortLagrangian:
    return arm_scene.effort_lagrangian()


def start(L: EffortLagrangian, seed: int = 0) -> tuple[Array, Array]:
    """A smooth start of a solution, x and p of shape (1, 2, n)."""
    jet = 0.3 * np.random.default_rng(seed).normal(size=(4, L.nv))
    x, p = legendre(L, *jet)
    return x[None], p[None]


def effort_hessian(L: EffortLagrangian, x: Array) -> Array:
    """W = d2L/da2 at a point of TQ, shape (n, n)."""
    return L.evaluate(*x[:, :2].transpose(1, 0, 2), 0 * x[:, 0])[2][0, 2, :, 2]


@pytest.mark.parametrize("robot", ["two_link", "ur5"])
def test_w_d_has_the_leading_terms_of_the_proof(request: pytest.FixtureRequest, robot: str) -> None:
    chosen: Robot = request.getfixturevalue(robot)
    L = Scene(chosen, [Gravity()]).effort_lagrangian()
    x, p = start(L)
    W, n = effort_hessian(L, x), L.nv
    leading = {(0, 2): (-12, 3), (0, 3): (6, 2), (1, 2): (-6, 2), (1, 3): (2, 1)}
    remainders = []
    for h in STEPS:
        interval = ExactDiscreteLagrangian(L, h).from_start(x, p)
        D = interval.second_derivatives[0]
        blocks = [D[ij] - c / h**m * W for ij, (c, m) in leading.items()]
        scaled = [
            h**m * np.abs(block).max() / np.abs(c * W).max()
            for block, (c, m) in zip(blocks, leading.values(), strict=True)
        ]
        determinant = np.linalg.det(interval.regularity_matrix[0] / (np.abs(W).max() / h**2))
        ideal = (12.0**n) * np.linalg.det(W / np.abs(W).max()) ** 2
        remainders.append([*scaled, abs(determinant / ideal - 1)])
    slopes = np.polyfit(np.log(STEPS), np.log(remainders), 1)[0]
    assert (np.array(remainders[-1]) < 0.05).all()
    assert (slopes > 0.7).all()  # O(h) at least, relative to the leading term


def test_det_w_d_is_positive_unlike_printed_in_the_paper(arm: EffortLagrangian) -> None:
    q, v, a = (ca.SX.sym(c, 1) for c in "qva")
    one = CasadiLagrangian([q, v, a], ca.sumsqr(a) / 2 + ca.sumsqr(v) / 2)
    ld = ExactDiscreteLagrangian(one, 0.01)
    x0, x1 = np.array([[0.1], [0.2]]), np.array([[0.102], [0.21]])
    found = regularity(ld, x0, x1)
    assert found.determinant[0] == pytest.approx(12 / 0.01**4, rel=1e-3)
    assert found.condition[0] == pytest.approx(np.linalg.cond(found.matrix[0]))


# Conjugate points: L = a^2/2 - v^2/2 is a minimum up to h = 2 pi


@pytest.fixture(scope="module")
def oscillator() -> CasadiLagrangian:
    q, v, a = (ca.SX.sym(c, 1) for c in "qva")
    return CasadiLagrangian([q, v, a], (ca.sumsqr(a) - ca.sumsqr(v)) / 2)


X0, P0 = np.array([[0.3], [0.1]]), np.array([[0.2], [0.5]])


def test_the_first_conjugate_point_of_the_oscillator_is_two_pi(
    oscillator: CasadiLagrangian,
) -> None:
    assert conjugate_time(oscillator, X0, P0, 10.0) == pytest.approx(2 * np.pi, rel=1e-10)
    assert conjugate_time(oscillator, X0, P0, 5.0) == float("inf")


def test_a_step_beyond_a_conjugate_point_is_refused(oscillator: CasadiLagrangian) -> None:
    exact = ExactDiscreteLagrangian(oscillator, 6.2).from_start(X0[None], P0[None])
    # q'''' = -q'': p = -v - jerk and p~ = a are those of A cos t + B sin t + C + D t
    t, (q, v), (p, a) = 6.2, X0[:, 0], P0[:, 0]
    jerk = -v - p
    end = q + a + (v + jerk) * t - a * np.cos(t) - jerk * np.sin(t)
    assert exact.x1[0, 0, 0] == pytest.approx(end, rel=1e-11)
    late = ExactDiscreteLagrangian(oscillator, 6.4)
    with pytest.raises(InputError, match=r"h = 6.4 s is too long .* 1 conjugate point"):
        late.from_start(X0[None], P0[None])
    with pytest.raises(InputError, match="conjugate"):
        late.joining(X0[None], X0[None] + 0.1)


def test_the_conjugate_point_of_the_arm_is_found(arm: EffortLagrangian) -> None:
    # held horizontal: a saddle for long durations, so there is a conjugate point
    x, p = legendre(arm, *np.zeros((4, 2)))
    limit = conjugate_time(arm, x, p, 4.0)
    assert 0.1 < limit < 4.0
    assert ExactDiscreteLagrangian(arm, 0.98 * limit).from_start(x[None], p[None])
    with pytest.raises(InputError, match="conjugate"):
        ExactDiscreteLagrangian(arm, 1.02 * limit).from_start(x[None], p[None])


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9, 1e-12])
def test_the_tolerance_is_met(arm: EffortLagrangian, tolerance: float) -> None:
    x, p = start(arm, 3)
    best = ExactDiscreteLagrangian(arm, 0.5, 3e-13).from_start(x, p)
    interval = ExactDiscreteLagrangian(arm, 0.5, tolerance).from_start(x, p)
    assert np.abs(interval.p1 - best.p1).max() <= 2 * tolerance * np.abs(best.p1).max()


def test_an_unreachable_tolerance_is_refused(arm: EffortLagrangian) -> None:
    x, p = start(arm)
    with pytest.raises(InputError, match="did not converge to 1e-30"):
        ExactDiscreteLagrangian(arm, 0.1, 1e-30).from_start(x, p)
    for h in (0.0, -1.0, np.nan):
        with pytest.raises(InputError, match="a step must be positive"):
            ExactDiscreteLagrangian(arm, h)
