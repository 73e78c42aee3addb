"""Forced mechanics: the discrete Lagrange-d'Alembert equations against other integrators."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

from hovi import plan
from hovi.cli.application import main
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Effect, Gravity, SceneSymbols
from hovi.errors import InputError, SceneError
from hovi.flows.simulator import simulate
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Drag(Effect):
    """An effect d = c v + b sin(t) v sqrt(1 + v^2)."""

    viscous: float = 0.3
    pulsing: float = 0.2
    key: ClassVar[str] = "drag"

    def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        v = symbols.v
        return self.viscous * v + self.pulsing * ca.sin(symbols.t) * v * ca.sqrt(1 + v**2)

    def describe(self) -> str:
        return "drag"


@dataclass(frozen=True)
class Lagging(Effect):
    """An effect that depends on the acceleration other than as an inertia."""

    key: ClassVar[str] = "lagging"

    def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        return ca.vertcat(0.1 * symbols.a[1], 0)

    def describe(self) -> str:
        return "lagging"


def torque(t: Array) -> Array:
    return np.stack([2 * np.cos(3 * t), -np.sin(t)], axis=1)


def reference(scene: Scene, start: State, T: float, u: Callable[[Array], Array] | None) -> Array:
    """(q, v) at T by SciPy and Pinocchio's articulated-body algorithm."""
    model, data, n = scene.model, scene.model.createData(), scene.robot.nv
    drag = next((e for e in scene.effects if isinstance(e, Drag)), Drag(0, 0))

    def rhs(t: float, y: Array) -> Array:
        q, v = np.split(y, 2)
        tau = np.zeros(n) if u is None else u(np.array([t]))[0]
        tau = tau - drag.viscous * v - drag.pulsing * np.sin(t) * v * np.sqrt(1 + v**2)
        return np.concatenate([v, pin.aba(model, data, q, v, tau)])

    y0 = np.concatenate([start.q, np.zeros(n) if start.v is None else start.v])
    return solve_ivp(rhs, (0, T), y0, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]


START = State([0.2, -0.4], [0.5, 0.3])
CASES = {
    "free": ([Gravity(9.8)], None),
    "driven": ([Gravity(9.8)], torque),
    "driven with drag": ([Gravity(9.8), Drag()], torque),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize(("r", "counts"), [(0, [80, 160]), (1, [40, 80]), (2, [20, 40])])
def test_a_simulation_has_order_2_r_plus_2_with_torques_and_drag(
    two_link: Robot, case: str, r: int, counts: list[int]
) -> None:
    effects, u = CASES[case]
    scene = Scene(two_link, effects)
    expected = reference(scene, START, 1.0, u)
    errors = []
    for N in counts:
        motion = simulate(scene, START, 1.0, u, intervals=N, inner_modes=r)
        errors.append(np.abs(np.concatenate([motion.q[-1], motion.v[-1]]) - expected).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2 * (r + 1), abs=0.3)


def test_the_fall_of_six_joints_matches_aba(ur5: Robot) -> None:
    scene, start = Scene(ur5, [Gravity()]), State(np.full(6, 0.3), np.full(6, -0.2))
    motion = simulate(scene, start, 0.5, intervals=50, inner_modes=2)
    expected = reference(scene, start, 0.5, None)
    np.testing.assert_allclose(motion.q[-1], expected[:6], rtol=0, atol=1e-7)
    np.testing.assert_allclose(motion.energy, motion.energy[0], rtol=1e-7)


def test_the_work_of_the_torques_equals_the_change_of_energy(arm_scene: Scene) -> None:
    motion = simulate(arm_scene, START, 1.0, torque, intervals=400)
    power = np.sum(torque(motion.t) * motion.v, axis=1)
    work = np.trapezoid(power, motion.t)
    assert motion.energy[-1] - motion.energy[0] == pytest.approx(work, rel=1e-4)


def test_a_plans_torques_drive_the_arm_along_the_plan(arm_scene: Scene) -> None:
    planned = plan(
        arm_scene, State([-np.pi / 2, 0.0]), State([0.3, 0.7], [0.5, -0.4]), 1.0, intervals=32
    ).trajectory
    motion = simulate(arm_scene, State([-np.pi / 2, 0.0]), 1.0, planned, intervals=320)
    np.testing.assert_allclose(motion.q[::10], planned.q, rtol=0, atol=1e-5)


def test_a_simulation_can_be_saved_and_replayed(arm_scene: Scene, tmp_path: Path) -> None:
    motion = simulate(arm_scene, START, 1.0, intervals=200)
    motion.trajectory.save(tmp_path / "fall.npz")
    loaded = Trajectory.load(tmp_path / "fall.npz")
    np.testing.assert_array_equal(loaded.q, motion.q)
    sample = loaded.sample(np.linspace(0, 1, 50))
    assert np.abs(sample.tau).max() < 1e-2  # of the cubic between the nodes


def test_invalid_simulations_are_refused(arm_scene: Scene, two_link: Robot) -> None:
    with pytest.raises(InputError, match="duration must be positive"):
        simulate(arm_scene, START, 0.0)
    for intervals in (0, 10**7 + 1):
        with pytest.raises(InputError, match="intervals must be from 1 to 10,000,000"):
            simulate(arm_scene, START, 1.0, intervals=intervals)
    with pytest.raises(SceneError, match="'lagging' depends on the acceleration, but not as"):
        simulate(Scene(two_link, [Lagging()]), START, 1.0)
    with pytest.raises(InputError, match=r"torque\(t\) must have shape \(\d+, 2\) .* got \(2,\)"):
        simulate(arm_scene, START, 1.0, lambda t: np.zeros(2))
    with pytest.raises(InputError, match=r"torque\(t\) must be numbers"):
        simulate(arm_scene, START, 1.0, lambda t: None)  # type: ignore[arg-type,return-value]
    with pytest.raises(InputError, match=r"the flow ends at t = .* shorter step"):
        simulate(arm_scene, State([0, 0], [200.0, -300.0]), 10.0, intervals=3)


# The command

SCENE = """robot = "two_link.urdf"
duration = 0.5
[start]
q = [0.0, 0.0]
[goal]
q = [1.0, 0.0]
[effects.gravity]
acceleration = 9.8
"""


@pytest.fixture
def scene_file(models: Path, tmp_path: Path) -> Path:
    path = tmp_path / "fall.toml"
    path.write_text(SCENE.replace("two_link.urdf", str(models / "two_link.urdf")))
    return path


def test_the_command_prints_one_object(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "fall.npz"
    assert main(["simulate", str(scene_file), "--json", "--out", str(out)]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["duration"], report["intervals"], report["order"]) == (0.5, 50, 4)
    assert report["energy_error"] < 1e-5
    np.testing.assert_array_equal(Trajectory.load(out).q[-1], report["q"])


def test_the_command_prints_a_report(scene_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", str(scene_file), "--duration", "0.2", "--intervals", "7"]) == 0
    printed = capsys.readouterr().out
    assert "0.2 s in 7 steps of order 4" in printed
    assert re.search(r"shoulder +\S+ +rad +\S+ +rad/s", printed)
    assert "feedback" not in printed
    assert main(["simulate", str(scene_file), "--duration", "-1"]) == 2
    assert "--duration must be" in capsys.readouterr().err
    assert main(["simulate", str(scene_file), "--out", "x.txt"]) == 2


def test_a_violated_limit_is_reported(
    models: Path, scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, narrow = tmp_path / "fall.npz", tmp_path / "narrow.urdf"
    assert main(["simulate", str(scene_file), "--out", str(out)]) == 0
    assert "not simulated" not in capsys.readouterr().out
    fall = Trajectory.load(out)
    urdf = (models / "two_link.urdf").read_text()
    narrow.write_text(urdf.replace('lower="-1000"', 'lower="-0.1"', 1))
    scene_file.write_text(SCENE.replace("two_link.urdf", str(narrow)))
    assert main(["simulate", str(scene_file)]) == 0
    t = fall.t[np.argmax(fall.q[:, 0] < -0.1)]
    sentence = f"shoulder passes its limit of -0.1 rad at t = {t:.4g} s: limits are not simulated"
    assert sentence in capsys.readouterr().out
    assert main(["simulate", str(scene_file), "--json"]) == 0
    (passed,) = json.loads(capsys.readouterr().out)["limits_passed"]
    assert passed == {"joint": "shoulder", "limit": -0.1, "unit": "rad", "t": pytest.approx(t)}


def test_a_simulation_prints_its_robot_time_and_grid(two_link: Robot) -> None:
    motion = simulate(Scene(two_link, [Gravity()]), np.zeros(2), 0.5, intervals=20)
    assert repr(motion) == "<Simulation of 'two_link': 0.5 s in 20 intervals, order 4>"
