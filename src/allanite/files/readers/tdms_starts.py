# SPDX-License-Identifier: BSD-3-Clause
"""The start times that a TDMS file states of a channel, each with the number of samples before it.

An acquisition that appends to a file sets ``wf_start_time`` again. npTDMS keeps the last one alone, as if all samples
followed each other from there.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["Start", "starts_of", "times_of"]

_LEAD: Final = 28
_METADATA, _NEW_LIST, _BIG = 1 << 1, 1 << 2, 1 << 6
_NO_DATA, _AS_BEFORE = 0xFFFFFFFF, 0
_DAQMX: Final = {0x1269: 20, 0x126A: 17}  # bytes of one scaler
_TEXT, _TIME = 0x20, 0x44
#: Bytes of a value, by its type.
_SIZES: Final = {
    1: 1, 2: 2, 3: 4, 4: 8, 5: 1, 6: 2, 7: 4, 8: 8, 9: 4, 10: 8, 11: 16, 0x19: 4, 0x1A: 8, 0x1B: 16, 0x21: 1,
    _TIME: 16, 0x8000C: 8, 0x10000D: 16,
}  # fmt: skip
_UNTIL_1970 = 2_082_844_800  # seconds from 1904
_LEAST_GAP = 0.1  # [s]; the clock of a computer that stamps the blocks of one acquisition wanders by less


#: A start time [ns since 1970], and the number of the sample that it belongs to.
Start = tuple[int, int]
#: What one object has in each chunk of a segment: samples; bytes of its own; bytes of DAQmx, which channels share.
_Index = tuple[int, int, int]


class _Metadata:
    """The metadata of one segment, read from end to end."""

    def __init__(self, data: bytes, order: str) -> None:
        self._data, self._order, self._at = data, order, 0

    def number(self, form: str) -> Any:
        size = struct.calcsize(form)
        (value,) = struct.unpack_from(self._order + form, self._data, self._at)
        self._at += size
        return value

    def text(self) -> str:
        size = self.number("I")
        self._at += size
        return self._data[self._at - size : self._at].decode("utf-8", "replace")

    def index(self, before: _Index | None) -> _Index | None:
        length = self.number("I")
        if length == _NO_DATA:
            return None
        if length == _AS_BEFORE:
            return before
        kind, _, count = self.number("I"), self.number("I"), self.number("Q")
        if length in _DAQMX:
            scalers = self.number("I")
            self._at += scalers * _DAQMX[length]
            widths = [self.number("I") for _ in range(self.number("I"))]
            return count, 0, count * sum(widths)
        return count, self.number("Q") if kind == _TEXT else count * _SIZES[kind], 0

    def start(self) -> int | None:
        """The start time among the properties of an object."""
        moment = None
        for _ in range(self.number("I")):
            name, kind = self.text(), self.number("I")
            if kind == _TEXT:
                self.text()
            elif kind == _TIME and name == "wf_start_time":
                parts = [self.number(form) for form in ("Qq" if self._order == "<" else "qQ")]
                fraction, seconds = parts if self._order == "<" else parts[::-1]
                moment = (seconds - _UNTIL_1970) * 10**9 + (fraction * 10**6 + 2**63 >> 64) * 1000
            else:
                self._at += _SIZES[kind]
        return moment


def starts_of(file: IO[bytes], size: int, channel: str) -> list[Start]:
    """The start times of a channel, "/'group'/'channel'", in their order."""
    starts: list[Start] = []
    known: dict[str, _Index | None] = {}
    listed: list[str] = []
    at, samples = 0, 0
    try:
        while at + _LEAD <= size:
            file.seek(at)
            lead = file.read(_LEAD)
            toc = int.from_bytes(lead[4:8], "little")
            order = ">" if toc & _BIG else "<"
            after, raw = struct.unpack(order + "QQ", lead[12:])
            end = min(at + _LEAD + after, size)
            if toc & _METADATA:
                content = _Metadata(file.read(raw), order)
                listed = [] if toc & _NEW_LIST else listed
                for _ in range(content.number("I")):
                    path = content.text()
                    known[path] = content.index(known.get(path))
                    listed += [] if path in listed else [path]
                    moment = content.start()
                    if path == channel and moment is not None:
                        starts.append((moment, samples))
            indices = [index for path in listed if (index := known.get(path))]
            chunk = sum(alone for _, alone, _ in indices) + max(
                (shared for _, _, shared in indices), default=0
            )
            mine = known.get(channel) if channel in listed else None
            if mine and chunk:
                samples += mine[0] * (end - at - _LEAD - raw) // chunk
            at = end
    except (struct.error, KeyError, OverflowError):
        return []  # a structure of another kind: npTDMS says what it is
    return starts


def times_of(starts: Sequence[Start], count: int, step: float) -> NDArray[np.datetime64] | None:
    """Time of every sample, each acquisition from its start; None if they follow each other without a pause."""
    runs = list(starts[:1])
    for moment, sample in starts[1:]:
        pause = (moment - runs[-1][0]) / 1e9 - (sample - runs[-1][1]) * step
        # A start before the end of the samples is one that was written again unchanged, or a clock that was set back.
        if sample < count and pause > max(_LEAST_GAP, 2.0 * step):
            runs.append((moment, sample))
    if len(runs) < 2 or runs[0][1]:
        return None
    samples = np.arange(count)
    run = np.searchsorted([sample for _, sample in runs], samples, side="right") - 1
    moments, firsts = np.array(runs).T
    steps = np.rint((samples - firsts[run]) * (step * 1e9)).astype(np.int64)
    times: NDArray[np.datetime64] = (moments[run] + steps).view("datetime64[ns]")
    return times
