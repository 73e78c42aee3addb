"""Grasped objects: their mass as a payload has it, their shape, and what they may touch."""

from __future__ import annotations

import dataclasses
import warnings
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.cli.reports.limit_margins import nearest_pair
from hovi.errors import InputError
from hovi.planning.clearance.distances import Distances
from hovi.planning.obstacles.grasped import scene_holding
from hovi.viewing.recorded_limits import imposed_clearance
from hovi.viewing.replay_session import write_html
from oracles.world_distances import shape_distance

AT, RPY = [0.02, -0.03, 0.1], [0.3, -0.5, 0.2]
PARTS = [hovi.Box([0.1, 0.06, 0.2], [0.0, 0.01, 0.0]), hovi.Cylinder(0.02, 0.3, [0.0, 0.0, 0.2])]


def crate(**changes: object) -> hovi.Grasped:
    given = {"shape": PARTS, "frame": "panda_hand", "mass": 2.0, "name": "crate"}
    return hovi.Grasped(**{**given, "position": AT, "rpy": RPY, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "changes",
    [{}, {"center": [0.1, 0.0, 0.0], "inertia": [0.1, 0.2, 0.15, 0.01, 0.02, -0.01]}],
    ids=["homogeneous", "given"],
)
def test_its_torques_are_those_of_the_payload(
    panda: hovi.Robot, changes: dict[str, object]
) -> None:
    grasped = crate(**changes)
    gravity = [hovi.effects.Gravity(9.81)]
    held = hovi.Scene(hovi.holding(panda, grasped), gravity)
    loaded = hovi.Scene(panda, [*gravity, grasped.payload()])
    random = np.random.default_rng(0)
    q, v, a = random.uniform(-1.0, 1.0, (3, 7))
    torques = [pin.rnea(s.model, s.model.createData(), q, v, a) for s in (held, loaded)]
    np.testing.assert_allclose(*torques, atol=1e-12)
    bare = pin.rnea(panda.model, panda.model.createData(), q, v, a)
    assert np.abs(torques[0] - bare).max() > 1.0


def test_a_homogeneous_body_has_the_inertia_of_its_points() -> None:
    """Of 200,000 random points in the two shapes, each with the same fraction of the mass."""
    random = np.random.default_rng(0)
    box = random.uniform(-0.5, 0.5, (200_000, 3)) * [0.1, 0.06, 0.2] + [0.0, 0.01, 0.0]
    around = random.uniform(-0.02, 0.02, (200_000, 2))
    rod = np.column_stack([around, random.uniform(0.05, 0.35, 200_000)])
    rod = rod[np.linalg.norm(around, axis=1) < 0.02]
    masses = np.array([0.1 * 0.06 * 0.2, np.pi * 0.02**2 * 0.3])
    shares = 2.0 * masses / masses.sum()
    center = sum(m * x.mean(axis=0) for m, x in zip(shares, (box, rod), strict=True)) / 2.0
    tensor = np.zeros((3, 3))
    for m, x in zip(shares, (box - center, rod - center), strict=True):
        square = np.vecdot(x, x).mean() * np.eye(3) - x.T @ x / len(x)
        tensor += m * square
    body = crate().body
    np.testing.assert_allclose(body.lever, center, atol=2e-4)
    np.testing.assert_allclose(body.inertia, tensor, atol=1e-4)


def test_its_shape_is_as_far_from_obstacles_as_shapes_at_its_pose(panda: hovi.Robot) -> None:
    """Placed by the pose of the hand and Coal's own call, at 50 configurations."""
    ball = hovi.Sphere([0.5, 0.2, 0.4], 0.1, name="ball")
    robot = hovi.holding(panda, crate())
    distances = Distances(robot, hovi.Clearance([ball]))
    columns = [k for k, pair in enumerate(distances.pairs) if pair.link == "crate"]
    pin.seed(3)
    q = np.array([pin.randomConfiguration(panda.model) for _ in range(50)])
    found = distances.values(q)[:, columns]
    data, hand = panda.model.createData(), panda.model.getFrameId("panda_hand")
    there = coal.Sphere(0.1), pin.SE3(np.eye(3), np.array([0.5, 0.2, 0.4]))
    object_in_hand = pin.SE3(pin.rpy.rpyToMatrix(*RPY), np.array(AT))
    for one, row in zip(q, found, strict=True):
        pin.framesForwardKinematics(panda.model, data, one)
        at = data.oMf[hand] * object_in_hand
        box, rod = coal.Box(0.1, 0.06, 0.2), coal.Cylinder(0.02, 0.3)
        expected = [
            shape_distance((shape, at * pin.SE3(np.eye(3), np.array(x))), there)
            for shape, x in ((box, [0.0, 0.01, 0.0]), (rod, [0.0, 0.0, 0.2]))
        ]
        np.testing.assert_allclose(row, expected, atol=1e-5)


def test_it_is_kept_from_links_but_not_from_the_hand_that_holds_it(panda: hovi.Robot) -> None:
    robot = hovi.holding(panda, crate())
    pairs = Distances(robot, hovi.Clearance(self_collision=True)).pairs
    others = {
        pair.link if pair.other == "crate" else pair.other
        for pair in pairs
        if "crate" in (pair.link, pair.other)
    }
    assert "panda_link0" in others
    assert not others & {"panda_hand", "panda_leftfinger", "panda_link7", "panda_link6"}


START, GOAL = [-0.6, 0.6], [0.2, 0.4]
BOX = hovi.Grasped(
    hovi.Box([0.3, 0.3, 0.3], [0, 0, 0]),
    frame="tip",
    mass=2.0,
    name="box",
    position=[0, 0, -0.25],
    may_touch=["table"],
)
UNDER_BOX = [2.2380034223654146, 0.0, -0.8469637100925521 - 0.45]
"""The center of a table of 0.1 m on which the box stands at the start."""
TABLE = hovi.Box([0.6, 0.6, 0.1], UNDER_BOX, name="table")


def lift(scene: hovi.Scene, grasped: hovi.Grasped) -> hovi.Solution:
    """Lifts the box from the table on which it stands."""
    options = {"limits": "none", "scheme": "galerkin-2x8", "intervals": 8, "margin": 0.05}
    return hovi.plan(
        scene,
        START,
        GOAL,
        1.0,
        obstacles=[TABLE],
        grasped=[grasped],
        **options,
        self_collision=False,
    )


def test_what_stands_on_a_table_is_lifted_where_it_may_touch_it(arm_scene: hovi.Scene) -> None:
    """At 2,000 samples, by the box's corners, no deeper than a millimetre; torques lift 2 kg."""
    solution = lift(arm_scene, BOX)
    assert solution.success, solution.message
    q = solution.trajectory.configurations(np.linspace(0.0, 1.0, 2_001))
    at = arm_scene.robot.frame_position("tip", q)
    angle = -q.sum(axis=1)
    corners = np.array([[x, z] for x in (-0.15, 0.15) for z in (-0.4, -0.1)])
    c, s = np.cos(angle), np.sin(angle)
    x = at[:, None, 0] + c[:, None] * corners[:, 0] + s[:, None] * corners[:, 1]
    z = at[:, None, 2] - s[:, None] * corners[:, 0] + c[:, None] * corners[:, 1]
    over = np.abs(x - UNDER_BOX[0]) < 0.3
    height = np.where(over, z - (UNDER_BOX[2] + 0.05), np.inf).min(axis=1)
    assert height[0] == pytest.approx(0.0, abs=1e-9)
    assert -0.00101 < height.min() < 1e-9
    bare = hovi.plan(arm_scene, START, GOAL, 1.0, limits="none")
    assert solution.cost > 1.2 * bare.cost


def test_without_leave_to_touch_the_start_is_refused(arm_scene: hovi.Scene) -> None:
    solution = lift(arm_scene, dataclasses.replace(BOX, may_touch=[]))
    assert not solution.success
    assert "at the start link 'box' and obstacle 'table' " in solution.message
    deep = hovi.Box([0.6, 0.6, 0.1], [*UNDER_BOX[:2], UNDER_BOX[2] + 0.02], name="table")
    options = {"limits": "none", "obstacles": [deep], "margin": 0.05}
    sunk = hovi.plan(arm_scene, START, GOAL, 1.0, grasped=[BOX], **options)
    assert "'table', which may touch, overlap by 0.02 m" in sunk.message


def test_a_motion_that_holds_an_object_is_saved_with_it(
    arm_scene: hovi.Scene, tmp_path: Path
) -> None:
    """The page draws it at the pose of the tip, by the messages to the browser."""
    motion = lift(arm_scene, BOX).trajectory
    motion.save(tmp_path / "lift.npz")
    again = hovi.Trajectory.load(tmp_path / "lift.npz")
    assert again.robot is not None
    assert "box" in again.robot.frame_names
    t = np.linspace(0.0, 1.0, 5)
    held = (again.robot.model.inertias[2], hovi.holding(arm_scene.robot, BOX).model.inertias[2])
    assert held[0].isApprox(held[1])
    np.testing.assert_array_equal(again.configurations(t), motion.configurations(t))
    page = write_html(again, tmp_path / "page.html").page
    drawn = [m.path for m in page.messages.all() if m.kind == "set_object"]
    assert any("box" in path for path in drawn)
    clearance = imposed_clearance(again)
    assert clearance is not None
    assert clearance.may_touch == (("box", "table"),)
    assert nearest_pair(again)[0] == pytest.approx(0.0, abs=1.01e-3)


def test_a_goal_may_name_its_frame(arm_scene: hovi.Scene) -> None:
    """The box's middle ends where it is asked to be."""
    goal = hovi.FrameGoal("box", position=[1.8, 0.0, -0.2])
    solution = hovi.plan(arm_scene, START, goal, 1.0, limits="none", grasped=[BOX])
    assert solution.success, solution.message
    q = solution.trajectory.q[-1]
    tip, angle = arm_scene.robot.frame_position("tip", q[None])[0], q.sum()
    middle = tip + 0.25 * np.array([np.sin(angle), 0.0, -np.cos(angle)])
    np.testing.assert_allclose(middle, [1.8, 0.0, -0.2], atol=1e-5)


def test_without_a_pose_it_is_at_the_origin_of_its_frame(arm_scene: hovi.Scene) -> None:
    robot = hovi.holding(arm_scene.robot, hovi.Grasped(hovi.Sphere([0, 0, 0.1], 0.1), "tip", 2.0))
    q = np.array([0.4, -0.9])
    np.testing.assert_allclose(
        robot.frame_pose("grasped", q), robot.frame_pose("tip", q), atol=1e-12
    )


def test_a_robot_holds_up_to_fifty_objects_of_up_to_a_million_tonnes(
    arm_scene: hovi.Scene,
) -> None:
    bead = hovi.Sphere([0, 0, 0], 0.01)
    beads = [hovi.Grasped(bead, "tip", 0.5, f"bead {i}") for i in range(51)]
    robot = hovi.holding(arm_scene.robot, beads[:50])
    more = sum(x.mass for x in robot.model.inertias) - sum(
        x.mass for x in arm_scene.robot.model.inertias
    )
    assert more == pytest.approx(25.0)
    with pytest.raises(InputError, match="50"):
        hovi.holding(arm_scene.robot, beads)
    assert hovi.Grasped(bead, "tip", 1e9).mass == 1e9
    with pytest.raises(InputError, match="the mass of grasped object 'grasped'"):
        hovi.Grasped(bead, "tip", 1.001e9)


def test_names_of_what_it_may_touch_have_to_exist(panda: hovi.Robot) -> None:
    robot = hovi.holding(panda, crate())
    clearance = hovi.Clearance(
        [hovi.Sphere([9, 0, 0], 0.1, name="ball")], may_touch=[("crate", "bal")]
    )
    with pytest.raises(InputError, match="named 'bal': did you mean 'ball'"):
        Distances(robot, clearance)


def test_a_robot_that_holds_the_same_is_the_same(panda: hovi.Robot) -> None:
    assert hovi.holding(panda, crate()) is hovi.holding(panda, [crate()])
    scene = hovi.Scene(panda)
    assert scene_holding(scene, ()) is scene
    assert scene_holding(scene, (crate(),)) is scene_holding(scene, (crate(),))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: crate(mass=0.0), "the mass of grasped object 'crate' must be positive"),
        (lambda: crate(mass="heavy"), "mass must be numbers"),
        (lambda: crate(shape=[]), "must be a hovi.Box, Sphere, Cylinder or Capsule"),
        (lambda: crate(shape=hovi.HalfSpace([0, 0, 1])), "must be a hovi.Box, Sphere, Cylinder"),
        (lambda: crate(position=[0, 0]), "`position` of grasped object 'crate' must be 3 finite"),
        (lambda: crate(inertia=[-1, 1, 1, 0, 0, 0]), "must not have a negative principal value"),
        (lambda: crate(may_touch=[3]), "`may_touch` of grasped object 'crate' must be a list"),
        (lambda: crate(name=""), "needs a name"),
        (lambda: crate(name="a\0b"), "name of a grasped object must be printable characters"),
        (lambda: crate(shape={"kind": "sphere", "position": [0, 0, 0], "radius": 1e-300}), "1e-09"),
        (lambda: crate(position=[0, True, 0]), "position must be numbers"),
        (lambda: hovi.Clearance(may_touch=["ab"]), "a list of pairs of different names"),
    ],
)
def test_an_invalid_object_is_refused_in_one_sentence(make: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()  # type: ignore[operator]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"frame": "panda_hnd"}, "has no 'panda_hnd': did you mean 'panda_hand'"),
        ({"frame": "panda_joint1"}, "must be held by a link"),
        ({"name": "panda_link1"}, "has a frame 'panda_link1' already"),
    ],
)
def test_an_object_that_does_not_fit_the_robot_is_refused(
    panda: hovi.Robot, changes: dict[str, object], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        hovi.holding(panda, crate(**changes))
    with pytest.raises(InputError, match="two grasped objects have the name"):
        hovi.holding(panda, [crate(), crate()])
    with pytest.raises(InputError, match=r"was given as a pinocchio\.Model"):
        hovi.holding(hovi.load_robot(panda.model), crate(frame="panda_hand"))


def test_a_link_that_it_always_overlaps_is_to_be_named_where_it_may_touch(ur5: hovi.Robot) -> None:
    """The box is as long as the hand and the wrist; a warning is told once of each robot."""
    shape = hovi.Box([0.1, 0.1, 1.2], [0, 0, 0.1])
    for name, may_touch in (("pole", []), ("rod", ["wrist_1_link"])):
        pole = hovi.Grasped(shape, "tool0", 1.0, name, may_touch=may_touch)
        clearance = hovi.PlanOptions(self_collision=True, grasped=[pole]).clearance
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            pairs = Distances(hovi.holding(ur5, pole), clearance).pairs
        assert {"wrist_1_link", name} not in [{pair.link, pair.other} for pair in pairs]
        sentences = [str(each.message) for each in caught]
        assert len(sentences) == (1 if not may_touch else 0)
        for sentence in sentences:
            assert "between links 'wrist_1_link' and 'pole': these" in sentence
            assert sentence.endswith("name the links in `may_touch` of the grasped object.")
