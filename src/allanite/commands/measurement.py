# SPDX-License-Identifier: BSD-3-Clause
"""What a measurement hands over: its document with findings and provenance, its files, its picture.

The document of a result is what its `to_json` gives, with four things beside it that only the caller knows:
"provenance", "recording" with "overview", "findings" and "model_name". Reports are made from it alone.
"""

from __future__ import annotations

import csv
import io
import itertools
import json
import math
import os
import platform
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.commands.pictures import Delivered, refuse_figure, save_figure
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.atomic_file import fresh, make_folder, refuse_existing
from allanite.plain_files.csv_cells import as_label
from allanite.plain_files.regular_file import file_sha256

if TYPE_CHECKING:
    from allanite.noise import NoiseModel
    from allanite.quantities.result import Result
    from allanite.recording.health.finding import Finding
    from allanite.recording.records import Recording
    from allanite.study.result_document import Overview, Reportable

__all__ = [
    "MeasurementResult",
    "file_names",
    "measured_result",
    "origin_of",
    "overview_of",
    "provenance",
    "refuse_measurement",
    "save_json",
    "write_measurement",
]

Json = Mapping[str, Any]

#: Names that are devices on Windows, with any suffix.
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\.|$)", re.IGNORECASE)
_LONGEST = 100  # bytes of a file name; file systems take 255


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasurementResult:
    """A result, and everything that a report of it needs.

    Attributes
    ----------
    result : EarthRateEstimate, NorthEstimate, Filtered, ReferenceAided or Plan
    document : ResultDocument, or Study
        Its document with what is known besides.
    name : str
        Of its files: ``<name>.json``.
    tables : mapping of str to list of mapping
        Further files: rows of a CSV table, by file name.
    lossy : bool
        Samples or rows of the log did not take part.
    series : Recording, optional
        What it leaves of the log, or makes of it, for ``--output``.
    models : mapping of str to NoiseModel, optional
        Noise models that it makes, for ``--output``.
    write : callable, optional
        Leaves its files, where these are others: takes folder, figure and `force`.
    code : int
        Exit code of its verdict, where a program decides by that; 0 for none.
    """

    result: Any
    document: Reportable
    name: str
    tables: Mapping[str, Sequence[Json]]
    lossy: bool
    series: Recording | None = None
    models: Mapping[str, NoiseModel] | None = None
    write: Callable[..., Delivered] | None = None
    code: int = 0

    @property
    def plain(self) -> Json:
        """The document as plain data."""
        return self.document.to_json()


# -- what stands beside a result ----------------------------------------------------------------------------


def origin_of(
    recording: Recording,
    findings: Iterable[Finding],
    log: str | os.PathLike[str],
    command: str | None,
    channel: str | None = None,
) -> dict[str, Any]:
    """What a `ResultDocument` holds of the log that it is made from, with the overview of a channel if one is named."""
    from allanite.study.result_document import Provenance, RecordFacts

    return {
        "overview": None if channel is None else overview_of(recording, channel),
        "provenance": Provenance(**provenance(recording.source, file_sha256(log), command)),
        "recording": RecordFacts.of(recording),
        "findings": tuple(findings),
    }


def overview_of(recording: Recording, channel: str) -> Overview:
    """What a picture of one channel needs."""
    from allanite.study.result_document import Overview
    from allanite.views.figures.records import overview

    return Overview.from_json(overview(recording, channel))


def measured_result(
    name: str,
    result: Result,
    *,
    lossy: bool,
    tables: Mapping[str, Iterable[Json]] | None = None,
    **origin: Any,
) -> MeasurementResult:
    """A result with where it comes from: the fields of `Origin`. `Command.measure` makes tables that are not given."""
    from allanite.study.result_document import ResultDocument

    document = ResultDocument(result=result, **origin)
    rows = {file: [*made] for file, made in (tables or {}).items()}
    return MeasurementResult(result=result, document=document, name=name, tables=rows, lossy=lossy)


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
    measured: MeasurementResult,
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
    if measured.write is not None:
        return measured.write(folder, figure, force=force)
    refuse_measurement(folder, figure, measured.name, measured.tables, force=force)
    overviews = getattr(measured.document, "overviews", None)
    drawn_over = {} if overviews is None else {"recording": overviews}
    files = [] if figure is None else [save_figure(measured.result, figure, force=force, **drawn_over)]
    if folder is not None:
        from allanite.views.report import render

        place = Path(folder)
        make_folder(place)
        beside = [save_json(measured.plain, place / f"{measured.name}.json", force=force)]
        beside += [_save_table(rows, place / name, force=force) for name, rows in measured.tables.items()]
        names = [path.name for path in beside]
        files += [render(measured.document, place / "report.html", force=force, beside=names), *beside]
    return Delivered(files=tuple(files), notes=())


def file_names(labels: Iterable[str], suffix: str) -> list[str]:
    """A file name for each label out of a file, whatever it holds: of one folder, short, and no two alike.

    Examples
    --------
    >>> file_names(["gyro_x", "../../gyro_x", "a/b", "con"], ".csv")
    ['gyro_x.csv', 'gyro_x_2.csv', 'a_b.csv', '_con.csv']
    """
    taken: set[str] = set()
    names = []
    for label in labels:
        plain = re.sub(r"[^\w.+-]+", "_", label).strip("._") or "channel"
        plain = plain.encode("utf-8", "replace")[:_LONGEST].decode("utf-8", "ignore")
        plain = f"_{plain}" if _DEVICES.match(plain) else plain
        name = next(
            n
            for n in itertools.chain([plain], (f"{plain}_{k}" for k in itertools.count(2)))
            if n.lower() not in taken
        )
        taken.add(name.lower())
        names.append(name + suffix)
    return names


def save_json(document: Json, path: Path, *, force: bool) -> Path:
    """Write a document."""
    text = json.dumps(document, ensure_ascii=False, indent=1, allow_nan=False)
    with fresh(path, force=force) as place:
        place.write_text(text + "\n", encoding="utf-8")
    return path


def _cell(value: object) -> object:
    """As a cell of a table: empty for a number that does not exist."""
    if isinstance(value, float) and not math.isfinite(value):
        return ""
    return as_label(value) if isinstance(value, str) else value


def _save_table(rows: Sequence[Json], path: Path, *, force: bool) -> Path:
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]) if rows else ["number"], lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: _cell(value) for key, value in row.items()} for row in rows)
    with fresh(path, force=force) as place:
        place.write_text(text.getvalue(), encoding="utf-8")
    return path
