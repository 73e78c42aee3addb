"""Restricts BLAS to one thread while hovi computes.

The rounding of a threaded product depends on how BLAS splits it, so the bytes of a motion would
depend on the number of processors; and the blocks of a motion are too small to gain from threads.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def one_blas_thread(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """A decorator: every BLAS that is loaded when the function is called runs one thread in it.

    SciPy's own BLAS is not restricted where the function itself is the first to import it: the
    SciPy functions that hovi uses multiply with NumPy's BLAS.
    """

    @functools.wraps(function)
    def limited(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        blas = _loaded_blas("scipy.linalg" in sys.modules)
        if all(library.num_threads == 1 for library in blas.lib_controllers):
            return function(*args, **kwargs)
        with blas.limit(limits=1):
            return function(*args, **kwargs)

    return limited


@functools.cache
def _loaded_blas(with_scipy: bool) -> ThreadpoolController:
    """NumPy's BLAS, and SciPy's once it is loaded; finding them takes some milliseconds."""
    return ThreadpoolController().select(user_api="blas")
