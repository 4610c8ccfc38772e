# SPDX-License-Identifier: BSD-3-Clause
"""Repairs of a recording, by name and never by default: each takes a Recording and gives one.

A repair answers a finding of `allanite.recording.health`, and the finding names it. What it takes out becomes a gap,
which no average crosses; rows that took no time of their own (a value logged twice) give up their place. Nothing is
bridged, filled or smoothed. Each repair is a step of the history, with counts and reason, and the finding `repaired` of
every later result.

========= ============================================================
`spans`   stretches that are left out: they become gaps
`rows`    rows that are no readings, or belong to two sensors
`renewed` values of a sensor with a clock of its own
`runs`    one of several power-ups in a log
`labels`  names that stand at the wrong column
========= ============================================================

What is no repair here, because the reader has the one way to it: the rate (``--rate``), the unit (``--unit``: degrees
called radians, mg called g), the part of a log (``--from``, ``--to``), columns and topics. And what cannot be
repaired is refused in words, not here: a clipped range, a bias removed on board, an aliased or unresolved noise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.recording.cleaning import labels, rows, runs, spans
from allanite.recording.records import Recording

__all__ = ["REPAIRS", "Repair", "clean"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Repair:
    """One repair.

    Attributes
    ----------
    does : str
        What becomes of the recording.
    answers : tuple of str
        Codes of the findings that name it.
    apply : callable
        (recording, value) -> recording; the value is the text after "=", "" for none.
    value : str
        What may stand after "=", and what holds without; "" where nothing may.
    """

    does: str
    answers: tuple[str, ...]
    apply: Callable[[Recording, str], Recording]
    value: str = ""


#: Name -> what it does. A new repair is one function and one line here.
REPAIRS: dict[str, Repair] = {
    "drop_saturated": Repair(
        does="codes at the end of the range and overload words become gaps",
        answers=("saturated", "overload"),
        apply=lambda recording, _: spans.drop_saturated(recording),
    ),
    "drop_padding": Repair(
        does="padding becomes a gap in all channels: zeros, fill values, rows of zeros, frozen readings",
        answers=("zero_filled", "fill_value", "stuck"),
        apply=lambda recording, _: spans.drop_padding(recording),
    ),
    "drop_cut_blocks": Repair(
        does="samples at half the level or half the noise just before a gap become gaps",
        answers=("half_before_gap",),
        apply=lambda recording, _: spans.drop_cut_blocks(recording),
    ),
    "drop_spikes": Repair(
        does="isolated samples beyond the threshold become gaps",
        answers=("spikes",),
        apply=spans.drop_spikes,
        value="threshold in standard deviations of the noise about the local median; 8 without",
    ),
    "cut_motion": Repair(
        does="stretches in which the unit moves, or is in another attitude, become gaps in all channels",
        answers=("disturbance", "not_at_rest", "motion"),
        apply=lambda recording, _: spans.cut_motion(recording),
    ),
    "drop_repeats": Repair(
        does="rows that repeat the previous one are removed; the rate becomes that of the sensor",
        answers=("held_samples",),
        apply=lambda recording, _: rows.drop_repeats(recording),
    ),
    "drop_duplicate_rows": Repair(
        does="rows written twice, with stamp and values, are removed; the rate stays",
        answers=("duplicate_stamps", "time_stamps"),
        apply=lambda recording, _: rows.drop_duplicate_rows(recording),
    ),
    "keep_run": Repair(
        does="one run of a log whose clock restarts is kept; the rest is removed",
        answers=(),
        apply=runs.keep_run,
        value="first, last, longest, or the number of the run from 1; longest without",
    ),
    "split_interleaved": Repair(
        does="sensors that share a column row by row become separate channels, each at its own rate",
        answers=("interleaved", "broken_up"),
        apply=lambda recording, _: rows.split_interleaved(recording),
    ),
    "swap": Repair(
        does="exchanges the names of two channels",
        answers=(),
        apply=labels.swap,
        value="the two names, as in swap=gyro_x,gyro_z",
    ),
}


def clean(recording: Recording, repairs: str | Sequence[str]) -> Recording:
    """The recording after these repairs, one after another.

    Parameters
    ----------
    recording : Recording
        Recording to repair.
    repairs : str or sequence of str
        Names of `REPAIRS`, with a value where one is taken: "drop_spikes=10", "swap=gyro_x,gyro_z".

    Returns
    -------
    Recording
        Recording with a step in its history for each repair: its samples and its reason.

    Raises
    ------
    InputError
        An unknown repair, a value that it does not take, or channels that it would need apart.
    DataQualityError
        The fault is another than the one the repair is for: what would be done is not what is meant.
    """
    for entry in [repairs] if isinstance(repairs, str) else repairs:
        name, _, value = str(entry).partition("=")
        if name not in REPAIRS:
            raise InputError(f"no repair named {name!r}; there are: {', '.join(REPAIRS)}")
        if value and not REPAIRS[name].value:
            raise InputError(f"the repair {name} takes no value, but {value!r} was given")
        recording = REPAIRS[name].apply(recording, value)
    return recording
