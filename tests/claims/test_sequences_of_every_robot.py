"""Sequences of continuous joints, orientations and passive joints are motions of Pinocchio's model.

Nothing here but the plans is hovi's: q moves by pin.integrate of v, torques are those of pin.rnea
with what is carried appended as a body, costs are their integrals, and no smooth change of the
motion that keeps its goals costs less.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from samples.manifold_robots import with_arm
from samples.small_robots import LENGTH, RADIUS, arm, with_shapes

pytestmark = pytest.mark.filterwarnings("ignore::hovi.errors.HoviWarning")
Array = npt.NDArray[np.float64]
CARRIED, SAMPLES, NEGLIGIBLE, SLOWER = 0.4, 6, 0.01, 0.95
"""Mass that the second segment carries, in [kg]; instants of an interval; torque of a passive joint
relative to the largest; limit of velocities relative to the largest without limits."""
GAUSS, WEIGHTS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True, eq=False)
class Kind:
    """A robot that moves from rest at q0 by `middle` and then on to `last` at rest.

    durations: of both segments, in [s]. passive, gravity: of its scene. left: joints that are free
    at both goals.
    """

    robot: hovi.Robot
    middle: Array
    last: Array
    durations: tuple[float, float] = (0.7, 0.9)
    passive: tuple[str, ...] = ()
    gravity: float = 9.81
    left: tuple[str, ...] = ()

    @property
    def scene(self) -> hovi.Scene:
        effects = [hovi.effects.Gravity(self.gravity)] if self.gravity else []
        return hovi.Scene(self.robot, effects, passive=self.passive, compile=False)

    def moved(self, change: Array) -> Array:
        return self.robot.integrate(self.robot.neutral(), change)

    def goal(self, change: Array, **more: Any) -> hovi.State:
        left = {"free": self.left, "free_velocity": self.left}
        return hovi.State(self.moved(change), **(left | more))

    def models(self) -> list[pin.Model]:
        """Without and with what is carried."""
        empty = self.robot.model.copy()
        empty.gravity.linear = np.array([0.0, 0.0, -self.gravity])
        empty.armature = np.zeros(empty.nv)
        loaded, tip = empty.copy(), empty.frames[empty.getFrameId(self.robot.tip_frame)]
        body = pin.Inertia(CARRIED, np.zeros(3), np.zeros((3, 3)))
        loaded.appendBodyToJoint(tip.parentJoint, body, tip.placement)
        return [empty, loaded]


@cache
def kinds() -> dict[str, Kind]:
    def chain(base: str, middle: float, last: float) -> Kind:
        robot = hovi.load_robot(with_arm(base))
        return Kind(robot, *(x * np.cos(np.arange(robot.nv)) for x in (middle, last)))

    turning = arm("c3", ("continuous", "revolute", "continuous"))
    cart, flyer = with_shapes("cart_pole.urdf"), arm("flyer2", ("revolute",) * 2, free_flyer=True)
    arms = [np.r_[np.zeros(6), x] for x in ([0.5, -0.4], [0.2, 0.9])]
    pendubot = hovi.load_robot(hovi.example("two_link.urdf"))
    return {
        "continuous": Kind(turning, np.array([0.8, 0.5, 2.9]), np.array([0.3, -0.4, 4.4])),
        "spherical": chain("spherical", 0.4, -0.3),
        "planar": chain("planar", 0.4, -0.3),
        "free-flyer": chain("free-flyer", 0.3, -0.3),
        "cart-pole": Kind(
            cart, np.array([0.5, 0.0]), np.array([0.2, 0.0]), (1.2, 1.3), passive=("hinge",)
        ),
        "pendubot": Kind(
            pendubot, np.array([1.2, 0.4]), np.array([0.0, 0.0]), (1.2, 1.3), passive=("elbow",)
        ),
        "spacecraft": Kind(
            flyer, arms[0], arms[1], passive=("root_joint",), gravity=0.0, left=("root_joint",)
        ),
    }


NAMES = "continuous", "spherical", "planar", "free-flyer", "cart-pole", "pendubot", "spacecraft"
DRIVEN = NAMES[:4]


@cache
def planned(name: str, passing: bool = True, limited: bool = False) -> hovi.Solution:
    """The sequence; the second segment carries something."""
    kind = kinds()[name]
    more = {"free_velocity": ["all"]} if passing else {}
    T, load = kind.durations, hovi.effects.Payload(frame=kind.robot.tip_frame, mass=CARRIED)
    segments = [
        hovi.Segment(kind.goal(kind.middle, **more), T[0]),
        hovi.Segment(kind.goal(kind.last), T[1], effects=[load]),
    ]
    limits: Any = {"base": "none", "v": fastest(name)} if limited else "none"
    found = hovi.plan_sequence(
        kind.scene,
        kind.robot.neutral(),
        segments,
        limits=limits,
        self_collision=False,
        tolerance=1e-4,
    )
    assert found.success, found.message
    return found


def fastest(name: str) -> float:
    """A limit of all velocities that the motion without limits exceeds."""
    motion = planned(name).trajectory
    return SLOWER * float(np.abs(motion.sample(np.linspace(0.0, motion.duration, 501)).v).max())


def instants(motion: hovi.Trajectory, s: Array) -> tuple[npt.NDArray[np.intp], Array]:
    """The intervals and places in them of the same points in every interval."""
    N = motion.grid.intervals
    return np.repeat(np.arange(N), len(s)), np.tile(s, N)


def seam(name: str, motion: hovi.Trajectory) -> int:
    """The node where both segments meet."""
    return int(np.argmin(np.abs(motion.t - kinds()[name].durations[0])))


def rnea(name: str, motion: hovi.Trajectory, k: Any, q: Array, v: Array, a: Array) -> Array:
    models = kinds()[name].models()
    data = [model.createData() for model in models]
    which = (np.asarray(k) >= seam(name, motion)).astype(int)
    return np.array(
        [pin.rnea(models[i], data[i], *jet) for i, *jet in zip(which, q, v, a, strict=True)]
    )


def effort(
    name: str, motion: hovi.Trajectory, jet: Callable[[Any, Array], Sequence[Array]], first: int = 0
) -> float:
    """The integral of 1/2 |tau|^2 of the driven joints along a curve, from an interval on."""
    kind = kinds()[name]
    driven = np.delete(np.arange(kind.robot.nv), kind.scene.passive_coordinates)
    k, s = instants(motion, (GAUSS + 1) / 2)
    tau = rnea(name, motion, k, *jet(k, s))[:, driven]
    weights = np.repeat(motion.grid.steps, len(GAUSS)) * np.tile(WEIGHTS, motion.grid.intervals) / 2
    return float((weights * (k >= first)) @ np.sum(tau**2, axis=1) / 2)


@pytest.mark.parametrize("limited", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_q_and_v_pass_the_seam_and_q_moves_by_v(name: str, limited: bool) -> None:
    """Every interval by pin.integrate in small steps of the velocity in their middle."""
    motion, model = planned(name, limited=limited).trajectory, kinds()[name].robot.model
    N = motion.grid.intervals
    before, after = (motion.sample_intervals(np.arange(N), np.full(N, x)) for x in (1.0, 0.0))
    for i in range(N - 1):
        apart = pin.difference(model, before.q[i], after.q[i + 1])
        assert np.abs(apart).max() < 1e-9
        assert np.abs(before.v[i] - after.v[i + 1]).max() < 1e-9 * (1 + np.abs(motion.v).max())
    steps = 200
    middles = (np.arange(steps) + 0.5) / steps
    for i in (0, seam(name, motion) - 1, seam(name, motion), N - 1):
        q, h = after.q[i], float(motion.grid.steps[i]) / steps
        for v in motion.sample_intervals(np.full(steps, i), middles).v:
            q = pin.integrate(model, q, h * v)
        moved = np.abs(pin.difference(model, after.q[i], before.q[i])).max()
        assert np.abs(pin.difference(model, q, before.q[i])).max() < 1e-4 * max(moved, 0.01)


@pytest.mark.parametrize("passing", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_both_goals_are_met_in_what_they_say(name: str, passing: bool) -> None:
    kind, motion = kinds()[name], planned(name, passing).trajectory
    free = np.isin(np.arange(kind.robot.nv), kind.scene.passive_coordinates) & bool(kind.left)
    for node, change, given in (
        (seam(name, motion), kind.middle, not passing),
        (-1, kind.last, True),
    ):
        apart = pin.difference(kind.robot.model, kind.moved(change), motion.q[node])
        assert np.abs(apart[~free]).max() < 1e-9
        if given:
            assert np.abs(motion.v[node][~free]).max() < 1e-9
    v = motion.v[seam(name, motion)]
    assert not passing or np.abs(v).max() > 1e-3


@pytest.mark.parametrize("limited", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_torques_are_those_of_pinocchio_and_passive_joints_have_none(
    name: str, limited: bool
) -> None:
    motion, kind = planned(name, limited=limited).trajectory, kinds()[name]
    k, s = instants(motion, np.linspace(0.0, 1.0, SAMPLES))
    sample = motion.sample_intervals(k, s)
    tau = rnea(name, motion, k, sample.q, sample.v, sample.a)
    largest = np.abs(tau).max()
    assert np.abs(sample.tau - tau).max() < 1e-9 * largest
    for joint in kind.scene.passive_coordinates:
        assert np.abs(tau[:, joint]).max() < NEGLIGIBLE * largest
    if limited:
        assert np.abs(sample.v).max() == pytest.approx(fastest(name), rel=1e-2)
        assert np.abs(sample.v).max() < fastest(name) * (1 + 1e-6)
        assert planned(name, limited=True).cost > planned(name).cost


@pytest.mark.parametrize("passing", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_the_cost_is_the_integral_along_the_curve(name: str, passing: bool) -> None:
    found = planned(name, passing)
    motion = found.trajectory

    def jet(k: Any, s: Array) -> Sequence[Array]:
        return motion.sample_intervals(k, s)[:3]

    assert effort(name, motion, jet) == pytest.approx(found.cost, rel=1e-2)


@dataclass(frozen=True)
class Changed:
    """q(t) (+) size x(t), with x = d times a polynomial that keeps what the goals say.

    Its velocities by Pinocchio's derivatives of integrate, its accelerations by differences.
    powers: of its roots at the start, at the seam and at the end.
    """

    name: str
    motion: hovi.Trajectory
    direction: Array
    powers: tuple[int, int, int]
    size: float

    def velocity(self, t: Array, k: Any, s: Array) -> tuple[Array, Array]:
        model, motion = kinds()[self.name].robot.model, self.motion
        T, at = motion.duration, kinds()[self.name].durations[0]
        roots = np.repeat([0.0, at, T], self.powers)
        shape = np.polynomial.Polynomial.fromroots(roots / T)
        scale = np.abs(shape(np.linspace(0, 1, 101))).max()
        found = motion.sample_intervals(k, s)
        q, v = np.empty_like(found.q), np.empty_like(found.v)
        for i, u in enumerate(t / T):
            x = self.size * self.direction * shape(u) / scale
            dx = self.size * self.direction * shape.deriv()(u) / scale / T
            at_q, at_x = (
                pin.dIntegrate(model, found.q[i], x, which) for which in (pin.ARG0, pin.ARG1)
            )
            q[i], v[i] = pin.integrate(model, found.q[i], x), at_q @ found.v[i] + at_x @ dx
        return q, v

    def jet(self, k: Any, s: Array) -> Sequence[Array]:
        h, d = self.motion.grid.steps[k], 1e-4
        t = self.motion.t[k] + s * h
        sides = [self.velocity(t + x * d * h, k, s + x * d)[1] for x in (-1, 1)]
        return *self.velocity(t, k, s), (sides[1] - sides[0]) / (2 * d * h)[:, None]


@pytest.mark.parametrize("passing", [False, True])
@pytest.mark.parametrize("name", DRIVEN)
def test_no_smooth_change_that_keeps_the_goals_costs_less(name: str, passing: bool) -> None:
    """Of a few sizes and directions; those of both signs cost alike to first order."""
    found = planned(name, passing)
    kind, random = kinds()[name], np.random.default_rng(5)
    for trial in range(4):
        direction = random.normal(size=kind.robot.nv)
        powers = (2, 1 if passing and trial % 2 == 0 else 2, 2)
        costs = {}
        for size in (-0.04, 0.0, 0.04):
            changed = Changed(name, found.trajectory, direction, powers, size)
            costs[size] = effort(name, found.trajectory, changed.jet)
        curvature = costs[-0.04] + costs[0.04] - 2 * costs[0.0]
        assert costs[0.0] == pytest.approx(found.cost, rel=1e-3)
        assert curvature > 1e-4 * costs[0.0]
        assert abs(costs[0.04] - costs[-0.04]) < 0.05 * curvature


@pytest.mark.parametrize("name", NAMES)
def test_no_other_velocity_at_the_seam_costs_less(name: str) -> None:
    """Stops there do, and so do passages of slightly other velocities, given to the plan."""
    kind, found = kinds()[name], planned(name)
    assert planned(name, passing=False).cost > found.cost * (1 - 1e-6)
    motion = found.trajectory
    best = motion.v[seam(name, motion)]
    load = hovi.effects.Payload(frame=kind.robot.tip_frame, mass=CARRIED)
    driven = np.delete(np.arange(kind.robot.nv), kind.scene.passive_coordinates)
    for sign in (-1.0, 1.0):
        v = best.copy()
        v[driven] *= 1 + 0.1 * sign
        given = kind.goal(kind.middle, v=v)
        segments = [
            hovi.Segment(given, kind.durations[0]),
            hovi.Segment(kind.goal(kind.last), kind.durations[1], effects=[load]),
        ]
        other = hovi.plan_sequence(
            kind.scene,
            kind.robot.neutral(),
            segments,
            limits="none",
            self_collision=False,
            tolerance=1e-4,
        )
        assert other.success, other.message
        assert other.cost > found.cost * (1 - 1e-4)


@pytest.mark.parametrize("name", NAMES)
def test_a_sequence_of_stops_costs_what_its_motions_cost(name: str) -> None:
    """Where the arm stops, with all that the goal says, nothing joins both motions."""
    kind, found = kinds()[name], planned(name, passing=False)
    if kind.left:
        pytest.skip("the base is left free where the motions meet")
    load = hovi.effects.Payload(frame=kind.robot.tip_frame, mass=CARRIED)
    loaded = hovi.Scene(
        kind.robot, [*kind.scene.effects, load], passive=kind.passive, compile=False
    )
    stops = kind.robot.neutral(), kind.moved(kind.middle), kind.moved(kind.last)
    total = 0.0
    for scene, *ends, T in zip(
        (kind.scene, loaded), stops, stops[1:], kind.durations, strict=False
    ):
        motion = hovi.plan(scene, *ends, T, limits="none", self_collision=False, tolerance=1e-4)
        assert motion.success, motion.message
        total += motion.cost
    assert found.cost == pytest.approx(total, rel=3e-4)


@pytest.mark.parametrize("later", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_what_is_left_of_it_costs_what_it_has_not_cost_yet(name: str, later: bool) -> None:
    """From a node of the first segment, and of the second, which has the seam behind it."""
    found = planned(name)
    motion = found.trajectory
    node = seam(name, motion) + 3 if later else 3

    def jet(k: Any, s: Array) -> Sequence[Array]:
        return motion.sample_intervals(k, s)[:3]

    left = found.advance(float(motion.t[node]))
    assert left.success, left.message
    apart = pin.difference(kinds()[name].robot.model, motion.q[node], left.trajectory.q[0])
    assert np.abs(apart).max() < 1e-9
    rest = effort(name, motion, jet, node)
    assert left.cost == pytest.approx(rest, rel=1e-3, abs=1e-3 * found.cost)


def nearest(kind: Kind, motion: hovi.Trajectory, center: Array) -> float:
    """The least distance of the balls in the middle of all links from a point, in [m]."""
    model, least = kind.robot.model, np.inf
    data, middle = model.createData(), np.array([LENGTH / 2, 0.0, 0.0])
    for q in motion.sample(np.linspace(0.0, motion.duration, 1001)).q:
        pin.framesForwardKinematics(model, data, q)
        for i in range(1, 4):
            if model.existFrame(f"l{i}"):
                at = data.oMf[model.getFrameId(f"l{i}")].act(middle)
                least = min(least, float(np.linalg.norm(at - center)))
    return least


@pytest.mark.parametrize("later", [False, True])
def test_it_keeps_clear_of_a_ball_that_is_in_its_way(later: bool) -> None:
    """In the first segment, and in the second, in which a joint turns by more than half a turn."""
    kind = Kind(
        arm("c3", ("continuous", "revolute", "continuous")),
        np.array([1.5, 0.6, 1.0]),
        np.array([0.0, -0.5, 4.0]),
        (1.5, 1.5),
    )
    load = hovi.effects.Payload(frame=kind.robot.tip_frame, mass=CARRIED)
    segments = [
        hovi.Segment(kind.goal(kind.middle), 1.5),
        hovi.Segment(kind.goal(kind.last), 1.5, effects=[load]),
    ]
    armature = hovi.effects.Armature(0.05)
    scene = hovi.Scene(kind.robot, [*kind.scene.effects, armature], compile=False)
    options: dict[str, Any] = {"limits": {"base": "none", "v": 4.0}, "self_collision": False}
    start = kind.robot.neutral()
    free = hovi.plan_sequence(scene, start, segments, **options)
    pose = kind.robot.frame_pose("l3", free.trajectory.sample([2.25 if later else 0.75]).q[0])
    center, radius = (pose @ [LENGTH / 2, 0.0, 0.0, 1.0])[:3] + np.array([0.03, 0.02, 0.03]), 0.06
    ball = hovi.Sphere(center, radius, name="ball")
    found = hovi.plan_sequence(scene, start, segments, obstacles=[ball], margin=0.01, **options)
    assert found.success, found.message
    assert nearest(kind, free.trajectory, center) < radius + RADIUS
    apart = nearest(kind, found.trajectory, center) - radius - RADIUS
    assert apart > 0.01 - 1e-6
    assert apart < 0.012
    assert found.cost > free.cost
    for node, change in ((1.5, kind.middle), (3.0, kind.last)):
        q = found.trajectory.sample([node]).q[0]
        assert np.abs(kind.robot.difference(kind.moved(change), q)).max() < 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_it_is_saved_certified_and_planned_again(name: str, tmp_path: Path) -> None:
    found, kind = planned(name), kinds()[name]
    motion = found.trajectory
    motion.save(tmp_path / "motion.npz")
    loaded, t = hovi.Trajectory.load(tmp_path / "motion.npz"), np.linspace(0.0, motion.duration, 50)
    for one, other in zip(loaded.sample(t), motion.sample(t), strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-9 * max(1.0, np.abs(other).max()))
    assert found.accuracy is not None
    assert found.accuracy.estimate is not None
    assert found.accuracy.estimate.cost < 1e-4
    certificate = hovi.certify(found)
    assert certificate.n_neg == 0
    again = found.replan(goal=kind.goal(kind.last * 1.02))
    assert again.success, again.message
    node = seam(name, again.trajectory)
    apart = pin.difference(kind.robot.model, motion.q[seam(name, motion)], again.trajectory.q[node])
    free = np.isin(np.arange(kind.robot.nv), kind.scene.passive_coordinates) & bool(kind.left)
    assert np.abs(apart[~free]).max() < 1e-9


@pytest.mark.parametrize("intervals", [2, 3, 7])
def test_given_intervals_are_those_of_all_segments_together(intervals: int) -> None:
    scene = hovi.Scene(with_shapes("two_link.urdf"), [hovi.effects.Gravity()])
    segments = [hovi.Segment([0.3, 0.2], 0.4), hovi.Segment([0.6, -0.1], 1.0)]
    given = {"intervals": intervals, "limits": "none", "self_collision": False}
    found = hovi.plan_sequence(scene, [0.0, 0.0], segments, **given)
    motion = found.trajectory
    assert motion.grid.intervals == intervals
    assert motion.segments is not None
    assert min(motion.segments.intervals) >= 1
    if intervals == 7:
        assert motion.segments.intervals == (2, 5)  # nearly equal lengths
