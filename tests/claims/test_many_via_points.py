"""Via points get as many intervals as they need, wherever they are, unless a grid is given."""

from __future__ import annotations

import numpy as np
import pytest

import hovi
from hovi.errors import InputError


def through(times: np.ndarray, **options: object) -> hovi.Solution:
    """The motion of the two-link arm through points on a curve at some times, in [s]."""
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    via = [hovi.Via(float(t), curve(t)) for t in times]
    return hovi.plan(scene, curve(0.0), curve(4.0), 4.0, via=via, **options)  # type: ignore[arg-type]


def curve(t: float) -> np.ndarray:
    return np.array([-1.2 + 0.3 * t, 0.4 * np.sin(2.0 * t)])


@pytest.mark.parametrize(
    "times",
    [
        np.linspace(0.0, 4.0, 18)[1:-1],
        np.linspace(0.0, 4.0, 42)[1:-1],
        np.linspace(0.1, 0.9, 20),
        np.array([3.7, 3.8, 3.9]),
    ],
    ids=["16", "40", "20 in the first quarter", "3 near the end"],
)
def test_every_point_is_passed(times: np.ndarray) -> None:
    solution = through(times)
    assert solution.success, solution.message
    passed = solution.trajectory.sample(times).q
    assert np.abs(passed - [curve(t) for t in times]).max() < 1e-9


def test_a_given_grid_that_has_too_few_intervals_is_refused() -> None:
    with pytest.raises(InputError, match=r"16 times between .* need 17 intervals or more"):
        through(np.linspace(0.0, 4.0, 18)[1:-1], intervals=16)
