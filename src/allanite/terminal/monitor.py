# SPDX-License-Identifier: BSD-3-Clause
"""A run while it is recorded, as text that is drawn again and again."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Protocol

from allanite.terminal.console import console
from allanite.terminal.parts import TONES
from allanite.terminal.study import curve_table
from allanite.wording.numbers import duration, number

if TYPE_CHECKING:
    from rich.console import Group

    from allanite.allan import AllanCurve

__all__ = ["monitoring", "show_monitor"]

Json = Mapping[str, Any]

_STATUS = {
    "recording": ("recording", "good"),
    "success": ("finished as planned", "good"),
    "abort": ("stopped before its time", "warning"),
    "fail": ("ended by a failure", "fatal"),
    "unfinished": ("broken off: the recorder died", "fatal"),
}


class Draw(Protocol):
    def __call__(self, document: Json, curve: AllanCurve | None) -> None: ...


@contextmanager
def monitoring() -> Iterator[Draw]:
    """Something that draws over what it drew before; where stdout is no terminal, below it."""
    if not sys.stdout.isatty():
        yield show_monitor
        return
    from rich.live import Live

    with Live(console=console(), screen=False, auto_refresh=False) as live:

        def draw(document: Json, curve: AllanCurve | None) -> None:
            live.update(_page(document, curve), refresh=True)

        yield draw


def show_monitor(document: Json, curve: AllanCurve | None) -> None:
    """Once."""
    console().print(_page(document, curve))


def _page(document: Json, curve: AllanCurve | None) -> Group:
    from rich.console import Group
    from rich.text import Text

    words, tone = _STATUS[document["status"]]
    reason = f": {document['reason']}" if document["reason"] else ""
    parts: list[Any] = [Text(f"{words}{reason}", TONES[tone]), _facts(document)]
    if curve is not None:
        parts += ["", curve_table(curve, range(min(len(curve.channels), 3)))]
    return Group(*parts)


def _facts(document: Json) -> str:
    rows = [
        ("samples", f"{document['samples']} ({duration(document['samples'] / document['rate'])})"),
        ("missing", f"{document['missing']} in {document['gaps']} gaps" if document["missing"] else "none"),
        ("rate", _rate(document)),
        ("last", _last(document)),
        ("disk", f"{document['disk']['free'] / 1e9:.1f} GB free, {duration(document['disk']['seconds'])}"),
    ]
    if document["overloads"]:
        rows.insert(2, ("overloads", str(document["overloads"])))
    return "\n".join(f"{name:<10}{text}" for name, text in rows)


def _rate(document: Json) -> str:
    measured = document["measured_rate"]
    return f"{document['rate']:g} Hz" + (
        "" if measured is None else f", by the host's clock {measured:.6g} Hz"
    )


def _last(document: Json) -> str:
    named = zip(document["channels"], document["values"], strict=False)
    return ", ".join(f"{c['name']} {number(v)} {c['unit']}" for c, v in named) or "nothing yet"
