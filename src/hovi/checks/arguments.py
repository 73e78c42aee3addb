"""Arguments of public functions, checked against their annotations.

Misuse is refused before anything is computed, in one sentence: the argument, what it must be, and
what was given. Shapes and values are checked by each function itself. A HoviError leaves such a
function without the frames below it, which say nothing to the caller: see `shows_all_frames`.
"""

from __future__ import annotations

import functools
import inspect
import sys
import types
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, TypeVar, cast

from hovi.checks.kinds import Kind, MismatchError, kind_of, resolved
from hovi.errors import HoviError, InputError, shows_all_frames
from hovi.system.dataclass import dataclass

Accept = Callable[[Any], Any]
_MARK = "_hovi_checks_arguments"
"""Attribute of functions that are checked already, or are not to be."""
Checked = TypeVar("Checked", bound=Callable[..., Any])


def check_arguments(checked: Checked) -> Checked:
    """A decorator: arguments that are not what their annotations say raise InputError.

    Any real number is accepted as a float, and a whole one as an int. What NumPy converts to an
    array of numbers is accepted as an array, which the function then receives, C-contiguous; masked
    entries are refused. Arguments annotated by Any, or by a name that only type checkers import,
    are not checked.

    checked: a function; or a class, whose constructor and public methods are checked unless they
        have a decorator of their own.
    Errors of hovi leave it with its own frame alone, and without a cause.
    """
    return check_arguments_except()(checked)


def check_arguments_except(*names: str) -> Callable[[Checked], Checked]:
    """As `check_arguments`, but some arguments are left to the function, whose messages say more.

    names: of these arguments.
    """

    def decorate(checked: Checked) -> Checked:
        if not isinstance(checked, type):
            return _checking(checked, names)
        _check_members(checked, names)
        return checked

    return decorate


def unchecked(function: Checked) -> Checked:
    """A decorator: leaves a method out of the checks of its class, since inner loops call it."""
    setattr(function, _MARK, True)
    return function


def without_checks(checked: Checked) -> Checked:
    """A function, or what makes an instance of a class, without the checks of its arguments.

    For the steps of an optimiser, whose arguments are known to be right.
    """
    if not isinstance(checked, type):
        return cast(Checked, inspect.unwrap(checked))
    initialize = inspect.unwrap(vars(checked)["__init__"])

    def make(*args: Any) -> Any:
        made = object.__new__(cast(type[Any], checked))
        initialize(made, *args)
        return made

    return cast(Checked, make)


def _checking(checked: Checked, names: Collection[str]) -> Checked:
    """The function with its arguments checked but for `names`."""
    parameters = functools.cache(lambda: _Parameters.of(checked, names))

    @functools.wraps(checked)
    def checking(*args: Any, **kwargs: Any) -> Any:
        known = parameters()
        accepted: Sequence[Any] = args
        named = kwargs
        try:
            try:
                accepts = known.accepts if len(args) <= len(known.accepts) else known.repeated(args)
                accepted = [accept(x) for accept, x in zip(accepts, args)]  # noqa: B905 - speed
                for name in kwargs:
                    named[name] = known.named.get(name, _anything)(kwargs[name])
            except MismatchError:
                known.refuse(args, kwargs)
            return checked(*accepted, **named)
        except HoviError as refused:
            if shows_all_frames():
                raise
            raise refused.with_traceback(None) from None  # HOVI_TRACEBACK=full shows all frames

    setattr(checking, _MARK, True)
    return checking  # type: ignore[return-value]


def _check_members(checked: type, names: Collection[str]) -> None:
    for name, member in list(vars(checked).items()):
        if (name != "__init__" and name.startswith("_")) or hasattr(member, _MARK):
            continue
        if inspect.isfunction(member):
            setattr(checked, name, _checking(member, names))
        elif isinstance(member, classmethod | staticmethod):
            setattr(checked, name, type(member)(_checking(member.__func__, names)))


def _anything(value: Any) -> Any:
    return value


@dataclass(frozen=True)
class _Parameters:
    """The parameters of a function.

    function: its name, for messages. kinds: of each parameter, by name; None where it may be
    anything. positional: names of those that can be given by position. rest: name of *args, or "".
    accepts, named: functions that accept the arguments, by position and by name.
    """

    function: str
    kinds: Mapping[str, Kind | None]
    positional: tuple[str, ...]
    rest: str
    accepts: tuple[Accept, ...]
    named: Mapping[str, Accept]

    @classmethod
    def of(cls, function: Callable[..., Any], left_out: Collection[str]) -> _Parameters:
        """The parameters of a function, with any value accepted for those that are left out."""
        kinds, positional, rest = dict[str, Kind | None](), list[str](), ""
        scope = inspect.unwrap(function).__globals__
        for name, each in inspect.signature(function).parameters.items():
            if each.kind is each.VAR_KEYWORD:
                continue
            kinds[name] = None
            if name not in left_out:
                kinds[name] = kind_of(resolved(each.annotation, scope))
            if each.kind is each.VAR_POSITIONAL:
                rest = name
            elif each.kind is not each.KEYWORD_ONLY:
                positional.append(name)
        named = {name: _anything if kind is None else kind.accept for name, kind in kinds.items()}
        accepts = tuple(named[name] for name in positional)
        name = function.__qualname__.removesuffix(".__init__")
        return cls(name, kinds, tuple(positional), rest, accepts, named)

    def repeated(self, args: tuple[Any, ...]) -> tuple[Accept, ...]:
        """Functions that accept as many positional arguments as these, with *args among them."""
        more = len(args) - len(self.accepts)
        return (*self.accepts, *[self.named.get(self.rest, _anything)] * more)

    def refuse(self, args: tuple[Any, ...], kwargs: Mapping[str, Any]) -> None:
        """Raise InputError about the first argument that is not accepted."""
        names = (*self.positional, *[self.rest] * len(args))
        for name, value in [*zip(names, args, strict=False), *kwargs.items()]:
            kind = self.kinds.get(name)
            if kind is None:
                continue
            try:
                kind.accept(value)
            except MismatchError as mismatch:
                sentence = kind.refusal(name, value, mismatch)
                raise InputError(f"{self.function}: {sentence}") from None


def check_fields(value: object, what: str, error: type[HoviError]) -> None:
    """Raise an error unless the fields of a dataclass are what their annotations say.

    Integers that no machine word holds become doubles. what: the start of the message.
    """
    kinds = _field_kinds(type(value))  # type: ignore[arg-type]
    for name, kind in kinds.items():
        if kind is None or name not in vars(value):
            continue
        given = getattr(value, name)
        try:
            object.__setattr__(value, name, kind.accept(given))
        except MismatchError as mismatch:
            raise error(f"{what}: {kind.refusal(name, given, mismatch)}") from None


@functools.cache
def _field_kinds(owner: type[Any]) -> dict[str, Kind | None]:
    """Kinds of the fields of a dataclass and of those that it extends."""
    kinds: dict[str, Kind | None] = {}
    for each in reversed(owner.__mro__):
        scope = vars(sys.modules.get(each.__module__, types))
        for name, annotation in vars(each).get("__annotations__", {}).items():
            kinds[name] = kind_of(resolved(annotation, scope))
    return kinds
