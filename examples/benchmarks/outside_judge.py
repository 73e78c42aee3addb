"""Shared by benchmarks: is a motion what is said of it? Judged by Pinocchio and samples alone.

Nothing of hovi is imported here: a motion is what its `sample` returns, torques are those of
pin.rnea, the cost is an integral along the curve, and limits are looked at at many times. So a
fault in hovi's own checks cannot hide itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

Array = npt.NDArray[np.float64]

MAX_DIFFERENCE = 1e-2
"""Largest relative difference of a cost and the integral along the curve."""
MAX_EXCESS = 2e-6
"""Largest accepted excess over a limit, as a fraction of its range: twice hovi's own tolerance."""
MAX_MISS = 2e-6
"""Largest accepted distance from a state that is asked for, in [rad] and, per second, in [rad]."""
MAX_PASSIVE = 2e-2
"""Largest accepted torque of passive joints along the curve, as a fraction of all torques."""
MAX_LED_BACK = 0.02
"""Fraction of a limit's range from which a start may be led back."""
GAUSS_POINTS, SAMPLES = 48, 20_001
"""Points per interval of the integral, and times at which limits are checked."""
ROWS = "q", "v", "a", "tau"
"""Kinds of limits, in the order of their rows."""


@dataclass(frozen=True)
class LedBack:
    """A limit that a start exceeds. row: of ROWS. excess: in its unit. until: in [s]."""

    row: int
    joint: int
    excess: float
    until: float


@dataclass(frozen=True)
class Asked:
    """What a motion is asked for.

    parts: models for pin.rnea, each until a time in [s], with what the robot carries until then.
    stops: times in [s] with q and v there; None for what is free.
    lower, upper: limits of q, v, a and tau, shape (4, nv); infinite without one.
    passive: joints that bear no torque. weight: of each torque in the cost, shape (nv,).
    price: of a second, which the cost contains. led_back: what the start exceeds of its limits.
    """

    parts: Sequence[tuple[float, pin.Model]]
    stops: Sequence[tuple[float, Array | None, Array | None]]
    lower: Array
    upper: Array
    passive: Sequence[int] = ()
    weight: Array | None = None
    price: float = 0.0
    led_back: Sequence[LedBack] = field(default=())


def oracle_model(model: pin.Model, gravity: float = 9.81) -> pin.Model:
    """A copy of a model with gravity along -z, in [m/s^2], and without rotors, for pin.rnea."""
    copy = model.copy()
    copy.gravity.linear = np.array([0.0, 0.0, -gravity])
    copy.armature = np.zeros(copy.nv)
    return copy


def carrying(model: pin.Model, frame: str, mass: float) -> pin.Model:
    """A copy of a model with a point mass in [kg] at the origin of a frame."""
    copy = model.copy()
    at = copy.frames[copy.getFrameId(frame)]
    body = pin.Inertia(mass, np.zeros(3), np.zeros((3, 3)))
    copy.appendBodyToJoint(at.parentJoint, body, at.placement)
    return copy


def torques(model: pin.Model, samples: Any) -> Array:
    """Torques of pin.rnea at samples of q, v and a, shape (M, nv), in [N m]."""
    data = model.createData()
    rows = zip(samples.q, samples.v, samples.a, strict=True)
    return np.array([pin.rnea(model, data, *row) for row in rows])


def torques_at(parts: Sequence[tuple[float, pin.Model]], t: Array, samples: Any) -> Array:
    """Torques at samples, each by the model of its part; of the later one where two meet."""
    ends = np.array([until for until, _ in parts])
    part = np.minimum(np.searchsorted(ends, t, side="right"), len(parts) - 1)
    tau = np.empty_like(samples.v)
    for number, (_, model) in enumerate(parts):
        own = part == number
        tau[own] = torques(model, _Rows(samples.q[own], samples.v[own], samples.a[own]))
    return tau


@dataclass(frozen=True)
class _Rows:
    q: Array
    v: Array
    a: Array


def gauss_points(t: Array) -> tuple[Array, Array]:
    """Times of the Gauss points of all intervals between nodes t, and their weights, in [s]."""
    x, w = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    h = np.diff(t)[:, None]
    return (t[:-1, None] + h * (x + 1) / 2).ravel(), (h * w / 2).ravel()


def integral(model: pin.Model, motion: Any) -> float:
    """1/2 integral |tau|^2 along the curve of a motion."""
    t, w = gauss_points(np.asarray(motion.t))
    return float(np.sum(w * 0.5 * np.sum(torques(model, motion.sample(t)) ** 2, axis=1)))


def excess(y: Array, lower: Array, upper: Array) -> float:
    """Largest excess of samples (M, nv) over bounds, as a fraction of a limit's range.

    lower, upper: shape (nv,), or (M, nv) with ranges of the first row. Joints without limits are
    left out.
    """
    low, high = np.atleast_2d(lower), np.atleast_2d(upper)
    ranges = high[0] - low[0]
    limited = np.isfinite(ranges) & (ranges > 0) & (ranges < 1e6)
    outside = np.maximum(y - high, low - y)[:, limited] / ranges[limited]
    return float(outside.max(initial=-np.inf))


def denial(motion: Any, cost: float | None, asked: Asked, samples: int = SAMPLES) -> str:
    """Why the success of a motion is denied, in a few words; "" if nothing speaks against it.

    cost: as the solution says; None where it is no integral of torques.
    """
    checks: tuple[Callable[[], str], ...] = (
        lambda: missed(motion, asked),
        lambda: unlike_its_cost(motion, cost, asked),
        lambda: beyond_limits(motion, asked, samples),
    )
    try:
        return next(filter(None, (check() for check in checks)), "")
    except (ValueError, ArithmeticError) as error:
        return f"no samples: {error}"


def missed(motion: Any, asked: Asked) -> str:
    """Which state that is asked for a motion misses."""
    for t, q, v in asked.stops:
        found = motion.sample(np.array([min(t, motion.duration)]))
        model = asked.parts[-1][1]
        if q is not None:
            miss = float(np.abs(pin.difference(model, np.asarray(q), found.q[0])).max())
            if not miss <= MAX_MISS:
                return f"misses q at {t:.3g} s by {miss:.1e}"
        if v is not None:
            miss = float(np.abs(found.v[0] - v).max()) * min(motion.duration, 1.0)
            if not miss <= MAX_MISS:
                return f"misses v at {t:.3g} s by {miss:.1e}"
    return ""


def unlike_its_cost(motion: Any, cost: float | None, asked: Asked) -> str:
    """Which torque passive joints bear, or how the cost differs from the integral on the curve."""
    t, w = gauss_points(np.asarray(motion.t))
    squares = torques_at(asked.parts, t, motion.sample(t)) ** 2
    passive = np.zeros(squares.shape[1], dtype=bool)
    passive[list(asked.passive)] = True
    weight = np.ones(len(passive)) if asked.weight is None else np.asarray(asked.weight)
    effort = float(0.5 * w @ (squares @ np.where(passive, 0.0, weight)))
    borne = float(np.sqrt((w @ squares[:, passive]).sum() / max((w @ squares).sum(), 1e-300)))
    if not borne <= MAX_PASSIVE:
        return f"passive torque {borne:.1e}"
    if cost is None:
        return ""
    said = cost - asked.price * float(motion.duration)
    difference = (effort - said) / max(abs(said), 1e-12)
    return "" if abs(difference) <= MAX_DIFFERENCE else f"integral {difference:+.1e}"


def beyond_limits(motion: Any, asked: Asked, samples: int = SAMPLES) -> str:
    """Which limit is exceeded, at many times."""
    if not (np.isfinite(asked.lower).any() or np.isfinite(asked.upper).any()):
        return ""
    t = np.linspace(0.0, motion.duration, samples)
    x = motion.sample(t)
    values = {"v": x.v, "a": x.a, "tau": torques_at(asked.parts, t, x)}
    if x.q.shape[1] == x.v.shape[1]:
        values["q"] = x.q
    for row, kind in enumerate(ROWS):
        if kind not in values:
            continue
        low, high, refused = _led_back(asked, row, t)
        if refused:
            return refused
        beyond = excess(values[kind], low, high)
        if beyond > MAX_EXCESS:
            return f"{kind} beyond its limits by {beyond:.1e}"
    return ""


def _led_back(asked: Asked, row: int, t: Array) -> tuple[Array, Array, str]:
    """Bounds of a kind at times, wider where a start is led back, and what is wrong with that."""
    lower, upper = asked.lower[row], asked.upper[row]
    own = [each for each in asked.led_back if each.row == row]
    if not own:
        return lower, upper, ""
    low, high = np.tile(lower, (len(t), 1)), np.tile(upper, (len(t), 1))
    for each in own:
        fraction = each.excess / (upper[each.joint] - lower[each.joint])
        if not fraction <= MAX_LED_BACK:
            return low, high, f"led back from {fraction:.1e} beyond {ROWS[row]}"
        begins = t < each.until
        low[begins, each.joint] -= each.excess
        high[begins, each.joint] += each.excess
    low[-1], high[-1] = lower, upper
    return low, high, ""
