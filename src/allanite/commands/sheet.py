# SPDX-License-Identifier: BSD-3-Clause
"""A data sheet beside what was measured, from their files."""

from __future__ import annotations

import os
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.commands.measurement import MeasurementResult, measured_result, provenance
from allanite.commands.option import BENCH_FILE
from allanite.commands.recordings import is_lossy
from allanite.commands.study import study_of
from allanite.errors import InputError
from allanite.plain_files.regular_file import file_sha256

if TYPE_CHECKING:
    from allanite.study.study import Study

__all__ = ["datasheet_of"]


def datasheet_of(
    sheet: str | os.PathLike[str],
    *,
    log: str | os.PathLike[str] | None = None,
    study: str | os.PathLike[str] | None = None,
    accept: Collection[str] = (),
    command: str | None = None,
    source: str | None = None,
    progress: Any = None,
    **options: Any,
) -> MeasurementResult:
    """A data sheet, held against a log or a study; see `allanite.study.datasheet.hold_against`.

    Parameters
    ----------
    sheet : path
        YAML.
    log, study : path, optional
        One of them, or neither for the sheet alone. A log is characterised; options are those of `read`.

    Raises
    ------
    InputError
        Both a log and a study, options of a log without one, or what `hold_against` refuses.
    """
    from allanite.study.datasheet import hold_against, read_datasheet
    from allanite.study.result_document import Provenance

    if log is not None and study is not None:
        raise InputError("give a log or its study, not both")
    usual = (None, (), BENCH_FILE)
    idle = [name for name, value in options.items() if value not in usual and name != "sampling"]
    if log is None and (idle or accept):
        raise InputError(f"{(idle or ['accept'])[0]} applies to a log, but there is none")
    stated = read_datasheet(sheet)
    measured = _studied(log, study, accept, source, progress, options)
    result = hold_against(measured, stated)
    made = provenance(stated.file, file_sha256(sheet), command)
    origin: dict[str, Any] = {"provenance": Provenance(**made)}
    if measured is not None:
        origin = {
            "provenance": replace(measured.provenance, command=command),
            "recording": measured.recording,
            "findings": measured.findings,
        }
    lossy = measured is not None and is_lossy(f.to_json() for f in measured.findings)
    return measured_result("datasheet", result, lossy=lossy, **origin)


def _studied(
    log: str | os.PathLike[str] | None,
    study: str | os.PathLike[str] | None,
    accept: Collection[str],
    source: str | None,
    progress: Any,
    options: dict[str, Any],
) -> Study | None:
    from allanite.study.study import Study

    if log is not None:
        return study_of(log, accept=accept, source=source, progress=progress, **options)
    return None if study is None else Study.load(Path(study))
