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
def solve(factor: Array, rows: Index, rhs: Array, out: Array, portable: bool = False) -> None: ...
