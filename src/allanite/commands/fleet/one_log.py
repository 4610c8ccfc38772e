# SPDX-License-Identifier: BSD-3-Clause
"""What is done with one log: read, characterized, and said in rows. Whatever it raises is its error."""

from __future__ import annotations

import json
import os
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.commands.fleet.addresses import file_system
from allanite.commands.fleet.rows import rows_of
from allanite.commands.recordings import read_part
from allanite.errors import DataQualityError
from allanite.plain_files.regular_file import file_sha256
from allanite.recording.records import Kind, Recording

if TYPE_CHECKING:
    from allanite.study.study import Study

__all__ = ["local_copy", "log_outcome", "studied"]

Json = Mapping[str, Any]
_ZERO_CELSIUS = 273.15


def log_outcome(task: Json) -> dict[str, Any]:
    """Characterize the log of a task.

    Parameters
    ----------
    task : mapping
        "log", its name; "place", where it is; "known", the SHA-256 of what is in the table already; "reading" and
        "options" of `read_part` and `characterize`; "keep" for the study itself.

    Returns
    -------
    dict
        "sha256", "rows", "error" (class and message, or None), "findings" (of a log that failed), "temperature" [°C],
        "start" (UTC), "study" (JSON text or None), "seconds" of processor time. Without rows and error: the log is
        the one that is known.
    """
    outcome: dict[str, Any] = {"sha256": None, "rows": [], "error": None, "findings": []}
    try:
        place = local_copy(str(task["place"]), tempfile.mkdtemp())
        outcome["sha256"] = file_sha256(place)
        if outcome["sha256"] is None or outcome["sha256"] != task.get("known"):
            outcome |= _results(task, place, outcome["sha256"])
    except Exception as error:  # noqa: BLE001 - whatever a log brings about is the row of this log
        outcome["error"] = _error_words(error)
        if isinstance(error, DataQualityError):
            outcome["findings"] = sorted({str(getattr(f, "code", f)) for f in error.findings})
    outcome["seconds"] = _processor_time()
    return outcome


def _error_words(error: BaseException) -> str:
    """Class and message, on one line."""
    if isinstance(error, MemoryError):
        return "LimitError: there is not enough memory for this log; allow more, or read fewer channels"
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


def local_copy(place: str, folder: str) -> Path:
    """A file of this machine: what stands behind an address is fetched into a folder."""
    if "://" not in place:
        return Path(place)
    system, path = file_system(place)
    local = Path(folder) / path.rpartition("/")[2]
    system.get_file(path, str(local))
    return local


def studied(
    place: Path, log: str, reading: Json, options: Json, sha256: str | None = None
) -> tuple[Recording, Study]:
    """The recording and the study of a log, with the options of a fleet."""
    from allanite.study.characterization import characterize

    recording = read_part(place, source=log, **reading)
    return recording, characterize(recording, provenance={"sha256": sha256, "command": None}, **options)


def _results(task: Json, place: Path, sha256: str | None) -> dict[str, Any]:
    recording, study = studied(place, str(task["log"]), task["reading"], task["options"], sha256)
    return {
        "rows": rows_of(study),
        "temperature": _temperature(recording),
        "start": study.recording.start,
        "study": _text(study) if task.get("keep") else None,
    }


def _temperature(recording: Recording) -> float | None:
    """Mean of the first thermometer [°C]."""
    for channel in recording.channels:
        if channel.kind is Kind.TEMPERATURE:
            samples = recording.values(channel.name) + recording.origin(channel.name)
            mean = float(np.nanmean(samples)) * channel.scale if np.isfinite(samples).any() else None
            return mean if mean is None or channel.unit != "K" else mean - _ZERO_CELSIUS
    return None


def _text(study: Study) -> str:
    return json.dumps(study.to_json(), ensure_ascii=False, indent=1, allow_nan=False) + "\n"


def _processor_time() -> float:
    """Of this process and of those that it waited for [s]."""
    return time.process_time() + sum(os.times()[2:4])
