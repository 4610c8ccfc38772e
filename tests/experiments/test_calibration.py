# SPDX-License-Identifier: BSD-3-Clause
"""Self-calibration: exact recovery, closed forms, a second method, coverage, and what is said."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from allanite.errors import DataQualityError, InputError
from allanite.experiments.calibration import calibrate, predict
from allanite.experiments.calibration.adjustment.interval_noise import (
    Intervals,
    interval_covariance,
    model_of_spans,
)
from allanite.experiments.calibration.adjustment.rounding import RoundingSteps, of_means
from allanite.experiments.calibration.orientations import ORIENTATIONS, words_of
from allanite.noise import Flicker, GaussMarkov, NoiseModel, Quantisation, Ramp, RandomWalk, Sinusoid, White
from allanite.quantities.attitude import rotation
from allanite.recording.calibration import Calibration, TriadErrors, errors_of, parameter_names
from allanite.recording.records import Recording
from allanite.recording.sample_columns import ArrayColumn
from unit_twin import Path, attitude_up, noise

G = 9.81
LATITUDE = 0.6
ACC = tuple(f"accel_{a}" for a in "xyz")
GYRO = tuple(f"gyro_{a}" for a in "xyz")
FACES = [(0, 0, 1), (1, 0, 0), (0, 0, -1), (-1, 0, 0), (0, 1, 0), (0, -1, 0)]
NAMES = parameter_names("accelerometer", frame="z") + parameter_names("gyro")


def models(n_acc: float = 1e-3, n_gyro: float = 1e-4, *more: tuple) -> dict[str, NoiseModel]:
    acc, gyro = more or ((), ())
    return {n: NoiseModel.of(White(N=n_acc), *acc) for n in ACC} | {
        n: NoiseModel.of(White(N=n_gyro), *gyro) for n in GYRO
    }


def attitudes(count: int, *, spread: float = 0.1, seed: int = 1) -> list:
    """Positions near some of the 26, with any heading."""
    rng = np.random.default_rng(seed)
    ups = np.array(list(ORIENTATIONS.values()), dtype=float)
    chosen = ups[rng.permutation(26)[:count]] + spread * rng.standard_normal((count, 3))
    return [attitude_up(u, h) for u, h in zip(chosen, rng.uniform(0, 6.28, count), strict=True)]


def truth(seed: int, names: tuple[str, ...] = NAMES, size: float = 0.02) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    return {n: (".scale_" in n) + size * float(rng.standard_normal()) for n in names}


def both(values: dict[str, float]) -> tuple[TriadErrors, TriadErrors]:
    return errors_of(values, "accelerometer"), errors_of(values, "gyro")


@pytest.fixture(scope="module")
def path() -> Path:
    return Path(attitudes(16), latitude=LATITUDE)


def close(found, values: dict[str, float], tolerance: float) -> None:
    for name, value in values.items():
        assert found[name].value == pytest.approx(value, abs=tolerance), name


# -- exact ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("frame", ["z", "x"])
def test_without_noise_the_parameters_come_back(path: Path, frame: str) -> None:
    values = truth(2, parameter_names("accelerometer", frame=frame) + parameter_names("gyro"))
    record = path.recording(*both(values))
    found = calibrate(record, spans=path.spans, model=models(), latitude=LATITUDE, gravity=G, frame=frame)
    assert found.verdict == "calibrated"
    close(found, values, 1e-9)


@pytest.mark.long
def test_models_may_be_given_by_role(path: Path) -> None:
    by_name = models()
    record = path.recording(*both(truth(2)), by_name)
    by_role = {"accelerometer": by_name[ACC[0]], "gyro": by_name[GYRO[0]]}
    found = [
        calibrate(record, spans=spans, model=model, latitude=LATITUDE, gravity=G).to_json()
        for model in (by_name, by_role)
        for spans in (path.spans, None)
    ]
    assert found[2:] == found[:2]


def test_without_noise_the_quadratic_terms_come_back() -> None:
    path = Path(attitudes(20, spread=0.05), latitude=LATITUDE)
    names = parameter_names("accelerometer", frame="z", quadratic=True) + parameter_names("gyro")
    values = truth(3, names) | {f"accelerometer.quadratic_{a}": 1e-4 for a in "xyz"}
    found = calibrate(
        path.recording(*both(values)),
        spans=path.spans,
        model=models(),
        latitude=LATITUDE,
        gravity=G,
        quadratic=True,
    )
    assert not found.assumed
    close(found, values, 1e-9)


def test_slopes_with_temperature_come_back() -> None:
    path = Path(attitudes(20), latitude=LATITUDE)
    values = truth(4)
    values |= {f"accelerometer.bias_temperature_{a}": 1e-3 for a in "xyz"}
    values |= {f"gyro.bias_temperature_{a}": -2e-4 for a in "xyz"}
    warmth = np.linspace(0.0, 12.0, path.count) + 3 * np.sin(np.arange(path.count) / 700)
    record = path.recording(*both(values), warmth=warmth)
    found = calibrate(
        record,
        spans=path.spans,
        model=models(),
        latitude=LATITUDE,
        gravity=G,
        reference_temperature=0.0,
    )
    close(found, values, 1e-8)
    assert found.calibration.temperature == 0.0
    assert (
        found.temperature_span is not None and found.temperature_span[0] < 2 < 9 < found.temperature_span[1]
    )


@pytest.mark.parametrize("scale", [1e-8, 1.0, 1e8])
def test_counts_of_any_size_give_the_same(path: Path, scale: float) -> None:
    """Rescaling the samples rescales biases and scale factors, and nothing else: no unit is hidden inside."""
    values = truth(5)
    record = path.recording(
        *both(values), models(), seed=1, units=("LSB", "LSB"), gains=(415 * scale, 4778 * scale),
        offset=33000.0 * scale,
    )  # fmt: skip
    found = calibrate(record, spans=path.spans, gravity=G, gyro=GYRO, accelerometer=ACC)
    reference = calibrate(path.recording(*both(values), models(), seed=1), spans=path.spans, gravity=G)
    for name in NAMES:
        k = (415 if name.startswith("acc") else 4778) * scale
        size, shift = (1.0, 0.0) if "misalignment" in name else (k, 33000 * scale if ".bias" in name else 0.0)
        a, b = found[name], reference[name]
        assert a.value == pytest.approx(b.value * size + shift, abs=0.01 * b.sd * size), name
        assert a.sd == pytest.approx(b.sd * size, rel=0.02), name
    assert found["accelerometer.scale_x"].unit == "LSB/(m/s²)"


def test_the_order_of_the_axes_is_a_name(path: Path) -> None:
    """Calling y, z, x by x, y, z moves the names of biases and scale factors, and nothing else."""
    values = truth(6, size=1e-4)
    record = path.recording(*both(values), models(), seed=2)
    arguments = {"spans": path.spans, "model": models(), "latitude": LATITUDE, "gravity": G}
    plain = calibrate(record, **arguments)
    turned = calibrate(
        record,
        accelerometer=("accel_y", "accel_z", "accel_x"),
        gyro=("gyro_y", "gyro_z", "gyro_x"),
        **arguments,
    )
    for sensor in ("accelerometer", "gyro"):
        for here, there in zip("xyz", "yzx", strict=True):
            for kind in ("bias", "scale"):
                a, b = turned[f"{sensor}.{kind}_{here}"], plain[f"{sensor}.{kind}_{there}"]
                assert a.value == pytest.approx(b.value, abs=0.02 * b.sd)  # the body leans by 1e-4 rad
                assert a.sd == pytest.approx(b.sd, rel=0.01)
    assert sum(s.chi2 for s in turned.scatter) == pytest.approx(sum(s.chi2 for s in plain.scatter), rel=1e-3)


# -- closed forms and other methods -----------------------------------------------------------------------


def test_six_exact_faces_have_the_closed_form() -> None:
    """Bias: half the sum of two opposite faces; scale: half the difference. Misalignments are not seen at all."""
    path = Path([attitude_up(u) for u in FACES], dwell=6.0)
    record = path.recording(*both({})).select(*ACC)
    found = calibrate(record, spans=path.spans, model={n: models()[n] for n in ACC}, gravity=G)
    mean = 1e-3 / math.sqrt(6.0)
    for a in "xyz":
        assert found[f"accelerometer.bias_{a}"].sd == pytest.approx(mean / math.sqrt(2), rel=1e-4)
        assert found[f"accelerometer.scale_{a}"].sd == pytest.approx(mean / math.sqrt(2) / G, rel=1e-4)
    assert found.assumed == tuple(f"accelerometer.misalignment_{p}" for p in ("xy", "xz", "yz"))
    assert all(found[n].sd == pytest.approx(0.1, rel=1e-6) and found[n].value == 0 for n in found.assumed)
    assert found.verdict == "partly calibrated"


def test_the_ellipsoid_fit_is_a_second_method() -> None:
    """|M^-1 (y - b)| = g fitted by itself, without attitudes, agrees to a small part of the sd."""
    from scipy.optimize import least_squares

    path = Path(attitudes(18))
    values = truth(8)
    record = path.recording(*both(values), models(), seed=4).select(*ACC)
    found = calibrate(record, spans=path.spans, model={n: models()[n] for n in ACC}, gravity=G)
    y = np.stack([record.values(n) for n in ACC], axis=1)
    means = np.array([y[a:b].mean(axis=0) for a, b in path.spans])

    def short(p: np.ndarray) -> np.ndarray:
        e = errors_of(dict(zip(found.calibration.names, p, strict=True)), "accelerometer")
        return np.linalg.norm(e.true(means), axis=1) - G

    start = np.array([1.0 if ".scale_" in n else 0.0 for n in found.calibration.names])
    other = least_squares(short, start, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert np.all(np.abs(other.x - found.calibration.values) < 0.05 * found.calibration.sd)
    mean = 1e-3 / math.sqrt(4.0)
    sd = mean * np.sqrt(np.diag(np.linalg.inv(other.jac.T @ other.jac)))
    assert found.calibration.sd == pytest.approx(
        sd, rel=0.06
    )  # the noise of |f| is that of its axes within the scale factors


@pytest.mark.parametrize(
    "term",
    [
        White(N=0.3), RandomWalk(K=0.1), GaussMarkov(q=0.1, T=3.0), GaussMarkov(q=1e-3, T=1e5), Ramp(R=0.2),
        Quantisation(Q=0.1, dt=0.1), Sinusoid(amplitude=0.3, frequency=0.21), Flicker(B=0.2),
    ],
)  # fmt: skip
def test_the_noise_of_means_is_that_of_the_state_space(term) -> None:
    """Two derivations: phase covariance with its constant settled, and the Markov states sample by sample."""
    intervals = Intervals(
        start=np.array([0.0, 20.0, 50.0, 100.0]),
        stop=np.array([15.0, 45.0, 90.0, 140.0]),
        whole=np.array([15.0, 25.0, 40.0, 40.0]),
        length=150.0,
        dt=0.1,
        sampling="mean",
    )
    model = NoiseModel.of(term)
    space = model.state_space(0.1, record=15.0, ratio=math.sqrt(10))
    n = 150
    cov, p = np.zeros((n, n)), space.initial.copy()
    for k in range(n):
        ahead = p @ space.output
        cov[k, k] = space.output @ ahead + space.noise
        for j in range(k + 1, n):
            ahead = space.transition @ ahead
            cov[j, k] = cov[k, j] = space.output @ ahead
        p = space.transition @ p @ space.transition.T + space.process
    means = np.zeros((4, n))
    for i, (a, b) in enumerate(zip(intervals.start.astype(int), intervals.stop.astype(int), strict=True)):
        means[i, a:b] = 1 / (b - a)
    expected = means @ cov @ means.T
    found = interval_covariance(model, intervals)
    if isinstance(term, Flicker):  # the level depends on where the correlation times fall: 0.8 to 1 B^2
        apart = np.eye(4) - 0.25
        assert np.allclose(apart @ found @ apart.T, apart @ expected @ apart.T, atol=2e-3 * term.B**2)
        assert np.abs(found - expected).max() < 0.15 * term.B**2
    else:
        assert np.allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_rounding_of_a_value_that_stands_still() -> None:
    rng = np.random.default_rng(0)
    still = [np.full(100, 3.0), np.full(100, 3.0), np.full(100, 7.0)]
    channel = np.concatenate([*still, np.arange(20.0)])
    cov = of_means(RoundingSteps.of(channel), still)
    assert np.allclose(np.diag(cov), 1 / 12, rtol=0.02)
    assert cov[0, 1] == pytest.approx(cov[0, 0], rel=1e-6) and cov[0, 2] == 0
    lively = [np.round(rng.normal(5.3, 2.0, 100)) for _ in range(3)]
    assert np.diag(of_means(RoundingSteps.of(np.concatenate(lively)), lively)).max() < 1e-12


def test_noise_of_the_spans_themselves() -> None:
    rng = np.random.default_rng(1)
    for b in (0.0, 1.0):
        terms = [White(N=1.0)] + ([Flicker(B=b)] if b else [])
        found = [
            model_of_spans(list(noise(NoiseModel.of(*terms), 20000, 0.01, rng).reshape(-1, 500)), 0.01)
            for _ in range(6)
        ]
        n = np.mean([f.term("white").N for f in found])
        flicker = np.mean([f.term("flicker").B for f in found])
        assert n == pytest.approx(1.0, abs=0.03)
        # what 5 s of N = 1 cannot exclude, 0.3; of B = 1 most is seen
        assert (0.1 < flicker < 0.5) if b == 0 else (0.6 < flicker < 1.3)
    assert model_of_spans([np.ones(100)], 0.01) is None


# -- statistics ---------------------------------------------------------------------------------------------


def campaign(path: Path, noises: dict[str, NoiseModel], runs: int, *, given: bool = True, **arguments):
    errors, covered, estimates = [], [], []
    for k in range(runs):
        values = truth(100 + k)
        record = path.recording(*both(values), noises, seed=k)
        found = calibrate(record, spans=path.spans, model=noises if given else None, gravity=G, **arguments)
        true = np.array([values[n] for n in NAMES])
        errors.append(found.calibration.values - true)
        covered.append(
            [p.interval[0] <= v <= p.interval[1] for p, v in zip(found.parameters, true, strict=True)]
        )
        estimates.append(found)
    return np.array(errors), np.array(covered), estimates


@pytest.mark.long
@pytest.mark.parametrize("kind", ["white", "slow"])
def test_intervals_cover_and_predictions_hold(kind: str) -> None:
    """21 parameters of 20 twins, some 200 independent numbers: 0.95 and the ratio 1 within 3 sd."""
    where = attitudes(14, seed=3)
    path = Path(where, dwell=3.0, turn=1.5, latitude=LATITUDE)
    more = (
        ()
        if kind == "white"
        else ((Flicker(B=1e-3), RandomWalk(K=2e-4)), (Flicker(B=1e-4), RandomWalk(K=3e-5)))
    )
    noises = models(1e-3, 1e-4, *more)
    errors, covered, estimates = campaign(path, noises, 20, latitude=LATITUDE)
    foreseen = predict(
        where,
        dwell=3.0,
        turn=1.5,
        models={"accelerometer": noises["accel_x"], "gyro": noises["gyro_x"]},
        latitude=LATITUDE,
        gravity=G,
        rate=50.0,
    )
    assert foreseen.names == NAMES and not foreseen.assumed
    assert 0.90 <= covered.mean() <= 0.99
    ratio = math.sqrt(float(((errors / foreseen.sd) ** 2).mean()))
    assert ratio == pytest.approx(1.0, abs=0.12)
    stated = np.array([e.calibration.sd for e in estimates if not e.inflated])
    assert np.median(stated, axis=0) == pytest.approx(foreseen.sd, rel=0.05)
    assert sum(bool(e.outliers) for e in estimates) <= 1


@pytest.mark.long
def test_intervals_cover_without_a_model_too() -> None:
    """Flicker and random walk that no span shows by itself: found in the scatter from span to span."""
    path = Path(attitudes(18, seed=3), dwell=3.0, turn=1.5, latitude=LATITUDE)
    slow = models(1e-3, 1e-4, (Flicker(B=1e-3), RandomWalk(K=2e-4)), (Flicker(B=1e-4), RandomWalk(K=3e-5)))
    _, covered, estimates = campaign(path, slow, 8, given=False, latitude=LATITUDE)
    assert 0.87 <= covered.mean() <= 1.0
    assert estimates[0].model_source == "this record"
    assert sum(e.inflated for e in estimates) >= 5


def test_a_prediction_is_what_the_calibration_states(path: Path) -> None:
    """Without noise the stated covariance is that of the geometry and the models, to rounding."""
    found = calibrate(
        path.recording(*both({})), spans=path.spans, model=models(), latitude=LATITUDE, gravity=G
    )
    foreseen = predict(
        attitudes(16),
        dwell=4.0,
        turn=2.0,
        models={"accelerometer": models()["accel_x"], "gyro": models()["gyro_x"]},
        latitude=LATITUDE,
        gravity=G,
        rate=50.0,
    )
    assert foreseen.sd == pytest.approx(found.calibration.sd, rel=2e-3)
    assert foreseen["gyro.scale_x"] == foreseen.sd[NAMES.index("gyro.scale_x")]


def test_four_times_as_long_is_half_the_sd() -> None:
    where = attitudes(12)
    white = {"accelerometer": NoiseModel.of(White(N=1e-3)), "gyro": NoiseModel.of(White(N=1e-7))}
    one, four = (predict(where, dwell=d, turn=2.0, models=white, latitude=0.6) for d in (5.0, 20.0))
    assert one.earth_resolved
    for name in ("accelerometer.bias_x", "accelerometer.scale_y", "gyro.bias_z"):
        assert four[name] == pytest.approx(one[name] / 2, rel=0.02)


def test_good_gyros_see_the_earth_and_consumer_gyros_do_not() -> None:
    path = Path(attitudes(14), rate=10.0, dwell=20.0, turn=4.0, latitude=LATITUDE)
    fine = calibrate(
        path.recording(*both(truth(1)), models(1e-4, 1e-6)),
        spans=path.spans,
        model=models(1e-4, 1e-6),
        latitude=LATITUDE,
        gravity=G,
    )
    assert fine.earth is not None and fine.earth.resolved
    assert abs(fine.earth.length - fine.earth.expected) < 4 * fine.earth.length_sd
    poor = calibrate(
        path.recording(*both(truth(1)), models(1e-3, 1e-3)),
        spans=path.spans,
        model=models(1e-3, 1e-3),
        latitude=LATITUDE,
        gravity=G,
    )
    assert poor.earth is not None and not poor.earth.resolved
    assert poor["gyro.bias_x"].sd < 7.3e-5 * 3  # the Earth is bounded all the same


def test_a_wrong_latitude_is_noticed() -> None:
    path = Path(attitudes(14), rate=10.0, dwell=20.0, turn=4.0, latitude=LATITUDE)
    fine = models(1e-4, 1e-7)
    record = path.recording(*both(truth(1)), fine)
    found = calibrate(record, spans=path.spans, model=fine, latitude=LATITUDE + 0.3, gravity=G)
    assert found.verdict == "inconsistent" and "latitude" in found.reason


# -- what is open, what stands out ---------------------------------------------------------------------------


def test_two_positions_say_what_to_add_and_it_helps() -> None:
    where = [attitude_up((0, 0, 1)), attitude_up((0, 0, -1))]
    path = Path(where, latitude=LATITUDE)
    found = calibrate(
        path.recording(*both({}), models()), spans=path.spans, model=models(), latitude=LATITUDE, gravity=G
    )
    assert found.verdict == "partly calibrated"
    assert found["accelerometer.scale_z"].status == "estimated"
    assert found["accelerometer.scale_x"].status == "assumed" and found["accelerometer.scale_x"].advice
    more = where + [attitude_up(ORIENTATIONS[words]) for words in found.add]
    white = {"accelerometer": models()["accel_x"], "gyro": models()["gyro_x"]}
    later = predict(more, dwell=4.0, turn=2.0, models=white, latitude=LATITUDE, gravity=G)
    assert not later.assumed
    assert predict(where, dwell=4.0, turn=2.0, models=white, latitude=LATITUDE).assumed == found.assumed


def test_gyros_alone_give_their_biases() -> None:
    path = Path([attitude_up(u) for u in FACES], latitude=LATITUDE)
    record = path.recording(*both(truth(2)), models()).select(*GYRO)
    found = calibrate(record, spans=path.spans, model={n: models()[n] for n in GYRO})
    assert {p.name for p in found.parameters if p.status == "estimated"} == {f"gyro.bias_{a}" for a in "xyz"}
    assert not found.add  # no position helps
    assert [a for a in found.advice if "gyros alone do not show" in a] == [found["gyro.scale_x"].advice[0]]
    for a in "xyz":
        p = found[f"gyro.bias_{a}"]
        assert abs(p.value - truth(2)[p.name]) < 5 * p.sd < 5 * 7.3e-5


def test_an_open_direction_keeps_its_plausible_size_and_disturbs_nothing() -> None:
    """Six faces, tilted a little: scale factors carry what the misalignments leave open, and cover."""
    rng = np.random.default_rng(0)
    where = [attitude_up(np.array(u) + 0.03 * rng.standard_normal(3)) for u in FACES]
    path = Path(where)
    values = truth(7)
    record = path.recording(*both(values), models()).select(*ACC)
    found = calibrate(record, spans=path.spans, model={n: models()[n] for n in ACC}, gravity=G)
    for p in found.parameters:
        assert abs(p.value - values[p.name]) < 4 * p.sd
    assert any(p.status == "assumed" for p in found.parameters)


@pytest.mark.long
@pytest.mark.parametrize("given", [True, False])
def test_a_bumped_span_is_named(path: Path, given: bool) -> None:
    record = path.recording(*both({}), models(), seed=5)
    a, b = path.spans[7]
    columns = list(record.columns)
    bumped = np.array(record.values("accel_z"))
    bumped[a:b] += 0.05 * np.sign(path.forces[a, 2])
    columns[2] = ArrayColumn(bumped)
    record = type(record)(channels=record.channels, columns=tuple(columns), rate=record.rate)
    arguments = {
        "spans": path.spans,
        "model": models() if given else None,
        "latitude": LATITUDE,
        "gravity": G,
    }
    found = calibrate(record, **arguments)
    assert found.outliers == ("position 8",)
    assert not found.checks[0].passed
    assert "position 8 contradicts" in found.advice[0] and "--without 8" in found.advice[0]
    clean = calibrate(record, without=[8], **arguments)
    assert not clean.outliers and not clean.positions[7].used
    assert clean["accelerometer.scale_z"].sd < found["accelerometer.scale_z"].sd
    assert any("position 8: not used, left out" in r for r in clean.notes)


@pytest.mark.long
def test_gyros_that_follow_gravity_are_found_out() -> None:
    """Their sensitivity is part of the calibration, with its covariance; a sound record has none."""
    path = Path(attitudes(20), latitude=LATITUDE)
    names = parameter_names("gyro", gravity_sensitivity=True)
    values = truth(9) | dict(zip(names[-9:], 1e-3 * np.arange(-4, 5), strict=True))
    record = path.recording(*both(values), models(), seed=2)
    found = calibrate(record, spans=path.spans, model=models(), latitude=LATITUDE, gravity=G)
    assert found.verdict == "calibrated" and found.calibration.names[-9:] == names[-9:]
    assert not found.inflated and any("follow gravity" in r for r in found.notes)
    assert found["gyro.gravity_sensitivity_xx"].unit == "rad/s/(m/s²)"
    assert len(found.parameters) == 30
    for p in found.parameters:
        assert abs(p.value - values[p.name]) < 4 * p.sd
    assert max(found[n].sd for n in names[-9:]) < 1e-4
    plain = calibrate(path.recording(*both(truth(9)), models()), spans=path.spans, model=models(), gravity=G)
    assert plain.calibration.names == NAMES


def test_a_turn_with_a_gap_or_a_cut_peak_is_left_out(path: Path) -> None:
    values = truth(3)
    record = path.recording(*both(values))
    rates = {n: np.array(record.values(n)) for n in GYRO}
    rates["gyro_x"][path.spans[3][1] + 20] = np.nan
    a, b = path.spans[6][1], path.spans[7][0]
    rates["gyro_y"][a + 30 : b - 30] = 60.0  # the converter's end
    columns = list(record.columns)
    for name, samples in rates.items():
        columns[record.index(name)] = ArrayColumn(samples)
    record = type(record)(channels=record.channels, columns=tuple(columns), rate=record.rate)
    found = calibrate(record, spans=path.spans, model=models(), latitude=LATITUDE, gravity=G)
    why = {t.before: t.why for t in found.turns if not t.used}
    assert why == {4: "samples missing", 7: "clipped"}
    for p in found.parameters:  # the Earth is hardly seen, and its prior draws a little
        assert abs(p.value - values[p.name]) < 0.1 * p.sd


def test_positions_beyond_a_gap_get_their_heading_from_the_earth() -> None:
    where = attitudes(14)
    path = Path(where, rate=10.0, dwell=20.0, turn=4.0, latitude=LATITUDE)
    values = truth(1)
    record = path.recording(*both(values), models(1e-4, 1e-7))
    columns = list(record.columns)
    samples = np.array(record.values("gyro_x"))
    samples[path.spans[6][1] + 5] = np.nan
    columns[record.index("gyro_x")] = ArrayColumn(samples)
    record = type(record)(channels=record.channels, columns=tuple(columns), rate=record.rate)
    found = calibrate(record, spans=path.spans, model=models(1e-4, 1e-7), latitude=LATITUDE, gravity=G)
    assert not found.positions[8].heading_known and found.positions[3].heading_known
    assert not found.inflated and not found.outliers
    for p in found.parameters:
        assert abs(p.value - values[p.name]) < 4.5 * p.sd
    turned = found.positions[0].attitude.T @ found.positions[12].attitude
    assert np.abs(turned - where[0].T @ where[12]).max() < 0.03


@pytest.mark.long
@pytest.mark.parametrize(
    ("order", "sign", "said"),
    [
        ("yxz", 1.0, "with --gyro gyro_x,gyro_y,gyro_z"),
        ("zxy", 1.0, "with --gyro gyro_x,gyro_y,gyro_z"),
        ("xyz", -1.0, "they match when the sign of gyro_z is reversed"),
        ("xzy", -1.0, "with --gyro gyro_x,gyro_y,gyro_z when the sign of gyro_z is reversed"),
    ],
)
def test_axes_in_another_order_are_told(order: str, sign: float, said: str) -> None:
    """With what to type, and without advice that a fit of the wrong axes would give."""
    path = Path(attitudes(9))
    record = path.recording(*both({}), models())
    columns = list(record.columns)
    columns[5] = ArrayColumn(sign * record.values("gyro_z"))
    found = calibrate(
        Recording(channels=record.channels, columns=tuple(columns), rate=record.rate),
        spans=path.spans,
        model=models(),
        latitude=LATITUDE,
        gravity=G,
        gyro=[f"gyro_{a}" for a in order],
    )
    assert found.verdict == "inconsistent" and said in found.reason
    assert not found.advice and not found.add


@pytest.mark.long
def test_a_turn_can_be_left_out(path: Path) -> None:
    """Two positions are sound, and what the gyros saw between them is not."""
    record = path.recording(*both(truth(3)), models(), seed=5)
    columns = list(record.columns)
    rate = np.array(record.values("gyro_y"))
    rate[path.spans[7][1] + 20 : path.spans[7][1] + 25] += 0.5
    columns[4] = ArrayColumn(rate)
    record = Recording(channels=record.channels, columns=tuple(columns), rate=record.rate)
    arguments = {"spans": path.spans, "model": models(), "latitude": LATITUDE, "gravity": G}
    found = calibrate(record, **arguments)
    assert found.outliers == ("turn 8 to 9",) and "--without 8-9" in found.advice[0]
    clean = calibrate(record, without=[(8, 9)], **arguments)
    assert not clean.outliers and not clean.inflated
    assert [(t.before, t.why) for t in clean.turns if not t.used] == [(8, "left out")]
    assert any("turn 8 to 9: not used, left out" in r for r in clean.notes)
    for p in clean.parameters:
        assert abs(p.value - truth(3)[p.name]) < 4.5 * p.sd
    for turn in ((8, 10), (9, 8)):
        with pytest.raises(InputError, match="no turn from position"):
            calibrate(record, without=[turn], **arguments)


@pytest.mark.long
def test_a_thermometer_beside_a_drift_is_pointed_at(path: Path) -> None:
    values = truth(4) | {f"gyro.bias_temperature_{a}": 2e-4 for a in "xyz"}
    record = path.recording(*both(values), models(), warmth=np.linspace(20.0, 32.0, path.count))
    arguments = {"spans": path.spans, "model": models(), "latitude": LATITUDE, "gravity": G}
    found = calibrate(record, **arguments)
    assert any("--reference-temperature 26" in a for a in found.advice)
    assert not calibrate(record, reference_temperature=26.0, **arguments).advice


def test_noise_that_turns_up_in_the_scatter_widens_by_student(path: Path) -> None:
    """Tilts that come anew in each position: the scatter is found within its own uncertainty."""
    rng = np.random.default_rng(6)
    record = path.recording(*both({}), models(), seed=6)
    columns = list(record.columns)
    for k in range(3):
        y = np.array(record.values(ACC[k]))
        for a, b in path.spans:
            y[a:b] += 0.01 * rng.standard_normal()
        columns[k] = ArrayColumn(y)
    record = type(record)(channels=record.channels, columns=tuple(columns), rate=record.rate)
    found = calibrate(record, spans=path.spans, model=models(), latitude=LATITUDE, gravity=G)
    extra = math.sqrt(sum(s.sd**2 + s.walk**2 * path.count / path.rate / 3 for s in found.scatter[:1]))
    assert extra == pytest.approx(0.01, rel=0.6)
    p = found["accelerometer.scale_x"]
    assert p.dof < 40 and (p.interval[1] - p.interval[0]) > 2 * 1.96 * p.sd
    assert abs(p.value - 1) < 4 * p.sd


# -- defaults, files and refusals ----------------------------------------------------------------------------


def test_defaults_find_the_spans_and_survive_a_file(path: Path, tmp_path) -> None:
    found = calibrate(path.recording(*both(truth(1)), models(), seed=3), latitude=LATITUDE, gravity=G)
    assert len(found.positions) >= 16 and found.spans_source == "found"
    document = json.loads(json.dumps(found.to_json()))
    assert document["format"] == "allanite-calibration-estimate" and document["version"] == 2
    again = Calibration.from_json(document)
    assert np.array_equal(again.values, found.calibration.values)
    assert np.array_equal(again.covariance, found.calibration.covariance)
    assert again.gravity == G and again.units == {"accelerometer": "m/s²", "gyro": "rad/s"}
    assert not found.positions[0].up.flags.writeable


def test_stated_uncertainties_enter(path: Path) -> None:
    record = path.recording(*both({}), models())
    arguments = {"spans": path.spans, "model": models(), "latitude": LATITUDE, "gravity": G}
    plain = calibrate(record, **arguments)
    wide = calibrate(record, stated={"gravity": 1e-2, "gyro.bias": 1e-3}, **arguments)
    for name, extra in (("accelerometer.scale_x", 1e-2 / G), ("gyro.bias_y", 1e-3), ("gyro.scale_x", 0.0)):
        assert wide[name].sd == pytest.approx(math.hypot(plain[name].sd, extra), rel=1e-3)
    i, j = (NAMES.index(f"accelerometer.scale_{a}") for a in "xy")
    assert wide.correlation[i, j] > 0.99


def test_gravity_that_nobody_gave_is_said(path: Path) -> None:
    record = path.recording(*both({}), models())
    assert any("gravity is assumed" in r for r in calibrate(record, spans=path.spans, model=models()).notes)
    known = calibrate(record, spans=path.spans, model=models(), latitude=LATITUDE)
    assert known.gravity == pytest.approx(9.7967, abs=1e-3) and known.gravity_source == "latitude"


def test_words_of_positions() -> None:
    assert words_of((0, 0, 1)) == "z up" and words_of((-0.99, 0.1, 0)) == "x down"
    assert words_of((0.7, 0.7, 0.05)) == "on an edge, +x and +y up"
    assert words_of(rotation([0.1, 0, 0]) @ (1, -1, 1)) == "on a corner, +x, -y and +z up"
    assert len(ORIENTATIONS) == 26


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"latitude": 40.0}, "radians"),
        ({"gravity": 1.0}, "gravity"),
        ({"frame": "y"}, "frame"),
        ({"confidence": 1.0}, "confidence"),
        ({"without": [99]}, "no position 99"),
        ({"stated": {"gravity": -1.0}}, "gravity"),
        ({"stated": {"nonsense": 1.0}}, "nonsense"),
        ({"reference_temperature": 25.0}, "temperature"),
        ({"model": NoiseModel.of(White(N=1.0))}, "one noise model"),
        ({"model": {"accel_x": NoiseModel.of(White(N=1.0))}}, "no noise model for"),
        ({"spans": [1, 2, 3]}, "spans"),
    ],
)
def test_nonsense_is_refused(path: Path, change: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        calibrate(path.recording(*both({}), models()), **({"spans": path.spans} | change))


def test_data_that_cannot_be_are_refused(path: Path) -> None:
    record = path.recording(*both({}), models(), gains=(0.1, 1.0))
    with pytest.raises(DataQualityError, match="not gravity"):
        calibrate(record, spans=path.spans)
    counts = path.recording(*both({}), models(), units=("LSB", "LSB"))
    with pytest.raises(DataQualityError, match="at least four positions"):
        calibrate(counts, spans=path.spans[:3], gyro=GYRO, accelerometer=ACC)
    with pytest.raises(InputError, match="positive"):
        predict(attitudes(3), dwell=0.0, turn=1.0, models={"gyro": NoiseModel.of(White(N=1.0))})
    with pytest.raises(InputError, match="attitudes"):
        predict(np.eye(3), dwell=1.0, turn=1.0, models={"gyro": NoiseModel.of(White(N=1.0))})
