from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from hovi.errors import InputError
from hovi.robot.loading import load_robot
from hovi.robot.urdf.planar_chain import chain, write_chain


@pytest.mark.parametrize("n", [1, 3, 30])
def test_a_straight_chain_is_one_long_rod(n: int, tmp_path: Path) -> None:
    length, mass = 0.7, 1.3
    robot = load_robot(write_chain(tmp_path / "chain.urdf", n, length=length, mass=mass))
    inertia = pin.crba(robot.model, robot.model.createData(), robot.neutral())
    radius = length / 30.0
    rod = n * mass * ((n * length) ** 2 / 3.0 + radius**2 / 4.0)
    assert inertia[0, 0] == pytest.approx(rod, rel=1e-13)
    tip = robot.frame_position("tip", robot.neutral()[None])
    assert tip[0] == pytest.approx([n * length, 0.0, 0.0], abs=1e-12)


def test_positive_angles_lift_against_gravity(tmp_path: Path) -> None:
    robot = load_robot(write_chain(tmp_path / "chain.urdf", 1, length=2.0, mass=3.0))
    torque = pin.rnea(robot.model, robot.model.createData(), np.zeros(1), np.zeros(1), np.zeros(1))
    assert torque == pytest.approx([3.0 * 9.81 * 1.0], rel=1e-14)


def test_a_chain_has_visual_geometry(tmp_path: Path) -> None:
    robot = load_robot(write_chain(tmp_path / "chain.urdf", 4))
    assert robot.visual is not None
    assert robot.visual.ngeoms == 8
    assert robot.joint_names == ("joint1", "joint2", "joint3", "joint4")
    assert robot.tip_frame == "tip"


@pytest.mark.parametrize("n", [0, -1, 251, 2.0, True, "3"])
def test_an_invalid_number_of_links_is_refused(n: object) -> None:
    with pytest.raises(InputError, match="1 to 250 links"):
        chain(n)  # type: ignore[arg-type]


@pytest.mark.parametrize("value", [0.0, -1.0, 1e300, float("nan"), float("inf")])
def test_a_link_without_positive_length_and_mass_is_refused(value: float) -> None:
    with pytest.raises(InputError, match="positive length and mass"):
        chain(2, length=value)
    with pytest.raises(InputError, match="positive length and mass"):
        chain(2, mass=value)
