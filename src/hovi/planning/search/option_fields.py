"""Option fields: the one description of each option, for docstrings and for scene files."""

from __future__ import annotations

import inspect
import math
import textwrap
from collections.abc import Callable, Iterable
from dataclasses import field, fields
from typing import Any

from hovi.checks.kinds import is_number, shown
from hovi.errors import InputError, nearest
from hovi.planning.problem.notation.other_planners import instead_of
from hovi.system.dataclass import dataclass

MAX_WHOLE_NUMBER = 10**9
"""Largest value of an integer option without a maximum of its own."""
WIDTH = 96
"""Line length of the arguments in a docstring."""


@dataclass(frozen=True)
class SceneKey:
    """The scene-file key of an option that is a single number, boolean or text.

    must_be: end of the message "`key` must be ...".
    written: whether to write the key, given the options; if None, only values other than the
        default are written.
    """

    must_be: str
    written: Callable[[Any], bool] | None = None


@dataclass(frozen=True)
class OptionInfo:
    """Description of an option besides its name, type and default.

    doc: meaning, ending with a full stop. key: None if scene files do not hold it as a single
    value. least, most: bounds of a number. whole: whether it is an integer.
    """

    doc: str
    key: SceneKey | None = None
    least: int | None = None
    most: int | None = None
    whole: bool = False


def option(default: Any, doc: str, key: SceneKey | None = None, least: int | None = None) -> Any:
    """A field of an options class, with its description."""
    return field(default=default, metadata={"info": OptionInfo(doc, key, least)})


def whole_number(
    default: Any, doc: str, least: int, most: int | None = None, key: SceneKey | None = None
) -> Any:
    """As `option`, for an integer."""
    info = OptionInfo(doc, key, least, most, whole=True)
    return field(default=default, metadata={"info": info})


def option_infos(options: type) -> dict[str, OptionInfo]:
    """The descriptions of all options, by name."""
    return {each.name: each.metadata["info"] for each in fields(options)}


def check_numbers(options: Any) -> None:
    """Convert integer options to int. Raises InputError for other numbers, or out of bounds."""
    defaults = {each.name: each.default for each in fields(options)}
    for name, known in option_infos(type(options)).items():
        number = getattr(options, name)
        if known.whole and (number is not None or defaults[name] is not None):
            object.__setattr__(options, name, _whole(name, known, number))
        elif known.key is not None and not _is_at_least(known.least, number):
            raise _refusal(name, known.key.must_be, number)


def _is_at_least(least: int | None, number: Any) -> bool:
    return least is None or (is_number(number) and bool(number >= least))


def _whole(name: str, known: OptionInfo, number: Any) -> int:
    least, most = known.least or 0, MAX_WHOLE_NUMBER if known.most is None else known.most
    finite = is_number(number) and (isinstance(number, int) or math.isfinite(number))
    if finite and number == int(number) and least <= number <= most:
        return int(number)
    too_large = finite and number > most
    open_ended = known.most is None and not too_large
    allowed = f", {least} or more" if open_ended else f" from {least} to {most:,}"
    raise _refusal(name, f"a whole number{allowed}", number)


def _refusal(name: str, must_be: str, number: Any) -> InputError:
    """The error about an option, in the words of the message about a scene file."""
    return InputError(f"`{name}` must be {must_be}, but it is {shown(number)}.")


def require_known(options: type, names: Iterable[str]) -> None:
    """Raise InputError for unknown option names."""
    known = option_infos(options)
    for name in names:
        if name not in known:
            hint = instead_of(name) or nearest(name, known)
            raise InputError(f"there is no option {name!r}: {hint}")


def described(options: type) -> str:
    """The descriptions of all options, in the format of a docstring's arguments."""
    return "\n".join(
        textwrap.fill(f"{name}: {known.doc}", WIDTH, subsequent_indent="    ")
        for name, known in option_infos(options).items()
    )


def explain(documented: Any, options: type) -> None:
    """Replace {options} in a docstring by the descriptions of the options."""
    documented.__doc__ = (inspect.getdoc(documented) or "").replace("{options}", described(options))


def spell_out(function: Any, options: type) -> None:
    """Set signature and docstring of a function that takes options by keyword, for help()."""
    explain(function, options)
    own = inspect.signature(function)
    own_parameters = [each for each in own.parameters.values() if each.kind is not each.VAR_KEYWORD]
    keywords = inspect.signature(options).parameters.values()
    function.__signature__ = own.replace(parameters=[*own_parameters, *keywords])
