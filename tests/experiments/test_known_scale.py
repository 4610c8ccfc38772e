# SPDX-License-Identifier: BSD-3-Clause
"""The uncertainty of a scale factor that channels carry enters what the Earth's rotation tells, as if it was stated."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.experiments.alignment import align
from allanite.experiments.earth_rate import measure_earth_rate
from allanite.experiments.north import find_north
from allanite.experiments.rate_vector import measure_rate_vector
from allanite.experiments.reversals import Position, Reversals
from allanite.filtering.simulation import Motion, UnitMotion, simulate_unit
from allanite.noise import NoiseModel, White
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.recording.records import Kind, Recording

LATITUDE = math.radians(48)
NOISE = NoiseModel.of(White(N=1e-6))
Measured = tuple[Recording, Callable[..., Any]]


def earth_rate() -> Measured:
    record = al.simulate(
        NOISE, rate=32.0, duration=360.0, seed=1, motion=Motion.reversals(30.0), latitude=LATITUDE
    )
    return record, lambda r, **given: measure_earth_rate(
        r, latitude=LATITUDE, model=NOISE, first="north", **given
    )


def north() -> Measured:
    headings, dwell = np.radians([0.0, 90.0, 180.0, 270.0]), 200
    where = Reversals.cut(
        rate=1.0,
        n_samples=4 * dwell,
        turns=(),
        positions=tuple(
            Position(start=i * dwell, stop=(i + 1) * dwell, heading=h, sign=0) for i, h in enumerate(headings)
        ),
        source="file",
        first="unknown",
        dead_time=0.0,
    )
    seen = EARTH_RATE * math.cos(LATITUDE) * np.cos(1.0 + np.repeat(headings, dwell))
    seen += 1e-6 * np.random.default_rng(1).standard_normal(len(seen))
    record = Recording.from_rate(seen, rate=1.0, unit="rad/s", names="gyro")
    return record, lambda r, **given: find_north(r, latitude=LATITUDE, model=NOISE, positions=where, **given)


def vector() -> Measured:
    noise = 1e-6 * np.random.default_rng(1).standard_normal((3000, 3))
    rates = EARTH_RATE * np.array([math.cos(LATITUDE), 0.0, math.sin(LATITUDE)]) + noise
    return Recording.from_rate(rates, rate=20.0, unit="rad/s"), measure_rate_vector


def alignment() -> Measured:
    attitudes = [tuple(np.radians(a)) for a in ((3, -8, 100), (-5, 6, 265))]
    motion = UnitMotion.positions(attitudes, dwell=40.0, turn=4.0)
    noise = {"gyro": NOISE, "accelerometer": NoiseModel.of(White(N=1e-4), kind="acceleration")}
    record = simulate_unit(noise, motion=motion, axes="FLU", rate=20.0, latitude=LATITUDE, seed=1)
    models = {c.name: noise["gyro" if c.kind is Kind.RATE else "accelerometer"] for c in record.channels}
    return record, lambda r, **given: align(r, latitude=LATITUDE, model=models, checkpoints=4, **given)


@pytest.mark.parametrize("experiment", [earth_rate, north, vector, alignment])
def test_the_channels_state_the_uncertainty_of_their_scale_unless_the_caller_does(
    experiment: Callable[[], Measured],
) -> None:
    record, measure = experiment()
    known = replace(record, channels=tuple(replace(c, scale_uncertainty=0.2) for c in record.channels))
    bare, stated = measure(record), measure(record, stated=SetupUncertainty(scale=0.2))
    assert bare.to_json() != stated.to_json() == measure(known).to_json()
    told = SetupUncertainty(scale=0.1)
    assert measure(known, stated=told).to_json() == measure(record, stated=told).to_json()
    leaning, both = SetupUncertainty(tilt=0.01), SetupUncertainty(scale=0.2, tilt=0.01)
    assert measure(known, stated=leaning).to_json() == measure(record, stated=both).to_json()
