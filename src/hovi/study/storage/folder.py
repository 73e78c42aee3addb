"""The folder of a study: which study it is, and that one run at a time uses it."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from hovi.errors import StudyError
from hovi.study.storage.journal import FOLDER
from hovi.system.dataclass import dataclass
from hovi.system.files import make_folders, names_file, reason, require_file, whole_file

ABOUT = "study.json"
"""The file that says which study a folder holds."""
FORMAT = "hovi-study"
VERSION = 1
_MAX_BYTES = 64_000_000


@dataclass(frozen=True)
class About:
    """Which study a folder holds.

    scene: the hash of its template. version: of hovi.
    text: of STUDY.toml, or the same as JSON. source: the path of the scene file.
    """

    scene: str
    version: str
    text: str = ""
    source: str = ""

    @property
    def identity(self) -> tuple[str, str]:
        """What a study has to have in common with the folder's one to be continued there."""
        return self.scene, self.version

    def write(self, folder: Path) -> None:
        """Write the file. Raises StudyError."""
        data = {"format": FORMAT, "format_version": VERSION, **self.__dict__}
        write_whole(folder / ABOUT, json.dumps(data, indent=1, sort_keys=True).encode() + b"\n")

    @classmethod
    def read(cls, folder: Path) -> Self | None:
        """From the file; None if there is none. Raises StudyError."""
        path = folder / ABOUT
        if not names_file(path):
            return None
        try:
            require_file(path, _MAX_BYTES)
            data = json.loads(path.read_bytes())
            if data["format"] != FORMAT or data["format_version"] > VERSION:
                raise ValueError("another format")
            texts = {name: data[name] for name in ("scene", "version", "text", "source")}
            if not all(isinstance(text, str) for text in texts.values()):
                raise TypeError
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            raise StudyError(
                f"{path} is not the {ABOUT} of a study of this version of hovi: choose another "
                "folder, or remove this one."
            ) from None
        return cls(**texts)


@contextmanager
def used_alone(folder: Path) -> Iterator[None]:
    """The folder, created if need be, which no other run uses. Raises StudyError."""
    try:
        make_folders(folder / FOLDER)
        descriptor = os.open(folder / ".lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    except OSError as refused:
        raise StudyError(f"{folder} cannot be written: {reason(refused)}.") from None
    except ValueError:
        raise StudyError(f"no folder can have the name {str(folder)!r}.") from None
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise StudyError(
                f"another run is working on the study in {folder}: wait for it, or end it."
            ) from None
        yield
    finally:
        os.close(descriptor)


def in_use(folder: Path) -> bool:
    """Whether a run is working on the study in a folder."""
    try:
        with (folder / ".lock").open("rb") as lock:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except OSError:
        return True
    return False


def write_whole(path: Path, content: bytes) -> None:
    """Write a file. Raises StudyError."""
    try:
        with whole_file(path) as stream:
            stream.write(content)
    except OSError as refused:
        raise StudyError(f"{path} cannot be written: {reason(refused)}.") from None
