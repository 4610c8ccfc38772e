# SPDX-License-Identifier: BSD-3-Clause
"""Dataclasses that compile nothing while their module loads.

`dataclasses.dataclass` compiles up to six methods of a class where it is declared: 0.9 ms for a frozen class with
slots, a quarter of the time of a short command. This decorator leaves to it what needs no compiler (fields, slots,
matching), shares the other methods between classes, and compiles ``__init__`` when the first object is made.

For a type checker it is the decorator of the standard library. `dataclasses.fields`, `replace`, `asdict`,
`inspect.signature`, `copy` and `pickle` treat its classes as any other dataclass. ``InitVar`` is not supported.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Sequence
from dataclasses import MISSING, Field, FrozenInstanceError, fields
from operator import attrgetter
from reprlib import recursive_repr
from types import MethodType
from typing import TYPE_CHECKING, Any

__all__ = ["dataclass"]

_LONG = 6  # fields or items of what is shown inside of another object


def _dataclass(
    *, eq: bool = True, frozen: bool = False, slots: bool = False, kw_only: bool = False
) -> Callable[[type[Any]], type[Any]]:
    """The decorator, with the options of `dataclasses.dataclass` that allanite uses."""
    prepared = dataclasses.dataclass(init=False, repr=False, eq=False, slots=slots, kw_only=kw_only)

    def completed(cls: type[Any]) -> type[Any]:
        declared = prepared(cls)
        body = dict(vars(declared))
        if "__eq__" in body and body["__hash__"] is None:
            del body["__hash__"]  # Python's answer to an `__eq__`, not the author's
        for name, method in _methods(declared, eq, frozen, slots).items():
            if name not in body:
                setattr(declared, name, method)
        return declared

    return completed


if TYPE_CHECKING:
    from dataclasses import dataclass
else:
    dataclass = _dataclass


def _methods(cls: type[Any], eq: bool, frozen: bool, slots: bool) -> dict[str, object]:
    """Every method that a class gets unless its body defines it."""
    declared = fields(cls)
    methods: dict[str, object] = {
        "__init__": _Initializer(cls, frozen),
        "__repr__": _repr_of([f.name for f in declared if f.repr]),
    }
    if eq:
        hashed = [f.name for f in declared if (f.compare if f.hash is None else f.hash)]
        methods["__eq__"] = _eq_of(_values_of([f.name for f in declared if f.compare]))
        methods["__hash__"] = _hash_of(_values_of(hashed)) if frozen else None
    if frozen:
        methods |= _frozen(cls, frozenset(f.name for f in declared))
        if slots:  # which Python would copy and unpickle by `setattr`
            methods |= {"__getstate__": _getstate, "__setstate__": _setstate}
    return methods


def _values_of(names: Sequence[str]) -> Callable[[Any], tuple[Any, ...]]:
    if len(names) > 1:
        return attrgetter(*names)
    return lambda value: tuple(getattr(value, name) for name in names)


def _repr_of(names: Sequence[str]) -> Callable[[Any], str]:
    @recursive_repr()
    def __repr__(self: Any) -> str:
        values = ", ".join(f"{name}={_short(getattr(self, name))}" for name in names)
        return f"{type(self).__qualname__}({values})"

    return __repr__


def _short(value: Any) -> str:
    """Arrays by type and shape, long rows by their length, objects of many fields by their class."""
    if hasattr(value, "dtype") and hasattr(value, "shape") and value.shape:
        return f"<{value.dtype} {'×'.join(map(str, value.shape))}>"
    if isinstance(value, (tuple, list, dict)) and len(value) > _LONG:
        return f"<{type(value).__name__} of {len(value)}>"
    if isinstance(value, tuple):
        return f"({', '.join(map(_short, value))}{',' * (len(value) == 1)})"
    if dataclasses.is_dataclass(value) and len(fields(value)) > _LONG:
        return f"<{type(value).__name__}>"
    return repr(value)


def _eq_of(values: Callable[[Any], tuple[Any, ...]]) -> Callable[[Any, object], bool]:
    def __eq__(self: Any, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        mine, theirs = values(self), values(other)
        try:
            if mine == theirs:
                return True
        except ValueError:  # arrays among them: their comparison is an array, too
            pass
        return all(map(_alike, mine, theirs))

    return __eq__


def _alike(one: Any, other: Any) -> bool:
    """Equality of values that may be, or hold, arrays; numbers that are missing (NaN) in both are alike."""
    if (
        hasattr(one, "dtype")
        and hasattr(other, "dtype")
        and hasattr(one, "shape")
        and hasattr(other, "shape")
    ):
        from numpy import array_equal

        return array_equal(one, other, equal_nan=one.dtype.kind in "fc" and other.dtype.kind in "fc")
    if isinstance(one, (tuple, list)) and type(one) is type(other):
        return len(one) == len(other) and all(map(_alike, one, other))
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_alike(one[key], other[key]) for key in one)
    return bool(one == other) or (one != one and other != other)  # NaN alone is not itself


def _hash_of(values: Callable[[Any], tuple[Any, ...]]) -> Callable[[Any], int]:
    def __hash__(self: Any) -> int:
        return hash(tuple(map(_hashed, values(self))))

    return __hash__


def _hashed(value: Any) -> Any:
    """What is hashed of a value: missing numbers are alike, as in `_alike`."""
    if type(value) is tuple:
        return tuple(map(_hashed, value))
    return None if isinstance(value, float) and value != value else value  # NaN alone is not itself


def _frozen(cls: type[Any], names: frozenset[str]) -> dict[str, object]:
    """Refusals to change a field; a class below may add attributes that are no fields."""

    def __setattr__(self: Any, name: str, value: object) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return {"__setattr__": __setattr__, "__delattr__": __delattr__}


def _getstate(self: Any) -> list[object]:
    return [getattr(self, f.name) for f in fields(self)]


def _setstate(self: Any, state: Sequence[object]) -> None:
    for f, value in zip(fields(self), state, strict=True):
        object.__setattr__(self, f.name, value)


# -- the initializer, which is compiled: objects are made often --------------------------------------------------------


class _Factory:
    """What a signature shows as the default of a field that is made for each object."""

    def __repr__(self) -> str:
        return "<factory>"


_FACTORY = _Factory()


class _Initializer:
    """``__init__`` of a class, until it is first asked for: the function that it compiles then replaces it."""

    __slots__ = ("_cls", "_frozen")

    def __init__(self, cls: type[Any], frozen: bool) -> None:
        self._cls, self._frozen = cls, frozen

    def __get__(self, instance: object, owner: type[Any]) -> Callable[..., None]:
        function: Callable[..., None] = _compiled(self._cls, self._frozen)
        self._cls.__init__ = function
        return function if instance is None else MethodType(function, instance)


def _compiled(cls: type[Any], frozen: bool) -> Any:
    """The ``__init__`` that `dataclasses` would have made."""
    declared = fields(cls)
    given = [f for f in declared if f.init]
    positional = [_parameter(f) for f in given if not f.kw_only]
    keywords = [_parameter(f) for f in given if f.kw_only]
    head = ", ".join(["self", *positional, *(["*", *keywords] if keywords else [])])
    put = "_put(self, {0!r}, {1})" if frozen else "self.{0} = {1}"
    body = [put.format(f.name, value) for f in declared if (value := _value(f))]
    body += ["self.__post_init__()"] if hasattr(cls, "__post_init__") else []
    known: dict[str, object] = {"_FACTORY": _FACTORY, "_put": object.__setattr__}
    known |= {f"_default_{f.name}": f.default for f in declared if f.default is not MISSING}
    known |= {f"_make_{f.name}": f.default_factory for f in declared if f.default_factory is not MISSING}
    lines = f"def enclosing({', '.join(known)}):\n def __init__({head}):\n  " + "\n  ".join(body or ["pass"])
    made: dict[str, Any] = {}
    exec(f"{lines}\n return __init__", vars(sys.modules[cls.__module__]), made)  # noqa: S102  # names of fields alone
    function = made["enclosing"](**known)
    function.__qualname__ = f"{cls.__qualname__}.__init__"
    function.__annotations__ = {f.name: f.type for f in given} | {"return": None}
    return function


def _parameter(f: Field[Any]) -> str:
    if f.default is not MISSING:
        return f"{f.name}=_default_{f.name}"
    return f.name if f.default_factory is MISSING else f"{f.name}=_FACTORY"


def _value(f: Field[Any]) -> str:
    """What a field becomes, as an expression; "" where the class sets it later."""
    if f.default_factory is not MISSING:
        made = f"_make_{f.name}()"
        return f"{made} if {f.name} is _FACTORY else {f.name}" if f.init else made
    if f.init:
        return f.name
    return "" if f.default is MISSING else f"_default_{f.name}"
