"""What the file of a motion says against executing it."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

import hovi
from hovi.discrete.output.caution import CAUTIONS, Caution, cautions_of, with_cautions
from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviWarning

START, GOAL = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1], [0.8, -1.0, 1.0, -0.3, 0.1, 0.4]


@pytest.fixture(scope="module")
def scene() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])


@pytest.fixture(scope="module")
def infeasible(scene: hovi.Scene) -> Trajectory:
    solution = hovi.plan(scene, START, GOAL, 0.05)
    assert solution.status == "infeasible"
    return solution.trajectory


@pytest.fixture(scope="module")
def found(scene: hovi.Scene) -> Trajectory:
    solution = hovi.plan(scene, START, GOAL, 1.0, self_collision=True)
    assert solution.success
    return solution.trajectory


def against(metadata: Mapping[str, Any]) -> str:
    return " ".join(each.sentence for each in cautions_of(metadata) if each.is_against)


def test_an_infeasible_motion_says_what_it_violates(infeasible: Trajectory) -> None:
    said = against(infeasible.metadata)
    assert "status 'infeasible'" in said
    assert "velocity limit of 3.15 rad/s" in said


def test_an_export_and_a_page_of_it_warn(infeasible: Trajectory, tmp_path: Path) -> None:
    infeasible.save(tmp_path / "motion.npz")
    loaded = Trajectory.load(tmp_path / "motion.npz")
    with pytest.warns(HoviWarning, match="violates its ends, limits or distances"):
        hovi.export(loaded, tmp_path / "motion.yaml")
    with pytest.warns(HoviWarning, match="violates its ends, limits or distances"):
        hovi.replay(loaded, html=tmp_path / "motion.html")
    assert "violates its ends, limits or distances" in (tmp_path / "motion.html").read_text()


def test_nothing_is_said_of_a_minimum(found: Trajectory, tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hovi.export(found, tmp_path / "motion.csv")
    assert against(found.metadata) == ""


def test_links_that_enter_each_other_are_told() -> None:
    arm = hovi.load_robot("panda", locked=["panda_finger_joint1", "panda_finger_joint2"])
    folded = [0.0, 1.7, 0.0, -3.05, 0.0, 0.5, 0.0]
    solution = hovi.plan(hovi.Scene(arm), "default", folded, 2.0, self_collision=False)
    assert solution.success
    assert "into each other" in against(solution.trajectory.metadata)


def test_a_motion_without_a_minimum_may_violate_its_limits(scene: hovi.Scene) -> None:
    solution = hovi.plan(scene, START, GOAL, 1.0, max_iterations=1)
    assert solution.status == "iteration_limit"
    assert "may violate its limits: " in against(solution.trajectory.metadata)


def test_a_file_of_another_origin_is_read_with_care(found: Trajectory) -> None:
    long = [["\x1b[2J", 10_000 * "a"], "ab", ["a"], ["a", 7], [1, "b"], None] + 100 * [["a", "b"]]
    other = {**found.metadata, CAUTIONS: long}
    cautions = cautions_of(dataclasses.replace(found, metadata=other).metadata)
    assert all(str(each).isprintable() for each in cautions)
    assert sum(len(str(each)) for each in cautions) < 1000
    assert [each.word for each in cautions[:2]] == ["[2J", "a"]
    assert cautions_of({CAUTIONS: "no list"}) == cautions_of({CAUTIONS: 7}) == ()


def test_the_text_of_an_earlier_version_is_read() -> None:
    entered = cautions_of({"status": "minimum", "caution": "Links meet."})
    assert entered == (Caution("collision", "Links meet."),)
    late = against({"status": "time_limit", "caution": "it was late."})
    assert late.endswith("may violate its limits: it was late.")


def test_cautions_are_added_once_and_those_against_the_motion_come_first() -> None:
    some = [Caution("coarse", "The grid is coarse."), Caution("collision", "Links meet.")]
    data = with_cautions(with_cautions({"cost": 1.0}, some), some)
    assert cautions_of(data) == (some[1], some[0])
    assert data["cost"] == 1.0
    assert with_cautions({"cost": 1.0}, []) == {"cost": 1.0}
