# Specification: `allanite.files.store`; its segments are Arrow IPC streams, a compacted run is a Parquet file.
# SPDX-License-Identifier: BSD-3-Clause
"""Runs that allanite has recorded, finished or still going: their folder, or the Parquet file made of it.

The samples lie on the grid of their counter, at the nominal rate; the clock of the host measures that rate, and says so
in the notes. A run whose settings changed has parts, which are read one by one (``variable="2"``).
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from allanite.errors import InputError
from allanite.files.readers.table import Options, Table

if TYPE_CHECKING:
    from allanite.files.store.survey import RunSurvey

NAME: Final = "run"
OPTIONS: Final = frozenset({"variable"})


def sniff(head: bytes, path: Path) -> bool:
    """True for a folder with a manifest or a first segment, and for a Parquet file with the header of a run."""
    if path.is_dir():
        return (path / "manifest.jsonl").exists() or any(path.glob("[0-9]*.arrows"))
    if not head.startswith(b"PAR1"):
        return False
    from allanite.files.store.compaction import is_compact

    return is_compact(path)


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
    from allanite.files.store.compaction import manifest_of, survey_of
    from allanite.files.store.run import open_run

    if path.is_dir():
        run = open_run(path)
        survey, status, manifest = run.survey(_part(options.variable)), run.status, run.manifest
    else:
        survey, status = survey_of(path)
        manifest = manifest_of(path)
    recording = survey.recording(path.name, status)
    guesses = [
        f"{name} is damaged ({why}): `allanite recover` may find more" for name, why in survey.faults.items()
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
        source={
            **recording.notes["source"],
            "status": status,
            "missing": _missing(survey, manifest),
            "remarks": sum(int(e.get("more", 1)) for e in manifest if e["kind"] == "remark"),
        },
        guesses=tuple(guesses),
        channels=recording.channels,
        history=recording.history,
    )


def _missing(survey: RunSurvey, manifest: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Each gap on the grid of the recording, with the reason that was noted for it; what nobody noted has none.

    One of them is the gap behind the last sample, as far as it was noted. A gap may have several reasons, one after the
    other; together they are never more than what is missing.
    """
    noted = sorted(
        (int(e["counter"]), int(e["samples"]), str(e.get("reason", "")))
        for e in manifest
        if e["kind"] == "gap" and "counter" in e and "samples" in e
    )
    ends, zero = (survey.begins + survey.counts).tolist(), int(survey.begins[0])
    following = [*survey.begins[1:].tolist(), survey.end]  # the last gap has no sample behind it
    gaps: list[dict[str, Any]] = []

    def add(start: int, stop: int, reason: str) -> None:
        if stop > start:
            gaps.append({"position": start - zero, "samples": stop - start, "reason": reason})

    for at, stop in zip(ends, following, strict=True):
        first = bisect_left(noted, at, key=lambda n: n[0])
        for counter, samples, reason in noted[first:]:
            if counter >= stop:
                break
            add(at, counter, "")
            at = max(at, counter)
            add(at, min(counter + samples, stop), reason)
            at = min(max(at, counter + samples), stop)
        add(at, stop, "")
    return gaps


def _part(variable: str | None) -> int | None:
    if variable is None:
        return None
    if not variable.isdecimal():
        raise InputError(f"variable={variable!r}: parts of a run are numbered from 1")
    return int(variable)
