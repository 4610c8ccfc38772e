# SPDX-License-Identifier: BSD-3-Clause
"""From a turned recording to the Earth rate: the regression, its checks, its interval and its verdict."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.earth_rate.dwell_means import DwellMeans
from allanite.experiments.earth_rate.noise_of_record import fit_noise
from allanite.experiments.earth_rate.quantile import needed_quantile, quantile_of
from allanite.experiments.earth_rate.residuals import residual_checks
from allanite.experiments.earth_rate.results import (
    G_SENSITIVITY,
    DwellMean,
    EarthRateEstimate,
    RateReading,
    RunningEstimate,
    SettlingFit,
    UndecidedNoise,
)
from allanite.experiments.earth_rate.take import RATE, TIME_CONSTANT, Take, Transient
from allanite.experiments.earth_rate.verdict import EarthRateVerdict, NoiseOrigin
from allanite.experiments.reversals import Reversals, find_reversals
from allanite.experiments.reversals.sides import is_vertical, sign_at_first
from allanite.experiments.reversals.turned_over import TurnedOver, turned_over
from allanite.experiments.reversals.turns import DEAD_TIME
from allanite.experiments.setup import setup_of
from allanite.filtering.regression import LEVEL, Regression
from allanite.noise import NoiseModel, White
from allanite.quantities.earth import EARTH_RATE, checked_latitude
from allanite.quantities.quantity import Quantity, QuantityStatus
from allanite.quantities.residual_tests import SEEN, grave, inflation_of
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.quantities.units import STANDARD_GRAVITY
from allanite.recording.records import Kind, Recording
from allanite.recording.thermometers import checked_thermometer

__all__ = ["measure_earth_rate"]

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]


#: Other dead times that are tried [s].
DEAD_TIMES = (0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0)


def measure_earth_rate(
    recording: Recording,
    *,
    latitude: float,
    model: NoiseModel | None = None,
    channel: str | None = None,
    reversals: Reversals | None = None,
    first: str | None = None,
    dead_time: float | None = None,
    settling: bool = False,
    warm_up: bool = False,
    temperature: str | None = None,
    stated: SetupUncertainty | None = None,
    g_sensitivity: float = 0.0,
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> EarthRateEstimate:
    """The Earth's rotation rate from one axis that was turned between north and south, or between up and down.

    Parameters
    ----------
    recording : Recording
        Record of rates with a unit; it may contain the turns.
    latitude : float [rad]
        Latitude, not at a pole, where the horizontal axis does not see the Earth; off the equator for a vertical axis.
    model : NoiseModel, optional
        Noise model of the sensor at rest. Without it white noise and flicker are fitted to this record, and the
        interval is widened for that.
    channel : str, optional
        Needed where the recording has several rates.
    reversals : Reversals, optional
        Turns of the sensor, with their `first` and `dead_time`; by default detected in the signal.
    first : "north", "south", "up", "down" or None
        Direction of the first dwell, which one axis cannot tell: with None the sign of the rate is a choice, and the
        axis is taken for horizontal.
    dead_time : float, optional [s]
        Left out after each turn; 2 s by default.
    settling, warm_up : bool
        Fit a rotation that settles after each turn, or an exponential warm-up, with the rate.
    temperature : str, optional
        Name of a temperature channel to fit with the rate.
    stated : SetupUncertainty, optional
        Uncertainties of scale factor (by default that of the channel), latitude, tilt and heading.
    g_sensitivity : float [rad/s/(m/s^2)]
        Standard uncertainty of the rate that gravity along an axis adds, for an axis turned between up and down; 0 if
        not stated.
    confidence : float
        Confidence level of the interval.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Returns
    -------
    EarthRateEstimate

    Raises
    ------
    InputError
        A latitude at which the axis sees nothing, an uncertainty that such an axis does not have, a channel that is no
        rate, no usable samples, `first` or `dead_time` beside `reversals`.

    Notes
    -----
    y(t) = Omega cos(latitude) s(t) + level + X(t) c + noise, with the sine for a vertical axis, by
    `allanite.filtering.regression.regress`. Excess scatter of the dwells (p < 0.01) or of the noise (p < 0.001)
    multiplies the standard deviation by the root of chi-square over its expectation (R. T. Birge, Phys. Rev. 40 (1932)
    207). A record without reversals gives no rate: bias and Earth are one constant there.
    """
    vertical = is_vertical(first if reversals is None else reversals.first)
    _refuse(latitude, confidence, stated or SetupUncertainty(), g_sensitivity, vertical=vertical)
    advance = progress or (lambda fraction, what: None)
    name = rate_channel(recording, channel)
    uncertainties = setup_of(stated, (recording[name],))
    if temperature is not None:
        checked_thermometer(recording, temperature, (name,))
    if reversals is None:
        advance(0.0, "looking for the turns")
        dead = DEAD_TIME if dead_time is None else dead_time
        reversals = find_reversals(recording, channel=name, first=first, dead_time=dead)
    elif first is not None or dead_time is not None:
        raise InputError("the reversals that are given have their own first direction and dead time")
    advance(0.3, "averaging")
    take = Take.of(recording, name, reversals, latitude, temperature, model=model)
    source, undecided = NoiseOrigin.GIVEN, None
    if model is None:
        advance(0.4, "fitting the noise of this record")
        model, source = fit_noise(take), NoiseOrigin.RECORD
    else:
        model, undecided = _cautious(take, model)
    advance(0.7, "fitting the rate")
    decays = (take.best(model, "settling") if settling else []) + (
        take.best(model, "warm-up") if warm_up else []
    )
    estimate = _estimate(take, model, source, decays, (uncertainties, g_sensitivity), confidence)
    return replace(estimate, undecided=undecided)


def rate_channel(recording: Recording, channel: str | None) -> str:
    """The channel of rates that is meant.

    Raises
    ------
    InputError
        None, several and no choice, or one whose unit is not that of a rate.
    """
    rates = [c.name for c in recording.channels if c.kind is Kind.RATE]
    if channel is None:
        if len(rates) == 1:
            return rates[0]
        has = ", ".join(f"{c.name} ({c.kind.value})" for c in recording.channels)
        raise InputError(
            f"{'no channel' if not rates else 'more than one channel'} of rates: {has}. "
            + ("Say which with channel=" if rates else "Give the unit, e.g. deg/s, or the scale factor")
        )
    if recording[channel].kind is not Kind.RATE:
        raise InputError(
            f"channel {channel!r} is one of {recording[channel].kind.value}, not of rates: give its unit, e.g. deg/s, "
            "or its scale factor"
        )
    return channel


def _refuse(
    latitude: float, confidence: float, stated: SetupUncertainty, g_sensitivity: float, *, vertical: bool
) -> None:
    checked_latitude(latitude, vertical=vertical)
    if not (isinstance(g_sensitivity, (int, float)) and math.isfinite(g_sensitivity) and g_sensitivity >= 0):
        raise InputError(
            f"the stated g-sensitivity must be finite and not negative [rad/s/(m/s^2)], not {g_sensitivity!r}"
        )
    if vertical and stated.heading:
        raise InputError(
            "a vertical axis has no heading: state how far it leans (--tilt), leave --heading-uncertainty out"
        )
    if g_sensitivity and not vertical:
        raise InputError(
            "--g-sensitivity is for an axis that is turned between up and down (--first up): gravity does not change "
            "along a level one"
        )
    if not 0.5 <= confidence < 1:
        raise InputError(f"confidence must be from 0.5 to below 1, not {confidence!r}")


def _cautious(take: Take, model: NoiseModel) -> tuple[NoiseModel, UndecidedNoise | None]:
    """Of the families that the record at rest leaves open, the one with the wider interval; and what that means.

    Raises
    ------
    InputError
        A noise model of something else than a rate.
    """
    if model.kind != Kind.RATE:
        raise InputError(f"the noise model is one of {model.kind}, channel {take.channel!r} holds rates")
    families = sorted((take.fit(m)[RATE][1], k, m) for k, m in enumerate(model.families))
    if len(families) == 1 or not math.isfinite(families[-1][0]):
        return model, None
    (small, _, narrow), (large, _, wide) = families
    return wide, UndecidedNoise(family=wide.family, other=narrow.family, narrower=1 - small / large)


def _estimate(
    take: Take,
    model: NoiseModel,
    source: NoiseOrigin,
    decays: list[Transient],
    stated: tuple[SetupUncertainty, float],
    confidence: float,
) -> EarthRateEstimate:
    fit = take.fit(model, decays, running=True)
    dwells = DwellMeans.of(take, model, decays)
    separable = RATE not in fit.unbounded
    checks = (*residual_checks(fit, take, model, decays), *(dwells.checks() if separable else ()))
    rate, sd = fit[RATE]
    flip = -1.0 if take.reversals.first == "unknown" and rate < 0 else 1.0
    readings = dwells.readings()
    inflation = inflation_of(checks)
    if source is NoiseOrigin.RECORD:
        inflation = max(inflation, _own_scatter(readings, sd))
    budget = {"noise": sd * inflation, **_stated(take, *stated)}
    total = math.sqrt(sum(v**2 for v in budget.values()))
    pairs = next((r.count for r in readings if r.name == "pairs"), 0)
    half = quantile_of((1 + confidence) / 2, source, pairs) * total
    is_resolved = abs(rate) >= needed_quantile(source, pairs) * total
    estimate = EarthRateEstimate(
        verdict=EarthRateVerdict.NOT_SEPARABLE,
        rotation=Quantity(
            value=flip * rate,
            lower=flip * rate - half,
            upper=flip * rate + half,
            unit="rad/s",
            status=QuantityStatus.RESOLVED if is_resolved else QuantityStatus.NOT_RESOLVED,
        ),
        sd=sd * inflation,
        total_sd=total,
        confidence=confidence,
        inflation=inflation,
        bias=_bias(take, model, decays, fit),
        nuisances={n: fit[n] for n in fit.names if n not in (RATE, LEVEL) and not n.endswith(TIME_CONSTANT)},
        budget=budget,
        readings=tuple(replace(r, rate=flip * r.rate, sd=r.sd * inflation) for r in readings),
        running=_running(take, fit, dwells, flip, inflation),
        dwells=_dwell_table(take, model, fit, decays),
        checks=checks,
        dead_times=_dead_times(take, model, decays, flip, inflation) if separable else np.zeros((0, 3)),
        latitude=take.latitude,
        first=take.reversals.first,
        model=model,
        model_source=source,
        reversals=take.reversals,
        duration=take.recording.duration,
        block=take.blocks.dt,
        channel=take.channel,
        source=take.recording.source,
    )
    over = turned_over(take.recording, take.channel, take.reversals.positions)
    along_first = rate * take.projection * sign_at_first(take.reversals.first)
    judged = replace(estimate, verdict=_judge(estimate, separable=separable), turned_over=over)
    return replace(
        judged, rate_if_up=_if_up(judged, over, along_first), settling=_settling(judged, take, decays)
    )


def _judge(estimate: EarthRateEstimate, *, separable: bool) -> EarthRateVerdict:
    """The verdict on an estimate that has none yet."""
    if not separable:
        return EarthRateVerdict.NOT_SEPARABLE
    if grave(estimate.checks):
        return EarthRateVerdict.INCONSISTENT
    if not estimate.rotation.resolved:
        return EarthRateVerdict.CONTRADICTS if estimate.hides_earth else EarthRateVerdict.NOT_RESOLVED
    low, high = estimate.interval
    if not low <= EARTH_RATE <= high:
        return EarthRateVerdict.CONTRADICTS
    return EarthRateVerdict.WITH_GRAVITY if estimate.bounds_sum else EarthRateVerdict.RESOLVED


def _if_up(estimate: EarthRateEstimate, over: TurnedOver | None, along_first: float) -> float | None:
    """The rate of a vertical axis, where a level one contradicts the Earth and that one does not.

    Parameters
    ----------
    over : TurnedOver or None
        What the accelerometers say; where they show it, nothing is left to guess.
    along_first : float [rad/s]
        The measured component along the direction of the first dwell.
    """
    shown = over is not None and over.along
    if is_vertical(estimate.first) or not estimate.reversals.turns or shown or not estimate.latitude:
        return None
    tangent = math.tan(estimate.latitude)
    low, high = sorted(abs(end / tangent) for end in estimate.interval)
    if estimate.verdict is not EarthRateVerdict.CONTRADICTS or not low <= EARTH_RATE <= high:
        return None
    return along_first / math.sin(estimate.latitude)


def _stated(take: Take, stated: SetupUncertainty, g_sensitivity: float) -> dict[str, float]:
    """Stated uncertainties of the rate [rad/s]; what follows gravity is reversed with an axis that is turned over."""
    vertical = is_vertical(take.reversals.first)
    relative = (stated.budget_of_vertical if vertical else stated.budget)(take.latitude)
    follows = g_sensitivity * STANDARD_GRAVITY / abs(take.projection)
    return {
        **{source: share * EARTH_RATE for source, share in relative.items()},
        **({G_SENSITIVITY: follows} if vertical else {}),
    }


def _settling(estimate: EarthRateEstimate, take: Take, decays: list[Transient]) -> SettlingFit | None:
    """A rate that contradicts the known one: would a settling explain it?"""
    fitted = any(d.kind == "settling" for d in decays)
    if fitted or estimate.verdict is not EarthRateVerdict.CONTRADICTS:
        return None
    best = take.best(estimate.model, "settling")
    if not best:
        return None
    value, sd = take.fit(estimate.model, [*decays, *best])[RATE]
    rate = -value if estimate.first == "unknown" and value < 0 else value
    sd *= estimate.inflation
    # one that is too small to be seen by itself may still bring the rate back to the known one
    explains = abs(rate - EARTH_RATE) < min(SEEN * sd, abs(estimate.rate - EARTH_RATE))
    return SettlingFit(T=best[0].T, rate=rate, sd=sd) if explains else None


def _own_scatter(readings: tuple[RateReading, ...], sd: float) -> float:
    """Where the noise comes from this record, the scatter of its pairs is asked too."""
    ratios = [r.scatter / sd for r in readings if r.name == "pairs" and r.scatter is not None]
    return max([1.0, *ratios])


def _bias(take: Take, model: NoiseModel, decays: list[Transient], fit: Regression) -> tuple[float, float]:
    """The level; where it cannot be told from the rate, that of a fit without the rate."""
    if LEVEL not in fit.unbounded:
        return fit[LEVEL]
    table, names = take.design(decays)
    return take.regress(table[:, 1:], names[1:], model)[LEVEL]


def _running(
    take: Take, fit: Regression, dwells: DwellMeans, flip: float, inflation: float
) -> RunningEstimate:
    time = np.asarray(take.checkpoints() * take.blocks.dt, dtype=np.float64)
    rate, sd = fit.running[:, 0, 0], fit.running[:, 1, 0]
    members, weights = dwells.pairs()
    values, ends = (weights * dwells.mean[members]).sum(axis=1), dwells.middle[members[:, 1]]
    so_far = np.searchsorted(ends, time, side="right")
    sums = np.concatenate([[np.nan], np.cumsum(values) / np.arange(1, len(values) + 1)])
    return RunningEstimate(time=time, rate=flip * rate, sd=sd * inflation, pairs=flip * sums[so_far])


def _dwell_table(
    take: Take, model: NoiseModel, fit: Regression, decays: list[Transient]
) -> tuple[DwellMean, ...]:
    """Means of all dwells, and what the fit leaves of them."""
    n = len(take.reversals.dwells)
    mean, whole = take.blocks.of_spans(n)
    explained = np.nan_to_num(take.design(decays)[0]) @ np.nan_to_num(fit.coefficients)
    left, _ = replace(take.blocks, mean=take.blocks.mean - explained).of_spans(n)
    white = math.sqrt(sum(t.N**2 for t in model.terms if isinstance(t, White)))
    rate = take.recording.rate
    return tuple(
        DwellMean(
            start=d.start / rate,
            stop=d.stop / rate,
            sign=d.sign,
            mean=float(mean[i]),
            sd=white / math.sqrt(whole[i] * take.blocks.dt) if whole[i] > 0 else math.inf,
            residual=float(left[i]),
        )
        for i, d in enumerate(take.reversals.dwells)
    )


def _dead_times(
    take: Take, model: NoiseModel, decays: list[Transient], flip: float, inflation: float
) -> Array:
    """The estimate for other dead times, as long as half of a short dwell remains."""
    turns = np.array([t.stop for t in take.reversals.turns]) / take.reversals.rate
    room = float(np.quantile(np.diff(turns), 0.2)) / 2 if len(turns) > 1 else 0.0
    rows = []
    for dead in [d for d in DEAD_TIMES if d <= room]:
        again = take.with_dead_time(dead)
        value, sd = again.fit(model, decays)[RATE]
        rows.append((dead, flip * value, sd * inflation))
    return np.array(rows).reshape(-1, 3)
