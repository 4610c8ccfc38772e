# SPDX-License-Identifier: BSD-3-Clause
"""Repairs that leave stretches out: what a detector of `allanite.recording.health` found becomes a gap, whatever its
share.

The analysis leaves most of them out by itself where they are few. By name they go wherever the recording goes, into a
converted file too, and a finding that is fatal because of their number is answered.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, InputError
from allanite.recording.cleaning.step import masked, surveys
from allanite.recording.health import disturbance, values
from allanite.recording.health.examination import padding_of
from allanite.recording.health.finding import Finding
from allanite.recording.health.meaning import triads
from allanite.recording.health.motion import LEAST, LENGTH, NOISE, TURNED
from allanite.recording.health.survey import ChannelSurvey
from allanite.recording.health.tails import law_of_survey, reach_of_tails
from allanite.recording.records import Kind, Recording
from allanite.recording.sample_columns import merge_spans

__all__ = [
    "THRESHOLD",
    "cut_motion",
    "drop_cut_blocks",
    "drop_padding",
    "drop_saturated",
    "drop_spikes",
]

Array = NDArray[np.float64]
Spans = NDArray[np.int64]

#: Standard deviations beyond which an isolated sample is dropped, where nothing else is said.
THRESHOLD = 8.0
#: Rounds of cutting: with the liveliest stretches gone the next ones stand out.
ROUNDS = 4
#: Margin on either side of a motion, in windows of the scale that shows it.
BESIDE = 1


def _found(recording: Recording, *looks: Callable[[ChannelSurvey], Iterator[Finding]]) -> dict[str, Spans]:
    """What detectors found in each channel."""
    out = {}
    for s in surveys(recording):
        spans = [f.spans for look in looks for f in look(s)]
        if spans:
            out[s.name] = merge_spans(np.concatenate(spans))
    return out


def drop_saturated(recording: Recording) -> Recording:
    """Codes at the end of an integer range, and overload words, as gaps."""
    spans = _found(recording, values.overload, values.saturated)
    return masked(recording, "drop_saturated", "the instrument was out of range", spans)


def drop_padding(recording: Recording) -> Recording:
    """Zeros and words for "no value" far from the level, and frozen readings, as gaps, in all channels."""
    padding: dict[str, list[Spans]] = {}
    trial = recording
    for _ in range(ROUNDS):  # what is left out may have hidden more
        more = padding_of(surveys(trial))
        if not more:
            break
        for f in more:
            padding.setdefault(str(f.channel), []).append(f.spans)
        spans = {name: merge_spans(np.concatenate(parts)) for name, parts in padding.items()}
        trial = recording.excluding(spans, "padding")
    merged = {name: merge_spans(np.concatenate(parts)) for name, parts in padding.items()}
    return masked(recording, "drop_padding", "padding: zeros, fill values or one repeated value", merged)


def drop_cut_blocks(recording: Recording) -> Recording:
    """What stands at half the level or half the noise before a gap, as gaps."""
    return masked(
        recording, "drop_cut_blocks", "a block cut short", _found(recording, disturbance.half_before_gap)
    )


def drop_spikes(recording: Recording, threshold: str = "") -> Recording:
    """Isolated samples further from the local median than a threshold, as gaps.

    Parameters
    ----------
    threshold : str
        In standard deviations of such distances; never less than noise of this length and of these tails reaches once
        in 1000 records.

    Raises
    ------
    InputError
        A threshold that is no number of at least 4: closer samples are noise, and dropping them makes N too small.
    DataQualityError
        So many large steps that they are no isolated impulses.
    """
    limit = _threshold(threshold)
    spans, least = {}, math.inf
    for s in surveys(recording):
        outliers = disturbance.impulses_of(s)
        if outliers.crowded > 0.1 * s.present:
            raise DataQualityError(
                f"channel {s.name!r}: large steps are too frequent for isolated impulses (see "
                "heavy_tails); dropping them would change the measured noise"
            )
        size = np.abs(outliers.deviation) / np.where(outliers.sigma > 0, outliers.sigma, np.inf)
        far = (size > limit) & (np.abs(outliers.deviation) > reach_of_tails(s, law_of_survey(s)))
        at = outliers.position[far]
        if len(at):
            least = min(least, float(size[far].min()))
            spans[s.name] = np.stack([at, at + 1], axis=1)
    facts = {"threshold": limit} | ({"smallest": least} if spans else {})
    why = f"more than {limit:g} standard deviations from the surrounding samples"
    return masked(recording, "drop_spikes", why, spans, **facts)


def _threshold(text: str) -> float:
    try:
        limit = float(text) if text else THRESHOLD
    except ValueError:
        limit = math.nan
    if not 4.0 <= limit < math.inf:
        raise InputError(
            f"drop_spikes takes a threshold of at least 4 standard deviations, not {text!r}: nearer samples are noise"
        )
    return limit


# -- motion -----------------------------------------------------------------------------------------------


def cut_motion(recording: Recording) -> Recording:
    """Stretches that move far more than the quiet ones, or in which gravity points elsewhere, as gaps in all channels.

    Raises
    ------
    DataQualityError
        Less than a tenth of the record is left: it is no record of a sensor at rest.
    """
    names = [c.name for c in recording.channels if c.kind.noise_bearing]
    out: Spans = _turned(recording)
    trial = recording.excluding(dict.fromkeys(names, out), "motion") if len(out) else recording
    for _ in range(ROUNDS):
        more = _lively(trial)
        if len(more) == 0:
            break
        out = merge_spans(np.concatenate([out, more]))
        trial = recording.excluding(dict.fromkeys(names, out), "motion")
    share = int(np.diff(out, axis=1).sum()) / max(recording.n_samples, 1)
    if share > 0.9:
        raise DataQualityError(
            f"cut_motion would leave {100 * (1 - share):.2g} % of the record: the sensor was rarely at "
            "rest; record it at rest, or choose a part (--from, --to)"
        )
    return masked(recording, "cut_motion", "the unit moved", dict.fromkeys(names, out))


def _lively(recording: Recording) -> Spans:
    """Windows that stand out in any channel, with those beside them."""
    windows = [np.zeros((0, 2), dtype=np.int64)]
    for s in surveys(recording):
        for u in disturbance.unrest(s):
            if u.excess < disturbance.SLIGHT:
                continue
            at = np.flatnonzero(u.out)
            spans = np.stack([at - BESIDE, at + 1 + BESIDE], axis=1) * u.scale.window
            windows.append(np.clip(spans, 0, s.n_samples).astype(np.int64))
    return merge_spans(np.concatenate(windows))


def _turned(recording: Recording) -> Spans:
    """Seconds in which gravity points over 2 deg away from where it points for most of the time."""
    seconds = [np.zeros((0, 2), dtype=np.int64)]
    accelerometers = [s for s in surveys(recording) if s.channel.kind is Kind.ACCELERATION]
    size = max(round(LENGTH * recording.rate), LEAST)
    rows = recording.n_samples // size
    for triad in triads(accelerometers):
        if rows < 2:
            continue
        means = np.stack([_block_means(recording, s.name, size, rows) for s in triad], axis=1)
        known = np.isfinite(means).all(axis=1) & (np.linalg.norm(means, axis=1) > 0)
        if known.sum() < 2:
            continue
        angle = _angles(means[known])
        noise = max(abs(s.channel.scale) * s.sigma for s in triad) / math.sqrt(size)
        bar = NOISE * noise / float(np.median(np.linalg.norm(means[known], axis=1)))
        at = np.flatnonzero(known)[angle > max(bar, TURNED)]
        spans = np.stack([at - BESIDE, at + 1 + BESIDE], axis=1) * size
        seconds.append(np.clip(spans, 0, recording.n_samples).astype(np.int64))
    return merge_spans(np.concatenate(seconds))


def _block_means(recording: Recording, name: str, size: int, rows: int) -> Array:
    step = max(1, (1 << 18) // size)
    means = [
        recording.scaled(name, a * size, min(a + step, rows) * size).reshape(-1, size).mean(axis=1)
        for a in range(0, rows, step)
    ]
    return np.concatenate(means)


def _angles(means: Array) -> Array:
    """Angle of each vector to the attitude in which the unit spends most of the time [rad]."""
    unit = means / np.linalg.norm(means, axis=1, keepdims=True)
    candidates = unit[:: -(-len(unit) // 256)]
    near = [np.count_nonzero(np.linalg.norm(unit - one, axis=1) < TURNED / 2) for one in candidates]
    chord = np.linalg.norm(unit - candidates[int(np.argmax(near))], axis=1)
    return np.asarray(2 * np.arcsin(np.minimum(0.5 * chord, 1.0)))
