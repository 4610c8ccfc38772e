# SPDX-License-Identifier: BSD-3-Clause
"""Contaminated noise: recognized, told from its look-alikes, and an interval of N that holds its tails."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import allanite as al
from allanite.fitting import fit
from allanite.fitting.tails import contamination_of, with_tails
from allanite.noise import NoiseModel
from allanite.noise.allan import allan_curve
from allanite.recording.health.examination import check
from allanite.recording.health.tails import TailLaw, Tails, law_of, tails_of
from noise_records import record

N = 20_000


def mixture(rng: np.random.Generator, share: float, ratio: float, n: int = N) -> np.ndarray:
    return rng.standard_normal(n) * np.where(rng.random(n) < share, ratio, 1.0)


def bursts(rng: np.random.Generator, count: int, length: int) -> np.ndarray:
    y = rng.standard_normal(N)
    for start in rng.integers(0, N - length, count):
        y[start : start + length] = 7.0 * rng.standard_normal(length)
    return y


@pytest.mark.long
def test_two_hundred_mixtures_are_recognized_with_their_share_and_ratio() -> None:
    rng = np.random.default_rng(11)
    off = []
    for _ in range(200):
        share, ratio = rng.uniform(0.015, 0.08), rng.uniform(5.0, 10.0)
        step = rng.choice([0.0, 0.3])
        y = mixture(rng, share, ratio, 9000) + 3.0
        y += np.cumsum(rng.uniform(0.0, 0.02) * rng.standard_normal(len(y)))
        law = tails_of([np.round(y / step) * step if step else y], float(step))
        assert law.law is TailLaw.CONTAMINATED, (share, ratio, step)
        core = math.sqrt(1.0 + step**2 / 12.0)
        off.append(
            (
                (law.share - share) / law.share_sd,
                (law.ratio - ratio / core) / law.ratio_sd,
                math.log(law.core / core) / law.core_sd,
            )
        )
    deviates = np.array(off)
    assert np.all(np.abs(deviates.mean(axis=0)) < 0.35)  # chance: 0.07; the walk and the level add a little
    assert np.all((deviates.std(axis=0) > 0.8) & (deviates.std(axis=0) < 1.25))


LOOK_ALIKES: dict[str, tuple[Callable[[np.random.Generator], np.ndarray], float, set[TailLaw]]] = {
    "Gaussian": (lambda rng: rng.standard_normal(N), 0.0, {TailLaw.GAUSSIAN}),
    "steps of a deviation": (lambda rng: np.round(rng.standard_normal(N)), 1.0, {TailLaw.GAUSSIAN}),
    "steps of three": (lambda rng: 3.0 * np.round(rng.standard_normal(N) / 3.0), 3.0, {TailLaw.UNKNOWN}),
    "Student": (lambda rng: rng.standard_t(4, N), 0.0, {TailLaw.HEAVY}),
    "Laplace": (lambda rng: rng.laplace(size=N), 0.0, {TailLaw.HEAVY}),
    "uniform": (lambda rng: rng.uniform(-1.0, 1.0, N), 0.0, {TailLaw.GAUSSIAN}),
    "clipped": (lambda rng: np.clip(rng.standard_normal(N), -1.5, 1.5), 0.0, {TailLaw.GAUSSIAN}),
    "three long bursts": (lambda rng: bursts(rng, 3, 250), 0.0, {TailLaw.CLUSTERED}),
    "many short bursts": (lambda rng: bursts(rng, 200, 3), 0.0, {TailLaw.CLUSTERED}),
    "spikes": (
        lambda rng: rng.standard_normal(N) + 30.0 * (rng.random(N) < 7e-4),
        0.0,
        {TailLaw.HEAVY, TailLaw.CLUSTERED},
    ),
    "low-pass": (lambda rng: np.convolve(rng.standard_normal(N), np.ones(4) / 2), 0.0, {TailLaw.UNKNOWN}),
    "short": (lambda rng: mixture(rng, 0.03, 7.0, 500), 0.0, {TailLaw.UNKNOWN}),
}


@pytest.mark.parametrize("name", LOOK_ALIKES)
def test_look_alikes_are_no_mixtures(name: str) -> None:
    make, step, laws = LOOK_ALIKES[name]
    for seed in range(8):
        assert tails_of([make(np.random.default_rng([5, seed]))], step).law in laws


def test_the_finding_names_the_mixture_and_nothing_else() -> None:
    y = mixture(np.random.default_rng(2), 0.03, 7.0)
    found = [f for f in check(record(0.02 * y + 1.0)) if f.code != "bias_removed"]
    (finding,) = found
    assert finding.code == "contaminated"
    assert "scatter 6.8 times" in finding.message
    assert "evenly distributed over the record" in finding.message


def interval(model: NoiseModel) -> tuple[float, float]:
    (n,) = [e for e in model.estimates if e.symbol == "N"]
    return n.lower, n.upper


def test_excess_kurtosis_adds_its_share_to_the_variance_of_every_lag() -> None:
    """g/n of the relative variance, the same error at all lags: what the interval of N is widened by."""
    rng = np.random.default_rng(8)
    share, ratio, n, records = 0.05, 6.0, 2048, 1500
    y = rng.standard_normal((records, n)) * np.where(rng.random((records, n)) < share, ratio, 1.0)
    variance = 1.0 + share * (ratio**2 - 1.0)
    excess = 3.0 * (1.0 + share * (ratio**4 - 1.0)) / variance**2 - 3.0
    off = []
    for m in (1, 4, 16):
        means = y.reshape(records, -1, m).mean(axis=2)
        off.append(0.5 * np.mean(np.diff(means, axis=1) ** 2, axis=1) * m / variance - 1.0)
        gaussian = 3.0 * m / n
        expected = excess / n + gaussian
        assert np.var(off[-1]) == pytest.approx(expected, rel=4.5 * math.sqrt(2.0 / records) * 1.5)
    covariance = np.mean(off[0] * off[2])
    assert covariance == pytest.approx(excess / n, rel=0.35)


def test_the_interval_of_n_is_wider_by_that() -> None:
    made = record(mixture(np.random.default_rng(8), 0.03, 7.0, 8000), rate=1.0, unit="rad/s")
    plain, law = fit(allan_curve(made)), law_of(made, "signal")
    narrow, wide = interval(plain), interval(with_tails(plain, law, 8000))
    (n,) = [e.value for e in plain.estimates if e.symbol == "N"]
    assert n is not None
    shift = 1.96 * 0.5 * math.sqrt(law.kurtosis / 8000)
    for before, after in zip(narrow, wide, strict=True):
        assert abs(math.log(after / n)) == pytest.approx(math.hypot(math.log(before / n), shift), rel=1e-3)
    truth = math.sqrt(1.0 + 0.03 * 48.0)
    assert wide[0] < truth < wide[1]
    found = contamination_of(plain, law, 1.0, 1.0)
    assert found is not None and found.N_without.lower < 1.0 < found.N_without.upper


def test_a_study_holds_n_with_and_without() -> None:
    study = al.characterize(record(mixture(np.random.default_rng(4), 0.03, 7.0), rate=100.0, unit="rad/s"))
    found = study["signal"].contamination
    assert found is not None and found.N.unit == "rad/s/√Hz"
    assert found.N_without.lower < 0.1 < found.N_without.upper
    assert found.N.lower < 0.1 * math.sqrt(1 + 0.03 * 48) < found.N.upper
    assert al.Study.from_json(study.to_json()).findings


def test_tails_of_a_normal_law_change_no_model() -> None:
    made = record(np.random.default_rng(1).standard_normal(4000))
    model = fit(allan_curve(made))
    assert with_tails(model, Tails(law=TailLaw.GAUSSIAN), 4000) is model
    assert contamination_of(model, Tails(law=TailLaw.HEAVY, kurtosis=2.0), 1.0, 0.01) is None
