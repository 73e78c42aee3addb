"""The integrator behind the replay of dynamics, against closed forms and SciPy's DOP853."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import solve_ivp

from hovi._native.integration import integrate

Array = npt.NDArray[np.float64]


def pendulums(t: float, y: Array) -> Array:
    """Two damped ones, driven."""
    angle, speed = y.reshape(2, 2)
    return np.concatenate([speed, np.sin(3.0 * t) - 9.81 * np.sin(angle) - 0.1 * speed])


def test_a_linear_oscillator_has_its_closed_form() -> None:
    y = np.array([1.0, 0.0])
    integrate(lambda t, y: np.array([y[1], -y[0]]), y, 0.5, 7.5, 1e-11, 1e-13)
    np.testing.assert_allclose(y, [np.cos(7.0), -np.sin(7.0)], atol=2e-10)


def test_driven_pendulums_arrive_where_scipy_says() -> None:
    first = np.array([0.3, 2.0, 0.0, -1.0])
    known = solve_ivp(pendulums, (0.0, 4.0), first, "DOP853", rtol=1e-12, atol=1e-13)
    y = first.copy()
    integrate(pendulums, y, 0.0, 4.0, 1e-11, 1e-13)
    np.testing.assert_allclose(y, known.y[:, -1], atol=1e-8)


def test_tolerances_bound_the_error() -> None:
    errors = []
    for tolerance in (1e-4, 1e-7, 1e-10):
        y = np.array([1.0])
        integrate(lambda t, y: -2.0 * t * y, y, 0.0, 2.0, tolerance, tolerance)
        errors.append(abs(float(y[0]) - np.exp(-4.0)))
        assert errors[-1] < 10 * tolerance
    assert errors == sorted(errors, reverse=True)


def test_errors_of_the_rates_pass_through() -> None:
    class StopError(Exception):
        pass

    def rates(t: float, y: Array) -> Array:
        raise StopError

    with pytest.raises(StopError):
        integrate(rates, np.zeros(2), 0.0, 1.0, 1e-6, 1e-6)


@pytest.mark.parametrize("wrong", [np.zeros(3), np.zeros((2, 1)), [0.0, 0.0], 1.0, None])
def test_rates_of_another_kind_are_refused(wrong: Any) -> None:
    with pytest.raises(ValueError, match=r"rates must return .* of shape \(2,\)"):
        integrate(lambda t, y: wrong, np.zeros(2), 0.0, 1.0, 1e-6, 1e-6)


def test_an_interval_backwards_is_refused() -> None:
    with pytest.raises(ValueError, match="begin must be less than end"):
        integrate(pendulums, np.zeros(4), 1.0, 1.0, 1e-6, 1e-6)


def test_a_motion_that_leaves_in_finite_time_raises() -> None:
    """y' = y^2 from 1 is 1 / (1 - t)."""
    y = np.array([1.0])
    with pytest.raises(RuntimeError), np.errstate(all="ignore"):
        integrate(lambda t, y: y * y, y, 0.0, 2.0, 1e-9, 1e-9)
