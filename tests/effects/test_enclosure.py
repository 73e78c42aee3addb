"""Bounds of CasADi functions over boxes contain the function, and say where it changes little."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from hovi.effects.expressions.enclosure import Enclosure
from hovi.effects.expressions.time_parts import bisected, time_parts

x = ca.SX.sym("x", 3)
EXPRESSIONS = {
    "products": x[0] * x[1] - x[2] ** 2 + 2 * x[0],
    "pulse": ca.sin(x[0]) * ca.exp(-(x[1] ** 2)) + ca.fabs(x[2]),
    "angle": ca.atan2(x[0], x[1]),
    "branch": ca.if_else(x[0] > 0, x[1], x[2] ** 3),
    "extremes": ca.fmin(x[0], x[1]) / (1 + ca.fmax(x[2], x[0]) ** 2),
    "step": ca.tanh(10 * x[0]) * ca.sqrt(x[1] ** 2 + 0.01),
    "stairs": ca.floor(3 * x[0]) + ca.sign(x[1]) + ca.ceil(x[2]),
    "powers": x[0] ** 5 - x[1] ** -2 + x[2] ** 3,
    "poles": ca.tan(x[0]) + 1 / x[1] + ca.cosh(x[2]) + ca.sinh(x[0]),
    "arcs": ca.acos(x[0] / 3) + ca.asin(x[1] / 3) + ca.atan(x[2]),
    "waves": ca.cos(7 * x[0]) + ca.log(x[1] ** 2 + 0.1),
    "logic": ca.logic_and(x[0] > 0, x[1] < 1) + ca.logic_or(x[2] >= 0, x[0] == 0),
}


@pytest.mark.parametrize("name", EXPRESSIONS)
def test_bounds_contain_the_function_and_its_derivative(name: str) -> None:
    random = np.random.default_rng(2)
    center = random.uniform(-2, 2, (60, 3))
    half = 10.0 ** random.uniform(-4, 0.3, (60, 3))
    low, high = center - half, center + half
    for each in (EXPRESSIONS[name], ca.densify(ca.jacobian(EXPRESSIONS[name], x))):
        function = ca.Function("f", [x], [each])
        bounds = Enclosure(function)([(low, high)], 0.5)
        for _ in range(10):
            inside = low + (high - low) * random.uniform(0, 1, low.shape)
            values = np.array([np.array(function(row)).ravel() for row in inside])
            slack = 1e-9 * (1 + np.abs(values))
            assert not np.any(values < bounds.lower - slack)
            assert not np.any(values > bounds.upper + slack)


def test_small_boxes_are_calm_and_large_ones_are_not() -> None:
    enclosure = Enclosure(ca.Function("f", [x], [ca.sin(x[0]) + ca.fabs(x[1])]))
    low = np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, -0.1, 0.0]])
    high = np.array([[0.1, 2.0, 9.0], [2.0, 2.0, 9.0], [0.1, 0.1, 9.0]])
    assert enclosure([(low, high)], 0.5).calm.tolist() == [True, False, False]


def test_jumps_and_unknown_operations_are_marked() -> None:
    box = [(np.array([[-1.0, 0.0, 0.0]]), np.array([[1.0, 1.0, 1.0]]))]
    assert Enclosure(ca.Function("f", [x], [ca.sign(x[0])]))(box, 1.0).jumps.all()
    assert not Enclosure(ca.Function("f", [x], [ca.erf(x[0])])).known
    assert not Enclosure(ca.Function("f", [x], [x[0] * x[1] + x[2] ** 2])).bends


def test_a_wave_takes_a_few_dozen_intervals_and_a_short_pulse_too() -> None:
    t = ca.SX.sym("t")
    for each in (ca.sin(2 * ca.pi * t), ca.exp(-(((t - 0.3331) / 2e-5) ** 2)) + ca.sin(t)):
        found = bisected(time_parts("f", [each], t), np.linspace(0.0, 1.5, 3))
        assert not found.fault
        assert len(found.nodes) < 60
    assert np.abs(found.nodes - 0.3331).min() < 1e-5
