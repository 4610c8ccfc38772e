# SPDX-License-Identifier: BSD-3-Clause
"""The instrument's own noise, taken off: units, refusals, the interval of a difference, the fit of both curves."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import DataQualityError, InputError
from allanite.fitting.design import design_of
from allanite.fitting.instrument import FLOOR, two_records
from allanite.fitting.instrument_floor import floor_of, over_floor, variance_difference
from allanite.noise import NoiseModel, White
from noise_records import binomial_bound
from shell import Run

RATE = 32.0
SCALE = "24.0 mV/(deg/s)"


def volts(samples: np.ndarray, *, unit: str = "V", name: str = "gyro", **more: object) -> al.Recording:
    return al.Recording.from_rate(samples, rate=RATE, unit=unit, names=name, **more)  # type: ignore[arg-type]


def take(rng: np.random.Generator, n: int, sensor: float, meter: float) -> tuple[al.Recording, al.Recording]:
    """A gyro of white noise `sensor` [deg/s] through a meter of white noise `meter` [V], and the meter alone."""
    seen = 0.024 * sensor * rng.standard_normal(n) + meter * rng.standard_normal(n)
    return volts(seen, scale_factor=SCALE), volts(meter * rng.standard_normal(n), name="short")


# -- which floor fits ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("unit", "factor"), [("V", 1.0), ("mV", 1e3), ("µV", 1e6)])
def test_the_floor_goes_through_the_scale_factor_of_the_sensor(
    rng: np.random.Generator, unit: str, factor: float
) -> None:
    sensor, _ = take(rng, 100, 0.01, 1e-4)
    short = rng.standard_normal(100) * 1e-4
    floor = floor_of(sensor, volts(short * factor, unit=unit, name="short"))
    assert floor.names == ("gyro",)
    np.testing.assert_allclose(floor.scaled("gyro"), np.radians(short / 0.024), rtol=1e-12)


def test_a_floor_in_the_unit_of_the_sensor_keeps_its_own_scale(rng: np.random.Generator) -> None:
    sensor = volts(rng.standard_normal(100), unit="deg/s")
    short = rng.standard_normal(100)
    floor = floor_of(sensor, volts(short, unit="deg/h"))
    np.testing.assert_allclose(floor.scaled("gyro"), np.radians(short / 3600.0), rtol=1e-12)


def test_a_floor_that_does_not_fit_is_refused_with_the_reason(rng: np.random.Generator) -> None:
    y = rng.standard_normal(100)
    sensor = volts(y, scale_factor=SCALE)
    faster = al.Recording.from_rate(y, rate=2 * RATE, unit="V")
    two = al.Recording.from_rate(np.stack([y, y], axis=1), rate=RATE, unit="V", names=["a", "b"])
    for floor, words in (
        (faster, "at 64 Hz, the sensor at 32 Hz: the noise of an instrument depends on its settings"),
        (two, "'gyro' has no floor: the channels of the floor are a, b"),
        (volts(y, unit="m/s^2"), "the floor must have the unit of the samples"),
        (volts(y, sampling="point"), "has sampling 'mean', its floor 'point'"),
        (volts(y, aperture=0.02), "has aperture not stated, its floor 0.02"),
    ):
        with pytest.raises(InputError, match=words):
            floor_of(sensor, floor)
    curve = al.allan_curve(sensor)
    with pytest.raises(InputError, match="from the oadev curve, not from mdev"):
        over_floor(al.allan_curve(sensor, statistic="mdev"), floor_of(sensor, volts(y)))
    with pytest.raises(InputError, match="apply the scale factor to the floor first"):
        al.fit(curve, floor=al.allan_curve(volts(y)))
    with pytest.raises(InputError, match="takes no floor"):
        al.fit(curve, method="slopes", floor=curve)
    with pytest.raises(InputError, match="goes with the curve"):
        al.fit(sensor, floor=curve)


# -- the interval of a difference ---------------------------------------------------------------------------


def test_without_a_floor_the_interval_is_that_of_the_curve_and_with_one_both_errors_add() -> None:
    one, none = np.array([1.0]), np.array([0.0])
    _, low, high = variance_difference(one, (np.array([0.8]), np.array([1.3])), none, (none, none))
    assert (float(low[0]), float(high[0])) == pytest.approx((0.8, 1.3), rel=1e-12)
    d, low, high = variance_difference(
        one, (np.array([0.7]), np.array([1.4])), np.array([0.5]), (np.array([0.2]), np.array([0.9]))
    )
    assert (float(d[0]), float(low[0]), float(high[0])) == pytest.approx((0.5, 0.0, 1.0), rel=1e-12)


@pytest.mark.parametrize(
    ("share", "edf", "edf_floor"), [(0.1, 30, 30), (0.5, 100, 20), (0.9, 50, 50), (1.0, 20, 40)]
)
def test_the_interval_of_a_difference_covers(
    rng: np.random.Generator, share: float, edf: int, edf_floor: int
) -> None:
    """Chi-square variances: misses stay within the 99.9 % bound for 95 %, whatever the share of the instrument."""
    from scipy.stats import chi2

    trials = 1000
    v, f = rng.chisquare(edf, trials) / edf, share * rng.chisquare(edf_floor, trials) / edf_floor

    def ends(x: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
        return x * k / chi2.ppf(0.975, k), x * k / chi2.ppf(0.025, k)

    _, low, high = variance_difference(v, ends(v, edf), f, ends(f, edf_floor))
    missed = int(np.count_nonzero((1.0 - share < low) | (1.0 - share > high)))
    assert missed <= binomial_bound(trials, 0.05)
    assert missed >= trials * 0.05 / 3  # it is no interval of any width


def test_the_curve_over_the_floor_is_the_sensor_and_a_limit_where_it_is_not_resolved(
    rng: np.random.Generator, tmp_path: Path
) -> None:
    sensor, floor = take(rng, 60_000, 0.004, 7e-5)
    above = over_floor(al.allan_curve(sensor, confidence=0.9999), floor_of(sensor, floor))
    true = math.radians(0.004) / np.sqrt(above.measured.lags)
    assert above.resolved[:6, 0].all()
    assert ((above.lower[:6, 0] < true[:6]) & (true[:6] < above.upper[:6, 0])).all()
    assert above.share()[0, 0] == pytest.approx(
        (7e-5 / 0.024) ** 2 / (0.004**2 + (7e-5 / 0.024) ** 2), rel=0.05
    )

    short = over_floor(al.allan_curve(sensor), floor_of(sensor, floor.window(0.0, 10.0)))
    beyond = short.measured.lags > 320 // 3
    assert np.isnan(short.upper[beyond]).all()
    assert np.isfinite(short.upper[~beyond]).all()

    alone, again = (volts(7e-5 * rng.standard_normal(60_000)) for _ in range(2))
    nothing = over_floor(al.allan_curve(alone), again)
    hidden = ~nothing.resolved[:, 0]
    assert hidden.sum() >= len(hidden) - 2
    assert (nothing.lower[hidden, 0] == 0.0).all()
    assert (nothing.upper[hidden, 0] < nothing.measured.upper[hidden, 0]).all()
    text = nothing.to_csv(tmp_path / "over.csv").read_text(encoding="utf-8")
    assert "# format: allanite-over-floor 1" in text
    assert text.count(",,") >= int(hidden.sum())


def test_labels_of_the_table_stay_text_on_one_line(rng: np.random.Generator, tmp_path: Path) -> None:
    made = al.Recording.from_rate(rng.standard_normal(200), rate=10.0, unit="V", names="@a, b\nc")
    above = over_floor(al.allan_curve(made), made)
    rows = above.to_csv(tmp_path / "over.csv").read_text(encoding="utf-8").splitlines()
    heads, first = list(csv.reader(rows[4:6]))
    assert heads[2:] == [rf"'@a, b\nc.{p}" for p in ("measured", "instrument", "sensor", "lower", "upper")]
    assert [float(cell) for cell in first[:4]] == [1.0, 0.1, *[above.measured.deviation[0, 0]] * 2]


# -- both curves fitted together ----------------------------------------------------------------------------


def test_the_design_of_two_records_is_two_blocks() -> None:
    lags = np.array([1, 2, 4, 8, 16, 32])
    upper, lower = design_of(lags, 4000, "mean"), design_of(lags[:4], 900, "mean")
    both = two_records(upper, lower)
    symbols = ("N", "B", "R", *FLOOR)
    c = np.array([1.0, 0.3, 1e-9, 0.0, 0.5, 0.2, 0.0, 1e-8])  # N B R fQ fN fB fK fR
    mean = both.columns(symbols) @ c
    np.testing.assert_allclose(mean[:6], upper.columns(("N", "B", "R")) @ [1.5, 0.5, 1e-9], rtol=1e-13)
    np.testing.assert_allclose(mean[6:], lower.columns(("N", "B", "R")) @ [0.5, 0.2, 1e-8], rtol=1e-13)
    V = both.covariance(symbols, c)
    np.testing.assert_allclose(
        V[:6, :6], upper.covariance(("N", "B", "R"), np.array([1.5, 0.5, 1e-9])), rtol=1e-12
    )
    np.testing.assert_allclose(
        V[6:, 6:], lower.covariance(("N", "B", "R"), np.array([0.5, 0.2, 1e-8])), rtol=1e-12
    )
    assert not V[:6, 6:].any()


def test_the_fit_finds_the_sensor_and_its_error_is_that_of_a_difference() -> None:
    """White noise v through a meter as loud: v + f and f are known to sqrt(3/n) of themselves, so N is known to
    sqrt(3/n) sqrt(2^2 + 1)/2 at best from the first lag (and a third better from all of them)."""
    n, records, covered, found, widths = 8192, 8, 0, [], []
    truth = math.radians(0.004) / math.sqrt(RATE)
    for seed in range(records):
        rng = np.random.default_rng([20261121, seed])
        sensor, floor = take(rng, n, 0.004, 9.6e-5)
        model = al.fit(al.allan_curve(sensor), floor=al.allan_curve(floor_of(sensor, floor)))
        (e,) = [e for e in model.estimates if e.symbol == "N"]
        covered += e.lower <= truth <= e.upper
        found.append((e.value or 0.0) / truth)
        widths.append((e.upper - e.lower) / truth / (2 * 1.96))
    first_lag = math.sqrt(3.0 / n) * math.sqrt(5.0) / 2.0
    assert records - covered <= binomial_bound(records, 0.05)
    assert 0.5 * first_lag < float(np.median(widths)) < 1.5 * first_lag
    assert abs(float(np.mean(found)) - 1.0) < 4.0 * first_lag / math.sqrt(records)


@pytest.mark.long
def test_a_sensor_that_is_not_there_is_not_found() -> None:
    for seed in range(3):
        rng = np.random.default_rng([7, seed])
        seen, floor = (volts(7e-5 * rng.standard_normal(8192)) for _ in range(2))
        model = al.fit(al.allan_curve(seen), floor=al.allan_curve(floor))
        assert not any(e.supported for e in model.estimates), model.verdict
        (n,) = [e for e in model.estimates if e.symbol == "N"]
        assert 0 < n.upper < 0.5 * 7e-5 / math.sqrt(RATE)


@pytest.mark.long
def test_a_floor_too_short_for_slow_noise_leaves_it_open() -> None:
    """The instrument's own walk is not known beyond its record, so the measured one may be either's."""
    rng = np.random.default_rng(1)
    n, step = 20_000, 4e-6
    seen = al.allan_curve(volts(2e-4 * rng.standard_normal(n) + np.cumsum(rng.standard_normal(n)) * step))
    floors = (al.allan_curve(volts(2e-4 * rng.standard_normal(k))) for k in (n, 400))
    known, open_ = (al.fit(seen, floor=f).estimate("K") for f in floors)
    assert known is not None
    assert open_ is not None
    assert known.supported
    assert known.lower < step * math.sqrt(RATE) < known.upper
    assert open_.lower < 0.7 * known.lower
    assert open_.upper == pytest.approx(known.upper, rel=0.05)


def test_a_floor_of_no_use_is_refused(rng: np.random.Generator) -> None:
    curve = al.allan_curve(volts(rng.standard_normal(1000)))
    with pytest.raises(DataQualityError, match="at least 3 are needed; record it longer"):
        al.fit(curve, floor=al.allan_curve(volts(rng.standard_normal(6))))
    slower = al.Recording.from_rate(rng.standard_normal(500), rate=RATE / 2, unit="V")
    with pytest.raises(InputError, match="record both with the same"):
        al.fit(curve, floor=al.allan_curve(slower))


# -- a study, and the command line --------------------------------------------------------------------------


@pytest.mark.long
def test_a_study_shows_both_and_models_the_sensor_alone(
    rng: np.random.Generator, run: Run, tmp_path: Path
) -> None:
    sensor, floor = take(rng, 8192, 0.004, 1.4e-4)
    study = al.characterize(sensor, floor=floor)
    again = al.Study.from_json(study.to_json())
    (channel,) = again.channels
    truth = math.radians(0.004) / math.sqrt(RATE)
    n = again.models["gyro"].estimate("N")
    assert n is not None
    assert n.lower < truth < n.upper
    assert "noise of the instrument is removed" in again.models["gyro"].verdict
    whole = NoiseModel.of(White(N=math.hypot(truth, math.radians(1.4e-4 / 0.024) / math.sqrt(RATE))))
    assert channel.curve.deviation[0] == pytest.approx(float(whole.adev(1 / RATE)), rel=0.05)
    assert {"floor_taken_off", "floor_dominates"} <= {f.code for f in again.findings}
    assert again.floor is not None and again.floor.duration == floor.duration
    from allanite.views.blocks import Cards, Details, TableBlock
    from allanite.views.figures import sheet_of
    from allanite.views.report import page_of

    labels = {c.label for c in sheet_of(again).rows[0][0].curves}
    assert {"gyro", "instrument", "sensor"} <= labels
    folded = [b for d in page_of(again).blocks() if isinstance(d, Details) for b in d.blocks]
    (cards,) = (b for b in folded if isinstance(b, Cards))
    (apart,) = (
        b for _, blocks in cards.items for b in blocks if isinstance(b, Details) and "apart" in b.summary
    )
    (rows,) = (b.rows for b in apart.blocks if isinstance(b, TableBlock))
    assert channel.floor is not None and len(rows) == channel.floor.sensor.tau.size


@pytest.mark.long
def test_allan_and_fit_take_the_floor_of_a_log(rng: np.random.Generator, run: Run, tmp_path: Path) -> None:
    sensor, floor = take(rng, 4096, 0.004, 7e-5)
    paths = [tmp_path / name for name in ("gyro.csv", "short.csv")]
    for path, recording in zip(paths, (sensor, floor), strict=True):
        np.savetxt(path, recording.values(recording.names[0]), "%.9f", header="u [V]", comments="")
    options = (paths[0], "--rate", RATE, "--unit", "V", "--scale-factor", SCALE, "--floor", paths[1])
    shown = run("allan", *options)
    assert shown.code == 0, shown.err
    assert "instrument" in shown.out
    shown_as_json = run("allan", *options, "--json").out
    plain = json.loads(shown_as_json)["u"]
    assert plain["sensor"]["deviation"][0] < plain["measured"]["deviation"][0]
    paths[1].write_text(paths[1].read_text().replace("[V]", "[mV]", 1))
    thousandfold = run("allan", *options)
    assert thousandfold.code == 1
    assert "the floor states mV for u, but V was given for the log" in thousandfold.err
    paths[1].write_text(paths[1].read_text().replace("[mV]", "[Volt]", 1))
    assert run("allan", *options, "--json").out == shown_as_json
    written = tmp_path / "curve.csv"
    assert run("allan", *options, "-o", written, "--plot", tmp_path / "curve.svg").code == 0
    assert written.read_text(encoding="utf-8").startswith("# format: allanite-over-floor 1")
    assert "not a log; commands take the two logs" in run("info", written).err
    refused = run("fit", written)
    assert refused.code == 1
    model = json.loads(run("fit", *options, "--json").out)["u"]
    assert "instrument is removed" in model["verdict"]
    assert run("fit", *options, "--method", "spectral").code == 1
