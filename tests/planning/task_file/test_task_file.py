"""Scene files are read and written without loss; every mistake is reported in one sentence."""

from __future__ import annotations

import dataclasses
import math
import shutil
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi.effects
from hovi import PlanOptions
from hovi.discrete.state import State
from hovi.errors import HoviError, InputError, ModelError, SceneError, SchemeError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.tolerance import Quantity, Tolerance
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.writing import save_task
from hovi.robot.bundled_models import example, example_scenes
from hovi.robot.robot import Robot
from hovi.schemes import galerkin
from samples.meshes import WEDGE
from samples.world_files import PLANNING_SCENE

REACH = example("two_link_reach.toml").read_text()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    shutil.copy(example("two_link.urdf"), tmp_path)
    return tmp_path


def write(folder: Path, text: str) -> Path:
    path = folder / "scene.toml"
    path.write_text(text)
    return path


def refusal(folder: Path, text: str, error: type[HoviError] = SceneError) -> str:
    with pytest.raises(error) as raised:
        load_task(write(folder, text))
    sentence = str(raised.value)
    assert "\n" not in sentence
    assert "pydantic" not in sentence
    return sentence


COMPARED = {"two_link_swing_up", "two_link_reach", "two_link_elbow", "ur5_reach", "panda_reach"}
"""Scenes without limits, which are also given to other solvers."""


@pytest.mark.parametrize("name", example_scenes())
def test_every_shipped_scene_loads(name: str) -> None:
    task = load_task(example(name))
    assert task.name == name
    assert task.options.limits == "none" or name not in COMPARED


def numbers_of(end: State | FrameGoal, robot: Robot) -> list[npt.NDArray[np.float64]]:
    """What a state or a frame goal prescribes."""
    if isinstance(end, State):
        return [*end.on(robot, "end")]
    given = end.position, end.rotation, *(end.axis or (None, None))
    return [np.asarray([] if each is None else each, dtype=float) for each in given]


@pytest.mark.parametrize("name", sorted(example_scenes()))
def test_a_saved_task_is_read_back_as_the_same_task(name: str, tmp_path: Path) -> None:
    task = load_task(example(name))
    again = load_task(save_task(task, tmp_path / f"{name}.toml"))
    assert (again.duration, again.name) == (task.duration, task.name)
    shaped = ("via", "obstacles")
    for key in fields(PlanOptions):
        one, other = (getattr(each.options, key.name) for each in (task, again))
        assert one == other or key.name in shaped
    for via, read in zip(task.options.via, again.options.via, strict=True):
        assert via.time == read.time
    assert again.options.clearance.to_dict() == task.options.clearance.to_dict()
    for end in ("start", "goal"):
        ends = [numbers_of(getattr(each, end), each.scene.robot) for each in (task, again)]
        for expected, found in zip(*ends, strict=True):
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-15)
    assert again.scene.effects == task.scene.effects
    assert again.scene.to_dict() == task.scene.to_dict()


def test_saving_never_replaces_another_urdf(folder: Path) -> None:
    task = load_task(example("two_link_reach"))
    (folder / "two_link.urdf").write_text("<robot/>")
    with pytest.raises(SceneError, match="differs from the task's URDF"):
        save_task(task, folder / "scene.toml")
    assert not (folder / "scene.toml").exists()


def test_a_shipped_robot_is_named_and_not_copied(tmp_path: Path) -> None:
    path = save_task(load_task(example("panda_reach")), tmp_path / "panda.toml")
    assert [each.name for each in tmp_path.iterdir()] == ["panda.toml"]
    assert load_task(path).scene.robot.nv == 7


def test_a_copy_of_a_shipped_scene_finds_the_shipped_urdf(tmp_path: Path) -> None:
    copy = tmp_path / "mine.toml"
    copy.write_text(example("two_link_reach.toml").read_text())
    assert load_task(copy).scene.robot.name == "two_link"
    own = example("two_link.urdf").read_text().replace('name="two_link"', 'name="own"')
    (tmp_path / "two_link.urdf").write_text(own)
    assert load_task(copy).scene.robot.name == "own"  # a file beside the scene comes first
    copy.write_text(copy.read_text().replace("two_link.urdf", "no.urdf"))
    with pytest.raises(ModelError, match="cannot read the URDF"):
        load_task(copy)


def test_ends_may_be_given_by_joint_in_any_order(folder: Path) -> None:
    text = REACH.replace("q = [0.3, 0.7]", "q = { elbow = 0.7, shoulder = 0.3 }")
    text = text.replace("v = [0.5, -0.4]", "v = { elbow = -0.4 }")
    task = load_task(write(folder, text))
    q, v = task.goal.on(task.scene.robot, "goal")
    np.testing.assert_array_equal(q, [0.3, 0.7])
    np.testing.assert_array_equal(v, [0.0, -0.4])


def test_a_scene_without_effects_or_choices_takes_the_defaults(folder: Path) -> None:
    text = 'robot = "two_link.urdf"\nduration = 2\nstart.q = [0, 0]\ngoal.q = [1, 1]\n'
    task = load_task(write(folder, text))
    assert (
        task.options.scheme,
        task.options.intervals,
        task.options.starts,
        task.options.seed,
    ) == (None, None, 1, 0)
    assert task.options.limits == "urdf"
    assert tuple(task.scene.effects) == ()


def test_integers_are_accepted_for_real_numbers(folder: Path) -> None:
    assert load_task(write(folder, REACH.replace("1.0  ", "1  "))).duration == 1.0


def test_times_may_be_texts(folder: Path) -> None:
    via = '[[via]]\ntime = "250 ms"\nq = [0, 0]\n'
    task = load_task(write(folder, REACH.replace("= 1.0  ", '= "500 ms"  ') + via))
    assert (task.duration, task.options.via[0].time) == (0.5, 0.25)
    again = load_task(save_task(task, folder / "again.toml"))
    assert (again.duration, again.options.via[0].time) == (0.5, 0.25)
    task = load_task(write(folder, REACH.replace("= 1.0  ", '= ["500 ms", 2]  ')))
    assert task.duration == (0.5, 2.0)


def test_options_without_a_key_are_refused_on_saving(folder: Path) -> None:
    task = load_task(write(folder, REACH))
    for name, value in (("weight", [1.0, 2.0]), ("processes", 2)):
        with pytest.raises(SceneError, match=f"no key for option '{name}'"):
            save_task(task.with_options(**{name: value}), folder / "again.toml")
    motion = hovi.plan(
        task.scene, [0, 0], [0.1, 0.1], 1.0, intervals=2, self_collision=False
    ).trajectory
    with pytest.raises(SceneError, match="no key for a motion as option 'guess'"):
        save_task(task.with_options(guess=motion), folder / "again.toml")
    own = dataclasses.replace(galerkin(2), name="mine")
    with pytest.raises(SceneError, match="the custom scheme 'mine'"):
        save_task(task.with_options(scheme=own), folder / "again.toml")


def test_scheme_and_tolerance_objects_survive_a_file(folder: Path) -> None:
    task = load_task(write(folder, REACH)).with_options(scheme=galerkin(3))
    assert load_task(save_task(task, folder / "again.toml")).options.scheme == "galerkin-3"
    tolerances = [
        Tolerance(1e-5),
        Tolerance(1e-4 / 3, Quantity.FRAME, "tip"),
        Tolerance(1e-4, Quantity.FRAME, unit="mm"),
        Tolerance(1e-3, Quantity.JOINTS),
    ]
    for tolerance in tolerances:
        path = save_task(task.with_options(tolerance=tolerance), folder / "again.toml")
        options = load_task(path).options
        assert Tolerance.of(options.tolerance, task.scene.robot) == tolerance
        assert options.scheme is None


def test_a_file_names_a_scheme_or_a_tolerance(folder: Path) -> None:
    line = REACH.splitlines().index("duration = 1.0        # s") + 1
    sentence = refusal(folder, REACH.replace("duration", "tolerance = 1e-6\nduration", 1))
    assert f"line {line}: tolerance chooses the scheme and the intervals" in sentence
    without = REACH.replace('name = "galerkin-2"', "")
    assert load_task(write(folder, "tolerance = 1e-6\n" + without)).options.tolerance == 1e-6


MISTAKES = {
    "unknown key": ("duration =", "durration =", ["line 5", "`durration`", "'duration'"]),
    "unknown key in a table": ("intervals =", "interval =", ["`scheme.interval`", "'intervals'"]),
    "unknown key of an effect": (
        "acceleration =",
        "aceleration =",
        ["`effects.gravity.aceleration`", "'acceleration'"],
    ),
    "unknown effect": ("[effects.gravity]", "[effects.gravty]", ["'gravty'", "'gravity'"]),
    "unknown scheme": ("galerkin-2", "galrkin-2", ["line 16", "'galrkin-2'", "'galerkin-2'"]),
    "string for a number": ("= 1.0", '= "one"', ["`duration`", "positive number", '"one"']),
    "boolean for a number": ("= 1.0", "= true", ["`duration`", "true"]),
    "T = 0": ("= 1.0", "= 0.0", ["line 5", "`duration`", "positive number", "it is 0"]),
    "T < 0": ("= 1.0", "= -3.0", ["`duration`", "-3"]),
    "T without a unit": ("= 1.0", '= "1"', ["`duration`", "positive number", '"1"']),
    "unit of T": ("= 1.0", '= "1 sec"', ["line 5", "the duration '1 sec'", "'s'"]),
    "T = 0 s": ("= 1.0", '= "0 s"', ["line 5", "`duration`", "positive number", "'0 s'"]),
    "unit in a pair": ("= 1.0", '= ["1 s", "2 mn"]', ["line 5", "'2 mn'", "'min'"]),
    "pair that falls": ("= 1.0", '= ["2 s", 1.0]', ["line 5", "`duration`", "[lower, upper]"]),
    "T = inf": ("= 1.0", "= inf", ["`duration`", "inf"]),
    "N = 0": ("intervals = 16", "intervals = 0", ["line 17", "`scheme.intervals`", "0"]),
    "N is no whole number": ("intervals = 16", "intervals = 1.5", ["whole number", "1.5"]),
    "N is too large": ("intervals = 16", "intervals = 99999999", ["1,000,000"]),
    "no starts": ('"none"', '"none"\nstarts = 0', ["`starts`", "1 or more", "0"]),
    "NaN": ("q = [0.3, 0.7]", "q = [0.3, nan]", ["line 12", "`goal.q[1]`", "finite", "nan"]),
    "string in a list": ("q = [0.3, 0.7]", 'q = [0.3, "x"]', ["`goal.q[1]`", "finite", '"x"']),
    "list of lists": ("q = [0.3, 0.7]", "q = [[0.3, 0.7]]", ["`goal.q[0]`", "finite"]),
    "q too short": ("q = [0.3, 0.7]", "q = [0.3]", ["line 12", "goal.q", "shoulder", "elbow"]),
    "v too long": ("v = [0.5, -0.4]", "v = [1, 2, 3]", ["line 13", "goal.v", "elbow"]),
    "unknown joint": ("q = [0.3, 0.7]", "q = { elbo = 1, shoulder = 0 }", ["'elbo'", "'elbow'"]),
    "left-out joint": ("q = [0.3, 0.7]", "q = { elbow = 1 }", ["leaves out", "'shoulder'"]),
    "joint with two numbers": (
        "q = [0.3, 0.7]",
        "q = { elbow = [1, 2], shoulder = 0 }",
        ["`goal.q.elbow`", "one number"],
    ),
    "no goal": ("[goal]", "[gaol]", ["`gaol`", "'goal'"]),
    "start without q": (
        "q = [-1.57",
        "v = [-1.57",
        ["line 8", "`start` needs q, or a frame and its target"],
    ),
    "limits by an unknown word": ('"none"', '"urd"', ["line 6", "`limits`", '"urdf"', '"urd"']),
    "limits of another arm": ('"none"', '"panda"', ["line 6", "panda_joint1", "shoulder, elbow"]),
    "limits as a number": ('"none"', "3", ["line 6", "`limits`", '"urdf"', "3"]),
    "robot of the wrong type": ('robot = "two_link.urdf"', "robot = 3", ["`robot`", "3"]),
    "locked of the wrong type": ('"none"', '"none"\nlocked = "elbow"', ["`locked`", "list"]),
    "syntax": ("duration = ", "duration ", ["line 5", "column", "not valid TOML"]),
    "key given twice": ("limits =", "duration = 1\nlimits =", ["line 6", "not valid TOML"]),
    "effect that is no table": ("[effects.gravity]", "[effects]", ["effects.acceleration"]),
    "NaN in an effect": ("acceleration = 9.8", "acceleration = nan", ["finite", "nan"]),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_reported_with_its_line(mistake: str, folder: Path) -> None:
    old, new, expected = MISTAKES[mistake]
    assert REACH.count(old) >= 1
    sentence = refusal(folder, REACH.replace(old, new, 1))
    assert "scene.toml" in sentence
    for fragment in expected:
        assert fragment in sentence


def test_a_missing_table_is_named(folder: Path) -> None:
    text = REACH.replace("[start]", "[scheme]", 1).split("[scheme]")[0] + "goal.q = [0, 0]\n"
    assert "`start` is missing" in refusal(folder, text)


def test_an_empty_file_is_refused_for_its_missing_robot(folder: Path) -> None:
    assert "`robot` is missing" in refusal(folder, "")


def test_a_missing_urdf_is_named_with_the_line(folder: Path) -> None:
    sentence = refusal(folder, REACH.replace("two_link.urdf", "three_link.urdf"), ModelError)
    assert "line 4" in sentence
    assert "three_link.urdf" in sentence


def test_an_unknown_example_robot_gets_the_nearest_name(folder: Path) -> None:
    assert "'panda'" in refusal(folder, REACH.replace("two_link.urdf", "pandaa"), ModelError)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"\xff\xfe\x00", "UTF-8"),
        (b"a = " + b"[" * 100_000, "nested"),
        (b"a = 1" + b"0" * 5000, ""),
        (b"a." * 500_000 + b"b = 1", "line 1: more than 1,000 dots"),
        (b"a = 0x" + b"f" * 5000, "unknown key `a`"),
        (b"robot = 0x" + b"f" * 5000, "a number of too many digits"),
        (b"robot = 1 # " + b" " * 500_000 + b"\n", "`robot` must be"),
        (b" " * 500_000 + b"robot = 1", "line 1: `robot` must be"),
        (b'"a\\nb" = 1', "unknown key"),
        (b"x" * 10_000 + b" = 1", "unknown key"),
    ],
)
def test_an_invalid_file_is_refused(content: bytes, expected: str, tmp_path: Path) -> None:
    path = tmp_path / "strange.toml"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=r"strange\.toml") as raised:
        load_task(path)
    assert expected in str(raised.value)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 1_000


@pytest.mark.parametrize("name", ["nowhere.toml", "."])
def test_an_invalid_path_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError):
        load_task(tmp_path / name)


POTENTIAL = """
[effects.joint_limit_potential]
ranges = { elbow = [0.0, 2.0] }
"""


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("[0.0, 2.0]", "[0.0]", ["ranges", "elbow"]),
        ("[0.0, 2.0]", '[0.0, "2"]', ["ranges.elbow[1]", "finite number"]),
        ("[0.0, 2.0]", "[0.0, 1e308]", ["ranges.elbow[1]", "1e+308"]),
        ("[0.0, 2.0]", "[0.0, inf]", ["ranges.elbow[1]", "inf"]),
        ("[0.0, 2.0]", "[2.0, 0.0]", ["'elbow'", "line"]),
        ("elbow", "elbw", ["'elbw'", "'elbow'"]),
        ("ranges = {", "range = {", ["range", "'ranges'"]),
        (
            "ranges = { elbow = [0.0, 2.0] }",
            "width = 0.1",
            ["`effects.joint_limit_potential.ranges`"],
        ),
        ("ranges = { elbow = [0.0, 2.0] }", "ranges = 3", ["ranges", "table", "3"]),
    ],
)
def test_an_effect_is_checked_against_its_fields(
    old: str, new: str, expected: list[str], folder: Path
) -> None:
    sentence = refusal(folder, REACH + POTENTIAL.replace(old, new))
    for fragment in expected:
        assert fragment in sentence


def test_an_effect_takes_its_own_defaults(folder: Path) -> None:
    task = load_task(write(folder, REACH + POTENTIAL))
    expected = hovi.effects.JointLimitPotential({"elbow": (0.0, 2.0)})
    assert task.scene.effects[1] == expected


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"intervals": 0}, InputError),
        ({"intervalls": 8}, InputError),
        ({"starts": 0}, InputError),
        ({"seed": -1}, InputError),
        ({"scheme": "simpson"}, SchemeError),
        ({"limits": "urd"}, InputError),
        ({"limits": {"v": -1.0}}, InputError),
    ],
)
def test_options_of_a_task_are_valid_once_built(
    change: dict[str, Any], error: type[HoviError]
) -> None:
    with pytest.raises(error):
        load_task(example("two_link_reach")).with_options(**change)


@pytest.mark.parametrize("duration", [math.nan, 0.0])
def test_a_task_takes_a_positive_time(duration: float) -> None:
    with pytest.raises(InputError, match="duration"):
        dataclasses.replace(load_task(example("two_link_reach")), duration=duration)


LIMITS = """
[limits]
base = "none"
q = [[-3.0, 3.0], [0.0, 2.0]]
v = 3
a = { shoulder = 40.0, elbow = [-50.0, inf] }
tau = [20.0, 10.0]
margin = 0.25
tolerance = 1e-5
"""


def limited(table: str = LIMITS) -> str:
    return REACH.replace('limits = "none"\n', "") + table


def test_limits_are_a_number_a_list_pairs_or_by_joint(folder: Path) -> None:
    task = load_task(write(folder, limited(LIMITS.replace("margin = 0.25", ""))))
    limits = as_limits(task.scene.robot, task.options.limits)
    np.testing.assert_array_equal(limits.lower, [[-3, 0], [-3, -3], [-40, -50], [-20, -10]])
    np.testing.assert_array_equal(limits.upper, [[3, 2], [3, 3], [40, np.inf], [20, 10]])
    assert limits.tolerance == 1e-5


def test_a_list_may_hold_numbers_and_pairs(folder: Path) -> None:
    task = load_task(write(folder, limited("[limits]\nq = [3.0, [0.0, 2.0]]\n")))
    limits = as_limits(task.scene.robot, task.options.limits)
    np.testing.assert_array_equal([limits.lower[0], limits.upper[0]], [[-3, 0], [3, 2]])


def test_a_list_of_pairs_of_the_wrong_length_is_refused(folder: Path) -> None:
    sentence = refusal(folder, limited("[limits]\nq = [[0.0, 2.0]]\n"))
    for fragment in ("line 21", "limits.q", "shoulder, elbow"):
        assert fragment in sentence


def test_a_margin_is_taken_on_every_side(folder: Path) -> None:
    task = load_task(write(folder, limited()))
    limits = as_limits(task.scene.robot, task.options.limits)
    np.testing.assert_array_equal([limits.lower[0], limits.upper[0]], [[-1.5, 0.5], [1.5, 1.5]])


def test_a_table_of_limits_starts_from_the_urdf(folder: Path) -> None:
    task = load_task(write(folder, limited("[limits.v]\nelbow = 2.0\n")))
    limits = as_limits(task.scene.robot, task.options.limits)
    np.testing.assert_array_equal(limits.upper[1], [1000.0, 2.0])
    np.testing.assert_array_equal(limits.upper[3], [1000.0, 1000.0])


@pytest.mark.parametrize("table", [LIMITS, "[limits.v]\nelbow = 2.0\n"])
def test_saved_limits_are_read_back(table: str, folder: Path) -> None:
    task = load_task(write(folder, limited(table)))
    imposed = as_limits(task.scene.robot, task.options.limits)
    for given in (task.options.limits, imposed):
        changed = task.with_options(limits=given)
        again = load_task(save_task(changed, folder / "again.toml"))
        assert as_limits(again.scene.robot, again.options.limits).to_dict() == imposed.to_dict()


WRONG_LIMITS = {
    "unknown key": ("v = 3", "w = 3", ["line 24", "`limits.w`", "valid names", "'v'"]),
    "unknown base": (
        'base = "none"',
        'base = "urd"',
        ["`limits.base`", '"soft", "none" or'],
    ),
    "word for numbers": ("v = 3", 'v = "slow"', ["line 24", "`limits.v`", '"slow"', "pair"]),
    "boolean": ("v = 3", "v = true", ["`limits.v`", "true"]),
    "negative": ("v = 3", "v = -3", ["line 24", "limits.v of 'shoulder'", "positive", "-3"]),
    "NaN": ("v = 3", "v = nan", ["line 24", "limits.v", "nan"]),
    "falling pair": (
        "[0.0, 2.0]",
        "[2.0, 0.0]",
        ["line 23", "limits.q of 'elbow'", "lower < upper"],
    ),
    "three numbers": ("[0.0, 2.0]", "[1, 2, 3]", ["line 23", "limits.q of 'elbow'", "pair"]),
    "too short": ("tau = [20.0, 10.0]", "tau = [20.0]", ["line 26", "shoulder, elbow"]),
    "unknown joint": ("elbow = [-50.0", "elbo = [-50.0", ["line 25", "'elbo'", "'elbow'"]),
    "word in a list": ("[20.0, 10.0]", '[20.0, "x"]', ["line 26", "`limits.tau[1]`", '"x"']),
    "word by joint": ("shoulder = 40.0", 'shoulder = "x"', ["`limits.a.shoulder`", '"x"']),
    "margin": ("margin = 0.25", "margin = 0.5", ["line 27", "`limits.margin`", "0.5"]),
    "tolerance": ("tolerance = 1e-5", "tolerance = 0", ["line 28", "`limits.tolerance`"]),
}


@pytest.mark.parametrize("mistake", WRONG_LIMITS)
def test_a_mistake_in_limits_is_reported_with_its_line(mistake: str, folder: Path) -> None:
    old, new, expected = WRONG_LIMITS[mistake]
    assert LIMITS.count(old) == 1
    sentence = refusal(folder, limited(LIMITS.replace(old, new)))
    for fragment in ("scene.toml", *expected):
        assert fragment in sentence


def test_an_unknown_example_gets_the_nearest_names() -> None:
    with pytest.raises(SceneError, match="two_link_swing_up"):
        example("two_link_swingup")


SRDF = """<robot name="two_link"><group_state name="ready" group="arm">
<joint name="shoulder" value="-1.5"/></group_state></robot>"""


def test_an_end_may_be_the_name_of_a_pose(folder: Path, tmp_path: Path) -> None:
    (folder / "poses.srdf").write_text(SRDF)
    head, rest = REACH.split("[start]")
    rest = rest.replace(rest.split("[goal]")[0], '\nq = "ready"\n\n')
    text = f'srdf = "poses.srdf"\n{head}[start]{rest}'
    task = load_task(write(folder, text))
    np.testing.assert_array_equal(task.start.q, [-1.5, 0.0])
    again = load_task(save_task(task, tmp_path / "copy" / "scene.toml"))
    assert list(again.scene.robot.poses) == ["ready"]
    sentence = refusal(
        folder, f'srdf = "poses.srdf"\n{head}[start]{rest}'.replace("ready", "raedy")
    )
    assert "did you mean 'ready'?" in sentence
    assert "line" in sentence


@pytest.mark.parametrize("tolerance", [1e-6, "0.1 mm", "0.01 deg"])
def test_a_tolerance_survives_a_file(folder: Path, tolerance: float | str) -> None:
    task = load_task(write(folder, REACH))
    wanted = task.with_options(tolerance=tolerance)
    assert load_task(save_task(wanted, folder / "again.toml")).options.tolerance == tolerance


BALL = """
margin = 0.03
self_collision = false
[[obstacles]]
name = "ball"
kind = "sphere"
position = [0.7, 0.0, -1.65]
radius = 0.15
[[obstacles]]
kind = "box"
size = [4, 4, 0.1]
position = [0.0, 0.0, -3.0]
"""


def with_obstacles(text: str) -> str:
    keys, tables = BALL.split("[[", 1)
    return f"{keys}{text}\n[[{tables}"


def test_obstacles_are_read_and_written(folder: Path, tmp_path: Path) -> None:
    task = load_task(write(folder, with_obstacles(REACH)))
    assert [each.kind for each in task.options.clearance.obstacles] == ["sphere", "box"]
    assert [each.name for each in task.options.clearance.obstacles] == ["ball", "box 2"]
    assert task.options.clearance.margin == 0.03
    again = load_task(save_task(task, tmp_path / "copy" / "scene.toml"))
    assert again.options.clearance.to_dict() == task.options.clearance.to_dict()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"sphere"', '"spere"', "did you mean 'sphere'"),
        ("radius = 0.15", "radius = -1", "'ball': `radius` of a sphere must be positive"),
        ("radius = 0.15", "radus = 1", "did you mean 'radius'"),
        ("margin = 0.03", "margin = -0.03", "`margin` must be a length of 0 or more"),
        ("self_collision = false", "self_collision = 1", "`self_collision` must be true or false"),
    ],
)
def test_a_wrong_obstacle_is_one_sentence(folder: Path, old: str, new: str, words: str) -> None:
    sentence = refusal(folder, with_obstacles(REACH).replace(old, new))
    assert words in sentence
    assert "line" in sentence


def test_options_under_their_old_names_warn() -> None:
    task = load_task(example("two_link_reach"))
    with pytest.warns(DeprecationWarning, match=r"task.intervals is now task.options.intervals"):
        assert task.intervals == task.options.intervals
    with pytest.raises(AttributeError, match="no attribute 'intervalls'"):
        _ = task.intervalls


WORLD = """
[[obstacles]]
name = "floor"
kind = "half_space"
normal = [0, 0, 1]
position = [0, 0, -9]
[[obstacles]]
kind = "cylinder"
radius = 0.1
length = 1.0
position = [5.0, 0.0, 0.0]
[[obstacles]]
kind = "convex_hull"
points = [[5, 0, 0], [6, 0, 0], [5, 1, 0], [5, 0, 1]]
[[obstacles]]
kind = "mesh"
file = "parts/wedge.obj"
position = [5.0, 0.0, 0.0]
scale = 0.5
[[obstacles]]
kind = "point_cloud"
points = [[5, 0, 0], [6, 0, 0]]
radius = 0.1
[[obstacles]]
kind = "file"
name = "left"
file = "parts/kitchen.yaml"
position = [9.0, 0.0, 0.0]
"""


def test_every_kind_of_obstacle_is_read_and_written(folder: Path, tmp_path: Path) -> None:
    """Files are relative to the scene, and found again from another folder."""
    (folder / "parts").mkdir()
    (folder / "parts" / "wedge.obj").write_text(WEDGE)
    (folder / "parts" / "kitchen.yaml").write_text(PLANNING_SCENE)
    task = load_task(write(folder, REACH + WORLD))
    names = [each.name for each in task.options.clearance.obstacles]
    assert names == [
        *("floor", "cylinder 2", "convex hull 3", "mesh 4", "point cloud 5"),
        *("left/table", "left/table 2", "left/ball", "left/wedge"),
    ]
    again = load_task(save_task(task, tmp_path / "copy" / "scene.toml"))
    assert '"../parts/wedge.obj"' in (tmp_path / "copy" / "scene.toml").read_text()
    assert again.options.clearance.to_dict() == task.options.clearance.to_dict()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("parts/wedge.obj", "wedge.obj", "there is no mesh"),
        ("parts/kitchen.yaml", "kitchen.yaml", "there is no file"),
        ('file = "parts/kitchen.yaml"', "", "obstacles of a file need `file`"),
        ('name = "left"', "rpi = [0, 0, 0]", "did you mean 'rpy'"),
        ("position = [9.0", "package_dirs = 7\nposition = [9.0", "a list of names"),
        ('kind = "file"', 'kind = "files"', "did you mean 'file'"),
    ],
)
def test_a_wrong_file_of_obstacles_is_one_sentence(
    folder: Path, old: str, new: str, words: str
) -> None:
    (folder / "parts").mkdir()
    (folder / "parts" / "wedge.obj").write_text(WEDGE)
    (folder / "parts" / "kitchen.yaml").write_text(PLANNING_SCENE)
    sentence = refusal(folder, (REACH + WORLD).replace(old, new))
    assert words in sentence
    assert "line" in sentence


GRASPED = """
[[obstacles]]
name = "table"
kind = "box"
size = [1, 1, 0.1]
position = [5.0, 0.0, 0.0]
[[grasped]]
name = "box"
frame = "tip"
mass = 2.0
position = [0.1, 0.0, 0.0]
shape = { kind = "box", size = [0.1, 0.1, 0.1], position = [0, 0, 0] }
may_touch = ["table"]
[[grasped]]
name = "lamp"
frame = "upper_arm"
mass = 0.1
center = [0.0, 0.0, 0.1]
inertia = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]
[[grasped.shape]]
kind = "sphere"
position = [0.0, 0.0, 0.2]
radius = 0.1
[[grasped.shape]]
kind = "cylinder"
position = [0.0, 0.0, 0.1]
radius = 0.01
length = 0.2
"""


def test_grasped_objects_are_read_and_written(folder: Path, tmp_path: Path) -> None:
    """A goal may name the frame of one, and a simulation has their masses."""
    text = REACH[: REACH.index("[goal]")] + REACH[REACH.index("[scheme]") :]
    goal = '[goal]\nframe = "box"\nposition = [1.5, 0.0, -1.0]\n'
    task = load_task(write(folder, text + goal + GRASPED))
    first, second = task.options.grasped
    assert first.may_touch == ("table",)
    assert task.options.clearance.may_touch == (("box", "table"),)
    assert [each.kind for each in second.shapes] == ["sphere", "cylinder"]
    again = load_task(save_task(task, tmp_path / "copy" / "scene.toml"))
    assert again.options.grasped == task.options.grasped
    more = pin.computeTotalMass(task.held_scene.model) - pin.computeTotalMass(task.scene.model)
    assert more == pytest.approx(2.1)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('frame = "tip"', 'frame = "tipp"', "did you mean 'tip'"),
        (
            "mass = 2.0",
            "mass = -2.0",
            " must be positive, in kg, got -2",
        ),
        ("mass = 2.0", "mas = 2.0", "did you mean 'mass'"),
        ('{ kind = "box"', '{ kind = "boks"', "object 'box': there is no obstacle of kind 'boks'"),
        ('{ kind = "box", size = [0.1, 0.1, 0.1], position = [0, 0, 0] }', "3", "must be a table"),
        ('name = "lamp"', 'name = "box"', "two grasped objects have the name 'box'"),
        ('["table"]', '["tabel"]', "nothing that may touch is named 'tabel'"),
    ],
)
def test_a_wrong_grasped_object_is_one_sentence(
    folder: Path, old: str, new: str, words: str
) -> None:
    sentence = refusal(folder, (REACH + GRASPED).replace(old, new))
    assert words in sentence
    assert "line" in sentence


MOVING = """
[[obstacles]]
name = "cart"
kind = "box"
size = [1, 1, 1]
position = [0, 0, 0.5]
path = { times = [0, 1], positions = [[9, 0, 0], [9, 5, 0]], rpy = [[0, 0, 0], [0, 0, 1]] }
[[obstacles]]
kind = "file"
file = "kitchen.yaml"
path.times = [0.0, 1.0]
path.positions = [[9.0, 0.0, 0.0], [9.0, 5.0, 0.0]]
"""


def test_the_path_of_an_obstacle_is_read_and_written(folder: Path, tmp_path: Path) -> None:
    (folder / "kitchen.yaml").write_text(PLANNING_SCENE)
    task = load_task(write(folder, REACH + MOVING))
    cart, *others = task.options.clearance.obstacles
    assert cart.motion is not None
    np.testing.assert_allclose(cart.motion.pose(0.5).translation, [9.0, 2.5, 0.0])
    assert all(each.motion is not None for each in others)
    again = load_task(save_task(task, tmp_path / "copy" / "scene.toml"))
    assert again.options.clearance.to_dict() == task.options.clearance.to_dict()


def test_a_wrong_path_is_one_sentence(folder: Path) -> None:
    (folder / "kitchen.yaml").write_text(PLANNING_SCENE)
    text = (REACH + MOVING).replace("times = [0, 1]", "times = [1, 0]")
    assert "obstacle 'cart': the times of a path of an obstacle must ascend" in refusal(
        folder, text
    )
