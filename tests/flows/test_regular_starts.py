"""A flow begins where its Lagrangian is regular in the highest derivative, and says where not."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.effects import Gravity
from hovi.errors import InputError
from hovi.flows.charted_lagrangian import ChartedLagrangian
from hovi.flows.legendre_transforms import kernel_coordinates, legendre
from hovi.flows.scheme_lagrangian import SchemeLagrangian
from hovi.flows.stepper import Flow, flow
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.schemes import galerkin

Array = npt.NDArray[np.float64]


def run(lagrangian: Lagrangian, jet: npt.ArrayLike, h: float = 0.01) -> Flow:
    """Three steps from a jet (q, q', ...)."""
    ld = SchemeLagrangian(lagrangian, galerkin(1, lagrangian.order), h)
    return flow(ld, *legendre(lagrangian, *np.asarray(jet)), 3, force=True)


def elastica(stiffness: float = 0.0) -> CasadiLagrangian:
    """The squared curvature of a plane curve, per length, and a cost of the acceleration."""
    q, v, a = (ca.SX.sym(c, 2) for c in "qva")
    bend = (v[0] * a[1] - v[1] * a[0]) ** 2 / ca.norm_2(v) ** 5
    return CasadiLagrangian([q, v, a], bend + stiffness / 2 * ca.sumsqr(a))


PLANE_JET = np.array([[0.0, 0.0], [1.0, 0.2], [0.1, 0.3], [0.1, 0.1]])


def test_a_passive_joint_is_named(two_link: Robot) -> None:
    scenes = [
        Scene(load_robot(example("cart_pole.urdf")), [Gravity()], passive=["hinge"]),
        Scene(two_link, [Gravity()], passive=[two_link.coordinate_names[1]]),
    ]
    jet = 0.3 * np.random.default_rng(0).normal(size=(4, 2))
    for scene in scenes:
        expected = rf"singular .* passive joints \('{scene.passive[0]}'\) .* hovi\.plan"
        with pytest.raises(InputError, match=expected) as refused:
            run(scene.effort_lagrangian(), jet)
        assert all(repr(name) in str(refused.value) for name in scene.robot.coordinate_names)


def test_a_passive_joint_of_a_floating_robot_is_named() -> None:
    robot = load_robot(example("spacecraft_arm.urdf"), free_flyer=True)
    joint = robot.coordinate_names[-1]
    L = Scene(robot, passive=[joint]).effort_lagrangian()
    assert L.space is not None
    x = np.append(pin.neutral(robot.model), np.full(L.nv, 0.1))[None]
    with pytest.raises(InputError, match=rf"do not determine .*'{joint}'"):
        flow(ChartedLagrangian(L, L.space, galerkin(0), 0.01), x, np.zeros((2, L.nv)), 3)


def test_a_cost_of_the_shape_alone_is_refused_and_one_that_resists_is_not() -> None:
    with pytest.raises(InputError, match=r"q\^\(2\) of q\[0\], q\[1\]; .* parametrization"):
        run(elastica(), PLANE_JET)
    assert np.isfinite(run(elastica(1e-6), PLANE_JET).q).all()


def test_a_curve_at_rest_has_no_curvature() -> None:
    ld = SchemeLagrangian(elastica(), galerkin(1), 0.01)
    with pytest.raises(InputError, match="not finite at the start"):
        flow(ld, np.zeros((2, 2)), np.zeros((2, 2)), 3)


@pytest.mark.parametrize("k", [1, 2, 3])
def test_only_the_coordinates_that_nothing_resists_are_named(k: int) -> None:
    jet = [ca.SX.sym(f"q{j}", 3) for j in range(k + 1)]
    top = jet[-1]
    L = CasadiLagrangian(jet, (top[0] + top[1] / 3) ** 2 + top[1] ** 2 + ca.sumsqr(jet[0]))
    with pytest.raises(InputError, match=rf"do not determine q\^\({k}\) of q\[2\];"):
        flow(SchemeLagrangian(L, galerkin(0, k), 0.01), np.ones((k, 3)), np.zeros((k, 3)), 3)


@pytest.mark.parametrize("unit", [1e-9, 1e-3, 1.0, 1e6])
def test_units_do_not_matter(unit: float) -> None:
    """One coordinate in another unit: regular stays regular, singular stays singular."""
    q, v, a = (ca.SX.sym(c, 2) for c in "qva")
    b = a * ca.DM([1.0, unit])
    regular = CasadiLagrangian([q, v, a], (b[0] + b[1]) ** 2 + 0.01 * b[1] ** 2)
    singular = CasadiLagrangian([q, v, a], (b[0] + b[1]) ** 2)
    start = np.ones((2, 2)), np.zeros((2, 2))
    flow(SchemeLagrangian(regular, galerkin(0), 0.01), *start, 3)
    with pytest.raises(InputError, match="singular"):
        flow(SchemeLagrangian(singular, galerkin(0), 0.01), *start, 3)


@pytest.mark.parametrize("name", ["xarm7", "z1", "talos_arm", "ur10", "alex_psyonic_hands"])
def test_arms_with_light_wrists_and_fingers_are_regular(name: str) -> None:
    # the condition number of W is up to 2e13 as it stands, and 3e5 scaled
    L = Scene(load_robot(name), [Gravity()]).effort_lagrangian()
    for jet in np.random.default_rng(0).normal(size=(5, 3, 1, L.nv)):
        assert len(kernel_coordinates(L.evaluate(*jet)[2][0, 2, :, 2], L.nv)) == 0


def unstable() -> CasadiLagrangian:
    """q'' = q, of which the midpoint rule makes q1 = ((1 + h^2/4) q0 + h v0) / (1 - h^2/4)."""
    q, v = (ca.SX.sym(c, 1) for c in "qv")
    return CasadiLagrangian([q, v], (ca.sumsqr(v) + ca.sumsqr(q)) / 2)


def test_a_step_whose_discrete_lagrangian_is_singular_is_refused() -> None:
    for h in (1.0, 1.5):
        q, p = 1.0, 0.5
        one = flow(SchemeLagrangian(unstable(), galerkin(0, 1), h), [[q]], [[p]], 1, force=True)
        expected = ((1 + h**2 / 4) * q + h * p) / (1 - h**2 / 4)
        assert one.q[1, 0] == pytest.approx(expected, rel=1e-12)
    for h in (2.0 - 1e-14, 2.0 + 1e-14):
        ld = SchemeLagrangian(unstable(), galerkin(0, 1), h)
        with pytest.raises(InputError, match=r"discrete .* singular .* q\[0\]: take another"):
            flow(ld, [[0.0]], [[0.0]], 1, force=True)
    ld = SchemeLagrangian(unstable(), galerkin(0, 1), 2.0)
    with pytest.raises(InputError, match=r"matrix of Newton's method is singular.* 2 steps of 1 s"):
        flow(ld, [[1.0]], [[0.5]], 1, force=True)


@pytest.mark.parametrize("h", [1.97, 2.0 - 1e-14, 2.03])
def test_a_solution_that_shorter_steps_contradict_is_refused(h: float) -> None:
    # at h = 1.97 the midpoint rule ends at 99 and the motion at 5, at h = 2.03 it ends at -101
    ld = SchemeLagrangian(unstable(), galerkin(0, 1), h)
    with pytest.raises(InputError, match=r"misses the end of shorter steps .* use a shorter step"):
        flow(ld, [[1.0]], [[0.5]], 1, force=True)
