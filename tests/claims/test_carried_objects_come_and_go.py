"""Objects that segments carry: in the way and heavy in these segments, and nowhere else.

Distances are judged by Pinocchio and Coal alone, on the robot as it was loaded.
"""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
import umsgpack

import hovi
from hovi.errors import HoviWarning, InputError, SceneError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.sequence.branches import MoveToGoal, chosen_branches
from hovi.planning.sequence.carried import scene_carrying
from hovi.viewing.payloads import Payloads
from hovi.viewing.recorded_limits import imposed_clearance, kept_distances
from hovi.viewing.replay_session import page_of

Array = npt.NDArray[np.float64]

SAMPLES = 2_001
MARGIN = 0.01
SIZE, MASS = (0.08, 0.08, 0.16), 1.5
HANGING = np.array([0.0, 0.0, 0.08])
WALL = {"size": [0.7, 0.02, 0.25], "position": [0.61, 0.109, 0.112]}


def at(pan: float, lift: float = 0.0) -> list[float]:
    return [pan, -1.2 + lift, 1.5, -1.87 - lift, -1.57, 0.0]


@functools.cache
def arm() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])


def crate(mass: float = MASS, **changes: Any) -> hovi.Grasped:
    """Hanging below the tool, so that its bottom is where the wall is."""
    given: dict[str, Any] = {"name": "crate", "may_touch": ["wrist_3_link", "ee_link"]}
    return hovi.Grasped(hovi.Box(SIZE, HANGING), "tool0", mass, **{**given, **changes})


def crate_at(frame: str) -> hovi.Grasped:
    return hovi.Grasped(hovi.Box(SIZE, HANGING), frame, MASS, f"at {frame}")


def ball(frame: str) -> hovi.Grasped:
    return hovi.Grasped(hovi.Sphere([0.0, 0.1, 0.0], 0.02), frame, 0.3, "ball")


def planned(segments: list[hovi.Segment], start: list[float], **more: Any) -> hovi.Solution:
    wall = hovi.Box(WALL["size"], WALL["position"], name="wall")
    options = {"obstacles": [wall], "margin": MARGIN, "objective": "acceleration"} | more
    return hovi.plan_sequence(arm(), start, segments, **options)


def across(*grasped: hovi.Grasped, duration: Any = 1.5, free: bool = False) -> list[hovi.Segment]:
    """To the one side of the wall, to the other with what is carried, and back without."""
    return [
        hovi.Segment(at(0.6), 1.0, name="reach"),
        hovi.Segment(at(-0.6), duration, grasped=grasped, name="carry"),
        hovi.Segment(at(0.6), duration if free else 1.5, name="return"),
    ]


@functools.cache
def with_crate() -> hovi.Solution:
    return planned(across(crate()), at(0.6, -0.2))


def judged(q: Array) -> Array:
    """The distance of the crate from the wall at configurations, by Pinocchio and Coal alone."""
    model = arm().robot.model
    data, tool = model.createData(), model.getFrameId("tool0")
    there = coal.Transform3s(np.eye(3), np.array(WALL["position"]))
    wall, box, found = coal.Box(*WALL["size"]), coal.Box(*SIZE), []
    for each in q:
        pin.framesForwardKinematics(model, data, each)
        place = data.oMf[tool] * pin.SE3(np.eye(3), HANGING)
        here = coal.Transform3s(place.rotation, place.translation)
        result = coal.DistanceResult()
        coal.distance(box, here, wall, there, coal.DistanceRequest(), result)
        found.append(result.min_distance)
    return np.array(found)


def heights(q: Array) -> Array:
    """The height of the tool at configurations, in [m]."""
    return np.array([arm().robot.frame_position("tool0", each)[2] for each in q])


def in_parts(motion: hovi.Trajectory) -> tuple[Array, Array, Array]:
    """Times, configurations and the number of the segment at each."""
    t = np.linspace(0.0, motion.duration, SAMPLES)
    ends = np.cumsum(motion.segment_durations)[:-1]
    return t, motion.configurations(t), np.searchsorted(ends, t)


def test_the_crate_keeps_its_margin_while_it_is_carried_and_not_before_or_after() -> None:
    solution = with_crate()
    assert solution.success, solution.message
    t, q, part = in_parts(solution.trajectory)
    d = judged(q)
    assert d[part == 1].min() >= MARGIN - 1e-6
    assert d[part == 2].min() < 0.0  # the empty tool passes where the crate would not
    without = planned(across(), at(0.6, -0.2))
    q_without = without.trajectory.configurations(t)
    assert judged(q_without)[part == 1].min() < 0.0
    highest = [heights(each[part == 1]).max() for each in (q, q_without)]
    assert highest[0] > highest[1] + 0.05
    assert solution.margins().distance == pytest.approx(MARGIN, abs=1e-3)


def drawn_at(motion: hovi.Trajectory, link: str, t: Array) -> Array:
    """Positions of a drawn link in the animation of a page, (M, 3), in [m]."""
    (message,) = (each for each in page_of(motion).messages.all() if each.kind == "set_animation")
    clips = umsgpack.unpackb(message.packed)["animations"]
    (clip,) = (each["clip"] for each in clips if each["path"].endswith(f"/{link}_0"))
    (track,) = (each for each in clip["tracks"] if each["name"] == ".position")
    times, places = ([key[name] for key in track["keys"]] for name in ("time", "value"))
    return np.array([np.interp(t, times, x) for x in np.transpose(places)]).T


def test_the_crate_is_drawn_where_it_lies_before_and_after_it_is_carried() -> None:
    motion = with_crate().trajectory
    ends = np.cumsum([0.0, *motion.segment_durations])
    t = np.linspace(0.0, motion.duration, 41)
    carried = np.clip(t, ends[1], ends[2])
    poses = [arm().robot.frame_pose("tool0", q) for q in motion.configurations(carried)]
    crates = np.array([pose[:3, :3] @ HANGING + pose[:3, 3] for pose in poses])
    np.testing.assert_allclose(drawn_at(motion, "crate", t), crates, atol=1e-3)
    assert np.ptp(crates[:, 1]) > 0.5
    assert Payloads.of(motion).items == ()  # its mass is no ball in it


def test_its_mass_acts_while_it_is_carried() -> None:
    motion = with_crate().trajectory
    loaded = arm().model.copy()
    tool = loaded.frames[loaded.getFrameId("tool0")]
    body = pin.Inertia.FromBox(MASS, *SIZE)
    at_tool = tool.placement * pin.SE3(np.eye(3), HANGING)
    loaded.appendBodyToJoint(tool.parentJoint, body, at_tool)
    for times, model in (([0.3, 0.7, 2.9, 3.5], arm().model), ([1.1, 1.7, 2.3], loaded)):
        sample = motion.sample(np.array(times))
        jets = zip(sample.q, sample.v, sample.a, strict=True)
        torques = [pin.rnea(model, model.createData(), *jet) for jet in jets]
        np.testing.assert_allclose(sample.tau, torques, atol=1e-9)


def test_a_motion_past_the_wall_after_the_release_is_that_without_the_crate() -> None:
    light = crate(mass=1e-9)
    goals = (at(0.4), 1.0), (at(-0.6), 1.5)
    start = at(0.6)
    found = [
        planned([hovi.Segment(*goals[0], grasped=held), hovi.Segment(*goals[1])], start)
        for held in ([light], [])
    ]
    assert all(each.success for each in found)
    _, q, part = in_parts(found[0].trajectory)
    assert judged(q)[part == 1].min() < 0.0
    t = np.linspace(0.0, 2.5, 101)
    q = [each.trajectory.configurations(t) for each in found]
    np.testing.assert_allclose(*q, atol=1e-5)
    assert found[0].cost == pytest.approx(found[1].cost, rel=1e-6)


def test_free_durations_move_the_parts_in_which_it_is_carried() -> None:
    free = across(crate(), duration=(0.8, 4.0))
    solution = planned(free, at(0.6, -0.2), time_weight=2.0)
    assert solution.success, solution.message
    motion = solution.trajectory
    assert abs(motion.segment_durations[1] - np.sqrt(0.8 * 4.0)) > 0.02
    clearance = imposed_clearance(motion)
    assert clearance is not None
    ((name, begin, end),) = clearance.during
    assert (name, begin) == ("crate", 1.0)
    assert end == pytest.approx(1.0 + motion.segment_durations[1], abs=1e-9)
    _, q, part = in_parts(motion)
    assert judged(q)[part == 1].min() >= MARGIN - 1e-6


def test_segments_that_follow_each_other_carry_it_through() -> None:
    one = crate()
    carry, more = hovi.Segment(None, 0.7, grasped=[one]), hovi.Segment(at(-0.6), 0.8, grasped=[one])
    solution = planned([hovi.Segment(at(0.6), 1.0), carry, more], at(0.6, -0.2))
    assert solution.success, solution.message
    clearance = imposed_clearance(solution.trajectory)
    assert clearance is not None
    assert clearance.during == [("crate", 1.0, pytest.approx(2.5))]


def test_a_saved_motion_knows_when_it_is_carried(tmp_path: Path) -> None:
    motion = with_crate().trajectory
    motion.save(tmp_path / "motion.npz")
    again = hovi.Trajectory.load(tmp_path / "motion.npz")
    known = kept_distances(again)
    assert known is not None
    clearance, distances = known
    assert clearance.during == [("crate", 1.0, 2.5)]
    t, q, part = in_parts(again)
    d = distances.values(distances.at(again.configurations(t), t))
    column = [(x.link, x.other) for x in distances.pairs].index(("crate", "wall"))
    assert np.isinf(d[(t < 1.0 - 1e-6) | (t > 2.5 + 1e-6), column]).all()
    np.testing.assert_allclose(d[part == 1, column], judged(q[part == 1]), atol=1e-6)


def test_reports_and_plots_show_when_it_is_near(tmp_path: Path) -> None:
    solution = with_crate()
    page = tmp_path / "report.html"
    hovi.write_report(solution, page)
    assert "least distance" in page.read_text(encoding="utf-8")
    assert "crate" in str(solution.margins())


def test_what_is_left_of_a_motion_carries_it_as_long() -> None:
    rest = with_crate().advance(1.25)
    assert rest.success, rest.message
    clearance = imposed_clearance(rest.trajectory)
    assert clearance is not None
    ((_, begin, end),) = clearance.during
    assert begin < 0.0
    assert end == pytest.approx(1.25)
    _, q, part = in_parts(rest.trajectory)
    assert judged(q)[part == 0].min() >= MARGIN - 1e-6


SCENE = """
format = 2
robot = "ur5"
start = {start}
margin = 0.01

[[obstacles]]
name = "wall"
kind = "box"
size = {size}
position = {position}

[[segments]]
name = "reach"
duration = 1.0
goal = {first}

[[segments]]
name = "carry"
duration = 1.5
goal = {second}

[[segments.grasped]]
name = "crate"
frame = "tool0"
mass = {mass}
shape = {{ kind = "box", size = [0.08, 0.08, 0.16], position = [0, 0, 0.08] }}
may_touch = ["wrist_3_link", "ee_link"]

[effects.gravity]
"""


def written(folder: Path, mass: float = MASS) -> Path:
    path = folder / "carry.toml"
    ends = {"start": at(0.6, -0.2), "first": at(0.6), "second": at(-0.6)}
    path.write_text(SCENE.format(**ends, **WALL, mass=mass))
    return path


def test_a_scene_file_says_it_and_is_written_again(tmp_path: Path) -> None:
    task = hovi.load_task(written(tmp_path))
    again = hovi.load_task(hovi.save_task(task, tmp_path / "again.toml"))
    for each in (task, again):
        assert each.segments[1].grasped[0].to_dict() == crate().to_dict()
        assert each.segments[0].grasped == ()
        assert "crate" in each.held_scene.robot.frame_names
    with pytest.raises(SceneError, match=r"line 18: the mass of grasped object .crate. must be"):
        hovi.load_task(written(tmp_path, mass=-1.0))


REFUSED: dict[str, tuple[list[Any], str]] = {
    "another of one name": (
        [[crate()], [crate(mass=2.0)]],
        "'segment 2' carries another 'crate' than a segment before it: give one",
    ),
    "a name that a frame has": ([[crate(name="tool0")], []], "has a frame 'tool0' already"),
    "no link": (
        [[ball("hand")], []],
        "must be held by a link or a tool of robot 'ur5', which has no 'hand'",
    ),
    "two joints": (
        [[crate(), ball("forearm_link")], []],
        "'segment 1' carries bodies at 'tool0', 'forearm_link', which different joints move",
    ),
    "no object": ([["crate"], []], "grasped must be a list of up to 50 hovi.Grasped"),
    "nothing to touch": ([[crate(may_touch=["tabel"])], []], "nothing that may touch is named"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_carried_is_refused_in_a_sentence(case: str) -> None:
    grasped, sentence = REFUSED[case]
    with pytest.raises(InputError, match=sentence):
        planned([hovi.Segment(at(0.4), 1.0, grasped=x) for x in grasped], at(0.6))


def test_the_frame_of_a_tool_may_hold_an_object() -> None:
    tools = {
        "grip": {"frame": "tool0", "position": [0, 0, 0.1], "rpy": [0.3, 0, 0]},
        "tip": {"frame": "grip", "position": [0, 0.02, 0.05]},
    }
    held = hovi.holding(hovi.load_robot("ur5", tools=tools), [crate(), crate_at("tip")])
    q = at(0.6)
    offset = np.linalg.inv(held.frame_pose("crate", q)) @ held.frame_pose("at tip", q)
    tilt = pin.rpy.rpyToMatrix(0.3, 0.0, 0.0)
    np.testing.assert_allclose(offset[:3, :3], tilt, atol=1e-12)
    np.testing.assert_allclose(offset[:3, 3], [0, 0, 0.1] + tilt @ [0, 0.02, 0.05], atol=1e-12)


def test_several_objects_and_a_payload_of_one_joint_act_together() -> None:
    scene = hovi.Scene(arm().robot, [hovi.effects.Payload("wrist_3_link", 0.5, (0.1, 0.0, 0.0))])
    segments = [
        hovi.Segment(at(0.4), 1.0, grasped=[crate(), ball("ee_link")]),
        hovi.Segment(at(0.2), 1.0),
    ]
    found = hovi.plan_sequence(scene, at(0.6), segments, intervals=8, self_collision=False)
    held = hovi.Scene(hovi.holding(arm().robot, [crate(), ball("ee_link")]), list(scene.effects))
    sample = found.trajectory.sample(np.array([0.5]))
    known = held.model, held.model.createData(), sample.q[0], sample.v[0], sample.a[0]
    np.testing.assert_allclose(sample.tau[0], pin.rnea(*known), atol=1e-9)


ROD = hovi.Grasped(
    hovi.Box([0.5, 0.03, 0.03], [0.22, 0.0, 0.06]),
    "tool0",
    0.5,
    "rod",
    may_touch=["wrist_3_link", "ee_link"],
)
LONG = 0.6
"""Height of a post, in [m]."""


def rod_at(q: Array) -> pin.SE3:
    """The middle of the rod, by Pinocchio alone."""
    model = arm().robot.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[model.getFrameId("tool0")] * pin.SE3(np.eye(3), np.array([0.22, 0.0, 0.06]))


def test_inverse_kinematics_sees_what_is_carried_at_a_goal() -> None:
    """Of the turns about the vertical that a goal leaves free, one puts the rod into a post."""
    goal = hovi.FrameGoal("tool0", position=[0.45, 0.25, 0.35], axis=([0, 0, 1], [0, 0, -1]))
    scene = scene_carrying(arm(), [hovi.Segment(goal, 1.0, grasped=[ROD])])
    room = np.full(6, -2 * np.pi), np.full(6, 2 * np.pi)
    begin = MoveToGoal((), 0.0, 0.0, hovi.State(at(0.6)), room)
    end = MoveToGoal((1,), 1.0, 2.0, goal, room)

    def chosen(middle: Array, during: tuple[str, float, float]) -> Array:
        post = hovi.Cylinder(0.03, LONG, middle, name="post")
        touching = [("rod", each) for each in ROD.may_touch]
        clearance = Clearance([post], MARGIN, False, touching, during=[during])
        known = scene.robot, scene.effort_lagrangian(), begin, [end], clearance
        _, (reached,) = chosen_branches(*known)
        assert isinstance(reached, hovi.FrameGoal)
        return np.asarray(reached.guess)

    def apart(q: Array, middle: Array) -> float:
        place, result = rod_at(q), coal.DistanceResult()
        here = coal.Transform3s(place.rotation, place.translation)
        there = coal.Transform3s(np.eye(3), middle)
        both = coal.Box(0.5, 0.03, 0.03), here, coal.Cylinder(0.03, LONG), there
        coal.distance(*both, coal.DistanceRequest(), result)
        return float(result.min_distance)

    before, carried = ("rod", 0.0, 1.0), ("rod", 1.0, 2.0)
    tip = rod_at(chosen(np.array([5.0, 5.0, 0.0]), before)) * np.array([0.2, 0.0, 0.0])
    assert apart(chosen(tip, before), tip) < 0.0
    assert apart(chosen(tip, carried), tip) >= MARGIN - 1e-6


def test_a_goal_at_which_nothing_is_clear_is_named_with_the_pair() -> None:
    """The crate's bottom would be 5 cm below the top of a table, in every configuration."""
    q = np.array(at(0.6))
    pose = arm().robot.frame_pose("tool0", q)
    bottom = pose[:3, 3] + pose[:3, :3] @ np.array([0.0, 0.0, 0.16])
    table = hovi.Box([0.2, 0.2, 0.1], bottom, name="table")
    goal = hovi.FrameGoal("tool0", position=pose[:3, 3], rotation=pose[:3, :3])
    segments = [
        hovi.Segment(goal, 1.0, name="lower", grasped=[crate()]),
        hovi.Segment(at(0.6, -0.3), 1.0, name="away"),
    ]
    known = {"obstacles": [table], "self_collision": False, "intervals": 8, "max_iterations": 5}
    with pytest.warns(HoviWarning, match="'lower' the goal is met.*'crate' and .*'table'"):
        hovi.plan_sequence(arm(), at(0.6, -0.4), segments, **known)
