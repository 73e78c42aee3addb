"""Where a robot ends, against Jacobians and chains of joints by Pinocchio."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.cli.application import main
from hovi.errors import InputError, ModelError
from hovi.robot.example_robots import BUILT_IN_CODE, example_names
from hovi.robot.frame_distance import FrameDistance
from hovi.robot.loading import load_robot
from hovi.robot.model import frame_id
from hovi.robot.robot import Robot
from hovi.robot.tip_frame import is_end_effector_name, is_moved, names_in_words

Array = npt.NDArray[np.float64]
Load = Callable[..., Robot]

LINKS = (pin.FrameType.BODY, pin.FrameType.OP_FRAME)
FEET = tuple(f"{leg}_FOOT" for leg in ("LF", "LH", "RF", "RH"))

EXPECTED = {
    "anymal": FEET,
    "anymal_kinova": ("j2s6s200_end_effector",),
    "baxter": ("left_gripper", "right_gripper"),
    "kinova": ("j2s6s200_end_effector",),
    "panda": ("panda_hand_tcp",),
    "pr2": ("l_gripper_tool_frame", "r_gripper_tool_frame"),
    "romeo": ("l_gripper", "r_gripper"),
    "solo12": ("FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"),
    "talos": ("wrist_left_ft_tool_link", "wrist_right_ft_tool_link"),
    "talos_arm": ("wrist_left_ft_tool_link",),
    "talos_legs": ("left_sole_link", "right_sole_link"),
    "tiago": ("hand_tool_link",),
    "tiago_dual": ("hand_left_tool_link", "hand_right_tool_link"),
    "ur5": ("tool0",),
    "xarm7": ("link_eef",),
    "z1": ("gripperMover",),
}
"""What a person calls the tip of these."""

TOOLS = """tool0 panda_hand_tcp ee_link link_eef EELink leftHandLink TCP hand_l gripper_frame_link
LeftSakePalmLink end_effector LEFT_FOOT tool_center_point"""
NO_TOOLS = """hand_index_flex_3_link left_hand_camera_link gripperMover wheel link_7 knee beetle
coffee LEFT_FOOT_IMU_LINK l_gripper_l_finger_tip tip 3"""


def configurations(model: pin.Model, count: int = 3) -> Iterator[Array]:
    random = np.random.default_rng(7)
    for _ in range(count):
        yield pin.integrate(model, pin.neutral(model), random.uniform(-1, 1, model.nv))


def jacobian_size(model: pin.Model, frame: int, rows: slice) -> float:
    """The largest entry of a frame's Jacobian at random configurations; rows: of 6."""
    data, axes = model.createData(), pin.LOCAL_WORLD_ALIGNED
    found = (pin.computeFrameJacobian(model, data, q, frame, axes) for q in configurations(model))
    return max(float(np.abs(J[rows]).max(initial=0.0)) for J in found)


def joints_above(model: pin.Model, frame: str) -> set[int]:
    """Indices of the joints between the world and a frame."""
    return set(model.supports[model.frames[frame_id(model, frame)].parentJoint]) - {0}


# Every example


@pytest.mark.parametrize("name", sorted({*example_names(), *BUILT_IN_CODE}))
def test_the_tips_of_every_example_move_and_end_its_longest_chains(name: str) -> None:
    try:
        robot = load_robot(name)
    except ModelError:
        assert name == "cassie"
        return
    model = robot.model
    assert robot.tip_frame == robot.tip_frames[0]
    for frame in robot.tip_frames:
        assert jacobian_size(model, frame_id(model, frame), slice(0, 3)) > 1e-3
    depth = max(len(support) for support in model.supports) - 1
    longest = [set(s) - {0} for s in model.supports if len(s) - 1 == depth]
    tips = {frame: joints_above(model, frame) for frame in robot.tip_frames}
    for chain in longest:  # each has a tip, at its end or at a hand with a name of its own
        (tip,) = (frame for frame, above in tips.items() if above <= chain)
        assert len(tips[tip]) == depth or is_end_effector_name(tip)
        assert 2 * len(tips[tip]) >= depth
        beyond = [f for f in model.frames if f.parentJoint in chain - tips[tip]]
        assert not any(is_end_effector_name(f.name) for f in beyond if f.type in LINKS)
    assert all(any(above <= chain for chain in longest) for above in tips.values())


@pytest.mark.parametrize(("name", "tips"), EXPECTED.items())
def test_the_tips_are_those_that_a_person_would_name(name: str, tips: tuple[str, ...]) -> None:
    assert load_robot(name).tip_frames == tips


@pytest.mark.parametrize("name", ["baxter", "tiago", "panda", "anymal", "kinova"])
def test_a_frame_moves_where_its_jacobian_is_not_zero(name: str) -> None:
    model = load_robot(name).model
    moved = [is_moved(model, frame.name) for frame in model.frames]
    same = [model.frames[frame_id(model, frame.name)] == frame for frame in model.frames]
    turned = [jacobian_size(model, i, slice(0, 6)) > 0 for i in range(model.nframes)]
    assert [m for m, its in zip(moved, same, strict=True) if its] == [
        t for t, its in zip(turned, same, strict=True) if its
    ]
    assert any(moved)
    assert not all(moved)


# Locked joints, mimics, bases that float


def test_locked_joints_do_not_move(panda: Robot) -> None:
    assert panda.tip_frames == ("panda_hand_tcp",)
    baxter = load_robot("baxter")
    left = [joint for joint in baxter.joint_names if joint.startswith("l")]
    assert load_robot("baxter", locked=left).tip_frames == ("right_gripper",)
    arms = [joint for joint in baxter.joint_names if joint != "head_pan"]
    assert load_robot("baxter", locked=arms).tip_frames == ("display",)
    still = load_robot("baxter", locked=baxter.joint_names)
    assert still.tip_frames == ("sonar_ring",)
    with pytest.raises(InputError, match=r"frame 'sonar_ring' .* as no joint moves it\.$"):
        still.check_frame_moves("sonar_ring")


LINK = (
    '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" '
    'izz="1"/></inertial></link>'
)


def tree(joints: dict[str, str], mimic: str = "") -> str:
    """A URDF of links by the link that carries each; mimic: the one whose joint mimics `a`."""
    text = LINK.format("base")
    for link, parent in joints.items():
        follows = '<mimic joint="a_joint"/>' if link == mimic else ""
        text += LINK.format(link) + (
            f'<joint name="{link}_joint" type="revolute"><parent link="{parent}"/>'
            f'<child link="{link}"/><origin xyz="0.1 0 0.2"/><axis xyz="0 1 0"/>'
            f'<limit lower="-2" upper="2" effort="9" velocity="9"/>{follows}</joint>'
        )
    return f'<robot name="tree">{text}</robot>'


@pytest.fixture
def loaded(tmp_path: Path) -> Load:
    def load(text: str, **options: object) -> Robot:
        path = tmp_path / "tree.urdf"
        path.write_text(text)
        return load_robot(path, **options)  # type: ignore[arg-type]

    return load


def test_joints_that_mimic_others_count(loaded: Load) -> None:
    text = tree({"a": "base", "b": "a", "c": "base"}, mimic="b")
    robot = loaded(text, mimic=True)
    assert (robot.nv, robot.tip_frames) == (2, ("b",))


def test_a_base_that_floats_moves_every_frame(loaded: Load) -> None:
    text = tree({"a": "base"})
    fixed, floating = loaded(text), loaded(text, free_flyer=True)
    with pytest.raises(InputError, match=r"'base' of robot 'tree' is fixed to the world.*'a'"):
        fixed.check_frame_moves("base")
    floating.check_frame_moves("base")
    assert fixed.tip_frames == floating.tip_frames == ("a",)


def test_among_chains_of_one_length_a_tool_comes_first(loaded: Load) -> None:
    assert loaded(tree({"a": "base", "b": "base"})).tip_frames == ("a", "b")
    assert loaded(tree({"a": "base", "tool0": "base"})).tip_frames == ("tool0", "a")
    assert loaded(tree({"a": "base", "b": "a", "c": "base"})).tip_frames == ("b",)


def test_fingers_end_at_their_hand_unless_they_are_most_of_the_chain(loaded: Load) -> None:
    fingers = {"f1": "palm", "f2": "palm"}
    arm = {"a": "base", "palm": "a"} | fingers
    assert loaded(tree(arm)).tip_frames == ("palm",)
    long = {"palm": "base"} | fingers | {"g1": "f1", "g2": "f2"}
    assert loaded(tree(long)).tip_frames == ("g1", "g2")


def test_a_model_without_links_ends_at_a_joint() -> None:
    model = pin.Model()
    first = model.addJoint(0, pin.JointModelRY(), pin.SE3.Identity(), "first")
    place = pin.SE3(np.eye(3), np.array([0.0, 0.0, 1.0]))
    last = model.addJoint(first, pin.JointModelRY(), place, "last")
    for joint in (first, last):
        model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Identity())
        model.addJointFrame(joint)
    assert load_robot(model).tip_frames == ("last",)


# Names


@pytest.mark.parametrize("name", TOOLS.split())
def test_names_of_tools_hands_and_feet(name: str) -> None:
    assert is_end_effector_name(name)


@pytest.mark.parametrize("name", ["", *NO_TOOLS.split()])
def test_other_names_are_not_those_of_tools(name: str) -> None:
    assert not is_end_effector_name(name)


def test_frames_are_named_in_sentences() -> None:
    assert names_in_words(["left"]) == "left"
    assert names_in_words(["left", "right"]) == "left and right"
    assert names_in_words(FEET) == "LF_FOOT and 3 more"


def test_the_command_names_all_tips(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "baxter"]) == 0
    assert "Tip frames: left_gripper, right_gripper.\n" in capsys.readouterr().out
    assert main(["info", "ur5"]) == 0
    out = capsys.readouterr().out
    assert "Tip frame: tool0.\nFrames: tool0, ee_link, wrist_3_link, " in out
    assert "wrist_3_joint," not in out.partition("Frames:")[2]


# Distances


def test_the_distance_of_several_frames_is_that_of_each_by_pinocchio() -> None:
    robot = load_robot("baxter")
    model, data = robot.model, robot.model.createData()
    q, other = (np.array(list(configurations(model, 4)))[i] for i in ([0, 1], [2, 3]))
    distance = FrameDistance.between(robot, q, other)
    for row, pair in zip(distance.each, zip(q, other, strict=True), strict=True):
        places = []
        for one in pair:
            pin.framesForwardKinematics(model, data, one)
            ids = [frame_id(model, frame) for frame in robot.tip_frames]
            places.append([data.oMf[i].translation.copy() for i in ids])
        expected = np.linalg.norm(np.subtract(*places), axis=1)
        np.testing.assert_allclose(row, expected, rtol=1e-13)
    np.testing.assert_array_equal(distance.largest, distance.each.max(axis=1))
    m, f = np.unravel_index(np.argmax(distance.each), distance.each.shape)
    assert distance.frame == distance.frame_at(int(m)) == robot.tip_frames[f]


def test_a_frame_that_cannot_be_measured_is_refused_by_name(ur5: Robot) -> None:
    q = ur5.neutral()[None]
    with pytest.raises(InputError, match="no frame 'tool1': did you mean 'tool0'"):
        FrameDistance.between(ur5, q, q, "tool1")
    sentence = r"frame 'base' of robot 'ur5' is fixed to the world.*; one that moves is 'tool0'\.$"
    with pytest.raises(InputError, match=sentence):
        FrameDistance.between(ur5, q, q, "base")
    assert FrameDistance.between(ur5, q, q, "wrist_1_link").frames == ("wrist_1_link",)
