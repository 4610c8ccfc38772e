# SPDX-License-Identifier: BSD-3-Clause
"""All detectors on all channels, and what follows: findings, and samples that are left out."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, InputError
from allanite.plain_files.counted import plural
from allanite.plain_files.loggers import logger_of
from allanite.recording.channel_names import for_shell
from allanite.recording.health import (
    constancy,
    disturbance,
    held,
    log,
    meaning,
    motion,
    padding,
    raw_counts,
    repeats,
    resolution,
    rows,
    run,
    tails,
    values,
)
from allanite.recording.health.catalogue import CATALOGUE, MOVES
from allanite.recording.health.finding import Finding, Severity
from allanite.recording.health.survey import ChannelSurvey, survey
from allanite.recording.records import Recording, checked_recording, merge_spans

__all__ = [
    "CHANNEL_DETECTORS",
    "LOG_DETECTORS",
    "NONSENSE_DETECTORS",
    "PRESENCE_DETECTORS",
    "RANGE_DETECTORS",
    "RECORD_DETECTORS",
    "ROW_DETECTORS",
    "SAMPLE_DETECTORS",
    "STILL_DETECTORS",
    "STRETCH_DETECTORS",
    "WORD_DETECTORS",
    "check",
    "padding_of",
    "prepare",
]

Progress = Callable[[float], None]

#: Share of a record that is worth an analysis of its own.
WORTH = 0.05
#: Findings of stretches in which the unit moves.
_LOG = logger_of(__name__)
_RESTLESS = ("not_at_rest", "motion", "disturbance")

#: Functions of one channel's survey: the numbers are no readings at all. Then nothing else is said of the channel.
NONSENSE_DETECTORS: tuple[Callable[[ChannelSurvey], Iterator[Finding]], ...] = (
    values.implausible_exponents,
    values.only_grows,
)
#: The same: what there is of samples.
PRESENCE_DETECTORS: tuple[Callable[[ChannelSurvey], Iterator[Finding]], ...] = (
    values.no_samples,
    values.too_short,
    values.missing,
    values.overload,
    meaning.unit,
)
#: The same, for channels with enough samples: words of the converter, which are left out.
RANGE_DETECTORS: tuple[Callable[[ChannelSurvey], Iterator[Finding]], ...] = (values.saturated,)
#: The same: values that are no readings and are left out.
WORD_DETECTORS: tuple[Callable[[ChannelSurvey], Iterator[Finding]], ...] = (
    padding.zero_filled,
    padding.fill_value,
)
#: The same: stretches of one value.
STRETCH_DETECTORS: tuple[Callable[[ChannelSurvey], Iterator[Finding]], ...] = (repeats.stuck,)
#: Of all channels together: rows without a reading that one channel alone does not show, after either of the two.
ROW_DETECTORS: tuple[Callable[[Sequence[ChannelSurvey], Sequence[Finding]], Iterator[Finding]], ...] = (
    padding.zero_rows,
    padding.shared_zeros,
)
STILL_DETECTORS: tuple[Callable[[Sequence[ChannelSurvey], Sequence[Finding]], Iterator[Finding]], ...] = (
    padding.shared_stretches,
)
#: Of one channel again, of what is left: what lies beside a gap, and single samples.
SAMPLE_DETECTORS: tuple[Callable[[ChannelSurvey], Iterator[Finding]], ...] = (
    disturbance.half_before_gap,
    disturbance.impulses,
)
#: The same, of what is left then. A new detector is one line here and one entry in the catalogue.
CHANNEL_DETECTORS: tuple[Callable[[ChannelSurvey], Iterator[Finding]], ...] = (
    values.clipping,
    resolution.no_noise_resolved,
    resolution.quantisation,
    resolution.quantisation_not_white,
    resolution.float_step,
    repeats.interleaved,
    disturbance.rest,
    disturbance.amplitude_drop,
    constancy.noise_changes,
    meaning.unit_trap,
    meaning.known_step,
    meaning.aliasing,
)
#: Functions of all channels' surveys together.
RECORD_DETECTORS: tuple[Callable[[Sequence[ChannelSurvey]], Iterator[Finding]], ...] = (
    repeats.duplicate_channels,
    motion.gravity,
    raw_counts.raw_counts,
    motion.motion,
    meaning.bias_removed,
)
#: Functions of the recording's notes.
LOG_DETECTORS: tuple[Callable[[Recording], Iterator[Finding]], ...] = (
    rows.rows_of_means,
    log.stamps,
    log.jitter,
    log.clock,
    log.decimated,
    log.drift,
    log.text,
    log.repairs,
    log.bench_files,
    run.gap_reasons,
    run.doubtful,
    run.remarks,
    run.autozero,
    run.scale,
)


#: Findings that a channel is no reading of a sensor at all, and what to do where others are.
NO_READINGS = {
    "only_grows": "read the log without it",
    "no_noise_resolved": "check its wiring and range, or read the log without it",
}


def check(recording: Recording, *, progress: Progress | None = None) -> tuple[Finding, ...]:
    """Everything that is wrong with a recording: motion first, then the gravest.

    One pass over each channel that can bear a noise model, in blocks: the recording may be larger than memory.

    Parameters
    ----------
    recording : Recording
        Recording to check.
    progress : callable, optional
        Called with the fraction done, 0 to 1.
    """
    checked_recording(recording, "check")
    total = max(recording.n_samples * len(recording.channels), 1)
    done = 0

    def advance(count: int) -> None:
        nonlocal done
        done += count
        if progress is not None:
            progress(done / total)

    with np.errstate(invalid="ignore", over="ignore"):  # samples of the wrong byte order are anything
        findings = _with_quiet_part(recording, _found(recording, advance))
    findings = _advise_the_others(recording, findings)
    _LOG.info("%s: %s", recording.source or "recording", plural(len(findings), "finding"))
    for each in findings:
        _LOG.info("%s", each)
    order, names = list(CATALOGUE), {None: -1} | {name: i for i, name in enumerate(recording.names)}

    def place(f: Finding) -> tuple[bool, int, int, int]:
        return f.code not in MOVES, f.severity.rank, order.index(f.code), names.get(f.channel, len(names))

    return tuple(sorted(findings, key=place))


def _advise_the_others(recording: Recording, findings: Sequence[Finding]) -> list[Finding]:
    """Channels that are no readings of a sensor are left out by reading the others: the advice names these."""
    aside = {f.channel for f in findings if f.code in {*NO_READINGS, "no_samples"}}
    others = [c.name for c in recording.channels if c.kind.noise_bearing and c.name not in aside]
    if not others:
        return [*findings]
    option = f"--channels {for_shell(','.join(others))}"
    return [f.advise(f"{NO_READINGS[f.code]}: {option}") if f.code in NO_READINGS else f for f in findings]


def _advise_the_spaced(surveys: Sequence[ChannelSurvey], findings: Sequence[Finding]) -> list[Finding]:
    """Channels with a value in every k-th row are read alone where others have more: rows without them are left out."""
    spaced = [s.name for s in surveys if values.every(s)]
    if not 0 < len(spaced) < len(surveys):
        return [*findings]
    advice = f"read them alone: --channels {for_shell(','.join(spaced))}"
    return [
        replace(f, advice=advice) if f.code == "broken_up" and f.channel in spaced else f for f in findings
    ]


def _found(recording: Recording, advance: Callable[[int], None]) -> list[Finding]:
    surveys = []
    for channel in recording.channels:
        if channel.kind.noise_bearing:
            surveys.append(survey(recording, channel.name, advance))
        else:
            advance(recording.n_samples)
    findings = [f for look in LOG_DETECTORS for f in look(recording)]
    findings += log.words(recording, surveys)
    of_channels: list[Finding] = []
    enough: list[ChannelSurvey] = []
    for s in surveys:
        nonsense = [f for look in NONSENSE_DETECTORS for f in look(s)]
        of_channels += nonsense or [f for look in PRESENCE_DETECTORS for f in look(s)]
        if not nonsense and s.present >= values.MINIMUM:
            enough.append(s)
    of_channels = _advise_the_spaced(surveys, of_channels)
    left_out, enough = _left_out(enough)
    of_channels += left_out
    renewed = held.holds(enough)
    laws = {s.name: _law(s, renewed) for s in enough}
    of_channels += held.held_samples(renewed)
    of_channels += [f for s in enough for f in tails.contaminated(s, laws[s.name])]
    samples, enough = _samples(_noise_scales(enough, renewed, laws), laws)
    of_channels += samples
    enough = _noise_scales(enough, renewed, laws)
    of_channels += [f for s in enough for look in CHANNEL_DETECTORS for f in look(s)]
    findings += _joined(of_channels, len(surveys))
    looks = RECORD_DETECTORS
    if any(
        step.get("step") == "simulate" for step in recording.history
    ):  # a simulated sensor never had a bias
        looks = tuple(look for look in looks if look is not meaning.bias_removed)
    return findings + [f for look in looks for f in look(enough)]


def _left_out(surveys: Sequence[ChannelSurvey]) -> tuple[list[Finding], list[ChannelSurvey]]:
    """What is found of stretches that are no readings, and the surveys of what is left."""
    rails, left = _stretches(RANGE_DETECTORS, surveys)
    padded, left = _padding(left)
    return [*rails, *padded], left


def _law(survey: ChannelSurvey, renewed: Mapping[str, held.Hold]) -> tails.Tails:
    """The law of a channel's white noise; values that repeat come in clusters, and hide theirs."""
    return tails.Tails(law=tails.TailLaw.UNKNOWN) if survey.name in renewed else tails.law_of_survey(survey)


def _noise_scales(
    surveys: Sequence[ChannelSurvey], renewed: Mapping[str, held.Hold], laws: Mapping[str, tails.Tails]
) -> list[ChannelSurvey]:
    """The surveys without the scales at which repeats, or a few wide samples, make the differences."""
    return [tails.without_short_scales(held.without_short_scales(s, renewed), laws[s.name]) for s in surveys]


def _samples(
    surveys: Sequence[ChannelSurvey], laws: Mapping[str, tails.Tails]
) -> tuple[list[Finding], list[ChannelSurvey]]:
    """Single samples that are no readings, and what is left; the tails of noise that is not Gaussian are no spikes."""

    def impulses(survey: ChannelSurvey) -> Iterator[Finding]:
        law = laws[survey.name]
        if law.law is tails.TailLaw.CONTAMINATED:
            return iter(())
        return disturbance.impulses(survey, tails.reach_of_tails(survey, law))

    return _stretches(
        [impulses if look is disturbance.impulses else look for look in SAMPLE_DETECTORS], surveys
    )


def padding_of(surveys: Sequence[ChannelSurvey]) -> list[Finding]:
    """Zeros, words for "no value" and frozen readings in these channels, and in the rows that they share."""
    return _padding(surveys)[0]


def _padding(surveys: Sequence[ChannelSurvey]) -> tuple[list[Finding], list[ChannelSurvey]]:
    findings: list[Finding] = []
    left = list(surveys)
    for alone, shared in ((WORD_DETECTORS, ROW_DETECTORS), (STRETCH_DETECTORS, STILL_DETECTORS)):
        more, left = _stretches(alone, left)
        findings += more
        for look in shared:
            more = list(look(left, findings))
            findings, left = [*findings, *more], _without(left, more)
    return findings, left


def _stretches(
    looks: Sequence[Callable[[ChannelSurvey], Iterator[Finding]]], surveys: Sequence[ChannelSurvey]
) -> tuple[list[Finding], list[ChannelSurvey]]:
    """One detector after another: what one leaves out is no evidence for the next."""
    findings: list[Finding] = []
    left = list(surveys)
    for look in looks:
        more = [f for s in left for f in look(s)]
        findings, left = [*findings, *more], _without(left, more)
    return findings, left


def _without(surveys: Sequence[ChannelSurvey], findings: Sequence[Finding]) -> list[ChannelSurvey]:
    """The surveys without what these findings leave out; those of channels with enough samples left."""
    spans: dict[str | None, list[NDArray[np.int64]]] = {}
    for f in findings:
        if f.excludes:
            spans.setdefault(f.channel, []).append(f.spans)
    left = [s.without(np.concatenate(spans[s.name])) if s.name in spans else s for s in surveys]
    return [s for s in left if s.present >= values.MINIMUM]


def _joined(findings: list[Finding], n_channels: int) -> list[Finding]:
    """What every channel says in the same words is said once, of the recording."""

    def words(f: Finding) -> tuple[object, ...]:
        return f.code, f.message, f.count, f.places, f.spans.tobytes()

    joined: list[Finding] = []
    for _, group in groupby(sorted(findings, key=lambda f: tuple(map(str, words(f)))), key=words):
        same = list(group)
        joined += [replace(same[0], channel=None)] if len(same) == n_channels > 1 else same
    return joined


def _with_quiet_part(recording: Recording, findings: Sequence[Finding]) -> list[Finding]:
    """The findings; those of motion with the options that take the longest part in which no channel moves."""
    moving = [f for f in findings if f.code in _RESTLESS and len(f.spans)]
    options = _quiet_part(recording, moving) if moving else None
    if options is None:
        return list(findings)
    return [f.advise(f"analyze only a quiet part: {options}") if f in moving else f for f in findings]


def _quiet_part(recording: Recording, moving: Sequence[Finding]) -> str | None:
    """``--from`` and ``--to``; None where nothing worth it is left."""
    n = recording.n_samples
    beside = max(n // 100, 1)
    taken = merge_spans(np.concatenate([f.spans for f in moving]) + np.array([-beside, beside]))
    starts, stops = np.append(0, taken[:, 1]), np.append(taken[:, 0], n)
    k = int(np.argmax(stops - starts))
    if stops[k] - starts[k] < max(WORTH * n, values.MINIMUM):
        return None
    begun = sum(float(step["start_s"]) for step in recording.history if step.get("step") == "window")
    ends = (("--from", int(starts[k]), 0), ("--to", int(stops[k]), n))
    return " ".join(f"{option} {begun + at * recording.dt:.6g}" for option, at, end in ends if at != end)


def prepare(
    recording: Recording,
    findings: Sequence[Finding],
    *,
    accept: Collection[str] = (),
    by_averages: bool = True,
) -> tuple[Recording, tuple[Finding, ...]]:
    """The recording as it may be analysed: refused, or with the samples that findings exclude left out.

    Parameters
    ----------
    findings : sequence of Finding
        What `check` said about this recording.
    accept : collection of str
        Codes of fatal findings to go on in spite of.
    by_averages : bool
        The analysis needs averages over unbroken stretches. If not, samples missing at random do no harm.

    Returns
    -------
    recording : Recording
        Excluded samples read as missing; the history says why. Channels without any sample are left out.
    findings : tuple of Finding
        The same findings; the accepted ones say so.

    Raises
    ------
    InputError
        `accept` names something that is not a code.
    DataQualityError
        A fatal finding was not accepted, or no channel is left. Its `findings` are the ones to blame.
    """
    accept = {accept} if isinstance(accept, str) else set(accept)
    unknown = sorted(accept - set(CATALOGUE))
    if unknown:
        raise InputError(
            f"no finding named {', '.join(map(repr, unknown))}; there are: {', '.join(CATALOGUE)}"
        )
    if not by_averages:
        lost = ("missing", "broken_up")
        findings = [f.harmless() if f.code in lost and values.scattered(f.spans) else f for f in findings]
    fatal = [f for f in findings if f.severity is Severity.FATAL and f.code not in accept]
    if fatal:
        raise DataQualityError(_refusal(recording, fatal), tuple(fatal))
    settled = tuple(f.accept() if f.severity is Severity.FATAL else f for f in findings)
    recording = _without_empty(recording, settled)
    for code, group in groupby((f for f in settled if f.excludes), key=lambda f: f.code):
        spans: dict[str, list[NDArray[np.int64]]] = {}
        for f in group:
            for name in _channels(recording, f):
                spans.setdefault(name, []).append(f.spans)
        if spans:
            recording = recording.excluding({n: np.concatenate(parts) for n, parts in spans.items()}, code)
    return recording, settled


def _channels(recording: Recording, finding: Finding) -> list[str]:
    if finding.channel is None:
        return [c.name for c in recording.channels if c.kind.noise_bearing]
    return [finding.channel] if finding.channel in recording.names else []


def _without_empty(recording: Recording, findings: Sequence[Finding]) -> Recording:
    empty = [f for f in findings if f.code == "no_samples"]
    gone = {name for f in empty for name in _channels(recording, f)}
    if not gone:
        return recording
    left = [name for name in recording.names if name not in gone]
    if not any(recording[name].kind.noise_bearing for name in left):
        raise DataQualityError("no channel has any samples: there is nothing to analyze", tuple(empty))
    step = {"step": "select", "reason": "no_samples", "left_out": sorted(gone)}
    selected = recording.select(*left)
    return replace(selected, history=(*selected.history, step))


def _refusal(recording: Recording, fatal: Sequence[Finding]) -> str:
    name = f" {recording.source!r}" if recording.source else ""
    lines = [f"the recording{name} is not fit for analysis:"]
    for f in fatal:
        places = ", ".join(f"{a / recording.rate:.6g} s (sample {a})" for a, _ in f.places)
        lines.append(
            f"  {f.code}{'' if f.channel is None else f' [{f.channel}]'}: {f.message} (count {f.count})"
        )
        lines += [f"    at {places}"] if places else []
        lines += [
            f"    what to do: {f.advice}",
            f"    to continue despite it: --accept {f.code}; risk: {f.risk}",
        ]
    return "\n".join(lines)
