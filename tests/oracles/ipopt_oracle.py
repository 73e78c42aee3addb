"""The discrete action, formulated in CasADi interval by interval and minimised by Ipopt."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]


Cost = Callable[[ca.SX, ca.SX, ca.SX, ca.SX, ca.SX], ca.SX]
"""C of the symbols (q, v, a, tau, t), a number."""


def least_action(
    problem: TrajectoryProblem,
    guess: DiscretePath,
    seed: int = 0,
    move: float = 1e-3,
    cost: Cost | None = None,
) -> tuple[float, Array]:
    """The cost and the nodes (q, v), shape (N - 1, 2 n), that Ipopt finds near a path.

    cost: instead of 1/2 |tau|^2 of the active joints.

    Each unknown of the guess is first moved at random, by `move` or so. The problem's limits hold
    at the quadrature points, r + 2 moments of every passive joint's torque vanish per interval, and
    what its seams hold is fixed.
    """
    grid, n = problem.grid, problem.robot.nv
    N, r = grid.intervals, grid.inner_modes
    nodes, modes = ca.MX.sym("nodes", 2 * n, N - 1), ca.MX.sym("modes", n, r * N)
    (q0, q1), (v0, v1) = problem.ends
    ends = [np.concatenate(end)[:, None] for end in ((q0, v0), (q1, v1))]
    all_nodes = ca.horzcat(ends[0], nodes, ends[1])
    left, right = all_nodes[:, :-1], all_nodes[:, 1:]
    times = ca.DM(grid.t[None, :-1])
    counts = [N] if problem.ld.segments is None else np.bincount(problem.ld.segments)
    ends_of, parts = np.cumsum([0, *counts]), []
    for scene, a, b in zip(problem.scenes, ends_of[:-1], ends_of[1:], strict=True):
        interval = _interval_action(problem, scene, cost).map(int(b - a))
        own = left[:, a:b], right[:, a:b], modes[:, r * a : r * b], times[:, a:b]
        parts.append(interval(*own))
    actions, outputs, moments = (ca.horzcat(*each) for each in zip(*parts, strict=True))
    action = ca.sum2(actions)
    x = ca.vertcat(ca.vec(nodes), ca.vec(modes))
    quiet = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False, "ipopt.tol": 1e-8}
    program = {"x": x, "f": action, "g": ca.vec(moments)}
    bounds = {name: np.zeros(moments.numel()) for name in ("lbg", "ubg")}
    if problem.limits is not None:
        program["g"] = ca.vertcat(program["g"], ca.vec(outputs))
        points = outputs.shape[0] // problem.limits.lower.size
        for name, bound in zip(("lbg", "ubg"), problem.limits.on(grid.t), strict=True):
            each = np.broadcast_to(bound, (N, *bound.shape[1:])).reshape(N, -1)
            bounds[name] = np.append(bounds[name], np.tile(each, points).ravel())
    solver = ca.nlpsol("least_action", "ipopt", program, quiet)
    fixed = np.full((N - 1, 2, n), np.nan)
    for each in problem.holds:
        fixed[each.node - 1] = np.where(each.fixed, [each.q, each.v], np.nan)
    known = np.append(fixed.ravel(), np.full(modes.numel(), np.nan))
    bounds["lbx"], bounds["ubx"] = (
        np.where(np.isnan(known), free, known) for free in (-np.inf, np.inf)
    )
    inner = np.concatenate([np.hstack([guess.q, guess.v])[1:-1].ravel(), guess.inner.ravel()])
    start = inner + move * np.random.default_rng(seed).standard_normal(inner.shape)
    result = solver(x0=start, **bounds)
    assert solver.stats()["success"]
    found = result["x"].full().ravel()[: 2 * n * (N - 1)]
    return float(result["f"]), found.reshape(N - 1, 2 * n)


def _interval_action(problem: TrajectoryProblem, scene: Scene, cost: Cost | None) -> ca.Function:
    """L_d(q0 v0, q1 v1, c, t0) of an interval: h sum_j w_j C_j by the scheme's numbers.

    And (q, v, a, tau) at its quadrature points, one after the other, and the moments of the passive
    torques against P_0 .. P_{r+1}. Without passive joints there are no moments.
    """
    scheme, h, n = problem.grid.schemes[0], float(problem.grid.steps[0]), problem.robot.nv
    tau = casadi_functions(scene.model).inverse_dynamics
    left, right = ca.SX.sym("left", 2 * n), ca.SX.sym("right", 2 * n)
    c, t0 = ca.SX.sym("c", n, scheme.inner_modes), ca.SX.sym("t0")
    q0, v0, q1, v1 = left[:n], left[n:], right[:n], right[n:]
    columns = ca.horzcat(h * v0, q1 - q0 - h * v0, h * (v1 - v0), h**2 * c)
    passive = [int(i) for i in problem.passive]
    active = [i for i in range(n) if i not in passive]
    polynomials = np.polynomial.legendre.legvander(2 * scheme.points - 1, scheme.inner_modes + 1)
    action, outputs, moments = 0, [], 0
    parts = zip(scheme.points, scheme.weights, scheme.table, polynomials, strict=True)
    for s, weight, rows, P in parts:
        x, hv, hha = ca.horzsplit(columns @ rows.T)
        effort = tau(q0 + x, hv / h, hha / h**2)
        if cost is None:
            action += h * weight * ca.sumsqr(effort[active]) / 2
        else:
            action += h * weight * cost(q0 + x, hv / h, hha / h**2, effort, t0 + s * h)
        outputs += [q0 + x, hv / h, hha / h**2, effort]
        moments += weight * effort[passive] @ P[None]
    return ca.Function("L_d", [left, right, c, t0], [action, ca.vertcat(*outputs), ca.vec(moments)])
