"""Compiles CasADi functions to C libraries, cached in the user's own cache folder.

The folder is `hovi/compiled` in $XDG_CACHE_HOME or ~/.cache. The name of a library is the SHA-256
of its source and compiler, and its own SHA-256 is stored beside it and checked before it is loaded.
No library is loaded from anywhere else, nor while another user could write to the folder.
"""

from __future__ import annotations

import functools
import hashlib
import os
import platform
import shutil
import stat
import subprocess
import tempfile
from pathlib import Path

import casadi as ca

from hovi.errors import HoviError
from hovi.system.files import reason, whole_file
from hovi.version import __version__

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
    Raises CompilationError without a C compiler or a folder that is safe to load from.
    """
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
    return _load(function.name(), library)


def c_code(function: ca.Function) -> str:
    """The function as C code, identical in every process."""
    generator = ca.CodeGenerator("function.c", {"with_header": False})
    generator.add(function)
    return str(generator.dump())


def library_folder() -> Path:
    """The folder of the compiled libraries, created with mode 0700 if necessary.

    Raises CompilationError if others can write to it or to its parent folder.
    """
    home = _cache_home()
    try:
        home.mkdir(mode=0o700, parents=True, exist_ok=True)
        mode = home.stat().st_mode
        if mode & stat.S_IWOTH and not mode & stat.S_ISVTX:
            raise _unsafe(home, "may be written to by everyone")
        folder = home
        for name in ("hovi", "compiled"):
            folder = folder / name
            _require_own(folder)
        folder.chmod(0o700)
    except OSError as error:
        raise CompilationError(
            f"compile=True keeps libraries in {home / 'hovi' / 'compiled'}, which cannot be made "
            f"({reason(error)}): set XDG_CACHE_HOME to a folder of yours, {_OTHERWISE}"
        ) from error
    return folder


def _cache_home() -> Path:
    """$XDG_CACHE_HOME if that is an absolute path, else ~/.cache."""
    named = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if named.is_absolute():
        return named
    try:
        return Path.home() / ".cache"
    except RuntimeError as error:
        raise CompilationError(
            "compile=True keeps libraries in the user's cache folder, but there is no home "
            f"folder: set XDG_CACHE_HOME, {_OTHERWISE}"
        ) from error


def _require_own(folder: Path) -> None:
    """Create a folder, or raise CompilationError if an existing one is unsafe."""
    try:
        folder.mkdir(mode=0o700)
    except FileExistsError:
        found = folder.lstat()
        if not stat.S_ISDIR(found.st_mode):
            raise _unsafe(folder, "is a symbolic link or a file") from None
        if found.st_uid != os.geteuid():
            raise _unsafe(folder, "belongs to another user") from None
        if found.st_mode & 0o022:
            raise _unsafe(folder, "may be written to by others") from None


def _unsafe(folder: Path, fault: str) -> CompilationError:
    return CompilationError(
        f"compile=True loads libraries only from a folder that nobody else can change, but "
        f"{folder} {fault}: remove it or correct it (chmod 700), {_OTHERWISE}"
    )


def _platform() -> tuple[str, ...]:
    return platform.system(), platform.machine(), *platform.libc_ver()


@functools.cache
def _identity(compiler: str) -> str:
    """Version and target machine that a compiler reports."""
    return "\n".join(_run(o, [compiler, o]) for o in ("--version", "-dumpmachine"))


def _build(compiler: str, name: str, code: str, library: Path) -> None:
    """Compile in a private folder, then move the library and its hash into place."""
    try:
        with tempfile.TemporaryDirectory(prefix="hovi-") as scratch:
            source, result = Path(scratch, "function.c"), Path(scratch, "function.so")
            source.write_text(code)
            _run(name, [compiler, *FLAGS, "-o", str(result), str(source), "-lm"])
            binary = result.read_bytes()
        with whole_file(library) as stream:
            stream.write(binary)
        with whole_file(_hash_file(library)) as stream:
            stream.write(hashlib.sha256(binary).hexdigest().encode())
    except OSError as error:
        raise CompilationError(
            f"the compiled function {name!r} cannot be written to {library.parent} "
            f"({reason(error)}): make room there, {_OTHERWISE}"
        ) from error


def _run(what: str, command: list[str]) -> str:
    """Output of the compiler. Raises CompilationError with its first error message."""
    run = subprocess.run(
        command,
        capture_output=True,
        text=True,
        errors="replace",
        stdin=subprocess.DEVNULL,
        env={**os.environ, "LC_ALL": "C"},
        check=False,
    )
    if run.returncode != 0:
        complaint = next(iter(run.stderr.splitlines()), f"exit code {run.returncode}")
        raise CompilationError(
            f"the C compiler {command[0]} fails on {what!r} ({complaint}): repair it, {_OTHERWISE}"
        )
    return run.stdout


def _is_intact(library: Path) -> bool:
    try:
        written = _hash_file(library).read_text()
        return written == hashlib.sha256(library.read_bytes()).hexdigest()
    except (OSError, UnicodeDecodeError):
        return False


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
