# SPDX-License-Identifier: BSD-3-Clause
"""One run of a log whose clock restarts: between two power-ups lies a time that no stamp tells."""

from __future__ import annotations

from dataclasses import replace

from allanite.errors import InputError
from allanite.plain_files.counted import plural
from allanite.recording.cleaning.step import noted
from allanite.recording.records import Recording
from allanite.recording.sample_columns import Slice

__all__ = ["keep_run"]


def keep_run(recording: Recording, value: str) -> Recording:
    """One run between backward steps of the clock, by its number from 1, "first", "last" or "longest".

    Raises
    ------
    InputError
        No such run.
    """
    base = recording.notes.get("timebase")
    base = base if isinstance(base, dict) else {}
    restarts = base.get("restarts") or []
    edges = [0, *(int(place) for place, _ in restarts), recording.n_samples]
    k = _chosen(value or "longest", edges)
    if not restarts:
        return noted(recording, "keep_run", "the clock never restarts", {})
    a, b = edges[k], edges[k + 1]
    backward = int(base["backward"]) - len(restarts)
    kept = {**base, "backward": backward, "set_back": 0, "alone": None, "restarts": []}
    kept |= {} if backward > 0 else {"backward_rows": []}
    later = round(float(restarts[k - 1][1]) * 1e9) if k else 0
    out = replace(
        recording,
        columns=tuple(Slice(column, a, b) for column in recording.columns),
        start=None if recording.start is None else recording.start + later,
        notes={**recording.notes, "timebase": kept},
    )
    dropped = dict.fromkeys((c.name for c in recording.channels), recording.n_samples - (b - a))
    why = f"the clock restarts {plural(len(restarts), 'time')}; run {k + 1} of {len(edges) - 1} is kept"
    return noted(out, "keep_run", why, dropped)


def _chosen(value: str, edges: list[int]) -> int:
    """Which run is meant, from 0."""
    count = len(edges) - 1
    if value == "longest":
        return max(range(count), key=lambda k: edges[k + 1] - edges[k])
    named = {"first": 1, "last": count}.get(value, int(value) if value.isdecimal() else 0)
    if not 1 <= named <= count:
        raise InputError(f"keep_run={value}: first, last, longest, or the number of a run from 1 to {count}")
    return named - 1
