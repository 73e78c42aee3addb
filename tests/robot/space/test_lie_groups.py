"""The Lie groups of joints: against Pinocchio's integrate and difference, and group axioms."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from hovi.robot.space.groups import GROUPS, SE2, Group
from samples.group_models import model_of

SIZES = [1e-12, 1e-9, 1e-4, 0.3, 0.99, 1.01, 1.7]


def samples(group: Group, count: int, seed: int = 0) -> np.ndarray:
    random = np.random.default_rng(seed)
    return group.normalized(random.normal(size=(count, group.nq)))


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("group", GROUPS.values(), ids=GROUPS)
def test_integrate_matches_pinocchio(group: Group, size: float) -> None:
    model, g = model_of(group), samples(group, 100)
    d = size * np.random.default_rng(1).uniform(-1, 1, (100, group.nv))
    expected = [pin.integrate(model, x, y) for x, y in zip(g, d, strict=True)]
    # Pinocchio's own SE(2) loses digits to 1 - cos at small angles
    tolerance = 1e-12 if group is SE2 else 1e-14
    np.testing.assert_allclose(group.integrate(g, d), expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize("group", GROUPS.values(), ids=GROUPS)
def test_difference_matches_pinocchio(group: Group) -> None:
    model = model_of(group)
    g0, g1 = samples(group, 200, 2), samples(group, 200, 3)
    expected = np.array([pin.difference(model, x, y) for x, y in zip(g0, g1, strict=True)])
    angle = np.linalg.norm(expected[:, list(group.angular)], axis=1)
    usual = angle < 3.1  # towards pi Pinocchio loses digits
    assert usual.sum() > 150
    np.testing.assert_allclose(group.difference(g0, g1)[usual], expected[usual], atol=2e-13)


@pytest.mark.parametrize("size", [*SIZES, 1.8])
@pytest.mark.parametrize("group", GROUPS.values(), ids=GROUPS)
def test_difference_undoes_integrate(group: Group, size: float) -> None:
    g = samples(group, 100)
    d = size * np.random.default_rng(1).uniform(-1, 1, (100, group.nv))
    found = group.difference(g, group.integrate(g, d))
    np.testing.assert_allclose(found, d, rtol=0, atol=1e-14 * (1 + 100 * size))


@pytest.mark.parametrize("group", GROUPS.values(), ids=GROUPS)
def test_steps_along_one_direction_add_up(group: Group) -> None:
    g = samples(group, 50)
    d = np.random.default_rng(1).normal(size=(50, group.nv))
    twice = group.integrate(group.integrate(g, 0.3 * d), 0.7 * d)
    np.testing.assert_allclose(twice, group.integrate(g, d), atol=1e-14)


def test_a_quaternion_and_its_negative_are_the_same_rotation() -> None:
    group = GROUPS["SO(3)"]
    g0, g1 = samples(group, 50, 2), samples(group, 50, 3)
    np.testing.assert_allclose(group.difference(g0, -g1), group.difference(g0, g1), atol=1e-15)


@pytest.mark.parametrize("size", [1.0 - 1e-12, 1.0 + 1e-12])
@pytest.mark.parametrize("group", GROUPS.values(), ids=GROUPS)
def test_series_and_closed_forms_agree(group: Group, size: float) -> None:
    g, d = samples(group, 50), np.random.default_rng(1).normal(size=(50, group.nv))
    turn = list(group.angular)
    d[:, turn] *= size / np.linalg.norm(d[:, turn], axis=1, keepdims=True)
    moved, model = group.integrate(g, d), model_of(group)
    expected = [pin.integrate(model, x, y) for x, y in zip(g, d, strict=True)]
    np.testing.assert_allclose(moved, expected, rtol=0, atol=4e-15)
    np.testing.assert_allclose(group.difference(g, moved), d, rtol=0, atol=2e-14)


@pytest.mark.parametrize("turns", [-2, -1, 0, 1, 3])
@pytest.mark.parametrize("group", GROUPS.values(), ids=GROUPS)
def test_full_turns_are_closest_to_the_expected_difference(group: Group, turns: int) -> None:
    g, d = samples(group, 50), np.random.default_rng(1).normal(size=(50, group.nv))
    turn = list(group.angular)
    size = np.linalg.norm(d[:, turn], axis=1, keepdims=True)
    d[:, turn] *= (1.5 + 2 * np.pi * turns) / size
    found = group.difference_near(g, group.integrate(g, d), 1.01 * d)
    np.testing.assert_allclose(found, d, rtol=0, atol=1e-12)
    still = group.difference_near(g, g, 2 * np.pi * d / np.linalg.norm(d[:, turn], axis=1)[:, None])
    np.testing.assert_allclose(np.linalg.norm(still[:, turn], axis=1), 2 * np.pi, rtol=1e-14)
