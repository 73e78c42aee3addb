"""Control points against SciPy's polynomials in Bernstein form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BPoly

from hovi.schemes.control_points import control_degree, control_rows
from hovi.schemes.interval_curve import jet_rows

CASES = [(k, r, j) for k in (1, 2, 3) for r in (0, 2, 6, 12) for j in range(k + 1)]


@pytest.mark.parametrize(("k", "inner_modes", "derivative"), CASES)
def test_a_polynomial_with_these_control_points_is_the_curve(
    k: int, inner_modes: int, derivative: int
) -> None:
    random = np.random.default_rng(k + 10 * inner_modes)
    data = random.normal(size=2 * k - 1 + inner_modes)
    left, width = np.array([0.0, 0.25, 0.875]), np.array([1.0, 0.5, 0.125])
    points, beside = control_rows(left, width, k, inner_modes, derivative)
    assert points.shape[1] == control_degree(k, inner_modes, derivative) + 1
    for a, w, c, at in zip(left, width, points @ data, beside @ data, strict=True):
        s = np.linspace(a, a + w, 50)
        curve = jet_rows(s, k, inner_modes)[:, derivative] @ data
        found = BPoly(c[:, None], [a, a + w])
        np.testing.assert_allclose(found(s), curve, rtol=1e-8, atol=1e-8 * np.abs(curve).max())
        assert c.min() <= curve.min() + 1e-8
        assert c.max() >= curve.max() - 1e-8
        where = a + w * np.linspace(0.0, 1.0, len(c)) if len(c) > 1 else np.array([a])
        expected = jet_rows(where, k, inner_modes)[:, derivative] @ data
        np.testing.assert_allclose(at, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_halving_a_part_brings_them_four_times_nearer(derivative: int) -> None:
    data = np.random.default_rng(4).normal(size=5)
    distances = []
    for halvings in (6, 7):
        width = np.full(2**halvings, 0.5**halvings)
        left = np.arange(2**halvings) * width
        points, beside = control_rows(left, width, 2, 2, derivative)
        distances.append(np.abs((points - beside) @ data).max())
    assert distances[0] / distances[1] == pytest.approx(4.0, rel=0.1)
