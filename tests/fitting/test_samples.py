# SPDX-License-Identifier: BSD-3-Clause
"""The fit of a recording names what its samples show beside noise, and holds heavy tails in the interval of N."""

import numpy as np
import pytest
from scipy.stats import binom

import allanite as al

UNIT, N_SAMPLES = 1e-4, 7200


def recorded(samples):
    return al.Recording.from_rate(UNIT * samples, rate=1.0, unit="rad/s", names=["x"])


def white(model):
    return next(e for e in model.estimates if e.symbol == "N")


@pytest.mark.parametrize("method", ["likelihood", "spectral"])
def test_an_aliased_line_is_named(method):
    t = np.arange(N_SAMPLES)
    y = np.random.default_rng(1).standard_normal(N_SAMPLES) + 0.3 * np.sin(2 * np.pi * 0.497 * t)
    model = al.fit(recorded(y), method=method)
    assert model.goodness["findings"] == ["spectral_line"]
    assert "Found in the samples: spectral_line" in model.verdict
    assert "findings" not in al.fit(recorded(y), method=method, screen=False).goodness


def test_findings_that_are_known_are_not_looked_for_again(monkeypatch):
    y = np.random.default_rng(1).standard_normal(N_SAMPLES)
    y[1000:1200] = y[1000]
    record = recorded(y)
    looked, known = al.fit(record), al.check(record)
    monkeypatch.setattr("allanite.fitting.samples.check", None)
    assert looked.goodness["findings"] and al.fit(record, screen=known) == looked
    assert "findings" not in al.fit(record, screen=()).goodness


def test_a_line_that_is_fitted_is_not_named():
    t = np.arange(N_SAMPLES)
    y = np.random.default_rng(1).standard_normal(N_SAMPLES) + 0.3 * np.sin(2 * np.pi * 0.21 * t)
    assert "findings" not in al.fit(recorded(y), lines=[0.21]).goodness


@pytest.mark.long
def test_white_noise_shows_nothing_else():
    """A check finds fault with at most one in a hundred of such records; with one in five, it fails with 95 %."""
    fits = [
        al.fit(recorded(np.random.default_rng([2, i]).standard_normal(3000)), terms="N") for i in range(40)
    ]
    assert sum("findings" in m.goodness for m in fits) <= binom.ppf(0.9995, 40, 0.01)


@pytest.mark.long
def test_heavy_tails_are_held_by_the_interval_of_white_noise():
    """Of Student noise with six degrees of freedom, whose excess kurtosis is 3: without it 0.78 are held."""
    records, held = 60, 0
    for i in range(records):
        y = np.random.default_rng([6, i]).standard_t(6, N_SAMPLES) / np.sqrt(1.5)
        model = al.fit(recorded(y), terms="N")
        held += white(model).lower <= UNIT <= white(model).upper
        if "heavy_tails" in model.goodness.get("findings", ()):
            assert white(model).upper > white(al.fit(recorded(y), terms="N", screen=False)).upper
    assert held >= binom.ppf(0.0005, records, 0.95)
