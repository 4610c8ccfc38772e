# SPDX-License-Identifier: BSD-3-Clause
"""Measurements as text: the verdict first, then the number, then what speaks for and against it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from allanite.views.terminal.console import console, table_of
from allanite.views.terminal.parts import (
    TONES,
    say_advice,
    say_checks,
    say_end,
    say_facts,
    say_files,
    say_indented,
    say_rows,
    say_verdict,
)
from allanite.views.wording import (
    angle,
    filter_verdict,
    model_words,
    sentence,
)

if TYPE_CHECKING:
    from rich.console import Console

    from allanite.views.wording.rates import EarthRateWording

__all__ = [
    "show_aided",
    "show_filtered",
    "show_plan",
    "show_rate_vector",
]

Json = Mapping[str, Any]

_NOISE_ALONE = (
    "The interval holds the noise alone: no uncertainty of scale factor, latitude, tilt or heading is stated."
)


def show_rate_vector(document: Json, files: Sequence[object] = ()) -> None:
    """Verdict, length, vector, what was used and left out, checks, budget and advice of a `RateVector`'s document."""
    from allanite.views.wording import latitude_words, pose_words, used_words

    out = console()
    say_verdict(out, document["verdict"], document["reason"])
    if document["length"] is not None:
        _vector(out, document)
    _left_out(out, document)
    say_checks(out, document["checks"])
    say_advice(out, document["advice"])
    say_facts(
        out,
        ("used", used_words(document)),
        *(("poses", words) for words in [pose_words(document)] if words),
        ("latitude", latitude_words(document)),
        ("noise", document.get("model_name") or document["model_source"]),
    )
    out.print(sentence(document["statement"]))
    out.print()
    say_end(out, document, files)


def _vector(out: Console, document: Json) -> None:
    """The length beside the known rate, the axes, and what the interval is made of."""
    from allanite.views.wording import EMPTY_BUDGET, axis_lines, length_lines, vector_budget

    _rates(out, "Rate vector", document, length_lines(document))
    say_rows(out, ("Axis", "deg/h", "± sd", "angle to the vector"), axis_lines(document))
    _uncertainties(out, vector_budget(document), EMPTY_BUDGET)
    out.print()


def _left_out(out: Console, document: Json) -> None:
    from allanite.views.wording import left_out_lines

    table = table_of(("Left out because", "stretches", "together", "the longest"))
    table.columns[0].no_wrap = False
    for row in left_out_lines(document):
        table.add_row(*row)
    if document["left_out"]:
        out.print(table)
        out.print()


def show_plan(document: Json, files: Sequence[object] = ()) -> None:
    """The plan in a sentence, the table of standard deviations, and what it assumes."""
    from rich.text import Text

    from allanite.views.wording import goal_words, plan_table

    out = console()
    out.print(sentence(document["says"]))
    for note in document.get("notes", ()):
        out.print(Text(f"Warning: {sentence(note)}", TONES["warning"]))
    out.print()
    made = plan_table(document)
    table = table_of(("Dwell", *made.durations, f"{goal_words(document)} after"))
    for i, (dwell, cells, reached) in enumerate(made.rows):
        marked = [Text(c, "bold" if made.best[j] == i else "") for j, c in enumerate(cells)]
        table.add_row(dwell, *marked, reached)
    out.print(table)
    out.print(
        f"Standard deviation in {made.unit}, by length of record; bold: the best dwell for that length."
    )
    out.print()
    say_facts(
        out,
        ("lost at each turn", f"{document['dead_time']:g} s"),
        ("latitude", angle(document["latitude"])),
        ("noise", f"{document.get('model_name', 'given')}: {model_words(document['model'])}"),
    )
    say_files(out, files)


def show_filtered(document: Json, files: Sequence[object] = ()) -> None:
    """Whether the model holds, what was removed, and what is left."""
    from allanite.views.wording import consistency_lines, filter_lines

    out = console()
    say_verdict(out, *filter_verdict(document))
    say_facts(out, *filter_lines(document))
    say_rows(out, ("Innovations", "found", "if the model holds"), consistency_lines(document))
    say_advice(out, document["notes"])
    say_facts(out, ("noise", f"{document.get('model_name', 'given')}: {model_words(document['model'])}"))
    say_end(out, document, files)


def show_aided(document: Json, files: Sequence[object] = ()) -> None:
    """What the reference-aided filter was told, what came out, and that it is no measurement."""
    from rich.text import Text

    from allanite.views.wording import AIDED, aided_lines

    out = console()
    text = Text(f"Reference-aided. {AIDED}")
    text.stylize(TONES["warning"], 0, len("Reference-aided"))
    out.print(text)
    out.print()
    say_rows(
        out,
        ("Reading", "told [deg/h]", "raw mean", "corrected mean", "follows what it was told"),
        aided_lines(document["readings"]),
    )
    for reading in document["readings"]:
        for note in reading["notes"]:
            say_indented(out, f"→ {sentence(note)}")
    out.print("The Earth rate is measured by `allanite earth-rate`, which is not told it.")
    out.print()
    say_files(out, files)


# -- parts ------------------------------------------------------------------------------------------------


def _rates(out: Console, what: str, document: Json, lines: Iterable[EarthRateWording]) -> None:
    """Rates in two units, each with its interval; the one that is kept in bold."""
    from rich.text import Text

    percent = f"{100 * document['confidence']:g} % interval"
    table = table_of((what, "deg/h", percent, "deg/s", percent))
    for line in lines:
        style = "bold" if line.kept else ""
        table.add_row(
            line.name, Text(line.value, style), line.range, Text(line.seconds, style), line.seconds_range
        )
    out.print(table)
    out.print()


def _uncertainties(out: Console, lines: Sequence[tuple[str, str, str]], empty: str = _NOISE_ALONE) -> None:
    """The budget, or that there is none."""
    from rich.text import Text

    table = table_of(("Standard uncertainty", "deg/h", "of the Earth rate"))
    for name, value, share in lines:
        table.add_row(name, Text(value, "dim" if not share else ""), share)
    out.print(table if lines else empty)
