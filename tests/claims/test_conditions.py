"""Conditions of a user: what is asked holds between the nodes, too, or there is no success."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.errors import InputError, SceneError
from hovi.study.running.measures import row_of

START, GOAL = np.array([0, -1.5, 1.5, 0, 0, 0.0]), np.array([1.0, -1.0, 1.0, 0.5, 0.5, 0.5])
OPTIONS: dict[str, Any] = {"self_collision": False}
MODEL = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity()]).model


def powers(motion: hovi.Trajectory, robot: hovi.Robot) -> np.ndarray:
    """tau v of every joint at many times, by Pinocchio alone, shape (M, nv)."""
    at = motion.sample(np.linspace(0.0, motion.duration, 4001))
    data = robot.model.createData()
    jets = zip(at.q, at.v, at.a, strict=True)
    return np.array([pin.rnea(robot.model, data, q, v, a) * v for q, v, a in jets])


def heights(motion: hovi.Trajectory, robot: hovi.Robot, t: np.ndarray) -> np.ndarray:
    """The height of tool0, shape (M,)."""
    return np.array([robot.frame_pose("tool0", q)[2, 3] for q in motion.configurations(t)])


def power(most: float, **more: Any) -> hovi.Condition:
    return hovi.Condition("tau * v", hovi.Between(-most, most), name="power", unit="W", **more)


@pytest.fixture(scope="module")
def scene(ur5: hovi.Robot) -> hovi.Scene:
    return hovi.Scene(ur5, [hovi.effects.Gravity()])


@pytest.fixture(scope="module")
def free(scene: hovi.Scene) -> hovi.Solution:
    """The motion without any condition: it takes 47 W."""
    return hovi.plan(scene, START, GOAL, 1.5, **OPTIONS)


@pytest.fixture(scope="module")
def limited(scene: hovi.Scene) -> hovi.Solution:
    return hovi.plan(scene, START, GOAL, 1.5, limits={"power": 28.0}, **OPTIONS)


def test_a_limit_on_the_power_holds_between_the_nodes(
    free: hovi.Solution, limited: hovi.Solution, ur5: hovi.Robot
) -> None:
    assert np.abs(powers(free.trajectory, ur5)).max() > 45.0
    assert limited.success, limited.message
    assert np.abs(powers(limited.trajectory, ur5)).max() <= 28.0 + 2e-6 * 56.0
    assert free.cost < limited.cost < 1.1 * free.cost
    assert limited.accuracy is not None
    assert limited.accuracy.reached
    assert 0.0 <= limited.margins().conditions["power"] < 1e-3


def test_an_inactive_limit_changes_nothing(scene: hovi.Scene, free: hovi.Solution) -> None:
    loose = hovi.plan(scene, START, GOAL, 1.5, conditions=[power(500.0)], **OPTIONS)
    assert loose.success
    assert loose.cost == pytest.approx(free.cost, rel=1e-5)
    most = np.abs(powers(loose.trajectory, scene.robot)).max()
    assert loose.margins().conditions["power"] == pytest.approx((500.0 - most) / 1000.0, rel=1e-3)


def test_a_formula_a_function_and_a_key_of_limits_are_one_condition(
    scene: hovi.Scene, limited: hovi.Solution
) -> None:
    def product(v: Any, tau: Any) -> Any:
        return tau * v

    given: tuple[str | Callable[..., Any], ...] = ("tau * v", product)
    for function in given:
        asked = hovi.Condition(function, hovi.Between(-28.0, 28.0), name="power")
        found = hovi.plan(scene, START, GOAL, 1.5, conditions=[asked], **OPTIONS)
        assert found.cost == pytest.approx(limited.cost, rel=1e-6)


def test_replan_and_advance_keep_a_limit_on_the_power(
    limited: hovi.Solution, ur5: hovi.Robot
) -> None:
    later = limited.advance(0.3)
    for motion in (
        limited.replan(goal=GOAL + 0.03),
        later,
        later.advance(0.2, duration=1.2),
        limited.replan(start=START + 0.02),
    ):
        assert motion.success, motion.message
        assert np.abs(powers(motion.trajectory, ur5)).max() <= 28.0 + 2e-6 * 56.0


def test_too_little_power_is_infeasible_and_named(scene: hovi.Scene) -> None:
    found = hovi.plan(scene, START, GOAL, 1.5, limits={"power": 1.0}, **OPTIONS)
    assert found.status is hovi.Status.INFEASIBLE
    assert not found.usable
    for words in ("condition 'power' of 'shoulder_lift_joint' reaches", " W at t = ", "is -1"):
        assert words in found.violation, found.violation


def test_a_motion_that_exceeds_a_condition_is_no_success(
    free: hovi.Solution, ur5: hovi.Robot
) -> None:
    """Its largest power, in words."""
    asked = dataclasses.replace(free.problem, conditions=[power(40.0)])  # type: ignore[type-var]
    judged = dataclasses.replace(free, problem=asked)
    P = powers(free.trajectory, ur5)
    i = int(np.abs(P).max(axis=0).argmax())
    assert judged.violation.startswith(f"condition 'power' of entry {i} reaches -46.7")
    assert not judged.usable


@pytest.mark.parametrize("smooth", [False, True])
def test_the_power_of_a_small_robot_is_limited(two_link: hovi.Robot, smooth: bool) -> None:
    """In segments, smooth or not, and with every joint's own bounds."""
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    names = two_link.joint_names
    alone = hovi.plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, limits="none", smooth=smooth, **OPTIONS)
    P = powers(alone.trajectory, two_link)
    most = 0.8 * np.abs(P).max(axis=0)
    limits = {"base": "none", "power": dict(zip(names, most.tolist(), strict=True))}
    found = hovi.plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, limits=limits, smooth=smooth, **OPTIONS)
    assert found.success, found.message
    assert (np.abs(powers(found.trajectory, two_link)) <= most * (1 + 4e-6)).all()
    assert found.cost > alone.cost


def test_a_sequence_keeps_the_power(scene: hovi.Scene) -> None:
    segments = [hovi.Segment(GOAL, 1.5), hovi.Segment(START, 1.5)]
    found = hovi.plan_sequence(scene, START, segments, limits={"power": 28.0}, **OPTIONS)
    assert found.success, found.message
    assert np.abs(powers(found.trajectory, scene.robot)).max() <= 28.0 + 2e-6 * 56.0
    segments[0] = hovi.Segment(GOAL, 1.5, limits={"power": 28.0})
    with pytest.raises(InputError, match="limits on the power must be the same in all segments"):
        hovi.plan_sequence(scene, START, segments, **OPTIONS)


@pytest.mark.parametrize("segments", [1, 2])
def test_limits_of_one_segment_leave_the_power_of_the_whole(
    scene: hovi.Scene, ur5: hovi.Robot, segments: int
) -> None:
    own = {"base": "none", "v": 1.1}
    given = [hovi.Segment(GOAL, 1.5, limits=own), hovi.Segment(START, 1.5)][:segments]
    found = hovi.plan_sequence(scene, START, given, limits={"power": 28.0}, **OPTIONS)
    assert found.success, found.message
    assert np.abs(powers(found.trajectory, ur5)).max() <= 28.0 + 2e-6 * 56.0
    first, later = (np.linspace(a, a + 1.5, 1001) for a in (0.0, 1.5))
    assert np.abs(found.trajectory.sample(first).v).max() <= 1.1 + 1e-5
    assert segments == 1 or np.abs(found.trajectory.sample(later).v).max() > 1.2


@pytest.mark.filterwarnings("ignore:Self-collision was left out")
@pytest.mark.parametrize(
    "limits",
    [
        {"power": 28.0},
        {"base": "none", "power": 28.0},
        {"power": {"elbow_joint": [-np.inf, 20.0]}},
        {"power": 28.0, "margin": 0.1, "tolerance": 1e-4},
    ],
    ids=["with others", "alone", "of one side", "with a margin"],
)
def test_a_saved_motion_keeps_its_limit_on_the_power(
    scene: hovi.Scene, ur5: hovi.Robot, tmp_path: Path, limits: dict[str, Any]
) -> None:
    found = hovi.plan(scene, START, GOAL, 1.5, limits=limits, **OPTIONS)
    assert found.success, found.message
    found.trajectory.save(tmp_path / "motion.npz")
    motion = hovi.Trajectory.load(tmp_path / "motion.npz")
    saved = motion.metadata["limits"]
    asked = hovi.as_limits(ur5, limits).conditions[0]
    again = hovi.Limits.from_dict(saved, ur5).conditions[0]
    assert (again.name, again.of, again.tolerance) == ("power", asked.of, asked.tolerance)
    for side in ("lower", "upper"):
        np.testing.assert_array_equal(getattr(again.on, side), getattr(asked.on, side))
    with pytest.raises(InputError, match="limits on the power need the robot: give it as `on`"):
        hovi.Limits.from_dict(saved)
    hovi.write_report(motion, tmp_path / "report.html")
    report = (tmp_path / "report.html").read_text()
    assert "margin to the limits on power</td>" in report
    assert "none were imposed" not in report


def test_limits_on_the_power_need_a_robot_with_inertia(tmp_path: Path) -> None:
    urdf = """<robot name="massless"><link name="base"/><link name="arm"/>
    <joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="3" effort="50"/></joint></robot>"""
    (tmp_path / "massless.urdf").write_text(urdf)
    scene = hovi.Scene(hovi.load_robot(tmp_path / "massless.urdf"))
    with pytest.raises(InputError, match="limits on the power need torques, and joints of this"):
        hovi.plan(scene, [0.0], [1.0], 1.0, limits={"power": 5.0}, objective="jerk")


def test_limits_have_conditions_of_their_own_keys_alone(ur5: hovi.Robot) -> None:
    """A bound that changes with time was saved as that at its start, and had a free duration."""
    limits = hovi.as_limits(ur5, {"power": 20.0})
    known = limits.conditions[0]
    varying = dataclasses.replace(known, on=hovi.Between(-9.0, lambda t: 28.0 - t), scale=9.0)
    for each in (varying, dataclasses.replace(known, name="other")):
        with pytest.raises(InputError, match="limits have conditions on the power alone"):
            dataclasses.replace(limits, conditions=(each,))
    upper = limits.with_margin(0.1).conditions[0].on.upper
    np.testing.assert_allclose(np.asarray(upper), 16.0)


def test_the_margin_of_a_study_and_the_bound_of_a_certificate_know_the_power(
    free: hovi.Solution, ur5: hovi.Robot
) -> None:
    known = hovi.as_limits(ur5, {"base": "none", "power": 28.0})
    problem = dataclasses.replace(free.problem, limits=known)  # type: ignore[type-var]
    judged = dataclasses.replace(free, problem=problem)
    most = np.abs(powers(free.trajectory, ur5)).max()
    row = row_of(judged, "", 1.0, None)
    assert row.margin == pytest.approx((28.0 - most) / 56.0, rel=1e-3)
    sentence = hovi.certify(judged, estimate=False).missing["bound"]
    assert "the curve exceeds condition 'power' by 3" in sentence


@pytest.mark.parametrize("own", [{}, {"jerk": 500.0}], ids=["alike", "one with a jerk"])
def test_segments_with_the_same_power_keep_it(
    scene: hovi.Scene, ur5: hovi.Robot, own: dict[str, float]
) -> None:
    limits = {"power": 28.0}, {"power": 28.0, **own}
    segments = [
        hovi.Segment(q, 1.5, limits=each) for q, each in zip((GOAL, START), limits, strict=True)
    ]
    found = hovi.plan_sequence(scene, START, segments, smooth=bool(own), **OPTIONS)
    assert found.success, found.message
    assert np.abs(powers(found.trajectory, ur5)).max() <= 28.0 + 2e-6 * 56.0
    assert found.problem is not None
    assert found.problem.limits is not None
    assert [each.name for each in found.problem.limits.conditions] == ["power"]


def test_a_bound_that_begins_later_holds_between_the_points_too(two_link: hovi.Robot) -> None:
    """It is infinite at first: the check between the points left it out altogether."""
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    most = 1.6

    def upper(t: float) -> float:
        return np.inf if t < 0.2 else most

    late = hovi.Condition('v["shoulder"]', hovi.Between(upper=upper), name="late", scale=1.0)
    ends = {"start": [0.0, 0.0], "goal": [1.0, 0.5], "duration": 1.0, "limits": "none"}
    free = hovi.plan(scene, **ends, **OPTIONS)
    found = hovi.plan(scene, **ends, conditions=[late], **OPTIONS)
    assert found.success, found.message
    t = np.linspace(0.2, 1.0, 4001)
    assert (
        found.trajectory.sample(t).v[:, 0].max() <= most + 1e-6 < free.trajectory.sample(t).v.max()
    )


def test_a_saved_task_keeps_the_power_of_its_limits(tmp_path: Path) -> None:
    task = hovi.load_task(hovi.example("ur5_reach"))
    limits = hovi.as_limits(task.scene.robot, {"power": {"elbow_joint": [-20.0, 28.0]}})
    hovi.save_task(task.with_options(limits=limits), tmp_path / "task.toml")
    found = hovi.load_task(tmp_path / "task.toml").options.limits
    assert found["power"] == {"elbow_joint": [-20.0, 28.0]}


def test_among_obstacles_and_links_the_power_is_limited_too(
    scene: hovi.Scene, ur5: hovi.Robot
) -> None:
    ball = hovi.Sphere([0.5, 0.5, 0.3], 0.1)
    found = hovi.plan(scene, START, GOAL, 1.5, limits={"power": 32.0}, obstacles=[ball])
    assert found.success, found.message
    assert np.abs(powers(found.trajectory, ur5)).max() <= 32.0 + 2e-6 * 64.0
    assert found.margins().distance >= 0.01 - 1e-6  # type: ignore[operator]


def test_a_free_duration_and_several_starts_keep_the_power(scene: hovi.Scene) -> None:
    limits = {"power": 28.0}
    given: tuple[tuple[Any, dict[str, Any]], ...] = (
        ((0.8, 3.0), {"time_weight": 50.0}),
        (1.5, {"starts": 3, "processes": 2}),
    )
    for duration, more in given:
        found = hovi.plan(scene, START, GOAL, duration, limits=limits, **more, **OPTIONS)
        assert found.success, found.message
        assert np.abs(powers(found.trajectory, scene.robot)).max() <= 28.0 + 2e-6 * 56.0


def test_bounds_may_change_with_time(scene: hovi.Scene) -> None:
    def most(t: float) -> float:
        return 40.0 - 5.0 * t

    asked = hovi.Condition(
        "tau * v", hovi.Between(lambda t: -most(t), most), name="power", scale=80
    )
    found = hovi.plan(scene, START, GOAL, 1.5, conditions=[asked], **OPTIONS)
    assert found.success, found.message
    t = np.linspace(0.0, found.trajectory.duration, 4001)
    over = np.abs(powers(found.trajectory, scene.robot)).max(axis=1) - (40.0 - 5.0 * t)
    assert -0.5 < over.max() <= 2e-6 * 80
    rest = found.advance(0.3)
    assert rest.success, rest.message
    t = np.linspace(0.3, found.trajectory.duration, 4001)
    over = np.abs(powers(rest.trajectory, scene.robot)).max(axis=1) - (40.0 - 5.0 * t)
    assert over.max() <= 2e-6 * 80


def test_a_bound_that_dips_between_the_samples_is_kept(two_link: hovi.Robot) -> None:
    def most(t: float) -> float:
        return 20.0 - 19.5 * float(np.exp(-(((t - 0.61) / 0.001) ** 2)))

    asked = hovi.Condition("dot(v, v)", hovi.Between(upper=most), name="dip", scale=20.0)
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    found = hovi.plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, limits="none", conditions=[asked])
    speed = np.square(found.trajectory.sample([0.61]).v).sum()
    assert not found.success or speed <= most(0.61) + 2e-6 * 20.0


def test_a_frame_stays_above_a_height(scene: hovi.Scene, free: hovi.Solution) -> None:
    t = np.linspace(0.0, 1.5, 4001)
    least = 0.2
    assert heights(free.trajectory, scene.robot, t).min() < least - 0.1
    asked = hovi.Condition('position["tool0", "z"]', hovi.Between(lower=least), name="height")
    found = hovi.plan(scene, START, GOAL, 1.5, conditions=[asked], **OPTIONS)
    assert found.success, found.message
    low = heights(found.trajectory, scene.robot, t).min()
    assert least - 2e-6 <= low < least + 1e-3
    again = found.replan(goal=GOAL + 0.01)
    assert again.success, again.message
    assert heights(again.trajectory, scene.robot, t).min() >= least - 2e-6


def test_a_frame_has_a_height_at_given_times(scene: hovi.Scene) -> None:
    asked = hovi.Condition(
        'position["tool0", "z"]', hovi.Equal(0.5), hovi.AtTimes([0.7, 1.2]), name="height"
    )
    found = hovi.plan(scene, START, GOAL, 1.5, conditions=[asked], **OPTIONS)
    later = found.advance(0.8)
    for motion, times in ((found, [0.7, 1.2]), (found.replan(goal=GOAL + 0.02), [0.7, 1.2])):
        assert motion.success, motion.message
        z = heights(motion.trajectory, scene.robot, np.array(times))
        np.testing.assert_allclose(z, 0.5, atol=1e-9)
    assert later.success, later.message
    np.testing.assert_allclose(
        heights(later.trajectory, scene.robot, np.array([0.4])), 0.5, atol=1e-9
    )


def test_what_is_asked_at_the_end_needs_something_free_there(scene: hovi.Scene) -> None:
    asked = hovi.Condition('position["tool0", "z"]', hovi.Equal(0.5), hovi.AtTimes(1.5), name="z")
    anywhere = hovi.State(GOAL, free=["all"])
    found = hovi.plan(scene, START, anywhere, 1.5, conditions=[asked], **OPTIONS)
    assert found.success, found.message
    assert heights(found.trajectory, scene.robot, np.array([1.5])) == pytest.approx(0.5, abs=1e-9)
    with pytest.raises(InputError, match="where the goal gives the state"):
        hovi.plan(scene, START, GOAL, 1.5, conditions=[asked], **OPTIONS)


def test_a_value_that_cannot_be_met_is_named(scene: hovi.Scene) -> None:
    asked = hovi.Condition('position["tool0", "z"]', hovi.Equal(5.0), hovi.AtTimes(0.7), name="sky")
    found = hovi.plan(scene, START, GOAL, 1.5, conditions=[asked], time_limit=30.0, **OPTIONS)
    assert not found.success
    assert "condition 'sky' at t = 0.7 s" in found.violation


def test_a_scene_file_limits_the_power(models: Path, tmp_path: Path) -> None:
    text = (models / "ur5_reach_limited.toml").read_text()
    task = hovi.load_task(models / "ur5_reach_limited.toml")
    free = hovi.plan_task(task)
    P = np.abs(powers(free.trajectory, task.scene.robot)).max(axis=0)
    i = int(P.argmax())
    joint, most = task.scene.robot.joint_names[i], round(0.8 * float(P[i]), 3)
    file = tmp_path / "scene.toml"

    def limited_to(bound: str) -> hovi.Task:
        file.write_text(text.replace("[limits]", f"[limits]\npower = {{ {joint} = {bound} }}"))
        return hovi.load_task(file)

    task = limited_to(str(most))
    found = hovi.plan_task(task)
    assert found.success, found.message
    assert np.abs(powers(found.trajectory, task.scene.robot))[:, i].max() <= most * (1 + 4e-6)
    hovi.save_task(task, tmp_path / "again.toml")
    assert hovi.load_task(tmp_path / "again.toml").options.limits == task.options.limits
    for bound in ("-3", '"50 %"', "[2, 1]"):
        with pytest.raises(SceneError, match=r"line \d+: .*limits\.power"):
            limited_to(bound)


TORQUE = float(pin.rnea(MODEL, MODEL.createData(), *np.array([[1.0, 0.5], [0.3, 0.2], [0, 0]]))[0])
"""Of the shoulder, in [N m], where a motion passes with a velocity and without an acceleration."""
AT_ENDS: dict[str, tuple[hovi.Condition, dict[str, Any], str]] = {
    "a start": (
        hovi.Condition("q", hovi.Between(0.1, 2.0), name="c"),
        {},
        "condition 'c' of entry 0 is 0 at the start, outside its bounds [0.1, 2]",
    ),
    "a goal": (
        hovi.Condition("q", hovi.Between(-1.0, 0.9), name="c", unit="rad"),
        {},
        "condition 'c' of entry 0 is 1 rad at the goal, outside its bounds [-1, 0.9]",
    ),
    "a velocity": (
        hovi.Condition("v", hovi.Between(-3.0, 3.0), name="c"),
        {"start": hovi.State([0.0, 0.0], [0.0, 4.0])},
        "condition 'c' of entry 1 is 4 at the start",
    ),
    "the power at rest": (
        hovi.Condition("tau * v", hovi.Between(1.0, 30.0), name="c"),
        {},
        "condition 'c' of entry 0 is 0 at the start",
    ),
    "a smooth motion's torque": (
        hovi.Condition("tau", hovi.Between(-1.0, 1.0), name="c"),
        {"smooth": True},
        "condition 'c' of entry 0 is 7.66406 at the start",
    ),
    "a smooth motion's torque at its goal": (
        hovi.Condition("tau", hovi.Between(-1.0, 1.0), name="c"),
        {"smooth": True, "start": [np.pi / 2, 0.0], "goal": hovi.State([1.0, 0.5], [0.3, 0.2])},
        f"condition 'c' of entry 0 is {TORQUE:.6g} at the goal",
    ),
    "a smooth motion's acceleration": (
        hovi.Condition("a", hovi.Between(1.0, 3e3), name="c"),
        {"smooth": True, "start": hovi.State([0.0, 0.0], [0.4, 0.4])},
        "condition 'c' of entry 0 is 0 at the start",
    ),
    "a bound of the time": (
        hovi.Condition("q", hovi.Between(-9.0, lambda t: 1.2 - 0.3 * t), name="c", scale=1.0),
        {"duration": 0.8},
        "condition 'c' of entry 0 is 1 at the goal, outside its bounds [-9, 0.96]",
    ),
    "what a free joint cannot change": (
        hovi.Condition("v", hovi.Between(1.0, 3.0), name="c", of=["shoulder", "elbow"]),
        {"goal": hovi.State([1.0, 0.5], free=["shoulder"])},
        "condition 'c' of 'shoulder' is 0 at the start",
    ),
}


@pytest.mark.parametrize("what", AT_ENDS)
def test_an_end_that_violates_a_condition_is_refused_at_once(
    two_link: hovi.Robot, what: str
) -> None:
    asked, given, sentence = AT_ENDS[what]
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    ends = {"start": [0.0, 0.0], "goal": [1.0, 0.5], "duration": 1.0, "limits": "none", **given}
    for more in ({}, {"duration": (0.5, 2.0), "time_weight": 1.0}):
        if more and what == "a bound of the time":
            continue
        found = hovi.plan(scene, **{**ends, **more}, conditions=[asked], **OPTIONS)
        assert (found.status, found.nit) == (hovi.Status.INFEASIBLE, 0)
        assert sentence in found.message


@pytest.mark.parametrize(
    ("function", "given"),
    [
        ("q", {"goal": hovi.State([1.0, 0.5], free=["shoulder"])}),
        ("tau", {}),
        ("tau * v", {"start": hovi.State([0.0, 0.0], [1.0, 0.0])}),
        ("a", {"goal": hovi.State([1.0, 0.5], [2.0, 1.0])}),
        (
            "tau",
            {
                "start": [-np.pi / 2, 0.0],
                "goal": hovi.State([0.0, 0.0], free=["shoulder"]),
                "smooth": True,
            },
        ),
    ],
)
def test_an_end_that_may_satisfy_a_condition_is_not_refused(
    two_link: hovi.Robot, function: str, given: dict[str, Any]
) -> None:
    """What is free there does: a position, or an acceleration and with it the torque."""
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    bounds = {"q": (-1.0, 0.9), "tau": (-7.0, 7.0), "tau * v": (-2.0, 3.0), "a": (0.5, 9.0)}[
        function
    ]
    asked = hovi.Condition(function, hovi.Between(*bounds), name="c")
    ends = {"start": [0.0, 0.0], "goal": [1.0, 0.5], "duration": 1.0, "limits": "none", **given}
    found = hovi.plan(scene, **ends, conditions=[asked], continuation=False, **OPTIONS)
    assert found.nit > 0


def test_of_a_periodic_motion_the_held_position_alone_may_violate_a_condition() -> None:
    """Its velocity at the start is a guess."""
    scene = hovi.Scene(hovi.load_robot(hovi.example("pendulum.urdf")), [hovi.effects.Gravity()])
    grid = hovi.Grid.uniform(1.0, 24, hovi.schemes.galerkin(2))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    start, turn = hovi.State([0.5], [1.0]), hovi.Periodic([2 * np.pi])

    def solved(function: str, on: hovi.Between) -> hovi.Solution:
        asked = hovi.Condition(function, on, name="c")
        return hovi.solve(hovi.TrajectoryProblem(ld, start, turn, conditions=[asked]))

    held = solved("q", hovi.Between(-9.0, 0.3))
    assert (held.status, held.nit) == (hovi.Status.INFEASIBLE, 0)
    assert "condition 'c' is 0.5 at the start, outside its bounds [-9, 0.3]" in held.message
    fast = solved("v", hovi.Between(lower=5.0))
    assert fast.success, fast.message
    assert fast.trajectory.v.min() > 5.0 - 1e-4


def broken(function: Any, on: Any = None, **more: Any) -> Callable[[], hovi.Condition]:
    return lambda: hovi.Condition(function, on or hovi.Between(-1, 1), name="odd", **more)


def own(
    values: Callable[[hovi.Points], Any],
    slopes: Callable[[hovi.Points], Any] = lambda at: {"q": np.zeros((len(at.q), 1, 6))},
    needs: frozenset[str] = frozenset({"q"}),
) -> Callable[[], hovi.Condition]:
    """A condition of a function without CasADi."""
    parts: dict[str, Any] = {"needs": needs, "size": 1}
    parts |= {"values": lambda self, at: values(at), "slopes": lambda self, at: slopes(at)}
    return broken(type("Own", (hovi.Function,), parts)())


REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    "constant": (broken(lambda q: 3.0), "depends on none of q, v, a and tau"),
    "time alone": (broken(lambda t: t), "depends on none of q, v, a and tau"),
    "no arguments": (broken(lambda: 1.0), "depends on none of q, v, a and tau"),
    "jerk": (broken(lambda jerk: jerk), "conditions on the jerk and on the torque rate"),
    "division": (broken(lambda q: q * (1 / 0)), "its function failed: "),
    "out of range": (broken(lambda q: q[7]), "its function failed: Slice"),
    "foreign": (broken(lambda q: q[0] + ca.SX.sym("x")), "contains x, which is none of q"),
    "typo": (broken(lambda qq: qq), "none of q, v, a, tau and t"),
    "text": (broken("tau * w"), "names 'w', which is unknown"),
    "matrix": (broken(lambda q: q @ q.T), "a column of one or more values"),
    "nothing": (broken(lambda q: None), "must return a CasADi expression"),
    "number": (broken(3.0), "the function of a condition must be"),
    "bounds": (broken("q", hovi.Between([-1, -2], 1)), "must be one number or 6"),
    "scale": (broken("q", scale=[1.0, 2.0]), "must be one number or 6"),
    "no scale": (broken("q", scale=-1.0), "must be positive"),
    "tolerance": (broken("q", tolerance=0.0), "needs a positive tolerance"),
    "small tolerance": (broken("q", tolerance=9e-7), "a positive tolerance of at least 1e-06"),
    "scale of a value": (
        broken("q", hovi.Equal(), scale=2.0),
        "leave its `scale` out",
    ),
    "tolerance of a value": (
        broken("q", hovi.Equal(), where=hovi.AtTimes(0.5), tolerance=1e-3),
        "and at given times its `tolerance`",
    ),
    "names": (broken("q", of=("elbow",)), "needs 6 names"),
    "set": (broken("q", 3), "needs a hovi.Between or a hovi.Equal"),
    "place": (broken("q", hovi.Equal(), where=0.5), "needs hovi.AtTimes(times) as `where`"),
    "torque along": (broken("tau", hovi.Equal()), "an equation of torques at all times"),
    "bounds at times": (broken("q", where=hovi.AtTimes(0.5)), "which hold at all times"),
    "torque at times": (
        broken("tau", hovi.Equal(), where=hovi.AtTimes(0.5)),
        "must be a function of q, v and t, but it depends on tau",
    ),
    "values": (broken("q", hovi.Equal([1.0, 2.0]), where=hovi.AtTimes(0.5)), "one number or 6"),
    "late": (broken('q["elbow_joint"]', hovi.Equal(), where=hovi.AtTimes(2.5)), "2.5 s"),
    "NaN": (lambda: hovi.Between(np.nan, 1.0), "must be numbers"),
    "empty": (lambda: hovi.Between(1.0, 1.0), "lower must be less than upper"),
    "no value": (lambda: hovi.Equal(np.nan), "finite numbers"),
    "no time": (lambda: hovi.AtTimes([]), "positive times"),
    "varying": (broken("q", hovi.Between(lambda t: -t - 1.0, 1.0)), "needs a `scale`"),
    "crossing": (
        broken("q", hovi.Between(lambda t: 2 * t - 3, lambda t: 2 - 2 * t), scale=1.0),
        "condition 'odd' has an empty range at t = 1.25 s: [-0.4995, -0.5005]",
    ),
    "crossing for a while": (
        broken("q", hovi.Between(-3.0, lambda t: 2.0 if abs(t - 0.5) > 1e-3 else -3.0), scale=1.0),
        "condition 'odd' has an empty range at t = 0.4995 s: [-3, -3]",
    ),
    "failing later": (
        broken("q", hovi.Between(-9, lambda t: 1.0 if t < 1 else 1 / 0), scale=1.0),
        "the upper bound at t = 1 s of a Between failed: division by zero",
    ),
    "values of a function": (
        own(lambda at: at.q[:, 0]),
        "the values of its function must have shape (2, 1) at two instants, got (2,)",
    ),
    "slopes of a function": (
        own(lambda at: at.q[:, :1], lambda at: {"q": np.zeros((len(at.q), 6))}),
        "the slopes in q of its function must have shape (2, 1, 6) at two instants, got (2, 6)",
    ),
    "no slopes of a function": (
        own(lambda at: at.q[:, :1], lambda at: {}),
        "the slopes in q of its function must have shape (2, 1, 6) at two instants, got none",
    ),
    "failing function": (own(lambda at: at.q[:, 9:10] / at.w), "its function failed: "),
    "needs of a function": (
        own(lambda at: at.q[:, :1], needs=frozenset({"w"})),
        "its function needs some of q, v, a, tau and t, got ['w']",
    ),
    "failing bound": (
        broken("q", hovi.Between(-9, lambda t: 1 / (t - t)), scale=1.0),
        "the upper bound at t = 0 s of a Between failed: float division by zero",
    ),
    "beyond": (
        broken('q["elbow_joint"]', hovi.Equal(), where=hovi.AtTimes(1.6)),
        "a via point or condition at 1.6 s is not inside the motion of 1.5 s",
    ),
    "three": (lambda: 3, "must be a list of hovi.Condition"),
}


def test_the_condition_of_the_documentation_holds(capsys: pytest.CaptureFixture[str]) -> None:
    """The distance of two frames, a limit on the power and a height, in one plan."""
    page = (Path(__file__).resolve().parents[2] / "docs" / "design.md").read_text()
    section = page.split("## Add a condition")[1]
    known: dict[str, Any] = {}
    exec(section.split("```python\n")[1].split("```")[0], known)
    motion, robot = known["motion"], known["scene"].robot
    assert motion.success, motion.message
    q = motion.trajectory.configurations(np.linspace(0.0, 1.5, 1001))
    poses = [[robot.frame_pose(name, x)[:3, 3] for x in q] for name in ("tool0", "base_link")]
    assert np.linalg.norm(np.subtract(*poses), axis=1).min() >= 0.25 - 1e-6
    assert "frames" in capsys.readouterr().out


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_asked_is_refused_in_one_sentence(scene: hovi.Scene, what: str) -> None:
    make, sentence = REFUSED[what]

    def planned() -> hovi.Solution:
        asked = make()
        given = [asked] if isinstance(asked, hovi.Condition) else asked
        return hovi.plan(scene, START, GOAL, 1.5, conditions=given, **OPTIONS)

    with pytest.raises(hovi.HoviError) as refused:
        planned()
    assert sentence in str(refused.value)
    assert str(refused.value).count("\n") == 0


def test_what_is_tolerated_is_not_named_as_the_worst(two_link: hovi.Robot) -> None:
    """Mean speeds of 1 and 0.5 rad/s exceed both bounds, the first by less than its tolerance."""
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    asked = [
        hovi.Condition('v["shoulder"]', hovi.Between(upper=0.9), name="loose", tolerance=0.3),
        hovi.Condition('v["elbow"]', hovi.Between(upper=0.48), name="tight"),
    ]
    given = {"limits": "none", "conditions": asked, "continuation": False}
    found = hovi.plan(scene, [0.0, 0.0], [1.0, 0.5], 1.0, **given, **OPTIONS)
    assert found.status is hovi.Status.INFEASIBLE
    assert "condition 'tight' reaches " in found.message
    assert "'loose'" not in found.message


def test_two_conditions_have_two_names(scene: hovi.Scene) -> None:
    with pytest.raises(InputError, match="two conditions have the name 'power'"):
        hovi.plan(scene, START, GOAL, 1.5, conditions=[power(50.0), power(60.0)], **OPTIONS)
    with pytest.raises(InputError, match="two conditions have the name 'power'"):
        hovi.plan(
            scene, START, GOAL, 1.5, conditions=[power(50.0)], limits={"power": 60.0}, **OPTIONS
        )


def test_a_condition_without_a_value_is_said(scene: hovi.Scene) -> None:
    asked = hovi.Condition(lambda q: (-1.0 - q[0] ** 2) ** 0.5, hovi.Between(-1, 1), name="root")
    found = hovi.plan(scene, START, GOAL, 1.5, conditions=[asked], continuation=False, **OPTIONS)
    assert not found.success
    assert "condition 'root' has no finite value at t = " in found.message


def test_torques_need_a_robot() -> None:
    ld = hovi.DiscreteLagrangian(
        hovi.spline(2, 2), hovi.Grid.uniform(1.0, 4, hovi.schemes.galerkin(2))
    )
    asked = hovi.Condition(lambda tau: tau, hovi.Between(-1, 1), name="torque")
    with pytest.raises(InputError, match="a condition on torques needs a Lagrangian of a scene"):
        hovi.TrajectoryProblem(ld, hovi.State([0, 0]), hovi.State([1, 1]), conditions=[asked])
