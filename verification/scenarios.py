# SPDX-License-Identifier: BSD-3-Clause
"""The scenarios of the coverage run: truth, rate and length of each. SI units of a rate gyro."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import allanite as al
from allanite.noise import (
    SIGMA_PER_B,
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    RandomWalk,
    Sinusoid,
    TermType,
    White,
)
from allanite.noise.spectrum.sampled import sampled_psd
from allanite.recording.records import Recording

__all__ = ["HARDER", "SCENARIOS", "SEED", "Scenario", "bound"]

_DEG = math.pi / 180
_OF_SLOW = 1 / 6  # of the records where one takes some ten seconds: a week, and gaps
_LONG = 10_000_000  # samples
#: The seed paper's sensor: N 0.0122 deg/sqrt(s), B 0.0027 deg/s, T_b 238.1 s, K 6.8314e-5 deg/s^1.5.
SEED = NoiseModel.of(
    White(N=0.0122 * _DEG),
    GaussMarkov.from_sigma(SIGMA_PER_B * 0.0027 * _DEG, 238.1),
    RandomWalk(K=6.8314e-5 * _DEG),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One truth, simulated again and again.

    Attributes
    ----------
    missing : float
        Part of the samples that are missing, half of them one by one, half in outages of five minutes or so.
    step : float
        Resolution of the angle, from whose increments the samples come: makes the quantisation of the model.
    terms : str
        Letters that the fit is given; none: what it finds.
    """

    name: str
    model: NoiseModel
    rate: float
    duration: float
    missing: float = 0.0
    step: float = 0.0
    terms: str = ""

    @property
    def n_samples(self) -> int:
        return round(self.rate * self.duration)

    @property
    def family(self) -> str:
        return "gauss-markov" if self.model.term("gauss_markov") else "flicker"

    def count(self, records: int) -> int:
        """Records of this scenario where a quick one has so many."""
        slow = self.n_samples > _LONG or self.missing
        return max(round(records * (_OF_SLOW if slow else 1.0)), 2)

    def truth(self) -> dict[str, float]:
        """Every parameter of the candidate family; 0 where the term is absent."""
        values = {"Q": 0.0, "N": 0.0, "K": 0.0, "R": 0.0}
        values |= {"B": 0.0} if self.family == "flicker" else {}
        markov = sorted((t for t in self.model.terms if isinstance(t, GaussMarkov)), key=lambda t: t.T)
        for rank, slow in enumerate(markov):
            end = f"_{rank + 1}" if rank else ""
            values |= {f"B_equiv{end}": slow.B_equiv, f"T{end}": slow.T}
        for term in self.model.terms:
            if not isinstance(term, GaussMarkov | Sinusoid):
                values[term.symbols[0]] = getattr(term, term.symbols[0])
        return values

    def bounds(self) -> dict[str, float]:
        """Relative standard deviation that this record allows at best, by parameter."""
        return bound(self.model, 1 / self.rate, self.n_samples * (1 - self.missing))

    def shows(self, symbol: str) -> bool:
        """Whether the parameter is there, and larger than three of its bounds."""
        return self.truth()[symbol] != 0 and 3 * self.bounds().get(symbol, math.inf) <= 1

    def record(self, seed: int) -> Recording:
        """One record."""
        noise = NoiseModel.of(
            *(t for t in self.model.terms if not (self.step and isinstance(t, Quantisation)))
        )
        record = al.simulate(noise, rate=self.rate, duration=self.duration, seed=seed)
        if not self.step and not self.missing:
            return record
        y = record.values(record.names[0]).copy()
        if self.step:
            angle = np.round(np.cumsum(y) / self.rate / self.step) * self.step
            y = np.diff(angle, prepend=0.0) * self.rate
        y[_missing(len(y), self.missing, round(300 * self.rate), np.random.default_rng([seed, 1]))] = np.nan
        return Recording.from_rate(y, rate=self.rate, unit="rad/s")


def _missing(n: int, share: float, length: int, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Half of the share one by one, half in outages of `length` in the mean."""
    lost = rng.random(n) < share / 2
    while lost.mean() < share:
        start, span = rng.integers(n), rng.exponential(length)
        lost[start : start + round(span)] = True
    return lost


def bound(model: NoiseModel, dt: float, n: float) -> dict[str, float]:
    """Cramer-Rao bound of the logarithm of each parameter of a record (Whittle: sum over its Fourier frequencies)."""
    terms = [t for t in model.terms if not isinstance(t, Sinusoid)]
    markov = sorted((t for t in terms if isinstance(t, GaussMarkov)), key=lambda t: t.T)
    duration = n * dt
    # every low frequency by itself, the many high ones by an integral
    f = np.arange(1, 4097) / duration
    if n > 8192:
        high = np.geomspace(4096.5 / duration, 0.5 / dt, 4000)
        weight = np.concatenate([np.ones(len(f)), np.gradient(high) * duration])
        f = np.concatenate([f, high])
    else:
        f, weight = f[f <= 0.5 / dt], np.ones(int(np.sum(f <= 0.5 / dt)))

    def density(changed: TermType, by: TermType) -> NDArray[np.float64]:
        return sampled_psd(NoiseModel.of(*(by if t is changed else t for t in terms)), f, dt, "mean")

    names, slopes, step = [], [], 1e-4
    for term in terms:
        end = f"_{markov.index(term) + 1}" if isinstance(term, GaussMarkov) and markov.index(term) else ""
        for name, moved in _moves(term):
            up, down = (density(term, moved(math.exp(s))) for s in (step, -step))
            names.append(name + end)
            slopes.append(np.log(up / down) / (2 * step))
    J = np.array(slopes)
    return dict(zip(names, np.sqrt(np.diag(np.linalg.inv((J * weight) @ J.T))).tolist(), strict=True))


def _moves(term: TermType) -> list[tuple[str, Callable[[float], TermType]]]:
    """Each parameter of a term, and the term with that parameter multiplied."""
    if isinstance(term, GaussMarkov):
        sigma, T = term.sigma, term.T
        return [
            ("B_equiv", lambda by: GaussMarkov.from_sigma(sigma * by, T)),
            ("T", lambda by: GaussMarkov.from_sigma(sigma, T * by)),
        ]
    symbol = term.symbols[0]
    return [(symbol, lambda by: replace(term, **{symbol: getattr(term, symbol) * by}))]


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
_MIXED = NoiseModel.of(White(N=1e-4), Flicker(B=3e-5), RandomWalk(K=1e-6))
_STEP = 1.3e-5  # noise of 0.77 steps per sample: errors of rounding are white to 1e-5
#: What records are like besides.
HARDER = (
    Scenario(name="10 % missing", model=_MIXED, rate=8.0, duration=24 * _HOUR, missing=0.1),
    Scenario(name="40 % missing", model=_MIXED, rate=8.0, duration=24 * _HOUR, missing=0.4),
    Scenario(
        name="two Gauss-Markov terms",
        model=NoiseModel.of(
            White(N=1e-4), GaussMarkov.from_sigma(1e-4, 10.0), GaussMarkov.from_sigma(5e-5, 1000.0)
        ),
        rate=8.0,
        duration=24 * _HOUR,
        terms="QNGGKR",
    ),
    Scenario(
        name="angles rounded",
        model=NoiseModel.of(
            Quantisation(Q=_STEP / math.sqrt(12), dt=0.01), White(N=1e-4), RandomWalk(K=1e-5)
        ),
        rate=100.0,
        duration=1 * _HOUR,
        step=_STEP,
    ),
    Scenario(
        name="a spectral line",
        model=NoiseModel.of(
            White(N=1e-4), GaussMarkov.from_sigma(4e-5, 100.0), Sinusoid(amplitude=3e-5, frequency=0.71)
        ),
        rate=8.0,
        duration=12 * _HOUR,
    ),
)
