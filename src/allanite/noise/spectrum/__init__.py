# SPDX-License-Identifier: BSD-3-Clause
"""Power spectral density of a channel, its lines, and the band limit of a filtered sensor.

Densities are two-sided, in SI^2/Hz: white noise stands at N^2 (a one-sided density, twice as large, stands at
sqrt(2) N in root density).

Lines and a band limit bend the Allan variance without being noise terms of a model: they imitate quantisation and
shift N. A line whose amplitude and phase stay the same through the record is a sinusoid, and `without_stable_lines`
takes it out of the samples; `lags_to_exclude` says which lags of a curve the others reach.

``windows``, ``periodogram``, ``estimation``
    Segments, their averages, and densities with intervals.
``holes``
    Isolated missing samples.
``sampled``, ``expected``
    What a model's density is after sampling, and through a window.
``lines``, ``stability``, ``band_limit``, ``exclusion``
    What is no noise term, and what it does to an Allan curve.
"""

from __future__ import annotations

from allanite.noise.spectrum.estimation import power_spectrum
from allanite.noise.spectrum.exclusion import Exclusion, lags_to_exclude, quiet_lags, without_spans
from allanite.noise.spectrum.lines import SpectralLine
from allanite.noise.spectrum.results import Spectrum
from allanite.noise.spectrum.sampled import sampled_psd
from allanite.noise.spectrum.stability import sinusoids, without_stable_lines

__all__ = [
    "Exclusion",
    "SpectralLine",
    "Spectrum",
    "lags_to_exclude",
    "power_spectrum",
    "quiet_lags",
    "sampled_psd",
    "sinusoids",
    "without_spans",
    "without_stable_lines",
]
