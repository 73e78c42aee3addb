"""Initial guesses for the modes of a step from momenta, and a search where the first one fails.

The modes (w, c) of an interval are those of q^(k), a polynomial, in its units: shape (k + r, n).
They come from the exact jet at the start, from the previous step, or from shorter steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError
from hovi.flows.regularized import regularized
from hovi.schemes import end_basis
from hovi.schemes.polynomials import legendre
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

PARTS = (2, 4, 8, 16)
"""Numbers of shorter steps that are tried in place of one."""
PERTURBED = 6
"""Number of random variants of the curve of each of them that are tried as guesses."""
NEAR = 0.5
"""Mismatch with shorter steps below which a solution is accepted without a further search."""
DOUBTFUL = 1.0
"""Mismatch of a solution and its guess above which it is compared with shorter steps."""
FAR = 10.0
"""Mismatch with shorter steps above which a solution is refused."""
HARMLESS = 1e-2
"""Distance of ends that counts as small, in [rad] or [m]; for derivatives, that divided by h^j."""
CONTINUED = 6
"""Number of modes of the previous step that are continued: higher ones would be magnified."""


@dataclass(frozen=True, eq=False)
class Trial:
    """The result of Newton's method for one step.

    modes: shape (k + r, n). residual: its last step relative to the modes. end: x1 and p1, for a
        batch of one; None where no solution was found.
    """

    modes: Array
    residual: float
    end: tuple[Array, Array] | None


Attempt = Callable[[float, Array, Array, float, Array | None], Trial]
"""A step of length h from x and p (batches of one) at t, from a guess or from the exact jet."""


def taylor_modes(k: int, count: int, h: float, top: Array, rate: Array, at: float = 0.0) -> Array:
    """Modes of q^(k)(s) = top + (s - at) h rate, shape (B, count, n).

    top, rate: q^(k) and q^(k+1) at s = `at`, shape (B, n).
    """
    s, project = _projection(k, count)
    values = top[:, None] + h * (s - at)[:, None] * rate[:, None]
    return np.asarray(project @ values)


def continued_modes(k: int, modes: Array) -> Array:
    """Modes of the same polynomial in the next interval, shape (B, count, n)."""
    count = modes.shape[1]
    kept = np.arange(count)[:, None] < CONTINUED
    return np.asarray(_restriction(k, count, 1.0, 1.0) @ (modes * kept))


def joined_modes(k: int, pieces: list[Array]) -> Array:
    """Modes of the curve nearest to the curves of equal intervals, each of shape (count, n)."""
    parts, count = len(pieces), len(pieces[0])
    joined = np.zeros_like(pieces[0])
    for i, modes in enumerate(pieces):
        joined += _restriction(k, count, i / parts, 1 / parts).T @ modes / parts
    return joined


@np.errstate(over="ignore", invalid="ignore")
def hard_step(attempt: Attempt, h: float, x: Array, p: Array, t: float, first: Trial) -> Trial:
    """A step whose first trial found nothing, or a solution far from its guess.

    The equations of a long step may have several solutions. Shorter steps show which one follows
    the motion: a solution is taken that ends near where they end, or else the nearest one found
    from their curves and perturbed ones; farther than `FAR` it does not approximate the motion.
    x, p: batches of one, p of shape (1, k, n). Raises InputError with what was found instead.
    """
    k = p.shape[1]
    trials = [first, attempt(h, x, p, t, None)]
    shorter: dict[int, Array] = {}
    for parts in PARTS:
        pieces = _shorter_steps(attempt, h / parts, parts, x, p, t)
        if pieces is not None:
            shorter[parts] = joined_modes(k, pieces)
            trials.append(attempt(h, x, p, t, shorter[parts]))
            if (nearest := _nearest(h, k, trials, shorter[parts]))[0] < NEAR:
                return nearest[1]
    distance, best = np.inf, first
    for guess in _perturbed(list(shorter.values())):
        trials.append(attempt(h, x, p, t, guess))
        distance, best = _nearest(h, k, trials, shorter[max(shorter)])
        if distance < NEAR:
            break
    if distance < FAR:
        return best
    residual = min(trial.residual for trial in trials)
    raise InputError(_no_solution(h, residual, distance, _sufficient(h, k, shorter)))


def mismatch(h: float, k: int, modes: Array, reference: Array) -> Array:
    """Distance of the ends of curves, relative to that which q^(k) moves the reference, shape (B,).

    The largest over q, q', ..., q^(k-1). modes, reference: shape (B, count, n).
    """
    moments = regularized(k, h).moments
    carried = np.abs(moments @ reference[:, :k]).max(axis=2)
    missed = np.abs(moments @ (modes - reference)[:, :k]).max(axis=2)
    small = HARMLESS / h ** np.arange(k)
    return np.asarray(np.max(missed / (carried + small), axis=1))


def _perturbed(shorter: list[Array]) -> Iterator[Array]:
    """Random variants of the curves of shorter steps, the same in every run."""
    random = np.random.default_rng(0)
    for _ in range(PERTURBED):
        for modes in shorter[::-1]:
            yield modes * (1 + random.normal(scale=0.5, size=modes.shape))


def _nearest(h: float, k: int, trials: list[Trial], reference: Array) -> tuple[float, Trial]:
    """The smallest mismatch of the solutions found, and its trial; infinite if none was found."""
    distance, best = np.inf, trials[0]
    for trial in trials:
        if trial.end is not None:
            missed = float(mismatch(h, k, trial.modes[None], reference[None])[0])
            if missed < distance:
                distance, best = missed, trial
    return distance, best


def _shorter_steps(
    attempt: Attempt, h: float, parts: int, x: Array, p: Array, t: float
) -> list[Array] | None:
    """Modes of consecutive steps of length h; None where one has no solution."""
    pieces = []
    for i in range(parts):
        trial = attempt(h, x, p, t + i * h, None)
        if trial.end is None:
            return None
        pieces.append(trial.modes)
        x, p = trial.end
    return pieces


def _sufficient(h: float, k: int, shorter: dict[int, Array]) -> int:
    """The smallest number of steps that end where the shortest ones do; 0 if there is none."""
    for parts, modes in shorter.items():
        if mismatch(h, k, modes[None], shorter[max(shorter)][None])[0] < NEAR:
            return parts
    return 0


def _no_solution(h: float, residual: float, nearest: float, possible: int) -> str:
    reason = "the matrix of Newton's method is singular"
    if np.isfinite(nearest):
        reason = (
            f"the nearest one misses the end of shorter steps by {nearest:.2g} times the distance "
            "that they cover"
        )
    elif np.isfinite(residual):
        reason = f"Newton's method stops at a relative residual of {residual:.1g}"
    advice = f"nor have {PARTS[-1]} steps of {h / PARTS[-1]:g} s; use a much shorter step"
    if possible:
        advice = f"but {possible} steps of {h / possible:g} s have one; use a shorter step"
    return (
        f"the discrete equations of a step of h = {h:g} s have no solution near the initial guess "
        f"({reason}), {advice} or smaller momenta."
    )


def _basis(s: Array, k: int, count: int) -> Array:
    """The polynomials whose coefficients the modes are, at s, shape (count, M)."""
    P = legendre(2 * s - 1, max(count - 1, 1))
    inner = [np.sqrt(2 * m + 1) * P[m] for m in range(k, count)]
    return np.concatenate([end_basis(s, k), np.reshape(inner, (-1, len(s)))])


@lru_cache(maxsize=64)
def _projection(k: int, count: int) -> tuple[Array, Array]:
    """Gauss points s (M,) in [0, 1] and the matrix of modes from values at them, (count, M)."""
    x, weights = np.polynomial.legendre.leggauss(max(count, 2))
    s = (x + 1) / 2
    return s, _basis(s, k, count) * weights / 2


@lru_cache(maxsize=256)
def _restriction(k: int, count: int, start: float, length: float) -> Array:
    """The matrix from the modes of f(s) to those of f(start + length s), (count, count)."""
    s, project = _projection(k, count)
    return np.asarray(project @ _basis(start + length * s, k, count).T)
