import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

panel_columns: int

def contract(
    table: Array,
    weights: Array,
    steps: Array,
    gradient: Array,
    hessian: Array,
    columns_gradient: Array,
    columns_hessian: Array,
    portable: bool = False,
) -> None: ...
def assemble(
    hessian: Array,
    starts: Index,
    positions: Index,
    lengths: Index,
    scales: Array | None,
    band: Array,
) -> None: ...
def factor(
    band: Array,
    metric: Array,
    shift: float,
    rows: Index,
    size: int,
    out: Array,
    portable: bool = False,
) -> bool: ...
def product(band: Array, rows: Index, x: Array, out: Array) -> None: ...
def descend(
    factor: Array,
    rows: Index,
    gradient: Array,
    metric: Array,
    out: Array,
    portable: bool = False,
) -> tuple[float, float]: ...
def misfit(steps: Array, q: Array, v: Array, z: Array, inner: Array) -> float: ...
def interpolate(
    table: Array,
    steps: Array,
    intervals: Index,
    q: Array,
    v: Array,
    z: Array,
    inner: Array,
    out: Array,
) -> None: ...
def move(
    step: Array,
    steps: Array,
    nodal: bool,
    v: Array,
    z: Array,
    inner: Array,
    dq: Array,
    new_v: Array,
    new_z: Array,
    new_inner: Array,
) -> None: ...
def solve(factor: Array, rows: Index, rhs: Array, out: Array, portable: bool = False) -> None: ...
def carry(increments: Array, share: float, values: Array) -> None: ...
def weighted_square(residuals: Array, metric: Array, weights: Array) -> float: ...
def expand_squares(
    residuals: Array,
    metric: Array,
    jacobian: Array,
    force: Array | None,
    values: Array,
    gradient: Array,
) -> None: ...
def predict(
    residuals: Array, metric: Array, jacobian: Array, change: Array, out: Array
) -> None: ...
