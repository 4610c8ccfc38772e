# SPDX-License-Identifier: BSD-3-Clause
"""Redundant sensors: weights against least squares, gains against theory, alarms at their rate, faults by name."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from allanite.errors import FormatError, InputError
from allanite.experiments.redundancy import Combination, combine
from allanite.experiments.redundancy.combined import combined_model
from allanite.experiments.redundancy.estimation import measured_gain
from allanite.experiments.redundancy.geometry import best_weights, parity_matrix, twins
from allanite.experiments.redundancy.means import window_means
from allanite.experiments.redundancy.parity import ParityFilter
from allanite.experiments.redundancy.shared import allan_covariance, correlation_kept, pairs_of
from allanite.filtering.simulation import simulate
from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.quantities.distributions import chi_square_quantile
from allanite.quantities.quantity import Quantity
from allanite.recording.records import Recording
from shell import Run

Array = NDArray[np.float64]
RATE = 50.0
N = 1e-3
WHITE = NoiseModel.of(White(N=N))


def cone(n: int, angle: float = math.radians(54.7356)) -> Array:
    """Axes evenly around a cone: with this angle every axis of the body is known equally well."""
    turn = 2 * np.pi * np.arange(n) / n
    side = math.sin(angle)
    return np.column_stack([side * np.cos(turn), side * np.sin(turn), np.full(n, math.cos(angle))])


def noise(n: int, samples: int, seed: int, shared: float = 0.0) -> Array:
    """White noise of density N of n sensors, each with a bias; `shared` is their correlation."""
    rng = np.random.default_rng(seed)
    own = rng.standard_normal((samples, n))
    common = rng.standard_normal((samples, 1))
    y = math.sqrt(1 - shared) * own + math.sqrt(shared) * common
    return N * math.sqrt(RATE) * y + 0.01 * rng.standard_normal(n)


def record(y: Array, unit: str = "rad/s") -> Recording:
    return Recording.from_rate(y, rate=RATE, unit=unit, names=[f"g{i}" for i in range(y.shape[1])])


def combined(y: Array, **options: Any) -> Combination:
    return combine(record(y), **{"models": WHITE, **options})


def binomial_bounds(p: float, n: int) -> tuple[int, int]:
    """Counts that a right probability leaves in all but one of 1000 cases."""
    from scipy.stats import binom

    return int(binom.ppf(5e-4, n, p)), int(binom.ppf(1 - 5e-4, n, p))


# -- geometry ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [4, 5, 6, 8])
def test_parity_matrix(n: int) -> None:
    h = cone(n)
    v = parity_matrix(h)
    assert v.shape == (n - 3, n)
    assert np.abs(v @ h).max() < 1e-14
    assert np.allclose(v @ v.T, np.eye(n - 3), atol=1e-14)
    assert np.allclose(v.T @ v, np.eye(n) - h @ np.linalg.pinv(h), atol=1e-13)


def test_weights_are_generalised_least_squares() -> None:
    """Inverse variances along one axis; in space the normal equations, and no other unbiased weights are better."""
    sd = np.array([1.0, 2.0, 4.0])
    w = best_weights(np.ones((3, 1)), np.diag(sd**2))
    assert np.allclose(w, (1 / sd**2 / (1 / sd**2).sum())[None], rtol=1e-14)
    rng = np.random.default_rng(1)
    h, half = cone(5), rng.standard_normal((5, 5))
    c = half @ half.T + np.eye(5)
    w = best_weights(h, c)
    assert np.allclose(w @ h, np.eye(3), atol=1e-13)
    v = parity_matrix(h)
    assert np.abs(w @ c @ v.T).max() < 1e-12  # what is left is uncorrelated with every parity


def test_twins_are_sensors_with_parallel_columns() -> None:
    two_triads = np.vstack([np.eye(3), np.eye(3)])
    assert twins(parity_matrix(two_triads)) == ((0, 3), (1, 4), (2, 5))
    assert twins(parity_matrix(cone(5))) == ()
    assert twins(parity_matrix(cone(4))) == ((0, 1, 2, 3),)


# -- the combined estimate -----------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [2, 4, 9])
def test_n_equal_sensors_gain_the_root_of_n(n: int) -> None:
    """Predicted exactly, and measured on the record and on the combined samples within their spread."""
    samples = 40_000
    c = combined(noise(n, samples, n))
    assert np.allclose(c.weights, 1 / n)
    assert np.allclose(c.gain_predicted, math.sqrt(n), rtol=1e-12)
    assert c.gain_lower[0, 0] < math.sqrt(n) < c.gain_upper[0, 0]
    y = c.recording().values("gyro")
    assert np.std(np.diff(y)) / math.sqrt(2) == pytest.approx(
        N * math.sqrt(RATE / n), rel=4 / math.sqrt(samples)
    )
    assert c.models[0].term("white").N == pytest.approx(N / math.sqrt(n), rel=1e-12)  # type: ignore[union-attr]


def test_a_cone_of_n_gains_the_root_of_n_over_three() -> None:
    for n in (4, 5, 6):
        c = combined(noise(n, 4000, n), directions=cone(n))
        assert c.axes == ("gyro_x", "gyro_y", "gyro_z")
        assert np.allclose(c.gain_predicted, math.sqrt(n / 3), rtol=1e-4)


def test_what_is_measured_goes_through_unchanged() -> None:
    """Any motion, at every sample; to rounding, for no noise is added here."""
    h, t = cone(5), np.arange(4000) / RATE
    true = np.column_stack([np.sin(3 * t), t * 0.01, np.sign(np.sin(t))])
    models = {f"g{i}": NoiseModel.of(White(N=N * (i + 1))) for i in range(5)}
    c = combined(true @ h.T, models=models, directions=h, rest=False)
    got = np.column_stack([c.recording().values(a) for a in c.axes])
    assert np.abs(got - true).max() < 1e-12
    assert c.verdict == "sensors agree"
    assert np.isnan(c.gain).all()


def test_unequal_models_weigh_by_their_deviation_at_the_averaging_time() -> None:
    quiet, steady = NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-4)), NoiseModel.of(White(N=1e-3))
    y = np.zeros((40_000, 2))
    models = {"g0": quiet, "g1": steady}
    for tau, better in ((0.1, 0), (30.0, 1)):
        c = combined(y + 1e-9 * noise(2, 40_000, 0), models=models, averaging=tau)
        v = [float(models[f"g{i}"].avar(tau)) for i in range(2)]
        assert c.weights[0, 0] == pytest.approx(v[1] / sum(v), rel=1e-9)
        assert int(np.argmax(c.weights[0])) == better
        assert (c.loss >= 1 - 1e-12).all()
        near = int(np.argmin(np.abs(c.tau - tau)))
        assert c.loss[near, 0] < 1.2
        assert c.loss.max() > 1.5


def test_combined_model_has_the_allan_variance_of_the_weighted_sum() -> None:
    models = [
        NoiseModel.of(White(N=1e-3), Flicker(B=1e-4), RandomWalk(K=1e-5)),
        NoiseModel.of(White(N=2e-3), RandomWalk(K=2e-5)),
        NoiseModel.of(GaussMarkov(q=1e-4, T=10.0)),
    ]
    w, tau = np.array([0.5, 0.3, 0.2]), np.geomspace(0.1, 1000, 12)
    total = sum(wi**2 * m.avar(tau) for wi, m in zip(w, models, strict=True))
    assert np.allclose(combined_model(models, w, np.eye(3)).avar(tau), total, rtol=1e-12)
    r = np.array([[1, 0.5, 0], [0.5, 1, 0], [0, 0, 1.0]])
    assert combined_model([WHITE] * 3, w, r).avar(1.0) == pytest.approx(N**2 * w @ r @ w, rel=1e-12)


def test_measured_deviation_of_simulated_flicker_agrees_with_the_model() -> None:
    """The whole chain on records of the simulator: three sensors of different noise."""
    parts = [NoiseModel.of(White(N=N * k), Flicker(B=3e-4 * k), RandomWalk(K=2e-5)) for k in (1, 2, 3)]
    columns = [simulate(m, rate=10.0, duration=4000.0, seed=i) for i, m in enumerate(parts)]
    y = np.column_stack([r.values(r.names[0]) for r in columns])
    rec = Recording.from_rate(y, rate=10.0, unit="rad/s", names=["a", "b", "c"])
    c = combine(rec, models=dict(zip("abc", parts, strict=True)))
    assert c.verdict == "sensors agree"
    inside = (c.lower[:, 0] < c.predicted[:, 0]) & (c.predicted[:, 0] < c.upper[:, 0])
    assert inside.mean() > 0.7  # 95 % each, but neighbours go together


def test_missing_samples_are_bridged_by_the_others() -> None:
    y = noise(3, 8000, 1)
    y[1000:1100, 0] = np.nan
    y[2000:2010] = np.nan
    c = combined(y)
    z = c.recording().values("gyro")
    assert np.isnan(z).sum() == 10
    jump = z[1000:1100].mean() - z[500:1000].mean()
    assert abs(jump) < 5 * N * math.sqrt(RATE * (1 / 200 + 1 / 1500))  # biases of 0.01 are taken off


# -- shared noise --------------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("shared", [0.0, 0.3])
def test_interval_of_a_correlation_covers(shared: float) -> None:
    """400 pairs; at the shortest time and at one with 40 degrees of freedom."""
    cover = np.zeros(2)
    for seed in range(400):
        y = noise(2, 800, 1000 + seed, shared)
        allan = allan_covariance(y, 1 / RATE, WHITE)
        for i, tau in enumerate((1 / RATE, 16 / RATE)):
            (pair,) = pairs_of(allan, tau, ["a", "b"], 0.95)
            cover[i] += pair.correlation.lower <= shared <= pair.correlation.upper
    low, high = binomial_bounds(0.95, 400)
    assert ((low <= cover) & (cover <= high)).all(), cover


@pytest.mark.long
@pytest.mark.parametrize("weights", [[1 / 3, 1 / 3, 1 / 3], [0.2, 0.5, 0.3]])
def test_interval_of_a_gain_covers(weights: list[float]) -> None:
    """400 records of correlated sensors; at the shortest time and at one with some 60 degrees of freedom."""
    w, r, cover = np.array(weights), 0.4, np.zeros(2)
    true = 1 / math.sqrt(float(w @ (r + (1 - r) * np.eye(3)) @ w))
    for seed in range(400):
        allan = allan_covariance(noise(3, 800, 5000 + seed, r), 1 / RATE, WHITE)
        found = measured_gain(allan, w[None], np.zeros(len(allan.tau), dtype=np.int64), 0.95)
        for i, k in enumerate((0, 4)):
            cover[i] += found["gain_lower"][k, 0] <= true <= found["gain_upper"][k, 0]
    low, high = binomial_bounds(0.95, 400)
    assert ((low <= cover) & (cover <= high)).all(), cover


@pytest.mark.long
def test_independent_sensors_are_rarely_called_correlated() -> None:
    """1 % of records; 300 of them with 6 pairs."""
    found = sum(
        any(p.seen for p in pairs_of(allan_covariance(noise(4, 800, s), 1 / RATE, WHITE), 0.02, "abcd", 0.95))
        for s in range(300)
    )
    assert found <= binomial_bounds(0.01, 300)[1]


def test_shared_noise_is_found_and_enters_the_weights() -> None:
    """Two sensors on one supply count as little more than one."""
    y = noise(3, 30_000, 4)
    rng = np.random.default_rng(9)
    common = rng.standard_normal(30_000) * N * math.sqrt(RATE)
    y[:, 0] = 0.3 * (y[:, 0] - y[0, 0]) + math.sqrt(0.91) * common
    y[:, 1] = 0.3 * (y[:, 1] - y[0, 1]) + math.sqrt(0.91) * common
    c = combined(y)
    pair = next(p for p in c.shared if {p.first, p.second} == {"g0", "g1"})
    assert pair.seen
    assert pair.correlation.lower < 0.91 < pair.correlation.upper
    assert [p.seen for p in c.shared].count(True) == 1
    # of correlation r the pair has the variance (1 + r)/2, the third 1
    r = pair.correlation.value
    assert c.weights[0, 2] == pytest.approx((1 + r) / (3 + r), rel=1e-6)
    assert c.advice[0].startswith("noise is shared by g0 and g1")
    assert c.gain_lower[0, 0] < c.gain_predicted[0, 0] * 1.02


def test_correlations_that_contradict_each_other_become_a_matrix() -> None:
    from allanite.experiments.redundancy import SharedNoise

    def pair(a: str, b: str, r: float) -> SharedNoise:
        return SharedNoise(first=a, second=b, tau=1.0, correlation=Quantity.of(r, (r, r), "1"), seen=True)

    r = correlation_kept([pair("a", "b", 0.9), pair("b", "c", 0.9), pair("a", "c", -0.9)], ["a", "b", "c"])
    assert np.linalg.eigvalsh(r)[0] > 0
    assert np.allclose(np.diag(r), 1.0)


# -- alarms --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("walks", [(1, 2, 3, 4, 5), (1,) * 5], ids=["different", "alike"])
@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_whitened_parity_is_white_and_of_variance_one(walks: tuple[int, ...], correlation: float) -> None:
    """A diffuse constant for each sensor, two that share white noise, gaps: against the dense covariance of the record.

    Sensors that are alike are filtered along the axes of their covariance.
    """
    models = [NoiseModel.of(White(N=N), RandomWalk(K=1e-4 * k), Flicker(B=1e-4)) for k in walks]
    shared = np.eye(5)
    shared[0, 3] = shared[3, 0] = correlation
    rows, q = 40, 2
    part = np.ones(rows)
    part[[0, 7, 20]] = 0.0
    part[11] = 0.6
    v = parity_matrix(cone(5))
    made = ParityFilter.of(v, models, shared, part, dt=1.0, extra=np.zeros(rows))
    spaces = [m.state_space(1.0, sampling="mean", record=float(rows)) for m in models]
    covariance = np.zeros((rows, 5, rows, 5))
    for i, space in enumerate(spaces):
        state = space.initial
        for a in range(rows):
            row = space.output @ state
            for b in range(a, rows):
                covariance[a, i, b, i] = covariance[b, i, a, i] = row @ space.output
                row = row @ space.transition.T
            white = N**2 / (part[a] or 1.0)
            covariance[a, i, a] += shared[i] * white
            covariance[a, i, a, i] += space.noise - N**2
            state = space.transition @ state @ space.transition.T + space.process
    p = np.einsum("qi,aibj,rj->aqbr", v, covariance, v).reshape(rows * q, rows * q)
    identity = np.eye(rows * 5).reshape(rows, 5, rows * 5)
    whiten = made.whiten(identity).reshape(rows * q, rows * 5)
    keep = ~np.isnan(whiten[:, 0])
    assert keep.sum() == (rows - 4) * q  # three windows are missing, one tells the constants
    v_inverse = np.kron(np.eye(rows), v.T)  # sensors that show a given parity
    effect = whiten[keep] @ v_inverse
    assert np.allclose(effect @ p @ effect.T, np.eye(keep.sum()), atol=1e-8)
    constants = effect @ np.kron(np.ones((rows, 1)), np.eye(q))
    assert np.abs(constants).max() < 1e-9 / N


@pytest.mark.long
@pytest.mark.parametrize(
    ("n", "directions", "model"),
    [(4, True, WHITE), (3, False, NoiseModel.of(White(N=N), RandomWalk(K=3e-4), Flicker(B=2e-4)))],
)
def test_false_alarms_come_at_the_stated_rate_or_less(n: int, directions: bool, model: NoiseModel) -> None:
    """40 records at a rate of 10 %: Bonferroni's bound may not be exceeded."""
    alarms = 0
    for seed in range(40):
        if model is WHITE:
            y = noise(n, 2560, 100 + seed)
        else:
            parts = [simulate(model, rate=RATE, duration=51.2, seed=10 * seed + i) for i in range(n)]
            y = np.column_stack([r.values(r.names[0]) for r in parts])
        options = {"directions": cone(n)} if directions else {}
        c = combined(y, models=model, false_alarm=0.10, window=0.16, rest=False, **options)
        alarms += bool(c.faults)
    assert alarms <= binomial_bounds(0.10, 40)[1]


@pytest.mark.long
def test_motion_gives_no_alarm_where_the_sensors_are_exact_or_their_errors_are_stated() -> None:
    h, t = cone(5), np.arange(8000) / RATE
    motion = np.column_stack([np.sin(t), np.cos(2 * t), 0.5 * np.sin(0.3 * t)])
    y = noise(5, 8000, 3) + motion @ h.T
    assert combined(y, directions=h, rest=False).verdict == "sensors agree"
    y = noise(5, 8000, 3) + motion @ h.T * (1 + 0.01 * np.random.default_rng(2).standard_normal(5))
    assert combined(y, directions=h, rest=False).verdict != "sensors agree"
    assert combined(y, directions=h, rest=False, motion_error=0.02).verdict == "sensors agree"


# -- faults --------------------------------------------------------------------------------------------------


def faulty(kind: str, sensor: int, seed: int = 5, n: int = 5, samples: int = 20_000) -> Array:
    """Five sensors around a cone; the fault lies between 40 % and 70 % of the record where it ends at all."""
    y = noise(n, samples, seed) + (cone(n) @ np.array([0.1, -0.2, 0.3]))
    a, b = int(0.4 * samples), int(0.7 * samples)
    rng = np.random.default_rng(77)
    if kind == "step":
        y[a:, sensor] += 4 * N
    elif kind == "spell":
        y[a:b, sensor] += 4 * N
    elif kind == "drift":
        y[a:, sensor] += 8 * N * np.arange(samples - a) / (samples - a)
    elif kind == "spike":
        y[a : a + 20, sensor] += 30 * N
    elif kind == "noise":
        y[a:b, sensor] += 3 * N * math.sqrt(RATE) * rng.standard_normal(b - a)
    else:
        y[a:b, sensor] = y[a, sensor]
    return y


@pytest.mark.long
@pytest.mark.parametrize(
    ("kind", "sensor"), [("step", 0), ("spell", 3), ("drift", 0), ("spike", 3), ("noise", 0), ("stuck", 3)]
)
def test_a_fault_is_found_and_its_sensor_named(kind: str, sensor: int) -> None:
    c = combined(faulty(kind, sensor), directions=cone(5))
    assert c.verdict == "a sensor is at fault"
    assert [f.sensor for f in c.faults] == [f"g{sensor}"]
    (fault,) = c.faults
    assert fault.kind == ("step" if kind == "spell" else kind)
    if kind != "drift":
        assert fault.start == pytest.approx(160.0, abs=6.5)
    stop = {"spell": 280.0, "noise": 280.0, "stuck": 280.0, "step": 400.0, "drift": 400.0, "spike": 160.8}[
        kind
    ]
    assert fault.stop == pytest.approx(stop, abs=8.0)
    if kind in ("step", "spell"):
        assert fault.size == pytest.approx(4 * N, abs=5 * fault.size_sd)
        assert fault.size_sd < 0.5 * N
    if kind == "drift":
        assert fault.size == pytest.approx(8 * N / 240.0, rel=0.3)
    if kind == "noise":
        assert fault.size == pytest.approx(math.sqrt(10.0), rel=0.3)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(4))
def test_a_step_that_ends_is_neither_noise_nor_kept_out_longer_than_it_lasts(seed: int) -> None:
    """Along one axis or around a cone, from 5 to 150 standard deviations of a window, 20 to 200 windows long."""
    rng = np.random.default_rng(seed)
    n, window, samples = int(rng.integers(5, 7)), 8, 2400
    model = NoiseModel.of(White(N=N), RandomWalk(K=3e-5)) if seed % 2 else WHITE
    y = noise(n, samples, 40 + seed)
    if seed % 2:
        y += 3e-5 * math.sqrt(1 / RATE) * np.cumsum(rng.standard_normal((samples, n)), axis=0)
    first, sensor = int(rng.uniform(0.15, 0.5) * samples), int(rng.integers(n))
    last = first + window * int(rng.integers(20, 121))
    size = float(rng.choice([5, 15, 50, 150])) * N * math.sqrt(RATE / window)
    y[first:last, sensor] += size
    c = combined(y, models=model, directions=cone(n) if seed % 4 < 2 else None)
    assert [(f.kind, f.sensor) for f in c.faults] == [("step", f"g{sensor}")]
    (fault,) = c.faults
    slack = 4 * window / RATE
    assert fault.start == pytest.approx(first / RATE, abs=slack)
    assert fault.stop == pytest.approx(last / RATE, abs=slack)
    assert fault.size == pytest.approx(size, abs=5 * fault.size_sd)


@pytest.mark.parametrize("rest", [0, 1, 5])
def test_a_fault_that_does_not_end_lasts_to_the_last_sample(rest: int) -> None:
    """Also in the samples at the end that fill no window."""
    samples = 2400 + rest
    y = noise(5, samples, 3)
    y[1203:, 1] += 40 * N * math.sqrt(RATE / 8)
    c = combined(y, directions=cone(5), window=8 / RATE)
    (fault,) = c.faults
    assert (fault.sensor, fault.stop) == ("g1", pytest.approx(samples / RATE))
    last = np.column_stack([c.recording().values(name) for name in c.axes])[-1]
    without = np.delete(np.arange(5), 1)
    level = cone(5)[without] @ last + c.differences[without]
    assert np.abs(level - y[-1, without]).max() < 5 * N * math.sqrt(RATE)


@pytest.mark.parametrize(("first", "last"), [(803, 1605), (800, 1600), (0, 805), (1607, 2403)])
def test_a_stuck_sensor_is_left_out_of_every_sample_of_the_repeated_value(first: int, last: int) -> None:
    """Windows of 8 samples hold the ends of the run in part, and the last three samples fill none."""
    y = noise(5, 2403, 4)
    y[first:last, 2] = y[first, 2]
    c = combined(y, directions=cone(5), window=8 / RATE)
    (fault,) = c.faults
    assert (fault.kind, fault.sensor) == ("stuck", "g2")
    assert fault.start * RATE == pytest.approx(first) and fault.stop * RATE == pytest.approx(last)
    assert c.recording().history[-1]["left_out"] == {"g2": [[first, last]]}


@pytest.mark.parametrize("size", [20.0, 400.0, 1e5])
def test_a_step_of_half_of_the_record_is_not_taken_for_the_noise(size: int) -> None:
    y = noise(4, 2400, 3)
    y[700:1900, 1] += size * N * math.sqrt(RATE / 8)
    c = combined(y, directions=cone(4))
    assert c.verdict == "sensors contradict each other"
    assert [(f.kind, round(f.stop)) for f in c.faults] == [("step", 38)]
    assert c.noise_ratio == pytest.approx(1.0, abs=0.15)


@pytest.mark.long
def test_steps_to_another_level_and_back_are_not_noise() -> None:
    y = noise(6, 2400, 12)
    y[600:1100, 2] += 40 * N * math.sqrt(RATE / 8)
    y[1100:1700, 2] -= 25 * N * math.sqrt(RATE / 8)
    c = combined(y, directions=cone(6))
    assert {(f.kind, f.sensor) for f in c.faults} == {("step", "g2")}
    assert max(f.stop for f in c.faults) == pytest.approx(34.0, abs=1.0)


@pytest.mark.long
def test_deviation_and_gain_are_those_of_the_recording_that_is_written() -> None:
    """Three of four sensors for a quarter of the record, or with a fault that nobody is blamed for."""
    from allanite.noise.allan import allan_curve

    y = noise(4, 2048, 3)
    y[1400:1912, 1] += 1.0
    alone = combined(y)
    assert [f.sensor for f in alone.faults] == ["g1"]
    assert any("continues without g1" in r for r in alone.advice)
    unknown = combined(y, directions=cone(4))
    assert [f.sensor for f in unknown.faults] == [None] * len(unknown.faults) != []
    assert any("stays in the recording" in r for r in unknown.advice)
    for c in (alone, unknown):
        written = c.recording()
        for m, name in enumerate(written.names):
            curve = allan_curve(written.select(name), taus="octave")
            at = [int(np.argmin(np.abs(curve.tau - t))) for t in c.tau]
            assert c.measured[:, m] == pytest.approx(curve.deviation[at, 0], rel=1e-6)
    # of variance 1/3 for a quarter of the windows, 1/4 for the others
    expected = math.sqrt(1 / (0.25 / 3 + 0.75 / 4))
    assert alone.gain_lower[0, 0] < expected < alone.gain_upper[0, 0]
    assert alone.gain[0, 0] == pytest.approx(expected, rel=0.05)


@pytest.mark.long
def test_the_sensor_at_fault_does_not_take_part_in_its_span() -> None:
    clean, broken = noise(5, 20_000, 5), faulty("spell", 2) - cone(5) @ np.array([0.1, -0.2, 0.3])
    c = combined(broken, directions=cone(5))
    z = np.column_stack([c.recording().values(a) for a in c.axes])
    true = combined(clean, directions=cone(5)).recording()
    good = np.column_stack([true.values(a) for a in true.names])
    inside = slice(9000, 13_500)
    jump = (z - good)[inside].mean(axis=0) - (z - good)[1000:7000].mean(axis=0)
    # a step of 4 N through weights of 3/5 sin(54.7 deg) would move x or y by up to 2 N; noise of the mean is 0.1 N
    assert np.abs(jump).max() < 0.5 * N


@pytest.mark.long
def test_with_four_sensors_a_fault_is_seen_and_not_whose_it_is() -> None:
    c = combined(faulty("step", 1, n=4), directions=cone(4))
    assert c.verdict == "sensors contradict each other"
    assert c.faults[0].sensor is None
    assert set(c.faults[0].candidates) == {"g0", "g1", "g2", "g3"}
    assert "not identified" in c.isolation
    assert "one parity cannot tell which" in c.faults[0].says


def test_four_sensors_name_the_one_that_stands_still() -> None:
    c = combined(faulty("stuck", 1, n=4), directions=cone(4))
    assert [(f.kind, f.sensor) for f in c.faults] == [("stuck", "g1")]


@pytest.mark.long
def test_twins_stay_candidates() -> None:
    h = np.vstack([np.eye(3), np.eye(3)])
    y = noise(6, 20_000, 1)
    y[8000:, 4] += 5 * N
    c = combined(y, directions=h)
    assert c.faults[0].sensor is None
    assert set(c.faults[0].candidates) == {"g1", "g4"}
    assert "except between" in c.isolation


@pytest.mark.long
def test_two_faults_of_two_sensors() -> None:
    y = faulty("step", 0, n=6)
    y[14_000:, 4] -= 5 * N
    c = combined(y, directions=cone(6))
    assert [(f.kind, f.sensor) for f in c.faults] == [("step", "g0"), ("step", "g4")]
    assert c.faults[1].size == pytest.approx(-5 * N, abs=5 * c.faults[1].size_sd)


@pytest.mark.long
def test_power_of_the_parity_test() -> None:
    """A pulse in one window: the chance to see it is that of a non-central chi-square over the threshold."""
    from scipy.stats import ncx2

    seen, rows, size = 0, 100, 8
    shift = 4.5  # standard deviations of one window mean
    h = cone(5)
    for seed in range(60):
        y = noise(5, rows * size, 2000 + seed)
        y[400:408, 0] += shift * N * math.sqrt(RATE / size)
        c = combined(y, directions=h, window=size / RATE, rest=False)
        seen += bool(c.parity.windows[0].statistic[50] > c.parity.threshold)
    share = float((parity_matrix(h)[:, 0] ** 2).sum())  # of the pulse that the parity sees
    tests = rows + rows // 8 + rows // 16
    threshold = chi_square_quantile(1 - 0.01 / tests, 2)
    power = float(ncx2.sf(threshold, 2, share * shift**2 * 50 / 51))
    low, high = binomial_bounds(power, 60)
    assert low <= seen <= high


def test_noise_beyond_the_models_is_said_and_allowed_for() -> None:
    c = combined(1.5 * noise(5, 20_000, 8), directions=cone(5))
    assert c.noise_ratio == pytest.approx(1.5, rel=0.1)
    assert any("1.5" in r and "as much as the models predict" in r for r in c.advice)
    assert not c.faults


# -- what is refused, and the document -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"directions": np.eye(3)[[0, 1, 0, 1]]}, "in one plane"),
        ({"directions": 2 * cone(4)}, "unit vectors"),
        ({"directions": np.eye(2)}, r"shape \(4, 3\)"),
        ({"directions": np.eye(3), "channels": ["g0", "g1", "g2"]}, "not redundant"),
        ({"models": {"g0": WHITE}}, "no noise model for g1"),
        ({"models": NoiseModel.of(White(N=1.0), kind="acceleration")}, "not of rate"),
        ({"averaging": 1e6}, "averaging"),
        ({"window": 100.0}, "parity needs 32"),
        ({"false_alarm": 0.0}, "false_alarm"),
        ({"channels": ["g9"]}, "no channel 'g9'"),
    ],
)
def test_what_makes_no_sense_is_refused(options: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        combined(noise(4, 4000, 0), **options)


def test_unknown_units_are_refused() -> None:
    with pytest.raises(InputError, match="known units"):
        combine(record(noise(4, 4000, 0), unit="V"), models=WHITE)


def test_window_means_stream_and_merge() -> None:
    y = noise(2, 1003, 3)
    y[8:12, 0] = np.nan
    y[16:24, 1] = 7.0
    means = window_means(record(y), ("g0", "g1"), 8)
    assert len(means) == 125
    assert means.mean[1, 0] == pytest.approx(y[12:16, 0].mean(), rel=1e-12)
    assert means.part[1, 0] == 0.5
    assert means.frozen[2, 1]
    assert means.frozen.sum() == 1
    long = means.merged(2)
    assert long.mean[0, 0] == pytest.approx(np.nanmean(y[:16, 0]), rel=1e-12)


@pytest.mark.long
def test_document_is_plain() -> None:
    import json

    document = combined(faulty("step", 1), directions=cone(5)).to_json()
    assert document["format"] == "allanite-combination"
    assert json.loads(json.dumps(document, allow_nan=False)) == document


# -- figures, report and command -----------------------------------------------------------------------------


@pytest.mark.long
def test_picture_report_and_command(run: Run, tmp_path: Path) -> None:
    import json

    from allanite.files.readers import read
    from allanite.files.recording_file import write_recording
    from allanite.views.figures import sheet_of

    write_recording(record(faulty("step", 1)), tmp_path / "gyros.parquet")
    rows = "".join(f"g{i},{x},{y},{z}\n" for i, (x, y, z) in enumerate(cone(5)))
    (tmp_path / "axes.csv").write_text("channel,x,y,z\n" + rows)
    words = ["--model", "N=0.05729578 deg/s/√Hz", "--directions", str(tmp_path / "axes.csv")]
    log, out = str(tmp_path / "gyros.parquet"), tmp_path / "out"
    done = run("combine", log, *words, "-o", str(tmp_path / "one.parquet"), "--out", str(out))
    assert done.code == 0, done.err
    assert "A sensor is at fault. g1 steps" in " ".join(done.out.split())
    assert read(tmp_path / "one.parquet").names == ("gyro_x", "gyro_y", "gyro_z")
    document = json.loads((out / "combination.json").read_text())
    assert document["faults"][0]["sensor"] == "g1"
    assert "g1 steps" in (out / "report.html").read_text()
    assert (out / "weights.csv").read_text().startswith("sensor,gyro_x,gyro_y,gyro_z\ng0,")
    panels = sheet_of(document).panels
    assert [p.title for p in panels] == [
        "Parity of the sensors; 2 expected",
        "Allan deviation of the combined axes",
        "Gain over the best sensor",
    ]
    *_, longest, alarm = panels[0].curves
    inside = (longest.x > 160 / 60 + 0.5) & (longest.x < 4)
    assert (longest.y[inside] > alarm.y.max()).all()
    moving = run("combine", log, *words, "--moving", "--json")
    assert json.loads(moving.out)["shared"] == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,x,y,z\ng0,1,0,0\n", "must begin with channel,x,y,z"),
        ("channel,x,y,z\ng0,1,0\n", "line 2"),
        ("channel,x,y,z\ng0,1,0,0\ng0,0,1,0\n", "twice"),
    ],
)
def test_a_bad_file_of_axes_is_refused(text: str, message: str, tmp_path: Path) -> None:
    from allanite.commands.redundancy import directions_from

    (tmp_path / "axes.csv").write_text(text)
    with pytest.raises(FormatError, match=message):
        directions_from(tmp_path / "axes.csv")


@pytest.mark.parametrize("silent", [["b"], ["a", "d"]])
@pytest.mark.parametrize("missing", [False, True])
def test_a_sensor_that_is_silent_throughout_is_no_agreement(silent: list[str], missing: bool) -> None:
    names = [*"abcd"]
    y = 0.01 * np.random.default_rng(3).standard_normal((20_000, 4))
    for name in silent:
        y[:, names.index(name)] = 0.0123
    if missing:
        y[5000:7000] = np.nan
    record = Recording.from_rate(y, rate=100.0, unit="rad/s", names=names)
    model = NoiseModel.of(White(N=1e-3), RandomWalk(K=2e-5))
    left = ",".join(name for name in names if name not in silent)
    with pytest.raises(
        InputError, match=f"one value throughout the record: {', '.join(silent)}.*--channels {left}"
    ):
        combine(record, models=model)
    assert combine(record, models=model, channels=left.split(",")).verdict
