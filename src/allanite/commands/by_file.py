# SPDX-License-Identifier: BSD-3-Clause
"""Positions that were recorded one by one: their files as one log, the rests in it, and what is said of the files."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from allanite.commands.recordings import read_part
from allanite.errors import DataQualityError, InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.regular_file import file_sha256
from allanite.study.result_document import PositionFile

if TYPE_CHECKING:
    from allanite.experiments.reversals import PositionsApart
    from allanite.experiments.static_spans import StaticSpans, UnitAxes
    from allanite.recording.health.finding import Finding
    from allanite.recording.records import Recording

__all__ = [
    "ByFile",
    "LogOfFiles",
    "headed",
    "log_of_files",
    "read_files",
    "refuse_beside_files",
    "rests_by_file",
    "without_pauses",
]

Place = str | os.PathLike[str]

#: A file as short as this holds no rest that could be told from motion [s]: it is taken as it was given.
TAKEN = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ByFile:
    """Files of one position each.

    Attributes
    ----------
    recordings : tuple of Recording
    findings : tuple of Finding
        Of their time stamps and their text, which one log of all no longer shows.
    files : tuple of PositionFile
    """

    recordings: tuple[Recording, ...]
    findings: tuple[Finding, ...]
    files: tuple[PositionFile, ...]


def read_files(files: Sequence[Place], *, accept: Collection[str] = (), **options: Any) -> ByFile:
    """Read each file; options are those of `read_part`.

    Raises
    ------
    DataQualityError
        A fatal finding of time stamps or text that was not accepted.
    """
    from allanite.recording.health.examination import LOG_DETECTORS, prepare

    recordings, findings = [], []
    for file in files:
        recording = read_part(file, **options)
        of_text = [f for look in LOG_DETECTORS for f in look(recording)]
        recording, kept = prepare(recording, of_text, accept=accept)
        recordings.append(recording)
        findings += [(recording.source, f) for f in kept]
    return ByFile(
        recordings=tuple(recordings),
        findings=_together(findings),
        files=tuple(PositionFile(file=os.fspath(file), sha256=file_sha256(file)) for file in files),
    )


def _together(findings: Sequence[tuple[str, Finding]]) -> tuple[Finding, ...]:
    """What several files have alike is said once, with their names."""
    alike: dict[tuple[str, str, str | None], list[tuple[str, Finding]]] = {}
    for source, finding in findings:
        alike.setdefault((finding.code, finding.message, finding.channel), []).append((source, finding))
    return tuple(
        replace(
            group[0][1],
            message=f"{_named([source for source, _ in group])}: {group[0][1].message}",
            count=sum(f.count for _, f in group),
            spans=group[0][1].spans[:0],
        )
        for group in alike.values()
    )


def _named(sources: Sequence[str]) -> str:
    return ", ".join(sources) if len(sources) < 4 else f"{sources[0]} and {len(sources) - 1} more files"


@dataclass(frozen=True, slots=True, kw_only=True)
class LogOfFiles:
    """One log of all files, missing between them.

    Attributes
    ----------
    recording : Recording
        Of the axes and the thermometers.
    axes : UnitAxes
    spans : tuple of (int, int) [samples]
        Where each file is in it.
    names : tuple of str
        Of the files.
    apart : PositionsApart
        Where the time between them comes from.
    findings, files
        As of `ByFile`.
    """

    recording: Recording
    axes: UnitAxes
    spans: tuple[tuple[int, int], ...]
    names: tuple[str, ...]
    apart: PositionsApart
    findings: tuple[Finding, ...]
    files: tuple[PositionFile, ...]

    def file_at(self, sample: int) -> int:
        """Number of the file, from 0, to which a sample belongs."""
        return max(k for k, (start, _) in enumerate(self.spans) if start <= sample)

    def without_pauses(self, findings: Iterable[Finding]) -> tuple[Finding, ...]:
        """See the function of this name."""
        return without_pauses(findings, self.recording.n_samples, self.spans)


def without_pauses(
    findings: Iterable[Finding], n_samples: int, spans: Sequence[tuple[int, int]]
) -> tuple[Finding, ...]:
    """Findings in which only what is missing in the files counts as missing, not the time between them.

    Parameters
    ----------
    findings : iterable of Finding
        Of the log of all files.
    n_samples : int
        Of that log.
    spans : sequence of (int, int) [samples]
        Where each file is in it.
    """
    pauses = [(a, b) for (_, a), (b, _) in pairwise(spans)]
    between = sum(b - a for a, b in pauses)
    left = (
        _missing_in_files(f, n_samples - between, between, pauses) if f.code == "missing" else f
        for f in findings
    )
    return tuple(f for f in left if f is not None)


def _missing_in_files(
    missing: Finding, recorded: int, between: int, pauses: Sequence[tuple[int, int]]
) -> Finding | None:
    from allanite.plain_files.counted import plural
    from allanite.recording.health.finding import Severity, percent
    from allanite.recording.health.values import TOLERATED

    count = missing.count - between
    if count <= 0:
        return None
    return replace(
        missing,
        message=f"{count} of {plural(recorded, 'sample')} in the files missing ({percent(count / recorded)})",
        severity=Severity.INFO if count <= TOLERATED * recorded else Severity.WARNING,
        count=count,
        spans=missing.spans[[tuple(span) not in pauses for span in missing.spans.tolist()]],
    )


def headed(log: ByFile | LogOfFiles, headings: Iterable[float | None]) -> tuple[PositionFile, ...]:
    """The files with their headings [rad]."""
    return tuple(replace(file, heading=heading) for file, heading in zip(log.files, headings, strict=True))


def refuse_beside_files(**given: object) -> None:
    """What only one log of all positions has.

    Raises
    ------
    InputError
        It was given.
    """
    for name in (name for name, value in given.items() if value is not None):
        raise InputError(
            f"--{name.replace('_', '-')} is for one log; with --positions each file is a position with all channels, "
            "cut by --from and --to"
        )


def log_of_files(
    files: Sequence[Place],
    axes_of: Callable[[Recording], UnitAxes],
    *,
    between: float,
    temperature: str | None = None,
    accept: Collection[str] = (),
    **options: Any,
) -> LogOfFiles:
    """Read the files of a unit as one log; options are those of `read_part`, for each.

    Parameters
    ----------
    axes_of : callable
        Which channels of a file are the axes.
    between : float [s]
        See `joined_files`.
    temperature : str, optional
        A further thermometer.
    """
    from allanite.commands.rests import thermometers
    from allanite.experiments.reversals import joined_files

    read = read_files(files, accept=accept, **options)
    first = read.recordings[0]
    axes = axes_of(first)
    names = dict.fromkeys((*axes.names, *thermometers(first, temperature)))
    recording, spans, apart = joined_files(read.recordings, list(names), between=between)
    return LogOfFiles(
        recording=recording,
        axes=axes,
        spans=tuple(spans),
        names=tuple(r.source for r in read.recordings),
        apart=apart,
        findings=read.findings,
        files=read.files,
    )


def rests_by_file(rests_of_log: StaticSpans, log: LogOfFiles) -> StaticSpans:
    """The rests that were found, each with its file; a file too short to be asked is taken as it was given.

    Parameters
    ----------
    rests_of_log : StaticSpans
        In the log of all files.
    log : LogOfFiles

    Raises
    ------
    DataQualityError
        A file in which the unit was nowhere at rest.
    """
    from allanite.experiments.static_spans import WHY, StaticSpan

    rests, taken = [], []
    for (a, b), file in zip(log.spans, log.names, strict=True):
        of_file = [s for s in rests_of_log.spans if s.start < b and s.stop > a]
        if not of_file and (b - a) / rests_of_log.rate > TAKEN:
            why = {WHY[m.why]: m.stop - m.start for m in rests_of_log.moving if m.start < b and m.stop > a}
            longest = max(why, key=lambda words: why[words], default="")
            raise DataQualityError(
                f"{file}: the unit is never at rest ({longest}). Leave the file out, or use only the part "
                "at rest (--from, --to, or a separate file)"
            )
        if not of_file:
            taken.append(file)
        rests += [replace(s, label=file) for s in of_file] or [StaticSpan(start=a, stop=b, label=file)]
    remark = (
        (
            f"{_named(taken)}: {TAKEN:g} s and less, too short to distinguish rest from motion; treated as rest",
        )
        if taken
        else ()
    )
    kept = [(s.start, s.stop) for s in rests]
    return replace(
        rests_of_log,
        spans=tuple(rests),
        moving=tuple(m for m in rests_of_log.moving if not any(a < m.stop and m.start < b for a, b in kept)),
        findings=(*rests_of_log.findings, *remark),
    )
