# SPDX-License-Identifier: BSD-3-Clause
"""Pieces that every page is made of: figures drawn twice, findings, provenance, numbers with powers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

from markupsafe import Markup, escape

from allanite.plain_files.printable import printable
from allanite.views.figures import matplotlib, plotly
from allanite.views.figures.panel import Sheet
from allanite.views.wording import model_words

__all__ = ["Figure", "clock", "finding_row", "provenance_rows", "with_powers"]

Json = Mapping[str, Any]
_MOST_SAID = 12  # entries of a list in the history that are spelled out
_SAFE_IN_URI = " !$&'()*+,-./:;=?@[]^_`{|}~\n"  # leaves an SVG readable, and half as long as base64 would


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A figure of the page: `spec` is drawn by the script, `still` (an SVG as data URI) stands in for it.

    Attributes
    ----------
    id, caption, words : str
        `words` say what is to be seen to those who cannot see it.
    sheet : Sheet
    """

    id: str
    caption: str
    words: str
    sheet: Sheet

    @classmethod
    def of(cls, id_: str, sheet: Sheet, caption: str, words: str) -> Figure:
        """The figure of a sheet; each of its two drawings is made when it is wanted."""
        return cls(id=id_, caption=caption, words=words, sheet=sheet)

    @property
    def spec(self) -> Json:
        """Traces and layout for Plotly."""
        return plotly.spec(self.sheet)

    @property
    def still(self) -> str:
        """The picture."""
        return "data:image/svg+xml," + quote(matplotlib.svg(self.sheet), safe=_SAFE_IN_URI)


def with_powers(text: str) -> Markup:
    """Text with exponents as people write them: 1.2e-05 becomes 1.2 × 10 to the minus five.

    An interval whose ends share an exponent gets it once: [1.1, 1.3] × 10 to the minus five.
    """
    safe = _MINUS.sub("−", _SHARED.sub(r"[\1, \3]e\2", printable(str(escape(text)), lines=True)))
    safe = safe.replace("T_b", "<i>T</i><sub>b</sub>").replace("B_equiv", "<i>B</i><sub>equiv</sub>")
    return Markup(_POWER.sub(lambda m: f"{m[1]}\u202f×\u202f10<sup>{_exponent(m[2])}</sup>", safe))  # nosec B704  # noqa: S704 - escaped above


_SHARED = re.compile(r"\[([\d.]+)e([+-]\d+), ([\d.]+)e\2\]")
_MINUS = re.compile(r"(?<![\w.])-(?=\d)")
_POWER = re.compile(r"([\d\]])e([+-]\d+)")


def _exponent(digits: str) -> str:
    return str(int(digits)).replace("-", "−")


def finding_row(finding: Json, rate: float) -> dict[str, Any]:
    """A finding as the table shows it; `rate` turns its samples into times."""
    return {
        **{k: finding[k] for k in ("code", "severity", "advice", "risk", "count", "accepted")},
        "message": finding["message"].removeprefix(f"{finding['channel']}: "),
        "channel": finding["channel"] or "all channels",
        "places": _places(finding["places"], rate, finding["count"]),
    }


def _places(places: Iterable[Sequence[int]], rate: float, count: int) -> str:
    found = [f"{clock(a / rate)} to {clock(b / rate)}" for a, b in places]
    covered = sum(b - a for a, b in places)
    return "; ".join(found) + (" and more" if found and count > covered else "")


def clock(seconds: float) -> str:
    """Hours, minutes and seconds since the first sample: a place that can be found again."""
    whole = math.floor(seconds)
    part = f"{seconds - whole:.3f}"[1:] if seconds != whole else ""
    return f"{whole // 3600}:{whole % 3600 // 60:02}:{whole % 60:02}{part}"


def provenance_rows(document: Json) -> list[tuple[str, str | tuple[str, ...]]]:
    """Where a result comes from: file, command, versions, and every step of the record's history.

    A step is its name and a line for each thing that is known of it; all else is text.
    """
    found = document.get("provenance") or {}
    rows = [
        ("File", found.get("source")),
        ("SHA-256", found.get("sha256")),
        ("Command", found.get("command")),
        ("Made", str(found.get("created") or "").replace("T", " ").replace("Z", " UTC")),
        ("allanite", found.get("allanite")),
        ("Python, NumPy", ", ".join(str(v) for v in (found.get("python"), found.get("numpy")) if v)),
        (
            document["format"].removeprefix("allanite-").capitalize(),
            f"{document['format']} version {document['version']}",
        ),
    ]
    history = (document.get("recording") or {}).get("history") or ()
    steps = [(f"Step {i}", _step(step)) for i, step in enumerate(history, 1)]
    return [*((name, str(value)) for name, value in rows if value), *steps]


def _step(step: Json) -> tuple[str, ...]:
    """Its name, and a line for each thing that is known of it."""
    known = {key: _said(part) for key, part in step.items() if key != "step"}
    lines = (f"{_spoken(key)}: {words}" for key, words in known.items() if words)
    return (_spoken(str(step.get("step", "step"))), *lines)


def _said(value: Any) -> str:
    """Nested plain data in words."""
    if isinstance(value, Mapping):
        if "terms" in value:
            with suppress(
                LookupError, TypeError, ValueError
            ):  # a history is free-form: anything may be called that
                return model_words(value)
        return ", ".join(f"{key} {words}" for key, part in value.items() if (words := _said(part)))
    if isinstance(value, list | tuple):
        return ", ".join(map(_said, value)) if len(value) <= _MOST_SAID else f"{len(value)} entries"
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _spoken(name: str) -> str:
    return name.replace("_", " ")
