# SPDX-License-Identifier: BSD-3-Clause
"""Given spectral lines: few periods, neighbours, gaps, slow noise, against least squares over all samples."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import binom, norm

import allanite as al
from allanite.errors import DataQualityError, InputError
from allanite.fitting.likelihood import LikelihoodProblem
from allanite.fitting.likelihood.lines import FEWEST_PERIODS, Line, fit_lines
from allanite.fitting.selection import select
from allanite.recording.records import Recording

Array = NDArray[np.float64]


def rates(x: Array, rate: float = 100.0) -> Recording:
    return Recording.from_rate(x, rate=rate, unit="rad/s", sampling="point", names=["gyro"])


def fitted(x: Array, *frequencies: float) -> tuple[Line, ...]:
    return fit_lines(lambda: iter(np.array_split(x, 3)), len(x), frequencies)


def two_lines() -> Array:
    k = np.arange(4000)
    x = np.random.default_rng(3).standard_normal(4000)
    return x + 0.5 * np.sin(2 * np.pi * 0.003 * k) + 0.5 * np.sin(2 * np.pi * 0.2 * k)


@pytest.mark.long
@pytest.mark.parametrize("gaps", [False, True])
@pytest.mark.parametrize("periods", [4.5, 12.0, 40.0])
def test_intervals_hold_the_truth_however_few_periods(periods: float, gaps: bool) -> None:
    """Variances for white noise of variance one: of 30 intervals at 95 % a binomial number holds the truth."""
    n, runs, amplitude = 4000, 30, 0.5
    k, rng = np.arange(n), np.random.default_rng(round(periods * 10))
    reach, hits = norm.ppf(0.975), np.zeros(2, dtype=int)
    for _ in range(runs):
        x = rng.standard_normal(n) + amplitude * np.sin(2 * np.pi * periods / n * k + rng.uniform(0, 7))
        if gaps:
            x[rng.random(n) < 0.2] = np.nan
            x[1500:1900] = np.nan
        (line,) = fitted(x, (periods + rng.uniform(-0.5, 0.5)) / n)
        away = np.array([line.amplitude - amplitude, line.frequency - periods / n])
        hits += np.abs(away) < reach * np.sqrt(line.variances)
    low, high = binom.ppf([1e-4, 1 - 1e-4], runs, 0.95)
    assert (hits >= low).all() and (hits <= high).all()


@pytest.mark.long
def test_each_line_is_what_it_is_alone() -> None:
    found = al.fit(rates(two_lines()), terms="N", lines=[0.3, 20.0])
    for tag, frequency in (("", 0.3), ("_2", 20.0)):
        size, place = found.estimate("amplitude" + tag), found.estimate("frequency" + tag)
        assert size.supported and size.lower < 0.5 < size.upper
        assert place.lower < frequency < place.upper
    alone, beside = fitted(two_lines(), 0.2)[0], fitted(two_lines(), 0.003, 0.2)[1]
    # what the other one leaves in its tails at this distance is less than a hundredth of the error
    error = np.sqrt([*alone.variances])
    assert abs(alone.amplitude - beside.amplitude) < 0.01 * error[0]
    assert abs(alone.frequency - beside.frequency) < 0.01 * error[1]


def test_lines_close_to_each_other_are_the_least_squares_of_all_samples() -> None:
    """Second witness: nonlinear least squares over the samples, with the same polynomials over one stretch."""
    n = 1000
    k = np.arange(n)
    truth = ((6.0, 0.7, 0.3), (8.0, 0.5, 2.0))
    x = np.random.default_rng(8).standard_normal(n) * 0.3 + 1.0 + 2.0 * k / n
    x = x + sum(a * np.sin(2 * np.pi * p / n * k + phase) for p, a, phase in truth)
    x[300:360] = np.nan
    here = np.isfinite(x)
    curves = np.polynomial.legendre.legvander(2 * (k + 0.5) / n - 1, 5)

    def rest(periods: Array) -> Array:
        angle = 2 * np.pi * np.outer(k, periods) / n
        A = np.concatenate([np.cos(angle), np.sin(angle), curves], axis=1)[here]
        return np.asarray(x[here] - A @ np.linalg.lstsq(A, x[here], rcond=None)[0])

    best = least_squares(rest, [6.0, 8.0], xtol=1e-13, ftol=1e-13, gtol=1e-13).x
    found = fitted(x, 8.1 / n, 6.2 / n)
    assert [line.frequency * n for line in found] == pytest.approx([best[1], best[0]], abs=1e-5)


def test_blocks_of_a_long_record_lose_nothing() -> None:
    """A ramp that is a line within each block leaves none of its own; shifts of some widths turn within no block."""
    n = 300_000
    k = np.arange(n)
    size = n // 1024
    x = 100.0 * k / n + 0.3 * np.cos(2 * np.pi * (1 / size + 2.4 / n) * k + 1.0)
    (line,) = fitted(x, 1 / size)  # whose period is a block
    assert line.amplitude == pytest.approx(0.3, rel=1e-4)
    assert line.frequency == pytest.approx(1 / size + 2.4 / n, abs=1e-3 / n)
    assert line.variances[0] == pytest.approx(2 / n, rel=0.01)
    assert line.variances[1] == pytest.approx(6 / (np.pi * 0.3) ** 2 / n**3, rel=0.01)


@pytest.mark.long
def test_a_random_walk_leaks_little_into_a_line() -> None:
    """At the density of the walk at the line: errors 1.4 times as large without the polynomials, at most 1.2 with."""
    n, periods, runs = 1000, 15.0, 200
    k, rng = np.arange(n), np.random.default_rng(2)
    density = 1 / (2 * np.sin(np.pi * periods / n)) ** 2
    amplitude = 12 * np.sqrt(2 * density / n)
    away = []
    for _ in range(runs):
        walk = np.cumsum(rng.standard_normal(n))
        (line,) = fitted(
            walk + amplitude * np.sin(2 * np.pi * periods / n * k + rng.uniform(0, 7)), periods / n
        )
        away.append((line.amplitude - amplitude) / np.sqrt(density * line.variances[0]))
    spread = float(np.mean(np.square(away)))
    assert spread < 1.2**2 * (1 + 3.7 * np.sqrt(2 / runs)) and spread > 1 - 3.7 * np.sqrt(2 / runs)


def test_too_few_periods_are_refused_and_never_found() -> None:
    made = rates(two_lines())
    with pytest.raises(InputError, match=r"3\.6 periods in the record of 40 s.*at least 44\.4 s"):
        al.fit(made, terms="N", lines=[20.0, 0.09])
    with pytest.raises(InputError, match="slow noise"):
        select(made, lines=[0.09])
    n = 4000
    (line,) = fitted(np.cumsum(np.random.default_rng(1).standard_normal(n)), 5.0 / n)
    assert line.frequency * n >= FEWEST_PERIODS - 1e-9
    again = LikelihoodProblem.of(made).with_lines([FEWEST_PERIODS / 40.0])
    assert len(again.lines) == 1


def test_what_cannot_be_told_is_not_stated() -> None:
    x = np.random.default_rng(1).standard_normal(60)
    x[10:50] = np.nan
    found = al.fit(rates(x), terms="N", lines=[8.0, 20.0, 30.0, 35.0, 41.0])
    lines = [e for e in found.estimates if e.symbol.startswith("amplitude")]
    assert len(lines) == 5 and not any(e.supported or np.isnan(e.upper) for e in lines)


@pytest.mark.parametrize("cycles", [0.0, 0.01, 0.05, 0.4, 0.9, 3.0, 30.0])
def test_a_line_at_half_the_sample_rate_is_the_least_squares_of_all_samples(cycles: float) -> None:
    n, f = 4000, 0.5 - cycles / 4000
    k = np.arange(n)
    x = np.random.default_rng(5).standard_normal(n) + 0.5 * np.sin(2 * np.pi * f * k + 1)
    (line,) = fitted(x, f)
    wave = line.cosine * np.cos(2 * np.pi * line.frequency * k) + line.sine * np.sin(
        2 * np.pi * line.frequency * k
    )
    columns = np.stack([np.cos(2 * np.pi * f * k), np.sin(2 * np.pi * f * k)], axis=1)
    at_truth = columns @ np.linalg.lstsq(columns, x - x.mean(), rcond=None)[0]
    # frequency is one parameter more; the curve beside the line takes next to nothing
    assert np.sum((x - wave) ** 2) < np.sum((x - at_truth) ** 2) + 0.5
    assert np.sum((wave - at_truth) ** 2) < 20
    assert line.alternates == (cycles < 0.02) and (line.sine == 0.0 or not line.alternates)
    assert line.gain == pytest.approx(np.sum(wave**2), rel=0.02) and line.variances[0] > 0


def test_an_alternation_is_one_column() -> None:
    n = 4000
    x = np.random.default_rng(6).standard_normal(n) + 0.3 * (-1.0) ** np.arange(n)
    (line,) = fitted(x, 0.5)
    bent = 4 * np.sqrt(6 * 41) / n  # curves of six columns in 41 stretches go with the line
    assert line.cosine == pytest.approx(np.mean((x - x.mean()) * (-1.0) ** np.arange(n)), abs=bent)
    assert line.variances[0] == pytest.approx(1 / n, rel=0.01) and np.isinf(line.variances[1])
    one, two = (LikelihoodProblem.of(rates(x)).with_lines(f).maximum("N") for f in ([], [50.0]))
    assert two.n_parameters == one.n_parameters + 1
    with pytest.raises(InputError, match="up to 50 Hz"):
        al.fit(rates(x), terms="N", lines=[50.1])


@pytest.mark.long
@pytest.mark.parametrize("by_curve", [True, False])
def test_a_line_near_half_the_sample_rate_is_no_quantization(by_curve: bool) -> None:
    """From 0.49 to 0.5 of the rate, of any amplitude that the spectrum shows: N is covered, Q is no more than noise."""
    rng, runs, covered, claimed, looked = np.random.default_rng(8), 60, 0, 0, 0
    for i in range(runs):
        n = int(rng.choice([4000, 12_000, 30_000]))
        f = 0.5 if i % 3 == 0 else 0.5 - 10 ** rng.uniform(-6, -2)
        phase = rng.uniform(0, 2 * np.pi) if i % 3 else np.pi / 2
        size = 10 ** rng.uniform(np.log10(10 / np.sqrt(n)), 0.3)
        record = rates(rng.standard_normal(n) + size * np.sin(2 * np.pi * f * np.arange(n) + phase))
        lines = al.power_spectrum(record, "gyro").lines
        if not all(line.stable for line in lines):
            continue
        if by_curve:
            (channel,) = al.characterize(record, accept=["interleaved"]).channels
            model = channel.models[0]
        else:
            model = al.fit(record)
        n_term, q_term = model.estimate("N"), model.estimate("Q")
        looked += 1
        assert n_term is not None
        covered += n_term.lower <= 0.1 <= n_term.upper
        claimed += q_term is not None and q_term.supported
    assert looked >= runs - binom.isf(1e-4, runs, 0.03)
    assert covered >= binom.ppf(1e-4, looked, 0.95)
    assert claimed <= binom.isf(1e-4, looked, 0.05)


@pytest.mark.long
def test_selection_keeps_a_line_of_few_periods() -> None:
    (kept,) = select(rates(two_lines()), lines=[0.3]).lines
    assert kept.kept and kept.frequency == pytest.approx(0.3, abs=0.003)
    # 2 ln L of a sinusoid in white noise and the power of the other one: n A^2/(2 sigma^2), sd twice its root
    expected = 4000 * 0.5**2 / (2 * (1 + 0.5**2 / 2))
    assert abs(kept.gain - expected) < 4 * 2 * np.sqrt(expected)


@pytest.mark.parametrize("block", [0, -1, 2.5, True, "4"])
def test_a_block_is_a_number_of_samples(block: object) -> None:
    with pytest.raises(InputError, match="whole number of samples"):
        al.fit(rates(two_lines()), method="likelihood", block=block)


@pytest.mark.parametrize("terms", [5, [["N"]], 1.5])
def test_terms_are_letters(terms: object) -> None:
    with pytest.raises(InputError, match="terms are letters"):
        al.fit(rates(two_lines()), terms=terms)


@pytest.mark.parametrize("lines", [0.3, "all", [None], None, [[0.3]]])
def test_lines_are_a_list_of_frequencies(lines: object) -> None:
    with pytest.raises(InputError, match="list of frequencies in Hz"):
        al.fit(rates(two_lines()), terms="N", lines=lines)
    with pytest.raises(InputError, match="list of frequencies in Hz"):
        select(rates(two_lines()), lines=lines)  # type: ignore[arg-type]


def test_samples_whose_squares_are_no_numbers() -> None:
    x = np.random.default_rng(4).standard_normal(2000)
    usual = al.fit(rates(x), terms="NK")
    small = al.fit(rates(x * 2.0**-400), terms="NK")  # 4e-121
    assert [e.upper * 2.0**400 for e in small.estimates] == pytest.approx(
        [e.upper for e in usual.estimates], rel=1e-9
    )
    for factor in (1e-150, 1e-160, 1e-170, 1e-300):
        with pytest.raises(DataQualityError, match="squares underflow"):
            al.fit(rates(x * factor), terms="NK")
    with pytest.raises(DataQualityError, match="constant"):
        al.fit(rates(np.full(2000, 1e-160)), terms="NK")


@pytest.mark.long
def test_one_term_in_a_short_record() -> None:
    """In a process of its own: without the term nothing is left, and SciPy 1.17 aborts on no columns."""
    code = (
        "import numpy as np, allanite as al\n"
        "x = np.random.default_rng(3).standard_normal(100)\n"
        "for terms in ('N', 'NR', 'K', 'G'):\n"
        "    m = al.fit(al.Recording.from_rate(x, rate=1.0, unit='rad/s'), terms=terms)\n"
        "    assert m.estimates[0].supported and m.estimates[0].lower > 0, terms\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
