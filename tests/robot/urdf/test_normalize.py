"""Pinocchio reads from the normalized text what the check has read, for any spelling."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from hovi.errors import ModelError
from hovi.robot.example_robots import example_names, example_robot
from hovi.robot.loading import load_robot
from hovi.robot.urdf.normalize import plain_urdf

ARM_FILE = Path(__file__).parents[3] / "models" / "two_link.urdf"
ARM = ARM_FILE.read_text()
MASS = 'mass value="0.375"'
AXIS = '<axis xyz="0 -1 0"/>'


@pytest.mark.parametrize("mass", [" 0.375", "0.375 ", "\t0.375", "&#51;.75e-1", "+.375"])
def test_a_mass_is_read_as_it_is_written(mass: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.replace(MASS, f'mass value="{mass}"'))
    assert load_robot(path).model.inertias[1].mass == 0.375


@pytest.mark.parametrize("axis", ["0\t-1\t0", "0\n-1\n0", " 0  -1  0 ", "0 -2 0", "0 -1e-6 0"])
def test_an_axis_is_read_as_it_is_written(axis: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.replace(AXIS, f'<axis xyz="{axis}"/>'))
    robot, q = load_robot(path), np.array([0.3, 0.7])
    plain = pin.buildModelFromXML(ARM)
    mass = pin.crba(robot.model, robot.model.createData(), q)
    np.testing.assert_allclose(mass, pin.crba(plain, plain.createData(), q), rtol=1e-14)


@pytest.mark.parametrize(
    "change",
    [
        ("<robot", "<?other program?><robot"),
        ('encoding="utf-8"', 'encoding="klingon"'),
        ("</robot>", '<gazebo><mass value="heavy"/></gazebo></robot>'),
        (AXIS, AXIS + "<dynamics/>"),
        (AXIS, '<axis xyz="0 -1 0"><note value="heavy"/></axis>'),
        ("<robot", '<robot xmlns="http://www.ros.org"'),
    ],
    ids=["instruction", "encoding", "extension", "no dynamics", "inside an axis", "namespace"],
)
def test_content_that_pinocchio_does_not_use_is_harmless(
    change: tuple[str, str], tmp_path: Path
) -> None:
    text = ARM.replace('<?xml version="1.0"?>', '<?xml version="1.0" encoding="utf-8"?>')
    assert change[0] in text
    path = tmp_path / "arm.urdf"
    path.write_text(text.replace(*change))
    robot = load_robot(path)
    assert robot.model == pin.buildModelFromXML(ARM)
    assert robot.visual is not None
    assert robot.visual.ngeoms > 0
    assert "2 joints" in robot.describe()


def test_stray_text_does_not_reach_pinocchio(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.replace("<inertial>", "<inertial>stray --").replace("<axis", "stray<axis"))
    assert "stray" not in plain_urdf(path.read_text())
    assert load_robot(path).visual is not None


@pytest.mark.parametrize("name", example_names())
def test_published_robots_are_bitwise_unchanged(name: str) -> None:
    try:
        text = example_robot(name).urdf.read_text()
    except ModelError:
        pytest.skip("described by an SDF file")
    plain = pin.buildModelFromXML(plain_urdf(text, name))
    assert plain.saveToString() == pin.buildModelFromXML(text).saveToString()


def test_a_second_root_joint_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.replace('joint name="shoulder"', 'joint name="root_joint"'))
    assert load_robot(path).joint_names == ("root_joint", "elbow")
    with pytest.raises(ModelError, match="'root_joint', the name of its floating base"):
        load_robot(path, free_flyer=True)


def test_a_link_with_the_name_of_a_joint_is_found(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.replace('joint name="shoulder"', 'joint name="tip"'))
    q = np.array([[0.3, 0.7]])
    position = load_robot(path).frame_position("tip", q)
    wanted = load_robot(ARM_FILE).frame_position("tip", q)
    np.testing.assert_array_equal(position, wanted)
