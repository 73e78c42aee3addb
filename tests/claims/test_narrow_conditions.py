"""Conditions that change in a small part of a motion: seen, or said to be looked at by samples."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest

import hovi

AT, MOST = 0.61, 0.3
"""Time of the peaks and dips, in [s], and the bound of peaks of height 1."""
WIDTHS = 1e-1, 1e-2, 1e-3, 5e-4, 1e-4, 1e-5, 1e-7
OPTIONS: dict[str, Any] = {"limits": "none", "self_collision": False}


@pytest.fixture(scope="module")
def free(two_link: hovi.Robot) -> hovi.Solution:
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    return hovi.plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, **OPTIONS)


def judged(motion: hovi.Solution, *asked: hovi.Condition) -> hovi.Solution:
    """A motion, and what was asked of it afterwards."""
    problem = dataclasses.replace(motion.problem, conditions=asked)  # type: ignore[type-var]
    return dataclasses.replace(motion, problem=problem)


def peaks(x: Any, kind: str) -> Any:
    """A peak of height 1 and width 1 at zero, of a CasADi expression or an array."""
    array = isinstance(x, np.ndarray)
    if kind == "gauss":
        return np.exp(-(x**2)) if array else ca.exp(-(x**2))
    if kind == "lorentz":
        return 1 / (1 + x**2)
    if kind == "step":
        return 1.0 * (np.abs(x) < 1) if array else ca.if_else(ca.fabs(x) < 1, 1.0, 0.0)
    return np.maximum(0, 1 - np.abs(x)) if array else ca.fmax(0, 1 - ca.fabs(x))


KINDS = "gauss", "lorentz", "step", "tent"
OF: dict[str, Callable[[hovi.Trajectory, np.ndarray], np.ndarray]] = {
    "q": lambda motion, t: motion.sample(t).q[:, 0],
    "v": lambda motion, t: motion.sample(t).v[:, 0],
    "a": lambda motion, t: motion.sample(t).a[:, 0],
    "tau": lambda motion, t: motion.sample(t).tau[:, 0],
    "t": lambda motion, t: t,
}


def peak_of(name: str, kind: str, place: float, width: float) -> Callable[..., Any]:
    """A function of one argument that peaks at a value of its first entry."""

    def of_q(q: ca.SX) -> ca.SX:
        return peaks((q[0] - place) / width, kind)

    def of_v(v: ca.SX) -> ca.SX:
        return peaks((v[0] - place) / width, kind)

    def of_a(a: ca.SX) -> ca.SX:
        return peaks((a[0] - place) / width, kind)

    def of_tau(tau: ca.SX) -> ca.SX:
        return peaks((tau[0] - place) / width, kind)

    def of_t(q: ca.SX, t: ca.SX) -> ca.SX:
        return peaks((t - place) / width, kind) + 0 * q[0] ** 2 + 1e-9 * q[0]

    return {"q": of_q, "v": of_v, "a": of_a, "tau": of_tau, "t": of_t}[name]


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("of", OF)
def test_a_narrow_peak_of_an_expression_is_seen(
    free: hovi.Solution, of: str, kind: str, width: float
) -> None:
    """On its way, the motion takes the value at which the function peaks."""
    place = float(OF[of](free.trajectory, np.array([AT]))[0])
    asked = hovi.Condition(peak_of(of, kind, place, width), hovi.Between(upper=MOST), name="peak")
    found = judged(free, asked)
    assert found.violation.startswith("condition 'peak' reaches ")
    assert not found.usable
    assert found.margins().conditions["peak"] == pytest.approx(MOST - 1.0, abs=2e-2)
    high = hovi.Condition(peak_of(of, kind, place, width), hovi.Between(upper=1.1), name="peak")
    assert judged(free, high).violation == ""


def dips(width: float, kind: str) -> tuple[Callable[[Any], Any], Callable[[Any], Any]]:
    """A bound that dips from 40 to 0.5 at AT, and the same as no expression can be read."""

    def bound(t: Any) -> Any:
        x = (t - AT) / width
        return 40.0 - 39.5 * (peaks(x, kind) if isinstance(x, ca.SX) else peaks(np.array(x), kind))

    return bound, lambda t: float(bound(math.fsum([t])))


@pytest.mark.parametrize(
    ("read", "width"), [*((True, x) for x in WIDTHS), *((False, x) for x in WIDTHS if x > 4e-4)]
)
@pytest.mark.parametrize("kind", KINDS)
def test_a_bound_that_dips_is_seen(
    free: hovi.Solution, kind: str, width: float, read: bool
) -> None:
    """A bound that is no expression by samples, if it dips for long enough."""
    bound = dips(width, kind)[0 if read else 1]
    asked = hovi.Condition("dot(v, v)", hovi.Between(upper=bound), name="dip", scale=20.0)
    found = judged(free, asked)
    assert found.violation.startswith("condition 'dip' reaches ")
    assert not found.usable


class Peak(hovi.Function):
    """A peak of q[0], without CasADi."""

    needs, size = frozenset({"q"}), 1

    def __init__(self, place: float, width: float) -> None:
        self.place, self.width = place, width

    def values(self, at: hovi.Points) -> np.ndarray:
        return np.exp(-(((at.q[:, :1] - self.place) / self.width) ** 2))

    def slopes(self, at: hovi.Points) -> dict[str, np.ndarray]:
        x, y = at.q[:, :1] - self.place, self.values(at)
        return {"q": np.stack([-2 * x / self.width**2 * y, np.zeros_like(y)], axis=2)}


@pytest.mark.parametrize("width", [1e-1, 1e-2, 1e-3, 5e-4])
def test_a_peak_of_a_function_without_casadi_is_seen(free: hovi.Solution, width: float) -> None:
    place = float(free.trajectory.sample([AT]).q[0, 0])
    asked = hovi.Condition(Peak(place, width), hovi.Between(upper=MOST), name="peak")
    assert judged(free, asked).violation.startswith("condition 'peak' reaches ")


def test_what_is_looked_at_by_samples_alone_stays_with_the_motion(
    free: hovi.Solution, two_link: hovi.Robot
) -> None:
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    sentence = "its function cannot be bounded between them"
    asked = hovi.Condition(Peak(5.0, 1e-5), hovi.Between(upper=MOST), name="far")
    found = hovi.plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, conditions=[asked], **OPTIONS)
    assert found.success, found.message
    for motion in (found, found.replan(goal=[1.0, 0.51]), found.advance(0.1)):
        assert any(sentence in each for each in motion.trajectory.cautions)
    high = hovi.Between(upper=lambda t: 2.0 if t < 0.5 else 3.0)
    many = hovi.Condition('sin(1e7 * q["shoulder"])', high, name="many", scale=1.0)
    found = hovi.plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, conditions=[many], **OPTIONS)
    assert found.success, found.message
    (caution,) = found.trajectory.cautions
    assert caution == (
        "Condition 'many' changes in too many places to look at all: between them its "
        "bounds may be exceeded."
    )


BOUNDS: dict[str, tuple[Callable[[Any], Any], bool]] = {
    "line": (lambda t: 40.0 - 5.0 * t, True),
    "several": (lambda t: [40.0, 41.0 + t], True),
    "array": (lambda t: np.array([40.0, 41.0 - t]), True),
    "exponential": (lambda t: 40.0 * np.exp(-t), True),
    "table": (lambda t: np.interp(t, [0.0, 0.5, 1.0], [40.0, 30.0, 40.0]), True),
    "constant": (lambda t: 40.0, False),
    "decision": (lambda t: 40.0 if t < 0.5 else 30.0, False),
    "float": (lambda t: float(40.0 - t), False),
    "math": (lambda t: 40.0 * math.exp(-t), False),
    "kind": (lambda t: 40.0 if isinstance(t, float) else 40.0 - t, False),
}


@pytest.mark.parametrize("bound", BOUNDS)
def test_a_motion_says_which_bounds_are_no_expressions_of_time(
    two_link: hovi.Robot, bound: str
) -> None:
    function, is_read = BOUNDS[bound]
    given = hovi.Condition("v", hovi.Between(upper=function), name="bound", scale=20.0)
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    found = hovi.plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, conditions=[given], **OPTIONS)
    assert found.success, found.message
    said = "2,000 instants, as its bounds cannot be bounded between them: narrower features may be"
    assert any(said in each for each in found.trajectory.cautions) is not is_read


@pytest.mark.parametrize("width", [1e-3, 1e-4, 1e-5, 1e-6])
@pytest.mark.parametrize(
    ("limits", "most"),
    [({"base": "none", "tau": 20.0}, 20.0), ({"base": "none", "power": 45.0}, 45.0)],
)
def test_torques_that_an_effect_changes_in_a_short_way_are_limited(
    two_link: hovi.Robot, limits: dict[str, Any], most: float, width: float
) -> None:
    """A peak of 30 N m where the shoulder passes 0.6 rad, which hardly costs anything."""
    place, joint = 0.6, 'q["shoulder"]'
    pulse = hovi.effects.Custom({"shoulder": f"-30 * exp(-(({joint} - {place}) / {width!r})**2)"})
    scene = hovi.Scene(two_link, [hovi.effects.Gravity(), pulse])
    found = hovi.plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, **{**OPTIONS, "limits": limits})
    motion, low, high = found.trajectory, 0.0, 1.0
    for _ in range(60):  # the shoulder turns forwards
        middle = (low + high) / 2
        before = motion.sample([middle]).q[0, 0] < place
        low, high = (middle, high) if before else (low, middle)
    speed = float(np.abs(motion.sample([low]).v[0, 0]))
    at = motion.sample(low + 5 * width / speed * np.linspace(-1, 1, 4001))
    worst = np.abs(at.tau * at.v if "power" in limits else at.tau).max()
    assert not found.success or worst <= most * (1 + 4e-6)
    alone = hovi.plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, **OPTIONS)
    problem = dataclasses.replace(alone.problem, limits=hovi.as_limits(two_link, limits))  # type: ignore[type-var]
    assert width > 2e-4 or not dataclasses.replace(alone, problem=problem).usable
