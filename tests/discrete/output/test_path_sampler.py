"""Single samples by the compiled call, against NumPy and Pinocchio, for every kind of motion."""

from __future__ import annotations

import copy
import dataclasses
import pickle

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.output.path_sampler import PathSampler
from hovi.discrete.output.stored_torque import StoredTorque
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.scene.segment_scenes import SegmentScenes
from hovi.schemes import Scheme, by_name, galerkin
from hovi.schemes.interval_curve import jet_rows

Array = npt.NDArray[np.float64]

EPS = float(np.finfo(float).eps)
NAMES = ("galerkin-0", "galerkin-1", "galerkin-3x5", "galerkin-9", "hermite-simpson")
TIMES = np.concatenate([np.random.default_rng(5).uniform(0.0, 3.0, 40), [0.0, 3.0]])


def random_motion(scene: hovi.Scene, schemes: tuple[Scheme, ...], **more: object) -> Trajectory:
    """A motion with random nodes and modes, which is not continuous, of 3 s."""
    random = np.random.default_rng(7)
    N, n = len(schemes), scene.robot.nv
    steps = random.uniform(0.5, 1.5, N)
    grid = Grid(steps * (3.0 / steps.sum()), schemes)
    q = np.array([pin.neutral(scene.robot.model)] * (N + 1))
    if scene.robot.curved_space is None:
        q = random.normal(size=(N + 1, n))
    path = DiscretePath(
        q,
        random.normal(size=(N + 1, n)),
        random.normal(size=(N, grid.order, n)),
        random.normal(size=(N, grid.inner_modes, n)),
        random.normal(size=(N + 1, max(0, grid.order - 2), n)),
    )
    momenta = np.zeros((N + 1, grid.order, n))
    return Trajectory(grid, path, momenta, **{"scene": scene, **more})  # type: ignore[arg-type]


def by_rows(motion: Trajectory, t: float) -> tuple[Array, Array, Array]:
    """(q, v, a) on a vector space from the rows of one interval."""
    grid, path = motion.grid, motion.path
    k = min(int(np.searchsorted(grid.t, t, side="right")) - 1, grid.intervals - 1)
    h, order = grid.steps[k], grid.order
    r = grid.schemes[k].inner_modes
    rows = jet_rows(np.array([(t - grid.t[k]) / h]), order, r, max(order, 2))[0]
    rates = [path.rates[k, i] * h ** (i + 1) for i in range(order - 1)]
    data = np.array([*rates, *(path.z[k] * h**order), *(path.inner[k, :r] * h**order)])
    x = [row @ data / h**j for j, row in enumerate(rows)]
    return path.q[k] + x[0], x[1], x[2]


def test_single_samples_of_every_scheme_are_those_of_its_rows(ur5: hovi.Robot) -> None:
    scene = hovi.Scene(ur5, [hovi.effects.Gravity()])
    motion = random_motion(scene, tuple(by_name(name) for name in NAMES))
    data = scene.model.createData()
    for t in TIMES:
        sample, jet = motion.sample(t), by_rows(motion, t)
        for got, wanted in zip(sample[:3], jet, strict=True):
            np.testing.assert_allclose(got[0], wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())
        tau = pin.rnea(scene.model, data, *jet)
        np.testing.assert_allclose(sample.tau[0], tau, rtol=0, atol=1e-12 * np.abs(tau).max())


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_single_samples_have_the_curve_of_any_order(order: int, two_link: hovi.Robot) -> None:
    scene = hovi.Scene(two_link)
    motion = random_motion(scene, tuple(galerkin(r, order) for r in (2, 0, 3)))
    for t in TIMES:
        for got, wanted in zip(motion.sample(t)[:3], by_rows(motion, t), strict=True):
            np.testing.assert_allclose(got[0], wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


def test_an_interval_leaves_modes_out_that_only_others_have(two_link: hovi.Robot) -> None:
    motion = random_motion(hovi.Scene(two_link), (by_name("galerkin-0"), by_name("galerkin-4")))
    assert np.abs(motion.path.inner[0]).min() > 0
    t = motion.grid.steps[0] * np.linspace(0.0, 0.99, 9)
    s = t / motion.grid.steps[0]
    h, path = motion.grid.steps[0], motion.path
    cubic = [path.v[0] * h, *(path.z[0] * h**2)]
    wanted = path.q[0] + by_name("galerkin-0").rows(s)[:, 0] @ np.array(cubic)
    np.testing.assert_allclose(motion.sample(t).q, wanted, atol=1e-14)


def scenes_of_all_kinds() -> dict[str, hovi.Scene]:
    gravity = hovi.effects.Gravity()
    base = hovi.effects.MovingBase(position=["0.1*sin(t)", "0", "0"])
    load = hovi.load_robot
    return {
        "friction": hovi.Scene(load("ur5"), [gravity, hovi.effects.ViscousFriction(0.3)]),
        "mimic joints": hovi.Scene(load("panda", mimic=True), [gravity]),
        "moving base": hovi.Scene(load(hovi.example("two_link.urdf")), [gravity, base]),
        "continuous joints": hovi.Scene(load("kinova"), [gravity]),
        "free flyer": hovi.Scene(load(hovi.example("two_link.urdf"), free_flyer=True)),
    }


@pytest.mark.parametrize("kind", ["friction", "mimic joints", "moving base", "continuous joints"])
def test_single_samples_are_those_of_the_scene(kind: str) -> None:
    scene = scenes_of_all_kinds()[kind]
    motion = random_motion(scene, (galerkin(2), galerkin(1)))
    together = motion.sample(TIMES)
    for i, t in enumerate(TIMES):
        sample = motion.sample(float(t))
        for one, many in zip(sample, together, strict=True):
            np.testing.assert_allclose(one[0], many[i], rtol=0, atol=1e-12 * np.abs(many).max())
        tau = scene.inverse_dynamics(*sample[:3], np.array([t]))
        np.testing.assert_allclose(sample.tau, tau, rtol=0, atol=1e-12 * np.abs(tau).max())


def test_each_segment_has_the_torques_of_its_own_scene(ur5: hovi.Robot) -> None:
    """Times go back and forth between the segments."""
    payload = hovi.effects.Payload(mass=3.0, frame="tool0")
    scenes = tuple(
        hovi.Scene(ur5, [hovi.effects.Gravity(g), *more]) for g, more in ((9.81, []), (1.6, []))
    )
    motion = random_motion(scenes[0], (galerkin(2),) * 3)
    motion = dataclasses.replace(motion, scene=None, segments=SegmentScenes(scenes, (1, 2)))
    times = np.random.default_rng(1).uniform(0.0, 3.0, 60)
    q, v, a, tau = motion.sample(times)
    first = times < motion.t[1]
    assert 5 < first.sum() < 55
    for scene, here in zip(scenes, (first, ~first), strict=True):
        wanted = scene.inverse_dynamics(q[here], v[here], a[here])
        np.testing.assert_allclose(tau[here], wanted, rtol=0, atol=1e-11)
    loaded = hovi.Scene(ur5, [hovi.effects.Gravity(), payload])
    mixed = dataclasses.replace(motion, segments=SegmentScenes((scenes[0], loaded), (1, 2)))
    wanted = loaded.inverse_dynamics(q[~first], v[~first], a[~first])
    np.testing.assert_allclose(mixed.sample(times).tau[~first], wanted, rtol=0, atol=1e-11)


def test_stored_torques_are_sampled_and_not_computed(two_link: hovi.Robot) -> None:
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    stored = StoredTorque(np.full((2, 3, 2), 4.5))
    motion = random_motion(scene, (galerkin(1),) * 2, torque=stored)
    np.testing.assert_allclose(motion.sample(0.7).tau, 4.5)


def test_the_end_is_sampled_a_few_roundings_late_and_not_later(two_link: hovi.Robot) -> None:
    motion = random_motion(hovi.Scene(two_link), (galerkin(2),) * 3)
    T = motion.duration
    for late in (T, T * (1 + 4 * EPS)):
        np.testing.assert_array_equal(motion.sample(late).q, motion.sample_intervals([2], [1.0]).q)
    np.testing.assert_array_equal(motion.sample(-EPS * T).q[0], motion.q[0])
    for beyond in (T * (1 + 9 * EPS), -9 * EPS * T, np.nan, np.inf):
        with pytest.raises(InputError, match=r"lasts from 0 to|finite"):
            motion.sample(beyond)


def test_nodes_are_sampled_without_rounding(ur5: hovi.Robot) -> None:
    motion = random_motion(hovi.Scene(ur5), tuple(by_name(name) for name in NAMES))
    for k, t in enumerate(motion.t[:-1]):
        sample = motion.sample(t)
        np.testing.assert_array_equal(sample.q[0], motion.q[k])
        np.testing.assert_array_equal(sample.v[0], motion.v[k])


def test_a_sampled_motion_can_be_pickled_and_copied(two_link: hovi.Robot) -> None:
    motion = random_motion(hovi.Scene(two_link), (galerkin(2),) * 3)
    before = motion.sample(1.0)
    for again in (pickle.loads(pickle.dumps(motion)), copy.deepcopy(motion)):
        for got, wanted in zip(again.sample(1.0), before, strict=True):
            np.testing.assert_array_equal(got, wanted)


def test_groups_have_no_compiled_sampler() -> None:
    scene = scenes_of_all_kinds()["free flyer"]
    motion = random_motion(scene, (galerkin(1),) * 2)
    sample = motion.sample(1.3)
    tau = scene.inverse_dynamics(*sample[:3])
    np.testing.assert_allclose(sample.tau, tau, rtol=0, atol=1e-12 * np.abs(tau).max())


def test_times_of_other_shapes_are_left_to_the_caller(two_link: hovi.Robot) -> None:
    motion = random_motion(hovi.Scene(two_link), (galerkin(2),) * 3)
    grid = motion.grid
    sampler = PathSampler(vars(motion.path), grid.t, grid.steps, grid.groups)
    assert sampler.at_times(np.zeros((2, 2))) is None
    assert sampler.at_times([0.0, 99.0]) is None
    found = sampler.at_times([0.0, 1.0])
    assert found is not None
    assert found[-1] is None
