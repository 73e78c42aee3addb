"""Steps far beyond what a motion resolves: found where they exist, refused in a sentence if not."""

from __future__ import annotations

import re
from functools import cache

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import solve_ivp

from hovi.effects import Gravity
from hovi.errors import InputError
from hovi.flows.charted_lagrangian import ChartedLagrangian
from hovi.flows.exact_lagrangian import ExactDiscreteLagrangian, conjugate_time
from hovi.flows.legendre_transforms import jet_at_momenta, legendre
from hovi.flows.scheme_lagrangian import SchemeLagrangian
from hovi.flows.step_guesses import continued_modes, joined_modes, taylor_modes
from hovi.flows.stepper import flow
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.scene import Scene
from hovi.scene.standard_lagrangians import mechanics, spline
from hovi.schemes import by_name, end_basis, galerkin
from hovi.schemes.polynomials import legendre as legendre_polynomials
from samples.manifold_robots import configurations, with_arm

Array = npt.NDArray[np.float64]

ARMS = ["xarm7", "z1", "talos_arm"]
STEP = 0.05
STARTS = [(size, seed) for size in (0.1, 0.5, 1.0) for seed in range(10)]


@cache
def effort(robot: str) -> EffortLagrangian:
    return Scene(load_robot(robot), [Gravity()]).effort_lagrangian()


def start(robot: str, size: float, seed: int) -> tuple[Array, Array]:
    """(q, v) and momenta of a random jet (q, v, a, jerk)."""
    L = effort(robot)
    return legendre(L, *size * np.random.default_rng(seed).normal(size=(4, L.nv)))


@cache
def exact_end(robot: str, size: float, seed: int, T: float = STEP) -> tuple[Array, Array]:
    """(q, v) and momenta at T by DOP853 on Hamilton's equations."""
    L, (x, p) = effort(robot), start(robot, size, seed)
    n = L.nv

    def rate(_: float, y: Array) -> Array:
        q, v, p, pt = y.reshape(4, 1, n)
        _, gradient, hessian = L.evaluate(q, v, 0 * v)
        a = np.linalg.solve(hessian[0, 2, :, 2], (pt - gradient[:, 2])[0])  # dL/da is linear
        by = L.gradient(q, v, a[None])[0]
        return np.concatenate([v[0], a, by[0], by[1] - p[0]])

    y = np.concatenate([*x, *p])
    end = solve_ivp(rate, (0, T), y, "DOP853", rtol=1e-10, atol=1e-11).y[:, -1].reshape(2, 2, n)
    return end[0], end[1]


# Steps that exist


@pytest.mark.parametrize("robot", ARMS)
def test_light_wrists_are_stepped_over_from_every_start(robot: str) -> None:
    """In 0.05 s they turn by up to 3.6 rad and reach 330 rad/s: galerkin-4 follows them."""
    for size, seed in STARTS:
        x, p = start(robot, size, seed)
        motion = flow(SchemeLagrangian(effort(robot), galerkin(4), STEP), x, p, 1, force=True)
        q = exact_end(robot, size, seed)[0][0]
        assert np.abs(motion.q[1] - q).max() < 0.35 * np.abs(q - x[0]).max()


@pytest.mark.parametrize("robot", ARMS)
def test_the_default_scheme_takes_every_step_and_most_of_them_near_the_motion(robot: str) -> None:
    ld, near = SchemeLagrangian(effort(robot), galerkin(2), STEP), 0
    for size, seed in STARTS:
        x, p = start(robot, size, seed)
        motion = flow(ld, x, p, 1, force=True)
        assert np.abs(motion.reevaluated_momenta[0][0] - p).max() < 1e-9 * np.abs(p).max()
        q = exact_end(robot, size, seed)[0][0]
        error = np.abs(motion.q[1] - q).max() / np.abs(q - x[0]).max()
        assert error < 2.5
        near += int(error < 0.5)
    assert near >= 24


@pytest.mark.parametrize(
    ("name", "order", "counts"),
    [("taylor-midpoint", 2, [32, 64]), ("galerkin-0", 4, [16, 24]), ("galerkin-1", 6, [8, 12])],
)
@pytest.mark.parametrize("robot", ARMS)
def test_their_flows_have_the_order_of_the_scheme(
    robot: str, name: str, order: int, counts: list[int]
) -> None:
    T, errors = 0.04, []
    x, p = start(robot, 0.1, 2)
    exact = exact_end(robot, 0.1, 2, T)[0]
    for N in counts:
        motion = flow(SchemeLagrangian(effort(robot), by_name(name), T / N), x, p, N, force=True)
        errors.append(np.abs(motion.x[-1] - exact).max())
    slope = np.log(errors[0] / errors[1]) / np.log(counts[1] / counts[0])
    assert slope == pytest.approx(order, abs=0.3)


@pytest.mark.parametrize("seed", range(6))
def test_a_step_found_by_shorter_steps_is_symplectic(seed: int) -> None:
    L, (x, p) = effort("z1"), start("z1", 0.1, seed)
    S = SchemeLagrangian(L, galerkin(2), STEP).from_start(x[None], p[None]).tangent[0]
    m = len(S) // 2
    powers = np.repeat([1.0, STEP], L.nv)  # (q, h v) and (p, p~ / h) are canonical too
    D = np.concatenate([powers, 1 / powers])
    S, J = D[:, None] * S / D, np.kron([[0, 1], [-1, 0]], np.eye(m))
    assert np.abs(S.T @ J @ S - J).max() < 1e-11 * np.abs(S).max() ** 2


def test_a_flow_whose_steps_have_several_solutions_follows_the_motion(two_link: Robot) -> None:
    """A spinning arm: the solution next to the last curve jumps to 3000 rad/s at t = 1.98 s."""
    L = Scene(two_link, [Gravity()]).effort_lagrangian()
    x, p = legendre(L, *0.1 * np.random.default_rng(0).normal(size=(4, 2)))
    fine = flow(SchemeLagrangian(L, galerkin(2), 0.0025), x, p, 840, force=True)
    motion = flow(SchemeLagrangian(L, galerkin(2), 0.01), x, p, 210, force=True)
    assert np.abs(fine.x[:, 1]).max() > 250
    assert np.abs(motion.q - fine.q[::4]).max() < 0.5


def test_the_search_is_the_same_in_every_run() -> None:
    ends = []
    for _ in range(2):
        x, p = start("z1", 0.1, 1)
        ends.append(flow(SchemeLagrangian(effort("z1"), galerkin(2), STEP), x, p, 1).x[1])
    np.testing.assert_array_equal(*ends)


@pytest.mark.parametrize(("base", "h"), [("spherical", 0.3), ("free-flyer", 0.2)])
def test_long_steps_on_groups_are_found_and_refused_alike(base: str, h: float) -> None:
    robot = load_robot(with_arm(base))
    L, n, found = Scene(robot, [Gravity()]).effort_lagrangian(), robot.nv, 0
    q = configurations(robot, 1, size=0.3)[0]
    for seed in range(6):
        x, p = legendre(L, q, *np.random.default_rng(seed).normal(size=(3, n)))
        fine = flow(ChartedLagrangian(L, robot.space, galerkin(2), h / 8), x, p, 16)
        try:
            motion = flow(ChartedLagrangian(L, robot.space, galerkin(1), h), x, p, 2)
        except InputError as refused:
            assert re.search(r"in step \d: .* steps of .* s have one", str(refused))  # noqa: PT017
            continue
        way = np.abs(robot.difference(fine.q[8], fine.q[16])).max()
        assert np.abs(robot.difference(fine.q[-1], motion.q[-1])).max() < way
        found += 1
    assert found >= 5


# Steps that do not


def test_a_step_without_a_solution_is_described() -> None:
    """The midpoint scheme on xarm7 has none at 0.05 s; the shorter steps that are named do."""
    named = 0
    for size, seed in STARTS[:10]:
        x, p = start("xarm7", size, seed)
        try:
            flow(SchemeLagrangian(effort("xarm7"), by_name("taylor-midpoint"), STEP), x, p, 1)
        except InputError as refused:
            text = str(refused)
            assert text.startswith("the flow ends at t = 0 s, in step 1: the discrete equations of")
            assert re.search(r"relative residual of [\d.e-]+|misses the end of shorter", text)
            assert text.endswith("use a shorter step or smaller momenta.")
            parts, h = re.search(r"but (\d+) steps of ([\d.]+) s have one", text).groups()
            assert int(parts) * float(h) == pytest.approx(STEP)
            ld = SchemeLagrangian(effort("xarm7"), by_name("taylor-midpoint"), float(h))
            assert ld.from_start(x[None], p[None]).x1.shape == (1, 2, 7)
            named += 1
    assert named >= 3


def test_the_step_that_fails_is_named_with_its_time() -> None:
    x, p = start("xarm7", 0.5, 3)  # 50 rad from its start after 0.083 s
    ld = SchemeLagrangian(effort("xarm7"), galerkin(2), STEP)
    with pytest.raises(InputError, match=r"ends at t = 1\.\d+ s, in step [2-6]: .*shorter step"):
        flow(ld, x, p, 20, t0=1.0, force=True)


def no_step() -> CasadiLagrangian:
    """L = a^3 / 3 + a: dL/da = a^2 + 1, so that no a has the momentum p~ = 0."""
    q, v, a = (ca.SX.sym(c, 1) for c in "qva")
    return CasadiLagrangian([q, v, a], a**3 / 3 + a + 1e-3 * ca.sumsqr(q - v))


def test_where_shorter_steps_fail_too_a_much_shorter_one_is_advised() -> None:
    x, p = np.array([[0.0], [1.0]]), np.array([[0.0], [0.0]])
    with pytest.raises(InputError, match=r"nor have 16 steps of 0\.000625 s; use a much shorter"):
        SchemeLagrangian(no_step(), galerkin(0), 0.01).from_start(x[None], p[None])


def test_a_batch_reports_and_finds_each_of_its_steps() -> None:
    pairs = [start("z1", 0.1, seed) for seed in range(4)]
    ld = SchemeLagrangian(effort("z1"), galerkin(2), STEP)
    together = ld.from_start(*(np.stack(each) for each in zip(*pairs, strict=True)))
    for i, (x, p) in enumerate(pairs):
        alone = ld.from_start(x[None], p[None])
        np.testing.assert_allclose(together.x1[i], alone.x1[0], rtol=1e-9, atol=1e-9)


def test_the_exact_flow_takes_a_hard_step() -> None:
    x, p = start("talos_arm", 0.5, 2)
    interval = ExactDiscreteLagrangian(effort("talos_arm"), STEP, 1e-8).from_start(x[None], p[None])
    np.testing.assert_allclose(interval.x1[0], exact_end("talos_arm", 0.5, 2)[0], atol=1e-5)


# Guesses


def jet_lagrangian(k: int) -> CasadiLagrangian:
    jet = [ca.SX.sym(f"q{j}", 2) for j in range(k + 1)]
    L = ca.sumsqr(jet[-1]) * (2 + ca.cos(jet[0][0])) + jet[-1][0] * jet[-2][1] + ca.sin(jet[0][1])
    return CasadiLagrangian(jet, L)


@pytest.mark.parametrize("k", [1, 2, 3])
def test_the_jet_at_momenta_is_the_inverse_of_the_legendre_transform(k: int) -> None:
    L, jet = jet_lagrangian(k), np.random.default_rng(k).normal(size=(2 * k, 5, 2))
    if k == 1:
        jet = np.stack([*jet, accelerations(L, jet)])
    x, p = legendre(L, *jet[: 2 * k])
    top, rate = jet_at_momenta(L, list(np.moveaxis(x, 1, 0)), p)
    np.testing.assert_allclose(top, jet[k], rtol=1e-12)
    np.testing.assert_allclose(rate, jet[k + 1], rtol=1e-10)


def accelerations(L: CasadiLagrangian, jet: Array) -> Array:
    """q'' of the Euler-Lagrange equations of a Lagrangian of order 1."""
    _, gradient, H = L.evaluate(*jet)
    force = gradient[:, 0] - np.einsum("bij,bj->bi", H[:, 1, :, 0], jet[1])
    return np.asarray(np.linalg.solve(H[:, 1, :, 1], force[:, :, None])[:, :, 0])


def test_the_jet_at_momenta_is_that_on_groups_too() -> None:
    robot = load_robot(with_arm("free-flyer"))
    L = Scene(robot, [Gravity()]).effort_lagrangian()
    q, rest = configurations(robot, 1, size=0.3), np.random.default_rng(1).normal(size=(3, 1, 9))
    x, p = legendre(L, q, *rest)
    top, rate = jet_at_momenta(L, np.split(x[:, 0], [robot.nq], axis=1), p)
    np.testing.assert_allclose(top, rest[1], rtol=1e-9)
    np.testing.assert_allclose(rate, rest[2], rtol=1e-8)


def curve(k: int, modes: Array, s: Array) -> Array:
    """q^(k) at s from modes, shape (M, n)."""
    P = legendre_polynomials(2 * s - 1, len(modes))
    rows = [*end_basis(s, k), *(np.sqrt(2 * m + 1) * P[m] for m in range(k, len(modes)))]
    return np.asarray(np.array(rows).T @ modes)


@pytest.mark.parametrize("k", [1, 2, 3])
@pytest.mark.parametrize("count", [3, 5])
def test_guesses_are_exact_on_polynomials(k: int, count: int) -> None:
    random, s = np.random.default_rng(0), np.linspace(0, 1, 9)
    modes = random.normal(size=(1, count, 2))
    following = continued_modes(k, modes)[0]
    np.testing.assert_allclose(curve(k, following, s), curve(k, modes[0], 1 + s), rtol=1e-10)
    pieces = [modes[0], following]  # one polynomial on [0, 2]
    np.testing.assert_allclose(
        curve(k, joined_modes(k, pieces), s), curve(k, modes[0], 2 * s), rtol=1e-9, atol=1e-10
    )
    top, rate, h = random.normal(size=(1, 2)), random.normal(size=(1, 2)), 0.3
    for at in (0.0, 1.0):
        line = curve(k, taylor_modes(k, count, h, top, rate, at)[0], s)
        np.testing.assert_allclose(line, top + h * (s - at)[:, None] * rate, atol=1e-12)


def test_smooth_motions_take_few_evaluations(two_link: Robot) -> None:
    """The last curve continued is a better guess than the last curve: two evaluations, not four."""
    L = Counted(mechanics(Scene(two_link, [Gravity()])))
    x, p = legendre(L.inner, [0.3, -0.2], [0.1, 0.4])
    flow(SchemeLagrangian(L, galerkin(2, 1), 0.001), x, p, 100, force=True)
    assert L.evaluations <= 320


class Counted(CasadiLagrangian):
    """Counts evaluations."""

    def __init__(self, inner: CasadiLagrangian) -> None:
        super().__init__(inner.jet, inner.expression)
        self.inner, self.evaluations = inner, 0

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        self.evaluations += 1
        return super().evaluate(*jet, t=t)


@pytest.mark.parametrize("size", [1e160, 1e300])
def test_an_action_that_is_no_number_is_refused(size: float) -> None:
    """Squares of the states and momenta overflow: such steps are refused, if they are found."""
    L = spline(2)
    one, exact = SchemeLagrangian(L, galerkin(1), STEP), ExactDiscreteLagrangian(L, STEP)
    x, p = np.zeros((1, 2, 2)), np.full((1, 2, 2), size)
    for call in (
        lambda: one.from_start(x, p),
        lambda: one.from_end(x, p),
        lambda: one.joining(x, p),
        lambda: exact.from_start(x, p),
        lambda: conjugate_time(L, x[0], p[0], 0.2),
    ):
        with pytest.raises(InputError, match=r"is not a finite number: use|no solution near"):
            call()


def test_an_action_is_a_number_up_to_the_largest_momenta() -> None:
    """Its slopes are larger than itself, and may overflow alone."""
    one, refused = SchemeLagrangian(spline(2), galerkin(1), STEP), 0
    for size in np.geomspace(1e152, 1e156, 100):
        try:
            interval = one.from_start(np.zeros((1, 2, 2)), np.full((1, 2, 2), size))
        except InputError:
            refused += 1
        else:
            assert np.isfinite(interval.values).all()
            assert np.isfinite(interval.step_rate).all()
    assert 20 < refused < 80


@pytest.mark.parametrize("h", [0.0, -0.1, 5e-324, 1e10, 1e300, np.inf, np.nan])
def test_steps_on_groups_are_bounded_as_on_vector_spaces(h: float) -> None:
    space = ConfigurationSpace(("SO(3)",))
    q, v = ca.SX.sym("q", 4), ca.SX.sym("v", 3)
    L = CasadiLagrangian([q, v], ca.sumsqr(v) / 2, space)
    with pytest.raises(InputError, match="a step must be"):
        ChartedLagrangian(L, space, galerkin(1, 1), h)
    with pytest.raises(InputError, match="a step must be"):
        SchemeLagrangian(spline(2), galerkin(1), h)
