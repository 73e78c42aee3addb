"""The folder of a study: which study it is, and that one run at a time uses it."""

from __future__ import annotations

import fcntl
import json
import os
import time
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
TRIES, TRY_AGAIN_SECONDS = 5, 0.02
"""How often a run tries to lock its folder, and after what time in [s]: `in_use` of another process
holds the lock for some microseconds."""


@dataclass(frozen=True)
class About:
    """Which study a folder holds.

    scene: the hash of its template. version: of hovi.
    text: of STUDY.toml, or the same as JSON. source: the path of the scene file.
    count: of all plans; None where an earlier version began it.
    coordinates: names of the entries of q with their units, such as "elbow [rad]"; none where they
        differ between plans.
    """

    scene: str
    version: str
    text: str = ""
    source: str = ""
    count: int | None = None
    coordinates: tuple[str, ...] = ()

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
            count, names = data.get("count"), data.get("coordinates", ())
            if not all(isinstance(text, str) for text in (*texts.values(), *names)):
                raise TypeError
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            raise StudyError(
                f"{path} is not the {ABOUT} of a study of this version of hovi: choose another "
                "folder, or remove this one."
            ) from None
        return cls(**texts, count=None if count is None else int(count), coordinates=tuple(names))


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
        if not _locked(descriptor):
            raise StudyError(
                f"another run is working on the study in {folder}: wait for it, or end it."
            )
        yield
    finally:
        os.close(descriptor)


def _locked(descriptor: int) -> bool:
    """Whether the lock was got: not while another run has it, but after one who only looked."""
    for _ in range(TRIES):
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            time.sleep(TRY_AGAIN_SECONDS)
            continue
        return True
    return False


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
