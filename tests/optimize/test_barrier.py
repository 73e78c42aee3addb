"""The compiled barrier equals its formulas, and its steps end inside the bounds."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt
import pytest

from hovi.optimize import barrier as module
from hovi.optimize.barrier import Barrier, Bounds, Direction, Pair
from oracles.finite_differences import derivative

Array = npt.NDArray[np.float64]
INF = np.inf
MU = 0.03
SEEDS = range(5)


def random_bounds(random: np.random.Generator, R: int) -> Bounds:
    """Bounds of outputs in turn on both sides, below, above, and on neither side."""
    lower, width = random.normal(size=R), random.uniform(0.5, 2.0, R)
    lower_only, upper_only = np.arange(R) % 4 == 1, np.arange(R) % 4 == 2
    free = np.arange(R) % 4 == 3
    upper = np.where(lower_only | free, INF, lower + width)
    weights = np.repeat(random.uniform(0.1, 2.0, (R + 2) // 3), 3)[:R]
    return Bounds(np.where(upper_only | free, -INF, lower), upper, weights, 2.0)


def random_barrier(seed: int, R: int = 23, mu: float = MU) -> tuple[Barrier, Array]:
    """Slacks inside, positive multipliers off the central path, and outputs, some at the slacks."""
    random = np.random.default_rng(seed)
    bounds = random_bounds(random, R)
    low = np.where(bounds.has_lower, bounds.lower, bounds.upper - 1.0)
    low = np.where(np.isfinite(low), low, 0.0)
    high = np.where(bounds.has_upper, bounds.upper, low + 1.0)
    s = low + random.uniform(0.02, 0.98, R) * (high - low)
    zl, zu = random.uniform(0.01, 2.0, (2, R))
    zl, zu = np.where(bounds.has_lower, zl, 0.0), np.where(bounds.has_upper, zu, 0.0)
    apart = np.where(random.uniform(size=R) < 0.5, 0.0, random.normal(size=R))
    return Barrier(bounds, s, zl, zu, mu, 1.0), s + apart


def random_targets(seed: int, R: int = 23) -> Pair:
    random = np.random.default_rng([seed, 7])
    return random.uniform(0.0, 0.1, R), random.uniform(0.0, 0.1, R)


def random_direction(seed: int) -> tuple[Barrier, Array, Direction]:
    """A barrier, outputs, and a direction that would leave the bounds."""
    barrier, y = random_barrier(seed)
    dy = 3.0 * np.random.default_rng([seed, 3]).normal(size=len(y))
    return barrier, y, barrier.aim(y, dy, random_targets(seed))


def gaps(barrier: Barrier) -> Pair:
    return barrier.s - barrier.bounds.lower, barrier.bounds.upper - barrier.s


def finite_gaps(barrier: Barrier) -> Pair:
    """The gaps, one where there is no bound."""
    below, above = (np.where(np.isfinite(gap), gap, 1.0) for gap in gaps(barrier))
    return below, above


def close(found: Array, expected: Array) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-13)


def sides(barrier: Barrier) -> Array:
    """The barrier's gaps that exist, those below and then those above."""
    below, above = gaps(barrier)
    return np.concatenate([below[barrier.bounds.has_lower], above[barrier.bounds.has_upper]])


# Newton's system


@pytest.mark.parametrize("seed", SEEDS)
def test_condensed_terms_are_those_of_the_eliminated_system(seed: int) -> None:
    barrier, y = random_barrier(seed)
    below, above = gaps(barrier)
    sigma, rho, force = barrier.condensed(y)
    expected = barrier.zl / below + barrier.zu / above
    close(sigma, expected)
    close(rho, MU / above - MU / below + expected * (y - barrier.s))
    close(force, barrier.zu - barrier.zl)
    close(force, barrier.multipliers)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_direction_solves_the_linearised_system(seed: int) -> None:
    """z gap + z dgap + gap dz is the target, y + dy is s + ds, and rho + sigma dy the force.

    A slack that differs from its output takes at most a fixed share of its gap.
    """
    barrier, y = random_barrier(seed)
    below, above = finite_gaps(barrier)
    dy = np.random.default_rng([seed, 3]).normal(size=len(y))
    targets = random_targets(seed)
    d = barrier.aim(y, dy, targets)
    lower, upper = barrier.bounds.has_lower, barrier.bounds.has_upper
    whole, keep = y + dy - barrier.s, barrier.boundary_fraction
    clipped = np.clip(
        whole, *(sign * keep * gap for sign, gap in zip((-1, 1), gaps(barrier), strict=True))
    )
    close(d.ds, np.where(y == barrier.s, whole, clipped))
    products = barrier.zl * (below + d.ds) + below * d.dzl
    close(products[lower], targets[0][lower])
    products = barrier.zu * (above - d.ds) + above * d.dzu
    close(products[upper], targets[1][upper])
    assert not d.dzl[~lower].any()
    assert not d.dzu[~upper].any()
    sigma, rho, _ = barrier.condensed(y)
    force = barrier.zu + d.dzu - barrier.zl - d.dzl
    lower_target, upper_target = (
        np.where(side, target, MU) for side, target in zip((lower, upper), targets, strict=True)
    )
    shifted = rho + barrier.shift(MU, (lower_target, upper_target))
    newton = d.ds == whole
    assert (~newton).any()
    close((shifted + sigma * dy)[newton], force[newton])
    assert d.largest_force == pytest.approx(np.abs(shifted + sigma * dy).max(), rel=1e-11)
    assert d.largest_residual == pytest.approx(np.abs(y - barrier.s).max(), rel=1e-13)


def test_a_shift_to_the_present_mu_is_none() -> None:
    barrier, _ = random_barrier(0)
    assert not barrier.shift(MU, barrier.central_targets()).any()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_shift_of_mu_is_the_difference_of_two_condensations(seed: int) -> None:
    barrier, y = random_barrier(seed)
    other = barrier.with_mu(0.4 * MU)
    change = other.condensed(y)[1] - barrier.condensed(y)[1]
    close(barrier.shift(MU, other.central_targets()), change)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_lengths_of_a_direction_are_those_to_the_boundary(seed: int) -> None:
    """The largest shares of slacks that equal their outputs, and of multipliers."""
    barrier, y, d = random_direction(seed)
    matched = np.abs(y - barrier.s) <= module.SLACK_MATCHED
    assert matched.any()
    assert (~matched).any()
    shares = np.linspace(0.0, 1.0, 20_001)[:, None]
    s = barrier.s + shares * d.ds
    inside = ((s >= barrier.bounds.lower) & (s <= barrier.bounds.upper))[:, matched].all(axis=1)
    assert d.primal == pytest.approx(shares[inside].max(), abs=1e-4)
    positive = ((barrier.zl + shares * d.dzl >= 0) & (barrier.zu + shares * d.dzu >= 0)).all(axis=1)
    assert d.dual == pytest.approx(shares[positive].max(), abs=1e-4)
    assert min(d.primal, d.dual) < 1.0
    end = barrier.s + d.primal * d.ds
    left = np.minimum(end - barrier.bounds.lower, barrier.bounds.upper - end)[matched]
    assert left.min() == pytest.approx(0.0, abs=1e-12) or d.primal == 1.0
    left = np.minimum(barrier.zl + d.dual * d.dzl, barrier.zu + d.dual * d.dzu)
    assert left.min() == pytest.approx(0.0, abs=1e-12)


def test_a_direction_away_from_all_bounds_may_be_taken_whole() -> None:
    bounds = Bounds(np.zeros(2), np.array([INF, 1.0]), np.ones(2))
    barrier = Barrier(bounds, np.array([0.1, 0.1]), np.ones(2), np.array([0.0, 1.0]), 0.1, 1.0)
    d = barrier.aim(barrier.s, np.array([7.0, 0.4]), (np.full(2, 9.0), np.full(2, 9.0)))
    assert (d.primal, d.dual) == (1.0, 1.0)


# Targets


@pytest.mark.parametrize("seed", SEEDS)
def test_mean_products_are_means_over_the_bounds_that_exist(seed: int) -> None:
    barrier, _, d = random_direction(seed)
    below, above = finite_gaps(barrier)
    lower, upper = barrier.bounds.has_lower, barrier.bounds.has_upper

    def mean(ds: Array, zl: Array, zu: Array) -> float:
        parts = (zl * (below + ds))[lower], (zu * (above - ds))[upper]
        return float(np.concatenate(parts).mean())

    still = np.zeros_like(d.ds)
    assert barrier.mean_product() == pytest.approx(mean(still, barrier.zl, barrier.zu), rel=1e-13)
    step = np.clip(d.primal * d.ds, -0.99 * below, 0.99 * above)
    after = mean(step, barrier.zl + d.dual * d.dzl, barrier.zu + d.dual * d.dzu)
    assert barrier.mean_product(d) == pytest.approx(after, rel=1e-12)


def test_without_bounds_the_mean_product_is_zero() -> None:
    bounds = Bounds(np.full(3, -INF), np.full(3, INF), np.ones(3))
    assert Barrier.central(bounds, np.ones(3), 0.1).mean_product() == 0.0


@pytest.mark.parametrize("seed", SEEDS)
def test_the_complementarity_is_the_largest_miss_of_mu(seed: int) -> None:
    barrier, _ = random_barrier(seed)
    below, above = finite_gaps(barrier)
    lower, upper = barrier.bounds.has_lower, barrier.bounds.has_upper
    products = np.concatenate([(barrier.zl * below)[lower], (barrier.zu * above)[upper]])
    assert barrier.complementarity() == pytest.approx(np.abs(products - MU).max(), rel=1e-13)


@pytest.mark.parametrize("seed", SEEDS)
def test_corrected_targets_make_up_for_second_order_terms(seed: int) -> None:
    """Where slacks are their outputs, (z + dz)(gap + dgap) is then mu, for the same direction."""
    barrier, y, d = random_direction(seed)
    lower, upper = barrier.corrected_targets(y, d, 0.02)
    matched = y == barrier.s
    close(lower, 0.02 - np.where(matched, d.ds * d.dzl, 0.0))
    close(upper, 0.02 + np.where(matched, d.ds * d.dzu, 0.0))
    below, _ = finite_gaps(barrier)
    here = matched & barrier.bounds.has_lower
    again = barrier.aim(y, d.dy, (lower, upper))
    first_order = (barrier.zl * (below + again.ds) + below * again.dzl)[here]
    close(first_order + (d.ds * d.dzl)[here], np.full(here.sum(), 0.02))


@pytest.mark.parametrize("seed", SEEDS)
def test_centered_targets_bring_outliers_into_a_range(seed: int) -> None:
    """At shares 1.08 a + 0.18: below mu/10 up to it, above 10 mu by at most 10 mu down to it."""
    barrier, y, d = random_direction(seed)
    given, mu = random_targets(seed), 0.02
    found = barrier.centered_targets(y, d, mu, given)
    primal, dual = (min(1.0, 1.08 * share + 0.18) for share in (d.primal, d.dual))
    below, above = finite_gaps(barrier)
    matched = y == barrier.s
    ends = [
        ((barrier.zl + dual * d.dzl) * (below + primal * d.ds), barrier.bounds.has_lower),
        ((barrier.zu + dual * d.dzu) * (above - primal * d.ds), barrier.bounds.has_upper),
    ]
    changed = 0
    for target, before, (product, bounded) in zip(found, given, ends, strict=True):
        by = np.maximum(np.clip(product, 0.1 * mu, 10 * mu) - product, -10 * mu)
        expected = np.where(matched & bounded, by, 0.0)
        close(target - before, expected)
        changed += np.count_nonzero(expected)
    assert changed > 0


def test_given_targets_are_not_written_to() -> None:
    barrier, y, d = random_direction(0)
    given = random_targets(0)
    copies = [each.copy() for each in given]
    barrier.centered_targets(y, d, 0.02, given)
    for each, copy in zip(given, copies, strict=True):
        np.testing.assert_array_equal(each, copy)


# Merit


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("seed", SEEDS)
def test_the_merit_is_the_barrier_and_the_misfit(seed: int, share: float) -> None:
    barrier, y, d = random_direction(seed)
    w, bounds, keep = barrier.bounds.weights, barrier.bounds, barrier.boundary_fraction
    below, above = gaps(barrier)
    s = barrier.s + np.clip(share * d.ds, -keep * below, keep * above)
    assert ((s > bounds.lower) & (s < bounds.upper)).all()
    logs = np.sum((w * np.log(s - bounds.lower))[bounds.has_lower])
    logs += np.sum((w * np.log(bounds.upper - s))[bounds.has_upper])
    misfit = float(w @ np.abs(y + share * d.dy - s))
    expected = 0.7 * misfit - MU * logs
    assert barrier.merit(y, 0.7, d, share) == pytest.approx(expected, rel=1e-11)


def test_merits_of_thousands_of_gaps_neither_overflow_nor_vanish() -> None:
    """Their products do, in one logarithm for all of them: gaps of 1e-9 and of 1e9."""
    for gap in (1e-9, 1e9):
        bounds = Bounds(np.zeros(2_000), np.full(2_000, INF), np.full(2_000, 0.5))
        barrier = Barrier.central(bounds, np.ones(2_000), MU)
        barrier = dataclasses.replace(barrier, s=np.full(2_000, gap))
        d = barrier.aim(barrier.s, np.zeros(2_000), barrier.central_targets())
        expected = -MU * 0.5 * 2_000 * np.log(gap)
        assert barrier.merit(barrier.s, 0.0, d, 0.0) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_condensed_gradient_is_that_of_the_merit(seed: int) -> None:
    """With y = s and multipliers on the central path: d barrier / dy = weights rho."""
    barrier, _ = random_barrier(seed)
    w = barrier.bounds.weights

    def value(s: Array) -> Array:
        moved = dataclasses.replace(barrier, s=s)
        still = moved.aim(s, np.zeros_like(s), moved.central_targets())
        return np.array(moved.merit(s, 1.0, still, 0.0))

    rho = barrier.condensed(barrier.s)[1]
    np.testing.assert_allclose(w * rho, derivative(value, barrier.s, 1e-4), rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_merit_falls_along_a_direction_as_its_slope_says(seed: int) -> None:
    barrier, y, d = random_direction(seed)
    h, penalty, w = 1e-7, 0.9, barrier.bounds.weights
    found = (barrier.merit(y, penalty, d, h) - barrier.merit(y, penalty, d, 0.0)) / h
    below, above = gaps(barrier)
    slope = float(w @ (MU / above * d.ds - MU / below * d.ds))
    slope += penalty * float(w @ (np.sign(y - barrier.s) * (d.dy - d.ds)))
    assert found == pytest.approx(slope, rel=1e-4)


# Steps


@pytest.mark.parametrize("share", [0.2, 1.0])
@pytest.mark.parametrize("seed", SEEDS)
def test_moved_slacks_and_multipliers_stay_inside(seed: int, share: float) -> None:
    barrier, y, d = random_direction(seed)
    reached = y + share * d.dy
    moved = barrier.moved(reached, d, share, 0.5)
    below, above = gaps(barrier)
    keep = barrier.boundary_fraction
    plain = barrier.s + np.clip(share * d.ds, -keep * below, keep * above)
    at_output = moved.s != plain
    np.testing.assert_array_equal(moved.s[at_output], reached[at_output])
    assert sides(moved).min() > 0
    lower, upper = barrier.bounds.has_lower, barrier.bounds.has_upper
    after_below, after_above = gaps(moved)
    dual = min(1.0, keep * d.dual)
    range_of = module.MAX_DUAL_RATIO
    for z, dz, gap, bounded, new in (
        (barrier.zl, d.dzl, after_below, lower, moved.zl),
        (barrier.zu, d.dzu, after_above, upper, moved.zu),
    ):
        expected = np.clip(z + dual * dz, MU / gap / range_of, MU / gap * range_of)
        close(new, np.where(bounded, expected, 0.0))
        assert (new[bounded] > 0).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_slack_becomes_its_output_where_that_lowers_the_merit(seed: int) -> None:
    barrier, y, d = random_direction(seed)
    random, penalty, bounds = np.random.default_rng([seed, 4]), 0.8, barrier.bounds
    reached = barrier.s + 0.2 * random.normal(size=len(y))
    keep = barrier.boundary_fraction
    below, above = gaps(barrier)
    plain = barrier.s + np.clip(0.4 * d.ds, -keep * below, keep * above)

    def merits(s: Array) -> Array:
        with np.errstate(invalid="ignore", divide="ignore"):
            low = np.where(bounds.has_lower, np.log(s - bounds.lower), 0.0)
            high = np.where(bounds.has_upper, np.log(bounds.upper - s), 0.0)
        return penalty * np.abs(reached - s) - MU * (low + high)

    inside = (reached > bounds.lower) & (reached < bounds.upper)
    chosen = inside & (np.nan_to_num(merits(reached), nan=INF) < merits(plain))
    assert chosen.any()
    assert (~chosen).any()
    moved = barrier.moved(reached, d, 0.4, penalty)
    np.testing.assert_allclose(moved.s, np.where(chosen, reached, plain), rtol=0, atol=1e-14)


# First barriers


def test_central_barriers_keep_slacks_inside_and_products_at_mu() -> None:
    bounds = Bounds(np.array([0.0, -INF, 0.0]), np.array([1.0, 2.0, INF]), np.ones(3))
    barrier = Barrier.central(bounds, np.array([5.0, 1.0, 3.0]), mu=0.1)
    assert ((barrier.s > bounds.lower) & (barrier.s < bounds.upper)).all()
    np.testing.assert_allclose(barrier.s, [0.99, 1.0, 3.0])
    np.testing.assert_allclose(barrier.zl, [0.1 / 0.99, 0.0, 0.1 / 3.0])
    np.testing.assert_allclose(barrier.zu, [0.1 / 0.01, 0.1 / 1.0, 0.0])
    assert barrier.complementarity() == pytest.approx(0.0, abs=1e-15)
    still = barrier.aim(barrier.s, np.zeros(3), barrier.central_targets())
    value = -0.1 * (np.log(0.99) + np.log(0.01) + np.log(2.0 - 1.0) + np.log(3.0))
    assert barrier.merit(barrier.s, 1.0, still, 0.0) == pytest.approx(value)
    far = barrier.aim(barrier.s, np.array([1.0, -1e9, 1e9]), barrier.central_targets())
    assert far.primal < 0.0101
    assert barrier.zu[2] == barrier.zl[1] == 0.0


@pytest.mark.parametrize("seed", SEEDS)
def test_a_refined_barrier_keeps_what_it_had(seed: int) -> None:
    """Old slacks and multipliers stay; new ones are at their outputs and on the central path."""
    barrier, y = random_barrier(seed)
    old = len(y)
    both = random_bounds(np.random.default_rng([seed, 8]), 8)
    bounds = Bounds(
        np.append(barrier.bounds.lower, both.lower),
        np.append(barrier.bounds.upper, both.upper),
        np.append(barrier.bounds.weights, both.weights),
    )
    further = np.where(both.has_lower, both.lower, 0.0) + 0.2
    further = np.where(both.has_upper, both.upper - 0.2, further)
    new = np.full(len(further), -1)
    whole = barrier.refined(bounds, np.append(y, further), np.arange(old), new, y)
    close(whole.s[:old], barrier.s)
    close(whole.zl[:old], barrier.zl)
    close(whole.zu[:old], barrier.zu)
    close(whole.s[old:], further)
    below, above = finite_gaps(whole)
    close((whole.zl * below)[old:][both.has_lower], np.full(both.has_lower.sum(), MU))
    close((whole.zu * above)[old:][both.has_upper], np.full(both.has_upper.sum(), MU))


def test_new_outputs_take_the_multipliers_of_those_at_whose_place_they_are() -> None:
    bounds = Bounds(np.zeros(3), np.ones(3), np.ones(3))
    zu = np.array([2.0, 5.0, 3.0])
    barrier = Barrier(bounds, np.full(3, 0.5), np.full(3, 1e-3), zu, 1e-3, 1.0)
    more = Bounds(np.zeros(4), np.ones(4), np.ones(4))
    kept, origin, y = np.array([0, 2]), np.array([1, -1]), np.array([0.5, 0.5, 0.9, 1.5])
    whole = barrier.refined(more, y, kept, origin, y[:2])
    close(whole.zu[:3], [2.0, 3.0, 5.0])
    assert whole.zu[3] == pytest.approx(1e-3 / (1.0 - whole.s[3]))
    assert whole.s[2] == 0.9
    assert 0.9 < whole.s[3] < 1.0


def test_slacks_move_with_outputs_that_move_away_from_their_only_bound() -> None:
    bounds = Bounds(np.zeros(3), np.array([np.inf, np.inf, 2.0]), np.ones(3))
    barrier = Barrier(bounds, np.full(3, 0.5), np.full(3, 1e-3), np.zeros(3), 1e-3, 1.0)
    before, y, none = np.full(3, 0.5), np.array([0.7, 0.3, 0.7]), np.zeros(0, dtype=np.intp)
    whole = barrier.refined(bounds, y, np.arange(3), none, before)
    close(whole.s, [0.7, 0.5, 0.5])  # the second came nearer, the third has another bound
    close(whole.zl, barrier.zl)


def test_new_outputs_below_their_bounds_take_over_the_forces_beside_them() -> None:
    """All rise together until the new ones are at their bounds, with products of mu."""
    inf = np.full(4, np.inf)
    bounds, mu = Bounds(np.zeros(4), inf, np.ones(4)), 1e-6
    s, zl = np.array([1e-5, 2e-5, 0.4, 0.3]), np.array([0.1, 0.05, 1e-5, 1e-5])
    barrier = Barrier(bounds, s, zl, np.zeros(4), mu, 1.0)
    y = np.array([1e-5, 2e-5, 0.4, -3e-3])
    after = barrier.handed_on(y, np.array([3, 3]), np.array([0, 1]))
    close(after.s[:2], s[:2] + 3e-3)
    assert after.zl[3] == pytest.approx(0.15)
    close(after.zl * after.s, [mu, mu, 4e-6, mu])
    inside = barrier.handed_on(np.abs(y), np.array([3, 3]), np.array([0, 1]))
    close(inside.s, s)
    close(inside.zl, zl)


def test_a_warm_barrier_takes_multipliers_along_and_stays_inside() -> None:
    bounds = Bounds(np.zeros(3), np.ones(3), np.ones(3))
    barrier = Barrier.central(bounds, np.full(3, 0.5), 1e-9)
    solved = dataclasses.replace(barrier, zu=np.array([5.0, 0.0, 0.0]), zl=np.zeros(3))
    warm = solved.warm(bounds, np.array([1.2, 0.5, -0.1]), 1e-6)
    assert ((warm.s > 0) & (warm.s < 1)).all()
    assert warm.zu[0] == 5.0
    assert warm.mu == 1e-6
    assert (warm.zl > 0).all()
    assert (warm.zu > 0).all()


def test_some_outputs_of_a_barrier_keep_all_that_is_theirs() -> None:
    barrier, _ = random_barrier(3)
    chosen = np.array([2, 0, 2, 5])
    some = barrier.of(chosen)
    for name in ("s", "zl", "zu"):
        np.testing.assert_array_equal(getattr(some, name), getattr(barrier, name)[chosen])
    for name in ("lower", "upper", "weights"):
        ours, theirs = (getattr(x.bounds, name) for x in (some, barrier))
        np.testing.assert_array_equal(ours, theirs[chosen])
    assert (some.mu, some.scale) == (barrier.mu, barrier.scale)
    assert some.bounds.measure == barrier.bounds.measure
    assert (barrier.of(np.array([-1])).multipliers == 0.0).all()


@pytest.mark.parametrize("mu", [1e-4, 1e-8, 1e-12])
def test_a_step_leaves_a_gap_of_which_rounding_errors_are_a_small_share(mu: float) -> None:
    """However small mu: a gap of 1e-7 that shrank by mu would vanish beside its slack."""
    bounds = Bounds(np.array([0.0]), np.array([1.0]), np.ones(1))
    y = np.array([1e-7])
    barrier = Barrier(bounds, y, np.array([mu / 1e-7]), np.array([mu]), mu, 1.0)
    along = barrier.aim(y, np.array([-1.0]), barrier.central_targets())
    moved = barrier.moved(y + along.primal * along.dy, along, 1.0, 0.0)
    assert moved.s[0] >= 0.9e-4 * y[0]


def differences(barrier: Barrier, y: Array, zl: Array, zu: Array, c: Array) -> Pair:
    """z - c gap of both bounds at outputs y; minus infinity where there is none."""
    bounds = barrier.bounds
    low = np.where(bounds.has_lower, zl - c * (y - np.maximum(bounds.lower, -1e9)), -INF)
    high = np.where(bounds.has_upper, zu - c * (np.minimum(bounds.upper, 1e9) - y), -INF)
    return low, high


def check_central(moved: Barrier, mu: float, wanted: Pair, c: Array) -> None:
    """Every product is mu, and the bound that matters more keeps z - c gap, up to the middle."""
    bounds, (below, above) = moved.bounds, gaps(moved)
    has = bounds.has_lower, bounds.has_upper
    for z, gap, sides in zip((moved.zl, moved.zu), (below, above), has, strict=True):
        np.testing.assert_allclose(z[sides] * gap[sides], mu, rtol=1e-9)
    assert (moved.zl[~bounds.has_lower] == 0.0).all()
    assert (moved.zu[~bounds.has_upper] == 0.0).all()
    kept = differences(moved, moved.s, moved.zl, moved.zu, c)
    lower = wanted[0] >= wanted[1]
    kept, wanted = np.where(lower, *kept), np.where(lower, *wanted)
    free = np.isfinite(wanted)
    both = np.flatnonzero(has[0] & has[1])
    free[both] &= np.abs(below[both] - above[both]) > 1e-12
    assert free.sum() >= 5
    np.testing.assert_allclose(kept[free], wanted[free], rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_recentered_barrier_is_central_and_keeps_what_holds_bounds(seed: int) -> None:
    barrier, _ = random_barrier(seed)
    c = np.full_like(barrier.s, 0.7)
    moved = barrier.recentered(0.7, 1e-3)
    check_central(moved, 1e-3, differences(barrier, barrier.s, barrier.zl, barrier.zu, c), c)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_followed_barrier_is_central_with_the_multipliers_of_the_step(seed: int) -> None:
    start, y = random_barrier(seed)
    barrier, random = start.recentered(0.7, MU), np.random.default_rng([seed, 3])
    dy, more = 0.1 * random.normal(size=(2, len(y)))
    y_new, mu = y + dy + 0.1 * more, 0.1 * MU
    moved, outside, work = barrier.followed(y, dy, y_new, mu, 0.7)
    below, above = gaps(barrier)
    ds = y + dy - barrier.s
    has = barrier.bounds.has_lower, barrier.bounds.has_upper
    zl = np.where(has[0], (MU - barrier.zl * ds) / np.where(has[0], below, 1.0), 0.0)
    zu = np.where(has[1], (MU + barrier.zu * ds) / np.where(has[1], above, 1.0), 0.0)
    ratio = barrier.zl / below + barrier.zu / above
    c = np.sqrt(np.maximum(ratio, 0.7) * 0.7)
    check_central(moved, mu, differences(barrier, y_new, zl, zu, c), c)
    bounds, w = barrier.bounds, barrier.bounds.weights
    assert outside == np.maximum(bounds.lower - y_new, y_new - bounds.upper).max()
    release = np.maximum(-zl, 0.0) + np.maximum(-zu, 0.0)
    miss = np.abs(moved.multipliers) * np.abs(y_new - moved.s)
    np.testing.assert_allclose(work, w @ (miss + 0.01 * release), rtol=1e-9)


def test_bounds_are_found_and_released_in_one_step() -> None:
    """An output that crosses its bound is held, one whose multiplier becomes negative is let go."""
    bounds = Bounds(np.zeros(2), np.full(2, INF), np.ones(2))
    start = Barrier(bounds, np.array([0.1, 1e-8]), np.zeros(2), np.ones(2), 1e-8, 1.0)
    barrier = dataclasses.replace(start, zl=1e-8 / start.s, zu=np.zeros(2))
    y, dy = barrier.s, np.array([-0.3, 5e-8])
    moved, outside, work = barrier.followed(y, dy, y + dy, 1e-8, 1.0)
    assert outside == pytest.approx(0.2)
    assert work >= 0.01 * 4.0  # the multiplier 1 becomes -4
    assert moved.zl[0] > 0.1
    assert moved.zl[1] < 1e-3
