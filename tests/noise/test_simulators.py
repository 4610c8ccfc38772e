# SPDX-License-Identifier: BSD-3-Clause
"""The second simulators, against closed forms and against `allanite.simulate`: the same Allan variances."""

import numpy as np
import pytest
from scipy.integrate import quad
from verification.simulators import flicker, gauss_markov, power_law, random_walk, telegraph

import allanite as al
from allanite.noise.allan.covariance import edf

N = 8192
LAGS = np.array([1, 2, 4, 8, 32, 128, 512])
RECORDS = 40
#: Standard deviations of a mean that one of 7 lags of 8 laws exceeds by chance once in 1000 runs.
FAR = 4.3


def allan_variances(y):
    phase = np.concatenate([[0.0], np.cumsum(y - y[0])])
    return [np.mean((phase[2 * m :] - 2 * phase[m:-m] + phase[: -2 * m]) ** 2) / (2 * m**2) for m in LAGS]


def mean_over(draw):
    return np.mean(
        [allan_variances(draw(np.random.default_rng([952, i]), N)) for i in range(RECORDS)], axis=0
    )


MODELS = {
    "flicker": (al.Flicker(B=1.0), lambda rng, n: flicker(rng, n, 1.0)),
    "random walk": (al.RandomWalk(K=1.0), lambda rng, n: random_walk(rng, n, 1.0)),
    "Gauss-Markov of 2": (al.GaussMarkov.from_sigma(1.0, 2.0), lambda rng, n: gauss_markov(rng, n, 1.0, 2.0)),
    "Gauss-Markov of 0.3": (
        al.GaussMarkov.from_sigma(1.0, 0.3),
        lambda rng, n: gauss_markov(rng, n, 1.0, 0.3),
    ),
    "Gauss-Markov of 60": (
        al.GaussMarkov.from_sigma(1.0, 60.0),
        lambda rng, n: gauss_markov(rng, n, 1.0, 60.0),
    ),
}


@pytest.mark.parametrize("name", MODELS)
def test_mean_allan_variance_is_that_of_the_term(name):
    term, draw = MODELS[name]
    model = al.NoiseModel(terms=(term,))
    spread = np.sqrt(2 / edf(model, LAGS, N, 1.0, "mean") / RECORDS)
    assert np.all(np.abs(mean_over(draw) / term.avar(LAGS.astype(float)) - 1) < FAR * spread)


@pytest.mark.parametrize("slope", [0.5, 0.7, 1.3, 1.5])
def test_a_power_law_has_the_allan_variance_of_its_density(slope):
    """4 times the integral of S sin(pi f tau)^4 / (pi f tau)^2; the records themselves tell the error of the mean."""

    def shape(u):
        return np.sin(u) ** 4 * u ** (-2 - slope)

    end = 200 * np.pi
    rest = 0.375 * end ** (-1 - slope) / (1 + slope)
    unit = 4 * np.pi ** (slope - 1) * (quad(shape, 0, end, limit=2000)[0] + rest)
    drawn = np.array(
        [allan_variances(power_law(np.random.default_rng([953, i]), N, 1.0, slope)) for i in range(RECORDS)]
    )
    ratio = drawn / (unit * LAGS ** (slope - 1.0))
    assert np.all(np.abs(ratio.mean(axis=0) - 1) < FAR * ratio.std(axis=0, ddof=1) / np.sqrt(RECORDS))


def test_a_telegraph_has_the_curve_of_a_gauss_markov_term():
    drawn = np.array(
        [allan_variances(telegraph(np.random.default_rng([954, i]), N, 2.0, 60.0)) for i in range(RECORDS)]
    )
    ratio = drawn / al.GaussMarkov.from_sigma(1.0, 30.0).avar(LAGS.astype(float))
    assert np.all(np.abs(ratio.mean(axis=0) - 1) < FAR * ratio.std(axis=0, ddof=1) / np.sqrt(RECORDS))


def test_simulated_flicker_has_its_floor_at_512_samples():
    """Two witnesses of one number: the program's sum of Gauss-Markov states, and the circle."""
    model = al.NoiseModel(terms=(al.Flicker(B=1.0),))
    theirs = [
        allan_variances(al.simulate(model, duration=float(N), rate=1.0, seed=i).values("gyro"))
        for i in range(RECORDS)
    ]
    spread = np.sqrt(2 / edf(model, LAGS, N, 1.0, "mean") / RECORDS)
    floor = 2 * np.log(2) / np.pi
    assert np.all(np.abs(np.mean(theirs, axis=0) / floor - 1) < FAR * spread)
