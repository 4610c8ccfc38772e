# SPDX-License-Identifier: BSD-3-Clause
"""Selection of terms: prices against theory, recovery of known sets, the search against all sets, honest intervals."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom, chi2, norm

import allanite as al
from allanite.errors import DataQualityError, InputError
from allanite.fitting.likelihood import LikelihoodProblem
from allanite.fitting.scale import with_scale_uncertainty
from allanite.fitting.selection import PRICE, Selection, line_price, select
from allanite.fitting.selection.averaging import averaged
from allanite.fitting.selection.lines import gains_of
from allanite.fitting.selection.search import TermSearch, all_sets, named, neighbours
from allanite.noise import Flicker, GaussMarkov, NoiseModel, Quantisation, RandomWalk, TermType, White
from allanite.recording.records import Recording

WHITE = White(N=1.0)


def record(*terms: TermType, n: int = 8192, seed: int = 1) -> Recording:
    return al.simulate(NoiseModel.of(*terms), rate=1.0, duration=float(n), seed=seed)


def with_line(amplitude: float, n: int = 4096) -> Recording:
    made = record(WHITE, n=n, seed=5)
    y = made.values(made.names[0]) + amplitude * np.sin(2 * np.pi * 0.1234 * np.arange(n) + 0.3)
    return Recording.from_rate(y, rate=1.0, unit="rad/s", names=["gyro"])


@pytest.fixture(scope="module")
def walking() -> Selection:
    return select(record(WHITE, RandomWalk(K=0.05), n=4096, seed=2))


# -- prices -----------------------------------------------------------------------------------------------


def test_prices_are_the_one_percent_points_of_absent_terms() -> None:
    assert 0.5 * chi2.sf(PRICE["K"], 1) == pytest.approx(0.01, rel=2e-3)  # half of the records gain nothing
    assert chi2.sf(PRICE["R"], 1) < 0.01  # slow noise has a slope too
    # its limit of long times is a random walk: on that it gains another half of a chi-square
    assert 0.5 * chi2.sf(PRICE["G"] - PRICE["K"], 1) == pytest.approx(0.01, rel=2e-3)


@pytest.mark.long
def test_an_absent_walk_gains_half_a_chi_square() -> None:
    gains = []
    for seed in range(40):
        problem = LikelihoodProblem.of(record(WHITE, n=1024, seed=seed))
        few, more = (problem.maximum(k).log_likelihood for k in (("N",), ("N", "K")))
        gains.append(2 * (more - few))
    assert min(gains) > -1e-4  # a set never loses by a term more
    idle = sum(g < 1e-3 for g in gains)
    assert idle >= binom.ppf(1e-4, 40, 0.5)
    assert sum(g > 2.71 for g in gains) <= binom.ppf(1 - 1e-4, 40, 0.05)


def test_the_price_of_a_line_is_paid_by_white_noise_once_in_a_hundred() -> None:
    n, runs = 256, 6000
    noise = np.random.default_rng(3).standard_normal((runs, n))
    power = 2 * np.abs(np.fft.rfft(noise, 8 * n, axis=1)[:, 8:-8]) ** 2 / n
    paid = int((power.max(axis=1) > line_price(n / 2)).sum())
    assert binom.ppf(1e-4, runs, 0.005) <= paid <= binom.ppf(1 - 1e-4, runs, 0.01)
    x = line_price(1000)
    assert 1000 * math.sqrt(math.pi * x / 6) * math.exp(-x / 2) == pytest.approx(0.01, rel=1e-9)


# -- the right set ----------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize(
    ("truth", "terms", "n"),
    [
        ("NB", (WHITE, Flicker(B=0.5)), 8192),
        ("NG", (WHITE, GaussMarkov.from_sigma(1.0, 100.0)), 8192),
        ("NGG", (White(N=0.5), GaussMarkov.from_sigma(1.0, 20.0), GaussMarkov.from_sigma(2.0, 800.0)), 65536),
        ("QNK", (Quantisation(Q=1.0, dt=1.0), WHITE, RandomWalk(K=0.05)), 8192),
    ],
)
def test_known_sets_come_first(truth: str, terms: tuple[TermType, ...], n: int) -> None:
    found = select(record(*terms, n=n, seed=1))  # an absent term is taken on in one record out of twenty
    assert "".join(found.best.letters) == truth and found.shortest == 1.0
    presence = found.presence()
    assert all(presence[s] > 0.8 for s in truth)
    assert all(presence[s] < 0.5 for s in "QBKRG" if s not in truth)
    assert sum(c.weight for c in found.candidates) == pytest.approx(1.0, abs=0.05)


def test_the_search_finds_the_best_of_all_sets() -> None:
    """Every set with at most one Gauss-Markov term, and those with two the search itself came by."""
    search = TermSearch(
        LikelihoodProblem.of(record(WHITE, Flicker(B=0.3), RandomWalk(K=0.02), n=1024, seed=4))
    )
    best = search.best()
    others = [k for k in all_sets() if k.count("G") < 2]
    assert len(all_sets()) == 94 and len(others) == 62
    assert search.score(best) >= max(search.score(k) for k in others) - 1e-6


def test_sets_one_step_away() -> None:
    assert ("N", "G") in neighbours(("N", "B")) and ("N",) in neighbours(("N", "B"))
    assert ("N", "B", "G") in neighbours(("N", "B")) and ("R",) not in neighbours(("N", "R"))
    assert all(k in all_sets() for k in neighbours(("N", "G", "G", "K")))
    assert named(("N",)) == "white noise"


@pytest.mark.long
def test_unit_and_sign_do_not_matter(walking: Selection) -> None:
    y = walking.recording.values(walking.recording.names[0])
    other = select(Recording.from_rate(-1e-7 * y, rate=1.0, unit="rad/s"))
    assert other.best.letters == walking.best.letters
    scores = {c.letters: c.score for c in other.candidates}
    for candidate in walking.candidates[:5]:
        assert scores[candidate.letters] == pytest.approx(candidate.score, abs=0.01)
    assert other.best.maximum.parameters["K"] == pytest.approx(
        1e-7 * walking.best.maximum.parameters["K"], rel=1e-3
    )


def test_verdict_names_terms_and_rivals(walking: Selection) -> None:
    terms, _, stand_ins = walking.verdict.partition(". ")
    assert terms == "The record has white noise and random walk, and needs no other term"
    assert stand_ins.startswith("A Gauss-Markov term with T above")
    assert walking.sure and walking.explained
    first, second = walking.candidates[0], replace(walking.candidates[1], letters=("N", "B"), weight=0.4)
    torn = replace(walking, candidates=(replace(first, weight=0.5), second))
    assert not torn.sure
    assert "white noise and random walk (50% of the weight)" in torn.verdict
    assert "it may be white noise and flicker (40%)" in torn.verdict
    open_ = replace(walking, candidates=(first, replace(second, letters=("N", "B", "K"))))
    assert "it may also have flicker (40%)" in open_.verdict


# -- lines ------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_line_is_a_term_if_it_pays() -> None:
    found = select(with_line(0.2), lines=[0.1234, 0.31])
    (kept, left_out) = found.lines
    assert kept.kept and kept.frequency == pytest.approx(0.1234, abs=2e-5) and not left_out.kept
    # 2 ln L of a sinusoid in white noise: n A^2/(2 sigma^2), with a standard deviation of twice the root of that
    shrunk = 0.2**2 * 4096 / 2
    assert abs(kept.gain - shrunk) < 4 * 2 * math.sqrt(shrunk)
    assert kept.price == left_out.price == line_price(6)
    assert found.best.words == "white noise" and len(found.model.terms) == 2
    (seen,) = select(with_line(0.5), lines="auto").lines
    assert seen.kept and seen.price == line_price(2048)


def test_lines_may_be_an_array_and_a_record_short() -> None:
    said: list[str] = []
    found = select(with_line(0.2), lines=np.array([0.1234]), progress=lambda _, what: said.append(what))
    assert [line.kept for line in found.lines] == [True] and "looking for lines" not in said
    short = Recording.from_rate(np.random.default_rng(4).standard_normal(8), rate=1.0, unit="rad/s")
    assert select(short).candidates


@pytest.mark.parametrize(("apart", "period"), [(0.0005, 0), (0.05, 0), (0.01, 100)])
def test_gains_are_those_of_lines_that_are_fitted_anew(apart: float, period: int) -> None:
    """Lines a few widths apart, or as far as gaps come again, share what one of them leaves; others do not."""
    k, tones = np.arange(8192), (0.1234, 0.1234 + apart)
    y = np.random.default_rng(8).standard_normal(8192) + sum(0.2 * np.sin(2 * np.pi * f * k) for f in tones)
    if period:
        y[k % period >= period // 2] = np.nan
    problem = LikelihoodProblem.of(Recording.from_rate(y, rate=1.0, unit="rad/s")).with_lines(tones)
    whole = problem.maximum(("N",)).log_likelihood
    anew = [2 * (whole - problem.with_lines([f]).maximum(("N",)).log_likelihood) for f in tones[::-1]]
    assert gains_of(problem, ("N",)) == pytest.approx(anew, abs=1e-3 * max(anew))


# -- intervals --------------------------------------------------------------------------------------------


def test_intervals_are_quantiles_of_the_mixture(walking: Selection) -> None:
    best = walking.best.maximum
    at = best.covariance["symbols"].index("K")
    value, sd = best.parameters["K"], math.sqrt(best.covariance["matrix"][at][at])
    alone = {e.symbol: e for e in averaged([best], [1.0])}["K"]
    assert (alone.lower, alone.upper) == pytest.approx(
        (value * math.exp(-1.96 * sd), value * math.exp(1.96 * sd)), rel=1e-3
    )
    without = replace(best, parameters={"N": 1.0}, covariance={})
    doubted = {e.symbol: e for e in averaged([best, without], [0.9, 0.1])}["K"]
    assert not doubted.supported and doubted.value is None and doubted.lower == 0.0
    assert doubted.upper == pytest.approx(value * math.exp(sd * norm.ppf((0.975 - 0.1) / 0.9)), rel=1e-6)
    shifted = replace(best, parameters={**best.parameters, "K": 3 * value})
    wide = {e.symbol: e for e in averaged([best, shifted], [0.6, 0.4])}["K"]
    assert wide.lower < value and wide.upper > 3 * value and wide.supported


def test_the_model_is_that_of_the_best_set(walking: Selection) -> None:
    model = walking.model
    assert [e.symbol for e in model.estimates] == ["N", "K"] and model.goodness["p"] > 1e-3
    assert al.NoiseModel.from_json(model.to_json()).terms == model.terms
    for e, truth in zip(model.estimates, (1.0, 0.05), strict=True):
        assert e.lower < truth < e.upper


def test_the_uncertainty_of_the_scale_factor_is_in_the_intervals(walking: Selection) -> None:
    known = walking.recording
    unsure = replace(known, channels=tuple(replace(c, scale_uncertainty=0.1) for c in known.channels))
    scaled = replace(walking, recording=unsure).model
    assert scaled == with_scale_uncertainty(walking.model, 0.1) and scaled.scale_uncertainty == 0.1
    for e, alone in zip(scaled.estimates, walking.model.estimates, strict=True):
        assert e.lower < alone.lower < alone.upper < e.upper and e.statistical == (alone.lower, alone.upper)


def test_refusals(walking: Selection) -> None:
    made = walking.recording
    with pytest.raises(InputError, match="'auto'"):
        select(made, lines="all")  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"above 0 and up to 0\.5 Hz"):
        select(made, lines=[0.7])
    with pytest.raises(InputError, match="confidence"):
        select(made, confidence=1.0)
    with pytest.raises(InputError, match="leave out"):
        select(LikelihoodProblem.of(made), lines=[0.1])
    with pytest.raises(InputError, match="list of frequencies"):
        select(LikelihoodProblem.of(made), lines="all")  # type: ignore[arg-type]
    with pytest.raises(InputError):
        select(made, channel="nowhere")
    with pytest.raises(DataQualityError, match="usable samples"):
        select(Recording.from_rate(np.arange(5.0), rate=1.0, unit="rad/s"))


def test_flicker_beside_a_gauss_markov_term_may_be_more_of_them(walking: Selection) -> None:
    """Three of them look like one and flicker; no set that is tried has three."""
    words = "may be the sum of further Gauss-Markov terms"
    best = replace(walking.best, letters=("N", "B", "G"))
    assert words in replace(walking, candidates=(best, *walking.candidates[1:])).verdict
    assert words not in walking.verdict
