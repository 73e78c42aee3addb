"""Former names of modules, which work for one version."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any

from hovi.errors import warn


def former_names(former: str, module: ModuleType, names: Mapping[str, str]) -> Callable[[str], Any]:
    """The `__getattr__` of a module whose names are now in another one, with a DeprecationWarning.

    former: name of that module. names: the present name for each former one.
    """

    def named(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module {former!r} has no attribute {name!r}")
        warn(f"{former}.{name} is now {module.__name__}.{names[name]}.", DeprecationWarning)
        return getattr(module, names[name])

    return named
