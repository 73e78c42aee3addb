"""Limits from names, mappings and the URDF; bad input is refused in one sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hovi import plan
from hovi.cli.application import main
from hovi.errors import HoviWarning, InputError
from hovi.planning.problem.limits import Limits, as_limits, no_limits
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from samples.manifold_robots import with_arm
from samples.slider import SLIDER


def test_a_name_selects_the_limits_of_the_urdf_or_none(ur5: Robot) -> None:
    urdf = as_limits(ur5, "urdf")
    np.testing.assert_array_equal(urdf.upper[1], ur5.velocity_limit)
    np.testing.assert_array_equal(urdf.upper[3], ur5.effort_limit)
    assert not as_limits(ur5, "none").bounded.any()


def test_a_number_bounds_both_sides_and_a_name_one_joint(two_link: Robot) -> None:
    limits = as_limits(two_link, {"base": "none", "v": 2.0, "q": {"elbow": [0.0, 3.0]}})
    np.testing.assert_array_equal(limits.lower[1], [-2, -2])
    np.testing.assert_array_equal(limits.upper[0], [np.inf, 3])


@pytest.mark.parametrize("q", [0.5, [0.5] * 9])
def test_position_limits_of_all_joints_bound_those_whose_position_is_a_number(q: Any) -> None:
    robot = load_robot(with_arm("free-flyer"))  # then revolute, continuous and prismatic joints
    limits = as_limits(robot, {"q": q})
    assert limits is not None
    expected = np.where(np.isin(np.arange(9), [6, 8]), 0.5, np.inf)
    np.testing.assert_array_equal(limits.upper[0], expected)
    np.testing.assert_array_equal(limits.lower[0], -expected)


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


@pytest.mark.parametrize(
    ("q", "words"),
    [
        (
            {"elbow": [-170, 170]},
            "elbow, -170 to 170 rad, looks like degrees: .* -2.967 to",
        ),
        ({"elbow": 170.0}, "range of elbow, -170 to 170 rad"),
        (180.0, "range of shoulder and of 1 more, -180 to 180 rad"),
        ({"elbow": [0.0, 45.0]}, "range of elbow, 0 to 45 rad, .* 0 to 0.7854 rad"),
    ],
)
def test_ranges_that_look_like_degrees_cause_a_warning(two_link: Robot, q: Any, words: str) -> None:
    with pytest.warns(HoviWarning, match=words) as caught:
        limits = as_limits(two_link, {"base": "none", "q": q})
    assert str(caught[0].message).endswith("; limits are in radians.")
    assert limits.bounded[0].any()


@pytest.mark.parametrize(
    "limits",
    [
        *({"base": "none", "q": {"elbow": x}} for x in (2.9, 6.3, 25.0, 1000.0, 1e6)),
        *({"base": "none", kind: 170.0} for kind in ("v", "a", "tau")),
    ],
    ids=str,
)
def test_other_ranges_cause_no_warning(two_link: Robot, limits: Any) -> None:
    as_limits(two_link, limits)


def test_a_rail_may_be_long(tmp_path: Path) -> None:
    (tmp_path / "slider.urdf").write_text(SLIDER)
    as_limits(load_robot(tmp_path / "slider.urdf"), {"base": "none", "q": {"rail": [-170, 170]}})


def test_plan_and_description_warn_of_degrees_in_a_urdf(models: Path, tmp_path) -> None:
    text = (models / "two_link.urdf").read_text()
    path = tmp_path / "degrees.urdf"
    path.write_text(text.replace('lower="-1000" upper="1000"', 'lower="-170" upper="170"'))
    robot = load_robot(path)
    note = "the position range of shoulder and of 1 more, -170 to 170 rad, looks like degrees"
    assert note in robot.describe()
    assert note not in load_robot(models / "two_link.urdf").describe()
    with pytest.warns(HoviWarning, match=note):
        plan(Scene(robot), [0.0, 0.0], [0.1, 0.1], 1.0, intervals=4)


def test_the_command_prints_the_warning_in_one_line(models: Path, tmp_path: Path, capsys) -> None:
    scene = (models / "two_link_reach.toml").read_text().replace('limits = "none"', "")
    path = tmp_path / "scene.toml"
    path.write_text(scene + '\n[limits]\nbase = "none"\nq = { elbow = [-170, 170] }\n')
    (tmp_path / "two_link.urdf").write_text((models / "two_link.urdf").read_text())
    assert main(["plan", str(path), "--starts", "3"]) == 0
    lines = capsys.readouterr().err.splitlines()
    caught = [line for line in lines if line.startswith("warning: ")]
    assert len(caught) == 1
    assert caught[0].startswith("warning: the position range of elbow, -170 to 170 rad, looks like")


@pytest.mark.parametrize("value", [np.complex128(0.1), np.timedelta64(0, "s"), True, "0.1", None])
@pytest.mark.parametrize("key", ["tolerance", "margin"])
def test_a_tolerance_or_a_margin_that_is_no_number_is_refused(
    two_link: Robot, key: str, value: Any
) -> None:
    with pytest.raises(InputError, match=f"limits.{key} must be a number"):
        as_limits(two_link, {key: value})


@pytest.mark.parametrize("value", [np.complex128(2.0), np.timedelta64(2, "s"), None])
@pytest.mark.parametrize("kind", ["q", "v", "tau"])
def test_a_bound_that_is_no_number_is_refused(two_link: Robot, kind: str, value: Any) -> None:
    for given in (value, [value, 1.0], {"elbow": value}, {"elbow": [0.0, value]}):
        with pytest.raises(InputError, match=f"limits.{kind}"):
            as_limits(two_link, {kind: given})
