# SPDX-License-Identifier: BSD-3-Clause
"""The uncertainty of a scale factor: how it is written, and what it does to the intervals of a model."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.files.store import Header
from allanite.fitting.scale import with_scale_uncertainty
from allanite.noise import Estimate, NoiseModel, White
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.quantities.uncertain_number import parse_leading_number
from allanite.quantities.units import parse_scale_factor
from allanite.recording.records import Channel, Recording


@pytest.mark.parametrize(
    ("text", "relative"),
    [
        ("24.0 mV/(deg/s)", None),
        ("24.0(2) mV/(deg/s)", 0.2 / 24),
        ("24.00(12) mV/(deg/s)", 0.12 / 24),
        ("24(2)mV/(deg/s)", 2 / 24),
        ("24.0(0.2) mV/(deg/s)", 0.2 / 24),
        ("2.40(2)e-2 V/(deg/s)", 0.02 / 2.4),
        ("-24.0 ± 0.2 mV/(deg/s)", 0.2 / 24),
        ("(24.0 +/- 0.2) mV/(deg/s)", 0.2 / 24),
        ("24.0 ± 0.5 % mV/(deg/s)", 0.005),
        ("0.0100(1) (deg/s)/LSB", 0.01),
        ("131 LSB/(deg/s)", None),
        ("0.01 (deg/s)/LSB", None),
    ],
)
def test_ways_to_write_it(text: str, relative: float | None) -> None:
    found = parse_scale_factor(text)
    assert found.uncertainty == (None if relative is None else pytest.approx(relative))
    plain = text.replace("(0.2)", "").replace("(2)", "").replace("(12)", "").replace("(1)", "")
    for sign in (" ± 0.2", " +/- 0.2", " ± 0.5 %"):
        plain = plain.replace(sign, "")
    plain = plain.replace("(24.0)", "24.0")
    assert found.factor == pytest.approx(parse_scale_factor(plain).factor)


@pytest.mark.parametrize("text", ["24.0(0) mV/(deg/s)", "24.0(2) ± 0.2 mV/(deg/s)", "24.0 ± 0 mV/(deg/s)"])
def test_what_is_no_uncertainty(text: str) -> None:
    with pytest.raises(InputError, match="uncertaint"):
        parse_scale_factor(text)


def test_numbers_without_one() -> None:
    assert parse_leading_number("no number") is None
    found = parse_leading_number(" 1.5e3 V")
    assert found is not None and (found[0].value, found[0].sd, found[1]) == (1500.0, None, "V")
    with pytest.raises(InputError, match="relative"):
        Channel(
            name="x",
            kind=al.recording.records.Kind.RATE,
            unit="V",
            scale=1.0,
            sampling="mean",
            scale_uncertainty=1.5,
        )


def model(*estimates: Estimate) -> NoiseModel:
    return NoiseModel(terms=(White(N=1e-4),), estimates=estimates, confidence=0.95, family="flicker")


def test_two_independent_relative_errors_add_in_quadrature() -> None:
    """Closed form: a statistical interval exp(±1.96 s) and a scale error u give exp(±1.96 sqrt(s² + u²))."""
    s, u, z = 0.03, 0.04, NormalDist().inv_cdf(0.975)
    both = model(
        Estimate(symbol="N", value=2.0, lower=2 * math.exp(-z * s), upper=2 * math.exp(z * s), supported=True)
    )
    (found,) = with_scale_uncertainty(both, u).estimates
    assert (found.lower, found.upper) == pytest.approx((2 * math.exp(-z * 0.05), 2 * math.exp(z * 0.05)))
    assert found.statistical == (both.estimates[0].lower, both.estimates[0].upper) and found.value == 2.0


def test_limits_times_and_open_ends() -> None:
    u = 0.1
    limit = Estimate(symbol="K", value=None, lower=0.0, upper=3.0, supported=False)
    time = Estimate(symbol="T", value=50.0, lower=20.0, upper=90.0, supported=True)
    open_ = Estimate(symbol="B", value=1.0, lower=0.5, upper=math.inf, supported=True)
    found = with_scale_uncertainty(model(limit, time, open_), u)
    k, t, b = found.estimates
    assert k.upper == pytest.approx(3 * math.exp(1.6448536 * u)) and k.lower == 0.0
    assert t == time  # no scale factor touches a time
    assert b.upper == math.inf and 0 < b.lower < 0.5 and b.supported
    assert NoiseModel.from_json(found.to_json()) == found
    assert with_scale_uncertainty(found, None) is found


def test_the_interval_covers_scale_and_noise_together(rng: np.random.Generator) -> None:
    """Simulated: both errors at once; 95 % of the intervals hold the truth, those of statistics alone do not."""
    s, u, z = 0.02, 0.05, NormalDist().inv_cdf(0.975)
    inside = alone = 0
    for _ in range(1000):
        value = math.exp(s * rng.standard_normal() + u * rng.standard_normal())
        stated = Estimate(
            symbol="N",
            value=value,
            lower=value * math.exp(-z * s),
            upper=value * math.exp(z * s),
            supported=True,
        )
        (found,) = with_scale_uncertainty(model(stated), u).estimates
        inside += found.lower <= 1.0 <= found.upper
        alone += stated.lower <= 1.0 <= stated.upper
    assert 930 <= inside <= 970 and alone < 700


@pytest.mark.long
def test_it_enters_every_fit_and_stays_apart(rng: np.random.Generator) -> None:
    y = 1e-3 * rng.standard_normal(4000)
    plain, sure = (
        Recording.from_rate(y, rate=100.0, unit="V", scale_factor=f, names="gyro")
        for f in ("24.0 mV/(deg/s)", "24.0(6) mV/(deg/s)")
    )
    for fitted in (lambda r: al.fit(al.allan_curve(r)), lambda r: al.fit(r, method="spectral")):
        without, with_ = fitted(plain), fitted(sure)
        assert without.scale_uncertainty is None and with_.scale_uncertainty == pytest.approx(0.025)
        assert with_ == with_scale_uncertainty(without, 0.6 / 24)


def test_it_is_kept_in_headers_and_channels() -> None:
    channel = Channel.of("gyro", "V", scale_factor="24.0(2) mV/(deg/s)")
    assert Channel.from_json(channel.to_json()) == channel
    header = Header(channels=(channel,), rate=1.0)
    assert Header.from_json(header.to_json()).channels[0].scale_uncertainty == pytest.approx(0.2 / 24)
    assert "scale_uncertainty" not in Channel.of("gyro", "V").to_json()


def test_the_frequency_of_a_line_is_of_time() -> None:
    """The interval of the frequency is that without an uncertain scale factor; that of the amplitude is wider."""
    x = np.random.default_rng(3).standard_normal(4000) + 0.5 * np.sin(2 * np.pi * 0.073 * np.arange(4000))

    def line(scale_factor: str) -> tuple[Estimate, Estimate]:
        made = Recording.from_rate(x, rate=100.0, unit="V", scale_factor=scale_factor)
        found = al.fit(made, terms="N", lines=[7.3])
        return found.estimate("amplitude"), found.estimate("frequency")

    (sure, at), (unsure, again) = line("24.0 mV/(deg/s)"), line("24.0(2) mV/(deg/s)")
    assert (again.lower, again.upper) == (at.lower, at.upper) and again.statistical is None
    assert unsure.upper > sure.upper and unsure.lower < sure.lower


def test_percent_that_was_meant_is_told_from_the_fraction_that_was_stated() -> None:
    with pytest.raises(InputError, match=r"is 1000 %.*10 % is 0\.1, --scale-uncertainty 10%"):
        SetupUncertainty(scale=10.0)
    assert SetupUncertainty(scale=0.1).budget(0.5)["scale factor"] == 0.1
