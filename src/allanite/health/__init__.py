# SPDX-License-Identifier: BSD-3-Clause
"""What is wrong with a recording: findings with a severity, a place and a count; never a silent repair.

`check` looks, `prepare` acts: it refuses what is fatal and was not accepted, and leaves out the samples that a
finding excludes. Left-out samples become gaps; each exclusion is a finding and a step of the history.

A channel is read once, block by block (`survey`); the detectors are small functions of what that pass counted:

=============== ==========================================================================
`values`        missing samples, overload words, saturation, clipping, nonsense
`resolution`    the step of the values against the noise
`repeats`       frozen readings, zeros, interleaved sensors, twin channels
`held`          samples that repeat because the sensor is slower than the log
`tails`         contaminated noise
`disturbance`   impulses; stretches that move more, or less, than the rest
`constancy`     noise that is larger in some parts of the record
`raw_counts`    whole numbers without a unit, and the scale factor that may fit
`motion`        a unit that was turned, by the direction of gravity
`meaning`       units, gravity, removed bias, aperture
`log`           time stamps and text, from the readers' notes
`run`           what a recorder noted: why samples are missing, which are in doubt, the meter's zero, the scale factor
=============== ==========================================================================

`CATALOGUE` says of each code what it means and what accepting it risks. Lines in the spectrum and the sensor's
low-pass filter are found by `allanite.spectrum`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from allanite.errors import DataQualityError, InputError
from allanite.health import (
    constancy,
    disturbance,
    held,
    log,
    meaning,
    motion,
    raw_counts,
    repeats,
    resolution,
    run,
    tails,
    values,
)
from allanite.health.catalogue import CATALOGUE, Entry
from allanite.health.finding import Finding, Severity
from allanite.health.survey import Survey, survey
from allanite.recording import Recording, checked_recording

__all__ = [
    "CATALOGUE",
    "CHANNEL_DETECTORS",
    "LOG_DETECTORS",
    "PRESENCE_DETECTORS",
    "RECORD_DETECTORS",
    "STRETCH_DETECTORS",
    "Entry",
    "Finding",
    "Severity",
    "check",
    "prepare",
]

Progress = Callable[[float], None]

#: Functions of one channel's survey: what there is of samples.
PRESENCE_DETECTORS: tuple[Callable[[Survey], Iterator[Finding]], ...] = (
    values.no_samples,
    values.too_short,
    values.missing,
    values.overload,
    meaning.unit,
)
#: The same, for channels with enough samples: stretches that are no samples and are left out.
STRETCH_DETECTORS: tuple[Callable[[Survey], Iterator[Finding]], ...] = (
    values.saturated,
    repeats.stuck,
    repeats.zero_filled,
    disturbance.half_before_gap,
)
#: The same, of what is left. A new detector is one line here and one entry in the catalogue.
CHANNEL_DETECTORS: tuple[Callable[[Survey], Iterator[Finding]], ...] = (
    values.clipping,
    values.implausible_exponents,
    resolution.no_noise_resolved,
    resolution.quantisation,
    resolution.quantisation_not_white,
    resolution.float_step,
    repeats.interleaved,
    disturbance.impulses,
    disturbance.rest,
    disturbance.amplitude_drop,
    constancy.noise_changes,
    meaning.unit_trap,
    meaning.known_step,
    meaning.aliasing,
)
#: Functions of all channels' surveys together.
RECORD_DETECTORS: tuple[Callable[[Sequence[Survey]], Iterator[Finding]], ...] = (
    repeats.duplicate_channels,
    meaning.gravity,
    raw_counts.raw_counts,
    motion.motion,
    meaning.bias_removed,
)
#: Functions of the recording's notes.
LOG_DETECTORS: tuple[Callable[[Recording], Iterator[Finding]], ...] = (
    log.stamps,
    log.jitter,
    log.clock,
    log.drift,
    log.text,
    log.repairs,
    run.gap_reasons,
    run.doubtful,
    run.remarks,
    run.autozero,
    run.scale,
)


def check(recording: Recording, *, progress: Progress | None = None) -> tuple[Finding, ...]:
    """Everything that is wrong with a recording, the gravest first.

    One pass over each channel that can bear a noise model, in blocks: the recording may be larger than memory.

    Parameters
    ----------
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
        found = _found(recording, advance)
    order = list(CATALOGUE)
    return tuple(sorted(found, key=lambda f: (f.severity.rank, order.index(f.code))))


def _found(recording: Recording, advance: Callable[[int], None]) -> list[Finding]:
    surveys = []
    for channel in recording.channels:
        if channel.kind.noise_bearing:
            surveys.append(survey(recording, channel.name, advance))
        else:
            advance(recording.n_samples)
    found = [f for look in LOG_DETECTORS for f in look(recording)]
    found += log.words(recording, surveys)
    own = [f for s in surveys for look in PRESENCE_DETECTORS for f in look(s)]
    enough = [s for s in surveys if s.present >= values.MINIMUM]
    renewed = held.holds(enough)
    own += held.held_samples(renewed)
    enough = [held.without_short_scales(s, renewed) for s in enough]
    for i, s in enumerate(enough):
        stretches = [f for look in STRETCH_DETECTORS for f in look(s)]
        enough[i] = s.without(np.concatenate([np.zeros((0, 2), np.int64), *(f.spans for f in stretches)]))
        own += stretches
        # values that repeat come in clusters: their law is that of the sensor's values, each taken once
        law = tails.Tails(law=tails.Law.UNKNOWN) if s.name in renewed else tails.law_of_survey(enough[i])
        own += tails.contaminated(s, law)
        enough[i] = tails.without_short_scales(enough[i], law)
        mixed = law.law is tails.Law.CONTAMINATED  # spikes and heavy tails are other words for it
        own += [
            f
            for look in CHANNEL_DETECTORS
            if look is not disturbance.impulses or not mixed
            for f in look(enough[i])
        ]
    found += _joined(own, len(surveys))
    looks = RECORD_DETECTORS
    if any(
        step.get("step") == "simulate" for step in recording.history
    ):  # a simulated sensor never had a bias
        looks = tuple(look for look in looks if look is not meaning.bias_removed)
    return found + [f for look in looks for f in look(enough)]


def _joined(found: list[Finding], n_channels: int) -> list[Finding]:
    """What every channel says in the same words is said once, of the recording."""

    def words(f: Finding) -> tuple[object, ...]:
        return f.code, f.message, f.count, f.places, f.spans.tobytes()

    joined: list[Finding] = []
    for _, group in groupby(sorted(found, key=lambda f: tuple(map(str, words(f)))), key=words):
        same = list(group)
        joined += [replace(same[0], channel=None)] if len(same) == n_channels > 1 else same
    return joined


def prepare(
    recording: Recording, findings: Sequence[Finding], *, accept: Collection[str] = ()
) -> tuple[Recording, tuple[Finding, ...]]:
    """The recording as it may be analysed: refused, or with the samples that findings exclude left out.

    Parameters
    ----------
    findings : sequence of Finding
        What `check` said about this recording.
    accept : collection of str
        Codes of fatal findings to go on in spite of.

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
            f"no finding is called {', '.join(map(repr, unknown))}; there are: {', '.join(CATALOGUE)}"
        )
    fatal = [f for f in findings if f.severity is Severity.FATAL and f.code not in accept]
    if fatal:
        raise DataQualityError(_refusal(recording, fatal), tuple(fatal))
    said = tuple(f.accept() if f.severity is Severity.FATAL else f for f in findings)
    recording = _without_empty(recording, said)
    for code, group in groupby((f for f in said if f.excludes), key=lambda f: f.code):
        spans = {name: f.spans for f in group for name in _channels(recording, f)}
        if spans:
            recording = recording.excluding(spans, code)
    return recording, said


def _channels(recording: Recording, found: Finding) -> list[str]:
    if found.channel is None:
        return [c.name for c in recording.channels if c.kind.noise_bearing]
    return [found.channel] if found.channel in recording.names else []


def _without_empty(recording: Recording, findings: Sequence[Finding]) -> Recording:
    empty = [f for f in findings if f.code == "no_samples"]
    gone = {name for f in empty for name in _channels(recording, f)}
    if not gone:
        return recording
    left = [name for name in recording.names if name not in gone]
    if not any(recording[name].kind.noise_bearing for name in left):
        raise DataQualityError("no channel holds a sample: there is nothing to analyse", tuple(empty))
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
            f"    to go on in spite of it: --accept {f.code}; risk: {f.risk}",
        ]
    return "\n".join(lines)
