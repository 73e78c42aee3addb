"""`hovi doctor` finds each fault of a robot, and its line mends it; a good robot has none."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.cli.application import main

CUBE = """OFF
8 6 0
-0.1 -0.1 0
0.1 -0.1 0
0.1 0.1 0
-0.1 0.1 0
-0.1 -0.1 0.4
0.1 -0.1 0.4
0.1 0.1 0.4
-0.1 0.1 0.4
4 0 3 2 1
4 4 5 6 7
4 0 1 5 4
4 1 2 6 5
4 2 3 7 6
4 3 0 4 7
"""
"""A mesh file."""


def link(name: str, mass: float, shape: str, z: float = 0.15) -> str:
    """A link of the arm with a shape that is drawn and touches."""
    at = f'<origin xyz="0 0 {z}"/>'
    both = "".join(
        f"<{kind}>{at if 'box' in shape else ''}<geometry>{shape}</geometry></{kind}>"
        for kind in ("visual", "collision")
    )
    moment = f"{mass / 100:g}"
    return f"""<link name="{name}"><inertial>{at}<mass value="{mass:g}"/><inertia ixx="{moment}"
ixy="0" ixz="0" iyy="{moment}" iyz="0" izz="{moment}"/></inertial>{both}</link>
"""


def joint(name: str, kind: str, parent: str, child: str, z: float, limit: str) -> str:
    """A joint of the arm."""
    return f"""<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="0 0 {z}"/><axis xyz="0 1 0"/><limit {limit} effort="50" velocity="3"/></joint>
"""


BOX = '<box size="0.1 0.1 0.2"/>'
ANGLE = 'lower="-2" upper="1.9"'
TOOL = """<link name="tool"/><joint name="tool_fixed" type="fixed"><parent link="c"/>
<child link="tool"/><origin xyz="0 0 0.25"/></joint>"""
GOOD = (
    '<robot name="arm">\n'
    + link("base", 5, BOX, -0.3)
    + link("a", 3, '<mesh filename="package://shapes/a.off"/>')
    + link("b", 2, BOX)
    + link("c", 1, BOX.replace("0.2", "0.21"))
    + joint("j1", "prismatic", "base", "a", 0, 'lower="0" upper="0.5"')
    + joint("j2", "revolute", "a", "b", 0.5, ANGLE)
    + joint("j3", "revolute", "b", "c", 0.4, ANGLE.replace("1.9", "1.8"))
    + TOOL
    + "</robot>"
)
HEAVY_C = '<mass value="1"/><inertia ixx="0.01"\nixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>'
INERTIA_C = HEAVY_C.partition("/>")[2]
INERTIAL_B, INERTIAL_C = (
    re.search(f'(?s)name="{name}">(<inertial>.*?</inertial>)', GOOD)[1]  # type: ignore[index]
    for name in "bc"
)
SHAPE_C = '<collision><origin xyz="0 0 0.15"/><geometry><box size="0.1 0.1 0.21"/>'
LIGHT_C = HEAVY_C.replace('"1"', '"1e-4"').replace("0.01", "1e-7")
LOOP = '<loop_joint name="pin" type="revolute"><link1 link="a"/><link2 link="c"/></loop_joint>'

BOTH = {"a", "base", "c"}

# By kind: what is changed in the good file, how bad it is, and which names the finding has.
FAULTS: dict[str, tuple[str, str, str, set[str]]] = {
    "empty-range": (ANGLE, 'lower="0" upper="0"', "stops", {"j2"}),
    "range-in-degrees": (ANGLE, 'lower="-170" upper="170"', "misleads", {"j2"}),
    "range-in-millimetres": ('upper="0.5"', 'upper="500"', "misleads", {"j1"}),
    "zero-velocity": (
        f'{ANGLE} effort="50" velocity="3"',
        f'{ANGLE} effort="50" velocity="0"',
        "misleads",
        {"j2"},
    ),
    "zero-effort": (f'{ANGLE} effort="50"', f'{ANGLE} effort="0"', "misleads", {"j2"}),
    "mass-in-grams": (HEAVY_C, HEAVY_C.replace('"1"', '"1000"'), "misleads", {"j3"}),
    "inertia-in-square-millimetres": (
        INERTIA_C,
        INERTIA_C.replace("0.01", "10000"),
        "misleads",
        {"j3"},
    ),
    "impossible-inertia": (
        INERTIA_C,
        INERTIA_C.replace('izz="0.01', 'izz="0.05'),
        "misleads",
        {"c"},
    ),
    "no-inertia": (INERTIAL_C, "", "stops", {"j3"}),
    "point-mass": (INERTIA_C, INERTIA_C.replace("0.01", "0"), "hint", {"c"}),
    "no-inertial": (INERTIAL_B, "", "hint", {"b"}),
    "mesh-unit": ("", "", "misleads", {"a"}),
    "mesh": ("", "", "misleads", {"a"}),
    "no-collision-shapes": ("", "", "hint", set()),
    "tool-without-frame": (TOOL, "", "hint", {"c"}),
    "always-touching": (SHAPE_C, SHAPE_C.replace("0.1 0.1 0.21", "3 3 3"), "hint", BOTH),
    "mimic-ignored": ("</joint>\n<link", '<mimic joint="j2"/></joint>\n<link', "misleads", {"j3"}),
    "no-joint": ("", "", "stops", set()),
}


def written(folder: Path, text: str, mesh_folder: str = "shapes") -> list[str]:
    """The arguments of the command for a file with this text, after its mesh was written."""
    (folder / "robot").mkdir(parents=True)
    (folder / mesh_folder).mkdir(parents=True)
    (folder / mesh_folder / "a.off").write_text(CUBE)
    file = folder / "robot" / "arm.urdf"
    file.write_text(text)
    return [str(file), "--package-dir", str(folder)]


def checked(
    capsys: pytest.CaptureFixture[str], *arguments: str
) -> tuple[int, dict[str, dict[str, Any]]]:
    """The exit code and the findings by kind."""
    capsys.readouterr()
    code = main(["doctor", *arguments, "--json"])
    found = json.loads(capsys.readouterr().out)
    assert found["stops"] == (code == 1)
    return code, {each["kind"]: each for each in found["findings"]}


def mended(arguments: list[str], finding: dict[str, Any]) -> list[str]:
    """The arguments after every line of a finding was written where it says."""
    file, more = Path(arguments[0]), list[str]()
    tree = ElementTree.parse(file)
    semantics = ""
    for line in finding["lines"]:
        if line["where"] == "command line":
            more += line["text"].split()
        elif line["where"] == "SRDF":
            semantics += line["text"]
        elif line["where"] != "Python":
            root, new = tree.getroot(), ElementTree.fromstring(line["text"])
            parent = root if line["where"] == "." else root.find(line["where"])
            assert parent is not None
            old = None if line["where"] == "." else parent.find(new.tag)
            if old is not None:
                parent.remove(old)
            parent.append(new)
    tree.write(file)
    if semantics:
        srdf = file.with_suffix(".srdf")
        srdf.write_text(f'<robot name="arm">{semantics}</robot>')
        more += ["--srdf", str(srdf)]
    return [*arguments, *more]


def scene_file(folder: Path, more: str, q: str) -> str:
    """A scene of the arm with more lines."""
    scene = folder / "scene.toml"
    lines = "format = 2", 'robot = "robot/arm.urdf"', 'package_dirs = ["."]', "duration = 1.0"
    scene.write_text("\n".join([*lines, f"start.q = {q}", f"goal.q = {q}", more]))
    return str(scene)


def faulty(folder: Path, kind: str) -> list[str]:
    """The good arm with one fault."""
    old, new, _, _ = FAULTS[kind]
    assert old in GOOD
    text = GOOD.replace(old, new, 1)
    if kind == "no-collision-shapes":
        text = re.sub("(?s)<collision>.*?</collision>", "", GOOD)
    if kind == "no-joint":
        text = re.sub("revolute|prismatic", "fixed", GOOD)
    arguments = written(folder, text)
    if kind == "mesh-unit":
        mesh = folder / "shapes" / "a.off"
        numbers = re.sub(r"(-?0\.\d)", lambda found: f"{1e3 * float(found[1]):g}", CUBE)
        mesh.write_text(numbers)
    return arguments[:1] if kind == "mesh" else arguments


def test_a_good_robot_has_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = written(tmp_path, GOOD)
    assert checked(capsys, *arguments) == (0, {})
    assert main(["info", *arguments, "--check"]) == 0
    assert "arm: nothing hurts. Goals may name the frame tool." in capsys.readouterr().out


@pytest.mark.parametrize("kind", FAULTS)
def test_a_fault_is_found_and_its_line_mends_it(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, _, severity, names = FAULTS[kind]
    arguments = faulty(tmp_path, kind)
    code, found = checked(capsys, *arguments)
    assert found[kind]["severity"] == severity
    assert set(found[kind]["subject"]) == names
    assert code == (severity == "stops")
    assert len(found) == 1, found
    assert main(["doctor", *arguments]) == code
    assert found[kind]["sentence"] in capsys.readouterr().out
    code, left = checked(capsys, *mended(arguments, found[kind]))
    assert kind not in left
    assert code == 0
    assert set(left) <= {"always-touching"}  # of a whole robot in the air


@pytest.mark.parametrize(
    ("content", "kind", "said"),
    [
        (CUBE.replace("0.4\n", "0\n"), "collision-shape", "'a.off' has no convex hull"),
        (CUBE.replace("OFF", "OF"), "mesh", "2 of 2 meshes cannot be used"),
        ("", "mesh", "was not found in"),
    ],
)
def test_a_mesh_that_is_there_and_no_shape_is_found(
    content: str, kind: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = written(tmp_path, GOOD)
    mesh = tmp_path / "shapes" / "a.off"
    mesh.write_text(content) if content else mesh.unlink()
    code, found = checked(capsys, *arguments)
    assert (code, found.keys()) == (0, {kind})
    assert found[kind]["severity"] == "misleads"
    assert said in found[kind]["sentence"]
    assert found[kind]["lines"] == []


@pytest.mark.parametrize("factor", [1e6, 1e9])
def test_inertias_are_as_they_were(
    factor: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = written(
        tmp_path, GOOD.replace(INERTIA_C, INERTIA_C.replace("0.01", f"{factor / 100:g}"))
    )
    _, found = checked(capsys, *arguments)
    mended(arguments, found["inertia-in-square-millimetres"])
    meant, read = (pin.buildModelFromXML(x) for x in (GOOD, Path(arguments[0]).read_text()))
    assert read.inertias[3].isApprox(meant.inertias[3], 1e-9)


@pytest.mark.parametrize("turned", [False, True])
def test_lines_of_two_faults_of_a_limit_do_not_undo_each_other(
    turned: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = GOOD.replace(f'{ANGLE} effort="50" velocity="3"', 'lower="-170" upper="90" effort="50"')
    text = text.replace('upper="0.5" effort="50"', 'upper="500" effort="0"')
    arguments = written(tmp_path, text.replace('upper="90"', 'upper="90" velocity="0"'))
    code, found = checked(capsys, *arguments)
    kinds = ["range-in-degrees", "range-in-millimetres", "zero-effort", "zero-velocity"]
    assert (code, sorted(found)) == (0, kinds)
    for kind in kinds[::-1] if turned else kinds:
        mended(arguments, found[kind])
    assert checked(capsys, *arguments) == (0, {})
    model = pin.buildModelFromUrdf(arguments[0])
    np.testing.assert_allclose(model.upperPositionLimit[:2], [0.5, np.pi / 2], rtol=1e-5)


def test_a_light_wrist_gets_a_rotor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = written(tmp_path, GOOD.replace(HEAVY_C, LIGHT_C))
    code, found = checked(capsys, *arguments)
    assert code == 0
    assert found.keys() == {"light-joint"}
    assert found["light-joint"]["subject"] == ["j3"]
    (line,) = found["light-joint"]["lines"]
    rotors = eval(line["text"], {"hovi": hovi})
    robot = hovi.load_robot(arguments[0])
    q = np.array([0.2, 0.3, 1.0])
    mass = np.diag(pin.crba(robot.model, robot.model.createData(), q))
    shares = (mass + rotors.values(robot)) / mass[1]
    assert mass[2] < 1e-4 * mass[1]
    assert shares[2] > 2.5e-3
    effect = f"inertia = {{ {', '.join(f'{k} = {x}' for k, x in rotors.inertia.items())} }}"
    scene = scene_file(tmp_path, f"[effects.armature]\n{effect}\n", "[0.1, 0.0, 0.0]")
    assert checked(capsys, scene) == (0, {})


def test_a_loop_is_closed_by_locked_joints(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = written(tmp_path, GOOD.replace("</robot>", f"{LOOP}</robot>"))
    code, found = checked(capsys, *arguments)
    assert code == 0
    assert found.keys() == {"open-loop"}
    assert found["open-loop"]["severity"] == "misleads"
    (line,) = found["open-loop"]["lines"]
    assert line["text"] == "locked=['j2', 'j3']"
    _, left = checked(capsys, scene_file(tmp_path, line["text"], "[0.1]"))
    assert "open-loop" not in left


@pytest.mark.parametrize(
    ("name", "kinds"),
    [
        ("ur5", set()),
        ("panda", {"mimic-ignored"}),
        ("solo12", {"always-touching"}),
        ("talos", {"light-joint"}),
        ("kinova", {"light-joint"}),
    ],
)
def test_real_robots_have_few(
    name: str, kinds: set[str], capsys: pytest.CaptureFixture[str]
) -> None:
    code, found = checked(capsys, name)
    assert (code, found.keys()) == (0, kinds)


def test_what_is_no_robot_gets_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = written(tmp_path, GOOD.replace('lower="-2"', 'lower="4"'))
    (tmp_path / "m.npz").write_bytes(b"")
    good = written(tmp_path / "good", GOOD)
    (tmp_path / "broken.srdf").write_text("<robot><disable_collisions/></robot>")
    with_srdf = [*good, "--srdf", str(tmp_path / "broken.srdf")]
    for given in (with_srdf, arguments, [str(tmp_path / "none.urdf")], [str(tmp_path / "m.npz")]):
        assert main(["doctor", *given]) == 2
        told = capsys.readouterr()
        assert told.out == ""
        assert re.fullmatch("error: .*\n", told.err)
    assert main(["info", arguments[0], "--json"]) == 2


@pytest.mark.parametrize(
    ("old", "new", "kind", "after"),
    [
        (HEAVY_C, LIGHT_C, "light-joint", "[0.1, 0.0, 0.0]"),
        ("</robot>", f"{LOOP}</robot>", "open-loop", "[0.1]"),
    ],
)
def test_the_lines_for_a_scene_are_those_of_its_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, kind: str, after: str
) -> None:
    assert old in GOOD
    written(tmp_path, GOOD.replace(old, new))
    _, found = checked(capsys, scene_file(tmp_path, "", "[0.1, 0.0, 0.0]"))
    (line,) = (each for each in found[kind]["lines"] if each["where"] == "scene file")
    assert not any(each["where"] == "Python" for each in found[kind]["lines"])
    _, left = checked(capsys, scene_file(tmp_path, line["text"], after))
    assert kind not in left


@pytest.mark.parametrize("ending", ["urdf", "xacro"])
def test_a_package_without_its_mesh_is_named_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], ending: str
) -> None:
    written(tmp_path / "whole", GOOD)
    bare = tmp_path / "bare" / "shapes"
    bare.mkdir(parents=True)
    (bare / "package.xml").write_text("<package><name>shapes</name></package>")
    (bare / f"arm.{ending}").write_text(GOOD)
    _, found = checked(capsys, str(bare / f"arm.{ending}"))
    assert found["mesh"]["sentence"].count(f"'{bare}'") == 1
    (line,) = found["mesh"]["lines"]
    option, folder = line["text"].split()
    assert folder == "FOLDER_THAT_HOLDS_shapes"
    _, left = checked(capsys, str(bare / f"arm.{ending}"), option, str(tmp_path / "whole"))
    assert "mesh" not in left
