# SPDX-License-Identifier: BSD-3-Clause
"""The scenarios of the coverage run: truth, rate and length of each. SI units of a rate gyro."""

from __future__ import annotations

import math
from dataclasses import dataclass

from allanite.fitting.advice import predicted_sd
from allanite.noise import SIGMA_PER_B, Flicker, GaussMarkov, NoiseModel, Quantisation, RandomWalk, White

__all__ = ["SCENARIOS", "SEED", "Scenario"]

_DEG = math.pi / 180
#: The seed paper's sensor: N 0.0122 deg/sqrt(s), B 0.0027 deg/s, T_b 238.1 s, K 6.8314e-5 deg/s^1.5.
SEED = NoiseModel.of(
    White(N=0.0122 * _DEG),
    GaussMarkov.from_sigma(SIGMA_PER_B * 0.0027 * _DEG, 238.1),
    RandomWalk(K=6.8314e-5 * _DEG),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One truth, simulated again and again."""

    name: str
    model: NoiseModel
    rate: float
    duration: float

    @property
    def n_samples(self) -> int:
        return round(self.rate * self.duration)

    @property
    def family(self) -> str:
        return "gauss-markov" if self.model.term("gauss_markov") else "flicker"

    def truth(self) -> dict[str, float]:
        """Every parameter of the candidate family; 0 where the term is absent."""
        values = {"Q": 0.0, "N": 0.0, "K": 0.0, "R": 0.0}
        values |= {"B": 0.0} if self.family == "flicker" else {}
        for term in self.model.terms:
            if isinstance(term, GaussMarkov):
                values |= {"B_equiv": term.B_equiv, "T": term.T}
            else:
                values[term.symbols[0]] = getattr(term, term.symbols[0])
        return values

    def bounds(self) -> dict[str, float]:
        """Relative standard deviation that this record allows at best, by parameter."""
        sd = predicted_sd(self.model, n_samples=self.n_samples, dt=1 / self.rate)
        return {"B_equiv" if s == "sigma" else s: v for s, v in sd.items()}


_HOUR = 3600.0
SCENARIOS = (
    Scenario(name="white", model=NoiseModel.of(White(N=1e-4)), rate=100.0, duration=1 * _HOUR),
    Scenario(
        name="white + walk",
        model=NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-5)),
        rate=100.0,
        duration=1 * _HOUR,
    ),
    Scenario(
        name="white + flicker",
        model=NoiseModel.of(White(N=1e-4), Flicker(B=3e-5)),
        rate=32.0,
        duration=3 * _HOUR,
    ),
    Scenario(
        name="white + flicker + walk, short",
        model=NoiseModel.of(White(N=1e-4), Flicker(B=3e-5), RandomWalk(K=1e-6)),
        rate=32.0,
        duration=1 * _HOUR,
    ),
    Scenario(
        name="white + flicker + walk, long",
        model=NoiseModel.of(White(N=1e-4), Flicker(B=3e-5), RandomWalk(K=1e-6)),
        rate=8.0,
        duration=24 * _HOUR,
    ),
    Scenario(
        name="white + Gauss-Markov",
        model=NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(4e-5, 100.0)),
        rate=8.0,
        duration=12 * _HOUR,
    ),
    Scenario(name="seed's sensor, 24 h", model=SEED, rate=32.0, duration=24 * _HOUR),
    Scenario(name="seed's sensor, 7 days", model=SEED, rate=32.0, duration=168 * _HOUR),
    Scenario(
        name="Q + N + K",
        model=NoiseModel.of(Quantisation(Q=2e-5, dt=0.01), White(N=1e-4), RandomWalk(K=1e-5)),
        rate=100.0,
        duration=1 * _HOUR,
    ),
)
