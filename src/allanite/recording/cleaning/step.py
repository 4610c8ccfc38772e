# SPDX-License-Identifier: BSD-3-Clause
"""The step of the history that a repair leaves, and the channels that it looks at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.recording.health.survey import ChannelSurvey, survey
from allanite.recording.health.values import MINIMUM
from allanite.recording.records import Recording
from allanite.recording.sample_columns import Masked, merge_spans

__all__ = ["masked", "noted", "surveys"]

Spans = NDArray[np.int64]


def surveys(recording: Recording) -> list[ChannelSurvey]:
    """The facts of each channel that bears noise and holds enough samples to tell."""
    facts = [survey(recording, c.name) for c in recording.channels if c.kind.noise_bearing]
    return [s for s in facts if s.present >= MINIMUM]


def noted(recording: Recording, repair: str, why: str, samples: Mapping[str, int], **facts: Any) -> Recording:
    """The recording with a step of its history; `samples` are those taken, by channel."""
    step = {"step": "repair", "repair": repair, "why": why, "samples": dict(samples), **facts}
    return replace(recording, history=(*recording.history, step))


def masked(
    recording: Recording, repair: str, why: str, spans: Mapping[str, Spans], **facts: Any
) -> Recording:
    """The recording with these samples as gaps; only those that were there are counted."""
    columns, counts = list(recording.columns), {}
    for name, given in spans.items():
        merged = merge_spans(np.asarray(given, dtype=np.int64).reshape(-1, 2))
        if len(merged) == 0:
            continue
        i = recording.index(name)
        counts[name] = sum(int(np.isfinite(columns[i].read(int(a), int(b))).sum()) for a, b in merged)
        columns[i] = Masked(columns[i], merged)
    return noted(replace(recording, columns=tuple(columns)), repair, why, counts, **facts)
