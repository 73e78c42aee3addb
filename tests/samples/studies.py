"""Small studies of the two-link arm for tests."""

from __future__ import annotations

import hashlib
from pathlib import Path

from hovi.study.study import Study


def reaches(
    count: int = 24, warm: bool = False, samples: int = 0, sample_format: str = "parquet"
) -> Study:
    """Reaches to a line of goals; to a grid of them where they start from each other's motions."""
    first = {"field": "goal.q[0]", "grid": {"lower": 0.0, "upper": 0.8, "count": count // 4}}
    second = {"field": "goal.q[1]", "grid": {"lower": 0.2, "upper": 1.0, "count": 4}}
    stored = {"samples": samples, "sample_format": sample_format}
    return Study("two_link_reach", [first, second], warm=warm, **stored)


def digest(folder: Path, name: str = "plans.parquet") -> str:
    """The hash of a table."""
    return hashlib.sha256((folder / name).read_bytes()).hexdigest()
