# SPDX-License-Identifier: BSD-3-Clause
"""The gain from polynomials between gaps: the kernel against its NumPy twin, segments against the filter row by row."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import allanite as al
import reference
from allanite import _kernels
from allanite.filtering.kalman import filter_recording
from allanite.filtering.kalman.channel import ChannelSpace, channel_space
from allanite.filtering.kalman.filtering import STEPS
from allanite.filtering.kalman.steady import riccati_steps
from allanite.noise import (
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    Ramp,
    RandomWalk,
    Sinusoid,
    StateSpace,
    White,
)
from allanite.recording.records import Recording, Sampling
from reference import Floats

DT = 1 / 32
WHITE, WALK, FLICKER = White(N=2e-4), RandomWalk(K=1.2e-6), Flicker(B=4.7e-5)
MODELS = {
    "white": (WHITE,),
    "walk": (WHITE, WALK),
    "flicker": (WHITE, FLICKER),
    "flicker and walk": (WHITE, FLICKER, WALK),
    "two Gauss-Markov terms": (WHITE, GaussMarkov.from_sigma(1e-4, 3.0), GaussMarkov.from_sigma(3e-5, 900.0)),
    "quantization": (White(N=1e-5), WALK, Quantisation(Q=1e-4, dt=DT)),
    "line and ramp": (WHITE, Sinusoid(amplitude=2e-3, frequency=0.5), Ramp(R=1e-8)),
}


@dataclass(kw_only=True)
class DriftPass:
    """All samples through the kernel, in blocks."""

    space: StateSpace
    drift: Floats
    readout: Floats
    steps: int = STEPS
    square_root: bool = False
    portable: bool = False

    def __post_init__(self) -> None:
        n, known = self.space.size, ~self.space.diffuse
        self.state = np.zeros(n)
        self.covariance = np.ascontiguousarray(self.space.initial * known * known[:, None])
        if self.square_root:
            assert _kernels.kalman_factor(self.covariance)
        self.directions, rank = np.zeros((n, n)), int(self.space.diffuse.sum())
        self.directions[:rank] = np.eye(n)[self.space.diffuse]
        self.sums = np.array([1.0, 0.0, 0.0, 1.0])
        self.counts = np.array([0, 0, rank, 0, 0, 0], dtype=np.int64)

    def run(self, y: Floats, *, step: int = 100, block: int = 1 << 16) -> dict[str, Floats]:
        """Rows 0, step, 2 step ... with all readouts; `block` is a multiple of `step`."""
        space, parts = self.space, []
        for start in range(0, len(y), block):
            piece = y[start : start + block]
            rows = tuple(np.empty(len(piece)) for _ in range(3))
            some = tuple(np.empty((len(range(0, len(piece), step)), len(self.readout))) for _ in range(2))
            _kernels.kalman_drift(
                space.transition, space.process, space.output, space.noise, *riccati_steps(space, self.steps), piece,
                self.drift, self.readout, 0, step, self.state, self.covariance, self.directions, self.sums, self.counts,
                *rows, *some, self.square_root, self.portable,
            )  # fmt: skip
            parts.append((*rows, *some))
        names = ("drift", "sd", "standardized", "means", "sds")
        return {
            name: np.concatenate(column) for name, column in zip(names, zip(*parts, strict=True), strict=True)
        }


def drift_pass(states: ChannelSpace, **options: Any) -> DriftPass:
    return DriftPass(
        space=states.space, drift=states.drift, readout=np.stack(list(states.terms.values())), **options
    )


def states_of(name: str, rows: int, sampling: Sampling = "mean") -> ChannelSpace:
    return channel_space(NoiseModel.of(*MODELS[name]), DT, sampling=sampling, record=rows * DT)


def samples_of(states: ChannelSpace, rows: int, seed: int, gaps: int = 0) -> Floats:
    """Noise of the size of the model's on a level, with gaps of one sample to a thousand."""
    rng = np.random.default_rng(seed)
    y = 1e-3 + math.sqrt(states.space.noise) * rng.standard_normal(rows)
    y += 1e-6 * rng.standard_normal(rows).cumsum()
    for first in rng.integers(0, rows, gaps):
        y[first : first + int(1 + 10 ** rng.uniform(0, 3))] = [np.nan, np.inf][first % 2]
    return y


# ---- rows one by one ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize("name", ["white", "walk", "two Gauss-Markov terms", "line and ramp", "flicker"])
def test_rows_are_those_of_the_twin(name: str, sampling: Sampling) -> None:
    rows = 90
    states = states_of(name, rows, sampling)
    space, y = states.space, samples_of(states, rows, 1)
    y[[0, 20, 21, 70]] = np.nan
    one = drift_pass(states, steps=0)
    result = one.run(y, step=1)
    means, covariances, diffuse, _, _ = reference.kalman_filter(
        space.transition, space.process, np.tile(space.output, (rows, 1, 1)), np.full((rows, 1, 1), space.noise),
        y[:, None], np.zeros((rows, space.size)), np.zeros(space.size), space.initial, np.diag(1.0 * space.diffuse),
    )  # fmt: skip
    readout = np.vstack([states.drift, one.readout])
    mean = means @ readout.T
    sd = np.sqrt(np.maximum(np.einsum("gi,kij,gj->kg", readout, covariances, readout), 0.0))
    known = np.einsum("gi,kij,gj->kg", readout, diffuse, readout) < 1e-9
    for column, (values, sds) in enumerate(
        [(result["drift"], result["sd"])] + list(zip(result["means"].T, result["sds"].T, strict=True))
    ):
        here = known[:, column]
        assert values[here] == pytest.approx(
            mean[here, column], abs=1e-9 * np.nanmax(sd[here, column], initial=1e-12)
        )
        assert sds[here] == pytest.approx(sd[here, column], rel=1e-7, abs=1e-13)
        assert np.isnan(values[~here]).all()
    assert np.isnan(result["standardized"]).sum() == 4 + one.counts[3]


def test_square_root_form_agrees() -> None:
    rows = 4096
    states = states_of("walk", rows)
    y = samples_of(states, rows, 2)
    root, plain = (drift_pass(states, square_root=s).run(y) for s in (True, False))
    for key in ("drift", "standardized"):
        np.testing.assert_allclose(root[key], plain[key], rtol=0, atol=1e-8 * np.nanmax(np.abs(plain[key])))


# ---- segments -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize(("sampling", "gaps"), [("mean", 0), ("mean", 12), ("point", 3)])
def test_segments_agree_with_the_filter_row_by_row(name: str, sampling: Sampling, gaps: int) -> None:
    """Means within 1e-9 of their standard deviation, and those to 1e-9 of themselves."""
    rows = 45_000
    states = states_of(name, rows, sampling)
    y = samples_of(states, rows, 3, gaps)
    exact, fast = drift_pass(states, steps=0), drift_pass(states)
    expected, result = exact.run(y, block=15_000), fast.run(y, block=15_000)
    for mean, sd in (("drift", "sd"), ("means", "sds")):
        known = np.isfinite(expected[sd]) & np.isfinite(expected[mean])
        error = np.abs(result[mean] - expected[mean])[known]
        assert (error <= 1e-9 * expected[sd][known] + 1e-17).all()
        np.testing.assert_allclose(result[sd][known], expected[sd][known], rtol=1e-9, atol=1e-15)
        assert np.array_equal(np.isfinite(result[mean]), np.isfinite(expected[mean]))
    np.testing.assert_allclose(result["standardized"], expected["standardized"], rtol=0, atol=1e-9)
    assert np.array_equal(fast.counts[[0, 2, 3, 5]], exact.counts[[0, 2, 3, 5]])
    likelihoods = [_kernels.kalman_likelihood(p.sums, p.counts)[0] for p in (exact, fast)]
    assert likelihoods[1] == pytest.approx(likelihoods[0], abs=1e-6)
    scale = np.sqrt(np.diag(exact.covariance))
    assert (np.abs(fast.state - exact.state) <= 1e-9 * scale + 1e-17).all()
    assert fast.covariance == pytest.approx(exact.covariance, abs=1e-9 * scale.max() ** 2)


@pytest.mark.parametrize("name", ["walk", "flicker and walk"])
def test_portable_kernel_has_the_same_digits(name: str) -> None:
    rows = 20_000
    states = states_of(name, rows)
    y = samples_of(states, rows, 4, 2)
    one, other = drift_pass(states), drift_pass(states, portable=True)
    results = [p.run(y) for p in (one, other)]
    assert all(np.array_equal(results[0][key], results[1][key], equal_nan=True) for key in results[0])
    assert np.array_equal(one.sums, other.sums)


def test_most_rows_are_in_segments() -> None:
    """Rows one by one would have the same digits as without steps."""
    rows = 30_000
    states = states_of("flicker and walk", rows)
    y = samples_of(states, rows, 5)
    fast, exact = drift_pass(states).run(y), drift_pass(states, steps=0).run(y)
    assert (fast["sd"] != exact["sd"])[8000:].mean() > 0.8


def test_steps_are_those_of_the_recursion() -> None:
    space = states_of("flicker and walk", 10_000).space
    p = space.initial + np.diag(np.full(space.size, 1e-9))
    for k, (a, g, h) in enumerate(zip(*riccati_steps(space, 6), strict=True)):
        expected = p
        for _ in range(1 << k):
            seen = expected @ space.output
            expected = expected - np.outer(seen, seen) / (space.output @ seen + space.noise)
            expected = space.transition @ expected @ space.transition.T + space.process
        result = h + a.T @ p @ np.linalg.solve(np.eye(space.size) + g @ p, a)
        assert result == pytest.approx(expected, rel=1e-9, abs=1e-12 * expected.max())


def test_steps_end_where_they_are_not_finite() -> None:
    one = np.eye(1)
    space = StateSpace(
        transition=1e60 * one, process=one, output=np.zeros(1), noise=1.0, initial=one, rate=np.ones(1),
        labels=("fast",), diffuse=np.zeros(1, dtype=bool),
    )  # fmt: skip
    assert len(riccati_steps(space, 14)[0]) == 2  # over four rows H is beyond 1e308


def test_lagged_products_are_those_of_numpy() -> None:
    x = np.random.default_rng(6).standard_normal(5001)
    for first in (0, 3, 2500, 5001):
        for portable in (False, True):
            out = np.empty(21)
            _kernels.lagged_products(x, first, out, portable)
            starts = [max(first, j) for j in range(21)]
            expected = [x[s:] @ x[s - j : len(x) - j] for j, s in enumerate(starts)]
            assert out == pytest.approx(expected, rel=1e-12, abs=1e-11)


def test_a_recording_is_filtered_as_row_by_row(monkeypatch: pytest.MonkeyPatch) -> None:
    model = NoiseModel.of(*MODELS["flicker and walk"])
    y = samples_of(states_of("flicker and walk", 40_000), 40_000, 7, 3)
    source = Recording.from_rate(y, rate=1 / DT, unit="rad/s", names="gyro")
    fast = filter_recording(source, model)
    monkeypatch.setattr("allanite.filtering.kalman.filtering.SEGMENTS_FROM", 1 << 40)
    exact = filter_recording(source, model)
    assert np.abs((fast.drift - exact.drift) / exact.drift_sd)[10:].max() < 1e-9
    assert fast.level == pytest.approx(exact.level, abs=1e-9 * exact.level_sd)
    assert fast.level_sd == pytest.approx(exact.level_sd, rel=1e-9)
    assert fast.mean_corrected == pytest.approx(exact.mean_corrected, abs=1e-9 * exact.level_sd)
    assert fast.consistency.nis == pytest.approx(exact.consistency.nis, rel=1e-10)
    assert fast.consistency.correlations == pytest.approx(exact.consistency.correlations, abs=1e-10)


# ---- noise through its innovations ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["walk", "flicker and walk", "two Gauss-Markov terms"])
def test_drawn_noise_has_the_law_of_its_model(name: str) -> None:
    """The filter row by row gives back the normal numbers: they are the innovations, so the law is exact."""
    rows = 20_000
    model = NoiseModel.of(*MODELS[name])
    space = model.state_space(DT, record=rows * DT)
    normals = np.random.default_rng(8).standard_normal(rows)
    samples, state, covariance = normals.copy(), np.zeros(space.size), space.initial.copy()
    for block in (samples[:5000], samples[5000:]):
        _kernels.kalman_draw(
            space.transition, space.process, space.output, space.noise, *riccati_steps(space, STEPS), state,
            covariance, block,
        )  # fmt: skip
    result = DriftPass(space=space, drift=space.output, readout=np.zeros((0, space.size)), steps=0).run(
        samples
    )
    np.testing.assert_allclose(result["standardized"], normals, rtol=0, atol=1e-9)
    assert np.abs(normals).max() < 6


def test_long_records_with_flicker_are_drawn_through_innovations(monkeypatch: pytest.MonkeyPatch) -> None:
    """Same seed, same samples, whatever the block; the Allan variance is that of the states."""
    model = NoiseModel.of(White(N=1e-5), FLICKER, WALK)
    by_states = al.simulate(model, rate=32.0, duration=4000.0, seed=9).values("gyro")
    monkeypatch.setattr("allanite.filtering.simulation.record.LONG", 1)
    one, other = (al.simulate(model, rate=32.0, duration=4000.0, seed=9).values("gyro") for _ in range(2))
    assert np.array_equal(one, other)
    assert not np.array_equal(one, by_states)
    curve = al.allan_curve(
        Recording.from_rate(one, rate=32.0, unit="rad/s", names="gyro"), taus=[1 / 32, 1.0, 16.0]
    )
    bounds = (0.01, 0.04, 0.16)  # 99.9 % of 6e4, 3e3 and 200 degrees of freedom
    for tau, deviation, bound in zip(curve.tau, curve.deviation[:, 0], bounds, strict=True):
        assert deviation == pytest.approx(model.adev(tau), rel=bound)
    white = NoiseModel.of(White(N=1e-5), WALK)
    assert np.array_equal(
        *(al.simulate(white, rate=32.0, duration=40.0, seed=9).values("gyro") for _ in range(2))
    )
