# SPDX-License-Identifier: BSD-3-Clause
"""Where faults begin and end in samples: windows show a fault, and hold its ends only in part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from allanite.experiments.redundancy.means import WindowMeans
from allanite.experiments.redundancy.results import SensorFault
from allanite.experiments.redundancy.verdict import FaultKind
from allanite.recording.records import Recording

__all__ = ["to_the_sample"]


def to_the_sample(fault: SensorFault, means: WindowMeans, recording: Recording) -> SensorFault:
    """The fault with the samples beside its windows that are part of it.

    A fault of the last window lasts to the end of the record, beyond what is no whole window. A stuck sensor repeats
    its value in parts of the windows before and after.
    """
    if fault.kind is FaultKind.STUCK:
        fault = _whole_run(fault, means, recording)
    if fault.stop >= len(means) * means.dt * (1 - 1e-12):
        fault = replace(fault, stop=recording.n_samples / recording.rate)
    return fault


def _whole_run(fault: SensorFault, means: WindowMeans, recording: Recording) -> SensorFault:
    """From the first sample of the repeated value to the last."""
    column = recording.columns[recording.index(fault.candidates[0])]
    start, stop = (round(time / means.dt) * means.size for time in (fault.start, fault.stop))
    value = column.read(start, start + 1)[0]
    before = column.read(max(start - means.size, 0), start)[::-1] != value
    after = column.read(stop, min(stop + means.size, len(column))) != value
    begin, end = start - _leading(before), stop + _leading(after)
    return replace(
        fault, start=begin / recording.rate, since=begin / recording.rate, stop=end / recording.rate
    )


def _leading(other: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> int:
    """How many come before the first that is True."""
    return int(np.argmax(other)) if other.any() else len(other)
