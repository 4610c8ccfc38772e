# SPDX-License-Identifier: BSD-3-Clause
"""East and west: there the Earth adds nothing, and what still follows the turns is an error."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from allanite.experiments.north.checks import NorthCheck
from allanite.experiments.north.circle import half_width, seen_from
from allanite.experiments.north.estimation import check_latitude
from allanite.experiments.north.results import EastWestNull
from allanite.experiments.north.scatter import Means
from allanite.experiments.north.tracks import Track, axes_of, tracks_of
from allanite.experiments.north.verdict import NorthCheckKind, NullVerdict
from allanite.experiments.reversals import Reversals
from allanite.filtering.regression import LEVEL, Regression, regress
from allanite.noise import NoiseModel
from allanite.noise.given_models import models_of
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.quantity import Quantity
from allanite.quantities.residual_tests import grave, inflation_of, scatter_check, size_check
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.recording.records import Recording

__all__ = ["east_west_null"]

#: Dwells within so much of east or west count [rad].
NEAR = math.radians(45.0)


def east_west_null(
    recording: Recording,
    *,
    model: NoiseModel,
    latitude: float,
    positions: Reversals,
    channel: str | None = None,
    stated: SetupUncertainty | None = None,
    confidence: float = 0.95,
) -> EastWestNull:
    """Does a bias follow the turns?

    A magnetic field, gravity on a leaning table or the hand that turns can add a bias that changes sign with the
    direction, and no estimator tells it from the Earth's rotation. Turned between east and west instead of north and
    south, the axis sees no Earth, and the bias alone remains.

    Parameters
    ----------
    recording : Recording
        Recording of the turned sensor.
    model : NoiseModel
        Noise model of the sensor at rest.
    latitude : float [rad]
        Latitude of the place.
    positions : Reversals
        Dwells with the heading of the sensitive axis from north over east; those within 45 deg of east or west are
        used, and the little of the Earth that a known heading lets in is removed.
    channel : str, optional
        Needed where the recording has several rates.
    stated : SetupUncertainty, optional
        Uncertainty of the heading, taken as common to all dwells, and of the tilt towards the east: both let in some
        of the Earth, to first order.
    confidence : float
        Confidence level of the interval.

    Raises
    ------
    InputError
        A latitude at a pole, a channel that is no rate, no dwell near east or west.

    Notes
    -----
    y(t) - Omega cos(latitude) cos(heading) = b sin(heading) + level + noise. The test sees the part of a bias that
    changes between east and west: one that points along north and south on the ground (a field) shows in the Earth
    rate and not here, one that the act of turning makes shows in both.
    """
    check_latitude(latitude)
    seen_from(confidence)  # refuses a confidence that makes no sense
    axes = axes_of(recording, channel)
    near = tuple(
        d for d in positions.dwells if math.isfinite(d.heading) and abs(math.sin(d.heading)) >= math.cos(NEAR)
    )
    models = models_of(model, {name: recording[name].kind for name in axes})
    (track,) = tracks_of(recording, axes, models, replace(positions, dwells=near), None)
    horizontal = EARTH_RATE * math.cos(latitude)
    fit = regress(
        track.blocks.mean - horizontal * track.cosine,
        np.column_stack([track.sine, np.ones(track.blocks.size)]),
        model,
        dt=track.blocks.dt,
        names=("bias", LEVEL),
        counts=np.where(track.used, track.blocks.part, 0.0),
        sampling=track.sampling,
    )
    uncertainties = stated or SetupUncertainty()
    # a heading off by h lets in Omega cos(latitude) h, a lean b to the east Omega sin(latitude) b
    letting_in = {
        "heading": horizontal * uncertainties.heading,
        "tilt": EARTH_RATE * abs(math.sin(latitude)) * uncertainties.tilt,
    }
    result = _result(track, fit, letting_in, latitude, confidence, recording)
    return replace(result, model=model, reversals=positions)


def _result(
    track: Track,
    fit: Regression,
    letting_in: dict[str, float],
    latitude: float,
    confidence: float,
    recording: Recording,
) -> EastWestNull:
    checks = [NorthCheck.of(NorthCheckKind.SIZE, size_check(fit.chi2, fit.dof))]
    means = Means.of(track)
    if means is not None and len(means.mean) > 2:
        whitened_sines = means.whitener @ np.sin(means.heading)
        left = means.whitener @ (means.mean - EARTH_RATE * math.cos(latitude) * np.cos(means.heading))
        left -= whitened_sines * (whitened_sines @ left) / (whitened_sines @ whitened_sines)
        test = scatter_check("positions", float(left @ left), len(left) - 1)
        checks.append(NorthCheck.of(NorthCheckKind.SCATTER, test))
    inflation = inflation_of(checks)
    value, sd = fit["bias"]
    budget = {"noise": sd * inflation, **letting_in}
    total = math.sqrt(sum(v**2 for v in budget.values()))
    half = half_width(confidence) * total
    result = EastWestNull(
        verdict=NullVerdict.NOT_SEPARABLE,
        following=Quantity.of(value, (value - half, value + half), "rad/s"),
        sd=sd * inflation,
        total_sd=total,
        confidence=confidence,
        inflation=inflation,
        bias=fit[LEVEL],
        budget=budget,
        checks=tuple(checks),
        latitude=latitude,
        channel=track.name,
        source=recording.source,
    )
    return replace(result, verdict=_verdict(result, separable="bias" not in fit.unbounded))


def _verdict(result: EastWestNull, *, separable: bool) -> NullVerdict:
    if not separable:
        return NullVerdict.NOT_SEPARABLE
    if grave(result.checks):
        return NullVerdict.INCONSISTENT
    low, high = result.interval
    return NullVerdict.NONE if low <= 0 <= high else NullVerdict.FOLLOWS
