"""A motion: the numbers of the discrete path, the scene they belong to, and how to read between."""

from __future__ import annotations

import hashlib
import importlib.metadata
import itertools
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.stored_torque import StoredTorque
from hovi.discrete.trajectory_file import read_arrays, write_arrays
from hovi.discrete.trajectory_file_check import require_continuous
from hovi.errors import HoviError, InputError, TrajectoryFileError
from hovi.robot.robot import Robot
from hovi.robot.space.chart import Chart
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.scene.scene import Scene
from hovi.schemes import Scheme, by_name

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

_ARRAYS = ("steps", "q", "v", "z", "inner", "momenta")
_TORQUE = "tau"
_MAX_INTERVALS = 10**7


class Sample(NamedTuple):
    """A motion at M times.

    q: configuration, shape (M, nq), in [rad] or [m].
    v: velocity, shape (M, nv), per [s].
    a: acceleration, shape (M, nv), per [s^2].
    tau: joint effort, shape (M, nv), in [N m] or [N].
    """

    q: Array
    v: Array
    a: Array
    tau: Array


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A motion of a scene's robot on a grid, with the costates that came with it.

    grid: the intervals, each with its step and scheme.
    path: nodes, regularized coordinates and inner modes.
    momenta: p and p~ at the nodes, shape (N + 1, 2, nv).
    scene: what moves; None for a robot that was a bare Pinocchio model, after loading.
    metadata: what JSON can hold about the origin (cost, status, versions), without wall times.
    torque: torques by interval where there is no scene to compute them.
    """

    grid: Grid
    path: DiscretePath = field(repr=False)
    momenta: Array = field(repr=False)
    scene: Scene | None = field(repr=False)
    metadata: Mapping[str, Any] = field(default_factory=dict)
    torque: StoredTorque | None = None

    def __post_init__(self) -> None:
        """Refuse arrays that do not fit the grid and the robot."""
        _check_shapes(self)
        if self.scene is None and self.torque is None:
            raise InputError("a trajectory needs a scene, or the torques themselves.")

    @property
    def robot(self) -> Robot | None:
        """The scene's robot; None where there is no scene."""
        return None if self.scene is None else self.scene.robot

    @property
    def duration(self) -> float:
        """T, in [s]."""
        return self.grid.duration

    @property
    def t(self) -> Array:
        """Times of the nodes, shape (N + 1,), in [s]."""
        return self.grid.t

    @property
    def q(self) -> Array:
        """Configurations at the nodes, shape (N + 1, nq), in [rad] or [m]."""
        return self.path.q

    @property
    def v(self) -> Array:
        """Velocities at the nodes, shape (N + 1, nv), per [s]."""
        return self.path.v

    @cached_property
    def space(self) -> ConfigurationSpace | None:
        """The configuration space; None where configurations are vectors."""
        if self.scene is not None:
            return self.scene.robot.curved_space
        parts = self.metadata.get("space")
        return None if parts is None else ConfigurationSpace(tuple(parts))

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """A name per velocity coordinate: the joint's, with an index where a joint has several."""
        if self.scene is not None:
            return tuple(self.scene.robot.coordinate_names)
        nv = self.path.v.shape[1]
        return tuple(self.metadata.get("coordinates") or (f"joint{i}" for i in range(nv)))

    def sample(self, t: npt.ArrayLike) -> Sample:
        """q, v, a and tau by the scheme's own interpolant (cubic Hermite where it has none).

        t: times in [0, T], shape (M,) or one number, in any order, in [s]. Accelerations and
            torques may jump at a node: the limit from the right is taken, from the left at T.
        Raises InputError when a time is outside the motion.
        """
        return self.sample_intervals(*self._locate(t))

    def configurations(self, t: npt.ArrayLike) -> Array:
        """q alone, shape (M, nq), as `sample` gives it: cheap, since no torque is computed."""
        return self._interpolate(*self._locate(t))[0]

    def jet(self, t: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """q, v and a as `sample` gives them, without torques."""
        return self._interpolate(*self._locate(t))

    def jet_intervals(self, k: npt.ArrayLike, s: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """q, v and a as `sample_intervals` gives them, without torques."""
        return self._interpolate(np.asarray(k, dtype=np.intp), np.asarray(s, dtype=np.float64))

    def sample_intervals(self, k: npt.ArrayLike, s: npt.ArrayLike) -> Sample:
        """q, v, a and tau in given intervals, both limits at a node within reach.

        k: numbers of intervals, shape (M,). s: places in [0, 1] of the interval, shape (M,).
        """
        k, s = np.asarray(k, dtype=np.intp), np.asarray(s, dtype=np.float64)
        q, v, a = self._interpolate(k, s)
        if self.torque is not None:
            return Sample(q, v, a, self.torque(k, s))
        assert self.scene is not None
        t = self.t[k] + s * self.grid.steps[k]
        return Sample(q, v, a, self.scene.inverse_dynamics(q, v, a, t))

    def _locate(self, t: npt.ArrayLike) -> tuple[Index, Array]:
        """The interval of each time, and the place in [0, 1] within it."""
        times = np.atleast_1d(np.asarray(t, dtype=np.float64))
        # the nodes' times are sums of so many steps
        slack = (4 + self.grid.intervals) * np.finfo(float).eps * self.duration
        if times.ndim != 1 or not np.isfinite(times).all():
            raise InputError(f"times must be finite and of shape (M,), not {times.shape}.")
        if times.size and not (-slack <= times.min() and times.max() <= self.duration + slack):
            raise InputError(
                f"the motion lasts from 0 to {self.duration:.17g} s, and a sample was asked at "
                f"{times.min() if times.min() < -slack else times.max():.17g} s."
            )
        nodes = self.t
        k = np.clip(np.searchsorted(nodes, times, side="right") - 1, 0, self.grid.intervals - 1)
        s = np.clip((times - nodes[k]) / self.grid.steps[k], 0.0, 1.0)
        s[times >= nodes[-1]] = 1.0
        return k, s

    def _interpolate(self, k: Index, s: Array) -> tuple[Array, Array, Array]:
        """q, v, a (M, n): rows(s) @ (h v0, Z0, Z1, c), added to q0 in the interval's chart."""
        h = self.grid.steps[k][:, None]
        path = self.path
        scaled = np.empty((len(k), 3, path.v.shape[1]))
        for scheme, members in self.grid.groups:
            here = np.isin(k, members)
            i, hi = k[here], h[here]
            ends = np.stack([path.v[i] * hi, path.z[i, 0] * hi**2, path.z[i, 1] * hi**2], axis=1)
            modes = path.inner[i, : scheme.inner_modes] * hi[:, None] ** 2
            data = np.concatenate([ends, modes], axis=1)  # (m, 3 + r, nv)
            scaled[here] = scheme.rows(s[here]) @ data
        x, dx, ddx = scaled[:, 0], scaled[:, 1] / h, scaled[:, 2] / h**2
        if self.space is None:
            return path.q[k] + x, dx, ddx
        return Chart(self.space).jet(path.q[k], x, dx, ddx)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the motion to one npz file, whole or not at all, the same bytes every time.

        The scene goes with it, the robot's URDF text included; for a robot that was given as a
        Pinocchio model, which has no text, the torques go instead.
        path: the file, by custom `*.npz`. Raises TrajectoryFileError.
        """
        for scheme, _ in self.grid.groups:
            _check_name(scheme)
        arrays = {
            "steps": self.grid.steps,
            "q": self.path.q,
            "v": self.path.v,
            "z": self.path.z,
            "inner": self.path.inner,
            "momenta": self.momenta,
        }
        metadata = {"versions": _versions(), **self.metadata}
        scene = None
        if self.scene is not None and self.scene.robot.source.kind != "model":
            scene = self.scene.to_dict()
        else:
            metadata["coordinates"] = list(self.coordinate_names)
            if self.space is not None:
                metadata["space"] = list(self.space.parts)
            arrays[_TORQUE] = self._torque_values()
        header = {
            "schemes": [[name, len(list(run))] for name, run in itertools.groupby(self._names())],
            "metadata": metadata,
            "scene": scene,
            "scene_sha256": _digest(scene),
        }
        write_arrays(path, header, arrays)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read what `save` wrote. Nothing in the file is believed before it is checked.

        Raises TrajectoryFileError in one sentence that says what is wrong with the file.
        """
        header, arrays = read_arrays(path, _ARRAYS, optional=[_TORQUE])
        try:
            schemes = _schemes(header["schemes"], arrays["inner"].shape)
            metadata = header["metadata"]
            if not isinstance(metadata, dict):
                raise InputError("the metadata is not a table")
            scene = _scene(header["scene"], header["scene_sha256"])
            if scene is None:
                _check_coordinates(metadata["coordinates"], arrays["v"].shape)
            loaded = cls(
                grid=Grid(arrays["steps"], schemes),
                path=DiscretePath(arrays["q"], arrays["v"], arrays["z"], arrays["inner"]),
                momenta=arrays["momenta"],
                scene=scene,
                metadata=metadata,
                torque=StoredTorque(arrays[_TORQUE]) if scene is None else None,
            )
            require_continuous(loaded.path, loaded.grid, loaded.space)
            return loaded
        except KeyError as error:
            raise TrajectoryFileError(
                f"trajectory file {Path(path).name!r} lacks {error.args[0]!r}."
            ) from error
        except (HoviError, TypeError, ValueError, AttributeError, IndexError) as error:
            raise TrajectoryFileError(
                f"trajectory file {Path(path).name!r} does not fit together: {error}"
            ) from error

    def _names(self) -> list[str]:
        return [scheme.name for scheme in self.grid.schemes]

    def _torque_values(self) -> Array:
        if self.torque is not None:
            return self.torque.values
        return StoredTorque.fit(
            lambda k, s: self.sample_intervals(k, s).tau, self.grid.intervals
        ).values


def _check_shapes(trajectory: Trajectory) -> None:
    path, grid = trajectory.path, trajectory.grid
    N, nv = grid.intervals, path.v.shape[-1]
    nq = path.q.shape[-1] if trajectory.scene is None else trajectory.scene.robot.nq
    wanted = {
        "q": (path.q, (N + 1, nq)),
        "v": (path.v, (N + 1, nv if trajectory.scene is None else trajectory.scene.robot.nv)),
        "z": (path.z, (N, 2, nv)),
        "momenta": (trajectory.momenta, (N + 1, 2, nv)),
    }
    if trajectory.torque is not None:
        points = trajectory.torque.values.shape[1]
        wanted["tau"] = (trajectory.torque.values, (N, points, nv))
    for name, (array, shape) in wanted.items():
        if array.shape != shape:
            raise InputError(f"{name} has shape {array.shape}; the grid and robot need {shape}.")
    inner = path.inner.shape
    if len(inner) != 3 or inner[::2] != (N, nv) or inner[1] < grid.inner_modes:
        raise InputError(
            f"inner has shape {inner}; the schemes need ({N}, {grid.inner_modes}, {nv})."
        )
    sizes = (nv, nv) if trajectory.space is None else (trajectory.space.nq, trajectory.space.nv)
    if (nq, nv) != sizes:
        raise InputError(f"nq is {nq} and nv is {nv}; the configuration space has {sizes}.")


def _check_name(scheme: Scheme) -> None:
    """Refuse a scheme whose name would bring back another table, or none."""
    try:
        same = np.array_equal(by_name(scheme.name).table, scheme.table)
    except HoviError:
        same = False
    if not same:
        raise TrajectoryFileError(
            f"the scheme {scheme.name!r} is not one that a file can name; "
            "use one of those of hovi.schemes.by_name."
        )


def _schemes(runs: Any, inner: tuple[int, ...]) -> tuple[Scheme, ...]:
    """One scheme per interval from [name, count] pairs; `inner` bounds what may be built."""
    if not isinstance(runs, list) or not all(isinstance(run, list) for run in runs):
        raise InputError("the schemes are not a list of [name, count]")
    schemes: list[Scheme] = []
    for name, count in runs:
        if not isinstance(name, str) or type(count) is not int or not 0 < count <= _MAX_INTERVALS:
            raise InputError(f"{[name, count]!r} is not a scheme's name and a count")
        modes = name.rpartition("-")[2]
        if modes.isdecimal() and int(modes) > inner[1]:
            raise InputError(f"the scheme {name!r} has more inner modes than the file")
        schemes += [by_name(name)] * count
        if len(schemes) > inner[0]:
            raise InputError("there are more schemes than intervals")
    return tuple(schemes)


def _scene(description: Any, sha256: Any) -> Scene | None:
    if description is None:
        return None
    if _digest(description) != sha256:
        raise InputError("the SHA-256 of its scene is not the one written beside it")
    return Scene.from_dict(description)


def _check_coordinates(names: Any, shape: tuple[int, ...]) -> None:
    if not isinstance(names, list) or len(names) != shape[-1]:
        raise InputError(f"{shape[-1]} names of coordinates are needed")
    if not all(isinstance(name, str) for name in names):
        raise InputError("the names of the coordinates are not all text")


def _digest(description: Any) -> str:
    """SHA-256 of a scene as canonical JSON, in hexadecimal."""
    return hashlib.sha256(json.dumps(description, sort_keys=True).encode()).hexdigest()


def _versions() -> dict[str, str]:
    """What made the motion: versions of hovi and of what it computes with."""
    versions = {}
    for name in ("hovi", "pin", "casadi"):
        try:
            versions[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            versions[name] = "not installed"
    return versions
