# SPDX-License-Identifier: BSD-3-Clause
"""The likelihood of a sum of terms, and its maximum.

Ordinate i is its mean mu_i times a chi-square variable over its degrees of freedom nu_i; so minus twice the logarithm
of the likelihood is, up to a constant,

    L(p) = sum of nu_i [ln mu_i + x_i/mu_i],    mu = sum over terms of c_t a_t(T_t),   c_t >= 0            (1)

[1], with the exact means a_t of the ordinates for each term, window and folding included [2]. A ramp of slope R is
no noise: it takes its part off the contrasts, x_k = (c_k - R d_k)^2, with the R that fits best.

Bridged samples give the densities errors e in common, whose parts in ordinate i are r_i [eq. (3) of spectrum.holes].
They are numbers more, of mean zero and variance one, at which L is least:

    L(p) = min over e of sum of nu_i [ln mu_i + r_i e + x_i exp(-r_i e)/mu_i] + e'e.                       (2)

The minimum is found by Fisher scoring: each step is a non-negative least-squares problem in the coefficients, with the
correlation times beside them.

References
----------
.. [1] P. Whittle, "Estimation and information in stationary time series", Arkiv for Matematik 2 (1953) 423.
.. [2] A. Sykulski et al., "The debiased Whittle likelihood", Biometrika 106 (2019) 251.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FitError
from allanite.fitting.nonnegative import nonnegative
from allanite.fitting.spectral.ordinates import Ordinates
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import chi_square_tails, normal_quantiles

__all__ = ["WhittleProblem", "WhittleSolution"]

Array = NDArray[np.float64]

_STEPS = 60
_SETTLED = 1e-6  # a gain of L that no longer matters: 0.001 standard deviations
_SCAN = 3.0  # ratio of the correlation times that are tried first
_LEAP = 0.7  # largest step in ln T, and in the logarithm of an ordinate
_CLOSE = 1e-7  # of a common error, whose deviation is one


@dataclass(frozen=True, slots=True, kw_only=True)
class WhittleSolution:
    """A minimum of L.

    Attributes
    ----------
    c : ndarray, shape (n_letters,)
        Variance coefficients, not negative; 0 in the place of a ramp.
    times : tuple of float
        Correlation times of the Gauss-Markov terms, in their order [s].
    ramp : float
        Slope, with its sign.
    value : float
        L.
    mean : ndarray, shape (n,)
        mu.
    """

    c: Array
    times: tuple[float, ...]
    ramp: float
    value: float
    mean: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class WhittleProblem:
    """Ordinates seen through a sum of terms: `letters` of Q, N, B, K, R and any number of G."""

    data: Ordinates
    letters: tuple[str, ...]

    @property
    def markov(self) -> tuple[int, ...]:
        """Places of the Gauss-Markov terms among the letters."""
        return tuple(i for i, s in enumerate(self.letters) if s == "G")

    def best(
        self,
        *,
        fixed: Mapping[int, float] | None = None,
        times: Mapping[int, float] | None = None,
        ramp: float | None = None,
        near: WhittleSolution | None = None,
    ) -> WhittleSolution:
        """The minimum with some coefficients, correlation times (by place) or the slope held.

        Raises
        ------
        FitError
            No sum of the terms that are left has a density at all ordinates.
        """
        fixed, times = dict(fixed or {}), dict(times or {})
        if near is not None:
            start = near.c.copy()
            start[list(fixed)] = list(fixed.values())
            guess = tuple(times.get(g, t) for g, t in zip(self.markov, near.times, strict=True))
            return self._descend(start, guess, fixed, times, ramp, near.ramp)
        open_ = [g for g in self.markov if g not in times and fixed.get(g) != 0.0]
        minima: list[WhittleSolution] = []
        for guess in self._guesses(open_, times):
            begin = self._start(guess, fixed)
            if begin is not None:
                minima.append(self._descend(begin, guess, fixed, times, ramp, 0.0))
        if not minima:
            raise FitError("no sum of these terms explains the spectrum; add white noise (N)")
        return min(minima, key=lambda s: s.value)

    def _guesses(self, open_: Sequence[int], times: Mapping[int, float]) -> list[tuple[float, ...]]:
        """Correlation times to begin with: all ascending choices from a coarse grid for those that are open."""
        import itertools

        low, high = self.data.times
        count = max(math.ceil(math.log(high / low) / math.log(_SCAN * max(len(open_), 1))), 1) + 1
        grid = np.geomspace(low, high, count + 2)[1:-1].tolist()
        middle = math.sqrt(low * high)
        choices = []
        for chosen in itertools.combinations(grid, len(open_)):
            given = dict(zip(open_, chosen, strict=True))
            choices.append(tuple(times.get(g, given.get(g, middle)) for g in self.markov))
        return choices

    def columns(self, times: Sequence[float]) -> Array:
        """Means of the unit processes, shape (n, n_letters); a ramp has none."""
        of = dict(zip(self.markov, times, strict=True))
        n = len(self.data.value)
        parts = [
            np.zeros(n) if s == "R" else self.data.column(s, of.get(i)) for i, s in enumerate(self.letters)
        ]
        return np.stack(parts, axis=1)

    def slopes(self, at: WhittleSolution) -> tuple[Array, tuple[int, ...]]:
        """Relative change of the means with ln c of every positive coefficient and with ln T, and their places.

        The place of a correlation time is that of its term plus the number of letters.
        """
        A = self.columns(at.times)
        parts, places = [], []
        for i, c in enumerate(at.c):
            if c > 0:
                parts.append(c * A[:, i] / at.mean)
                places.append(i)
        for g, T in zip(self.markov, at.times, strict=True):
            if at.c[g] > 0:
                parts.append(at.c[g] * self.data.slope(T) / at.mean)
                places.append(g + len(self.letters))
        n = len(self.data.value)
        return np.stack(parts, axis=1) if parts else np.zeros((n, 0)), tuple(places)

    # -- the minimum ---------------------------------------------------------------------------------------

    def _start(self, times: Sequence[float], fixed: Mapping[int, float]) -> Array | None:
        """Relative least squares: a safe first guess; None where no term that is free or fixed fills the spectrum."""
        A = self.columns(times)
        c = np.array([fixed.get(i, 0.0) for i in range(len(self.letters))])
        free = [i for i, s in enumerate(self.letters) if i not in fixed and s != "R"]
        scale = np.maximum(self.data.value, 1e-3 * float(np.mean(self.data.value)))
        smooth = _running_mean(self.data.value, self.data.dof)
        scale = np.maximum(smooth, 1e-12 * float(smooth.max()))
        weight = np.sqrt(self.data.weight / 2) / scale
        if free:
            B = A[:, free] * weight[:, None]
            norm = np.linalg.norm(B, axis=0)
            norm[norm == 0] = 1.0
            c[free] = nonnegative(B / norm, (self.data.value - A @ c) * weight) / norm
        mean = A @ c
        if not np.all(mean > 0):
            if not free:
                return None
            typical = float(np.median(self.data.value))
            for i in free:  # a little of everything
                c[i] += 1e-3 * typical / max(float(np.median(A[:, i])), 1e-300)
            if not np.all(A @ c > 0):
                return None
        return c

    def _descend(
        self,
        c: Array,
        times: tuple[float, ...],
        fixed: Mapping[int, float],
        held: Mapping[int, float],
        ramp: float | None,
        slope: float,
    ) -> WhittleSolution:
        """Fisher scoring with halving of steps that lead up."""
        here = self._at(c, times, ramp, slope)
        if here is None:
            start = self._start(times, fixed)
            here = None if start is None else self._at(start, times, ramp, slope)
        if here is None:
            nothing = np.full(len(self.data.value), np.nan)
            return WhittleSolution(c=c, times=times, ramp=0.0, value=math.inf, mean=nothing)
        low, high = (math.log(t) for t in self.data.times)
        for _ in range(_STEPS):
            step, turn = self._step(here, fixed, held)
            size, better = 1.0, None
            while size > 1e-4:
                moved = np.maximum(here.c + size * step, 0.0)
                logs = np.log(here.times) + size * turn if here.times else np.zeros(0)
                trial = self._at(moved, tuple(np.exp(np.clip(logs, low, high)).tolist()), ramp, here.ramp)
                if trial is not None and trial.value < here.value:
                    better = trial
                    break
                size /= 2.5
            if better is None:
                break
            gain, here = here.value - better.value, better
            if gain < _SETTLED:
                break
        return here

    def _at(
        self, c: Array, times: tuple[float, ...], ramp: float | None, near: float
    ) -> WhittleSolution | None:
        mean = self.columns(times) @ c
        if not np.all(mean > 0) or not np.all(np.isfinite(mean)):
            return None
        slope = self._ramp(mean) if ramp is None else ramp
        ratio = self.values(slope) / mean
        value = float(self.data.weight @ (np.log(mean) + ratio))
        if self.data.common.shape[1]:
            e = self._shared(ratio)
            turn = self.data.common @ e
            value += float(self.data.weight @ (turn + ratio * np.expm1(-turn)) + e @ e)
        return WhittleSolution(c=c, times=times, ramp=slope, value=value, mean=mean)

    def _shared(self, ratio: Array) -> Array:
        """The common errors at which L is least, for ordinates over their means: eq. (2) is convex in them."""
        r, w = self.data.common, self.data.weight
        e = np.zeros(r.shape[1])
        if not len(e):
            return e
        for _ in range(_STEPS):
            part = w * ratio * np.exp(-(r @ e))
            step = np.linalg.solve(2 * np.eye(len(e)) + (r.T * part) @ r, 2 * e + r.T @ (w - part))
            e = e - step / max(1.0, float(np.abs(r @ step).max()) / _LEAP)
            if np.abs(step).max() < _CLOSE:
                break
        return e

    def whitened(self, parts: Array, mean: Array) -> Array:
        """Columns of parts of the ordinates over their standard deviations, the common errors taken into account.

        The covariance of the ordinates over their own deviations is 1 + U U'; with U'U = V diag(s) V' its inverse root
        is 1 - U V diag((1 - 1/sqrt(1 + s))/s) V' U'.
        """
        root = np.sqrt(self.data.weight / 2)
        scaled = parts * (root / mean)[:, None]
        if not self.data.common.shape[1]:
            return np.asarray(scaled)
        U = root[:, None] * self.data.common
        s, V = np.linalg.eigh(U.T @ U)
        s = np.maximum(s, 1e-12)
        turned = U @ V
        return np.asarray(scaled - turned @ (((1 - 1 / np.sqrt(1 + s)) / s)[:, None] * (turned.T @ scaled)))

    def values(self, slope: float) -> Array:
        """The ordinates without a ramp."""
        if slope == 0.0:
            return self.data.value
        n = len(self.data.contrast)
        left = (self.data.contrast - slope * self.data.ramp) ** 2
        return np.concatenate([left, self.data.value[n:]])

    def _ramp(self, mean: Array) -> float:
        if "R" not in self.letters:
            return 0.0
        d, w = self.data.ramp, self.data.weight[: len(self.data.ramp)] / mean[: len(self.data.ramp)]
        size = float(w @ d**2)
        return float((w * d) @ self.data.contrast) / size if size > 0 else 0.0

    def _step(
        self, at: WhittleSolution, fixed: Mapping[int, float], held: Mapping[int, float]
    ) -> tuple[Array, Array]:
        """Step of the coefficients and of ln T to the minimum of the expected quadratic."""
        free = [i for i, s in enumerate(self.letters) if i not in fixed and s != "R"]
        moving = [k for k, g in enumerate(self.markov) if g not in held and at.c[g] > 0]
        if not free and not moving:
            return np.zeros_like(at.c), np.zeros(len(at.times))
        A = self.columns(at.times)
        slope = [self.data.slope(at.times[k]) * at.c[self.markov[k]] for k in moving]
        B = self.whitened(np.column_stack([A[:, free], *slope, *(-s for s in slope)]), at.mean)
        norm = np.linalg.norm(B, axis=0)
        norm[norm == 0] = 1.0
        rest = self.values(at.ramp) - at.mean + A[:, free] @ at.c[free]
        target = self.whitened(rest[:, None], at.mean)[:, 0]
        x = nonnegative(B / norm, target) / norm
        step, turn = np.zeros_like(at.c), np.zeros(len(at.times))
        step[free] = x[: len(free)] - at.c[free]
        k = len(moving)
        turn[moving] = np.clip(x[len(free) : len(free) + k] - x[len(free) + k :], -_LEAP, _LEAP)
        return step, turn

    # -- how well ------------------------------------------------------------------------------------------

    def chi2(self, at: WhittleSolution) -> float:
        """Sum of squared normal scores of the ordinates: chi-square with one degree of freedom for each."""
        z, e = self.scores(at), self._shared(self.values(at.ramp) / at.mean)
        return float(z @ z + e @ e)

    def scores(self, at: WhittleSolution) -> Array:
        """Normal score of each ordinate: where it lies in the law that the model gives it."""
        dof = self.data.weight
        ratio = self.values(at.ramp) / at.mean
        if self.data.common.shape[1]:
            ratio = ratio * np.exp(-(self.data.common @ self._shared(ratio)))
        low, high = np.maximum(chi_square_tails(dof * ratio, dof), 1e-300)
        return np.where(low < 0.5, normal_quantiles(low), -normal_quantiles(high))


def _running_mean(value: Array, dof: Array, reach: int = 3) -> Array:
    """Mean over neighbours, weighted by their degrees of freedom."""
    ones = np.ones(2 * reach + 1)
    return np.convolve(value * dof, ones, "same") / np.convolve(dof, ones, "same")
