# SPDX-License-Identifier: BSD-3-Clause
"""Rate table: exact recovery, coverage, clocks, range, and what the checks are for."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom

from allanite.errors import FormatError, InputError
from allanite.experiments.rate_table import (
    RateSteps,
    RateTable,
    RateTableEstimate,
    Sampled,
    Sinusoids,
    TableUncertainty,
    measure_rate_table,
    read_rate_table,
    simulate_on_table,
)
from allanite.experiments.rate_table.earth_part import EarthPart
from allanite.experiments.rate_table.motion import TableClock
from allanite.experiments.rate_table.record.fit import solve
from allanite.experiments.rate_table.record.rows import RegressionRows, SampleSelection, power
from allanite.experiments.rate_table.record.timing import coarse_offset
from allanite.filtering.regression import LEVEL
from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.quantities.distributions import chi_square_quantile
from allanite.quantities.earth import EARTH_RATE
from allanite.recording.records import ArrayColumn, Channel, Recording

DEG = math.pi / 180
FULL = 100 * DEG
RATES = np.array([0, 10, -10, 40, -40, 100, -100, 0, 100, -100, 40, -40, 10, -10, 0]) * DEG
NOISE = NoiseModel.of(
    White(N=0.005 * DEG), GaussMarkov.from_sigma(0.003 * DEG, 60.0), RandomWalk(K=5e-5 * DEG)
)
#: So little that rounding shows.
SILENT = NoiseModel.of(White(N=1e-12))


def steps(dwell: float = 20.0) -> RateSteps:
    start = dwell * np.arange(len(RATES))
    return RateSteps(start=start, stop=start + dwell, rate=RATES)


def sweep() -> Sampled:
    t = np.arange(0.0, 300.05, 0.1)
    return Sampled.of_rates(t, FULL * (1 - np.abs((t / 100 + 0.25) % 1 * 4 - 2)))


def sinusoids(*frequencies: float, length: float = 100.0) -> Sinusoids:
    start = (length + 1) * np.arange(len(frequencies))
    one = np.ones(len(frequencies))
    return Sinusoids(
        start=start, stop=start + length, amplitude=FULL * one, frequency=frequencies, phase=0 * one
    )


def twin(
    table: RateTable, *, model: NoiseModel = NOISE, seed: int = 1, rate: float = 20.0, **truth: Any
) -> Recording:
    return simulate_on_table(
        model, table, rate=rate, duration=float(table.spans[-1, 1]) + 5.0, seed=seed, **truth
    )


def line_slopes(u: np.ndarray, degree: int) -> list[float]:
    """Slope of the best straight line of each power."""
    return [float(np.polyfit(u, u**k, 1)[0]) for k in range(2, degree + 1)]


def failed(found: RateTableEstimate) -> list[str]:
    return [c.name for c in found.checks if not c.passed]


# -- truth without noise ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("table", "tolerance"),
    [
        (steps(), 1e-9),
        (sweep(), 1e-8),
        (sinusoids(0.1), 1e-9),
        (
            Sampled.of_angles(
                np.arange(0, 300, 0.02), FULL / (2 * np.pi * 0.1) * (1 - np.cos(0.2 * np.pi * np.arange(0, 300, 0.02)))
            ),
            3e-6,
        ),
    ],
    ids=["steps", "rates", "sinusoid", "encoder"],
)  # fmt: skip
def test_without_noise_the_response_comes_back(table: RateTable, tolerance: float) -> None:
    truth = {"scale": -1.002, "bias": 0.05 * DEG, "powers": (2e-4, -1e-4), "full_scale": FULL}
    found = measure_rate_table(
        twin(table, model=SILENT, **truth),
        table=table,
        model=SILENT,
        nonlinearity=3,
        offset=0.0,
        dead_time=1.0,
    )
    ratio = truth["scale"] / found["scale factor"].value * (FULL / found.full_scale)
    assert found["bias"].value == pytest.approx(0.05 * DEG, abs=tolerance * FULL)
    assert found["quadratic"].value == pytest.approx(
        2e-4 * ratio * (found.full_scale / FULL) ** 2, abs=tolerance
    )
    assert found["cubic"].value == pytest.approx(
        -1e-4 * ratio * (found.full_scale / FULL) ** 3, abs=tolerance
    )
    if isinstance(table, RateSteps):
        u = RATES / FULL
        slope = 1 + np.dot([2e-4, -1e-4], line_slopes(u, 3))
        assert found["scale factor"].value == pytest.approx(-1.002 * slope, rel=1e-9)


def test_asymmetry_is_the_scale_of_plus_less_that_of_minus() -> None:
    table = steps()
    record = twin(table, model=SILENT, scale=1.0, asymmetry=3e-4)
    found = measure_rate_table(record, table=table, model=SILENT, nonlinearity="sign", dead_time=1.0)
    y = {r: next(s.mean for s in found.steps if s.rate == r) for r in (-FULL, 0.0, FULL)}
    plus, minus = (y[FULL] - y[0.0]) / FULL, (y[-FULL] - y[0.0]) / -FULL
    assert plus - minus == pytest.approx(3e-4, rel=1e-6)
    assert found["asymmetry"].value == pytest.approx((plus - minus) / found["scale factor"].value, rel=1e-6)


def test_gain_and_phase_of_a_first_order_sensor() -> None:
    table, corner = sinusoids(0.1, 0.5, 2.0), 5.0
    record = twin(table, model=SILENT, rate=100.0)
    t = (np.arange(record.n_samples) + 0.5) / 100
    row = table.row(t)
    f = table.frequency[row]
    gain, lag = 1 / np.sqrt(1 + (f / corner) ** 2), np.arctan(f / corner)
    own = FULL * gain * np.sinc(f / 100) * np.sin(2 * np.pi * f * (t - table.start[row]) - lag)
    record = replace(record, columns=(ArrayColumn(own),))
    found = measure_rate_table(record, table=table, model=SILENT, offset=0.0, nonlinearity=1)
    for point, frequency in zip(found.frequencies, (0.1, 0.5, 2.0), strict=True):
        assert point.frequency == frequency
        assert point.gain == pytest.approx(1 / math.sqrt(1 + (frequency / corner) ** 2), rel=1e-6)
        assert point.phase == pytest.approx(-math.atan(frequency / corner), abs=1e-6)
    assert found["scale factor"].value == pytest.approx(found.frequencies[0].gain, rel=1e-6)
    assert found["delay"].value == pytest.approx(math.atan(0.1 / corner) / (0.2 * math.pi), rel=1e-6)
    assert any("0.1 Hz" in note for note in found.notes)


# -- witnesses ----------------------------------------------------------------------------------------------


def test_in_white_noise_it_is_plain_least_squares() -> None:
    table, white = steps(), NoiseModel.of(White(N=0.01 * DEG))
    record = twin(table, model=white, seed=3, powers=(1e-4,))
    rows = RegressionRows.of(record, "gyro", table, SampleSelection(dead_time=2.0), model=white, size=1)
    found = solve(rows, white, (power(2),))
    x, y = [], []
    for start, rate in zip(table.start, table.rate, strict=True):
        own = record.values("gyro")[round((start + 2) * 20) : round((start + 20) * 20)]
        x += [rate] * len(own)
        y += own.tolist()
    u = np.array(x) / FULL
    design = np.column_stack([np.ones_like(u), u, u**2 - np.polyval(np.polyfit(u, u**2, 1), u)])
    plain, *_ = np.linalg.lstsq(design, np.array(y), rcond=None)
    covariance = (0.01 * DEG) ** 2 * 20 * np.linalg.inv(design.T @ design)
    assert found.fit.coefficients == pytest.approx(plain, rel=1e-9, abs=1e-15)
    assert found.fit.sd == pytest.approx(np.sqrt(np.diag(covariance)), rel=1e-9)
    assert found.bias[0] == pytest.approx(np.polyfit(u, y, 2)[2], rel=1e-6)
    assert found.fit.names[0] == LEVEL


def test_b6_units_scale_and_nothing_else() -> None:
    table, factor = steps(), 1e-6
    record = twin(table, powers=(2e-4,), scale=1.002)
    small = NoiseModel.of(
        *(White(N=t.N * factor) if isinstance(t, White) else
          GaussMarkov(q=t.q * factor, T=t.T) if isinstance(t, GaussMarkov) else
          RandomWalk(K=t.K * factor) for t in NOISE.terms), kind="voltage",
    )  # fmt: skip
    volts = Recording.from_rate(record.values("gyro") * factor, rate=20.0, unit="V", names="gyro")
    a = measure_rate_table(record, table=table, model=NOISE)
    b = measure_rate_table(volts, table=table, model=small)
    for name in ("quadratic", "nonlinearity", "asymmetry", "clock offset"):
        assert b[name].value == pytest.approx(a[name].value, rel=1e-7)
        assert b[name].total_sd == pytest.approx(a[name].total_sd, rel=1e-7)
    assert b["scale factor"].value == pytest.approx(factor * a["scale factor"].value, rel=1e-10)
    assert b["scale factor"].unit == "V/(rad/s)" and "scale-factor error" not in b.names


def test_a_table_that_counts_the_other_way_round_turns_odd_signs() -> None:
    table = steps()
    record = twin(table, powers=(2e-4, 1e-4))
    other = replace(table, rate=-table.rate)
    a = measure_rate_table(record, table=table, model=NOISE, nonlinearity=3, offset=0.0)
    b = measure_rate_table(record, table=other, model=NOISE, nonlinearity=3, offset=0.0)
    assert b["scale factor"].value == pytest.approx(-a["scale factor"].value, rel=1e-10)
    assert b["quadratic"].value == pytest.approx(-a["quadratic"].value, rel=1e-7)
    assert b["cubic"].value == pytest.approx(a["cubic"].value, rel=1e-7)
    assert b["scale-factor error"].value == pytest.approx(a["scale-factor error"].value, rel=1e-7)
    assert any("opposite signs" in note for note in b.notes)


# -- intervals ----------------------------------------------------------------------------------------------


TWINS = 20


@pytest.mark.long
@pytest.mark.parametrize("kind", ["steps", "sweep", "sinusoid"])
def test_intervals_hold_the_truth(kind: str) -> None:
    """Sum of squares of errors over stated sd inside its 99.9 % bounds; 1000 twins each are in `make verify`."""
    table = {"steps": steps(), "sweep": sweep(), "sinusoid": sinusoids(0.1, length=300.0)}[kind]
    u = {
        "steps": RATES / FULL,
        "sweep": np.linspace(-1, 1, 20001),
        "sinusoid": np.sin(np.linspace(0, 2 * np.pi, 20001)),
    }
    slopes = line_slopes(u[kind], 3)
    errors: dict[str, list[float]] = {}
    inside: list[bool] = []
    for seed in range(TWINS):
        rng = np.random.default_rng([20261121, seed, len(kind)])
        c, bias, offset = 1e-4 * rng.standard_normal(2), 0.1 * DEG * rng.standard_normal(), rng.uniform(0, 2)
        record = twin(table, seed=seed, scale=1.002, bias=bias, powers=c, offset=offset)
        found = measure_rate_table(record, table=table, model=NOISE, nonlinearity=3)
        line = 1.002 * (1 + c @ slopes)
        truth = {
            "scale factor": line,
            "bias": bias,
            "quadratic": c[0] * 1.002 / line,
            "cubic": c[1] * 1.002 / line,
            "clock offset": offset,
        }
        for name, value in truth.items():
            p = found[name]
            errors.setdefault(name, []).append((p.value - value) / p.total_sd)
            inside.append(p.interval[0] <= value <= p.interval[1])
    low, high = chi_square_quantile(5e-4, TWINS), chi_square_quantile(1 - 5e-4, TWINS)
    sums = {name: float(np.sum(np.square(values))) for name, values in errors.items()}
    assert all(low <= s <= high for s in sums.values()), sums
    assert sum(inside) >= 5 * binom.ppf(1e-3, TWINS, 0.95)  # the worst case: the five of a twin go together


def test_misalignment_of_the_other_axes() -> None:
    table = steps()
    along = twin(table, seed=1)
    across = twin(table, seed=2, scale=1.5e-3, name="x")
    both = replace(
        along, channels=(*across.channels, *along.channels), columns=(*across.columns, *along.columns)
    )
    found = measure_rate_table(both, table=table, model={"x": NOISE, "gyro": NOISE})
    assert found.channel == "gyro"  # the one that responds most
    p = found["misalignment of x"]
    assert p.unit == "rad" and p.interval[0] < 1.5e-3 < p.interval[1] and p.total_sd < 1e-4
    none = measure_rate_table(both, table=table, channel="gyro", model=NOISE, cross_axes=())
    assert not any(n.startswith("misalignment") for n in none.names)


def test_what_is_not_seen_has_a_limit() -> None:
    table = steps()
    found = measure_rate_table(twin(table, scale=1.002), table=table, model=NOISE)
    p = found["quadratic"]
    assert not p.resolved and p.limit is not None
    assert p.limit == pytest.approx(max(abs(end) for end in p.interval)) and p.limit > 1.9 * p.total_sd
    assert not found["nonlinearity"].resolved and found["nonlinearity"].interval[0] == 0.0
    assert found["scale-factor error"].resolved and found["scale-factor error"].limit is None


def test_nonlinearity_is_the_largest_deviation_from_the_line() -> None:
    table = steps()
    found = measure_rate_table(
        twin(table, powers=(5e-4,), scale=1.0), table=table, model=NOISE, nonlinearity=2
    )
    u = RATES / FULL
    grid = np.linspace(-1, 1, 201)
    line = np.polyval(np.polyfit(u, u**2, 1), grid)
    truth = 5e-4 * float(np.abs(grid**2 - line).max())
    low, high = found["nonlinearity"].interval
    assert low < truth < high and found["nonlinearity"].resolved


def test_stated_uncertainties_enter_the_scale_factor() -> None:
    table = steps()
    record = twin(table)
    plain = measure_rate_table(record, table=table, model=NOISE)
    sure = TableUncertainty(scale=2e-5, misalignment=5e-3)
    stated = measure_rate_table(record, table=table, model=NOISE, stated=sure, axis="horizontal")
    budget = stated.budget
    assert budget["table rate"] == 2e-5
    assert budget["misalignment"] == pytest.approx(math.sqrt(3) / 2 * 25e-6)
    whole = math.sqrt(sum(v**2 for v in budget.values())) * abs(stated["scale factor"].value)
    assert stated["scale factor"].total_sd == pytest.approx(whole, rel=1e-9)
    assert stated["scale factor"].sd == pytest.approx(plain["scale factor"].sd, rel=1e-12)
    with pytest.raises(InputError, match="scale"):
        TableUncertainty(scale=-1.0)


# -- clocks -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("table", [steps(), sweep(), sinusoids(0.05, 0.2)], ids=lambda t: t.kind)
@pytest.mark.parametrize("offset", [-4.3, 0.0, 3.7])
def test_the_offset_of_the_clocks_is_found(table: RateTable, offset: float) -> None:
    record = twin(table, offset=offset)
    start = coarse_offset(record, "gyro", table).offset
    found = measure_rate_table(record, table=table, model=NOISE)
    assert start == pytest.approx(offset, abs=0.6)
    assert found["clock offset"].value == pytest.approx(offset, abs=4 * found["clock offset"].total_sd + 1e-4)
    assert found.clock == "found" and not failed(found)


@pytest.mark.parametrize("table", [steps(), sweep()], ids=lambda t: t.kind)
def test_clocks_that_run_apart_are_noticed(table: RateTable) -> None:
    found = measure_rate_table(twin(table, offset=1.0, drift=3e-4), table=table, model=NOISE)
    drift = found["clock drift"]
    assert drift.value == pytest.approx(3e-4, abs=5 * drift.total_sd) and drift.total_sd < 5e-5
    assert any("ppm" in note for note in found.notes)
    level = measure_rate_table(twin(table, offset=1.0), table=table, model=NOISE)
    assert "clock drift" not in level.names


@pytest.mark.parametrize("table", [steps(), sweep(), sinusoids(0.1)], ids=lambda t: t.kind)
def test_by_a_clock_that_is_given_the_delay_is_the_sensors(table: RateTable) -> None:
    found = measure_rate_table(twin(table, offset=0.35, scale=1.002), table=table, model=NOISE, offset=0.3)
    delay = found["delay"]
    assert delay.value == pytest.approx(0.05, abs=4 * delay.total_sd) and "clock offset" not in found.names
    assert found["scale factor"].value == pytest.approx(1.002, abs=4 * found["scale factor"].total_sd)
    assert (
        found.clock == "given"
        and any("the output lags the table" in n for n in found.notes)
        and not failed(found)
    )


def holed(record: Recording, missing: np.ndarray) -> Recording:
    samples = np.array(record.values("gyro"))
    samples[missing] = np.nan
    return replace(record, columns=(ArrayColumn(samples), *record.columns[1:]))


def test_missing_samples_hide_no_clock() -> None:
    table = steps()
    record = twin(table, offset=1.3, scale=1.002)
    lost = np.random.default_rng(9).random(record.n_samples) < 0.1
    lost[2000:2100] = True
    found = measure_rate_table(holed(record, lost), table=table, model=NOISE)
    whole = measure_rate_table(record, table=table, model=NOISE)
    assert found.clock == "found" and found.verdict == "resolved" and not failed(found)
    for name in ("clock offset", "scale factor"):
        assert found[name].value == pytest.approx(whole[name].value, abs=4 * found[name].total_sd)
        assert found[name].total_sd < 2 * whole[name].total_sd


def test_a_change_that_a_gap_hides_says_little_of_the_clock() -> None:
    table = RateSteps(start=[0.0, 20.0], stop=[20.0, 40.0], rate=[0.0, FULL])
    record = twin(table)
    lost = np.zeros(record.n_samples, dtype=bool)
    lost[390:405] = True  # the change at 20 s is sample 400: not in the middle
    found = measure_rate_table(holed(record, lost), table=table, model=NOISE, nonlinearity=1)
    offset = found["clock offset"]
    assert offset.total_sd == pytest.approx(16 / math.sqrt(12) / 20, rel=0.05)  # anywhere in the gap
    assert abs(offset.value) < 2 * offset.total_sd


def test_edges_that_clip_are_no_witnesses_of_the_clock() -> None:
    table = steps()
    record = twin(table, offset=1.0, settling=0.3, limit=90 * DEG)
    found = measure_rate_table(record, table=table, model=NOISE)
    offset = found["clock offset"]
    assert "clock drift" not in found.names
    assert offset.value == pytest.approx(1.3, abs=4 * offset.total_sd)


@pytest.mark.parametrize(("offset", "taken"), [(-47.0, -7.0), (-33.0, 7.0)])
def test_a_motion_that_repeats_itself_is_said_to(offset: float, taken: float) -> None:
    """Square waves of 40 s with the log in the middle: other offsets, and the other sign of the sensor, fit as well."""
    start = 20.0 * np.arange(16)
    table = RateSteps(start=start, stop=start + 20, rate=np.tile([50 * DEG, -50 * DEG], 8))
    record = simulate_on_table(NOISE, table, rate=20.0, duration=200.0, seed=3, offset=offset)
    found = measure_rate_table(record, table=table, model=NOISE, nonlinearity=1)
    assert found["clock offset"].value == pytest.approx(taken, abs=0.01) and found["scale factor"].value > 0
    (note,) = [n for n in found.notes if "periodic" in n]
    assert "opposite sign" in note and "--offset" in note
    for other in (steps(), sweep(), sinusoids(0.1)):
        assert not any(
            "periodic" in n for n in measure_rate_table(twin(other), table=other, model=NOISE).notes
        )


@pytest.mark.parametrize("offset", [-1.3, 3.0])
def test_of_a_single_sinusoid_the_nearest_period_is_taken(offset: float) -> None:
    """The log begins before the first swing, or in it: then all earlier periods fit as well."""
    table = sinusoids(0.5)
    found = measure_rate_table(twin(table, rate=20.0, offset=offset), table=table, model=NOISE)
    assert any("periodic" in n for n in found.notes) == (offset < 0)
    assert found["clock offset"].value == pytest.approx(offset, abs=4 * found["clock offset"].total_sd)
    assert found["scale factor"].value == pytest.approx(1.0, abs=4 * found["scale factor"].total_sd)


def test_without_a_model_the_clock_of_a_sweep_is_as_well_known() -> None:
    table, record = sweep(), twin(sweep())
    own = measure_rate_table(record, table=table)["clock offset"]
    known = measure_rate_table(record, table=table, model=NOISE)["clock offset"]
    assert own.total_sd == pytest.approx(known.total_sd, rel=0.5)


def test_a_slow_sensor_gets_a_longer_dead_time() -> None:
    table = steps()
    quick = measure_rate_table(twin(table, settling=0.02), table=table, model=NOISE)
    slow = measure_rate_table(twin(table, settling=0.5), table=table, model=NOISE)
    assert quick.dead_time < 1.5 < slow.dead_time < 10
    assert slow["scale factor"].value == pytest.approx(1.0, abs=4 * slow["scale factor"].total_sd)
    wrong = measure_rate_table(twin(table, settling=0.5), table=table, model=NOISE, dead_time=0.0)
    assert failed(wrong)
    crawling = measure_rate_table(twin(table, settling=15.0), table=table, model=NOISE)
    assert any("settled" in note for note in crawling.notes)


def test_an_encoder_that_saw_steps_is_taken_for_steps() -> None:
    own = steps()
    t = np.arange(0.0, 300.0, 0.02)
    table = Sampled.of_angles(t, np.cumsum(own.means(t, 0.0)) * 0.02)
    found = measure_rate_table(twin(own, scale=1.002), table=table, model=NOISE)
    assert len(found.steps) == len(RATES) and not failed(found)
    assert found["scale factor"].value == pytest.approx(1.002, abs=5 * found["scale factor"].total_sd)
    assert sweep().plateaus() is None
    # The encoder saw the changes: the offset is known as well as from steps that follow one another.
    bare = measure_rate_table(twin(own, scale=1.002), table=own, model=NOISE)
    assert found["clock offset"].total_sd == pytest.approx(bare["clock offset"].total_sd, rel=0.3)
    offset = found["clock offset"]  # the sum of the angle runs one row ahead
    assert offset.value == pytest.approx(0.02, abs=4 * offset.total_sd)
    repeats = next(c for c in found.checks if c.name == "scatter of the repeats")
    assert repeats.dof == len(RATES) - len(set(RATES))


@pytest.mark.parametrize("wraps", [True, False])
def test_an_encoder_wraps_or_counts_on(wraps: bool) -> None:
    """Three quarters of a turn from row to row: no jump where an encoder counts on; a quarter back where it wraps."""
    t = np.arange(0.0, 100.0, 1.0)
    angle = 1.5 * math.pi * t
    table = Sampled.of_angles(t, angle % (2 * math.pi) if wraps else angle)
    rate = -0.5 * math.pi if wraps else 1.5 * math.pi
    assert table.means(np.array([10.0]), 50.0) == pytest.approx([rate])


# -- what goes wrong ----------------------------------------------------------------------------------------


def test_steps_beyond_the_range_are_left_out_by_name() -> None:
    table = steps()
    found = measure_rate_table(twin(table, scale=1.002, limit=90 * DEG), table=table, model=NOISE)
    out = {round(s.rate / DEG) for s in found.steps if not s.used}
    assert out == {100, -100} and all(s.why == "beyond the range" for s in found.steps if not s.used)
    assert found.full_scale == pytest.approx(40 * DEG)
    assert "-100, 100 deg/s" in found.notes[0] and found.verdict == "resolved"
    assert found["scale factor"].value == pytest.approx(1.002, abs=4 * found["scale factor"].total_sd)


def test_a_coarse_record_is_not_taken_for_clipped() -> None:
    table = steps()
    record = twin(table)
    counts = np.round(record.values("gyro") / (0.05 * DEG))
    coarse = Recording.from_rate(counts, rate=20.0, unit="LSB", names="gyro")
    model = NoiseModel.of(White(N=0.1), kind="counts")
    found = measure_rate_table(coarse, table=table, model=model)
    assert all(s.used for s in found.steps)
    assert found["scale factor"].value == pytest.approx(20 / DEG, rel=1e-3)
    assert found["scale factor"].unit == "LSB/(rad/s)"


def test_rates_of_a_sweep_beyond_the_range_are_left_out() -> None:
    table = sweep()
    found = measure_rate_table(twin(table, scale=1.002, limit=80 * DEG), table=table, model=NOISE)
    assert 75 * DEG < found.full_scale < 80 * DEG
    assert found["scale factor"].value == pytest.approx(1.002, abs=4 * found["scale factor"].total_sd)
    assert any("are left out" in note for note in found.notes)


def test_noise_that_grows_with_the_rate_is_named_and_weighed() -> None:
    table = steps()
    plain = measure_rate_table(twin(table), table=table, model=NOISE)
    found = measure_rate_table(twin(table, noise_growth=2.0), table=table, model=NOISE)
    assert "noise against the rate" in failed(found) and "noise against the rate" not in failed(plain)
    worst = max(found.noise_by_rate, key=lambda n: n.ratio)
    assert worst.rate == pytest.approx(FULL) and worst.ratio == pytest.approx(3.0, abs=0.6)
    assert found["scale factor"].sd > 1.1 * plain["scale factor"].sd and found.verdict == "resolved"


def test_repeats_that_disagree_widen_the_interval() -> None:
    table = steps()
    rng = np.random.default_rng(5)
    moved = replace(table, rate=table.rate * (1 + 5e-4 * rng.standard_normal(len(RATES))))
    found = measure_rate_table(twin(moved), table=table, model=NOISE)
    assert "scatter of the repeats" in failed(found) and found.inflation > 1.5
    low, high = found["scale factor"].interval
    assert high - low > 1e-3 * 0.3


def test_a_curve_that_was_not_fitted_is_named() -> None:
    table = steps()
    found = measure_rate_table(twin(table, powers=(0.0, 2e-3)), table=table, model=NOISE, nonlinearity=2)
    assert "shape of the response" in failed(found) and "--nonlinearity" in " ".join(found.advice)
    better = measure_rate_table(twin(table, powers=(0.0, 2e-3)), table=table, model=NOISE, nonlinearity=3)
    assert not failed(better) and better["cubic"].resolved
    swept = measure_rate_table(twin(sweep(), powers=(0.0, 2e-3)), table=sweep(), model=NOISE)
    assert "shape of the response" in failed(swept)


def test_hysteresis_is_named() -> None:
    table = steps()
    record = twin(table)
    t = (np.arange(record.n_samples) + 0.5) / 20
    way = table.direction[np.clip(np.searchsorted(table.start, t, side="right") - 1, 0, len(RATES) - 1)]
    lagging = replace(record, columns=(ArrayColumn(record.values("gyro") + 3e-4 * FULL * way),))
    found = measure_rate_table(lagging, table=table, model=NOISE, offset=0.0)
    (check,) = [c for c in found.checks if c.name == "hysteresis"]
    assert not check.passed
    size = float(check.says.split("at rest by ")[1].split(" ppm")[0])
    assert size == pytest.approx(600, rel=0.15)  # from one direction to the other


def test_a_scale_factor_that_drifts_is_named_and_follows_a_temperature() -> None:
    table = steps()
    record = twin(table, scale=1.0)
    t = (np.arange(record.n_samples) + 0.5) / 20
    warm = 25.0 + 10 * t / t[-1]
    rate = table.means(t, 0.0)
    samples = record.values("gyro") + rate * 40e-6 * (warm - warm.mean()) + 0.002 * DEG * (warm - warm.mean())
    channels = (record.channels[0], Channel.of("temperature", "°C"))
    both = replace(record, channels=channels, columns=(ArrayColumn(samples), ArrayColumn(warm)))
    blind = measure_rate_table(both, table=table, model=NOISE)
    assert "constancy of the scale factor" in failed(blind)
    found = measure_rate_table(both, table=table, model=NOISE, temperature="temperature")
    assert "constancy of the scale factor" not in failed(found)
    slope, bias = found["scale factor over temperature"], found["bias over temperature"]
    assert slope.interval[0] < 40e-6 < slope.interval[1] and slope.resolved
    rare = np.where(np.arange(len(warm)) % 20 == 0, warm, np.nan)  # once a second
    rare[1000:3000] = np.nan
    seldom = replace(both, columns=(ArrayColumn(samples), ArrayColumn(rare)))
    again = measure_rate_table(seldom, table=table, model=NOISE, temperature="temperature")
    assert again["scale factor over temperature"].value == pytest.approx(slope.value, rel=1e-3)
    assert bias.value == pytest.approx(0.002 * DEG, abs=4 * bias.total_sd)


def test_a_table_of_another_record_is_no_scale_factor() -> None:
    table = steps()
    other = replace(table, rate=np.random.default_rng(2).permutation(table.rate))
    assert measure_rate_table(twin(table), table=other, model=NOISE).verdict != "resolved"
    still = measure_rate_table(twin(table, scale=0.0), table=table, model=NOISE)
    assert still.verdict == "not resolved" and still.clock == "not seen"
    foreign = NoiseModel.of(White(N=5e-7 * DEG))
    for own in (table, sweep(), sinusoids(0.1)):
        assert measure_rate_table(twin(own), table=own, model=foreign).verdict == "inconsistent"
    assert still.points == () and "quadratic" not in still.names  # relative to nothing


@pytest.mark.parametrize("every", [0.1, 20.0], ids=["rates", "one row for each step"])
def test_rows_too_far_apart_to_hold_each_change_are_no_table(every: float) -> None:
    own = steps()
    t = np.arange(0.0, 300.0, every)
    table = Sampled.of_rates(t, own.means(t, 0.0))
    found = measure_rate_table(twin(own), table=table, model=NOISE)
    assert (found.verdict == "resolved") == (every < 1)


def test_a_channel_of_one_value_is_refused() -> None:
    table = steps()
    dead = Recording.from_rate(np.zeros(6000), rate=20.0, unit="deg/s", names="gyro")
    with pytest.raises(InputError, match="one value throughout"):
        measure_rate_table(dead, table=table, model=NOISE)


@pytest.mark.parametrize("nonlinearity", [1, 2, 3, 4, 5, "sign"])
@pytest.mark.parametrize(
    "rates",
    [
        (0, 10, 30, 60, 100),
        (-100, -40, -10, 0),
        (10, 30, 60),
        (0, 100),
        (33.3, 100),
        (-100, 100),
        (-100, 0, 100),
        (-70, -20, 100),
        (-100, -50, 0, 10, 20, 100),
    ],
)
@pytest.mark.parametrize("model", [SILENT, NOISE])
def test_what_the_rates_do_not_determine_has_no_number(
    rates: tuple[float, ...], nonlinearity: int | str, model: NoiseModel
) -> None:
    """A polynomial needs a rate more than its degree; two slopes need rates that are not on one of them."""
    every = np.array([*rates, *rates[::-1]]) * DEG
    start = 10.0 * np.arange(len(every))
    table = RateSteps(start=start, stop=start + 10.0, rate=every)
    record = twin(table, model=model, scale=1.003)
    found = measure_rate_table(
        record, table=table, model=model, nonlinearity=nonlinearity, dead_time=1.0, offset=0.0
    )
    two_slopes = int(np.linalg.matrix_rank(np.column_stack([np.ones(len(rates)), rates, np.abs(rates)]))) == 3
    enough = two_slopes if nonlinearity == "sign" else len(rates) > int(nonlinearity)
    assert (found.verdict != "not separable") is enough
    for parameter in found.parameters:
        assert not abs(parameter.value) > 1e3, parameter.name
    # beside the odd powers of a curve two slopes need still more rates
    odd = 0 if nonlinearity == "sign" else (int(nonlinearity) - 1) // 2
    if odd == 0:
        assert math.isfinite(found["asymmetry"].value) is two_slopes
    if not two_slopes:
        missing = "negative" if min(rates) >= 0 else "positive" if max(rates) <= 0 else ""
        words = f"not determined: no {missing} rates" if missing else "not determined: too few rates"
        assert found.asymmetry_unknown == words
        assert nonlinearity != "sign" or words in found.reason


def test_one_rate_is_not_separable_and_says_so() -> None:
    table = RateSteps(start=[0.0, 30.0], stop=[30.0, 60.0], rate=[DEG, DEG])
    found = measure_rate_table(twin(table), table=table, model=NOISE)
    assert found.verdict == "not separable" and math.isnan(found["scale factor"].value)
    json.dumps(found.to_json(), allow_nan=False)
    both = RateSteps(start=[0.0, 30.0], stop=[30.0, 60.0], rate=[-DEG, DEG])
    assert "2 rates" in measure_rate_table(twin(both), table=both, model=NOISE).reason
    few = RateSteps(start=[0.0, 30.0], stop=[30.0, 60.0], rate=[0.0, DEG])
    assert measure_rate_table(twin(few), table=few, model=NOISE).verdict == "not separable"
    assert measure_rate_table(twin(few), table=few, model=NOISE, nonlinearity=1).verdict == "resolved"


def test_without_a_model_the_noise_comes_from_the_record_and_the_interval_is_wider() -> None:
    table = steps()
    record = twin(table, scale=1.002)
    found = measure_rate_table(record, table=table)
    assert found.model_source == "this record"
    assert {type(t) for t in found.model.terms} == {White, Flicker}
    low, high = found["scale factor"].interval
    assert low < 1.002 < high
    assert (high - low) / 2 > 1.96 * found["scale factor"].total_sd * 1.01  # Student's law


# -- the Earth ----------------------------------------------------------------------------------------------


def test_the_bias_holds_the_earth_of_a_vertical_axis() -> None:
    table, latitude = steps(), 0.8
    quiet = NoiseModel.of(White(N=1e-5 * DEG))
    bias = EARTH_RATE * math.sin(latitude) + 2e-5
    record = twin(table, model=quiet, bias=bias)
    up = measure_rate_table(record, table=table, model=quiet, axis="up", latitude=latitude)
    own = up["bias without the Earth"]
    assert own.interval[0] < 2e-5 < own.interval[1] and own.total_sd < 1e-6
    down = EarthPart("down", latitude)
    assert down.along == pytest.approx(-EARTH_RATE * math.sin(latitude))
    either = measure_rate_table(record, table=table, model=quiet, latitude=latitude)
    assert "bias without the Earth" not in either.names and any("--axis" in n for n in either.notes)
    with pytest.raises(InputError, match="axis"):
        EarthPart("sideways", None)


def test_whole_revolutions_leave_nothing_of_the_earth() -> None:
    part = EarthPart("horizontal", 0.5)
    whole = RateSteps(
        start=[0.0, 10.0], stop=[10.0, 20.0], rate=[0.4 * math.pi, -0.4 * math.pi]
    )  # two turns each
    half = RateSteps(start=[0.0, 10.0], stop=[10.0, 20.0], rate=[0.05 * math.pi, -0.05 * math.pi])
    used, length = np.array([0, 1]), np.array([10.0, 10.0])
    assert part.wobble(whole, used, length, 1e-3)[0] == pytest.approx(0.0, abs=1e-15)
    # By hand: each step turns by pi/2; the mean of a cosine over it is at most sin(pi/4)/(pi/4).
    each = 1e-3 * EARTH_RATE * math.sin(math.pi / 4) / (math.pi / 4) / math.sqrt(2)
    scale, bias = part.wobble(half, used, length, 1e-3)
    assert scale == pytest.approx(each / math.sqrt(2) / (0.05 * math.pi))
    assert bias == pytest.approx(each / math.sqrt(2))


# -- the reference-aided filter -----------------------------------------------------------------------------


def test_the_aided_filter_takes_slow_noise_off_and_measures_nothing() -> None:
    loud = NoiseModel.of(
        White(N=0.002 * DEG), GaussMarkov.from_sigma(0.01 * DEG, 60.0), RandomWalk(K=1e-5 * DEG)
    )
    table = steps()
    found = measure_rate_table(twin(table, model=loud, scale=1.002), table=table, model=loud)
    assert found.aided is not None and "no measurement" in found.aided.statement
    assert found.aided.corrected < 0.5 * found.aided.raw
    assert found.aided.scale == pytest.approx(found["scale factor"].value, abs=2 * found["scale factor"].sd)
    white = NoiseModel.of(White(N=0.002 * DEG))
    assert measure_rate_table(twin(table, model=white), table=table, model=white).aided is None


# -- reading tables -----------------------------------------------------------------------------------------


def written(folder: Path, text: str) -> Path:
    place = folder / "table.csv"
    place.write_text(text, encoding="utf-8")
    return place


def test_tables_of_every_kind_are_read(tmp_path: Path) -> None:
    table = read_rate_table(written(tmp_path, "start;stop;rate [deg/s]\n# rest\n0;10;0,5\n12;20;-3\n"))
    assert isinstance(table, RateSteps) and table.rate == pytest.approx([0.5 * DEG, -3 * DEG])
    table = read_rate_table(written(tmp_path, "time_ms,angle_deg\n0,350\n10,359\n20,8\n30,17\n"))
    assert isinstance(table, Sampled) and table.angle[-1] - table.angle[0] == pytest.approx(27 * DEG)
    assert table.interval == pytest.approx(0.01)
    table = read_rate_table(written(tmp_path, "t,speed_rpm\n0,0\n1,1\n2,2\n"))
    assert isinstance(table, Sampled) and table.means(np.array([0.0]), 2.0) == pytest.approx([math.tau / 60])
    table = read_rate_table(
        written(tmp_path, "start,stop,amplitude_deg_s,frequency_hz\n0,100,50,0.1\n110,120,50,5\n")
    )
    assert isinstance(table, Sinusoids) and table.frequency.tolist() == [0.1, 5.0]


@pytest.mark.parametrize(
    "text",
    [
        "start,stop,rate_deg_s\n0,30,1\n32.5,60,2\n",
        "start,stop,rate\ns,s,deg/s\n0,30,1\n32.5,60,2\n",
        "start,stop,rate_deg_s\n1700000000,1700000030,1\n1700000032.5,1700000060,2\n",
        "start,stop,rate_deg_s\n2026-11-21T10:00:00Z,2026-11-21 10:00:30,1\n2026-11-21 10:00:32.5,2026-11-21 10:01,2\n",
        "start;stop;rate [°/s]\n0;30;1\n32,5;60;2\n",
    ],
    ids=["plain", "units in a row", "epoch", "dates", "decimal comma"],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_tables_as_loggers_write_them(tmp_path: Path, text: str, encoding: str) -> None:
    (tmp_path / "table.csv").write_bytes(text.encode(encoding))
    table = read_rate_table(tmp_path / "table.csv")
    assert isinstance(table, RateSteps) and table.rate == pytest.approx([DEG, 2 * DEG])
    assert table.spans == pytest.approx(np.array([[0.0, 30.0], [32.5, 60.0]]), abs=1e-6)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("start,stop,rate\n0,1,2\n", "line 1, column 'rate': no unit"),
        ("start,stop,rate_deg\n0,1,2\n", "line 1, column 'rate'"),
        ("start,stop,rate_deg_s\n0,10,1\n10,20,x\n", "line 3, column 'rate': 'x' is no number"),
        ("start,stop,rate_deg_s\n0,10\n", "line 2: no cell in column 'rate'"),
        ("start,stop,rate_deg_s\n0,10,1\n5,20,2\n", "line 3: start 5 s comes before"),
        ("start,stop,rate_deg_s\n10,5,1\n", "line 2: stop 5 s does not come after"),
        ("time,angle_deg\n0,1\n2,3\n1,4\n", "line 4: column 'time' does not grow"),
        ("start,stop,rate_deg_s,rate_rpm\n0,1,2,3\n", "two columns 'rate'"),
        ("start,stop\n0,1\n", "a table needs the columns"),
        ("start,stop,amplitude_deg_s,frequency\n0,1,-2,3\n", "line 2: amplitude must be positive"),
        ("start,stop,rate_deg_s\n", "no rows"),
        ("", "is empty"),
    ],
)
def test_errors_name_line_and_column(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises((FormatError, InputError)) as error:
        read_rate_table(written(tmp_path, text))
    assert said in str(error.value) and "table.csv" in str(error.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"nonlinearity": 9}, "degree from 1 to 5"),
        ({"nonlinearity": "cubic"}, "degree from 1 to 5"),
        ({"channel": "nobody"}, "no channel"),
        ({"confidence": 1.0}, "confidence"),
        ({"dead_time": -1.0}, "dead_time"),
        ({"dead_time": 30.0}, "shorter than"),
        ({"offset": 1e4}, "do not overlap"),
        ({"axis": "east"}, "axis"),
        ({"temperature": "gyro"}, "is measured"),
        ({"cross_axes": ("gyro",)}, "cannot be across"),
        ({"model": NoiseModel.of(White(N=1.0), kind="voltage")}, "is of voltage, not of rate"),
        ({"model": {"other": NOISE}}, "no noise model for"),
    ],
)
def test_wrong_arguments_are_refused(change: dict[str, Any], said: str) -> None:
    table = steps()
    with pytest.raises(InputError, match=said):
        measure_rate_table(twin(table), **{"table": table, "model": NOISE, **change})


# -- the result ---------------------------------------------------------------------------------------------


def test_the_result_is_plain_and_frozen() -> None:
    table = steps()
    seen: list[float] = []
    found = measure_rate_table(
        twin(table), table=table, model=NOISE, progress=lambda fraction, what: seen.append(fraction)
    )
    document = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert document["format"] == "allanite-rate-table" and document["version"] == 2
    assert document["parameters"][0]["name"] == "scale factor" and seen == sorted(seen)
    assert len(document["steps"]) == len(RATES) and document["table"]["kind"] == "steps"
    with pytest.raises(AttributeError):
        found.verdict = "better"  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        table.rate[0] = 1.0
    with pytest.raises(InputError, match="no parameter"):
        found["wow"]


def test_a_clock_counts_both_ways() -> None:
    clock = TableClock(offset=3.0, drift=1e-4)
    t = np.linspace(-5, 500, 7)
    assert clock.table_time(clock.record_time(t)) == pytest.approx(t, abs=1e-10)


@pytest.mark.parametrize(
    "made",
    [
        lambda: RateSteps(start=[0.0], stop=[0.0], rate=[1.0]),
        lambda: RateSteps(start=[0.0, 1.0], stop=[2.0, 3.0], rate=[1.0, 2.0]),
        lambda: RateSteps(start=[0.0], stop=[1.0], rate=[math.nan]),
        lambda: RateSteps(start=[0.0], stop=[1.0], rate=[]),
        lambda: Sampled.of_rates([0.0, 1.0, 1.0], [0.0, 0.0, 0.0]),
        lambda: Sinusoids(start=[0.0], stop=[1.0], amplitude=[0.0], frequency=[1.0], phase=[0.0]),
    ],
)
def test_tables_that_make_no_sense_are_refused(made: Callable[[], object]) -> None:
    with pytest.raises(InputError):
        made()
