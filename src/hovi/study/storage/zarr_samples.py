"""The samples of all motions as Zarr arrays in one file, samples.zarr.zip.

A zip file is a store of Zarr, of format 2 here, which most programs read. The times of its entries
are constant, so that equal motions give equal bytes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from typing import Any, BinaryIO
from zipfile import ZipFile, ZipInfo

import numpy as np

from hovi.study.storage.samples import Samples
from hovi.system.dataclass import dataclass

Shape = tuple[int, int, int, int]
_MODE = 0o644
_DIMENSIONS = {
    "cell": ("plan",),
    "key": ("plan",),
    "t": ("plan", "sample"),
    "q": ("plan", "sample", "configuration"),
    "v": ("plan", "sample", "velocity"),
    "a": ("plan", "sample", "velocity"),
    "tau": ("plan", "sample", "effort"),
}
"""The arrays, and the names of their dimensions as xarray reads them."""


@dataclass(frozen=True)
class SampledPlan:
    """The samples of a plan. cell: its number. key: of the plan."""

    cell: int
    key: str
    samples: Samples


def widest(shapes: Iterator[Shape]) -> Shape:
    """The number of motions, and the largest nq, nv and width of tau of their samples.

    shapes: of `Samples.shape_of`.
    """
    plans, nq, nv, outputs = 0, 0, 0, 0
    for _, *widths in shapes:
        plans += 1
        nq, nv, outputs = (max(pair) for pair in zip((nq, nv, outputs), widths, strict=True))
    return plans, nq, nv, outputs


def write_zarr(
    stream: BinaryIO, groups: Iterator[list[SampledPlan]], shape: Shape, samples: int, size: int
) -> None:
    """Write t, q, v, a and tau of all motions, of shapes (plans, samples, ...), and cell and key.

    groups: of `size` plans, the last one of fewer. shape: of `widest`; where robots differ in their
    number of joints, what is left over is NaN. samples: of each motion.
    """
    with ZipFile(stream, "w") as archive:
        store = _Store(archive, shape, samples, size)
        for number, group in enumerate(groups):
            for name, values in _arrays(group, shape, samples).items():
                store.add(name, number * size, values)


@dataclass(eq=False)
class _Store:
    """Arrays of which each group of plans goes to the archive as soon as it is there."""

    archive: ZipFile
    shape: Shape
    samples: int
    size: int
    _made: dict[str, Any] = field(default_factory=dict)
    _arrays: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        from numcodecs import Blosc
        from zarr import create_group
        from zarr.storage import MemoryStore

        root = create_group(MemoryStore(self._made), zarr_format=2)
        empty = _arrays([], self.shape, self.samples)
        for name, values in empty.items():
            within = values.shape[1:]
            self._arrays[name] = root.create_array(
                name,
                shape=(self.shape[0], *within),
                chunks=(self.size, *(max(1, each) for each in within)),
                dtype=values.dtype,
                compressors=Blosc("zstd"),
                fill_value=np.nan if values.dtype.kind == "f" else None,
                attributes={"_ARRAY_DIMENSIONS": _DIMENSIONS[name]},
            )
        self._put_away()

    def add(self, name: str, first: int, values: Any) -> None:
        """Write a group of plans. first: the number of its first one."""
        self._arrays[name][first : first + len(values)] = values
        self._put_away()

    def _put_away(self) -> None:
        """Move what was made to the archive."""
        for name in sorted(self._made):
            entry = ZipInfo(name)  # of 1980
            entry.external_attr = _MODE << 16
            entry.create_system = 3  # of Unix, on every system
            self.archive.writestr(entry, self._made[name].to_bytes())
        self._made.clear()


def _arrays(group: list[SampledPlan], shape: Shape, samples: int) -> dict[str, Any]:
    """The arrays of some plans."""
    _, nq, nv, outputs = shape
    found: dict[str, Any] = {
        "cell": np.array([each.cell for each in group], "<i8"),
        "key": np.array([each.key.encode() for each in group], "S32"),
        "t": np.array([each.samples.t for each in group], "<f8").reshape(-1, samples),
    }
    for name, width in (("q", nq), ("v", nv), ("a", nv), ("tau", outputs)):
        values = np.full((len(group), samples, width), np.nan)
        for i, each in enumerate(group):
            own = getattr(each.samples, name)
            values[i, :, : own.shape[1]] = own
        found[name] = values
    return found
