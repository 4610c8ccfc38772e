# SPDX-License-Identifier: BSD-3-Clause
"""The maximum of a likelihood over a set of terms: Fisher scoring with coefficients that are not negative.

A step goes to the maximum, among coefficients >= 0, of the quadratic with the expected information; it is halved until
the likelihood rises. Correlation times are stepped in their logarithm, after a coarse scan, because the likelihood may
have several maxima in them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.likelihood.objective import LikelihoodValue, Point, RandomTerm
from allanite.fitting.nonnegative import nonnegative
from allanite.lazy_dataclasses import dataclass

__all__ = ["LikelihoodSearch", "Peak", "maximise"]

Array = NDArray[np.float64]
Evaluate = Callable[[Point], LikelihoodValue]

_STEPS = 60
#: A step that promises less is the last one: 0.0014 standard deviations.
_SETTLED = 1e-6
_ROUGHLY = 0.03  # enough to tell which of several correlation times is worth a climb
_FARTHEST = 1.0  # in ln T, in one step
_SCAN, _SCAN_OF_TWO = 4.0, 10.0  # ratio of the correlation times tried first
_AROUND = 5.0  # the same around known ones
_CLOSE = 1.0  # in ln p


@dataclass(frozen=True, slots=True)
class Peak:
    """A maximum: where, and what the record says there."""

    at: Point
    value: LikelihoodValue

    @property
    def log_likelihood(self) -> float:
        return self.value.log_likelihood

    def place(self, symbol: str) -> int:
        """Position of the first component with this letter; -1 without one."""
        symbols = [k.symbol for k in self.at.components]
        return symbols.index(symbol) if symbol in symbols else -1

    def coefficient(self, symbol: str) -> float:
        """Variance coefficient of the first component with this letter; 0 without one."""
        i = self.place(symbol)
        return float(self.at.c[i]) if i >= 0 else 0.0

    def moving(self) -> list[int]:
        """Positions in the gradient of what has a value: positive coefficients and their correlation times."""
        n = len(self.at.c)
        timed = [i for i, k in enumerate(self.at.components) if k.T is not None]
        positions = [i for i in range(n) if self.at.c[i] > 0]
        return positions + [n + j for j, i in enumerate(timed) if self.at.c[i] > 0]

    def log_covariance(self) -> tuple[list[int], Array]:
        """Covariance of ln c and ln T of what has a value, with the positions in the gradient."""
        at = self.moving()
        n = len(self.at.c)
        unit = np.array([self.at.c[i] if i < n else 1.0 for i in at])
        H = self.value.information[np.ix_(at, at)] * np.outer(unit, unit)
        scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
        return at, np.linalg.pinv(H / np.outer(scale, scale), rcond=1e-12) / np.outer(scale, scale)


@dataclass(frozen=True, slots=True, kw_only=True)
class LikelihoodSearch:
    """What may move.

    Attributes
    ----------
    evaluate : callable
        Value, gradient and information at a point.
    times : (float, float)
        Shortest and longest correlation time [samples].
    """

    evaluate: Evaluate
    times: tuple[float, float]

    def climb(self, start: Point, *, held: frozenset[int] = frozenset(), settled: float = _SETTLED) -> Peak:
        """The maximum near `start`.

        Parameters
        ----------
        held : set of int
            Parameters that stay as they are, by their position in the gradient: coefficients, then correlation times.
        settled : float
            Promise at which to stop.
        """
        at, value = start, self.evaluate(start)
        for _ in range(_STEPS):
            step, promised = self._step(at, value, held)
            if promised < settled:
                break
            size = 1.0
            while size > 1e-4:
                trial = self._moved(at, size * step)
                new = self.evaluate(trial)
                if new.log_likelihood > value.log_likelihood - 1e-12 * abs(value.log_likelihood):
                    break
                size /= 3
            else:
                break
            gained = new.log_likelihood - value.log_likelihood
            at, value = trial, new
            if gained < settled / 10 and promised < 1e3 * settled:
                break
        return Peak(at, value)

    def _step(self, at: Point, value: LikelihoodValue, held: frozenset[int]) -> tuple[Array, float]:
        """Step of (c, ln T), and how much it promises.

        A correlation time that would pass the longest one goes there, and the others step as is best with it: stepping
        for a time that cannot follow, they would lose as much as they promise.
        """
        n, g, H = len(at.c), value.gradient, value.information
        moving = [i for i in self._moving(at, held) if H[i, i] > 0]
        step, promised = self._toward(at, g, H, moving)
        longest = math.log(self.times[1])
        room = {n + j: longest - math.log(T) for j, T in enumerate(_times(at))}
        ends = [i for i in moving if i >= n and step[i] > room[i]]
        if ends:
            way = np.array([room[i] for i in ends])
            rest = [i for i in moving if i not in ends]
            step, promised = self._toward(at, g - H[:, ends] @ way, H, rest)
            step[ends] = way
            promised += float(g[ends] @ way - way @ H[np.ix_(ends, ends)] @ way / 2)
        step[n:] = np.clip(step[n:], -_FARTHEST, _FARTHEST)
        return step, promised

    def _moving(self, at: Point, held: frozenset[int]) -> list[int]:
        """Positions in the gradient of what may move; the time of a term that is not there may not."""
        n = len(at.c)
        timed = [i for i, k in enumerate(at.components) if k.T is not None]
        moving = [i for i in range(n) if i not in held]
        return moving + [n + j for j, i in enumerate(timed) if n + j not in held and at.c[i] > 0]

    def _toward(self, at: Point, g: Array, H: Array, moving: Sequence[int]) -> tuple[Array, float]:
        """Step to the maximum of a quadratic in what moves, coefficients staying >= 0, and how much it promises."""
        from scipy.linalg.lapack import dpotrf, dpotrs, dtrtrs

        n, step = len(at.c), np.zeros(len(g))
        if not moving:
            return step, 0.0
        places = np.array(moving)
        H, g = H[places[:, None], places], g[places]
        scale = np.sqrt(H.diagonal())
        H = H / (scale[:, None] * scale)
        H.flat[:: len(H) + 1] = 1 + 1e-9
        shortest, times = math.log(self.times[0]), _times(at)
        here = np.array([at.c[i] if i < n else math.log(times[i - n]) - shortest for i in moving])
        L, refused = dpotrf(H, lower=1, clean=1)
        if refused:
            raise np.linalg.LinAlgError("the expected information is not positive definite")
        y = here * scale
        target = H @ y + g / scale
        wanted = dpotrs(L, target, lower=1)[0]
        if wanted.min() < 0:
            wanted = nonnegative(L.T, dtrtrs(L, target, lower=1)[0])
        d = wanted - y
        step[places] = d / scale
        return step, float(d @ (g / scale) - d @ H @ d / 2)

    def _moved(self, at: Point, step: Array) -> Point:
        n = len(at.c)
        c = np.maximum(at.c + step[:n], 0.0)
        c[(at.c > 0) & (c < 1e-14 * at.c)] = 0.0
        components, j = list(at.components), n
        for i, k in enumerate(components):
            if k.T is not None:
                if step[j] != 0:
                    T = min(max(k.T * math.exp(step[j]), self.times[0]), self.times[1])
                    components[i] = RandomTerm(k.symbol, T)
                j += 1
        return replace(at, components=tuple(components), c=c)


def _times(at: Point) -> list[float]:
    """Correlation times, in the order of the gradient."""
    return [k.T for k in at.components if k.T is not None]


def maximise(
    search: LikelihoodSearch,
    symbols: Sequence[str],
    start: Callable[[tuple[RandomTerm, ...]], Array],
    *,
    slope: float | None = 0.0,
    averaged: bool = False,
    near: Peak | None = None,
    nested: Sequence[Peak] = (),
) -> Peak:
    """The highest maximum over coefficients and correlation times.

    Parameters
    ----------
    symbols : sequence of str
        Letters of the random terms; G may stand twice.
    start : callable
        Coefficients to begin with, for components with known correlation times.
    slope : float or None
        Of the ramp; None: free.
    averaged : bool
        The mean over all slopes instead of the best: see `Point`.
    near : Peak, optional
        A maximum for more terms: correlation times are tried around its own only.
    nested : sequence of Peak
        Maxima for some of the terms. What is returned is no lower than any of them.
    """
    peaks: list[Peak] = []
    for times in _tried(search.times, sum(s == "G" for s in symbols), near):
        left = iter(times)
        components = tuple(RandomTerm(s, next(left) if s == "G" else None) for s in symbols)
        c = peaks[-1].at.c if peaks else start(components)
        # two times that are both somewhat wrong mislead: there they move at once
        held = frozenset(range(len(c), len(c) + len(times))) if len(times) < 2 else frozenset()
        peaks.append(search.climb(Point(components, c, slope, averaged), held=held, settled=_ROUGHLY))
    for fewer in nested:
        starts = _beside(search.times, symbols, fewer)
        peaks += [search.climb(Point(*start, slope, averaged), settled=_ROUGHLY) for start in starts]
    peaks.sort(key=lambda p: -p.log_likelihood)
    # scans stop early, so the runner-up gets its chance where it is close
    close = [p for p in peaks[:3] if p.log_likelihood > peaks[0].log_likelihood - _CLOSE]
    return max((search.climb(p.at) for p in close), key=lambda p: p.log_likelihood)


def _beside(
    ends: tuple[float, float], symbols: Sequence[str], fewer: Peak
) -> Iterator[tuple[tuple[RandomTerm, ...], Array]]:
    """Where to begin from a maximum for fewer terms: the others are zero, with several correlation times."""
    known = list(zip(fewer.at.components, fewer.at.c.tolist(), strict=True))
    rest = list(symbols)
    for component, _ in known:
        rest.remove(component.symbol)
    for times in _tried(ends, rest.count("G"), None):
        left = iter(times)
        terms = [*known, *((RandomTerm(s, next(left) if s == "G" else None), 0.0) for s in rest)]
        terms.sort(key=lambda term: symbols.index(term[0].symbol))
        yield tuple(component for component, _ in terms), np.array([c for _, c in terms])


def _tried(ends: tuple[float, float], count: int, near: Peak | None) -> list[tuple[float, ...]]:
    """Correlation times to begin with."""
    if count == 0:
        return [()]
    shortest, longest = ends
    known = [] if near is None else [k.T for k in near.at.components if k.T is not None]
    if len(known) == count:
        stretched = [tuple(t * f for t in known) for f in (1.0, _AROUND, 1 / _AROUND)]
        return [t for t in stretched if shortest <= t[0] and t[-1] <= longest] or [tuple(known)]
    ratio = _SCAN if count == 1 else _SCAN_OF_TWO
    n = max(int(math.log(longest / shortest) / math.log(ratio)) + 2, count + 1)
    return list(itertools.combinations([float(t) for t in np.geomspace(shortest, longest, n)], count))
