"""A CasADi function evaluated at a batch of points, without copies from or to NumPy arrays.

Its instructions are read once, and each is carried out at several points at a time, which takes a
tenth of the time of CasADi's interpreter and rounds as that does.
"""

from __future__ import annotations

import functools
import math
import os
import threading
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi._native.expressions import expression_of
from hovi.checks.shapes import numbers_of
from hovi.errors import InputError

Array = npt.NDArray[np.float64]


class PointFunction:
    """f at P points: every argument gains a leading axis of length P.

    Arguments are column vectors in CasADi; a result of shape (r, c) comes back as (P, r, c), a
    column as (P, r), a scalar as (P,). Many points are distributed over threads; results are
    bitwise independent of their number. Calls from several Python threads are safe.

    function: of SX expressions. One that calls others is evaluated by CasADi, on one thread.
    """

    def __init__(self, function: ca.Function) -> None:
        self._given = function
        self.function = function = _dense(function)
        self._expression = expression_of(function)
        self._widths = [int(function.numel_in(i)) for i in range(function.n_in())]
        self._shapes = [function.size_out(i) for i in range(function.n_out())]
        self._sizes = [math.prod(shape) for shape in self._shapes]
        self._name = f"an argument of {function.name()}"
        self._threads = default_threads()
        self._mapped = functools.lru_cache(maxsize=16)(function.map)
        self._lock = threading.Lock()

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled as its function."""
        return type(self), (self._given,)

    def __call__(self, *arguments: Array) -> list[Array]:
        """Evaluate at P points; arguments of shape (P, width). Raises InputError for others."""
        arrays = [np.atleast_1d(numbers_of(self._name, each)) for each in arguments]
        points = len(arrays[0])
        self._check(arrays, points)
        results = [np.empty((points, *reversed(shape))) for shape in self._shapes]
        if self._expression is not None:
            given = tuple(a.reshape(points, n) for a, n in zip(arrays, self._widths, strict=True))
            made = tuple(r.reshape(points, n) for r, n in zip(results, self._sizes, strict=True))
            self._expression(given, made, points, self._threads)
        elif points > 0:
            self._interpret(arrays, results, points)
        return [_squeeze(result) for result in results]

    def _check(self, arrays: list[Array], points: int) -> None:
        """Raise InputError unless every argument has one row of its numbers for each point."""
        if [array.shape for array in arrays] == [(points, width) for width in self._widths]:
            return
        if len(arrays) != len(self._widths):
            raise InputError(
                f"{self.function.name()} takes {len(self._widths)} arrays, got {len(arrays)}."
            )
        for i, (array, width) in enumerate(zip(arrays, self._widths, strict=True)):
            if (len(array), array.size) != (points, points * width):
                raise InputError(
                    f"{self.function.name_in(i)} must have shape ({points}, {width}), got "
                    f"{array.shape}."
                )

    def _interpret(self, arguments: list[Array], results: list[Array], points: int) -> None:
        with self._lock:
            mapped = self._mapped(points)
        buffer, trigger = mapped.buffer()
        # CasADi's stubs lack that buffers take a memoryview
        for i, argument in enumerate(arguments):
            if argument.size:
                buffer.set_arg(i, memoryview(argument.reshape(-1)))  # type: ignore[call-arg,arg-type]
        for i, result in enumerate(results):
            if result.size:
                buffer.set_res(i, memoryview(result.reshape(-1)))  # type: ignore[call-arg,arg-type]
        trigger()


def default_threads() -> int:
    """OMP_NUM_THREADS if set, as in worker processes, else the number of processors."""
    wanted = os.environ.get("OMP_NUM_THREADS", "")
    return int(wanted) if wanted.isdigit() and int(wanted) > 0 else os.cpu_count() or 1


def _dense(function: ca.Function) -> ca.Function:
    """The function with dense results."""
    dense = [ca.Sparsity.dense(*function.size_out(i)) for i in range(function.n_out())]
    if all(function.sparsity_out(i) == dense[i] for i in range(function.n_out())):
        return function
    symbols = [ca.SX.sym(function.name_in(i), *function.size_in(i)) for i in range(function.n_in())]
    results = [ca.densify(result) for result in function.call(symbols)]
    return ca.Function(function.name(), symbols, results)


def _squeeze(result: Array) -> Array:
    """(P, c, r) from column-major memory to (P, r, c), (P, r) or (P,), C-contiguous."""
    _, columns, rows = result.shape
    if columns == 1:
        return result[:, 0, 0] if rows == 1 else result[:, 0, :]
    return np.ascontiguousarray(result.transpose(0, 2, 1))
