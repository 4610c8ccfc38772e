# SPDX-License-Identifier: BSD-3-Clause
"""Temperature and warm-up: against closed forms, plain least squares and simulated sensors."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from verification.simulators import gauss_markov

import allanite as al
from allanite.commands.measurement import file_names
from allanite.errors import DataQualityError, InputError
from allanite.files.recording_file import write_recording
from allanite.filtering.regression import LEVEL, covariance_of, regress
from allanite.filtering.simulation import Temperature, simulate
from allanite.noise import Flicker, NoiseModel, RandomWalk, White
from allanite.noise.allan import allan_curve
from allanite.recording.health.finding import Severity
from allanite.recording.records import Channel, Recording
from allanite.stability.environment.climate import Climate, smoothed
from allanite.stability.environment.correction import LEAST, Correction, allan_products, correction_of
from allanite.stability.environment.design import DRIFT, QUADRATIC, RATE, TEMPERATURE, EnvironmentDesign, play
from allanite.stability.environment.estimation import (
    free_of_environment,
    regress_environment,
    warm_ups_to_cut,
)
from allanite.stability.environment.noise_left_open import Noise
from allanite.stability.environment.results import EnvironmentEstimate, FreedRecording
from allanite.stability.environment.warming import settles
from allanite.views.blocks import TableBlock
from allanite.views.environment import coefficient_table
from allanite.views.figures import plot
from allanite.views.report import html_of
from pages import text_of
from shell import Run

Array = NDArray[np.float64]

RATE_HZ, ROWS = 0.25, 500
LENGTH = ROWS / RATE_HZ
DEG_H = math.radians(1) / 3600
NOISE = NoiseModel.of(White(N=20 * DEG_H), Flicker(B=1.0 * DEG_H))
SLOPE = 6 * DEG_H
TIME = (np.arange(ROWS) + 0.5) / RATE_HZ


def twin(
    *,
    seed: int = 1,
    model: NoiseModel = NOISE,
    warm_up: tuple[float, float] | None = None,
    **temperature: Any,
) -> Recording:
    """A gyro whose temperature goes up and down four times."""
    course = {"swing": 5.0, "period": LENGTH / 4, "coefficient": SLOPE, "noise": 0.02} | temperature
    return simulate(
        model,
        rate=RATE_HZ,
        duration=LENGTH,
        seed=seed,
        warm_up=warm_up,
        temperature=Temperature(channel="temp", **course),
    )


def with_signal(record: Recording, signal: Array, temperature: Array | None = None) -> Recording:
    """The record with a signal added, and other readings of the thermometer."""
    y = np.array(record.values("gyro")) + signal
    readings = record.values("temp") if temperature is None else temperature
    table = [Recording.from_rate(v, rate=RATE_HZ, unit="K").columns[0] for v in (y, readings)]
    return replace(record, columns=tuple(table))


@pytest.fixture(scope="module")
def found() -> EnvironmentEstimate:
    """A warm-up and a temperature, both modelled."""
    record = twin(seed=4, warm_up=(150 * DEG_H, LENGTH / 12))
    return regress_environment(record, temperature="temp", warm_up="model")


# -- columns ---------------------------------------------------------------------------------------------------


def test_play_follows_the_branch() -> None:
    """+1 after warming by the way back, -1 after cooling by it, between the two on the way, and it stays at rest."""
    warmth = np.array([0.0, 10.0, 9.5, 9.0, 0.0, 0.0, 0.5, 1.0, 10.0])
    assert play(warmth, part=0.1) == pytest.approx([0, 1, 0, -1, -1, -1, 0, 1, 1])


def test_smoothing_is_a_local_parabola(rng: np.random.Generator) -> None:
    values = rng.standard_normal(60)
    for width in (5, 9, 17):
        half, x = width // 2, np.arange(width)
        for i in (0, 3, half, 30, 59):
            first = min(max(i - half, 0), 60 - width)
            fit = np.polynomial.polynomial.polyfit(x, values[first : first + width], 2)
            expected = np.polynomial.polynomial.polyval(i - first, fit)
            assert smoothed(values, width)[i] == pytest.approx(expected, abs=1e-12)


def test_the_thermometer_is_smoothed_no_further_than_its_noise_allows() -> None:
    for noise in (0.001, 0.02, 0.5):
        climate = Climate.of(twin(noise=noise), "gyro", "temp")
        truth = 5 * np.sin(2 * np.pi * 4 * TIME / LENGTH)
        error = np.std(climate.warmth - (truth - truth.mean()))
        assert climate.thermometer is not None
        assert climate.thermometer.noise == pytest.approx(noise, rel=0.15)
        assert error < 0.7 * noise  # local parabolas over 5 values leave that much, over more of them less
    assert climate.width > 13


def test_a_temperature_below_the_noise_of_its_thermometer_is_constant() -> None:
    found = regress_environment(twin(swing=0.0), temperature="temp")
    assert found.thermometer is not None
    assert found.thermometer.constant
    assert (found.verdict, found.taken_off, found.correction) == ("not separable", (), None)
    assert "constant" in found.reason
    assert found["temperature"].value is None


# -- regression ------------------------------------------------------------------------------------------------


def test_a_node_is_the_regression() -> None:
    """Coefficients and covariance of the products are those of `allanite.filtering.regression` in the same noise."""
    record = twin(seed=2)
    climate = Climate.of(record, "gyro", "temp")
    design = EnvironmentDesign(climate=climate)
    names = [DRIFT, TEMPERATURE, QUADRATIC, RATE]
    noise = Noise.of(climate, design.blocks, design.names, design=names, model=NOISE)
    fit = noise.fit(names)
    columns = design.blocks[:, [design.names.index(n) for n in names]]
    plain = regress(
        climate.blocks.mean,
        np.column_stack([np.ones(ROWS), columns]),
        NOISE,
        dt=1 / RATE_HZ,
        names=[LEVEL, *names],
    )
    assert fit.mean == pytest.approx(plain.coefficients[1:], rel=1e-6)
    assert fit.covariance == pytest.approx(plain.covariance[1:, 1:], rel=1e-6)
    # the same about another temperature: slope at r is c1 + 2 c2 r
    change = np.eye(len(noise.names))
    r, (zero, one, two) = 1.5, (noise.names.index(n) for n in (LEVEL, TEMPERATURE, QUADRATIC))
    change[zero, one], change[one, two], change[zero, two] = -r, -2 * r, r**2
    moved = dict(zip(names, noise.with_columns(change).fit(names).mean, strict=True))
    c = dict(zip(names, fit.mean, strict=True))
    assert moved[TEMPERATURE] == pytest.approx(c[TEMPERATURE] + 2 * r * c[QUADRATIC], rel=1e-6)


@pytest.mark.long
def test_the_noise_is_found_beside_the_effect() -> None:
    """White noise to 4 standard errors of 500 samples, whether the temperature acts or not."""
    for slope in (0.0, 100 * SLOPE):
        model = regress_environment(twin(seed=3, coefficient=slope, noise=0.001), temperature="temp").model
        white = model.term("white")
        assert isinstance(white, White)
        assert white.N == pytest.approx(20 * DEG_H, rel=4 / math.sqrt(2 * ROWS))


def test_coefficient_warm_up_and_what_is_left(found: EnvironmentEstimate) -> None:
    c = found["temperature"]
    assert (found.verdict, c.status) == ("resolved", "resolved")
    assert c.lower is not None
    assert c.upper is not None
    assert c.lower < SLOPE < c.upper
    assert c.upper - c.lower < SLOPE  # the record tells it to better than half
    warm = found.warm_up
    assert (warm.found, warm.action, len(warm.terms)) == (True, "modelled", 1)
    assert abs(warm.terms[0].amplitude - 150 * DEG_H) < 4 * warm.terms[0].amplitude_sd
    assert abs(warm.terms[0].T - LENGTH / 12) < 4 * warm.terms[0].T_sd
    assert found.correction is not None
    assert found.correction.share.max() > 0.9
    # the residual is the noise: its Allan deviation at 32 blocks is that of the model, within 4 standard deviations
    curve = allan_curve(found.residual.select("gyro"), taus=[32 / RATE_HZ]).with_model(NOISE)
    corrected = found.correction.applied(curve).deviation[0, 0] ** 2
    assert corrected == pytest.approx(float(NOISE.avar(32 / RATE_HZ)), rel=4 * math.sqrt(2 / curve.edf[0, 0]))


def test_a_thermometer_that_lags() -> None:
    """Of a first-order thermometer the sensor's temperature is T + L dT/dt, exactly."""
    turn, lag = 2 * np.pi * 4 / LENGTH, 40.0
    readings = 5 * np.sin(turn * TIME)
    felt = readings + lag * 5 * turn * np.cos(turn * TIME)
    record = with_signal(twin(seed=5, coefficient=0.0), 10 * SLOPE * felt, readings + 0.001)
    found = regress_environment(record, temperature="temp")
    assert found.lag is not None
    assert found.lag.status == "resolved"
    assert found.lag.value is not None
    assert found.lag.lower is not None
    assert found.lag.upper is not None
    sd = (found.lag.upper - found.lag.lower) / (2 * 1.96)
    assert abs(found.lag.value - lag) < 4 * sd < 2.0
    assert "behind the sensor" in found.lag.says
    assert RATE in found.taken_off
    assert found.hysteresis is not None
    assert found.hysteresis.status == "not found"


def test_hysteresis_is_told_from_a_lag() -> None:
    """One temperature, two signals: the play operator in the signal, no lag."""
    readings = 5 * np.sin(2 * np.pi * 4 * TIME / LENGTH)
    gap = 30 * DEG_H
    record = with_signal(
        twin(seed=6, coefficient=0.0), 10 * SLOPE * readings + gap / 2 * play(readings), readings
    )
    found = regress_environment(record, temperature="temp")
    assert found.hysteresis is not None
    assert found.hysteresis.status == "found"
    assert found.hysteresis.lower is not None
    assert found.hysteresis.upper is not None
    assert found.hysteresis.lower < gap < found.hysteresis.upper
    assert any("not removed" in words for words in found.advice)


@pytest.mark.long
def test_a_temperature_that_goes_with_time_is_no_drift_of_the_sensor() -> None:
    """A line in time cannot be told from a drift; nothing is taken off, and it is said what would help."""
    record = twin(swing=0.0, drift=10 / LENGTH, coefficient=10 * SLOPE, noise=0.001)
    found = regress_environment(record, temperature="temp")
    assert found.verdict == "not separable"
    assert "drift" in found.reason
    assert found.taken_off == ()
    assert any("the temperature return" in words for words in found.advice)
    one_way = regress_environment(twin(swing=0.0, rise=8.0, time_constant=LENGTH / 4), temperature="temp")
    assert one_way.hysteresis is not None
    assert one_way.hysteresis.status == "one way"
    assert one_way["rate of temperature"].status == "not separable"


@pytest.mark.parametrize(
    ("unit", "scale", "si"),
    [
        ("mV", 1e-3, "V"),
        ("V", 1.0, "V"),
        ("degC", 1.0, "K"),
        ("LSB", 1.0, "LSB"),
        ("hPa", 1.0, "hPa"),
        ("", 1.0, ""),
    ],
)
def test_a_thermometer_keeps_its_unit(unit: str, scale: float, si: str) -> None:
    """Readings of some 300 of any unit are told in it; the coefficient is per volt, kelvin or the unit itself."""
    record = twin(seed=2)
    readings = 280.0 + np.asarray(record.values("temp"))
    columns = (record.columns[0], Recording.from_rate(readings, rate=RATE_HZ, unit="K").columns[0])
    channels = (record.channels[0], Channel.of("temp", unit))
    pair = replace(record, channels=channels, columns=columns)
    found = regress_environment(pair, channel="gyro", temperature="temp", model=NOISE)
    thermometer = found.thermometer
    assert thermometer is not None and (thermometer.unit, thermometer.si) == (unit, si)
    assert thermometer.mean == pytest.approx(readings.mean(), rel=1e-3)
    assert thermometer.low == pytest.approx(readings.min(), rel=1e-3)
    assert thermometer.high == pytest.approx(readings.max(), rel=1e-3)
    assert found.reference is not None and thermometer.low < found.reference < thermometer.high
    assert found["temperature"].value == pytest.approx(SLOPE / scale, rel=0.25)
    (table,) = coefficient_table(found.facts)
    assert isinstance(table, TableBlock) and f"deg/h/{si or 'unit'}" in table.rows[0][0][1].text


@pytest.mark.long
def test_a_noisy_thermometer_is_told() -> None:
    """Noise as large as a tenth of the swing, in blocks: the coefficient is too small by less than is said."""
    found = regress_environment(twin(seed=8, noise=8.0, coefficient=20 * SLOPE), temperature="temp")
    assert found.attenuation is not None
    assert found.attenuation > 0.02
    assert any("too small" in words for words in found.advice)


# -- warm-up ---------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_random_walk_is_no_warm_up() -> None:
    """Of 4 strong walks at most 2 may pass for one: 5 % of chance make 3 in one of 2000 cases."""
    walk = NoiseModel.of(White(N=20 * DEG_H), RandomWalk(K=1.0 * DEG_H))
    calls = [regress_environment(simulate(walk, rate=0.1, duration=3000.0, seed=s)).warm_up for s in range(4)]
    assert sum(w.found for w in calls) <= 2
    assert all(w.action in ("none found", "left in") for w in calls)


def test_a_warm_up_is_cut_modelled_or_left_in_and_said() -> None:
    record = twin(seed=9, coefficient=0.0, warm_up=(200 * DEG_H, LENGTH / 15)).select("gyro")
    left = regress_environment(record)
    assert left.warm_up.action == "left in"
    assert left.residual is record
    assert any("--warm-up" in words for words in left.advice)
    cut = regress_environment(record, warm_up="cut")
    assert cut.warm_up.cut is not None
    assert (
        3 * LENGTH / 15 < cut.warm_up.cut < 0.7 * LENGTH
    )  # 200 deg/h are lost in some deg/h after 4 constants
    assert cut.residual.duration == pytest.approx(LENGTH - cut.warm_up.cut, abs=2 / RATE_HZ)
    with pytest.raises(DataQualityError, match="model it"):
        regress_environment(
            twin(seed=9, coefficient=0.0, warm_up=(9e3 * DEG_H, LENGTH / 4)).select("gyro"), warm_up="cut"
        )


def test_an_empty_recording_is_refused() -> None:
    empty = Recording.from_rate(np.zeros(0), rate=RATE_HZ, unit="rad/s", names="gyro")
    with pytest.raises(DataQualityError, match="no samples"):
        regress_environment(empty)


# -- residual --------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_the_residual_is_made_as_it_is_read(found: EnvironmentEstimate) -> None:
    """Block by block the same, with gaps where they were, integers and units as they were written."""
    record = twin(seed=4, warm_up=(150 * DEG_H, LENGTH / 12))
    whole = found.residual.values("gyro")
    assert found.effect is not None
    assert np.asarray(record.values("gyro")) - whole == pytest.approx(found.effect(TIME), abs=1e-15)
    parts = np.concatenate([block for _, block in found.residual.blocks("gyro", 7)])
    assert np.array_equal(parts, whole)
    step = found.residual.history[-1]
    assert (step["step"], step["channel"]) == ("environment", "gyro")
    assert set(step["taken_off"]) == set(found.taken_off)
    counts = np.round(np.asarray(record.values("gyro")) / DEG_H * 8).astype(np.int64)
    y = Recording.from_rate(counts, rate=RATE_HZ, unit="LSB", names="gyro")
    y = y.excluding({"gyro": [[100, 160]]}, "a gap")
    both = replace(
        y, channels=(*y.channels, record["temp"]), columns=(*y.columns, record.columns[1]), notes={}
    )
    freed = regress_environment(both, channel="gyro", temperature="temp", warm_up="model")
    assert freed["temperature"].value == pytest.approx(SLOPE / DEG_H * 8, rel=0.25)
    assert np.isnan(freed.residual.values("gyro")[100:160]).all()
    assert np.isfinite(freed.residual.values("gyro")[160:]).all()


def test_a_corrected_curve_has_the_variance_over_what_is_left_of_it() -> None:
    curve = allan_curve(
        Recording.from_rate(np.random.default_rng(3).standard_normal(256), rate=1.0, unit="deg/h")
    )
    tau, none = np.array([1.0, 64.0]), np.zeros(2)
    correction = Correction(
        tau=tau, left=np.array([0.81, 0.81]), share=none, deviation=none, error=none, before=none, after=none,
        longest=256.0,
    )  # fmt: skip
    corrected = correction.applied(curve)
    inside = curve.tau >= 1.0
    np.testing.assert_allclose(corrected.variance[inside], curve.variance[inside] / 0.81)
    np.testing.assert_allclose(corrected.upper / corrected.deviation, curve.upper / curve.deviation)


def test_the_reference_is_where_slope_and_curvature_begin() -> None:
    plain = EnvironmentDesign(climate=Climate.of(twin(noise=0.02), "gyro", "temp"))
    t = plain.climate.middle
    slope, curvature = (plain.names.index(name) for name in (TEMPERATURE, QUADRATIC))
    before, after = plain.at(t), replace(plain, reference=1.5).at(t)
    np.testing.assert_allclose(after[:, slope], before[:, slope] - 1.5, atol=1e-12)
    np.testing.assert_allclose(after[:, curvature], (before[:, slope] - 1.5) ** 2, atol=1e-12)
    rest = [i for i in range(before.shape[1]) if i not in (slope, curvature)]
    np.testing.assert_array_equal(after[:, rest], before[:, rest])


def test_u14_what_a_regression_takes_off_a_walk_is_known_and_restored() -> None:
    """A line taken off a random walk by generalised least squares leaves 1 - 1.5 tau/T of its Allan variance.

    The estimate is the difference of the ends over T, and what is left is a Brownian bridge. At N/4 that is 0.625: the
    lag is refused. Divided by what is left it is restored to 1 within 3 %: 6000 walks, whose mean has 0.8 %.
    """
    n, walks = 64, 6000
    walk = NoiseModel.of(RandomWalk(K=1.0))
    line = ((np.arange(n) + 0.5) / n - 0.5)[:, None]
    columns = np.column_stack([np.ones(n), line])
    covariance = covariance_of(columns, walk, dt=1.0)[1:, 1:]
    y = np.cumsum(np.random.default_rng(14).standard_normal((walks, n)), axis=1)
    taken = np.array([0])
    correction = correction_of(line, covariance, taken, np.zeros(1), walk, y[0], 1.0)
    at = int(np.flatnonzero(correction.tau == n // 4)[0])
    assert correction.left == pytest.approx(1 - 1.5 * correction.tau / n, abs=0.02)
    assert correction.left[at] < LEAST
    assert correction.longest == n / 4
    slope = (y[:, -1] - y[:, 0])[:, None] / (n - 1) * n
    left = y - slope * line.T
    m = n // 4
    variance = np.mean([allan_products(row[:, None], m)[0, 0] for row in left])
    assert variance / correction.left[at] / float(walk.avar(m)) == pytest.approx(1.0, abs=0.03)
    # and the plain fit of a line, which is what detrending does, leaves 0.466
    plain = y - y @ line / (line**2).sum() * line.T
    assert np.mean([allan_products(r[:, None], m)[0, 0] for r in plain]) / float(
        walk.avar(m)
    ) == pytest.approx(0.466, abs=0.03)


def test_lags_that_the_regression_rules_are_not_fitted(found: EnvironmentEstimate) -> None:
    assert found.correction is not None
    doubtful = replace(found.correction, left=np.where(found.correction.tau > 400, 0.5, 1.0), longest=400.0)
    curve = doubtful.applied(allan_curve(found.residual.select("gyro")))
    assert curve.excluded[curve.tau > 600, 0].all()
    assert not curve.excluded[curve.tau < 200, 0].any()


# -- several channels, studies ---------------------------------------------------------------------------------


def two_sensors() -> Recording:
    one, other = (
        twin(seed=10),
        twin(seed=11, swing=0.0, rise=6.0, time_constant=LENGTH / 5, coefficient=-SLOPE),
    )
    names = (
        Channel.of("gx", "rad/s"),
        Channel.of("gy", "rad/s"),
        Channel.of("t1", "°C"),
        Channel.of("t2", "°C"),
    )
    columns = (one.columns[0], other.columns[0], one.columns[1], other.columns[1])
    return replace(one, channels=names, columns=columns)


def test_one_thermometer_for_each_sensor() -> None:
    record = two_sensors()
    freed = free_of_environment(record, channels=["gx", "gy"], temperature={"gx": "t1", "gy": "t2"})
    assert freed["gx"].thermometer is not None
    assert freed["gx"].thermometer.channel == "t1"
    assert freed["gy"].thermometer is not None
    assert freed["gy"].thermometer.channel == "t2"
    assert [s["channel"] for s in freed.residual.history if s["step"] == "environment"][:1] == ["gx"]
    with pytest.raises(InputError, match="no channel 'gz'"):
        free_of_environment(record, channels=["gx"], temperature={"gz": "t1"})
    with pytest.raises(InputError, match="choose a channel"):
        regress_environment(record)
    with pytest.raises(InputError, match="holds rate, not temperature"):
        regress_environment(record, channel="gx", temperature="gy")


@pytest.mark.long
def test_one_cut_for_all_sensors() -> None:
    record = twin(seed=12, coefficient=0.0, warm_up=(200 * DEG_H, LENGTH / 15))
    still = twin(seed=13, coefficient=0.0)
    both = replace(
        record,
        channels=(Channel.of("gx", "rad/s"), Channel.of("gy", "rad/s")),
        columns=(record.columns[0], still.columns[0]),
    )
    cuts = warm_ups_to_cut(both, channels=["gx", "gy"])
    assert cuts["gx"].cut == cuts["gy"].cut
    assert cuts["gx"].action == cuts["gy"].action == "cut"


@pytest.fixture(scope="module")
def study() -> al.Study:
    return al.characterize(
        twin(seed=4, warm_up=(150 * DEG_H, LENGTH / 12)), temperature="temp", warm_up="model"
    )


@pytest.mark.long
def test_a_study_says_whose_noise_it_is(study: al.Study) -> None:
    found = study["gyro"].environment
    assert found is not None and found.verdict == "resolved"
    codes = {f.code for f in study.findings}
    assert {"environment_taken_off", "warm_up"} <= codes
    assert "K" in {e.symbol for e in study.models["gyro"].estimates if not e.supported}
    again = al.Study.from_json(json.loads(json.dumps(study.to_json())))
    assert again.to_json() == study.to_json()
    raw = al.characterize(twin(seed=4, warm_up=(150 * DEG_H, LENGTH / 12)))
    assert any(e.symbol in "KR" and e.supported for e in raw.models["gyro"].estimates)
    assert raw["gyro"].environment is None


def test_reports_and_figures(study: al.Study, found: EnvironmentEstimate) -> None:
    page = text_of(html_of(study))
    assert "The noise model is that of the residual" in page
    assert "Curves and noise models above are those of the residual" in page
    own = text_of(html_of(FreedRecording(residual=found.residual, estimates=(found,))))
    assert "What was removed" in own
    assert "Fieller" in own
    for view in ("temperature", "deviation", "time"):
        assert len(plot(found, view=view).axes) >= 1
    assert sum(len(panel.curves) for panel in plot(found, interactive=True).sheet.panels) >= 8
    with pytest.raises(InputError, match="no view"):
        plot(found, view="colour")


# -- command line ----------------------------------------------------------------------------------------------


@pytest.mark.long
def test_the_command_says_what_the_library_says(run: Run, tmp_path: Path) -> None:
    """M13; and a column that is no temperature is refused with what to do."""
    record = twin(seed=20).window(0, 300 / RATE_HZ)
    table = np.column_stack([np.arange(300) / RATE_HZ, record.values("gyro"), record.values("temp")])
    log = tmp_path / "gyro.csv"
    np.savetxt(
        log, table, delimiter=",", comments="", header="time [s],gyro [rad/s],temp [degC]", fmt="%.17g"
    )
    shown = run("info", log)
    assert "temperature" in shown.out
    assert "degC" in shown.out
    done = run("environment", log, "--temperature", "temp", "--json", "-o", tmp_path / "residual.npy")
    assert done.code == 0, done.err
    own = json.loads(done.out)["channels"][0]["coefficients"][0]
    assert own["value"] == regress_environment(al.read(log), temperature="temp")["temperature"].value
    assert (tmp_path / "residual.npy").exists()
    wrong = run("environment", log, "--temperature", "gyro", "--channels", "gyro,temp")
    assert wrong.code == 1
    nothing = run("environment", log, "--temperature", "heat")
    assert (nothing.code, "heat" in nothing.err) == (1, True)


def test_f10_a_channel_names_no_place_outside_of_the_folder(run: Run, tmp_path: Path) -> None:
    record = twin(seed=20)
    gyro, temp = record.channels
    named = replace(record, channels=(replace(gyro, name="../../evil"), temp))
    log, out = write_recording(named, tmp_path / "log.parquet"), tmp_path / "a" / "b" / "out"
    done = run("environment", log, "--temperature", "temp", "--out", out)
    assert done.code == 0, done.err
    assert {p.name for p in tmp_path.rglob("*") if p.is_file()} == {
        "log.parquet", "report.html", "environment.json", "evil.csv",
    }  # fmt: skip
    assert (out / "evil.csv").exists()
    labels = ["../../x", "C:\\x", "\0", "con", "LPT1.txt", "X", "g" * 300, "g" * 300, "a/b", "", "ω"]
    made = file_names(labels, ".csv")
    assert len({name.lower() for name in made}) == len(labels)
    assert made[:6] == ["x.csv", "C_x.csv", "channel.csv", "_con.csv", "_LPT1.txt.csv", "X_2.csv"]
    for name in made:
        assert (tmp_path / name).parent == tmp_path and len(name.encode()) < 120
        (tmp_path / name).touch()


# -- a warm-up that nobody asked about ------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("slow", "walk"), [(0.0, 0.0), (0.0, 1e-4), (1e-4, 3e-5)])
def test_characterize_reports_a_warm_up_and_takes_no_slow_noise_for_one(
    seed: int, slow: float, walk: float
) -> None:
    rng = np.random.default_rng([20261128, seed])
    rate, n = 20.0, 18_000
    y = 2e-4 * np.sqrt(rate) * rng.standard_normal(n) + walk / np.sqrt(rate) * np.cumsum(
        rng.standard_normal(n)
    )
    if slow:
        y += gauss_markov(rng, n, slow, 60.0 * rate)
    warm = 20e-3 * np.exp(-np.arange(n) / rate / 150.0)
    for added, found in ((0.0, False), (warm, True)):
        record = al.Recording.from_rate(y + added, rate=rate, unit="rad/s", names="x")
        study = al.characterize(record)
        remarks = [f for f in study.findings if f.code == "warm_up"]
        assert bool(remarks) is found
        assert all(
            f.severity is Severity.WARNING and f.message.endswith("left in the record") for f in remarks
        )


@pytest.mark.parametrize("size", [0.0, 1e-6, 1.0])
def test_settling_is_seen_in_white_noise_alone_and_not_in_a_constant(size: float) -> None:
    """The question that is asked before the noise is fitted."""
    rng = np.random.default_rng(20261128)
    decay = size * np.exp(-np.arange(3000) / 400.0)
    for noise in (0.0, 1e-2):
        record = al.Recording.from_rate(
            3.0 + decay + noise * rng.standard_normal(3000), rate=1.0, unit="V", names="x"
        )
        assert settles(Climate.of(record, "x", None), 1e-3) is bool(size > noise)


@pytest.mark.parametrize("unit", ["rad", "m/s"])
def test_characterize_of_running_sums_looks_for_no_warm_up(unit: str) -> None:
    y = np.cumsum(np.random.default_rng(20261128).standard_normal(4000)) + np.exp(-np.arange(4000) / 500.0)
    record = al.Recording.from_angle(1e-6 * y, rate=1.0, unit=unit, names="x")
    assert not any(f.code == "warm_up" for f in al.characterize(record).findings)
