"""A folder that only this user and the administrator can change, and all folders above it.

Whoever can write to a folder above can put another one in its place, so each is opened and checked
in turn, from the root down, by the descriptor of the one before: a path that is checked by its name
may lead elsewhere a moment later.
"""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Sequence
from pathlib import Path
from typing import Self

_FOLDER = os.O_PATH | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_MAX_LINKS = 40
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


class UnsafeFolderError(Exception):
    """Somebody else could change a folder.

    folder: which one. fault: what is wrong with it.
    """

    def __init__(self, folder: str, fault: str) -> None:
        super().__init__(f"{folder} {fault}")
        self.folder, self.fault = folder, fault


def private_folder(above: Path, names: Sequence[str]) -> Path:
    """The real path of above/names[0]/names[1]/..., created with mode 0700 where it is missing.

    The folders of `names` must belong to this user, and nobody else may write to them. Those above
    may belong to the administrator too, and be shared as /tmp is: with the sticky bit, entries can
    be replaced by their owners only. Symbolic links are followed above, and not in `names`.

    above: an absolute path.
    Raises UnsafeFolderError, and OSError if a folder cannot be created or opened.
    """
    with _Descent() as descent:
        descent.follow(above.parts[1:])
        for name in names:
            descent.enter(name)
        return descent.path


def is_private_file(descriptor: int) -> bool:
    """Whether an open file is a regular one of this user that nobody else may write to."""
    found = os.fstat(descriptor)
    is_own = stat.S_ISREG(found.st_mode) and found.st_uid == os.geteuid()
    return is_own and not found.st_mode & _OTHERS_WRITE


class _Descent:
    """The folder that was reached from the root, with every folder on the way checked."""

    def __init__(self) -> None:
        self._names: list[str] = []
        self._descriptor = os.open("/", _FOLDER)
        self._administrators = {0, os.fstat(self._descriptor).st_uid}
        """Whoever owns the root can change everything below it."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        os.close(self._descriptor)

    @property
    def path(self) -> Path:
        """The path of the folder, without links."""
        return Path("/", *self._names)

    def follow(self, names: Sequence[str]) -> None:
        """Go down, through symbolic links too; the folders may be the administrator's."""
        self._check(self._administrators)
        waiting, links = list(reversed(names)), 0
        while waiting:
            name = waiting.pop()
            target = self._link(name)
            if target is None:
                self._open(name)
                self._check(self._administrators)
                continue
            links += 1
            if links > _MAX_LINKS:
                raise UnsafeFolderError(str(self.path / name), "is a link without an end")
            if target.startswith("/"):
                self._restart()
            waiting += reversed([part for part in target.split("/") if part not in ("", ".")])

    def enter(self, name: str) -> None:
        """Go down to a folder of this user."""
        if self._link(name) is not None:
            raise UnsafeFolderError(str(self.path / name), "is a symbolic link")
        self._open(name)
        self._check(set())

    def _check(self, owners: set[int]) -> None:
        found = os.fstat(self._descriptor)
        if found.st_uid not in {*owners, os.geteuid()}:
            raise UnsafeFolderError(str(self.path), "belongs to another user")
        is_shared = bool(owners) and found.st_mode & stat.S_ISVTX
        if found.st_mode & _OTHERS_WRITE and not is_shared:
            raise UnsafeFolderError(str(self.path), "may be written to by others")

    def _link(self, name: str) -> str | None:
        """Where a symbolic link of somebody trusted leads; None for anything else."""
        try:
            found = os.stat(name, dir_fd=self._descriptor, follow_symlinks=False)
        except FileNotFoundError:
            return None
        if not stat.S_ISLNK(found.st_mode):
            return None
        if found.st_uid not in {*self._administrators, os.geteuid()}:
            raise UnsafeFolderError(str(self.path / name), "is a symbolic link of another user")
        return os.readlink(name, dir_fd=self._descriptor)

    def _open(self, name: str) -> None:
        try:
            below = os.open(name, _FOLDER, dir_fd=self._descriptor)
        except FileNotFoundError:
            with contextlib.suppress(FileExistsError):  # another process was faster
                os.mkdir(name, 0o700, dir_fd=self._descriptor)
            below = os.open(name, _FOLDER, dir_fd=self._descriptor)
        os.close(self._descriptor)
        self._descriptor = below
        if name == "..":
            del self._names[-1:]
        else:
            self._names.append(name)

    def _restart(self) -> None:
        os.close(self._descriptor)
        self._descriptor = os.open("/", _FOLDER)
        self._names = []
