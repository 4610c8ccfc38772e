# SPDX-License-Identifier: BSD-3-Clause
"""The Allan curve of a record that is still being made: the decimated engine, fed as samples come."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, InputError
from allanite.noise.allan.curve import AllanCurve, curve_of_sums
from allanite.noise.allan.online import OnlineSums, decimable
from allanite.noise.allan.statistics import STATISTICS
from allanite.plain_files.counted import plural
from allanite.recording.records import Channel

__all__ = ["LiveCurve"]

Array = NDArray[np.float64]

#: Octaves of lags, the longest 2^29 samples: half a year at 32 Hz. What is not yet reached costs some hundred bytes.
_OCTAVES = 30
_FEWEST = 3


class LiveCurve:
    """OADEV on the octave grid of samples as they come, in fixed memory but for the list of gaps.

    The curve of `allan_curve(recording, taus="octave", engine="decimated")` of the same samples, to rounding: the level
    that is removed first is another one.

    Parameters
    ----------
    channels : sequence of Channel
        Those that carry sensor noise are followed.
    rate : float [Hz]
    confidence : float
        Level of the intervals.

    Raises
    ------
    InputError
        No channel carries sensor noise, or one holds angles or velocities.
    """

    def __init__(self, channels: Sequence[Channel], rate: float, *, confidence: float = 0.6827) -> None:
        self._places = [i for i, c in enumerate(channels) if c.kind.noise_bearing]
        self.channels = tuple(channels[i] for i in self._places)
        if not self.channels or any(c.kind.integrated for c in self.channels):
            raise InputError(
                "a live curve follows rates, accelerations and voltages; the recording has none, or an angle"
            )
        self.rate, self.confidence = rate, confidence
        self._lags = decimable(np.int64(1) << np.arange(_OCTAVES, dtype=np.int64))
        self._sums: list[OnlineSums] = []
        self._before = 0  # missing samples before the first that is there

    @property
    def n_samples(self) -> int:
        """Samples so far, missing ones included."""
        return self._sums[0].n_samples if self._sums else self._before

    def feed(self, values: Array) -> None:
        """The next samples, shape (n, n_channels of the run), NaN where missing."""
        if not self._sums:
            there = np.flatnonzero(np.isfinite(values[:, self._places]).any(axis=1))
            if not len(there):
                self._before += len(values)
                return
            self._begin(values[there[0] :])
        for sums, place in zip(self._sums, self._places, strict=True):
            sums.feed(values[:, place])

    def skip(self, samples: int) -> None:
        """So many samples are missing."""
        for start in range(0, samples, 1 << 16):
            self.feed(np.full((min(1 << 16, samples - start), 1 + max(self._places)), np.nan))

    def _begin(self, values: Array) -> None:
        levels = [values[np.isfinite(values[:, i]), i] for i in self._places]
        self._sums = [OnlineSums(self._lags, float(x[0]) if len(x) else 0.0) for x in levels]
        if self._before:
            for sums in self._sums:
                sums.feed(np.full(self._before, np.nan))

    def curve(self) -> AllanCurve:
        """The curve so far.

        Raises
        ------
        DataQualityError
            Fewer than three samples.
        """
        n = self.n_samples
        if n < _FEWEST or not self._sums:
            raise DataQualityError(
                f"{plural(n, 'sample')} so far; an Allan variance needs at least {_FEWEST}"
            )
        reached = self._lags <= n // 2
        read = [sums.read() for sums in self._sums]
        return curve_of_sums(
            STATISTICS["oadev"],
            self._lags[reached],
            [(variance[reached], count[reached]) for variance, count, _ in read],
            [missing for *_, missing in read],
            channels=self.channels,
            dt=1 / self.rate,
            n_samples=n,
            confidence=self.confidence,
            engine="decimated",
        )
