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
The names in ``__all__`` are public (docs/reference/public.md), and so are those of `allanite.instruments` and
`allanite.compat`; all else may change in any release. They load on first use: ``import allanite`` costs the standard
library only.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING

__version__ = "0.1.0"

if TYPE_CHECKING:
    from allanite.commands.fleet.running import fleet
    from allanite.errors import (
        AllaniteError,
        DataQualityError,
        DataQualityWarning,
        FitError,
        FormatError,
        InputError,
        InstrumentError,
        LimitError,
        StorageError,
        WorkerError,
    )
    from allanite.experiments.alignment import AlignmentPlan, align, predict_alignment
    from allanite.experiments.calibration import calibrate
    from allanite.experiments.dead_reckoning import InitialErrors, dead_reckon
    from allanite.experiments.earth_rate import measure_earth_rate
    from allanite.experiments.north import Rotation, east_west_null, find_north
    from allanite.experiments.planning import plan
    from allanite.experiments.position_planning import plan_positions
    from allanite.experiments.rate_table import (
        TableUncertainty,
        measure_rate_table,
        read_rate_table,
        simulate_on_table,
    )
    from allanite.experiments.redundancy import combine
    from allanite.experiments.reversals import find_reversals
    from allanite.experiments.static_spans import find_rests
    from allanite.exporters import export
    from allanite.files.foreign_curves import read_curve
    from allanite.files.readers import read
    from allanite.files.recording_file import write_recording
    from allanite.filtering.innovations import examine_innovations
    from allanite.filtering.kalman import filter_recording
    from allanite.filtering.simulation import (
        Motion,
        Temperature,
        UnitMotion,
        simulate,
        simulate_unit,
        true_attitudes,
    )
    from allanite.fitting import fit
    from allanite.fitting.model_difference import model_difference
    from allanite.fitting.overbound import overbound
    from allanite.fitting.selection import select
    from allanite.noise import (
        Flicker,
        GaussMarkov,
        NoiseModel,
        Quantisation,
        Ramp,
        RandomWalk,
        Sinusoid,
        White,
    )
    from allanite.noise.allan import AllanCurve, allan_curve
    from allanite.noise.allan.interval_error import interval_error
    from allanite.noise.allan.theo_covariance import theo1_bias
    from allanite.noise.spectrum.estimation import power_spectrum
    from allanite.noise.spectrum.stability import without_stable_lines
    from allanite.quantities.setup_uncertainty import SetupUncertainty
    from allanite.quantities.units import parse_unit
    from allanite.recording.calibration import Calibration
    from allanite.recording.cleaning import clean
    from allanite.recording.clock_channels import clock_recording
    from allanite.recording.health.examination import check
    from allanite.recording.records import Channel, Recording
    from allanite.stability.environment.estimation import regress_environment
    from allanite.stability.fleet.population import describe_fleet
    from allanite.stability.in_motion import measure_in_motion
    from allanite.stability.record_comparison.estimation import compare
    from allanite.stability.shared_noise import separate_noise
    from allanite.stability.variation import examine_variation
    from allanite.study.characterization import characterize
    from allanite.study.datasheet import hold_against, read_datasheet
    from allanite.study.model_file import load_models, model_of, save_models
    from allanite.study.study import Study
    from allanite.views.figures import plot
    from allanite.views.progress import progress_bar
    from allanite.views.report import render

__all__ = [
    "AlignmentPlan",
    "AllanCurve",
    "AllaniteError",
    "Calibration",
    "Channel",
    "DataQualityError",
    "DataQualityWarning",
    "FitError",
    "Flicker",
    "FormatError",
    "GaussMarkov",
    "InitialErrors",
    "InputError",
    "InstrumentError",
    "LimitError",
    "Motion",
    "NoiseModel",
    "Quantisation",
    "Ramp",
    "RandomWalk",
    "Recording",
    "Rotation",
    "SetupUncertainty",
    "Sinusoid",
    "StorageError",
    "Study",
    "TableUncertainty",
    "Temperature",
    "UnitMotion",
    "White",
    "WorkerError",
    "__version__",
    "align",
    "allan_curve",
    "calibrate",
    "characterize",
    "check",
    "clean",
    "clock_recording",
    "combine",
    "compare",
    "dead_reckon",
    "describe_fleet",
    "east_west_null",
    "examine_innovations",
    "examine_variation",
    "export",
    "filter_recording",
    "find_north",
    "find_rests",
    "find_reversals",
    "fit",
    "fleet",
    "hold_against",
    "interval_error",
    "load_models",
    "measure_earth_rate",
    "measure_in_motion",
    "measure_rate_table",
    "model_difference",
    "model_of",
    "overbound",
    "parse_unit",
    "plan",
    "plan_positions",
    "plot",
    "power_spectrum",
    "predict_alignment",
    "progress_bar",
    "read",
    "read_curve",
    "read_datasheet",
    "read_rate_table",
    "regress_environment",
    "render",
    "save_models",
    "select",
    "separate_noise",
    "simulate",
    "simulate_on_table",
    "simulate_unit",
    "theo1_bias",
    "true_attitudes",
    "without_stable_lines",
    "write_recording",
]

_HOMES = {
    "AlignmentPlan": "experiments.alignment",
    "AllanCurve": "noise.allan",
    "AllaniteError": "errors",
    "Calibration": "recording.calibration",
    "Channel": "recording.records",
    "DataQualityError": "errors",
    "DataQualityWarning": "errors",
    "FitError": "errors",
    "Flicker": "noise",
    "FormatError": "errors",
    "GaussMarkov": "noise",
    "InitialErrors": "experiments.dead_reckoning",
    "InputError": "errors",
    "InstrumentError": "errors",
    "LimitError": "errors",
    "Motion": "filtering.simulation",
    "NoiseModel": "noise",
    "Quantisation": "noise",
    "Ramp": "noise",
    "RandomWalk": "noise",
    "Recording": "recording.records",
    "Rotation": "experiments.north",
    "Sinusoid": "noise",
    "SetupUncertainty": "quantities.setup_uncertainty",
    "StorageError": "errors",
    "Study": "study.study",
    "TableUncertainty": "experiments.rate_table",
    "Temperature": "filtering.simulation",
    "UnitMotion": "filtering.simulation",
    "White": "noise",
    "WorkerError": "errors",
    "align": "experiments.alignment",
    "allan_curve": "noise.allan",
    "calibrate": "experiments.calibration",
    "characterize": "study.characterization",
    "check": "recording.health.examination",
    "clean": "recording.cleaning",
    "clock_recording": "recording.clock_channels",
    "combine": "experiments.redundancy",
    "compare": "stability.record_comparison.estimation",
    "dead_reckon": "experiments.dead_reckoning",
    "describe_fleet": "stability.fleet.population",
    "east_west_null": "experiments.north",
    "examine_innovations": "filtering.innovations",
    "examine_variation": "stability.variation",
    "export": "exporters",
    "filter_recording": "filtering.kalman",
    "find_north": "experiments.north",
    "find_rests": "experiments.static_spans",
    "find_reversals": "experiments.reversals",
    "fit": "fitting",
    "fleet": "commands.fleet.running",
    "hold_against": "study.datasheet",
    "interval_error": "noise.allan.interval_error",
    "load_models": "study.model_file",
    "measure_earth_rate": "experiments.earth_rate",
    "measure_in_motion": "stability.in_motion",
    "measure_rate_table": "experiments.rate_table",
    "model_difference": "fitting.model_difference",
    "model_of": "study.model_file",
    "overbound": "fitting.overbound",
    "parse_unit": "quantities.units",
    "plan": "experiments.planning",
    "plan_positions": "experiments.position_planning",
    "plot": "views.figures",
    "power_spectrum": "noise.spectrum.estimation",
    "predict_alignment": "experiments.alignment",
    "progress_bar": "views.progress",
    "read": "files.readers",
    "read_curve": "files.foreign_curves",
    "read_datasheet": "study.datasheet",
    "read_rate_table": "experiments.rate_table",
    "regress_environment": "stability.environment.estimation",
    "render": "views.report",
    "save_models": "study.model_file",
    "select": "fitting.selection",
    "separate_noise": "stability.shared_noise",
    "simulate": "filtering.simulation",
    "simulate_on_table": "experiments.rate_table",
    "simulate_unit": "filtering.simulation",
    "theo1_bias": "noise.allan.theo_covariance",
    "true_attitudes": "filtering.simulation",
    "without_stable_lines": "noise.spectrum.stability",
    "write_recording": "files.recording_file",
}
"""Public name -> the module it lives in."""

_RENAMED: dict[str, str] = {}
"""Deprecated name -> the public name that replaces it."""


def __getattr__(name: str) -> object:
    """Import a public name from its module on first use (PEP 562)."""
    return _public(__name__, name, _HOMES, _RENAMED)


def __dir__() -> list[str]:
    return sorted(__all__)


def _public(package: str, name: str, homes: Mapping[str, str], renamed: Mapping[str, str]) -> object:
    """A public name of a package, which keeps it: this is asked, and a deprecated name warns, once."""
    from importlib import import_module

    current = renamed.get(name, name)
    if current not in homes:
        raise AttributeError(f"module {package!r} has no attribute {name!r}")
    if current != name:
        warnings.warn(
            f"{package}.{name} is deprecated; use {package}.{current}", DeprecationWarning, stacklevel=3
        )
    value = getattr(import_module(f"allanite.{homes[current]}"), current)
    setattr(sys.modules[package], name, value)
    return value
