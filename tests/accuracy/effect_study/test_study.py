"""The study of effects: trials, tables, candidates and the command."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

from hovi import PlanOptions, plan
from hovi.accuracy.effect_study.candidates import effect_candidates
from hovi.accuracy.effect_study.study import EffectStudy, study_effects
from hovi.accuracy.effect_study.tables import (
    COLUMNS,
    study_figure,
    study_json,
    study_note,
    study_rows,
)
from hovi.cli.application import main
from hovi.discrete.state import State
from hovi.effects import Armature, Drag, Gravity, Payload, VelocityCost, ViscousFriction, Wrench
from hovi.errors import InputError, SceneError
from hovi.flows.execution.tracking import play
from hovi.planning.task_file.task import Task
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from samples.manifold_robots import with_arm

CANDIDATES = (ViscousFriction(0.3), Armature(0.0), VelocityCost(2.0), Gravity())


@pytest.fixture(scope="module")
def task(two_link: Robot) -> Task:
    scene = Scene(two_link, [Gravity(9.8)])
    ends = State([-0.5, 0.2]), State([-0.2, 0.4])
    return Task(scene, *ends, 0.4, PlanOptions(intervals=8, limits="none"), "a reach")


@pytest.fixture(scope="module")
def study(task: Task) -> EffectStudy:
    return study_effects(task, CANDIDATES)


def test_a_trial_plans_and_plays_the_scene_with_one_more_effect(
    study: EffectStudy, task: Task, two_link: Robot
) -> None:
    trial = study.trials[0]
    scene = Scene(two_link, [Gravity(9.8), ViscousFriction(0.3)])
    alone = plan(scene, task.start, task.goal, 0.4, intervals=8, limits="none")
    assert (trial.name, trial.added, trial.success) == ("+ viscous_friction", True, True)
    assert trial.cost == pytest.approx(alone.cost, rel=1e-8)
    own = study.solution.trajectory
    assert trial.open_loop == play(scene, own).tip_deviation[-1]
    assert trial.held is not None
    assert trial.open_loop > trial.held > 0
    speed = np.abs(own.sample(np.linspace(0, 0.4, 2001)).v).max()
    assert trial.torque == pytest.approx(0.3 * speed, rel=1e-2)
    grown = scene.graph().n_instructions() - task.scene.graph().n_instructions()
    assert trial.instructions == grown > 0


def test_an_effect_of_the_scene_is_removed(study: EffectStudy, task: Task) -> None:
    trial = study.trials[3]
    bare = plan(
        task.scene.without("gravity"), task.start, task.goal, 0.4, intervals=8, self_collision=False
    )
    assert (trial.name, trial.added, trial.effect) == ("- gravity", False, Gravity(9.8))
    assert trial.cost == pytest.approx(bare.cost, rel=1e-6)
    assert study.change(trial) < 0
    assert trial.instructions < 0


def test_an_effect_of_zero_strength_changes_nothing(study: EffectStudy) -> None:
    trial = study.trials[1]
    assert trial.torque == 0
    assert abs(study.change(trial)) < 1e-9
    assert trial.tip is not None
    assert trial.tip < 1e-6


def test_the_noise_of_the_tip_is_shown(two_link: Robot) -> None:
    """Of a push too weak to move it, planned on other grids than the scene's own motion."""
    scene = Scene(two_link, [Gravity(9.8)])
    options = PlanOptions(limits="none", self_collision=False)
    loose = Task(scene, [-1.5, 0.2], [1.5, 0.4], 1.0, options)
    study = study_effects(loose, [Wrench("tip", (0.0, 1e-12, 0.0))])
    (trial,) = study.trials
    assert trial.tip is not None
    assert trial.tip_noise is not None
    assert 0 < trial.tip <= 1.1 * trial.tip_noise
    assert json.loads(study_json(study))["trials"][0]["tip_noise"] == trial.tip_noise
    shown = dict(zip(COLUMNS, study_rows(study)[1], strict=True))["tip [mm]"]
    value, noise = map(float, shown.split(" ± "))
    assert value == pytest.approx(1e3 * trial.tip, rel=1e-2)
    assert 1e3 * trial.tip_noise <= noise <= 2e3 * trial.tip_noise
    unknown = dataclasses.replace(study, trials=(dataclasses.replace(trial, tip_noise=None),))
    assert "± ?" in study_rows(unknown)[1][4]


def test_a_cost_term_changes_the_plan_but_not_the_simulation(study: EffectStudy) -> None:
    trial = study.trials[2]
    assert (trial.torque, trial.open_loop, trial.held) == (0.0, 0.0, 0.0)
    assert study.change(trial) > 0
    assert trial.tip is not None
    assert trial.tip > 1e-3


def test_every_trial_is_timed(study: EffectStudy) -> None:
    assert study.seconds > 0
    assert all(trial.seconds > 0 and trial.plan_seconds > 0 for trial in study.trials)


def test_the_table_has_a_row_for_the_scene_and_for_every_trial(study: EffectStudy) -> None:
    rows = study_rows(study)
    assert [row[0] for row in rows] == ["(unchanged)", *(trial.name for trial in study.trials)]
    assert {len(row) for row in rows} == {len(COLUMNS)}
    fields = json.loads(study_json(study))
    assert fields["cost"] == study.solution.cost
    assert [trial["cost"] for trial in fields["trials"]] == [t.cost for t in study.trials]


def test_the_figure_has_a_bar_for_every_trial(study: EffectStudy) -> None:
    for panel in study_figure(study).axes:
        assert len(panel.patches) == len(study.trials)
        lowest, highest = panel.get_xlim()
        for bar in panel.patches:
            assert lowest <= bar.get_width() <= highest  # type: ignore[attr-defined]


def test_a_trial_without_a_minimum_shows_no_cost(study: EffectStudy) -> None:
    found, *others = study.trials
    failed = dataclasses.replace(found, success=False, tip=None)
    study = dataclasses.replace(study, trials=(failed, *others))
    row = dict(zip(COLUMNS, study_rows(study)[1], strict=True))
    assert (row["cost"], row["change"], row["tip [mm]"]) == ("no minimum", "-", "-")
    assert json.loads(study_json(study))["trials"][0]["cost_change"] is None
    panel = study_figure(study).axes[1]
    assert [text.get_text() for text in panel.texts].count("no minimum") == 1
    widths = [bar.get_width() for bar in panel.patches]  # type: ignore[attr-defined]
    assert widths[-1] == panel.get_xlim()[0] < min(widths[:-1])


def test_an_interrupted_study_keeps_its_trials(study: EffectStudy, task: Task) -> None:
    def interrupt(text: str, share: float) -> None:
        if "velocity_cost" in text:
            raise KeyboardInterrupt

    part = study_effects(task, CANDIDATES, interrupt)
    assert [trial.name for trial in part.trials] == [trial.name for trial in study.trials[:2]]
    assert part.untried == CANDIDATES[2:]
    assert json.loads(study_json(part))["untried"] == ["velocity_cost", "gravity"]


def test_an_unactuated_floating_base_gets_no_constant_force() -> None:
    robot = load_robot(with_arm("free-flyer"))
    keys = {e.key for e in effect_candidates(robot)}
    arm = {e.key for e in effect_candidates(robot, robot.joint_names[1:])}
    unactuated_base = {e.key for e in effect_candidates(robot, robot.joint_names[:1])}
    assert keys == arm == unactuated_base | {"gravity", "wrench"}


@pytest.mark.filterwarnings("ignore:the payload of 100000 kg looks like grams")
def test_a_diverging_simulation_has_no_tip_deviation(task: Task) -> None:
    heavy = study_effects(task, [Payload(task.scene.robot.tip_frame, 1e5)]).trials[0]
    assert heavy.open_loop is None or math.isfinite(heavy.open_loop)


def test_an_infeasible_task_raises(task: Task, two_link: Robot) -> None:
    scene = Scene(two_link, [Gravity(9.8)])
    limits = {"base": "none", "v": 0.1}
    stuck = Task(scene, task.start, task.goal, 0.4, PlanOptions(limits=limits), "stuck")
    with pytest.raises(SceneError, match="the effects of 'stuck' cannot be compared"):
        study_effects(stuck, CANDIDATES)


def test_candidates_act_where_something_moves(two_arms: Robot, task: Task) -> None:
    at_frames = Payload | Wrench | Drag
    frames = {e.frame for e in effect_candidates(two_arms) if isinstance(e, at_frames)}
    assert frames == {"left_gripper"}
    for fixed in (Wrench("base", (1.0, 0.0, 0.0)), Drag("base", 0.1)):
        with pytest.raises(InputError, match=r"'base' .* is fixed to the world.*'tip'"):
            study_effects(task, [fixed])


def test_a_study_names_the_frames_of_its_lengths(study: EffectStudy) -> None:
    assert "the tip is tip;" in study_note(study)
    assert json.loads(study_json(study))["tip_frames"] == ["tip"]
    labels = [panel.get_xlabel() for panel in study_figure(study).axes]
    assert "deviation of tip at the end, held [mm]" in labels


@pytest.mark.parametrize("name", ["two_link", "ur5", "panda", "pendulum"])
def test_candidates_suit_their_robot(request: pytest.FixtureRequest, name: str) -> None:
    robot: Robot = request.getfixturevalue(name)
    candidates = effect_candidates(robot)
    assert len({effect.key for effect in candidates}) == len(candidates) >= 5
    scene = Scene(robot, candidates)
    assert np.isfinite(scene.inverse_dynamics(*np.zeros((3, 1, robot.nv)))).all()


def test_candidates_use_the_parameters_of_the_model(two_link: Robot) -> None:
    model = two_link.model.copy()
    model.damping, model.friction = np.array([0.1, 0.2]), np.array([0.3, 0.4])
    model.armature = np.array([0.5, 0.6])
    by_key = {effect.key: effect for effect in effect_candidates(load_robot(model))}
    assert all(by_key[key].from_urdf for key in ("viscous_friction", "dry_friction", "armature"))


def test_a_floating_base_gets_no_moving_base() -> None:
    keys = [effect.key for effect in effect_candidates(load_robot("solo8", free_flyer=True))]
    assert "moving_base" not in keys


@pytest.mark.parametrize(
    ("base", "floating"), [("free-flyer", 6), ("spherical", 3), ("planar", 3), ("continuous", 0)]
)
def test_a_floating_base_gets_no_joint_friction(base: str, floating: int) -> None:
    by_key = {e.key: e for e in effect_candidates(load_robot(with_arm(base)))}
    assert ("moving_base" in by_key) == (floating == 0)
    for effect in (by_key["viscous_friction"], by_key["dry_friction"], by_key["armature"]):
        (numbers,) = [x for x in vars(effect).values() if isinstance(x, tuple)]
        assert numbers[:floating] == (0.0,) * floating
        assert min(numbers[floating:]) > 0.0


def test_continuous_joints_give_the_study_of_revolute_joints(
    study: EffectStudy, task: Task, models: Path, tmp_path: Path
) -> None:
    path = tmp_path / "turning.urdf"
    text = (models / "two_link.urdf").read_text()
    path.write_text(text.replace('type="revolute"', 'type="continuous"'))
    robot = load_robot(path)
    assert robot.nq == 2 * robot.nv
    ends = (
        State(robot.integrate(robot.neutral(), np.asarray(end.q)))
        for end in (task.start, task.goal)
    )
    turning = Task(
        Scene(robot, [Gravity(9.8)]), *ends, 0.4, PlanOptions(intervals=8, limits="none")
    )
    for ours, theirs in zip(study_effects(turning, CANDIDATES).trials, study.trials, strict=True):
        for key in ("torque", "cost", "tip", "open_loop", "held"):
            assert getattr(ours, key) == pytest.approx(getattr(theirs, key), rel=1e-6, abs=1e-9)


# The command

SCENE = """robot = "two_link.urdf"
duration = 0.2
limits = "none"
[start]
q = [-0.5, 0.2]
[goal]
q = [-0.4, 0.2]
[scheme]
intervals = 8
[effects.gravity]
"""


def test_the_command_prints_a_table_and_writes_a_figure(
    models: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene, rich = tmp_path / "reach.toml", tmp_path / "rich.toml"
    text = SCENE.replace("two_link.urdf", str(models / "two_link.urdf"))
    scene.write_text(text)
    rich.write_text(text + "[effects.viscous_friction]\ncoefficient = 0.1\n")
    picture = tmp_path / "effects.png"
    assert main(["effects", str(scene), "--with", str(rich), "--out", str(picture)]) == 0
    printed = capsys.readouterr().out
    assert "- gravity" in printed
    assert "+ viscous_friction: 0.1 N m s/rad" in printed
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["effects", str(scene), "--with", str(rich), "--json"]) == 0
    fields = json.loads(capsys.readouterr().out)
    assert [trial["effect"] for trial in fields["trials"]] == ["gravity", "viscous_friction"]
    assert main(["effects", str(scene), "--out", "effects.txt"]) == 2
    assert main(["effects", str(scene), "--time-limit", "0"]) == 2
    assert main(["effects", str(tmp_path / "no.toml")]) == 2
