# SPDX-License-Identifier: BSD-3-Clause
"""One choice of units for all that a command prints."""

import re

import numpy as np
import pytest
from verification.simulators import gauss_markov

import allanite as al
from allanite.quantities.display_units import display_unit, read_in_si, si_unit
from allanite.views.terminal.page import show_document, show_models
from allanite.views.terminal.style import TerminalStyle

KINDS = ("rate", "angle", "acceleration", "velocity", "voltage", "phase", "frequency", "counts")
SYMBOLS = ("Q", "N", "B", "K", "R", "q", "sigma", "T", "sigma_2", "amplitude", "adev", "mean", "sd")
READ_BY_PEOPLE = re.compile(r"deg|µg|arcsec|√h|/h\b")


@pytest.fixture(scope="module", params=["rad/s", "m/s^2"])
def undecided(request: pytest.FixtureRequest) -> al.Study:
    """A channel of which both families are shown."""
    for seed in range(20):
        rng = np.random.default_rng([20261128, seed])
        y = 2e-4 * np.sqrt(10.0) * rng.standard_normal(6000) + gauss_markov(rng, 6000, 1e-4, 200.0)
        study = al.characterize(al.Recording.from_rate(y, rate=10.0, unit=request.param, names="x"))
        if len(study.channels[0].models) == 2:
            return study
    raise AssertionError("no record of these is undecided")


@pytest.mark.parametrize("kind", KINDS)
def test_read_in_si_is_si_for_every_coefficient_and_ends(kind: str) -> None:
    for symbol in SYMBOLS:
        usual = display_unit(kind, symbol, "counts")
        with read_in_si(True):
            text, factor = display_unit(kind, symbol, "counts")
            assert factor == 1.0
            assert not READ_BY_PEOPLE.search(text)
            if kind in ("rate", "angle", "acceleration", "velocity"):
                assert text == si_unit(kind, symbol)
        assert display_unit(kind, symbol, "counts") == usual


@pytest.mark.parametrize("details", [False, True])
def test_all_that_is_printed_is_in_si_if_asked(
    undecided: al.Study, details: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    show_document(undecided, style=TerminalStyle(si=False, details=details))
    assert READ_BY_PEOPLE.search(capsys.readouterr().out)
    show_document(undecided, style=TerminalStyle(si=True, details=details))
    printed = capsys.readouterr().out
    assert "cannot decide between two models" in " ".join(printed.split())
    assert not READ_BY_PEOPLE.search(printed), printed
    show_models(undecided.channels, style=TerminalStyle(si=True))
    assert not READ_BY_PEOPLE.search(capsys.readouterr().out)
