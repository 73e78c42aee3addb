import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

class InverseKinematicsKernel:
    def __init__(
        self,
        rotations: Array,
        translations: Array,
        angular: Array,
        linear: Array,
        tip_rotation: Array,
        tip_translation: Array,
        lower: Array,
        upper: Array,
    ) -> None: ...
    @property
    def n(self) -> int: ...
    def search(
        self,
        position: Array | None,
        rotation: Array | None,
        axis: Array | None,
        weight: float,
        near: Array,
        apart: float,
        seeds: int,
        patience: int,
        configurations: Array,
        best: Array,
    ) -> tuple[int, int]: ...
