"""hp refinement: which intervals get more modes and which are split."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from hovi.discrete.grid import DiscretePath, Grid
from hovi.planning.refinement.hp_refinement import (
    DECAY_RANGE,
    Demand,
    _decay_of_pieces,
    decay,
    refined,
)
from hovi.schemes import galerkin
from hovi.schemes.polynomials import interval_rows

Array = npt.NDArray[np.float64]


def projected(grid: Grid, singularity: float) -> DiscretePath:
    """a(t) = 1 / (1 + ((t - 0.5)/singularity)^2) on a grid, as its Legendre coefficients."""
    x, w = np.polynomial.legendre.leggauss(60)
    s = (x + 1) / 2
    t = grid.t[:-1, None] + grid.steps[:, None] * s
    a = 1 / (1 + ((t - 0.5) / singularity) ** 2)
    r = grid.inner_modes
    rows = interval_rows(s, r)
    inner = np.einsum("kq,qj,q->kj", a, rows[:, 2, 3:], w / 2)
    z1 = a @ (w / 2)
    z0 = (a * (1 - s)) @ (w / 2)
    N = grid.intervals
    zeros = np.zeros((N + 1, 1))
    return DiscretePath(zeros, zeros, np.stack([z0, z1], 1)[..., None], inner[..., None])


def test_the_decay_is_that_of_the_ellipse_of_analyticity() -> None:
    # poles at 0.5 +- 0.3 i for the interval [0, 1]: y = 0.6 half lengths from its middle
    grid = Grid.uniform(1.0, 1, galerkin(14))
    y = 0.3 / 0.5
    assert decay(grid, projected(grid, 0.3))[0] == pytest.approx(np.sqrt(1 + y * y) - y, rel=0.05)


@pytest.mark.parametrize("distance", [0.3, 0.5, 1.0])
def test_with_two_modes_the_decay_is_between_the_lowest_degrees(distance: float) -> None:
    """From degrees 0 and 1 to degrees 2 and 3, by the Legendre coefficients of a itself."""
    grid = Grid.uniform(1.0, 1, galerkin(2))
    x, w = np.polynomial.legendre.leggauss(60)
    a = 1 / (1 + ((x / 2 + 0.1) / distance) ** 2)
    c = [np.sqrt(2 * d + 1) * (w / 2 * a) @ np.polynomial.legendre.Legendre.basis(d)(x)
         for d in range(4)]  # fmt: skip
    expected = np.sqrt(np.hypot(c[2], c[3]) / np.hypot(c[0], c[1]))
    s = (x + 1) / 2
    z = np.array([w / 2 @ (a * (1 - s)), w / 2 @ a])
    inner = np.einsum("q,qj,q->j", a, interval_rows(s, 2)[:, 2, 3:], w / 2)
    ends = np.zeros((2, 1))
    found = decay(grid, DiscretePath(ends, ends, z[None, :, None], inner[None, :, None]))
    assert found[0] == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("distance", [0.05, 0.2, 0.5])
def test_the_predicted_decay_of_pieces_is_that_of_the_ellipse_of_each(distance: float) -> None:
    """The poles are as far from the piece in the middle, in half lengths, times their number."""
    grid = Grid.uniform(1.0, 1, galerkin(16))
    rho = decay(grid, projected(grid, distance))
    predicted = _decay_of_pieces(rho)[0]
    assert predicted[0] == pytest.approx(rho[0], rel=1e-12)
    assert (np.diff(predicted) < 0).all()
    thirds = Grid.uniform(1.0, 3, galerkin(8))
    assert predicted[2] == pytest.approx(decay(thirds, projected(thirds, distance))[1], rel=0.1)


def test_intervals_away_from_a_singularity_decay_faster() -> None:
    grid = Grid.uniform(1.0, 9, galerkin(6))
    rho = decay(grid, projected(grid, 0.02))
    assert np.argmax(rho) == 4
    assert rho[0] < 0.2 < rho[4]


def test_too_few_coefficients_give_the_slowest_decay() -> None:
    grid = Grid(np.full(2, 0.5), (galerkin(0), galerkin(4)))
    path = DiscretePath(np.zeros((3, 1)), np.zeros((3, 1)), np.ones((2, 2, 1)), np.ones((2, 4, 1)))
    assert decay(grid, path)[0] == DECAY_RANGE[1]


def test_smooth_intervals_get_modes_and_others_are_split() -> None:
    grid = Grid.uniform(1.0, 4, galerkin(2))
    finer = refined(grid, np.array([0.1, 0.1, 0.9, 0.1]), [Demand(np.full(4, 1e-4), 2)])
    np.testing.assert_allclose(finer.steps[:2], 0.25)
    assert finer.intervals > 4
    assert finer.duration == pytest.approx(1.0, rel=1e-14)
    cut = (finer.t[:-1] >= 0.5 - 1e-12) & (finer.t[:-1] < 0.75 - 1e-12)
    assert cut.sum() > 1
    assert finer.inner_modes > 2


def test_a_grid_that_meets_its_demands_stays_as_it_is() -> None:
    grid = Grid(np.array([0.2, 0.3, 0.5]), (galerkin(2), galerkin(4), galerkin(4)))
    same = refined(grid, np.full(3, 0.3), [Demand(np.full(3, 2.0), 2)])
    np.testing.assert_array_equal(same.steps, grid.steps)
    assert all(new.inner_modes >= old.inner_modes for new, old in pairs(same, grid))


def test_the_predicted_error_meets_the_demand() -> None:
    # one interval of decay 0.3 that needs a reduction by 1e-6 in a quantity of twice the order
    grid = Grid.uniform(1.0, 1, galerkin(2))
    finer = refined(grid, np.array([0.3]), [Demand(np.array([1e-6]), 2)])
    assert finer.intervals == 1
    more = finer.inner_modes - 2
    assert 0.3 ** (2 * more) <= 1e-6 * (1 + 1e-9) < 0.3 ** (2 * (more - 2))


def test_the_curve_between_the_nodes_needs_more_than_the_nodes() -> None:
    grid = Grid.uniform(1.0, 1, galerkin(2))
    curve, nodes = (
        refined(grid, np.array([0.3]), [Demand(np.array([1e-3]), power)]) for power in (1, 2)
    )
    assert curve.inner_modes > nodes.inner_modes


def test_infeasible_demands_split_the_interval_into_four() -> None:
    grid = Grid.uniform(1.0, 2, galerkin(2))
    finer = refined(grid, np.array([0.97, 0.05]), [Demand(np.array([1e-12, 1.0]), 2)])
    np.testing.assert_allclose(finer.steps, [0.125, 0.125, 0.125, 0.125, 0.5])


def pairs(one: Grid, other: Grid):  # type: ignore[no-untyped-def]
    return zip(one.schemes, other.schemes, strict=True)


def test_a_grid_has_one_scheme_or_two() -> None:
    rng = np.random.default_rng(0)
    grid = Grid.uniform(1.0, 24, galerkin(2))
    for joints in (2, 6, 30):
        demands = [Demand(10 ** rng.uniform(-9, 0, 24), 2)]
        finer = refined(grid, rng.uniform(0.05, 0.8, 24), demands, joints)
        assert len(finer.groups) <= 2


def test_a_second_scheme_pays_for_many_joints_only() -> None:
    grid = Grid.uniform(1.0, 64, galerkin(2))
    factor = np.where(np.arange(64) < 60, 1.0, 1e-7)
    rho = np.where(np.arange(64) < 60, 0.1, 0.3)
    groups = [len(refined(grid, rho, [Demand(factor, 2)], n).groups) for n in (1, 20)]
    assert groups == [1, 2]


def test_remaining_errors_are_averaged_for_the_cost_and_maximal_for_the_curve() -> None:
    factor = np.array([1e-2, 1e-4])
    change = np.array([0.1, 0.1])
    assert Demand(factor, 2).remaining(change) == pytest.approx((1e-2 / 1e-2 + 1e-2 / 1e-4) / 2)
    assert Demand(factor, 1).remaining(change) == pytest.approx(0.1 / 1e-4)


def test_an_interval_without_decay_is_split_into_four() -> None:
    grid = Grid.uniform(1.0, 3, galerkin(2))
    demand = Demand(np.array([1.0, 1e-12, 1.0]), 2)
    finer = refined(grid, np.array([0.1, 0.97, 0.1]), [demand])
    np.testing.assert_allclose(finer.steps, [1 / 3, *[1 / 12] * 4, 1 / 3])


def least_work(grid: Grid, rho: Array, demand: Demand, joints: int) -> float:
    """The work of the cheapest grid, from all pairs of numbers of modes, counted out.

    An interval with r modes has r + 2 points, and its Hessian r + 4 columns, those of the scheme
    with more modes where there are two.
    """
    choices: list[list[tuple[int, int] | None]] = []
    for modes in (2, 3, 4, 5, 6, 8, 10, 12):
        row: list[tuple[int, int] | None] = []
        for i, scheme in enumerate(grid.schemes):
            r = max(modes, scheme.inner_modes)
            y = (1 / rho[i] - rho[i]) / 2
            met = [
                s
                for s in (1, 2, 3, 4)
                if 2 * ((r + 2) * np.log(np.sqrt(1 + (s * y) ** 2) - s * y))
                - 2 * (scheme.inner_modes + 2) * np.log(rho[i])
                <= np.log(min(demand.factor[i], 1.0)) + 1e-12
            ]
            row.append((met[0], r) if met else None)
        choices.append(row)
    works = []
    for k, low in enumerate(choices):
        for high in choices[k:]:
            if any(a is None and b is None for a, b in zip(low, high, strict=True)):
                continue
            best = [
                min((c for c in pair if c is not None), key=lambda c: c[0] * (c[1] + 2))
                for pair in zip(low, high, strict=True)
            ]
            largest = max(c[1] for c in high if c is not None)
            works.append(work_of(best, largest, high is not low, joints))
    return min(works)


def work_of(intervals: list[tuple[int, int]], largest: int, two: bool, joints: int) -> float:
    """The work of intervals, each as (pieces, modes). two: whether there are two schemes."""
    points = sum(s * (r + 2) for s, r in intervals)
    hessians = 0.05 * sum(s for s, _ in intervals) * (largest + 4) ** 2
    is_split = any(s > 1 for s, _ in intervals)
    return points + hessians + (900 * two + 900 * is_split) / joints**2


def test_no_grid_that_meets_the_demands_takes_less_work() -> None:
    rng = np.random.default_rng(3)
    for joints in (1, 4, 12, 60):
        for _ in range(60):
            N = int(rng.integers(1, 30))
            grid = Grid.uniform(1.0, N, galerkin(2))
            rho, demand = rng.uniform(0.05, 0.6, N), Demand(10 ** rng.uniform(-5, 0, N), 2)
            found = refined(grid, rho, [demand], joints)
            cut = np.rint(grid.steps[0] / found.steps).astype(int)
            starts = np.flatnonzero(np.isin(np.round(found.t[:-1] * N, 9), np.arange(N)))
            intervals = [(int(cut[i]), found.schemes[i].inner_modes) for i in starts]
            modes = {r for _, r in intervals}
            work = work_of(intervals, max(modes), len(modes) > 1, joints)
            assert work <= least_work(grid, rho, demand, joints) * (1 + 1e-12)
