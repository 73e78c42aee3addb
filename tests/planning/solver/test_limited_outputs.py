"""Compiled limits at points and in rows of intervals equal their sums, written out."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from hovi._native import intervals as native

Array = npt.NDArray[np.float64]

SHAPES = [(1, 1, 3, 4, 1, 1), (3, 4, 3, 6, 6, 6), (2, 3, 2, 4, 2, 0), (5, 3, 4, 8, 7, 9)]
"""Intervals B, points Q, rows R, columns m, components n, outputs p."""
each_shape = pytest.mark.parametrize("shape", SHAPES, ids=str)
own_tables = pytest.mark.parametrize("own", [False, True], ids=["one table", "own tables"])


class Case:
    """Tables, unequal steps, a Jacobian of outputs, and a selection with a column twice."""

    def __init__(self, shape: tuple[int, ...], own: bool) -> None:
        B, Q, R, m, n, p = shape
        self.random = random = np.random.default_rng(list(shape))
        tables = B * Q if own else Q
        self.table, self.weights = random.normal(size=(tables, R, m)), random.uniform(size=tables)
        self.steps = random.uniform(0.3, 2.0, B)
        self.jacobian = random.normal(size=(B * Q, p, R * n))
        chosen = random.permutation(R * n + p)[: max(1, (R * n + p) // 2)]
        self.selected = np.append(chosen, chosen[0])
        self.scales = random.uniform(0.1, 3.0, len(self.selected))
        per_interval = self.table.reshape(-1, Q, R, m)
        powers = self.steps[:, None, None, None] ** -np.arange(R)[:, None]
        self.A = np.broadcast_to(per_interval * powers, (B, Q, R, m))
        self.shares = self.steps[:, None] * np.broadcast_to(self.weights.reshape(-1, Q), (B, Q))

    def derivative(self, shape: tuple[int, ...]) -> Array:
        """d (selection) / d columns, (B, Q, K, m, n)."""
        B, Q, R, m, n, p = shape
        jets = np.einsum("bqrm,xy->bqrxmy", self.A, np.eye(n)).reshape(B, Q, R * n, m, n)
        J = self.jacobian.reshape(B, Q, p, R * n)
        outputs = np.einsum("bqpi,bqimn->bqpmn", J, jets)
        whole = np.concatenate([jets, outputs], axis=2)[:, :, self.selected]
        return np.asarray(whole * self.scales[:, None, None])

    @property
    def tables(self) -> tuple[Array, Array, Array]:
        return self.table, self.weights, self.steps

    @property
    def selection(self) -> tuple[Any, Array, Array]:
        return self.selected, self.scales, self.jacobian


@own_tables
@each_shape
def test_pushed_steps_are_the_changes_at_the_points(shape: tuple[int, ...], own: bool) -> None:
    case = Case(shape, own)
    B, Q, _, m, n, _ = shape
    step = case.random.normal(size=(B, m, n))
    found = np.full((B * Q, len(case.selected)), np.nan)
    native.push(*case.tables, step, *case.selection, found)
    expected = np.einsum("bqkmn,bmn->bqk", case.derivative(shape), step).reshape(found.shape)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@own_tables
@each_shape
def test_pulled_forces_are_weighted_sums_over_the_points(shape: tuple[int, ...], own: bool) -> None:
    case = Case(shape, own)
    B, Q, _, m, n, _ = shape
    forces = case.random.normal(size=(B * Q, len(case.selected)))
    found = np.full((B, m, n), np.nan)
    native.pull(*case.tables, forces, *case.selection, found)
    by_point = forces.reshape(B, Q, -1)
    expected = np.einsum("bq,bqk,bqkmn->bmn", case.shares, by_point, case.derivative(shape))
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


ROWS = [(1, 4, 1, 1), (3, 5, 6, 11), (4, 8, 7, 40), (2, 4, 2, 0), (2, 6, 2, 30)]
"""Intervals N, columns m, components n, rows E: of the last, many follow in one place."""
each_rows = pytest.mark.parametrize("shape", ROWS, ids=str)


def rows_of(shape: tuple[int, ...]) -> tuple[Any, Any, Array, Array, np.random.Generator]:
    """Intervals, joints and rows, some in one interval; and d rows / d columns, (E, N, m, n)."""
    N, m, n, E = shape
    random = np.random.default_rng(list(shape))
    k, joints = random.integers(N, size=E), random.integers(n, size=E)
    if 4 * N * n < E:
        order = np.lexsort((joints, k))
        k, joints = k[order], joints[order]
    rows = random.normal(size=(E, m))
    whole = np.zeros((E, N, m, n))
    whole[np.arange(E), k, :, joints] = rows
    return k, joints, rows, whole, random


@each_rows
def test_pushed_rows_are_their_changes(shape: tuple[int, ...]) -> None:
    k, joints, rows, whole, random = rows_of(shape)
    step, found = random.normal(size=shape[:3]), np.full(shape[3], np.nan)
    native.push_rows(k, joints, rows, step, found)
    np.testing.assert_allclose(found, np.einsum("ekmn,kmn->e", whole, step), atol=1e-13)


@each_rows
def test_pulled_rows_are_added_to_a_gradient(shape: tuple[int, ...]) -> None:
    k, joints, rows, whole, random = rows_of(shape)
    forces, before = random.normal(size=shape[3]), random.normal(size=shape[:3])
    found = before.copy()
    native.pull_rows(k, joints, rows, forces, found)
    expected = before + np.einsum("e,ekmn->kmn", forces, whole)
    np.testing.assert_allclose(found, expected, atol=1e-13)


@each_rows
def test_squares_of_rows_are_added_to_a_hessian(shape: tuple[int, ...]) -> None:
    N, m, n, _ = shape
    k, joints, rows, whole, random = rows_of(shape)
    weights, before = random.normal(size=shape[3]), random.normal(size=(N, m, m, n, n))
    found = before.copy()
    native.add_squares(k, joints, rows, weights, found)
    expected = before + np.einsum("e,ekix,ekjy->kijxy", weights, whole, whole, optimize=True)
    np.testing.assert_allclose(found, expected, atol=1e-13)
