"""Samples of a motion as bytes, as workers store them."""

from __future__ import annotations

import struct
from typing import Literal, Self

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
SampleFormat = Literal["parquet", "zarr"]
"""In which format the samples of all motions are written."""
_HEAD = struct.Struct("<4i")
HEAD_BYTES = _HEAD.size
"""Bytes that `shape_of` needs."""


@dataclass(frozen=True, eq=False)
class Samples:
    """A motion at equally spaced times, both ends included.

    t: in [s], shape (M,). q: shape (M, nq). v, a: shape (M, nv). tau: shape (M, nv), or (M, 0).
    """

    t: Array
    q: Array
    v: Array
    a: Array
    tau: Array

    @classmethod
    def of(cls, trajectory: Trajectory, count: int) -> Self:
        """Samples of a motion."""
        t = np.linspace(0.0, trajectory.duration, count)
        motion = trajectory.sample(t)
        return cls(t, motion.q, motion.v, motion.a, motion.tau)

    def to_bytes(self) -> bytes:
        """As `from_bytes` reads it."""
        columns = [self.q, self.v, self.a, self.tau]
        head = _HEAD.pack(len(self.t), self.q.shape[1], self.v.shape[1], self.tau.shape[1])
        body = np.concatenate([self.t[:, None], *columns], axis=1)
        return head + np.ascontiguousarray(body, "<f8").tobytes()

    @staticmethod
    def shape_of(content: bytes) -> tuple[int, int, int, int]:
        """M, nq, nv and the width of tau, from the first bytes."""
        count, nq, nv, outputs = _HEAD.unpack_from(content)
        return count, nq, nv, outputs

    @classmethod
    def from_bytes(cls, content: bytes) -> Self:
        """From bytes. Raises ValueError for others."""
        count, nq, nv, outputs = cls.shape_of(content)
        body = np.frombuffer(content, "<f8", offset=_HEAD.size).astype(np.float64)
        rows = body.reshape(count, 1 + nq + 2 * nv + outputs)
        parts = np.split(rows, np.cumsum([1, nq, nv, nv]), axis=1)
        return cls(parts[0][:, 0], *parts[1:])
