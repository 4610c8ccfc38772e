# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of a model by the symbols of its fit, in whatever order its terms stand."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from allanite.noise import (
    Estimate,
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    Ramp,
    RandomWalk,
    Sinusoid,
    White,
)
from allanite.noise.parameters import amplitude_symbols, estimate_of, holder_of, with_factor

TERMS = {
    "Q": Quantisation(Q=1e-6),
    "N": White(N=1e-4),
    "B": Flicker(B=2e-5),
    "K": RandomWalk(K=3e-7),
    "R": Ramp(R=1e-9),
    "sigma": GaussMarkov.from_sigma(2e-5, 4.0),
    "sigma_2": GaussMarkov.from_sigma(1e-5, 40.0),
    "amplitude": Sinusoid(amplitude=1e-4, frequency=0.013),
    "amplitude_2": Sinusoid(amplitude=2e-4, frequency=0.007),
}
SLOW, QUICK = TERMS["sigma_2"], TERMS["sigma"]


def test_every_amplitude_belongs_to_the_term_that_it_is_named_after() -> None:
    assert amplitude_symbols(list(TERMS.values())) == list(TERMS)
    for symbol, term in TERMS.items():
        assert holder_of(symbol, list(TERMS.values())) is term


def test_two_gauss_markov_terms_are_told_by_their_times_in_any_order() -> None:
    for terms in itertools.permutations((SLOW, QUICK, TERMS["N"])):
        assert holder_of("sigma", terms) is QUICK is holder_of("T", terms)
        assert holder_of("sigma_2", terms) is SLOW is holder_of("T_2", terms)
        assert dict(zip(amplitude_symbols(terms), terms, strict=True))["sigma_2"] is SLOW


def test_the_slower_term_alone_keeps_its_symbol() -> None:
    assert holder_of("sigma_2", [SLOW]) is SLOW
    gone = Estimate(symbol="sigma", value=None, lower=0.0, upper=1e-5, supported=False)
    kept = Estimate(symbol="sigma_2", value=1e-5, lower=9e-6, upper=1.1e-5, supported=True)
    assert estimate_of(SLOW, NoiseModel(terms=(SLOW,), estimates=(gone, kept))) is kept


def test_what_no_term_holds_belongs_to_none() -> None:
    for symbol in ("K", "sigma", "amplitude", "B_equiv", "T_2"):
        assert holder_of(symbol, [TERMS["N"]]) is None
    assert estimate_of(TERMS["N"], NoiseModel(terms=(TERMS["N"],))) is None
    assert holder_of("amplitude_3", list(TERMS.values())) is None


@pytest.mark.parametrize("symbol", TERMS)
def test_an_amplitude_scales_its_own_term_and_no_other(symbol: str) -> None:
    """The Allan variance of its term is four times as large, that of the rest the same."""
    tau = np.array([0.3, 3.0, 30.0])
    before = tuple(TERMS.values())
    for term, moved, name in zip(before, with_factor(before, symbol, 2.0), TERMS, strict=True):
        expected = 4.0 if name == symbol else 1.0
        assert moved.avar(tau) == pytest.approx(expected * term.avar(tau), rel=1e-12)


def test_another_time_leaves_the_deviation_of_the_term() -> None:
    quick, slow = with_factor((QUICK, SLOW), "T_2", 3.0)
    assert quick is QUICK
    assert isinstance(slow, GaussMarkov)
    assert slow.T == pytest.approx(120.0) and slow.sigma == pytest.approx(1e-5)
    (line,) = with_factor((TERMS["amplitude"],), "frequency", math.e)
    assert isinstance(line, Sinusoid) and line.frequency == pytest.approx(0.013 * math.e)
