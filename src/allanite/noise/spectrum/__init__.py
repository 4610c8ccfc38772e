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
