# SPDX-License-Identifier: BSD-3-Clause
"""The verified rows of a run as columns, read segment by segment: a run may be larger than memory."""

from __future__ import annotations

import threading
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError
from allanite.files.store.message import decoding
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.arrow_numbers import numbers_of
from allanite.plain_files.regular_file import open_regular
from allanite.recording.channel_names import for_shell
from allanite.recording.sample_columns import Bound, Calculated

__all__ = ["RowColumn", "RunRows", "SegmentRows"]

_KEPT = 2


class RunRows(Protocol):
    """Some consecutive rows of a run."""

    @property
    def count(self) -> int:
        """How many."""
        ...

    def read(self, name: str) -> NDArray[np.float64]:
        """One channel of them."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmentRows:
    """The rows of a segment.

    Attributes
    ----------
    path : Path
    size : int
        Bytes that were verified; what has come since is not looked at.
    crc : int
        CRC-32 of these bytes as they were verified.
    skip, count : int
        Rows that an earlier segment holds already, and those after them.
    """

    path: Path
    size: int
    crc: int
    skip: int
    count: int

    def read(self, name: str) -> NDArray[np.float64]:
        """One channel; see `RunRows`. The bytes that are decoded are those that are verified, at every reading.

        Raises
        ------
        FormatError
            The file has changed since it was verified, or cannot be read any more.
        """
        import pyarrow as pa

        try:
            with open_regular(self.path) as file:
                data = file.read(self.size)
        except OSError as error:
            raise FormatError(f"{self.path} can no longer be read: {error.strerror or error}") from None
        if zlib.crc32(data) != self.crc:
            raise FormatError(
                f"{self.path} has changed since it was verified: `allanite recover {for_shell(str(self.path.parent))}` "
                "shows what is lost of the run"
            )
        with decoding():
            whole = pa.ipc.open_stream(pa.py_buffer(data)).read_all().column(name)
            return numbers_of(whole)[self.skip :]


class RowColumn(Bound, Calculated):
    """One channel of a run, its samples one after another without the gaps."""

    __slots__ = ("_edges", "_kept", "_lock", "_name", "_rows")

    def __init__(self, rows: Sequence[RunRows], name: str) -> None:
        self._rows, self._name = rows, name
        self._edges = np.cumsum([0, *(r.count for r in rows)])
        self._lock = threading.Lock()
        self._kept: dict[int, NDArray[np.float64]] = {}

    def __len__(self) -> int:
        return int(self._edges[-1])

    def read(self, start: int, stop: int) -> NDArray[np.float64]:
        stop = min(stop, len(self))
        k = int(np.searchsorted(self._edges, start, side="right")) - 1
        parts = [np.zeros(0)]
        while start < stop:
            offset, end = int(self._edges[k]), min(stop, int(self._edges[k + 1]))
            parts.append(self._samples(k)[start - offset : end - offset])
            start, k = end, k + 1
        return np.concatenate(parts)

    def _samples(self, k: int) -> NDArray[np.float64]:
        with self._lock:
            if k not in self._kept:
                if len(self._kept) >= _KEPT:
                    self._kept.pop(next(iter(self._kept)))
                self._kept[k] = self._rows[k].read(self._name)
            return self._kept[k]
