import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

panel_columns: int

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
def factor_signed(
    band: Array,
    metric: Array,
    shift: float,
    rows: Index,
    size: int,
    signs: Array,
    out: Array,
    portable: bool = False,
) -> int: ...
def solve(
    factor: Array,
    rows: Index,
    rhs: Array,
    out: Array,
    portable: bool = False,
    signs: Array | None = None,
) -> None: ...
def product(band: Array, rows: Index, x: Array, out: Array) -> None: ...
def descend(
    factor: Array,
    rows: Index,
    gradient: Array,
    metric: Array,
    out: Array,
    portable: bool = False,
) -> tuple[float, float]: ...
