"""Frozen dataclasses of hovi are those of the standard library, compiled less."""

from __future__ import annotations

import ast
import copy
import dataclasses
import inspect
import pickle
from collections.abc import Callable
from dataclasses import field
from typing import Any, Generic, TypeVar

import pytest

from hovi.system.dataclass import dataclass
from oracles.packages import FILES, Module

Decorator = Callable[..., Any]
Item = TypeVar("Item")


def both(define: Callable[[Decorator], Any]) -> tuple[Any, Any]:
    """What is defined with the decorator of hovi and with that of the standard library."""
    return define(dataclass), define(dataclasses.dataclass)


def point(decorator: Decorator) -> Any:
    @decorator(frozen=True)
    class Point:
        """A point."""

        x: float
        y: float = 2.0
        names: list[str] = field(default_factory=list, compare=False)
        hidden: int = field(default=3, repr=False, hash=False, kw_only=True)
        length: float = field(init=False, default=0.0)
        made: tuple[int, ...] = field(init=False, default_factory=tuple)

        def __post_init__(self) -> None:
            object.__setattr__(self, "length", abs(self.x) + abs(self.y))

    return Point


@dataclass(frozen=True)
class Kept(Generic[Item]):
    item: Item
    count: int = 1


def test_values_print_compare_and_hash_as_in_the_standard_library() -> None:
    ours, theirs = both(point)
    for arguments in ((1.0,), (1.0, 3.0, ["a"])):
        mine, other = ours(*arguments, hidden=4), theirs(*arguments, hidden=4)
        assert repr(mine) == repr(other)
        assert vars(mine) == vars(other)
        assert hash(mine) == hash(other)
        assert dataclasses.asdict(mine) == dataclasses.asdict(other)
        assert mine == copy.copy(mine) == ours(arguments[0], mine.y, ["other"], hidden=4)
        assert mine != ours(*arguments, hidden=5)
        assert mine != other
    assert ours(1.0).names is not ours(1.0).names
    assert dataclasses.replace(ours(1.0), y=5.0).length == 6.0


def test_a_class_is_described_as_in_the_standard_library() -> None:
    ours, theirs = both(point)
    assert str(inspect.signature(ours)) == str(inspect.signature(theirs))
    assert ours.__init__.__qualname__ == theirs.__init__.__qualname__
    assert ours.__init__.__globals__ is theirs.__init__.__globals__
    assert ours.__match_args__ == theirs.__match_args__
    assert repr(ours.__dataclass_params__) == repr(theirs.__dataclass_params__)
    assert ours.__doc__ == "A point."


@pytest.mark.parametrize(
    "wrong", [{}, {"z": 1.0}, {"x": 1.0, "length": 2.0}], ids=["missing", "unknown", "not given"]
)
def test_wrong_arguments_are_refused_in_the_same_words(wrong: dict[str, float]) -> None:
    messages = []
    for owner in both(point):
        with pytest.raises(TypeError) as refused:
            owner(**wrong)
        messages.append(str(refused.value))
    assert messages[0] == messages[1]


def test_fields_cannot_be_assigned_or_deleted() -> None:
    messages = []
    for owner in both(point):
        value = owner(1.0)
        for change in (
            lambda value: setattr(value, "x", 2.0),
            lambda value: setattr(value, "unknown", 2.0),
            lambda value: delattr(value, "x"),
        ):
            with pytest.raises(dataclasses.FrozenInstanceError) as refused:
                change(value)
            messages.append(str(refused.value))
        assert value.x == 1.0
    assert messages[:3] == messages[3:]


def test_a_plain_class_may_extend_one_and_have_attributes_of_its_own() -> None:
    for owner in both(point):
        extended = type("Extended", (owner,), {})(1.0)
        extended.other = 2.0
        del extended.other
        with pytest.raises(dataclasses.FrozenInstanceError):
            extended.x = 2.0


@pytest.mark.parametrize("decorator", [dataclass, dataclasses.dataclass])
def test_a_dataclass_may_extend_one(decorator: Decorator) -> None:
    @decorator(frozen=True)
    class Named(point(dataclass)):  # type: ignore[misc]
        name: str = "origin"

    assert Named(1.0, name="a").length == 3.0
    assert [each.name for each in dataclasses.fields(Named)][-1] == "name"
    with pytest.raises(TypeError, match="non-frozen"):

        @decorator()
        class Changed(point(dataclass)):  # type: ignore[misc]
            name: str = "origin"


def test_methods_of_the_class_itself_are_kept() -> None:
    def define(decorator: Decorator) -> Any:
        @decorator(frozen=True)
        class Own:
            x: int

            def __init__(self) -> None:
                object.__setattr__(self, "x", 7)

            def __repr__(self) -> str:
                return "own"

            def __eq__(self, other: object) -> bool:
                return True

            def __hash__(self) -> int:
                return 5

        return Own

    for owner in both(define):
        assert (owner().x, repr(owner()), hash(owner())) == (7, "own", 5)
        assert owner() == 3


def test_without_eq_or_repr_those_of_the_object_stay() -> None:
    def define(decorator: Decorator) -> Any:
        @decorator(frozen=True, eq=False, repr=False)
        class Plain:
            x: int

        return Plain

    for owner in both(define):
        assert owner.__repr__ is object.__repr__
        assert owner.__eq__ is object.__eq__
        assert owner.__hash__ is object.__hash__


def test_a_value_that_holds_itself_can_be_printed() -> None:
    for owner in both(point):
        value = owner(1.0)
        value.names.append(value)
        assert "names=[...]" in repr(value)


def test_a_generic_value_can_be_pickled() -> None:
    value = Kept[int](5)
    assert pickle.loads(pickle.dumps(value)) == value == Kept(5)


def test_other_options_are_left_to_the_standard_library() -> None:
    def define(decorator: Decorator) -> Any:
        @decorator(frozen=True, slots=True, order=True)
        class Ordered:
            x: int

        return Ordered

    for owner in both(define):
        assert owner(1) < owner(2)
        assert not hasattr(owner(1), "__dict__")


@pytest.mark.parametrize("module", FILES, ids=".".join)
def test_every_module_of_hovi_takes_this_decorator(module: Module) -> None:
    if module == ("system", "dataclass"):
        return
    for node in ast.walk(ast.parse(FILES[module].read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module == "dataclasses":
            assert "dataclass" not in {each.name for each in node.names}
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "dataclasses":
            assert node.attr != "dataclass"
