from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

def integrate(
    rates: Callable[[float, Array], Array],
    y: Array,
    begin: float,
    end: float,
    relative: float,
    absolute: float,
) -> None: ...
