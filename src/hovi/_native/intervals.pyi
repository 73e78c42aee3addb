import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

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
def displacements_at(
    rows: Array, steps: Array, intervals: Index, v: Array, z: Array, inner: Array, out: Array
) -> None: ...
def misfit(steps: Array, q: Array, v: Array, z: Array, inner: Array) -> float: ...
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
def replace_by_prefix_sums(increments: Array, share: float, values: Array) -> None: ...
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
def push(
    table: Array,
    weights: Array,
    steps: Array,
    step: Array,
    selected: Index,
    scales: Array,
    jacobian: Array,
    out: Array,
) -> None: ...
def pull(
    table: Array,
    weights: Array,
    steps: Array,
    forces: Array,
    selected: Index,
    scales: Array,
    jacobian: Array,
    out: Array,
) -> None: ...
def push_rows(intervals: Index, joints: Index, rows: Array, step: Array, out: Array) -> None: ...
def pull_rows(intervals: Index, joints: Index, rows: Array, forces: Array, sums: Array) -> None: ...
def add_squares(
    intervals: Index, joints: Index, rows: Array, weights: Array, sums: Array
) -> None: ...
