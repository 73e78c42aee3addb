"""Directions of vectors whose squares no double holds."""

from __future__ import annotations

import numpy as np
import pytest

import hovi
from hovi.checks.directions import unit_vector
from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene

SIZES = [5e-324, 1e-300, 1e-160, 1e-9, 1.0, 3e7, 1e155, 1e200, 1e308]
ALONG = np.array([1.0, -1.0, 0.0])


def test_an_ordinary_vector_is_divided_by_its_length() -> None:
    for x in np.random.default_rng(0).normal(size=(200, 4)):
        np.testing.assert_array_equal(unit_vector(x), x / np.linalg.norm(x))


@pytest.mark.parametrize("size", SIZES)
def test_a_vector_of_any_length_has_a_direction(size: float) -> None:
    np.testing.assert_allclose(unit_vector(size * ALONG), ALONG / np.sqrt(2), rtol=1e-15)


@pytest.mark.parametrize("size", SIZES)
def test_gravity_takes_a_direction_of_any_length(size: float, two_link: Robot) -> None:
    along = size * np.array([1.0, 0.0, -1.0])
    pulled = Scene(two_link, [hovi.effects.Gravity(9.8, tuple(along.tolist()))])
    wanted = 9.8 * np.sqrt(0.5) * np.array([1.0, 0.0, -1.0])
    np.testing.assert_allclose(pulled.model.gravity.linear, wanted, rtol=1e-15)


@pytest.mark.parametrize("size", [1e-3, *SIZES[4:]])
def test_the_axis_of_a_goal_may_have_any_length(size: float) -> None:
    goal = hovi.FrameGoal("tip", axis=(size * ALONG, [0.0, 0.0, size]))
    assert goal.axis is not None
    np.testing.assert_allclose(goal.axis, [ALONG / np.sqrt(2), [0, 0, 1]], atol=1e-15)


@pytest.mark.parametrize("size", [1e155, 1e200, 1e308])
def test_orientations_far_from_unit_length_are_refused(size: float) -> None:
    with pytest.raises(InputError, match="quaternion_xyzw of a frame goal must have length 1"):
        hovi.FrameGoal("tip", quaternion_xyzw=[0.5, -size, size, 0.0])
    for matrix in (np.full((3, 3), size), np.diag([1.0, 1.0, -size])):
        with pytest.raises(InputError, match="must be an orthonormal"):
            hovi.FrameGoal("tip", rotation=matrix)
