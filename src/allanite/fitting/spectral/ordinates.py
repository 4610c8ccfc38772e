# SPDX-License-Identifier: BSD-3-Clause
"""What the spectral fit looks at: slow contrasts and bins of a spectrum, with what each unit process puts into them.

Below, each contrast is one chi-square variable with one degree of freedom; above, each point of a log-binned spectrum
is one with as many as its bins and segments give. Points in which a line stands, or which the sensor's own filter
bends, take no part.
"""

from __future__ import annotations

import math
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.spectral.modes import PartMeans, SlowModes, slow_modes
from allanite.lazy_dataclasses import dataclass
from allanite.noise import Flicker, GaussMarkov, Quantisation, RandomWalk, TermType, White
from allanite.noise.spectrum.expected import Sight, sight_of
from allanite.noise.spectrum.periodogram import additive_dof
from allanite.noise.spectrum.results import Spectrum
from allanite.noise.spectrum.sampled import sampled_psd
from allanite.noise.spectrum.windows import window_of
from allanite.recording.records import Recording

__all__ = ["Ordinates", "ordinates_of"]

Array = NDArray[np.float64]

#: Correlation times of the table of Gauss-Markov columns are so far apart, in the logarithm.
_STEP = 0.1
#: Shortest correlation time that is tried [samples], and the longest, as a part of the record.
_SHORTEST, _LONGEST = 2.0, 2.0
#: A line is kept at this distance [resolutions of the spectrum].
_CLEAR = 8.0
#: Points on each side over which a density is averaged to tell how much of it was put back for bridged samples.
_NEIGHBOURS = 7


@dataclass(slots=True)
class _Tables:
    """Columns that do not change, and logarithms of those of Gauss-Markov terms by the number of their time."""

    linear: dict[str, Array] = field(default_factory=dict)
    markov: dict[int, Array] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ordinates:
    """Chi-square variables whose means are linear in the coefficients of a model.

    Attributes
    ----------
    modes : SlowModes
    contrast, ramp : ndarray, shape (n_slow,)
        Contrasts that take part [SI], and what a ramp of 1 SI/s puts into them.
    value : ndarray, shape (n,)
        Squares of the contrasts [SI^2], then densities [SI^2/Hz].
    dof : ndarray, shape (n,)
    frequency : ndarray, shape (n,) [Hz]
    dt, duration : float [s]
    common : ndarray, shape (n, n_errors)
        Loadings of the relative errors, of unit variance, that bridged samples give all densities in common.
    discrepancy : float
        Relative error of the model at every ordinate, for records that no sum of terms explains.
    """

    modes: SlowModes
    contrast: Array
    ramp: Array
    value: Array
    dof: Array
    frequency: Array
    dt: float
    duration: float
    sampling: str
    common: Array
    discrepancy: float = 0.0
    _sight: Sight
    _kept: NDArray[np.bool_]
    _tables: _Tables

    @property
    def times(self) -> tuple[float, float]:
        """Shortest and longest correlation time that is tried [s]."""
        return _SHORTEST * self.dt, max(self.duration / _LONGEST, 2 * _SHORTEST * self.dt)

    @property
    def weight(self) -> Array:
        """Degrees of freedom, fewer where the model has an error of its own."""
        return 1 / (1 / self.dof + self.discrepancy**2 / 2)

    def column(self, letter: str, T: float | None = None) -> Array:
        """Mean of each ordinate for a unit process (Q, N, B, K; G with correlation time T and variance 1)."""
        if letter == "G":
            return self._markov(math.nan if T is None else T)[0]
        if letter not in self._tables.linear:
            units: dict[str, TermType] = {
                "Q": Quantisation(Q=1.0, dt=self.dt),
                "N": White(N=1.0),
                "B": Flicker(B=1.0),
                "K": RandomWalk(K=1.0),
            }
            self._tables.linear[letter] = self._means(units[letter])
        return self._tables.linear[letter][self._kept]

    def slope(self, T: float) -> Array:
        """Derivative of the column of a Gauss-Markov term with respect to ln T."""
        return self._markov(T)[1]

    def below(self, frequency: float) -> Ordinates:
        """Without the points above a frequency."""
        keep = self.frequency <= max(frequency, float(np.max(self.modes.frequency, initial=0.0)))
        kept = self._kept.copy()
        kept[np.flatnonzero(self._kept)[~keep]] = False
        return replace(
            self,
            value=self.value[keep],
            dof=self.dof[keep],
            frequency=self.frequency[keep],
            common=self.common[keep],
            _kept=kept,
        )

    def _markov(self, T: float) -> tuple[Array, Array]:
        """Column and derivative: cubic through the logarithms of four columns of the table."""
        place = math.log(T / self.dt) / _STEP
        first = math.floor(place) - 1
        near = np.stack([self._node(first + i) for i in range(4)])[:, self._kept]
        x = place - first
        share, turn = _cubic(x)
        column: Array = np.exp(share @ near)
        return column, column * (turn @ near) / _STEP

    def _node(self, number: int) -> Array:
        if number not in self._tables.markov:
            unit = GaussMarkov.from_sigma(1.0, self.dt * math.exp(number * _STEP))
            self._tables.markov[number] = np.log(np.maximum(self._means(unit), 1e-300))
        return self._tables.markov[number]

    def _means(self, term: TermType) -> Array:
        from allanite.noise import NoiseModel

        unit = NoiseModel.of(term)
        fast = self._sight(lambda f: sampled_psd(unit, f, self.dt, self.sampling))  # type: ignore[arg-type]
        return np.concatenate([self.modes.variance(term), fast])


def _cubic(x: float) -> tuple[Array, Array]:
    """Weights of the values at 0, 1, 2, 3, and of the derivative, of the cubic through them at x."""
    return _CUBIC @ np.array([1.0, x, x * x, x**3]), _CUBIC @ np.array([0.0, 1.0, 2 * x, 3 * x * x])


_CUBIC: Array = np.linalg.inv(np.vander(np.arange(4.0), increasing=True).T)


def ordinates_of(recording: Recording, spectrum: Spectrum, means: PartMeans | None = None) -> Ordinates:
    """Ordinates of a channel, from its log-binned spectrum, and its `means` or one more pass over the samples."""
    modes = slow_modes(recording, spectrum.channel, means=means)
    used = np.zeros(len(spectrum.frequency), dtype=bool)
    if not modes.whole:
        split = float(modes.frequency[-1]) if len(modes.frequency) else 0.0
        used = (spectrum.bins[:, 0] - 0.5) * spectrum.resolution > split
    if spectrum.band_limit is not None:
        used &= spectrum.frequency <= spectrum.band_limit.begins
    for line in spectrum.lines:
        reach = _CLEAR * spectrum.resolution + line.width
        edges = (spectrum.bins - 0.5 + [0, -1]) * spectrum.resolution[:, None]
        used &= (edges[:, 1] < line.frequency - reach) | (edges[:, 0] > line.frequency + reach)
    away = np.ones(len(modes.value), dtype=bool)
    for line in spectrum.lines:
        beside = line.width + _CLEAR / (spectrum.dt * spectrum.n_samples)
        away &= np.abs(modes.frequency - line.frequency) > beside
    fast = additive_dof(spectrum.edf[used], np.diff(spectrum.bins[used], axis=1)[:, 0])
    level, bridged = _smooth(spectrum.density[used]), spectrum.bridged
    shared = bridged.common(level, *((spectrum.bins[used] - 0.5) * spectrum.resolution[used, None]).T)
    fast = fast / bridged.own_part(level, spectrum.frequency[used])
    contrast = modes.value[away]
    return Ordinates(
        modes=modes,
        contrast=contrast,
        ramp=modes.slope[away],
        value=np.concatenate([contrast**2, spectrum.density[used]]),
        dof=np.concatenate([np.ones(len(contrast)), fast]),
        frequency=np.concatenate([modes.frequency[away], spectrum.frequency[used]]),
        dt=spectrum.dt,
        duration=spectrum.dt * spectrum.n_samples,
        sampling=spectrum.sampling,
        common=np.concatenate([np.zeros((len(contrast), shared.shape[1])), shared]),
        _sight=sight_of(
            spectrum.bins[used], spectrum.resolution[used], 0.5 / spectrum.dt, window_of(spectrum.window)
        ),
        _kept=np.concatenate([away, np.ones(int(used.sum()), dtype=bool)]),
        _tables=_Tables(),
    )


def _smooth(density: Array) -> Array:
    """Densities averaged over neighbours, so that a weight depends little on the value that it weighs."""
    ones = np.ones(2 * _NEIGHBOURS + 1)
    if not len(density):
        return density
    total, count = (
        np.convolve(v, ones)[_NEIGHBOURS:-_NEIGHBOURS]
        for v in (np.log(np.maximum(density, 1e-300)), np.ones(len(density)))
    )
    return np.asarray(np.exp(total / count))
