# SPDX-License-Identifier: BSD-3-Clause
"""An Allan curve as text: one line for each averaging time, the deviation drawn with its interval on a log scale."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, interval, number
from allanite.views.terminal.console import table_of

if TYPE_CHECKING:
    from rich.table import Table
    from rich.text import Text

    from allanite.noise.allan import AllanCurve

__all__ = ["LogScale", "octave_table"]

#: Characters that a drawing has at least and at most, and those between two columns.
_NARROW, _BROAD, _BETWEEN = 12, 72, 3
_STEPS = (1.0, 2.0, 5.0)


@dataclass(frozen=True, slots=True)
class LogScale:
    """A log scale on so many characters.

    Attributes
    ----------
    low, high : float
        Values at the middle of the first and of the last character.
    width : int
    """

    low: float
    high: float
    width: int

    def place(self, value: float) -> int:
        """Character of a value; the nearest one at an end where it lies outside."""
        span = math.log(self.high / self.low)
        share = math.log(value / self.low) / span if value > 0 else 0.0
        return min(max(round(share * (self.width - 1)), 0), self.width - 1)

    def ticks(self) -> list[float]:
        """Round numbers within the scale: whole decades where there are two of them, else 1, 2 and 5 as well."""
        decades = range(math.floor(math.log10(self.low)), math.ceil(math.log10(self.high)) + 1)
        round_numbers = [s * 10.0**d for d in decades for s in _STEPS]
        inside = [v for v in round_numbers if self.low <= v <= self.high]
        round_ones = [v for v in inside if math.isclose(10.0 ** round(math.log10(v)), v)]
        return round_ones if len(round_ones) > 2 else inside

    def labels(self) -> str:
        """The ticks, each centred above its place as far as there is room."""
        line = [" "] * self.width
        free = 0
        for value in self.ticks():
            text = number(value, 1)
            start = min(max(self.place(value) - len(text) // 2, 0), self.width - len(text))
            if start >= free:
                line[start : start + len(text)] = text
                free = start + len(text) + 1
        return "".join(line).rstrip()

    def bar(self, lower: float, middle: float, upper: float) -> Text:
        """An interval with its point, over dots at the ticks."""
        from rich.text import Text

        line = [" "] * self.width
        for value in self.ticks():
            line[self.place(value)] = "·"
        first, point, last = (self.place(v) for v in (lower, middle, upper))
        line[first : last + 1] = "─" * (last + 1 - first)
        line[first], line[last] = "├", "┤"
        line[point] = "●"
        text = Text("".join(line), style="dim")
        text.stylize("not dim cyan", first, last + 1)
        text.stylize("not dim bold cyan", point, point + 1)
        return text


def octave_table(curve: AllanCurve, name: str, *, columns: int, lines: int | None = None) -> Table:
    """One channel of a curve, in people's unit.

    Parameters
    ----------
    columns : int
        Of the terminal.
    lines : int, optional
        Room below the heading; the shortest averaging times are left out where it does not suffice.
    """
    from rich.text import Text

    i = curve.names.index(name)
    unit, factor = display_unit(curve.channels[i].kind.value, "adev", curve.channels[i].unit)
    rows = [
        (float(tau), *(float(getattr(curve, k)[j, i]) / factor for k in ("deviation", "lower", "upper")))
        for j, tau in enumerate(curve.tau)
    ]
    rows = rows if lines is None else rows[-max(lines, 1) :]
    heads = ("τ", f"σ [{unit}]", f"{100 * curve.confidence:.0f} % interval")
    texts = [(duration(tau), *_said(*row)) for tau, *row in rows]
    taken = sum(max(map(len, column)) + _BETWEEN for column in zip(heads, *texts, strict=True))
    scale = _scale([v for row in rows for v in row[1:]], min(columns - taken, _BROAD))
    table = table_of(heads)
    for column in table.columns[:2]:
        column.justify = "right"
    if scale is not None:
        table.add_column(Text(scale.labels(), style="not bold dim"), no_wrap=True)
    for text, (_, *row) in zip(texts, rows, strict=True):
        table.add_row(*text, *([] if scale is None else [_drawn(scale, *row)]))
    return table


def _said(middle: float, lower: float, upper: float) -> tuple[str, str]:
    if not math.isfinite(middle):
        return "–", "no window is whole"
    value, low, high = interval(middle, lower, upper)
    return value, f"[{low}, {high}]" if math.isfinite(lower) and math.isfinite(upper) else "–"


def _drawn(scale: LogScale, middle: float, lower: float, upper: float) -> Text:
    from rich.text import Text

    if not (math.isfinite(middle) and middle > 0):
        return Text("")
    low, high = (v if math.isfinite(v) and v > 0 else middle for v in (lower, upper))
    return scale.bar(low, middle, high)


def _scale(values: Sequence[float], width: int) -> LogScale | None:
    """From the smallest to the largest value; none where there is no room or nothing to draw."""
    drawable = [v for v in values if math.isfinite(v) and v > 0]
    if width < _NARROW or not drawable:
        return None
    low, high = min(drawable), max(drawable)
    if high < 1.5 * low:  # a level line in the middle
        low, high = low / 1.5, high * 1.5
    return LogScale(low, high, width)
