# SPDX-License-Identifier: BSD-3-Clause
"""allanite: from a log of a sensor at rest to a noise model, a filter, and the Earth's rotation measured with it.

Flow
----
Data go one way::

    file --read--> Recording --check--> findings
                   Recording --allan_curve--> AllanCurve --fit--> NoiseModel --simulate--> Recording
                   Recording --characterize--> Study --render, plot, export--> report, figures, files

    NoiseModel + Recording --filter_recording--> Filtered
    NoiseModel + Recording that was turned --measure_earth_rate--> EarthRateEstimate
                                           --find_north--> NorthEstimate
    Recording of a unit in several positions --calibrate--> CalibrationEstimate
    Recording of a unit at rest or turned --align--> AlignmentEstimate
    NoiseModel + Recording on a rate table --measure_rate_table--> RateTableEstimate
    NoiseModel --dead_reckon--> DeadReckoning: what the noise costs a navigator
    NoiseModel --plan, plan_positions--> Plan, PositionPlan, before a single sample is taken

`Study` is the only thing that crosses from the science to the presentation. It is a plain, versioned
JSON document; reports, figures and exporters read it and hold no formula.

Data types
----------
Recording
    Evenly sampled channels of one sensor, with one rate. A recording is at most as long as its samples say:
    rate, length and span cannot disagree.
Channel
    Name, kind (rate, angle, acceleration, velocity, voltage, counts, unknown), unit, scale factor, and the
    sampling convention: ``"mean"`` where a sample is the mean over its interval (integrating converters, angle
    increments), ``"point"`` where it is the value at an instant.
AllanCurve
    Deviations with their intervals, equivalent degrees of freedom and counts, per lag and channel.
NoiseModel
    A sum of noise terms. Each term answers ``psd(f)`` and ``avar(tau)``; the sum answers ``state_space(dt)`` too.
Study
    All of the above for one recording, serialisable.

Conventions
-----------
Axis order
    Samples run along axis 0 and channels along axis 1: ``(n_samples, n_channels)``; curves are
    ``(n_lags, n_channels)``. Arrays held by results are read-only.
Units
    SI inside, always: rad, rad/s, m/s², m/s, V, s, Hz. Other units exist in names and texts at the edge only
    (`allanite.quantities.units`). Samples are never copied to change their unit: results are scaled.
Missing samples
    NaN, in every function. A gap is never closed up and never filled.
Spectra
    Power spectral densities are two-sided, ``S(f)`` over ``-inf < f < inf``, in (SI unit)²/Hz, as in
    IEEE Std 952, so that

    ``AVAR(tau) = 4 * integral from 0 to inf of S(f) * sin(pi f tau)**4 / (pi f tau)**2 df``.

    For a one-sided density, twice as large, the factor is 2.
Symbols
    IEEE Std 952 letters. The units are those of a rate gyro; an accelerometer has m/s² in place of rad/s.

    ===== ========================================= ============== ===========================
    name  term                                      unit           AVAR(tau)
    ===== ========================================= ============== ===========================
    Q     quantisation                              rad            3 Q² / tau²
    N     white noise (angle random walk)           rad/s/√Hz      N² / tau
    B     flicker (bias instability)                rad/s          (2 ln 2 / pi) B²
    K     random walk of the rate                   rad/s/√s       K² tau / 3
    R     ramp                                      rad/s²         R² tau² / 2
    q, T  Gauss-Markov: driving noise and           rad/s/√s, s    see `allanite.noise`
          correlation time, T is the seed's T_b
    ===== ========================================= ============== ===========================
Uncertainty
    No estimate without its interval, or the words "upper limit" or "not resolved". Intervals are at 95 % unless
    said otherwise.
Errors
    Everything raised on purpose derives from `AllaniteError`. The library neither prints nor exits.

Names
-----
The public names below load on first use: ``import allanite`` costs the standard library only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

__version__ = "0.1.0"

if TYPE_CHECKING:
    from allanite.errors import AllaniteError
    from allanite.experiments.alignment import align
    from allanite.experiments.calibration import calibrate
    from allanite.experiments.dead_reckoning import dead_reckon
    from allanite.experiments.earth_rate import measure_earth_rate
    from allanite.experiments.north import find_north
    from allanite.experiments.planning import plan
    from allanite.experiments.position_planning import plan_positions
    from allanite.experiments.rate_table import measure_rate_table
    from allanite.exporters import export
    from allanite.files.readers import read
    from allanite.filtering.kalman import filter_recording
    from allanite.filtering.simulation import simulate
    from allanite.fitting import fit
    from allanite.noise import NoiseModel
    from allanite.noise.allan import AllanCurve, allan_curve
    from allanite.recording.health import check
    from allanite.recording.records import Channel, Recording
    from allanite.study.study import Study, characterize
    from allanite.views.figures import plot
    from allanite.views.report import render

__all__ = [
    "AllanCurve",
    "AllaniteError",
    "Channel",
    "NoiseModel",
    "Recording",
    "Study",
    "__version__",
    "align",
    "allan_curve",
    "calibrate",
    "characterize",
    "check",
    "dead_reckon",
    "export",
    "filter_recording",
    "find_north",
    "fit",
    "measure_earth_rate",
    "measure_rate_table",
    "plan",
    "plan_positions",
    "plot",
    "read",
    "render",
    "simulate",
]

_HOMES = {
    "AllanCurve": "noise.allan",
    "AllaniteError": "errors",
    "Channel": "recording.records",
    "NoiseModel": "noise",
    "Recording": "recording.records",
    "Study": "study.study",
    "align": "experiments.alignment",
    "allan_curve": "noise.allan",
    "calibrate": "experiments.calibration",
    "characterize": "study.study",
    "check": "recording.health",
    "dead_reckon": "experiments.dead_reckoning",
    "export": "exporters",
    "filter_recording": "filtering.kalman",
    "find_north": "experiments.north",
    "fit": "fitting",
    "measure_earth_rate": "experiments.earth_rate",
    "measure_rate_table": "experiments.rate_table",
    "plan": "experiments.planning",
    "plan_positions": "experiments.position_planning",
    "plot": "views.figures",
    "read": "files.readers",
    "render": "views.report",
    "simulate": "filtering.simulation",
}
"""Public name -> the module it lives in."""


def __getattr__(name: str) -> object:
    """Import a public name from its module on first use (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'allanite' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
