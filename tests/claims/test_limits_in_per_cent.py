"""A limit may be a fraction of that of the robot, "50 %", wherever limits are given."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.cli.application import main
from hovi.errors import InputError, SceneError

HOME, AWAY = [0.0, -1.4, 1.6, -0.2, 0.5, 0.0], [2.6, -1.0, 1.2, -0.2, 0.9, 0.3]


@pytest.fixture(scope="module")
def scene() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])


def speeds(motion: hovi.Trajectory) -> Any:
    return np.abs(motion.sample(np.linspace(0.0, motion.duration, 2000)).v).max(axis=0)


def test_half_the_velocity_is_half_of_what_pinocchio_reads(scene: hovi.Scene) -> None:
    of_urdf = scene.robot.model.velocityLimit  # (6,), of Pinocchio
    fast = hovi.plan(scene, HOME, AWAY, 2.0, tolerance=1e-2)
    slow = hovi.plan(scene, HOME, AWAY, 2.0, tolerance=1e-2, limits={"v": "50 %"})
    assert fast.success
    assert slow.success
    assert (speeds(fast.trajectory) > 0.5 * of_urdf).any()
    assert (speeds(slow.trajectory) <= 0.5 * of_urdf * (1 + 1e-5)).all()
    assert slow.cost > fast.cost


def test_the_torques_keep_a_share_by_rnea(scene: hovi.Scene) -> None:
    found = hovi.plan(scene, HOME, AWAY, 3.0, limits={"tau": {"shoulder_lift_joint": "33 %"}})
    assert found.success, found.message
    model = scene.robot.model
    data = model.createData()
    sample = found.trajectory.sample(np.linspace(0.0, 3.0, 500))
    tau = [pin.rnea(model, data, *x) for x in zip(sample.q, sample.v, sample.a, strict=True)]
    largest = np.abs(tau).max(axis=0)[1]
    assert 0.32 * model.effortLimit[1] < largest <= 0.33 * model.effortLimit[1] * (1 + 1e-5)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"v": "50 %"}, [1.575, 1.575, 1.575, 1.6, 1.6, 1.6]),
        ({"v": " 50% "}, [1.575, 1.575, 1.575, 1.6, 1.6, 1.6]),
        ({"v": "100 %"}, [3.15, 3.15, 3.15, 3.2, 3.2, 3.2]),
        ({"v": {"elbow_joint": "1e1 %"}}, [3.15, 3.15, 0.315, 3.2, 3.2, 3.2]),
        ({"v": ["10 %", 1.0, [-2.0, 3.0], 3, "12.5 %", "0.1 %"]}, [0.315, 1, 3, 3, 0.4, 0.0032]),
        ({"base": "ur5e", "v": "50 %"}, [np.pi / 2] * 6),
        ({"v": "50 %", "margin": 0.1}, [0.8 * x for x in [1.575, 1.575, 1.575, 1.6, 1.6, 1.6]]),
    ],
)
def test_shares_are_of_the_base(scene: hovi.Scene, given: Any, expected: list[float]) -> None:
    limits = hovi.as_limits(scene.robot, given)
    np.testing.assert_allclose(limits.upper[1], expected, rtol=1e-12)


def test_shares_are_the_numbers_written_out_bit_by_bit(scene: hovi.Scene) -> None:
    of_urdf = scene.robot.model.velocityLimit
    for per_cent in range(1, 101):
        written = [float(f"{per_cent / 100:.2f}") * x for x in of_urdf]
        shares = hovi.as_limits(scene.robot, {"v": f"{per_cent} %"})
        numbers = hovi.as_limits(scene.robot, {"v": written})
        np.testing.assert_array_equal(shares.upper, numbers.upper)
        np.testing.assert_array_equal(shares.lower, numbers.lower)


def test_accelerations_are_of_the_maker_of_an_arm(scene: hovi.Scene) -> None:
    arm = hovi.load_robot("panda", locked=["panda_finger_joint1", "panda_finger_joint2"])
    published = hovi.as_limits(arm, "panda")
    half = hovi.as_limits(arm, {"base": "panda", "a": "50 %"})
    np.testing.assert_allclose(half.upper[2], 0.5 * published.upper[2])
    np.testing.assert_allclose(half.lower[2], 0.5 * published.lower[2])
    with pytest.raises(InputError, match="'urdf' has none for this joint"):
        hovi.as_limits(arm, {"a": "50 %"})


REFUSED: list[tuple[Any, str]] = [
    ({"v": text}, "from above 0 % to 100 % of its limit")
    for text in (
        "0 %",
        "-5 %",
        "101 %",
        "nan %",
        "inf %",
        "1e999 %",
        "50",
        "",
        "%",
        "fast",
        "50 deg",
    )
]
REFUSED += [
    ({"q": "50 %"}, "a range of positions has no share: .*`margin`"),
    ({"q": {"elbow_joint": "50 %"}}, "limits.q of 'elbow_joint'"),
    ({"base": "none", "v": {"elbow_joint": "50 %"}}, "'elbow_joint' .* 'none' has none"),
    ({"a": "50 %"}, "'shoulder_pan_joint' .* 'urdf' has none"),
    ({"v": ["50 %"]}, "one entry for each of"),
    ({"v": {"elbow": "50 %"}}, "has no joint 'elbow'"),
    ({"v": [["10 %", "50 %"]] * 6}, "must be a positive number"),
]


@pytest.mark.parametrize(("given", "said"), REFUSED)
def test_others_are_refused_in_one_sentence(scene: hovi.Scene, given: Any, said: str) -> None:
    with pytest.raises(InputError, match=said) as refused:
        hovi.plan(scene, HOME, AWAY, 2.0, limits=given)
    assert "\n" not in str(refused.value)


ARM = """<robot name="arm"><link name="base"/>
<link name="upper">{inertia}</link><link name="lower">{inertia}</link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="0" effort="50"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
<origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" velocity="4" effort="50"/></joint></robot>"""
INERTIA = """<inertial><mass value="1"/><origin xyz="0 0 0.15"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>"""
SCENE = """robot = "arm.urdf"
start = [0.0, 0.0]
goal = [0.2, 1.5]
duration = 1.0

[effects.gravity]

[limits]
base = "urdf"
v = { elbow = "SHARE" }
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "arm.urdf").write_text(ARM.format(inertia=INERTIA))
    return tmp_path


def test_a_joint_without_a_limit_in_the_urdf_is_refused_by_name(folder: Path) -> None:
    robot = hovi.load_robot(folder / "arm.urdf")
    for given in ({"v": "50 %"}, {"v": {"shoulder": "50 %"}}, {"v": ["50 %", 1.0]}):
        with pytest.raises(InputError, match=r"limits\.v of 'shoulder' is '50 %' of a limit, but"):
            hovi.as_limits(robot, given)
    limits = hovi.as_limits(robot, {"v": {"elbow": "50 %"}})
    np.testing.assert_array_equal(limits.upper[1], [np.inf, 2.0])


def test_scene_files_take_them(folder: Path) -> None:
    (folder / "reach.toml").write_text(SCENE.replace("SHARE", "50 %"))
    task = hovi.load_task(folder / "reach.toml")
    found = hovi.plan_task(task)
    assert found.success, found.message
    assert 1.9 < speeds(found.trajectory)[1] <= 2.0 * (1 + 1e-5)
    hovi.save_task(task, folder / "again.toml")
    assert hovi.load_task(folder / "again.toml").options.limits == task.options.limits


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("SHARE", "0 %", "line 10: limits.v of 'elbow' must be"),
        ("SHARE", "half", "line 10: `limits.v.elbow` must be"),
        ("SHARE", "-5 %", "line 10: `limits.v.elbow` must be"),
        ('elbow = "SHARE"', 'shoulder = "50 %"', "line 10: limits.v of 'shoulder' is '50 %'"),
        ('{ elbow = "SHARE" }', '"50 %"', "line 10: limits.v of 'shoulder' is '50 %'"),
        ('v = { elbow = "SHARE" }', 'q = "50 %"', "line 10: `limits.q` must be"),
        ('base = "urdf"', 'base = "none"', "'none' has none for this joint"),
        ("duration", 'velocity_scaling = "50 %"\nduration', 'limits = { v = "50 %" }'),
    ],
)
def test_scene_files_refuse_the_same_with_the_line(
    folder: Path, old: str, new: str, said: str
) -> None:
    text = SCENE.replace(old, new, 1).replace("SHARE", "50 %")
    (folder / "reach.toml").write_text(text)
    with pytest.raises(SceneError) as refused:
        hovi.load_task(folder / "reach.toml")
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_the_command_line_takes_the_table_of_a_scene_file(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene, out = folder / "reach.toml", folder / "motion.npz"
    scene.write_text(SCENE.replace("SHARE", "100 %"))
    given = ["plan", str(scene), "--json", "--out", str(out), "--limits"]
    assert main([*given, "{v = {elbow = '60 %'}}"]) == 0
    assert json.loads(capsys.readouterr().out)["success"]
    assert 2.3 < speeds(hovi.Trajectory.load(out))[1] <= 2.4 * (1 + 1e-5)
    for wrong, said in (
        ("{v = {elbow = '0 %'}}", "limits.v of 'elbow'"),
        ("{v = {shoulder = '50 %'}}", "limits.v of 'shoulder'"),
        ("{v = ", "is no table in TOML"),
        ("{w = 1}", "unknown key `limits.w`"),
        ("50 %", "as a table such as"),
    ):
        assert main([*given, wrong]) == 2
        shown = capsys.readouterr().err
        assert said in shown.replace("\n", " ")
        assert "Traceback" not in shown


def test_segments_take_them(folder: Path) -> None:
    scene = hovi.Scene(hovi.load_robot(folder / "arm.urdf"), [hovi.effects.Gravity()])
    slow = hovi.Segment([0.2, 1.5], 1.5, limits={"v": {"elbow": "40 %"}})
    found = hovi.plan_sequence(scene, [0.0, 0.0], [slow, hovi.Segment([0.0, 0.0], 1.5)])
    assert found.success, found.message
    v = found.trajectory.sample(np.linspace(0.0, 1.499, 500)).v
    assert np.abs(v[:, 1]).max() <= 1.6 * (1 + 1e-5)


@pytest.mark.parametrize(
    "option", ["velocity_scaling", "max_velocity_scaling_factor", "max_acceleration_scaling_factor"]
)
def test_scalings_of_other_planners_are_answered_by_limits(scene: hovi.Scene, option: str) -> None:
    options: dict[str, Any] = {option: 0.5}
    with pytest.raises(InputError, match=f"no option {option!r}: give limits, such as .*50 %"):
        hovi.plan(scene, HOME, AWAY, 2.0, **options)


@pytest.mark.parametrize(
    ("option", "said"),
    [
        ("--velocity-scaling", "--limits \"{v = '50 %'}\""),
        ("--max-acceleration-scaling-factor", "--limits \"{base = 'panda', a = '50 %'}\""),
    ],
)
def test_scalings_on_the_command_line_are_answered_by_what_to_type(
    capsys: pytest.CaptureFixture[str], option: str, said: str
) -> None:
    assert main(["plan", "two_link", option, "50%"]) == 2
    assert said in capsys.readouterr().err
    assert main(["plan", "two_link", "--velocty", "50%"]) == 2
    assert "--limits" not in capsys.readouterr().err
