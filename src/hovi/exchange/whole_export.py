"""Files of other formats, written completely or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from hovi.errors import DisplayError
from hovi.system.files import reason, whole_file


@contextlib.contextmanager
def whole_export(path: str | os.PathLike[str], what: str) -> Iterator[BinaryIO]:
    """A binary file that replaces `path` only if the block ends without an exception.

    what: the kind of file, for the message. Raises DisplayError where it cannot be written.
    """
    try:
        with whole_file(path) as stream:
            yield stream
    except OSError as error:
        raise DisplayError(f"cannot write the {what} {str(path)!r}: {reason(error)}.") from error


@contextlib.contextmanager
def written_elsewhere(path: str | os.PathLike[str], what: str) -> Iterator[Path]:
    """A path in a private folder, for libraries that take a path; the file there becomes `path`.

    It has the suffix of `path`. Raises DisplayError where one of the two cannot be written.
    """
    with whole_export(path, what) as stream, tempfile.TemporaryDirectory() as folder:
        elsewhere = Path(folder) / f"motion{Path(path).suffix}"
        yield elsewhere
        stream.write(elsewhere.read_bytes())
