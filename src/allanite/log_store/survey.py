# SPDX-License-Identifier: BSD-3-Clause
"""What one pass over the batches of a run finds: where its samples are, where its gaps, and the rate of its clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from allanite.columns import Spliced
from allanite.log_store.header import Header
from allanite.log_store.rows import RowColumn, Rows
from allanite.recording import Recording

__all__ = ["Piece", "Survey"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """Some rows of a run, looked through.

    Attributes
    ----------
    rows : Rows
    begins, counts : ndarray of int64, shape (n_stretches,)
        First number and length of each stretch of samples without a gap.
    clocks : ndarray of int64, shape (2, 3)
        Counter, monotonic clock and UTC [ns] at the ends of the first and of the last batch.
    """

    rows: Rows
    begins: NDArray[np.int64]
    counts: NDArray[np.int64]
    clocks: NDArray[np.int64]

    @classmethod
    def of(cls, rows: Rows, counter: NDArray[np.int64], clocks: NDArray[np.int64]) -> Self:
        """Rows whose samples have these numbers."""
        at = np.concatenate(([0], np.flatnonzero(np.diff(counter) != 1) + 1))
        return cls(rows=rows, begins=counter[at], counts=np.diff(np.append(at, counter.size)), clocks=clocks)


@dataclass(frozen=True, slots=True, kw_only=True)
class Survey:
    """What one pass over all batches of a run, or of a part of it, has found.

    Attributes
    ----------
    header : Header
    rows : tuple of Rows
        Where the samples are.
    begins, counts : ndarray of int64, shape (n_stretches,)
        First number and length of each stretch of samples without a gap.
    clocks : ndarray of int64, shape (n, 3)
        Counter, monotonic clock and UTC [ns] at some samples throughout the run.
    faults : dict of str to str
        Segments that do not verify to their end, and why.
    torn : bool
        The last batch of the run is not whole.
    """

    header: Header
    rows: tuple[Rows, ...] = field(repr=False)
    begins: NDArray[np.int64] = field(repr=False)
    counts: NDArray[np.int64] = field(repr=False)
    clocks: NDArray[np.int64] = field(repr=False)
    faults: Mapping[str, str]
    torn: bool

    @classmethod
    def of(cls, header: Header, pieces: Sequence[Piece], faults: Mapping[str, str], *, torn: bool) -> Self:
        """One piece after another; stretches that go on from one into the next are made one."""
        begins = np.concatenate([p.begins for p in pieces])
        ends = begins + np.concatenate([p.counts for p in pieces])
        new = np.concatenate(([True], begins[1:] != ends[:-1]))
        return cls(
            header=header,
            rows=tuple(p.rows for p in pieces),
            begins=begins[new],
            counts=ends[np.append(new[1:], True)] - begins[new],
            clocks=np.concatenate([p.clocks for p in pieces]),
            faults=faults,
            torn=torn,
        )

    @property
    def n_samples(self) -> int:
        """Samples that are there."""
        return int(self.counts.sum())

    @property
    def rate(self) -> tuple[float, float] | None:
        """Samples per second of the host's monotonic clock, with its standard uncertainty; None from one batch [Hz]."""
        x, t = self.clocks[:, 0].astype(float), (self.clocks[:, 1] - self.clocks[0, 1]) * 1e-9
        u = t - t.mean()
        if not u.any():
            return None
        slope = float(u @ (x - x.mean()) / (u @ u))
        left = x - x.mean() - slope * u
        freedom = max(len(x) - 2, 1)
        # The stamps of a host are late by a batch at times: from two of them nothing can be said below a sample.
        spread = max(float(left @ left) / freedom, 1.0 if len(x) < 3 else 0.0)
        return slope, float(np.sqrt(spread / (u @ u)))

    @property
    def start(self) -> int:
        """UTC of the first sample [ns since 1970]."""
        counter, _, utc = (int(value) for value in self.clocks[0])
        return utc - round((counter - int(self.begins[0])) / self.header.rate * 1e9)

    def recording(self, name: str, status: str) -> Recording:
        """The samples on an even grid; see `Run.recording`."""
        header = self.header
        source = np.concatenate(([0], np.cumsum(self.counts)))
        grid = self.begins - self.begins[0]
        length = int(grid[-1] + self.counts[-1])
        step = {
            "step": "record",
            "run": name,
            "status": status,
            "instrument": dict(header.instrument),
            "settings": dict(header.settings),
            "aperture": header.aperture,
            "scale_date": header.scale_date,
            "software": header.software,
        }
        measured = self.rate
        notes = {
            "samples": self.n_samples,
            "gaps": len(self.begins) - 1,
            "damaged": dict(self.faults),
            "rate_measured": measured and measured[0],
            "rate_uncertainty": measured and measured[1],
        }
        return Recording(
            channels=header.channels,
            columns=tuple(Spliced(RowColumn(self.rows, n), source, grid, length) for n in header.names),
            rate=header.rate,
            start=self.start,
            source=name,
            history=(step,),
            notes={"source": notes},
        )
