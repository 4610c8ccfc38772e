# SPDX-License-Identifier: BSD-3-Clause
"""Recordings out of logs, and what can be said of them before any science."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.errors import DataQualityError, InputError
from allanite.recording.channel_names import for_shell

if TYPE_CHECKING:
    from allanite.noise import NoiseModel
    from allanite.recording.health.finding import Finding
    from allanite.recording.records import Recording

__all__ = [
    "GAPS",
    "describe",
    "has_gaps",
    "is_lossy",
    "models_from",
    "models_of_several",
    "noise_channels",
    "options_of",
    "read_floor",
    "read_part",
    "read_whole",
    "ready_log",
]

Json = Mapping[str, Any]

#: Gaps that are listed.
GAPS = 1000
_LOSSES = frozenset(
    {
        "missing",
        "broken_up",
        "overload",
        "ragged_rows",
        "cells_missing",
        "duplicate_stamps",
        "repaired",
        "unterminated_last_line",
    }
)


def read_part(
    path: str | os.PathLike[str],
    *,
    start: float | None = None,
    stop: float | None = None,
    source: str | None = None,
    repair: Sequence[str] = (),
    config: str | os.PathLike[str] | None = None,
    **options: Any,
) -> Recording:
    """A log, or the part of it between two times [s] since its first stamp; options are those of `read`.

    `source` replaces the name of the file; `repair` names what is to be done to that part
    (`allanite.recording.cleaning`). `config` is a file of the bench, or "auto" (`allanite.commands.bench_file`). Units
    and such may be given for each of several logs, see `options_of`.
    """
    from allanite.commands.bench_file import bench_of
    from allanite.files.readers import read

    bench, of_log = bench_of(path, config), options_of(path, options)
    recording = (read if bench is None else bench.read)(path, start=start, stop=stop, **of_log)
    recording = recording if source is None else replace(recording, source=source)
    if not repair:
        return recording
    from allanite.recording.cleaning import clean

    return clean(recording, repair)


def options_of(path: str | os.PathLike[str], options: Mapping[str, Any]) -> dict[str, Any]:
    """The options of one of several logs: a mapping may name the log, and a channel or group of it behind a colon.

    >>> options_of("a.csv", {"rate": 100.0, "unit": {"acc": "g"}})
    {'rate': 100.0, 'unit': {'acc': 'g'}}

    ``{"a.csv": "g", "b.csv": "m/s^2"}`` is "g" for ``a.csv``; ``{"acc": "g", "b.csv:acc": "m/s^2"}`` is "g" for all but
    ``b.csv``. A log is named as its path is.
    """
    return {
        name: _of_log(Path(path), value) if isinstance(value, Mapping) else value
        for name, value in options.items()
    }


def _of_log(path: Path, value: Mapping[str, Any]) -> Any:
    """What a mapping says of a log: one thing for all of it, or what it says of its channels."""
    channels: dict[str, Any] = {}
    of_channels: dict[str, Any] = {}
    for key, statement in value.items():
        log, colon, channel = key.rpartition(":")
        if _names_log(key, path):
            if _is_same(key, path):
                return statement
        elif colon and _names_log(log, path):
            of_channels |= {channel: statement} if _is_same(log, path) else {}
        else:
            channels[key] = statement
    return channels | of_channels or None


def _names_log(key: str, path: Path) -> bool:
    return bool(key) and (key == os.fspath(path) or Path(key).exists())


def _is_same(key: str, path: Path) -> bool:
    return key == os.fspath(path) or (path.exists() and Path(key).samefile(path))


def read_whole(
    log: str | os.PathLike[str], start: float | None, stop: float | None, *, listed: bool, **options: Any
) -> tuple[Recording, float | None, float | None]:
    """The whole of a log, of which a part is taken later, and the ends of that part; options are those of `read_part`.

    Where no time grid can be made of the whole, it is the part, without ends: unless a list (`listed`) counts its times
    from a sample that the part does not begin with.
    """
    try:
        return read_part(log, **options), start, stop
    except DataQualityError:
        if (start is None and stop is None) or (listed and start is not None):
            raise
        return read_part(log, start=start, stop=stop, **options), None, None


def read_floor(floor: str | os.PathLike[str], **options: Any) -> Recording:
    """The record of a shorted input, read as the log of the sensor is.

    Of the options of the log those hold that say how it is written: not its part, channels, topic or repairs.

    Raises
    ------
    InputError
        The file states another unit than the log was said to have: a floor in mV that is read as V would be a thousand
        times too large, and one that is too small takes nothing off.
    """
    kept = (
        "unit",
        "time",
        "rate",
        "scale_factor",
        "sampling",
        "layout",
        "delimiter",
        "decimal",
        "kind",
        "carrier",
        "config",
    )
    recording = read_part(floor, **{k: options[k] for k in kept if options.get(k) is not None})
    for step in recording.history:
        for name, stated in step.get("units_set_aside", {}).items():
            unit = recording[name].unit
            raise InputError(
                f"{floor}: the floor states {stated} for {name}, but {unit} was given for the log. If {unit} is "
                f"right for both, write it into a copy: allanite convert {for_shell(str(floor))} floor.parquet --unit "
                f"{for_shell(unit)}; if not, correct the unit in the file of the log, and state no unit"
            )
    return recording


def ready_log(
    log: str | os.PathLike[str],
    *,
    accept: Collection[str] = (),
    judged_elsewhere: Collection[str] = (),
    by_averages: bool = True,
    source: str | None = None,
    progress: Callable[[float, str], None] | None = None,
    **options: Any,
) -> tuple[Recording, tuple[Finding, ...]]:
    """A log that was looked through for faults, without the samples that these exclude; and what was found.

    Parameters
    ----------
    accept : collection of str
        Codes of fatal findings to go on in spite of.
    judged_elsewhere : collection of str
        Codes of findings that the measurement comes to itself.
    by_averages : bool
        See `prepare`.
    **options
        Those of `read_part`.

    Raises
    ------
    DataQualityError
        A fatal finding that was not accepted.
    """
    from allanite.recording.health.examination import check, prepare

    advance = progress or (lambda fraction, what: None)
    advance(0.0, "reading")
    recording = read_part(log, source=source, **options)
    findings = check(recording, progress=lambda fraction: advance(fraction, "looking for faults"))
    return prepare(
        recording,
        [f for f in findings if f.code not in judged_elsewhere],
        accept=accept,
        by_averages=by_averages,
    )


def noise_channels(recording: Recording) -> list[str]:
    """Names of the channels that carry sensor noise.

    Raises
    ------
    InputError
        There is none.
    """
    from allanite.recording.clock_channels import without_noise

    names = [c.name for c in recording.channels if c.kind.noise_bearing]
    if not names:
        raise without_noise(recording)
    return names


def models_from(source: str | os.PathLike[str], names: Sequence[str]) -> dict[str, NoiseModel]:
    """The models of a file or of words by channel; one alone stands for all these channels."""
    from allanite.study.model_file import load_models

    models, _ = load_models(source)
    return dict.fromkeys(names, next(iter(models.values()))) if len(models) == 1 else dict(models)


def models_of_several(
    sources: Iterable[str | os.PathLike[str]],
) -> tuple[dict[str, NoiseModel], float | None]:
    """The models of several files or words by channel, and the first rate [Hz] that one of them states.

    Raises
    ------
    InputError
        Two sources that name the same channel.
    """
    from allanite.study.model_file import load_models

    by_channel: dict[str, NoiseModel] = {}
    rate = None
    for source in sources:
        models, stated = load_models(source)
        twice = sorted(set(models) & set(by_channel))
        if twice:
            raise InputError(f"{source} has a second model of {twice[0]!r}: give each channel once")
        by_channel |= models
        rate = rate or stated
    return by_channel, rate


def describe(
    recording: Recording, findings: Iterable[Finding], log: str | os.PathLike[str] | None = None
) -> dict[str, Any]:
    """Facts of a recording and what was found in it, as plain data.

    With its `log`, "run" says what a recorded run holds and lacks, as `allanite recover` does; None for other logs.

    "gaps" lists where samples are missing, `GAPS` at most, each with its "channels", "start" and "stop" [samples]; the
    same gap in several channels is one. "gap_count" says how many there are; where "gaps_cut", at least so many, and
    not all of them are listed.
    """
    from allanite.commands.run_account import account_of
    from allanite.recording.health.run import missing_because

    findings, account = tuple(findings), None if log is None else account_of(log)
    listed = [f.to_json() for f in findings]
    missing = max((f.count for f in findings if f.code == "missing"), default=0)
    return {
        "source": recording.source,
        "rate": recording.rate,
        "samples": recording.n_samples,
        "duration": recording.duration,
        "start": recording.start,
        "missing": missing,
        "missing_because": missing_because(recording, missing),
        **_gaps(recording, findings),
        "channels": [c.to_json() for c in recording.channels],
        "history": [dict(step) for step in recording.history],
        "contents": [*_contents(recording), *(account.sentences() if account else ())],
        "run": account and account.to_json(),
        "remarks": _remarks(recording),
        "findings": listed,
    }


def _gaps(recording: Recording, findings: Iterable[Finding]) -> dict[str, Any]:
    """All stretches without samples that the findings know of; the pass keeps the first 100 000 of a channel."""
    bearing = [c.name for c in recording.channels if c.kind.noise_bearing]
    channels: dict[tuple[int, int], list[str]] = {}
    unknown = False
    for f in (f for f in findings if f.code == "missing"):
        spans = f.spans.tolist()
        unknown = unknown or sum(stop - start for start, stop in spans) < f.count
        for start, stop in spans:
            channels.setdefault((start, stop), []).extend(bearing if f.channel is None else [f.channel])
    listed = sorted(channels)[:GAPS]
    return {
        "gaps": [
            {"channels": [n for n in bearing if n in channels[span]], "start": span[0], "stop": span[1]}
            for span in listed
        ],
        "gap_count": len(channels),
        "gaps_cut": unknown or len(listed) < len(channels),
    }


def _contents(recording: Recording) -> list[str]:
    """Messages, groups or topics that the file holds, in words; empty for a file that is one table."""
    source = recording.notes.get("source", {})
    return [str(part) for part in source.get("contents") or source.get("topics") or ()]


def _remarks(recording: Recording) -> list[str]:
    """What the reader chose, set aside or passed over, in words."""
    notes = recording.notes
    return [str(remark) for remark in notes.get("text", notes.get("source", {})).get("guesses", ())]


def is_lossy(findings: Iterable[Json]) -> bool:
    """True when samples or rows of the record did not take part: gaps, overloads, dropped rows, exclusions."""
    return any(f["count"] > 0 and (f.get("excludes") or f["code"] in _LOSSES) for f in findings)


def has_gaps(recording: Recording) -> bool:
    """True when a sample of a sensor is missing, or a repair took rows."""
    import numpy as np

    if any(step.get("step") == "repair" and any(step["samples"].values()) for step in recording.history):
        return True
    # A companion (temperature, magnetic field) may have been measured less often: that is no loss.
    bearing = [c.name for c in recording.channels if c.kind.noise_bearing] or recording.names
    return any(np.isnan(block).any() for name in bearing for _, block in recording.blocks(name))
