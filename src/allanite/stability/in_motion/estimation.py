# SPDX-License-Identifier: BSD-3-Clause
"""measure_in_motion(rest, motions): band by band, what motion adds to the noise, and what a filter is to be told.

The spectrum of each log is compared with the model at rest as that log would show it: sample rates and lengths may
differ, and a steep density that leaks through the window does no harm. Ratios of levels are F-distributed for Gaussian
noise. Lines are left out of them. Vibration is seldom steady: the log in motion is cut into parts, and where these
differ by more than chance allows, the degrees of freedom are those of their scatter.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from allanite.errors import DataQualityError, InputError
from allanite.fitting import fit
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.motion import MotionInflation
from allanite.noise.spectrum.bands import MeanDensity, amplitude_ratio, band_edges
from allanite.noise.spectrum.estimation import power_spectrum
from allanite.noise.spectrum.results import Spectrum
from allanite.quantities.display_units import si_unit
from allanite.quantities.distributions import f_tail
from allanite.quantities.number_words import number
from allanite.quantities.probabilities import require_probabilities
from allanite.quantities.quantity import Quantity
from allanite.recording.records import Recording
from allanite.stability.in_motion.levels import LogLevels, with_scatter
from allanite.stability.in_motion.lines import lines_in_motion
from allanite.stability.in_motion.matching import matched_channels
from allanite.stability.in_motion.results import (
    BandInflation,
    ChannelInMotion,
    InMotion,
    MotionLog,
    MotionVerdict,
)
from allanite.stability.in_motion.told import told_model

__all__ = ["measure_in_motion"]


Progress = Callable[[float, str], None]

#: Lowest frequency that counts as noise where nobody states it: half the rate of a filter's updates of 20 Hz, and at
#: most this share of the common band [Hz].
ABOVE, SHARE = 10.0, 0.25
#: Probability that any channel without inflation is called inflated or lower.
FALSE_ALARM = 0.05
#: Parts of the log in motion, and samples that each has at least.
PARTS, LEAST = 8, 512
#: Share of the square of the white noise from which on lines are told as noise.
COUNTS = 0.01


def measure_in_motion(
    rest: Recording,
    motions: Recording | Sequence[Recording],
    *,
    above: float | None = None,
    fixed: bool = False,
    match: Sequence[str] = (),
    models: Mapping[str, NoiseModel] | None = None,
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> InMotion:
    """How much noise does motion add, and what is a filter to be told?

    Parameters
    ----------
    rest : Recording
        Log at rest.
    motions : Recording or sequence of Recording
        Logs with motors on, or carried; of any rate and length.
    above : float, optional [Hz]
        Lowest frequency that counts as noise: half the update rate of the filter, or the end of the movement of the
        body. By default 10 Hz, at most a quarter of half the lowest sample rate.
    fixed : bool
        The body was held still in the logs in motion: slow changes are noise as well.
    match : sequence of str, optional
        Channels, each by one name, or by its names at rest and in motion with a comma between.
    models : mapping of str to NoiseModel, optional
        Models at rest by channel; by default they are fitted to `rest`.
    confidence : float
        Level of the intervals.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Raises
    ------
    InputError
        No log in motion, channels that do not belong together, a frequency outside the common band, or no model of a
        channel.
    DataQualityError, FitError
        A log is too short, or its noise at rest has no model.

    Notes
    -----
    Intervals are those of Gaussian noise. They assume steady logs; the parts of a log tell where its level changes.
    """
    logs = [motions] if isinstance(motions, Recording) else [*motions]
    if not logs:
        raise InputError("state a log in motion beside the one at rest")
    require_probabilities(confidence=confidence)
    below = min(rest.rate, *(log.rate for log in logs)) / 2
    lowest = _lowest(above, below)
    report = progress or (lambda fraction, what: None)
    pairs = [(log, pair) for log in logs for pair in matched_channels(rest, log, match)]
    names = list(dict.fromkeys(name for _, (name, _) in pairs))
    quiet = {}
    for i, name in enumerate(names):
        report(0.5 * i / len(names), f"{name} at rest")
        quiet[name] = _quiet(rest, name, models)
    channels = []
    for i, (log, (name, moving)) in enumerate(pairs):
        report(0.5 + 0.5 * i / len(pairs), f"{moving} in motion")
        pair = _ChannelPair(
            quiet[name], log, moving, (lowest, below), confidence, FALSE_ALARM / len(pairs), fixed
        )
        channels.append(_channel(pair))
    report(1.0, "done")
    return InMotion(
        rest=_facts(rest),
        logs=tuple(map(_facts, logs)),
        channels=tuple(channels),
        above=lowest,
        below=below,
        fixed=fixed,
        confidence=confidence,
    )


def _lowest(above: float | None, below: float) -> float:
    if above is None:
        return min(ABOVE, SHARE * below)
    if isinstance(above, bool) or not (math.isfinite(above) and 0 < above <= below / 2):
        raise InputError(
            f"above must be a frequency up to {number(below / 2)} Hz, half the common band of the logs, not {above!r}"
        )
    return float(above)


def _facts(recording: Recording) -> MotionLog:
    return MotionLog(name=recording.source, rate=recording.rate, duration=recording.duration)


@dataclass(frozen=True, slots=True)
class _AtRest:
    """A channel at rest: its facts, its model and its spectrum."""

    recording: Recording
    name: str
    model: NoiseModel
    spectrum: Spectrum


def _quiet(rest: Recording, name: str, models: Mapping[str, NoiseModel] | None) -> _AtRest:
    if models is not None and name not in models:
        raise InputError(f"no noise model of {name!r}; there are: {', '.join(models) or 'none'}")
    spectrum = _spectrum(rest, name)
    model = fit(rest, method="spectral", channel=name) if models is None else models[name]
    return _AtRest(rest, name, model, spectrum)


def _spectrum(recording: Recording, name: str) -> Spectrum:
    spectrum = power_spectrum(recording, name)
    if not len(spectrum.frequency):
        raise DataQualityError(
            f"{name} of {recording.source or 'the log'} is too short, or its gaps leave too little: record longer "
            f"(now {number(recording.duration)} s)"
        )
    return spectrum


@dataclass(frozen=True, slots=True)
class _ChannelPair:
    """A channel at rest and in motion, in the band [above, below) Hz."""

    quiet: _AtRest
    log: Recording
    moving: str
    band: tuple[float, float]
    confidence: float
    false_alarm: float
    fixed: bool


@dataclass(frozen=True, slots=True)
class _WhiteNoise:
    """White noise in motion and at rest: squares, and what lines add in motion with its ends."""

    motion: MeanDensity
    rest: MeanDensity
    lines: tuple[float, float, float]

    def judged(self, false_alarm: float) -> tuple[float, MotionVerdict]:
        """Two-sided chance of a ratio as different from 1, and what follows."""
        ratio = self.motion.value / self.rest.value
        larger = f_tail(ratio, self.motion.dof, self.rest.dof)
        smaller = f_tail(1 / ratio, self.rest.dof, self.motion.dof)
        p = min(2 * min(larger, smaller), 1.0)
        if p >= false_alarm:
            return p, MotionVerdict.UNCHANGED
        return p, MotionVerdict.INFLATED if ratio > 1 else MotionVerdict.LOWER


def _channel(pair: _ChannelPair) -> ChannelInMotion:
    quiet, (above, below) = pair.quiet, pair.band
    motion = _spectrum(pair.log, pair.moving)
    moving, still = (LogLevels.of(s, quiet.model, below) for s in (motion, quiet.spectrum))
    parts = [LogLevels.of(part, quiet.model, below) for part in _parts(pair.log, pair.moving)]
    in_motion, at_rest = moving.white(above), still.white(above)
    if in_motion is None or at_rest is None:
        raise DataQualityError(
            f"{pair.moving}: no points of both spectra from {number(above)} to {number(below)} Hz; record longer"
        )
    in_motion, steady = with_scatter(in_motion, [part.white(above) for part in parts])
    white = _WhiteNoise(in_motion, at_rest, moving.white_of_lines(above))
    p, verdict = white.judged(pair.false_alarm)
    slow = _over(moving.of_slow_terms(), still.of_slow_terms(), pair.confidence)
    facts = pair.log[pair.moving]
    kind, unit = facts.kind.rate.value, "" if facts.kind.has_si else facts.unit
    n_unit = si_unit(kind, "N", unit)
    lines, combs = lines_in_motion(motion, quiet.spectrum, si_unit(kind, "mean", unit))
    ends = in_motion.interval(pair.confidence)
    return ChannelInMotion(
        name=quiet.name,
        moving=pair.moving,
        log=pair.log.source,
        kind=kind,
        unit=unit,
        verdict=verdict,
        p=p,
        noise=_root(in_motion.value, ends, n_unit),
        inflation=_over(in_motion, at_rest, pair.confidence),
        with_lines=_root(
            in_motion.value + white.lines[0], (ends[0] + white.lines[1], ends[1] + white.lines[2]), n_unit
        ),
        slow=slow,
        steady=steady,
        bands=tuple(_bands(moving, still, parts, pair.confidence)),
        lines=lines,
        combs=combs,
        model=_told(pair, white, verdict, slow),
        at_rest=quiet.spectrum,
        in_motion=motion,
    )


def _parts(log: Recording, name: str) -> list[Spectrum]:
    """Spectra of the parts of a log."""
    alone, ends = log.select(name), np.linspace(0, log.n_samples, PARTS + 1).astype(int) / log.rate
    if log.n_samples < PARTS * LEAST:
        return []
    windows = (alone.window(float(a), float(b)) for a, b in itertools.pairwise(ends))
    return [power_spectrum(part, name) for part in windows]


def _root(value: float, ends: tuple[float, float], unit: str) -> Quantity:
    return Quantity.of(math.sqrt(value), (math.sqrt(ends[0]), math.sqrt(ends[1])), unit)


def _over(one: MeanDensity | None, other: MeanDensity | None, confidence: float) -> Quantity:
    """Root of the ratio of two levels; not resolved where one is missing."""
    if one is None or other is None:
        return Quantity.of(math.nan, (0.0, math.inf), "1")
    ratio, lower, upper = amplitude_ratio(one, other, confidence)
    return Quantity.of(ratio, (lower, upper), "1")


def _bands(
    moving: LogLevels, still: LogLevels, parts: Sequence[LogLevels], confidence: float
) -> Iterator[BandInflation]:
    for band in moving.bands():
        in_motion, at_rest = moving.of_band(band), still.of_band(band)
        if in_motion is None or at_rest is None:
            continue
        in_motion, steady = with_scatter(in_motion, [part.of_band(band) for part in parts])
        lower, upper = band_edges(band)
        yield BandInflation(
            lower=lower,
            upper=min(upper, moving.below),
            inflation=_over(in_motion, at_rest, confidence),
            steady=steady,
        )


def _told(pair: _ChannelPair, white: _WhiteNoise, verdict: MotionVerdict, slow: Quantity) -> NoiseModel:
    """The model to tell: larger N where motion adds noise or lines, larger slow terms where the body was held still."""
    line, line_lower, line_upper = white.lines
    rest, (above, below) = white.rest.value, pair.band
    ratio, lower, upper = (1.0, 1.0, 1.0)
    if verdict is MotionVerdict.INFLATED:
        ratio, lower, upper = (r**2 for r in amplitude_ratio(white.motion, white.rest, pair.confidence))
    total = ratio + line / rest
    share = line / rest / total
    if share > COUNTS:
        lower, upper = lower + line_lower / rest, upper + line_upper / rest
    else:
        total, share = ratio, 0.0
    facts = MotionInflation(
        log=pair.log.source,
        above=above,
        below=below,
        noise=math.sqrt(total),
        noise_lower=math.sqrt(lower),
        noise_upper=math.sqrt(upper),
        lines=share,
        slow=slow.value if pair.fixed and slow.resolved and slow.lower > 1 else 1.0,
        fixed=pair.fixed,
    )
    return told_model(pair.quiet.model, facts, math.sqrt(total * rest))
