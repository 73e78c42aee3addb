"""Plans for a group of joints, the others being locked where they are at the start."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hovi
from hovi.errors import HoviError, InputError, ModelError
from hovi.robot.srdf import parse_srdf

FAST = {"intervals": 8, "scheme": "galerkin-2", "continuation": False}
ARM = [f"panda_joint{i}" for i in range(1, 8)]


@pytest.fixture(scope="module")
def scene() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("panda"), [hovi.effects.Gravity()])


def start_of(scene: hovi.Scene, opening: float) -> np.ndarray:
    q = scene.robot.pose("default")
    q[-2:] = opening, 0.01
    return q


def test_the_motion_is_that_of_the_robot_with_its_hand_locked(scene: hovi.Scene) -> None:
    q, opening = start_of(scene, 0.02), {"panda_finger_joint1": 0.02, "panda_finger_joint2": 0.01}
    arm = hovi.load_robot("panda", locked=opening)
    goal = q + np.array([0.2] * 7 + [0, 0])
    motion = hovi.plan(scene, q, hovi.State(goal), 1.5, group="arm", **FAST, self_collision=False)
    same = hovi.plan(
        hovi.Scene(arm, scene.effects), q[:7], goal[:7], 1.5, **FAST, self_collision=False
    )
    assert motion.trajectory.robot is not None
    assert list(motion.trajectory.robot.joint_names) == ARM
    assert motion.trajectory.robot.source.held == opening
    assert motion.cost == pytest.approx(same.cost, rel=1e-12)
    np.testing.assert_allclose(motion.trajectory.q, same.trajectory.q, atol=1e-12)


def test_a_frame_is_reached_with_the_hand_as_it_was(scene: hovi.Scene) -> None:
    q = start_of(scene, 0.03)
    goal = hovi.FrameGoal("panda_leftfinger", position=[0.45, 0.1, 0.5])
    motion = hovi.plan(scene, q, goal, 2.0, group="arm", self_collision=False)
    assert motion.success, motion.message
    last = np.concatenate([motion.trajectory.q[-1], q[-2:]])
    reached = scene.robot.frame_position("panda_leftfinger", last[None])[0]
    np.testing.assert_allclose(reached, [0.45, 0.1, 0.5], atol=1e-9)


def test_a_table_of_the_group_alone_leaves_the_other_joints_where_they_start(
    scene: hovi.Scene, tmp_path: Path
) -> None:
    q = start_of(scene, 0.02)
    table = {joint: float(x) + 0.2 for joint, x in zip(ARM, q, strict=False)}
    whole = hovi.plan(
        scene, q, q + np.array([0.2] * 7 + [0, 0]), 1.5, group="arm", **FAST, self_collision=False
    )
    for goal in (table, {"q": table}, hovi.State(table)):
        same = hovi.plan(scene, q, goal, 1.5, group="arm", **FAST, self_collision=False)
        assert same.cost == pytest.approx(whole.cost, rel=1e-12)
    with pytest.raises(InputError, match="leaves out joint 'panda_finger_joint1'"):
        hovi.plan(scene, q, table, 1.5, **FAST, self_collision=False)
    with pytest.raises(InputError, match="leaves out joint 'panda_joint7'"):
        hovi.plan(
            scene, q, dict(list(table.items())[:6]), 1.5, group="arm", **FAST, self_collision=False
        )
    written = "{ " + ", ".join(f"{joint} = {x}" for joint, x in table.items()) + " }"
    text = f'robot = "panda"\ngroup = "arm"\nstart.q = {q.tolist()}\nscheme = "galerkin-2"\n'
    text += "intervals = 8\ncontinuation = false\n[effects.gravity]\n"
    alone, parts = tmp_path / "alone.toml", tmp_path / "parts.toml"
    alone.write_text(f"duration = 1.5\ngoal.q = {written}\n{text}")
    parts.write_text(f"{text}[[segments]]\nduration = 1.5\ngoal.q = {written}\n")
    for file in (alone, parts):
        again = hovi.plan_task(hovi.load_task(file))
        assert again.cost == pytest.approx(whole.cost, rel=1e-6)


def test_a_goal_that_moves_other_joints_is_refused(scene: hovi.Scene) -> None:
    q = start_of(scene, 0.02)
    with pytest.raises(InputError, match="'panda_finger_joint1' is not in group 'arm'"):
        hovi.plan(scene, q, start_of(scene, 0.03), 1.0, group="arm", **FAST, self_collision=False)
    with pytest.raises(InputError, match="no group 'amr': did you mean 'arm'"):
        hovi.plan(scene, q, q, 1.0, group="amr", **FAST, self_collision=False)
    two_link = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")))
    with pytest.raises(InputError, match="defines none"):
        hovi.plan(two_link, [0, 0], [1, 1], 1.0, group="arm", **FAST, self_collision=False)


SRDF = """<robot name="panda">
<group name="chain"><chain base_link="panda_link2" tip_link="panda_link5"/></group>
<group name="link"><link name="panda_link3"/><link name="panda_hand"/></group>
<group name="both"><group name="link"/><joint name="panda_joint7"/><passive_joint name="x"/></group>
<group name="loop"><group name="loop"/></group>
<group name="ghost"><link name="nowhere"/></group>
<group name="missing"><group name="other"/></group>
</robot>"""


@pytest.mark.parametrize(
    ("group", "joints"),
    [
        ("chain", ["panda_joint3", "panda_joint4", "panda_joint5"]),
        ("link", ["panda_joint3"]),
        ("both", ["panda_joint3", "panda_joint7"]),
    ],
)
def test_groups_are_chains_links_joints_and_groups(group: str, joints: list[str]) -> None:
    """The hand is fixed to the last link, and so without a joint of its own."""
    model = hovi.load_robot("panda").model
    assert list(parse_srdf(SRDF).joints_of(group, model)) == joints


@pytest.mark.parametrize(
    ("group", "sentence"),
    [
        ("loop", "contains itself"),
        ("ghost", "link 'nowhere', which does not exist"),
        ("missing", "'other' that it does not define"),
    ],
)
def test_groups_that_mean_nothing_are_refused(group: str, sentence: str) -> None:
    with pytest.raises(ModelError, match=sentence):
        parse_srdf(SRDF).joints_of(group, hovi.load_robot("panda").model)


FILE = """robot = "panda"
duration = 2
group = "arm"
start = { q = "default" }
goal = { frame = "panda_hand", position = [0.4, 0.1, 0.5] }
[scheme]
intervals = 8
[effects.gravity]
"""


def test_scene_files_name_a_group(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(FILE)
    task = hovi.load_task(path)
    assert hovi.load_task(hovi.save_task(task, tmp_path / "again.toml")).options.group == "arm"
    motion = hovi.plan_task(task, continuation=False)
    assert motion.trajectory.robot is not None
    assert list(motion.trajectory.robot.joint_names) == ARM
    path.write_text(FILE.replace('"arm"', '"amr"'))
    with pytest.raises(HoviError, match="did you mean 'arm'"):
        hovi.plan_task(hovi.load_task(path))
