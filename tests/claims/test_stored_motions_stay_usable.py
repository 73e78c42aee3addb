"""Files of motions that an earlier version wrote load, sample, replan, export and play as they did.

What they hold is known as plain numbers: see tests/data/write_motions.py, which wrote both.
"""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from data.write_motions import MOTIONS, STEPS
from oracles.offline_pages import messages_of

DATA = Path(__file__).resolve().parents[1] / "data"
NUMBERS: dict[str, dict[str, Any]] = json.loads((DATA / "samples.json").read_text())
ONE_SCENE = ("free", "limited", "smooth", "group", "meshes")
"""Motions of a scene; the sequence has three, and that of a Pinocchio model has lost its own."""
CARRY = 0.5
"""Mass that the arm of the sequence carries in its second segment, in [kg]."""


@pytest.fixture(scope="module", params=NUMBERS)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def loaded(name: str) -> hovi.Trajectory:
    return hovi.Trajectory.load(DATA / f"{name}.npz")


def known(name: str) -> dict[str, np.ndarray]:
    """The numbers of a motion: t, q, v, a and tau at equal steps, nodes, momenta and the cost."""
    return {key: np.array(each) for key, each in NUMBERS[name].items()}


def assert_same(found: np.ndarray, expected: np.ndarray, share: float = 1e-9) -> None:
    """Equal up to a fraction of the largest number."""
    np.testing.assert_allclose(found, expected, rtol=0, atol=share * np.abs(expected).max())


def test_every_file_of_the_folder_is_tested() -> None:
    assert {each.stem for each in DATA.glob("*.npz")} == {*MOTIONS, "meshes"} == set(NUMBERS)


def test_samples_are_those_that_were_written(name: str) -> None:
    motion, numbers = loaded(name), known(name)
    sample = motion.sample(numbers["t"])
    for key in ("q", "v", "a", "tau"):
        assert_same(getattr(sample, key), numbers[key])
    assert_same(motion.t, numbers["nodes"], 1e-15)
    assert_same(motion.momenta, numbers["momenta"])
    assert motion.metadata["status"] == "minimum"
    assert motion.metadata["cost"] == pytest.approx(numbers["cost"], rel=1e-15)


def test_velocities_and_accelerations_are_derivatives_of_positions(name: str) -> None:
    """By differences of the loaded motion's own samples, on the tangent space of a group."""
    motion, numbers = loaded(name), known(name)
    dt, at = 1e-5, numbers["t"][1:-1] + 1e-3
    before, here, after = (motion.sample(at + dt * i) for i in (-1, 0, 1))
    space = motion.robot or motion.space
    there = after.q - before.q if space is None else space.difference(before.q, after.q)
    assert_same(there / (2 * dt), here.v, 1e-6)
    assert_same((after.v - before.v) / (2 * dt), here.a, 1e-5)


def models(name: str) -> list[pin.Model]:
    """Pinocchio's models of the equal steps of time, in which the load is carried for a while."""
    robot = loaded(name).robot
    assert robot is not None
    model = robot.model.copy()
    model.gravity.linear = np.array([0.0, 0.0, -9.8 if name == "sequence" else -9.81])
    if name != "sequence":
        return [model] * (STEPS + 1)
    loaded_model, tip = model.copy(), model.frames[model.getFrameId("tip")]
    mass = pin.Inertia(CARRY, np.zeros(3), np.zeros((3, 3)))
    loaded_model.appendBodyToJoint(tip.parentJoint, mass, tip.placement)
    return [loaded_model if 0.6 <= t < 1.5 else model for t in known(name)["t"]]


@pytest.mark.parametrize("name", [*ONE_SCENE, "sequence"])
def test_torques_are_those_of_rnea(name: str) -> None:
    sample = loaded(name).sample(known(name)["t"])
    jets = zip(models(name), sample.q, sample.v, sample.a, strict=True)
    tau = np.array([pin.rnea(m, m.createData(), q, v, a) for m, q, v, a in jets])
    friction = 0.3 * sample.v if name == "free" else 0.0
    assert_same(sample.tau, tau + friction)


@pytest.mark.parametrize("name", MOTIONS)
def test_a_plan_from_a_loaded_motion_is_that_motion(name: str) -> None:
    """The same task, on the grid that it names or by its tolerance, from the file as the guess."""
    found, numbers = MOTIONS[name](guess=loaded(name)), known(name)
    assert found.success, found.message
    assert found.cost == pytest.approx(numbers["cost"], rel=1e-3)
    assert_same(found.trajectory.sample(numbers["t"]).q, numbers["q"], 3e-3)
    if name in ("free", "model", "group"):  # from a cubic 8 steps, if it is not the solution
        assert found.nit <= 2


def test_a_loaded_turn_leads_to_a_turn() -> None:
    """Ends alone do not say that a body turns over: the motion that is given as a guess does."""
    motion, numbers = loaded("group"), known("group")
    ends = [hovi.State(q, v) for q, v in zip(motion.q[[0, -1]], motion.v[[0, -1]], strict=True)]
    grid = {"scheme": "galerkin-2", "intervals": 24, "limits": "none"}
    assert motion.scene is not None
    found, straight = (
        hovi.plan(motion.scene, *ends, motion.duration, **grid, **guess)
        for guess in ({"guess": motion}, {})
    )
    assert found.success, found.message
    assert found.cost == pytest.approx(numbers["cost"], rel=1e-6)
    assert straight.cost < 0.99 * found.cost


@pytest.fixture(scope="module")
def solved() -> dict[str, hovi.Solution]:
    """What `solve` makes of the loaded motions, between their ends and on their grids."""
    return {
        name: hovi.solve(problem_of(name), loaded(name)) for name in ("free", "smooth", "group")
    }


def problem_of(name: str) -> hovi.TrajectoryProblem:
    """The problem of a loaded motion, from what is in its file alone."""
    motion = loaded(name)
    assert motion.scene is not None
    ld = hovi.DiscreteLagrangian(motion.scene.effort_lagrangian(), motion.grid)
    ends = motion.sample([0.0, motion.duration])
    rest = {"a": np.zeros(motion.v.shape[1])} if motion.grid.order > 2 else {}
    start, goal = (hovi.State(q, v, **rest) for q, v in zip(ends.q, ends.v, strict=True))
    limits = hovi.as_limits(motion.scene.robot, {"base": "none", "v": 2.2}, motion.grid.order)
    return hovi.TrajectoryProblem(ld, start, goal, limits if name == "smooth" else None)


@pytest.mark.parametrize("name", ["free", "smooth", "group"])
def test_a_loaded_motion_solves_the_problem_of_its_file(
    solved: dict[str, hovi.Solution], name: str
) -> None:
    """Without limits it is the solution, which the solver sees at once."""
    found, numbers = solved[name], known(name)
    assert found.success, found.message
    assert found.nit <= 1 or name == "smooth"
    assert found.cost == pytest.approx(numbers["cost"], rel=1e-4 if name == "smooth" else 1e-9)
    share = 1e-3 if name == "smooth" else 1e-6
    assert_same(found.trajectory.sample(numbers["t"]).q, numbers["q"], share)


@pytest.mark.parametrize("name", ["free", "smooth", "group"])
def test_what_was_loaded_is_replanned_and_advanced(
    solved: dict[str, hovi.Solution], name: str
) -> None:
    numbers, robot = known(name), loaded(name).robot
    assert robot is not None
    q = robot.integrate(numbers["q"][-1], np.full(robot.nv, 0.01))
    there = solved[name].replan(goal=hovi.State(q))
    assert there.success, there.message
    ends = there.trajectory.q[0], there.trajectory.q[-1]
    for found, expected in zip(ends, (numbers["q"][0], q), strict=True):
        assert np.abs(robot.difference(expected, found)).max() < 1e-8
    rest = solved[name].advance(numbers["t"][2])
    assert rest.success, rest.message
    later = rest.trajectory.sample(numbers["t"][2:] - numbers["t"][2])
    share = 1e-2 if name == "smooth" else 1e-4
    assert_same(later.q, numbers["q"][2:], share)


def test_a_table_of_a_loaded_motion_has_its_numbers(name: str, tmp_path: Path) -> None:
    motion, numbers = loaded(name), known(name)
    hovi.export(motion, tmp_path / "motion.csv", rate=STEPS / motion.duration)
    with (tmp_path / "motion.csv").open() as stream:
        head, *rows = [row for row in csv.reader(stream) if not row[0].startswith("#")]
    table = np.array(rows, dtype=float)
    for key in ("v", "a", "tau"):
        columns = [i for i, column in enumerate(head) if column.startswith(f"{key}_")]
        assert_same(table[:, columns], numbers[key])
    positions = [i for i, column in enumerate(head) if column.startswith("q_")]
    assert_same(table[:, positions], numbers["q"])
    if name == "model":
        turned = table[:, head.index("angle_turn")]
        np.testing.assert_allclose(turned[[0, -1]], [7.0, 8.5], atol=1e-9)


@pytest.mark.parametrize("name", ["free", "limited", "smooth", "sequence"])
def test_a_message_of_a_loaded_motion_has_its_numbers(name: str, tmp_path: Path) -> None:
    motion, numbers = loaded(name), known(name)
    hovi.export(motion, tmp_path / "motion.json", rate=STEPS / motion.duration)
    points = json.loads((tmp_path / "motion.json").read_text())["points"]
    for key, field in (("q", "positions"), ("v", "velocities"), ("a", "accelerations")):
        assert_same(np.array([each[field] for each in points]), numbers[key])


@pytest.mark.parametrize("name", [*ONE_SCENE, "sequence"])
def test_a_page_shows_a_loaded_motion(name: str, tmp_path: Path) -> None:
    """It traces the path of the tip, which passes through all that was sampled."""
    motion, numbers = loaded(name), known(name)
    assert motion.robot is not None
    hovi.replay(motion, html=tmp_path / "page.html")
    messages = messages_of((tmp_path / "page.html").read_text())
    (drawn,) = (m for m in messages if "trace" in m["path"])
    data = drawn["object"]["geometries"][0]["data"]["attributes"]["position"]["array"]
    path = np.frombuffer(data.data, np.float32).reshape(-1, 3)
    for q in numbers["q"]:
        tip = motion.robot.frame_pose(motion.robot.tip_frame, q)[:3, 3]
        assert np.linalg.norm(path - tip, axis=1).min() < 0.02


def test_a_loaded_robot_is_drawn_by_the_meshes_of_its_file() -> None:
    """A cube of 12 triangles for each link, of several formats, or a textured flag of one."""
    robot = loaded("meshes").robot
    assert robot is not None
    assert robot.visual is not None
    triangles = [each.geometry.num_tris for each in robot.visual.geometryObjects]
    assert triangles == [12, 12, 12, 1, 12, 12]
    assert not robot.visual_problem


@pytest.mark.parametrize("name", ONE_SCENE)
def test_the_torques_of_a_loaded_motion_lead_to_its_goal(name: str) -> None:
    motion, numbers = loaded(name), known(name)
    assert motion.scene is not None
    played = hovi.play(motion.scene, motion).simulation
    apart = motion.scene.robot.difference(numbers["q"][-1], played.q[-1])
    assert np.abs(apart).max() < 1e-3
