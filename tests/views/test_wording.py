# SPDX-License-Identifier: BSD-3-Clause
"""Numbers, units and sentences: what people read."""

from __future__ import annotations

import math

import pytest

import allanite as al
import sample_study
from allanite.fitting.estimates import limit_estimate
from allanite.noise import Estimate, RandomWalk, White
from allanite.quantities.display_units import si_unit
from allanite.quantities.number_words import interval, number, probability, with_sd
from allanite.recording.health.finding import Finding, Severity, finding
from allanite.study.results import ChannelModels
from allanite.study.study import Study
from allanite.views.wording.findings import finding_kinds, finding_line, worst
from allanite.views.wording.provisos import provisos
from allanite.views.wording.rates import sentence
from allanite.views.wording.study import (
    cautions,
    groups,
    headings,
    key_numbers,
    limit_words,
    reading,
    readings,
)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (0.01234, "0.0123"),
        (9.996, "10.0"),
        (999.6, "1000"),
        (123456.0, "123456"),
        (1.234e7, "1.23e+07"),
        (-1.234e-5, "-1.23e-05"),
        (9.999e-4, "0.00100"),
        (math.inf, "∞"),
        (math.nan, "–"),
        (None, "–"),
    ],
)
def test_number_keeps_three_digits(value: float | None, text: str) -> None:
    assert number(value) == text


@pytest.mark.parametrize(
    ("value", "lower", "upper", "texts"),
    [
        (0.30012, 0.2994, 0.3009, ("0.30012", "0.29940", "0.30090")),
        (5.1, 4.6, 5.6, ("5.10", "4.60", "5.60")),
        (66.0, 7.1, 97.2, ("66", "7", "97")),
        (8.73e-5, 8.71e-5, 8.75e-5, ("8.730e-05", "8.710e-05", "8.750e-05")),
        (9.6e-7, 5.4e-7, 1.01e-6, ("0.96e-06", "0.54e-06", "1.01e-06")),
        (3.0, 0.0, None, ("3.0", "0.0", "–")),
        (3.0, 1.0, math.inf, ("3.0", "1.0", "∞")),
        (0.0, 0.0, 0.0, ("0", "0", "0")),
    ],
)
def test_interval_shows_the_second_digit_of_the_half_width_and_one_exponent(
    value: float, lower: float, upper: float | None, texts: tuple[str, str, str]
) -> None:
    assert interval(value, lower, upper) == texts


def test_a_probability_is_small_below_a_thousandth() -> None:
    assert [probability(p) for p in (0.00099, 0.001, 0.005, 0.5)] == [
        "p < 0.001",
        "p = 0.0010",
        "p = 0.0050",
        "p = 0.50",
    ]


@pytest.mark.parametrize("value", [1e-300, 3.7e-12, 1.0, 5.5e5, 1e300])
def test_rounding_moves_a_number_by_less_than_half_a_percent(value: float) -> None:
    assert float(number(value)) == pytest.approx(value, rel=5e-3)


def test_people_read_the_coefficient_that_si_holds() -> None:
    value, lower, upper = (math.radians(n) / 60 for n in (0.3, 0.29, 0.31))
    estimate = Estimate(symbol="N", value=value, lower=lower, upper=upper, supported=True)
    found = reading("rate", "", estimate)
    assert found.text == "0.300 [0.290, 0.310] deg/√h"
    assert found.si_unit == "rad/s/√Hz"
    assert float(found.si) == pytest.approx(math.radians(0.3) / 60, rel=1e-3)


@pytest.mark.parametrize("upper", [math.nan, math.inf])
def test_a_set_without_upper_end_is_said_to_be_unbounded(upper: float) -> None:
    estimate = Estimate(symbol="K", value=None, lower=0.0, upper=upper, supported=False)
    assert reading("rate", "", estimate).value == "not bounded"


def test_si_units_follow_the_kind() -> None:
    assert [si_unit("rate", s) for s in "QNBKRT"] == [
        "rad",
        "rad/s/√Hz",
        "rad/s",
        "rad/s/√s",
        "rad/s²",
        "s",
    ]
    assert si_unit("acceleration", "K") == "m/s²/√s"
    assert si_unit("counts", "N", "LSB") == "LSB/√Hz"
    assert si_unit("unknown", "B", "") == "units"


def test_channels_are_grouped_by_unit_and_by_name_where_there_is_none() -> None:
    def channel(name: str, kind: str, unit: str = "") -> ChannelModels:
        return ChannelModels(name=name, kind=kind, unit=unit, models=())

    made = [
        channel("gx", "unknown"),
        channel("ax", "unknown"),
        channel("gy", "unknown"),
        channel("w", "rate", "deg/s"),
    ]
    found = groups([*made, channel("v", "rate", "rad/s")])
    assert [[c.name for c in g.channels] for g in found] == [["gx", "gy"], ["ax"], ["w", "v"]]
    assert [g.title for g in found] == ["gx, gy (unknown unit)", "ax (unknown unit)", "Gyroscope"]


def test_key_numbers_say_what_is_resolved_where_and_what_is_bounded_elsewhere() -> None:
    gyro, accelerometer = groups(Study.from_json(sample_study.build()).channels)
    white, _, walk, _ = key_numbers(gyro)
    assert (white.name, white.value, white.unit) == ("Angle random walk N", "0.270 to 0.320", "deg/√h")
    assert white.beside == "all three channels"
    assert walk.beside == "gyro_x; gyro_y and gyro_z below 7.8 deg/h/√h"
    assert limit_words(gyro) == ""
    assert limit_words(accelerometer).startswith("Not resolved: Q below")


def test_doubts_are_stated_by_channel() -> None:
    gyro, _ = groups(Study.from_json(sample_study.build()).channels)
    doubts = cautions(gyro.channels)
    undecided = "gyro_y: the record cannot decide between two models. The Gauss-Markov family gives N 0.3"
    assert any(s.startswith(undecided) for s in doubts)
    assert any("does not explain the curve of gyro_z (p < 0.001)" in s for s in doubts)


def test_the_limit_of_several_channels_is_the_largest() -> None:
    _, accelerometer = groups(Study.from_json(sample_study.build()).channels)
    limits = [r.amount for c in accelerometer.channels if (r := readings(c)["Q"])]
    assert all(amount is not None and amount <= 1.37e-6 for amount in limits)
    assert "Q below 1.4e-06 m/s" in limit_words(accelerometer)


def test_an_accepted_finding_comes_after_an_open_one_of_its_severity() -> None:
    findings = [Finding.from_json(f) for f in sample_study.build()["findings"]]
    assert next(f.code for kind in finding_kinds(findings) for f in kind) == "clipping"
    gravest = worst(f for f in findings if not f.accepted)
    assert gravest is not None and gravest.code == "gap"
    assert worst(f for f in findings if f.severity is Severity.INFO) is None


# -- standard deviations ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "sd", "text"),
    [
        (-19.8634, 8.0412, "-19.9 ± 8.0 deg/h (1 sd)"),
        (12.3456, 0.0123, "12.346 ± 0.012 deg/h (1 sd)"),
        (0.3, 250.0, "0 ± 250 deg/h (1 sd)"),
        (None, 1.0, "not determined"),
        (1.0, math.inf, "not determined"),
    ],
)
def test_a_value_has_no_digit_beyond_its_standard_deviation(
    value: float | None, sd: float, text: str
) -> None:
    assert with_sd(value, sd, "deg/h") == text


def test_a_name_stays_as_it_is_written_where_a_sentence_begins() -> None:
    names = ["x", "gyro_x"]
    assert sentence("gyro_x in N", names) == "gyro_x in N."
    assert sentence("x: its lags", names) == "x: its lags."
    assert sentence("xenon is heavy", names) == "Xenon is heavy."


def test_a_second_term_of_a_kind_and_lines_have_columns_of_their_own() -> None:
    def said(symbol: str, value: float, *, supported: bool = True) -> Estimate:
        return Estimate(symbol=symbol, value=value, lower=0.5 * value, upper=2 * value, supported=supported)

    estimates = [
        *(
            said("N", 1e-5),
            said("sigma", 2e-6),
            said("sigma_2", 1e-6),
            said("B_equiv", 3e-6),
            said("T", 20.0),
        ),
        *(said("B_equiv_2", 1e-6), said("T_2", 900.0), said("amplitude_2", 2e-5), said("amplitude", 1e-5)),
        *(said("frequency", 7.0), said("frequency_2", 3.0, supported=False)),
    ]
    model = al.NoiseModel(terms=(), family="gauss-markov", estimates=tuple(estimates))
    channel = ChannelModels(name="gyro", kind="rate", unit="", models=(model,))
    (group,) = groups([channel])
    heads = headings(group)
    assert list(heads) == ["N", "B", "T", "B_2", "T_2", "amplitude", "frequency", "amplitude_2"]
    assert [head for head, _ in heads.values()] == ["N", "B", "T_b", "B_2", "T_b2", "line", "f", "line_2"]
    assert (
        heads["T_2"][1] == "s"
        and heads["frequency"][1] == "Hz"
        and heads["amplitude_2"][1] == heads["amplitude"][1]
    )
    assert readings(channel)["B_2"].equivalent
    assert si_unit("rate", "T_2") == "s" and si_unit("rate", "frequency") == "Hz"
    assert group.name_of("T_2") == "correlation time, number 2"


def test_a_limit_of_noise_that_is_there_is_not_read_as_none() -> None:
    """From a record that needs a slow term and cannot tell which, to the sentence below the table."""
    truth = al.NoiseModel.of(White(N=2e-5), RandomWalk(K=3.5e-6))
    (channel,) = al.characterize(al.simulate(truth, rate=20.0, duration=200.0, seed=1)).channels
    assert not any(e.supported for e in channel.models[0].estimates if e.symbol in "BKR")
    (said,) = provisos([channel])
    assert "Low-frequency noise is present" in said and "given as an upper limit" in said
    clear = al.characterize(al.simulate(al.NoiseModel.of(White(N=1e-4)), rate=20.0, duration=200.0, seed=1))
    assert provisos(clear.channels) == []


@pytest.mark.long
@pytest.mark.parametrize(
    ("symbols", "said"),
    [
        (["K"], "(K or a similar term)"),
        (["B", "R"], "Low-frequency noise is present"),
        (["N"], "Noise beyond"),
    ],
)
def test_white_noise_that_is_needed_is_not_called_slow(symbols: list[str], said: str) -> None:
    estimates = tuple(limit_estimate(s, 1.0, "; the record needs this term or one like it") for s in symbols)
    model = al.NoiseModel(terms=(), estimates=estimates)
    (words,) = provisos([ChannelModels(name="x", kind="rate", unit="", models=(model,))])
    assert words.startswith("x: ") and said in words


@pytest.mark.parametrize(
    ("symbols", "said"), [(["B"], "B"), (["sigma", "T"], "the Gauss-Markov term"), (["B", "R"], "B and R")]
)
def test_a_slow_term_that_is_resolved_is_not_called_a_limit(symbols: list[str], said: str) -> None:
    resolved = [Estimate(symbol=s, value=2.0, lower=1.0, upper=3.0, supported=True) for s in symbols]
    needed = limit_estimate("K", 1.0, "; the record needs this term or one like it")
    model = al.NoiseModel(terms=(), estimates=(*resolved, needed))
    (words,) = provisos([ChannelModels(name="x", kind="rate", unit="", models=(model,))])
    assert words.startswith(f"x: Low-frequency noise besides {said} is present")
    assert words.endswith("(K or a similar term): each of these is given as an upper limit.")


def test_channels_whose_findings_differ_are_not_given_the_numbers_of_one() -> None:
    """Steps of gyros in mdps and of accelerometers in mg: what a line says names its channel."""
    steps = {"gx": "8.75 mdps", "gy": "8.75 mdps", "ax": "0.061 mg"}
    members = [
        finding("resolution_step", f"{name}: steps of {step}", severity=Severity.INFO, channel=name)
        for name, step in steps.items()
    ]
    assert finding_line(members, 200) == "resolution_step: 3 channels, e.g. gx: steps of 8.75 mdps"
    assert finding_line(members[:2], 200) == "resolution_step: gx, gy: steps of 8.75 mdps"
    assert finding_line(members[1:], 200) == "resolution_step: gy, ax; gy: steps of 8.75 mdps"
    assert finding_line(members[:1], 200) == "resolution_step: gx: steps of 8.75 mdps"
