"""Small problems of kinds that stand on the KKT system, by their closed forms.

A border that is not symmetric is eliminated here, from the factor of the system alone.

A slider of mass 1 moves by u = a at the cost 1/2 integral u^2: its least cost over a time s is
J = 6 d^2 / s^3 - 6 d (v0 + v1) / s^2 + 2 (v0^2 + v0 v1 + v1^2) / s for a way d between two speeds.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import pytest

from hovi.optimize.banded_model import BandLayout
from hovi.optimize.kkt_model import ConstraintRows, KktFactor, KktLayout, KktModel
from hovi.optimize.quadratic_model import IntervalSum
from hovi.schemes import by_name

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
SCHEME = by_name("galerkin-1")
NODAL = SCHEME.nodal_table
COLUMNS = NODAL.shape[2]


@dataclass
class Sliders:
    """Some coordinates on intervals, as columns (q0, h v0, q1, h v1, c) and further ones.

    steps: of the intervals. given: values of (q, v) at nodes, NaN where free, (N + 1, 2, n).
    ratio: of the velocity after a node and before it, (N + 1,). force: number of columns of a force
    in every interval. moving: which coordinates cost an effort.
    """

    steps: Array
    given: Array
    ratio: Array | None = None
    force: int = 0
    moving: tuple[int, ...] = (0,)
    weight: float = 0.0
    numbers: Index = field(init=False)

    def __post_init__(self) -> None:
        N, n = len(self.steps), self.given.shape[2]
        count = 0
        nodes = np.full(self.given.shape, -1)
        inner = np.zeros((N, COLUMNS - 4 + self.force, n), dtype=np.intp)
        for k in range(N + 1):
            for place in np.argwhere(np.isnan(self.given[k])):
                nodes[(k, *place)], count = count, count + 1
            if k < N:
                size = inner[k].size
                inner[k], count = count + np.arange(size).reshape(inner[k].shape), count + size
        self.numbers = np.concatenate([nodes[:-1], nodes[1:], inner], axis=1)

    @property
    def scales(self) -> Array:
        """column = scale * unknown."""
        scales = np.ones(self.numbers.shape[:2])
        after = 1.0 if self.ratio is None else self.ratio[:-1]
        scales[:, 1], scales[:, 3] = self.steps * after, self.steps
        return scales

    @property
    def known(self) -> Array:
        """The columns of what is given, zero elsewhere."""
        known = np.nan_to_num(self.given)
        columns = np.zeros(self.numbers.shape)
        columns[:, :2], columns[:, 2:4] = known[:-1], known[1:]
        return columns * self.scales[..., None]

    def accelerations(self) -> Array:
        """Rows of u at the points over the columns of an interval, (N, Q, m)."""
        rows = np.zeros((len(self.steps), len(NODAL), self.numbers.shape[1]))
        rows[:, :, :COLUMNS] = NODAL[:, 2] / self.steps[:, None, None] ** 2
        for j in range(self.force):  # a force polynomial, which the joint need not give
            rows[:, :, COLUMNS + j] = -(SCHEME.points**j)
        return rows

    def model(self, rows: list[ConstraintRows]) -> KktModel:
        """Of the effort, with the load `weight` on u, at what is given."""
        N, m, n = self.numbers.shape
        u, w = self.accelerations(), SCHEME.weights * self.steps[:, None]
        blocks = np.einsum("kqc,kq,kqd->kcd", u, w, u)
        hessian = np.zeros((N, m, m, n, n))
        for i in self.moving:
            hessian[:, :, :, i, i] = blocks
        gradient = np.einsum("kcdab,kdb->kca", hessian, self.known)
        gradient[:, :, 0] += self.weight * np.einsum("kqc,kq->kc", u, w)
        layout = BandLayout.of(self.numbers, self.scales)
        metric = np.broadcast_to(np.eye(m), (N, m, m)).copy()
        band = layout.assemble(metric[..., None, None] * np.eye(n))
        wide = KktLayout.of(layout, rows)
        sums = IntervalSum(gradient, hessian, metric)
        return KktModel(sums, rows, wide, band, wide.extended(band))

    def solved(self, rows: list[ConstraintRows]) -> tuple[Array, float, KktModel]:
        """The columns of the least effort where rows times them are zero, and the effort."""
        model = self.model(rows)
        factor = model.factor(0.0)
        assert factor is not None
        s, _ = factor.solve(-model.gradient, -model.pushed_columns(self.known))
        columns = self.known + model.plain.gather(s)
        u = np.einsum("kqc,kc->kq", self.accelerations(), columns[:, :, 0]) + self.weight
        return columns, float(0.5 * np.sum(SCHEME.weights * self.steps[:, None] * u**2)), model


def at_rest(N: int, start: float, goal: float, n: int = 1) -> Array:
    """Ends at rest; the nodes between them are free."""
    given = np.full((N + 1, 2, n), np.nan)
    given[0], given[-1] = [[start], [0.0]], [[goal], [0.0]]
    return given


def least(d: float, v0: float, v1: float, s: float) -> float:
    return 6 * d**2 / s**3 - 6 * d * (v0 + v1) / s**2 + 2 * (v0**2 + v0 * v1 + v1**2) / s


@pytest.mark.parametrize("bounce", [0.0, 0.6, 1.0])
def test_a_node_with_two_velocities(bounce: float) -> None:
    """A ball that leaves a wall by a ratio of the speed with which it meets it."""
    N, s = 6, 0.5
    given, ratio = at_rest(N, 1.0, 0.5), np.ones(N + 1)
    given[N // 2, 0], ratio[N // 2] = 0.0, -bounce
    steps = np.full(N, 2 * s / N)
    columns, effort, _ = Sliders(steps, given, ratio).solved([ConstraintRows.none(COLUMNS, 1)])
    before = 6 * (-1.0 - bounce * 0.5) / (4 * s * (1 + bounce**2))
    assert columns[N // 2 - 1, 3, 0] / steps[0] == pytest.approx(before, rel=1e-12)
    assert columns[N // 2, 1, 0] / steps[0] == pytest.approx(-bounce * before, abs=1e-12)
    expected = least(-1.0, 0.0, before, s) + least(0.5, -bounce * before, 0.0, s)
    assert effort == pytest.approx(expected, rel=1e-12)


def test_a_coordinate_without_dynamics() -> None:
    """It costs nothing, and an equation in every interval says where it is."""
    N = 5
    given = np.concatenate([at_rest(N, 0.0, 1.0), at_rest(N, 0.0, 2.0)], axis=2)
    slopes = np.zeros((N, 3, COLUMNS, 2))
    for row, column in enumerate((2, 3, 4)):  # at the right node, and of the inner mode
        slopes[:, row, column] = -2.0, 1.0
    inside = ConstraintRows(np.arange(N - 1), slopes[:-1])
    last = ConstraintRows(np.array([N - 1]), slopes[-1:, 2:])
    columns, effort, model = Sliders(np.full(N, 0.2), given).solved([inside, last])
    np.testing.assert_allclose(columns[..., 1], 2 * columns[..., 0], atol=1e-10)
    assert effort == pytest.approx(6.0, rel=1e-12)
    assert model.negative_eigenvalues() == 0


def test_force_columns_in_intervals() -> None:
    """A weight g is lowered onto a wall, and lies on it: there the wall's force carries it."""
    N, g, s = 6, 9.81, 0.5
    given = at_rest(N, 1.0, 0.0)
    sliders = Sliders(np.full(N, 2 * s / N), given, force=2, weight=g)
    held, m = np.arange(N // 2, N), COLUMNS + 2
    wall = np.zeros((len(held), 3, m, 1))
    for row, column in enumerate((0, 1, 4)):
        wall[:, row, column] = 1.0
    free = np.zeros((N // 2, 2, m, 1))
    free[:, 0, COLUMNS], free[:, 1, COLUMNS + 1] = 1.0, 1.0
    rows = [ConstraintRows(held, wall), ConstraintRows(np.arange(N // 2), free)]
    columns, effort, model = sliders.solved(rows)
    np.testing.assert_allclose(columns[held, COLUMNS:, 0], [[g, 0.0]] * len(held), atol=1e-8)
    assert effort == pytest.approx(least(-1.0, 0.0, 0.0, s) + 0.5 * g**2 * s, rel=1e-10)
    assert model.negative_eigenvalues() == 0


@dataclass(frozen=True)
class ClosedBorder:
    """[K, B; C, D], with K symmetric and p last unknowns that equations of their own close.

    B: (size, p). C: (p, size). D: (p, p).
    """

    inner: KktFactor
    B: Array
    C: Array
    D: Array

    def solve(self, rhs: Array, transpose: bool = False) -> Array:
        B, C, D = (self.C.T, self.B.T, self.D.T) if transpose else (self.B, self.C, self.D)
        solved = np.stack([self._inner(b) for b in B.T], axis=1)
        x, size = self._inner(rhs[: len(B)]), len(B)
        p = np.linalg.solve(D - C @ solved, rhs[size:] - C @ x)
        return np.concatenate([x - solved @ p, p])

    def _inner(self, rhs: Array) -> Array:
        return self.inner.solve(rhs, np.zeros(len(self.inner.layout.multipliers)))[0]


WAY, LIMIT, TIME = 1.0, 0.7, 2.0
SWITCH = 1.5 * (TIME - WAY / LIMIT)
"""When a slider with |v| <= LIMIT has sped up: there a = 0, and it goes on at the limit."""


def speeding_up(t: float, way: float = WAY) -> Sliders:
    """The first part of its motion, up to a time t: half of the rest goes by at the limit."""
    given = at_rest(3, 0.0, 0.0)
    given[-1] = [[0.5 * (way - LIMIT * (TIME - 2 * t))], [LIMIT]]
    return Sliders(np.full(3, t / 3), given)


def last_acceleration(sliders: Sliders, columns: Array) -> float:
    table = SCHEME.rows(np.ones(1))[0, 2] / sliders.steps[-1] ** 2
    regular = columns[-1, :, 0].copy()
    q0, v0, q1, v1 = regular[:4]
    data = np.concatenate([[v0, q1 - q0 - v0, v1 - v0], regular[4:]])
    return float(table @ data)


def residual(x: Array, t: float, way: float = WAY) -> Array:
    """The gradient of the effort at unknowns x, and the acceleration at the switch."""
    sliders = speeding_up(t, way)
    model = sliders.model([ConstraintRows.none(COLUMNS, 1)])
    columns = sliders.known + model.plain.gather(x)
    force = np.einsum("kcdab,kdb->kca", model.plain.intervals.hessian, columns)
    return np.append(model.plain.scatter(force), last_acceleration(sliders, columns))


def border(x: Array, t: float) -> ClosedBorder:
    """The derivatives of the residual, those in t by differences."""
    sliders, h = speeding_up(t), 1e-4
    model = sliders.model([ConstraintRows.none(COLUMNS, 1)])
    slope = (
        8 * (residual(x, t + h) - residual(x, t - h))
        - (residual(x, t + 2 * h) - residual(x, t - 2 * h))
    ) / (12 * h)
    units = np.eye(len(x))
    C = np.array([last_acceleration(sliders, model.plain.gather(e)) for e in units])
    factor = model.factor(0.0)
    assert factor is not None
    return ClosedBorder(factor, slope[:-1, None], C[None], slope[-1:, None])


def found_switch() -> tuple[Array, float, list[float]]:
    """Newton's method on the motion and the switch at once."""
    t = 0.8 * SWITCH
    x, sizes = np.zeros(int(speeding_up(t).numbers.max()) + 1), list[float]()
    for _ in range(8):
        step = border(x, t).solve(-residual(x, t))
        x, t = x + step[:-1], t + float(step[-1])
        sizes.append(abs(t - SWITCH))
    return x, t, sizes


def test_a_parameter_that_is_closed_by_an_equation() -> None:
    """A slider with |v| <= V finds its switch by a = 0, where its border is not symmetric."""
    x, t, misses = found_switch()
    assert t == pytest.approx(SWITCH, rel=1e-9)
    for before, after in itertools.pairwise(misses[2:6]):  # quadratically, above rounding
        assert after < 5 * before**2 + 1e-13
    of = border(x, t)
    assert np.abs(of.B - of.C.T).max() > 0.1 * np.abs(of.B).max()


def test_an_adjoint_of_a_closed_parameter_is_a_solve_with_the_transpose() -> None:
    """d t / d way = -3 / (2 V), by one transposed solve and by its own solve."""
    x, t, _ = found_switch()
    of, h = border(x, t), 1e-5
    slope = (residual(x, t, WAY + h) - residual(x, t, WAY - h)) / (2 * h)
    adjoint = of.solve(np.append(np.zeros(len(x)), 1.0), transpose=True)
    assert -float(adjoint @ slope) == pytest.approx(-1.5 / LIMIT, rel=1e-6)
    assert -float(of.solve(slope)[-1]) == pytest.approx(-1.5 / LIMIT, rel=1e-6)
