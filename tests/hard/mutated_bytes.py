"""Random changes of bytes, independent of the file format."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from random import Random


def mutated_bytes(content: bytes, random: Random, tokens: Sequence[bytes]) -> bytes:
    """Apply one to four changes: flip bits, cut, truncate or duplicate parts, insert tokens.

    tokens: byte strings to insert.
    """
    changed = bytearray(content)
    for _ in range(random.randint(1, 4)):
        random.choice(_CHANGES)(changed, random, tokens)
    return bytes(changed)


def _flip(data: bytearray, random: Random, tokens: Sequence[bytes]) -> None:
    for _ in range(random.choice((1, 1, 2, 16))):
        if data:
            data[random.randrange(len(data))] ^= 1 << random.randrange(8)


def _cut(data: bytearray, random: Random, tokens: Sequence[bytes]) -> None:
    start, end = _part(data, random)
    del data[start:end]


def _truncate(data: bytearray, random: Random, tokens: Sequence[bytes]) -> None:
    del data[random.randint(0, len(data)) :]


def _double(data: bytearray, random: Random, tokens: Sequence[bytes]) -> None:
    start, end = _part(data, random)
    position = random.randint(0, len(data))
    data[position:position] = data[start:end]


def _insert(data: bytearray, random: Random, tokens: Sequence[bytes]) -> None:
    position = random.randint(0, len(data))
    data[position:position] = random.choice(tokens)


def _overwrite(data: bytearray, random: Random, tokens: Sequence[bytes]) -> None:
    start, end = _part(data, random)
    data[start:end] = random.choice(tokens)


def _part(data: bytearray, random: Random) -> tuple[int, int]:
    start = random.randint(0, len(data))
    return start, min(len(data), start + random.choice((1, 4, 20, 200)))


_CHANGES: tuple[Callable[[bytearray, Random, Sequence[bytes]], None], ...] = (
    _flip,
    _cut,
    _truncate,
    _double,
    _insert,
    _overwrite,
)
