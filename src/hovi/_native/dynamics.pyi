from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

class InverseDynamicsKernel:
    def __init__(
        self,
        nq: int,
        gravity: Array,
        parents: Index,
        coordinates: Index,
        continuous: npt.NDArray[np.bool_],
        rotations: Array,
        translations: Array,
        angular: Array,
        linear: Array,
        masses: Array,
        centers: Array,
        moments: Array,
        armatures: Array,
        base_twist_indices: Index,
        base_coordinate: int,
        planar_base: bool,
        portable: bool = False,
    ) -> None: ...
    @property
    def nq(self) -> int: ...
    @property
    def n(self) -> int: ...
    def torque(self, q: Array, v: Array, a: Array, tau: Array, threads: int) -> None: ...
    def linearize(
        self, q: Array, v: Array, a: Array, tau: Array, jacobian: Array, threads: int
    ) -> None: ...
    def expand(
        self,
        q: Array,
        v: Array,
        a: Array,
        weight: Array,
        curvature: Array | None,
        tau: Array,
        jacobian: Array,
        hessian: Array,
        threads: int,
    ) -> None: ...

class PathSampler:
    def __init__(
        self,
        q: Array,
        v: Array,
        higher: Array,
        z: Array,
        inner: Array,
        times: Array,
        steps: Array,
        series: Array,
        used: Index,
        kernels: Sequence[InverseDynamicsKernel],
        ends: Index,
    ) -> None: ...
    def locate(self, t: Array, intervals: Index, positions: Array) -> None: ...
    def sample(
        self,
        intervals: Index,
        positions: Array,
        q: Array,
        v: Array,
        a: Array,
        tau: Array | None,
    ) -> None: ...

def ignore_leaks() -> None: ...
