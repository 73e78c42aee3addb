"""What an offline page tells meshcat, read from its text."""

from __future__ import annotations

import base64
import gzip
import itertools
import json
import re
from typing import Any

import umsgpack


def parts_of(page: str) -> list[bytes]:
    """The parts of all messages, each once."""
    packed = re.search(r"Promise\.all\((\[[^\]]+\])\.map\(unpacked\)\)", page)
    sizes = re.search(r"const ends = (\[[\d,]*\])", page)
    assert packed is not None
    assert sizes is not None
    _, small, *large = [gzip.decompress(base64.b64decode(each)) for each in json.loads(packed[1])]
    ends = [0, *itertools.accumulate(json.loads(sizes[1]))]
    return [*(small[a:b] for a, b in itertools.pairwise(ends)), *large]


def messages_of(page: str) -> list[dict[str, Any]]:
    """The messages, in order."""
    numbers = re.search(r"for \(const numbers of (\[.*\])\)", page)
    assert numbers is not None
    parts = parts_of(page)
    return [umsgpack.unpackb(b"".join(parts[i] for i in row)) for row in json.loads(numbers[1])]
