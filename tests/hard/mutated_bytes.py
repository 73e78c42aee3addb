"""Changes to a text that know nothing of what it means."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from random import Random


def mutated_bytes(content: bytes, random: Random, tokens: Sequence[bytes]) -> bytes:
    """One to four changes: bits flipped, parts cut, doubled or moved, tokens put in.

    tokens: what is worth putting in.
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
    begin, end = _part(data, random)
    del data[begin:end]


def _truncate(data: bytearray, random: Random, tokens: Sequence[bytes]) -> None:
    del data[random.randint(0, len(data)) :]


def _double(data: bytearray, random: Random, tokens: Sequence[bytes]) -> None:
    begin, end = _part(data, random)
    place = random.randint(0, len(data))
    data[place:place] = data[begin:end]


def _insert(data: bytearray, random: Random, tokens: Sequence[bytes]) -> None:
    place = random.randint(0, len(data))
    data[place:place] = random.choice(tokens)


def _overwrite(data: bytearray, random: Random, tokens: Sequence[bytes]) -> None:
    begin, end = _part(data, random)
    data[begin:end] = random.choice(tokens)


def _part(data: bytearray, random: Random) -> tuple[int, int]:
    begin = random.randint(0, len(data))
    return begin, min(len(data), begin + random.choice((1, 4, 20, 200)))


_CHANGES: tuple[Callable[[bytearray, Random, Sequence[bytes]], None], ...] = (
    _flip,
    _cut,
    _truncate,
    _double,
    _insert,
    _overwrite,
)
