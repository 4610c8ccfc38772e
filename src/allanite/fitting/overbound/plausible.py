# SPDX-License-Identifier: BSD-3-Clause
"""Noise that a record does not contradict: curves of sums of terms, drawn from the likelihood of the measured curve.

The likelihood is that of the moment fit (`allanite.fitting.objective`): cube roots of the variances, with the
covariance that each drawn model itself gives the curve. Beforehand every amplitude is as likely as any other that is
not negative, and so is the logarithm of a correlation time. For one amplitude alone an upper end by these weights
covers a little more often than it states; what it does for whole curves is measured (`python -m verification
overbound`).

Once all terms of a family take part, supported or not, because those that the record cannot show are what matters at
long averaging times. And once those of the fit alone: a term that may only add, and is not there, takes a little from
its neighbours in every draw, so that where these rule the curve is drawn too low (quantisation from white noise).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite._kernels import curve_levels
from allanite.fitting.design import LINEAR, TIME_POWER
from allanite.fitting.overbound.ensemble import walk
from allanite.lazy_dataclasses import dataclass
from allanite.noise import GaussMarkov, NoiseModel, TermType
from allanite.noise.allan.covariance import LagPairs, lag_pairs
from allanite.noise.allan.curve import AllanCurve

__all__ = ["plausible_variances"]

Array = NDArray[np.float64]
Key = tuple[str, float]

_WALKERS = 96
_STEPS = 260
_SETTLE = 60
#: Neighbouring steps of a walker are nearly the same.
_EVERY = 4
#: Correlation times per octave of the table that columns are taken from, and of that of covariances, as in the fit.
_TABLE, _COVARIANCES = 8, 2
#: Shortest correlation time [samples], as for the fit, and longest in records.
_FORGETS, _LASTS = 16.0, 0.5
#: A term that the fit does not hold begins as this share of the curve where it is largest.
_ABSENT = 0.02
_EDF_MIN = 0.5


def plausible_variances(
    curve: AllanCurve,
    used: NDArray[np.bool_],
    model: NoiseModel,
    m: Array,
    *,
    fitted_terms_only: bool = False,
    discrepancy: float = 0.0,
    rng: np.random.Generator,
) -> Array:
    """Allan variances of models that the curve does not contradict.

    Parameters
    ----------
    curve : AllanCurve
        Of one channel, oadev.
    used : ndarray of bool, shape (n_lags,)
        Lags that count.
    model : NoiseModel
        What was fitted: where the walk begins, and which family it takes (flicker, or as many Gauss-Markov terms).
    m : ndarray, shape (n_times,)
        Averaging times [samples] at which the variances are wanted.
    fitted_terms_only : bool
        Without the terms of the family that the model does not hold.
    discrepancy : float
        Relative error of the model at every lag that the fit allowed for.

    Returns
    -------
    ndarray, shape (n_draws, n_times) [SI^2]
    """
    scale = float(curve.variance[used, 0][0])
    starts = curve.starts()
    part = None if starts is None else [starts[i] for i in np.flatnonzero(used)]
    lags = curve.lags[used]
    sums = _TermSums(
        variance=curve.variance[used, 0] / scale,
        lags=lags,
        n_samples=curve.n_samples,
        sampling=curve.channels[0].sampling,
        pairs=lag_pairs(lags, curve.n_samples, part),
        symbols=_symbols(model, fitted_terms_only),
        discrepancy=discrepancy,
    )
    begin = _start(sums, model, curve.dt, scale, rng)
    drawn = walk(sums.log_density, begin, steps=_STEPS, settle=_SETTLE, every=_EVERY, rng=rng)
    return sums.variances(drawn, m) * scale


def _symbols(model: NoiseModel, fitted_terms_only: bool) -> tuple[str, ...]:
    markov = sum(isinstance(t, GaussMarkov) for t in model.terms)
    every = ("Q", "N", *(["G"] * markov or ["B"]), "K", "R")
    held = {"G" if isinstance(t, GaussMarkov) else t.symbols[0] for t in model.terms}
    return tuple(s for s in every if s in held) if fitted_terms_only and held & set(every) else every


def _start(sums: _TermSums, model: NoiseModel, dt: float, scale: float, rng: np.random.Generator) -> Array:
    """Walkers around the fitted model, those of absent terms spread below the curve."""
    times = [t.T / dt for t in model.terms if isinstance(t, GaussMarkov)]
    amplitudes = _amplitudes(model)
    markov = iter([t.sigma for t in model.terms if isinstance(t, GaussMarkov)])
    middle, spread = [], []
    for symbol in sums.symbols:
        amplitude = next(markov) if symbol == "G" else amplitudes.get(symbol, 0.0)
        fitted = (amplitude / dt ** TIME_POWER[symbol]) ** 2 / scale
        if fitted > 0:
            middle.append(np.log(fitted))
            spread.append(0.05)
        else:
            column = sums.column(symbol, sums.middle_time)
            middle.append(np.log(_ABSENT * float(np.min(sums.variance / column))))
            spread.append(1.0)
    shortest, longest = sums.times
    middle += [np.log(min(max(t, 1.2 * shortest), longest / 1.2)) for t in times]
    spread += [0.1] * len(times)
    return np.array(middle) + np.array(spread) * rng.standard_normal((_WALKERS, len(middle)))


def _amplitudes(model: NoiseModel) -> dict[str, float]:
    """Coefficients of the power-law terms; two of a kind add as variances."""
    amplitudes: dict[str, float] = {}
    for term in model.terms:
        if not isinstance(term, GaussMarkov) and term.symbols[0] in LINEAR:
            symbol = term.symbols[0]
            amplitudes[symbol] = float(np.hypot(amplitudes.get(symbol, 0.0), getattr(term, symbol)))
    return amplitudes


@dataclass(slots=True)
class _TermSums:
    """Sums of terms in units of the sample interval, many at a time.

    A position is the logarithms of the variance coefficients, in the order of `symbols`, then those of the correlation
    times [samples], one for each G.
    """

    variance: Array
    lags: NDArray[np.int64]
    n_samples: int
    sampling: str
    pairs: LagPairs
    symbols: tuple[str, ...]
    discrepancy: float
    _columns: dict[Key, Array] = field(default_factory=dict)
    _cross: dict[Key, Array] = field(default_factory=dict)
    _parts: dict[tuple[Key, Key], Array] = field(default_factory=dict)
    _tables: dict[tuple[float, ...], int] = field(default_factory=dict)
    _parts_of_tables: Array = field(default_factory=lambda: np.empty(0))
    _random: NDArray[np.bool_] = field(init=False)
    _term_pairs: tuple[NDArray[np.int64], NDArray[np.int64]] = field(init=False)

    def __post_init__(self) -> None:
        self._random = np.array([s != "R" for s in self.symbols])
        self._term_pairs = np.triu_indices(int(self._random.sum()))

    @property
    def times(self) -> tuple[float, float]:
        """Shortest and longest correlation time considered, as in the fit."""
        return max(_FORGETS, 2.0 * float(self.lags[0])), self.n_samples * _LASTS

    @property
    def middle_time(self) -> float:
        return float(np.sqrt(self.times[0] * self.times[1]))

    def log_density(self, positions: Array) -> Array:
        """Of the curve given the sums, times the prior; shape (n,)."""
        k = len(self.symbols)
        out = np.full(len(positions), -np.inf)
        shortest, longest = np.log(self.times)
        times = positions[:, k:]
        inside = np.all((times > shortest) & (times < longest) & (np.abs(times) < 700), axis=1)
        inside &= np.all(np.abs(positions[:, :k]) < 300, axis=1)
        if not inside.any():
            return out
        c = np.exp(positions[inside, :k])
        with np.errstate(over="ignore", invalid="ignore"):  # far out: no density there
            level = self._minus_twice(c, times[inside])
        out[inside] = (
            -level / 2 + positions[inside, :k].sum(axis=1) / 2
        )  # flat in the root of each coefficient
        return out

    def variances(self, positions: Array, m: Array) -> Array:
        """Allan variance of each position at averaging times m, shape (n, n_times)."""
        k = len(self.symbols)
        return self._mean(np.exp(positions[:, :k]), positions[:, k:], np.asarray(m, dtype=np.float64))

    # -- means ---------------------------------------------------------------------------------------------

    def column(self, symbol: str, time: float, m: Array | None = None) -> Array:
        """Allan variance of a unit term."""
        if m is None:
            key = (symbol, time if symbol == "G" else 0.0)
            if key not in self._columns:
                self._columns[key] = self._unit(symbol, time).avar_sampled(
                    self.lags.astype(np.float64), 1.0, self.sampling
                )
            return self._columns[key]
        return self._unit(symbol, time).avar_sampled(m, 1.0, self.sampling)

    def _unit(self, symbol: str, time: float) -> TermType:
        return GaussMarkov.from_sigma(1.0, time) if symbol == "G" else LINEAR[symbol]

    def _mean(self, c: Array, times: Array, m: Array | None = None) -> Array:
        markov = iter(times.T)
        total: Array | float = 0.0
        for i, symbol in enumerate(self.symbols):
            if symbol == "G":
                total = total + c[:, [i]] * self._markov_columns(next(markov), m)
            else:
                total = total + c[:, [i]] * self.column(symbol, 0.0, m)
        return np.asarray(total)

    def _markov_columns(self, log_times: Array, m: Array | None) -> Array:
        """Unit Gauss-Markov columns at many correlation times, out of a table, shape (n, n_lags)."""
        place = log_times / np.log(2) * _TABLE
        first = np.floor(place).astype(np.int64)
        share = (place - first)[:, None]
        table = {
            int(j): np.log(self.column("G", 2.0 ** (j / _TABLE), m)) for j in np.unique([first, first + 1])
        }
        low = np.stack([table[int(j)] for j in first])
        high = np.stack([table[int(j) + 1] for j in first])
        return np.asarray(np.exp((1 - share) * low + share * high))

    # -- covariances ---------------------------------------------------------------------------------------

    def _minus_twice(self, c: Array, log_times: Array) -> Array:
        """Minus twice the log-likelihood, with the weights that each model itself has."""
        near = np.round(log_times / np.log(2) * _COVARIANCES).tolist()
        tables = np.array([self._table(tuple(place)) for place in near])
        return curve_levels(
            self.variance,
            self._mean(c, log_times),
            self._weights(c),
            self._parts_of_tables,
            tables,
            self.discrepancy,
            _EDF_MIN,
        )

    def _weights(self, c: Array) -> Array:
        """Of the parts of a table in the covariance of each model, shape (n, n_parts).

        A ramp spreads nothing by itself, but multiplies the noise: large, it makes the long lags certain.
        """
        x, ramp = c[:, self._random], c[:, ~self._random].sum(axis=1, keepdims=True)
        first, second = self._term_pairs
        both = x[:, first] * x[:, second] * np.where(first == second, 1.0, 2.0)
        return np.ascontiguousarray(np.concatenate([both, ramp * x], axis=1))

    def _table(self, place: tuple[float, ...]) -> int:
        """Number of the table of parts at correlation times, which stand as half octaves."""
        if place not in self._tables:
            self._tables[place] = len(self._tables)
            parts = self._parts_at([2.0 ** (x / _COVARIANCES) for x in place])[None]
            held = self._parts_of_tables
            self._parts_of_tables = np.concatenate([held, parts]) if held.size else parts
        return self._tables[place]

    def _parts_at(self, times: Sequence[float]) -> Array:
        """Unit covariances of all pairs of terms, then those of each with a ramp, shape (n_parts, n_lags, n_lags)."""
        markov = iter(times)
        keys = [(s, next(markov) if s == "G" else 0.0) for s in self.symbols if s != "R"]
        parts = [self._part(keys[i], keys[j]) for i, j in zip(*self._term_pairs, strict=True)]
        m = self.lags.astype(np.float64)
        ramps = [2 * np.outer(m, m) * self.pairs.sum(self._r12(key)) for key in keys]
        return np.stack([*parts, *ramps])

    def _part(self, a: Key, b: Key) -> Array:
        if (a, b) not in self._parts:
            self._parts[a, b] = self._parts[b, a] = 2 * self.pairs.sum(self._r12(a) * self._r12(b))
        return self._parts[a, b]

    def _r12(self, key: Key) -> Array:
        if key not in self._cross:
            self._cross[key] = self.pairs.cross(self._unit(*key), self.sampling)
        return self._cross[key]
