"""One thread of BLAS while hovi computes.

How BLAS shares a product out decides how it rounds, so the bytes of a motion would depend on the
number of processors; and the blocks of a motion are small: two threads only wait for each other.
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
    """The function, which runs with one thread in every BLAS that the process has as it begins.

    That of SciPy, where the function itself imports it, is left as it is: what hovi takes from
    there multiplies by NumPy's.
    """

    @functools.wraps(function)
    def limited(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        blas = _blas("scipy.linalg" in sys.modules)
        if all(library.num_threads == 1 for library in blas.lib_controllers):
            return function(*args, **kwargs)
        with blas.limit(limits=1):
            return function(*args, **kwargs)

    return limited


@functools.cache
def _blas(scipy_too: bool) -> ThreadpoolController:
    """That of NumPy, and SciPy's own one once it is there; to find them takes some milliseconds."""
    return ThreadpoolController().select(user_api="blas")
