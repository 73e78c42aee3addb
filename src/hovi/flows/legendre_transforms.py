"""Legendre transforms: the continuous FL, and F+ and F- of a discrete Lagrangian.

[ColomboFerraroMartin2016, sections 3 and 4; F+ and F- as in its theorems, interchanged with respect
to its first display]

Points of T^(k-1)Q and momenta have shape (B, k, n) or (k, n); on groups points are rows, of shape
(B, 1, nq + (k - 1) nv) or (1, nq + (k - 1) nv).
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.checks.shapes import require_shape
from hovi.errors import InputError, some_of
from hovi.flows.interval import IntervalLagrangian
from hovi.optimize.batched_newton import newton
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]

SINGULAR = 1e-13
"""Singular value of an equilibrated matrix, relative to the largest, that counts as zero."""
INVOLVED = 0.1
"""Norm of a coordinate's part of the kernel's unit vectors above which it is named."""


@check_arguments
def legendre_minus(ld: IntervalLagrangian, x0: Array, x1: Array) -> tuple[Array, Array]:
    """F^- L_d: (x0, x1) -> (x0, p0) with p0 = (-D_1 L_d, ..., -D_k L_d)."""
    interval = ld.joining(batch(x0), batch(x1))
    return x0, unbatched(x0, interval.p0)


@check_arguments
def legendre_plus(ld: IntervalLagrangian, x0: Array, x1: Array) -> tuple[Array, Array]:
    """F^+ L_d: (x0, x1) -> (x1, p1) with p1 = (D_{k+1} L_d, ..., D_2k L_d)."""
    interval = ld.joining(batch(x0), batch(x1))
    return x1, unbatched(x1, interval.p1)


@check_arguments
def inverse_legendre_minus(ld: IntervalLagrangian, x0: Array, p0: Array) -> tuple[Array, Array]:
    """(F^- L_d)^-1: (x0, p0) -> (x0, x1), near the diagonal."""
    return x0, unbatched(x0, ld.from_start(batch(x0), batch(p0)).x1)


@check_arguments
def inverse_legendre_plus(ld: IntervalLagrangian, x1: Array, p1: Array) -> tuple[Array, Array]:
    """(F^+ L_d)^-1: (x1, p1) -> (x0, x1), near the diagonal."""
    return unbatched(x1, ld.from_end(batch(x1), batch(p1)).x0), x1


@check_arguments
def legendre(lagrangian: Lagrangian, *jet: npt.ArrayLike) -> tuple[Array, Array]:
    """FL: T^(2k-1)Q -> T*T^(k-1)Q, (q, q', ..., q^(2k-1)) -> (x, p), both (B, k, n) or (k, n).

    p_{k-1} = dL/dq^(k) and p_{j-1} = dL/dq^(j) - d/dt p_j; for k = 2 it is
    (q, v, dL/dv - d/dt dL/da, dL/da). [ColomboFerraroMartin2016, section 4; deLeonRodrigues1985]

    lagrangian: independent of time; a CasadiLagrangian for order 3 or more.
    jet: 2 k arrays of shape (B, n) or (n,). On groups x has shape (B, 1, nq + (k - 1) nv).
    """
    arrays = [np.asarray(x, dtype=np.float64) for x in jet]
    k, nq, n = lagrangian.order, lagrangian.nq, lagrangian.nv
    if len(arrays) != 2 * k:
        raise InputError(
            f"FL of a Lagrangian of order {k} needs {2 * k} arrays (q, q', ...), got {len(arrays)}."
        )
    one = arrays[0].ndim == 1
    lead = () if one else (None if not arrays[0].ndim else len(arrays[0]),)
    for j, array in enumerate(arrays):
        require_shape(f"array {j} of the jet", array, *lead, n if j else nq)
    points = [np.atleast_2d(x) for x in arrays]
    p = _momenta(lagrangian, points) if k <= 2 else _symbolic_momenta(lagrangian, points)
    if lagrangian.space is None:
        x = np.stack(points[:k], axis=1)
    else:
        x = np.concatenate(points[:k], axis=1)[:, None]
    return (x[0], p[0]) if one else (x, p)


def highest_derivative(lagrangian: Lagrangian, x: Array | Sequence[Array], p: Array) -> Array:
    """q^(k) of p_{k-1} = dL/dq^(k)(x, q^(k)), shape (B, n) for x and p of shape (B, k, n).

    x: alternatively (q, q', ..., q^(k-1)), k arrays with B rows, as on groups.
    """
    jet = list(np.moveaxis(x, 1, 0)) if isinstance(x, np.ndarray) else list(x)

    u, found = _highest_derivative(lagrangian, jet, p, None)
    if not found.all():
        raise InputError("the Lagrangian is not regular there: dL/dq^(k) = p has no solution.")
    return u


def jet_at_momenta(
    lagrangian: Lagrangian, x: Sequence[Array], p: Array, t: float = 0.0
) -> tuple[Array, Array]:
    """q^(k) and q^(k+1) of the solution through (x, p), (B, n) each; zero where none is found.

    q^(k+1) follows from p_{k-1}' = dL/dq^(k-1) - p_{k-2}, for k = 1 from p' = dL/dq. What a
    Lagrangian's own time and the brackets of groups add is left out: this is a guess there.
    x: (q, q', ..., q^(k-1)), k arrays of B rows. p: shape (B, k, n). t: in [s].
    """
    k, times = lagrangian.order, np.full(len(p), t)
    top, found = _highest_derivative(lagrangian, x, p, times)
    top = np.where(found[:, None] & np.isfinite(top), top, 0.0)
    _, gradient, hessian = lagrangian.evaluate(*x, top, t=times)
    rates = np.stack([*x[1:], top], axis=1)  # q', ..., q^(k)
    known = np.einsum("bisj,bsj->bi", hessian[:, -1, :, :-1], rates)
    force = gradient[:, -2] - known - (p[:, -2] if k > 1 else 0.0)
    try:
        rate = np.linalg.solve(hessian[:, -1, :, -1], force[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:
        rate = np.zeros_like(top)
    return top, np.where(np.isfinite(rate), rate, 0.0)


def require_regular_lagrangian(
    lagrangian: Lagrangian, x: Sequence[Array], p: Array, t: float = 0.0
) -> None:
    """Raise InputError where W = d2L/dq^(k)2 is singular to working precision at a start (x, p).

    Momenta do not determine q^(k) there, and no flow begins. x: (q, q', ..., q^(k-1)), k arrays of
    one row. p: shape (1, k, n). t: in [s].
    """
    u, found = _highest_derivative(lagrangian, x, p, np.array([t]))
    u = np.where(found[:, None], u, 0.0)
    W = lagrangian.evaluate(*x, u, t=np.array([t]))[2][0, -1, :, -1]
    if not np.isfinite(W).all():
        raise InputError("the second derivatives of the Lagrangian are not finite at the start.")
    kernel = kernel_coordinates(W, lagrangian.nv)
    if len(kernel):
        raise InputError(_singular_start(lagrangian, kernel))


def kernel_coordinates(matrix: Array, n: int, terms: Array | None = None) -> Indices:
    """Which of n coordinates are involved in the kernel of a matrix; none if it is regular.

    matrix: shape (m n, m n), m unknowns for each coordinate. terms: sizes of what its entries are
        sums of, the same shape; the entries themselves when None. Units differ from coordinate to
        coordinate, so that rows and columns are scaled to one size first.
    """
    size = np.abs(matrix) if terms is None else terms
    _, values, vectors = np.linalg.svd(matrix * _equilibration(size))
    kernel = vectors[values <= SINGULAR * max(values[0], 1.0)]
    parts = np.linalg.norm(kernel.reshape(-1, n), axis=0)
    return np.flatnonzero(parts > INVOLVED)


def coordinates_in_words(lagrangian: Lagrangian, coordinates: Indices) -> str:
    """Names of the joints of a scene's robot, or indices, for a message; at most six of them."""
    scene = getattr(lagrangian, "scene", None)
    if isinstance(scene, Scene):
        shown = [repr(scene.robot.coordinate_names[i]) for i in coordinates]
    else:
        shown = [f"q[{i}]" for i in coordinates]
    return some_of(shown, 6)


@check_arguments
def hamiltonian(lagrangian: Lagrangian, x: Array | Sequence[Array], p: Array) -> Array:
    """H = sum_j p_j . q^(j+1) - L on T*T^(k-1)Q, shape (B,); x and p of shape (B, k, n).

    H = E_L o FL^-1: mechanical energy for k = 1, Pontryagin's p.v + p~.a - L for k = 2.
    x: as for `highest_derivative`.
    Raises InputError for other shapes.
    """
    k, n = lagrangian.order, lagrangian.nv
    require_shape("p", p, None, k, n)
    if isinstance(x, np.ndarray):
        require_shape("x", x, len(p), k, None)
    jet = list(np.moveaxis(x, 1, 0)) if isinstance(x, np.ndarray) else list(x)
    if len(jet) != k:
        raise InputError(f"x must be {k} arrays with one row per point, got {len(jet)}.")
    for j, array in enumerate(jet):
        require_shape(f"x[{j}]", array, len(p), n if j else lagrangian.nq)
    jet.append(highest_derivative(lagrangian, jet, p))
    rates = np.stack(jet[1:], axis=1)
    return np.asarray(np.sum(p * rates, axis=(1, 2)) - lagrangian.value(*jet))


def unbatched(x: Array, values: Array) -> Array:
    """A batch, or its only row if x is no batch."""
    return values if np.ndim(x) == 3 else values[0]


def batch(x: npt.ArrayLike) -> Array:
    """(k, n) or (B, k, n) as (B, k, n)."""
    array = np.asarray(x, dtype=np.float64)
    if array.ndim not in (2, 3):
        raise InputError(f"points and momenta have shape (k, n) or (B, k, n), got {array.shape}.")
    return array if array.ndim == 3 else array[None]


def _highest_derivative(
    lagrangian: Lagrangian, jet: Sequence[Array], p: Array, t: Array | None
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """q^(k) of dL/dq^(k) = p_{k-1}, shape (B, n), and where it was found, (B,)."""

    def system(u: Array) -> tuple[Array, Array]:
        _, gradient, hessian = lagrangian.evaluate(*jet, u, t=t)
        return gradient[:, -1] - p[:, -1], hessian[:, -1, :, -1]

    return newton(system, np.zeros_like(p[:, -1]))


def _equilibration(size: Array) -> Array:
    """Factors of entries, by row and column, that bring the largest of each near one. [Ruiz2001]"""
    factors = np.ones_like(size)
    for _ in range(5):
        for axis in (0, 1):
            largest = (size * factors).max(axis=axis, keepdims=True)
            factors = factors / np.sqrt(np.where(largest > 0, largest, 1.0))
    return factors


def _singular_start(lagrangian: Lagrangian, kernel: Indices) -> str:
    scene = getattr(lagrangian, "scene", None)
    advice = (
        "add a cost that resists it, a small multiple of its square for instance, or fix what "
        "does not matter, such as a parametrization"
    )
    if isinstance(scene, Scene):
        advice = "give the joints inertia, by the effect 'armature' for instance"
        if scene.passive:
            advice = (
                f"the torque of passive joints ({', '.join(map(repr, scene.passive))}) costs "
                "nothing, so plan between two states with hovi.plan, or let them carry torque"
            )
    return (
        "the Lagrangian is singular in its highest derivative at the start: momenta do not "
        f"determine q^({lagrangian.order}) of {coordinates_in_words(lagrangian, kernel)}; {advice}."
    )


def _momenta(lagrangian: Lagrangian, jet: list[Array]) -> Array:
    """p of FL for k = 1 and 2, from first and second derivatives of L."""
    k = lagrangian.order
    _, gradient, hessian = lagrangian.evaluate(*jet[: k + 1])
    if k == 1:
        return gradient[:, 1:]
    rates = np.stack(jet[1:], axis=1)  # (B, 3, n): v, a, jerk
    along = np.einsum("bisj,bsj->bi", hessian[:, 2], rates)
    return np.stack([gradient[:, 1] - along, gradient[:, 2]], axis=1)


def _symbolic_momenta(lagrangian: Lagrangian, jet: list[Array]) -> Array:
    """p of FL for any k, differentiated along the curve by CasADi."""
    if not isinstance(lagrangian, CasadiLagrangian):
        raise InputError("FL of order 3 or more needs a CasadiLagrangian.")
    k, n = lagrangian.order, lagrangian.nv
    symbols = [*lagrangian.jet, *(ca.SX.sym(f"q{k + 1 + j}", n) for j in range(k - 1))]
    momenta = [ca.gradient(lagrangian.expression, symbols[k])]
    for j in range(k - 1, 0, -1):
        slope = ca.gradient(lagrangian.expression, symbols[j])
        momenta.insert(0, slope - total_derivative(momenta[0], symbols))
    columns = [x.T for x in jet]
    values = ca.Function("FL", symbols, momenta).map(columns[0].shape[1])(*columns)
    return np.stack([np.array(value).T for value in values], axis=1)


def total_derivative(expression: ca.SX, jet: list[ca.SX]) -> ca.SX:
    """d/dt of an expression along a curve with the jet (q, q', ...)."""
    return ca.jtimes(expression, ca.vertcat(*jet[:-1]), ca.vertcat(*jet[1:]))
