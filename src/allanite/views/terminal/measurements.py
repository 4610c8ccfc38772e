# SPDX-License-Identifier: BSD-3-Clause
"""Measurements as text: the verdict first, then the number, then what speaks for and against it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.views.terminal.console import console
from allanite.views.terminal.parts import (
    TONES,
    say_advice,
    say_end,
    say_facts,
    say_files,
    say_indented,
    say_rows,
    say_verdict,
)
from allanite.views.wording import (
    filter_verdict,
    model_words,
    sentence,
)

__all__ = [
    "show_aided",
    "show_filtered",
]

Json = Mapping[str, Any]


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
