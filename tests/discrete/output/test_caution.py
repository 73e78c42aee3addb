"""What the file of a motion says against executing it."""

from __future__ import annotations

import dataclasses
import warnings
from pathlib import Path

import pytest

import hovi
from hovi.discrete.output.caution import CAUTION, caution_of
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


def test_an_infeasible_motion_says_what_it_violates(infeasible: Trajectory) -> None:
    said = caution_of(infeasible.metadata)
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
    assert caution_of(found.metadata) == ""


def test_links_that_enter_each_other_are_told() -> None:
    arm = hovi.load_robot("panda", locked=["panda_finger_joint1", "panda_finger_joint2"])
    folded = [0.0, 1.7, 0.0, -3.05, 0.0, 0.5, 0.0]
    solution = hovi.plan(hovi.Scene(arm), "default", folded, 2.0)
    assert solution.success
    assert "into each other" in caution_of(solution.trajectory.metadata)


def test_a_motion_without_a_minimum_may_violate_its_limits(scene: hovi.Scene) -> None:
    solution = hovi.plan(scene, START, GOAL, 1.0, max_iterations=1)
    assert solution.status == "iteration_limit"
    assert "may violate its limits: " in caution_of(solution.trajectory.metadata)


def test_a_file_of_another_origin_is_read_with_care(found: Trajectory) -> None:
    other = {**found.metadata, CAUTION: "\x1b[2J" + 10_000 * "a"}
    said = caution_of(dataclasses.replace(found, metadata=other).metadata)
    assert said.isprintable()
    assert len(said) < 1000
    assert caution_of({**found.metadata, CAUTION: 7}) == ""
