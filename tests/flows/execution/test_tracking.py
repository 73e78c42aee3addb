"""Plans executed on scenes with more effects, open loop and with feedback."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

from hovi import certify, plan
from hovi.cli.application import main
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Gravity, Payload, ViscousFriction, Wrench
from hovi.errors import InputError
from hovi.flows.execution.controllers import FEEDBACKS, Controller, OpenLoop, controller
from hovi.flows.execution.tracking import Tracking, play
from hovi.flows.simulator import simulate
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task_plan import plan_task
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]

START, GOAL = State([-0.5, 0.2]), State([0.6, 0.9])


@pytest.fixture(scope="module")
def simple(two_link: Robot) -> Scene:
    return Scene(two_link, [Gravity(9.8)])


@pytest.fixture(scope="module")
def rich(two_link: Robot) -> Scene:
    effects = [Gravity(9.8), ViscousFriction(0.2), Payload(two_link.tip_frame, 0.1)]
    return Scene(two_link, effects)


@pytest.fixture(scope="module")
def planned(simple: Scene) -> Trajectory:
    return plan(
        simple, START, GOAL, 1.0, intervals=32, limits="none", self_collision=False
    ).trajectory


def by_scipy(tracking: Tracking) -> Array:
    """(q, v) at the end under the same torques, by SciPy and ABA."""
    scene, drive = tracking.simulation.scene, tracking.controller
    model, data = scene.model, scene.model.createData()

    def rate(t: float, y: Array) -> Array:
        q, v = np.split(y, 2)
        u = drive.evaluate(q[None], v[None], np.array([t]))[0][0]
        return np.concatenate([v, pin.aba(model, data, q, v, u - 0.2 * v)])

    y0 = np.concatenate([tracking.plan.q[0], tracking.plan.v[0]])
    end = solve_ivp(rate, (0, 1), y0, "DOP853", rtol=1e-8, atol=1e-8, max_step=1 / 32)
    return np.asarray(end.y[:, -1])


@pytest.mark.parametrize("feedback", FEEDBACKS)
def test_open_loop_execution_matches_scipy(rich: Scene, planned: Trajectory, feedback: str) -> None:
    tracking = play(rich, planned, feedback, inner_modes=2, intervals=96)
    motion = tracking.simulation
    found = np.concatenate([motion.q[-1], motion.v[-1]])
    np.testing.assert_allclose(found, by_scipy(tracking), rtol=0, atol=2e-5)


@pytest.mark.parametrize("feedback", FEEDBACKS)
def test_without_model_error_there_is_no_deviation(
    simple: Scene, planned: Trajectory, feedback: str
) -> None:
    tracking = play(simple, planned, feedback)
    assert np.abs(tracking.joint_deviation).max() < 1e-4
    assert tracking.tip_deviation.max() < 1e-4


def test_feedback_reduces_the_deviation_of_open_loop(rich: Scene, planned: Trajectory) -> None:
    off = [play(rich, planned, feedback).tip_deviation for feedback in FEEDBACKS]
    firm = play(rich, planned, "pd", bandwidth=40.0)
    assert off[0][-1] > 0.05
    assert max(off[1].max(), off[2].max()) < 0.5 * off[0].max()
    assert firm.tip_deviation.max() < 0.2 * off[1].max()
    assert np.abs(firm.feedback_torque).max() > 0


@pytest.mark.parametrize("feedback", FEEDBACKS)
def test_derivatives_of_feedback_match_finite_differences(
    simple: Scene, planned: Trajectory, feedback: str
) -> None:
    drive = controller(planned, feedback, simple, 7.0)
    random = np.random.default_rng(1)
    q, v = random.normal(size=(2, 5, 2))
    t = random.uniform(0, 1, 5)
    _, slope = drive.evaluate(q, v, t)
    for k, x in enumerate((q, v)):
        for i in range(2):
            d, jet = 1e-6 * np.eye(2)[i], [q, v]
            jet[k] = x + d
            above = drive.evaluate(*jet, t)[0]
            jet[k] = x - d
            below = drive.evaluate(*jet, t)[0]
            np.testing.assert_allclose(slope[:, :, k, i], (above - below) / 2e-6, atol=1e-6)


def test_computed_torque_decays_at_its_bandwidth(simple: Scene, planned: Trajectory) -> None:
    w, off = 8.0, np.array([0.02, -0.03])
    drive = controller(planned, "computed-torque", simple, w)
    moved = State(planned.q[0] + off, planned.v[0])
    motion = simulate(simple, moved, 1.0, drive, intervals=200)
    error = motion.q - planned.sample(motion.t).q
    expected = np.outer(np.exp(-w * motion.t) * (1 + w * motion.t), off)
    np.testing.assert_allclose(error, expected, atol=1e-4)


@pytest.mark.parametrize(("r", "counts"), [(0, (200, 400)), (1, (40, 80))])
def test_the_energy_balance_has_the_order_of_the_integrator(
    rich: Scene, planned: Trajectory, r: int, counts: tuple[int, int]
) -> None:
    wrong = []
    for N in counts:
        motion = simulate(rich, START, 1.0, _smooth, intervals=N, inner_modes=r)
        driven, resisted = motion.work
        assert (np.diff(resisted) <= 0).all()
        wrong.append(np.abs(motion.energy - motion.energy[0] - driven - resisted).max())
    assert np.log2(wrong[0] / wrong[1]) == pytest.approx(2 * (r + 1), abs=0.3)


def _smooth(t: Array) -> Array:
    return np.stack([12 * np.cos(3 * t), 4 - np.sin(t)], axis=1)


def test_a_plan_of_another_robot_is_refused(planned: Trajectory, ur5: Robot, simple: Scene) -> None:
    with pytest.raises(InputError, match=r"the plan moves shoulder, elbow, but .* 'ur5'"):
        play(Scene(ur5), planned)
    with pytest.raises(InputError, match="no feedback 'pid': did you mean 'pd'"):
        play(simple, planned, "pid")
    for bandwidth in (0.0, 1e300, float("nan")):
        with pytest.raises(InputError, match="bandwidth must be positive and at most"):
            play(simple, planned, "pd", bandwidth=bandwidth)


def test_a_plan_without_a_scene_is_executed_open_loop(simple: Scene, planned: Trajectory) -> None:
    from hovi.discrete.output.stored_torque import StoredTorque

    stored = StoredTorque.fit(
        lambda k, s: planned.sample_intervals(k, s).tau, planned.grid.intervals
    )
    bare = Trajectory(
        planned.grid,
        planned.path,
        planned.momenta,
        None,
        {"coordinates": list(planned.coordinate_names)},
        stored,
    )
    assert play(simple, bare).tip_deviation.max() < 1e-4
    with pytest.raises(InputError, match="computed torques need the plan's scene"):
        play(simple, bare, "computed-torque")


# The command

SCENE = """robot = "two_link.urdf"
duration = 1.0
[start]
q = [-0.5, 0.2]
[goal]
q = [0.6, 0.9]
[effects.gravity]
acceleration = 9.8
[effects.viscous_friction]
coefficient = 0.2
"""


@pytest.fixture
def files(models: Path, tmp_path: Path, planned: Trajectory) -> tuple[str, str]:
    scene, motion = tmp_path / "rich.toml", tmp_path / "plan.npz"
    scene.write_text(SCENE.replace("two_link.urdf", str(models / "two_link.urdf")))
    planned.save(motion)
    return str(scene), str(motion)


def test_the_command_reports_the_deviation(
    files: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    scene, motion = files
    arguments = ["simulate", scene, "--plan", motion]
    assert main([*arguments, "--json"]) == 0
    loose = json.loads(capsys.readouterr().out)
    assert main([*arguments, "--feedback", "pd", "--bandwidth", "30", "--json"]) == 0
    held = json.loads(capsys.readouterr().out)
    assert (loose["feedback"], held["feedback"], held["bandwidth"]) == ("none", "pd", 30.0)
    assert loose["tip_deviation_end"] > 5 * held["tip_deviation_end"] > 0
    assert (loose["tip_frame_end"], loose["tip_frame_max"]) == ("tip", "tip")
    assert loose["work_of_effects"] < 0
    assert loose["energy_error"] < 1e-4
    assert main(arguments) == 0
    assert "feedback" not in capsys.readouterr().out
    assert main([*arguments, "--feedback", "computed-torque"]) == 0
    text = capsys.readouterr().out
    assert "feedback: computed-torque of 10 rad/s" in text
    assert re.search(r"^tip is off by \S+ mm at the end, tip by \S+ mm at most$", text, re.M)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--feedback", "pd"], "--feedback needs a plan to track"),
        (["--plan", "PLAN", "--duration", "1"], "--duration cannot be combined with --plan"),
        (["--plan", "PLAN", "--feedback", "pdd"], "no feedback 'pdd': did you mean 'pd'"),
        (["--plan", "nowhere.npz"], "no trajectory file 'nowhere.npz'"),
    ],
)
def test_the_command_refuses_in_one_sentence(
    files: tuple[str, str],
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    sentence: str,
) -> None:
    scene, motion = files
    given = [motion if each == "PLAN" else each for each in arguments]
    assert main(["simulate", scene, *given]) == 2
    assert sentence in capsys.readouterr().err


def test_of_several_tips_the_one_with_the_largest_deviation_is_reported(two_arms: Robot) -> None:
    scene = Scene(two_arms, [Gravity()])
    ends = State(two_arms.neutral()), State(two_arms.neutral() + 0.2)
    motion = plan(scene, *ends, 0.5, limits="none", self_collision=False).trajectory
    pushed = Scene(two_arms, [Gravity(), Wrench("right_gripper", (0.0, 0.0, 5.0))])
    distance = play(pushed, motion).tip_distance
    assert distance.frames == ("left_gripper", "right_gripper")
    assert distance.each[:, 0].max() < 1e-4 < distance.each[-1, 1]
    assert distance.frame == distance.frame_at(-1) == "right_gripper"
    np.testing.assert_array_equal(play(pushed, motion).tip_deviation, distance.each.max(axis=1))


def test_open_loop_is_a_controller(planned: Trajectory) -> None:
    drive: Controller = OpenLoop(planned)
    t = np.array([0.0, 0.5, 2.0])
    u, slope = drive.evaluate(np.zeros((3, 2)), np.zeros((3, 2)), t)
    np.testing.assert_array_equal(u[:2], planned.sample(t[:2]).tau)
    np.testing.assert_array_equal(u[2], planned.sample(1.0).tau[0])
    assert not slope.any()


def test_passive_joints_get_no_torque(models: Path) -> None:
    task = load_task(models / "cart_pole_swing_up.toml")
    plan = plan_task(task).trajectory
    drive = controller(plan, "pd", task.scene, 10.0)
    far = plan.q + 0.3
    u, slope = drive.evaluate(far, plan.v, plan.t)
    slide, hinge = (task.scene.robot.coordinate_names.index(name) for name in ("slide", "hinge"))
    assert not u[:, hinge].any()
    assert not slope[:, hinge].any()
    assert np.abs(u[:, slide] - plan.sample(plan.t).tau[:, slide]).min() > 0.1
    with pytest.raises(InputError, match="a motor at every joint, and hinge has none"):
        play(task.scene, plan, "computed-torque")
    names = ["elbow_joint", "wrist_1_joint"]
    with pytest.raises(InputError, match=f"and {', '.join(names)} have none"):
        controller(plan, "computed-torque", Scene(load_robot("ur5"), passive=names), 10.0)


def test_a_solution_is_not_accepted_as_a_trajectory(simple: Scene) -> None:
    solution = plan(simple, START, GOAL, 1.0, self_collision=False)
    with pytest.raises(InputError, match="expected a Trajectory, got a Solution; give the traj"):
        play(simple, solution)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="expected a Solution, got a Trajectory; give what"):
        certify(solution.trajectory)  # type: ignore[arg-type]
