"""Mechanics on groups: the discrete flow against SciPy, its order, momenta and symplecticity."""

from __future__ import annotations

import json
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
from hovi.effects import Effect, Gravity, SceneSymbols, ViscousFriction
from hovi.errors import InputError
from hovi.flows.charted_lagrangian import ChartedLagrangian
from hovi.flows.execution.controllers import FEEDBACKS, controller
from hovi.flows.execution.dynamics_replay import chart_rates
from hovi.flows.execution.tracking import play
from hovi.flows.legendre_transforms import highest_derivative, legendre
from hovi.flows.simulator import simulate
from hovi.flows.stepper import flow
from hovi.robot.loading import load_robot
from hovi.robot.mimic_model import Coupling, coupled
from hovi.robot.robot import Robot
from hovi.robot.space.configuration_space import bracket
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.scene.standard_lagrangians import mechanics
from hovi.schemes import galerkin
from oracles.finite_differences import derivative, derivative_per_point
from samples.manifold_robots import BASES, chain, configurations, rigid_body, with_arm

Array = npt.NDArray[np.float64]
Torque = Callable[[Array], Array]

PLACES = {"SE(2)": [0, 1, 5], "SO(3)": [3, 4, 5], "SE(3)": [0, 1, 2, 3, 4, 5]}
MOMENTS = [1.0, 2.0, 3.5]


@dataclass(frozen=True)
class Flywheels(Effect):
    """An effect A(q) a with A diagonal, which depends on one vector coordinate, if there is one."""

    sizes: tuple[float, ...]
    place: int | None = None
    key: ClassVar[str] = "flywheels"

    def inertia(self, q: ca.SX) -> ca.SX:
        grown = 1.0 if self.place is None else 1.0 + ca.sin(q[self.place]) ** 2
        return ca.diag(ca.DM(self.sizes)) * grown

    def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        return self.inertia(symbols.q) @ symbols.a

    def describe(self) -> str:
        return "flywheels"


def scipys(
    scene: Scene, start: State, T: float, torque: Torque | None = None, tolerance: float = 1e-13
) -> tuple[Array, Array]:
    """(q, v) at T: DOP853 in charts that follow the motion, with (M + A) a + b + d v = u."""
    model, robot, n = scene.model, scene.robot, scene.robot.nv
    data = model.createData()
    effects = {effect.key: effect for effect in scene.effects}
    wheels = effects.get("flywheels")
    symbol = ca.SX.sym("q", robot.nq)
    A = ca.Function("A", [symbol], [wheels.inertia(symbol) if wheels else ca.SX.zeros(n, n)])  # type: ignore[attr-defined]
    friction = 0.3 if "viscous_friction" in effects else 0.0
    q, v = np.array(start.q, dtype=float), np.array(start.v, dtype=float)

    def rhs(t: float, y: Array) -> Array:
        x, rate = np.split(y, 2)
        here = robot.integrate(q, x)
        mass = np.triu(pin.crba(model, data, here))
        mass += np.triu(mass, 1).T + A(here).full()
        u = np.zeros(n) if torque is None else torque(np.array([t]))[0]
        force = u - friction * rate - pin.nonLinearEffects(model, data, here, rate)
        a = np.linalg.solve(mass, force)
        return np.concatenate([chart_rates(robot, q[None], x[None], rate[None])[0], a])

    for k in range(10):
        ends = k * T / 10, (k + 1) * T / 10
        done = solve_ivp(rhs, ends, np.r_[np.zeros(n), v], "DOP853", rtol=tolerance, atol=tolerance)
        x, v = np.split(done.y[:, -1], 2)
        q = robot.integrate(q, x)
    return q, v


def torque_of(robot: Robot) -> Torque:
    sizes = np.linspace(0.4, 1.0, robot.nv)
    return lambda t: np.cos(np.outer(t, 1 + 2 * sizes)) * sizes


def start_of(robot: Robot, speed: float = 0.5) -> State:
    v = speed * np.random.default_rng(4).normal(size=robot.nv)
    return State(configurations(robot, 1, size=0.3)[0], v)


def off(motion: object, expected: tuple[Array, Array]) -> float:
    q, v = expected
    robot = motion.scene.robot  # type: ignore[attr-defined]
    misses = robot.difference(q, motion.q[-1]), motion.v[-1] - v  # type: ignore[attr-defined]
    return float(np.abs(np.concatenate(misses)).max())


# Against SciPy


def gripper() -> pin.Model:
    """A floating body with a revolute finger and a prismatic one that mimics it."""
    model = chain([pin.JointModelFreeFlyer(), pin.JointModelRX(), pin.JointModelPY()])
    return coupled(model, [Coupling("j2", "j1", -0.8, 0.1)])


CASES = {
    "a free body": lambda: Scene(rigid_body(MOMENTS)),
    "a floating gripper": lambda: Scene(load_robot(gripper()), [Gravity()]),
    "a heavy top": lambda: Scene(load_robot(chain([pin.JointModelSpherical()])), [Gravity()]),
    **{
        f"an arm on a {base} base": (
            lambda base=base: Scene(load_robot(with_arm(base)), [Gravity(), ViscousFriction(0.3)])
        )
        for base in BASES
    },
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize(("r", "counts"), [(0, (40, 80)), (1, (20, 40)), (2, (10, 20))])
def test_a_flow_on_groups_has_order_2_r_plus_2(case: str, r: int, counts: tuple[int, int]) -> None:
    scene = CASES[case]()
    start = start_of(scene.robot, 1.0 if scene.robot.nv == 3 else 0.5)
    u = torque_of(scene.robot) if scene.robot.nv > 3 else None
    expected = scipys(scene, start, 1.0, u)
    errors = [
        off(simulate(scene, start, 1.0, u, intervals=N, inner_modes=r), expected) for N in counts
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2 * (r + 1), abs=0.3)


def test_armature_and_effect_inertia_have_no_coadjoint_term() -> None:
    """RNEA adds armature * a and nothing else, also for a freely rotating body."""
    model = with_arm("spherical")
    model.armature = np.zeros(6)
    wheels = (0.7, 0.1, 1.3, 0.2, 0.1, 0.4)
    scene = Scene(load_robot(model), [Gravity(), Flywheels(wheels, place=4)])
    start = start_of(scene.robot)
    motion = simulate(scene, start, 1.0, intervals=40, inner_modes=2)
    assert off(motion, scipys(scene, start, 1.0)) < 1e-9


def test_armature_and_an_equal_effect_give_the_same_motion() -> None:
    sizes = (0.7, 0.1, 1.3)
    robot = load_robot(chain([pin.JointModelSpherical()]))
    rotors, wheels = (Scene(robot, [Gravity(), *more]) for more in ((), (Flywheels(sizes),)))
    rotors.model.armature = np.array(sizes)
    motions = [simulate(s, start_of(robot), 1.0, intervals=40) for s in (rotors, wheels)]
    np.testing.assert_allclose(motions[0].q, motions[1].q, atol=1e-12)
    assert off(motions[0], scipys(wheels, start_of(robot), 1.0)) < 1e-5


def test_a_continuous_joint_moves_like_a_revolute_one(models: Path, tmp_path: Path) -> None:
    text = (models / "two_link.urdf").read_text()
    path = tmp_path / "turning.urdf"
    path.write_text(text.replace('type="revolute"', 'type="continuous"'))
    plain, turning = (
        Scene(load_robot(each), [Gravity(9.8), ViscousFriction(0.3)])
        for each in (models / "two_link.urdf", path)
    )
    assert turning.robot.nq == 4
    q, v = np.array([0.3, 2.9]), np.array([1.0, 6.0])
    u = torque_of(plain.robot)
    first = simulate(plain, State(q, v), 2.0, u, intervals=200)
    start = turning.robot.integrate(turning.robot.neutral(), q)
    second = simulate(turning, State(start, v), 2.0, u, intervals=200)
    angles = turning.robot.integrate(turning.robot.neutral(), first.q)
    np.testing.assert_allclose(second.q, angles, rtol=0, atol=1e-10)
    np.testing.assert_allclose(second.momenta, first.momenta, rtol=0, atol=1e-10)
    np.testing.assert_allclose(second.energy, first.energy, rtol=0, atol=1e-9)
    np.testing.assert_allclose(second.work, first.work, rtol=0, atol=1e-9)


# Laws of the discrete motion


def test_the_spatial_momentum_of_a_free_body_is_conserved() -> None:
    """The momentum is conserved at any step size, and the energy does not drift."""
    robot = rigid_body(MOMENTS)
    start = State(robot.neutral(), [0.1, 2.0, -0.1])  # about the middle axis: it tumbles
    motion = simulate(Scene(robot), start, 60.0, intervals=600)
    rotations = [pin.Quaternion(q).toRotationMatrix() for q in motion.q]
    momenta = np.einsum("kij,kj->ki", rotations, motion.momenta)
    assert np.abs(motion.momenta[:, 1]).min() < 0.1 * np.abs(momenta[0]).max()
    np.testing.assert_allclose(momenta, momenta[[0] * 601], rtol=0, atol=2e-12)
    energy = motion.energy / motion.energy[0] - 1.0
    assert np.abs(energy).max() < 1e-4
    assert np.abs(energy[-100:]).max() < 1.2 * np.abs(energy[:200]).max()


def test_the_spatial_momenta_of_a_free_robot_are_conserved() -> None:
    """Three linear momenta and three angular momenta about the origin of the world."""
    robot = load_robot(with_arm("free-flyer"))
    motion = simulate(Scene(robot), start_of(robot), 2.0, torque_inside(robot), intervals=40)
    momenta = []
    for q, p in zip(motion.q, motion.momenta, strict=True):
        placed = robot.model.jointPlacements[1] * pin.XYZQUATToSE3(q[:7])
        momenta.append(placed.act(pin.Force(p[:6])).vector)
    np.testing.assert_allclose(momenta, [momenta[0]] * 41, rtol=0, atol=1e-11)


def torque_inside(robot: Robot) -> Torque:
    """Torques at the joints of the arm only."""
    arm = torque_of(robot)
    return lambda t: arm(t) * (np.arange(robot.nv) >= 6)


@pytest.mark.parametrize("base", BASES)
def test_a_step_on_a_group_is_symplectic(base: str) -> None:
    """D^T w1 D = w0, with w((a, f), (b, g)) = g.a - f.b + p.[a, b] in the body frames."""
    robot = load_robot(with_arm(base))
    scene = Scene(robot, [Gravity()])
    L, n = mechanics(scene), robot.nv
    ld = ChartedLagrangian(L, robot.space, galerkin(1, 1), 0.2)
    q0, p0 = start_of(robot).q, np.random.default_rng(0).normal(size=n)

    def step(z: Array) -> tuple[Array, Array]:
        x = robot.integrate(np.asarray(q0), z[:n])
        interval = ld.from_start(x[None, None], (p0 + z[n:])[None, None])
        return interval.x1[0, 0], interval.p1[0, 0]

    q1, p1 = step(np.zeros(2 * n))

    def ends(z: Array) -> Array:
        q, p = step(z)
        return np.concatenate([robot.difference(q1, q), p - p1])

    D = derivative(ends, np.zeros(2 * n))
    np.testing.assert_allclose(D.T @ form(robot, p1) @ D, form(robot, p0), atol=1e-8)


def form(robot: Robot, p: Array) -> Array:
    n = robot.nv
    w = np.zeros((2 * n, 2 * n))
    w[:n, n:], w[n:, :n] = np.eye(n), -np.eye(n)
    for factor in robot.space.curved:
        i, places = factor.v, PLACES[factor.group.name]
        for j, a in enumerate(np.eye(6)[places]):
            for k, b in enumerate(np.eye(6)[places]):
                bracket = pin.Motion(a).cross(pin.Motion(b)).vector[places]
                w[i.start + j, i.start + k] = p[i] @ bracket
    return w


def test_a_flow_supports_any_lagrangian_on_a_group() -> None:
    robot = rigid_body(MOMENTS)
    L = mechanics(Scene(robot))
    ld = ChartedLagrangian(L, robot.space, galerkin(2, 1), 0.05)
    q, v = robot.neutral(), np.array([0.3, -1.0, 0.8])
    found = flow(ld, q[None], (np.array(MOMENTS) * v)[None], 20)
    expected = scipys(Scene(robot), State(q, v), 1.0)
    np.testing.assert_allclose(found.q[-1], expected[0], atol=1e-9)
    np.testing.assert_allclose(found.energy, found.energy[0], rtol=1e-9)


def test_a_step_that_rotates_too_far_is_refused() -> None:
    start = State([0, 0, 0, 1], [0.0, 40.0, 0.0])
    with pytest.raises(InputError, match="shorter step"):
        simulate(Scene(rigid_body(MOMENTS)), start, 1.0, intervals=10)


# Of optimal control, k = 2


def pontryagin(
    robot: Robot, L: Lagrangian, start: tuple[Array, Array], p: Array, T: float
) -> tuple[Array, Array]:
    """q and (v, p, p~) at T: DOP853 on q' = q v, L_a = p~, p~' = L_v - p, p' = ad*_v p + L_q."""
    n, (q, v) = robot.nv, start
    y = np.concatenate([v, *p])

    def rhs(t: float, z: Array) -> Array:
        x, v, p, pt = np.split(z, 4)
        here = robot.integrate(q, x)[None], v[None]
        a = highest_derivative(L, here, np.stack([p, pt])[None])
        by_q, by_v, _ = L.gradient(*here, a)[0]
        turned = bracket(robot.space, np.tile(v, (n, 1)), np.eye(n)) @ p
        rate = chart_rates(robot, q[None], x[None], v[None])[0]
        return np.concatenate([rate, a[0], turned + by_q, by_v - p])

    for _ in range(10):
        first = np.concatenate([np.zeros(n), y])
        z = solve_ivp(rhs, (0, T / 10), first, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
        q, y = robot.integrate(q, z[:n]), z[n:]
    return q, y


@pytest.mark.parametrize("base", BASES)
def test_the_flow_of_optimal_control_has_the_order_of_the_nodes(base: str) -> None:
    robot = load_robot(with_arm(base))
    L = Scene(robot, [Gravity()]).effort_lagrangian()
    q, (v, a, jerk) = start_of(robot).q, 0.5 * np.random.default_rng(1).normal(size=(3, robot.nv))
    x, p = legendre(L, q, v, a, jerk)
    expected, rest = pontryagin(robot, L, (np.asarray(q), v), p, 0.5)
    errors = []
    for N in (24, 48) if base == "free-flyer" else (12, 24):
        motion = flow(ChartedLagrangian(L, robot.space, galerkin(1), 0.5 / N), x, p, N)
        found = np.concatenate([motion.jets[1][-1], motion.p[-1].ravel()])
        misses = robot.difference(expected, motion.q[-1]), found - rest
        errors.append(np.abs(np.concatenate(misses)).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(6, abs=0.3)
    np.testing.assert_allclose(motion.energy, motion.energy[0], rtol=1e-6)


def test_a_plan_equals_the_flow_from_its_own_momenta() -> None:
    """The optimizer and the flow solve the same discrete equations on groups as well."""
    robot = load_robot(with_arm("free-flyer"))
    q = configurations(robot, 2, size=0.4)
    scene = Scene(robot, [Gravity()])
    planned = plan(scene, q[0], q[1], 1.0, limits="none", intervals=8)
    assert planned.problem is not None
    ld = planned.problem.ld
    path = planned.trajectory.path
    start = State(path.q[0], path.v[0])
    motion = flow(ld, start, ld.momenta(path)[0], 4)
    misses = robot.difference(path.q[:5], motion.q)
    assert np.abs(misses).max() < 1e-6
    np.testing.assert_allclose(motion.p, ld.momenta(path)[:5], rtol=1e-5, atol=1e-4)
    again = motion.trajectory
    np.testing.assert_allclose(again.path.z, path.z[:4], rtol=1e-4, atol=1e-5)
    t = np.linspace(0.0, 0.49, 20)
    np.testing.assert_allclose(again.sample(t).tau, planned.trajectory.sample(t).tau, atol=1e-3)


# Playing plans


@pytest.fixture(scope="module")
def planned() -> Trajectory:
    robot = load_robot(with_arm("free-flyer"))
    q = configurations(robot, 2, size=0.4)
    return plan(Scene(robot, [Gravity()]), q[0], q[1], 1.0, limits="none", intervals=12).trajectory


@pytest.mark.parametrize("feedback", FEEDBACKS)
def test_a_floating_robot_follows_its_plan_without_model_error(
    planned: Trajectory, feedback: str
) -> None:
    assert planned.scene is not None
    tracking = play(planned.scene, planned, feedback, intervals=96, inner_modes=2)
    assert np.abs(tracking.joint_deviation).max() < 1e-5


def test_feedback_reduces_the_deviation_of_a_floating_robot(planned: Trajectory) -> None:
    assert planned.scene is not None
    robot = planned.scene.robot
    rich = Scene(robot, [Gravity(), ViscousFriction(0.3)])
    alone, held = (play(rich, planned, each, intervals=96) for each in ("none", "pd"))
    assert alone.tip_deviation[-1] > 5 * held.tip_deviation[-1] > 0.0
    start = State(planned.q[0], planned.v[0])
    expected = scipys(rich, start, 1.0, lambda t: planned.sample(t).tau, 1e-8)
    assert off(alone.simulation, expected) < 1e-4


def test_a_simulation_is_a_trajectory_between_its_nodes() -> None:
    scene = Scene(load_robot(with_arm("spherical")), [Gravity()])
    motions = [simulate(scene, start_of(scene.robot), 1.0, intervals=N) for N in (50, 100)]
    found = motions[0].trajectory.configurations(motions[1].t)
    misses = scene.robot.difference(found, motions[1].q)
    assert np.abs(misses).max() < 1e-5


@pytest.mark.parametrize("feedback", FEEDBACKS)
def test_derivatives_of_feedback_on_groups_match_finite_differences(
    planned: Trajectory, feedback: str
) -> None:
    assert planned.scene is not None
    robot = planned.scene.robot
    drive = controller(planned, feedback, planned.scene, 5.0)
    t = np.array([0.2, 0.7])
    q, v = configurations(robot, 2, seed=5), np.random.default_rng(5).normal(size=(2, robot.nv))
    zero = np.zeros_like(v)
    _, slope = drive.evaluate(q, v, t)
    by_q = derivative_per_point(lambda x: drive.evaluate(robot.integrate(q, x), v, t)[0], zero)
    by_v = derivative_per_point(lambda x: drive.evaluate(q, v + x, t)[0], zero)
    np.testing.assert_allclose(slope, np.stack([by_q, by_v], axis=2), rtol=1e-7, atol=1e-6)


def test_the_command_executes_a_plan_of_a_floating_robot(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "leap.toml"
    scene.write_text(
        'robot = "solo8"\nfree_flyer = true\npassive = ["root_joint"]\nduration = 0.3\n'
        'limits = "none"\n[scheme]\nintervals = 4\n[start]\nq = "standing"\n'
        "v = {root_joint = [0.0, 0.0, 1.5, 0.3, 0.2, 0.1]}\n"
        '[goal]\nfree = ["root_joint"]\nfree_velocity = ["root_joint"]\n'
        "q = [0, 0, 0.24, 0, 0, 0, 1, 0.6, -1.3, 0.9, -1.7, -0.7, 1.5, -0.9, 1.4]\n"
        "[effects.gravity]\n"
    )
    motion = str(tmp_path / "leap.npz")
    assert main(["plan", str(scene), "--out", motion]) == 0
    capsys.readouterr()
    assert main(["simulate", str(scene), "--plan", motion, "--feedback", "pd", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert len(told["q"]) == 15
    assert max(told["joint_deviation_max"]) < 1e-5
    assert told["feedback_torque_max"][:6] == [0.0] * 6
    assert told["energy_error"] < 1e-6
