"""The installed version, in a module of its own since `importlib.metadata` is slow to import."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("hovi")
except PackageNotFoundError:  # a source tree that was never installed
    __version__ = "0+unknown"
