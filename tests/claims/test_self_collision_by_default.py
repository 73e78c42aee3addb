"""Links keep apart unless it is said by name that they may meet, and pairs at ends are named."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

import hovi
from hovi.cli.application import main
from oracles.mesh_distances import MeshDistances

START = [0.0, -1.2, 1.0, -0.6, -0.8, 0.2]
GOAL = [0.9, -0.9, 1.3, -0.9, -0.5, 0.6]
"""Ends of a UR5 between which the motion of least torque brings its links into each other."""
FOLDED = [0.0, -1.2, 2.9, 0.0, 0.0, 0.0]
"""A configuration at which they are in each other."""
MARGIN = 0.01
SCENE = f"""robot = "ur5"
duration = 1.5
start = {START}
goal = {GOAL}
[effects.gravity]
acceleration = 9.81
"""

URDF = """<robot name="fork"><link name="base"/>
{links}{joints}</robot>"""
LINK = """<link name="{name}"><inertial><mass value="1"/><origin xyz="0 0 {at}"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>{shape}</link>"""
JOINT = """<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
<axis xyz="1 0 0"/><limit lower="-1" upper="1" velocity="5" effort="100"/></joint>"""
FORK = '<collision><geometry><mesh filename="fork.obj"/></geometry></collision>'
STICK = (
    '<collision><origin xyz="{x} 0.3 0"/><geometry><sphere radius="0.03"/></geometry></collision>'
)


@pytest.fixture(scope="module")
def scene(ur5: hovi.Robot) -> hovi.Scene:
    return hovi.Scene(ur5, [hovi.effects.Gravity()])


def fork(folder: Path, x: float) -> hovi.Robot:
    """A fork along y, and a ball that two joints turn about x: at 0 between the prongs."""
    boxes = [(-0.2, -0.1), (0.1, 0.2)]
    sizes = [((low, high), (-0.5, 0.5), (-0.1, 0.1)) for low, high in boxes]
    sizes.append(((-0.2, 0.2), (0.5, 0.6), (-0.1, 0.1)))
    lines, faces = list[str](), list[str]()
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    for k, box in enumerate(sizes):
        lines += [f"v {a} {b} {c}" for a, b, c in itertools.product(*box)]
        for a, b, c, d in quads:
            first = [8 * k + 1 + i for i in (a, b, c, d)]
            faces += [f"f {first[0]} {first[1]} {first[2]}", f"f {first[0]} {first[2]} {first[3]}"]
    (folder / "fork.obj").write_text("\n".join([*lines, *faces, ""]))
    shapes = [("a", FORK), ("b", ""), ("c", STICK.format(x=x))]
    shapes.append(("d", STICK.format(x=0.6)))
    links = "".join(LINK.format(name=name, at=-0.2, shape=shape) for name, shape in shapes)
    pairs = itertools.pairwise(["base", "a", "b", "c", "d"])
    joints = "".join(JOINT.format(name=f"j_{b}", parent=a, child=b) for a, b in pairs)
    path = folder / "fork.urdf"
    path.write_text(URDF.format(links=links, joints=joints))
    return hovi.load_robot(path)


def test_a_default_plan_keeps_links_apart(scene: hovi.Scene) -> None:
    found = hovi.plan(scene, START, GOAL, 1.5)
    assert found.success, found.message
    q = found.trajectory.sample(np.linspace(0.0, 1.5, 500)).q
    assert MeshDistances(scene.robot).least(q) >= MARGIN - 1e-6
    assert found.margins().distance == pytest.approx(MARGIN, abs=1e-3)


def test_links_may_meet_where_it_is_said_by_name_and_the_caution_stays(scene: hovi.Scene) -> None:
    found = hovi.plan(scene, START, GOAL, 1.5, self_collision=False)
    assert found.success, found.message
    cautions = [each for each in found.trajectory.cautions if "into each other" in each]
    assert len(cautions) == 1
    assert cautions[0] in found.message
    q = found.trajectory.sample(np.linspace(0.0, 1.5, 200)).q
    assert MeshDistances(scene.robot).least(q) == 0.0


@pytest.mark.parametrize("ends", [(FOLDED, GOAL), (START, FOLDED)])
def test_an_end_in_which_links_overlap_is_refused_by_name(
    scene: hovi.Scene, ends: tuple[list[float], list[float]]
) -> None:
    d, links = MeshDistances(scene.robot).at(np.array(FOLDED))
    assert d == 0.0
    found = hovi.plan(scene, *ends, 1.5)
    assert found.status == "infeasible"
    assert "overlap by" in found.message
    assert hovi.plan(scene, *ends, 1.5, self_collision=False).status != "infeasible"
    assert any(link in found.message for link in links)


def planned(robot: hovi.Robot, **options: object) -> hovi.Solution:
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    return hovi.plan(scene, [0.0] * 4, [0.1, 0.2, 0.1, 0.1], 1.0, intervals=8, **options)


def test_a_pair_of_which_hulls_alone_overlap_is_left_out_and_named(tmp_path: Path) -> None:
    robot = fork(tmp_path, 0.0)
    assert MeshDistances(robot).at(np.zeros(4))[0] == pytest.approx(0.07, abs=1e-6)
    found = planned(robot)
    assert found.success, found.message
    assert "Links 'a' and 'c' are not kept apart: at the start their convex hulls" in found.message
    assert "0.07 m apart" in found.message
    assert any("are not kept apart" in each for each in found.trajectory.cautions)
    assert found.trajectory.metadata["clearance"]["left_out"] == [["a", "c"]]


def test_a_motion_through_the_mesh_of_a_pair_that_is_left_out_is_said(tmp_path: Path) -> None:
    """The ball turns about z, from between the prongs through one of them to its far side."""
    fork(tmp_path, 0.0)
    path = tmp_path / "fork.urdf"
    before, after = path.read_text().split('name="j_c"')
    path.write_text(f'{before}name="j_c"{after.replace("1 0 0", "0 0 1", 1)}')
    robot = hovi.load_robot(path)
    scene, goal = hovi.Scene(robot, [hovi.effects.Gravity()]), [0.0, 0.0, 1.0, 0.0]
    found = hovi.plan(scene, [0.0] * 4, goal, 1.0, intervals=8)
    assert found.success, found.message
    said = next(each for each in found.trajectory.cautions if "into each other at" in each)
    assert "The motion brings 'a' and 'c' into each other at t =" in said
    t = float(said.rsplit("t = ", 1)[1].split()[0])
    q = found.trajectory.sample(np.linspace(0.0, 1.0, 401)).q
    meet = [MeshDistances(robot).at(each)[0] == 0.0 for each in q]
    assert not meet[0]
    assert not meet[-1]
    assert t == pytest.approx(meet.index(True) / 400, abs=1 / 100)


@pytest.mark.parametrize("x", [0.11, 0.15])
def test_meshes_that_overlap_at_an_end_are_refused(tmp_path: Path, x: float) -> None:
    """A ball through the side of a prong, and one that is wholly in it."""
    found = planned(fork(tmp_path, x))
    assert found.status == "infeasible"
    assert "link 'a' and link 'c' overlap by" in found.message


def test_files_without_a_format_are_read_as_before(tmp_path: Path) -> None:
    old, new = tmp_path / "old.toml", tmp_path / "new.toml"
    old.write_text(SCENE)
    new.write_text("format = 2\n" + SCENE)
    before, now = (hovi.plan_task(hovi.load_task(path)) for path in (old, new))
    assert before.cost < now.cost
    assert "old.toml has no `format`" in before.message
    assert any("has no `format`" in each for each in before.trajectory.cautions)
    assert now.margins().distance == pytest.approx(MARGIN, abs=1e-3)
    assert "format" not in now.message
    saved = hovi.save_task(hovi.load_task(old), tmp_path / "saved.toml")
    assert hovi.load_task(saved).options.self_collision is False
    assert hovi.load_task(saved).note == ""


def test_a_robot_without_shapes_plans_as_before(two_link: hovi.Robot) -> None:
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    both = [
        hovi.plan(scene, [0.0, 0.0], [0.3, 0.7], 1.0, limits="none", intervals=8, **given)
        for given in ({}, {"self_collision": False})
    ]
    assert both[0].message == both[1].message
    np.testing.assert_array_equal(both[0].trajectory.q, both[1].trajectory.q)


def test_missing_meshes_are_named_where_nothing_is_kept_apart(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fork(tmp_path, 1.5)
    path = tmp_path / "scene.toml"
    path.write_text(
        'format=2\nrobot = "fork.urdf"\nduration = 1\nstart = [0, 0, 0, 0]\ngoal = [0, 0, 0, 0]\n'
    )
    assert main(["info", str(path)]) == 0
    assert "keeps 0.01 m from itself" in capsys.readouterr().out
    (tmp_path / "fork.obj").unlink()
    assert main(["info", str(path)]) == 0
    out = capsys.readouterr().out
    assert "from itself" not in out
    assert "Self-collision was not looked at: distances need every collision shape" in out
