# SPDX-License-Identifier: BSD-3-Clause
"""Entries of a YAML file that are checked as a whole: everything that is wrong, each with its place and its line."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from allanite.errors import FormatError

__all__ = ["Entry", "Fault", "Place", "check_entries", "name_of"]

#: Keys and positions that lead to an entry.
Place = tuple[str | int, ...]
#: Where it is, and what is wrong with it.
Fault = tuple[Place, str]


class Entry(BaseModel):
    """Unknown entries are refused: a word spelled wrong must not be a default in silence."""

    model_config = ConfigDict(extra="forbid", frozen=True)


Kind = TypeVar("Kind", bound=Entry)


def check_entries(
    kind: type[Kind],
    entries: Mapping[str, Any],
    source: str,
    lines: Mapping[Place, int],
    contradictions: Callable[[Kind], Iterable[Fault]],
) -> Kind:
    """The entries as what they describe.

    Parameters
    ----------
    kind : subclass of Entry
    entries : mapping
        Plain data.
    source : str
        For the message: the file.
    lines : mapping of place to int
        Lines of the entries; empty where they come out of no file.
    contradictions : callable
        Place and words of everything that does not fit together in what was made.

    Raises
    ------
    FormatError
        Something is wrong: the message lists all of it.
    """
    try:
        made = kind.model_validate(dict(entries))
    except ValidationError as error:
        raise FormatError(_listed(_wrong(error, entries), source, lines)) from None
    if wrong := list(contradictions(made)):
        raise FormatError(_listed(wrong, source, lines))
    return made


def name_of(place: Place) -> str:
    """In words: frame.fields[0]."""
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in place).lstrip(".")


def _wrong(error: ValidationError, entries: Mapping[str, Any]) -> list[Fault]:
    errors = error.errors()
    places = [_place_of(one["loc"], entries) for one in errors]
    return [
        (place, _said(one))
        for place, one in zip(places, errors, strict=True)
        # a list whose entries are wrong counts as empty: that is no fault of its own
        if one["type"] != "too_short" or not any(p != place and p[: len(place)] == place for p in places)
    ]


def _place_of(loc: Place, entries: object) -> Place:
    """The place without the names that pydantic gives to the members of a union."""
    place: list[str | int] = []
    inside: Any = entries
    for i, step in enumerate(loc):
        if isinstance(inside, Mapping) and step not in inside and i < len(loc) - 1:
            continue
        place.append(step)
        if isinstance(inside, Mapping):
            inside = inside.get(step)
        elif isinstance(inside, (list, tuple)) and isinstance(step, int) and step < len(inside):
            inside = inside[step]
        elif i < len(loc) - 1:
            place.pop()
    return tuple(place)


def _said(error: Any) -> str:
    if error["type"] == "missing":
        return "is missing"
    if error["type"] == "extra_forbidden":
        return "is not a known entry; see the how-to for the known ones"
    message = str(error["msg"]).removeprefix("Value error, ")
    message = message.replace("Input should", "should")
    return message if error["type"] == "value_error" else f"{message}, not {str(error['input'])[:60]!r}"


def _listed(wrong: list[Fault], source: str, lines: Mapping[Place, int]) -> str:
    in_order = sorted(wrong, key=lambda fault: _line(fault[0], lines) or 0)
    faults = list(dict.fromkeys(f"  {_where(place, lines)}: {what}" for place, what in in_order))
    return f"{source} has {len(faults)} {'fault' if len(faults) == 1 else 'faults'}:\n" + "\n".join(faults)


def _where(place: Place, lines: Mapping[Place, int]) -> str:
    known = _line(place, lines)
    return (name_of(place) or "top level") if known is None else f"line {known}, {name_of(place)}"


def _line(place: Place, lines: Mapping[Place, int]) -> int | None:
    """Of the entry, or of the nearest one around it."""
    return next((lines[place[:n]] for n in range(len(place), 0, -1) if place[:n] in lines), None)
