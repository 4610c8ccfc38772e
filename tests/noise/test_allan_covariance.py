# SPDX-License-Identifier: BSD-3-Clause
"""Exact covariance and degrees of freedom: against the plain sum over all distances and published tables."""

from __future__ import annotations

import numpy as np
import pytest

from allanite.noise import Flicker, GaussMarkov, NoiseModel, Quantisation, Ramp, RandomWalk, TermType, White
from allanite.noise.allan.covariance import (
    complete_starts,
    count_pairs,
    covariance,
    edf,
    lag_pairs,
    touching_starts,
)

W = (1, -2, 1)
TERMS: dict[str, TermType] = {
    "white": White(N=1.0),
    "flicker": Flicker(B=1.0),
    "walk": RandomWalk(K=1.0),
    "quantisation": Quantisation(Q=1.0),
    "gauss-markov": GaussMarkov.from_sigma(1.0, 100.0),
    "short gauss-markov": GaussMarkov.from_sigma(1.0, 3.0),
}


def plain_covariance(term: TermType, sampling: str, n: int, m1: int, m2: int) -> float:
    """The twin: every distance, one by one."""
    M1, M2 = n - 2 * m1 + 1, n - 2 * m2 + 1
    k = np.arange(-(M1 - 1), M2)
    pairs = np.minimum(M1, M2 - k) - np.maximum(0, -k)
    r = sum(
        W[i] * W[j] * term.phase_covariance(k + j * m2 - i * m1 + 0.0, 1.0, sampling)
        for i in range(3)
        for j in range(3)
    ) / (2 * m1 * m2)
    return float(2 * np.sum(pairs * r * r) / (M1 * M2))


@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize("name", sorted(TERMS))
def test_quadrature_equals_the_plain_sum(name: str, sampling: str) -> None:
    n, lags = 3000, [1, 2, 5, 32, 200, 1000, 1500]
    V = covariance(NoiseModel.of(TERMS[name]), lag_pairs(lags, n), 1.0, sampling)
    plain = np.array(
        [[plain_covariance(TERMS[name], sampling, n, *sorted((a, b))) for b in lags] for a in lags]
    )
    scale = np.sqrt(np.outer(np.diag(plain), np.diag(plain)))
    assert np.max(np.abs(V - plain) / scale) < 1e-6


EDF = {
    256: {
        "white": [170.2225, 145.0629, 87.2793, 45.0611, 21.7628, 9.8520, 4.0194, 1],
        "flicker": [224.7336, 143.9532, 73.0133, 35.7201, 16.9792, 7.6218, 3.0161, 1],
        "walk": [255.0000, 130.3793, 59.8825, 28.4803, 13.3890, 5.9299, 2.2496, 1],
        "walk i": [226.7655, 117.3981, 58.0200, 28.2479, 13.3616, 5.9269, 2.2494, 1],
        "quantisation": [131.4079, 130.6454, 129.1239, 126.0955, 120.1068, 108.5098, 89.0687, 1],
    },
    1024: {
        "white": [682.2223, 583.9188, 354.4058, 186.2933, 93.3916, 45.7532, 21.7944, 9.8290, 4.0051, 1],
        "flicker": [901.1390, 579.5705, 296.6046, 147.8298, 73.0424, 35.6277, 16.9262, 7.5948, 3.0032, 1],
        "walk": [1023.0, 525.3503, 243.6242, 118.2231, 57.9792, 28.1779, 13.3204, 5.9056, 2.2390, 1],
        "walk i": [909.4321, 472.9274, 236.0201, 117.2514, 57.8588, 28.1632, 13.3187, 5.9054, 2.2390, 1],
        "quantisation": [
            526.3789,
            525.6152,
            524.0887,
            521.0389,
            514.9529,
            502.8397,
            478.8864,
            432.5098,
            354.9144,
            1,
        ],
    },
}


@pytest.mark.parametrize("n", [256, 1024])
@pytest.mark.parametrize("name", ["white", "flicker", "walk", "walk i", "quantisation"])
def test_u1_exact_degrees_of_freedom(name: str, n: int) -> None:
    lags = [1 << i for i in range(n.bit_length() - 1)]
    sampling = "mean" if name in ("walk i", "flicker") else "point"
    got = edf(NoiseModel.of(TERMS[name.removesuffix(" i")]), lags, n, 1.0, sampling)
    np.testing.assert_allclose(got, EDF[n][name], rtol=1e-4)


def test_u2_gauss_markov_degrees_of_freedom() -> None:
    model = NoiseModel.of(GaussMarkov(q=1.0, T=100.0))
    points = edf(model, [1, 10, 100, 256, 512], 1024, 1.0, "point")
    np.testing.assert_allclose(points, [1020.5745, 94.8397, 8.7137, 2.8911, 1], rtol=1e-4)
    means = edf(model, [1, 10, 100, 256, 512], 1024, 1.0, "mean")
    np.testing.assert_allclose(means, [909.6499, 94.3368, 8.7132, 2.8910, 1], rtol=1e-4)


def test_u6_correlation_between_lags() -> None:
    published = {
        "white": (0.50771, 0.47876, 0.15974),
        "flicker": (0.65947, 0.61862, 0.25865),
        "walk": (0.85372, 0.81082, 0.56782),
    }
    for name, values in published.items():
        V = covariance(NoiseModel.of(TERMS[name]), lag_pairs([64, 128, 256], 1024), 1.0, "point")
        rho = V / np.sqrt(np.outer(np.diag(V), np.diag(V)))
        np.testing.assert_allclose([rho[0, 1], rho[1, 2], rho[0, 2]], values, rtol=1e-3)


def test_mixture_with_ramp_against_matrices() -> None:
    """Second method: tr(A1 S A2 S) with the full covariance matrix of 64 samples."""
    n, dt, lags = 64, 0.5, [1, 3, 8]
    model = NoiseModel.of(White(N=0.7), RandomWalk(K=0.3), Ramp(R=0.02))
    S = 0.7**2 / dt * np.eye(n) + 0.3**2 * dt * np.minimum.outer(np.arange(1, n + 1), np.arange(1, n + 1))
    ramp = 0.02 * dt * np.arange(n)
    forms = []
    for m in lags:
        rows = []
        for i in range(n - 2 * m + 1):
            d = np.zeros(n)
            d[i : i + m], d[i + m : i + 2 * m] = -1, 1
            rows.append(d / (np.sqrt(2) * m))
        D = np.array(rows)
        forms.append(D.T @ D / len(D))
    expected = np.array(
        [[2 * np.trace(A @ S @ B @ S) + 4 * ramp @ A @ S @ B @ ramp for B in forms] for A in forms]
    )
    got = covariance(model, lag_pairs(lags, n), dt, "point")
    np.testing.assert_allclose(got, expected, rtol=1e-9)
    means = [np.trace(A @ S) + ramp @ A @ ramp for A in forms]
    np.testing.assert_allclose(model.avar_sampled(np.array(lags), dt, "point"), means, rtol=1e-10)


def test_gaps_count_the_pairs_of_windows_that_are_left() -> None:
    rng = np.random.default_rng(4)
    present = rng.random(400) > 0.1
    missing = np.flatnonzero(~present)
    runs = np.stack([missing, missing + 1], axis=1)
    starts = [complete_starts(runs, 400, 2 * m) for m in (1, 4)]
    masks = [np.array([present[i : i + 2 * m].all() for i in range(400 - 2 * m + 1)]) for m in (1, 4)]
    for found, mask in zip(starts, masks, strict=True):
        inside = np.zeros(len(mask), dtype=bool)
        for a, b in found:
            inside[a:b] = True
        np.testing.assert_array_equal(inside, mask)
    k = np.arange(-50, 60)
    expected = [
        sum(masks[0][i] and masks[1][i + d] for i in range(len(masks[0])) if 0 <= i + d < len(masks[1]))
        for d in k
    ]
    np.testing.assert_allclose(count_pairs(starts[0], starts[1], k.astype(float)), expected)


@pytest.mark.parametrize("clustered", [False, True])
def test_pairs_of_many_runs_are_those_of_an_interpolation(clustered):
    """Against NumPy's piecewise linear counts, for distances that are not whole, up to beyond both ends."""
    rng = np.random.default_rng(5)
    for _ in range(50):
        edges = np.cumsum(rng.integers(1, 40, size=2 * rng.integers(1, 200)))
        if clustered:  # most runs in a small part of the record
            edges[len(edges) // 2 :] += 100_000
        runs = edges.reshape(-1, 2).astype(np.int64)
        other = np.cumsum(rng.integers(1, 90, size=60)).reshape(-1, 2).astype(np.int64)
        k = np.concatenate([rng.uniform(-edges[-1] - 9, edges[-1] + 9, 300), rng.integers(-500, 500, 50)])
        counts = np.zeros(len(edges))
        counts[1::2] = runs[:, 1] - runs[:, 0]

        def below(place, edges=edges, counts=counts):
            return np.interp(place, edges, np.cumsum(counts))

        expected = (below(other[:, 1][:, None] + k) - below(other[:, 0][:, None] + k)).sum(axis=0)
        np.testing.assert_allclose(count_pairs(other, runs, k), expected, rtol=1e-12, atol=1e-9)


def test_gappy_covariance_against_matrices() -> None:
    n, lags = 80, [1, 4]
    runs = np.array([[0, 1], [10, 12], [40, 47]])
    starts = [complete_starts(runs, n, 2 * m) for m in lags]
    S = np.eye(n) + 0.2 * np.minimum.outer(np.arange(1, n + 1), np.arange(1, n + 1))
    forms = []
    for m, found in zip(lags, starts, strict=True):
        rows = []
        for a, b in found:
            for i in range(a, b):
                d = np.zeros(n)
                d[i : i + m], d[i + m : i + 2 * m] = -1, 1
                rows.append(d / (np.sqrt(2) * m))
        D = np.array(rows)
        forms.append(D.T @ D / len(D))
    expected = np.array([[2 * np.trace(A @ S @ B @ S) for B in forms] for A in forms])
    model = NoiseModel.of(White(N=1.0), RandomWalk(K=np.sqrt(0.2)))
    np.testing.assert_allclose(
        covariance(model, lag_pairs(lags, n, starts), 1.0, "point"), expected, rtol=1e-9
    )


def test_touching_starts_leave_out_only_terms_that_touch() -> None:
    missing = np.array([[5, 6], [20, 23]])
    found = touching_starts(missing, 40, 4, 2)
    bad = {5, 20, 21, 22}
    expected = [i for i in range(40 - 8) if not {i, i + 4, i + 8} & bad]
    assert [i for a, b in found for i in range(a, b)] == expected
