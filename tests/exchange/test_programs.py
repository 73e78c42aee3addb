"""Programs for arms, read back by a grammar of their manuals and compared with closed forms."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import yaml

import hovi
from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviWarning, InputError
from hovi.exchange.joint_trajectory import joint_trajectory
from hovi.scene.segment_scenes import SegmentScenes
from oracles.programs import Program, read_franka, read_urscript
from samples.cubic_motion import Cubic, cubic_motion

Array = npt.NDArray[np.float64]

T = 0.7
A6, B6 = [0.1, -1.5, 1.4, -0.3, 0.2, 0.0], [1.0, -0.7, 0.9, -1.3, 0.4, 2.5]
A7, B7 = [0.0, -0.8, 0.0, -2.3, -0.1, 1.5, 0.7], [0.4, -0.6, 0.2, -2.0, 0.0, 1.7, -0.7]
UR_ORDER = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
"""Base, shoulder, elbow and the wrists, as the manual lists them."""


def resting(
    robot: hovi.Robot, start: Sequence[float], end: Sequence[float], duration: float = T
) -> tuple[Trajectory, Cubic]:
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    cubic = Cubic.resting(start, end, duration)
    return cubic_motion(scene, duration, ["galerkin-2"] * 5, cubic=cubic)


@pytest.fixture(scope="module")
def motion(ur5: hovi.Robot) -> tuple[Trajectory, Cubic]:
    return resting(ur5, A6, B6)


@pytest.fixture(scope="module")
def reach(panda: hovi.Robot) -> tuple[Trajectory, Cubic]:
    return resting(panda, A7, B7)


def written(motion: Trajectory, folder: Path, rate: float = 125.0, **options: float) -> Program:
    motion.to_urscript(folder / "a-b 2.script", rate, **options)
    return read_urscript((folder / "a-b 2.script").read_bytes())


@pytest.mark.parametrize("rate", [50.0, 100.0, 125.0, 500.0])
def test_a_urscript_reaches_the_motion_at_each_of_its_times(
    motion: tuple[Trajectory, Cubic], rate: float, tmp_path: Path
) -> None:
    program, cubic = written(motion[0], tmp_path, rate), motion[1]
    assert program.name == "hovi_a_b_2"
    np.testing.assert_allclose(program.start, A6, atol=1e-9)
    t = np.minimum(program.times, T)
    np.testing.assert_allclose(program.targets, cubic(t)[0], atol=1e-9)
    np.testing.assert_allclose(program.times[0], 1 / rate)
    assert (program.times[:-1] < T + 1 / rate).all()


def test_a_urscript_holds_the_end_as_long_as_the_arm_looks_ahead(
    motion: tuple[Trajectory, Cubic], tmp_path: Path
) -> None:
    for lookahead in (0.03, 0.2):
        program = written(motion[0], tmp_path, lookahead_time=lookahead, gain=1000)
        assert program.tuning == {(lookahead, 1000)}
        assert program.times[-1] - T >= lookahead
        assert program.times[-1] - program.times[-2] <= lookahead + 0.008
        np.testing.assert_array_equal(program.targets[-1], program.targets[-2])


def test_steps_of_programs_keep_the_velocities_of_the_plan(ur5: hovi.Robot, tmp_path: Path) -> None:
    scene = hovi.Scene(ur5, [hovi.effects.Gravity()])
    limits = {"v": 0.9}
    goal = [1.0, -1.2, 1.2, -1.3, 0.4, 0.8]
    solution = hovi.plan(scene, A6, goal, 1.6, limits=limits)
    assert solution.success
    program = written(solution.trajectory, tmp_path)
    q, t = np.vstack([program.start, program.targets]), np.append(0.0, program.times)
    speed = np.abs(np.diff(q, axis=0)) / np.diff(t)[:, None]
    assert 0.85 < speed.max() <= 0.9 * (1 + 1e-6)  # the limit is reached


def test_the_program_that_the_docs_show_is_the_one_that_is_written(tmp_path: Path) -> None:
    """But for "...": its first and last lines have the numbers of its ends and durations."""
    page = Path(__file__).resolve().parents[2] / "docs" / "howto" / "arms.md"
    shown = re.search(r"```text\n(.*?)\n```", page.read_text(), re.S)
    assert shown
    robot, home = hovi.load_robot("ur10"), [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
    there, back = resting(robot, home, B6, 2.0)[0], resting(robot, B6, home, 2.5)[0]
    hovi.export([there, back], tmp_path / "fetch.script", gap=1.0)
    pattern = ".*?".join(re.escape(each) for each in shown[1].split("..."))
    assert re.fullmatch(pattern + "\n", (tmp_path / "fetch.script").read_text(), re.S)


def test_segments_are_named_where_they_begin(
    motion: tuple[Trajectory, Cubic], tmp_path: Path
) -> None:
    """As for the commands of a gripper, which users put there: after the last target before it."""
    from dataclasses import replace

    scene = motion[0].scene
    assert scene is not None
    parts = SegmentScenes((scene, scene, scene), (1, 1, 3))
    named = {"segment_names": ["reach", "close\nstopj(2)", "carry"]}
    program = written(replace(motion[0], scene=None, segments=parts, metadata=named), tmp_path)
    marks = [(0, "0 s: reach"), (17, "0.14 s: close?stopj(2)"), (35, "0.28 s: carry")]
    assert program.marks == marks
    begun = np.array([at for at, _ in marks]) * 0.008
    assert (begun <= [0.0, 0.14, 0.28]).all()
    assert (begun + 0.008 > [0.0, 0.14, 0.28]).all()


def test_joints_are_in_the_order_of_the_controller_whatever_that_of_the_robot(
    tmp_path: Path,
) -> None:
    robot = hovi.load_robot(reversed_ur(tmp_path))
    assert robot.joint_names[0] == "right_a_slide"
    assert robot.joint_names[1:3] == ("right_wrist_3_joint", "right_wrist_2_joint")
    ends = [[0.0, *A6[::-1]], [0.0, *B6[::-1]]]
    moved, _ = resting(robot, *ends)
    program = written(moved, tmp_path)
    np.testing.assert_allclose(program.start, A6, atol=1e-9)
    np.testing.assert_allclose(program.targets[-1], B6, atol=1e-9)
    listed = next(each for each in program.comments if each.startswith("joints:"))
    assert listed == "joints: " + ", ".join(f"right_{name}_joint" for name in UR_ORDER)
    sliding, _ = resting(robot, ends[0], [0.1, *ends[1][1:]])
    with pytest.raises(InputError, match="moves 'right_a_slide', too: plan it with that joint"):
        sliding.to_urscript(tmp_path / "no.script")


def reversed_ur(folder: Path) -> Path:
    """A chain of a slide and the joints of a UR from its last to its first, of one inertia."""
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    names = [("a_slide", "prismatic"), *((f"{name}_joint", "revolute") for name in UR_ORDER[::-1])]
    links = [
        f'<link name="l{k}"><inertial><mass value="1"/>{inertia}</inertial></link>'
        for k in range(8)
    ]
    joints = [
        f'<joint name="right_{name}" type="{kind}"><parent link="l{k}"/><child link="l{k + 1}"/>'
        '<axis xyz="0 0 1"/><limit lower="-7" upper="7" effort="99" velocity="9"/></joint>'
        for k, (name, kind) in enumerate(names)
    ]
    path = folder / "reversed.urdf"
    path.write_text(f'<robot name="reversed">{"".join(links + joints)}</robot>')
    return path


def test_text_in_a_program_cannot_be_a_command(ur5: hovi.Robot, tmp_path: Path) -> None:
    from dataclasses import replace

    named = replace(ur5, name="x\n  movej([9, 9, 9, 9, 9, 9])\rüñ")
    motion, _ = resting(named, A6, B6)
    caution = {"cautions": [["collision", "links\u2028enter é each other"]]}
    with pytest.warns(HoviWarning, match="enter"):
        hovi.export(replace(motion, metadata=caution), tmp_path / "é.script")
    program = read_urscript((tmp_path / "é.script").read_bytes())
    assert any(
        each.startswith("x?  movej([9, 9, 9, 9, 9, 9])???: 0.7 s") for each in program.comments
    )
    assert any(each.startswith("collision: ") for each in program.comments)
    np.testing.assert_allclose(program.start, A6, atol=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rate": 60.0}, r"2 ms apart or a multiple of it, got a rate of 60: use 500"),
        ({"rate": 1000.0}, r"got a rate of 1000"),
        ({"rate": 5.0}, r"a program needs 10 targets per second or more, .* got a rate of 5:"),
        (
            {"lookahead_time": 0.02},
            r"`lookahead_time` of servoj must be 0\.03 to 0\.2 s, got 0\.02",
        ),
        ({"lookahead_time": float("nan")}, "got nan"),
        ({"gain": 99.0}, "`gain` of servoj must be 100 to 2000, got 99"),
        ({"gain": 2001.0}, "`gain` of servoj must be 100 to 2000, got 2001"),
    ],
)
def test_values_that_servoj_does_not_take_are_refused(
    options: dict[str, float], message: str, motion: tuple[Trajectory, Cubic], tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=message):
        hovi.export(motion[0], tmp_path / "m.script", **options)  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def test_options_of_one_format_are_refused_by_the_others(
    motion: tuple[Trajectory, Cubic], tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="`gain` is for the format 'urscript': leave it out"):
        hovi.export(motion[0], tmp_path / "m.csv", gain=300)
    with pytest.raises(InputError, match="a gap is between motions, and there is one"):
        hovi.export(motion[0], tmp_path / "m.csv", gap=1.0)


def test_arms_with_other_joints_are_refused_in_a_sentence(
    reach: tuple[Trajectory, Cubic], motion: tuple[Trajectory, Cubic], tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=r"Robots moves 6 joints that turn, and this motion has 7"):
        reach[0].to_urscript(tmp_path / "m.script")
    with pytest.raises(InputError, match=r"Franka moves 7 joints that turn, and this motion has 6"):
        motion[0].to_franka(tmp_path / "m.csv")
    assert not list(tmp_path.iterdir())


def test_a_passive_joint_has_no_place_in_a_program(ur5: hovi.Robot, tmp_path: Path) -> None:
    from dataclasses import replace

    moved, _ = resting(ur5, A6, B6)
    assert moved.scene is not None
    passive = replace(moved, scene=replace(moved.scene, passive=("elbow_joint",)))
    with pytest.raises(InputError, match="joint 'elbow_joint' is passive in this motion"):
        passive.to_urscript(tmp_path / "m.script")


def test_six_joints_of_other_names_are_written_with_a_warning(tmp_path: Path) -> None:
    (tmp_path / "chain.urdf").write_text(hovi.chain(6))
    moved, cubic = resting(hovi.load_robot(tmp_path / "chain.urdf"), A6, B6)
    with pytest.warns(HoviWarning, match="do not have the names of an arm of Universal Robots"):
        program = written(moved, tmp_path)
    np.testing.assert_allclose(program.targets[-1], cubic(T)[0][0], atol=1e-9)


def test_a_program_that_does_not_begin_and_end_at_rest_is_refused(
    ur5: hovi.Robot, panda: hovi.Robot, tmp_path: Path
) -> None:
    moving, _ = cubic_motion(hovi.Scene(ur5), T)
    with pytest.raises(InputError, match=r"this motion begins at .* rad/s of .*at rest: plan it"):
        moving.to_urscript(tmp_path / "m.script")
    half = Cubic.resting(A7, B7, 2 * T)  # its end is the middle of a motion
    ends, _ = cubic_motion(hovi.Scene(panda), T, cubic=half)
    with pytest.raises(InputError, match=r"this motion ends at .* rad/s of 'panda_joint7'"):
        ends.to_franka(tmp_path / "m.csv")
    assert not list(tmp_path.iterdir())


def test_a_long_program_is_warned_of(ur5: hovi.Robot, tmp_path: Path) -> None:
    slow, _ = resting(ur5, A6, B6, 21.0)
    with pytest.warns(HoviWarning, match=r"this program has 2,626 targets"):
        program = written(slow, tmp_path)
    assert len(program.targets) == 2626


def test_a_franka_table_has_a_row_per_millisecond(
    reach: tuple[Trajectory, Cubic], panda: hovi.Robot, tmp_path: Path
) -> None:
    with pytest.warns(HoviWarning, match=r"acceleration of .* rad/s\^2, and the control interface"):
        reach[0].to_franka(tmp_path / "m.csv")
    rows = read_franka((tmp_path / "m.csv").read_bytes())
    t = np.minimum(np.arange(len(rows)) * 1e-3, T)
    assert len(rows) == 701
    np.testing.assert_allclose(rows, reach[1](t)[0], atol=1e-13)
    speed = np.abs(np.diff(rows, axis=0)).max(axis=0) / 1e-3
    np.testing.assert_array_less(speed, 1.5 * np.abs(np.subtract(B7, A7)) / T + 1e-9)
    assert (rows < 0).any(axis=0)[[0, 3]].tolist() == [False, True]  # signs at ends of rows stay
    assert rows[-1, 6] == pytest.approx(-0.7)
    with pytest.raises(InputError, match="1000 rows per second, got a rate of 500"):
        reach[0].to_franka(tmp_path / "n.csv", 500.0)


def test_smooth_motions_have_no_warning_as_franka_tables(panda: hovi.Robot, tmp_path: Path) -> None:
    solution = hovi.plan(hovi.Scene(panda), A7, B7, 1.0, smooth=True, limits="none")
    solution.trajectory.to_franka(tmp_path / "m.csv")
    rows = read_franka((tmp_path / "m.csv").read_bytes())
    wanted = solution.trajectory.configurations(np.arange(1001) * 1e-3)
    np.testing.assert_allclose(rows, wanted, atol=1e-14)


def test_the_fingers_of_a_panda_that_do_not_move_are_left_out(tmp_path: Path) -> None:
    robot = hovi.load_robot("panda")
    fingers = [0.01, 0.01]
    moved, cubic = resting(robot, A7 + fingers, B7 + fingers)
    with pytest.warns(HoviWarning, match="acceleration"):
        moved.to_franka(tmp_path / "m.csv")
    rows = read_franka((tmp_path / "m.csv").read_bytes())
    np.testing.assert_allclose(rows[350], cubic(0.35)[0][0, :7], atol=1e-13)
    closing, _ = resting(robot, A7 + fingers, [*B7, 0.0, 0.0])
    with pytest.raises(InputError, match="moves 'panda_finger_joint1', too"):
        closing.to_franka(tmp_path / "n.csv")


@pytest.mark.parametrize("suffix", [".yaml", ".json"])
def test_a_robot_trajectory_has_the_fields_of_the_message(
    suffix: str, motion: tuple[Trajectory, Cubic], tmp_path: Path
) -> None:
    path = tmp_path / f"m{suffix}"
    hovi.export(motion[0], path, "robot-trajectory", 50.0)
    text = path.read_text()
    found = yaml.safe_load(text) if suffix == ".yaml" else json.loads(text)
    assert list(found) == ["joint_trajectory", "multi_dof_joint_trajectory"]
    assert found["joint_trajectory"] == joint_trajectory(motion[0], 50.0)
    assert found["multi_dof_joint_trajectory"] == {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
        "joint_names": [],
        "points": [],
    }
    points = found["joint_trajectory"]["points"]
    stamps = [each["time_from_start"] for each in points]
    t = np.array([each["sec"] + 1e-9 * each["nanosec"] for each in stamps])
    for name, wanted in zip(
        ("positions", "velocities", "accelerations"), motion[1](t), strict=True
    ):
        np.testing.assert_allclose([each[name] for each in points], wanted, atol=1e-9)


def test_a_robot_trajectory_says_its_cautions_as_comments(
    motion: tuple[Trajectory, Cubic], tmp_path: Path
) -> None:
    from dataclasses import replace

    cautioned = replace(motion[0], metadata={"cautions": [["coarse", "its grid is coarse"]]})
    cautioned.to_robot_trajectory(tmp_path / "m.yaml")
    assert (tmp_path / "m.yaml").read_text().startswith("# coarse: its grid is coarse\njoint_traj")
