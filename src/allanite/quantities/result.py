# SPDX-License-Identifier: BSD-3-Clause
"""The base of results: what a dataclass says of its fields, said once, makes documents of it and reads them back.

The types of the fields say how they are written and read; the section "Attributes" of the docstring gives their units
and what they mean. So a new field is one line of each.
"""

from __future__ import annotations

import functools
import inspect
import math
import re
import types
import typing
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, fields
from enum import Enum
from typing import ClassVar, Protocol, Self, TypeVar, runtime_checkable

import numpy as np

from allanite.errors import FormatError
from allanite.plain_files.json_values import plain

__all__ = ["FieldEntry", "Result", "entries_of"]


R = TypeVar("R", bound="Result")


@runtime_checkable
class _Documented(Protocol):
    """What writes and reads its own document."""

    def to_json(self) -> dict[str, object]: ...

    @classmethod
    def from_json(cls, data: Mapping[str, object]) -> Self: ...


class Result:
    """Base of frozen dataclasses that are results or parts of them.

    A field is a number, a text, a truth, an array, a `Result`, anything else with `to_json` and `from_json`, a member
    of an `Enum`, None, or a tuple or mapping of these. SI units throughout.

    Attributes
    ----------
    FORMAT, VERSION : str, int
        Of a document of its own; "" for a part of one.
    STATED : tuple of str
        Properties that the document states besides its fields.
    """

    __slots__ = ()
    FORMAT: ClassVar[str] = ""
    VERSION: ClassVar[int] = 1
    STATED: ClassVar[tuple[str, ...]] = ()

    def to_json(self) -> dict[str, object]:
        """Plain data, SI units; null for a number that does not exist or is infinite."""
        head: dict[str, object] = {"format": self.FORMAT, "version": self.VERSION} if self.FORMAT else {}
        names = [*self.STATED, *(f.name for f in _fields(type(self)))]
        return head | {name: plain(getattr(self, name)) for name in names}

    @classmethod
    def from_json(cls, data: Mapping[str, object]) -> Self:
        """Inverse of `to_json`; an infinite number comes back as NaN.

        Raises
        ------
        FormatError
            A later version, a field that is missing, or one of another form; says which.
        """
        present = cls._upgraded(data)
        version = present.get("version")
        if cls.FORMAT and version != cls.VERSION:
            raise FormatError(
                f"version {version!r} of {cls.FORMAT}; this allanite reads up to version {cls.VERSION}"
            )
        return _read_result(cls, present, cls.FORMAT)

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        """A document of an earlier version in the present one; for results that had one."""
        return data


# -- out of a document ---------------------------------------------------------------------------------------------


@functools.cache
def _types(of: Hashable) -> Mapping[str, object]:
    """Type of every field of a result by its name."""
    return typing.get_type_hints(of)


def _fields(of: type[Result]) -> tuple[Field[object], ...]:
    return fields(of)  # type: ignore[arg-type]  # only dataclasses are results


def _read_result(of: type[R], data: object, place: str) -> R:
    if not isinstance(data, Mapping):
        raise FormatError(f"{place}: an object is expected, not {data!r:.40}")
    values: dict[str, object] = {}
    for f in _fields(of):
        where = f"{place}.{f.name}" if place else f.name
        if f.name in data:
            values[f.name] = _read(_types(of)[f.name], data[f.name], where)  # type: ignore[arg-type]  # classes are hashable
        elif f.default is MISSING and f.default_factory is MISSING:
            raise FormatError(f"{where} is missing")
    return of(**values)


def _read(kind: object, value: object, place: str) -> object:
    """A value of a type, out of plain data."""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        if value is None and type(None) in inner:
            return None
        (kind,) = (k for k in inner if k is not type(None))
        return _read(kind, value, place)
    if origin is tuple:
        return tuple(_members(inner, value, place))
    if origin is np.ndarray:
        return _array(typing.get_args(inner[1])[0], value, place)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            raise FormatError(f"{place}: an object is expected, not {value!r:.40}")
        return {key: _read(inner[1], v, f"{place}.{key}") for key, v in value.items()}
    return _single(kind, value, place) if isinstance(kind, type) and kind is not object else value


def _members(inner: tuple[object, ...], value: object, place: str) -> Iterator[object]:
    if not isinstance(value, Sequence) or isinstance(value, str):
        raise FormatError(f"{place}: a list is expected, not {value!r:.40}")
    each = [inner[0]] * len(value) if inner[1:] == (...,) else inner
    if len(each) != len(value):
        raise FormatError(f"{place}: {len(each)} members are expected, not {len(value)}")
    return (_read(kind, v, f"{place}[{i}]") for i, (kind, v) in enumerate(zip(each, value, strict=True)))


def _array(scalar: object, value: object, place: str) -> object:
    try:
        return np.asarray(value, dtype=np.float64 if value is None else scalar)  # type: ignore[call-overload]
    except (TypeError, ValueError):
        raise FormatError(f"{place}: a list of numbers is expected, not {value!r:.40}") from None


def _single(kind: type[object], value: object, place: str) -> object:
    if issubclass(kind, Result):
        return _read_result(kind, value, place)
    if issubclass(kind, Enum):
        try:
            return kind(value)
        except ValueError:
            known = ", ".join(repr(m.value) for m in kind)
            raise FormatError(f"{place}: one of {known} is expected, not {value!r:.40}") from None
    if issubclass(kind, _Documented):
        if not isinstance(value, Mapping):
            raise FormatError(f"{place}: an object is expected, not {value!r:.40}")
        return kind.from_json(value)
    if kind is float and value is None:
        return math.nan
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if type(value) is not kind:
        raise FormatError(f"{place}: a {kind.__name__} is expected, not {value!r:.40}")
    return value


# -- what is said of fields -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldEntry:
    """A field as the reference lists it.

    Attributes
    ----------
    name, type, unit, meaning : str
        Of its docstring; no unit is "".
    """

    name: str
    type: str
    unit: str
    meaning: str


_ENTRY = re.compile(r"(?P<names>\w+(?:, \w+)*) : (?P<type>.*?)(?: \[(?P<unit>[^\]]+)\])?")


def entries_of(of: type[Result]) -> list[FieldEntry]:
    """What the section "Attributes" of a result's docstring says, field by field."""
    _, _, section = inspect.cleandoc(of.__doc__ or "").partition("Attributes\n----------\n")
    entries: list[FieldEntry] = []
    for entry in re.split(r"\n(?=\S)", section.split("\n\n")[0]):
        head, _, words = entry.partition("\n")
        parts = _ENTRY.fullmatch(head)
        if parts:
            meaning = " ".join(words.split())
            entries += [
                FieldEntry(name=name, type=parts["type"], unit=parts["unit"] or "", meaning=meaning)
                for name in parts["names"].split(", ")
            ]
    return entries
