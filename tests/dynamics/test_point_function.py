"""Batch evaluation equals evaluation point by point."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi.dynamics.point_function import PointFunction

Array = npt.NDArray[np.float64]
MANY = 1024


def sparse_function() -> ca.Function:
    """A scalar, a column, and a nonsymmetric 2 x 3 matrix with structural zeros."""
    x, t = ca.SX.sym("x", 2), ca.SX.sym("t")
    matrix = ca.SX(2, 3)
    matrix[0, 1], matrix[1, 0], matrix[1, 2] = x[0] * x[1], ca.sin(x[1]), t
    return ca.Function("f", [x, t], [ca.sumsqr(x), ca.vertcat(x[1], t * x[0], 3), matrix])


def by_hand(x: Array, t: Array) -> tuple[Array, Array, Array]:
    a, b = x.T
    number, column = a**2 + b**2, np.stack([b, t * a, np.full_like(t, 3.0)], axis=1)
    matrix = np.zeros((len(t), 2, 3))
    matrix[:, 0, 1], matrix[:, 1, 0], matrix[:, 1, 2] = a * b, np.sin(b), t
    return number, column, matrix


@pytest.mark.parametrize("points", [0, 1, 2, 7, MANY, MANY + 1, 2 * MANY + 5])
def test_batches_of_any_size_equal_single_evaluations(points: int) -> None:
    random = np.random.default_rng(points)
    x, t = random.normal(size=(points, 2)), random.normal(size=(points, 1))
    found = PointFunction(sparse_function())(x, t)
    for result, expected in zip(found, by_hand(x, t[:, 0]), strict=True):
        assert result.shape == expected.shape
        np.testing.assert_allclose(result, expected, rtol=1e-14, atol=0)


def test_any_memory_layout_is_accepted() -> None:
    function = PointFunction(sparse_function())
    x, t = np.random.default_rng(0).normal(size=(20, 2)), np.arange(20)[:, None]
    for view in (np.asfortranarray(x), np.repeat(x, 2, axis=0)[::2], x.astype(np.float32)):
        for result, expected in zip(
            function(view, t), by_hand(view.astype(float), t[:, 0] * 1.0), strict=True
        ):
            np.testing.assert_allclose(result, expected, rtol=1e-6)


def test_results_of_an_earlier_call_are_not_overwritten() -> None:
    function = PointFunction(sparse_function())
    x, t = np.random.default_rng(0).normal(size=(2, 6, 2)), np.ones((6, 1))
    first = function(x[0], t)
    kept = [result.copy() for result in first]
    function(x[1], t)
    for result, before in zip(first, kept, strict=True):
        np.testing.assert_array_equal(result, before)


def test_many_batch_sizes_in_turn_give_the_same_results() -> None:
    function = PointFunction(sparse_function())
    x, t = np.random.default_rng(0).normal(size=(30, 2)), np.ones((30, 1))
    whole = function(x, t)
    for points in [*range(1, 20), *range(1, 20)]:
        for part, expected in zip(function(x[:points], t[:points]), whole, strict=True):
            np.testing.assert_array_equal(part, expected[:points])


def heavy_function() -> ca.Function:
    """A function with enough instructions for several threads at a dozen points."""
    x = ca.SX.sym("x", 3)
    y = x
    for _ in range(800):
        y = ca.sin(y) * y[0] + ca.cos(y[1] * y[2])
    return ca.Function("heavy", [x], [y, ca.dot(x, y)])


@pytest.mark.parametrize("points", [5, 64, 101, MANY + 7])
def test_results_are_bitwise_independent_of_the_number_of_threads(
    points: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    x = np.random.default_rng(points).normal(size=(points, 3))
    results = []
    for threads in ("1", "2", "3"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        results.append([r.tobytes() for r in PointFunction(heavy_function())(x)])
    assert results[0] == results[1] == results[2]


X, S = ca.SX.sym("x"), ca.SX.sym("s")
OPERATIONS: dict[str, ca.SX] = {
    "arithmetic": (X + S) * (X - S) / (2.0 + X) - 1.0 / S + -X,
    "roots and powers": ca.sqrt(S) + S**X + X**3 + X**2 + 2 * X,
    "turns": ca.sin(X) + ca.cos(S) + ca.tan(X) + ca.atan2(X, S) + ca.asin(X / 9) + ca.acos(X / 9),
    "exponentials": ca.exp(X) * ca.log(S) + ca.log1p(S) + ca.expm1(X) + ca.erf(X),
    "hyperbolic": ca.sinh(X) + ca.cosh(X) + ca.tanh(X) + ca.asinh(X) + ca.acosh(1 + S),
    "branches": ca.if_else(X > S, X, S) + ca.fmin(X, 0) + ca.fmax(X, S) + ca.fabs(X) + ca.sign(X),
    "steps": ca.floor(X) + ca.ceil(S) + ca.fmod(X, S) + ca.copysign(S, X) + ca.remainder(X, S),
    "truths": ca.logic_and(X > 0, S > 1) + ca.logic_or(X > 0, S > 1) + ca.logic_not(X) + (X == S),
}


@pytest.mark.parametrize("name", OPERATIONS)
@pytest.mark.parametrize("points", [1, 15, 16, 17, 40])
def test_results_are_the_bits_of_casadi(name: str, points: int) -> None:
    function = ca.Function("f", [X, S], [OPERATIONS[name], ca.gradient(OPERATIONS[name], X)])
    random = np.random.default_rng(points)
    x, s = random.normal(size=(points, 1)), random.uniform(0.1, 2.0, (points, 1))
    found = PointFunction(function)(x, s)
    for i, (one, other) in enumerate(zip(x[:, 0], s[:, 0], strict=True)):
        for mine, theirs in zip(found, function(one, other), strict=True):
            assert mine[i].tobytes() == np.array(theirs)[0].tobytes()


def test_numbers_that_are_none_are_passed_on() -> None:
    x = np.array([[np.nan], [np.inf], [-np.inf], [0.0], [-0.0], [1.0]])
    found = PointFunction(ca.Function("f", [X], [1.0 / X, ca.sqrt(X)]))(x)
    with np.errstate(all="ignore"):
        np.testing.assert_array_equal(found[0], 1.0 / x[:, 0])
        np.testing.assert_array_equal(found[1], np.sqrt(x[:, 0]))


def test_a_function_that_calls_another_is_evaluated_too() -> None:
    inner = ca.Function("inner", [X], [ca.sin(X)], {"never_inline": True})
    function = PointFunction(ca.Function("outer", [X], [2.0 * inner(X)]))
    x = np.linspace(-1.0, 1.0, 5)[:, None]
    np.testing.assert_allclose(function(x)[0], 2.0 * np.sin(x[:, 0]), rtol=1e-15)
    assert function(x[:0])[0].shape == (0,)


def test_concurrent_calls_are_independent() -> None:
    function = PointFunction(heavy_function())
    x = np.random.default_rng(0).normal(size=(40, 3))
    whole = [result.copy() for result in function(x)]

    def first(points: int) -> bool:
        return all(
            np.array_equal(part, expected[:points])
            for part, expected in zip(function(x[:points]), whole, strict=True)
        )

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(first, [1 + i % 40 for i in range(200)]))


def test_a_pickled_function_gives_the_same_bytes() -> None:
    function = PointFunction(sparse_function())
    x, t = np.random.default_rng(0).normal(size=(6, 2)), np.ones((6, 1))
    copy = pickle.loads(pickle.dumps(function))
    for result, expected in zip(copy(x, t), function(x, t), strict=True):
        np.testing.assert_array_equal(result, expected)
