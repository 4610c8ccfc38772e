# SPDX-License-Identifier: BSD-3-Clause
"""The functions of allantools: equal numbers, honest errors, and no silence."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from allanite import compat
from allanite.errors import DataQualityError, InputError, LimitError

NAMES = ("adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "totdev")


@pytest.fixture(scope="module")
def rates() -> np.ndarray:
    return np.random.default_rng(20261121).standard_normal(700)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("data_type", ["freq", "phase"])
def test_r4_grids_deviations_and_counts_are_those_of_allantools(
    rates: np.ndarray, name: str, data_type: str
) -> None:
    allantools = pytest.importorskip("allantools")
    for taus in (None, "octave", "decade", "log10", "all", [0.5, 2.0, 16.0]):
        known = getattr(allantools, name)(rates, rate=2.0, data_type=data_type, taus=taus)
        found = getattr(compat, name)(rates, rate=2.0, data_type=data_type, taus=taus)
        # the last lags of a total deviation, beyond half of the record, are left out here
        n = len(found.taus) if name == "totdev" else len(known[0])
        assert len(found.taus) == n
        np.testing.assert_allclose(found.taus, known[0][:n], rtol=1e-12)
        np.testing.assert_allclose(found.devs, known[1][:n], rtol=1e-9)
        np.testing.assert_array_equal(found.ns, known[3][:n])


@pytest.mark.parametrize("data_type", ["freq", "phase"])
def test_r4_theo1_is_that_of_allantools_by_window(rates: np.ndarray, data_type: str) -> None:
    allantools = pytest.importorskip("allantools")
    for taus in (None, [10.0, 64.0, 200.0]):
        known = allantools.theo1(rates, rate=2.0, data_type=data_type, taus=taus)
        found = compat.theo1(rates, rate=2.0, data_type=data_type, taus=taus)
        shown = known[0] >= 5.0  # ten samples: the published definition begins there
        np.testing.assert_allclose(found.taus, known[0][shown])
        np.testing.assert_allclose(found.devs, known[1][shown], rtol=1e-9)
        np.testing.assert_array_equal(found.ns, known[3][shown])
        np.testing.assert_allclose(found.curve.tau, 0.75 * found.taus)
    with pytest.raises(InputError, match="even number of samples, 10 at least"):
        compat.theo1(rates, data_type=data_type, taus=[11.0])
    # what the page says of the named grids: the window as long as the record has one term, and is left out
    known = allantools.theo1(rates[:100], rate=10.0, data_type=data_type, taus="decade")[0]
    found = compat.theo1(rates[:100], rate=10.0, data_type=data_type, taus="decade").taus
    assert (known[-1], found[-1]) == ((10.0, 4.0) if data_type == "freq" else (4.0, 4.0))


def test_r1_r2_published_values() -> None:
    """NBS Monograph 140 and SP 1065: ten points and a thousand."""
    y = np.array([892, 809, 823, 798, 671, 644, 883, 903, 677])
    for name, expected in (("adev", 115.8082107), ("oadev", 85.95286984), ("mdev", 74.78849343)):
        assert getattr(compat, name)(y, data_type="freq", taus=[2]).devs[0] == pytest.approx(
            expected, rel=1e-9
        )
    n, z = 1234567890, []
    for _ in range(1000):
        z.append(n / 2147483647)
        n = 16807 * n % 2147483647
    for name, expected in (("hdev", 0.1052754194), ("ohdev", 0.09581083173), ("totdev", 0.09134743262)):
        assert getattr(compat, name)(z, data_type="freq", taus=[10]).devs[0] == pytest.approx(
            expected, rel=1e-9
        )


def test_four_arrays_unpack_and_carry_their_intervals(rates: np.ndarray) -> None:
    found = compat.oadev(rates, data_type="freq")
    taus, devs, errors, ns = found
    assert len(found) == 4 and taus is found.taus and ns is found.ns
    np.testing.assert_array_equal(ns, 700 - 2 * taus + 1)
    assert np.all((found.lower < devs) & (devs < found.upper))
    narrow = found.interval(0.68)
    assert np.all((found.lower < narrow[0]) & (narrow[1] < found.upper))
    assert np.all(errors > 0)
    with pytest.raises(InputError, match="between 0 and 1"):
        found.interval(95)


def test_errors_are_the_spread_of_the_estimates() -> None:
    """Over 300 records of white noise the spread agrees with the mean error within 5 standard errors (4 %) and 5 %.

    allantools says devs/sqrt(ns), here more than 3 times too small at a quarter of the record.
    """
    rng = np.random.default_rng(3)
    found = [compat.oadev(rng.standard_normal(256), data_type="freq", taus=[1, 8, 64]) for _ in range(300)]
    devs, errors = np.array([f.devs for f in found]), np.array([f.errors for f in found])
    ratio = devs.std(axis=0) / errors.mean(axis=0)
    np.testing.assert_allclose(ratio, 1.0, atol=5 / math.sqrt(600) + 0.05)
    assert devs[:, 2].std() > 3 * np.mean(devs[:, 2] / np.sqrt(found[0].ns[2]))


def test_errors_hold_at_any_number_of_degrees_of_freedom() -> None:
    """Against forty digits: 1e-9 from a tenth of a degree of freedom to 1e12, where sd/mean is sqrt(1/(2 n))."""
    mpmath = pytest.importorskip("mpmath")
    edf = np.concatenate([np.geomspace(0.1, 1e12, 53), [29.999, 30.0, 30.001]])
    with mpmath.workdps(40):
        halves = [mpmath.mpf(float(e)) / 2 for e in edf]
        means = [mpmath.exp(mpmath.loggamma(h + 0.5) - mpmath.loggamma(h)) / mpmath.sqrt(h) for h in halves]
        right = np.array([float(mpmath.sqrt(1 / m**2 - 1)) for m in means])
    np.testing.assert_allclose(compat._relative_sd(edf), right, rtol=1e-9)
    assert compat._relative_sd(np.array([1e8]))[0] == pytest.approx(math.sqrt(0.5e-8), rel=1e-8)


def test_gaps_cost_the_terms_that_touch_them_and_nothing_else() -> None:
    """A tenth of the samples missing: the deviation of white noise stays within its interval (99.99 %)."""
    y = np.random.default_rng(4).standard_normal(20_000)
    y[3000:5000] = np.nan
    found = compat.oadev(y, data_type="freq", taus=[1, 10, 100], gaps=True)
    whole = compat.oadev(np.nan_to_num(y), data_type="freq", taus=[1, 10, 100])
    np.testing.assert_array_equal(whole.ns - found.ns, 2000 + 2 * found.taus - 1)
    low, high = found.interval(0.9999)
    truth = 1 / np.sqrt(found.taus)
    assert np.all((low < truth) & (truth < high))
    phase = np.concatenate([[0.0], np.cumsum(np.nan_to_num(y))])
    phase[3001:5000] = np.nan
    of_phase = compat.oadev(phase, data_type="phase", taus=[1], gaps=True)
    assert of_phase.ns[0] == found.ns[0]


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({}, InputError, "data_type='freq' for rates"),
        ({"data_type": "rate"}, InputError, "must be 'freq' or 'phase'"),
        ({"data_type": "freq", "taus": []}, InputError, "positive seconds"),
        ({"data_type": "freq", "taus": [-1.0]}, InputError, "positive seconds"),
        ({"data_type": "freq", "taus": [1.5]}, InputError, "not a whole number of samples"),
        ({"data_type": "freq", "taus": [400.0]}, InputError, "longer than the record"),
        ({"data_type": "freq", "taus": [2.0, 2.0]}, InputError, "given twice"),
        ({"data_type": "freq", "taus": "many"}, InputError, "'octave', 'decade'"),
        ({"data_type": "freq", "rate": 0.0}, InputError, "finite and positive"),
        ({"data_type": "freq", "rate": "1"}, InputError, "number of samples per second"),
    ],
)
def test_what_allantools_accepts_in_silence_is_refused(
    rates: np.ndarray, options: dict[str, object], error: type[Exception], words: str
) -> None:
    with pytest.raises(error, match=words):
        compat.oadev(rates, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["oadev", "theo1"])
@pytest.mark.parametrize("taus", [["a"], [16j], [16 + 1j], [None], ["16"]])
def test_averaging_times_that_are_no_numbers_are_refused(
    rates: np.ndarray, name: str, taus: list[object]
) -> None:
    with pytest.raises(InputError, match="numbers of seconds"):
        getattr(compat, name)(rates, data_type="freq", taus=taus)


def test_unsound_samples_are_refused(rates: np.ndarray) -> None:
    holed, loud = rates.copy(), rates.copy()
    holed[17], loud[23] = np.nan, np.inf
    for data, words in (
        (holed, "1 of 700 samples are NaN, the first is number 17"),
        (loud, "sample number 23 is inf"),
        (rates[:2], "at least 3"),
        (np.ma.masked_greater(rates, 2.0), "samples are NaN"),
    ):
        with pytest.raises(DataQualityError, match=words):
            compat.oadev(data, data_type="freq")
    for wrong in (rates.reshape(350, 2), rates * 1j, ["a", "b", "c"]):
        with pytest.raises(InputError):
            compat.oadev(wrong, data_type="freq")
    with pytest.raises(InputError, match="total deviation"):
        compat.totdev(holed, data_type="freq", gaps=True)
    with pytest.raises(LimitError, match="log10"):
        compat.oadev(np.zeros(300_000) + np.arange(300_000) % 2, data_type="freq", taus="all")


def test_r3_stable32_phase(real_data: Callable[[str], Path]) -> None:
    """PHASE.DAT: all statistics at octaves, to the printed digits."""
    folder = real_data("allantools_stable32/phasedat")
    x = np.loadtxt(folder / "PHASE.DAT")
    for name in NAMES:
        table = np.genfromtxt(folder / f"phase_dat_{name}_octave.txt")
        found = getattr(compat, name)(x, rate=1.0, data_type="phase", taus=table[:, 1])
        np.testing.assert_allclose(found.devs, table[:, 5], rtol=1e-4)
        np.testing.assert_array_equal(found.ns, table[:, 2])
