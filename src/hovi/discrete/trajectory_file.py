"""The file format of trajectories: arrays of doubles, meshes and one JSON header in an npz file.

The file is a plain npz that `numpy.load(path, allow_pickle=False)` reads. It is written without
compression and with fixed time stamps, so that the same motion gives the same bytes on every
machine. A mesh is an entry "mesh-" with the SHA-256 of its content, of bytes that `zlib.decompress`
unpacks; the header maps its names in the URDF to that hash. Files are untrusted input: sizes are
checked before memory is allocated, and pickles are never decoded. The header holds the SHA-256 of
the file's contents, which shows changes by accident or by hand; it is no signature.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import io
import json
import math
import os
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import MAX_INTERVALS
from hovi.errors import HoviError, InputError, TrajectoryFileError, warn
from hovi.robot.geometry import stored_meshes
from hovi.robot.meshes.stored_meshes import (
    MAX_KEPT_BYTES,
    StoredMeshes,
    from_table,
    hashes_in,
    to_table,
)
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import Scheme, by_name
from hovi.system.files import reason, require_file, whole_file

Array = npt.NDArray[np.float64]

FORMAT = "hovi-trajectory"
VERSION = 2
_WITHOUT_MESHES = 1
"""Version of files without meshes, which earlier versions of hovi read."""
MAX_BYTES = 2**30
MAX_HEADER_BYTES = 2**26
MAX_HEADER_PARTS = 2_000_000
"""Maximum number of lists, tables and entries, which take thirty times their size in memory."""
MAX_EXPANSION = 50
"""Maximum ratio of unpacked to packed size; real data compresses less."""
_MARGIN = 2**16  # overhead of zip and npy
_ARRAY_HEADER = 128  # bytes before those of a mesh
_HEADER = "header"
_MESHES, _MESH = "meshes", "mesh-"
_ZIP = b"PK"
"""What every zip file, and so every npz, begins with."""
_HASH = "sha256"
_DOUBLES = np.dtype("<f8")
_BYTES = np.dtype("u1")


def write_arrays(
    path: str | os.PathLike[str] | BinaryIO,
    header: Mapping[str, Any],
    arrays: Mapping[str, Array],
    meshes: Mapping[str, StoredMeshes] | None = None,
) -> None:
    """Write a header and named arrays to one npz, atomically and with reproducible bytes.

    path: the file; an existing one is replaced. Or a stream, which gets the bytes.
    header: JSON-compatible data.
    arrays: finite doubles of any shape, by name.
    meshes: of robots by the sha256 of their URDFs.
    Raises TrajectoryFileError.
    """
    packed = {key: file for each in (meshes or {}).values() for key, file in each.packed.items()}
    header = {**header, _MESHES: to_table(meshes)} if meshes else header
    doubles = {name: np.ascontiguousarray(array, _DOUBLES) for name, array in arrays.items()}
    entries: dict[str, npt.NDArray[Any]] = {_HEADER: _encode_header(header, doubles)}
    if entries[_HEADER].nbytes > MAX_HEADER_BYTES:
        raise TrajectoryFileError(
            f"the scene and metadata take {entries[_HEADER].nbytes} bytes, but a trajectory file "
            f"can have at most {MAX_HEADER_BYTES}."
        )
    entries |= doubles
    entries |= {f"{_MESH}{key}": np.frombuffer(file, _BYTES) for key, file in packed.items()}
    size = sum(entry.nbytes for entry in entries.values())
    if size > MAX_BYTES:
        raise TrajectoryFileError(
            f"this trajectory takes {size} bytes, but a file can have at most {MAX_BYTES}."
        )
    try:
        with _destination(path) as stream, zipfile.ZipFile(stream, "w") as archive:
            for name, entry in entries.items():
                info = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
                info.external_attr = 0o644 << 16
                info.create_system = 3  # the default depends on the operating system
                with archive.open(info, "w") as member:
                    np.lib.format.write_array(member, entry, version=(1, 0), allow_pickle=False)
    except OSError as error:
        raise TrajectoryFileError(f"cannot write {str(path)!r}: {reason(error)}.") from error


def _destination(path: str | os.PathLike[str] | BinaryIO) -> AbstractContextManager[BinaryIO]:
    return whole_file(path) if isinstance(path, str | os.PathLike) else nullcontext(path)


def read_arrays(
    path: str | os.PathLike[str], names: Iterable[str], optional: Iterable[str] = ()
) -> tuple[dict[str, Any], dict[str, Array]]:
    """Read the header and the named arrays of a trajectory file.

    names: required arrays. optional: further arrays that are read if present.
    Returns the header and the arrays, finite doubles of any shape.
    Raises TrajectoryFileError with one sentence about what is wrong with the file.
    """
    label = _label(path)
    with _opened(path, label) as archive:
        members = {info.filename: info for info in archive.infolist()}
        entry_names = [_HEADER, *names]
        entry_names += [name for name in optional if f"{name}.npy" in members]
        _check_members(members, entry_names, label)
        _check_expansion(members, entry_names, Path(path).stat().st_size, label)
        raw = {name: archive.read(members[f"{name}.npy"]) for name in entry_names}
    header = _decode_header(_decode_array(raw.pop(_HEADER), _BYTES, f"{label}, header"), label)
    return header, {name: _decode_doubles(raw[name], f"{label}, {name!r}") for name in raw}


def read_meshes(path: str | os.PathLike[str], header: Mapping[str, Any]) -> dict[str, StoredMeshes]:
    """The meshes of robots in a trajectory file, by the sha256 of their URDFs.

    header: the result of `read_arrays`. Raises TrajectoryFileError.
    """
    if _MESHES not in header:
        return {}
    label = _label(path)
    try:
        names = [f"{_MESH}{each}" for each in hashes_in(header[_MESHES])]
        with _opened(path, label) as archive:
            members = {info.filename: info for info in archive.infolist()}
            _check_members(members, [_HEADER, *names], label)
            size = sum(members[f"{name}.npy"].file_size for name in names)
            if size > MAX_KEPT_BYTES + len(names) * _ARRAY_HEADER:
                raise InputError(f"its meshes take {size} bytes, more than {MAX_KEPT_BYTES}")
            raw = {name: archive.read(members[f"{name}.npy"]) for name in names}
        packed = {
            name.removeprefix(_MESH): _decode_array(raw[name], _BYTES, f"{label}, {name!r}")
            for name in names
        }
        return from_table(header[_MESHES], {key: each.tobytes() for key, each in packed.items()})
    except InputError as error:
        raise TrajectoryFileError(f"{label} is inconsistent: {error}.") from error


def _label(path: str | os.PathLike[str]) -> str:
    return f"trajectory file {Path(path).name!r}"


@contextmanager
def _opened(path: str | os.PathLike[str], label: str) -> Iterator[zipfile.ZipFile]:
    """The archive, whose errors in the block become TrajectoryFileErrors of one sentence."""
    try:
        require_file(path, MAX_BYTES + _MARGIN)
        if _first_bytes(path) != _ZIP:
            raise TrajectoryFileError(
                f"{label} is not a motion: expected an .npz file, as `hovi plan --out` writes it."
            )
        with zipfile.ZipFile(path) as archive:
            if len({info.filename for info in archive.infolist()}) < len(archive.infolist()):
                raise ValueError("an entry occurs twice")
            yield archive
    except HoviError:
        raise
    except FileNotFoundError as error:
        raise TrajectoryFileError(f"there is no {label}.") from error
    except OSError as error:
        raise TrajectoryFileError(f"cannot read {label}: {reason(error)}.") from error
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, ValueError) as error:
        raise TrajectoryFileError(f"{label} is not a complete npz file: {error}.") from error
    except Exception as error:  # such as zlib.error: each compression has its own
        raise TrajectoryFileError(f"{label} is damaged: {error}.") from error


def _first_bytes(path: str | os.PathLike[str]) -> bytes:
    with Path(path).open("rb") as stream:
        return stream.read(len(_ZIP))


def require_unchanged(header: Mapping[str, Any], arrays: Mapping[str, Array]) -> None:
    """Raise InputError if a header and arrays of `read_arrays` are not those that were written.

    Warns about a file of an earlier version of hovi, which has no hash.
    """
    if _HASH not in header:
        message = "the file has no SHA-256 of its contents, so a change of them would not show."
        warn(message)
    elif header[_HASH] != _digest(header, arrays):
        raise InputError("its contents do not match their stored SHA-256")


def require_known_name(scheme: Scheme) -> None:
    """Raise TrajectoryFileError for a scheme that cannot be restored from its name."""
    try:
        same = np.array_equal(by_name(scheme.name).table, scheme.table)
    except HoviError:
        same = False
    if not same:
        raise TrajectoryFileError(
            f"the scheme {scheme.name!r} cannot be restored from its name; "
            "use a scheme of hovi.schemes.by_name."
        )


def schemes_of(runs: Any, inner: tuple[int, ...]) -> tuple[Scheme, ...]:
    """One scheme per interval from [name, count] pairs; `inner` is the shape of the inner modes."""
    if not isinstance(runs, list) or not all(isinstance(run, list) for run in runs):
        raise InputError("the schemes are not a list of [name, count]")
    schemes: list[Scheme] = []
    for name, count in runs:
        if not isinstance(name, str) or type(count) is not int or not 0 < count <= MAX_INTERVALS:
            raise InputError(f"{[name, count]!r} is not a scheme's name and a count")
        modes = name.rpartition("-")[2]
        if modes.isdecimal() and int(modes) > inner[1]:
            raise InputError(f"the scheme {name!r} has more inner modes than the file")
        schemes += [by_name(name)] * count
        if len(schemes) > inner[0]:
            raise InputError("there are more schemes than intervals")
    return tuple(schemes)


def scene_of(
    header: Mapping[str, Any],
    package_dirs: Iterable[str | Path],
    meshes: Mapping[str, StoredMeshes],
) -> Scene | None:
    """The scene in a header; None without one. Raises InputError for another than was written."""
    description = header["scene"]
    if description is None:
        return None
    if digest(description) != header["scene_sha256"]:
        raise InputError("its scene does not match the stored SHA-256")
    return Scene.from_dict(description, package_dirs, meshes)


@lru_cache(maxsize=4)
def meshes_of(robots: Iterable[Robot]) -> dict[str, StoredMeshes]:
    """The meshes that the file of a motion keeps, by the sha256 of their URDFs."""
    return stored_meshes(robot.source for robot in robots)


def warn_of_hashes(meshes: Mapping[str, StoredMeshes]) -> None:
    """Warn of meshes that a motion does not keep, since they are too large."""
    left = {name for each in meshes.values() for name in each.meshes if not each.keeps(name)}
    if left:
        warn(
            f"{len(left)} of the robot's meshes take more than {MAX_KEPT_BYTES / 1e6:.0f} MB, so "
            "that the motion keeps their names and hashes alone: to show it elsewhere, name the "
            "folder of their package in package_dirs or --package-dir."
        )


def require_names(names: Any, shape: tuple[int, ...]) -> None:
    """Raise InputError unless there is a name for each of the velocities, shape (N + 1, nv)."""
    if not isinstance(names, list) or len(names) != shape[-1]:
        raise InputError(f"{shape[-1]} names of coordinates are needed")
    if not all(isinstance(name, str) for name in names):
        raise InputError("the names of the coordinates are not all strings")


def _digest(header: Mapping[str, Any], arrays: Mapping[str, Array]) -> str:
    """SHA-256 of a decoded header without its hash, and of the arrays, in hexadecimal."""
    rest = {key: value for key, value in header.items() if key != _HASH}
    digest = hashlib.sha256(json.dumps(rest, sort_keys=True).encode())
    for name in sorted(arrays):
        digest.update(f"{name} {arrays[name].shape}".encode())
        digest.update(np.ascontiguousarray(arrays[name], _DOUBLES).tobytes())
    return digest.hexdigest()


def _check_members(members: Mapping[str, zipfile.ZipInfo], names: list[str], label: str) -> None:
    missing = [name for name in names if f"{name}.npy" not in members]
    if missing:
        raise TrajectoryFileError(f"{label} lacks the entry {missing[0]!r}.")
    header = members[f"{_HEADER}.npy"].file_size
    size = sum(members[f"{name}.npy"].file_size for name in names)
    if size > MAX_BYTES + _MARGIN:
        raise TrajectoryFileError(f"{label} holds {size} bytes, more than the {MAX_BYTES} allowed.")
    if header > MAX_HEADER_BYTES + _MARGIN:
        raise TrajectoryFileError(
            f"{label} has a header of {header} bytes, more than the {MAX_HEADER_BYTES} allowed."
        )


def _check_expansion(
    members: Mapping[str, zipfile.ZipInfo], names: list[str], packed: int, label: str
) -> None:
    size = sum(members[f"{name}.npy"].file_size for name in names)
    if size > MAX_EXPANSION * packed + 10_000_000:
        raise TrajectoryFileError(
            f"{label} has {packed} bytes and would unpack to {size}: this is not a motion."
        )


def _encode_header(header: Mapping[str, Any], arrays: Mapping[str, Array]) -> npt.NDArray[np.uint8]:
    version = VERSION if _MESHES in header else _WITHOUT_MESHES
    complete = {"format": FORMAT, "version": version, **header}
    try:
        decoded = json.loads(json.dumps(complete, allow_nan=False))  # keys become strings
        decoded[_HASH] = _digest(decoded, arrays)
        text = json.dumps(decoded, sort_keys=True, separators=(",", ":"))
    except (TypeError, ValueError) as error:
        raise TrajectoryFileError(f"the metadata cannot be written as JSON: {error}.") from error
    return np.frombuffer(text.encode(), np.uint8)


def _decode_header(data: npt.NDArray[Any], label: str) -> dict[str, Any]:
    text = data.tobytes()
    if sum(map(text.count, (b"[", b"{", b","))) > MAX_HEADER_PARTS:
        raise TrajectoryFileError(
            f"{label} has a header of more than {MAX_HEADER_PARTS:,} parts, the maximum."
        )
    try:
        header = json.loads(text, parse_float=_finite, parse_constant=_finite)
    except (ValueError, RecursionError) as error:
        raise TrajectoryFileError(f"{label} has a header that is not JSON: {error}.") from error
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise TrajectoryFileError(f"{label} is not a hovi trajectory.")
    if header.get("version") not in (_WITHOUT_MESHES, VERSION):
        raise TrajectoryFileError(
            f"{label} has format version {header.get('version')!r}, but this version of hovi reads "
            f"versions up to {VERSION}."
        )
    return header


def _finite(text: str) -> float:
    """A finite number; Python's JSON parser accepts NaN, and reads 1e999 as infinity."""
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text[:40]} is not a finite number")
    return number


def _decode_array(raw: bytes, dtype: np.dtype[Any], label: str) -> npt.NDArray[Any]:
    """Decode one npy entry. numpy.load would allocate the size in its header before checking it."""
    stream = io.BytesIO(raw)
    try:
        if np.lib.format.read_magic(stream) != (1, 0):
            raise ValueError("it is not in npy format 1.0")
        shape, fortran, found = np.lib.format.read_array_header_1_0(stream)
    except Exception as error:  # the header is a Python literal: anything can be wrong with it
        raise TrajectoryFileError(f"{label}: not a readable array: {error}.") from error
    if found != dtype or fortran:
        raise TrajectoryFileError(f"{label}: expected {dtype} in C order, the file has {found}.")
    data = memoryview(raw)[stream.tell() :]
    sizes = all(type(size) is int and size >= 0 for size in shape)  # True is an int, too
    if not sizes or len(data) != math.prod(shape) * dtype.itemsize:
        raise TrajectoryFileError(f"{label}: shape {shape} does not fit its {len(data)} bytes.")
    try:
        return np.frombuffer(data, dtype).reshape(shape)
    except (ValueError, OverflowError) as error:  # too many dimensions; a zero next to large sizes
        raise TrajectoryFileError(f"{label}: no array has the shape {shape}.") from error


def _decode_doubles(raw: bytes, label: str) -> Array:
    array = np.array(_decode_array(raw, _DOUBLES, label), dtype=np.float64)
    if not np.isfinite(array).all():
        raise TrajectoryFileError(f"{label}: holds numbers that are not finite.")
    return array


@cache
def versions() -> Mapping[str, str]:
    """Versions of hovi and the libraries that computed the motion."""
    found = {}
    for name in ("hovi", "pin", "casadi"):
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found


def digest(description: Any) -> str:
    """SHA-256 of a scene as canonical JSON, in hexadecimal."""
    return hashlib.sha256(json.dumps(description, sort_keys=True).encode()).hexdigest()
