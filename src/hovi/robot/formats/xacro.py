"""URDFs from xacro files, by xacrodoc. Expressions are evaluated and other files included."""

from __future__ import annotations

from pathlib import Path

from hovi.errors import ModelError
from hovi.system.files import reason, require_file

MAX_BYTES = 2**26


def urdf_of_xacro(path: Path, package_dirs: tuple[str, ...]) -> str:
    """The text of the URDF that a xacro file describes, with default arguments.

    package_dirs: folders of the packages that `$(find ...)` names. `package://` paths of meshes
        stay as they are.
    Raises ModelError for a file that cannot be read or expanded, and without xacrodoc.
    """
    try:
        import xacro
        from xacrodoc import packages  # which tells xacro where packages are, without ROS
    except ImportError:
        raise ModelError(
            f"{path.name!r} is a xacro file, which needs xacrodoc: run pip install 'hovi[robots]'."
        ) from None
    try:
        require_file(path, MAX_BYTES)
        packages.reset()
        packages.look_in([str(folder) for folder in package_dirs])
        packages.walk_up_from(path)
        return str(xacro.process_file(str(path)).toprettyxml(indent="  "))
    except OSError as error:
        raise ModelError(f"cannot read the xacro file {str(path)!r}: {reason(error)}.") from error
    except Exception as error:  # whatever the expressions of the file raise
        raise ModelError(
            f"the xacro file {path.name!r} cannot be expanded: {type(error).__name__}: {error}."
        ) from error
