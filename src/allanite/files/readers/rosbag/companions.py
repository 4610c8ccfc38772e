# SPDX-License-Identifier: BSD-3-Clause
"""Temperature and magnetic field that were recorded beside an IMU, as channels of the same log.

They have stamps and a rate of their own. Each sample is put to the sample of the IMU that is nearest in time, and only
there: in between nothing was measured. What does not fit (another span, a higher rate, a clock of its own) is left
out, and said.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.headings import canonical_group
from allanite.files.readers.rosbag.decoding import Decoder
from allanite.files.readers.rosbag.storage import Connection, Storage
from allanite.files.readers.rosbag.types import (
    MAGNETIC_FIELD,
    TEMPERATURE,
    ImuPlace,
    MessageLayout,
    layout_of,
    typestore_of,
)
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

__all__ = ["Companion", "CompanionChannel", "beside", "companions_of"]

_NEAR = 0.75  # of a sample interval of the IMU: further away no sample of it belongs to a companion
_MOST_AWAY = 0.1  # share of the companion's samples in the span of the IMU that may lie so far away
_LEAST_SPAN = 0.5  # share of the span of the IMU that a companion must cover

_Ints = NDArray[np.int64]
_Finished = tuple[_Ints, _Ints, list[NDArray[np.float64]]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Companion:
    """A topic of temperatures or of the magnetic field."""

    connection: Connection
    store: Typestore
    layout: MessageLayout

    @property
    def topic(self) -> str:
        return self.connection.topic

    def decoder(self) -> Decoder:
        """Of its messages."""
        return Decoder(
            connection=self.connection, store=self.store, layout=self.layout, place=ImuPlace((), True)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class CompanionChannel:
    """A channel of a companion.

    Attributes
    ----------
    name, unit : str
    rows : str
        Key of the rows of the IMU to which its samples belong, in `arrays`.
    arrays : dict
    """

    name: str
    unit: str
    rows: str
    arrays: dict[str, NDArray[Any]]


def companions_of(
    storages: Sequence[Storage], topic: str, channels: Sequence[str] | None
) -> tuple[dict[tuple[int, int], Companion], list[str]]:
    """Companions of an IMU topic: one of each kind, the one in the same namespace where there are several.

    Where several are equally near, none is taken, and the words say so.

    Parameters
    ----------
    channels : sequence of str or None
        What the caller wants to have; companions nobody asks for are not decoded.
    """
    companions: dict[tuple[int, int], Companion] = {}
    remarks: list[str] = []
    for layout in (TEMPERATURE, MAGNETIC_FIELD):
        if channels is not None and not any(_means(word, layout) for word in channels):
            continue
        fitting = [
            Companion(connection=c, store=store, layout=layout)
            for s in storages
            for c in s.connections
            if layout_of(c.kind) is layout and c.count and (store := typestore_of(c)) is not None
        ]
        topics = sorted({c.topic for c in fitting}, key=lambda t: (-_shared(t, topic), t))
        if not topics:
            continue
        if len(topics) > 1 and _shared(topics[0], topic) == _shared(topics[1], topic):
            remarks.append(
                f"{', '.join(layout.names)} could be any of {', '.join(topics)}: none is added to {topic}"
            )
            continue
        places = {id(c): (i, c.key) for i, s in enumerate(storages) for c in s.connections}
        companions |= {places[id(c.connection)]: c for c in fitting if c.topic == topics[0]}
    return companions, remarks


def _means(word: str, layout: MessageLayout) -> bool:
    group = canonical_group(word)
    return word.lower() in layout.names or (group != "" and group == layout.names[0])


def _shared(one: str, other: str) -> int:
    """Levels of the names that two topics have in common."""
    levels = 0
    for a, b in zip(one.strip("/").split("/")[:-1], other.strip("/").split("/")[:-1], strict=False):
        if a != b:
            break
        levels += 1
    return levels


def beside(
    time: _Ints, samples_of_companions: Sequence[tuple[Companion, _Finished]], *, zero: bool
) -> tuple[list[CompanionChannel], list[str]]:
    """Channels of companions, each sample at its row of the IMU; and what is to be said.

    Parameters
    ----------
    time : ndarray of int64, shape (n_samples,) [ns]
        Of the IMU.
    zero : bool
        `time` is that of reception.
    """
    placed: list[CompanionChannel] = []
    remarks: list[str] = []
    for companion, (stamps, received, numbers) in samples_of_companions:
        names = companion.layout.names
        if zero or (len(stamps) and not stamps[:1000].any()):
            stamps = received
        rows, kept, why = _rows(time, stamps)
        if why:
            remarks.append(f"{companion.topic} ({companion.connection.kind}) is not added: {why}")
            continue
        away = len(stamps) - len(kept)
        more = f"; {plural(away, 'sample')} outside, or sharing an IMU sample, left out" if away else ""
        remarks.append(
            f"beside: {', '.join(names)} from {companion.topic}, each sample at the nearest IMU sample, "
            f"none between{more}"
        )
        key = f"rows {names[0]}"
        for name, unit, values in zip(names, companion.layout.units, numbers, strict=True):
            arrays = {name: np.ascontiguousarray(values[kept]), key: rows}
            placed.append(CompanionChannel(name=name, unit=unit, rows=key, arrays=arrays))
    return placed, remarks


_NONE: Final = np.zeros(0, dtype=np.int64)


def _rows(time: _Ints, stamps: _Ints) -> tuple[_Ints, _Ints, str]:
    """Rows of the IMU, the samples that belong to them, and why a companion does not fit."""
    if len(time) < 2 or len(stamps) == 0:
        return _NONE, _NONE, "too few samples"
    if (np.diff(time) < 0).any():
        return _NONE, _NONE, "the stamps of the IMU are not in order"
    if (np.diff(stamps) < 0).any():
        return _NONE, _NONE, "its stamps are not in order"
    span = int(time[-1] - time[0])
    within = np.flatnonzero((stamps >= time[0]) & (stamps <= time[-1]))
    near = _NEAR * span / (len(time) - 1)
    covered = int(stamps[within[-1]] - stamps[within[0]]) if len(within) > 1 else 0
    step = covered / (len(within) - 1) if len(within) > 1 else 0.0
    if covered + step < _LEAST_SPAN * span:
        return _NONE, _NONE, f"it covers {(covered + step) / span:.0%} of the time of the IMU"
    after = np.clip(np.searchsorted(time, stamps), 1, len(time) - 1)
    row = np.where(stamps - time[after - 1] <= time[after] - stamps, after - 1, after)
    distance = np.abs(time[row] - stamps)
    fitting = np.flatnonzero(distance <= near)
    lost = len(within) - int(np.isin(within, fitting, assume_unique=True).sum())
    if lost > _MOST_AWAY * len(within):
        reason = "has no sample of the IMU near it" if lost == 1 else "have no sample of the IMU near them"
        return _NONE, _NONE, f"{lost} of {len(within)} samples {reason}"
    order = fitting[np.lexsort((distance[fitting], row[fitting]))]
    first = np.concatenate(([True], np.diff(row[order]) > 0))
    kept = order[first]
    if len(kept) < (1 - _MOST_AWAY) * len(fitting):
        return _NONE, _NONE, "it has more samples than the IMU"
    return row[kept].astype(np.int64), kept.astype(np.int64), ""
