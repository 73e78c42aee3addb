"""Hard cases 17 to 21: the flow from momenta, its instability, and long runs."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hard.case import Case, Outcome, at_most, parameters
from hard.scenes import arm
from hovi.errors import InputError
from hovi.flows.euler_lagrange import discrete_lagrangian_map, legendre_plus
from hovi.flows.exact_lagrangian import ExactDiscreteLagrangian
from hovi.flows.legendre_transforms import legendre
from hovi.flows.scheme_lagrangian import SchemeLagrangian
from hovi.flows.stepper import Flow, flow
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.schemes import by_name, galerkin
from samples.long_flows import JET, arm_energy, costless, quarters, quartic, quartic_energy

Array = npt.NDArray[np.float64]

COUNTS = 80, 160, 320


@cache
def exact_motion() -> Flow:
    """One second of the arm's optimal control flow, accurate to round-off."""
    L = arm().effort_lagrangian()
    return flow(SchemeLagrangian(L, galerkin(4), 1 / 320), *legendre(L, *JET), 320, force=True)


def taylor(N: int) -> SchemeLagrangian:
    return SchemeLagrangian(arm().effort_lagrangian(), by_name("taylor-midpoint"), 1.0 / N)


def end_error(motion: Flow) -> float:
    """The error of q at the end."""
    return float(np.abs(motion.q[-1] - exact_motion().q[-1]).max())


def naive_start() -> str:
    parts = []
    for N in COUNTS:
        ld, x = taylor(N), exact_motion().x[:: 320 // N]
        x1, p1 = legendre_plus(ld, x[None, 0], x[None, 1])
        error = end_error(flow(ld, x1[0], p1[0], N - 1, force=True))
        parts.append(f"off by {error:.2g} after {N} steps")
    return "; ".join(parts)


def legendre_start() -> Outcome:
    exact = exact_motion()
    errors = [end_error(flow(taylor(N), exact.x[0], exact.p[0], N, force=True)) for N in COUNTS]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    shown = ", ".join(f"off by {e:.2g}" for e in errors) + f"; order {slopes[-1]:.2f}"
    return Outcome(shown, bool((np.abs(slopes - 2) < 0.3).all()))


def upright() -> tuple[SchemeLagrangian, Array, Array]:
    """The upright equilibrium, where the exponents of the flow are +-3.75 per second."""
    L = arm().effort_lagrangian()
    x, p = legendre(L, [np.pi / 2, 0], *np.zeros((3, 2)))
    return SchemeLagrangian(L, galerkin(1), 0.05), x, p


def naive_horizon() -> str:
    ld, x, p = upright()
    x[0, 0] += 1e-14
    gone = np.abs(flow(ld, x, p, 240, force=True).q - x[0]).max(axis=1)
    lost = np.flatnonzero(gone > 0.1)
    when = f"{0.05 * lost[0]:.1f} s" if len(lost) else "later than 12 s"
    return f"perturbed by 1e-14 rad, it deviates by 0.1 rad after {when}, silently"


def refused_horizon() -> Outcome:
    ld, x, p = upright()
    forced = flow(ld, x, p, 200, force=True)
    try:
        flow(ld, x, p, 200)
    except InputError as refused:
        horizon = float(str(refused).split("after ")[1].split(" s")[0])
        known = flow(ld, x, p, int(0.9 * horizon / 0.05))
        assert known.rounding is not None
        growth = np.median(np.diff(np.log(known.rounding[len(known.rounding) // 2 :]))) / 0.05
        good = 3 < horizon < 8 and abs(growth - 3.75) < 0.1 and len(forced.t) == 201
        return Outcome(f"refused after {horizon:.2g} s, growth {growth:.2f}/s", bool(good))
    return Outcome("accepted", False)


def naive_energy() -> str:
    L = quartic()
    x, p = legendre(L, [0.3], [0.1], [0.0], [0.05])
    y, energies = np.stack([x, p]), []
    for _ in range(4000):
        y = runge_kutta(L, y, 0.05)
        energies.append(float((y[1] * [y[0, 1], y[1, 1]]).sum() - L.value(*_jet(y))[0]))
    first, last = quarters(np.array(energies) - energies[0])
    return f"energy of RK4 off by {first:.1g} in the first quarter and {last:.1g} in the last"


def _jet(y: Array) -> list[Array]:
    """(q, v, a) with a = p~, as for the quartic oscillator."""
    return [y[0, :1], y[0, 1:], y[1, 1:]]


def runge_kutta(L: Lagrangian, y: Array, h: float) -> Array:
    """A step of the classical method for q' = v, v' = p~, p' = dL/dq, p~' = dL/dv - p."""

    def rate(y: Array) -> Array:
        gradient = L.gradient(*_jet(y))[0]
        return np.array([[y[0, 1], y[1, 1]], [gradient[0], gradient[1] - y[1, 0]]], dtype=object)

    def at(y: Array) -> Array:
        return np.array([[float(np.ravel(c)[0]) for c in row] for row in rate(y)])[..., None]

    k1 = at(y)
    k2 = at(y + h / 2 * k1)
    k3 = at(y + h / 2 * k2)
    k4 = at(y + h * k3)
    return np.asarray(y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))


def bounded_energy(steps: int) -> Callable[[], Outcome]:
    def run() -> Outcome:
        ratios = []
        for name in ("taylor-midpoint", "galerkin-0"):
            first, last = quartic_energy(name, steps)
            ratios.append(last / first)
        shown = f"last quarter over first: {ratios[0]:.3f} and {ratios[1]:.3f}"
        return Outcome(shown, max(ratios) <= 1.2)

    return run


def falling_arm() -> Outcome:
    ratios = [last / first for first, last in (arm_energy(arm(), r, 100_000) for r in (0, 1, 2))]
    shown = ", ".join(f"{ratio:.3f}" for ratio in ratios)
    return Outcome(f"last quarter over first: {shown}", max(ratios) <= 1.2)


def pendulum() -> Scene:
    from hovi.effects import Gravity

    return Scene(load_robot(example("pendulum.urdf")), [Gravity()])


def naive_costless() -> str:
    L = pendulum().effort_lagrangian()
    ld = SchemeLagrangian(L, by_name("hermite-simpson"), 0.1)
    motion = flow(ld, [[0.4], [0.2]], np.zeros((2, 1)), 300, force=True)
    recursion = SchemeLagrangian(L, galerkin(0), 0.02)
    x0 = np.array([[[0.4], [0.2]]])
    x1 = flow(recursion, x0[0], np.zeros((2, 1)), 1, force=True).x[None, 1]
    for _ in range(1000):
        x0, x1 = discrete_lagrangian_map(recursion, x0, x1)
    p = np.abs(legendre_plus(recursion, x0, x1)[1]).max()
    return (
        f"Hermite-Simpson: |p| grows to {np.abs(motion.p).max():.1g} in 300 steps of 0.1 s; "
        f"stepped in nodes, to {p:.1g} in 1,000 of 0.02 s"
    )


def stays_costless(steps: int) -> Callable[[], Outcome]:
    def run() -> Outcome:
        scenes = (pendulum(), [0.2]), (arm(False), [0.2, -0.1])
        return at_most(max(np.abs(costless(s, steps, v).p).max() for s, v in scenes), 1e-5)

    return run


def oscillator() -> CasadiLagrangian:
    q, v, a = (ca.SX.sym(c, 1) for c in "qva")
    return CasadiLagrangian([q, v, a], (ca.sumsqr(a) - ca.sumsqr(v)) / 2)


START = np.array([[[0.3], [0.1]]]), np.array([[[0.2], [0.5]]])


def naive_conjugate() -> str:
    late = SchemeLagrangian(oscillator(), galerkin(8), 6.4).from_start(*START)
    return f"a step of 6.4 s to q = {late.x1[0, 0, 0]:.3g}, a saddle, silently"


def refused_step() -> Outcome:
    ExactDiscreteLagrangian(oscillator(), 6.2).from_start(*START)
    try:
        ExactDiscreteLagrangian(oscillator(), 6.4).from_start(*START)
    except InputError as refused:
        return Outcome(str(refused)[:120], "1 conjugate point" in str(refused))
    return Outcome("accepted", False)


CASES = (
    Case(
        "17",
        "started from Legendre momenta the flow has the order of its scheme",
        naive_start,
        legendre_start,
        "order 2 with the Taylor scheme at 80, 160, 320 steps",
    ),
    Case(
        "18",
        "a horizon beyond the flow's instability is refused",
        naive_horizon,
        refused_horizon,
        "refused after 3 to 8 s of holding upright, growth 3.75/s; forced on request",
    ),
    Case(
        "19a",
        "the energy of the quartic oscillator is bounded over 2,000 steps",
        naive_energy,
        bounded_energy(2000),
        "last quarter at most 1.2 times the first",
    ),
    Case(
        "19b",
        "the energy of the quartic oscillator is bounded over 100,000 steps",
        naive_energy,
        bounded_energy(100_000),
        "last quarter at most 1.2 times the first",
        long=True,
    ),
    Case(
        "19c",
        "the energy of the falling arm is bounded over 100,000 steps, by three schemes",
        naive_energy,
        falling_arm,
        "last quarter at most 1.2 times the first",
        long=True,
    ),
    Case(
        "20a",
        "motions of zero cost keep it over 1,500 steps",
        naive_costless,
        stays_costless(1500),
        "|p| at most 1e-5",
    ),
    Case(
        "20b",
        "motions of zero cost keep it over 50,000 steps",
        naive_costless,
        stays_costless(50_000),
        "|p| at most 1e-5",
        long=True,
    ),
    Case(
        "21",
        "a step beyond a conjugate point is refused",
        naive_conjugate,
        refused_step,
        "h = 6.2 accepted, h = 6.4 refused with the conjugate point",
    ),
)


@pytest.mark.parametrize("case", parameters(CASES))
def test_flow(case: Case) -> None:
    outcome = case.run()
    assert outcome.passed, f"{outcome.shown}; the requirement: {case.requirement}"
