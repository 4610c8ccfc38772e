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
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, Field, fields
from enum import Enum
from typing import ClassVar, Protocol, Self, TypeVar, runtime_checkable

import numpy as np

from allanite.errors import AllaniteError, FormatError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.json_values import plain
from allanite.quantities.tabular import Tabular

__all__ = ["FieldEntry", "Result", "entries_of", "read_result"]


R = TypeVar("R", bound="Result")


@runtime_checkable
class _Documented(Protocol):
    """What writes and reads its own document."""

    def to_json(self) -> dict[str, object]: ...

    @classmethod
    def from_json(cls, data: Mapping[str, object]) -> Self: ...


class Result(Tabular):
    """Base of frozen dataclasses that are results or parts of them.

    A field is a number, a text, a truth, an array, a `Result`, anything else with `to_json` and `from_json`, a member
    of an `Enum`, None, or a tuple or mapping of these. SI units throughout.

    Attributes
    ----------
    FORMAT, VERSION : str, int
        Of a document of its own; "" for a part of one.
    STATED : tuple of str
        Properties that the document states besides its fields.
    PLAIN : bool
        What `to_json` gives needs no second look.
    """

    __slots__ = ()
    FORMAT: ClassVar[str] = ""
    VERSION: ClassVar[int] = 1
    STATED: ClassVar[tuple[str, ...]] = ()
    PLAIN: ClassVar[bool] = True

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
            A later version, fields that are missing, or of another form; names them all, each with its place.
        """
        present = cls._upgraded(data)
        version = present.get("version")
        if cls.FORMAT and version != cls.VERSION:
            raise FormatError(
                f"version {version!r} of {cls.FORMAT}; this allanite reads up to version {cls.VERSION}"
            )
        return read_result(cls, present, cls.FORMAT)

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


def read_result(of: type[R], data: object, place: str = "") -> R:
    """A result out of plain data of its present version; `place` is where the data are in a document.

    Raises
    ------
    FormatError
        As for `Result.from_json`.
    """
    if not isinstance(data, Mapping):
        raise FormatError(f"{place}: an object is expected, not {data!r:.40}")
    if not of.FORMAT:  # a part may be of a version of its own
        data = of._upgraded(data)
    known = {f.name: f"{place}.{f.name}" if place else f.name for f in _fields(of)}
    missing = [
        f"{known[f.name]} is missing"
        for f in _fields(of)
        if f.name not in data and f.default is MISSING and f.default_factory is MISSING
    ]
    present = [name for name in known if name in data]
    kinds = _types(of)  # type: ignore[arg-type]  # classes are hashable
    values = _read_all([(kinds[name], data[name], known[name]) for name in present], missing)
    try:
        return of(**dict(zip(present, values, strict=True)))
    except FormatError as fault:
        raise FormatError(f"{place}: {fault}") from None


def _read_all(parts: Iterable[tuple[object, object, str]], faults: Sequence[str] = ()) -> list[object]:
    """Values with their types and places, out of plain data; all faults at once, beside those that are known."""
    values, messages = [], [*faults]
    for kind, value, place in parts:
        try:
            values.append(_read(kind, value, place))
        except FormatError as fault:
            messages.append(str(fault))
    if messages:
        raise FormatError("\n".join(messages))
    return values


def _read(kind: object, value: object, place: str) -> object:
    """A value of a type, out of plain data."""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        if value is None and type(None) in inner:
            return None
        (kind,) = (k for k in inner if k is not type(None))
        return _read(kind, value, place)
    if origin is tuple:
        return tuple(_read_all(_members(inner, value, place)))
    if origin is np.ndarray:
        return _array(typing.get_args(inner[1])[0], value, place)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            raise FormatError(f"{place}: an object is expected, not {value!r:.40}")
        values = _read_all((inner[1], v, f"{place}.{key}") for key, v in value.items())
        return dict(zip(value, values, strict=True))
    if origin is typing.Literal:
        return _one_of(inner, value, place)
    return _single(kind, value, place) if isinstance(kind, type) and kind is not object else value


def _members(inner: tuple[object, ...], value: object, place: str) -> Iterator[tuple[object, object, str]]:
    """Type, value and place of each member of a tuple."""
    if not isinstance(value, Sequence) or isinstance(value, str):
        raise FormatError(f"{place}: a list is expected, not {value!r:.40}")
    each = [inner[0]] * len(value) if inner[1:] == (...,) else inner
    if len(each) != len(value):
        raise FormatError(f"{place}: {len(each)} members are expected, not {len(value)}")
    return ((kind, v, f"{place}[{i}]") for i, (kind, v) in enumerate(zip(each, value, strict=True)))


def _one_of(known: Sequence[object], value: object, place: str) -> object:
    if value not in known:
        listed = ", ".join(map(repr, known))
        raise FormatError(f"{place}: one of {listed} is expected, not {value!r:.40}")
    return value


def _array(scalar: object, value: object, place: str) -> object:
    try:
        return np.asarray(value, dtype=np.float64 if value is None else scalar)  # type: ignore[call-overload]
    except (OverflowError, TypeError, ValueError):
        raise FormatError(f"{place}: a list of numbers is expected, not {value!r:.40}") from None


def _single(kind: type[object], value: object, place: str) -> object:
    if issubclass(kind, Result):
        return read_result(kind, value, place)
    if issubclass(kind, Enum):
        return kind(_one_of([m.value for m in kind], value, place))
    if issubclass(kind, _Documented):
        if not isinstance(value, Mapping):
            raise FormatError(f"{place}: an object is expected, not {value!r:.40}")
        return _documented(kind, value, place)
    if kind is float and value is None:
        return math.nan
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if type(value) is not kind:
        raise FormatError(f"{place}: a {kind.__name__} is expected, not {value!r:.40}")
    return value


def _documented(kind: type[_Documented], value: Mapping[str, object], place: str) -> object:
    try:
        return kind.from_json(value)
    except (AllaniteError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as fault:
        missing = isinstance(fault, KeyError)
        raise FormatError(f"{place}: {fault} is missing" if missing else f"{place}: {fault}") from None


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
    """What the section "Attributes" of a result's docstring says, field by field; those of its bases first."""
    bases = [base for base in of.__bases__ if issubclass(base, Result) and base is not Result]
    inherited = [entry for base in bases for entry in entries_of(base)]
    _, _, section = inspect.cleandoc(of.__doc__ or "").partition("Attributes\n----------\n")
    entries: list[FieldEntry] = inherited
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
