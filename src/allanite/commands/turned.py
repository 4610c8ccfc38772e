# SPDX-License-Identifier: BSD-3-Clause
"""Records of a sensor that was turned: when, what is wrong with them between the turns, and which model is theirs.

A record with turns in it is not at rest, clips where it is turned, and repeats its limit there. None of that is a
fault. So the record is looked at twice: as it is, and with the turns left out. What the second look no longer sees
came from the turns and is information; what it still sees is a fault of the measurement.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.commands.recordings import is_lossy
from allanite.errors import DataQualityError, InputError
from allanite.lazy_dataclasses import dataclass
from allanite.recording.channel_names import for_shell, scale_option, unit_option, ways_to_units

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from allanite.experiments.reversals import Reversals
    from allanite.noise import NoiseModel
    from allanite.recording.health.finding import Finding
    from allanite.recording.records import Channel, Recording

__all__ = [
    "TurnedRecord",
    "checked",
    "chosen_model",
    "gyro_of",
    "gyros_of",
    "judged",
    "model_for",
    "models_for",
    "part_of",
    "placed_of",
    "rates_of",
    "turn_spans",
    "turns_of",
]

Json = Mapping[str, Any]

#: Leaving the turns out makes these; they say nothing about the record.
_MADE_BY_LEAVING_OUT = frozenset({"missing", "broken_up", "too_short"})
#: A drift, a warm-up or a knock moves the signal. Whether that matters is judged with the noise model, dwell by dwell.
_JUDGED_LATER = frozenset(
    {"not_at_rest", "disturbance", "amplitude_drop", "noise_changes", "spikes", "heavy_tails"}
)
#: Findings by which the signal contradicts the turns that were given.
CONTRADICTIONS = ("turn_not_listed", "turn_not_seen")
#: A turn that no signal shows is as long as the gap that hides it: beyond this the gap is a loss [s].
LONGEST_TURN = 15.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnedRecord:
    """A record that may be measured.

    Attributes
    ----------
    recording : Recording
        Samples that a finding excludes read as missing.
    findings : tuple of Finding
    lossy : bool
        Samples or rows that belong to a dwell did not take part.
    """

    recording: Recording
    findings: tuple[Finding, ...]
    lossy: bool


# -- which channel, which model -----------------------------------------------------------------------------


def gyro_of(recording: Recording) -> str:
    """The one channel of rates.

    Raises
    ------
    InputError
        None, or several.
    """
    return gyros_of(recording, most=1)[0]


def gyros_of(recording: Recording, *, most: int) -> list[str]:
    """The channels of rates, at most so many.

    Raises
    ------
    InputError
        None, or more.
    """
    rates = rates_of(recording)
    if len(rates) > most:
        count = "one" if most == 1 else f"at most {most}"
        raise InputError(f"several channels of rates: {', '.join(rates)}; choose {count} with --channels")
    return rates


def rates_of(recording: Recording) -> list[str]:
    """The channels of rates.

    Raises
    ------
    InputError
        None.
    """
    from allanite.recording.records import Kind

    rates = [c.name for c in recording.channels if c.kind is Kind.RATE]
    if rates:
        return rates
    has = ", ".join(f"{c.name} ({c.kind.value})" for c in recording.channels)
    way = ways_to_units([(c.name, c.kind.value) for c in recording.channels])
    raise InputError(f"no channel of rates, but {has}{f': {way}' if way else ''}")


def model_for(
    source: str | os.PathLike[str] | None,
    channel: Channel,
    *,
    called: str = "",
    beside: Sequence[Channel] = (),
) -> tuple[NoiseModel | None, str]:
    """The model of a channel out of a study, a fit or words, and where it comes from.

    `called` is its name there, where that is another one; `beside` are the channels that need one as well.

    Raises
    ------
    InputError
        Several models, and none of that channel; or a model of another kind of sensor.
    """
    model, where = chosen_model(source, called or channel.name, by_name=bool(called), beside=beside)
    if model is not None:
        _refuse_other_kind(model, where, channel)
    return model, where


def models_for(
    source: str | os.PathLike[str] | None,
    channels: Iterable[Channel],
    called: Mapping[str, str] | None = None,
    *,
    mapped: bool = True,
) -> tuple[dict[str, NoiseModel], dict[str, str]]:
    """The same of several channels: models by name, where there is one, and where they come from.

    Parameters
    ----------
    called : mapping of str to str, optional
        What the models call a channel of the log, where that is another name.
    mapped : bool
        Whether the command takes such names (--model-channels): a refusal offers them only then.

    Raises
    ------
    InputError
        No such channel; or as `model_for`.
    """
    taking, named = list(channels), dict(called or {})
    if unknown := sorted(set(named) - {channel.name for channel in taking}):
        raise InputError(
            f"--model-channels names {', '.join(unknown)}; the channels used are: "
            f"{', '.join(channel.name for channel in taking)}"
        )
    given = {
        channel.name: model_for(
            source, channel, called=named.get(channel.name, ""), beside=taking if mapped else ()
        )
        for channel in taking
    }
    models = {name: model for name, (model, _) in given.items() if model is not None}
    return models, {name: where for name, (_, where) in given.items()}


def chosen_model(
    source: str | os.PathLike[str] | None,
    channel: str,
    *,
    by_name: bool = False,
    beside: Sequence[Channel] = (),
) -> tuple[NoiseModel | None, str]:
    """The same by the name of the channel alone, whatever its kind; the only one there is, unless it goes by name."""
    from allanite.study.model_file import load_models

    if source is None:
        return None, "fitted to this record"
    models, _ = load_models(source)
    if not Path(source).exists():
        return next(iter(models.values())), "given in words"
    if channel in models:
        return models[channel], f"{source}, channel {channel}"
    if len(models) == 1 and not by_name:
        return next(iter(models.values())), str(source)
    has = f"{source} has no model of channel {channel!r}, but of {', '.join(models)}"
    if by_name:
        raise InputError(f"{has}: --model-channels takes one of these")
    refusal = f"{has}: write the intended model to a separate file"
    if beside:
        refusal += f", or map the names, --model-channels {for_shell(_mapped(beside, models))}"
    raise InputError(refusal)


def _mapped(channels: Sequence[Channel], models: Mapping[str, NoiseModel]) -> str:
    """A name of a model of its kind for each channel, in their order; the last one where there are too few."""
    words = []
    for kind in dict.fromkeys(channel.kind for channel in channels):
        names = [name for name, model in models.items() if model.kind == kind.rate] or list(models)
        alike = [channel.name for channel in channels if channel.kind is kind]
        words += [f"{name}={names[min(k, len(names) - 1)]}" for k, name in enumerate(alike)]
    return ",".join(words)


def _refuse_other_kind(model: NoiseModel, where: str, channel: Channel) -> None:
    """Words and files say what sensor they are of: its numbers mean nothing for another."""
    kind = channel.kind.rate.value
    if kind == model.kind:
        return
    advice = "pass the model of this channel"
    if kind == "unknown":
        unit = "deg/s" if model.kind == "rate" else "m/s^2" if model.kind == "acceleration" else ""
        advice = f"state the unit of the samples, as in {unit_option([channel.name], unit)}"
    elif way := scale_option([(channel.name, kind)]):
        advice = f"give the scale factor of the data sheet, as in {way}, or a model in that unit"
    raise InputError(
        f"channel {channel.name!r} is one of {channel.kind.value}, the noise model ({where}) is one of {model.kind}: "
        f"{advice}"
    )


# -- when it was turned -------------------------------------------------------------------------------------


def turns_of(
    whole: Recording,
    channel: str,
    *,
    start: float | None = None,
    stop: float | None = None,
    turns: str | os.PathLike[str] | None = None,
    dwell: float | None = None,
    first: str | None = None,
    dead_time: float,
) -> tuple[Recording, Reversals]:
    """The part of a record between two times, and its turns: from a file, by the clock, or read off the signal.

    Parameters
    ----------
    whole : Recording
    start, stop : float, optional [s]
        Since its first sample.
    turns : path, optional
        Times in it count from the first sample of the whole record.
    dwell : float, optional [s]
    first : "north", "south", "up", "down" or None
        Direction in which the part begins.
    dead_time : float [s]

    Raises
    ------
    InputError
        Turns both from a file and by the clock.
    """
    from allanite.experiments.reversals import find_reversals, periodic_reversals, read_turns

    if turns is not None and dwell is not None:
        raise InputError(
            "turns come either from a file (--turns) or from a dwell time (--dwell), not from both"
        )
    part = part_of(whole, start, stop)
    facts: dict[str, Any] = {"channel": channel, "first": first, "dead_time": dead_time}
    if turns is not None:
        listed = read_turns(turns, whole, **facts).window(round((start or 0.0) * whole.rate), part.n_samples)
        return part, listed.beginning(first)
    if dwell is not None:
        return part, periodic_reversals(part, dwell=dwell, **facts).beginning(first)
    return part, find_reversals(part, **facts)


def placed_of(
    whole: Recording,
    channel: str,
    headings: str | os.PathLike[str] | None,
    *,
    start: float | None = None,
    stop: float | None = None,
    dead_time: float,
) -> tuple[Recording, Reversals]:
    """The part of a record between two times, and its positions from a file; one position where there is no file."""
    from allanite.experiments.reversals import Position, Reversals, read_positions

    part = part_of(whole, start, stop)
    if headings is not None:
        listed = read_positions(headings, whole, channel=channel, dead_time=dead_time)
        return part, listed.window(round((start or 0.0) * whole.rate), part.n_samples)
    all_of_it = (Position(start=0, stop=part.n_samples, heading=math.nan, sign=0),)
    nothing = Reversals.cut(
        rate=part.rate,
        n_samples=part.n_samples,
        turns=(),
        positions=all_of_it,
        source="none",
        first="unknown",
    )
    return part, nothing


def part_of(whole: Recording, start: float | None, stop: float | None) -> Recording:
    """The part of a record between two times [s]; the whole where there is neither."""
    return whole if start is None and stop is None else whole.window(start, stop)


# -- what is wrong with it ----------------------------------------------------------------------------------


def checked(
    recording: Recording,
    reversals: Reversals,
    channels: Sequence[str],
    *,
    accept: Collection[str] = (),
    longest: float = LONGEST_TURN,
) -> TurnedRecord:
    """A record without the samples that a finding excludes, or a refusal.

    Parameters
    ----------
    longest : float [s]
        Samples missing in a longer turn are a loss.

    Raises
    ------
    DataQualityError
        A fatal finding between the turns that was not accepted.
    """
    doubts = [f for f in reversals.findings if f.code in CONTRADICTIONS]
    try:
        ready = judged(recording, turn_spans(reversals), channels, accept=accept, longest=longest)
    except DataQualityError as error:
        if not doubts:
            raise
        # A list of turns that is wrong makes a good record look bad.
        contradictions = "".join(f"{f.message}\n    what to do: {f.advice}\n" for f in doubts)
        raise DataQualityError(
            f"signal and turns disagree: {contradictions}{error}", (*doubts, *error.findings)
        ) from None
    others = [f for f in reversals.findings if f not in doubts]
    return replace(ready, findings=(*doubts, *ready.findings, *others))


def judged(
    recording: Recording,
    spans: NDArray[np.int64],
    channels: Sequence[str],
    *,
    where: str = "while the sensor was turned",
    longest: float = LONGEST_TURN,
    milder: Collection[str] = (),
    accept: Collection[str] = (),
    reviewed: Callable[[Finding], Finding] | None = None,
) -> TurnedRecord:
    """The same for spans of samples in which the sensor is known to move.

    Parameters
    ----------
    spans : ndarray of int64, shape (n, 2) [samples]
        Half-open. What is wrong there alone is information.
    where : str
        Words for them.
    longest : float [s]
        Samples missing in a longer span are a loss.
    milder : collection of str
        Further findings that warn and do not refuse.
    reviewed : callable, optional
        What to make of a finding before it refuses or excludes anything.

    Raises
    ------
    DataQualityError
        A fatal finding outside of them that was not accepted.
    """
    from allanite.recording.health.examination import check, prepare
    from allanite.recording.health.finding import Severity

    as_it_is = check(recording)
    still = recording.excluding(dict.fromkeys(channels, spans), "turns") if len(spans) else recording
    moves_all_the_time = len(spans) == 1 and spans[0, 1] - spans[0, 0] >= recording.n_samples
    at_rest = {
        (f.code, f.channel): f
        for f in (() if moves_all_the_time else check(still))
        if f.code not in _MADE_BY_LEAVING_OUT and not _is_of_the_log(f)
    }
    kept_findings: list[Finding] = []
    for f in as_it_is:
        kept = f if _is_of_the_log(f) else at_rest.pop((f.code, f.channel), None)
        kept_findings.append(_of_the_spans(f, where) if kept is None else kept)
    kept_findings += at_rest.values()
    kept_findings = [_milder(f) if f.code in {*_JUDGED_LATER, *milder} else f for f in kept_findings]
    kept_findings = [reviewed(f) for f in kept_findings] if reviewed is not None else kept_findings
    if len(spans):  # cutting the motion out of a record that was turned would take the turns
        kept_findings = [f.unrepaired("cut_motion") for f in kept_findings]
    kept_findings.sort(key=lambda f: f.severity.rank)
    ready, findings = prepare(recording, kept_findings, accept=accept)
    serious = [f for f in findings if f.severity is not Severity.INFO or f.excludes or _is_of_the_log(f)]
    short = spans[spans[:, 1] - spans[:, 0] <= longest * recording.rate]
    return TurnedRecord(recording=ready, findings=findings, lossy=is_lossy(_lost(f, short) for f in serious))


def turn_spans(reversals: Reversals) -> NDArray[np.int64]:
    """Samples of the turns, with the dead time after each and the guard before; of those in the signal that a list
    does not hold as well.
    """
    import numpy as np

    before, after = (math.ceil(s * reversals.rate) for s in (reversals.guard, reversals.dead_time))
    moved = [(t.start, t.stop) for t in reversals.turns]
    moved += [(d.start, d.stop) for d in reversals.disturbed if d.kind == "turn"]
    spans = [(max(a - before, 0), min(b + after, reversals.n_samples)) for a, b in moved]
    return np.array(sorted(spans), dtype=np.int64).reshape(-1, 2)


def _is_of_the_log(finding: Finding) -> bool:
    """True for findings of time stamps and text, and for gaps: they do not depend on what the samples are."""
    from allanite.recording.health.catalogue import CATALOGUE

    return finding.code == "missing" or CATALOGUE[finding.code].group in ("Time", "Text")


def _of_the_spans(finding: Finding, where: str) -> Finding:
    from allanite.recording.health.finding import Severity

    return replace(
        finding,
        severity=Severity.INFO,
        message=f"{where}: {finding.message}",
        advice="none needed: it is caused by moving the sensor",
        excludes=False,
        risk="",
    )


def _milder(finding: Finding) -> Finding:
    from allanite.recording.health.finding import Severity

    return replace(finding, severity=Severity.WARNING) if finding.severity is Severity.FATAL else finding


def _lost(finding: Finding, spans: NDArray[np.int64]) -> Json:
    """A finding as plain data, its count that of samples outside of the spans where it names its samples."""
    import numpy as np

    from allanite.recording.records import merge_spans

    plain = finding.to_json()
    if not len(finding.spans):
        return plain
    spans = merge_spans(spans)
    before = np.cumsum(np.column_stack([np.zeros(len(spans)), spans[:, 1] - spans[:, 0]]))  # at their ends
    ends = np.interp(finding.spans, spans.ravel(), before) if len(spans) else np.zeros_like(finding.spans)
    inside = round(float(np.diff(ends, axis=1).sum()))
    return {**plain, "count": max(plain["count"] - inside, 0)}
