"""A motion: the discrete path, its scene, interpolation and files."""

from __future__ import annotations

import io
import itertools
import os
from collections.abc import Iterable, Mapping
from dataclasses import field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.checks.shapes import numbers_of, require_shape
from hovi.discrete import trajectory_file
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.node_continuity import require_continuous
from hovi.discrete.output.export_methods import ExportMethods
from hovi.discrete.output.path_sampler import PathSampler
from hovi.discrete.output.stored_torque import StoredTorque
from hovi.discrete.output.trajectory_summary import TrajectorySummary
from hovi.discrete.positions import Positions, displacements
from hovi.errors import HoviError, InputError, TrajectoryFileError
from hovi.robot.robot import Robot
from hovi.robot.source import absolute_folders
from hovi.robot.space.chart import Chart
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.scene.scene import Scene
from hovi.scene.segment_scenes import SegmentScenes
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

_ARRAYS = ("steps", "q", "v", "z", "inner", "momenta")
_PATH = ("q", "v", "z", "inner", "higher")
_TORQUE, _HIGHER = "tau", "higher"


class Sample(NamedTuple):
    """A motion at M times.

    q: configuration, shape (M, nq), in [rad] or [m].
    v: velocity, shape (M, nv), per [s].
    a: acceleration, shape (M, nv), per [s^2].
    tau: joint effort, shape (M, nv), in [N m] or [N]; (M, 0) for a Lagrangian without torques.
    """

    q: Array
    v: Array
    a: Array
    tau: Array


@check_arguments_except("package_dirs")
@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Positions, ExportMethods, TrajectorySummary):
    """A motion of a scene's robot on a grid, with its costates.

    grid: the intervals, each with its step and scheme.
    path: nodes, regularized coordinates and inner modes.
    momenta: p and p~ at the nodes, shape (N + 1, k, nv) for a Lagrangian of order k.
    scene: None for a Lagrangian without one, for a loaded motion of a robot that was given as a
        Pinocchio model, and for a motion in segments.
    metadata: JSON-compatible data about the origin (cost, status, versions), without wall times.
    torque: torques by interval if there is no scene to compute them.
    segments: the scenes of a motion in segments.
    turns: full turns of continuous joints at the start, by joint, that q does not show.
    """

    grid: Grid
    path: DiscretePath = field(repr=False)
    momenta: Array = field(repr=False)
    scene: Scene | None = field(repr=False)
    metadata: Mapping[str, Any] = field(default_factory=dict)
    torque: StoredTorque | None = None
    segments: SegmentScenes | None = None
    turns: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Raise InputError for arrays that do not match the grid and the robot."""
        _check_shapes(self)
        if self.scene is None and self.torque is None and self.segments is None:
            raise InputError("a trajectory needs a scene, or the torques themselves.")
        _ = self.turns_at_start

    @property
    def robot(self) -> Robot | None:
        """The robot of the scene or the scenes; None without one."""
        about = self.segments if self.scene is None else self.scene
        return None if about is None else about.robot

    @property
    def duration(self) -> float:
        """T, in [s]."""
        return self.grid.duration

    @property
    def segment_durations(self) -> Array:
        """Those of the segments of a motion in segments, shape (number,), in [s]; else (0,)."""
        intervals = () if self.segments is None else self.segments.intervals
        return np.diff(self.t[np.cumsum([0, *intervals])])

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
        """The configuration space; None if it is a vector space."""
        if self.robot is not None:
            return self.robot.curved_space
        parts = self.metadata.get("space")
        return None if parts is None else ConfigurationSpace(tuple(parts))

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """A name per velocity coordinate: that of the joint, with an index if it has several."""
        if self.robot is not None:
            return tuple(self.robot.coordinate_names)
        nv = self.path.v.shape[1]
        return tuple(self.metadata.get("coordinates") or (f"joint{i}" for i in range(nv)))

    def sample(self, t: npt.ArrayLike) -> Sample:
        """q, v, a and tau by the scheme's own interpolant (cubic Hermite if it has none).

        t: times in [0, T], shape (M,) or scalar, in any order, in [s]. Where accelerations and
            torques jump at a node, the limit from the right is returned; at T, from the left.
        Raises InputError for a time outside the motion.
        """
        found = None if self._sampler is None else self._sampler.at_times(t)
        return self._sampled(*self._locate(t)) if found is None else self._complete(*found)

    def configurations(self, t: npt.ArrayLike) -> Array:
        """q of `sample`, shape (M, nq), without computing torques."""
        found = None if self._curve is None else self._curve.at_times(t)
        return self._interpolate(*self._locate(t), 0)[0] if found is None else found[2]

    def jet(self, t: npt.ArrayLike, order: int = 2) -> tuple[Array, ...]:
        """(q, v, a) of `sample`, without computing torques.

        order: the highest derivative: 3 for the jerk, or that of the Lagrangian; up to 2 on groups.
        """
        return self._interpolate(*self._locate(t), order)

    def jet_intervals(
        self, k: npt.ArrayLike, s: npt.ArrayLike, order: int = 2
    ) -> tuple[Array, ...]:
        """As `jet`, at the times of `sample_intervals`."""
        return self._interpolate(*self._checked(k, s), order)

    def sample_intervals(self, k: npt.ArrayLike, s: npt.ArrayLike) -> Sample:
        """q, v, a and tau in given intervals, so that both limits at a node are available.

        k: interval numbers, shape (M,). s: positions in [0, 1] in the interval, shape (M,).
        """
        return self._sampled(*self._checked(k, s))

    def _sampled(self, k: Index, s: Array) -> Sample:
        if self._sampler is not None:
            return self._complete(*self._sampler.in_intervals(k, s))
        return self._complete(k, s, *self._interpolate(k, s, 2))

    def _complete(
        self, k: Index, s: Array, q: Array, v: Array, a: Array, tau: Array | None = None
    ) -> Sample:
        return Sample(q, v, a, self.torques(k, s, (q, v, a)) if tau is None else tau)

    def torques(self, k: Index, s: Array, jet: tuple[Array, Array, Array]) -> Array:
        """tau in given intervals where (q, v, a) is known, shape (M, nv), in [N m] or [N].

        k, s: as for `sample_intervals`. jet: q of shape (M, nq), v and a of shape (M, nv).
        """
        if self.torque is not None:
            return self.torque(k, s)
        t = self.t[k] + s * self.grid.steps[k]
        if self.segments is not None:
            return self.segments.inverse_dynamics(k, jet, t)
        assert self.scene is not None
        return self.scene.inverse_dynamics(*jet, t)

    @cached_property
    def _curve(self) -> PathSampler | None:
        """Compiled samples of q, v and a; None on groups."""
        grid = self.grid
        path = vars(self.path), grid.t, grid.steps, grid.groups
        return None if self.space is not None else PathSampler(*path)

    @cached_property
    def _sampler(self) -> PathSampler | None:
        """The same with tau, where that is RNEA alone."""
        scenes = [] if self.scene is None else [self.scene]
        ends = [self.grid.intervals]
        if self.segments is not None:
            scenes, ends = list(self.segments.scenes), np.cumsum(self.segments.intervals).tolist()
        if self._curve is None or self.torque is not None:
            return self._curve
        return self._curve.with_torques([scene.torques for scene in scenes], ends)

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the compiled samplers, which cannot be pickled."""
        return {k: value for k, value in vars(self).items() if k not in ("_curve", "_sampler")}

    def _checked(self, k: npt.ArrayLike, s: npt.ArrayLike) -> tuple[Index, Array]:
        """Interval numbers and relative positions as arrays, (M,) each. Raises InputError."""
        numbers, positions = numbers_of("k", k, None), numbers_of("s", s, None)
        known = (numbers >= 0) & (numbers < self.grid.intervals) & (numbers == np.floor(numbers))
        if not known.all() or not ((positions >= 0) & (positions <= 1)).all():
            raise InputError(
                f"k must be interval numbers from 0 to {self.grid.intervals - 1} and s positions "
                f"from 0 to 1 within them, got k = {_span(numbers)}, s = {_span(positions)}."
            )
        require_shape("s", positions, len(numbers))
        return numbers.astype(np.intp), positions

    def _locate(self, t: npt.ArrayLike) -> tuple[Index, Array]:
        """The interval of each time, and the position in [0, 1] within it."""
        times = np.atleast_1d(np.asarray(t, dtype=np.float64))
        # rounding of the sums of steps
        slack = (4 + self.grid.intervals) * np.finfo(float).eps * self.duration
        if times.ndim != 1 or not np.isfinite(times).all():
            raise InputError(f"times must be finite and of shape (M,), not {times.shape}.")
        if times.size and not (-slack <= times.min() and times.max() <= self.duration + slack):
            raise InputError(
                f"the motion lasts from 0 to {self.duration:.17g} s, but a sample was requested at "
                f"{times.min() if times.min() < -slack else times.max():.17g} s."
            )
        nodes = self.t
        k = np.clip(np.searchsorted(nodes, times, side="right") - 1, 0, self.grid.intervals - 1)
        s = np.clip((times - nodes[k]) / self.grid.steps[k], 0.0, 1.0)
        s[times >= nodes[-1]] = 1.0
        return k, s

    def _interpolate(self, k: Index, s: Array, order: int) -> tuple[Array, ...]:
        """(q, v, ..., q^(order)), each (M, n): rows(s) @ (h v0, Z, c) in the interval's chart."""
        if self._curve is not None and 0 <= order <= 2:
            return self._curve.in_intervals(k, s)[2 : order + 3]  # type: ignore[return-value]
        commutes = self.space is None or self.space.flat
        most = max(3 if commutes else 2, self.grid.order)
        if not 0 <= order <= most:
            raise InputError(f"this motion has derivatives up to {most}, not {order}.")
        top = max(2, self.grid.order, order)
        h, path = self.grid.steps[k][:, None], self.path
        scaled = displacements(self.grid, path, k, s, top)
        x, *rates = (scaled[:, j] / h**j for j in range(top + 1))
        if self.space is None:
            return (path.q[k] + x, *rates)[: order + 1]
        if top > 2:  # on commutative groups
            return (self.space.integrate(path.q[k], x), *rates)[: order + 1]
        return Chart(self.space).jet(path.q[k], x, *rates)[: order + 1]

    def save(self, path: str | os.PathLike[str] | io.BytesIO, *, meshes: bool = True) -> None:
        """Write the motion to one npz file, atomically and with reproducible bytes.

        The file contains the scene with the text of the URDF; for a robot given as a Pinocchio
        model it contains the torques instead.
        path: the file, usually `*.npz`, or a stream.
        meshes: whether it contains the meshes of a robot that was loaded from a file, up to 20 MB.
        Raises TrajectoryFileError.
        """
        for scheme, _ in self.grid.groups:
            trajectory_file.require_known_name(scheme)
        arrays = {
            "steps": self.grid.steps,
            "q": self.path.q,
            "v": self.path.v,
            "z": self.path.z,
            "inner": self.path.inner,
            "momenta": self.momenta,
        }
        if self.path.higher.size:
            arrays[_HIGHER] = self.path.higher
        metadata = {"versions": dict(trajectory_file.versions()), **self.metadata}
        scene, segments = None, {}
        if self.robot is not None and self.robot.source.kind != "model":
            scene = None if self.scene is None else self.scene.to_dict()
            segments = {} if self.segments is None else self.segments.to_tables()
        else:
            metadata["coordinates"] = list(self.coordinate_names)
            if self.space is not None:
                metadata["space"] = list(self.space.parts)
            arrays[_TORQUE] = self._torque_values()
        header = {
            "schemes": [[name, len(list(run))] for name, run in itertools.groupby(self._names())],
            "metadata": metadata,
            "scene": scene,
            "scene_sha256": trajectory_file.digest(scene),
            **segments,
            **({"turns": dict(self.turns)} if self.turns else {}),
        }
        robots = {id(each.robot): each.robot for each in self.scenes}.values()
        kept = trajectory_file.meshes_of(robots) if meshes else {}
        trajectory_file.warn_of_hashes(kept)
        trajectory_file.write_arrays(path, header, arrays, kept)

    @classmethod
    def load(cls, path: str | os.PathLike[str], package_dirs: Iterable[str | Path] = ()) -> Self:
        """Read a file of `save`; everything in it is checked.

        package_dirs: folders with the packages of meshes that are not in the file.
        Raises TrajectoryFileError with one sentence about what is wrong with the file, ModelError
        for a package folder with the files of every user.
        """
        header, arrays = trajectory_file.read_arrays(path, _ARRAYS, optional=[_TORQUE, _HIGHER])
        files = absolute_folders(package_dirs), trajectory_file.read_meshes(path, header)
        try:
            schemes = trajectory_file.schemes_of(header["schemes"], arrays["inner"].shape)
            metadata = header["metadata"]
            if not isinstance(metadata, dict):
                raise InputError("the metadata is not a table")
            scene = trajectory_file.scene_of(header, *files)
            segments = SegmentScenes.from_tables(header, *files) if "segments" in header else None
            stored = scene is None and segments is None
            if stored:
                trajectory_file.require_names(metadata["coordinates"], arrays["v"].shape)
            loaded = cls(
                grid=Grid(arrays["steps"], schemes),
                path=DiscretePath(*(arrays[name] for name in _PATH if name in arrays)),
                momenta=arrays["momenta"],
                scene=scene,
                metadata=metadata,
                torque=StoredTorque(arrays[_TORQUE]) if stored else None,
                segments=segments,
                turns=header.get("turns", {}),
            )
            require_continuous(loaded.path, loaded.grid, loaded.space)
            trajectory_file.require_unchanged(header, arrays)
            return loaded
        except KeyError as error:
            raise TrajectoryFileError(
                f"trajectory file {Path(path).name!r} lacks {error.args[0]!r}."
            ) from error
        except (HoviError, TypeError, ValueError, AttributeError, IndexError) as error:
            raise TrajectoryFileError(
                f"trajectory file {Path(path).name!r} is inconsistent: {error}"
            ) from error

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """The scenes of its segments, or its own; none for a motion without one."""
        given = (self.scene,) if self.segments is None else self.segments.scenes
        return tuple(scene for scene in given if scene is not None)

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
    N, nv, robot = grid.intervals, path.v.shape[-1], trajectory.robot
    nq = path.q.shape[-1] if robot is None else robot.nq
    expected = {
        "q": (path.q, (N + 1, nq)),
        "v": (path.v, (N + 1, nv if robot is None else robot.nv)),
        "z": (path.z, (N, grid.order, nv)),
        "momenta": (trajectory.momenta, (N + 1, grid.order, nv)),
    }
    if grid.order > 2:
        expected["higher"] = (path.higher, (N + 1, grid.order - 2, nv))
    segments = trajectory.segments
    if segments is not None and (trajectory.scene, sum(segments.intervals)) != (None, N):
        raise InputError(
            f"a motion in segments has no scene of its own, and its segments need {N} intervals, "
            f"got {sum(segments.intervals)}."
        )
    if trajectory.torque is not None:
        points, given = trajectory.torque.values.shape[1:]
        expected["tau"] = (trajectory.torque.values, (N, points, nv if given else 0))
    for name, (array, shape) in expected.items():
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


def _span(values: Array) -> str:
    return f"{values.min():g} to {values.max():g}" if values.size else "none"
