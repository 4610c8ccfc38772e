# SPDX-License-Identifier: BSD-3-Clause
"""Findings that the readers made possible: what stood in the time stamps and in the text of a log.

The readers count and judge nothing; their notes are in `Recording.notes`. Rows are counted from 0 at the first
row of samples.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

from allanite.errors import InputError
from allanite.quantities.number_words import with_parentheses
from allanite.quantities.units import QuantityKind, parse_unit
from allanite.recording.health.finding import PLACES, Finding, Severity, finding, percent, plural
from allanite.recording.health.survey import ChannelSurvey
from allanite.recording.health.values import TOLERATED
from allanite.recording.records import Kind, Recording

__all__ = ["clock", "decimated", "drift", "jitter", "repairs", "stamps", "text", "words"]

Notes = Mapping[str, Any]

#: Clock error worth a warning [ppm]: that of a poor crystal.
POOR_CLOCK = 100.0
#: Of what differs by more, the percentage is easier to read [ppm].
_PERCENT = 1e4
#: Share of the samples off the even grid from which the grid is refused.
OFF_GRID = 0.05
#: Share of the longest run of a clock that was set back from which a cut by its times is as good.
_AS_LONG = 0.9
#: Standard errors by which a drift of the clock must stand out: less than one record in a million by chance.
CERTAIN = 5.0


def _notes(recording: Recording, part: str) -> Notes:
    notes = recording.notes.get(part)
    return notes if isinstance(notes, Mapping) else {}


def _number(notes: Notes, key: str) -> float:
    value = notes.get(key)
    return float(value) if isinstance(value, (int, float)) and math.isfinite(value) else 0.0


def _rows(notes: Notes, *keys: str) -> list[int]:
    rows = [int(row) for key in keys for row in notes.get(key) or ()]
    return sorted(set(rows))[:PLACES]


def _spans(rows: Sequence[int]) -> list[tuple[int, int]]:
    return [(row, row + 1) for row in rows]


# -- time -------------------------------------------------------------------------------------------------


def _set_back(alone: Mapping[str, Any] | None, longest: int) -> str:
    """What to do about stamps that step back.

    `alone` cuts the longest part that has its times to itself; the longest run between steps has `longest` rows.
    """
    if longest and (not alone or int(alone["rows"]) < _AS_LONG * longest):
        return (
            "did the logger restart, or was its clock set back? --repair keep_run keeps the longest run "
            f"({longest} rows), --repair keep_run=first or =last another; --rate overrides the stamps and takes the "
            "runs for one record"
        )
    if alone:
        options = " ".join(f"--{end} {alone[end]:.15g}" for end in ("from", "to") if end in alone)
        return (
            f"was the clock set back (to winter time, say)? {options} takes {alone['rows']} rows with unique "
            "times; --rate overrides the stamps"
        )
    return "sort the rows, or pass --rate, which overrides the stamps"


def _places(rows: Sequence[int], count: int) -> str:
    """At which rows, of so many: "at row 7", "at rows 7, 9", or of more "first at rows 7, 9, 11"."""
    listed = f"row{'s' * (len(rows) > 1)} {', '.join(map(str, rows))}"
    return f"at {listed}" if len(rows) == count else f"first at {listed}"


def _doubled(share: float) -> str:
    """What to do about stamps equal to the one before, this share of all."""
    return (
        "if rows were logged twice, --repair drop_duplicate_rows removes the copies; --rate would count them as "
        f"samples and stretch time by {percent(share)}. Pass --rate only if each row is a sample of its own"
    )


def longest_run(recording: Recording) -> int:
    """Samples of the longest run between backward steps of the clock; 0 where it never steps back for good."""
    places = [int(place) for place, _ in _notes(recording, "timebase").get("restarts") or ()]
    edges = [0, *places, recording.n_samples]
    return max(b - a for a, b in pairwise(edges)) if places else 0


def stamps(recording: Recording) -> Iterator[Finding]:
    """Stamps that contradict each other (battery B12)."""
    notes = _notes(recording, "timebase")
    backward, duplicates = int(_number(notes, "backward")), int(_number(notes, "duplicates"))
    share = duplicates / max(recording.n_samples - int(_number(notes, "missing")), 1)
    rows = _rows(notes, "backward_rows", "duplicate_rows")
    parts = (
        ["time stamps step back " + ("once" if backward == 1 else f"{backward} times")] if backward else []
    )
    if duplicates:
        verb, of_them = ("equals", "stamp") if duplicates == 1 else ("equal", "stamps")
        parts.append(
            f"{duplicates} {'time ' * (not backward)}{of_them} {verb} the one before ({percent(share)})"
        )
    if not parts:
        return
    fatal = backward > 0 or share > TOLERATED
    yield finding(
        "time_stamps" if fatal else "duplicate_stamps",
        f"{' and '.join(parts)}, {_places(rows, backward + duplicates)}",
        severity=Severity.FATAL if fatal else Severity.WARNING,
        spans=_spans(rows),
        count=backward + duplicates,
        advice=_set_back(notes.get("alone"), longest_run(recording)) if backward else _doubled(share),
        repaired=False,
    )


def jitter(recording: Recording) -> Iterator[Finding]:
    """Stamps that scatter, or are coarse, or whose median tells another rate (battery B13; class 1)."""
    notes = _notes(recording, "timebase")
    rate, dt = recording.rate, recording.dt
    resolution, rms = _number(notes, "resolution_s"), _number(notes, "jitter_rms_s")
    if resolution > 1.5 * dt:
        message = f"time stamps come in steps of {resolution:.3g} s, samples every {dt:.3g} s"
        lost = int(_number(notes, "unplaced"))
        if lost:
            message += (
                f"; {plural(lost, 'sample')} next to pauses may be up to a step from their place. Log "
                "finer stamps, or name another time column (--time)"
            )
        yield finding(
            "coarse_stamps",
            message,
            severity=Severity.WARNING if lost > TOLERATED * recording.n_samples else Severity.INFO,
            count=lost or recording.n_samples,
        )
    elif rms > 0.01 * dt:
        yield _scatter(recording, rms, int(_number(notes, "unplaced")))
    median = _number(notes, "median_rate")
    if median > 0.0 and abs(median / rate - 1.0) > 0.01:
        yield finding(
            "rate_not_median",
            f"the median interval says {median:.5g} Hz, {_by_count(recording)}",
            severity=Severity.INFO,
            count=recording.n_samples,
        )


def _by_count(recording: Recording) -> str:
    """The rate that is used, and the samples in the file over their span, which gaps make another one."""
    notes = _notes(recording, "timebase")
    span, missing = _number(notes, "span_s"), int(_number(notes, "missing"))
    there = recording.n_samples - missing
    if missing == 0 or span <= 0.0:
        return f"the number of samples over the span gives {recording.rate:.6g} Hz, which is used"
    return (
        f"the stamps between gaps give {recording.rate:.6g} Hz, which is used ({there} samples over "
        f"{span:.6g} s, gaps "
        f"among them, are {(there - 1) / span:.6g} Hz)"
    )


#: What the samples of an integral show of it.
_SHOWS_JITTER = {
    Kind.ANGLE: "an angle that changes at a rate w shows this as noise of w times that",
    Kind.VELOCITY: "a velocity that grows at an acceleration a shows this as noise of a times that",
    Kind.PHASE: "the phase of a clock with a fractional frequency offset y shows this as noise of y times that",
}


def _scatter(recording: Recording, rms: float, lost: int) -> Finding:
    """Jitter of the stamps. A steady rate does not see it; a moving angle does, as noise of rate times jitter.

    Of the samples that a host stamped in one go, where some are missing, `lost` have no place of their own.
    """
    share = rms / recording.dt
    kinds = {c.kind for c in recording.channels}
    shows = next((text for kind, text in _SHOWS_JITTER.items() if kind in kinds), "")
    moving = bool(shows)
    message = (
        f"time stamps scatter by {rms:.3g} s rms, {percent(share)} of the interval; the samples are "
        "treated as evenly spaced"
    )
    if moving:
        message += f"; {shows}"
    if lost:
        message += (
            f"; {plural(lost, 'sample')}, stamped in one batch around missing ones, may be displaced by "
            "as many intervals as samples are missing"
        )
    of_clock = bool(kinds & {Kind.PHASE, Kind.FREQUENCY})
    return finding(
        "rate_jitter",
        message,
        advice="use the time of the counter itself, or trigger each reading from a clock"
        if of_clock
        else None,
        severity=Severity.WARNING
        if share > 0.5 or (moving and share > 0.05) or lost > TOLERATED * recording.n_samples
        else Severity.INFO,
        count=recording.n_samples,
    )


def clock(recording: Recording) -> Iterator[Finding]:
    """The rate against what the file claims; and no clock at all (battery B14; class 2)."""
    notes = _notes(recording, "timebase")
    if not notes:
        return
    if _notes(recording, "source").get("format") == "run":
        yield from _of_run(recording)
        return
    stamped = bool(notes.get("unit"))
    if not stamped:
        seams = _rows(notes, "seams")
        says = (
            f"no time stamps are used: {recording.rate:.6g} Hz is the {notes.get('source') or 'rate given'}"
        )
        if seams:
            says += (
                f"; the stamps restart or jump at {plural(len(seams), 'row')} ({', '.join(map(str, seams))}), and the "
                "samples on both sides are treated as consecutive"
            )
        yield finding(
            "no_time_stamps",
            says,
            severity=Severity.WARNING if seams else Severity.INFO,
            spans=_spans(seams),
            count=recording.n_samples,
            advice="take one part of the log: --from and --to, or --repair keep_run, without --rate"
            if seams
            else None,
        )
    nominal = _number(notes, "rate_nominal")
    if nominal > 0.0:
        yield from _against(recording, nominal, "the stamps say" if stamped else "the rate given is")


def decimated(recording: Recording) -> Iterator[Finding]:
    """A sensor that runs faster than its log, as the log itself says."""
    stated = _notes(recording, "source").get("sensor_rate")
    sensor = _number(stated, "hz") if isinstance(stated, Mapping) else 0.0
    if isinstance(stated, Mapping) and sensor > 1.5 * recording.rate:
        yield finding(
            "decimated",
            f"the sensor runs at {sensor:.4g} Hz ({stated['from']}) and is logged at {recording.rate:.4g} Hz: N is up "
            f"to {math.sqrt(sensor / recording.rate):.3g} times too large, less if the samples were filtered before",
            severity=Severity.WARNING,
            count=recording.n_samples,
            advice=str(stated["advice"]),
        )


def _of_run(recording: Recording) -> Iterator[Finding]:
    """The clock of the instrument, by which samples were counted, against that of the host."""
    notes = _notes(recording, "source")
    host, error = _number(notes, "rate_measured"), _number(notes, "rate_uncertainty")
    ppm = (host / recording.rate - 1.0) * 1e6 if host > 0 else 0.0
    if abs(ppm) > max(POOR_CLOCK, 5e6 * error / recording.rate):
        yield finding(
            "clock_rate",
            f"the instrument states {recording.rate:.8g} Hz, the clock of the host says "
            f"{with_parentheses(host, error)} Hz: {_apart(ppm)}; the former is used",
            severity=Severity.WARNING,
            count=recording.n_samples,
        )


def _apart(ppm: float) -> str:
    """How far a rate is from the stated one."""
    return f"{ppm:+.4g} ppm" if abs(ppm) < _PERCENT else f"{ppm / _PERCENT:+.3g} %"


def _against(recording: Recording, nominal: float, says: str) -> Iterator[Finding]:
    """The rate against the one that the header claims."""
    notes = _notes(recording, "timebase")
    ratio = nominal / recording.rate
    every = round(ratio)
    if every >= 2 and abs(ratio / every - 1.0) < 0.01:
        yield finding(
            "decimated",
            f"the header says {nominal:.6g} Hz, {says} {recording.rate:.6g} Hz: one sample in {every} was logged",
            severity=Severity.WARNING,
            count=recording.n_samples,
        )
        return
    ppm = (recording.rate / nominal - 1.0) * 1e6
    error = _number(notes, "jitter_rms_s") * math.sqrt(12.0 / recording.n_samples) / recording.duration
    if abs(ppm) > max(POOR_CLOCK, 5e6 * error):
        yield finding(
            "clock_rate",
            f"the header says {nominal:.8g} Hz, {says} {recording.rate:.8g} Hz: {_apart(ppm)}; the latter is used",
            severity=Severity.WARNING,
            count=recording.n_samples,
        )


def drift(recording: Recording) -> Iterator[Finding]:
    """A clock that gains or loses more at one end of the record than at the other (battery B14)."""
    notes = _notes(recording, "timebase")
    change, error = _number(notes, "rate_change_ppm"), _number(notes, "rate_change_error_ppm")
    wander, off = _number(notes, "wander_s"), _number(notes, "off_grid")
    if off > OFF_GRID:
        yield _off_grid(recording, off)
    drifts = abs(change) > max(POOR_CLOCK, CERTAIN * error)
    # A rate that changes evenly from end to end takes stamps an eighth of it times the span from their places.
    if drifts or wander > max(0.5 / recording.rate, POOR_CLOCK * 1e-6 / 8.0 * recording.duration):
        how = (
            f"the rate changes by {change:+.4g} ppm from start to end (standard error {error:.2g} ppm)"
            if drifts
            else "the rate wanders"
        )
        yield finding(
            "clock_drift",
            f"according to the stamps, {how}; the mean rate, {recording.rate:.8g} Hz, is used, and samples are up to "
            f"{wander:.2g} s, {wander * recording.rate:.2g} intervals, from their stamps",
            severity=Severity.WARNING,
            count=recording.n_samples,
        )


def _off_grid(recording: Recording, share: float) -> Finding:
    rate = f"{recording.rate:.8g}"
    return finding(
        "off_grid",
        f"{percent(share)} of the samples are more than half an interval from an even grid of {rate} Hz, "
        "and no slow clock drift explains it: sampling was uneven, or samples were lost without a gap in the stamps",
        severity=Severity.FATAL,
        count=round(share * recording.n_samples),
        advice=f"log the clock of the sensor; --rate {rate} treats the samples as even and ignores the stamps",
    )


# -- what was done ----------------------------------------------------------------------------------------


def repairs(recording: Recording) -> Iterator[Finding]:
    """The repairs in the history: what went, of which channel, and why."""
    for step in recording.history:
        if step.get("step") != "repair":
            continue
        samples = {str(name): int(count) for name, count in (step.get("samples") or {}).items()}
        went = ", ".join(f"{plural(count, 'sample')} of {name}" for name, count in samples.items() if count)
        yield finding(
            "repaired",
            f"{step.get('repair')}: {went or 'no sample'} taken out: {step.get('why')}",
            severity=Severity.INFO,
            count=max(samples.values(), default=0),
        )


def bench_files(recording: Recording) -> Iterator[Finding]:
    """The file of a bench that stated how the log is read."""
    for step in recording.history:
        if step.get("step") == "bench_file":
            yield finding("bench_file", words_of_bench(step), severity=Severity.INFO, count=0)


def words_of_bench(step: Mapping[str, Any]) -> str:
    """What a file of a bench stated, as it stands there."""
    stated = []
    for key, value in (step.get("stated") or {}).items():
        parts = [f"{k} = {v}" for k, v in value.items()] if isinstance(value, Mapping) else [str(value)]
        stated.append(f"{key} {', '.join(parts)}")
    return f"from {step.get('file')}: {'; '.join(stated)}"


# -- text -------------------------------------------------------------------------------------------------


def text(recording: Recording) -> Iterator[Finding]:
    """What was odd in the text of a log, and what a reader of any format had to guess (battery F6; class 5)."""
    notes = _notes(recording, "text")
    ragged = int(_number(notes, "ragged"))
    if ragged:
        rows = _rows(notes, "ragged_rows")
        yield finding(
            "ragged_rows",
            f"{plural(ragged, 'row')} with too few or too many cells; first: {', '.join(map(str, rows))}",
            severity=Severity.WARNING,
            spans=_spans(rows),
            count=ragged,
        )
    yield from _sentences(notes)
    yield from _labels(notes)
    yield from _suffixes(notes)
    empty = int(_number(notes, "missing_cells"))
    if empty:
        what = f"{plural(empty, 'cell')} without a number"
        yield finding("cells_missing", what, severity=Severity.INFO, count=empty)
    if notes.get("unterminated_last_line"):
        yield finding(
            "unterminated_last_line",
            "the last line is incomplete and was dropped: its last number may be truncated",
            severity=Severity.WARNING,
            count=1,
        )
    nul = int(_number(notes, "nul_bytes"))
    if nul:
        what = f"{plural(nul, 'NUL byte')} in the text"
        yield finding("nul_bytes", what, severity=Severity.WARNING, count=nul)
    lost = [str(name) for name in recording.notes.get("sensors_left_out") or ()]
    if lost:
        yield finding(
            "sensor_left_out",
            f"{', '.join(lost)}: the cells are text, not numbers; left out",
            severity=Severity.WARNING,
            count=len(lost),
        )
    kept = [*(notes.get("guesses") or ()), *(_notes(recording, "source").get("guesses") or ())]
    guesses = [str(guess) for guess in kept]
    if guesses:
        yield finding("dialect_guessed", "; ".join(guesses), severity=Severity.INFO, count=len(guesses))


def _suffixes(notes: Notes) -> Iterator[Finding]:
    """Units and marks behind the numbers, by column."""
    by_column = notes.get("suffixes")
    for name, suffixes in (by_column if isinstance(by_column, Mapping) else {}).items():
        for suffix, count in suffixes.items():
            unit = _is_unit(suffix)
            meaning = "it is the unit" if unit else "left out; its meaning is unknown"
            yield finding(
                "cell_suffix",
                f"{name}: {suffix!r} follows the number in {plural(count, 'cell')}: {meaning}",
                severity=Severity.INFO if unit else Severity.WARNING,
                count=count,
            )


def _is_unit(text: str) -> bool:
    try:
        parse_unit(text, tuple(QuantityKind))
    except InputError:
        return False
    return True


def _sentences(notes: Notes) -> Iterator[Finding]:
    """Sentences that failed their checksum, and lines that may have been one."""
    failed, stray = int(_number(notes, "sentences_failed")), int(_number(notes, "stray_lines"))
    if failed + stray == 0:
        return
    parts, rows = [], _rows(notes, "failed_rows")
    if failed:
        parts.append(
            f"{plural(failed, 'sentence')} {notes.get('sentence')} failed the checksum, {_places(rows, failed)}: read "
            "as missing samples"
        )
    if stray:
        parts.append(f"{plural(stray, 'line')} of unknown type left out")
    yield finding(
        "checksum_failed",
        "; ".join(parts),
        severity=Severity.WARNING,
        spans=_spans(rows),
        count=failed + stray,
    )


def _labels(notes: Notes) -> Iterator[Finding]:
    """Lines of labeled values that break with the others."""
    damaged, stray = int(_number(notes, "labels_damaged")), int(_number(notes, "labels_stray"))
    lacking, absent = int(_number(notes, "labels_lacking")), notes.get("labels_absent") or {}
    unknown, rows = notes.get("labels_unknown") or {}, _rows(notes, "failed_rows")
    parts = []
    if damaged:
        parts.append(f"{plural(damaged, 'damaged line')} read as missing samples, {_places(rows, damaged)}")
    if stray:
        parts.append(f"{plural(stray, 'line')} without a label of the log left out")
    if lacking:
        parts.append(f"{plural(lacking, 'line')} without a value of {_counted(absent)}: missing there")
    if unknown:
        parts.append(f"rare labels left out: {_counted(unknown)}")
    if parts:
        yield finding(
            "labeled_lines",
            "; ".join(parts),
            severity=Severity.WARNING if damaged or stray else Severity.INFO,
            spans=_spans(rows) if damaged else [],
            count=damaged + stray + lacking + sum(unknown.values()),
        )


def _counted(names: Mapping[str, int]) -> str:
    shown = [f"{name} ({count})" for name, count in list(names.items())[:PLACES]]
    return ", ".join(shown) + (f" and {len(names) - PLACES} more" if len(names) > PLACES else "")


def words(recording: Recording, surveys: Sequence[ChannelSurvey]) -> Iterator[Finding]:
    """Overload words of a text log that came in as missing samples (battery B2)."""
    count = int(_number(_notes(recording, "text"), "overload_words"))
    surveyed = sum(s.overload for s in surveys)
    if count > surveyed:
        share = (count - surveyed) / max(recording.n_samples * max(len(surveys), 1), 1)
        yield finding(
            "overload",
            f"{plural(count - surveyed, 'overload word')} in the text ({percent(share)} of the cells), read as missing",
            severity=Severity.FATAL if share > TOLERATED else Severity.WARNING,
            count=count - surveyed,
        )
