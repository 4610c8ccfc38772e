# SPDX-License-Identifier: BSD-3-Clause
"""A set holds the value of its own model, also where fewer terms than the family has are reported."""

from collections.abc import Iterator

import numpy as np
import pytest
from verification.simulators import gauss_markov

import allanite as al
from allanite.fitting.joined_sets import joined_sets
from allanite.noise import NoiseModel

AMPLITUDES = {"White": "N", "Flicker": "B", "RandomWalk": "K", "Quantisation": "Q", "Ramp": "R"}
#: N, sigma, T [s], K, and B of records of flicker
SENSORS = [
    (2e-4, 1e-4, 60.0, 2e-5),
    (2e-4, 0.0, 100.0, 2e-5),
    (2e-4, 2e-4, 5.0, 0.0),
    (2e-4, 1e-4, 150.0, 0.0),
    (1e-4, 3e-4, 20.0, 4e-5),
    (2e-4, 3e-4, 0.3, 3e-5),
]
RATE = 20.0


def record(seed: int, sensor: tuple[float, float, float, float], duration: float) -> al.Recording:
    rng = np.random.default_rng([20261128, seed])
    n = int(duration * RATE)
    N, sigma, T, K = sensor
    y = N * np.sqrt(RATE) * rng.standard_normal(n) + K / np.sqrt(RATE) * np.cumsum(rng.standard_normal(n))
    if sigma:
        y += gauss_markov(rng, n, sigma, T * RATE)
    return al.Recording.from_rate(y, rate=RATE, unit="rad/s", names="x")


def named(model: NoiseModel) -> Iterator[tuple[str, float]]:
    """Symbols of the estimates, and the values of the terms."""
    for term in model.terms:
        if type(term).__name__ in AMPLITUDES:
            symbol = AMPLITUDES[type(term).__name__]
            yield symbol, getattr(term, symbol)
    markov = sorted((t for t in model.terms if isinstance(t, al.GaussMarkov)), key=lambda t: t.T)
    symbols = [e.symbol for e in model.estimates if e.symbol.startswith("sigma")]
    if len(markov) < len(symbols):
        symbols = [s for s in symbols if model.estimate(s).supported]
    for symbol, term in zip(symbols, markov, strict=True):
        yield symbol, term.sigma
        yield symbol.replace("sigma", "T"), term.T


def fitted(recording: al.Recording, method: str) -> NoiseModel:
    if method == "moments":
        return al.fit(al.allan_curve(recording))
    return al.fit(recording, method=method)


@pytest.mark.parametrize(
    "method", ["moments", *(pytest.param(m, marks=pytest.mark.long) for m in ("likelihood", "spectral"))]
)
@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("duration", [300.0, pytest.param(900.0, marks=pytest.mark.long)])
def test_a_set_holds_the_value_of_its_model(
    method: str, sensor: tuple[float, float, float, float], duration: float
) -> None:
    for seed in range(3):
        for model in fitted(record(seed, sensor, duration), method).families:
            for symbol, value in named(model):
                estimate = model.estimate(symbol)
                assert estimate is not None, symbol
                assert estimate.lower <= value * (1 + 1e-9), estimate
                assert value * (1 - 1e-9) <= estimate.upper, estimate
                if estimate.supported:
                    assert estimate.value == pytest.approx(value, rel=1e-9)


# -- the mechanism ----------------------------------------------------------------------------------------


def test_a_set_that_leaves_out_its_value_is_joined_with_that_of_the_model() -> None:
    sets = {
        "held": (1.0, 3.0),
        "above": (1.0, 3.0),
        "below": (1.0, 3.0),
        "limit": (0.0, 2.0),
        "absent": (1.0, 2.0),
    }
    values = {"held": 2.0, "above": 5.0, "below": 0.5, "limit": 2.5}
    own = {"above": (2.0, 7.0), "below": (0.0, 0.9), "limit": (0.0, 4.0)}
    assert joined_sets(sets, values, own.__getitem__) == {
        "held": (1.0, 3.0),
        "above": (1.0, 7.0),
        "below": (0.5, 3.0),  # supported, and stays so
        "limit": (0.0, 4.0),
        "absent": (1.0, 2.0),
    }
