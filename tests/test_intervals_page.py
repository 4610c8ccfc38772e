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


def scenarios(name):
    """Scenarios of a coverage run."""
    return results(name)["scenarios"]


def covered(name):
    """Least and greatest coverage of two-sided sets."""
    shares = [p["coverage"] for s in scenarios(name) for p in s["parameters"] if not p["one_sided"]]
    return f"{100 * min(shares):.1f} to {100 * max(shares):.1f} %"


def records(name):
    """How many a coverage run has of each scenario."""
    return {s["name"]: s["records"] for s in scenarios(name)}


def test_coverage_of_both_fits(page):
    assert f"covered the truth in {covered('likelihood_coverage')} of records by the samples" in page
    assert f"and in {covered('coverage')} by the curve" in page
    declared = [
        share
        for name in ("coverage", "likelihood_coverage")
        for scenario in scenarios(name)
        for term, share in scenario["false"].items()
        if "instead" not in term
    ]
    assert f"terms that are absent were declared in at most {100 * max(declared):.1f} %" in page
    wide = [p["coverage"] for s in scenarios("coverage") for p in s["parameters"] if not p["passes"]]
    assert (
        f"wider than necessary where samples are missing ({100 * min(wide):.1f} to {100 * max(wide):.0f} %"
        in page
    )
    assert {s["name"] for s in scenarios("coverage") if any(not p["passes"] for p in s["parameters"])} == {
        "10 % missing",
        "40 % missing",
    }
    assert all(p["passes"] for s in scenarios("likelihood_coverage") for p in s["parameters"])
    assert len(scenarios("likelihood_coverage")) == 14 and "Fourteen scenarios" in page
    assert [s["name"] for s in scenarios("likelihood_coverage") if s["given"]] == ["two Gauss-Markov terms"]
    for name in ("coverage", "likelihood_coverage"):
        of = records(name)
        week, tenth, more = (of.pop(s) for s in ("seed's sensor, 7 days", "10 % missing", "40 % missing"))
        (many,) = set(of.values())
        assert (
            f"{many} records of each ({week} of the week, {tenth} with 10 % missing, {more} with 40 %)"
            in page
        )


def test_errors_over_the_bound(page):
    (rows,) = (rows for rows in results("default_fits").values() if isinstance(rows, list))
    row = {(r["scenario"], r["parameter"]): r for r in rows}

    def span(method):
        ratios = [r[f"{method}, rms over bound{' where supported' * (method == 'samples')}"] for r in rows]
        return f"{min(ratios):.2f} to {max(ratios):.2f} times the"

    assert f"with the terms given, {span('terms given')} Cramér-Rao bound" in page
    assert f"those of supported terms are {span('samples')} bound" in page
    withheld = 1 - row["white + flicker + walk, long", "B"]["samples, supported"]
    assert f"explains the record as well: flicker in {100 * withheld:.0f} % of days of white noise" in page
    k, gaps = row["seed's sensor, 24 h", "K"], row["10 % missing", "K"]
    by_curve, by_samples = 100 * k["curve, supported"], 100 * k["samples, supported"]
    assert f"in {by_curve:.0f} % of days, the samples in {by_samples:.0f} %" in page
    assert f"in {100 * gaps['curve, supported']:.0f} %:" in page


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


def test_coverage_of_other_statistics():
    text = (ROOT / "docs" / "explanation" / "which-statistic.md").read_text(encoding="utf-8")
    tables = [
        (heading, row)
        for heading, rows in results("statistics").items()
        if heading.startswith("Coverage of 68.27 % intervals under")
        for row in rows
    ]

    def shares(row):
        return [100 * share for lag, share in row.items() if lag.startswith("m =")]

    gated = [(row, shares(row)) for _, row in tables if row["passes"] is not None]
    below = [min(held) for row, held in gated if not row["passes"]]
    every = [share for _, held in gated for share in held]
    (rest,) = (shares(row) for _, row in tables if row["passes"] is None)
    assert {row["records"] for _, row in tables} == {10_000}
    assert f"held in {min(every):.1f} to {max(every):.1f} %; TheoBR alone" in " ".join(text.split())
    assert {heading for heading, row in tables if row["passes"] is False} == {
        "Coverage of 68.27 % intervals under the model, theobr"
    }
    assert f"{below[1]:.1f} % in a random walk and {below[0]:.1f} % in white noise" in " ".join(text.split())
    assert f"held in {rest[-1]:.1f} % at the longest" in text


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
