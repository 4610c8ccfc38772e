# SPDX-License-Identifier: BSD-3-Clause
"""Findings of what a recorder noted: why samples are missing, how the meter was set, how sure the scale is.

A run keeps it in the first steps of its history and in the notes of its source; other logs have nothing of the kind.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from allanite.recording.health.finding import Finding, Severity, finding, percent, plural
from allanite.recording.records import Recording

__all__ = ["autozero", "doubtful", "gap_reasons", "missing_because", "remarks", "scale"]

Json = Mapping[str, Any]

_NOT_NOTED = "no reason was noted"
_NO_VALUE = "no value: an overload, not a number, or left out because of a finding"
_NAMED = 5


def missing_because(recording: Recording, missing: int = 0) -> list[dict[str, Any]]:
    """What is missing in a recorded run and why, one entry for each reason, the largest first; empty for other logs.

    Parameters
    ----------
    missing : int
        Samples that are missing in all; those beyond the gaps are there without a value, and are an entry too.

    Returns
    -------
    list of dict
        `reason`, `gaps`, `samples`, `first` [samples from the beginning of the recording], `longest` [samples].
    """
    source = recording.notes.get("source")
    noted = source.get("missing") if isinstance(source, Mapping) else None
    if noted is None:
        return []
    begin = sum(
        round(float(step["start_s"]) * recording.rate)
        for step in recording.history
        if step.get("step") == "window"
    )
    by_reason: dict[str, dict[str, Any]] = {}
    for gap in noted:
        start = max(int(gap["position"]) - begin, 0)
        stop = min(int(gap["position"]) + int(gap["samples"]) - begin, recording.n_samples)
        if stop > start:
            _add(by_reason, gap["reason"] or _NOT_NOTED, start, stop - start)
    left = missing - sum(entry["samples"] for entry in by_reason.values())
    entries = sorted(by_reason.values(), key=lambda entry: -int(entry["samples"]))
    if left > 0:
        entries.append({"reason": _NO_VALUE, "gaps": None, "samples": left, "first": None, "longest": None})
    return entries


def _add(by_reason: dict[str, dict[str, Any]], reason: str, start: int, samples: int) -> None:
    nothing = {"reason": reason, "gaps": 0, "samples": 0, "first": start, "longest": 0}
    entry = by_reason.setdefault(reason, nothing)
    entry["gaps"] += 1
    entry["samples"] += samples
    entry["longest"] = max(entry["longest"], samples)


def gap_reasons(recording: Recording) -> Iterator[Finding]:
    """The reasons that were noted for what is missing."""
    entries = missing_because(recording)
    if not entries:
        return
    phrases = [
        f"{e['reason']} ({plural(e['samples'], 'sample')} in {plural(e['gaps'], 'gap')})" for e in entries
    ]
    more = f"; and {plural(len(phrases) - _NAMED, 'more reason')}" if len(phrases) > _NAMED else ""
    yield finding(
        "gap_reasons",
        f"missing, as the recorder noted it: {'; '.join(phrases[:_NAMED])}{more}",
        severity=Severity.INFO,
        count=sum(e["samples"] for e in entries),
    )


def doubtful(recording: Recording) -> Iterator[Finding]:
    """Samples that the driver of the instrument could not vouch for."""
    flagged = _source(recording).get("flagged", {})
    count, stored = int(flagged.get("doubtful", 0)), int(_source(recording).get("samples", 0))
    if count:
        yield finding(
            "doubtful_samples",
            f"{plural(count, 'sample')} of {stored} in the run ({percent(count / stored)}) "
            f"{'is' if count == 1 else 'are'} flagged as doubtful: the value, or the time of it and of later samples, "
            "may be wrong; nothing was left out",
            severity=Severity.WARNING,
            count=count,
        )


def remarks(recording: Recording) -> Iterator[Finding]:
    """What the instrument and the link did besides samples."""
    source = _source(recording)
    n_remarks, resyncs = int(source.get("remarks", 0)), int(source.get("flagged", {}).get("resync", 0))
    if n_remarks or resyncs:
        yield finding(
            "instrument_remarks",
            f"the driver made {plural(n_remarks, 'remark')} (rejected lines, garbage, repeated frames, "
            f"uncertain counters) and noted {plural(resyncs, 'interruption')}",
            severity=Severity.INFO,
            count=n_remarks + resyncs,
        )


def autozero(recording: Recording) -> Iterator[Finding]:
    """A voltmeter that does not measure its own zero."""
    for step in _records(recording):
        settings = step.get("settings")
        if isinstance(settings, Mapping) and settings.get("autozero") in (0, 0.0, False):
            yield finding(
                "autozero_off",
                "the meter measured its zero once and subtracted it from all readings: the record "
                "includes the drift of its zero, which is not separable from slow noise of the sensor (B, K, R)",
                severity=Severity.INFO,
                count=recording.n_samples,
            )
            return


def scale(recording: Recording) -> Iterator[Finding]:
    """A scale factor that is known so well and no better."""
    known = [c for c in recording.channels if c.scale_uncertainty is not None]
    for channel in known:
        yield finding(
            "scale_uncertain",
            f"the scale factor has a standard uncertainty of {percent(channel.scale_uncertainty or 0.0)}"
            f"{_dated(recording)}: it enters the intervals of fitted noise models, of bounds and of the Earth's rate, "
            "and no others",
            severity=Severity.INFO,
            channel=channel.name,
            count=recording.n_samples,
        )


def _source(recording: Recording) -> Json:
    source = recording.notes.get("source")
    return source if isinstance(source, Mapping) else {}


def _dated(recording: Recording) -> str:
    dates = {str(step["scale_date"]) for step in _records(recording) if step.get("scale_date")}
    return f", determined {', '.join(sorted(dates))}" if dates else ""


def _records(recording: Recording) -> Sequence[Json]:
    return [step for step in recording.history if step.get("step") == "record"]
