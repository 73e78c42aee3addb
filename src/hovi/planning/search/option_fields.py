"""Fields of options: what each one means is said once, for help texts and for scene files."""

from __future__ import annotations

import inspect
import math
import textwrap
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from hovi.errors import InputError, nearest

WIDTH = 96
"""Columns of an argument in a docstring."""


@dataclass(frozen=True)
class SceneKey:
    """The key of a scene file that holds an option which is one number, truth value or text.

    must_be: what ends the sentence "`key` must be ...".
    written: whether a file that is written names it, from the options; where it is None, only a
        value that is not the default is written.
    """

    must_be: str
    written: Callable[[Any], bool] | None = None


@dataclass(frozen=True)
class About:
    """What is known of an option besides its name, type and default.

    doc: what it means; ends with a full stop. key: None where scene files do not hold it as one
    value. least, most: of a number. whole: whether it is a whole number.
    """

    doc: str
    key: SceneKey | None = None
    least: int | None = None
    most: int | None = None
    whole: bool = False


def option(default: Any, doc: str, key: SceneKey | None = None, least: int | None = None) -> Any:
    """A field of options, with what About says of it."""
    return field(default=default, metadata={"about": About(doc, key, least)})


def whole_number(
    default: Any, doc: str, least: int, most: int | None = None, key: SceneKey | None = None
) -> Any:
    """A field that holds a whole number; as `option`."""
    about = About(doc, key, least, most, whole=True)
    return field(default=default, metadata={"about": about})


def about(options: type) -> dict[str, About]:
    """What is known of each option, by name."""
    return {each.name: each.metadata["about"] for each in fields(options)}


def keep_whole_numbers(options: Any) -> None:
    """Hold whole numbers as int. Raises InputError for what is none, or out of bounds."""
    for name, known in about(type(options)).items():
        number = getattr(options, name)
        if known.whole and number is not None:
            object.__setattr__(options, name, _whole(name, known, number))


def _whole(name: str, known: About, number: Any) -> int:
    least, most = known.least or 0, math.inf if known.most is None else known.most
    is_number = isinstance(number, int) or (
        isinstance(number, float | np.number) and math.isfinite(number)
    )
    if is_number and number == int(number) and least <= number <= most:
        return int(number)
    allowed = f"of {least} or more" if known.most is None else f"from {least} to {known.most:,}"
    raise InputError(f"{name} must be a whole number {allowed}, got {number}.")


def require_known(options: type, names: Iterable[str]) -> None:
    """Raise InputError for a name that no option has."""
    known = about(options)
    for name in names:
        if name not in known:
            raise InputError(f"there is no option {name!r}: {nearest(name, known)}")


def described(options: type) -> str:
    """What each option means, as a docstring lists arguments."""
    return "\n".join(
        textwrap.fill(f"{name}: {known.doc}", WIDTH, subsequent_indent="    ")
        for name, known in about(options).items()
    )


def explain(documented: Any, options: type) -> None:
    """Say what the options mean in the place of {options} in a docstring."""
    documented.__doc__ = (inspect.getdoc(documented) or "").replace("{options}", described(options))


def spell_out(function: Any, options: type) -> None:
    """Give a function that takes options by keyword their names and meanings, for help()."""
    explain(function, options)
    own = inspect.signature(function)
    kept = [each for each in own.parameters.values() if each.kind is not each.VAR_KEYWORD]
    keywords = inspect.signature(options).parameters.values()
    function.__signature__ = own.replace(parameters=[*kept, *keywords])
