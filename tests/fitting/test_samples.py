# SPDX-License-Identifier: BSD-3-Clause
"""The fit of a recording names what its samples show beside noise, and holds heavy tails in the interval of N."""

import numpy as np
import pytest
from scipy.stats import binom, norm

import allanite as al

UNIT, N_SAMPLES = 1e-4, 7200


def recorded(samples):
    return al.Recording.from_rate(UNIT * samples, rate=1.0, unit="rad/s", names=["x"])


def white(model):
    return next(e for e in model.estimates if e.symbol == "N")


def line(frequency, amplitude=0.3, phase=0.0):
    return amplitude * np.sin(2 * np.pi * frequency * np.arange(N_SAMPLES) + phase)


#: What fits the samples of a record and is told nothing of its lines.
FITS = {
    "likelihood": al.fit,
    "spectral": lambda record: al.fit(record, method="spectral"),
    "select": lambda record: al.select(record).model,
}


@pytest.mark.parametrize("frequency", [0.03, 0.0713, 0.31, 0.497])
@pytest.mark.parametrize("fitted", FITS.values(), ids=FITS)
def test_a_line_that_nobody_named_takes_nothing_from_white_noise(fitted, frequency):
    """A sinusoid takes three of all degrees of freedom, less than a tenth of a standard deviation of N."""
    noise = np.random.default_rng(1).standard_normal(N_SAMPLES)
    without, found = white(fitted(recorded(noise))), fitted(recorded(noise + line(frequency)))
    sd = (without.upper - without.lower) / (2 * norm.ppf(0.975))
    assert abs(white(found).value - without.value) < 0.1 * sd
    (tone,) = [term for term in found.terms if isinstance(term, al.Sinusoid)]
    assert abs(tone.frequency - frequency) < 0.1 / N_SAMPLES
    assert "findings" not in found.goodness


@pytest.mark.parametrize("method", ["likelihood", "spectral"])
def test_a_line_that_is_no_sinusoid_is_named(method):
    rng = np.random.default_rng(1)
    wandering = np.cumsum(rng.normal(0.0, 0.07, N_SAMPLES))
    y = rng.standard_normal(N_SAMPLES) + line(0.2, 0.6, wandering)
    model = al.fit(recorded(y), method=method)
    assert model.goodness["findings"] == ["spectral_line"]
    assert "Found in the samples: spectral_line" in model.verdict
    (left,) = model.goodness["lines_left_in"]
    assert abs(left - 0.2) < 0.01 and "is no sinusoid and stays in the record" in model.verdict
    assert "findings" not in al.fit(recorded(y), method=method, screen=False).goodness


def test_findings_that_are_known_are_not_looked_for_again(monkeypatch):
    y = np.random.default_rng(1).standard_normal(N_SAMPLES)
    y[1000:1200] = y[1000]
    record = recorded(y)
    looked, known = al.fit(record), al.check(record)
    monkeypatch.setattr("allanite.fitting.samples.check", None)
    assert looked.goodness["findings"] and al.fit(record, screen=known) == looked
    assert "findings" not in al.fit(record, screen=()).goodness


def test_lines_beside_those_that_are_asked_for_are_named():
    y = np.random.default_rng(1).standard_normal(N_SAMPLES) + line(0.21) + line(0.33)
    assert "findings" not in al.fit(recorded(y), lines=[0.21, 0.33]).goodness
    for asked in ([0.21], []):
        assert al.fit(recorded(y), lines=asked).goodness["findings"] == ["spectral_line"]


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
