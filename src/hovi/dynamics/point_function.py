"""A CasADi function evaluated at a batch of points, straight from and into NumPy's memory."""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Iterator
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.dynamics.function_cache import compiled

Array = npt.NDArray[np.float64]

CHUNK = 1024
"""Points of one mapped call; more are done chunk by chunk, so that memory stays bounded."""
SHARE = 100_000
"""Instructions that a thread has to have for itself to be worth its start. Two threads break even
at 50,000 each: starting and ending them takes up to 100 microseconds, the interpreter 2 to 5
nanoseconds for an instruction."""
COMPILED_GAIN = 10
"""How many times faster compiled code is, for the same account: 4 to 25 were measured."""


class PointFunction:
    """f at P points: every argument gains a leading axis of length P.

    Arguments are column vectors in CasADi; a result of shape (r, c) comes back as (P, r, c), a
    column as (P, r), a number as (P,). Many points are shared out over threads, which does not
    change a bit of the result. Calls from several Python threads are safe.

    function: made of SX expressions.
    compile: compile it to machine code, or take that from the user's cache: see `compiled`.
    """

    def __init__(self, function: ca.Function, compile: bool = False) -> None:
        self._made_from = function, compile
        function = _dense(function)
        self._cost = function.n_instructions()
        if compile:
            function = compiled(function)
            self._cost //= COMPILED_GAIN
        self.function = function
        self._shapes = [function.size_out(i) for i in range(function.n_out())]
        self._threads = default_threads()
        self._mapped = functools.lru_cache(maxsize=16)(function.map)
        self._lock = threading.Lock()

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled as what it was made from: compiled code stays in the cache."""
        return type(self), self._made_from

    def __call__(self, *arguments: Array) -> list[Array]:
        """Evaluate at P points; arguments of shape (P, width)."""
        arrays = [np.ascontiguousarray(argument, dtype=np.float64) for argument in arguments]
        points = len(arrays[0])
        results = [np.empty((points, *reversed(shape))) for shape in self._shapes]
        for part, threads in self._parts(points):
            self._evaluate([a[part] for a in arrays], [r[part] for r in results], threads)
        return [_squeeze(result) for result in results]

    def _parts(self, points: int) -> Iterator[tuple[slice, int]]:
        """Points of one call and the threads that share them equally; the rest are done alone."""
        for first in range(0, points, CHUNK):
            last = min(first + CHUNK, points)
            threads = max(1, min(self._threads, (last - first) * self._cost // SHARE))
            shared = last - (last - first) % threads
            yield slice(first, shared), threads
            if shared < last:
                yield slice(shared, last), 1

    def _evaluate(self, arguments: list[Array], results: list[Array], threads: int) -> None:
        points = len(arguments[0])
        with self._lock:
            mapped = (
                self._mapped(points) if threads == 1 else self._mapped(points, "thread", threads)
            )
        buffer, trigger = mapped.buffer()
        # CasADi's stubs do not know that buffers take a memoryview
        for i, argument in enumerate(arguments):
            if argument.size:
                buffer.set_arg(i, memoryview(argument.reshape(-1)))  # type: ignore[call-arg,arg-type]
        for i, result in enumerate(results):
            if result.size:
                buffer.set_res(i, memoryview(result.reshape(-1)))  # type: ignore[call-arg,arg-type]
        trigger()


def default_threads() -> int:
    """OMP_NUM_THREADS where it is set, as worker processes do, else the processors at hand."""
    wanted = os.environ.get("OMP_NUM_THREADS", "")
    return int(wanted) if wanted.isdigit() and int(wanted) > 0 else os.cpu_count() or 1


def _dense(function: ca.Function) -> ca.Function:
    """The function with full matrices for results."""
    dense = [ca.Sparsity.dense(*function.size_out(i)) for i in range(function.n_out())]
    if all(function.sparsity_out(i) == dense[i] for i in range(function.n_out())):
        return function
    symbols = [ca.SX.sym(function.name_in(i), *function.size_in(i)) for i in range(function.n_in())]
    results = [ca.densify(result) for result in function.call(symbols)]
    return ca.Function(function.name(), symbols, results)


def _squeeze(result: Array) -> Array:
    """(P, c, r) from column-major memory to (P, r, c), (P, r) or (P,)."""
    _, columns, rows = result.shape
    if columns == 1:
        return result[:, 0, 0] if rows == 1 else result[:, 0, :]
    return result.transpose(0, 2, 1)
