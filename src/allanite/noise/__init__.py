# SPDX-License-Identifier: BSD-3-Clause
"""Noise: terms and their sum, and what a record shows of it.

One term is one class with every view of one process: ``psd(f)``, ``avar(tau)``, ``avar_sampled(m, dt, sampling)``,
``phase_covariance(t, dt, sampling)`` and the Markov states of the process. Models add with ``+`` and answer
``state_space(dt)`` for a filter.

Conventions (whole package): rate in rad/s (acceleration in m/s^2, ...), two-sided density S(f) over frequency in Hz,

    AVAR(tau) = 4 * integral from 0 to infinity of S(f) sin^4(pi f tau) / (pi f tau)^2 df.

``terms``, ``model``, ``state_space``, ``markov``
    What a sensor's noise is. ``datasheet`` and ``given_models``: what sheets and words say of it. ``quick_terms``:
    Gauss-Markov terms of a few samples, which consumers take for white noise; ``sinusoid_sum`` many spectral lines.
``allan``, ``spectrum``, ``span_means``
    What a record shows of it: curve, density, and means over spans with their covariance.

Coefficients carry the letters of IEEE Std 952: Q, N, B, K, R. Samples are interval means ("mean") or
instantaneous values ("point"); the two differ at small m.

References
----------
.. [1] IEEE Std 952-1997, annex C (terms and their Allan variance).
.. [2] N. F. Zhang, "Allan variance of time series models for measurement data", Metrologia 45 (2008) 549.
.. [3] C. Greenhall, W. Riley, "Uncertainty of stability variances based on finite differences", PTTI 2003.
"""

from allanite.noise.model import Estimate, NoiseModel
from allanite.noise.state_space import StateSpace
from allanite.noise.terms import (
    BY_LETTER,
    FLICKER_FLOOR,
    GM_PEAK_DEVIATION,
    GM_PEAK_TAU,
    SIGMA_PER_B,
    TERMS,
    Flicker,
    GaussMarkov,
    Quantisation,
    Ramp,
    RandomWalk,
    Sinusoid,
    Term,
    TermType,
    White,
    gauss_markov_shape,
    term_of,
)

__all__ = [
    "BY_LETTER",
    "FLICKER_FLOOR",
    "GM_PEAK_DEVIATION",
    "GM_PEAK_TAU",
    "SIGMA_PER_B",
    "TERMS",
    "Estimate",
    "Flicker",
    "GaussMarkov",
    "NoiseModel",
    "Quantisation",
    "Ramp",
    "RandomWalk",
    "Sinusoid",
    "StateSpace",
    "Term",
    "TermType",
    "White",
    "gauss_markov_shape",
    "term_of",
]
