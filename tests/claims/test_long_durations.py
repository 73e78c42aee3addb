"""Durations of minutes to hours under gravity end in a motion, or at once in a sentence."""

from __future__ import annotations

import numpy as np
import pytest

import hovi

ENDS = [0.3, -1.1, 0.9, 0.4, -0.5, 0.2], [-0.5, -0.8, 1.2, -0.4, 0.3, 0.8]
SAID = r"the period of ([\d.]+) s in which the robot swings"


def ur5(*effects: hovi.effects.Effect) -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), effects)


@pytest.mark.parametrize("T", [1e3, 1e4])
@pytest.mark.parametrize("limits", ["none", "urdf", {"base": "none", "v": 1.0}])
@pytest.mark.filterwarnings("ignore:the duration of")
def test_an_arm_that_would_swing_is_refused_before_a_solve(T: float, limits: object) -> None:
    found = hovi.plan(ur5(hovi.effects.Gravity()), *ENDS, T, limits=limits, self_collision=False)
    assert (found.status, found.success, found.nit) == ("unresolved", False, 0)
    assert "no motion was sought" in found.message
    assert "plan a motion of seconds and rest" in found.message


@pytest.mark.filterwarnings("ignore:the duration of")
def test_the_period_is_that_of_a_small_swing(tmp_path) -> None:  # type: ignore[no-untyped-def]
    """Of a rod of 2 kg, 0.5 m below its joint, about which its inertia is 0.6 kg m^2."""
    path = tmp_path / "pendulum.urdf"
    path.write_text(
        '<robot name="p"><link name="base"/><link name="rod"><inertial><origin xyz="0 0 -0.5"/>'
        '<mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>'
        '</inertial></link><joint name="j" type="revolute"><parent link="base"/>'
        '<child link="rod"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="9" '
        'effort="99"/></joint></robot>'
    )
    scene = hovi.Scene(hovi.load_robot(path), [hovi.effects.Gravity(9.81)])
    found = hovi.plan(scene, [0.4], [0.9], 3e3, limits="none")
    period = 2 * np.pi * np.sqrt(0.6 / (2 * 9.81 * 0.5))
    assert f"the period of {period:.2g} s" in found.message
    assert hovi.plan(scene, [0.4], [0.9], 2.0, limits="none").success


@pytest.mark.parametrize("T", [1e2, 1e3, 1e4])
@pytest.mark.filterwarnings("ignore:the duration of")
def test_motions_without_swings_are_found(T: float) -> None:
    """Without gravity, along the base alone, and up from where a robot rests upright."""
    assert hovi.plan(ur5(), *ENDS, T, self_collision=False, limits="urdf").success
    upright = hovi.Scene(hovi.load_robot("double_pendulum"), [hovi.effects.Gravity()])
    assert hovi.plan(upright, [0.3, -0.2], [-0.4, 0.5], T, limits="none").success
