# SPDX-License-Identifier: BSD-3-Clause
"""Recordings and curves as text, and what was found in a record."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from allanite.plain_files.printable import printable
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, number
from allanite.recording.health.finding import Finding, Severity, percent
from allanite.views.terminal.console import console, table_of
from allanite.views.wording.findings import finding_kinds, finding_line, movement, said_of
from allanite.views.wording.recorded import missing_lines, record_facts

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from allanite.fitting.sensor_curves import OverFloor
    from allanite.noise.allan import AllanCurve
    from allanite.noise.allan.interval_error import IntervalError

__all__ = [
    "curve_table",
    "show_curve",
    "show_finding_lines",
    "show_findings",
    "show_interval_errors",
    "show_movement",
    "show_recording",
]

Json = Mapping[str, Any]

#: Sets of channels whose gaps are listed, and gaps of each.
_SETS, _SPANS = 12, 12
_COLOURS = {"fatal": "bold red", "warning": "yellow", "info": "cyan"}


def show_movement(findings: Sequence[Finding]) -> None:
    """That a log moves, before anything else is said of it."""
    from rich.text import Text

    words = movement(findings)
    if words is not None:
        console().print(Text(words, style=_COLOURS["fatal"]), soft_wrap=True)
        console().print()


def show_findings(findings: Sequence[Finding]) -> None:
    """What was found, the worst first; findings of one kind together, with their advice once."""
    from rich.padding import Padding
    from rich.text import Text

    out = console()
    for members in finding_kinds(findings):
        severity, code = members[0].severity, members[0].code
        head = severity.value + (" (accepted)" if members[0].accepted else "")
        out.print(Text.assemble((head, _COLOURS[severity.value]), f" {code}"))
        for words in said_of(members):
            out.print(Padding(Text(words), (0, 0, 0, 2), expand=False))
        if severity is not Severity.INFO:
            for advice in dict.fromkeys(f.advice for f in members if f.advice):
                out.print(Padding(Text(f"→ {advice}", style="dim"), (0, 0, 0, 2), expand=False))
    if findings:
        out.print()


def show_finding_lines(findings: Sequence[Finding]) -> None:
    """A line for each kind of finding, as long as it fits, and where to see the rest."""
    from rich.text import Text

    out = console()
    for members in finding_kinds(findings):
        severity = members[0].severity
        head = severity.value + (" (accepted)" if members[0].accepted else "")
        words = finding_line(members, out.width - len(head) - 1)
        out.print(Text.assemble((head, _COLOURS[severity.value]), f" {words}"), soft_wrap=True)
    if findings:
        out.print("Explanations and repairs: --details, or the report.\n")


def show_recording(facts: Json) -> None:
    """What a log holds: `facts` are those of `allanite.commands.recordings.describe`."""
    out = console()
    findings = [Finding.from_json(f) for f in facts["findings"]]
    show_movement(findings)
    table = table_of(("Channel", "Kind", "Unit", "SI value of one", "Samples are"))
    for c in facts["channels"]:
        scale = "–" if c["kind"] in ("counts", "unknown", "other") else f"{c['scale']:.7g}"
        kind = {"mean": "means", "point": "points"}[c["sampling"]]
        table.add_row(c["name"], c["kind"], c["unit"] or "unknown", scale, kind)
    missing = f", {facts['missing']} missing" if facts["missing"] else ""
    source = printable(facts["source"] or "recording")
    out.print(f"{source}: {duration(facts['duration'])} at {facts['rate']:.9g} Hz, ", end="")
    out.print(f"{facts['samples']} samples{missing}\n")
    out.print(table)
    _recorded(out, facts)
    _listed(out, "In this file", facts["contents"])
    _listed(out, "How it was read", facts["remarks"])
    _gaps(out, facts)
    _missing(out, facts)
    out.print()
    show_findings(findings)
    if not findings:
        out.print("No problems found.")


def _listed(out: Console, title: str, lines: Sequence[str]) -> None:
    from rich.padding import Padding
    from rich.text import Text

    if lines:
        out.print(f"\n{title}:")
        for line in lines:
            out.print(Padding(Text(line), (0, 0, 0, 2), expand=False))


def _recorded(out: Console, facts: Json) -> None:
    """Instrument and settings of a run."""
    from rich.table import Table

    facts_of_run = record_facts(facts["history"])
    if facts_of_run:
        grid = Table.grid(padding=(0, 2))
        grid.add_column()
        grid.add_column(overflow="fold")
        for fact in facts_of_run:
            grid.add_row(*fact)
        out.print()
        out.print(grid)


def _gaps(out: Console, facts: Json) -> None:
    """Where samples are missing: the first gaps of each set of channels that share theirs."""
    bearing = [c["name"] for c in facts["channels"] if c["kind"] not in ("temperature", "other")]
    shared: dict[tuple[str, ...], list[str]] = {}
    for gap in facts["gaps"]:
        shared.setdefault(tuple(gap["channels"]), []).append(_span(gap["start"], gap["stop"], facts["rate"]))
    shown = 0
    for names, spans in list(shared.items())[:_SETS]:
        which = (
            ""
            if len(bearing) == 1
            else f" in {', '.join(names)}"
            if len(names) < len(bearing)
            else " in all channels"
        )
        more = f"; … {len(spans) - _SPANS} more" if len(spans) > _SPANS else ""
        out.print(f"Gaps{which}: {'; '.join(spans[:_SPANS])}{more}")
        shown += len(spans)
    if shown < facts["gap_count"]:
        least = "at least " if facts["gaps_cut"] else ""
        out.print(f"Gaps, {least}{facts['gap_count'] - shown} more: see --json")


def _span(start: int, stop: int, rate: float) -> str:
    """From when to when [s], to a hundredth of the span."""
    digits = max(0, 2 - math.floor(math.log10((stop - start) / rate)))
    begin, end = (f"{sample / rate:.{digits}f}" for sample in (start, stop))
    if digits:
        begin, end = (text.rstrip("0").rstrip(".") for text in (begin, end))
    return f"{begin} s to {end} s"


def _missing(out: Console, facts: Json) -> None:
    """What is missing in a run, and why."""
    if facts["missing_because"]:
        from allanite.study.results import MissingSamples

        lines = missing_lines(map(MissingSamples.from_json, facts["missing_because"]), facts["rate"])
        table = table_of(("Missing because", "Gaps", "Samples", "Longest", "First at"))
        table.columns[0].no_wrap, table.columns[0].overflow = False, "fold"
        for line in lines:
            table.add_row(*line)
        out.print()
        out.print(table)


def show_curve(curve: AllanCurve | OverFloor) -> None:
    """The deviations of a curve with their intervals, in people's units; as many channels abreast as there is room."""
    from allanite.fitting.sensor_curves import OverFloor

    if isinstance(curve, OverFloor):
        from allanite.views.terminal.floor import show_over_floor

        show_over_floor(curve)
        return
    out = console()
    room = max(1, (out.width - 20) // 30)
    for first in range(0, len(curve.channels), room):
        out.print(curve_table(curve, range(first, min(first + room, len(curve.channels)))))
    out.print(f"{curve.statistic}, {100 * curve.confidence:g} % intervals ({curve.interval_basis})")
    for channel in curve.channels:
        if channel.scale_uncertainty is not None:
            scale = percent(channel.scale_uncertainty)
            out.print(
                f"{printable(channel.name)}: the intervals do not include the scale factor's standard uncertainty of "
                f"{scale}",
                soft_wrap=True,
            )
    out.print("Gaps and overloads are excluded. Other problems are not checked: allanite info")


def show_interval_errors(errors: Sequence[IntervalError]) -> None:
    """Time interval errors of clocks [s], one table a channel."""
    out = console()
    for one in errors:
        table = table_of(("m", "τ [s]", f"{one.name}, {one.statistic} [s]", "windows"))
        for m, tau, error, count in zip(one.lags, one.tau, one.error, one.count, strict=True):
            table.add_row(str(m), f"{tau:.6g}", number(float(error), 5), str(count))
        out.print(table)
    out.print("These values describe this record only, without intervals; they include a frequency offset.")


def curve_table(curve: AllanCurve, which: range) -> Table:
    symbol = "Q" if curve.statistic == "tdev" else "adev"
    units = [display_unit(curve.channels[i].kind.value, symbol, curve.channels[i].unit) for i in which]
    table: Table = table_of(
        ("m", "τ [s]", *(f"{curve.names[i]} [{u}]" for i, (u, _) in zip(which, units, strict=True)))
    )
    for j, (m, tau) in enumerate(zip(curve.lags.tolist(), curve.tau.tolist(), strict=True)):
        cells = []
        for i, (_, factor) in zip(which, units, strict=True):
            middle, low, high = (
                float(getattr(curve, k)[j, i]) / factor for k in ("deviation", "lower", "upper")
            )
            cells.append(f"{number(middle, 4)}  [{number(low, 4)}, {number(high, 4)}]")
        table.add_row(str(m), f"{tau:.6g}", *cells)
    return table
