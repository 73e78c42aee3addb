"""Limit sets: claims about the data, whose joints they fit, and plans within them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.conditions.joint_quantity import QUANTITIES
from hovi.errors import InputError
from hovi.planning.problem.arms import limit_set as module
from hovi.planning.problem.arms.limit_set import NAMES, LimitSet, limit_set
from hovi.planning.problem.limits import KINDS, as_limits, urdf_limits
from hovi.robot.robot import Robot
from samples.manifold_robots import chain

Array = npt.NDArray[np.float64]

SETS = hovi.limit_sets()
DOCS = Path(__file__).resolve().parents[4] / "docs"
FINGERS = ["panda_finger_joint1", "panda_finger_joint2"]
MAKERS = {
    "frankaemika.github.io/docs",
    "github.com/frankaemika/",
    "github.com/UniversalRobots/",
    "github.com/xArm-Developer/",
    "github.com/Kinovarobotics/",
}


# The data

every_set = pytest.mark.parametrize("arm", SETS.values(), ids=NAMES)


def test_every_file_has_a_name_and_every_name_a_file() -> None:
    assert sorted(NAMES) == sorted(p.stem for p in Path(module.__file__).parent.glob("*.toml"))
    assert list(SETS) == list(NAMES)


@every_set
def test_every_kind_is_confirmed_by_a_source_of_the_maker(arm: LimitSet) -> None:
    makers = [s for s in arm.sources if any(maker in s.url for maker in MAKERS)]
    assert {kind for source in makers for kind in source.kinds} == set(arm.limits)
    for source in arm.sources:
        assert source.title
        assert re.fullmatch(r"https://\S+", source.url)
        assert re.search(r"\d", source.version)
        assert set(source.kinds) <= set(arm.limits)


@every_set
def test_every_joint_has_a_sane_range_of_every_kind(arm: LimitSet) -> None:
    largest = {"q": 7.0, "v": 7.0, "a": 25.0, "tau": 400.0, "jerk": 1e4, "torque_rate": 1e3}
    smallest = {"q": 0.05, "v": 0.5, "a": 0.3, "tau": 5.0, "jerk": 400.0, "torque_rate": 900.0}
    assert {"q", "v"} <= set(arm.limits) <= set(QUANTITIES)
    for kind, pairs in arm.limits.items():
        assert len(pairs) == len(arm.joints)
        for low, high in pairs:
            assert low < high
            if kind == "q" and low == -high == -np.inf:
                continue
            assert smallest[kind] <= max(-low, high) <= largest[kind]
            if kind != "q":
                assert low == -high


@every_set
def test_joints_have_distinct_names(arm: LimitSet) -> None:
    for names in (arm.joints, *arm.aliases):
        assert len(set(names)) == len(names) == len(arm.joints)


@every_set
def test_what_is_not_published_is_said(arm: LimitSet) -> None:
    assert set(arm.unpublished) == set(QUANTITIES) - set(arm.limits)
    for kind in arm.unpublished:
        words = {"a": "acceleration"}.get(kind, QUANTITIES[kind])
        assert words in arm.note.lower()


def test_panda_has_the_numbers_of_libfranka() -> None:
    upper = {k: [pair[1] for pair in pairs] for k, pairs in SETS["panda"].limits.items()}
    assert upper["v"] == [2.175] * 4 + [2.61] * 3
    assert upper["a"] == [15, 7.5, 10, 12.5, 15, 20, 20]
    assert upper["jerk"] == [7500, 3750, 5000, 6250, 7500, 10000, 10000]
    assert upper["tau"] == [87] * 4 + [12] * 3
    assert upper["torque_rate"] == [1000] * 7


PAIRS = [("panda", "panda"), ("xarm7", "xarm7"), ("j2s6s200", "kinova"), ("ur5", "ur5")]


@pytest.mark.parametrize(("name", "example"), PAIRS)
def test_positions_velocities_and_torques_are_those_of_example_robot_data(
    name: str, example: str
) -> None:
    """Its URDFs are older copies: ur5's velocities are rounded up there, to 3.15 and 3.2 rad/s."""
    robot = hovi.load_robot(example, locked=FINGERS if example == "panda" else [])
    ours, urdf = as_limits(robot, name), urdf_limits(robot)
    for kind, slack in (("q", 1e-6), ("v", 0.07 if name == "ur5" else 1e-6), ("tau", 1e-9)):
        row = KINDS.index(kind)
        np.testing.assert_allclose(ours.upper[row], urdf.upper[row], atol=slack)
        np.testing.assert_allclose(ours.lower[row], urdf.lower[row], atol=slack)


def test_the_documentation_cites_every_source() -> None:
    text = (DOCS / "limits_of_arms.md").read_text()
    for name, arm in SETS.items():
        assert f"`{name}`" in text
        for source in arm.sources:
            repository = "/".join(source.url.split("/")[:5])
            assert repository in text or source.url.partition("#")[0] in text


# On a robot


def test_joints_that_the_arm_does_not_have_keep_the_limits_of_the_urdf() -> None:
    robot = hovi.load_robot("panda")
    limits, urdf = as_limits(robot, "panda"), urdf_limits(robot)
    fingers = [robot.coordinate_names.index(name) for name in FINGERS]
    for row in (0, 1, 3):
        np.testing.assert_array_equal(limits.upper[row, fingers], urdf.upper[row, fingers])
    assert np.isinf(limits.upper[2, fingers]).all()
    assert limits.upper[2, :7].tolist() == [15, 7.5, 10, 12.5, 15, 20, 20]


def test_joints_of_the_arm_may_be_locked(panda: Robot) -> None:
    robot = hovi.load_robot("panda", locked=[*FINGERS, "panda_joint3", "panda_joint7"])
    whole, part = as_limits(panda, "panda"), as_limits(robot, "panda")
    kept = [0, 1, 3, 4, 5]
    np.testing.assert_array_equal(part.upper, whole.upper[:, kept])
    np.testing.assert_array_equal(part.lower, whole.lower[:, kept])


def test_joints_may_have_the_names_of_an_alias(panda: Robot) -> None:
    model = pin.Model(panda.model)
    for i, name in enumerate(list(model.names)):
        model.names[i] = name.replace("panda_", "fer_")
    renamed = hovi.load_robot(model)
    assert renamed.joint_names[0] == "fer_joint1"
    np.testing.assert_array_equal(
        as_limits(renamed, "panda").upper, as_limits(panda, "panda").upper
    )


def test_what_is_not_published_stays_unlimited(ur5: Robot) -> None:
    limits = as_limits(ur5, "ur5")
    assert np.isinf(limits.upper[KINDS.index("a")]).all()
    assert np.isfinite(limits.upper[[KINDS.index(k) for k in ("q", "v", "tau")]]).all()


def test_a_set_is_the_base_of_other_limits(panda: Robot) -> None:
    given = {"base": "panda", "v": {"panda_joint2": 1.0}, "margin": 0.01}
    limits, whole = as_limits(panda, given), as_limits(panda, "panda")
    assert limits.upper[1, 1] == pytest.approx(0.98)
    np.testing.assert_allclose(limits.upper[2], 0.98 * whole.upper[2])


def test_continuous_joints_have_no_position_limits() -> None:
    robot = hovi.load_robot("kinova")
    bounds = limit_set("j2s6s200").on(robot)
    assert set(bounds) == set(QUANTITIES)
    free = [joint for joint, (low, high) in bounds["q"].items() if low == -high == -np.inf]
    assert free == [f"j2s6s200_joint_{i}" for i in (1, 4, 6)]


def test_a_joint_that_is_continuous_in_the_urdf_has_none_either() -> None:
    model = chain([pin.JointModelRX()] * 5 + [pin.JointModelRUBZ()])
    for i, name in enumerate(SETS["ur5"].joints, start=1):
        model.names[i] = name
    limits = as_limits(hovi.load_robot(model), "ur5")
    assert np.isinf(limits.upper[0]).tolist() == [False] * 5 + [True]
    assert np.isfinite(limits.upper[1]).all()


def test_a_robot_with_other_joints_is_refused_in_one_sentence(ur5: Robot) -> None:
    with pytest.raises(InputError, match=r"panda_joint1, .* but robot 'ur5' has shoulder") as no:
        as_limits(ur5, "panda")
    assert "choose another set or give limits by joint" in str(no.value)
    with pytest.raises(InputError, match=r"joints joint1, .* xArm 7"):
        as_limits(hovi.load_robot("z1"), "xarm7")


def test_a_robot_that_lacks_a_joint_is_refused(panda: Robot) -> None:
    model = pin.buildReducedModel(panda.model, [7], pin.neutral(panda.model))
    with pytest.raises(InputError, match="panda_joint7"):
        as_limits(hovi.load_robot(model), "panda")


def test_unknown_names_get_a_hint(panda: Robot) -> None:
    with pytest.raises(InputError, match="did you mean 'panda'"):
        as_limits(panda, "pnda")
    wrong: Any = 3
    with pytest.raises(InputError, match="no limits of an arm 3"):
        limit_set(wrong)


def test_jerk_and_torque_rate_are_for_order_3() -> None:
    assert SETS["panda"].beyond(2) == ("jerk", "torque_rate")
    assert SETS["panda"].beyond(3) == ()
    assert SETS["ur5e"].beyond(2) == ()


# Plans

MOVES = {
    "panda": ("panda", [0, -0.5, 0, -2, 0, 1.6, 0.7], [0.7, 0.1, -0.3, -1.5, 0.3, 1.9, 0.2], 0.6),
    "xarm7": ("xarm7", [0, -0.5, 0, 1, 0, 1, 0], [0.6, 0.2, 0.3, 1.7, -0.3, 1.4, 0.5], 0.52),
    "ur5": ("ur5", [0, -1.5, 1, 0.2, 0.1, 0], [1.5, -1.0, 1.8, -0.3, 0.6, 0.9], 0.6),
}


def reached(robot: Robot, trajectory: hovi.Trajectory, armature: float) -> dict[str, Array]:
    """All kinds at 8001 samples: torques by pin.rnea, jerk and torque rate by differences."""
    t = np.linspace(0, trajectory.duration, 8001)
    q, v, a, _ = trajectory.sample(t)
    model, data = robot.model.copy(), robot.model.createData()
    model.gravity.linear = np.array([0, 0, -9.81])
    model.armature = np.full(model.nv, armature)
    tau = np.array([pin.rnea(model, data, *point) for point in zip(q, v, a, strict=True)])
    jerk, rate = (np.diff(x, axis=0) / t[1] for x in (a, tau))
    return {"q": q, "v": v, "a": a, "tau": tau, "jerk": jerk, "torque_rate": rate}


def least_room(values: dict[str, Array], arm: LimitSet, kinds: Iterable[str]) -> dict[str, float]:
    """The least distance to a limit of each kind, as a fraction of its range."""
    room = {}
    for kind in kinds:
        low, high = np.array(arm.limits[kind]).T
        inside = np.minimum(values[kind] - low, high - values[kind])
        room[kind] = float(np.min(inside / (high - low)))
    return room


@pytest.mark.parametrize("name", MOVES)
def test_a_plan_holds_them_at_samples_of_its_own(name: str) -> None:
    example, start, goal, duration = MOVES[name]
    robot = hovi.load_robot(example, locked=FINGERS if example == "panda" else [])
    scene = hovi.Scene(robot, [hovi.effects.Gravity(), hovi.effects.Armature(1.0)])
    found = hovi.plan(
        scene, start, goal, duration=duration, limits=name, intervals=16, self_collision=False
    )
    assert found.success, found.message
    arm = SETS[name]
    kinds = arm.limits.keys() - set(arm.beyond(2))
    room = least_room(reached(robot, found.trajectory, 1.0), arm, kinds)
    assert -1e-6 < min(room.values()) < 0.01, room


SMOOTH = {
    "panda": ([0, -0.5, 0, -2, 0, 1.6, 0.7], [0.7, 0.1, -0.3, -1.5, 0.3, 1.9, 0.2], 0.9),
    "xarm7": ([0, -0.5, 0, 1, 0, 1, 0], [0.6, 0.2, 0.3, 1.7, -0.3, 1.4, 0.5], 1.0),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_a_smooth_plan_holds_those_on_jerk_and_torque_rate_too(name: str) -> None:
    start, goal, duration = SMOOTH[name]
    robot = hovi.load_robot(name, locked=FINGERS if name == "panda" else [])
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    found = hovi.plan(
        scene, start, goal, duration=duration, limits=name, smooth=True, self_collision=False
    )
    assert found.success, found.message
    values, arm = reached(robot, found.trajectory, 0.0), SETS[name]
    room = least_room(values, arm, arm.limits)
    assert -1e-6 < min(room.values()) < 0.01, room
    assert np.abs(values["a"][[0, -1]]).max() < 1e-6
