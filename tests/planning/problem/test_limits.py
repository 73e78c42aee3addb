"""Limits from names, mappings and the URDF; bad input is refused in one sentence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hovi.errors import InputError
from hovi.planning.problem.limits import Limits, as_limits, no_limits
from hovi.robot.robot import Robot


def test_a_name_selects_the_limits_of_the_urdf_or_none(ur5: Robot) -> None:
    urdf = as_limits(ur5, "urdf")
    np.testing.assert_array_equal(urdf.upper[1], ur5.velocity_limit)
    np.testing.assert_array_equal(urdf.upper[3], ur5.effort_limit)
    assert not as_limits(ur5, "none").bounded.any()


def test_a_number_bounds_both_sides_and_a_name_one_joint(two_link: Robot) -> None:
    limits = as_limits(two_link, {"base": "none", "v": 2.0, "q": {"elbow": [0.0, 3.0]}})
    np.testing.assert_array_equal(limits.lower[1], [-2, -2])
    np.testing.assert_array_equal(limits.upper[0], [np.inf, 3])


def test_a_margin_narrows_by_a_share_of_the_range(two_link: Robot) -> None:
    limits = as_limits(two_link, {"base": "none", "v": 2.0, "margin": 0.1})
    np.testing.assert_allclose(limits.upper[1], 1.6, rtol=1e-15)


def test_limits_survive_their_dictionary(ur5: Robot) -> None:
    limits = as_limits(ur5, "urdf")
    again = Limits.from_dict(limits.to_dict())
    np.testing.assert_array_equal(again.lower, limits.lower)
    np.testing.assert_array_equal(again.upper, limits.upper)


@pytest.mark.parametrize(
    "bad",
    [
        "urfd",
        {"base": "urfd"},
        {"velocity": 1.0},
        {"v": 0.0},
        {"v": -1.0},
        {"v": "fast"},
        {"v": float("nan")},
        {"v": [1.0, 2.0, 3.0]},
        {"v": {"elbo": 1.0}},
        {"q": {"elbow": [1.0, 1.0]}},
        {"tau": {"elbow": [1.0, 2.0, 3.0]}},
        {"margin": 0.5},
        {"margin": -0.1},
        {"margin": "wide"},
        {"tolerance": 0.0},
        {"tolerance": "small"},
        {"base": 3},
        {"base": ["urdf"]},
        {"v": None},
        {"tau": 1e-308},
        {"q": [[1e300, 1e308], [0.0, 1.0]]},
        3,
    ],
)
def test_bad_limits_are_refused_in_one_sentence(two_link: Robot, bad: Any) -> None:
    with pytest.raises(InputError) as caught:
        as_limits(two_link, bad)
    assert str(caught.value).count("\n") == 0


def test_huge_bounds_count_as_none(two_link: Robot) -> None:
    limits = as_limits(two_link, {"base": "none", "q": {"elbow": [0.0, 1e308]}, "tau": 1e200})
    assert np.isinf(limits.upper).all()
    assert list(limits.lower[0]) == [-np.inf, 0.0]
    assert np.isinf(limits.lower[3]).all()


def test_empty_ranges_are_refused(two_link: Robot) -> None:
    free = no_limits(two_link)
    with pytest.raises(InputError, match="range of joint coordinate 0 is empty"):
        Limits(np.zeros((4, 2)), np.zeros((4, 2)))
    with pytest.raises(InputError, match="not a number"):
        Limits(np.full((4, 2), np.nan), free.upper)
