# SPDX-License-Identifier: BSD-3-Clause
"""Levels of one log: of its white noise, of its slow terms and of each band, its lines left out."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.spectrum.bands import MeanDensity, band_of, level, widths
from allanite.noise.spectrum.results import Spectrum
from allanite.quantities.distributions import chi_square_tail
from allanite.stability.in_motion.told import is_slow

__all__ = ["LogLevels", "with_scatter"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Share of the density at rest that slow terms make where they prevail.
PREVAIL = 0.5
#: The scatter of parts that counts: one steady log in a thousand shows as much.
UNSTEADY = 1e-3


@dataclass(frozen=True, slots=True)
class LogLevels:
    """A spectrum up to a frequency [Hz], and what the model at rest would show in its place.

    Attributes
    ----------
    spectrum : Spectrum
    below : float [Hz]
    expected, slow : ndarray, shape (n,)
        Density of the model, and of its slow terms.
    """

    spectrum: Spectrum
    below: float
    expected: Array
    slow: Array

    @classmethod
    def of(cls, spectrum: Spectrum, model: NoiseModel, below: float) -> LogLevels:
        """With the densities of a model."""
        slow = NoiseModel.of(*(t for t in model.terms if is_slow(t)), kind=model.kind)
        return cls(spectrum, below, spectrum.expected(model), spectrum.expected(slow))

    def white(self, above: float) -> MeanDensity | None:
        """Square of the white noise that leaves the same error after integration as the density from `above` on."""
        weight = widths(self.spectrum) / self.spectrum.frequency**2
        return level(self.spectrum, self._points(above), np.ones_like(weight), weight)

    def of_slow_terms(self) -> MeanDensity | None:
        """Density over that of the model, where its slow terms prevail."""
        return self._over_model(self._points() & (self.slow > PREVAIL * self.expected))

    def of_band(self, band: int) -> MeanDensity | None:
        """Density over that of the model in a band."""
        return self._over_model(self._points() & (band_of(self.spectrum.frequency) == band))

    def bands(self) -> list[int]:
        """Numbers of the bands in which there are points."""
        return sorted(set(band_of(self.spectrum.frequency[self._points()]).tolist()))

    def white_of_lines(self, above: float) -> tuple[float, float, float]:
        """What the lines add to `white`, and its ends."""
        points = self._points(above)
        weight = float(np.sum(widths(self.spectrum)[points] / self.spectrum.frequency[points] ** 2))
        lines = [line for line in self.spectrum.lines if above <= line.frequency < self.below]
        amplitudes = [(line.amplitude, line.amplitude_lower, line.amplitude_upper) for line in lines]
        known = [tuple(a if math.isfinite(a) else each[0] for a in each) for each in amplitudes]
        value, lower, upper = (
            math.fsum((each[i] / line.frequency) ** 2 for each, line in zip(known, lines, strict=True))
            / 4
            / weight
            for i in range(3)
        )
        return value, lower, upper

    def _points(self, above: float = 0.0) -> Mask:
        ends = self.spectrum.bins[:, 1] * self.spectrum.resolution
        return np.asarray((self.spectrum.frequency >= above) & (ends <= self.below * (1 + 1e-9)))

    def _over_model(self, points: Mask) -> MeanDensity | None:
        return level(self.spectrum, points, self.expected, widths(self.spectrum))


def with_scatter(whole: MeanDensity, parts: Sequence[MeanDensity | None]) -> tuple[MeanDensity, bool]:
    """A level of a log with the degrees of freedom that its parts leave, and whether these agree.

    Of a steady log the logarithms of the parts scatter with variances 2/dof. Where they scatter more, each knows less.
    """
    known = [part for part in parts if part is not None and part.value > 0]
    if len(known) < 2 or len(known) < len(parts):
        return whole, True
    dof = np.array([part.dof for part in known])
    off = np.log([part.value for part in known]) + 1 / dof  # the mean of the logarithm of a chi-square
    off -= float(dof @ off) / float(dof.sum())
    scatter = float(np.sum(off**2 / (2 / dof + 2 / dof**2)))
    freedom = len(known) - 1
    if chi_square_tail(scatter, freedom) >= UNSTEADY:
        return whole, True
    return MeanDensity(value=whole.value, dof=max(whole.dof * freedom / scatter, 1.0)), False
