"""What a plan returns is pickled and copied whole, after everything that it computes was asked for.

A table of kinds of problems and ways to copy: the 22 features of motions, and what motions keep.
"""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from functools import cache
from typing import Any

import cloudpickle
import numpy as np
import pytest

import hovi
from samples.asked_features import FEATURES, AskedFeatures, planned_with
from samples.small_robots import arm

pytestmark = pytest.mark.filterwarnings("ignore::hovi.errors.HoviWarning")
WAYS: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda whole: pickle.loads(pickle.dumps(whole)),
    "cloudpickle": lambda whole: cloudpickle.loads(cloudpickle.dumps(whole)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "twice": lambda whole: pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(whole)))),
}
MORE: dict[str, Callable[[], dict[str, Any]]] = {
    "bounded formula": lambda: {
        "conditions": [hovi.Condition("tau * v", hovi.Between(-80, 80), name="power")]
    },
    "bounded function": lambda: {
        "conditions": [hovi.Condition(lambda v: 2 * v, hovi.Between(-9, 9), name="twice")]
    },
    "value at a time": lambda: {
        "conditions": [
            hovi.Condition('q["j1"]', hovi.Equal(0.2), hovi.AtTimes(0.5), name="halfway")
        ]
    },
    "kept speed": lambda: {"keep": [{"kind": "tool_speed", "frame": "l3", "linear": 2.0}]},
    "jerk": lambda: {"objective": "jerk"},
}


def asked_more(name: str) -> hovi.Solution:
    robot = arm("three", ("revolute",) * 3)
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    options = {"limits": "none", "self_collision": False} | MORE[name]()
    return hovi.plan(scene, [0.0] * 3, [0.4, -0.3, 0.5], 1.0, **options)


@cache
def planned(kind: str) -> hovi.Solution:
    """With all that a solution caches."""
    found = asked_more(kind) if kind in MORE else planned_with(AskedFeatures.of(kind))
    assert found.success, (kind, found.message)
    uses(found)
    return found


def uses(found: hovi.Solution) -> list[Any]:
    """What people ask a solution for, as numbers."""
    motion, extremes = found.trajectory, hovi.extremes(found.trajectory)
    at = motion.sample(np.linspace(0.0, motion.duration, 7))
    known: list[Any] = [at.q, at.v, at.a, at.tau, found.cost, found.effort, str(extremes)]
    known += [str(found.status), found.message, str(found.margins()), str(found.violation)]
    for name in ("duration_derivative", "factor"):
        try:
            value = getattr(found, name)
            known.append(value if name == "duration_derivative" else value.negative_eigenvalues)
        except hovi.HoviError as refused:
            known.append(str(refused))
    return known


@pytest.mark.parametrize("kind", [*FEATURES, *MORE])
@pytest.mark.parametrize("way", WAYS)
def test_a_copy_is_the_same_and_is_planned_again(way: str, kind: str) -> None:
    found = planned(kind)
    copied = WAYS[way](found)
    for one, other in zip(uses(copied), uses(found), strict=True):
        np.testing.assert_array_equal(one, other)
    again = copied.replan()
    assert again.success, again.message
    assert again.cost == pytest.approx(found.cost, rel=1e-4)


def test_a_copy_of_the_motion_of_a_process_is_no_shared_one() -> None:
    """A deep copy does not change with the motion that it was made from."""
    found = planned("limits")
    copied = copy.deepcopy(found)
    assert copied.trajectory.q is not found.trajectory.q
    assert copied.problem is not found.problem
