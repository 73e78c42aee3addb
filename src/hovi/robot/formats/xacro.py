"""URDFs from xacro files, by xacrodoc. Expressions are evaluated and other files included."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from hovi.errors import InputError, ModelError, nearest
from hovi.robot.formats.packages import packages_around, packages_in
from hovi.system.files import reason, require_file

MAX_BYTES = 2**26

_ARGUMENT = re.compile(r"""<xacro:arg\b[^>]*?\bname\s*=\s*["']([^"']+)|\$\(arg\s+([^\s)]+)""")
_EXPRESSION = re.compile(r"when evaluating expression '(.*?)'(?:\s|$)", re.DOTALL)
_PACKAGE = re.compile(r"package://([^/\"']+)/")


def urdf_of_xacro(
    path: Path, package_dirs: tuple[str, ...], arguments: Mapping[str, str]
) -> tuple[str, tuple[str, ...]]:
    """The text of the URDF that a xacro file describes, and the folders of its packages.

    package_dirs: folders of the packages that `$(find ...)` names; those around the file are found
        by themselves. `package://` paths of meshes stay as they are.
    arguments: values of <xacro:arg> by name; the others have their defaults.
    Raises ModelError for a file that cannot be read or expanded, an argument that it does not have,
    and without xacrodoc.
    """
    try:
        import xacro
        from xacrodoc import packages  # which says to xacro where packages are, without ROS
    except ImportError:
        raise ModelError(
            f"{path.name!r} is a xacro file, which needs xacrodoc: run pip install 'hovi[robots]'."
        ) from None
    try:
        require_file(path, MAX_BYTES)
    except OSError as error:
        raise ModelError(f"cannot read the xacro file {str(path)!r}: {reason(error)}.") from error
    known = packages_around(path) | packages_in(Path(folder) for folder in package_dirs)
    packages.reset()
    packages.look_in([str(folder) for folder in package_dirs])
    packages.update_package_cache(known)
    xacro.all_includes.clear()
    try:
        with contextlib.redirect_stderr(io.StringIO()):  # what xacro prints next to its error
            text = xacro.process_file(str(path), mappings=dict(arguments)).toprettyxml(indent="  ")
    except Exception as error:  # whatever the expressions of the file raise
        raise ModelError(_sentence(path, error, xacro)) from error
    _require_known(path, arguments, _arguments_of([path, *map(Path, xacro.all_includes)]))
    return str(text), _folders(str(text), known, package_dirs)


def as_arguments(arguments: Mapping[str, Any]) -> dict[str, str]:
    """Values of <xacro:arg> as xacro takes them: texts, numbers as written, true or false.

    Raises InputError for anything else.
    """
    for name, value in arguments.items():
        if not isinstance(name, str) or not isinstance(value, str | int | float):
            raise InputError(
                "xacro_args must map names of arguments to texts, numbers, True or False, got "
                f"{name!r}: {value!r}."
            )
    return {
        name: str(value).lower() if isinstance(value, bool) else str(value)
        for name, value in arguments.items()
    }


def _folders(text: str, known: Mapping[str, Path], given: tuple[str, ...]) -> tuple[str, ...]:
    """The given folders, and those of packages that meshes are in."""
    used = [known[name] for name in sorted(set(_PACKAGE.findall(text))) if name in known]
    return tuple(dict.fromkeys((*given, *(str(each.parent) for each in used))))


def _arguments_of(files: Iterable[Path]) -> set[str]:
    """Names of arguments that files declare or use."""
    names = set()
    for file in files:
        with contextlib.suppress(OSError):
            found = _ARGUMENT.findall(file.read_text(errors="replace"))
            names |= {declared or used for declared, used in found}
    return names


def _require_known(path: Path, arguments: Mapping[str, str], known: set[str]) -> None:
    for name in arguments:
        if name not in known:
            hint = nearest(name, known) if known else "it has none."
            raise ModelError(f"the xacro file {path.name!r} has no argument {name!r}: {hint}")


def _sentence(path: Path, error: Exception, xacro: ModuleType) -> str:
    """What failed, in which file, and what to write, without the classes of xacro."""
    cause: Any = error
    while getattr(cause, "exc", None) is not None:
        cause = cause.exc
    kind, what = type(cause).__name__, str(cause).strip().rstrip(".")
    if kind == "ArgException":
        return (
            f"the xacro file {path.name!r} needs a value of its argument {what!r}: write "
            f'xacro_args={{"{what}": ...}}, or --xacro-arg {what}:=VALUE on the command line.'
        )
    if kind == "PackageNotFoundError":
        name = what.rpartition(" ")[2]
        return (
            f"the xacro file {path.name!r} needs the package {name!r}, which is not around it: "
            "write package_dirs=[FOLDER] with the folder that holds it, or --package-dir FOLDER on "
            "the command line."
        )
    where = Path(xacro.filestack[-1] or path).name
    inside = "" if where == path.name else f" in {where!r}"
    if isinstance(cause, KeyError):
        what = f"there is no {what}"
    found = _EXPRESSION.search(str(error))
    expression = f" in the expression {found[1]!r}" if found else ""
    what = " ".join(re.sub(r"\s*when evaluating expression.*", "", what, flags=re.DOTALL).split())
    return (
        f"the xacro file {path.name!r} cannot be expanded{inside}: {what}{expression}; correct it "
        "there, or give other arguments."
    )
