# SPDX-License-Identifier: BSD-3-Clause
"""Deviation over time: windows against plain sums, their covariance against theory and simulation, changes found."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import allanite as al
from allanite.errors import DataQualityError, InputError
from allanite.noise import Flicker, GaussMarkov, NoiseModel, Quantisation, Ramp, RandomWalk, White
from allanite.noise.allan.cells import AllanCells, cell_covariance, cells_of
from allanite.noise.allan.covariance import edf
from allanite.noise.allan.statistics import phase_of
from allanite.quantities.distributions import chi_square_tail
from allanite.recording.records import Recording
from allanite.stability.variation import VariationVerdict, changes, examine_variation
from allanite.stability.variation.constancy import (
    Whitened,
    WindowScatter,
    excess_kurtosis,
    together,
    window_scores,
)
from allanite.stability.variation.estimation import _change
from allanite.stability.variation.remarks import remarks
from allanite.stability.variation.shapes import (
    ChangeShape,
    _shares,
    doubt_of_effect,
    doubts_of,
    effect_of,
    shares_of,
)
from allanite.stability.variation.sizes import FoundChange, Misfit, _deviations, _hansen, _minimum, ratio_of
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import TableBlock
from allanite.views.variation import view
from noise_records import binomial_bound

WHITE = NoiseModel.of(White(N=1.0))
SLOW = NoiseModel.of(White(N=1.0), Flicker(B=0.1), RandomWalk(K=1e-3))


def record(y: np.ndarray, rate: float = 1.0) -> Recording:
    return Recording.from_rate(y, rate=rate, unit="rad/s", names=["gyro"])


def noise(model: NoiseModel, n: int, seed: int) -> np.ndarray:
    made = al.simulate(model, rate=1.0, duration=float(n), seed=seed)
    return made.values(made.names[0]).copy()


def cells_by_hand(y: np.ndarray, m: int, length: int) -> list[tuple[int, float]]:
    """Count and mean of the terms whose centre lies in each window, by the definition."""
    x = np.concatenate(([0.0], np.cumsum(np.nan_to_num(y))))
    bad = np.concatenate(([0], np.cumsum(np.isnan(y))))
    found = []
    for start in range(0, len(y), length):
        terms = [
            (x[i + 2 * m] - 2 * x[i + m] + x[i]) ** 2 / (2 * m * m)
            for i in range(len(y) - 2 * m + 1)
            if start <= i + m < start + length and bad[i + 2 * m] == bad[i]
        ]
        found.append((len(terms), float(np.mean(terms)) if terms else math.nan))
    return [cell for cell in found if cell[0]]


@pytest.mark.parametrize("gaps", [(), (slice(0, 3), slice(150, 152), slice(300, 420))], ids=["whole", "gaps"])
def test_windows_are_the_sums_of_the_definition_and_add_up_to_the_curve(gaps: tuple[slice, ...]) -> None:
    y = noise(SLOW, 700, 1)
    for gap in gaps:
        y[gap] = np.nan
    cells = cells_of(phase_of(record(y), "gyro"), [1, 4, 8], [64, 64, 128])
    for row, (m, length) in enumerate(((1, 64), (4, 64), (8, 128))):
        here = cells.row == row
        wanted = cells_by_hand(y, m, length)
        assert cells.count[here].tolist() == [count for count, _ in wanted]
        np.testing.assert_allclose(cells.variance[here], [mean for _, mean in wanted], rtol=1e-9)
    curve = al.allan_curve(record(y), taus=[1.0, 4.0, 8.0])
    np.testing.assert_allclose(cells.whole, curve.variance[:, 0], rtol=1e-12)


@pytest.mark.parametrize(
    "model",
    [
        WHITE,
        NoiseModel.of(RandomWalk(K=0.1)),
        NoiseModel.of(Flicker(B=1.0)),
        NoiseModel.of(White(N=1.0), GaussMarkov.from_sigma(0.5, 40.0)),
        NoiseModel.of(White(N=1.0), Ramp(R=1e-3)),
        NoiseModel.of(Quantisation(Q=1.0, dt=1.0), White(N=0.2)),
    ],
    ids=["white", "walk", "flicker", "Gauss-Markov", "ramp", "quantisation"],
)
def test_covariance_of_windows_adds_up_to_that_of_the_whole_record(model: NoiseModel) -> None:
    lags = [1, 2, 8, 32, 128]
    cells = cells_of(phase_of(record(noise(WHITE, 4096, 2)), "gyro"), lags, [128, 128, 128, 128, 512])
    V = cell_covariance(cells, model, 4096, 1.0, "mean")
    assert np.allclose(V, V.T)
    for row, m in enumerate(lags):
        weight = np.where(cells.row == row, cells.count, 0) / cells.count[cells.row == row].sum()
        expected = edf(model, [m], 4096, 1.0, "mean")[0]
        mean = float(model.avar_sampled(float(m), 1.0, "mean"))
        assert 2 * mean**2 / (weight @ V @ weight) == pytest.approx(expected, rel=1e-6)


def test_covariance_of_neighbouring_windows_is_that_of_the_plain_double_sum() -> None:
    m, length, n = 4, 16, 96
    cells = cells_of(phase_of(record(noise(WHITE, n, 3)), "gyro"), [m], [length])
    V = cell_covariance(cells, WHITE, n, 1.0, "mean")
    w = np.repeat([1.0, -1.0], m) / m / math.sqrt(2)  # d of white noise as a filter of the samples
    for a in range(3):
        for b in range(3):
            i = np.arange(cells.first[a], cells.last[a])[:, None]
            j = np.arange(cells.first[b], cells.last[b])
            r = np.correlate(w, w, "full")
            k = np.clip(j - i + 2 * m - 1, -1, 4 * m - 1)
            square = np.where((k >= 0) & (k < 4 * m - 1), np.append(r, 0.0)[k], 0.0) ** 2
            assert V[a, b] == pytest.approx(2 * square.sum() / square.size, rel=1e-9, abs=1e-15)


def scatter_of(cells: AllanCells, model: NoiseModel, n: int) -> WindowScatter:
    mean = model.avar_sampled(cells.lag.astype(float), 1.0, "mean")
    return WindowScatter.of(cell_covariance(cells, model, n, 1.0, "mean") / np.outer(mean, mean))


@pytest.mark.long
def test_chi_square_of_windows_has_its_law_and_gaps_make_it_no_larger() -> None:
    """Cells under a known model: mean of chi-square, and at most 5 % of p values below 5 %."""
    runs, small, sums = 80, {False: 0, True: 0}, []
    for gaps in (False, True):
        scatter = None
        for i in range(runs):
            y = noise(SLOW, 1024, 1000 + i)
            if gaps:
                y[100:110], y[500:680] = np.nan, np.nan
            cells = cells_of(phase_of(record(y), "gyro"), [1, 4, 16], [64, 64, 64])
            if scatter is None:
                scatter = scatter_of(cells, SLOW, 1024)
            if not gaps:
                sums.append(Whitened.of(cells.variance, cells.row, scatter).chi2)
            here = np.flatnonzero(cells.row == 0)
            chi2, scores = window_scores(cells.variance[here], scatter.of_cells(here))
            small[gaps] += chi2 > 1.96**2 and math.erfc(abs(scores[0]) / math.sqrt(2)) < 0.05
    dof = 3 * 16 - 3
    assert abs(np.mean(sums) - dof) < 5 * math.sqrt(2 * dof / runs) + 0.03 * dof
    assert max(small.values()) <= binomial_bound(runs, 0.05)


@pytest.mark.long
def test_all_lags_together_have_their_law_where_they_see_nearly_the_same_noise() -> None:
    """A walk, neighbouring lags: a sum over all whitened cells says p < 0.025 in three times as many records."""
    walk = NoiseModel.of(White(N=0.3), RandomWalk(K=0.05))
    runs, n, found, small = 400, 4096, [], 0
    scatter = None
    for i in range(runs):
        lags = [1, 2, 4, 8, 16]
        cells = cells_of(phase_of(record(noise(walk, n, 3000 + i)), "gyro"), lags, [128] * len(lags))
        scatter = scatter or scatter_of(cells, walk, n)
        chi2, dof = together(cells.variance, cells.row, scatter)
        found.append(chi2)
        small += chi_square_tail(chi2, dof) < 0.025
    assert len(lags) * 0.2 * 31 < dof < len(lags) * 31  # they do share noise
    # the cube root of few degrees of freedom is narrower than normal, by a few per cent
    assert -5 * math.sqrt(2 * dof / runs) - 0.05 * dof < np.mean(found) - dof < 5 * math.sqrt(2 * dof / runs)
    assert small <= binomial_bound(runs, 0.025)


@pytest.mark.long
def test_constant_noise_is_said_to_change_in_at_most_five_per_cent() -> None:
    runs = 12
    wrong = sum(
        examine_variation(record(noise(SLOW, 2000, 50 + i)), models=SLOW, windows=16).verdict
        is not VariationVerdict.CONSTANT
        for i in range(runs)
    )
    assert wrong <= binomial_bound(runs, 0.05)


def test_step_of_the_white_noise_is_found_with_its_time_and_size() -> None:
    y = noise(WHITE, 20_000, 7)
    y[13_000:] *= 1.3
    found = examine_variation(record(y + noise(NoiseModel.of(RandomWalk(K=2e-3)), 20_000, 8)), windows=32)
    channel = found["gyro"]
    assert found.verdict is VariationVerdict.CHANGES and len(channel.changes) == 1
    change = channel.changes[0]
    assert change.symbol == "N" and change.time is not None
    assert change.time.lower <= 13_000 <= change.time.upper
    assert change.ratio.lower <= 1.3 <= change.ratio.upper and change.ratio.upper - change.ratio.lower < 0.12
    assert channel.lags[0].significant.any() and channel.p_left > 1e-3
    assert found.reason.startswith("N grew by") and " h" in found.reason


def test_drift_is_told_from_a_step() -> None:
    y = noise(WHITE, 20_000, 9) * 1.6 ** (np.arange(20_000) / 20_000)
    change = examine_variation(record(y), models=WHITE, windows=32).channels[0].changes[0]
    assert change.time is None
    assert change.ratio.lower <= 1.6 <= change.ratio.upper
    assert "steadily" in str(change)


@pytest.mark.long
def test_noise_that_comes_and_goes_has_two_changes_and_a_factor_of_four_is_placed_to_a_part_of_a_window() -> (
    None
):
    y = noise(WHITE, 16_000, 11)
    y[6_000:9_000] *= 4.0
    changes = examine_variation(record(y), models=WHITE, windows=32).channels[0].changes
    assert len(changes) == 2
    for change, time, ratio in zip(changes, (6_000, 9_000), (4.0, 0.25), strict=True):
        assert change.time is not None and abs(change.time.value - time) <= 250
        assert change.ratio.lower / 1.05 <= ratio <= change.ratio.upper * 1.05


def test_intervals_widen_with_heavy_tails_and_not_with_a_step() -> None:
    rng = np.random.default_rng(3)
    tails, step = rng.standard_t(5.0, 30_000), rng.standard_normal(30_000)
    step[15_000:] *= 2.0
    found = []
    for y in (tails, step):
        phase = phase_of(record(y), "gyro")
        found.append(excess_kurtosis(phase.x, cells_of(phase, [1], [512])))
    assert found[0] > 1.0 and found[1] == 0.0


def test_the_cube_root_of_a_variance_has_the_mean_of_wilson_and_hilferty() -> None:
    edf = np.array([8.0, 20.0, 300.0])
    scatter = WindowScatter.of(np.diag(2.0 / edf))
    exact = [(2 / n) ** (1 / 3) * math.exp(math.lgamma(n / 2 + 1 / 3) - math.lgamma(n / 2)) for n in edf]
    np.testing.assert_allclose(scatter.centre, exact, atol=5e-4)
    np.testing.assert_allclose(scatter.edf, edf)


@pytest.mark.long
def test_scale_of_the_data_does_not_matter_and_missing_samples_do_not_spoil_a_window() -> None:
    y = noise(SLOW, 6000, 13)
    y[4000:] *= 1.5
    y[np.random.default_rng(1).random(6000) < 0.05] = np.nan
    y[:400] = np.nan
    small = NoiseModel.of(White(N=1e-7), Flicker(B=1e-8), RandomWalk(K=1e-10))
    one, other = (
        examine_variation(record(s * y), models=model, windows=16).channels[0]
        for s, model in ((1.0, SLOW), (1e-7, small))
    )
    assert one.chi2 == pytest.approx(other.chi2, rel=1e-6)
    assert one.changes[0].ratio.value == pytest.approx(other.changes[0].ratio.value, rel=1e-5)
    assert one.lags[0].start[0] >= 375 and all(np.isfinite(lag.deviation).all() for lag in one.lags)


def test_effect_of_changes_has_mean_one_at_every_lag() -> None:
    cells = cells_of(phase_of(record(noise(SLOW, 4096, 2)), "gyro"), [1, 8, 64], [128, 128, 256])
    shares = shares_of(NoiseModel.of(White(N=1.0), RandomWalk(K=0.02)), cells.lags, 1.0, "mean")
    shapes = [
        ChangeShape(symbol="N", time=1000.0),
        ChangeShape(symbol="K", time=None),
        ChangeShape(symbol="all", time=3000.0),
    ]
    effect = effect_of(shapes, np.array([0.5, -0.3, 0.0]), cells, shares)
    for row in range(3):
        here = cells.row == row
        weight = (cells.stop - cells.start)[here]
        assert np.average(effect[here], weights=weight) == pytest.approx(1.0, abs=1e-9)
    assert np.allclose(effect_of([], np.zeros(0), cells, shares), 1.0)


MARKOV = NoiseModel.of(White(N=1.0), GaussMarkov.from_sigma(0.2, 40.0), RandomWalk(K=0.01))


def fitted(model: NoiseModel, symbols: list[str], sd: float) -> NoiseModel:
    rng = np.random.default_rng(5)
    root = sd * (np.eye(len(symbols)) + 0.3 * rng.standard_normal((len(symbols),) * 2))
    return replace(model, covariance={"symbols": symbols, "matrix": (root @ root.T).tolist()})


@pytest.mark.parametrize(
    ("model", "symbols"), [(SLOW, ["N", "B", "K"]), (MARKOV, ["N", "sigma", "K", "T"])], ids=["B", "G"]
)
def test_doubt_of_the_shares_is_the_spread_of_the_shares_of_models_drawn(
    model: NoiseModel, symbols: list[str]
) -> None:
    lags, sd = np.array([1, 8, 64, 512]), 1e-3
    known = fitted(model, symbols, sd)
    doubts = doubts_of(known, lags, 1.0, "mean")
    root = np.linalg.cholesky(np.array(known.covariance["matrix"]))
    rng = np.random.default_rng(6)
    drawn = {symbol: [] for symbol in doubts}
    for _ in range(500):
        step = dict(zip(symbols, root @ rng.standard_normal(len(symbols)), strict=True))
        terms = []
        for term in model.terms:
            if isinstance(term, GaussMarkov):
                sigma, T = term.sigma * math.exp(step["sigma"]), term.T * math.exp(step["T"])
                terms.append(GaussMarkov.from_sigma(sigma, T))
            else:
                s = term.symbols[0]
                terms.append(replace(term, **{s: getattr(term, s) * math.exp(step[s])}))
        shares = _shares(NoiseModel.of(*terms), lags, 1.0, "mean")
        for symbol, share in shares.items():
            drawn[symbol].append(share)
    for symbol, rows in drawn.items():
        wanted = np.cov(np.array(rows).T)
        found = doubts[symbol] @ doubts[symbol].T
        # four standard deviations of a variance from 500 draws
        assert np.diag(found) == pytest.approx(np.diag(wanted), rel=4 * math.sqrt(2 / 500), abs=1e-16)
    assert sum(doubts.values()) == pytest.approx(np.zeros_like(doubts["N"]), abs=1e-9)


def test_a_model_that_is_given_without_a_covariance_leaves_no_doubt() -> None:
    found = doubts_of(SLOW, np.array([1, 8]), 1.0, "mean")
    assert {s: d.shape for s, d in found.items()} == {"N": (2, 0), "B": (2, 0), "K": (2, 0)}


def test_likelihood_with_doubt_is_that_of_the_whole_covariance() -> None:
    """Equation (2) as a matrix of full size, the levels eliminated as unknown means."""
    cells = cells_of(phase_of(record(noise(SLOW, 4096, 2)), "gyro"), [1, 8, 64], [128, 128, 512])
    known = fitted(SLOW, ["N", "B", "K"], 0.2)
    scatter = scatter_of(cells, SLOW, 4096)
    shares, doubts = (of(known, cells.lags, 1.0, "mean") for of in (shares_of, doubts_of))
    none = {symbol: np.zeros((3, 0)) for symbol in doubts}
    shapes, beta = [ChangeShape(symbol="N", time=1024.0)], np.array([-0.6])
    sure, unsure = (Misfit.of(cells, scatter, shares, d) for d in (none, doubts))

    effect = effect_of(shapes, beta, cells, shares)
    slope = doubt_of_effect(shapes, beta, cells, shares, doubts)
    for k in range(3):  # the slope against a difference of effects
        ends = [
            effect_of(
                shapes,
                beta,
                cells,
                {s: v + h * doubts[s][:, k] if s in doubts else v for s, v in shares.items()},
            )
            for h in (1e-5, -1e-5)
        ]
        assert slope[:, k] == pytest.approx(np.log(ends[0] / ends[1]) / 2e-5, rel=1e-3, abs=1e-6)

    C = scatter.covariance * np.sqrt(np.outer(*[shapes[0].spread(cells, -0.6, shares)] * 2))
    edf = scatter.edf / shapes[0].spread(cells, -0.6, shares)
    centre = 1 - 2 / 9 / edf
    levels = centre[:, None] * (cells.row[:, None] == np.arange(3))
    u = np.cbrt(cells.variance / effect)[:, None] * (cells.row[:, None] == np.arange(3))
    inverse = np.linalg.inv(C)
    a = np.linalg.solve(levels.T @ inverse @ u, levels.T @ inverse @ centre)
    z = u @ a - centre
    G = centre[:, None] * slope / 3
    # basis of what is free of the levels
    free = np.linalg.svd(levels)[0][:, 3:].T
    both = []
    for V in (C, C + G @ G.T):
        W = free @ V @ free.T
        both.append(float(free @ z @ np.linalg.solve(W, free @ z) + np.linalg.slogdet(W)[1]))
    assert unsure(shapes, beta) - sure(shapes, beta) == pytest.approx(both[1] - both[0], rel=1e-5)
    assert abs(both[1] - both[0]) > 0.1


@pytest.mark.parametrize("factor", [1.5, 1000.0])
def test_a_divided_window_feels_the_samples_of_both_sides(factor: float) -> None:
    """Mean and scatter of its differences, one by one, against the sums in closed form."""
    n, time, more = 512, 200, factor**2 - 1
    cells = cells_of(phase_of(record(noise(WHITE, n, 1)), "gyro"), [1, 8, 32], [64, 64, 128])
    shape, shares = ChangeShape(symbol="N", time=float(time)), {"N": np.array([1.0, 0.7, 0.3])}
    sample = np.concatenate(([0.0], np.cumsum(np.arange(n) >= time)))
    reached = shape.reaches(cells, time, time)
    for i, (m, first, last) in enumerate(zip(cells.lag, cells.first, cells.last, strict=True)):
        start = np.arange(first, last)
        x = (sample[start + 2 * m] - sample[start]) / (2 * m)
        g = 1 + shares["N"][cells.row[i]] * more * x
        assert shape.after(cells)[i] == pytest.approx(x.mean(), abs=1e-12)
        wanted = np.mean(g**2) / g.mean() ** 2
        assert shape.spread(cells, math.log(factor), shares)[i] == pytest.approx(wanted, rel=1e-9)
        assert reached[i] == (0 < x.min() + x.max() < 2)


@pytest.mark.long
@pytest.mark.parametrize(("factor", "at"), [(20.0, 7_500), (1e3, 3_500)])
def test_one_clear_step_is_one_change_with_its_time_and_size(factor: float, at: int) -> None:
    """Off the borders of the windows: what is left of a step is no other one, and the intervals hold the truth."""
    runs, more, size, time = 4, 0, 0, 0  # `make verify` looks at 300 of each kind
    for i in range(runs):
        y = np.random.default_rng([41, i, int(factor)]).standard_normal(10_000)
        y[at:] *= factor
        changes = examine_variation(record(y), models=WHITE).channels[0].changes
        clearest = max(changes, key=lambda c: abs(math.log(c.ratio.value)))
        more += len(changes) > 1
        assert clearest.time is not None
        size += not clearest.ratio.lower <= factor <= clearest.ratio.upper
        time += not clearest.time.lower <= at <= clearest.time.upper
    assert more <= binomial_bound(runs, 0.025)
    assert max(size, time) <= binomial_bound(runs, 0.05)


@pytest.mark.long
@pytest.mark.parametrize(
    ("start", "stop", "factor"), [(3500, None, 100.0), (3500, None, 1e6), (0, 3500, 1e6)]
)
def test_steps_of_large_factors_are_told_by_the_terms_that_the_fit_finds(
    start: int, stop: int | None, factor: float
) -> None:
    y = np.random.default_rng(8).standard_normal(10_000)
    y[start:stop] *= factor
    channel = examine_variation(Recording.from_rate(y, rate=100.0, unit="rad/s")).channels[0]
    (change,) = channel.changes
    truth = factor if start else 1 / factor
    assert change.ratio.lower / 1.02 <= truth <= change.ratio.upper * 1.02
    assert change.time is not None and change.time.lower - 0.05 <= 35.0 <= change.time.upper + 0.05
    assert channel.kurtosis == 0.0


@pytest.mark.parametrize("counts", [1, 2, 5])
def test_few_counts_among_zeros_are_no_steps(counts: int) -> None:
    """Of a quiet quantised sensor most windows hold one value: refused, or said."""
    y = np.zeros(5000)
    y[np.linspace(300, 4500, counts).astype(int)] = 1.0
    if counts < 4:
        with pytest.raises(DataQualityError, match="fewer than 4 windows have samples and noise"):
            examine_variation(record(y))
        return
    channel = examine_variation(record(y)).channels[0]
    assert channel.verdict is VariationVerdict.FLUCTUATES and not channel.changes
    assert "59 windows repeat one value" in channel.reason


def test_a_size_that_the_windows_do_not_tell_has_no_interval() -> None:
    def wall(at: np.ndarray) -> float:
        return math.inf if abs(at[0]) < 0.01 else float(at[0] ** 2)

    at, _, hessian = _minimum(wall, np.array([0.03]))
    assert np.isfinite(at).all() and not np.isfinite(hessian).all()
    assert np.isinf(_deviations(hessian)).all()
    assert np.isinf(_deviations(np.array([[2.0, 0.0], [0.0, -1.0]]))).all()
    np.testing.assert_allclose(_deviations(np.array([[2.0, 1.0], [1.0, 2.0]])), math.sqrt(4 / 3))
    found = FoundChange(
        shape=ChangeShape(symbol="N", time=60.0), lower=50.0, upper=70.0, beta=3.0, sd=math.inf, p=0.01
    )
    assert ratio_of(found, 0.95)[1:] == (0.0, math.inf)
    change = _change(found, 1.0, 0.95)
    assert str(change) == "N grew at 60 s, by an amount that the windows do not resolve"
    assert not change.ratio.resolved and math.isnan(change.ratio.upper)
    whole = examine_variation(record(noise(SLOW, 2000, 1)), models=SLOW, windows=16)
    channel = replace(whole.channels[0], changes=(change,))
    page = view(ResultDocument(result=replace(whole, channels=(channel,))))
    table = next(block for block in page.blocks() if isinstance(block, TableBlock))
    assert [cell.text for cell in table.rows[0][0]] == [
        "gyro", "N", "60 s [50 s, 70 s]", "not resolved", "p = 0.010",
    ]  # fmt: skip
    assert any("there may be others" in words for words in remarks(channel, 0.05))


@pytest.mark.long
@pytest.mark.parametrize(
    ("n", "factor", "seed"), [(64, 0.03, 18), (64, 30.0, 10), (100, 1e-3, 7), (100, 0.03, 0)]
)
def test_a_change_that_leaves_no_two_windows_of_any_lag_is_told_all_the_same(
    n: int, factor: float, seed: int
) -> None:
    y = np.random.default_rng(seed).standard_normal(n)
    y[n // 2 :] *= factor
    channel = examine_variation(record(y)).channels[0]
    assert channel.verdict is VariationVerdict.CHANGES and channel.changes
    assert 0.0 < channel.p_left <= 1.0 and math.isfinite(channel.chi2)


@pytest.mark.long
def test_where_steps_divide_every_window_the_search_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    y = noise(WHITE, 4000, 3)
    y[1500:] *= 2.0
    monkeypatch.setattr(changes, "undivided", lambda found, cells: np.full(len(cells), not found))
    channel = examine_variation(record(y), models=WHITE).channels[0]
    assert len(channel.changes) == 1 and channel.p_left == 1.0


def test_quantile_of_the_time_is_that_of_the_published_law() -> None:
    assert _hansen(0.95) == pytest.approx(7.35, abs=0.005)  # Hansen 2000, table I
    assert _hansen(0.90) == pytest.approx(5.94, abs=0.005)
    assert _hansen(0.99) == pytest.approx(10.59, abs=0.005)


def test_document_is_plain_and_long_lags_are_left_out() -> None:
    found = examine_variation(record(noise(SLOW, 4096, 1)), models=SLOW, windows=16)
    document = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert document["format"] == "allanite-variation"
    for lag in document["channels"][0]["lags"]:
        assert len(lag["start"]) >= 4 and lag["window"] >= 4 * lag["tau"]
        assert all(a <= b <= c for a, b, c in zip(lag["lower"], lag["deviation"], lag["upper"], strict=True))


def test_what_cannot_be_asked_is_refused() -> None:
    with pytest.raises(DataQualityError, match="4 windows of 16 samples"):
        examine_variation(record(np.random.default_rng(0).standard_normal(60)))
    with pytest.raises(InputError, match="at least 4 windows"):
        examine_variation(record(np.ones(100)), windows=2)
    with pytest.raises(InputError, match="false_alarm must lie between 0 and 1"):
        examine_variation(record(np.ones(100)), false_alarm=0.0)
    with pytest.raises(InputError, match="no channel 'x'"):
        examine_variation(record(noise(WHITE, 2000, 1)), models=WHITE)["x"]
    assert isinstance(cells_of(phase_of(record(noise(WHITE, 300, 1)), "gyro"), [1], [64]), AllanCells)
