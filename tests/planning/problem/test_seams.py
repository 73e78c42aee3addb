"""Goals where segments meet: what they fix, and the guess through them."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest
from scipy.linalg import expm

import hovi
from hovi.discrete.interval_paths import regularized_nodes
from hovi.discrete.state import State
from hovi.planning.problem.goals import Via
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.seams import Hold, Seam, curve_through, holding
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.schemes import galerkin

Array = npt.NDArray[np.float64]

ROBOT = hovi.load_robot(hovi.example("two_link.urdf"))
SCENES = [
    hovi.Scene(ROBOT, [hovi.effects.Gravity(9.8), *more])
    for more in ([], [hovi.effects.Payload(frame="tip", mass=0.5)])
]
ENDS = State([0.0, 0.0]), State([1.0, 0.5])
MIDDLE = State([0.7, 0.9])


def carry(*via: Via, limits: Any = None, order: int = 2) -> TrajectoryProblem:
    """A move in which a payload is picked up after 0.6 s of 1.5 s."""
    scenes = SCENES
    if order == 3:
        jerk = hovi.effects.JerkCost(1e-4)
        scenes = [hovi.Scene(ROBOT, [*scene.effects, jerk]) for scene in SCENES]
    parts = [
        hovi.DiscreteLagrangian(
            scene.effort_lagrangian(), hovi.Grid.uniform(T, n, galerkin(3, order))
        )
        for scene, T, n in zip(scenes, (0.6, 0.9), (4, 6), strict=True)
    ]
    bounds = None if limits is None else [as_limits(ROBOT, limits)] * 2
    return TrajectoryProblem.of_segments(parts, *ENDS, bounds, via)


def hold(node: int, fixed: list[list[bool]], time: float = 0.6) -> Hold:
    return held(node, time, [0.7, 0.9], fixed, [0.3, -0.2])


def held(
    node: int, time: float, q: list[float], fixed: list[list[bool]], v: Any = (0.0, 0.0)
) -> Hold:
    state = State(q, list(v))
    known = np.array(q), np.array(v), np.array(fixed)
    return Hold(node, time, *known, state, np.zeros(2), State(q))


@pytest.mark.parametrize("order", [2, 3])
def test_a_path_holds_what_is_fixed_and_nothing_else(order: int) -> None:
    problem = carry(order=order)
    path, fixed = problem.guess("cubic"), [[True, False], [False, True]]
    on_seam = holding(path, problem.grid, [hold(4, fixed)], ROBOT)
    q, v = path.q.copy(), path.v.copy()
    q[4, 0], v[4, 1] = 0.7, -0.2
    np.testing.assert_array_equal(on_seam.q, q)
    np.testing.assert_array_equal(on_seam.v, v)
    np.testing.assert_array_equal(on_seam.inner, path.inner)
    nodes = np.concatenate([on_seam.q[:, None], on_seam.rates], axis=1)
    z = regularized_nodes(nodes, problem.grid.steps)
    np.testing.assert_allclose(on_seam.z, z, rtol=0, atol=1e-9 * np.abs(z).max())
    np.testing.assert_array_equal(on_seam.z[:3], path.z[:3])
    np.testing.assert_array_equal(on_seam.z[5:], path.z[5:])


@pytest.mark.parametrize("name", ["cubic", "minimum-jerk"])
@pytest.mark.parametrize("order", [2, 3])
def test_a_guess_passes_every_seam_and_its_velocity_is_continuous(order: int, name: str) -> None:
    passing = held(1, 0.6, [0.7, 0.9], [[True] * 2, [False] * 2])
    stop = hold(2, [[True, True], [True, True]], time=1.0)
    jets = [np.zeros((2, 2)) for _ in range(order)]
    jets[0][1] = [1.5, 0.5]
    curve = curve_through(name, ROBOT, jets, 1.5, [passing, stop], np.zeros(2))
    d = 1e-7
    for t, q in ((0.0, [0.0, 0.0]), (0.6, [0.7, 0.9]), (1.0, [0.7, 0.9]), (1.5, [1.5, 0.5])):
        np.testing.assert_allclose(curve(np.array([t]))[0][0], q, atol=1e-12)
    for t in (0.2, 0.6, 0.8, 1.0, 1.3):
        before, at, after = (curve(np.array([s])) for s in (t - d, t, t + d))
        slope = (after[0] - before[0]) / (2 * d)
        np.testing.assert_allclose(slope, at[1], atol=1e-4)
    np.testing.assert_allclose(curve(np.array([1.0]))[1][0], [0.3, -0.2], atol=1e-12)
    # from (0, 0) by (0.7, 0.9) to (0.7, 0.9): the mean velocity where none reverses
    assert curve(np.array([0.6]))[1][0] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_free_velocity_of_a_guess_is_the_mean_one_unless_it_would_reverse() -> None:
    passing = held(1, 0.5, [1.0, 1.0], [[True] * 2, [False] * 2])
    jets = [np.array([[0.0, 0.0], [3.0, -1.0]]), np.zeros((2, 2))]
    curve = curve_through("cubic", ROBOT, jets, 1.5, [passing], np.zeros(2))
    assert curve(np.array([0.5]))[1][0] == pytest.approx([2.0, 0.0])


@pytest.mark.parametrize(
    ("seam", "via"),
    [
        (MIDDLE, State(MIDDLE.q, [0.0, 0.0])),
        (State(MIDDLE.q, [0.4, -0.1]), State(MIDDLE.q, [0.4, -0.1])),
        (State(MIDDLE.q, free_velocity=["all"]), MIDDLE),
        (
            State(MIDDLE.q, free=["elbow"], free_velocity=["elbow"]),
            State(MIDDLE.q, [0.0, 0.0], free=["elbow"], free_velocity=["elbow"]),
        ),
    ],
)
def test_a_seam_is_what_equations_of_a_via_point_are(seam: State, via: State) -> None:
    """By multipliers, without any of the code that leaves unknowns out."""
    found, other = (hovi.solve(carry(at)) for at in (Seam(0.6, seam), Via(0.6, via)))
    assert found.success, found.message
    assert other.success, other.message
    assert found.cost == pytest.approx(other.cost, rel=1e-10)
    assert found.n_neg == other.n_neg == 0
    np.testing.assert_allclose(found.trajectory.q, other.trajectory.q, rtol=0, atol=1e-6)


def test_a_seam_within_limits_is_what_equations_are() -> None:
    limits = {"base": "none", "tau": [20.0, 9.0]}
    found = hovi.solve(carry(Seam(0.6, MIDDLE), limits=limits))
    other = hovi.solve(carry(Via(0.6, State(MIDDLE.q, [0.0, 0.0])), limits=limits))
    assert found.success, found.message
    assert found.cost > 1.001 * hovi.solve(carry(Seam(0.6, MIDDLE))).cost
    assert found.cost == pytest.approx(other.cost, rel=1e-4)
    np.testing.assert_array_equal(found.trajectory.configurations([0.6])[0], MIDDLE.q)


def test_momenta_jump_at_a_seam_in_what_is_fixed_alone() -> None:
    passing = State(MIDDLE.q, free=["elbow"], free_velocity=["all"])
    found = hovi.solve(carry(Seam(0.6, passing)))
    problem, motion = found.problem, found.trajectory
    assert problem is not None
    D = problem.ld.derivatives(motion.path)
    jumps = np.abs(D[:-1, 2:] + D[1:, :2])
    size = np.abs(D).max()
    assert jumps[3, 0, 0] > 1e-3 * size  # p of the shoulder at node 4
    jumps[3, 0, 0] = 0.0
    assert jumps.max() < 1e-9 * size


def test_the_certificate_measures_the_equations_where_nothing_is_fixed() -> None:
    found = hovi.certify(hovi.solve(carry(Seam(0.6, MIDDLE))), estimate=False)
    assert found.residual is not None
    assert found.residual < 1e-9


def test_a_beam_held_in_the_middle_bends_as_its_equations_say() -> None:
    """Position fixed and slope free at a support: q', c q'' agree there, the shear force jumps."""
    (c0, k0), (c1, k1), ends, support = (1.0, 30.0), (5.0, 2.0), (0.4, 1.0), 0.3
    q, v, a = (ca.SX.sym(name) for name in "qva")

    def flow(c: float, k: float, t: float) -> Array:
        # of q and its first three derivatives, by c q^(4) + k q = 0
        A = np.diag(np.ones(3), 1)
        A[3, 0] = -k / c
        return np.asarray(expm(A * t))

    one, other = flow(c0, k0, ends[0]), flow(c1, k1, ends[1] - ends[0])
    rows, known = np.zeros((8, 8)), np.array([0, 0, support, support, 0, 0, 0.2, 0.5])
    rows[0, 0] = rows[1, 1] = rows[3, 4] = 1.0
    rows[2, :4] = one[0]
    rows[4, :4], rows[4, 5] = one[1], -1.0
    rows[5, :4], rows[5, 6] = c0 * one[2], -c1
    rows[6:, 4:] = other[:2]
    starts = np.linalg.solve(rows, known).reshape(2, 4)
    parts = [
        hovi.DiscreteLagrangian(
            CasadiLagrangian([q, v, a], c * a**2 / 2 + k * q**2 / 2),
            hovi.Grid.uniform(T, n, galerkin(4)),
        )
        for (c, k), T, n in (((c0, k0), 0.4, 3), ((c1, k1), 0.6, 5))
    ]
    held = Seam(0.4, State([support], free_velocity=["all"]))
    problem = TrajectoryProblem.of_segments(parts, State([0.0]), State([0.2], [0.5]), via=(held,))
    found = hovi.solve(problem)
    assert found.success, found.message
    for begin, end, start, beam in zip((0.0, 0.4), ends, starts, ((c0, k0), (c1, k1)), strict=True):
        for t in np.linspace(begin, end, 9)[1:-1]:
            moved = found.trajectory.sample([t])
            true = flow(*beam, t - begin) @ start
            np.testing.assert_allclose([moved.q[0, 0], moved.v[0, 0]], true[:2], atol=1e-8)


def test_a_motion_with_seams_is_replanned_and_stays_on_them() -> None:
    found = hovi.solve(carry(Seam(0.6, MIDDLE)))
    again = found.replan(goal=[1.1, 0.3])
    fresh = hovi.solve(found.problem.between(ENDS[0], State([1.1, 0.3])))  # type: ignore[union-attr]
    assert again.success, again.message
    assert again.cost == pytest.approx(fresh.cost, rel=1e-9)
    np.testing.assert_array_equal(again.trajectory.q[4], MIDDLE.q)
    np.testing.assert_array_equal(again.trajectory.v[4], 0.0)


def test_a_frame_is_met_at_rest_where_segments_meet() -> None:
    tip = ROBOT.frame_position("tip", np.array([[0.7, 0.9]]))[0]
    found = hovi.solve(carry(Seam(0.6, hovi.FrameGoal("tip", position=tip))))
    assert found.success, found.message
    reached = ROBOT.frame_position("tip", found.trajectory.q[4:5])[0]
    np.testing.assert_allclose(reached, tip, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(found.trajectory.v[4], 0.0)
