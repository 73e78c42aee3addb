"""Frozen dataclasses at a third of their price at import, which most classes of hovi pay.

The standard library compiles up to six functions for each frozen dataclass, which takes half a
millisecond, and a small plan loads more than two hundred of them. Here all classes share the
functions that can be shared, and only constructors are compiled. Everything else is the standard
library's: fields, `replace`, `asdict`, and classes that extend these.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable
from dataclasses import MISSING, Field, FrozenInstanceError, field, fields
from reprlib import recursive_repr
from typing import Any, TypeVar, dataclass_transform

Owner = TypeVar("Owner")
_FIELDS = "__dataclass_fields__"


@dataclass_transform(field_specifiers=(field,))
def dataclass(
    *, frozen: bool = False, eq: bool = True, repr: bool = True, **others: Any
) -> Callable[[type[Owner]], type[Owner]]:
    """A decorator: as `dataclasses.dataclass`, which does all but frozen classes without a base.

    frozen, eq, repr, others: as there.
    """

    def decorate(owner: type[Owner]) -> type[Owner]:
        extends = any(_FIELDS in vars(base) for base in owner.__mro__[1:])
        if extends or others or not frozen:
            return dataclasses.dataclass(frozen=frozen, eq=eq, repr=repr, **others)(owner)
        return _frozen(owner, eq, repr)

    return decorate


def _frozen(owner: type[Owner], eq: bool, repr: bool) -> type[Owner]:
    """A frozen dataclass that extends none."""
    methods: dict[str, Any] = {"__setattr__": _refuse_assignment, "__delattr__": _refuse_deletion}
    methods |= {"__repr__": _repr} if repr else {}
    methods |= {"__eq__": _equal} if eq else {}
    if eq and vars(owner).get("__hash__") is None:  # which is what an __eq__ leaves there
        setattr(owner, "__hash__", _hash)  # noqa: B010 - type checkers know no such assignment
    owner.__doc__ = owner.__doc__ or owner.__name__  # not the signature, which takes long
    made: Any = dataclasses.dataclass(init=False, repr=False, eq=False)(owner)
    if "__init__" not in vars(owner):
        methods["__init__"] = _constructor(made)
    for name in methods.keys() - vars(owner).keys():
        setattr(made, name, methods[name])
    parameters = made.__dataclass_params__
    parameters.init, parameters.repr, parameters.eq, parameters.frozen = True, repr, eq, True
    return owner


def _constructor(owner: type[Any]) -> Callable[..., None]:
    """The constructor, as if it were written in the module of the class."""
    known = fields(owner)
    given = [each for each in known if each.init]
    by_name = [_parameter(each) for each in given if each.kw_only]
    parameters = [_parameter(each) for each in given if not each.kw_only]
    parameters += ["*", *by_name] if by_name else []
    body = [_assignment(each) for each in known if each.init or _has_factory(each)]
    body += ["self.__post_init__()"] if hasattr(owner, "__post_init__") else []
    values = {"_set": object.__setattr__, "_UNSET": _UNSET}
    values |= {f"_default_{each.name}": each.default for each in known if _has_default(each)}
    values |= {f"_make_{each.name}": each.default_factory for each in known if _has_factory(each)}
    text = (
        f"def enclose({', '.join(values)}):\n"
        f" def __init__({', '.join(['self', *parameters])}):\n"
        f"  {'; '.join(body) or 'pass'}\n"
        " return __init__"
    )
    compiled: dict[str, Any] = {}
    exec(text, vars(sys.modules[owner.__module__]), compiled)
    constructor: Callable[..., None] = compiled["enclose"](**values)
    constructor.__qualname__ = f"{owner.__qualname__}.__init__"
    constructor.__annotations__ = {each.name: each.type for each in given} | {"return": None}
    return constructor


def _has_default(of: Field[Any]) -> bool:
    return of.default is not MISSING


def _has_factory(of: Field[Any]) -> bool:
    return of.default_factory is not MISSING


def _parameter(of: Field[Any]) -> str:
    if _has_factory(of):
        return f"{of.name}=_UNSET"
    return f"{of.name}=_default_{of.name}" if _has_default(of) else of.name


def _assignment(of: Field[Any]) -> str:
    value = of.name
    if _has_factory(of):
        made = f"_make_{of.name}()"
        value = f"{made} if {of.name} is _UNSET else {of.name}" if of.init else made
    return f"_set(self, {of.name!r}, {value})"


class _Unset:
    """The default of a parameter whose value a factory makes."""

    def __repr__(self) -> str:
        return "<factory>"


_UNSET = _Unset()


def _compared(value: Any) -> tuple[Any, ...]:
    return tuple(getattr(value, each.name) for each in fields(value) if each.compare)


def _equal(self: Any, other: object) -> Any:
    if other.__class__ is not self.__class__:
        return NotImplemented
    return _compared(self) == _compared(other)


def _hash(self: Any) -> int:
    hashed = (each for each in fields(self) if (each.compare if each.hash is None else each.hash))
    return hash(tuple(getattr(self, each.name) for each in hashed))


@recursive_repr()
def _repr(self: Any) -> str:
    shown = (f"{each.name}={getattr(self, each.name)!r}" for each in fields(self) if each.repr)
    return f"{type(self).__qualname__}({', '.join(shown)})"


def _refuse_assignment(self: Any, name: str, value: object) -> None:
    if _is_frozen(self, name):
        raise FrozenInstanceError(f"cannot assign to field {name!r}")
    object.__setattr__(self, name, value)


def _refuse_deletion(self: Any, name: str) -> None:
    if _is_frozen(self, name):
        raise FrozenInstanceError(f"cannot delete field {name!r}")
    object.__delattr__(self, name)


def _is_frozen(value: object, name: str) -> bool:
    """Whether an attribute cannot be changed: other ones of classes that extend a dataclass can."""
    known: dict[str, object] = getattr(value, _FIELDS)
    return name in known or _FIELDS in vars(type(value))
