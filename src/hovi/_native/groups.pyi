import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Layout = npt.NDArray[np.int64]

def integrate(layout: Layout, q: Array, x: Array, result: Array) -> None: ...
def difference(
    layout: Layout, q0: Array, q1: Array, expected: Array | None, result: Array
) -> None: ...
def rates(
    layout: Layout, x: Array, base_rates: Array | None, out: Array, portable: bool = False
) -> None: ...
def local_rates(
    layout: Layout, x: Array, v: Array, a: Array, out: Array, portable: bool = False
) -> None: ...
def expand(
    layout: Layout,
    table: Array,
    weights: Array,
    steps: Array,
    x: Array,
    ends: Array,
    gradient: Array,
    hessian: Array,
    columns_gradient: Array,
    columns_hessian: Array,
    portable: bool = False,
) -> None: ...
def pull_gradient(
    layout: Layout,
    table: Array,
    weights: Array,
    steps: Array,
    x: Array,
    ends: Array,
    gradient: Array,
    regular: bool,
    columns_gradient: Array,
    portable: bool = False,
) -> None: ...
def pull_moments(
    layout: Layout,
    table: Array,
    weights: Array,
    steps: Array,
    x: Array,
    ends: Array,
    tests: Array,
    jacobian: Array,
    columns_gradients: Array,
    portable: bool = False,
) -> None: ...
def push_steps(
    layout: Layout,
    table: Array,
    weights: Array,
    steps: Array,
    x: Array,
    ends: Array,
    step: Array,
    change: Array,
    portable: bool = False,
) -> None: ...
