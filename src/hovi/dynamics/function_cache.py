"""Compiles CasADi functions to C libraries, cached in the user's own cache folder.

The folder is `hovi/compiled` in $XDG_CACHE_HOME or ~/.cache. The name of a library is the SHA-256
of its source and compiler, and its own SHA-256 is stored next to it and checked before loading.
No library is loaded from anywhere else, nor while another user could change the folder or one above
it; this is checked immediately before a library is loaded, since it may take seconds to build.
"""

from __future__ import annotations

import functools
import hashlib
import os
import platform
import shutil
import signal
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path

import casadi as ca

from hovi.errors import HoviError
from hovi.system.cache_home import cache_home
from hovi.system.deadline import OutOfTimeError, time_left
from hovi.system.files import reason, whole_file
from hovi.system.private_folder import UnsafeFolderError, is_private_file, private_folder

COMPILERS = ("cc", "gcc")
FLAGS = ("-O1", "-ffp-contract=off", "-fPIC", "-shared", "-s")
"""Without fused multiply-add, so that results equal the interpreter's; -O2 takes longer to compile
and is not faster."""

_OTHERWISE = "or leave compile=False."


class CompilationError(HoviError):
    """A function cannot be compiled, or its library cannot be stored safely."""


def compiled(function: ca.Function) -> ca.Function:
    """The same function as compiled C code.

    function: made of expressions only, without solvers or callbacks.
    Raises CompilationError without a C compiler or a folder that is safe to load from, and
    OutOfTimeError if it is not built at the deadline in force.
    """
    from hovi.version import __version__  # slow to import

    code = c_code(function)
    folder = library_folder()
    source_hash = _digest(code, *FLAGS, ca.CasadiMeta.version(), __version__, *_platform())
    compiler = next(filter(None, map(shutil.which, COMPILERS)), None)
    if compiler is None:
        library = next(filter(_is_intact, sorted(folder.glob(f"{source_hash}-*.so"))), None)
        if library is None:
            raise CompilationError(
                f"compile=True needs a C compiler named {' or '.join(COMPILERS)}, and PATH has "
                f"none: install one, {_OTHERWISE}"
            )
        return _load(function.name(), library)
    library = folder / f"{source_hash}-{_digest(_identity(compiler))}.so"
    if not _is_intact(library):
        _build(compiler, function.name(), code, library)
        if library_folder() != folder:
            raise CompilationError(
                f"{folder} was exchanged while a library was built: compile again, {_OTHERWISE}"
            )
    return _load(function.name(), library)


def c_code(function: ca.Function) -> str:
    """The function as C code, identical in every process."""
    generator = ca.CodeGenerator("function.c", {"with_header": False})
    generator.add(function)
    return str(generator.dump())


def library_folder() -> Path:
    """The folder of the compiled libraries, created with mode 0700 if necessary.

    Raises CompilationError if others can change it or a folder above it.
    """
    home = _cache_home()
    try:
        folder = private_folder(home, ("hovi", "compiled"))
        folder.chmod(0o700)
    except UnsafeFolderError as error:
        raise CompilationError(
            "compile=True loads libraries only from a folder that nobody else can change, but "
            f"{error.folder} {error.fault}: remove it or correct it (chmod go-w), set "
            f"XDG_CACHE_HOME to a folder of yours, {_OTHERWISE}"
        ) from error
    except OSError as error:
        raise CompilationError(
            f"compile=True keeps libraries in {home / 'hovi' / 'compiled'}, which cannot be made "
            f"({reason(error)}): set XDG_CACHE_HOME to a folder of yours, {_OTHERWISE}"
        ) from error
    return folder


def _cache_home() -> Path:
    """The folder of all caches. Raises CompilationError for a user without a home folder."""
    try:
        return cache_home()
    except RuntimeError as error:
        raise CompilationError(
            "compile=True keeps libraries in the user's cache folder, but there is no home "
            f"folder: set XDG_CACHE_HOME, {_OTHERWISE}"
        ) from error


def _platform() -> tuple[str, ...]:
    return platform.system(), platform.machine(), *platform.libc_ver()


@functools.cache
def _identity(compiler: str) -> str:
    """Version and target machine that a compiler reports."""
    return "\n".join(_run(o, [compiler, o]) for o in ("--version", "-dumpmachine"))


def _build(compiler: str, name: str, code: str, library: Path) -> None:
    """Compile in a private folder, then move the library and its hash into place."""
    try:
        # Not in /tmp: whoever can change that folder could exchange what is built there.
        with tempfile.TemporaryDirectory(prefix="build-", dir=library.parent) as scratch:
            source, result = Path(scratch, "function.c"), Path(scratch, "function.so")
            source.write_text(code)
            command = [compiler, *FLAGS, "-o", str(result), str(source), "-lm"]
            _run(name, command, TMPDIR=scratch)
            binary = result.read_bytes()
        _write(library, binary)
        _write(_hash_file(library), hashlib.sha256(binary).hexdigest().encode())
    except OSError as error:
        raise CompilationError(
            f"the compiled function {name!r} cannot be written to {library.parent} "
            f"({reason(error)}): make room there, {_OTHERWISE}"
        ) from error


def _write(path: Path, content: bytes) -> None:
    with whole_file(path) as stream:
        os.fchmod(stream.fileno(), 0o600)
        stream.write(content)


def _run(what: str, command: list[str], **environment: str) -> str:
    """Output of the compiler.

    Raises CompilationError with its first error message, and OutOfTimeError at the deadline in
    force.
    """
    compiler = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        env={**os.environ, "LC_ALL": "C", **environment},
        process_group=0,
    )
    with compiler:
        output, complaints = _finished(compiler)
    if compiler.returncode != 0:
        complaint = next(iter(complaints.splitlines()), f"exit code {compiler.returncode}")
        raise CompilationError(
            f"the C compiler {command[0]} fails on {what!r} ({complaint}): repair it, {_OTHERWISE}"
        )
    return output


def _finished(compiler: subprocess.Popen[str]) -> tuple[str, str]:
    """Output and messages of a compiler, which is ended with its children if it takes too long."""
    try:
        return compiler.communicate(timeout=time_left())
    except BaseException as error:
        with suppress(ProcessLookupError):
            os.killpg(compiler.pid, signal.SIGKILL)
        if isinstance(error, subprocess.TimeoutExpired):
            raise OutOfTimeError from None
        raise


def _is_intact(library: Path) -> bool:
    """Whether a library and its hash are files of this user, and the hash is right."""
    try:
        written = _own_file(_hash_file(library))
        return written == hashlib.sha256(_own_file(library)).hexdigest().encode()
    except OSError:
        return False


def _own_file(path: Path) -> bytes:
    """The content of a file; raises OSError if somebody else could change it."""
    with os.fdopen(os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb") as stream:
        if not is_private_file(stream.fileno()):
            raise OSError("it is not a file of this user alone")
        return stream.read()


def _hash_file(library: Path) -> Path:
    return library.with_name(f"{library.name}.sha256")


def _load(name: str, library: Path) -> ca.Function:
    for root in _search_roots():
        # CasADi puts these before a path, even an absolute one.
        if Path(f"{root}/{library}").exists():
            raise CompilationError(
                f"{root}/{library} would be loaded in place of {library}: remove it, {_OTHERWISE}"
            )
    try:
        return ca.external(name, str(library))
    except RuntimeError as error:
        raise CompilationError(
            f"the compiled function {library} does not load ({str(error).splitlines()[-1]}): set "
            f"XDG_CACHE_HOME to a folder from which programs may run, {_OTHERWISE}"
        ) from error


def _search_roots() -> list[str]:
    """Folders in which CasADi looks for a library before the given path."""
    paths = [os.environ.get(name, "") for name in ("CASADI_PLUGIN_SEARCH_PATH", "CASADIPATH")]
    paths.append(ca.GlobalOptions.getCasadiPath())
    return [root for path in paths for root in path.split(os.pathsep) if root]


def _digest(*parts: str) -> str:
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode()
        digest.update(len(data).to_bytes(8, "little") + data)
    return digest.hexdigest()
