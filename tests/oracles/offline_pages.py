"""What an offline page tells meshcat, read from its text."""

from __future__ import annotations

import base64
import gzip
import itertools
import json
import re
from typing import Any

import umsgpack


def content_of(page: str) -> bytes:
    """The parts of all messages, each once."""
    packed = re.findall(r'unpacked\("([^"]+)"\)', page)
    assert len(packed) == 2
    return gzip.decompress(base64.b64decode(packed[1]))


def messages_of(page: str) -> list[dict[str, Any]]:
    """The messages, in order."""
    sizes = re.search(r"const ends = (\[[\d,]*\])", page)
    numbers = re.search(r"for \(const numbers of (\[.*\])\)", page)
    assert sizes is not None
    assert numbers is not None
    content = content_of(page)
    ends = [0, *itertools.accumulate(json.loads(sizes[1]))]
    parts = [content[a:b] for a, b in itertools.pairwise(ends)]
    return [umsgpack.unpackb(b"".join(parts[i] for i in row)) for row in json.loads(numbers[1])]
