# SPDX-License-Identifier: BSD-3-Clause
"""Mean, bias and degrees of freedom of Theo1 and TheoBR under a model.

Theo1 is a quadratic form of the data (`theo`, eq. 1), so for Gaussian noise, with the generalised autocovariance S of
the phase and the taps w = (1, -1, -1, 1) at o_d = (0, d, m - d, m),

    r_dd'(k) = E[z_d(i) z_d'(i+k)] = sum_ab w_a w_b S(k + o_d'b - o_da),
    E        = 1/(0.75 m^2) sum_d r_dd(0)/d,
    Var      = 2/(0.75 m^2 M)^2 sum_k n_k sum_dd' r_dd'(k)^2/(d d'),    edf = 2 E^2/Var.                      (1)

Sums to m = 62 are taken term by term and are exact. In longer windows 16 evenly spread d stand for all, and as many
distances k: the sums are then integrals of smooth functions, within 1 % of the exact ones. White angle noise
(quantisation) is not smooth: its degrees of freedom per window hardly depend on m, and those of m = 62 are taken.

TheoBR multiplies Theo1 by a ratio from the record. To first order its logarithm is a quadratic form as well,

    ln TheoBR = T/E T + mean_j (A_j/E A_j - T_j/E T_j) + const,    edf = 2/Var,                               (2)

whose variance is taken with full matrices on at most 256 samples: longer records are seen through block means. The
same matrices give the skewness of both, which is not that of chi-square in long windows.

References
----------
.. [1] C. Greenhall, W. Riley, "Uncertainty of stability variances based on finite differences", PTTI 2003.
.. [2] J. Taylor, D. Howe, "Fast TheoBR: a method for long data set stability analysis", IEEE Trans. UFFC 57, 2010.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.noise import Flicker, GaussMarkov, NoiseModel, Quantisation, Ramp, Sinusoid, TermType
from allanite.noise.allan.covariance import count_pairs, in_samples
from allanite.noise.allan.statistics import total_length

__all__ = ["edf_theo1", "edf_theobr", "mean", "shapes", "theo1_bias"]

Array = NDArray[np.float64]
Lags = NDArray[np.int64]
Spans = NDArray[np.int64]
Terms = tuple[TermType, ...]

_DEPTH = 16  # inner differences that stand for all of a long window, at least
_REACH = 16  # windows to which correlations are followed; beyond they add less than 1e-4
_SAMPLES = 256  # of the matrices
_SHORTEST = 8  # samples of a window in them
_MANY = 4096  # inner differences that the mean of a very long window takes
_TAPS = (1.0, -1.0, -1.0, 1.0)


def mean(model: NoiseModel, lags: ArrayLike, dt: float, sampling: str) -> Array:
    """Expected Theo1 of a model at windows of `lags` samples, shape (n_lags,), in SI squared."""
    terms = _terms(model, dt)
    return np.array([_mean(terms, int(m), sampling) for m in np.atleast_1d(np.asarray(lags))])


def theo1_bias(model: NoiseModel, lags: ArrayLike, dt: float, sampling: str) -> Array:
    """AVAR(0.75 m dt) over the expected Theo1(m): what to multiply Theo1 by where the model is known.

    Parameters
    ----------
    model : NoiseModel
        Noise model of the samples.
    lags : array_like of int, shape (n_lags,)
        Windows m, even.
    dt : float [s]
        Sample interval.
    sampling : "mean" or "point"
        Whether a sample is the mean over its interval or a point value.

    Returns
    -------
    ndarray, shape (n_lags,)
        1 for white noise, 1.859 for flicker and 2.700 for random walk in long windows.
    """
    m = np.atleast_1d(np.asarray(lags, dtype=np.float64))
    truth = np.array([model.avar_sampled(0.75 * value, dt, sampling) for value in m])
    return np.asarray(truth / mean(model, m, dt, sampling))


def edf_theo1(
    model: NoiseModel,
    lags: Sequence[int] | Lags,
    n_samples: int,
    dt: float,
    sampling: str,
    starts: Sequence[Spans] | None = None,
) -> Array:
    """Equivalent degrees of freedom of Theo1 at each window length by (1), shape (n_lags,).

    `starts` are the runs of complete windows of each lag where samples are missing.
    """
    terms, out = _terms(model, dt), np.empty(len(lags))
    for i, m in enumerate(lags):
        if starts is None:
            out[i] = _edf_theo1(terms, int(m), n_samples, sampling)
        else:
            out[i] = _edf_with_gaps(terms, int(m), sampling, starts[i])
    return out


def edf_theobr(
    model: NoiseModel, lags: Sequence[int] | Lags, n_samples: int, dt: float, sampling: str
) -> Array:
    """Equivalent degrees of freedom of TheoBR at each window length by (2), shape (n_lags,), without gaps."""
    terms = _terms(model, dt)
    return np.array([_edf_theobr(terms, int(m), n_samples, sampling) for m in lags])


def shapes(model: NoiseModel, lags: Sequence[int] | Lags, n_samples: int, dt: float, sampling: str) -> Array:
    """8/skewness^2 of Theo1 over its degrees of freedom at each window length, shape (n_lags,); 1 is chi-square.

    A long window holds a few large eigenvalues and many small ones: the law is a chi-square law of fewer degrees of
    freedom on top of a constant. `degrees.shifted_factors` makes intervals of it. TheoBR, a product of Theo1 and
    a ratio, keeps it: its linear form (2) may be negative, and its own skewness is too small.
    """
    terms = _terms(model, dt)
    return np.array([_shape(terms, int(m), n_samples, sampling) for m in lags])


def _terms(model: NoiseModel, dt: float) -> Terms:
    return tuple(in_samples(t, dt) for t in model.terms)


# -- Theo1 --------------------------------------------------------------------------------------------------------


def _mean(terms: Terms, m: int, sampling: str) -> float:
    """E of all d, or of 4096 evenly spread ones."""
    half = m // 2
    step = max(1.0, half / _MANY)
    j = np.arange(1, round(half / step) + 1, dtype=np.float64)
    return _expected(terms, j, step, float(m), sampling) / (0.75 * m**2)


def _expected(terms: Terms, j: Array, step: float, m: float, sampling: str) -> float:
    """sum over d = j step of E z_d^2 step/d: each stands for `step` of the d = 1..m/2."""
    d, total = j * step, 0.0
    for term in terms:
        if isinstance(term, Ramp):
            total += float(np.sum((term.R * d * (m - d)) ** 2 / j))
            continue
        S = [
            term.phase_covariance(t, 1.0, sampling) for t in (np.zeros(1), d, m - d, np.array([m]), m - 2 * d)
        ]
        total += float(np.sum((4 * S[0] - 4 * S[1] - 4 * S[2] + 2 * S[3] + 2 * S[4]) / j))
    return total


@lru_cache(maxsize=4096)
def _edf_theo1(terms: Terms, m: int, n_samples: int, sampling: str) -> float:
    windows = n_samples - m + 1
    return _edf(terms, m, sampling, windows, None)


def _edf_with_gaps(terms: Terms, m: int, sampling: str, starts: Spans) -> float:
    windows = total_length(starts)
    return _edf(terms, m, sampling, windows, starts) if windows else float("nan")


def _edf(terms: Terms, m: int, sampling: str, windows: int, starts: Spans | None) -> float:
    depth = m // 2 if m // 2 < 2 * _DEPTH else _DEPTH
    step = m / 2 / depth
    rough = tuple(t for t in terms if isinstance(t, Quantisation)) if step > 1 else ()
    smooth = tuple(t for t in terms if t not in rough)
    k, weight = _distances(smooth, m, step, windows, starts)
    variance = _variance(smooth, m, depth, step, sampling, k, weight) / (0.75 * m**2) ** 2
    if rough:
        variance += 2 * _mean(rough, m, sampling) ** 2 / (windows * _per_window(m, windows, sampling))
    return 2 * _mean(terms, m, sampling) ** 2 / variance


def _per_window(m: int, windows: int, sampling: str) -> float:
    """Degrees of freedom of white angle noise per window: those of m = 62 in a record as many windows long."""
    longest = 4 * _DEPTH - 2
    few = min(max(1, round(windows * longest / m)), 100 * longest)
    return _edf_theo1((Quantisation(Q=1.0, dt=1.0),), longest, few + longest - 1, sampling) / few


def _distances(terms: Terms, m: int, step: float, windows: int, starts: Spans | None) -> tuple[Array, Array]:
    """Distances k >= 0 and weights, so that sum over whole k of n_k f(k)/M^2 = sum of weight * f, f even."""
    far = any(isinstance(t, (Flicker, GaussMarkov, Sinusoid)) for t in terms)
    span = windows if starts is None else int(starts[-1, 1] - starts[0, 0])
    # Whole samples where the sum is exact; else so fine that the triangle n_k of a short record is seen.
    grid = step if step == 1 else step / max(1, -(-8 * step // span))
    reach = min(float(span), (_REACH * m if far else m + 1))
    k: Array = grid * np.arange(int(reach / grid) + 2, dtype=np.float64)
    pairs = np.maximum(windows - k, 0.0) if starts is None else count_pairs(starts, starts, k)
    weight = 2 * grid * pairs / windows**2
    weight[0] /= 2
    return k, weight


def _variance(terms: Terms, m: int, depth: int, step: float, sampling: str, k: Array, weight: Array) -> float:
    """Variance of sum_d z_d^2/d averaged over the windows: 2 sum_k n_k/M^2 sum_dd' r^2/(j j')."""
    offsets = [np.array([0.0, j * step, m - j * step, float(m)]) for j in range(1, depth + 1)]
    random = [t for t in terms if not isinstance(t, Ramp)]
    slope = float(np.sqrt(sum(t.R**2 for t in terms if isinstance(t, Ramp))))
    # S is looked up at whole multiples of the spacing of k, all of which are differences of offsets and k.
    spacing = k[1] if len(k) > 1 else 1.0
    origin = round(m / spacing)
    table = np.zeros(len(k) + 2 * origin)
    for term in random:
        table += term.phase_covariance((np.arange(len(table)) - origin) * spacing, 1.0, sampling)
    places = [np.rint(o / spacing).astype(np.int64) for o in offsets]
    mu = [slope * o[1] * (m - o[1]) for o in offsets]
    share = 1.0 / np.arange(1, depth + 1)
    share[-1] *= (1 + 1 / step) / 2  # trapezoids: the last d stands for half a step and for itself
    total = 0.0
    for a in range(depth):
        line = np.zeros(len(k) + origin)  # E[x(i+t) z_a(i)] at t = 0, 1, ... of k + offset
        for w, place in zip(_TAPS, places[a], strict=True):
            line += w * table[origin - place : origin - place + len(line)]
        for b in range(a, depth):
            r = np.zeros(len(k))
            for w, place in zip(_TAPS, places[b], strict=True):
                r += w * line[place : place + len(k)]
            both = 2 * r**2 + (4 * mu[a] * mu[b] * r if slope else 0.0)
            total += (1 if a == b else 2) * float(weight @ both) * share[a] * share[b]
    return total


# -- matrices: TheoBR, and the law of long windows ----------------------------------------------------------------


@lru_cache(maxsize=4096)
def _shape(terms: Terms, m: int, n_samples: int, sampling: str) -> float:
    """`shapes` on block means; 1 in windows too short for them, which hold enough degrees of freedom."""
    size, short = _in_blocks(m, n_samples)
    if short < _SHORTEST:
        return 1.0
    S = _phase_matrix(terms, n_samples, sampling)
    second, third = _moments(S, _normalised(_theo_form(size, short), S))
    return second**4 / third**2


@lru_cache(maxsize=4096)
def _edf_theobr(terms: Terms, m: int, n_samples: int, sampling: str) -> float:
    size, short = _in_blocks(m, n_samples)
    S, ratio = _phase_matrix(terms, n_samples, sampling), _ratio_form(terms, n_samples, sampling)
    if short >= _SHORTEST:
        return 1 / _moments(S, _normalised(_theo_form(size, short), S) + ratio)[0]
    # Too short for the block means: the ratio and Theo1 are nearly independent there.
    return 1 / (1 / _edf_theo1(terms, m, n_samples, sampling) + _moments(S, ratio)[0])


def _in_blocks(m: int, n_samples: int) -> tuple[int, int]:
    """Size of the matrices, and the window in block means."""
    size = min(n_samples, _SAMPLES)
    return size, min(2 * round(m * size / n_samples / 2), size)


def _moments(S: Array, form: Array) -> tuple[float, float]:
    """Of x'Fx with Cov x = S: tr (FS)^2 = variance/2 and tr (FS)^3 = third cumulant/8."""
    product = form @ S
    return float(np.sum(product * product.T)), float(np.sum((product @ product) * product.T))


def _normalised(form: Array, S: Array) -> Array:
    return np.asarray(form / np.sum(form * S))


@lru_cache(maxsize=16)
def _phase_matrix(terms: Terms, n_samples: int, sampling: str) -> Array:
    """S of the phase points of the block means."""
    size = min(n_samples, _SAMPLES)
    t = np.arange(size + 1, dtype=np.float64) * (n_samples / size)
    table = np.zeros(size + 1)
    for term in terms:
        table += term.phase_covariance(t, 1.0, sampling)
    return np.asarray(table[np.abs(np.arange(size + 1)[:, None] - np.arange(size + 1))])


@lru_cache(maxsize=16)
def _ratio_form(terms: Terms, n_samples: int, sampling: str) -> Array:
    """The quadratic form of the mean ratio in (2)."""
    S = _phase_matrix(terms, n_samples, sampling)
    size, total = len(S) - 1, np.zeros_like(S)
    for q, weight in enumerate(_ratio_weights(n_samples, size)):
        if weight > 0:
            allan, theo = _allan_form(size, 3 * q), _theo_form(size, 4 * q)
            total += weight * (_normalised(allan, S) - _normalised(theo, S))
    return total


def _ratio_weights(n_samples: int, size: int) -> Array:
    """Weight in (2) of AVAR(3 q)/Theo1(4 q) in block means, q = 0, 1, ...: 9 + 3 j = 3 q and 12 + 4 j = 4 q."""
    last = (n_samples + 1) // 30 - 3
    if last < 0:
        return np.zeros(0)
    q = np.arange(3, last + 4)
    in_blocks = np.maximum(np.rint(q * size / n_samples), 1).astype(np.int64)
    return np.bincount(in_blocks) / len(q)


def _allan_form(size: int, m: int) -> Array:
    return _sum_of_squares(size, 2 * m, [(np.array([0, m, 2 * m]), np.array([1.0, -2.0, 1.0]), 1.0)])


def _theo_form(size: int, m: int) -> Array:
    taps = np.array(_TAPS)
    return _sum_of_squares(
        size, m, [(np.array([0, d, m - d, m]), taps, 1.0 / d) for d in range(1, m // 2 + 1)]
    )


def _sum_of_squares(size: int, window: int, filters: list[tuple[NDArray[np.int64], Array, float]]) -> Array:
    """Matrix of the sum over all windows of weight * (filter of the phase)^2, up to a factor."""
    cell = np.zeros((window + 1, window + 1))
    for places, taps, weight in filters:
        np.add.at(cell, (places[:, None], places), weight * np.outer(taps, taps))
    out = np.zeros((size + 1, size + 1))
    for i in range(size - window + 1):
        out[i : i + window + 1, i : i + window + 1] += cell
    return out
