"""A study of effects tries every candidate within limits, and goes on where one of them fails."""

from __future__ import annotations

import json

import hovi
from hovi.accuracy.effect_study.study import study_effects
from hovi.accuracy.effect_study.tables import study_json
from hovi.effects import Armature, Gravity, MovingBase, ViscousFriction

LIMITS = {"base": "none", "v": 3.0, "tau": 60.0}
CANDIDATES = (
    ViscousFriction(0.1),
    MovingBase((0.0, 0.0, "0.01*sin(4*pi*t)")),
    Armature(0.01),
)


def task(duration: float | tuple[float, float]) -> hovi.Task:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [Gravity()])
    options = hovi.PlanOptions(intervals=8, limits=LIMITS, self_collision=False)
    ends = hovi.State([0, 0]), hovi.State([0.3, 0.7])
    return hovi.Task(scene, *ends, duration, options, "a reach")


def test_every_candidate_is_tried_within_limits() -> None:
    study = study_effects(task(1.0), CANDIDATES)
    assert [trial.effect for trial in study.trials if trial.success] == list(CANDIDATES)
    assert (study.untried, study.failed) == ((), ())


def test_a_candidate_that_fails_is_named_and_the_others_are_kept() -> None:
    """A scene that depends on time has no free duration."""
    study = study_effects(task((0.8, 1.5)), CANDIDATES)
    assert [trial.effect for trial in study.trials] == [CANDIDATES[0], CANDIDATES[2]]
    assert study.untried == ()
    (failed,) = study.failed
    assert failed.effect == CANDIDATES[1]
    assert "depends on time" in failed.reason
    assert json.loads(study_json(study))["failed"] == [
        {"effect": "moving_base", "reason": failed.reason}
    ]
