"""Variational orders by the definition of the paper, and the resulting orders of the flow."""

from __future__ import annotations

from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi import symbolic
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.effects import Gravity
from hovi.errors import InputError
from hovi.flows.legendre_transforms import legendre
from hovi.flows.order_of_accuracy import VariationalOrder, variational_order
from hovi.flows.scheme_lagrangian import SchemeLagrangian
from hovi.flows.stepper import flow
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.scene.standard_lagrangians import mechanics, spline
from hovi.schemes import by_name, galerkin

Array = npt.NDArray[np.float64]

INTERVALS = 50


def jets(n: int, size: float, count: int = 4) -> Array:
    """(q, v, a, jerk, ...) of solutions' starts, shape (count, INTERVALS, n)."""
    return size * np.random.default_rng(n).normal(size=(count, INTERVALS, n))


@pytest.fixture(scope="module")
def arm(arm_scene: Scene) -> EffortLagrangian:
    return arm_scene.effort_lagrangian()


@pytest.fixture(scope="module")
def six_joints(ur5: Robot) -> EffortLagrangian:
    return Scene(ur5, [Gravity()]).effort_lagrangian()


ORDERS = [
    ("taylor-midpoint", 2, [0.005, 0.0025, 0.00125]),
    ("taylor-trapezoid", 2, [0.005, 0.0025, 0.00125]),
    ("hermite-simpson", 4, [0.02, 0.014, 0.01]),
    ("galerkin-0", 4, [0.02, 0.014, 0.01]),
    ("galerkin-1", 6, [0.04, 0.028, 0.02]),
]


@pytest.mark.parametrize(("name", "order", "steps"), ORDERS)
def test_the_slope_of_the_variational_error_is_order_plus_one_on_the_arm(
    arm: EffortLagrangian, name: str, order: int, steps: list[float]
) -> None:
    measured = variational_order(arm, by_name(name), steps, *jets(2, 0.5))
    assert measured.order == pytest.approx(order, abs=0.3)
    assert measured.reliable, measured.reason


@pytest.mark.parametrize(("name", "order", "steps"), ORDERS)
def test_the_slope_of_the_variational_error_is_order_plus_one_on_six_joints(
    six_joints: EffortLagrangian, name: str, order: int, steps: list[float]
) -> None:
    measured = variational_order(six_joints, by_name(name), steps, *jets(6, 0.1))
    assert measured.order == pytest.approx(order, abs=0.3)
    assert measured.reliable, measured.reason


@pytest.mark.parametrize(("r", "intervals"), [(2, 8), (3, 8)])
def test_higher_orders_in_extended_precision(arm_scene: Scene, r: int, intervals: int) -> None:
    assert extended_slope(arm_scene, r, intervals) == pytest.approx(2 * (r + 2) + 1, abs=0.3)


@pytest.mark.long
@pytest.mark.parametrize("r", [2, 3])
def test_higher_orders_in_extended_precision_on_fifty_intervals(arm_scene: Scene, r: int) -> None:
    assert extended_slope(arm_scene, r, INTERVALS) == pytest.approx(2 * (r + 2) + 1, abs=0.3)


def extended_slope(scene: Scene, r: int, intervals: int, k: int = 2) -> float:
    """Slope of max |L_d - L_d^e| with 40 digits; L_d^e with nine inner modes, of order 18 + 2 k."""
    mp = pytest.importorskip("mpmath")
    from oracles.extended_precision import action, graph

    lagrangian, functions = of_order(scene, k), casadi_functions(scene.model)
    torque, kinetic, potential = (
        graph(function)
        for function in (
            functions.inverse_dynamics,
            functions.kinetic_energy,
            functions.potential_energy,
        )
    )

    def exact_value(*jet: list[Any]) -> Any:
        if k == 1:
            return kinetic(*jet)[0] - potential(jet[0])[0]
        jerk = sum(j * j for j in jet[3]) * mp.mpf(JERK_WEIGHT) / 2 if k == 3 else 0
        return sum(u * u for u in torque(*jet[:3])) / 2 + jerk

    x, p = legendre(lagrangian, *jets(2, 0.5, 2 * k)[:, :intervals])
    errors, steps = [], [0.03, 0.021, 0.015]
    with mp.workdps(40):
        for h in steps:
            exact = SchemeLagrangian(lagrangian, galerkin(9, k), h).from_start(x, p)
            close = SchemeLagrangian(lagrangian, galerkin(r, k), h).between(x, exact.w)
            pairs = [
                [
                    action(exact_value, h, *ends)
                    for ends in (
                        (x[i], exact.w[i], close.inner[i]),
                        (x[i], exact.w[i], exact.inner[i]),
                    )
                ]
                for i in range(intervals)
            ]
            errors.append(float(max(abs(a - b) for a, b in pairs)))
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


# Of orders other than 2, on the arm

JERK_WEIGHT = 0.3


def of_order(scene: Scene, k: int) -> Lagrangian:
    """K - V, the effort, and the effort with 1/2 w |jerk|^2."""
    if k == 1:
        return mechanics(scene)
    if k == 2:
        return scene.effort_lagrangian()
    jet = [ca.SX.sym(f"q{j}", scene.robot.nv) for j in range(4)]
    effort = symbolic.lagrangian(scene)(*jet[:3], 0.0)
    return CasadiLagrangian(jet, effort + JERK_WEIGHT / 2 * ca.sumsqr(jet[3]))


@pytest.mark.parametrize(
    ("k", "r", "size", "steps"),
    [
        (1, 0, 0.5, [0.02, 0.014, 0.01]),
        (1, 1, 0.5, [0.04, 0.028, 0.02]),
        (1, 2, 0.5, [0.06, 0.042, 0.03]),
        (1, 3, 1.0, [0.1, 0.08, 0.06]),
        (3, 0, 0.5, [0.06, 0.042, 0.03]),
        (3, 1, 0.5, [0.14, 0.1, 0.08]),
    ],
)
def test_mechanics_and_least_jerk_of_the_arm_have_order_2_r_plus_k(
    arm_scene: Scene, k: int, r: int, size: float, steps: list[float]
) -> None:
    starts = jets(2, size, 2 * k)
    measured = variational_order(of_order(arm_scene, k), galerkin(r, k), steps, *starts)
    assert measured.order == pytest.approx(2 * (r + k), abs=0.3)
    assert measured.reliable, measured.reason


@pytest.mark.parametrize(("k", "r"), [(1, 4), (3, 2)])
def test_their_higher_orders_in_extended_precision(arm_scene: Scene, k: int, r: int) -> None:
    assert extended_slope(arm_scene, r, 6, k) == pytest.approx(2 * (r + k) + 1, abs=0.3)


def nonlinear(k: int) -> CasadiLagrangian:
    """A Lagrangian of order k with every kind of coupling, in the plane."""
    jet = [ca.SX.sym(f"q{j}", 2) for j in range(k + 1)]
    q, top = jet[0], jet[-1]
    L = ca.sumsqr(top) / 2 * (2 + ca.cos(q[0])) + top[0] * top[1] * ca.sin(q[1])
    return CasadiLagrangian(jet, L - ca.cos(q[0] + q[1]) + sum(ca.sumsqr(x) for x in jet[1:-1]))


@pytest.mark.parametrize(
    ("k", "r", "steps"),
    [
        (1, 0, [0.04, 0.02, 0.01]),
        (1, 1, [0.1, 0.05, 0.025]),
        (1, 2, [0.14, 0.1, 0.07]),
        (2, 0, [0.1, 0.05, 0.025]),
        (2, 1, [0.14, 0.1, 0.07]),
        (3, 0, [0.14, 0.1, 0.07]),
    ],
)
@pytest.mark.parametrize("more", [0, 1, 4])
def test_galerkin_has_order_2_r_plus_k_with_any_number_of_points(
    k: int, r: int, steps: list[float], more: int
) -> None:
    starts = 0.7 * np.random.default_rng(k).normal(size=(2 * k, INTERVALS, 2))
    scheme = galerkin(r, k, points=r + k + more)
    measured = variational_order(nonlinear(k), scheme, steps, *starts)
    assert measured.order == pytest.approx(2 * (r + k), abs=0.3)
    assert measured.reliable, measured.reason


# The flow from momenta has the order of its L_d


DURATION = {2: 0.4, 6: 0.1}  # the arm with six joints is far less stable


@cache
def reference(lagrangian: EffortLagrangian) -> tuple[Array, Array, Array, Array]:
    """A start, and its image under the exact flow."""
    duration = DURATION[lagrangian.nv]
    x, p = legendre(lagrangian, *jets(lagrangian.nv, 0.25)[:, 0])
    motion = flow(SchemeLagrangian(lagrangian, galerkin(6), duration / 8), x, p, 8, force=True)
    return x, p, motion.x[-1], motion.p[-1]


FLOWS = [
    ("taylor-midpoint", 2, [16, 32, 64]),
    ("taylor-trapezoid", 2, [16, 32, 64]),
    ("galerkin-0", 4, [8, 12, 16]),
    ("galerkin-1", 6, [5, 7, 10]),
]


@pytest.mark.parametrize("robot", ["arm", "six_joints"])
@pytest.mark.parametrize(("name", "order", "counts"), FLOWS)
def test_the_flow_from_momenta_has_the_order_of_its_discrete_lagrangian(
    request: pytest.FixtureRequest, robot: str, name: str, order: int, counts: list[int]
) -> None:
    lagrangian = request.getfixturevalue(robot)
    T = DURATION[lagrangian.nv]
    x, p, x_end, p_end = reference(lagrangian)
    errors = []
    for N in counts:
        motion = flow(SchemeLagrangian(lagrangian, by_name(name), T / N), x, p, N, force=True)
        errors.append([np.abs(motion.x[-1] - x_end).max(), np.abs(motion.p[-1] - p_end).max()])
    slopes = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    np.testing.assert_allclose(slopes, order, rtol=0, atol=0.3)


@pytest.mark.parametrize("name", ["taylor-midpoint", "galerkin-0"])
def test_a_flow_from_two_exact_nodes_can_fail_at_every_step_size(
    arm: EffortLagrangian, name: str
) -> None:
    # with the Taylor scheme the error does not shrink with h: start from Legendre momenta
    T = DURATION[2]
    x, p, x_end, _ = reference(arm)
    errors = []
    for N in (20, 40):
        ld = SchemeLagrangian(arm, by_name(name), T / N)
        second = flow(SchemeLagrangian(arm, galerkin(6), T / N), x, p, 1, force=True).x[1]
        start = ld.joining(x[None], second[None]).p0[0]
        errors.append(np.abs(flow(ld, x, start, N, force=True).x[-1] - x_end).max())
    assert (errors[1] > 0.5 * errors[0]) == (name == "taylor-midpoint")


def test_the_cubic_spline_is_exact_on_four_coefficients() -> None:
    measured = variational_order(spline(2), galerkin(0), [0.4, 0.2], *jets(2, 1.0))
    assert measured.errors.max() < 1e-14
    coarse = variational_order(spline(2), by_name("taylor-trapezoid"), [0.4, 0.2], *jets(2, 1.0))
    np.testing.assert_allclose(coarse.slopes, 3.0, atol=1e-9)


def test_a_step_beyond_the_exact_solution_is_refused(arm: EffortLagrangian) -> None:
    with pytest.raises(InputError, match="step"):
        variational_order(arm, galerkin(1), [30.0], *jets(2, 0.5))


# Steps that do not tell the order


@pytest.mark.parametrize(
    ("robot", "size", "steps"),
    [("xarm7", 0.02, [5e-3, 2.5e-3, 1.25e-3]), ("talos_arm", 0.1, [5e-3, 2.5e-3, 1.25e-3])],
)
def test_steps_too_large_to_tell_the_order_are_named(
    robot: str, size: float, steps: list[float]
) -> None:
    # the largest errors of talos_arm fall with 2.82 and 2.72, which agree with each other
    lagrangian = Scene(load_robot(robot), [Gravity()]).effort_lagrangian()
    starts, scheme = jets(lagrangian.nv, size), by_name("taylor-midpoint")
    large = variational_order(lagrangian, scheme, steps, *starts)
    assert abs(large.order - 2) > 0.3
    assert not large.reliable
    assert "take smaller steps" in large.reason
    assert str(large) == f"order {large.order:.2f}, not reliable: {large.reason}"
    small = variational_order(lagrangian, scheme, [h / 16 for h in steps], *starts)
    assert small.reliable, small.reason
    assert small.order == pytest.approx(2, abs=0.1)
    assert str(small) == f"order {small.order:.2f}"


def test_errors_at_rounding_and_too_few_steps_tell_no_order() -> None:
    starts = jets(2, 1.0)
    exact = variational_order(spline(2), galerkin(0), [0.4, 0.2, 0.1], *starts)
    assert "may be rounding; take larger steps" in exact.reason
    none = VariationalOrder(exact.steps, *np.zeros((2, 3)), exact.actions)
    assert str(none).startswith("no order, not reliable: the error is 0 at h = 0.4 s")
    two = variational_order(spline(2), by_name("taylor-trapezoid"), [0.4, 0.2], *starts)
    assert two.order == pytest.approx(2, abs=1e-9)
    assert "three different steps" in two.reason
    tiny = variational_order(spline(2), by_name("taylor-trapezoid"), [4e-7, 2e-7, 1e-7], *starts)
    assert "may be rounding" in tiny.reason


@pytest.mark.parametrize(
    ("errors", "mean_errors", "reliable"),
    [
        ([8.0, 1.0, 0.125], [4.0, 0.5, 0.0625], True),
        ([8.0, 1.0, 0.1], [4.0, 0.5, 0.0625], False),
        ([8.0, 1.0, 0.125], [4.0, 0.5, 0.05], False),
        ([2.0**7, 2.0**3.5, 1.0], [2.0**7, 2.0**3.5, 1.0], False),
    ],
)
def test_an_order_is_reliable_where_all_slopes_agree_on_an_integer(
    errors: list[float], mean_errors: list[float], reliable: bool
) -> None:
    steps = np.array([0.04, 0.02, 0.01])
    found = VariationalOrder(steps, np.array(errors), np.array(mean_errors), np.ones(3))
    assert found.reliable == reliable
