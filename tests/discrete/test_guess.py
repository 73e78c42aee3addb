"""Initial guesses: curves that meet their ends, with consistent derivatives."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.discrete.grid import Grid
from hovi.discrete.guess import (
    NAMED,
    Curve,
    check_path,
    cubic,
    minimum_jerk,
    named_curve,
    regularized,
    stretched,
    with_bump,
)
from hovi.discrete.path_on_grid import moved, path_on_grid
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import by_name, galerkin
from oracles.finite_differences import derivative
from samples.manifold_robots import chain

Array = npt.NDArray[np.float64]

T = 1.7
ENDS = np.array([[-1.5, 0.2], [0.4, 2.0]]), np.array([[0.3, -0.8], [-1.1, 0.6]])


@pytest.fixture(params=["cubic", "minimum-jerk", "cubic with a bump", "quintic with a bump"])
def curve(request: pytest.FixtureRequest, two_link: Robot) -> Curve:
    base = cubic if "cubic" in request.param else minimum_jerk
    curve = base(two_link, ENDS, T)
    return with_bump(curve, two_link, T, seed=5) if "bump" in request.param else curve


def trajectory(curve: Curve, grid: Grid, scene: Scene) -> Trajectory:
    path = path_on_grid(curve, grid, ENDS, scene.robot)
    return Trajectory(grid, path, np.zeros((grid.intervals + 1, 2, 2)), scene)


# Curves


def test_a_curve_meets_both_ends(curve: Curve) -> None:
    q, v, _ = curve(np.array([0.0, T]))
    np.testing.assert_allclose(q, ENDS[0], rtol=0, atol=1e-14)
    np.testing.assert_allclose(v, ENDS[1], rtol=0, atol=1e-13)


def test_v_and_a_are_derivatives_of_q(curve: Curve) -> None:
    for t in np.linspace(0.1, T - 0.1, 7):
        point = np.array([t])
        _, v, a = curve(point)
        for order, expected in ((0, v), (1, a)):
            slope = derivative(lambda x, order=order: curve(x)[order][0], point)[:, 0]
            np.testing.assert_allclose(slope, expected[0], rtol=1e-8, atol=1e-8)


def test_a_curve_is_the_same_at_any_batch_of_times(curve: Curve) -> None:
    t = np.linspace(0.0, T, 5)
    for whole, alone in zip(curve(t), curve(t[2:3]), strict=True):
        assert whole.shape == (5, 2)
        np.testing.assert_allclose(whole[2:3], alone, rtol=1e-14)


def test_the_jerk_of_the_cubic_is_constant(two_link: Robot) -> None:
    a = cubic(two_link, ENDS, T)(np.linspace(0.0, T, 9))[2]
    np.testing.assert_allclose(np.diff(a, n=2, axis=0), 0.0, atol=1e-12)


def test_the_quintic_starts_and_ends_without_acceleration(two_link: Robot) -> None:
    t = np.linspace(0.0, T, 7)
    a = minimum_jerk(two_link, ENDS, T)(t)[2]
    np.testing.assert_allclose(a[[0, -1]], 0.0, atol=1e-13)
    differences = np.diff(a, n=4, axis=0)  # of a cubic
    np.testing.assert_allclose(differences, 0.0, atol=1e-11)


def test_a_bump_vanishes_with_its_rate_at_both_ends(two_link: Robot) -> None:
    base = cubic(two_link, ENDS, T)
    t = np.linspace(0.0, T, 101)
    sizes = []
    for seed in range(20):
        bumped = with_bump(base, two_link, T, seed)
        for order in (0, 1):
            change = bumped(t)[order] - base(t)[order]
            np.testing.assert_allclose(change[[0, -1]], 0.0, atol=1e-12)
        sizes.append(np.abs(bumped(t)[0] - base(t)[0]).max())
    assert min(sizes) > 0.05
    assert 1.0 < max(sizes) < 12.0


def test_bumps_are_reproducible_and_differ_by_seed(two_link: Robot) -> None:
    base, t = cubic(two_link, ENDS, T), np.linspace(0.0, T, 11)
    q = [with_bump(base, two_link, T, seed)(t)[0] for seed in (1, 1, 2)]
    np.testing.assert_array_equal(q[0], q[1])
    assert np.abs(q[0] - q[2]).max() > 1e-3


@pytest.mark.parametrize("name", NAMED)
def test_a_named_curve_is_its_function(two_link: Robot, name: str) -> None:
    t = np.linspace(0.0, T, 5)
    pairs = zip(
        named_curve(name, two_link, ENDS, T)(t), NAMED[name](two_link, ENDS, T)(t), strict=True
    )
    for one, other in pairs:
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("name", "hint"), [("cubik", "did you mean 'cubic'"), ("spiral", "valid names are 'cubic'")]
)
def test_an_unknown_guess_is_refused_with_the_nearest_name(
    two_link: Robot, name: str, hint: str
) -> None:
    with pytest.raises(InputError, match=f"there is no guess '{name}'.*{hint}"):
        named_curve(name, two_link, ENDS, T)


# On a grid


@pytest.mark.parametrize("names", [["galerkin-2"] * 6, ["galerkin-3", "hermite-simpson"] * 3])
def test_a_path_has_the_nodes_of_the_curve_and_the_exact_boundary(
    curve: Curve, two_link: Robot, names: list[str]
) -> None:
    grid = Grid(T * np.array([1, 2, 3, 4, 5, 6]) / 21, tuple(by_name(name) for name in names))
    path = path_on_grid(curve, grid, ENDS, two_link)
    q, v, _ = curve(grid.t)
    np.testing.assert_array_equal(path.q[1:-1], q[1:-1])
    np.testing.assert_array_equal(path.v[1:-1], v[1:-1])
    for found, ends in zip((path.q, path.v), ENDS, strict=True):
        np.testing.assert_array_equal(found[[0, -1]], ends)
    np.testing.assert_array_equal(path.z, regularized(two_link, grid, path.q, path.v))
    for k, scheme in enumerate(grid.schemes):
        assert not path.inner[k, scheme.inner_modes :].any()


def test_z_matches_the_definition_in_the_paper(two_link: Robot) -> None:
    grid = Grid(np.array([0.5, 0.1]), (by_name("galerkin-0"),) * 2)
    q, v = np.random.default_rng(0).normal(size=(2, 3, 2))
    z = regularized(two_link, grid, q, v)
    for k, h in enumerate(grid.steps):
        np.testing.assert_allclose(z[k, 0], (q[k + 1] - q[k] - h * v[k]) / h**2, rtol=1e-14)
        np.testing.assert_allclose(z[k, 1], (v[k + 1] - v[k]) / h, rtol=1e-14)


@pytest.mark.parametrize("name", ["galerkin-0", "hermite-simpson", "galerkin-2"])
def test_a_cubic_is_exact_between_the_nodes_of_any_scheme(arm_scene: Scene, name: str) -> None:
    curve = cubic(arm_scene.robot, ENDS, T)
    sample = trajectory(curve, Grid.uniform(T, 4, by_name(name)), arm_scene).sample
    t = np.linspace(0.0, T, 61)
    for found, expected in zip(sample(t)[:3], curve(t), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_a_quintic_is_exact_between_the_nodes_with_two_inner_modes(arm_scene: Scene) -> None:
    curve = minimum_jerk(arm_scene.robot, ENDS, T)
    steps = T * np.array([1, 2, 3, 4]) / 10
    names = ["galerkin-2", "galerkin-4", "galerkin-3", "galerkin-2"]
    grid = Grid(steps, tuple(by_name(name) for name in names))
    sample = trajectory(curve, grid, arm_scene).sample
    t = np.linspace(0.0, T, 61)
    for found, expected in zip(sample(t)[:3], curve(t), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("r", [0, 1, 2, 3])
def test_the_acceleration_between_the_nodes_has_the_order_of_its_polynomial(
    arm_scene: Scene, r: int
) -> None:
    curve = with_bump(cubic(arm_scene.robot, ENDS, T), arm_scene.robot, T, seed=1)
    t, errors, Ns = np.linspace(0.0, T, 1001), [], np.array([40, 60, 80, 120])
    for N in Ns:
        sample = trajectory(curve, Grid.uniform(T, N, by_name(f"galerkin-{r}")), arm_scene).sample
        errors.append(np.abs(sample(t).a - curve(t)[2]).max())
    order = -np.polyfit(np.log(Ns), np.log(errors), 1)[0]
    assert order == pytest.approx(r + 2, abs=0.3)


# Motions as guesses


def test_a_stretched_motion_follows_the_same_path(arm_scene: Scene, curve: Curve) -> None:
    motion = trajectory(curve, Grid.uniform(T, 8, by_name("galerkin-3")), arm_scene)
    slow = stretched(motion, 3 * T)
    t = np.linspace(0.0, T, 31)
    q, v, a, _ = motion.sample(t)
    found = slow(3 * t)
    np.testing.assert_allclose(found[0], q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found[1], v / 3, rtol=0, atol=1e-11)
    np.testing.assert_allclose(found[2][:-1], a[:-1] / 9, rtol=0, atol=1e-9)


def test_a_motion_on_its_own_grid_is_reproduced(arm_scene: Scene, curve: Curve) -> None:
    grid = Grid.uniform(T, 8, by_name("galerkin-3"))
    motion = trajectory(curve, grid, arm_scene)
    again = path_on_grid(stretched(motion, T), grid, ENDS, arm_scene.robot)
    np.testing.assert_array_equal(again.q, motion.path.q)
    np.testing.assert_allclose(again.v, motion.path.v, rtol=0, atol=1e-13)
    np.testing.assert_allclose(again.z, motion.path.z, rtol=0, atol=1e-11)
    np.testing.assert_allclose(again.inner, motion.path.inner, rtol=0, atol=1e-11)


# Paths between other ends

OTHER_ENDS = [
    x + 0.1 * np.array([[i + 1], [i + 3]]) * np.array([1.0, -2.0]) for i, x in enumerate(ENDS)
]
UNEQUAL = Grid(T * np.array([1, 2, 3, 4]) / 10, (by_name("galerkin-2"),) * 4)


def test_a_moved_path_is_the_path_plus_a_cubic(arm_scene: Scene, curve: Curve) -> None:
    robot = arm_scene.robot
    path = path_on_grid(curve, UNEQUAL, ENDS, robot)
    found = moved(path, UNEQUAL, OTHER_ENDS, robot)
    shift = [b - a for a, b in zip(ENDS, OTHER_ENDS, strict=True)]
    dq, dv, _ = cubic(robot, shift, T)(UNEQUAL.t)
    np.testing.assert_allclose(found.q, path.q + dq, rtol=0, atol=1e-13)
    np.testing.assert_allclose(found.v, path.v + dv, rtol=0, atol=1e-13)
    np.testing.assert_array_equal(found.inner, path.inner)
    z = regularized(robot, UNEQUAL, found.q, found.v)
    np.testing.assert_allclose(found.z, z, rtol=0, atol=1e-11)
    for ends, x in zip(OTHER_ENDS, (found.q, found.v), strict=True):
        np.testing.assert_array_equal(x[[0, -1]], ends)


def test_a_path_with_the_same_boundary_is_bitwise_unchanged(two_link: Robot, curve: Curve) -> None:
    path = path_on_grid(curve, UNEQUAL, ENDS, two_link)
    found = moved(path, UNEQUAL, ENDS, two_link)
    for name in ("q", "v", "z", "inner"):
        np.testing.assert_array_equal(getattr(found, name), getattr(path, name))


def test_an_inconsistent_path_is_refused(two_link: Robot, curve: Curve) -> None:
    path = path_on_grid(curve, UNEQUAL, ENDS, two_link)
    check_path(path, UNEQUAL, two_link)
    bad = [
        (dataclasses.replace(path, q=path.q[:-1]), r"guess's q must be .* shape \(5, 2\)"),
        (dataclasses.replace(path, v=path.v * np.inf), "guess's v must be finite"),
        (dataclasses.replace(path, inner=path.inner[:, :1]), "guess's inner must be"),
        (dataclasses.replace(path, z=-path.z), "guess's z does not match its q and v"),
    ]
    for other, sentence in bad:
        with np.errstate(invalid="ignore"), pytest.raises(InputError, match=sentence):
            check_path(other, UNEQUAL, two_link)


@pytest.mark.parametrize("power", [1, 3, 6])
@pytest.mark.parametrize("turns", [0.3, 3.2, -5.7])
def test_all_turns_within_an_interval_count_whenever_they_happen(power: int, turns: float) -> None:
    """A continuous joint turns by 2 pi turns s^power in one interval: z keeps the full angle."""
    robot = load_robot(chain([pin.JointModelRUBY()]))
    T, size = 2.0, 2 * np.pi * turns

    def curve(t: Array) -> tuple[Array, Array, Array]:
        s = t[:, None] / T
        angle, v = size * s**power, size * power * s ** (power - 1) / T
        a = size * power * (power - 1) * s ** max(power - 2, 0) / T**2
        return np.concatenate([np.cos(angle), np.sin(angle)], axis=1), v, a

    ends = curve(np.array([0.0, T]))[:2]
    path = path_on_grid(curve, Grid.uniform(T, 1, galerkin(4)), ends, robot)
    v0, v1 = ends[1]
    assert T**2 * path.z[0, 0] + T * v0 == pytest.approx(size, rel=1e-12)
    assert T * path.z[0, 1] == pytest.approx(v1 - v0, rel=1e-12)
