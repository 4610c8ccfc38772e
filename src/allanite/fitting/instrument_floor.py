# SPDX-License-Identifier: BSD-3-Clause
"""The instrument's own noise, from a record of its shorted input, removed from the curve of a sensor read through it.

Sensor and instrument are independent, so their Allan variances add. `floor_of` brings the floor into the channels of
the recording, through the same scale factor; `over_floor` takes one curve from the other, lag by lag; the noise model
of the sensor without the instrument is fitted to both curves together (`allanite.fitting.instrument`), for a
difference of two curves is no longer what a fit may weigh as one.

The interval of a difference of two independent variances v - f, each with its own interval (l, u), is [1, 2]

    v - f - sqrt((v - l_v)^2 + (u_f - f)^2)   to   v - f + sqrt((u_v - v)^2 + (f - l_f)^2),

which becomes that of v alone where f is small, and no chi-square law is pretended where they are alike. Where its lower
end is not above zero the sensor is *not resolved* at that lag: the upper end is then a limit, and there is no value.

What a shorted input does not show: the current noise of the input in the sensor's own resistance, and what the
leads pick up.

References
----------
.. [1] F. Graybill, C. Wang, "Confidence intervals on nonnegative linear combinations of variances", JASA 75 (1980) 869;
   for differences N. Ting et al., "Confidence intervals on linear combinations of variance components that are
   unrestricted in sign", J. Statist. Comput. Simul. 35 (1990) 135.
.. [2] G. Zou, A. Donner, "Construction of confidence limits about effect measures", Statist. Med. 27 (2008) 1693.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, InputError
from allanite.fitting.sensor_curves import OverFloor
from allanite.noise.allan import AllanCurve, allan_curve
from allanite.quantities.units import parse_unit
from allanite.recording.health.examination import check, prepare
from allanite.recording.health.finding import Finding, Severity, finding, percent
from allanite.recording.records import Channel, Recording

__all__ = [
    "SAME_RATE",
    "floor_findings",
    "floor_of",
    "over_floor",
    "quiet_curve",
    "ready_floor",
    "variance_difference",
]

Array = NDArray[np.float64]

#: Rates that differ by less, relative, are one setting seen by two clocks.
SAME_RATE = 1e-3
#: Findings that say nothing of a shorted input: it has no bias, no gravity, and the noise of no gyro.
_NOT_OF_A_SHORT = frozenset(
    {"bias_removed", "gravity", "unit_trap", "unit_missing", "counts", "duplicate_channels"}
)


def floor_of(recording: Recording, floor: Recording) -> Recording:
    """The floor under the names, and in the physical units, of the channels of a recording.

    Parameters
    ----------
    recording : Recording
        Of the sensor through the instrument.
    floor : Recording
        Of the instrument alone, with the same settings. A channel of the same name is the floor of that channel; a
        single channel is that of all.

    Returns
    -------
    Recording
        One channel for each noise-bearing channel of `recording`.

    Raises
    ------
    InputError
        Another rate, sampling or aperture, a channel without a floor, or units that do not fit.
    """
    if abs(floor.rate / recording.rate - 1.0) > SAME_RATE:
        raise InputError(
            f"the floor was recorded at {floor.rate:.9g} Hz, the sensor at {recording.rate:.9g} Hz: the "
            "noise of an instrument depends on its settings and does not follow from another rate; "
            "record the shorted input with the settings of the sensor"
        )
    named = [c for c in recording.channels if c.kind.noise_bearing]
    pairs = [(c, _own(c, floor)) for c in named]
    return replace(
        floor,
        rate=recording.rate,
        channels=tuple(_as(c, shorted) for c, shorted in pairs),
        columns=tuple(floor.columns[floor.index(shorted.name)] for _, shorted in pairs),
    )


def _own(channel: Channel, floor: Recording) -> Channel:
    """The channel of the floor that belongs to one of the sensor."""
    candidates = [c for c in floor.channels if c.kind.noise_bearing]
    for c in candidates:
        if c.name == channel.name:
            return c
    if len(candidates) == 1:
        return candidates[0]
    names = ", ".join(c.name for c in candidates) or "none"
    raise InputError(
        f"channel {channel.name!r} has no floor: the channels of the floor are {names}. Use the names of "
        "the sensor, or a floor with a single channel for all"
    )


def _as(channel: Channel, shorted: Channel) -> Channel:
    """What the floor's samples are once they have gone through the sensor's scale factor."""
    for what, mine, other in (
        ("sampling", channel.sampling, shorted.sampling), ("aperture", channel.aperture, shorted.aperture)
    ):  # fmt: skip
        if mine != other:
            raise InputError(
                f"channel {channel.name!r} has {what} {_said(mine)}, its floor {_said(other)}: record the shorted "
                "input with the settings of the sensor"
            )
    return replace(channel, scale=_scale(channel, shorted))


def _said(value: object) -> str:
    return "not stated" if value is None else repr(value)


def _scale(channel: Channel, shorted: Channel) -> float:
    if shorted.kind is channel.kind and (channel.kind.has_si or shorted.unit == channel.unit):
        return shorted.scale
    if shorted.unit and channel.unit:
        mine, other = parse_unit(channel.unit), parse_unit(shorted.unit)
        if mine.quantity is other.quantity and not channel.kind.integrated and not shorted.kind.integrated:
            return (
                channel.scale * other.factor / mine.factor
            )  # both as written: volts through the scale factor
    raise InputError(
        f"channel {channel.name!r} is written in {channel.unit or 'an unknown unit'!s} ({channel.kind.value}), its "
        f"floor in {shorted.unit or 'an unknown unit'!s} ({shorted.kind.value}): the floor must have the "
        "unit of the samples, or that of the sensor"
    )


# -- the difference of two curves -------------------------------------------------------------------------


def variance_difference(
    v: Array, v_ends: tuple[Array, Array], f: Array, f_ends: tuple[Array, Array]
) -> tuple[Array, Array, Array]:
    """Difference of independent variances with its interval: estimate, lower, upper; either end may be negative."""
    d = v - f
    lower = d - np.hypot(v - v_ends[0], f_ends[1] - f)
    upper = d + np.hypot(v_ends[1] - v, f - f_ends[0])
    return d, lower, upper


def over_floor(measured: AllanCurve, floor: Recording | AllanCurve) -> OverFloor:
    """The curve of a sensor without its instrument, lag by lag.

    Parameters
    ----------
    measured : AllanCurve
        Of sensor and instrument, oadev.
    floor : Recording or AllanCurve
        Of the instrument, as `floor_of` gives it; a curve must have the lags of `measured`, or fewer.

    Returns
    -------
    OverFloor
        NaN at lags that the floor's record is too short for.

    Raises
    ------
    InputError
        Another statistic or other channels.
    DataQualityError
        No lag in common.
    """
    if measured.statistic != "oadev":
        raise InputError(f"a floor is removed from the oadev curve, not from {measured.statistic}")
    below = floor if isinstance(floor, AllanCurve) else _curve_of(floor, measured)
    if below.names != measured.names:
        raise InputError(
            f"the floor has the channels {', '.join(below.names)}, the curve {', '.join(measured.names)}"
        )
    below = _at(below, measured.lags)
    d, lower, upper = variance_difference(
        measured.variance,
        (measured.lower**2, measured.upper**2),
        below.variance,
        (below.lower**2, below.upper**2),
    )
    with np.errstate(invalid="ignore"):
        resolved = lower > 0.0
        known = np.isfinite(upper)
        deviation = np.sqrt(np.where(resolved, d, np.nan))
        low = np.where(known, np.sqrt(np.maximum(lower, 0.0)), np.nan)
        high = np.sqrt(np.where(known & (upper > 0.0), upper, np.nan))
    return OverFloor(measured=measured, floor=below, deviation=deviation, lower=low, upper=high)


def _curve_of(floor: Recording, like: AllanCurve) -> AllanCurve:
    """The curve of the floor at those lags of another that it is long enough for."""
    lags = like.lags[like.lags <= (floor.n_samples - int(floor.channels[0].kind.integrated)) // 3]
    if len(lags) == 0:
        raise DataQualityError(
            f"the floor's {floor.n_samples} samples cover none of the lags of the curve: record the "
            "shorted input longer"
        )
    return allan_curve(floor, taus=lags * floor.dt, confidence=like.confidence)


def _at(curve: AllanCurve, lags: NDArray[np.int64]) -> AllanCurve:
    """A curve on other lags: NaN where it has none."""
    place = np.searchsorted(curve.lags, lags)
    here = (place < len(curve.lags)) & (curve.lags[np.minimum(place, len(curve.lags) - 1)] == lags)
    place = np.where(here, place, 0)

    def spread(values: NDArray[Any], nothing: float) -> NDArray[Any]:
        return np.where(here[:, None], values[place], nothing)

    return replace(
        curve,
        lags=lags,
        tau=lags.astype(np.float64) * curve.dt,
        deviation=spread(curve.deviation, np.nan),
        lower=spread(curve.lower, np.nan),
        upper=spread(curve.upper, np.nan),
        edf=spread(curve.edf, np.nan),
        count=spread(curve.count, 0).astype(np.int64),
        excluded=spread(curve.excluded, 0).astype(bool),
    )


# -- as an analysis takes it ------------------------------------------------------------------------------


def ready_floor(
    recording: Recording, floor: Recording, *, accept: Collection[str] = ()
) -> tuple[Recording, tuple[Finding, ...]]:
    """The floor of a recording, looked through for faults; see `floor_of`.

    Raises
    ------
    DataQualityError
        A fatal finding in the record of the floor that was not accepted.
    """
    findings = [f for f in check(floor) if f.code not in _NOT_OF_A_SHORT]
    try:
        ready, left_over = prepare(floor, findings, accept=accept)
    except DataQualityError as refusal:
        raise DataQualityError(f"the record of the floor: {refusal}", refusal.findings) from None
    return floor_of(recording, ready), left_over


def quiet_curve(floor: Recording, name: str, confidence: float) -> AllanCurve:
    """The curve of one channel of a floor as a fit takes it: steady lines gone, lags that others bend marked."""
    from allanite.noise.spectrum.estimation import power_spectrum
    from allanite.noise.spectrum.exclusion import lags_to_exclude
    from allanite.noise.spectrum.stability import without_stable_lines

    spectrum = power_spectrum(floor, name)
    alone = without_stable_lines(floor, spectrum)
    curve = allan_curve(alone, confidence=confidence)
    bent = lags_to_exclude(
        power_spectrum(alone, name), curve.tau, avar=curve.variance[:, 0], edf=curve.edf[:, 0]
    )
    return replace(curve, excluded=np.asarray(bent.excluded, dtype=bool)[:, None])


def floor_findings(above: OverFloor, floor: Recording, used: NDArray[np.bool_]) -> list[Finding]:
    """That the floor of one channel was removed, and where little is left.

    Parameters
    ----------
    above : OverFloor
        Of one channel.
    used : ndarray of bool, shape (n_lags,)
        Lags that the fit of the measured curve uses.
    """
    name, tau = above.names[0], above.tau
    share = above.share()[:, 0]
    first = int(np.argmax(np.isfinite(share)))
    findings = [
        finding(
            "floor_taken_off",
            f"{name}: the instrument's own noise ({floor.source or 'samples in memory'}, {floor.duration:.6g} s) is "
            f"removed; it is {percent(float(share[first]))} of the variance at {tau[first]:.3g} s",
            severity=Severity.INFO,
            channel=name,
            count=0,
        )
    ]
    most, unknown = used & (share > 0.5), used & np.isnan(share)
    statements = []
    if most.any():
        statements.append(
            f"it makes {percent(float(np.nanmax(share[most])))} of the variance at the worst lag, and more than half "
            f"at {int(most.sum())} of {int(used.sum())} lags"
        )
    if unknown.any():
        statements.append(f"its record is too short for lags from {float(tau[unknown][0]):.3g} s on")
    if statements:
        findings.append(
            finding(
                "floor_dominates",
                f"{name}: of the instrument's noise, {'; '.join(statements)}",
                severity=Severity.WARNING,
                channel=name,
                count=int(most.sum() + unknown.sum()),
            )
        )
    return findings
