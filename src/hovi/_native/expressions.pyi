from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

def expression_of(function: Any) -> Expression | None: ...

class Expression:
    def __call__(
        self,
        arguments: tuple[Array, ...],
        results: tuple[Array, ...],
        points: int,
        threads: int,
    ) -> None: ...
