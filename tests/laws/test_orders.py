"""Observed orders of the schemes on the two-link reach: sharp, on a nonlinear problem.

Errors are those against a Galerkin motion at least two orders finer, which the tests of the
solver compare with Pontryagin's equations. Orders are slopes of least-squares lines.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import numpy.typing as npt
import pytest

from hovi import Solution
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.effects import Gravity
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot
from hovi.scene.scene import Scene
from hovi.schemes import by_name
from oracles.on_grid import solve_on_grid
from samples.paper_arm import HANG, REACH_Q, REACH_V

Array = npt.NDArray[np.float64]

COMMON = np.arange(1, 8) / 8
"""Times that are nodes of every grid."""
BETWEEN = np.linspace(0.0, 1.0, 401)


@cache
def arm() -> Scene:
    return Scene(load_robot(example("two_link.urdf")), [Gravity(9.8)])


@cache
def reach(scheme: str, intervals: int) -> Solution:
    """The reach by a scheme, near the reference so that it is the same minimum."""
    grid = Grid.uniform(1.0, intervals, by_name(scheme))
    ld = DiscreteLagrangian(arm().effort_lagrangian(), grid)
    problem = TrajectoryProblem(ld, State(HANG), State(REACH_Q, REACH_V))
    solution = (
        solve_on_grid(problem)
        if scheme == "galerkin-4"
        else solve_on_grid(problem, reference().trajectory)
    )
    assert solution.success
    return solution


def reference() -> Solution:
    """Galerkin with four inner modes: order 12 at the nodes, 8, 7 and 6 between them."""
    return reach("galerkin-4", 96)


def at_common_nodes(solution: Solution, name: str) -> Array:
    motion = solution.trajectory
    nodes = np.rint(COMMON * motion.grid.intervals).astype(int)
    values = motion.momenta[:, ("p", "p~").index(name)] if "p" in name else getattr(motion, name)
    return values[nodes]


def nodal_error(scheme: str, intervals: int, name: str) -> float:
    solution, truth = reach(scheme, intervals), reference()
    if name == "cost":
        return abs(solution.cost - truth.cost)
    error = at_common_nodes(solution, name) - at_common_nodes(truth, name)
    return float(np.sqrt(np.mean(error**2)))


def error_between(scheme: str, intervals: int, name: str) -> float:
    samples = (s.trajectory.sample(BETWEEN) for s in (reach(scheme, intervals), reference()))
    found, truth = (getattr(sample, name) for sample in samples)
    return float(np.abs(found - truth).max())


def slope(intervals: Sequence[int], errors: Sequence[float]) -> float:
    assert len(intervals) >= 4
    return float(-np.polyfit(np.log(intervals), np.log(errors), 1)[0])


@pytest.mark.parametrize("name", ["q", "v", "p", "p~", "cost"])
@pytest.mark.parametrize(
    ("scheme", "intervals", "order"),
    [
        ("taylor-midpoint", (64, 96, 128, 192, 256), 2),
        ("taylor-trapezoid", (64, 96, 128, 192, 256), 2),
        ("hermite-simpson", (64, 96, 128, 192, 256), 4),
        ("galerkin-0", (32, 48, 64, 96, 128), 4),
        ("galerkin-1", (24, 32, 40, 48, 64), 6),
        ("galerkin-2", (32, 40, 48, 56), 8),
        ("galerkin-0x4", (48, 64, 96, 128, 192), 4),
        ("galerkin-1x5", (32, 40, 48, 64, 96), 6),
        ("galerkin-2x6", (32, 40, 48, 56), 8),
    ],
)
def test_nodes_momenta_and_cost_have_the_order_of_the_scheme(
    scheme: str, intervals: tuple[int, ...], order: int, name: str
) -> None:
    assert by_name(scheme).order == order
    errors = [nodal_error(scheme, N, name) for N in intervals]
    assert slope(intervals, errors) == pytest.approx(order, abs=0.3)


def test_three_inner_modes_are_at_round_off_with_32_intervals() -> None:
    for name, scale in (("q", 1.0), ("v", 10.0), ("cost", 20.0)):
        assert nodal_error("galerkin-3", 16, name) > 1e-11 * scale
        assert nodal_error("galerkin-3", 32, name) < 3e-12 * scale


@pytest.mark.parametrize(("name", "loss"), [("q", 0), ("v", 1), ("a", 2), ("tau", 2)])
@pytest.mark.parametrize(
    ("r", "intervals"),
    [
        (0, (64, 96, 128, 192, 256)),
        (1, (48, 64, 96, 128)),
        (2, (32, 40, 48, 64)),
        (3, (24, 32, 40, 48)),
    ],
)
def test_between_the_nodes_the_orders_are_of_the_polynomial(
    r: int, intervals: tuple[int, ...], name: str, loss: int
) -> None:
    errors = [error_between(f"galerkin-{r}", N, name) for N in intervals]
    assert slope(intervals, errors) == pytest.approx(r + 4 - loss, abs=0.3)


@pytest.mark.parametrize("scheme", ["taylor-midpoint", "taylor-trapezoid"])
def test_between_the_nodes_of_the_taylor_schemes_accelerations_are_of_first_order(
    scheme: str,
) -> None:
    # the midpoint's two accelerations differ by O(h): the paper's schemes say little about a
    intervals = (64, 96, 128, 192, 256)
    for name, order in (("q", 2), ("v", 2), ("a", 1), ("tau", 1)):
        errors = [error_between(scheme, N, name) for N in intervals]
        assert slope(intervals, errors) == pytest.approx(order, abs=0.3)


def test_torques_from_the_momenta_are_superconvergent() -> None:
    # tau = M^-1 p~ at the nodes, of order 2 (r + 2); from the interpolant of order r + 2 only
    M = casadi_functions(arm().model).mass_matrix

    def torque(solution: Solution) -> Array:
        q, pt = at_common_nodes(solution, "q"), at_common_nodes(solution, "p~")
        return np.stack([np.linalg.solve(M(x).full(), y) for x, y in zip(q, pt, strict=True)])

    intervals = (24, 32, 40, 48, 64)
    truth = torque(reference())
    errors = [float(np.abs(torque(reach("galerkin-1", N)) - truth).max()) for N in intervals]
    assert slope(intervals, errors) == pytest.approx(6, abs=0.3)
