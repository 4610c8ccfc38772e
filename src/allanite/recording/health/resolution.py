# SPDX-License-Identifier: BSD-3-Clause
"""Findings about the step of the values against the noise."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from allanite.recording.health.finding import Finding, Severity, finding, percent
from allanite.recording.health.survey import ChannelSurvey, lattice_among, probes
from allanite.recording.records import Recording

__all__ = [
    "float_step",
    "is_unresolved",
    "no_noise_resolved",
    "patterned_step",
    "quantisation",
    "quantisation_not_white",
]

#: Noise, in steps, below which it does not dither the converter. Rounding a Gaussian of sd 0.41 step gives 0.5
#: step; there the harmonics of the rounding error, exp(-2 pi^2 s^2), are 4 % and grow fast below.
DITHERED = 0.5
#: Step, in units of the noise, from which the converter's share of N (1 % at 0.5) is worth a warning.
NOTICED = 0.5
#: Variance of an angle's increments, in steps^2, below which its rounding errors follow a pattern. White errors
#: give 1/6 plus the variance of the true increments; steps without noise give at most 1/4.
PATTERN = 0.30


def no_noise_resolved(survey: ChannelSurvey) -> Iterator[Finding]:
    """All samples equal (battery B4)."""
    if not survey.constant or survey.present < 2:
        return
    what = "every increment is" if survey.channel.kind.integrated else "every sample is"
    yield finding(
        "no_noise_resolved",
        f"no noise resolved: {what} {survey.high.values[0] + _origin(survey):.9g}{survey.unit} (resolution limit)",
        severity=Severity.FATAL,
        channel=survey.name,
        count=survey.present,
    )


def _origin(survey: ChannelSurvey) -> float:
    return 0.0 if survey.channel.kind.integrated else survey.origin


def quantisation(survey: ChannelSurvey) -> Iterator[Finding]:
    """The converter's step against the noise (battery B5, C10; class 10)."""
    step, sigma = survey.lattice.step, survey.sigma
    if step == 0.0 or survey.constant:
        return
    ratio = step / sigma if sigma > 0.0 else np.inf
    if is_unresolved(survey):
        yield finding(
            "quantisation_limited",
            f"the sample-to-sample noise is less than half the step (LSB) of the values, {step:.4g}{survey.unit}: it "
            "is not resolved",
            severity=Severity.FATAL,
            channel=survey.name,
            count=survey.present,
        )
    elif ratio >= NOTICED and not survey.channel.kind.integrated and _float_ratio(survey) < 0.5 * ratio:
        excess = (1.0 - ratio**2 / 12.0) ** -0.5 - 1.0
        yield finding(
            "quantisation",
            f"the values come in steps (LSB) of {step:.4g}{survey.unit}, {ratio:.2g} times the noise: rounding raises "
            f"N by up to {percent(excess)}",
            severity=Severity.WARNING,
            channel=survey.name,
            count=survey.present,
        )
    else:
        yield from _step(survey)


def is_unresolved(survey: ChannelSurvey) -> bool:
    """The noise moves the values by so little that the step makes what is seen of it.

    Either they rarely change, or they change between two neighbouring codes only: Gaussian noise of 0.41 step
    puts at least 1.5 % elsewhere, wherever its level lies.
    """
    step = survey.lattice.step
    if step == 0.0 or survey.channel.kind.integrated:
        return False
    quiet = survey.unbroken > 1 and survey.sigma < DITHERED * step  # without neighbors nothing is known of it
    return quiet or float(np.median(_two_codes(survey))) > 0.99


def _two_codes(survey: ChannelSurvey) -> list[float]:
    """Share of the two most frequent codes, probe by probe."""
    shares = []
    for _, values in survey.probes:
        code = np.rint((values[~np.isnan(values)] - survey.low.values[0]) / survey.lattice.step)
        counts = np.sort(np.unique(code, return_counts=True)[1])
        shares.append(float(counts[-2:].sum() / len(code)) if len(code) else 0.0)
    return shares or [0.0]


def _step(survey: ChannelSurvey) -> Iterator[Finding]:
    """The step, where it is worth knowing: a fiftieth of the noise, or several counts."""
    step = survey.lattice.step
    several = survey.dtype.kind in "iu" or survey.channel.kind.value == "counts"
    several = several and step > 1.5
    if survey.sigma == 0.0 or (step < 0.02 * survey.sigma and not several):
        return
    if _float_ratio(survey) >= 0.5 * step / survey.sigma:
        return  # the step of the number type: see float_step
    lost = f"; all values are multiples of {step:.0f} counts apart" if several else ""
    yield finding(
        "resolution_step",
        f"the values come in steps (LSB) of {step:.4g}{survey.unit}, {step / survey.sigma:.2g} times the noise{lost}",
        severity=Severity.INFO,
        channel=survey.name,
        count=survey.present,
    )


def quantisation_not_white(survey: ChannelSurvey) -> Iterator[Finding]:
    """Rounding errors of an angle that follow a pattern (battery C9).

    With phase increments of r steps and standard deviation s steps, the first harmonic of the correlation of
    neighbouring rounding errors is exp(-2 pi^2 s^2): 5 % at s = 0.39, where the increments have variance 0.32.
    """
    step = survey.lattice.step
    if not survey.channel.kind.integrated or step == 0.0 or survey.constant:
        return
    variance = _variance([np.diff(values) for _, values in survey.probes])
    if variance < PATTERN * step**2:
        yield finding(
            "quantisation_not_white",
            f"rounding to steps of {step:.4g}{survey.unit} is not white: the increments vary by only "
            f"{variance**0.5 / step:.2g} steps",
            severity=Severity.WARNING,
            channel=survey.name,
            count=survey.present,
        )


def patterned_step(recording: Recording, name: str) -> float:
    """Step [SI, of the angle or the velocity] of a channel whose rounding errors follow a pattern; 0.0 of any other.

    Rates count if they were read as increments: their sum is the angle that was rounded.
    """
    channel = recording[name]
    stated = any(name in s["channels"] for s in recording.history if s.get("step") == "increments")
    if not (stated or channel.kind.integrated):
        return 0.0
    stretches = probes(recording, name)
    values = np.concatenate(stretches) if stretches else np.zeros(0)
    values = values[np.isfinite(values)]
    step = lattice_among(np.unique(values), values, 0.0).step if len(values) else 0.0
    increments = [np.diff(v) for v in stretches] if channel.kind.integrated else stretches
    if not _variance(increments) < PATTERN * step**2:
        return 0.0
    return step * channel.scale * (1.0 if channel.kind.integrated else recording.dt)


def _variance(stretches: Iterable[np.ndarray]) -> float:
    """Median of the local variances; infinite where there are too few samples."""
    spreads = [s for increments in stretches for s in _local_variance(increments)]
    return float(np.median(spreads)) if spreads else np.inf


def _local_variance(increments: np.ndarray, size: int = 64) -> list[float]:
    rows = increments[: len(increments) // size * size].reshape(-1, size)
    rows = rows[np.isfinite(rows).all(axis=1)]
    return [float(v) for v in rows.var(axis=1, ddof=1)]


def float_step(survey: ChannelSurvey) -> Iterator[Finding]:
    """A level so large that the number type cannot hold the noise (battery B9)."""
    ratio = _float_ratio(survey)
    if ratio >= 0.1 and not survey.constant:
        excess = (1.0 - min(ratio, 3.0) ** 2 / 12.0) ** -0.5 - 1.0
        kind = "float32" if _is_single(survey) else survey.dtype.name
        yield finding(
            "float_step",
            f"{kind} numbers near {_level(survey):.4g}{survey.unit} lie {ratio * survey.sigma:.2g}{survey.unit} apart, "
            f"{ratio:.2g} times the noise: N is about {percent(excess)} high",
            severity=Severity.WARNING,
            channel=survey.name,
            count=survey.present,
        )


def _float_ratio(survey: ChannelSurvey) -> float:
    """Spacing of the number type at the level of the samples, in units of the noise; 0.0 for integers."""
    if survey.sigma == 0.0 or survey.dtype.kind != "f":
        return 0.0
    size = abs(_level(survey))
    kind = np.dtype(np.float32) if _is_single(survey) else survey.dtype
    return float(np.spacing(kind.type(size))) / survey.sigma if size < 1e30 else 0.0


def _level(survey: ChannelSurvey) -> float:
    """Where the samples lie: their median, which no wild value moves; the largest for an angle or a velocity."""
    values = np.concatenate([values for _, values in survey.probes]) if survey.probes else np.zeros(0)
    values = values[np.isfinite(values)]
    if len(values) == 0:
        return 0.0
    return (
        float(np.abs(values).max() if survey.channel.kind.integrated else np.median(values)) + survey.origin
    )


def _is_single(survey: ChannelSurvey) -> bool:
    """True for float32, and for float64 that holds nothing but float32 numbers."""
    if survey.dtype == np.float32:
        return True
    if survey.dtype != np.float64 or not survey.probes:
        return False
    values = np.concatenate([values for _, values in survey.probes])
    values = values[np.abs(values) < 1e30]
    return bool(len(values) and np.array_equal(values, values.astype(np.float32).astype(np.float64)))
