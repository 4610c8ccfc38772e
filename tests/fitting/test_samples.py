# SPDX-License-Identifier: BSD-3-Clause
"""The fit of a recording names what its samples show beside noise, and holds heavy tails in the interval of N."""

import numpy as np
import pytest
from scipy.stats import binom, norm

import allanite as al
from allanite.noise.spectrum.lines import SpectralLine

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


@pytest.mark.long
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


@pytest.mark.long
@pytest.mark.parametrize("method", ["likelihood", "spectral"])
def test_a_line_that_is_no_sinusoid_is_named(method):
    rng = np.random.default_rng(1)
    wandering = np.cumsum(rng.normal(0.0, 0.07, N_SAMPLES))
    y = rng.standard_normal(N_SAMPLES) + line(0.2, 0.6, wandering)
    model = al.fit(recorded(y), method=method)
    assert model.goodness["findings"] == ["spectral_line"]
    assert "Found in the samples: spectral_line" in model.verdict
    (left,) = model.goodness["lines_left_in"]
    assert abs(left - 0.2) < 0.01 and "stays in the record: amplitude and phase wander" in model.verdict
    assert "findings" not in al.fit(recorded(y), method=method, screen=False).goodness


@pytest.mark.long
def test_findings_that_are_known_are_not_looked_for_again(monkeypatch):
    y = np.random.default_rng(1).standard_normal(N_SAMPLES)
    y[1000:1200] = y[1000]
    record = recorded(y)
    looked, known = al.fit(record), al.check(record)
    monkeypatch.setattr("allanite.fitting.samples.check", None)
    assert looked.goodness["findings"] and al.fit(record, screen=known) == looked
    assert "findings" not in al.fit(record, screen=()).goodness


@pytest.mark.long
def test_lines_beside_those_that_are_asked_for_are_named():
    y = np.random.default_rng(1).standard_normal(N_SAMPLES) + line(0.21) + line(0.33)
    assert "findings" not in al.fit(recorded(y), lines=[0.21, 0.33]).goodness
    one, none = (al.fit(recorded(y), lines=asked) for asked in ([0.21], []))
    for model, left in ((one, [0.33]), (none, [0.21, 0.33])):
        assert model.goodness["findings"] == ["spectral_line"]
        assert model.goodness["lines_left_in"] == pytest.approx(left, abs=1e-3)
    assert "The line at 0.33 Hz stays in the record: it was not asked for." in one.verdict
    assert "These lines stay in the record: 0.21 Hz and 0.33 Hz." in none.verdict


@pytest.mark.long
@pytest.mark.parametrize("fitted", [al.fit, al.select], ids=["fit", "select"])
def test_a_line_hides_no_other_slope(fitted):
    """Beside f^-1.3 neither flicker nor a walk is shown, and the range of slopes is said, with a line as without."""
    n, rng = 28_800, np.random.default_rng(1)
    frequency = np.fft.rfftfreq(2 * n)
    spectrum = np.fft.rfft(rng.standard_normal(2 * n))
    spectrum[1:] *= (200 * frequency[1:]) ** -0.65
    y = rng.standard_normal(n) + np.fft.irfft(spectrum)[:n]
    beside = fitted(recorded(y + 0.3 * np.sin(2 * np.pi * 0.21 * np.arange(n))))
    alone = fitted(recorded(y))
    shown = [
        [e.symbol for e in getattr(found, "model", found).estimates if e.supported and len(e.symbol) == 1]
        for found in (alone, beside)
    ]
    assert shown[0] == shown[1]
    facts = [getattr(found, "slow", None) or found.goodness for found in (alone, beside)]
    for end in ("slope_lower", "slope_upper"):
        assert facts[1][end] == pytest.approx(facts[0][end], abs=0.1)


def test_a_line_that_the_model_explains_as_noise_is_no_term(monkeypatch):
    """The spectrum may show a line, once in a thousand records, that does not pay its price in likelihood."""
    seen = SpectralLine(frequency=0.2, amplitude=1e-6, significance=3.0, width=1e-3, stable=True)
    monkeypatch.setattr("allanite.fitting.likelihood.proposed_lines.spectral_lines", lambda *_: (seen,))
    model = al.fit(recorded(np.random.default_rng(1).standard_normal(N_SAMPLES)))
    assert not any(isinstance(t, al.Sinusoid) for t in model.terms)
    assert model.goodness["lines_left_in"] == [0.2] and "the model explains it as noise" in model.verdict


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
