"""The folder for files that can be made again."""

from __future__ import annotations

import os
from pathlib import Path


def cache_home() -> Path:
    """$XDG_CACHE_HOME if that is an absolute path, else ~/.cache.

    Raises RuntimeError for a user without a home folder.
    """
    named = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return named if named.is_absolute() else Path.home() / ".cache"
