import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

class PairDistances:
    def __init__(
        self,
        nq: int,
        nv: int,
        parents: Index,
        kinds: Index,
        coordinates: Index,
        columns: Index,
        rotations: Array,
        translations: Array,
        axes: Array,
        shape_joints: Index,
        shape_kinds: Index,
        shape_rotations: Array,
        shape_translations: Array,
        shape_sizes: Array,
        shape_spheres: Array,
        points: Array,
        point_counts: Index,
        neighbor_counts: Index,
        neighbors: Index,
        pairs: Index,
        portable: bool = False,
    ) -> None: ...
    @property
    def nq(self) -> int: ...
    @property
    def nv(self) -> int: ...
    @property
    def size(self) -> int: ...
    def values(
        self,
        q: Array,
        chosen: Index,
        reach: float,
        distances: Array,
        known: Index,
        wanted: Mask | None = None,
        rounding: Array | None = None,
        normals: Array | None = None,
    ) -> None: ...
    def expand(
        self,
        q: Array,
        chosen: Index,
        reach: float,
        force: Array | None,
        distances: Array,
        known: Index,
        jacobian: Array,
        curvature: Array,
        wanted: Mask | None = None,
        rounding: Array | None = None,
        normals: Array | None = None,
    ) -> None: ...
