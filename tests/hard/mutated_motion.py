"""Mutated trajectory files, and the properties of those that load.

A motion that loads must have finite samples, be continuous at its nodes, and be unchanged by saving
and loading it again.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import tempfile
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

import hovi
from hard import mutated_urdf
from hard.mutated_bytes import mutated_bytes
from hard.verdict import Mutant, Verdict, judge
from hovi.discrete.trajectory import Trajectory
from hovi.robot.bundled_models import example

TOKENS = (b"PK\x03\x04", b"PK\x01\x02", b"PK\x05\x06", b"\x93NUMPY", b"\0" * 8, b"\xff" * 8, b"nan")
UNUSUAL_VALUES: tuple[Any, ...] = (
    *(
        None,
        True,
        0,
        1,
        -1,
        10**30,
        0.5,
        float("nan"),
        float("inf"),
        1e308,
        "",
        "x",
        "\ud800",
        [],
        {},
    ),
    *(
        [["galerkin-2", 4]],
        [["galerkin-9999", 4]],
        [["galerkin-2", 10**9]],
        [[]],
        [[1, 2]],
        "0" * 64,
    ),
)

Entries = dict[str, bytes]
"""The members of the file: "header" is JSON, the others are npy arrays."""
Change = Callable[[Entries, Random], None]


@cache
def original() -> bytes:
    """The file of a motion of the two-link arm."""
    robot = hovi.load_robot(example("two_link.urdf"))
    scene = hovi.Scene(robot, effects=[hovi.effects.Gravity(9.8)])
    solution = hovi.plan(scene, [0.0, 0.0], [0.3, 0.7], 1.0, intervals=4, processes=1)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "motion.npz"
        solution.trajectory.save(path)
        return path.read_bytes()


def mutate(random: Random) -> Mutant:
    """A changed file: in its bytes, in its entries, or with an invalidating change."""
    kind = random.random()
    if kind < 0.4:
        return Mutant(mutated_bytes(original(), random, TOKENS))
    entries = unpacked(original())
    if kind < 0.75:
        for _ in range(random.randint(1, 3)):
            random.choice(_CHANGES)(entries, random)
        rehash(entries, random)
        return Mutant(packed(entries, random))
    change = random.choice(_INVALIDATING_CHANGES + _UNNOTICEABLE_CHANGES)
    change(entries, random)
    if change not in _UNNOTICEABLE_CHANGES:
        rehash(entries, random)
    return Mutant(packed(entries, random), (change.__doc__ or "").split("\n")[0])


def verdict(mutant: Mutant, folder: Path) -> tuple[Verdict, str]:
    """Load it from a file in `folder`."""
    path = folder / "motion.npz"
    path.write_bytes(mutant.content)
    return judge(lambda: Trajectory.load(path), lambda m: error_in(m, folder), mutant.reason)


def error_in(motion: Trajectory, folder: Path) -> str:
    """The error in a loaded motion; "" if there is none."""
    sample = motion.sample(np.linspace(0.0, motion.duration, 50))
    positions = motion.positions(np.linspace(0.0, motion.duration, 50))
    if not all(np.isfinite(part).all() for part in (*sample, positions)):
        return "its samples are not finite"
    inner = np.arange(motion.grid.intervals - 1)
    before = motion.sample_intervals(inner, np.ones(inner.size))
    if np.abs(before.q - motion.q[1:-1]).max(initial=0.0) > 1e-5 * (1 + np.abs(motion.q).max()):
        return "it jumps at a node"
    copy = folder / "copy.npz"
    motion.save(copy)
    for name in ("q", "v", "t"):
        if not np.array_equal(getattr(Trajectory.load(copy), name), getattr(motion, name)):
            return f"it changes its {name} when it is saved"
    return ""


def unpacked(content: bytes) -> Entries:
    """The entries of a file."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        entries = {name.removesuffix(".npy"): archive.read(name) for name in archive.namelist()}
    entries["header"] = entries["header"][entries["header"].index(b"\n") + 1 :]
    return entries


def packed(entries: Entries, random: Random) -> bytes:
    """The entries as a file."""
    stream = io.BytesIO()
    method = random.choice((zipfile.ZIP_STORED, zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    with zipfile.ZipFile(stream, "w", method) as archive:
        for name, data in entries.items():
            plain = name != "header" or data.startswith(b"\x93NUMPY")
            archive.writestr(f"{name}.npy", data if plain else _npy(np.frombuffer(data, np.uint8)))
    return stream.getvalue()


def _npy(array: Any) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.asarray(array), allow_pickle=True)
    return stream.getvalue()


def _array_of(entries: Entries, name: str) -> Any:
    return np.lib.format.read_array(io.BytesIO(entries[name])).copy()


def _names(entries: Entries) -> list[str]:
    return [name for name in entries if name != "header"] or ["q"]


def edit(entries: Entries, change: Callable[[dict[str, Any]], object]) -> None:
    """Change the header, unless an earlier change has removed what is changed."""
    try:
        header = json.loads(entries["header"])
        change(header)
    except (ValueError, AttributeError, LookupError, TypeError, RecursionError):
        return  # an earlier change has removed it
    entries["header"] = json.dumps(header).encode()


def _update_hashes(header: dict[str, Any]) -> None:
    """Recompute the hashes of the header, as an attacker can."""
    robot = header["scene"]["robot"]
    robot["sha256"] = hashlib.sha256(robot["urdf"].encode()).hexdigest()
    text = json.dumps(header["scene"], sort_keys=True)
    header["scene_sha256"] = hashlib.sha256(text.encode()).hexdigest()


def rehash(entries: Entries, random: Random) -> None:
    """Remove the hash of the contents, or recompute it, or leave the one of the original."""
    kind = random.random()
    if kind < 0.3:
        edit(entries, lambda header: header.pop("sha256"))
    elif kind < 0.7:
        with contextlib.suppress(Exception):  # an array cannot be read
            named = [name for name in entries if name != "header" and not name.startswith("mesh-")]
            arrays = {name: _array_of(entries, name) for name in named}
            edit(entries, lambda header: header.update(sha256=_contents_hash(header, arrays)))


def _contents_hash(header: dict[str, Any], arrays: dict[str, Any]) -> str:
    rest = {key: value for key, value in header.items() if key != "sha256"}
    content = json.dumps(rest, sort_keys=True).encode()
    for name, array in sorted(arrays.items()):
        content += f"{name} {array.shape}".encode() + array.tobytes()
    return hashlib.sha256(content).hexdigest()


# Changes after which the file may or may not be valid


def _header_value(entries: Entries, random: Random) -> None:
    def change(header: dict[str, Any]) -> None:
        table = header
        while True:
            key = random.choice(list(table))
            if not isinstance(table[key], dict) or not table[key] or random.random() < 0.3:
                break
            table = table[key]
        if random.random() < 0.2:
            del table[key]
        else:
            table[key] = random.choice(UNUSUAL_VALUES)

    edit(entries, change)
    if random.random() < 0.7:
        edit(entries, _update_hashes)


def _robot(entries: Entries, random: Random) -> None:
    urdf = mutated_urdf.mutate(random).content.decode(errors="replace")
    edit(entries, lambda header: header["scene"]["robot"].update(urdf=urdf))
    edit(entries, _update_hashes)


def _header_bytes(entries: Entries, random: Random) -> None:
    tokens = (b"{", b"]", b"NaN", b"1e999", b"[" * 9_000)
    entries["header"] = mutated_bytes(entries["header"], random, tokens)


def _remove(entries: Entries, random: Random) -> None:
    entries.pop(random.choice(list(entries)))
    entries.setdefault("header", b"{}")


def _array_bytes(entries: Entries, random: Random) -> None:
    name = random.choice(_names(entries))
    if name in entries:
        entries[name] = mutated_bytes(entries[name], random, TOKENS)


def _array_shape(entries: Entries, random: Random) -> None:
    name = random.choice(("q", "v", "z", "inner", "momenta", "steps"))
    shapes = ((0,), (1, 1), (5, 2), (4, 2, 2), (4, 5_000, 2), (10**5,), (2, 0, 3), (5, 2, 2), (4,))
    entries[name] = _npy(np.ones(random.choice(shapes)))


def _full_turns(entries: Entries, random: Random) -> None:
    joint, count = random.choice(["shoulder", "", "x"]), random.choice(UNUSUAL_VALUES)
    turns = random.choice([{joint: count}, count, {}])
    edit(entries, lambda header: header.update(turns=turns))


_CHANGES: tuple[Change, ...] = (
    _full_turns,
    *(
        _header_value,
        _header_value,
        _header_value,
        _robot,
        _header_bytes,
        _remove,
        _array_bytes,
        _array_shape,
    ),
)

# Changes that make the file invalid; the docstring is the reason


def _not_finite(entries: Entries, random: Random) -> None:
    """an array holds numbers that are not finite"""
    name = random.choice(("q", "v", "z", "momenta", "steps"))
    array = _array_of(entries, name)
    array.flat[random.randrange(array.size)] = random.choice((np.nan, np.inf, -np.inf))
    entries[name] = _npy(array)


def _beyond(entries: Entries, random: Random) -> None:
    """an array holds numbers beyond any motion"""
    name = random.choice(("q", "v", "z", "inner"))
    array = _array_of(entries, name)
    array.flat[random.randrange(array.size)] = random.choice((1e300, -1e308, 1e155, 1e60))
    entries[name] = _npy(array)


def _steps(entries: Entries, random: Random) -> None:
    """a step is not positive"""
    array = _array_of(entries, "steps")
    array[random.randrange(array.size)] = random.choice((0.0, -0.25, 1e-320, 1e300))
    entries["steps"] = _npy(array)


def _jump(entries: Entries, random: Random) -> None:
    """the nodes do not follow from each other"""
    name = random.choice(("q", "v", "z"))
    array = _array_of(entries, name)
    array.flat[random.randrange(array.size)] += random.choice((1e-2, -3.0, 1e6))
    entries[name] = _npy(array)


def _type(entries: Entries, random: Random) -> None:
    """an array is not one of doubles"""
    name = random.choice(("q", "v", "z", "momenta", "steps"))
    kind = random.choice((np.float32, np.int64, np.complex128, ">f8", "U8", np.float16))
    entries[name] = _npy(_array_of(entries, name).astype(kind))


def _pickle(entries: Entries, random: Random) -> None:
    """an array is a pickle"""
    name = random.choice(("q", "v", "z", "momenta", "steps"))
    entries[name] = _npy(np.array([{"a": 1}, None], dtype=object))


def _bomb(entries: Entries, random: Random) -> None:
    """an array claims more numbers than it holds"""
    shapes = ("(10**18, 2)", "(1000000000000, 2)", "(-1, 2)", "(5, 3)", "(2**63,)")
    odd = ("(True, 10)", "(0, 10000000000000000000000)", "(5, False)", "((),)", f"({'1,' * 70})")
    shape = random.choice((*shapes, *odd))
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    data = b"\0" * random.choice((0, 80, 10_000_000))
    start = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header
    entries[random.choice(("q", "v", "z"))] = start + data


def _scene(entries: Entries, random: Random) -> None:
    """the scene is not the one whose hash is written"""

    def change(header: dict[str, Any]) -> None:
        robot = header["scene"]["robot"]
        robot["urdf"] = robot["urdf"].replace("0.375", random.choice(("0.376", "NaN", "-1")))

    edit(entries, change)


def _number(entries: Entries, random: Random) -> None:
    """the header holds a number that is not finite"""
    value = random.choice((float("nan"), float("inf"), -float("inf")))
    edit(entries, lambda header: header["metadata"].update(cost=value))


_INVALIDATING_CHANGES: tuple[Change, ...] = (
    *(_not_finite, _beyond, _steps, _jump, _type, _pickle, _bomb, _scene, _number),
)

# Changes to another motion, which only the hash of the contents shows; the docstring is the reason


def _momenta(entries: Entries, random: Random) -> None:
    """the momenta or the inner modes are edited"""
    name = random.choice(("momenta", "momenta", "inner"))
    array = _array_of(entries, name)
    array.flat[random.randrange(array.size)] += random.choice((1e-9, 0.1, -3.0, 1e6))
    entries[name] = _npy(array)


def _other_scheme(entries: Entries, random: Random) -> None:
    """the scheme is another one"""
    schemes = ("galerkin-0", "galerkin-1", "hermite-simpson", "taylor-midpoint")
    name = random.choice(schemes)
    edit(entries, lambda header: header.update(schemes=[[name, 4]]))


def _metadata(entries: Entries, random: Random) -> None:
    """the cost or the status is edited"""
    key, value = random.choice((("cost", 1.0), ("cost", -1), ("status", "x"), ("status", 7)))
    edit(entries, lambda header: header["metadata"].update({key: value}))


_UNNOTICEABLE_CHANGES: tuple[Change, ...] = (_momenta, _momenta, _other_scheme, _metadata)
