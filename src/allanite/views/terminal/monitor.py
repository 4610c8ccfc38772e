# SPDX-License-Identifier: BSD-3-Clause
"""A run while it is recorded, as text that is drawn again and again."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, interval, number, with_parentheses
from allanite.recording.records import Channel, Kind
from allanite.views.terminal.console import console, is_terminal, table_of
from allanite.views.terminal.octaves import octave_table
from allanite.views.terminal.parts import TONES
from allanite.views.wording.run_end import RUN_STATES

if TYPE_CHECKING:
    from rich.console import Console, Group
    from rich.table import Table
    from rich.text import Text

    from allanite.noise.allan import AllanCurve

__all__ = ["monitoring", "show_monitor"]

Json = Mapping[str, Any]

#: A recorder that has stored nothing for so long is silent [s]: batches come each second.
_SILENT = 10.0
_BAR = 16
#: Degrees of freedom that a point needs to be called the lowest: fewer are low by chance.
_SURE = 10.0
#: Lines of a page besides those of the curve and of the channels.
_LINES = 15


class Draw(Protocol):
    def __call__(self, document: Json, curve: AllanCurve | None) -> None: ...


@contextmanager
def monitoring(channel: str | None = None) -> Iterator[Draw]:
    """Something that draws over what it drew before; where stdout is no terminal, below it."""
    if not is_terminal(sys.stdout):
        yield lambda document, curve: show_monitor(document, curve, channel)
        return
    from rich.live import Live

    out = console()
    with Live(console=out, screen=False, auto_refresh=False, vertical_overflow="crop") as live:

        def draw(document: Json, curve: AllanCurve | None) -> None:
            live.update(_page(out, document, curve, channel, out.height), refresh=True)

        yield draw


def show_monitor(document: Json, curve: AllanCurve | None, channel: str | None = None) -> None:
    """Once, in whole; the curve of one channel, by default the first that carries noise."""
    out = console()
    out.print(_page(out, document, curve, channel, None))


def _page(
    out: Console, document: Json, curve: AllanCurve | None, channel: str | None, height: int | None
) -> Group:
    from rich.console import Group
    from rich.text import Text

    parts: list[Any] = [_head(document), ""]
    if document["plan"] is not None:
        parts += [_plan(document), ""]
    parts += [_facts(document), "", _channels(document, curve)]
    if curve is not None:
        name = channel if channel in curve.names else curve.names[0]
        others = [n for n in curve.names if n != name]
        more = f"  (another: --channel {others[0]})" if others else ""
        room = None if height is None else height - _LINES - len(document["channels"])
        parts += [
            "",
            Text.assemble((f"Allan deviation of {name} so far", "bold"), (more, "dim")),
            octave_table(curve, name, columns=out.width, lines=room),
        ]
    return Group(*parts)


# -- parts ------------------------------------------------------------------------------------------------


def _head(document: Json) -> Text:
    from rich.text import Text

    words, tone = RUN_STATES[document["status"]]
    age, outage = document["age"], document["outage"]
    if age is not None and outage is not None:
        words, tone = f"recording, but no data arrive: {outage['reason']}", "warning"
    elif age is not None and age > _SILENT:
        words, tone = f"recording, but nothing has been stored for {duration(age)}", "warning"
    reason = f": {document['reason']}" if document["reason"] else ""
    part = f", part {document['part']}" if document["part"] > 1 else ""
    name = f"  {Path(document['folder']).name}{part}"
    return Text.assemble((f"● {words}{reason}", TONES[tone]), name, no_wrap=True, overflow="ellipsis")


def _plan(document: Json) -> Text:
    from rich.text import Text

    plan = document["plan"]
    full = round(plan["share"] * _BAR)
    done = duration(plan["share"] * plan["seconds"])
    text = Text.assemble(
        ("━" * full, "bold green"), ("━" * (_BAR - full), "dim"),
        f"  {100 * plan['share']:.1f} %  {done} of {duration(plan['seconds'])}",
    )  # fmt: skip
    if plan["left"] is not None:
        text.append(f", {duration(plan['left'])} left, until {_moment(plan['ends'])}")
    return text


def _facts(document: Json) -> Table:
    from rich.table import Table
    from rich.text import Text

    named = (document["instrument"].get(key) for key in ("maker", "model", "serial"))
    rows: list[tuple[str, str | Text]] = [
        ("instrument", " ".join(str(part) for part in named if part) or "–"),
        ("samples", f"{_grouped(document['samples'])}, {duration(document['samples'] / document['rate'])}"),
        ("missing", _missing(document)),
        ("rate", _rate(document)),
        ("disk", _disk(document)),
    ]
    if document["age"] is not None:
        rows[1] = ("samples", f"{rows[1][1]}; the last one {duration(document['age'])} ago")
    rows[3:3] = [
        (name, Text(_grouped(document[key]), TONES["warning"]))
        for name, key in (("no value", "overloads"), ("doubtful", "doubtful"))
        if document[key]
    ]
    if document["remarks"]:
        rows.append(("remarks", f"{_grouped(document['remarks'])} of the instrument, in manifest.jsonl"))
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="dim")
    grid.add_column(overflow="fold")
    for name, value in rows:
        grid.add_row(name, value)
    return grid


def _missing(document: Json) -> str | Text:
    from rich.text import Text

    outage = document["outage"]
    if not document["missing"]:
        return "none" if outage is None else Text(f"none yet noted{_since(outage)}", TONES["warning"])
    gaps = "1 gap" if document["gaps"] == 1 else f"{_grouped(document['gaps'])} gaps"
    share = number(100 * document["missing_share"], 2)
    text = Text.assemble((f"{_grouped(document['missing'])} ({share} %) in {gaps}", TONES["warning"]))
    last = document["last_gap"]
    if last is not None:
        text.append(f"; the last, noted {_moment(last['noted'])}: {last['reason'] or 'no reason was noted'}")
    if outage is not None:
        text.append(_since(outage), TONES["warning"])
    return text


def _since(outage: Json) -> str:
    """What is missing besides, behind the last sample: so far nobody counted it."""
    if outage["seconds"] is None:
        return f"; no data arrived when the recorder died: {outage['reason']}"
    return f"; and by the clock about {_grouped(outage['samples'])} in the {duration(outage['seconds'])} since the last"


def _rate(document: Json) -> str:
    measured = document["measured_rate"]
    nominal = f"{document['rate']:.9g} Hz nominal"
    if measured is None:
        return nominal
    value, sd = measured["value"], measured["standard_uncertainty"]
    ppm = f"{number(1e6 * (value / document['rate'] - 1), 2)}".replace("-", "−")
    return f"{nominal}; {with_parentheses(value, sd)} Hz by the host's clock, {ppm} ppm"


def _disk(document: Json) -> str | Text:
    from rich.text import Text

    disk = document["disk"]
    text = f"{_size(disk['free'])} free"
    if document["status"] != "recording":
        return text
    text += f", enough for {duration(disk['seconds'])}"
    if disk["enough"]:
        return text
    if disk["needed"] is None:
        return Text(f"{text}: make room", TONES["fatal"])
    short = disk["needed"] - disk["free"]
    shortage = f"{_size(short)} too little" if short > 0 else "less than twice that is free"
    return Text(f"{text}; the run still needs {_size(disk['needed'])}, {shortage}: make room", TONES["fatal"])


def _size(count: float) -> str:
    return f"{count / 1e9:.3g} GB" if count >= 1e9 else f"{count / 1e6:.3g} MB"


def _channels(document: Json, curve: AllanCurve | None) -> Table:
    """Last values, and the lowest point of each curve."""
    table = table_of(("Channel", "Last", "", "Lowest deviation so far"))
    values: Sequence[float | None] = document["values"] or [None] * len(document["channels"])
    for c, value in zip(document["channels"], values, strict=True):
        table.add_row(
            c["name"], f"{number(value, 6)} {c['unit']}", _converted(c, value), _lowest(curve, c["name"])
        )
    return table


def _converted(channel: Json, value: float | None) -> str:
    """Through the scale factor, where the samples are volts or counts of something else."""
    if value is None or Channel.of("", channel["unit"]).kind is Kind(channel["kind"]):
        return ""
    unit, factor = display_unit(channel["kind"], "mean", channel["unit"])
    return f"= {number(value * channel['scale'] / factor, 5)} {unit}"


def _lowest(curve: AllanCurve | None, name: str) -> str:
    import numpy as np

    if curve is None or name not in curve.names:
        return "–"
    i = curve.names.index(name)
    there = np.flatnonzero(np.isfinite(curve.deviation[:, i]) & (curve.edf[:, i] >= _SURE))
    if not len(there):
        return "–"
    j = int(there[np.argmin(curve.deviation[there, i])])
    unit, factor = display_unit(curve.channels[i].kind.value, "adev", curve.channels[i].unit)
    middle, low, high = (float(getattr(curve, k)[j, i]) / factor for k in ("deviation", "lower", "upper"))
    texts = interval(middle, low, high)
    return f"{texts[0]} [{texts[1]}, {texts[2]}] {unit} at {duration(float(curve.tau[j]))}"


def _grouped(count: int) -> str:
    return f"{count:,}".replace(",", "\u202f")


def _moment(text: str) -> str:
    """An instant of these days: 22 Nov 18:26 UTC."""
    moment = datetime.fromisoformat(text)
    return f"{moment.day} {moment:%b %H:%M} UTC"
