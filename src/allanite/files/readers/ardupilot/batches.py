# SPDX-License-Identifier: BSD-3-Clause
"""The batch sampler of ArduPilot: ISBH heads a batch, ISBD messages hold 32 samples of three axes each.

value = raw / mul; sample k of a batch was taken at SampleUS + k / smp_rate. Between batches there are gaps.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.files.readers.ardupilot.records import Format, Records
from allanite.files.readers.contents import FilePart
from allanite.files.readers.spool import GrowingColumn
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural

__all__ = ["SensorBatches", "batches_in"]

_IN_BLOCK: Final = 32  # samples of a ISBD message
_TYPES: Final = {0: ("acc", "Acc", "m/s²"), 1: ("gyro", "Gyr", "rad/s")}
_HEAD: Final = frozenset({"N", "type", "instance", "mul", "smp_cnt", "SampleUS", "smp_rate"})
_BODY: Final = frozenset({"N", "seqno", "x", "y", "z"})

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorBatches:
    """The batches of one sensor.

    Attributes
    ----------
    kind : int
        0 accelerometer, 1 gyro.
    instance : int
    rate : float [Hz]
        Within a batch, as its header says.
    """

    kind: int
    instance: int
    rate: float

    def samples(self, records: Records) -> tuple[Arrays, list[str], list[str]]:
        """Stamps [µs] and three axes, their units, and remarks."""
        forms = _forms(records)
        assert forms is not None  # noqa: S101 - `batches_in` has found them
        head, body = forms
        heads, places = _heads(records, head), records.places[head.kind]
        of_sensor = (heads["type"] == self.kind) & (heads["instance"] == self.instance)
        growing = [GrowingColumn(np.dtype(np.float64)) for _ in range(4)]
        lost, done = 0, 0
        for block in records.blocks(body.kind):
            at = records.places[body.kind][done : done + len(block)]
            done += len(block)
            before = np.searchsorted(places, at) - 1
            mine = before >= 0
            mine[mine] = of_sensor[before[mine]]
            named = mine.copy()
            named[mine] = heads["N"][before[mine]] == block["N"][mine]
            lost += int(np.count_nonzero(mine & ~named))
            _grow(growing, block[named], heads[before[named]])
        _, letter, unit = _TYPES[self.kind]
        finished = [g.finish_array() for g in growing]
        arrays = dict(zip(("timestamp_us", *(f"{letter}{a}" for a in "XYZ")), finished, strict=True))
        blocks = len(finished[0]) // _IN_BLOCK
        wanted = int(heads["smp_cnt"][of_sensor].astype(np.int64).sum()) // _IN_BLOCK
        batches = plural(int(of_sensor.sum()), "batch")
        remarks = [
            f"{batches} with gaps between them: averaging times longer than a batch carry little information"
        ]
        if blocks < wanted:
            remarks.append(
                f"{wanted - blocks} of {wanted} blocks of {_IN_BLOCK} samples are missing from the log"
            )
        if lost:
            remarks.append(f"{lost} blocks without a header are left out")
        return arrays, ["us", unit, unit, unit], remarks


def _grow(growing: list[GrowingColumn], blocks: NDArray[Any], heads: NDArray[Any]) -> None:
    if len(blocks) == 0:
        return
    number = blocks["seqno"].astype(np.float64)[:, None] * _IN_BLOCK + np.arange(_IN_BLOCK)
    stamps = (
        heads["SampleUS"].astype(np.float64)[:, None]
        + number * (1e6 / heads["smp_rate"].astype(float))[:, None]
    )
    growing[0].append(stamps.ravel())
    for grown, axis in zip(growing[1:], "xyz", strict=True):
        grown.append((blocks[axis] / heads["mul"].astype(np.float64)[:, None]).ravel())


def batches_in(records: Records) -> Iterator[tuple[FilePart, SensorBatches]]:
    """The sensors of which there are batches."""
    forms = _forms(records)
    if forms is None or not len(records.places[forms[0].kind]):
        return
    heads = _heads(records, forms[0])
    for kind, instance in sorted({(int(h["type"]), int(h["instance"])) for h in heads}):
        of_sensor = heads[(heads["type"] == kind) & (heads["instance"] == instance)]
        rates = of_sensor["smp_rate"].astype(np.float64)
        rates = rates[np.isfinite(rates) & (rates > 0)]
        if kind not in _TYPES or len(rates) == 0 or (of_sensor["mul"] == 0).any():
            continue
        word, letter, _ = _TYPES[kind]
        rows = int(of_sensor["smp_cnt"].astype(np.int64).sum())
        part = FilePart(
            name=f"batch.{word}[{instance}]",
            rows=rows,
            columns=tuple(f"{letter}{a}" for a in "XYZ"),
            rate=float(np.median(rates)),
            rank=1 - kind,  # the gyro first
            spare=True,
        )
        yield part, SensorBatches(kind=kind, instance=instance, rate=float(np.median(rates)))


def _heads(records: Records, head: Format) -> NDArray[Any]:
    return np.concatenate(list(records.blocks(head.kind)))


def _forms(records: Records) -> tuple[Format, Format] | None:
    forms = {form.name: form for form in records.formats.values()}
    head, body = forms.get("ISBH"), forms.get("ISBD")
    if head is None or body is None or not set(head.columns) >= _HEAD or not set(body.columns) >= _BODY:
        return None
    sound = set(head.numbers) >= _HEAD and all(body.letters[body.columns.index(a)] == "a" for a in "xyz")
    return (head, body) if sound else None
