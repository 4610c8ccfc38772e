# SPDX-License-Identifier: BSD-3-Clause
"""A run that was recovered, as text: what is kept, what is lost, where and why."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.views.terminal.console import console
from allanite.views.terminal.parts import TONES, say_facts, say_files, say_rows
from allanite.views.wording.run_end import RUN_STATES

__all__ = ["show_compaction", "show_recovery"]

Json = Mapping[str, Any]


def show_recovery(document: Json) -> None:
    """Verdict, losses and facts of a `Recovery`'s document."""
    from rich.text import Text

    out = console()
    losses = document["losses"]
    whole = "All recorded samples are stored" if document["missing"] else "Complete"
    verdict, tone = (whole, "good") if not losses else ("With loss", "warning")
    if not document["kept"]:
        verdict, tone = "Nothing can be read", "fatal"
    out.print(Text(verdict, TONES[tone]) + Text("."))
    out.print()
    heads = ("File", "from byte", "bytes", "samples lost", "why")
    say_rows(out, heads, ((x["file"], f"{x['offset']}", f"{x['size']}", _rows(x), x["why"]) for x in losses))
    say_facts(
        out,
        ("kept", f"{document['kept']} samples"),
        ("lost", _lost(document)),
        *([("missing", _missing(document))] if document["missing"] else []),
        ("run ended", RUN_STATES[document["status"]][0]),
    )
    say_files(out, [document["out"]] if document["out"] else [])


def show_compaction(document: Json) -> None:
    """The file, and the room it saves."""
    out = console()
    before, after = document["bytes_of_run"], document["bytes"]
    say_files(out, [document["file"]])
    say_facts(
        out,
        (
            "size",
            f"{after / 1e6:.3g} MB, {100 * after / before:.0f} % of the {before / 1e6:.3g} MB of the run",
        ),
        ("run", f"{document['folder']} is still there"),
    )


def _rows(loss: Json) -> str:
    return "not known" if loss["rows"] is None else str(loss["rows"])


def _missing(document: Json) -> str:
    gaps = document["gaps"]
    return f"{document['missing']} samples in {gaps} gap{'' if gaps == 1 else 's'}, noted while recording"


def _lost(document: Json) -> str:
    unknown = any(loss["rows"] is None for loss in document["losses"])
    return f"{document['lost']} samples" + (", and an unknown number" if unknown else "")
