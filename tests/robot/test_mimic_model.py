"""Mimic joints against Pinocchio's RNEA and against the same robot without couplings."""

from __future__ import annotations

import pickle
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi import PlanOptions, plan
from hovi.accuracy.effect_study.study import study_effects
from hovi.cli.application import main
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.dynamics.torque_model import CasadiTorque
from hovi.effects import Drag, Gravity, MovingBase, Payload, ViscousFriction, Wrench
from hovi.errors import ModelError, SceneError
from hovi.flows.execution.dynamics_replay import replay_dynamics
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import Distances
from hovi.planning.clearance.obstacles import Box
from hovi.planning.problem.limits import urdf_limits
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task import Task
from hovi.planning.task_file.writing import save_task
from hovi.robot.loading import load_robot
from hovi.robot.mass_matrix import MassMatrix
from hovi.robot.mimic_model import CoordinateMap, Coupling, coupled, uncoupled
from hovi.robot.mimic_tags import read_couplings
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.viewing.highlights import Highlights
from oracles.finite_differences import derivative_per_point
from samples.manifold_robots import chain, configurations

Array = npt.NDArray[np.float64]

RX, RY, PZ = pin.JointModelRX, pin.JointModelRY, pin.JointModelPZ
RUB = pin.JointModelRUBY
CHAINS = {
    "two followers": ([RX(), PZ(), RY(), RX()], [("j0", 2, -1.5, 0.3), ("j0", 3, 0.5, 0.0)]),
    "sliding": ([PZ(), RX(), PZ()], [("j0", 2, -1.0, 0.02)]),
    "floating": ([pin.JointModelFreeFlyer(), RX(), RY(), PZ()], [("j1", 2, -2.0, 0.1)]),
    "a body between": ([RX(), pin.JointModelSpherical(), RY()], [("j0", 2, -0.7, 0.1)]),
    "continuous": ([RUB(), RX(), RUB()], [("j0", 2, -2.0, 0.7)]),
}


def mimic_robot(name: str) -> Robot:
    joints, links = CHAINS[name]
    return load_robot(
        coupled(chain(joints), [Coupling(f"j{i}", leader, m, o) for leader, i, m, o in links])
    )


def points(robot: Robot, count: int = 5) -> tuple[Array, Array, Array]:
    v, a = np.random.default_rng(1).normal(size=(2, count, robot.nv))
    return configurations(robot, count), v, a


def rnea(scene: Scene, q: Array, v: Array, a: Array) -> Array:
    data = scene.model.createData()
    return np.array([pin.rnea(scene.model, data, *row) for row in zip(q, v, a, strict=True)])


def close(actual: Array, expected: Array, tolerance: float) -> None:
    assert np.abs(actual - expected).max() <= tolerance * (1.0 + np.abs(expected).max())


# Torques and their derivatives


@pytest.mark.parametrize("name", ["panda", "baxter", "romeo", "tiago_pro", "pr2"])
def test_torques_of_published_robots_match_pinocchio(name: str) -> None:
    robot = load_robot(name, mimic=True)
    assert len(robot.couplings) == load_robot(name).nv - robot.nv > 0
    scene = Scene(robot, [Gravity()])
    at = points(robot)
    assert scene.analytic
    close(scene.torques.torque(*at), rnea(scene, *at), 1e-12)


@pytest.mark.parametrize("name", CHAINS)
def test_first_derivatives_match_finite_differences(name: str) -> None:
    robot = mimic_robot(name)
    scene = Scene(robot, [Gravity()])
    q, v, a = points(robot)
    tau, J = scene.torques.linearize(q, v, a)
    close(tau, rnea(scene, q, v, a), 1e-12)
    zero = np.zeros_like(v)
    by_q = derivative_per_point(lambda x: rnea(scene, robot.integrate(q, x), v, a), zero)
    by_v = derivative_per_point(lambda x: rnea(scene, q, v + x, a), zero)
    by_a = derivative_per_point(lambda x: rnea(scene, q, v, a + x), zero)
    close(J, np.concatenate([by_q, by_v, by_a], axis=2), 1e-9)


@pytest.mark.parametrize("name", CHAINS)
def test_second_derivatives_match_casadi(name: str) -> None:
    robot = mimic_robot(name)
    scene = Scene(robot, [Gravity()])
    symbols = scene.terms.symbols
    space = None if robot.vector_joints else robot.space
    tau = scene.graph()(*symbols.columns())[0]
    slow = CasadiTorque(symbols.columns(), tau, space)
    at = points(robot)
    random = np.random.default_rng(2)
    R, curvature = random.uniform(0.5, 2.0, robot.nv), random.normal(size=at[1].shape)
    for lent in (None, curvature):
        for fast, sure in zip(
            scene.torques.expand(*at, None, R, lent), slow.expand(*at, None, R, lent), strict=True
        ):
            close(fast, sure, 1e-11)


@pytest.mark.parametrize("name", CHAINS)
def test_the_mass_matrix_matches_rnea(name: str) -> None:
    """CRBA itself is wrong with a spherical joint between leader and follower."""
    robot = mimic_robot(name)
    q, v, _ = points(robot)
    scene, still = Scene(robot), np.zeros_like(v)
    columns = [rnea(scene, q, still, still + e) for e in np.eye(robot.nv)]
    mass = MassMatrix(robot.model)(q)
    close(mass, np.stack(columns, axis=2), 1e-13)
    assert np.linalg.eigvalsh(mass).min() > 0.0
    robot.check_mass_matrix()


def test_an_accelerating_base_is_equivalent_to_gravity() -> None:
    robot = mimic_robot("two followers")
    lifted = Scene(robot, [MovingBase((0.0, 0.0, "4.905*t**2"))])
    q, v, a = points(robot)
    close(lifted.torques.torque(q, v, a), rnea(Scene(robot, [Gravity(9.81)]), q, v, a), 1e-12)


@pytest.mark.parametrize("name", CHAINS)
def test_effects_on_followers_act_on_their_leaders(name: str) -> None:
    """Torques equal G^T times those of the uncoupled robot, by virtual work."""
    bound, free = mimic_robot(name), load_robot(chain(CHAINS[name][0]))
    last = f"b{len(CHAINS[name][0]) - 1}"
    effects = [
        Gravity(),
        Payload(last, 0.7, (0.1, 0.2, 0.3)),
        Wrench(last, (1.0, 2.0, 3.0), (0.3, 0.2, 0.1)),
        Drag(last, 0.3, wind=(0.0, 5.0, 0.0)),
    ]
    q, v, a = points(bound)
    pull = CoordinateMap.of(bound.model, uncoupled(bound.model))
    of_all = pull.configurations(q), v @ pull.matrix.T, a @ pull.matrix.T
    expected = Scene(free, effects).inverse_dynamics(*of_all) @ pull.matrix
    close(Scene(bound, effects).inverse_dynamics(q, v, a), expected, 1e-13)


# Plans


LINK = (
    '<link name="{0}"><inertial><origin xyz="0 0 {1}"/><mass value="{2}"/>'
    '<inertia ixx="{3}" iyy="{3}" izz="{3}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
JOINT = (
    '<joint name="{0}" type="{5}"><parent link="{1}"/><child link="{2}"/><origin xyz="0 0 {3}"/>'
    '<axis xyz="1 0 0"/><limit lower="-4" upper="4" effort="90" velocity="20"/>{4}</joint>'
)


def urdf(*parts: str) -> str:
    return "\n".join(['<robot name="made"><link name="base"/>', *parts, "</robot>"])


def joint(
    name: str, parent: str, child: str, z: float = 0.0, follows: str = "", kind: str = ""
) -> str:
    return JOINT.format(name, parent, child, z, follows, kind or "revolute")


def mimic(of: str, times: float = 1.0, offset: float = 0.0) -> str:
    return f'<mimic joint="{of}" multiplier="{times}" offset="{offset}"/>'


def loaded(tmp_path: Path, text: str, **options: object) -> Robot:
    path = tmp_path / "made.urdf"
    path.write_text(text)
    return load_robot(path, **({"mimic": True} | options))  # type: ignore[arg-type]


def test_a_tray_that_stays_level_moves_like_a_pendulum(tmp_path: Path) -> None:
    """A last link that counter-rotates the first only translates: a point mass."""
    m1, c1, i1, m2, length = 1.3, 0.4, 0.11, 0.7, 0.9
    tray = loaded(
        tmp_path,
        urdf(
            LINK.format("arm", c1, m1, i1),
            LINK.format("tray", 0.2, m2, 0.05),
            joint("swing", "base", "arm"),
            joint("level", "arm", "tray", length, mimic("swing", -1.0, 0.4)),
        ),
    )
    mass, moment = m1 + m2, m1 * c1 + m2 * length
    about_center = i1 + m1 * c1**2 + m2 * length**2 - moment**2 / mass
    bob = LINK.format("arm", moment / mass, mass, about_center)
    pendulum = loaded(tmp_path, urdf(bob, joint("swing", "base", "arm")))
    found = [
        plan(Scene(robot, [Gravity()]), [0.0], [2.0], 1.0, limits="none", intervals=12)
        for robot in (tray, pendulum)
    ]
    assert found[0].success
    assert tray.nq == 1
    assert found[0].cost == pytest.approx(found[1].cost, rel=1e-10)
    np.testing.assert_allclose(found[0].trajectory.q, found[1].trajectory.q, atol=1e-9)


def test_replayed_torques_of_the_panda_with_gripper_follow_the_plan(tmp_path: Path) -> None:
    robot = load_robot("panda", mimic=True)
    start = robot.pose("default")
    goal = start + np.array([0.5, -0.4, 0.3, 0.6, -0.2, 0.4, 0.5, 0.03])
    solution = plan(
        Scene(robot, [Gravity()]),
        start,
        goal,
        1.5,
        limits="none",
        intervals=8,
        self_collision=False,
    )
    assert solution.n_neg == 0
    replayed = replay_dynamics(solution.trajectory)
    assert max(replayed.angle, replayed.slide, replayed.largest_tip) < 1e-7
    solution.trajectory.save(tmp_path / "motion.npz")
    again = Trajectory.load(tmp_path / "motion.npz")
    assert again.robot is not None
    assert again.robot.couplings == robot.couplings
    t = np.linspace(0.0, 1.5, 7)
    np.testing.assert_array_equal(again.sample(t).tau, solution.trajectory.sample(t).tau)


def test_shapes_are_placed_like_those_of_the_free_robot() -> None:
    """For a robot whose leaders come after their followers in the URDF."""
    bound, free = (load_robot("romeo", mimic=each) for each in (True, False))
    q, follow = configurations(bound, 1, size=0.4)[0], free.neutral()
    for name in bound.joint_names:
        ours, theirs = (r.model.joints[r.model.getJointId(name)] for r in (bound, free))
        follow[theirs.idx_q : theirs.idx_q + theirs.nq] = q[ours.idx_q : ours.idx_q + ours.nq]
    for coupling in bound.couplings:
        leader = bound.model.joints[bound.model.getJointId(coupling.leader)]
        place = free.model.joints[free.model.getJointId(coupling.follower)].idx_q
        follow[place] = coupling.multiplier * q[leader.idx_q] + coupling.offset
    first, second = placements(bound, q), placements(free, follow)
    assert len(first) == len(second) > 20
    for name, placement in first.items():
        np.testing.assert_allclose(placement, second[name], atol=1e-14)


def placements(robot: Robot, q: Array) -> dict[str, Array]:
    shapes = robot.visual
    assert shapes is not None
    data, places = robot.model.createData(), shapes.createData()
    pin.updateGeometryPlacements(robot.model, data, shapes, places, q)
    pairs = zip(shapes.geometryObjects, places.oMg, strict=True)
    return {shape.name: np.array(place.homogeneous) for shape, place in pairs}


def test_second_derivatives_of_distances_include_mimic_joints() -> None:
    robot = load_robot("baxter", mimic=True)
    distances = Distances(robot, Clearance(Box([0.2, 0.2, 0.2], [0.9, -0.3, 0.4])))
    q = configurations(robot, 2, size=0.4)
    _, slopes = distances.expand(q)
    found = derivative_per_point(lambda x: distances.values(q + x), np.zeros_like(q), 1e-5)
    np.testing.assert_allclose(slopes, found, atol=1e-6)
    fingers = [robot.coordinate_names.index(c.leader) for c in robot.couplings]
    assert np.abs(slopes[:, :, fingers]).max() > 0.1


# What a URDF says of them


def two_fingers(follows: str, kind: str = "revolute") -> str:
    """A joint "b" with mass, and a joint "a" that follows it but sorts before it."""
    return urdf(
        LINK.format("left", 0.2, 1.0, 0.1),
        LINK.format("right", 0.3, 2.0, 0.2),
        joint("b", "base", "left", kind=kind),
        joint("a", "base", "right", 0.1, follows),
    )


def test_a_leader_may_come_after_its_follower(tmp_path: Path) -> None:
    robot = loaded(tmp_path, two_fingers(mimic("b", -2.0, 0.3)))
    assert robot.joint_names == ("b",)
    assert robot.frame_names[1:] == ("base", "a", "right", "b", "left")
    assert robot.couplings == (Coupling("a", "b", -2.0, 0.3),)
    free = loaded(tmp_path, two_fingers(""), mimic=False)
    q, v, a = 0.7, -0.4, 1.9
    tau = pin.rnea(robot.model, robot.model.createData(), *(np.array([x]) for x in (q, v, a)))
    at = np.array([0.3 - 2 * q, q]), np.array([-2 * v, v]), np.array([-2 * a, a])
    both = pin.rnea(free.model, free.model.createData(), *at)
    assert tau[0] == pytest.approx(both[1] - 2 * both[0], rel=1e-13)


def test_limits_and_losses_of_a_follower_are_transferred_to_its_leader(tmp_path: Path) -> None:
    text = two_fingers(mimic("b", -2.0, 1.0) + '<dynamics damping="0.5" friction="0.25"/>')
    robot = loaded(tmp_path, text)
    limits = urdf_limits(robot)
    np.testing.assert_allclose([limits.lower[0, 0], limits.upper[0, 0]], [-1.5, 2.5])
    np.testing.assert_allclose(robot.velocity_limit, [10.0])
    np.testing.assert_allclose(robot.effort_limit, [90.0])
    np.testing.assert_allclose([*robot.damping, *robot.friction], [2.0, 0.5])


def test_followers_of_fixed_joints_are_fixed(tmp_path: Path) -> None:
    text = urdf(
        LINK.format("left", 0.2, 1.0, 0.1),
        LINK.format("right", 0.3, 2.0, 0.2),
        joint("a", "base", "left"),
        joint("b", "left", "right", 0.1, mimic("a", 2.0, 0.3)),
    )
    both = loaded(tmp_path, text, mimic=False)
    neither, one = (loaded(tmp_path, text, locked=[name]) for name in "ab")
    assert neither.nv == 0
    assert one.joint_names == ("a",)
    assert not one.couplings
    held = neither.frame_position("right", np.zeros((1, 0)))
    np.testing.assert_allclose(held, both.frame_position("right", np.array([[0.0, 0.3]])))
    data = neither.model.createData()
    pin.framesForwardKinematics(neither.model, data, np.zeros(0))
    turned = data.oMf[neither.model.getFrameId("right")].rotation
    np.testing.assert_allclose(turned, pin.utils.rotate("x", 0.3), atol=1e-15)


def test_a_chain_of_mimics_follows_its_first_leader(tmp_path: Path) -> None:
    text = two_fingers(mimic("b", 2.0, 0.5)).replace("</robot>", "")
    text += LINK.format("tip", 0.1, 1.0, 0.1)
    text += joint("c", "right", "tip", 0.2, mimic("a", -3.0, 0.25)) + "</robot>"
    assert Coupling("c", "b", -6.0, -1.25) in read_couplings(text)
    assert loaded(tmp_path, text).nv == 1


@pytest.mark.parametrize(
    ("locked", "held"),
    [
        ("a", {"a": 0.0, "c": 0.25, "d": -0.125}),
        ("b", {"b": 0.0, "a": 0.5, "c": -1.25, "d": 2.125}),
        ("c", {"c": 0.0, "d": 0.25}),
    ],
)
def test_a_locked_joint_of_a_chain_fixes_its_followers(
    tmp_path: Path, locked: str, held: dict[str, float]
) -> None:
    """Of a = 2 b + 0.5, c = -3 a + 0.25, d = -1.5 c + 0.25."""
    text = two_fingers(mimic("b", 2.0, 0.5)).replace("</robot>", "")
    text += LINK.format("tip", 0.1, 1.0, 0.1) + LINK.format("top", 0.1, 1.0, 0.1)
    text += joint("c", "right", "tip", 0.2, mimic("a", -3.0, 0.25))
    text += joint("d", "tip", "top", 0.2, mimic("c", -1.5, 0.25)) + "</robot>"
    robot, free = loaded(tmp_path, text, locked=[locked]), loaded(tmp_path, text, mimic=False)
    assert robot.joint_names == (() if locked == "b" else ("b",))
    stands = {"b": 0.7, "a": 1.9, **held}
    np.testing.assert_allclose(top(robot, stands), top(free, stands), atol=1e-14)


def top(robot: Robot, stands: dict[str, float]) -> Array:
    """Position of the frame "top" at given positions of the independent joints."""
    data, q = robot.model.createData(), np.array([stands[name] for name in robot.joint_names])
    pin.framesForwardKinematics(robot.model, data, q)
    return np.array(data.oMf[robot.model.getFrameId("top")].homogeneous)


def test_a_range_that_a_continuous_leader_cannot_enforce_is_reported(tmp_path: Path) -> None:
    text = two_fingers(mimic("b", -2.0, 0.3))
    turning = text.replace('<joint name="b" type="revolute"', '<joint name="b" type="continuous"')
    assert turning != text
    note = "position range of a is not enforced"
    assert note in loaded(tmp_path, turning).describe()
    assert note not in loaded(tmp_path, turning, mimic=False).describe()
    assert note not in loaded(tmp_path, text).describe()


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (two_fingers(mimic("nobody")), "'a' mimics 'nobody', which does not exist"),
        (two_fingers(mimic("b", 0.5), "continuous"), "'a' mimics 'b', a continuous joint, 0.5"),
        (
            two_fingers(mimic("b")).replace("<limit", mimic("a") + "<limit", 1),
            "mimics itself through others",
        ),
        (
            urdf(
                LINK.format("left", 0.2, 1.0, 0.1),
                LINK.format("right", 0.3, 2.0, 0.2),
                joint("a", "base", "left", 0.0, mimic("b")),
                joint("b", "left", "right"),
            ),
            "'a' mimics 'b', which comes after it in the chain",
        ),
    ],
)
def test_an_impossible_coupling_is_refused_by_name(
    tmp_path: Path, text: str, sentence: str
) -> None:
    with pytest.raises(ModelError, match=sentence):
        loaded(tmp_path, text)


def test_without_mimic_every_joint_moves_and_the_description_says_so(tmp_path: Path) -> None:
    text = two_fingers(mimic("b", -2.0, 0.3))
    free, bound = (loaded(tmp_path, text, mimic=each) for each in (False, True))
    assert free.nv == 2
    assert "<mimic>" in free.describe()
    assert "= -2 b + 0.3" in bound.describe()
    assert "<mimic>" not in bound.describe()


def test_the_command_lists_followers(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "panda", "--mimic"]) == 0
    note = capsys.readouterr().out
    assert "nq = 8" in note
    assert "= panda_finger_joint1" in note


def test_followers_are_highlighted_with_their_leader(tmp_path: Path) -> None:
    robot = loaded(tmp_path, two_fingers(mimic("b", -2.0, 0.3)))
    limits = {"v": {"b": 1.2}}
    motion = plan(
        Scene(robot, [Gravity()]), [0.0], [1.0], 1.0, limits=limits, self_collision=False
    ).trajectory
    shown = Highlights.of(motion, robot, np.linspace(0.0, 1.0, 200))
    assert shown is not None
    flags = {name: shown.flags[:, robot.model.getJointId(name)] for name in "ab"}
    assert 0 < flags["a"].sum() < 200
    np.testing.assert_array_equal(flags["a"], flags["b"])


def test_an_effect_study_supports_mimic_joints(tmp_path: Path) -> None:
    robot = loaded(tmp_path, two_fingers(mimic("b", -2.0, 0.3)))
    task = Task(
        Scene(robot, [Gravity()]), State([0.0]), State([0.5]), 0.5, PlanOptions(limits="none")
    )
    study = study_effects(task, [Payload("right", 0.5), ViscousFriction(0.3)])
    assert all(trial.success and trial.held is not None for trial in study.trials)
    rubbed = study.trials[1]
    speed = np.abs(study.solution.trajectory.sample(np.linspace(0.0, 0.5, 2001)).v).max()
    assert rubbed.torque == pytest.approx(0.3 * speed, rel=1e-2)


def test_a_follower_cannot_be_named_as_an_independent_joint(tmp_path: Path) -> None:
    robot = loaded(tmp_path, two_fingers(mimic("b")))
    with pytest.raises(SceneError, match="no joint 'a': it mimics 'b'; name that joint"):
        Scene(robot, passive=["a"])


def test_a_pose_of_an_srdf_sets_the_leader(tmp_path: Path) -> None:
    srdf = tmp_path / "made.srdf"
    srdf.write_text(
        '<robot name="made"><group_state name="open" group="g"><joint name="a" value="0.9"/>'
        '<joint name="b" value="0.4"/></group_state></robot>'
    )
    robot = loaded(tmp_path, two_fingers(mimic("b")), srdf=srdf)
    np.testing.assert_array_equal(robot.pose("open"), [0.4])


# Files and other processes


def test_a_scene_file_supports_mimic(tmp_path: Path) -> None:
    (tmp_path / "made.urdf").write_text(two_fingers(mimic("b")))
    scene = tmp_path / "scene.toml"
    scene.write_text(
        'robot = "made.urdf"\nmimic = true\nduration = 1.0\n[start]\nq = {b = 0.0}\n'
        "[goal]\nq = [1.0]\n[effects.gravity]\n"
    )
    task = load_task(scene)
    assert task.scene.robot.couplings
    save_task(task, tmp_path / "copy.toml")
    assert load_task(tmp_path / "copy.toml").scene.robot.couplings == task.scene.robot.couplings


@pytest.mark.parametrize("name", CHAINS)
def test_robots_and_scenes_can_be_pickled(name: str) -> None:
    scene = Scene(mimic_robot(name), [Gravity()])
    again = pickle.loads(pickle.dumps(scene))
    at = points(scene.robot)
    assert again.robot.couplings == scene.robot.couplings
    np.testing.assert_array_equal(again.robot.upper, scene.robot.upper)
    close(rnea(again, *at), rnea(scene, *at), 1e-15)
    close(again.torques.torque(*at), scene.torques.torque(*at), 1e-15)


def test_a_given_model_can_lock_joints_beside_its_mimic_joints() -> None:
    model = load_robot("pr2", mimic=True).model
    held = ["r_gripper_l_finger_joint", "l_gripper_l_finger_tip_joint", "torso_lift_joint"]
    robot, same = load_robot(model, locked=held), load_robot("pr2", mimic=True, locked=held)
    assert robot.joint_names == same.joint_names
    assert {c.follower for c in robot.couplings} == {c.follower for c in same.couplings}
    assert len(robot.couplings) == 4
    at = points(robot)
    close(rnea(Scene(robot), *at), rnea(Scene(same), *at), 1e-14)


def test_the_description_lists_followers_of_fixed_joints(tmp_path: Path) -> None:
    text = urdf(
        LINK.format("a", 0.0, 1.0, 0.1),
        LINK.format("b", 0.0, 1.0, 0.1),
        joint("first", "base", "a", follows=""),
        joint("second", "a", "b", 0.5, follows=mimic("first", 0.0, 0.1)),
    )
    never = loaded(tmp_path, text)
    assert (never.nv, re.findall("second +mimic += 0.1\n", never.describe()) != []) == (1, True)
    stuck = loaded(tmp_path, text.replace('multiplier="0.0"', 'multiplier="2"'), locked="first")
    assert (stuck.nv, re.findall("second +mimic += 0.1\n", stuck.describe()) != []) == (0, True)
    assert "second" not in loaded(tmp_path, text, locked="second").describe().split("Base:")[0]


def test_the_description_says_if_no_joint_mimics_another() -> None:
    assert "no joint mimics another" in load_robot("ur5", mimic=True).describe()
    assert "no joint mimics another" not in load_robot("ur5").describe()
