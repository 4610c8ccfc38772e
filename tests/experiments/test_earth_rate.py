# SPDX-License-Identifier: BSD-3-Clause
"""The Earth rate by reversals: exact without noise, calibrated with it, and not fooled by what benches do."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import stats

import allanite as al
from allanite.errors import DataQualityError, InputError
from allanite.experiments.earth_rate import SetupUncertainty, measure_earth_rate
from allanite.experiments.earth_rate.dwell_means import DwellMeans
from allanite.experiments.earth_rate.take import Take
from allanite.experiments.earth_rate.words import widened_words
from allanite.experiments.reversals import find_reversals, periodic_reversals
from allanite.filtering.simulation import Motion, Temperature, simulate
from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.quantities.earth import EARTH_RATE
from allanite.recording.records import Recording
from allanite_seed_paper import twin as seed_paper

LATITUDE = seed_paper.LATITUDE
DEG_H = math.pi / 180 / 3600
QUIET = NoiseModel.of(White(N=1e-9))
SENSOR = seed_paper.sensor()


def twin(
    model: NoiseModel = SENSOR, *, duration: float = 720.0, seed: int = 1, dwell: Any = 30.0, **given: Any
) -> Recording:
    """A take of the seed's bench; `motion` holds options of the reversals."""
    options = {"full_scale": seed_paper.FULL_SCALE} | given.pop("motion", {})
    return simulate(
        model,
        rate=32.0,
        duration=duration,
        seed=seed,
        unit="deg/s",
        motion=Motion.reversals(dwell, **options),
        latitude=LATITUDE,
        **given,
    )


def measured(record: Recording, model: NoiseModel | None = SENSOR, **given: Any) -> Any:
    own = {} if "reversals" in given else {"first": "north"}
    return measure_earth_rate(record, latitude=LATITUDE, model=model, **(own | given))


# -- exact ------------------------------------------------------------------------------------------------


def test_without_noise_the_rate_is_that_of_the_earth() -> None:
    e = measured(twin(QUIET, turn_on_bias=0.3 * math.pi / 180), QUIET)
    assert e.rate == pytest.approx(EARTH_RATE, rel=1e-5)
    assert e.bias[0] == pytest.approx(0.3 * math.pi / 180, abs=4 * e.bias[1])
    assert [r.rate for r in e.readings] == pytest.approx([EARTH_RATE] * 2, rel=1e-5)
    assert (e.verdict, len(e.reversals.turns), len(e.dwells)) == ("resolved", 23, 24)


def test_the_first_direction_gives_the_sign() -> None:
    """Part 7: one axis cannot know it. South first, read as north first, is the Earth turning backwards."""
    record = twin(QUIET, motion={"first": "south"})
    assert measured(record, QUIET, first="south").rate == pytest.approx(EARTH_RATE, rel=1e-5)
    wrong = measured(record, QUIET)
    assert wrong.rate == pytest.approx(-EARTH_RATE, rel=1e-5)
    assert wrong.verdict == "inconsistent with Earth"
    assert "the first dwell points south" in wrong.reason
    chosen = measured(record, QUIET, first=None)
    assert chosen.rate == pytest.approx(EARTH_RATE, rel=1e-5)
    assert chosen.reading("pairs").rate == pytest.approx(EARTH_RATE, rel=1e-5)
    assert any("arbitrary" in sentence for sentence in chosen.advice)


@pytest.mark.parametrize(("vertical", "known"), [(False, True), (False, False), (True, True)])
def test_an_axis_that_sees_nothing_of_the_earth_contradicts_it(vertical: bool, known: bool) -> None:
    """What is not seen though the sensor would see it is no matter of time: `longer` helps nobody."""
    still = simulate(SENSOR, rate=32.0, duration=720.0, seed=3, unit="deg/s")
    cut = find_reversals(twin(seed=3), first="up" if vertical else "north")
    found = measured(still, SENSOR if known else None, reversals=cut)
    assert not found.rotation.resolved
    assert found.verdict == "inconsistent with Earth"
    assert "excludes the known 15.041" in found.reason
    assert ("lies level" if vertical else "points east and west") in found.reason
    assert "required" not in found.reason


@pytest.mark.long
def test_a_sensor_that_cannot_see_the_earth_is_not_resolved_and_no_contradiction() -> None:
    """At two standard deviations of the Earth's rate and less; chance contradicts in one of a thousand."""
    loud = NoiseModel.of(White(N=1.2e-3))
    verdicts = [measured(twin(loud, seed=seed), loud, reversals=find_reversals(twin(seed=1), first="north")).verdict
                for seed in range(12)]  # fmt: skip
    assert set(verdicts) <= {"not resolved", "resolved"}


def test_drift_leaks_through_ordered_pairs_and_not_through_triples() -> None:
    """A ramp R adds -R T/(2 cos latitude) to each pair, T between the middles of its dwells."""
    R = 1e-7
    record = twin(QUIET + al.noise.Ramp(R=R), motion={"turn_time": (2.0, 2.0)})
    e = measured(record, QUIET + RandomWalk(K=1e-6))
    middles = [(d.start + d.stop) / 2 for d in e.dwells]
    leak = -R * np.mean(np.diff(middles)[::2]) / (2 * math.cos(LATITUDE))
    assert e.reading("pairs").rate - EARTH_RATE == pytest.approx(leak, rel=1e-3)
    assert e.reading("north-south-north").rate == pytest.approx(EARTH_RATE, rel=1e-4)


def test_triples_of_unequal_dwells_are_free_of_a_linear_drift() -> None:
    start, stop = np.array([0.0, 100.0, 350.0, 420.0]), np.array([90.0, 300.0, 400.0, 700.0])
    sign, rate = np.array([1.0, -1.0, 1.0, -1.0]), 7e-5
    drift = 3e-6 + 2e-8 * (start + stop) / 2
    dwells = DwellMeans(
        start=start,
        stop=stop,
        whole=stop - start,
        sign=sign,
        mean=rate * 0.8 * sign + drift,
        nuisances=np.zeros((4, 0)),
        projection=0.8,
        triple="north-south-north",
        model=QUIET,
        dt=1.0,
        sampling="mean",
    )
    members, weights = dwells.triples()
    np.testing.assert_allclose((weights * dwells.mean[members]).sum(axis=1), rate, rtol=1e-12)


def test_covariance_of_dwell_means_is_that_of_the_samples() -> None:
    """The closed form of the phase against the state space, sample by sample."""
    model = NoiseModel.of(White(N=1.0), GaussMarkov(q=0.05, T=20.0), RandomWalk(K=0.1))
    record = simulate(
        model, rate=2.0, duration=200.0, seed=1, motion=Motion.reversals(20.0, coupling=200.0), latitude=0.0
    )
    turns = periodic_reversals(record, dwell=20.0, first="north")
    take = Take.of(record, "gyro", turns, 0.0, None, model=model)
    dwells = DwellMeans.of(take, model, [])
    space = model.state_space(0.5, record=200.0)
    n, F, h, P = record.n_samples, space.transition, space.output, space.initial
    full = np.zeros((n, n))
    for i in range(n):
        step = P
        for j in range(i, n):
            full[i, j] = full[j, i] = h @ step @ h
            step = F @ step
        P = F @ P @ F.T + space.process
    full += space.noise * np.eye(n)
    mean = np.zeros((dwells.size, n))
    for row, d in zip(mean, turns.dwells, strict=True):
        row[d.start : d.stop] = 1 / (d.stop - d.start)
    contrast = np.diff(np.eye(dwells.size), axis=0)
    np.testing.assert_allclose(
        contrast @ dwells.covariance(slice(None)) @ contrast.T,
        contrast @ mean @ full @ mean.T @ contrast.T,
        rtol=1e-9,
    )


def test_the_estimate_runs_to_its_end_and_dead_times_meet_it() -> None:
    e = measured(twin(seed=4))
    assert e.running.rate[-1] == pytest.approx(e.rate, rel=1e-9)
    assert e.running.sd[-1] == pytest.approx(e.sd / e.inflation, rel=1e-9)
    assert np.isinf(e.running.sd[0])  # one dwell: rate and bias cannot be told apart yet
    assert (np.diff(e.running.sd[1:]) < 0).all()
    assert e.running.pairs[-1] == pytest.approx(e.reading("pairs").rate, rel=1e-9)
    own = e.dead_times[e.dead_times[:, 0] == e.reversals.dead_time][0]
    assert own[1] == pytest.approx(e.rate, rel=1e-6)
    assert (np.diff(e.dead_times[:, 2]) > 0).all()


def test_blocks_cost_less_than_a_thousandth_of_the_standard_deviation() -> None:
    """Part 5, for dwells of 30 s: against blocks a quarter as long."""
    record = twin(QUIET)
    turns = find_reversals(record)
    for model in (SENSOR, seed_paper.sensor(flicker=True)):
        sd = [
            Take.of(record, "gyro", turns, LATITUDE, None, model=model, finer=k).fit(model)["rate"][1]
            for k in (1, 4)
        ]
        assert abs(sd[0] / sd[1] - 1) < 1e-3


# -- calibrated -------------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("flicker", [False, True], ids=["gauss-markov", "flicker"])
def test_interval_covers_and_no_check_cries_wolf(flicker: bool) -> None:
    """20 takes of 12 min (1000: verification). Bounds: 99.99 % of the binomial and chi-square laws."""
    model, runs = seed_paper.sensor(flicker=flicker), 20
    found = [measured(twin(model, seed=100 + k), model) for k in range(runs)]
    inside = sum(e.interval[0] <= EARTH_RATE <= e.interval[1] for e in found)
    assert inside >= stats.binom.ppf(1e-4, runs, 0.95)
    z2 = sum(((e.rate - EARTH_RATE) / e.sd) ** 2 for e in found)
    low, high = stats.chi2.ppf([5e-5, 1 - 5e-5], runs)
    assert low < z2 < high
    for name in ("scatter of the dwells", "size of the noise", "constancy of the rate"):
        p = [next(c.p for c in e.checks if c.name == name) for e in found]
        assert stats.kstest(p, "uniform").pvalue > 1e-4, name
    for name in ("warm-up", "settling", "order of the turns"):  # the best of several: conservative
        p = [next(c.p for c in e.checks if c.name == name) for e in found]
        assert sum(x < 0.01 for x in p) <= stats.binom.ppf(1 - 1e-4, runs, 0.01), name
    assert sum(e.verdict == "inconsistent" for e in found) <= stats.binom.ppf(1 - 1e-4, runs, 0.008)


def test_noise_of_the_record_itself_gives_a_wider_interval() -> None:
    """Without a model at rest: white noise and flicker from this record, Student's law by its pairs."""
    record = twin(duration=1500.0, seed=7)
    own, given = measured(record, None), measured(record)
    assert own.model_source == "this record"
    assert own.model.term("white").N == pytest.approx(seed_paper.N, rel=4 / math.sqrt(2 * 1300))
    assert own.interval[0] <= EARTH_RATE <= own.interval[1]
    assert np.ptp(own.interval) > 0.97 * np.ptp(given.interval)


def test_a_record_too_short_to_know_its_noise_is_refused() -> None:
    noise = np.random.default_rng(0).standard_normal(9)
    with pytest.raises(DataQualityError, match="--model"):
        measured(Recording.from_rate(noise, rate=1.0, unit="deg/s"), None)


# -- what the noise model does not know -------------------------------------------------------------------


def test_a_warm_up_is_named_and_can_be_fitted() -> None:
    record = twin(duration=1500.0, seed=2, warm_up=(0.1 * math.pi / 180, 500.0))
    e = measured(record)
    assert e.verdict == "inconsistent"
    assert "--warm-up" in " ".join(e.advice)
    fitted = measured(record, warm_up=True)
    assert fitted.verdict == "resolved"
    assert abs(fitted.deviation) < 3
    (name,) = fitted.nuisances
    amplitude, sd = fitted.nuisances[name]
    assert name.startswith("warm-up") and abs(amplitude) > 10 * sd
    assert fitted.inflation == 1


def test_a_rotation_that_settles_is_named_and_can_be_fitted() -> None:
    """0.3 deg with 3 s in the sense of the turn, on half an hour."""
    record = twin(
        duration=1800.0, seed=3, motion={"settling_angle": 0.3 * math.pi / 180, "settling_time": 3.0}
    )
    e = measured(record)
    assert e.verdict == "inconsistent"
    assert "--settling" in " ".join(e.advice)
    fitted = measured(record, settling=True)
    assert fitted.verdict == "resolved"
    assert abs(fitted.deviation) < 3
    assert fitted.sd > e.sd / e.inflation  # what else is fitted costs


@pytest.mark.long
def test_a_settling_of_10_to_30_s_that_leads_astray_is_named() -> None:
    """In at least 9 of 10 takes of any dwell, noise and amplitude whose interval excludes the truth."""
    astray = named = 0
    for seed in range(16):
        rng = np.random.default_rng(seed)
        size, time = rng.choice([0.1, 0.2, 0.3, 0.6, 1.0]) * EARTH_RATE, rng.uniform(10.0, 30.0)
        density = math.radians(math.exp(rng.uniform(math.log(3e-4), math.log(1e-2))))
        model = NoiseModel.of(White(N=density), Flicker(B=0.2 * density))
        motion = {"settling_angle": size * time, "settling_time": time}
        dwell = float(rng.choice([30.0, 45.0, 60.0, 120.0]))
        e = measured(twin(model, duration=1500.0, seed=seed, dwell=dwell, motion=motion), model)
        out = not e.interval[0] <= EARTH_RATE <= e.interval[1]
        astray += out
        named += out and "settl" in " ".join([e.reason, *e.advice])
        assert not (out and e.verdict == "resolved")
    assert astray >= 8
    assert named >= 0.9 * astray


def test_a_bias_that_turns_with_the_sensor_is_only_seen_against_the_earth() -> None:
    bias = 2e-3 * math.pi / 180
    record = twin(QUIET, motion={"coherent_bias": bias})
    e = measured(record, QUIET)
    assert e.rate == pytest.approx(EARTH_RATE + bias / math.cos(LATITUDE), rel=1e-5)
    assert e.verdict == "inconsistent with Earth"
    assert "follows the turns" in e.reason


def test_scatter_from_turn_to_turn_widens_the_interval() -> None:
    """A random bias of each dwell, three times the white noise of its mean: the interval grows about as much."""
    record = twin(duration=3600.0, seed=5)
    turns = find_reversals(record)
    values, rng = record.values("gyro").copy(), np.random.default_rng(5)
    for p in turns.positions:
        values[p.start : p.stop] += 3 * 0.0122 / math.sqrt(28) * rng.standard_normal()
    changed = replace(record, columns=Recording.from_rate(values, rate=32.0, unit="deg/s").columns)
    e = measured(changed)
    scatter = next(c for c in e.checks if c.name == "scatter of the dwells")
    assert not scatter.passed
    assert 2.2 < e.inflation < 3.8  # sqrt(1 + 9) less the part of flicker in the dwells
    assert e.inflation == pytest.approx(math.sqrt(scatter.statistic / scatter.dof))
    assert e.interval[0] <= EARTH_RATE <= e.interval[1]


@pytest.mark.long
def test_turns_counted_wrongly_are_named_with_their_time() -> None:
    """--dwell 30, and the operator forgot the tenth turn of half an hour."""
    record = twin(duration=3600.0, seed=6, motion={"missed": (60,)})
    e = measured(record, reversals=periodic_reversals(record, dwell=30.0, first="north"))
    assert e.verdict == "inconsistent"
    wrong = next(c for c in e.checks if c.name == "order of the turns")
    assert not wrong.passed
    assert any(str(t) in wrong.says for t in range(1785, 1900))
    assert measured(record).verdict == "resolved"  # from the signal the direction is right


def test_another_noise_than_the_model_is_named() -> None:
    loud = measured(twin(NoiseModel.of(White(N=2.5 * seed_paper.N)), seed=8))
    size = next(c for c in loud.checks if c.name == "size of the noise")
    assert (
        not size.passed and 2.3 < math.sqrt(size.statistic / size.dof) < 2.5
    )  # the model has slow noise besides
    assert loud.verdict == "inconsistent"


@pytest.mark.long
def test_the_temperature_can_be_fitted() -> None:
    warmth = Temperature(start=20.0, drift=40.0 / 3600, coefficient=5e-5, noise=0.01)
    record = twin(duration=3600.0, seed=9, temperature=warmth)
    name = next(c.name for c in record.channels if c.kind.value == "temperature")
    assert not next(c for c in measured(record).checks if c.name == name).passed
    e = measured(record, temperature=name)
    value, sd = e.nuisances[name]
    assert abs(value - 5e-5) < 4 * sd
    assert all(c.passed for c in e.checks) and abs(e.deviation) < 4


# -- without reversals ------------------------------------------------------------------------------------


def test_without_reversals_rate_and_bias_are_one_constant() -> None:
    """Part 8. For white noise the constant is the mean."""
    white = NoiseModel.of(White(N=seed_paper.N))
    record = simulate(
        white,
        rate=32.0,
        duration=3600.0,
        seed=1,
        unit="deg/s",
        motion=Motion.still(0.0),
        latitude=LATITUDE,
        turn_on_bias=1e-4,
    )
    e = measured(record, white)
    assert e.verdict == "not separable"
    assert math.isnan(e.rate) and math.isinf(e.sd)
    mean = float(record.values("gyro").mean()) * math.pi / 180
    assert e.bias[0] == pytest.approx(mean, rel=1e-9)
    assert e.bias[1] == pytest.approx(seed_paper.N / 60.0, rel=1e-9)
    horizontal = EARTH_RATE * math.cos(LATITUDE)
    for bias in (mean - horizontal, mean + horizontal, mean):
        assert f"{bias / DEG_H:.4g}" in e.reason
    json.dumps(e.to_json(), allow_nan=False)


# -- stated uncertainties ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "effect"),
    [
        ("scale", {"scale_error": 1e-3}),
        ("tilt", {"motion": {"table_tilt": 1e-3}}),
        ("heading", {"motion": {"pointing_offset": 0.1}}),
    ],
)
def test_e7_the_budget_is_what_the_effects_do(name: str, effect: dict[str, Any]) -> None:
    """Without noise. A heading off by h takes 1 - cos h, of which h^2/2 has the mean square (3/4) sd^4."""
    e = measured(twin(QUIET, **effect), QUIET)
    size = 0.1 if name == "heading" else 1e-3
    off = abs(e.rate / EARTH_RATE - 1)
    stated = sum(SetupUncertainty(**{name: size}).budget(LATITUDE).values())
    if name == "heading":
        assert off == pytest.approx(size**2 / 2, rel=0.01)
        normal = np.random.default_rng(0).standard_normal(200_000) * size
        assert stated == pytest.approx(math.sqrt(np.mean((1 - np.cos(normal)) ** 2)), rel=0.05)
    else:
        assert off == pytest.approx(stated, rel=0.05)


def test_stated_uncertainties_widen_the_interval() -> None:
    record = twin(seed=4)
    bare, wide = measured(record), measured(record, stated=SetupUncertainty(scale=0.2, latitude=0.01))
    assert wide.sd == bare.sd
    assert wide.budget["scale factor"] == pytest.approx(0.2 * EARTH_RATE)
    assert wide.budget["latitude"] == pytest.approx(0.01 * abs(math.tan(LATITUDE)) * EARTH_RATE)
    assert wide.total_sd == pytest.approx(math.sqrt(sum(v**2 for v in wide.budget.values())))
    half = wide.interval[1] - wide.rate
    assert half == pytest.approx(stats.norm.ppf(0.975) * wide.total_sd)
    with pytest.raises(InputError, match="scale"):
        SetupUncertainty(scale=-1.0)


def test_too_short_a_take_is_not_resolved() -> None:
    """60 s hold 44 % of the Earth's rate at best (science of the seed): never three standard deviations."""
    e = measured(twin(duration=62.0, seed=11))
    assert e.verdict in ("not resolved", "inconsistent with Earth")
    assert e.sd / EARTH_RATE > 0.4


# -- borders ----------------------------------------------------------------------------------------------


def test_json_is_plain() -> None:
    text = json.dumps(measured(twin(seed=4)).to_json(), allow_nan=False)
    found = json.loads(text)
    assert found["format"] == "allanite-earth-rate"
    assert len(found["dwells"]) == 24 and len(found["running"]["time"]) == 24
    assert found["verdict"] == "resolved"


@pytest.mark.parametrize("latitude", [math.pi / 2, -math.pi / 2, 23.3, math.nan])
def test_at_a_pole_there_is_nothing_to_see(latitude: float) -> None:
    with pytest.raises(InputError, match="latitude"):
        measure_earth_rate(twin(QUIET, duration=70.0), latitude=latitude, model=QUIET)


def test_the_channel_must_be_a_rate_and_only_one() -> None:
    noise = np.random.default_rng(0).standard_normal((640, 2))
    volts = Recording.from_rate(noise[:, 0], rate=32.0, unit="V")
    two = Recording.from_rate(noise, rate=32.0, unit="deg/s", names=["a", "b"])
    with pytest.raises(InputError, match="scale factor"):
        measured(volts)
    with pytest.raises(InputError, match="more than one"):
        measured(two)
    with pytest.raises(InputError, match="voltage"):
        measured(volts, channel="signal")
    assert measured(two, channel="a").verdict == "not separable"


def test_flicker_alone_is_enough_of_a_model() -> None:
    model = NoiseModel.of(White(N=seed_paper.N), Flicker(B=seed_paper.B))
    assert abs(measured(twin(model, seed=12), model).deviation) < 4


def test_of_two_families_left_open_the_wider_interval_counts() -> None:
    record = twin(seed=4)
    short = replace(
        SENSOR, family="gauss-markov", alternative=replace(seed_paper.sensor(flicker=True), family="flicker")
    )
    e, flicker = measured(record, short), measured(record, seed_paper.sensor(flicker=True))
    assert e.model.family == "flicker"
    assert e.sd == pytest.approx(flicker.sd, rel=1e-12)
    assert any("does not decide between flicker and gauss-markov" in a for a in e.advice)


def test_a_model_of_an_accelerometer_is_refused() -> None:
    with pytest.raises(InputError, match="acceleration"):
        measured(twin(duration=120.0), replace(SENSOR, kind="acceleration"))


def test_a_direction_that_nobody_gave_is_a_choice() -> None:
    e = measure_earth_rate(twin(seed=4), latitude=LATITUDE, model=SENSOR)
    assert e.first == "unknown" and e.rate > 0
    assert any("--first" in a for a in e.advice)


def test_reversals_bring_their_own_direction_and_dead_time() -> None:
    record = twin(seed=4)
    turns = find_reversals(record, first="south", dead_time=5.0)
    e = measured(record, reversals=turns)
    assert (e.first, e.reversals.dead_time, e.rate < 0) == ("south", 5.0, True)
    for given in ({"first": "north"}, {"dead_time": 1.0}):
        with pytest.raises(InputError, match="their own"):
            measured(record, reversals=turns, **given)


def test_turns_without_dwells_are_not_a_record_without_turns() -> None:
    """A dead time longer than the dwells leaves the first of them alone."""
    e = measured(twin(seed=4), dead_time=60.0)
    assert e.verdict == "not separable"
    assert "23 turns" in e.reason and "dead time" in " ".join(e.advice)


def test_too_little_noise_is_named_and_takes_nothing_away() -> None:
    large = NoiseModel.of(White(N=20 * seed_paper.N))
    e = measured(twin(seed=4), large)
    size = next(c for c in e.checks if c.name == "size of the noise")
    assert not size.passed and size.ratio < 0.1
    assert e.verdict == "not resolved" and "is it the model of this sensor" in e.reason
    assert e.inflation == 1


def test_a_model_of_another_sensor_is_the_first_thing_that_is_said() -> None:
    e = measured(twin(seed=4), NoiseModel.of(White(N=seed_paper.N / 20)))
    assert e.verdict == "inconsistent" and "is it the model of this sensor" in e.reason


def test_what_widens_the_rate_widens_all_that_stands_beside_it() -> None:
    """A noise at least 1.5 times that of the model: rate, readings, running estimate and dead times alike."""
    record = twin(seed=4)
    small = NoiseModel.of(White(N=seed_paper.N / 1.5))
    e = measured(record, small)
    assert e.inflation > 1.3
    assert e.running.sd[-1] == pytest.approx(e.sd)
    assert e.dead_times[e.dead_times[:, 0] == 2.0][0, 2] == pytest.approx(e.sd)
    bare = DwellMeans.of(
        Take.of(record, "gyro", e.reversals, LATITUDE, None, model=small), small, []
    ).readings()
    assert e.reading("pairs").sd == pytest.approx(bare[0].sd * e.inflation)


@pytest.mark.long
def test_what_widens_the_noise_is_said() -> None:
    """A check that failed, or, of a record that tells its own noise, the pairs: never checks that all passed."""
    given = measured(twin(seed=4), NoiseModel.of(White(N=seed_paper.N / 1.5)))
    assert not all(c.passed for c in given.checks) and widened_words(given.inflation, given.checks).endswith(
        "see the checks."
    )
    own = [measure_earth_rate(twin(seed=seed), latitude=LATITUDE, first="north") for seed in range(4)]
    widened = [e for e in own if e.inflation > 1 and all(c.passed for c in e.checks)]
    assert widened
    for e in own:
        words = widened_words(e.inflation, e.checks)
        assert bool(words) == (e.inflation > 1)
        assert "see the checks" not in words or not all(c.passed for c in e.checks)
    assert "the pairs of dwells scatter that much" in widened_words(widened[0].inflation, widened[0].checks)


def test_of_very_many_dwells_those_in_the_middle_are_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every second dwell would be all of one direction."""
    from allanite.experiments.earth_rate import dwell_means

    monkeypatch.setattr(dwell_means, "MOST", 12)
    monkeypatch.setattr(dwell_means, "GROUP", 5)
    e = measured(twin(seed=4))
    monkeypatch.undo()
    whole = measured(twin(seed=4))
    scatter = {c.name: c for c in e.checks}["scatter of the dwells"]
    assert scatter.dof == 10 and scatter.p > 1e-4
    assert e.reading("pairs").rate == pytest.approx(whole.reading("pairs").rate, rel=1e-12)
    assert e.reading("pairs").sd == pytest.approx(
        whole.reading("pairs").sd, rel=0.02
    )  # groups taken as independent


@pytest.mark.parametrize("name", ["gyro", "other"])
def test_a_gyro_is_no_temperature(name: str) -> None:
    """The measured channel would fit the whole record, and leave a rate of zero."""
    record = twin()
    both = Recording.from_rate(
        np.column_stack([record.values("gyro"), record.values("gyro")[::-1]]),
        rate=32.0,
        unit="rad/s",
        names=["gyro", "other"],
    )
    with pytest.raises(InputError, match="is measured" if name == "gyro" else "not temperature"):
        measured(both, channel="gyro", temperature=name)


@pytest.mark.parametrize("scale", [1.0, 10.0, math.inf, -0.1, math.nan])
def test_an_uncertainty_of_the_scale_factor_is_a_fraction(scale: float) -> None:
    with pytest.raises(InputError, match="uncertainty of "):
        SetupUncertainty(scale=scale)
