# SPDX-License-Identifier: BSD-3-Clause
"""The live curve: that of a file with the same samples, whatever the pieces."""

from __future__ import annotations

import numpy as np
import pytest

import allanite as al
from allanite.errors import DataQualityError, InputError
from allanite.noise import NoiseModel, RandomWalk, White
from allanite.noise.allan.live import LiveCurve
from allanite.recording.records import Channel, Kind, Recording

GYRO = Channel(name="gyro", kind=Kind.RATE, unit="deg/s", scale=np.pi / 180, sampling="mean")


def samples(n: int) -> np.ndarray:
    model = NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-6))
    record = al.simulate(model, rate=32.0, duration=n / 32, seed=5, unit="deg/s")
    y = record.values(record.names[0]).copy() + 0.3
    y[1000:1500] = np.nan
    y[n // 2] = np.nan
    return y


@pytest.mark.parametrize("piece", [1, 37, 4096])
def test_pieces_make_no_difference(piece: int) -> None:
    y = samples(6000)
    live = LiveCurve([GYRO], 32.0)
    for start in range(0, len(y), piece):
        live.feed(y[start : start + piece, None])
    ours = live.curve()
    file = al.allan_curve(
        Recording.from_rate(y, rate=32.0, unit="deg/s", sampling="mean"),
        taus="octave",
        engine="decimated",
        confidence=0.6827,
    )
    same = np.isin(ours.lags, file.lags)
    assert np.array_equal(ours.lags[same], file.lags)
    for name in ("deviation", "lower", "upper", "edf"):
        assert getattr(ours, name)[same] == pytest.approx(getattr(file, name), rel=1e-9, nan_ok=True), name
    assert np.array_equal(ours.count[same], file.count)
    assert np.array_equal(ours.missing[0], file.missing[0])


def test_missing_samples_can_be_skipped() -> None:
    y = samples(3000)
    whole, skipped = LiveCurve([GYRO], 32.0), LiveCurve([GYRO], 32.0)
    whole.feed(y[:, None])
    skipped.feed(y[:1000, None])
    skipped.skip(500)
    skipped.feed(y[1500:, None])
    assert np.array_equal(whole.curve().deviation, skipped.curve().deviation, equal_nan=True)
    assert skipped.n_samples == 3000


def test_companions_are_not_followed_and_nothing_is_no_curve() -> None:
    thermometer = Channel(name="t", kind=Kind.TEMPERATURE, unit="K", scale=1.0, sampling="point")
    live = LiveCurve([thermometer, GYRO], 32.0)
    assert [c.name for c in live.channels] == ["gyro"]
    live.feed(np.full((10, 2), np.nan))
    with pytest.raises(DataQualityError, match="10 samples so far"):
        live.curve()
    live.feed(np.ones((20, 2)) * np.arange(20.0)[:, None] ** 2)
    assert live.curve().n_samples == 30
    with pytest.raises(InputError, match="rates"):
        LiveCurve([thermometer], 1.0)
