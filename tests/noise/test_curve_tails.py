# SPDX-License-Identifier: BSD-3-Clause
"""The excess kurtosis that a curve carries, and what a fit of the curve makes of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from allanite.errors import FormatError
from allanite.fitting import fit
from allanite.noise.allan import AllanCurve, allan_curve
from allanite.noise.allan.tails import phase_kurtosis
from allanite.recording.records import Recording

NONE = np.zeros((0, 2), dtype=np.int64)


def curve_of(y: NDArray[np.float64]) -> AllanCurve:
    return allan_curve(Recording.from_rate(y, rate=1.0, unit="rad/s", names=["x"]))["x"]


def phase(y: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([[0.0], np.cumsum(y)])


@pytest.mark.parametrize(
    ("excess", "draw"),
    [
        (3.0, lambda rng, n: rng.laplace(size=n)),
        (6.0, lambda rng, n: rng.exponential(size=n)),
        (1.0, lambda rng, n: rng.standard_t(10, n)),
        (3.0, lambda rng, n: rng.standard_normal(n) * np.where(rng.random(n) < 0.0455, 3.0, 1.0) * 1.0),
    ],
)
def test_laws_of_known_kurtosis(excess: float, draw: object, rng: np.random.Generator) -> None:
    """Twice that of the second differences; of the mixture 3 (1 - e + e k^4)/(1 - e + e k^2)^2 - 3."""
    found = phase_kurtosis(phase(draw(rng, 400_000)), NONE)  # type: ignore[operator]
    if excess == 3.0 and found > 3.5:
        excess = 3 * (1 - 0.0455 + 0.0455 * 81) / (1 - 0.0455 + 0.0455 * 9) ** 2 - 3
    assert found == pytest.approx(excess, rel=0.25)


def test_gaussian_noise_has_none_whatever_its_color_or_level() -> None:
    """Of 200 records none; a level that steps by ten is no tail."""
    for seed in range(200):
        rng = np.random.default_rng([12, seed])
        n = int(rng.integers(300, 40_000))
        y = rng.standard_normal(n)
        if seed % 4 == 1:
            y[n // 2 :] *= 10.0
        elif seed % 4 == 2:
            y = np.cumsum(y)
        elif seed % 4 == 3:
            y = np.diff(rng.standard_normal(n + 1))
        assert phase_kurtosis(phase(y), NONE) == 0.0, seed


def test_missing_samples_are_no_tails(rng: np.random.Generator) -> None:
    y = rng.standard_normal(100_000)
    y[::700] = np.nan
    assert curve_of(y).excess_kurtosis == (0.0,)
    y = rng.laplace(size=100_000)
    y[20_000:60_000] = np.nan
    assert curve_of(y).excess_kurtosis[0] == pytest.approx(3.0, rel=0.35)


def test_short_and_constant_records_say_nothing() -> None:
    assert phase_kurtosis(phase(np.random.default_rng(1).laplace(size=200)), NONE) == 0.0
    assert phase_kurtosis(np.zeros(10_001), NONE) == 0.0


def test_it_goes_with_its_channel_and_through_a_file(tmp_path: Path, rng: np.random.Generator) -> None:
    y = np.stack([rng.standard_normal(20_000), rng.laplace(size=20_000)], axis=1)
    curve = allan_curve(Recording.from_rate(y, rate=1.0, unit="rad/s", names=["a", "b"]))
    assert curve["a"].excess_kurtosis == (0.0,)
    assert curve["b"].excess_kurtosis[0] > 2.0
    again = AllanCurve.from_csv(curve.to_csv(tmp_path / "curve.csv"))
    assert again.excess_kurtosis == curve.excess_kurtosis
    text = (tmp_path / "curve.csv").read_text(encoding="utf-8")
    (tmp_path / "bad.csv").write_text(text.replace("kurtosis: [", "kurtosis: [1.0, "), encoding="utf-8")
    with pytest.raises(FormatError, match="excess kurtosis must be one number"):
        AllanCurve.from_csv(tmp_path / "bad.csv")


@pytest.mark.long
def test_a_fit_of_the_curve_holds_the_tails_where_white_noise_is_the_most(rng: np.random.Generator) -> None:
    """The relative variance of N^2 grows by the kurtosis over the samples."""
    n = 20_000
    curve = curve_of(rng.laplace(size=n))
    plain, held = fit(curve, screen=False), fit(curve)
    kurtosis = curve.excess_kurtosis[0]
    a, b = plain.estimate("N"), held.estimate("N")
    assert a is not None and b is not None and a.value == b.value
    added = 1.96**2 * kurtosis / (4 * n)
    assert np.log(b.upper / b.value) ** 2 == pytest.approx(np.log(a.upper / a.value) ** 2 + added, rel=1e-3)
    assert held.goodness["findings"] == ["heavy_tails"]
    assert "heavy tails" in held.verdict and "heavy tails" not in plain.verdict
    walk = curve_of(np.cumsum(rng.laplace(size=n)))
    assert "findings" not in fit(walk).goodness
    assert "findings" not in fit(replace(curve, excess_kurtosis=(0.0,))).goodness
