"""The scenes and URDFs that ship with hovi."""

from __future__ import annotations

from pathlib import Path

from hovi.checks.arguments import check_arguments
from hovi.errors import SceneError, nearest

_PACKAGE = Path(__file__).resolve().parents[1]
_FOLDERS = (_PACKAGE / "models", _PACKAGE.parents[1] / "models")
"""Inside an installed wheel, and in a source tree."""


@check_arguments
def example(name: str) -> Path:
    """The path of a scene or URDF that ships with hovi.

    name: such as "two_link_swing_up" or "two_link.urdf"; without a suffix, a scene is preferred
        to a URDF. Raises SceneError for an unknown name.
    """
    known = _shipped("**/*")
    for file_name in (name, f"{name}.toml", f"{name}.urdf"):
        if file_name in known:
            return known[file_name]
    raise SceneError(f"hovi ships no scene or URDF {name!r}; {nearest(name, known)}")


def shipped_urdf(name: str) -> Path | None:
    """The path of a URDF that ships with hovi, by its file name; None for any other name."""
    return _shipped("**/*").get(name) if name.endswith(".urdf") else None


def example_scenes() -> list[str]:
    """Names of the scenes that ship with hovi, without its suite of tasks, sorted."""
    return sorted(path.stem for path in _shipped("*").values() if path.suffix == ".toml")


def task_suite() -> list[Path]:
    """The scene files of the suite of tasks, in folders by family, sorted."""
    return sorted(path for path in _shipped("tasks/*/*").values() if path.suffix == ".toml")


def _shipped(pattern: str) -> dict[str, Path]:
    """Scenes and URDFs by file name, of which there is one each."""
    for folder in _FOLDERS:
        files = {p.name: p for p in folder.glob(pattern) if p.suffix in (".toml", ".urdf")}
        if files:
            return files
    return {}
