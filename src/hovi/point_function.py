"""A CasADi function evaluated at a batch of points, straight from and into NumPy's memory."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

CHUNK = 1024
"""Points of one mapped call; more are done chunk by chunk, so that memory stays bounded."""


class PointFunction:
    """f at P points: every argument gains a leading axis of length P.

    Arguments are column vectors in CasADi; a result of shape (r, c) comes back as (P, r, c), a
    column as (P, r), a number as (P,).
    """

    def __init__(self, function: ca.Function) -> None:
        dense = [ca.Sparsity.dense(*function.size_out(i)) for i in range(function.n_out())]
        if any(function.sparsity_out(i) != dense[i] for i in range(function.n_out())):
            symbols = [
                ca.SX.sym(function.name_in(i), *function.size_in(i)) for i in range(function.n_in())
            ]
            results = [ca.densify(result) for result in function.call(symbols)]
            function = ca.Function(function.name(), symbols, results)
        self.function = function
        self._widths = [function.size1_in(i) for i in range(function.n_in())]
        self._shapes = [function.size_out(i) for i in range(function.n_out())]
        self._mapped: dict[int, ca.Function] = {}

    def __call__(self, *arguments: Array) -> list[Array]:
        """Evaluate at P points; arguments of shape (P, width)."""
        arrays = [np.ascontiguousarray(argument, dtype=np.float64) for argument in arguments]
        points = len(arrays[0])
        results = [np.empty((points, *reversed(shape))) for shape in self._shapes]
        for first in range(0, points, CHUNK):
            last = min(first + CHUNK, points)
            self._evaluate([a[first:last] for a in arrays], [r[first:last] for r in results])
        return [_squeeze(result) for result in results]

    def _evaluate(self, arguments: list[Array], results: list[Array]) -> None:
        points = len(arguments[0])
        if points not in self._mapped:
            if len(self._mapped) > 8:
                self._mapped.clear()
            self._mapped[points] = self.function.map(points)
        buffer, trigger = self._mapped[points].buffer()
        for i, argument in enumerate(arguments):
            if argument.size:
                buffer.set_arg(i, memoryview(argument.reshape(-1)))  # type: ignore[call-arg,arg-type]
        for i, result in enumerate(results):
            if result.size:
                buffer.set_res(i, memoryview(result.reshape(-1)))  # type: ignore[call-arg,arg-type]
        trigger()


def _squeeze(result: Array) -> Array:
    """(P, c, r) from column-major memory to (P, r, c), (P, r) or (P,)."""
    _, columns, rows = result.shape
    if columns == 1:
        return result[:, 0, 0] if rows == 1 else result[:, 0, :]
    return result.transpose(0, 2, 1)
