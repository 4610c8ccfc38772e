# SPDX-License-Identifier: BSD-3-Clause
"""Every number of docs/explanation/intervals.md, from committed results, closed forms or exact covariances."""

import json
import math
from pathlib import Path

import pytest
from scipy.stats import chi2

from allanite.noise import Flicker, NoiseModel, RandomWalk, White
from allanite.noise.allan import covariance

ROOT = Path(__file__).parents[1]
N = 1024


@pytest.fixture(scope="module")
def page() -> str:
    text = (ROOT / "docs" / "explanation" / "intervals.md").read_text(encoding="utf-8")
    return " ".join(text.split())


def results(name):
    return json.loads((ROOT / "verification" / "results" / f"{name}.json").read_text(encoding="utf-8"))


def parameters(name):
    """Rows of a coverage run, with the name of their scenario."""
    return [(scenario["name"], p) for scenario in results(name)["scenarios"] for p in scenario["parameters"]]


def covered(name):
    """Least and greatest coverage of two-sided sets."""
    shares = [p["coverage"] for _, p in parameters(name) if not p["one_sided"]]
    return f"{100 * min(shares):.1f} to {100 * max(shares):.1f} %"


def over_bound(name):
    """Errors over the Cramer-Rao bound, where the record shows the term."""
    return {
        (scenario, p["symbol"]): p["rms"] / p["bound"]
        for scenario, p in parameters(name)
        if not p["one_sided"] and p["rms"] and p["bound"]
    }


def test_coverage_and_errors_of_both_fits(page):
    assert f"covered the truth in {covered('coverage')} of records" in page
    assert f"covered in {covered('likelihood_coverage')}" in page
    declared = [
        share
        for scenario in results("coverage")["scenarios"]
        for term, share in scenario["false"].items()
        if "instead" not in term
    ]
    assert f"absent terms were declared in at most {100 * max(declared):.1f} %" in page
    moments = over_bound("coverage")
    week = [ratio for (scenario, _), ratio in moments.items() if scenario == "seed's sensor, 7 days"]
    assert f"{min(week):.2f} to {max(week):.2f} times the Cramér-Rao bound" in page
    k_in_a_day = moments.pop(("seed's sensor, 24 h", "K"))
    assert f"up to {max(moments.values()):.2f} times, and {k_in_a_day:.1f} times for K in a day" in page
    assert f"up to {max(over_bound('likelihood_coverage').values()):.2f} times the bound" in page


def test_errors_of_fits_that_are_given_nothing(page):
    (rows,) = (rows for rows in results("default_fits").values() if isinstance(rows, list))
    row = {(r["scenario"], r["parameter"]): r for r in rows}
    assert {r["records"] for r in rows} == {60, 30} and "Sixty records" in page and "(30 of the week)" in page

    def span(method):
        ratios = [r[f"{method}, rms over bound{' where supported' * (method == 'samples')}"] for r in told]
        return f"{min(ratios):.2f} to {max(ratios):.2f} times the bound"

    told = [r for r in rows if r["scenario"] != "a spectral line"]
    assert f"the fit of the samples are {span('terms given')}" in page
    assert f"supported terms are {span('samples')}" in page
    withheld = 1 - row["white + flicker + walk, long", "B"]["samples, supported"]
    assert f"Flicker is withheld in {100 * withheld:.0f} % of days of white noise" in page
    k, gaps = row["seed's sensor, 24 h", "K"], row["10 % missing", "K"]
    by_curve, by_samples = 100 * k["curve, supported"], 100 * k["samples, supported"]
    assert f"in {by_curve:.0f} % of days, the samples in {by_samples:.0f} %" in page
    assert f"in {100 * gaps['curve, supported']:.0f} %." in page
    assert f"holds in {100 * row['a spectral line', 'N']['covered']:.0f} %" in page


def test_sets_of_n_miss_on_one_side(page):
    sensors = results("sensors")
    (held,) = (row for row in sensors["Coverage of sets at five levels"] if row["coefficient"] == "N")
    (ranks,) = (
        row for row in sensors["Ranks of coefficients that every set resolves"] if row["coefficient"] == "N"
    )
    below, above = ranks["2.5 %"], 1 - ranks["97.5 %"]
    assert f"in {100 * held['95 %']:.1f} % of {held['records']} [sensors" in page
    assert f"above the set in {100 * above:.2f} % and below it in {100 * below:.2f} %" in page
    assert f"sets of {held['records']} sensors" in page


def test_numbers_of_records(page):
    for name, words in (
        ("coverage", "In 500 records"),
        ("likelihood_coverage", "run with 2000 records each"),
    ):
        assert {scenario["records"] for scenario in results(name)["scenarios"]} == {
            int(words.split()[1 if "In" in words else 2])
        }
        assert words in page
    assert len(results("coverage")["scenarios"]) == 9 and "nine scenarios" in page
    assert len(results("likelihood_coverage")["scenarios"]) == 14 and "Fourteen scenarios" in page


def test_the_naive_error_bar(page):
    """By the chi-square law of the deviation: white noise of 1024 samples."""

    def coverage(m):
        edf = covariance.edf(NoiseModel.of(White(N=1.0)), [m], N, 1.0, "mean")[0]
        naive = 1 / math.sqrt(N - 2 * m + 1)
        return chi2.cdf(edf / (1 - naive) ** 2, edf) - chi2.cdf(edf / (1 + naive) ** 2, edf)

    assert f"{100 * coverage(16):.0f} % at m = 16, and {100 * coverage(N // 4):.0f} % at a quarter" in page


def test_the_chi_square_form_at_long_lags(page):
    rows = results("battery")["U4: 68.27 % interval at the longest lags of 1024 samples"]
    shares = [row["coverage"] for row in rows]
    assert f"slightly wide ({100 * min(shares):.0f} to {100 * max(shares):.0f} %)" in page


def test_one_degree_of_freedom(page):
    mean, median = math.sqrt(2 / math.pi), math.sqrt(chi2.ppf(0.5, 1))
    assert f"its mean is {mean:.3f} of the true value and its median {median:.3f}" in page
    low, high = 1 / math.sqrt(chi2.ppf(0.975, 1)), 1 / math.sqrt(chi2.ppf(0.025, 1))
    assert f"the 95 % interval is {low:.2f} to {high:.0f} times the deviation" in page


def test_correlations_of_neighbours(page):
    def correlation(model, lags):
        C = covariance.covariance(model, covariance.lag_pairs(lags, 20_000), 1.0, "mean")
        return C[0, 1] / math.sqrt(C[0, 0] * C[1, 1])

    assert f"Neighboring lags correlate at {correlation(NoiseModel.of(White(N=1.0)), [100, 101]):.4f}" in page
    octave = [
        correlation(NoiseModel.of(term), [m, 2 * m])
        for term in (White(N=1.0), Flicker(B=1.0), RandomWalk(K=1.0))
        for m in (1, 16, 256)
    ]
    assert f"octave lags at {min(octave):.2f} to {max(octave):.2f}" in page
