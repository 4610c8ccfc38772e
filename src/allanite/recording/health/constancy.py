# SPDX-License-Identifier: BSD-3-Clause
"""The finding that the noise itself is not the same all the time: a coarse look at what the survey counted.

Windows of a scale are joined to sixteen parts of the record; the energy of a part is chi-square with as many degrees
of freedom as its windows have, read from the scatter of neighbours. Cube roots are nearly normal [1]. What stands out
as a disturbance has its own finding, and `allanite.stability.variation` asks the same at every lag, exactly.

References
----------
.. [1] E. Wilson, M. Hilferty, "The distribution of chi-square", PNAS 17 (1931) 684.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import normal_quantile
from allanite.recording.health.disturbance import SLIGHT, amplitude_drop, excess_of, freedom_of
from allanite.recording.health.finding import Finding, Severity, finding, percent, short
from allanite.recording.health.survey import ChannelSurvey
from allanite.recording.health.tallies import BlockDifferences

__all__ = ["noise_changes"]

Samples = NDArray[np.float64]

#: Parts into which a record is divided, at the most and at the least.
PARTS, FEWEST = 16, 8
#: False alarms per channel, and the margin for the error of the degrees of freedom.
ALARM, MARGIN = 1e-4, 1.3
#: Ratio of the largest deviation of a part to the smallest that is worth a word.
NOTICED = 1.1


@dataclass(frozen=True, slots=True)
class _PartEnergies:
    """Energies of the parts of a record at one scale, and how much more they scatter than chance allows."""

    scale: BlockDifferences
    size: int
    energy: Samples
    excess: float

    @property
    def ratio(self) -> float:
        """Largest deviation over the smallest."""
        return math.sqrt(float(np.nanmax(self.energy) / np.nanmin(self.energy)))


def noise_changes(survey: ChannelSurvey) -> Iterator[Finding]:
    """The noise is larger in some parts of the record than in others."""
    if survey.sigma == 0.0 or excess_of(survey) >= SLIGHT or survey.lattice.step > 2.0 * survey.sigma:
        return
    uneven = _uneven(survey.scales)
    drops = [f.spans for f in amplitude_drop(survey)]
    if uneven and drops:  # which say it, if the rest of the record is even
        uneven = _uneven([_without(scale, np.concatenate(drops)) for scale in survey.scales])
    if not uneven:
        return
    worst = max(uneven, key=lambda p: p.excess)
    most = int(np.nanargmax(worst.energy))
    lag, length = worst.scale.lag * survey.dt, worst.size * survey.dt
    larger = (
        f"{percent(worst.ratio - 1.0)} larger than" if worst.ratio < 2.0 else f"{short(worst.ratio)} times"
    )
    yield finding(
        "noise_changes",
        f"the noise varies during the record: over {lag:.3g} s the deviation of the noisiest part of "
        f"{length:.3g} s is {larger} that of the quietest",
        severity=Severity.WARNING,
        channel=survey.name,
        spans=[(most * worst.size, min((most + 1) * worst.size, survey.n_samples))],
        count=0,
    )


def _uneven(scales: Sequence[BlockDifferences]) -> list[_PartEnergies]:
    """The scales at which the parts of a record scatter by more than chance, and enough to be worth a word."""
    parts = [made for scale in scales if (made := _parts(scale, len(scales))) is not None]
    return [p for p in parts if p.excess > 1.0 and p.ratio > NOTICED]


def _without(scale: BlockDifferences, spans: NDArray[np.int64]) -> BlockDifferences:
    """A scale without the windows of these spans, and without half as much around each: their ends are mixtures.

    The spans are sorted, and as long as one another.
    """
    margin = (spans[:, 1] - spans[:, 0]) // 2
    starts = np.arange(len(scale.energy)) * scale.window
    begun = np.searchsorted(spans[:, 0] - margin, starts + scale.window, side="left")
    ended = np.searchsorted(spans[:, 1] + margin, starts, side="right")
    return replace(scale, energy=np.where(begun > ended, np.nan, scale.energy))


def _parts(scale: BlockDifferences, n_scales: int) -> _PartEnergies | None:
    join = max(1, len(scale.energy) // PARTS)
    rows = len(scale.energy) // join
    windows = scale.energy[: rows * join].reshape(rows, join)
    there = (~np.isnan(windows)).sum(axis=1)
    use = there > 0
    if use.sum() < FEWEST:
        return None
    energy = np.where(use, np.nansum(windows, axis=1) / np.maximum(there, 1), np.nan)
    edf = freedom_of(scale) * there[use]
    if not (energy[use] > 0).all():
        return None
    mean, spread = 1.0 - 2.0 / (9.0 * edf), 2.0 / (9.0 * edf)
    level = float((energy[use] * edf).sum() / edf.sum())
    chi2 = float(((np.cbrt(energy[use] / level) - mean) ** 2 / spread).sum())
    bar = MARGIN * _quantile(int(use.sum()) - 1, 1.0 - ALARM / n_scales)
    return _PartEnergies(scale, join * scale.window, energy, chi2 / bar)


def _quantile(dof: int, p: float) -> float:
    """Of chi-square (Wilson-Hilferty)."""
    spread = 2.0 / (9.0 * dof)
    return dof * (1.0 - spread + normal_quantile(p) * math.sqrt(spread)) ** 3
