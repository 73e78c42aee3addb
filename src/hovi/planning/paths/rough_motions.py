"""Rough motions between many pairs of ends at once, as initial guesses and to compare the ends.

A cubic, plus a few smooth bumps whose sizes minimise the cost by Newton's method, for all motions
in one batch; limits on positions and velocities are penalties. From the cubic alone a motion ends
in the minimum next to it, which may cost several times as much as another one, so that some begin
with random bumps.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from hovi.discrete.guess import Curve
from hovi.planning.problem.limits import Limits
from hovi.robot.robot import Robot
from hovi.scene.lagrangian import Lagrangian
from hovi.system.dataclass import dataclass
from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]

BUMPS = 3
"""Number of bumps per joint, sin(pi s) sin(j pi s) with s = t/T."""
SIZE = 1.0
"""Standard deviation of the first bump of a random start, in [rad] or [m]."""
POINTS = 12
"""Number of Gauss points along each motion."""
STEPS = 12
"""Number of Newton steps."""
PENALTY = 1e3
"""Penalty of a limit that is exceeded by its range, relative to the mean density of the cost."""
DAMPING = 1e-2
"""First damping of a step, relative to the mean curvature; DAMPED times that after a failed one."""
DAMPED, FREED = 8.0, 0.25
"""Factors on the damping after a failed and after a successful step."""


@dataclass(frozen=True, eq=False)
class RoughMotions:
    """C motions of a robot: q0 (C, nq), step (C, nv) and v0 (C, nv) of their cubics, and bumps.

    bumps: sizes, shape (C, BUMPS, nv). cost: with the penalties of limits, shape (C,).
    duration: in [s]. order: of the Lagrangian.
    """

    robot: Robot
    q0: Array
    step: Array
    v0: Array
    bumps: Array
    cost: Array
    duration: float
    order: int

    def curve(self, number: int) -> Curve:
        """One of the motions, up to the derivative of the Lagrangian's order."""
        q0, step, v0, c = (x[number] for x in (self.q0, self.step, self.v0, self.bumps))

        def along(t: Array) -> tuple[Array, ...]:
            cubic, bumps = _tables(np.asarray(t) / self.duration, self.duration, self.order)
            x, *rates = cubic @ np.stack([step, v0]) + bumps @ c
            return (self.robot.integrate(np.tile(q0, (len(x), 1)), x), *rates)

        return along


def rough_motions(
    lagrangian: Lagrangian,
    robot: Robot,
    limits: Limits,
    ends: tuple[Array, Array, Array],
    duration: float,
    seed: int | None = None,
) -> RoughMotions:
    """A rough motion for every pair of ends, which is at rest at its goal.

    Of robots whose joints need no charts, and Lagrangians that do not depend on time.
    ends: configurations q0, q1 of shape (C, nq), and velocities v0 at the start, (C, nv).
    duration: in [s]. seed: of the bumps with which it begins; None to begin with the cubics.
    """
    q0, q1, v0 = ends
    first = np.zeros((len(q0), BUMPS, robot.nv))
    if seed is not None:
        first[:, 0] = SIZE * np.random.default_rng(seed).standard_normal(first[:, 0].shape)
    batch = _Batch.of(lagrangian, robot, limits, (q0, robot.difference(q0, q1), v0), duration)
    bumps, cost = batch.minimized(first)
    return RoughMotions(robot, q0, batch.step, v0, bumps, cost, duration, lagrangian.order)


@dataclass(frozen=True, eq=False)
class _Batch:
    """The cost of C motions as a function of their bumps.

    cubic: rows of (step, v0), shape (k + 1, G, 2). table: of the bumps, (k + 1, G, BUMPS).
    weights: of the points, in [s], (G,). bounds: of q and v, in the coordinates of x, two arrays of
        shape (2, C, nv) each. scale: of the penalty, (C,).
    """

    lagrangian: Lagrangian
    robot: Robot
    q0: Array
    step: Array
    v0: Array
    cubic: Array
    table: Array
    weights: Array
    bounds: tuple[Array, Array]
    ranges: Array
    scale: Array

    @classmethod
    def of(
        cls,
        lagrangian: Lagrangian,
        robot: Robot,
        limits: Limits,
        ends: tuple[Array, Array, Array],
        duration: float,
    ) -> _Batch:
        """The batch between ends (q0, step, v0)."""
        q0, step, v0 = ends
        s, weights = np.polynomial.legendre.leggauss(POINTS)
        k = lagrangian.order
        cubic, table = _tables((s + 1) / 2, duration, k)
        near = robot.difference(np.tile(robot.neutral(), (len(q0), 1)), q0)
        sides = [np.stack([limits.lower[row], limits.upper[row]])[:, None] for row in (0, 1)]
        bounds = sides[0] - near, np.broadcast_to(sides[1], (2, len(q0), robot.nv))
        batch = cls(
            lagrangian,
            robot,
            q0,
            step,
            v0,
            cubic,
            table,
            weights * duration / 2,
            bounds,
            limits.ranges[:2],
            np.zeros(len(q0)),
        )
        cost = np.abs(batch.expanded(np.zeros((len(q0), BUMPS, robot.nv)))[0])
        scale = np.where(np.isfinite(cost), PENALTY * cost / duration, 0.0)
        return dataclasses.replace(batch, scale=scale)

    def expanded(self, bumps: Array) -> tuple[Array, Array, Array]:
        """Costs (C,), gradients (C, m) and Hessians (C, m, m) in m = BUMPS nv sizes of bumps."""
        C, G, n = len(bumps), len(self.weights), self.robot.nv
        x = (
            np.einsum("jg,cn->jcgn", self.cubic[:, :, 0], self.step)
            + np.einsum("jg,cn->jcgn", self.cubic[:, :, 1], self.v0)
            + np.einsum("jgb,cbn->jcgn", self.table, bumps)
        )
        q = self.robot.integrate(np.repeat(self.q0, G, axis=0), x[0].reshape(-1, n))
        value, slope, curvature = self.lagrangian.evaluate(
            q, *(each.reshape(-1, n) for each in x[1:])
        )
        rows = self.lagrangian.order + 1
        value = value.reshape(C, G)
        slope, curvature = slope.reshape(C, G, rows, n), curvature.reshape(C, G, rows, n, rows, n)
        value, slope, curvature = self._penalized(x, value, slope, curvature)
        cost = value @ self.weights
        # sums over points and derivatives
        m, along = BUMPS * n, self.table.transpose(1, 0, 2)
        weighted = self.weights[:, None, None] * along
        gradient = np.einsum("gjb,cgjn->cbn", weighted, slope, optimize=True)
        half = np.einsum("gjb,cgjnim->cgbnim", weighted, curvature, optimize=True)
        hessian = np.einsum("cgbnim,gia->cbnam", half, along, optimize=True)
        return cost, gradient.reshape(C, m), hessian.reshape(C, m, m)

    def _penalized(
        self, x: Array, value: Array, slope: Array, curvature: Array
    ) -> tuple[Array, Array, Array]:
        """The same with the penalties of limits on q and v."""
        joints = np.arange(self.robot.nv)
        for row, (lower, upper) in enumerate(self.bounds):
            over = np.maximum(x[row] - upper[:, None], 0.0) - np.maximum(lower[:, None] - x[row], 0)
            range_ = np.where(np.isfinite(self.ranges[row]), self.ranges[row], 1.0)
            stiffness = self.scale[:, None, None] / range_**2
            value = value + 0.5 * (stiffness * over**2).sum(axis=2)
            slope[:, :, row] += stiffness * over
            curvature[:, :, row, joints, row, joints] += stiffness * (over != 0)
        return value, slope, curvature

    def minimized(self, bumps: Array) -> tuple[Array, Array]:
        """The bumps after STEPS Newton steps, damped where the cost did not fall, and the costs."""
        cost, gradient, hessian = self.expanded(bumps)
        damping = np.full(len(bumps), DAMPING)
        for _ in range(STEPS):
            raise_if_late()
            step = _newton_step(gradient, hessian, damping).reshape(bumps.shape)
            there = bumps + step
            after = self.expanded(there)
            better = after[0] < cost
            damping = np.where(better, FREED, DAMPED) * damping
            chosen = better[:, None]
            bumps = np.where(chosen[:, :, None], there, bumps)
            gradient = np.where(chosen, after[1], gradient)
            hessian = np.where(chosen[:, :, None], after[2], hessian)
            cost = np.where(better, after[0], cost)
        return bumps, cost


def _newton_step(gradient: Array, hessian: Array, damping: Array) -> Array:
    """-(abs(H) + d mean(abs(H)) I)^-1 g, with the absolute values of the eigenvalues, (C, m)."""
    finite = np.asarray(np.isfinite(hessian).all(axis=(1, 2)) & np.isfinite(gradient).all(axis=1))
    H = np.where(finite[:, None, None], hessian, np.eye(hessian.shape[1]))
    g = np.where(finite[:, None], gradient, 0.0)
    values, vectors = np.linalg.eigh((H + H.transpose(0, 2, 1)) / 2)
    sizes = np.abs(values)
    sizes += (damping * sizes.mean(axis=1))[:, None] + np.finfo(float).tiny
    along = np.einsum("ckj,ck->cj", vectors, g) / sizes
    return np.asarray(-np.einsum("cij,cj->ci", vectors, along))


def _tables(s: Array, duration: float, order: int) -> tuple[Array, Array]:
    """Derivatives up to an order of the cubic in (step, v0), and of the bumps, at s = t/T.

    Shapes (order + 1, G, 2) and (order + 1, G, BUMPS).
    """
    powers = [np.array([0.0, 0.0, 3.0, -2.0]), duration * np.array([0.0, 1.0, -2.0, 1.0])]
    cubic, bumps = np.empty((order + 1, len(s), 2)), np.empty((order + 1, len(s), BUMPS))
    j = np.arange(1, BUMPS + 1)
    for row in range(order + 1):
        for column, coefficients in enumerate(powers):
            cubic[row, :, column] = np.polynomial.polynomial.polyval(
                s, np.polynomial.polynomial.polyder(coefficients, row)
            )
        # sin(pi s) sin(j pi s) = (cos((j - 1) pi s) - cos((j + 1) pi s)) / 2
        low, high = (j - 1) * np.pi, (j + 1) * np.pi
        turn = row * np.pi / 2
        waves = [w**row * np.cos(np.outer(s, w) + turn) for w in (low, high)]
        bumps[row] = (waves[0] - waves[1]) / 2
        cubic[row] /= duration**row
        bumps[row] /= duration**row
    return cubic, bumps
