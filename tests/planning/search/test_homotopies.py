"""The easier problems of a continuation, against Pinocchio: what they change, and nothing else."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.robot.robot import Robot
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.scene import Scene
from samples.paper_arm import HANG, REACH_Q, REACH_V

POINTS = np.random.default_rng(0).normal(size=(3, 5, 2))
HURRIED: dict[str, Any] = {"max_iterations": 1, "scheme": "taylor-midpoint", "intervals": 50}
"""Too few steps for any of the problems."""


def stages(scene: Scene, limits: Any = "none", **options: Any) -> dict[str, list[str]]:
    """What each way of continuation reports: the words of its stages, by its name."""
    said: dict[str, list[str]] = {}

    def report(text: str, fraction: float) -> None:
        if text.startswith("continuation in "):
            name, what = text.removeprefix("continuation in ").split(": ")
            said.setdefault(name, []).append(what)

    ends = HANG, hovi.State(REACH_Q, REACH_V)
    hovi.plan(scene, *ends, 1.0, limits=limits, progress=report, **(HURRIED | options))
    return said


def test_without_limits_every_way_is_tried_in_order(arm_scene: Scene) -> None:
    said, itself = stages(arm_scene, max_iterations=2), "the task itself"
    assert list(said) == ["inertia", "the intervals", "gravity", "the duration", "steps"]
    assert said["the intervals"] == ["7 intervals", "13 intervals", "25 intervals", itself]
    assert said["gravity"] == [*(f"{share} % of gravity" for share in (0, 25, 50, 75)), itself]


def test_rotors_fall_from_more_than_every_link_to_less_than_any(arm_scene: Scene) -> None:
    M = pin.crba(arm_scene.model, arm_scene.model.createData(), HANG)
    M = np.triu(M) + np.triu(M, 1).T
    said = stages(arm_scene, max_iterations=2)["inertia"]
    assert said[-1] == "the task itself"
    sizes = [float(each.split()[2]) for each in said[:-1]]
    assert sizes[0] == pytest.approx(10 * M.diagonal().max(), rel=0.05)
    least = np.linalg.eigvalsh(M)[0]
    assert 0.1 * least < sizes[-1] <= least
    np.testing.assert_allclose(np.divide(sizes[:-1], sizes[1:]), 10.0, rtol=0.05)


def test_gravity_and_finer_grids_are_no_way_where_there_are_none(arm_scene: Scene) -> None:
    said = stages(Scene(arm_scene.robot), scheme="galerkin-2", intervals=8)
    assert "gravity" not in said
    assert "the intervals" not in said
    assert "the duration" in said


def test_durations_are_shorter_without_limits_and_longer_with_them(arm_scene: Scene) -> None:
    shorter = stages(Scene(arm_scene.robot), max_iterations=2)["the duration"]
    assert shorter[:3] == [f"a duration of {T} s" for T in ("0.125", "0.25", "0.5")]
    longer = stages(arm_scene, {"base": "none", "v": 5.0, "tau": 20.0})["the duration"]
    assert longer[0] == "a duration of 2 s"


@pytest.mark.parametrize("share", [0.125, 0.25, 0.5])
def test_another_duration_without_gravity_is_the_same_motion(
    arm_scene: Scene, share: float
) -> None:
    """tau scales like 1/T^2, hence the cost like 1/T^3: which is why shorter ones help."""
    grid = {"limits": "none", "scheme": "galerkin-2", "intervals": 8}
    whole, other = (
        hovi.plan(Scene(arm_scene.robot), HANG, REACH_Q, T, **grid) for T in (1.0, share)
    )
    assert other.cost == pytest.approx(whole.cost / share**3, rel=1e-9)
    np.testing.assert_allclose(other.trajectory.q, whole.trajectory.q, atol=1e-7)


def test_limits_come_first_where_there_are_any_and_narrow(arm_scene: Scene) -> None:
    said = stages(arm_scene, {"base": "none", "v": 9.0, "tau": 90.0}, max_iterations=2)
    assert next(iter(said)) == "the limits"
    wide = [f"limits {share} times as wide" for share in ("8", "4", "2", "1.5", "1.25", "1.1")]
    assert said["the limits"] == [*wide, "the task itself"]


def test_easier_scenes_have_the_torques_of_rotors_and_weaker_gravity(
    two_link: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is evaluated while a stage is reported: pin.rnea with its armature and its gravity."""
    scene = Scene(two_link, [hovi.effects.Gravity(9.8)])
    output, seen, stage = EffortLagrangian.output, dict[str, Scene](), ""

    def watched(self: EffortLagrangian, *jet: Any, **more: Any) -> Any:
        seen[stage] = self.scene
        return output(self, *jet, **more)

    def report(text: str, fraction: float) -> None:
        nonlocal stage
        stage = text

    monkeypatch.setattr(EffortLagrangian, "output", watched)
    few = {"max_iterations": 2, "limits": "none", "intervals": 8, "scheme": "galerkin-2"}
    hovi.plan(scene, HANG, -HANG, 3.0, progress=report, **few)
    checked = 0
    for text, used in seen.items():
        model = two_link.model.copy()
        model.gravity.linear = np.array([0.0, 0.0, -9.8])
        if "rotors of" in text:
            rotor = used.model.armature
            assert np.ptp(rotor) == 0
            assert rotor[0] == pytest.approx(float(text.split()[5]), rel=0.05)
            model.armature = rotor
        if "% of gravity" in text:
            model.gravity.linear *= float(text.split()[3]) / 100
        expected = [
            pin.rnea(model, model.createData(), *point) for point in zip(*POINTS, strict=True)
        ]
        np.testing.assert_allclose(used.inverse_dynamics(*POINTS), expected, rtol=0, atol=1e-12)
        checked += "rotors of" in text or "% of gravity" in text
    assert checked >= 5
