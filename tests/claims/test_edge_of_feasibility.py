"""The shortest duration for which a motion is found is the least time of the robot.

It is found by bisection, to 0.2 % where accelerations or torques are limited and to 1 % where only
velocities are. The least times are closed forms of double integrators, and for the pendulum the
integrals of its phase plane: a full torque up to where the energy suffices, then the opposite one.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

import hovi

CART = """<link name="cart{i}"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="x{i}" type="prismatic"><parent link="{parent}"/><child link="cart{i}"/>
<axis xyz="{axis}"/><limit lower="-90" upper="90" velocity="9" effort="1e9"/></joint>"""
PENDULUM = """<robot name="pendulum"><link name="base"/><link name="rod"><inertial>
<origin xyz="0 0 -0.5"/><mass value="2"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" velocity="100" effort="1e9"/></joint></robot>"""
INERTIA, WEIGHT = 0.1 + 2 * 0.5**2, 2 * 9.81 * 0.5
WITH_FORCE, OF_VELOCITY = 0.002, 0.01
Plan = Callable[[float], hovi.Solution]


def sliders(folder: Path, n: int) -> hovi.Scene:
    axes, parents = ("1 0 0", "0 1 0", "0 0 1"), ("rail", "cart0", "cart1")
    carts = [CART.format(i=i, parent=parents[i], axis=axes[i]) for i in range(n)]
    path = folder / "sliders.urdf"
    path.write_text(f'<robot name="sliders"><link name="rail"/>{"".join(carts)}</robot>')
    return hovi.Scene(hovi.load_robot(path), [])


def edge(plan: Plan, least: float, precision: float, resolved: bool = True) -> float:
    """The shortest duration that succeeds, relative to the least time.

    resolved: False for the shortest one that is not called infeasible, on a grid that is given.
    """
    refused, found = 1 - 4 * precision, 1 + 4 * precision
    longer = plan(found * least)
    assert longer.success, longer.message
    assert plan(refused * least).status == "infeasible"
    while found - refused > precision / 2:
        middle = (found + refused) / 2
        solution = plan(middle * least)
        success = solution.success or (not resolved and solution.status == "unresolved")
        refused, found = (refused, middle) if success else (middle, found)
    return found


def least_time(d: float, u: float, w: float, V: float, A: float) -> float:
    """That of |v| <= V, |a| <= A from velocity u to w: up to a peak, along it, and down."""
    times = []
    for d, u, w in ((d, u, w), (-d, -u, -w)):  # noqa: B020
        square = A * d + (u * u + w * w) / 2
        peak = min(V, np.sqrt(max(square, 0.0)))
        if square >= 0 and peak >= max(u, w):
            at_peak = d - (2 * peak**2 - u * u - w * w) / (2 * A)
            times.append((2 * peak - u - w) / A + max(at_peak, 0.0) / max(peak, 1e-9))
    return float(min(times))


def hurried(seed: int, n: int, moving: bool, accelerated: bool) -> tuple[float, dict[str, Any]]:
    """Travels of n joints, all of whose least times are within 0.5 % of the largest."""
    rng = np.random.default_rng(seed)
    V, A = rng.uniform(0.4, 2.0, n), rng.uniform(1.0, 8.0, n)
    u, w = 0.8 * V * rng.uniform(-1, 1, (2, n)) * moving
    sides, times = rng.choice([-1, 1], n), rng.uniform(0.995, 1.0, n)
    times *= rng.uniform(4.0, 6.0) * (V / A).max() / times.max()
    A = A if accelerated else np.full(n, 1e12)
    low, high = np.zeros(n), 20 * V * times
    for _ in range(60):
        d = (low + high) / 2
        least = [least_time(*x) for x in zip(sides * d, u, w, V, A, strict=True)]
        low, high = np.where(least < times, d, low), np.where(least < times, high, d)
    limits = {"v": list(V), "a": list(A)} if accelerated else {"v": list(V)}
    given = {"start": hovi.State(np.zeros(n), u), "goal": hovi.State(sides * d, w)}
    return float(times.max()), {**given, "limits": limits}


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("accelerated", [False, True])
@pytest.mark.parametrize("n", [1, pytest.param(2, marks=pytest.mark.long), 3])
def test_of_sliders(n: int, accelerated: bool, moving: bool, tmp_path: Path) -> None:
    scene = sliders(tmp_path, n)
    least, given = hurried(10 * n + moving, n, moving, accelerated)
    precision = WITH_FORCE if accelerated else OF_VELOCITY
    found = edge(lambda T: hovi.plan(scene, duration=T, **given), least, precision)
    assert abs(found - 1) <= precision


@pytest.mark.parametrize(("angle", "torque"), [(1.0, 9.0), (0.6, 8.0), (2.0, 20.0)])
def test_of_a_pendulum_with_a_torque_limit(angle: float, torque: float, tmp_path: Path) -> None:
    path = tmp_path / "pendulum.urdf"
    path.write_text(PENDULUM)
    scene = hovi.Scene(hovi.load_robot(path), [hovi.effects.Gravity(9.81)])
    goal, limits = np.array([angle]), {"base": "none", "tau": [torque]}

    def potential(q: float) -> float:
        return float(WEIGHT * (1 - np.cos(q)))

    def up(s: float) -> float:  # dt / ds with q = s^2 from the start, ...
        return float(2 * s / np.sqrt(2 / INERTIA * (torque * s * s - potential(s * s))))

    def down(s: float) -> float:  # ... and with q = angle - s^2
        fall = potential(angle) - potential(angle - s * s)
        return float(2 * s / np.sqrt(2 / INERTIA * (torque * s * s + fall)))

    switch = (torque * angle + potential(angle)) / (2 * torque)
    least = quad(up, 0, np.sqrt(switch))[0] + quad(down, 0, np.sqrt(angle - switch))[0]
    found = edge(lambda T: hovi.plan(scene, [0.0], goal, T, limits=limits), least, WITH_FORCE)
    assert abs(found - 1) <= WITH_FORCE


@pytest.mark.parametrize("intervals", [pytest.param(4, marks=pytest.mark.long), 12])
@pytest.mark.parametrize("accelerated", [False, True])
def test_on_given_intervals(intervals: int, accelerated: bool, tmp_path: Path) -> None:
    scene = sliders(tmp_path, 2)
    least, given = hurried(intervals, 2, False, accelerated)
    precision = WITH_FORCE if accelerated else OF_VELOCITY

    def plan(T: float) -> hovi.Solution:
        return hovi.plan(scene, duration=T, intervals=intervals, **given)

    assert abs(edge(plan, least, precision, resolved=False) - 1) <= precision


@pytest.mark.long
@pytest.mark.parametrize(("accelerated", "resting"), [(0, 0), (0, 1), (1, 1)])
@pytest.mark.parametrize("back", [False, True])
def test_by_a_via_point(back: bool, resting: int, accelerated: int, tmp_path: Path) -> None:
    scene, V, A = sliders(tmp_path, 2), (1.0, 0.7), (5.0, 3.0)
    middle = np.array([0.9, 0.55])
    goal = np.array([0.2, 0.1] if back else [1.5, 1.4])
    most, limits = (A, {"v": V, "a": A}) if accelerated else ((1e12, 1e12), {"v": V})
    first, second = (
        max(least_time(*x) for x in zip(d, (0, 0), (0, 0), V, most, strict=True))
        for d in (middle, goal - middle)
    )
    precision = WITH_FORCE if accelerated else OF_VELOCITY

    def plan(T: float) -> hovi.Solution:
        state = hovi.State(middle, np.zeros(2) if resting else None)
        via = [hovi.Via(T * first / (first + second), state)]
        return hovi.plan(scene, np.zeros(2), goal, T, via=via, limits=limits)

    assert abs(edge(plan, first + second, precision) - 1) <= precision


@pytest.mark.parametrize(("way", "most"), [(1.3, 1.0), (0.7, 1.9), (3.1, 0.6)])
def test_smooth_motions_too(way: float, most: float, tmp_path: Path) -> None:
    scene = sliders(tmp_path, 1)

    def plan(T: float) -> hovi.Solution:
        return hovi.plan(scene, [0.0], [way], T, limits={"v": [most]}, smooth=True)

    assert plan(1.01 * way / most).success
    assert not plan(0.99 * way / most).success


@pytest.mark.parametrize("seed", range(8))
def test_smooth_motions_near_the_least_time_of_a_velocity(seed: int, tmp_path: Path) -> None:
    """A convex problem, whose cost is a hundred times that of its guess."""
    way, most = np.random.default_rng(seed).uniform([0.3, 0.4], [4.0, 2.0])
    scene = sliders(tmp_path, 1)
    T = (1.005, 1.01, 1.02)[seed % 3] * way / most
    solution = hovi.plan(scene, [0.0], [way], T, limits={"v": [most]}, smooth=True)
    assert solution.success, solution.message


def test_smooth_motions_with_an_acceleration_limit(tmp_path: Path) -> None:
    scene, way, V, A = sliders(tmp_path, 1), 1.3, 1.0, 4.0

    def plan(T: float) -> hovi.Solution:
        return hovi.plan(scene, [0.0], [way], T, limits={"v": [V], "a": [A]}, smooth=True)

    assert abs(edge(plan, least_time(way, 0, 0, V, A), WITH_FORCE) - 1) <= WITH_FORCE + 1e-12
