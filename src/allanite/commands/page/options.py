# SPDX-License-Identifier: BSD-3-Clause
"""Options that a page may give: their kind, how the command line spells them, and how Python does.

What is not in a table does not exist. Values are checked here, and become one word of a command each,
``--name=value``: nothing that somebody types can become another option, a path or a line of a shell.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from typing import Any

from allanite.commands import option
from allanite.commands.option import Option
from allanite.commands.page.replies import Refused
from allanite.lazy_dataclasses import dataclass

__all__ = [
    "READING",
    "Code",
    "Spelt",
    "asked_for",
    "checked",
    "code_of",
    "described",
    "given_in",
    "number_text",
]

_LONGEST = 2000  # characters of a text
_MOST = 1000  # members of a list


@dataclass(frozen=True, slots=True)
class Code:
    """A piece of Python, as it stands in a line."""

    text: str


def given_in(request: Mapping[str, Any], name: str) -> dict[str, Any]:
    """The options that a request holds under a name.

    Raises
    ------
    Refused
        They are no object.
    """
    options = request.get(name)
    if options is not None and not isinstance(options, Mapping):
        raise Refused(400, f"{name} must be an object of names and values")
    return dict(options or {})


#: Types that the page shows as others.
_ON_THE_PAGE = {
    "share": "number",
    "lines": "text",
    "findings": "texts",
    "goal": "number",
    "latitude": "degrees",
    "turns": "spans",
}


def _help(option: Option) -> str:
    """What the page says of an option: its fields take numbers and lists where the command line takes words."""
    if option.type == "goal":
        return f"{option.help.removesuffix('.')}: a share (0.03), or degrees with north."
    if option.type == "turns":
        return "Turns by hand: [[start, stop], …]."
    if option.type == "headings":
        return "Positions by hand: [[start, stop, heading], …]."
    if option.type == "spans":
        return f"{option.help.removesuffix('.')}: [[from, to], …]."
    return f"{option.help.removesuffix('.')} (0.001 is 0.1 %)." if option.type == "share" else option.help


def described(options: Mapping[str, Option]) -> dict[str, Any]:
    """For the page: what each is called and takes."""
    return {
        name: {
            "type": "choice" if o.choices else _ON_THE_PAGE.get(o.type, o.type),
            "help": _help(o),
            **({"choices": list(o.choices)} if o.choices else {}),
            **({} if o.default is None else {"default": o.default}),
        }
        for name, o in options.items()
    }


# -- values -----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Spelt:
    """Options that were given: words of a command, and arguments in Python."""

    words: tuple[str, ...]
    arguments: Mapping[str, Any]
    inside: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


Place = Callable[[Option, str, Any], str]
"""Turns an id, turns or a model into a word that names it."""


def checked(options: Mapping[str, Option], given: Mapping[str, Any], place: Place) -> Spelt:
    """The options of a request, each checked.

    Raises
    ------
    Refused
        Names the option and what it takes.
    """
    words: list[str] = []
    arguments: dict[str, Any] = {}
    inside: dict[str, dict[str, Any]] = {}
    for name, value in given.items():
        option = options.get(name)
        if option is None:
            raise Refused(400, f"no option {str(name)[:60]!r}; there are: {', '.join(options) or 'none'}")
        if value is None or value is False or value == "" or value == []:
            continue
        if option.type == "goal":  # what it is depends on what is planned
            option = replace(option, type="degrees" if given.get("north") is True else "number")
        text, python = _spelt(option, name, value, place)
        words += [f"{option.flag}={t}" if t is not None else option.flag for t in text]
        target = inside.setdefault(option.inside, {}) if option.inside else arguments
        target[option.python] = python
    return Spelt(words=tuple(words), arguments=arguments, inside=inside)


def _spelt(option: Option, name: str, value: Any, place: Place) -> tuple[list[str | None], Any]:
    """Words of a command (None: the flag alone), and the value in Python."""
    match option.type:
        case "flag":
            if value is not True:
                raise Refused(400, f"{name} is yes or no (true, false)")
            return [None], True
        case "number" | "share" | "seconds" | "degrees" | "latitude" | "deg/s" | "deg/h" | "deg/h/g":
            return _number(option.type, _real(name, value))
        case "integer":
            whole = _real(name, value)
            if whole != int(whole):
                raise Refused(400, f"{name} must be a whole number")
            return [str(int(whole))], int(whole)
        case "choice" | "text" if option.choices:
            if value not in option.choices:
                raise Refused(400, f"{name} must be one of {', '.join(option.choices)}")
            return [str(value)], value
        case "text":
            return [_text(name, value)], value
        case "lines":
            return [_text(name, value)], _frequencies(name, value)
        case "texts" | "findings":
            texts = [_text(name, v) for v in _list(name, value)]
            return list(texts), texts
        case "names":
            texts = [_name(name, v) for v in _list(name, value)]
            return [",".join(texts)], texts
        case "by-channel":
            return _by_channel(name, value)
        case "seconds-list":
            numbers = [_real(name, v) for v in _list(name, value)]
            return [",".join(map(number_text, numbers))], numbers
        case "spans":
            spans = _rows(name, value, 2)
            return [",".join(f"{number_text(a)}:{number_text(b)}" for a, b in spans)], [
                tuple(s) for s in spans
            ]
        case "turns" | "headings":
            _rows(name, value, 2 if option.type == "turns" else 3)
            word = place(option, name, value)
            return [word], word
        case _:
            word = place(option, name, value)
            return [word], word


def _number(kind: str, value: float) -> tuple[list[str | None], Any]:
    text = number_text(value)
    if kind in ("degrees", "latitude"):
        return [f"{text}deg"], Code(f"math.radians({text})")
    if kind in ("deg/s", "deg/h", "deg/h/g"):
        return [f"{text}{kind}"], Code(f"{text} * parse_unit({kind!r}).factor")
    return [text], value


def number_text(value: float) -> str:
    """The shortest text from which the same number is read."""
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(float(value))


def _real(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise Refused(400, f"{name} must be a number")
    return float(value)


def _text(name: str, value: Any) -> str:
    if (
        not isinstance(value, str)
        or len(value) > _LONGEST
        or any(ord(c) < 32 or ord(c) == 127 for c in value)
    ):
        raise Refused(400, f"{name} must be a line of text")
    return value


def _frequencies(name: str, text: str) -> str | list[float]:
    """Spectral lines as Python has them."""
    try:
        return text if text == "auto" else [] if text == "none" else [float(part) for part in text.split(",")]
    except ValueError:
        raise Refused(400, f"{name}: auto, none, or frequencies in Hz like 12.3,50") from None


def _name(name: str, value: Any) -> str:
    text = _text(name, value)
    if "," in text:
        raise Refused(400, f"{name}: a name cannot contain a comma: {text[:60]}")
    return text


def _list(name: str, value: Any) -> Sequence[Any]:
    if not isinstance(value, list) or len(value) > _MOST:
        raise Refused(400, f"{name} must be a list of at most {_MOST}")
    return value


def _by_channel(name: str, value: Any) -> tuple[list[str | None], Any]:
    if isinstance(value, str):
        text = _text(name, value)
        if "=" in text:
            raise Refused(400, f"{name}: write one for all, or an object of channels")
        return [text], text
    if not isinstance(value, Mapping) or not 0 < len(value) <= _MOST:
        raise Refused(400, f"{name} must be a text, or an object of channels and texts")
    parts = {_text(name, k): _text(name, v) for k, v in value.items()}
    if any(re.search("[,=]", word) for pair in parts.items() for word in pair):
        raise Refused(400, f"{name}: neither a channel nor its value may contain a comma or =")
    return [",".join(f"{k}={v}" for k, v in parts.items())], parts


def _rows(name: str, value: Any, width: int) -> list[list[float]]:
    rows = [[_real(name, v) for v in _list(name, row)] for row in _list(name, value)]
    if any(len(row) != width or row[0] > row[1] for row in rows):
        columns = "start, stop" + (", heading" if width == 3 else "")
        raise Refused(400, f"{name} must be a list of [{columns}] with start before stop")
    return rows


def code_of(value: Any) -> str:
    """A value as it stands in Python."""
    if isinstance(value, Code):
        return value.text
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{k!r}: {code_of(v)}" for k, v in value.items()) + "}"
    if isinstance(value, tuple):
        return "(" + ", ".join(map(code_of, value)) + ("," if len(value) == 1 else "") + ")"
    if isinstance(value, list):
        return "[" + ", ".join(map(code_of, value)) + "]"
    return number_text(value) if isinstance(value, float) else repr(value)


READING: Mapping[str, Option] = {o.python: o for o in option.READING if o.type != "file"}
"""What every kind of work that reads a log understands; files are attached."""


def asked_for(message: str) -> list[str]:
    """The options of reading that a refusal names: what can be given so that the file is read."""
    named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", message))
    return [name for name, option in READING.items() if option.flag in named]
