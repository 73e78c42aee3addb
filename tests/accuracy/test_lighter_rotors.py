"""Rotors that become lighter, against Pinocchio: what they change, and nothing else."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.accuracy.lighter_rotors import lighter_rotors
from hovi.discrete.grid import Grid
from hovi.planning.search.job import Job
from hovi.planning.search.options import PlanOptions
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from samples.paper_arm import HANG, REACH_Q

POINTS = np.random.default_rng(0).normal(size=(3, 5, 2))


def job(scene: Scene) -> Job:
    grid, options = Grid.uniform(1.0, 8, galerkin(2)), PlanOptions(limits="none").on(scene)
    return Job(scene, grid, hovi.State(HANG), hovi.State(REACH_Q), options)


def test_rotors_fall_from_more_than_every_link_to_less_than_any(arm_scene: Scene) -> None:
    M = pin.crba(arm_scene.model, arm_scene.model.createData(), HANG)
    M = np.triu(M) + np.triu(M, 1).T
    sizes = [float(each.scene.model.armature[0]) for each in lighter_rotors(job(arm_scene))]
    assert sizes[0] == pytest.approx(10 * M.diagonal().max(), rel=0.05)
    least = np.linalg.eigvalsh(M)[0]
    assert 0.1 * least < sizes[-1] <= least
    np.testing.assert_allclose(np.divide(sizes[:-1], sizes[1:]), 10.0, rtol=0.05)


def test_easier_scenes_have_the_torques_of_rotors(arm_scene: Scene) -> None:
    easier = lighter_rotors(job(arm_scene))
    assert len(easier) >= 3
    for each in easier:
        used = each.scene
        rotor = used.model.armature - arm_scene.model.armature
        assert np.ptp(rotor) == pytest.approx(0.0, abs=1e-15)
        assert rotor[0] > 0.0
        model = arm_scene.model.copy()
        model.armature = model.armature + rotor
        data = model.createData()
        expected = [pin.rnea(model, data, *point) for point in zip(*POINTS, strict=True)]
        np.testing.assert_allclose(used.inverse_dynamics(*POINTS), expected, rtol=0, atol=1e-12)
