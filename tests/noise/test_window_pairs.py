# SPDX-License-Identifier: BSD-3-Clause
"""The covariance of two second differences of the phase: kernels against their twins in eighty bits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from allanite import _kernels
from allanite.noise import Flicker, GaussMarkov, Quantisation, RandomWalk, TermType, White
from allanite.noise.allan.covariance import cross_covariance, distance_nodes, lag_pairs
from allanite.noise.power_law import PowerLaw

Floats = NDArray[np.float64]
W = (1, -2, 1)
#: Windows of every size, beside each other, and to the ends of a record.
LENGTHS = np.array([[1, 1], [1, 2], [1, 700], [3, 8], [64, 64], [64, 4096], [700, 2500]], dtype=np.float64)
N = 5000
TERMS: dict[str, TermType] = {
    "quantisation": Quantisation(Q=1.0),
    "white": White(N=1.0),
    "flicker": Flicker(B=1.0),
    "walk": RandomWalk(K=1.0),
} | {
    f"gauss-markov {T:g}": GaussMarkov.from_sigma(1.0, T) for T in (1e-3, 0.02, 0.5, 4.0, 57.0, 1e3, 1e5, 1e8)
}


def nodes() -> tuple[NDArray[np.int64], Floats]:
    parts = [distance_nodes(int(a), int(b), N)[0] for a, b in LENGTHS]
    return np.concatenate(([0], np.cumsum([len(k) for k in parts]))), np.concatenate(parts)


def twin(S: object, k: Floats, m1: float, m2: float) -> Floats:
    """The nine values of S, one after the other, in eighty bits."""
    wide = np.asarray(k, dtype=np.longdouble)
    total = sum(W[i] * W[j] * S(np.abs(wide + j * m2 - i * m1)) for i in range(3) for j in range(3))  # type: ignore[operator]
    return np.asarray(total / (2 * m1 * m2), dtype=np.float64)


def wide_phase(term: TermType, t: NDArray[np.longdouble], sampling: str) -> NDArray[np.longdouble]:
    """Generalised covariance of the phase, with all the digits that eighty bits have."""
    if not isinstance(term, GaussMarkov):
        return term.phase_covariance(t, 1.0, sampling)  # a polynomial, or t^2 log t
    parts = term.phase_parts(1.0, sampling)
    u = np.longdouble(parts["rate"]) * t
    series = sum((-1) ** n * u**n / math.factorial(n) for n in range(22, 2, -1))
    rest = np.where(u < 1, series, np.exp(-u) - 1 + u - u**2 / 2)
    return np.asarray(np.longdouble(parts["exponential"]) * rest + np.longdouble(parts["linear"]) * t)


@pytest.mark.long
@pytest.mark.skipif(np.finfo(np.longdouble).eps > 1e-18, reason="no eighty bits on this machine")
@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize("name", TERMS)
def test_every_term_is_its_nine_values(name: str, sampling: str) -> None:
    """To 1e-12 of the roots of both variances, plus what the nine values lose to each other far apart.

    The twin adds them in eighty bits. Of t^2 log t the kernel adds nine values as well, in sixty-four.
    """
    digits = 1e-15 if isinstance(TERMS[name], Flicker) else 3e-17
    offsets, k = nodes()
    r = cross_covariance(TERMS[name], LENGTHS, offsets, k, sampling)
    for p, (m1, m2) in enumerate(LENGTHS):
        part = k[offsets[p] : offsets[p + 1]]
        kernel, near = r[offsets[p] : offsets[p + 1]], np.abs(part + m2 - m1) <= 50 * (m1 + m2)
        exact = twin(lambda t: wide_phase(TERMS[name], t, sampling), part, m1, m2)
        sizes = np.sqrt(
            [cross_covariance(TERMS[name], np.array([[m, m]]), np.array([0, 1]), np.zeros(1), sampling)[0]
             for m in (m1, m2)]
        )  # fmt: skip
        lost = digits * float(np.max(np.abs(wide_phase(TERMS[name], np.longdouble(N), sampling)))) / (m1 * m2)
        bound = 1e-12 * float(sizes.prod()) + lost
        np.testing.assert_allclose(kernel[near], exact[near], rtol=0, atol=bound)


@pytest.mark.parametrize("slope", [0.5, 0.97, 1.0, 1.2, 1.5])
def test_every_power_law_is_its_nine_values(slope: float) -> None:
    offsets, k = nodes()
    law = PowerLaw(slope=slope)
    r = cross_covariance(law, LENGTHS, offsets, k, "mean")
    for p, (m1, m2) in enumerate(LENGTHS):
        part = k[offsets[p] : offsets[p + 1]]
        near = np.abs(part + m2 - m1) <= 50 * (m1 + m2)
        exact = twin(lambda t: law.phase_covariance(t, 1.0, "mean"), part[near], m1, m2)
        lost = 1e-15 * float(np.max(np.abs(law.phase_covariance(np.array(100 * (m1 + m2)), 1.0, "mean"))))
        np.testing.assert_allclose(
            r[offsets[p] : offsets[p + 1]][near], exact, rtol=0, atol=1e-12 + lost / (m1 * m2)
        )


def test_power_laws_together_are_those_one_by_one() -> None:
    pairs = lag_pairs([1, 2, 16, 900], N)
    slopes = [0.5, 0.8, 1.0, 1.3]
    together = pairs.power_laws(slopes)
    for slope, row in zip(slopes, together, strict=True):
        np.testing.assert_array_equal(row, pairs.cross(PowerLaw(slope=slope), "mean"))


def test_windows_of_white_noise_in_whole_numbers() -> None:
    """Windows of 2 and 3 samples: the triangle of shared samples, by hand."""
    k = np.arange(-7.0, 5.0)
    r = _kernels.window_pairs(np.array([[2.0, 3.0]]), np.array([0, len(k)]), k, 0.0, -0.5, 0.0, 0.0, 0.0)
    a, b = np.repeat([-1, 1], 2), np.repeat([-1, 1], 3)
    shared = [sum(a[i] * b[i - int(d)] for i in range(4) if 0 <= i - d < 6) / 12 for d in k]
    np.testing.assert_allclose(r, shared, atol=1e-15)


@pytest.mark.parametrize(
    ("lengths", "offsets"),
    [
        ([[2.0, 1.0]], [0, 3]),
        ([[0.0, 1.0]], [0, 3]),
        ([[math.nan, 1.0]], [0, 3]),
        ([[1.0, 2.0]], [0, 2]),
        ([[1.0, 2.0]], [1, 3]),
        ([[1.0, 2.0], [1.0, 2.0]], [0, 4, 3]),
        ([[1.0, 2.0], [1.0, 2.0]], [0, 3]),
    ],
)
def test_pairs_that_do_not_fit_are_refused(lengths: list[list[float]], offsets: list[int]) -> None:
    pairs, ends, k = np.array(lengths), np.array(offsets), np.zeros(3)
    with pytest.raises(ValueError, match=r"lengths|offsets"):
        _kernels.window_pairs(pairs, ends, k, 1.0, 1.0, 1.0, 1.0, 1.0)
    with pytest.raises(ValueError, match=r"lengths|offsets"):
        _kernels.power_window_pairs(pairs, ends, k, np.array([0.1]))
