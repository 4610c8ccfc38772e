# SPDX-License-Identifier: BSD-3-Clause
"""Pulses of a gyro: N is that of the sensor, although rounding of the angle rules the short averaging times."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.recording.health.resolution import patterned_step

STEP, N = 0.35, 0.003  # arcsec, deg/√h
ARCSEC = np.pi / 648000


def pulses(seed: int, counts: float, n: int = 40_000) -> np.ndarray:
    """The angle of a gyro of 100 Hz in whole steps, which turns by so many steps a sample."""
    rng = np.random.default_rng(seed)
    true = np.cumsum(counts * STEP + 6.0 * N * rng.standard_normal(n))  # N √dt = 6 N arcsec
    return STEP * np.floor(true / STEP)


def increments(folder: Path, angle: np.ndarray) -> al.Recording:
    path = folder / "fog.csv"
    np.savetxt(path, np.diff(angle, prepend=0.0), "%.4f", header="dtheta_z [arcsec]", comments="")
    return al.read(path, rate=100.0)


@pytest.mark.parametrize(  # a fit of all lags misses N in both
    ("seed", "counts"), [(2, 0.36), pytest.param(5, 0.98, marks=pytest.mark.long)]
)
def test_white_noise_is_found_below_a_step(seed: int, counts: float, tmp_path: Path) -> None:
    angle = pulses(seed, counts)
    counted = al.Recording.from_angle(angle, rate=100.0, unit="arcsec", names=["fog"])
    summed = increments(tmp_path, angle)
    for recording in (counted, summed):
        (name,) = recording.names
        study = al.characterize(recording, accept=["quantisation_limited"])
        found = study.models[name].estimate("N")
        assert found.lower < np.deg2rad(N) / 60 < found.upper
        assert patterned_step(recording, name) == pytest.approx(STEP * ARCSEC, rel=1e-3)
        curve = study[name].curve
        short = curve.tau < 0.5
        assert all("less than its step" in r for r in np.array(curve.excluded)[short])


def test_a_dithered_angle_and_a_rate_keep_all_lags() -> None:
    rng = np.random.default_rng(4)
    angle = 0.01 * np.round(np.cumsum(3.9 + 0.6 * rng.standard_normal(20_000)))
    assert patterned_step(al.Recording.from_angle(angle, rate=100.0, unit="deg", names=["a"]), "a") == 0.0
    coarse = 0.5 * np.round(0.4 * rng.standard_normal(20_000))
    assert patterned_step(al.Recording.from_rate(coarse, rate=100.0, unit="deg/s", names=["w"]), "w") == 0.0
