# SPDX-License-Identifier: BSD-3-Clause
"""Units: the conversion tables, every spelling, every trap."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from allanite.errors import InputError
from allanite.quantities.display_units import display_unit
from allanite.quantities.units import QuantityKind, Unit, parse_scale_factor, parse_unit

# Class, spellings, factor to SI as printed in the table of conversions (seven digits).
TABLE = [
    (QuantityKind.ANGLE_RATE, "rad/s", 1.0),
    (
        QuantityKind.ANGLE_RATE,
        "deg/s dps DPS °/s º/s ˚/s degree/s degrees/sec deg_s [deg/s] (deg/s)",
        1.745329e-02,
    ),
    (QuantityKind.ANGLE_RATE, "mdeg/s mdps", 1.745329e-05),
    (QuantityKind.ANGLE_RATE, "deg/min", 2.908882e-04),
    (QuantityKind.ANGLE_RATE, "deg/h dph deg/hr deg/hour °/h arcsec/s", 4.848137e-06),
    (QuantityKind.ANGLE_RATE, "mdeg/h", 4.848137e-09),
    (QuantityKind.ANGLE_RATE, "rpm", 1.047198e-01),
    (QuantityKind.ANGLE_RATE, "meru", 7.292115e-08),
    (QuantityKind.GYRO_N, "rad/s/√Hz rad/√s rad/s/sqrt(Hz) rad/s/rtHz rad*s^-0.5", 1.0),
    (QuantityKind.GYRO_N, "deg/s/√Hz dps/√Hz deg/√s deg/s/rt(Hz) dps/rtHz deg/s/Hz^0.5", 1.745329e-02),
    (QuantityKind.GYRO_N, "mdps/√Hz mdps/rt-Hz", 1.745329e-05),
    (QuantityKind.GYRO_N, "deg/h/√Hz deg/hr/rtHz", 4.848137e-06),
    (
        QuantityKind.GYRO_N,
        "deg/√h deg/sqrt(h) deg/sqrt(hr) deg/rt-hr deg/rtHr deg/h^0.5 deg/h^(1/2) deg/h**0.5 deg·h^-0.5 °/√hr",
        2.908882e-04,
    ),
    (QuantityKind.GYRO_N, "arcmin/√h", 4.848137e-06),
    (QuantityKind.GYRO_N, "arcsec/√h", 8.080228e-08),
    (QuantityKind.GYRO_K, "rad/s²/√Hz rad/s/√s rad/s·√Hz rad/s^2/√Hz", 1.0),
    (QuantityKind.GYRO_K, "deg/s/√s deg/s²/√Hz", 1.745329e-02),
    (QuantityKind.GYRO_K, "deg/h/√h deg/h^1.5 deg/h^(3/2) deg/h/sqrt(h) (deg/h)/√h", 8.080228e-08),
    (QuantityKind.GYRO_K, "deg/h/√s", 4.848137e-06),
    (QuantityKind.GYRO_K, "deg/s/√h", 2.908882e-04),
    (QuantityKind.GYRO_R, "rad/s² rad/s/s", 1.0),
    (QuantityKind.GYRO_R, "deg/s²", 1.745329e-02),
    (QuantityKind.GYRO_R, "deg/h/s", 4.848137e-06),
    (QuantityKind.GYRO_R, "deg/h² deg/h/h deg/h^2 deg/h**2", 1.346705e-09),
    (QuantityKind.GYRO_G, "rad/s/(m/s²) rad/s/(m/s^2)", 1.0),
    (QuantityKind.GYRO_G, "deg/h/g (deg/h)/g", 4.943724e-07),
    (QuantityKind.GYRO_G, "deg/s/g dps/g", 1.779741e-03),
    (QuantityKind.ANGLE, "rad", 1.0),
    (QuantityKind.ANGLE, "deg ° º ˚ degrees", 1.745329e-02),
    (QuantityKind.ANGLE, "arcmin '", 2.908882e-04),
    (QuantityKind.ANGLE, 'arcsec " ″', 4.848137e-06),
    (QuantityKind.ANGLE, "mrad", 1e-3),
    (QuantityKind.ANGLE, "µrad μrad urad", 1e-6),
    (QuantityKind.ACCELERATION, "m/s² m/s^2 m/s**2 m/s2 m/s/s m_s2 m·s^-2 m.s-2 m·s⁻²", 1.0),
    (QuantityKind.ACCELERATION, "g g0", 9.80665),
    (QuantityKind.ACCELERATION, "mg", 9.80665e-03),
    (QuantityKind.ACCELERATION, "µg μg ug", 9.80665e-06),
    (QuantityKind.ACCELERATION, "ng", 9.80665e-09),
    (QuantityKind.ACCELERATION, "Gal", 1e-2),
    (QuantityKind.ACCELERATION, "mGal", 1e-5),
    (QuantityKind.ACCELERATION, "µGal uGal", 1e-8),
    (QuantityKind.ACCELERATION, "ft/s² ft/s^2", 3.048e-01),
    (QuantityKind.ACCEL_N, "m/s²/√Hz m/s/√s m/s^2/sqrt(Hz)", 1.0),
    (QuantityKind.ACCEL_N, "g/√Hz", 9.80665),
    (QuantityKind.ACCEL_N, "mg/√Hz", 9.80665e-03),
    (QuantityKind.ACCEL_N, "µg/√Hz ug/sqrt(Hz) ug/rtHz", 9.80665e-06),
    (QuantityKind.ACCEL_N, "ng/√Hz", 9.80665e-09),
    (QuantityKind.ACCEL_N, "mGal/√Hz", 1e-5),
    (QuantityKind.ACCEL_N, "m/s/√h m/s/rt-hr m/s/√hr", 1.666667e-02),
    (QuantityKind.ACCEL_N, "ft/s/√h", 5.08e-03),
    (QuantityKind.ACCEL_K, "m/s³/√Hz m/s²/√s", 1.0),
    (QuantityKind.ACCEL_K, "mg/√h", 1.634442e-04),
    (QuantityKind.ACCEL_K, "µg/√h", 1.634442e-07),
    (QuantityKind.ACCEL_K, "m/s²/√h", 1.666667e-02),
    (QuantityKind.ACCEL_K, "m/s/h/√h", 4.629630e-06),
    (QuantityKind.ACCEL_R, "m/s³", 1.0),
    (QuantityKind.ACCEL_R, "µg/s", 9.80665e-06),
    (QuantityKind.ACCEL_R, "mg/h", 2.724069e-06),
    (QuantityKind.ACCEL_R, "µg/h", 2.724069e-09),
    (QuantityKind.ACCEL_R, "m/s/h²", 7.716049e-08),
    (QuantityKind.VELOCITY, "m/s m_s", 1.0),
    (QuantityKind.VELOCITY, "mm/s", 1e-3),
    (QuantityKind.VELOCITY, "ft/s", 3.048e-01),
    (QuantityKind.VOLTAGE, "V", 1.0),
    (QuantityKind.VOLTAGE, "mV", 1e-3),
    (QuantityKind.VOLTAGE, "µV uV", 1e-6),
    (QuantityKind.VOLTAGE, "nV", 1e-9),
    (QuantityKind.VOLTAGE_N, "V/√Hz", 1.0),
    (QuantityKind.VOLTAGE_N, "nV/√Hz nV/rtHz", 1e-9),
    (QuantityKind.COUNTS, "LSB lsb count counts digit digits ct", 1.0),
    (QuantityKind.RATIO, "ppm", 1e-6),
    (QuantityKind.RATIO, "%", 1e-2),
    (QuantityKind.GYRO_PSD, "(deg/h)²/Hz (deg/h)^2/Hz", 4.848137e-06**2),
    (QuantityKind.GYRO_PSD, "(deg/s)²/Hz", 1.745329e-02**2),
    (QuantityKind.ACCEL_PSD, "g²/Hz", 9.80665**2),
    (QuantityKind.VOLTAGE_PSD, "V²/Hz", 1.0),
    (QuantityKind.TIME, "s sec second", 1.0),
    (QuantityKind.TIME, "ms", 1e-3),
    (QuantityKind.TIME, "µs us", 1e-6),
    (QuantityKind.TIME, "ns", 1e-9),
    (QuantityKind.TIME, "min", 60.0),
    (QuantityKind.TIME, "h hour hr", 3600.0),
    (QuantityKind.TIME, "d", 86400.0),
    (QuantityKind.FREQUENCY, "Hz 1/s s^-1", 1.0),
    (QuantityKind.FREQUENCY, "kHz", 1e3),
    (QuantityKind.TEMPERATURE, "K °C degC C ℃", 1.0),
    (QuantityKind.MAGNETIC, "µT uT", 1e-6),
]
SPELLINGS = [(q, text, factor) for q, texts, factor in TABLE for text in texts.split()]


@pytest.mark.parametrize(("quantity", "text", "factor"), SPELLINGS, ids=[s[1] for s in SPELLINGS])
def test_every_spelling_of_the_table(quantity: QuantityKind, text: str, factor: float) -> None:
    unit = parse_unit(text)
    assert unit.quantity is quantity
    assert unit.factor == pytest.approx(factor, rel=6e-7)


@pytest.mark.parametrize(
    ("one", "factor", "other"),
    [
        ("deg/√h", 1 / 60, "deg/s/√Hz"),
        ("deg/√h", 60, "deg/h/√Hz"),
        ("deg/h", 1, "arcsec/s"),
        ("rad/s/√Hz", 180 / math.pi * 60, "deg/√h"),
        ("m/s/√h", 1e6 / 9.80665 / 60, "µg/√Hz"),
    ],
)
def test_cross_checks(one: str, factor: float, other: str) -> None:
    assert parse_unit(one).factor == pytest.approx(factor * parse_unit(other).factor, rel=1e-14)


def test_blank_is_a_product_and_words_are_read() -> None:
    for text in ("rad s^-1", "rad s⁻¹", "radians per second", " rad / s "):
        assert parse_unit(text).quantity is QuantityKind.ANGLE_RATE, text
    assert parse_unit("deg/rt hr").quantity is QuantityKind.GYRO_N
    assert parse_unit("m/s/s^0.5").quantity is QuantityKind.ACCEL_N


def test_division_associates_to_the_left() -> None:
    assert parse_unit("deg/h/√h") == Unit("deg/h/√h", parse_unit("(deg/h)/√h").factor, QuantityKind.GYRO_K)
    assert parse_unit("deg/h·h").quantity is QuantityKind.ANGLE


@pytest.mark.parametrize("root", ["√h", "sqrt(h)", "rt-hr", "h^0.5", "h^(1/2)", "√Hz", "rtHz", "√s"])
@pytest.mark.parametrize("head", ["deg", "deg/s", "deg/h", "rad/s", "arcsec"])
def test_the_root_is_never_lost(head: str, root: str) -> None:
    try:
        quantity = parse_unit(f"{head}/{root}").quantity
    except InputError:  # deg/√Hz is a density of angle: no noise coefficient
        assert root in ("√Hz", "rtHz")
        assert head in ("deg", "arcsec")
    else:
        assert quantity in (QuantityKind.GYRO_N, QuantityKind.GYRO_K)


def test_gravity_never_grams_and_no_other_traps() -> None:
    assert parse_unit("mg").quantity is QuantityKind.ACCELERATION
    assert parse_unit("ms").quantity is QuantityKind.TIME
    assert parse_unit("m/s").quantity is QuantityKind.VELOCITY
    assert parse_unit("deg").quantity is QuantityKind.ANGLE
    assert parse_unit("deg C") == Unit("deg C", 1.0, QuantityKind.TEMPERATURE, 273.15)
    assert parse_unit("°F").factor * 212 + parse_unit("°F").offset == pytest.approx(373.15)
    assert parse_unit("G", QuantityKind.ACCELERATION).factor == 9.80665
    for text in ("G", "S", "deg/S"):
        with pytest.raises(InputError, match=text[-1]):
            parse_unit(text)


@pytest.mark.parametrize(
    ("text", "needed", "found", "meant"),
    [
        ("deg/h", QuantityKind.GYRO_N, "angle rate", "deg/√h"),
        ("deg/√h", QuantityKind.ANGLE_RATE, "angle random walk", "without the root"),
        ("deg/s/√h", QuantityKind.GYRO_N, "rate random walk", "deg/√h"),
        ("mg/√h", QuantityKind.ACCEL_N, "acceleration random walk", "m/s/√h"),
        ("m/s", QuantityKind.ACCELERATION, "velocity", "m/s²"),
        ("deg", QuantityKind.TEMPERATURE, "angle", "°C"),
        ("(deg/h)²/Hz", QuantityKind.GYRO_N, "power spectral density", "one- or two-sided"),
        ("ms", QuantityKind.VELOCITY, "time", "m/s"),
    ],
)
def test_wrong_class_names_what_was_found_and_what_was_meant(
    text: str, needed: QuantityKind, found: str, meant: str
) -> None:
    with pytest.raises(InputError) as error:
        parse_unit(text, needed)
    assert found in str(error.value)
    assert meant in str(error.value)


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("degg/s", "deg"),
        ("rad/sek", "sec"),
        ("mdsp", "mdps"),
        ("", "never assumed"),
        ("5 deg/h", "no number"),
        ("deg/", "missing"),
        ("(deg/h", "not closed"),
        ("deg/s)", "not expected"),
        ("rad/s^0.3", "power"),
        ("Hz^(1/2)", "does not fit a sensor log"),
        ("deg$", "not understood"),
        ("deg/h" * 40, "too long"),
        ("deg^8^8", "not expected"),
    ],
)
def test_what_is_refused(text: str, hint: str) -> None:
    with pytest.raises(InputError, match=hint.replace("(", r"\(")):
        parse_unit(text)


@pytest.mark.parametrize("word", ["unknown", "unit", "uv light"])
def test_an_error_repeats_a_word_as_it_was_written(word: str) -> None:
    with pytest.raises(InputError) as refused:
        parse_unit(word)
    assert "µ" not in str(refused.value).partition("(nearest")[0]


def test_expected_class_may_be_one_of_several() -> None:
    assert parse_unit("g", (QuantityKind.ACCELERATION, QuantityKind.ANGLE_RATE)).factor == 9.80665
    with pytest.raises(InputError, match="text such as"):
        parse_unit(3)  # type: ignore[arg-type]


@given(st.text(max_size=60))
def test_any_text_is_a_unit_or_an_input_error(text: str) -> None:
    try:
        unit = parse_unit(text)
    except InputError:
        return
    assert unit.factor > 0
    assert math.isfinite(unit.factor)


@given(st.text(alphabet="degrashlbmV/√()^*·0123456789.- ", max_size=40))
def test_texts_made_of_unit_pieces_never_crash_the_parser(text: str) -> None:
    for parse in (parse_unit, parse_scale_factor):
        try:
            assert parse(text).factor > 0
        except InputError:
            continue


@pytest.mark.parametrize(
    ("text", "sample", "physical", "factor"),
    [
        ("24.0 mV/(deg/s)", QuantityKind.VOLTAGE, QuantityKind.ANGLE_RATE, math.radians(1) / 24e-3),
        ("131 LSB/(deg/s)", QuantityKind.COUNTS, QuantityKind.ANGLE_RATE, math.radians(1) / 131),
        ("131 LSB/dps", QuantityKind.COUNTS, QuantityKind.ANGLE_RATE, math.radians(1) / 131),
        ("0.01 (deg/s)/LSB", QuantityKind.COUNTS, QuantityKind.ANGLE_RATE, math.radians(0.01)),
        ("0.05 deg/s/LSB", QuantityKind.COUNTS, QuantityKind.ANGLE_RATE, math.radians(0.05)),
        ("1 V/g", QuantityKind.VOLTAGE, QuantityKind.ACCELERATION, 9.80665),
        ("-1V/g", QuantityKind.VOLTAGE, QuantityKind.ACCELERATION, -9.80665),
        ("16384 LSB/g", QuantityKind.COUNTS, QuantityKind.ACCELERATION, 9.80665 / 16384),
        ("1e-1 arcsec/count", QuantityKind.COUNTS, QuantityKind.ANGLE, math.radians(0.1 / 3600)),
    ],
)
def test_scale_factors(text: str, sample: QuantityKind, physical: QuantityKind, factor: float) -> None:
    scale = parse_scale_factor(text)
    assert (scale.sample, scale.physical) == (sample, physical)
    assert scale.factor == pytest.approx(factor, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("24 mV/deg/s", r"mV/\(deg/s\)"),
        ("24", "no unit"),
        ("mV/(deg/s)", "number and a unit"),
        ("0 V/g", "not zero"),
        ("1e999 V/g", "finite"),
        ("3 deg/s", "volts or counts"),
        ("3 V/parsec", "parsec"),
    ],
)
def test_scale_factors_that_are_refused(text: str, hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        parse_scale_factor(text)


@pytest.mark.parametrize(
    "kind", ["rate", "angle", "acceleration", "velocity", "voltage", "counts", "unknown"]
)
@pytest.mark.parametrize("symbol", ["Q", "N", "B", "K", "R", "q", "sigma", "adev", "mean", "sd", "amplitude"])
def test_units_for_people_parse_back_to_their_factor(kind: str, symbol: str) -> None:
    text, factor = display_unit(kind, symbol, "LSB")
    assert parse_unit(text).factor == pytest.approx(factor, rel=1e-15)


def test_units_for_people_of_channels_without_a_unit() -> None:
    assert display_unit("counts", "N", "LSB") == ("LSB/√Hz", 1.0)
    assert display_unit("unknown", "N") == ("units/√Hz", 1.0)
    assert display_unit("other", "K", "µT/s") == ("(µT/s)/√s", 1.0)
    assert display_unit("rate", "T") == ("s", 1.0)
    assert display_unit("rate", "frequency") == ("Hz", 1.0)
    assert display_unit("rate", "N")[0] == "deg/√h"
    with pytest.raises(InputError, match="'Z'"):
        display_unit("rate", "Z")


@pytest.mark.parametrize(
    ("text", "bare"),
    [
        ("[deg/s]", "deg/s"),
        ("(V)", "V"),
        ("m/(s^2)", "m/(s^2)"),
        ("(rad)/(s)", "(rad)/(s)"),
        ("[m/(s^2)]", "m/(s^2)"),
        (" <g> ", "g"),
        ("", ""),
    ],
)
def test_only_brackets_around_a_unit_are_taken_off(text: str, bare: str) -> None:
    from allanite.files.readers.headings import is_unit, unbracketed

    assert unbracketed(text) == bare
    assert is_unit(text) == bool(bare)


@pytest.mark.parametrize("name", ["deg", "rad", "m", "°"])
def test_a_full_stop_between_units_is_a_product_whatever_the_name(name: str) -> None:
    """deg.s^-1, as converters of navigation units write it; the name before the stop is a whole one."""
    product = parse_unit(f"{name} s^-1", tuple(QuantityKind))
    for sign in ("^-1", "-1", "⁻¹"):
        written = parse_unit(f"{name}.s{sign}", tuple(QuantityKind))
        assert (written.factor, written.quantity) == (product.factor, product.quantity)
