"""Kinds of values: what an annotation stands for, in words and as a check."""

from __future__ import annotations

import inspect
import math
import numbers
import operator
import sys
import types
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal, Union, get_args, get_origin

import numpy as np
import numpy.typing as npt

from hovi.system.dataclass import dataclass

MAX_WHOLE_NUMBER = 10**18
"""Largest magnitude of an integer: larger ones overflow in compiled code."""
MAX_DIMENSIONS = 64
"""Of an array of NumPy."""
_QUOTED = (str, bool, int, float, types.NoneType)
_ARRAY_LIKE = set(get_args(npt.ArrayLike))


class MismatchError(Exception):
    """A value is not of a kind.

    Its argument, if any, says what the value must be more precisely than the words of the kind.
    """


@dataclass(frozen=True)
class Kind:
    """What a value may be.

    words: for messages, with an article. accept: returns the value, with numbers and arrays
    converted; raises MismatchError.
    """

    words: str
    accept: Callable[[Any], Any]

    def refusal(self, name: str, value: Any, mismatch: MismatchError) -> str:
        """The sentence about a value that was not accepted. name: of the argument."""
        words = mismatch.args[0] if mismatch.args else self.words
        return f"{name} must be {words}, got {shown(value)}."


def resolved(annotation: Any, scope: dict[str, Any]) -> Any:
    """The meaning of an annotation; Any where only type checkers know it.

    scope: the names of the module in which it is written.
    """
    if not isinstance(annotation, str):
        return annotation
    try:
        return eval(annotation, scope)
    except (NameError, AttributeError, TypeError):
        return Any


def kind_of(annotation: Any) -> Kind | None:
    """The kind that an annotation stands for; None if it may be anything."""
    origin, members = get_origin(annotation), get_args(annotation)
    if origin is None:
        return _simple(annotation)
    if origin in (Union, types.UnionType):
        if set(members) >= _ARRAY_LIKE:
            return _array_like(set(members) - _ARRAY_LIKE)
        return _union([kind_of(each) for each in members])
    if origin is Literal:
        return _literal(members)
    if origin is np.ndarray:
        return _array(np.dtype(get_args(members[1])[0]))
    if not isinstance(origin, type):  # such as ClassVar
        return None
    if issubclass(origin, Callable):  # type: ignore[arg-type]
        return Kind("a function", _callable)
    if issubclass(origin, Mapping):
        return _mapping(*map(kind_of, members))
    if origin is tuple and Ellipsis not in members:
        return _tuple([kind_of(each) for each in members])
    if issubclass(origin, Iterable):
        return _sequence(kind_of(members[0]), issubclass(origin, Sequence))
    return _instance(origin)


def shown(value: Any) -> str:
    """A value in a message: itself if it is short, else its type."""
    if isinstance(value, _QUOTED):
        text = repr(value) if not isinstance(value, int) or abs(value) < 10**40 else "an integer"
        return text if len(text) <= 80 else f"{text[:60]}..."
    if isinstance(value, np.ndarray):
        masked = "a masked" if _is_masked_array(value) else "an"
        return f"{masked} array of {value.dtype} of shape {value.shape}"
    name = f"class {value.__name__}" if isinstance(value, type) else type(value).__name__
    return _with_article(name)


def _with_article(name: str) -> str:
    return f"{'an' if name[:1] in 'aeiouAEIO' else 'a'} {name}"


def _simple(annotation: Any) -> Kind | None:
    """As `kind_of`, for an annotation without members."""
    if isinstance(annotation, type | None) and annotation in _SCALARS:
        return _SCALARS[annotation]
    if annotation in (Any, inspect.Parameter.empty) or not isinstance(annotation, type):
        return None
    is_protocol = getattr(annotation, "_is_protocol", False)
    return _protocol(annotation) if is_protocol else _instance(annotation)


def is_number(value: Any) -> bool:
    """Whether a value is an integer or a float of Python or NumPy, and no bool.

    NumPy's complex numbers and its times are numbers only by name: float() drops their imaginary
    part or their unit, or fails.
    """
    known = isinstance(value, float | int | np.floating | np.integer)
    return known and not isinstance(value, bool | np.timedelta64)


def is_whole(value: Any) -> bool:
    """Whether a value is an integer of Python or NumPy, and no bool."""
    return is_number(value) and isinstance(value, int | np.integer)


def _number(value: Any) -> Any:
    if type(value) is float:
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if _is_masked_array(value):  # np.ma.masked: what has a value became it above
        raise MismatchError("a number that is not masked")
    if not isinstance(value, numbers.Real) or isinstance(value, bool | np.timedelta64):
        raise MismatchError
    try:
        double = float(value)
    except OverflowError as error:
        raise MismatchError from error
    # NumPy refuses what no machine word holds, and fractions
    known = is_number(value) and abs(double) < 2**53
    return value if known else double


def _whole(value: Any) -> int:
    if type(value) is int and -MAX_WHOLE_NUMBER <= value <= MAX_WHOLE_NUMBER:
        return value
    value = _number(value)
    finite = isinstance(value, numbers.Integral) or math.isfinite(value)
    if not finite or value != int(value):
        raise MismatchError
    if abs(value) > MAX_WHOLE_NUMBER:
        raise MismatchError(f"a whole number of at most {MAX_WHOLE_NUMBER:.0e}")
    return int(value)


def _boolean(value: Any) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise MismatchError
    return bool(value)


def _callable(value: Any) -> Any:
    if not callable(value):
        raise MismatchError
    return value


def _instance(kind: type) -> Kind:
    def accept(value: Any) -> Any:
        if not isinstance(value, kind):
            raise MismatchError
        return value

    return Kind(_with_article(kind.__name__), accept)


def _protocol(kind: type) -> Kind:
    methods = [name for name in vars(kind) if not name.startswith("_")]

    def accept(value: Any) -> Any:
        if isinstance(value, type) or not all(hasattr(value, name) for name in methods):
            raise MismatchError
        return value

    return Kind(_with_article(kind.__name__), accept)


def _literal(values: tuple[Any, ...]) -> Kind:
    def accept(value: Any) -> Any:
        if not isinstance(value, str) or value not in values:
            raise MismatchError
        return value

    return Kind(" or ".join(map(repr, values)), accept)


def _union(members: Sequence[Kind | None]) -> Kind | None:
    kinds = [kind for kind in members if kind is not None]
    if len(kinds) < len(members):
        return None
    # a list of arrays must not become one array if the annotation allows the list
    ordered = sorted(kinds, key=lambda kind: kind.words.startswith(_ARRAY_OF))

    def accept(value: Any) -> Any:
        precise: MismatchError | None = None
        for kind in kinds if isinstance(value, np.ndarray) else ordered:
            try:
                return kind.accept(value)
            except MismatchError as mismatch:
                precise = mismatch if mismatch.args else precise
        raise precise or MismatchError

    *most, last = dict.fromkeys(kind.words for kind in kinds)
    return Kind(f"{', '.join(most)} or {last}" if most else last, accept)


def _array(dtype: np.dtype[Any]) -> Kind:
    allowed = {"f": "iuf", "i": "iu", "b": "b"}[dtype.kind]
    words = {"f": "numbers", "i": "integers", "b": "booleans"}[dtype.kind]

    def accept(value: Any) -> Any:
        if type(value) is np.ndarray and (value.dtype is dtype or value.dtype == dtype):
            return compact(value)
        if _masks(value):
            raise MismatchError(f"{words}, none of them masked")
        try:
            array = np.asarray(value)
        except Exception as error:  # an object may raise anything
            raise MismatchError from error
        if array.dtype.kind not in allowed and array.size:
            raise MismatchError
        if dtype.kind != "b" and _has_booleans(value):
            raise MismatchError
        return array.astype(dtype, order="C")

    return Kind(f"{_ARRAY_OF} {words}", accept)


def compact(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The array as compiled code takes it: itself, or a copy if not C-contiguous and aligned."""
    flags = array.flags
    return array if flags.c_contiguous and flags.aligned else array.copy()


def _masks(value: Any, depth: int = 0) -> bool:
    """Whether entries of an array, or of one in nested lists, are masked.

    NumPy converts to what is behind the mask.
    """
    if _is_masked_array(value):
        return bool(np.ma.is_masked(value))
    if not isinstance(value, list | tuple) or depth > MAX_DIMENSIONS:
        return False
    nested = any(issubclass(kind, list | tuple | np.ndarray) for kind in set(map(type, value)))
    return nested and any(_masks(each, depth + 1) for each in value)


def _is_masked_array(value: Any) -> bool:
    """Whether a value is a masked array, of which there are none before numpy.ma is imported."""
    return "numpy.ma" in sys.modules and isinstance(value, np.ma.MaskedArray)


def _has_booleans(value: Any) -> bool:
    """Whether there is a truth value in nested sequences, which NumPy takes as 0 or 1."""
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        others = set(map(type, value)) - {float, int}
        return bool(others) and any(map(_has_booleans, value))
    return isinstance(value, bool | np.bool_) or getattr(value, "dtype", None) == np.bool_


def _array_like(others: set[Any]) -> Kind | None:
    """The kind of ArrayLike, which the function itself converts; None if it is not the only one.

    others: the other members of the annotated union.
    """
    if others - {types.NoneType}:
        return None

    def accept(value: Any) -> Any:
        if value is not None or not others:
            NUMBERS.accept(value)
        return value

    return Kind("numbers" + (" or None" if others else ""), accept)


def _items_of(value: Any, sized: bool) -> list[Any]:
    """The items of a sequence, or of any iterable unless it must be `sized`."""
    if isinstance(value, np.ndarray):
        fits = value.ndim > 0
    else:
        fits = isinstance(value, Sequence if sized else Iterable)
    if not fits or isinstance(value, bytes | bytearray | memoryview | Mapping):
        raise MismatchError
    return list(value)


def _sequence(member: Kind | None, sized: bool) -> Kind:
    def accept(value: Any) -> Any:
        if isinstance(value, str):  # a sequence of texts, as Python has it
            if member is not None and member is not _SCALARS[str]:
                raise MismatchError
            return value
        plain = type(value) in (list, tuple)
        items = value if plain else _items_of(value, sized)
        accepted = items if member is None else [member.accept(each) for each in items]
        kept = plain or (sized and not isinstance(value, np.ndarray))
        return value if kept and _same(accepted, items) else tuple(accepted)

    return Kind("a sequence" if member is None else f"a sequence, each {member.words}", accept)


def _same(accepted: Sequence[Any], items: Sequence[Any]) -> bool:
    """Whether all items were accepted as they are."""
    return all(map(operator.is_, accepted, items))


def _tuple(members: Sequence[Kind | None]) -> Kind:
    """Of any length where all members are of one kind: the function says how many it needs."""
    if len({kind and kind.words for kind in members}) == 1:
        return _sequence(members[0], True)

    def accept(value: Any) -> Any:
        items = _items_of(value, True)
        if len(items) != len(members):
            raise MismatchError
        return tuple(
            each if kind is None else kind.accept(each)
            for kind, each in zip(members, items, strict=True)
        )

    words = ", ".join("anything" if kind is None else kind.words for kind in members)
    return Kind(f"a tuple ({words})", accept)


def _mapping(key: Kind | None, member: Kind | None) -> Kind:
    def accept(value: Any) -> Any:
        if not isinstance(value, Mapping):
            raise MismatchError
        for kind, each in [(key, k) for k in value] + [(member, v) for v in value.values()]:
            if kind is not None:
                kind.accept(each)
        return value

    words = "" if key is None else f" from {key.words}"
    return Kind(f"a mapping{words}" + ("" if member is None else f" to {member.words}"), accept)


_ARRAY_OF = "an array of"
NUMBERS = _array(np.dtype(np.float64))
"""What numpy converts to an array of numbers."""
_SCALARS: dict[Any, Kind] = {
    float: Kind("a number", _number),
    int: Kind("a whole number", _whole),
    bool: Kind("True or False", _boolean),
    str: Kind("a text", _instance(str).accept),
    None: Kind("None", _instance(types.NoneType).accept),
    types.NoneType: Kind("None", _instance(types.NoneType).accept),
}
