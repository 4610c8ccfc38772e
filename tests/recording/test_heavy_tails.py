# SPDX-License-Identifier: BSD-3-Clause
"""Noise with heavy tails keeps its samples: they are no spikes, and N holds; a glitch among them is one."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binom

import allanite as al
from allanite.recording.cleaning import clean
from allanite.recording.health.examination import check

N = 20_000
LAWS = {
    "Student of 5": lambda rng, n: rng.standard_t(5, n) / np.sqrt(5 / 3),
    "Student of 6": lambda rng, n: rng.standard_t(6, n) / np.sqrt(6 / 4),
    "Student of 8": lambda rng, n: rng.standard_t(8, n) / np.sqrt(8 / 6),
    "Laplace": lambda rng, n: rng.laplace(size=n) / np.sqrt(2),
    "logistic": lambda rng, n: rng.logistic(size=n) / (np.pi / np.sqrt(3)),
}


def record(y: NDArray[np.float64]) -> al.Recording:
    return al.Recording.from_samples(0.1 + 0.01 * y, rate=100.0, unit="rad/s", names="gx")


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("seed", range(3))
def test_no_sample_of_heavy_tails_is_left_out(law: str, seed: int) -> None:
    found = check(record(LAWS[law](np.random.default_rng([1, seed]), N)))
    assert not [f for f in found if f.excludes]
    assert {f.code for f in found} <= {"heavy_tails", "no_time_stamps"}


@pytest.mark.parametrize("law", LAWS)
def test_a_glitch_among_them_is_left_out_alone(law: str) -> None:
    y = LAWS[law](np.random.default_rng(7), N)
    y[[5000, 12_000]] += [400.0, -300.0]
    (spikes,) = [f for f in check(record(y)) if f.code == "spikes"]
    assert spikes.excludes and spikes.spans[:, 0].tolist() == [5000, 12_000]
    cleaned = clean(record(y), "drop_spikes").values("gx")
    assert np.flatnonzero(np.isnan(cleaned)).tolist() == [5000, 12_000]


def test_glitches_in_gaussian_noise_are_spikes_whatever_they_do_to_the_kurtosis() -> None:
    rng = np.random.default_rng(8)
    y = rng.standard_normal(N)
    places = np.sort(rng.choice(N // 100, 12, replace=False)) * 100 + 50
    y[places] = rng.choice([-1, 1], 12) * rng.uniform(12, 60, 12)
    (spikes,) = [f for f in check(record(y)) if f.code in ("spikes", "heavy_tails")]
    assert (spikes.code, spikes.count) == ("spikes", 12)


@pytest.mark.long
@pytest.mark.parametrize("law", ["Student of 5", "Laplace"])
def test_n_holds(law: str) -> None:
    """No fewer of 60 sets of 95 % than chance allows once in 1000 runs."""
    held = 0
    for seed in range(60):
        study = al.characterize(record(LAWS[law](np.random.default_rng([2, seed]), N)))
        n = study.models["gx"].estimate("N")
        held += n.lower <= 1e-3 <= n.upper
    assert held >= binom.ppf(1e-3, 60, 0.95), held
