"""The discrete flow: conservation laws, conditioning, and refusals."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.effects import Gravity
from hovi.errors import InputError, SchemeError
from hovi.flows.euler_lagrange import regularity
from hovi.flows.exact_lagrangian import ExactDiscreteLagrangian
from hovi.flows.legendre_transforms import legendre
from hovi.flows.scheme_lagrangian import SchemeLagrangian
from hovi.flows.stepper import compensated, flow
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.robot import Robot
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.scene.standard_lagrangians import spline
from hovi.schemes import by_name, galerkin
from oracles.on_grid import solve_on_grid
from samples.long_flows import JET, arm_energy, costless, noether_errors, quartic, quartic_energy

Array = npt.NDArray[np.float64]

REGULAR = ["taylor-midpoint", "taylor-trapezoid", "hermite-simpson", "galerkin-0", "galerkin-2"]


@pytest.fixture(scope="module")
def arm(arm_scene: Scene) -> EffortLagrangian:
    return arm_scene.effort_lagrangian()


@pytest.fixture(scope="module")
def floating(two_link: Robot) -> Scene:
    """The arm without gravity."""
    return Scene(two_link)


# Symplecticity and reversibility


def symplectic_defect(S: Array) -> float:
    """max |S^T J S - J| in canonical units in which S is balanced: entries of order one."""
    m = len(S) // 2
    J = np.block([[np.zeros((m, m)), np.eye(m)], [-np.eye(m), np.zeros((m, m))]])
    unit = np.sqrt(np.linalg.norm(S[:m, m:], 2))
    D = np.repeat([unit, 1 / unit], m)
    S = S * D / D[:, None]
    assert np.abs(S).max() < 10
    return float(np.max(np.abs(S.T @ J @ S - J)))


def scaled(S: Array, k: int, n: int, h: float) -> Array:
    """The tangent map in (h^j q^(j), h^-j p_j), which are canonical too."""
    powers = np.repeat([h**j for j in range(k)], n)
    D = np.concatenate([powers, 1 / powers])
    return np.asarray(D[:, None] * S / D)


@pytest.mark.parametrize("name", REGULAR)
@pytest.mark.parametrize("h", [0.1, 1e-3])
def test_the_flow_is_symplectic(arm: EffortLagrangian, name: str, h: float) -> None:
    x, p = legendre(arm, *JET)
    interval = SchemeLagrangian(arm, by_name(name), h).from_start(x[None], p[None])
    assert symplectic_defect(scaled(interval.tangent[0], 2, 2, h)) < 1e-12


@pytest.mark.parametrize(("k", "r"), [(1, 0), (1, 2), (3, 0), (3, 2)])
def test_flows_of_other_orders_are_symplectic(k: int, r: int) -> None:
    jet = [ca.SX.sym(f"q{j}", 2) for j in range(k + 1)]
    L = CasadiLagrangian(jet, ca.sumsqr(jet[-1]) / 2 * (2 + ca.cos(jet[0][0])) + ca.sin(jet[0][1]))
    x, p = np.random.default_rng(k).normal(size=(2, 1, k, 2))
    interval = SchemeLagrangian(L, galerkin(r, k), 0.2).from_start(x, p)
    assert symplectic_defect(scaled(interval.tangent[0], k, 2, 0.2)) < 1e-12


def test_the_tangent_map_is_the_derivative_of_the_flow(arm: EffortLagrangian) -> None:
    x, p = legendre(arm, *JET)
    ld = SchemeLagrangian(arm, galerkin(1), 0.1)
    S, y, e = ld.from_start(x[None], p[None]).tangent[0], np.concatenate([x, p]), 1e-5
    for i in range(8):
        d = e * np.eye(8)[i].reshape(4, 2)
        ends = [ld.from_start((y + s * d)[None, :2], (y + s * d)[None, 2:]) for s in (-1, 1)]
        column = [np.concatenate([end.x1[0], end.p1[0]]).ravel() for end in ends]
        np.testing.assert_allclose((column[1] - column[0]) / (2 * e), S[:, i], atol=1e-6)


@pytest.mark.parametrize("name", REGULAR)
def test_symmetric_schemes_are_reversible(arm: EffortLagrangian, name: str) -> None:
    x, p = legendre(arm, *JET)
    ld, flip = SchemeLagrangian(arm, by_name(name), 0.02), np.array([[1.0], [-1.0]])
    there = flow(ld, x, p, 20)
    back = flow(ld, flip * there.x[-1], -flip * there.p[-1], 20)
    np.testing.assert_allclose(flip * back.x[-1], x, rtol=0, atol=1e-11)
    np.testing.assert_allclose(-flip * back.p[-1], p, rtol=0, atol=1e-10 * np.abs(p).max())


# Energy over long times


@pytest.mark.parametrize("name", ["taylor-midpoint", "galerkin-0"])
def test_the_energy_of_the_quartic_oscillator_does_not_drift(name: str) -> None:
    first, last = quartic_energy(name, 4000)
    assert last <= 1.2 * first


@pytest.mark.parametrize(("name", "order"), [("taylor-midpoint", 2), ("galerkin-0", 4)])
def test_its_energy_error_has_the_order_of_the_scheme(name: str, order: int) -> None:
    x, p = legendre(quartic(), [0.3], [0.1], [0.0], [0.05])
    errors = []
    for N in (100, 200):
        ld = SchemeLagrangian(quartic(), by_name(name), 10 / N)
        errors.append(np.ptp(flow(ld, x, p, N).energy))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)


def test_the_energy_of_the_falling_arm_does_not_drift(arm_scene: Scene) -> None:
    first, last = arm_energy(arm_scene, 1, 10_000)
    assert last <= 1.2 * first


# Discrete Noether


@pytest.mark.parametrize("N", [100, 1000])
def test_noether_the_momentum_of_the_shoulder_without_gravity(floating: Scene, N: int) -> None:
    carried, minus, plus = noether_errors(floating, N)
    assert carried < 1e-12
    assert max(minus, plus) < 1e-13 * N


# The Newton matrix of a step


def conditions(L: Lagrangian, x: Array, p: Array, name: str, steps: Array) -> Array:
    """Condition of the step's Newton matrix, equations scaled as h p and p~ - h p."""
    found = []
    for h in steps:
        interval = SchemeLagrangian(L, by_name(name), h).from_start(x[None], p[None])
        found.append(np.linalg.cond(interval.newton_matrix[0]))
    return np.array(found)


STEPS = 10.0 ** -np.arange(2.0, 9.0)


@pytest.mark.parametrize("name", ["taylor-trapezoid", "galerkin-0", "galerkin-2"])
def test_the_condition_of_a_step_is_constant_on_the_spline(name: str) -> None:
    x, p = np.random.default_rng(0).normal(size=(2, 2, 3))
    found = conditions(spline(3), x, p, name, STEPS)
    np.testing.assert_allclose(found, found[-1], rtol=1e-12)


@pytest.mark.parametrize("name", ["taylor-midpoint", "hermite-simpson", "galerkin-0", "galerkin-2"])
def test_the_condition_of_a_step_tends_to_its_limit_on_the_arm(
    arm: EffortLagrangian, name: str
) -> None:
    x, p = legendre(arm, *JET)
    found = conditions(arm, x, p, name, STEPS)
    ratio = found / found[-1]
    assert ((ratio > 0.5) & (ratio < 2)).all()
    W = arm.evaluate(*JET[:3, None])[2][0, 2, :, 2]
    if name.startswith("galerkin"):
        assert found[-1] == pytest.approx(np.linalg.cond(W), rel=1e-6)


@pytest.mark.parametrize("h", [1e-2, 1e-4, 1e-6, 1e-8])
def test_steps_are_accurate_as_h_tends_to_zero(arm: EffortLagrangian, h: float) -> None:
    # w1 is the mean acceleration, w0 its slope: neither loses eps/h^2 as differences would
    x, p = legendre(arm, *JET)
    interval = SchemeLagrangian(arm, galerkin(2), h).from_start(x[None], p[None])
    W = arm.evaluate(*JET[:3, None])[2][0, 2, :, 2]
    rounding = 2 * np.finfo(float).eps * np.linalg.cond(W)  # of the acceleration from W a = p~
    for w, exact in ((1, JET[2] + h / 2 * JET[3]), (0, -h * JET[3] / np.sqrt(12))):
        np.testing.assert_allclose(interval.w[0, w], exact, rtol=0, atol=rounding + 200 * h**2)


# The horizon


def test_a_horizon_beyond_the_flows_own_instability_is_refused(arm_scene: Scene) -> None:
    # held upright: exponents +-3.75, so that rounding of 2e-16 is 1e-6 after 6 s
    L = arm_scene.effort_lagrangian()
    x, p = legendre(L, [np.pi / 2, 0], *np.zeros((3, 2)))
    ld = SchemeLagrangian(L, galerkin(1), 0.05)
    with pytest.raises(InputError, match=r"so unstable that after .* force=True") as refused:
        flow(ld, x, p, 200)
    horizon = float(str(refused.value).split("after ")[1].split(" s")[0])
    assert 3.0 < horizon < 8.0
    forced = flow(ld, x, p, 200, force=True)
    assert forced.rounding is None
    assert len(forced.t) == 201
    known = flow(ld, x, p, int(0.9 * horizon / 0.05))
    growth = np.diff(np.log(known.rounding[len(known.rounding) // 2 :])) / 0.05
    assert np.median(growth) == pytest.approx(3.75, abs=0.1)


def test_a_swing_up_is_replayed_from_its_momenta_until_it_is_unstable(arm_scene: Scene) -> None:
    # what eps of the start becomes in ten seconds is 5e-7 rad; the plan's momenta have some more
    grid = Grid.uniform(10.0, 100, galerkin(1))
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), grid)
    ends = State([-np.pi / 2, 0.0]), State([np.pi / 2, 0.0])
    plan = solve_on_grid(TrajectoryProblem(ld, *ends)).trajectory
    replay = flow(ld, ends[0], plan.momenta[0], 100)
    np.testing.assert_allclose(replay.q, plan.q, rtol=0, atol=1e-3)
    with pytest.raises(InputError, match="more than tolerance 1e-09"):
        flow(ld, ends[0], plan.momenta[0], 100, tolerance=1e-9)


def test_a_short_reach_is_replayed_from_its_momenta(arm_scene: Scene) -> None:
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), Grid.uniform(1.0, 32, galerkin(2)))
    plan = solve_on_grid(
        TrajectoryProblem(ld, State([-np.pi / 2, 0.0]), State([0.3, 0.7], [0.5, -0.4]))
    ).trajectory
    replay = flow(ld, State(plan.q[0]), plan.momenta[0], 32)
    np.testing.assert_allclose(replay.q, plan.q, rtol=0, atol=1e-9)
    again, times = replay.trajectory, np.linspace(0, 1, 20)
    assert again.duration == plan.duration
    for mine, planned in zip(again.sample(times), plan.sample(times), strict=True):
        scale = np.abs(planned).max()
        np.testing.assert_allclose(mine / scale, planned / scale, rtol=0, atol=1e-6)


# Motions without cost


def test_the_pendulum_without_torque_stays_without_torque(pendulum: Robot) -> None:
    motion = costless(Scene(pendulum, [Gravity()]), 3000, [0.2])
    assert np.abs(motion.p).max() < 1e-5


# Details


def test_compensated_sums_are_exact() -> None:
    total, lost = np.array([1.0]), np.zeros(1)
    for _ in range(10_000):
        total, lost = compensated(total, np.array([1e-17]), lost)
    assert total[0] - lost[0] == pytest.approx(1 + 1e-13, rel=3e-16)


def test_the_exact_flow_takes_long_steps(arm: EffortLagrangian) -> None:
    x, p = legendre(arm, *JET)
    few = flow(ExactDiscreteLagrangian(arm, 0.25), x, p, 2)
    many = flow(SchemeLagrangian(arm, galerkin(3), 0.02), x, p, 25)
    np.testing.assert_allclose(few.x[-1], many.x[-1], rtol=1e-9)
    with pytest.raises(InputError, match="of a scheme"):
        _ = few.reevaluated_momenta


@pytest.mark.parametrize("name", ["mean-difference", "trapezoid-difference"])
def test_a_degenerate_scheme_has_no_flow(arm: EffortLagrangian, name: str) -> None:
    x, p = legendre(arm, *JET)
    found = regularity(SchemeLagrangian(spline(2), by_name(name), 0.1), x, x + 0.01)
    assert abs(found.determinant[0]) < 1e-10 * np.abs(found.matrix).max() ** 4
    with pytest.raises(SchemeError, match="is not regular"):
        flow(SchemeLagrangian(arm, by_name(name), 0.1), x, p, 5)


def test_invalid_arguments_are_refused(arm: EffortLagrangian) -> None:
    x, p = legendre(arm, *JET)
    ld = SchemeLagrangian(arm, galerkin(0), 0.1)
    with pytest.raises(InputError, match=r"p0 needs 2 rows of 2 .* got shape \(1, 2\)"):
        flow(ld, x, p[:1], 10)
    with pytest.raises(InputError, match="z0 needs"):
        flow(ld, x * np.nan, p, 10)
    with pytest.raises(InputError, match="steps must be 1 or more"):
        flow(ld, x, p, 0)
    uneven = Grid(np.array([0.1, 0.2]), (galerkin(0),) * 2)
    with pytest.raises(InputError, match="equal steps"):
        flow(DiscreteLagrangian(arm, uneven), x, p, 2)
    with pytest.raises(InputError, match="effort Lagrangian"):
        _ = flow(SchemeLagrangian(spline(2), galerkin(0), 0.1), x, p, 2).trajectory
