# SPDX-License-Identifier: BSD-3-Clause
"""What a measurement hands over: its document with findings and provenance, its files, its picture.

The document of a result is what its `to_json` gives, with four things beside it that only the caller knows:
"provenance", "recording" with "overview", "findings" and "model_name". Reports are made from it alone.
"""

from __future__ import annotations

import csv
import io
import json
import os
import platform
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.atomic_file import fresh, make_folder, refuse_existing
from allanite.delivery.pictures import Delivered, refuse_figure, save_figure

if TYPE_CHECKING:
    from allanite.health import Finding
    from allanite.recording import Recording

__all__ = ["Measured", "beside", "provenance", "refuse_measurement", "save_json", "write_measurement"]

Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """A result, and everything that a report of it needs.

    Attributes
    ----------
    result : EarthRateEstimate, NorthEstimate, Filtered, ReferenceAided or Plan
    document : mapping
        Its plain document with what is known besides.
    name : str
        Of its files: ``<name>.json``.
    tables : mapping of str to list of mapping
        Further files: rows of a CSV table, by file name.
    lossy : bool
        Samples or rows of the log did not take part.
    """

    result: Any
    document: Json
    name: str
    tables: Mapping[str, Sequence[Json]]
    lossy: bool


# -- what stands beside a result ----------------------------------------------------------------------------


def beside(
    recording: Recording,
    channel: str | None,
    findings: Iterable[Finding],
    sha256: str | None,
    command: str | None,
) -> dict[str, Any]:
    """Provenance, facts of the record, the overview of a channel if one is named, and findings."""
    from allanite.figures.records import overview

    return {
        "provenance": provenance(recording.source, sha256, command),
        "recording": {
            "rate": recording.rate,
            "samples": recording.n_samples,
            "duration": recording.duration,
            "channels": [c.to_json() for c in recording.channels],
            "history": [dict(step) for step in recording.history],
        },
        **({} if channel is None else {"overview": overview(recording, channel)}),
        "findings": [f.to_json() for f in findings],
    }


def provenance(source: str, sha256: str | None = None, command: str | None = None) -> dict[str, Any]:
    """What made a result, and when."""
    import numpy as np

    from allanite import __version__

    return {
        "allanite": __version__,
        "created": datetime.now(UTC).replace(microsecond=0).isoformat().replace("+00:00", "Z"),
        "source": source,
        "sha256": sha256,
        "command": command,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


# -- files --------------------------------------------------------------------------------------------------


def refuse_measurement(
    folder: str | os.PathLike[str] | None,
    figure: str | os.PathLike[str] | None,
    name: str,
    tables: Collection[str] = (),
    *,
    force: bool,
) -> None:
    """Raise, before the work is done, if a file is in the way or the figure is no picture.

    Raises
    ------
    InputError
        A suffix that is no picture.
    StorageError
        Names the files that exist.
    """
    if folder is not None:
        names = ("report.html", f"{name}.json", *tables)
        refuse_existing(*(Path(folder) / each for each in names), force=force)
    if figure is not None:
        refuse_figure(figure, force=force)


def write_measurement(
    measured: Measured,
    folder: str | os.PathLike[str] | None,
    figure: str | os.PathLike[str] | None = None,
    *,
    force: bool = False,
) -> Delivered:
    """Leave report.html, the document as JSON and the tables in a folder, and the figure where it is wanted.

    Raises
    ------
    StorageError
        One of the files exists and `force` is not given, or the disk refuses.
    """
    from allanite.report import render

    refuse_measurement(folder, figure, measured.name, measured.tables, force=force)
    files = [] if figure is None else [save_figure(measured.result, figure, force=force)]
    if folder is not None:
        place = Path(folder)
        make_folder(place)
        files.append(render(measured.document, place / "report.html", force=force))
        files.append(save_json(measured.document, place / f"{measured.name}.json", force=force))
        files += [_save_table(rows, place / name, force=force) for name, rows in measured.tables.items()]
    return Delivered(files=tuple(files), notes=())


def save_json(document: Json, path: Path, *, force: bool) -> Path:
    """Write a document."""
    text = json.dumps(document, ensure_ascii=False, indent=1, allow_nan=False)
    with fresh(path, force=force) as place:
        place.write_text(text + "\n", encoding="utf-8")
    return path


def _save_table(rows: Sequence[Json], path: Path, *, force: bool) -> Path:
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]) if rows else ["number"], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    with fresh(path, force=force) as place:
        place.write_text(text.getvalue(), encoding="utf-8")
    return path
