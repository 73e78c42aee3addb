"""Evaluates CasADi graphs and Galerkin actions in the extended precision of mpmath."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import mpmath as mp
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_UNARY: dict[int, Callable[[Any], Any]] = {
    ca.OP_ASSIGN: lambda x: x,
    ca.OP_NEG: lambda x: -x,
    ca.OP_SQ: lambda x: x * x,
    ca.OP_TWICE: lambda x: 2 * x,
    ca.OP_INV: lambda x: 1 / x,
    ca.OP_SIN: mp.sin,
    ca.OP_COS: mp.cos,
    ca.OP_SQRT: mp.sqrt,
}
_BINARY: dict[int, Callable[[Any, Any], Any]] = {
    ca.OP_ADD: lambda x, y: x + y,
    ca.OP_SUB: lambda x, y: x - y,
    ca.OP_MUL: lambda x, y: x * y,
    ca.OP_DIV: lambda x, y: x / y,
}


def graph(function: ca.Function) -> Callable[..., list[Any]]:
    """An SX function with one dense output column as a function of lists of mpmath numbers."""
    program = [
        (
            function.instruction_id(i),
            list(function.instruction_input(i)),
            list(function.instruction_output(i)),
        )
        for i in range(function.n_instructions())
    ]
    constants = {
        i: function.instruction_constant(i)
        for i, (op, _, _) in enumerate(program)
        if op == ca.OP_CONST
    }
    size = function.size1_out(0)

    def run(*arguments: list[Any]) -> list[Any]:
        work: dict[int, Any] = {}
        result: list[Any] = [mp.mpf(0)] * size
        for i, (op, inputs, outputs) in enumerate(program):
            if op == ca.OP_OUTPUT:
                result[outputs[1]] = work[inputs[0]]
            elif op == ca.OP_CONST:
                work[outputs[0]] = mp.mpf(constants[i])
            elif op == ca.OP_INPUT:
                work[outputs[0]] = arguments[inputs[0]][inputs[1]]
            elif op in _UNARY:
                work[outputs[0]] = _UNARY[op](work[inputs[0]])
            else:
                work[outputs[0]] = _BINARY[op](work[inputs[0]], work[inputs[1]])
        return result

    return run


def gauss(points: int) -> tuple[list[Any], list[Any]]:
    """Nodes and weights of the Gauss rule on [0, 1], by Newton's method from NumPy's."""
    nodes, weights = [], []
    for guess in np.polynomial.legendre.leggauss(points)[0]:
        x = mp.findroot(lambda y: mp.legendre(points, y), mp.mpf(float(guess)))
        slope = points * (x * mp.legendre(points, x) - mp.legendre(points - 1, x)) / (x * x - 1)
        nodes.append((x + 1) / 2)
        weights.append(1 / ((1 - x * x) * slope**2))
    return nodes, weights


def mode(degree: int, integrals: int) -> list[list[Any]]:
    """Monomial coefficients of sqrt(2 m + 1) P_m(2 s - 1) and its integrals, the last one first."""
    p = [
        mp.sqrt(2 * degree + 1)
        * (-1) ** (degree + i)
        * mp.binomial(degree, i)
        * mp.binomial(degree + i, i)
        for i in range(degree + 1)
    ]
    jets = [p]
    for _ in range(integrals):
        jets.insert(0, [mp.mpf(0), *(c / (i + 1) for i, c in enumerate(jets[0]))])
    return jets


def action(lagrangian: Callable[..., Any], h: float, x0: Array, w: Array, inner: Array) -> Any:
    """L_d of Galerkin with modes as NumPy found them, shape x0, w (k, n), inner (r, n).

    L_d is extremal in the inner modes: what they lack in digits counts squared.
    lagrangian: lists (q, q', ..., q^(k)) of mpmath numbers -> L.
    """
    k = len(x0)
    nodes, weights = gauss(len(inner) + k)
    degrees = [*range(k - 1, -1, -1), *range(k, k + len(inner))]
    signs = [(-1) ** m if m < k else 1 for m in degrees]  # b_j = sqrt(2 m + 1) P_m(1 - 2 s)
    modes = [mode(m, k) for m in degrees]
    rows = [*w, *inner]
    step = mp.mpf(h)
    total = mp.mpf(0)
    for s, weight in zip(nodes, weights, strict=True):
        jet: list[list[Any]] = [[] for _ in range(k + 1)]
        for joint in range(x0.shape[1]):
            for j in range(k + 1):
                taylor = [
                    (step * s) ** (i - j) / mp.factorial(i - j) * mp.mpf(x0[i, joint])
                    for i in range(j, k)
                ]
                moved = [
                    sign * mp.fsum(c * s**i for i, c in enumerate(m[j])) * mp.mpf(row[joint])
                    for sign, m, row in zip(signs, modes, rows, strict=True)
                ]
                jet[j].append(mp.fsum(taylor) + step ** (k - j) * mp.fsum(moved))
        total += weight * lagrangian(*jet)
    return step * total
