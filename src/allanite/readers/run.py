# Specification: `allanite.log_store`; its segments are Arrow IPC streams, a compacted run is a Parquet file.
# SPDX-License-Identifier: BSD-3-Clause
"""Runs that allanite has recorded, finished or still going: their folder, or the Parquet file made of it.

The samples lie on the grid of their counter, at the nominal rate; the clock of the host measures that rate, and says so
in the notes. A run whose settings changed has parts, which are read one by one (``variable="2"``).
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from allanite.errors import InputError
from allanite.log_store.run import open_run
from allanite.readers.assembly import Options, Table

NAME: Final = "run"
OPTIONS: Final = frozenset({"variable"})


def sniff(head: bytes, path: Path) -> bool:
    """True for a folder with a manifest or a first segment, and for a Parquet file with the header of a run."""
    from allanite.log_store.compaction import is_compact

    if path.is_dir():
        return (path / "manifest.jsonl").exists() or any(path.glob("[0-9]*.arrows"))
    return head.startswith(b"PAR1") and is_compact(path)


def read(path: Path, options: Options) -> Table:
    """All samples that verify, as long as they are by now.

    Raises
    ------
    InputError
        No such part.
    DataQualityError
        No samples; or the settings have changed, and no part is named.
    FormatError
        Nothing of it can be read.
    """
    from allanite.log_store.compaction import survey_of

    if path.is_dir():
        run = open_run(path)
        survey, status = run.survey(_part(options.variable)), run.status
    else:
        survey, status = survey_of(path)
    recording = survey.recording(path.name, status)
    guesses = [
        f"{name} is damaged ({why}): what `allanite recover` finds may be more"
        for name, why in survey.faults.items()
    ]
    if survey.torn and status == "unfinished":
        guesses.append("the last batch was being written when the recorder died; it was never acknowledged")
    return Table(
        format=NAME,
        headings=recording.names,
        columns=recording.columns,
        units=tuple(c.unit for c in recording.channels),
        units_from="metadata",
        rate=recording.rate,
        rate_from="rate of the run",
        start=recording.start,
        source={**recording.notes["source"], "status": status},
        guesses=tuple(guesses),
        channels=recording.channels,
        history=recording.history,
    )


def _part(variable: str | None) -> int | None:
    if variable is None:
        return None
    if not variable.isdecimal():
        raise InputError(f"variable={variable!r}: parts of a run are numbered from 1")
    return int(variable)
