"""Durations in which a robot swings so often that no grid resolves a motion of least effort.

Where gravity or springs pull a robot back to a state of little effort, a motion that has much more
time than it needs swings there at the natural frequencies. About that state the cost is quadratic,
with the Hessians H_ij in the i-th and the j-th derivative of q, and a swing exp(lambda t) solves

    sum_ij (-1)^i lambda^(i + j) H_ij q = 0.

It lasts as long as |Re lambda| lets it, which friction and costs on the motion enlarge.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.planning.problem.problem import TrajectoryProblem

Array = npt.NDArray[np.float64]

MOST_SWINGS = 130.0
"""Number of swings above which no solve is started; a pendulum with as many is resolved."""
DECAY = 7.0
"""A swing has decayed once |Re lambda| t is as large."""
LONG = 50.0
"""Duration from which swings are counted, in [s]."""
AT_REST = 1e-3
"""The robot may rest at ends whose static cost exceeds the least by at most this fraction."""
MAX_STEPS = 200
"""Maximum number of steps to the state of least static cost."""


def too_many_swings(problem: TrajectoryProblem) -> str:
    """The duration against the period of a swing, as a clause; "" if a grid may resolve it."""
    T = problem.grid.duration
    supported = problem.about_robot and problem.robot.space.flat and not problem.ld.lagrangian.timed
    if T < LONG or not supported or problem.ld.segments is not None or problem.via:
        return ""
    at_rest = _Static(problem)
    first, last = problem.ends[0]
    states = [at_rest.least(q) for q in (first, last, first / 2 + last / 2)]
    least = min(at_rest.cost(q)[0] for q in states)
    ends = max(at_rest.cost(first)[0], at_rest.cost(last)[0])
    if ends <= least + AT_REST * max(abs(least), abs(ends)):
        return ""
    swings = np.concatenate([at_rest.swings(q) for q in states])
    lasting = np.minimum(T, DECAY / np.maximum(np.abs(swings.real), 1e-300))
    number = np.abs(swings.imag) * lasting / (2 * np.pi)
    if number.max(initial=0.0) <= MOST_SWINGS:
        return ""
    k = int(np.argmax(number))
    period = 2 * np.pi / abs(swings[k].imag)
    return (
        f"the duration of {T:g} s is {T / period:.2g} times the period of {period:.2g} s in which "
        "the robot swings about its state of least effort, and a motion of least cost swings all "
        "that time"
    )


class _Static:
    """The static cost of a problem: that of its robot at rest."""

    def __init__(self, problem: TrajectoryProblem) -> None:
        self.lagrangian, self.nv = problem.ld.lagrangian, problem.robot.nv
        self.none = [np.zeros((1, self.nv)) for _ in range(problem.ld.k)]
        self.lower, self.upper = np.full(self.nv, -np.inf), np.full(self.nv, np.inf)
        if problem.limits is not None:
            self.lower, self.upper = problem.limits.lower[0], problem.limits.upper[0]

    def cost(self, q: Array) -> tuple[float, Array]:
        """L~(q, 0, 0) and its gradient, shape (nv,)."""
        value, gradient = self.lagrangian.evaluate(q[None], *self.none)[:2]
        return float(value[0]), np.asarray(gradient)[0, 0]

    def least(self, q: Array) -> Array:
        """A configuration of least static cost within the limits, (nq,). q: where to begin."""
        from scipy.optimize import minimize

        bounds, options = list(zip(self.lower, self.upper, strict=True)), {"maxiter": MAX_STEPS}
        begin = np.clip(q, self.lower, self.upper)
        found = minimize(
            self.cost, begin, jac=True, method="L-BFGS-B", bounds=bounds, options=options
        )
        return np.asarray(found.x)

    def swings(self, q: Array) -> npt.NDArray[np.complex128]:
        """All lambda at a configuration, of the joints that are not at a limit."""
        from scipy.linalg import LinAlgError, eigvals

        hessian = np.asarray(self.lagrangian.evaluate(q[None], *self.none)[2])[0]
        free = np.flatnonzero((q > self.lower) & (q < self.upper))
        n, k = len(free), len(self.none)
        powers = np.zeros((2 * k + 1, n, n))
        for i in range(k + 1):
            for j in range(k + 1):
                powers[i + j] += (-1.0) ** i * hessian[i][free][:, j][:, free]
        A, B = np.eye(2 * k * n, k=n), np.eye(2 * k * n)  # A x = lambda B x
        A[-n:] = -np.concatenate(powers[:-1], axis=1)
        B[-n:, -n:] = powers[-1]
        try:
            found = eigvals(A, B) if n > 0 else np.zeros(0)
        except LinAlgError:
            found = np.zeros(0)
        return np.asarray(found[np.isfinite(found)])
