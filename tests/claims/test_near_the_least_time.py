"""Motions that have little more than their least time are found, and shorter ones are refused.

A mass m that rests at both ends of a way D, within |v| <= V in T = D / V + s, costs least when its
acceleration falls linearly to zero within 3 s / 2 from each end, where it reaches V:

    J = 8 m^2 V^2 / (9 s),  3 s <= T.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hovi

SLIDER = """<robot name="slider"><link name="rail"/><link name="cart"><inertial>
<mass value="{mass}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="x" type="prismatic"><parent link="rail"/><child link="cart"/><axis xyz="1 0 0"/>
<limit lower="-9" upper="9" velocity="1" effort="1e9"/></joint></robot>"""


def slider(folder: Path, mass: float) -> hovi.Scene:
    path = folder / "slider.urdf"
    path.write_text(SLIDER.format(mass=mass))
    return hovi.Scene(hovi.load_robot(path), [])


@pytest.mark.parametrize("seed", range(6))
def test_a_velocity_limit_alone_leaves_short_ramps(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    mass, way, most = rng.uniform(0.5, 4.0), rng.uniform(0.2, 4.0), rng.uniform(0.3, 3.0)
    T = (1.0 + (0.002, 0.005, 0.01, 0.02, 0.05, 0.2)[seed]) * way / most
    found = hovi.plan(slider(tmp_path, mass), [0.0], [way], T, limits={"v": [most]})
    assert found.success, found.message
    assert found.cost == pytest.approx(8 * mass**2 * most**2 / (9 * (T - way / most)), rel=2e-3)
    motion = found.trajectory.sample(np.linspace(0.0, T, 50_001))
    assert np.abs(motion.v).max() <= most * (1 + 3e-6)
    assert motion.q[[0, -1], 0] == pytest.approx([0.0, way], abs=1e-9)


@pytest.mark.parametrize("share", [1.002, 1.01])
@pytest.mark.parametrize("limit", [{"a": [4.0]}, {"tau": [8.0]}])
def test_with_an_acceleration_limit_too(
    limit: dict[str, list[float]], share: float, tmp_path: Path
) -> None:
    scene = slider(tmp_path, 2.0)
    least = 1.3 + 1 / 4  # at 1 m/s, and 4 m/s^2 on both ramps
    found = hovi.plan(scene, [0.0], [1.3], share * least, limits={"v": [1.0], **limit})
    assert found.success, found.message
    motion = found.trajectory.sample(np.linspace(0.0, share * least, 50_001))
    assert np.abs(motion.v).max() <= 1 + 3e-6
    assert np.abs(motion.a).max() <= 4 * (1 + 1e-5)
    shorter = hovi.plan(scene, [0.0], [1.3], 0.998 * least, limits={"v": [1.0], **limit})
    assert shorter.status == "infeasible"
    assert not shorter.success
