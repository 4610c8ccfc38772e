# SPDX-License-Identifier: BSD-3-Clause
"""Closed forms and honest intervals: rows C5, C8, C12, C15, U4, U12, U14 and U15 of the battery.

Those that take thousands of records are run by `python -m verification battery`; here is what is exact or quick.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.fitting.misfit import candidate
from allanite.fitting.moments import lags_used
from allanite.noise import (
    FLICKER_FLOOR,
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    Ramp,
    RandomWalk,
    Sinusoid,
    TermType,
    White,
)
from allanite.noise.allan import covariance
from allanite.noise.allan.degrees import chi_square_factors
from allanite.recording.records import Recording


def oavar(y: np.ndarray, lags: list[int]) -> np.ndarray:
    curve = al.allan_curve(Recording.from_rate(y, rate=1.0, unit="rad/s"), taus=[float(m) for m in lags])
    return curve.variance[:, 0]


# -- C5: flicker at short lags ---------------------------------------------------------------------------------


def fractional_avar(m: int) -> float:
    """Of the fractional difference of order 1/2, B = 1: 2/m^2 int sin^4(pi f m)/sin^3(pi f) df, 0 to 1/2."""
    from scipy.integrate import quad

    edges = np.linspace(0, 0.5, m + 1)
    parts = [
        quad(
            lambda f: math.sin(math.pi * f * m) ** 4 / math.sin(math.pi * f) ** 3,
            a,
            b,
            epsabs=0,
            epsrel=1e-12,
        )[0]
        for a, b in zip(edges[:-1], edges[1:], strict=True)
    ]
    return 2 / m**2 * sum(parts)


def test_c5_discrete_flicker_lies_above_its_floor_at_short_lags() -> None:
    """Ours is that of interval means, on the floor at every lag; the simulator of others may be the discrete one."""
    published = {1: 0.797884560802865, 2: 0.713649646461108, 4: 0.680687438872955, 8: 0.669382167099798}
    for m, value in published.items():
        assert math.sqrt(fractional_avar(m)) == pytest.approx(value, rel=1e-10)
    means = Flicker(B=1.0).avar_sampled(np.array([1, 2, 4, 8]), 1.0, "mean")
    np.testing.assert_allclose(np.sqrt(means), FLICKER_FLOOR, rtol=1e-12)


# -- C8: a dithered quantiser ----------------------------------------------------------------------------------


def test_c8_dithered_angle_quantiser(rng: np.random.Generator) -> None:
    """3 (LSB^2/12)/tau^2, and the fit calls it Q = LSB/sqrt(12). The dither is subtracted again and leaves nothing."""
    lsb, n = 0.01, 200_000
    dither = rng.random(n) - 0.5
    angle = lsb * (np.round(3.9 * np.arange(n) + dither) - dither)
    curve = al.allan_curve(
        Recording.from_angle(angle, rate=1.0, unit="rad"), taus=[1.0, 2.0, 4.0, 8.0, 16.0, 32.0]
    )
    np.testing.assert_allclose(curve.variance[:, 0], 3 * lsb**2 / 12 / curve.tau**2, rtol=0.05)
    q = al.fit(curve).estimate("Q")
    assert q is not None and q.supported and q.lower < lsb / math.sqrt(12) < q.upper


# -- C12: from the density to the variance ---------------------------------------------------------------------


def shape_integral(g: Callable[[float], float]) -> float:
    """int g(x) sin^4(x)/x^2 dx from 0: plain to 2 pi, beyond by the lines of sin^4 = 3/8 - cos(2x)/2 + cos(4x)/8."""
    from scipy.integrate import quad

    end, tiny = 2 * math.pi, {"epsabs": 0, "epsrel": 1e-11, "limit": 400}
    near = sum(
        quad(lambda x: g(x) * math.sin(x) ** 4 / x**2, a, b, **tiny)[0]
        for a, b in ((1e-12, 0.1), (0.1, 3.0), (3.0, end))
    )
    far = 3 / 8 * quad(lambda x: g(x) / x**2, end, math.inf, **tiny)[0]
    scale = g(end)
    for turns, weight in ((2.0, -1 / 2), (4.0, 1 / 8)):
        line = quad(
            lambda x: g(x) / scale / x**2, end, math.inf, weight="cos", wvar=turns, epsabs=1e-12, limlst=200
        )
        far += weight * scale * line[0]
    return near + far


@pytest.mark.parametrize(
    "term",
    [White(N=0.7), Flicker(B=1.3), RandomWalk(K=0.2), GaussMarkov(q=0.4, T=30.0)],
    ids=lambda t: t.type,
)
def test_c12_avar_is_the_integral_of_the_density(term: TermType) -> None:
    """AVAR = 4 int S sin^4(pi f tau)/(pi f tau)^2 df from 0, two-sided S."""
    for tau in (0.7, 30.0, 500.0):
        total = 4 / (math.pi * tau) * shape_integral(lambda x, t=tau: float(term.psd(x / math.pi / t)))
        assert total == pytest.approx(float(term.avar(tau)), rel=1e-6)


def test_c12_quantisation_and_sinusoid() -> None:
    """The angle's white error ends at half the rate; a sinusoid is two lines of A^2/4."""
    from scipy.integrate import quad

    dt, term = 0.5, Quantisation(Q=0.3, dt=0.5)
    for m in (1, 3, 20):

        def density(f: float, m: int = m) -> float:
            shape = math.sin(math.pi * f * m * dt) ** 4 / (m * math.sin(math.pi * f * dt)) ** 2
            return 4 * float(term.psd(f)) * shape

        total = sum(
            quad(density, k / (2 * m * dt) + 1e-15, (k + 1) / (2 * m * dt), epsrel=1e-11)[0] for k in range(m)
        )
        assert total == pytest.approx(float(term.avar_sampled(np.array([m]), dt, "mean")[0]), rel=1e-6)
    line = Sinusoid(amplitude=0.5, frequency=0.05)
    for tau in (0.7, 30.0, 500.0):
        x = math.pi * 0.05 * tau
        assert float(line.avar(tau)) == pytest.approx(
            4 * 0.5**2 / 4 * math.sin(x) ** 4 / x**2, rel=1e-6, abs=1e-15
        )


# -- C15: one degree of freedom --------------------------------------------------------------------------------


def test_c15_a_deviation_with_one_degree_of_freedom_lies_low(rng: np.random.Generator) -> None:
    """The last lag has one window: the dot is at 0.798 of the truth in the mean, and its interval holds."""
    n, records = 64, 4000
    deviation = np.empty(records)
    for i in range(records):
        y = rng.standard_normal(n)
        deviation[i] = abs(y[32:].mean() - y[:32].mean()) / math.sqrt(2)
    one = al.allan_curve(Recording.from_rate(y, rate=1.0, unit="rad/s"), taus=[32.0])
    assert one.deviation[0, 0] == pytest.approx(deviation[-1], rel=1e-12) and one.edf[0, 0] == pytest.approx(
        1.0
    )
    ratio = deviation * math.sqrt(32)
    sd = math.sqrt(1 - 2 / math.pi)
    assert ratio.mean() == pytest.approx(math.sqrt(2 / math.pi), abs=4 * sd / math.sqrt(records))
    assert np.median(ratio) == pytest.approx(0.6745, abs=4 * 0.5 / 0.6357 / math.sqrt(records))
    low, high = chi_square_factors(np.array([1.0]), 0.95)
    held = np.mean((low[0] * ratio <= 1) & (high[0] * ratio >= 1))
    assert held == pytest.approx(0.95, abs=4 * math.sqrt(0.95 * 0.05 / records))
    view = Path(al.__file__).parent / "views" / "study.py"
    assert "0.798" in str(al.AllanCurve.__doc__) and "is low on average" in view.read_text("utf-8")


# -- U4: the longest lags --------------------------------------------------------------------------------------


@pytest.mark.parametrize("m", [256, 341])
def test_u4_at_a_third_of_the_record_the_interval_is_wide_not_narrow(
    m: int, rng: np.random.Generator
) -> None:
    """White noise, 68.27 %: chi-square with the exact degrees of freedom covers 0.72 to 0.75."""
    n, records = 1024, 4000
    model = NoiseModel.of(White(N=1.0))
    low, high = chi_square_factors(covariance.edf(model, [m], n, 1.0, "mean"), 0.6827)
    x = np.cumsum(rng.standard_normal((records, n)), axis=1)
    x = np.concatenate([np.zeros((records, 1)), x], axis=1)
    d = x[:, 2 * m :] - 2 * x[:, m:-m] + x[:, : -2 * m]
    ratio = np.sqrt(np.mean(d * d, axis=1) / 2 / m)
    held = np.mean((low[0] * ratio <= 1) & (high[0] * ratio >= 1))
    assert 0.66 <= held <= 0.77


# -- U12: the wrong model --------------------------------------------------------------------------------------


def test_u12_a_gauss_markov_bias_is_not_passed_as_flicker() -> None:
    """Where the record tells them apart, flicker alone has a p below 0.01 and is not printed."""
    from scipy.special import chdtrc

    truth = NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(1e-4, 50.0))
    curve = al.allan_curve(al.simulate(truth, rate=1.0, duration=60_000.0, seed=0))
    used = lags_used(curve)
    flicker = candidate(curve, used).flicker
    assert float(chdtrc(int(used.sum()) - int((flicker.c > 0).sum()), flicker.chi2)) < 0.01
    model = al.fit(curve)
    assert model.family == "gauss-markov" and model.alternative is None


# -- U14: nothing is detrended ---------------------------------------------------------------------------------


def detrended_ratio(n: int, m: int) -> float:
    """E[OAVAR(m)] of a random walk less its least-squares line, over that of the walk: tr(A P S P)/tr(A S)."""
    walk = np.minimum.outer(np.arange(1.0, n + 1), np.arange(1.0, n + 1))
    line = np.linalg.qr(np.column_stack([np.ones(n), np.arange(n)]))[0]
    left = walk - line @ (line.T @ walk)
    left = left - (left @ line) @ line.T
    rows = np.zeros((n - 2 * m + 1, n))
    for i in range(len(rows)):
        rows[i, i : i + m], rows[i, i + m : i + 2 * m] = -1, 1
    return float(np.sum((rows @ left) * rows) / np.sum((rows @ walk) * rows))


def test_u14_taking_a_line_off_takes_the_walk_with_it() -> None:
    for part, published in ((10, 0.83), (4, 0.466), (2, 0.025)):
        assert detrended_ratio(400, 400 // part) == pytest.approx(published, rel=0.03)


@pytest.mark.long
def test_u14_a_ramp_is_a_term_and_the_walk_stays(rng: np.random.Generator) -> None:
    """The curve keeps all of the walk at a quarter of the record, and a ramp beside it is named, not taken off."""
    n, records = 400, 400
    m, ratio, away = n // 4, [], []
    t = np.arange(n) - (n - 1) / 2
    for _ in range(records):
        y = np.cumsum(rng.standard_normal(n))
        ratio.append(oavar(y, [m])[0])
        away.append(oavar(y - y.mean() - (t @ y) / (t @ t) * t, [m])[0])
    truth = float(RandomWalk(K=1.0).avar_sampled(np.array([m]), 1.0, "point")[0])
    edf = covariance.edf(NoiseModel.of(RandomWalk(K=1.0)), [m], n, 1.0, "point")[0]
    assert np.mean(ratio) / truth == pytest.approx(1.0, abs=4 * math.sqrt(2 / edf / records))
    assert np.mean(away) / np.mean(ratio) == pytest.approx(0.466, rel=0.1)
    both = NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-5), Ramp(R=1e-6))
    found = al.fit(al.allan_curve(al.simulate(both, rate=10.0, duration=4000.0, seed=14)))
    for symbol, true in (("N", 1e-4), ("K", 1e-5), ("R", 1e-6)):
        e = found.estimate(symbol)
        assert e is not None and e.supported and e.lower <= true <= e.upper


# -- U15: too short to tell ------------------------------------------------------------------------------------


def test_u15_fewer_than_thirty_samples_are_refused() -> None:
    y = np.random.default_rng(15).standard_normal(29)
    with pytest.raises(al.errors.DataQualityError, match="at least 32"):
        al.characterize(Recording.from_rate(y, rate=1.0, unit="rad/s"))
