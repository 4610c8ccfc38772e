# SPDX-License-Identifier: BSD-3-Clause
"""What one pass over the batches of a run finds: where its samples are, where its gaps, and the rate of its clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from allanite.files.store.batch import count_flags
from allanite.files.store.header import Header
from allanite.files.store.rows import RowColumn, RunRows
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.limits import MISSING, MISSING_EACH, refuse_more
from allanite.recording.records import Recording
from allanite.recording.sample_columns import Spliced

__all__ = ["Piece", "RunSurvey", "clock_rate"]

#: Degrees of freedom from which the t distribution has a standard deviation.
_FREEDOM = 3
#: Stamps that lie on a line so closely were computed, and rounded to the nanosecond [s].
_COMPUTED = 2e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """Some rows of a run, looked through.

    Attributes
    ----------
    rows : RunRows
    begins, counts : ndarray of int64, shape (n_stretches,)
        First number and length of each stretch of samples without a gap.
    clocks : ndarray of int64, shape (n, 3)
        Counter, monotonic clock and UTC [ns] at the ends of some batches, the first and the last among them.
    flagged : dict of str to int
        Samples with each flag; see `count_flags`.
    """

    rows: RunRows
    begins: NDArray[np.int64]
    counts: NDArray[np.int64]
    clocks: NDArray[np.int64]
    flagged: Mapping[str, int]

    @classmethod
    def of(
        cls,
        rows: RunRows,
        counter: NDArray[np.int64],
        flags: NDArray[np.uint8],
        clocks: NDArray[np.int64],
    ) -> Self:
        """Rows whose samples have these numbers and flags."""
        at = np.concatenate(([0], np.flatnonzero(np.diff(counter) != 1) + 1))
        return cls(
            rows=rows,
            begins=counter[at],
            counts=np.diff(np.append(at, counter.size)),
            clocks=clocks,
            flagged=count_flags(flags),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSurvey:
    """What one pass over all batches of a run, or of a part of it, has found.

    Attributes
    ----------
    header : Header
    rows : tuple of RunRows
        Where the samples are.
    begins, counts : ndarray of int64, shape (n_stretches,)
        First number and length of each stretch of samples without a gap.
    end : int
        Number behind the last sample that is there, or that is noted as missing behind it.
    clocks : ndarray of int64, shape (n, 3)
        Counter, monotonic clock and UTC [ns] at some samples throughout the run.
    flagged : dict of str to int
        Samples with each flag; see `count_flags`.
    faults : dict of str to str
        Segments that do not verify to their end, and why.
    torn : bool
        The last batch of the run is not whole.
    """

    header: Header
    rows: tuple[RunRows, ...] = field(repr=False)
    begins: NDArray[np.int64] = field(repr=False)
    counts: NDArray[np.int64] = field(repr=False)
    end: int
    clocks: NDArray[np.int64] = field(repr=False)
    flagged: Mapping[str, int]
    faults: Mapping[str, str]
    torn: bool

    @classmethod
    def of(
        cls, header: Header, pieces: Sequence[Piece], faults: Mapping[str, str], *, torn: bool, end: int = 0
    ) -> Self:
        """One piece after another; stretches that go on from one into the next are made one.

        `end`: number behind the last sample that is noted as missing.
        """
        begins = np.concatenate([p.begins for p in pieces])
        ends = begins + np.concatenate([p.counts for p in pieces])
        new = np.concatenate(([True], begins[1:] != ends[:-1]))
        return cls(
            header=header,
            rows=tuple(p.rows for p in pieces),
            begins=begins[new],
            counts=ends[np.append(new[1:], True)] - begins[new],
            end=max(end, int(ends[-1])),
            clocks=np.concatenate([p.clocks for p in pieces]),
            flagged={name: sum(p.flagged[name] for p in pieces) for name in pieces[0].flagged},
            faults=faults,
            torn=torn,
        )

    @property
    def n_samples(self) -> int:
        """Samples that are there."""
        return int(self.counts.sum())

    @property
    def rate(self) -> tuple[float, float] | None:
        """Samples per second of the host's monotonic clock, with its standard uncertainty; see `clock_rate` [Hz]."""
        return clock_rate(self.clocks)

    @property
    def start(self) -> int:
        """UTC of the first sample [ns since 1970]."""
        counter, _, utc = (int(value) for value in self.clocks[0])
        return utc - round((counter - int(self.begins[0])) / self.header.rate * 1e9)

    def recording(self, name: str, status: str) -> Recording:
        """The samples on an even grid; see `Run.recording`.

        Raises
        ------
        LimitError
            Far more are missing than are there.
        """
        header = self.header
        source = np.concatenate(([0], np.cumsum(self.counts)))
        grid = self.begins - self.begins[0]
        length = self.end - int(self.begins[0])
        there = self.n_samples
        refuse_more(
            length - there,
            MISSING + MISSING_EACH * there,
            f"missing samples for {there} stored ones",
            name,
            "Its counter jumps: split it into one folder per stretch of segments",
        )
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
            "samples": there,
            "gaps": len(self.begins) - 1 + int(self.end > self.begins[-1] + self.counts[-1]),
            "flagged": dict(self.flagged),
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


def clock_rate(clocks: NDArray[np.int64]) -> tuple[float, float] | None:
    """Samples per second of the host's monotonic clock, with its standard uncertainty [Hz].

    The uncertainty is that of the scatter of the stamps about a straight line, s, from n - 2 degrees of freedom: the
    standard deviation of the t distribution that the slope then has, s √((n - 2)/(n - 4)). What the clock of the host
    itself is wrong by, some tens of ppm where nothing disciplines it, is not in it.

    Parameters
    ----------
    clocks : ndarray of int64, shape (n, 2) or more
        Counter and monotonic clock [ns] at some samples throughout the run.

    Returns
    -------
    tuple of float or None
        None from fewer than five stamps, and from stamps that lie on a line to the nanosecond: these were computed,
        as those of a simulated instrument are, and measure nothing.

    References
    ----------
    JCGM 101:2008, 6.4.9.2 and 6.4.9.4 (t distribution, and its standard deviation).
    """
    x, t = (clocks[:, 0] - clocks[0, 0]).astype(float), (clocks[:, 1] - clocks[0, 1]) * 1e-9
    u = t - t.mean()
    freedom = len(x) - 2
    if freedom < _FREEDOM or not u.any():
        return None
    slope = float(u @ (x - x.mean()) / (u @ u))
    left = x - x.mean() - slope * u
    if np.abs(left).max() <= slope * _COMPUTED:
        return None
    return slope, float(np.sqrt(left @ left / (freedom - 2) / (u @ u)))
