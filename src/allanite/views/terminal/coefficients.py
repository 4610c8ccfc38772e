# SPDX-License-Identifier: BSD-3-Clause
"""Noise coefficients as a table, in people's units or in SI; a line for each where a row would be too wide."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from allanite.views.blocks import Coefficients
from allanite.views.terminal.console import BETWEEN, WIDE, table_of
from allanite.views.wording.study import CoefficientWording, readings, shown_symbol

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

__all__ = ["say_coefficients"]


def say_coefficients(out: Console, block: Coefficients, *, si: bool = False) -> None:
    """The table of a group of channels, and an empty line."""
    si = si and block.group.has_si
    for between in (BETWEEN, 2, 1):
        table = _table(block, si=si, between=between)
        if out.measure(table, options=out.options.update(max_width=WIDE)).maximum <= out.width:
            break
    else:
        table = _list(block, si=si)
    out.print(table)
    out.print()


def _table(block: Coefficients, *, si: bool, between: int) -> Table:
    table = table_of((_title(block, si=si), *replace(block, si=si).columns), between=between)
    for name, cells in block.rows:
        table.add_row(name, *(_cell(read, si=si) for read in cells))
    return table


def _title(block: Coefficients, *, si: bool) -> str:
    return f"{block.group.title}{', SI' if si else ''}"


def _cell(read: CoefficientWording | None, *, si: bool) -> Text:
    from rich.text import Text

    if read is None:
        return Text("–", style="dim")
    value, ends = _value(read, si=si)
    return Text.assemble((value, "bold" if read.supported else ""), (f"\n{ends}" if ends else "", "dim"))


def _value(read: CoefficientWording, *, si: bool) -> tuple[str, str]:
    value, ends = (read.si, read.si_range) if si else (read.value, read.range)
    return value + (" *" if read.equivalent else ""), ends


def _list(block: Coefficients, *, si: bool) -> Table:
    table = table_of((_title(block, si=si), "", "Estimate", "95 % interval", "Unit"))
    for channel in block.group.channels:
        for row in _lines(channel.name, readings(channel), si=si):
            table.add_row(*row)
    return table


def _lines(
    name: str, coefficients: dict[str, CoefficientWording], *, si: bool
) -> Iterator[tuple[str, str, Text, str, str]]:
    from rich.text import Text

    for i, (symbol, read) in enumerate(coefficients.items()):
        value, ends = _value(read, si=si)
        words = Text(value, "bold" if read.supported else "")
        yield "" if i else name, shown_symbol(symbol), words, ends, read.si_unit if si else read.unit
