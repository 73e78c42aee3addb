"""Samples of a motion on a vector space, each by one compiled call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from hovi._native import dynamics as native
from hovi.dynamics.torque_model import TorqueModel, compiled_rnea
from hovi.schemes import Scheme
from hovi.schemes.interval_curve import curve_series

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Samples = tuple[Index, Array, Array, Array, Array, Array | None]


class PathSampler:
    """(q, v, a) of a path at times in one call, with tau where that is RNEA alone.

    path: the arrays of a DiscretePath by name, which are read when it is sampled.
    times: of the nodes, shape (N + 1,), in [s]. steps: h, shape (N,), in [s].
    groups: each scheme with the numbers of its intervals.
    kernels: of the segments, or none. ends: the number of intervals up to the end of each.
    """

    def __init__(
        self,
        path: Mapping[str, Array],
        times: Array,
        steps: Array,
        groups: Sequence[tuple[Scheme, npt.NDArray[np.intp]]],
        kernels: Sequence[native.InverseDynamicsKernel] = (),
        ends: Sequence[int] = (),
    ) -> None:
        q, v, z, inner, higher = (path[name] for name in ("q", "v", "z", "inner", "higher"))
        k, self._n = z.shape[1:]
        used = np.zeros(len(z), dtype=np.int64)
        for scheme, members in groups:
            used[members] = scheme.inner_modes
        series = curve_series(k, inner.shape[1], max(k, 2))[:, :3]
        self._arguments = path, times, steps, groups
        self._with_torques = len(kernels) > 0
        self._compiled = native.PathSampler(
            q=q,
            v=v,
            higher=higher if k > 2 else np.zeros((len(q), 0, self._n)),
            z=z,
            inner=inner,
            times=times,
            steps=steps,
            series=np.ascontiguousarray(series),
            used=used,
            kernels=kernels,
            ends=np.array(ends, dtype=np.int64),
        )

    def with_torques(self, torques: Sequence[TorqueModel], ends: Sequence[int]) -> PathSampler:
        """The same with the torques of the segments; itself if there is more to them than RNEA."""
        kernels = [kernel for kernel in map(compiled_rnea, torques) if kernel is not None]
        if not kernels or len(kernels) < len(torques):
            return self
        return PathSampler(*self._arguments, kernels, ends)

    def at_times(self, t: npt.ArrayLike) -> Samples | None:
        """As `in_intervals`, at times in [s], shape (M,) or a number.

        None for any other shape, and for a time that is not in the motion: from 0 to T, up to the
        rounding of the sum of its steps.
        """
        times = np.array(t, dtype=np.float64, ndmin=1)
        if times.ndim != 1:
            return None
        intervals, positions = np.empty(len(times), dtype=np.int64), np.empty(len(times))
        try:
            self._compiled.locate(times, intervals, positions)
        except ValueError:
            return None
        return self.in_intervals(intervals, positions)

    def in_intervals(self, intervals: Index, positions: Array) -> Samples:
        """Interval numbers (M,), positions in them (M,), q, v, a (M, n), and tau or None."""
        shape = len(intervals), self._n
        q, v, a = np.empty(shape), np.empty(shape), np.empty(shape)
        tau = np.empty(shape) if self._with_torques else None
        self._compiled.sample(intervals, positions, q, v, a, tau)
        return intervals, positions, q, v, a, tau
