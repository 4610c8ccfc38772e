# SPDX-License-Identifier: BSD-3-Clause
"""What a data sheet beside a study says: which statements are met, and the sheet as a model."""

from __future__ import annotations

from collections.abc import Iterator

from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, number
from allanite.quantities.quantity import Quantity, QuantityStatus
from allanite.quantities.verdict import Tone
from allanite.study.datasheet import (
    ChannelJudgement,
    DatasheetJudgement,
    StatementJudgement,
    StatementVerdict,
)
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Cell, Page, PageBlock, References, Subheading, Text, pairs, table
from allanite.views.result_page import advice, findings_of, pictures, result_page, verdict_banner
from allanite.views.wording.rates import model_words

__all__ = ["rows", "view"]

_NAMES = {"bias_stability": "bias stability (1 σ)"}
_LOOKS = {StatementVerdict.MEETS: Tone.GOOD, StatementVerdict.FAILS: Tone.FATAL}
_HEADS = ("Statement", "Data sheet", "Measured, 95 % interval", "Ratio", "Verdict")
_PICTURES = {
    "curves": "Allan deviation, measured and stated by the data sheet.",
    "ratio": "Ratio of measured to stated, with the 95 % interval of the measurement.",
}
_METHOD = (
    "Each statement is compared with the measured interval of the same quantity. It is met if the whole interval is at "
    "or below the stated value, not met if the interval is above, and not resolved if the interval contains the stated "
    "value. A minimum of the Allan deviation is measured at the lag of the minimum of the fitted model."
)
_IEEE_952 = (
    "IEEE Std 952-1997, “Specification format guide and test procedure for single-axis interferometric fiber optic "
    "gyros”, annex C."
)


def view(document: ResultDocument[DatasheetJudgement]) -> Page:
    """The page of a data sheet."""
    result, record = document.result, document.recording
    sheet = result.datasheet
    return result_page(
        document,
        title=sheet.sensor or sheet.file or "Data sheet",
        kicker="Data sheet and measurement",
        facts=[
            ("Channels", ", ".join(c.name for c in result.channels)),
            ("Length", "" if record is None else duration(record.duration)),
            ("Source", sheet.source),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "pictures": ("Pictures", pictures(result, _PICTURES)),
            "findings": ("Findings", findings_of(document)),
            "method": ("Method", _method(result)),
        },
    )


def _verdict(result: DatasheetJudgement) -> Iterator[PageBlock]:
    yield verdict_banner(result.verdict, result.reason, [c.name for c in result.channels])
    for channel in result.channels:
        yield Subheading(channel.name, brief=True)
        yield from table(_HEADS, [_line(channel, statement) for statement in channel.statements])
        yield from advice(f"{_name(s)}: {s.note}" for s in channel.statements if s.note)
    models = [(f"The sheet as a model, {n}", model_words(m)) for n, m in result.datasheet.models.items()]
    yield pairs(models, brief=not result.channels)


def _method(result: DatasheetJudgement) -> list[PageBlock]:
    read = [(f"As read, {name}", model.verdict) for name, model in result.datasheet.models.items()]
    return [Text(_METHOD), pairs(read, brief=not result.channels), References([_IEEE_952])]


def _line(channel: ChannelJudgement, statement: StatementJudgement) -> tuple[str | Cell, ...]:
    entry, verdict = statement.entry, statement.verdict
    symbol = "B" if entry.symbol == "minimum" else entry.symbol
    unit, factor = display_unit(channel.kind, symbol, channel.unit)
    return (
        _name(statement),
        Cell(
            text=f"{number(entry.value / factor)} {unit}",
            below=", ".join(part for part in (entry.text, entry.reading) if part),
        ),
        _measured(statement.measured, factor),
        _measured(statement.ratio),
        Cell(text=verdict or "stated, not promised", look="" if verdict is None else _LOOKS.get(verdict, "")),
    )


def _name(statement: StatementJudgement) -> str:
    return _NAMES.get(statement.entry.name, statement.entry.name.replace("_", " "))


def _measured(quantity: Quantity, factor: float = 1.0) -> str:
    """A number with its interval, a limit, or both ends of what is known without a number."""
    if quantity.status is QuantityStatus.NOT_RESOLVED:
        return "unknown"
    if quantity.status is QuantityStatus.UPPER_LIMIT and quantity.lower > 0:
        return f"[{number(quantity.lower / factor)}, {number(quantity.upper / factor)}]"
    return quantity.shown(factor)


def rows(result: DatasheetJudgement) -> Iterator[dict[str, object]]:
    """One row of a table for each statement, in SI."""
    for channel in result.channels:
        for statement in channel.statements:
            entry, measured = statement.entry, statement.measured
            yield {
                "channel": channel.name,
                **{key: getattr(entry, key) for key in ("name", "text", "symbol", "reading", "value")},
                "measured": measured.value,
                "lower": measured.lower,
                "upper": measured.upper,
                "verdict": statement.verdict or "",
            }
