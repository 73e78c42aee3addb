"""A study of effects tries every candidate within limits, and goes on where one of them fails."""

from __future__ import annotations

import json

import hovi
from hovi.accuracy.effect_study.study import study_effects
from hovi.accuracy.effect_study.tables import study_json
from hovi.effects import Armature, Gravity, JerkCost, MovingBase, ViscousFriction

LIMITS = {"base": "none", "v": 3.0, "tau": 60.0}
CANDIDATES = (
    ViscousFriction(0.1),
    MovingBase((0.0, 0.0, "0.01*sin(4*pi*t)")),
    Armature(0.01),
)


def task(duration: float, smooth: bool = False) -> hovi.Task:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [Gravity()])
    options = hovi.PlanOptions(intervals=8, limits=LIMITS, self_collision=False, smooth=smooth)
    ends = hovi.State([0, 0]), hovi.State([0.3, 0.7])
    return hovi.Task(scene, *ends, duration, options, "a reach")


def test_every_candidate_is_tried_within_limits() -> None:
    study = study_effects(task(1.0), CANDIDATES)
    assert [trial.effect for trial in study.trials if trial.success] == list(CANDIDATES)
    assert (study.untried, study.failed) == ((), ())


def test_a_candidate_that_fails_is_named_and_the_others_are_kept() -> None:
    """A smooth motion chooses a cost on the jerk, and takes no other one."""
    candidates = CANDIDATES[0], JerkCost(0.1), CANDIDATES[2]
    study = study_effects(task(1.0, smooth=True), candidates)
    assert [trial.effect for trial in study.trials] == [candidates[0], candidates[2]]
    assert study.untried == ()
    (failed,) = study.failed
    assert failed.effect == candidates[1]
    assert "cost on the jerk" in failed.reason
    assert json.loads(study_json(study))["failed"] == [
        {"effect": "jerk_cost", "reason": failed.reason}
    ]
