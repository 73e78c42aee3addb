"""Motions without limits that keep links apart are found; those that do anyway stay as they are."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import pytest

import hovi
from hovi.system.interruption import record_interrupt
from oracles.mesh_distances import MeshDistances

START = [0.0, -1.2, 1.0, -0.6, -0.8, 0.2]
THROUGH_ITSELF = [0.9, -0.9, 1.3, -0.9, -0.5, 0.6]
"""Ends of a UR5 between which its links enter each other."""
APART = [0.0, -1.2, 0.3, -0.5, 0.3, 0.1], [0.8, -0.9, 0.1, -0.2, 0.6, 0.3]
"""Ends between which they stay apart."""


@pytest.fixture(scope="module")
def scene(ur5: hovi.Robot) -> hovi.Scene:
    return hovi.Scene(ur5, [hovi.effects.Gravity()])


def test_a_motion_without_limits_that_would_pass_through_itself_is_found(scene: hovi.Scene) -> None:
    given = {"limits": "none", "max_iterations": 200, "continuation": False}
    kept = hovi.plan(scene, START, THROUGH_ITSELF, 1.5, self_collision=True, **given)
    assert kept.success, kept.message
    free = hovi.plan(scene, START, THROUGH_ITSELF, 1.5, self_collision=False, **given)
    assert free.success, free.message
    meshes, t = MeshDistances(scene.robot), np.linspace(0.0, 1.5, 400)
    assert meshes.least(free.trajectory.sample(t).q) == 0.0
    assert meshes.least(kept.trajectory.sample(t).q) >= 0.01 - 1e-6
    assert kept.cost > free.cost


@pytest.mark.parametrize("limits", ["none", "urdf"])
def test_self_collision_that_changes_nothing_leaves_every_digit(
    scene: hovi.Scene, limits: str
) -> None:
    kept, free = (
        hovi.plan(scene, *APART, 1.5, limits=limits, self_collision=given)
        for given in (True, False)
    )
    assert kept.success, kept.message
    np.testing.assert_array_equal(kept.trajectory.q, free.trajectory.q)
    assert (kept.cost, kept.nit) == (free.cost, free.nit)
    assert kept.trajectory.metadata["clearance"]["self_collision"] is True
    assert kept.margins().distance is not None
    again = kept.replan(goal=np.add(APART[1], 0.01))
    assert again.success, again.message
    assert again.margins().distance is not None


def test_an_interrupt_before_links_were_looked_at_is_no_success(
    scene: hovi.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It comes when the motion that may pass through itself is a resolved minimum already."""
    search = importlib.import_module("hovi.planning.search.search").Search
    looked = search._of_whole

    def interrupted(*given: Any) -> Any:
        record_interrupt()
        return looked(*given)

    monkeypatch.setattr(search, "_of_whole", interrupted)
    ends = START, THROUGH_ITSELF
    given: dict[str, Any] = {"limits": "none", "self_collision": True, "processes": 1}
    found = hovi.plan(scene, *ends, 1.5, **given)
    assert (found.success, found.status) == (False, "interrupted")
    assert "keeps links apart" in found.message
