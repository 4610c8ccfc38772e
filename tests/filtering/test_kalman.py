# SPDX-License-Identifier: BSD-3-Clause
"""Filter, smoother, likelihood and their tests against closed forms, batch conditioning and statsmodels."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from allanite.errors import FitError, InputError
from allanite.filtering.kalman import (
    FilterRun,
    consistency,
    log_likelihood,
    merged,
    run_filter,
    smooth,
    steady_state,
)
from allanite.noise import (
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    RandomWalk,
    Sinusoid,
    StateSpace,
    White,
)
from allanite.noise.state_space import states

Array = NDArray[np.float64]
FORMS = ("covariance", "square root")

KOOPMAN = np.r_[10.2394, np.ones(9)]


def local_level(scale: float = 1.0) -> StateSpace:
    """A random walk of which nothing is known at first, in white noise: the example of Koopman (1997)."""
    walk = states(1.0, 8.253 * scale**2, 1.0, 0.0, label="walk", diffuse=True)
    return replace(walk, noise=1.993 * scale**2)


def random_space(rng: np.random.Generator, n: int, n_diffuse: int = 0) -> StateSpace:
    """A stable model with full matrices; the last `n_diffuse` states have no prior."""
    transition = rng.normal(size=(n, n))
    transition *= rng.uniform(0.5, 0.98) / np.abs(np.linalg.eigvals(transition)).max()
    root, prior = rng.normal(size=(n, n)), rng.normal(size=(n, n))
    diffuse = np.arange(n) >= n - n_diffuse
    known = np.outer(~diffuse, ~diffuse)
    return StateSpace(
        transition=transition,
        process=root @ root.T / n,
        output=rng.normal(size=n),
        noise=float(rng.uniform(0.1, 3)),
        initial=prior @ prior.T * known,
        rate=np.zeros(n),
        labels=("x",) * n,
        diffuse=diffuse,
    )


def draw(space: StateSpace, rows: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Samples of a model and its states, shape (rows + 1, n); diffuse states begin at zero."""
    n = space.size
    root = np.linalg.cholesky(space.process + 1e-300 * np.eye(n)) if n else space.process
    path = np.empty((rows + 1, n))
    path[0] = rng.multivariate_normal(np.zeros(n), space.initial)
    for k in range(rows):
        path[k + 1] = space.transition @ path[k] + root @ rng.standard_normal(n)
    return path[:-1] @ space.output + math.sqrt(space.noise) * rng.standard_normal(rows), path


def with_gaps(y: Array, rng: np.random.Generator, part: float = 0.15) -> Array:
    """Samples of which some are missing, the first among them."""
    missing = rng.random(len(y)) < part
    missing[0] = missing[len(y) // 2 : len(y) // 2 + 5] = True
    return np.where(missing, np.nan, y)


def batch(
    y: Array,
    space: StateSpace,
    upto: int,
    outputs: Array | None = None,
    drive: Array | None = None,
    noise: Array | None = None,
) -> tuple[Array, Array, float]:
    """States at every row given the samples before row `upto`, by generalised least squares on the whole record.

    Every quantity is a linear form of the known part (initial states and driving noise) and of the unknown starting
    values, which are estimated without prior. Returns means (rows, n), covariances (rows, n, n) and the
    log-likelihood of the contrasts.
    """
    rows, n = len(y), space.size
    h = np.broadcast_to(space.output, (rows, n)) if outputs is None else outputs
    r = np.full(rows, space.noise) if noise is None else noise
    push = np.zeros((rows, n)) if drive is None else drive
    unknown = np.eye(n)[:, space.diffuse]
    covariance = np.zeros((rows, n, rows, n))  # of the states at each pair of rows
    trend, mean = np.empty((rows, n, unknown.shape[1])), np.empty((rows, n))
    own, now, path = space.initial, unknown, np.zeros(n)
    for k in range(rows):
        covariance[k, :, k], trend[k], mean[k] = own, now, path
        later = own
        for j in range(k + 1, rows):
            later = space.transition @ later
            covariance[j, :, k], covariance[k, :, j] = later, later.T
        own = space.transition @ own @ space.transition.T + space.process
        now, path = space.transition @ now, space.transition @ path + push[k]
    use = np.flatnonzero(np.isfinite(y) & (np.arange(rows) < upto))
    cross = np.einsum("knjm,jm->knj", covariance[:, :, use], h[use])
    sigma = np.einsum("in,inj->ij", h[use], cross[use]) + np.diag(r[use])
    x, e = np.einsum("in,ind->id", h[use], trend[use]), y[use] - np.einsum("in,in->i", h[use], mean[use])
    inverse = np.linalg.inv(sigma)
    information = x.T @ inverse @ x
    beta = np.linalg.solve(information, x.T @ inverse @ e) if x.shape[1] else np.zeros(0)
    residual = e - x @ beta
    gain = cross @ inverse
    left = trend - gain @ x
    means = mean + trend @ beta + gain @ residual
    spread = np.linalg.inv(information) if x.shape[1] else np.zeros((0, 0))
    covariances = (
        covariance[np.arange(rows), :, np.arange(rows)]
        - gain @ np.swapaxes(cross, 1, 2)
        + left @ spread @ np.swapaxes(left, 1, 2)
    )
    logs = np.linalg.slogdet(sigma)[1] + (np.linalg.slogdet(information)[1] if x.shape[1] else 0.0)
    count = len(use) - x.shape[1]
    return (
        means,
        covariances,
        -0.5 * (count * math.log(2 * math.pi) + logs + float(residual @ inverse @ residual)),
    )


# -- published numbers --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
def test_k1_local_level_from_an_exact_diffuse_start(form: Any) -> None:
    result = run_filter(KOOPMAN, local_level(), readout=[[1.0]], form=form)
    assert result.log_likelihood == pytest.approx(-23.01632185093656111, rel=1e-13)
    assert result.readout[:3, 0] == pytest.approx([10.2394, 2.50454483, 1.25167384], rel=1e-8)
    assert result.readout[-1, 0] == pytest.approx(1.000000927215463497, rel=1e-13)
    assert result.readout_sd[-1, 0] ** 2 == pytest.approx(1.659364779788760324, rel=1e-13)
    assert (result.count, result.diffuse_rows, result.unresolved) == (9, 1, 0)
    assert math.isnan(result.innovations[0])
    assert math.isinf(result.variances[0])
    assert smooth(KOOPMAN, local_level(), form=form).readout[0, 0] == pytest.approx(8.692691894822, rel=1e-12)


def test_k2_steady_state_of_the_local_level() -> None:
    steady = steady_state(local_level())
    assert steady.predicted[0, 0] == pytest.approx(9.912364779788756868, rel=1e-12)
    assert steady.covariance[0, 0] == pytest.approx(1.659364779788756868, rel=1e-12)
    assert steady.gain[0] == pytest.approx(0.8325964775658589401, rel=1e-12)


@pytest.mark.parametrize("scale", [1e-8, 1e-5, 1e-3, 1e3, 1e8])
@pytest.mark.parametrize("form", FORMS)
def test_k3_rescaled_data_rescale_the_result(form: Any, scale: float, rng: np.random.Generator) -> None:
    model = [White(N=1.0), Flicker(B=0.3), RandomWalk(K=0.05)]
    scaled = [White(N=scale), Flicker(B=0.3 * scale), RandomWalk(K=0.05 * scale)]
    one, other = (NoiseModel.of(*m).state_space(1.0, record=300.0).with_constant() for m in (model, scaled))
    y = with_gaps(rng.standard_normal(300) + 5, rng)
    plain, result = (
        run_filter(s * y, m, readout=np.eye(m.size), form=form) for s, m in ((1.0, one), (scale, other))
    )
    assert result.readout / scale == pytest.approx(plain.readout, rel=1e-9, abs=1e-9, nan_ok=True)
    assert result.readout_sd / scale == pytest.approx(plain.readout_sd, rel=1e-9, abs=1e-12)
    assert result.covariance / scale**2 == pytest.approx(plain.covariance, rel=1e-9, abs=1e-12)
    shift = result.count * math.log(scale)
    assert result.log_likelihood + shift == pytest.approx(plain.log_likelihood, rel=1e-9)
    back, again = (smooth(s * y, m, form=form) for s, m in ((1.0, one), (scale, other)))
    assert again.readout / scale == pytest.approx(back.readout, rel=1e-9, abs=1e-9)
    assert again.readout_sd / scale == pytest.approx(back.readout_sd, rel=1e-9, abs=1e-12)


def test_k12_a_constant_in_white_noise_is_the_mean_of_the_samples(rng: np.random.Generator) -> None:
    n, dt, noise = 4000, 1 / 32, 0.7
    y = 3.0 + noise / math.sqrt(dt) * rng.standard_normal(n)
    space = NoiseModel.of(White(N=noise)).state_space(dt).with_constant()
    result = run_filter(y, space, readout=[[1.0]])
    assert result.readout[-1, 0] == pytest.approx(y.mean(), rel=1e-12)
    assert result.readout_sd[-1, 0] == pytest.approx(noise / math.sqrt(n * dt), rel=1e-12)
    level = smooth(y, space).readout
    assert level == pytest.approx(np.full((n, 1), y.mean()), rel=1e-12)


# -- oracles ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("n_diffuse", [0, 1, 2])
def test_k8_filter_equals_batch_least_squares(form: Any, n_diffuse: int, rng: np.random.Generator) -> None:
    """With gaps, time-varying outputs, a known input and a variance of its own for each row."""
    space, rows = random_space(rng, 3, n_diffuse), 40
    y = with_gaps(draw(space, rows, rng)[0], rng)
    sides = {
        "outputs": rng.normal(size=(rows, 3)),
        "drive": rng.normal(size=(rows, 3)),
        "noise": rng.uniform(0.1, 2, rows),
    }
    result = run_filter(y, space, readout=np.eye(3), form=form, **sides)
    for row in (10, 25, rows - 1):
        means, covariances, _ = batch(y, space, row + 1, **sides)
        sd = np.sqrt(np.diag(covariances[row]))
        assert result.readout_sd[row] == pytest.approx(sd, rel=1e-9)
        assert np.abs(result.readout[row] - means[row]).max() < 1e-9 * sd.max()
    assert result.log_likelihood == pytest.approx(batch(y, space, rows, **sides)[2], rel=1e-10)
    assert log_likelihood(y, space, form=form, **sides) == result.log_likelihood


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("n_diffuse", [0, 2])
def test_k10_smoother_equals_batch_conditioning(
    form: Any, n_diffuse: int, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    space, rows = random_space(rng, 3, n_diffuse), 200
    y = with_gaps(draw(space, rows, rng)[0], rng)
    sides = {"outputs": rng.normal(size=(rows, 3)), "drive": rng.normal(size=(rows, 3))}
    means, covariances, likelihood = batch(y, space, rows, **sides)
    sd = np.sqrt(np.einsum("kii->ki", covariances))
    monkeypatch.setattr(
        "allanite.filtering.kalman.smoothing.block_rows", lambda _: 64
    )  # and cuts leave no trace
    result = smooth(y, space, form=form, **sides)
    assert np.abs((result.readout - means) / sd).max() < 1e-10
    assert result.readout_sd == pytest.approx(sd, rel=1e-10)
    assert result.log_likelihood == pytest.approx(likelihood, rel=1e-10)


def test_k8_missing_rows_are_predicted_over(rng: np.random.Generator) -> None:
    """A record with every third row only is that of the same process at a longer interval."""
    space = replace(random_space(rng, 3), noise=0.5)
    y = draw(space, 60, rng)[0]
    sparse = np.where(np.arange(60) % 3 == 0, y, np.nan)
    f, q = space.transition, space.process
    long = replace(
        space,
        transition=np.linalg.matrix_power(f, 3),
        process=q + f @ q @ f.T + f @ f @ q @ f.T @ f.T,
    )
    one, other = run_filter(sparse, space, readout=np.eye(3)), run_filter(y[::3], long, readout=np.eye(3))
    assert one.readout[::3] == pytest.approx(other.readout, rel=1e-9, abs=1e-12)
    assert one.readout_sd[::3] == pytest.approx(other.readout_sd, rel=1e-9)
    assert one.log_likelihood == pytest.approx(other.log_likelihood, rel=1e-12)
    assert np.isnan(one.innovations[1::3]).all()


def oracle(y: Array, space: StateSpace) -> Any:
    """statsmodels on the same model, without its frozen gain."""
    smoother = pytest.importorskip(
        "statsmodels.tsa.statespace.kalman_smoother", reason="statsmodels is the oracle of this test"
    )
    from statsmodels.tsa.statespace.initialization import Initialization

    n = space.size
    model = smoother.KalmanSmoother(k_endog=1, k_states=n)
    model.bind(np.array(y))
    model["design"], model["obs_cov"] = space.output[None], [[space.noise]]
    model["transition"], model["state_cov"], model["selection"] = space.transition, space.process, np.eye(n)
    start = Initialization(n)
    known = np.flatnonzero(~space.diffuse)
    if len(known):
        block = slice(int(known[0]), int(known[-1]) + 1)
        start.set(
            block if len(known) < n else None,
            "known",
            constant=np.zeros(len(known)),
            stationary_cov=space.initial[block, block],
        )
    if space.diffuse.any():
        first = int(np.flatnonzero(space.diffuse)[0])
        start.set(slice(first, n) if len(known) else None, "diffuse")
    model.initialize(start)
    model.tolerance = 0.0
    return model.smooth()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("number", range(24))
def test_oracle_statsmodels_agrees(number: int, form: Any) -> None:
    """24 random models of one to six states with gaps, half of them with one or two diffuse states."""
    rng = np.random.default_rng([7, number])
    n = 1 + number % 6
    space = random_space(rng, n, n_diffuse=0 if number % 2 else min(n, 1 + number % 3))
    y = with_gaps(draw(space, 150, rng)[0], rng)
    truth = oracle(y, space)
    used = run_filter(y, space, readout=np.eye(n), form=form)
    burnt = int(space.diffuse.sum())
    assert used.diffuse_rows == burnt
    theirs = truth.llf_obs.sum() + 0.5 * burnt * math.log(2 * math.pi)
    assert used.log_likelihood == pytest.approx(theirs, rel=1e-9)
    after = slice(int(truth.nobs_diffuse), None)
    sd = np.sqrt(np.einsum("iik->ki", truth.filtered_state_cov))[after]
    assert np.abs((used.readout[after] - truth.filtered_state.T[after]) / sd).max() < 1e-9
    assert used.readout_sd[after] == pytest.approx(sd, rel=1e-9)
    back = smooth(y, space, form=form)
    sd = np.sqrt(np.einsum("iik->ki", truth.smoothed_state_cov))
    assert np.abs((back.readout - truth.smoothed_state.T) / sd).max() < 1e-9
    assert back.readout_sd == pytest.approx(sd, rel=1e-9)


# -- consistency --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("n", "low", "high"), [(1, 0.59896, 1.53167), (3, 2.25886, 3.87203), (6, 4.92520, 7.20576)]
)
def test_k5_mean_nees_of_100_runs(n: int, low: float, high: float) -> None:
    rng, total = np.random.default_rng([5, n]), 0.0
    space = random_space(rng, n)
    for _ in range(100):
        y, path = draw(space, 40, rng)
        result = run_filter(with_gaps(y, rng), space)
        error = result.state - path[-1]
        total += float(error @ np.linalg.solve(result.covariance, error))
    assert low < total / 100 < high


def test_k6_innovations_of_the_right_model_are_consistent(rng: np.random.Generator) -> None:
    space = random_space(rng, 3)
    result = run_filter(draw(space, 10_000, rng)[0], space)
    found = consistency(result.innovations, result.variances)
    assert 0.95412 < found.nis < 1.04719
    assert (found.nis_lower, found.nis_upper) == pytest.approx((0.97247, 1.02791), abs=2e-5)
    assert found.whiteness_p > 1e-3
    assert found.verdict == "consistent" and found.consistent
    assert found.consistent


@pytest.mark.long
def test_k7_a_variance_wrong_by_ten_is_flagged() -> None:
    """200 records of 1000 samples; at least 99 % of the wrong models are found, and at most 2 % of the right ones."""
    rng, runs, rows = np.random.default_rng(11), 200, 1000
    right = NoiseModel.of(White(N=1.0), GaussMarkov.from_sigma(1.0, 20.0)).state_space(1.0)
    root = np.linalg.cholesky(right.process + 1e-12 * np.eye(right.size))
    s, y = (
        rng.standard_normal((runs, right.size)) @ np.linalg.cholesky(right.initial).T,
        np.empty((runs, rows)),
    )
    for k in range(rows):
        y[:, k] = s @ right.output + math.sqrt(right.noise) * rng.standard_normal(runs)
        s = s @ right.transition.T + rng.standard_normal((runs, right.size)) @ root.T
    models = {"right": right}
    for factor in (0.1, 10.0):
        models[f"R x {factor}"] = replace(right, noise=right.noise * factor)
        models[f"Q x {factor}"] = replace(
            right, process=right.process * factor, initial=right.initial * factor
        )
    flagged = dict.fromkeys(models, 0)
    for name, model in models.items():
        for samples in y:
            result = run_filter(samples, model)
            flagged[name] += not consistency(result.innovations, result.variances).consistent
    assert flagged.pop("right") <= 4
    assert min(flagged.values()) >= 198, flagged


def test_verdicts_say_what_is_wrong_and_by_how_much(rng: np.random.Generator) -> None:
    z, one = rng.standard_normal(20_000), np.ones(20_000)
    assert (
        consistency(1.1 * z, one).reason
        == "the noise is larger than the model predicts by 10 % (standard deviation)"
    )
    assert "smaller than the model predicts by a factor 3 " in consistency(z / 3, one).reason
    rising = consistency(z[1:] + 0.5 * z[:-1], 1.25 * one[1:])
    assert "not white: correlation +0.4 at lag 1" in rising.reason
    assert "samples share noise" in rising.reason
    assert "samples compensate" in consistency(z[1:] - 0.5 * z[:-1], 1.25 * one[1:]).reason
    model = NoiseModel.of(White(N=1.0), GaussMarkov.from_sigma(1.0, 20.0))
    space = model.state_space(1.0)
    y = draw(replace(space, process=space.process + 1e-12 * np.eye(space.size)), 5000, rng)[0]
    for factor, cause in ((0.1, "the sensor drifts more"), (10.0, "too much drift in the model")):
        result = run_filter(y, replace(space, process=factor * space.process))
        assert cause in consistency(result.innovations, result.variances).reason
    untested = consistency([], [])
    assert (untested.verdict, untested.reason) == ("not tested", "there is no innovation")
    few = consistency(z[:30], one[:30])
    assert few.consistent
    assert "too few samples" in few.reason
    assert "everything" in consistency(0 * z, one).reason
    json.dumps([consistency([], []).to_json(), rising.to_json()], allow_nan=False)
    for bad in ({"confidence": 1.0}, {"variances": one[1:]}):
        with pytest.raises(InputError):
            consistency(**{"innovations": z, "variances": one, **bad})


def test_whiteness_is_ljung_box_and_gaps_are_left_out(rng: np.random.Generator) -> None:
    from scipy.stats import chi2

    z = rng.standard_normal(500)
    r = np.array([z[j:] @ z[:-j] for j in range(1, 21)]) / (z @ z)
    q = 500 * 502 * float((r**2 / (500 - np.arange(1, 21))).sum())
    found = consistency(z, np.ones(500))
    assert found.whiteness == pytest.approx(q, rel=1e-12)
    assert found.whiteness_p == pytest.approx(chi2.sf(q, 20), rel=1e-12)
    # size of the test with a third of the samples missing: 20 degrees of freedom, mean 20, sd of the mean 0.32
    statistics = []
    for _ in range(400):
        z = np.where(rng.random(600) < 1 / 3, np.nan, rng.standard_normal(600))
        statistics.append(consistency(z, np.ones(600)).whiteness)
    assert np.mean(statistics) == pytest.approx(20, abs=4 * math.sqrt(40 / 400))


# -- streaming and choices ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
def test_cuts_leave_no_trace(form: Any, rng: np.random.Generator) -> None:
    space = NoiseModel.of(White(N=1.0), Flicker(B=0.3)).state_space(1.0).with_constant()
    y = with_gaps(rng.standard_normal(1000), rng)
    outputs, noise = space.output * rng.choice([-1.0, 1.0], (1000, 1)), rng.uniform(0.5, 2, 1000)
    sides = {"outputs": outputs, "noise": noise, "drive": rng.normal(size=(1000, space.size))}
    whole = run_filter(y, space, readout=np.eye(space.size), form=form, **sides)
    cut = run_filter(iter(np.split(y, [1, 7, 500])), space, readout=np.eye(space.size), form=form, **sides)
    for name in ("innovations", "variances", "readout", "readout_sd", "state", "covariance"):
        assert np.array_equal(getattr(whole, name), getattr(cut, name), equal_nan=True)
    lean = run_filter(y, space, form=form, store=False, **sides)
    assert lean.log_likelihood == cut.log_likelihood == whole.log_likelihood
    assert len(lean.innovations) == 0
    assert np.array_equal(lean.state, whole.state)


def test_lists_integers_and_infinities(rng: np.random.Generator) -> None:
    space = local_level()
    assert (
        run_filter([1, 2, 4], space).log_likelihood
        == run_filter(np.array([1.0, 2.0, 4.0]), space).log_likelihood
    )
    odd, plain = (run_filter([1.0, x, 4.0], space, readout=[[1.0]]) for x in (math.inf, math.nan))
    assert np.array_equal(odd.readout, plain.readout)
    two = run_filter([np.array([1.0, 2.0]), np.array([4.0])], space)
    assert two.count == 2
    nothing = run_filter([], space, readout=[[1.0]])
    assert (len(nothing.innovations), nothing.readout.shape, nothing.unresolved) == (0, (0, 1), 1)
    assert math.isnan(log_likelihood([math.nan] * 5, space))
    assert not two.innovations.flags.writeable
    assert "2 innovations" in repr(two)


@pytest.mark.parametrize("form", FORMS)
def test_white_noise_without_states(form: Any, rng: np.random.Generator) -> None:
    space, y = NoiseModel.of(White(N=2.0)).state_space(1.0), with_gaps(rng.standard_normal(50), rng)
    result = run_filter(y, space, form=form)
    present = y[np.isfinite(y)]
    expected = -0.5 * (len(present) * math.log(2 * math.pi * 4) + float(present @ present) / 4)
    assert result.log_likelihood == pytest.approx(expected, rel=1e-13)
    assert np.array_equal(result.innovations, y, equal_nan=True)
    assert smooth(y, space, form=form).readout.shape == (50, 0)


def test_a_start_that_is_known(rng: np.random.Generator) -> None:
    space = replace(local_level(), diffuse=np.array([False]), initial=np.array([[2.0]]))
    result = run_filter([5.0], space, state=[3.0], readout=[[1.0]])
    assert result.readout[0, 0] == pytest.approx(3 + 2 / (2 + 1.993) * 2, rel=1e-14)


def test_k9_samples_without_noise(rng: np.random.Generator) -> None:
    """R = 0 is defined: a sample is then the state itself; once it is known, a sample that differs is left out."""
    walk = replace(local_level(), noise=0.0)
    for form in FORMS:
        result = run_filter([3.0, 4.0, math.nan, 6.0], walk, readout=[[1.0]], form=form)
        assert result.readout[:, 0].tolist() == [3.0, 4.0, 4.0, 6.0]
        assert result.readout_sd[:, 0] ** 2 == pytest.approx([0, 0, 8.253, 0], abs=1e-12)
        level = run_filter([3.0, 4.0], replace(walk, process=np.zeros((1, 1))), readout=[[1.0]], form=form)
        assert level.skipped == 1
        assert level.readout[:, 0].tolist() == [3.0, 3.0]


BAD_MATRIX = np.array([[1.0, 2.0], [2.0, 1.0]])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"noise": -1.0}, "not negative, not -1.0"),
        ({"noise": math.nan}, "finite"),
        ({"noise": np.ones(3)}, "must be one number"),
        ({"process": BAD_MATRIX}, "process is no covariance: it is not positive semidefinite"),
        ({"process": np.diag([1.0, -1.0])}, "variance -1 of state 1"),
        ({"process": np.array([[0.0, 1.0], [1.0, 1.0]])}, "not positive semidefinite"),
        ({"process": np.array([[1.0, 0.5], [0.2, 1.0]])}, "not symmetric"),
        ({"initial": BAD_MATRIX}, "initial is no covariance"),
        ({"transition": np.eye(3)}, r"transition must have shape \(2, 2\), not \(3, 3\)"),
        ({"transition": np.full((2, 2), math.nan)}, "not finite"),
        ({"output": np.array([1.0, math.inf])}, "output holds numbers that are not finite"),
        ({"output": np.array(["a", "b"])}, "real numbers"),
        ({"diffuse": np.zeros(3, dtype=bool)}, "2 entries"),
    ],
)
def test_k9_models_that_make_no_sense_are_refused(change: dict[str, Any], message: str) -> None:
    space = replace(local_level() + local_level(), noise=1.0)
    with pytest.raises(InputError, match=message):
        run_filter([1.0, 2.0], replace(space, **change))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"y": np.ones((3, 2))}, r"shape \(rows,\)"),
        ({"y": ["a", "b", "c"]}, "real numbers"),
        ({"y": 3.0}, "array of samples or blocks"),
        ({"outputs": np.ones((4, 1))}, "have 4 rows, the samples have 3"),
        ({"outputs": np.ones((2, 1))}, "have 2 rows, the samples have more"),
        ({"outputs": np.ones((3, 2))}, r"outputs must have shape \(3, 1\)"),
        ({"noise": [1.0, -1.0, 1.0]}, "negative variance, -1 in row 1"),
        ({"noise": np.ones(3), "drive": np.ones((2, 1))}, "different numbers of rows"),
        ({"readout": np.eye(2)}, "readout must have shape"),
        ({"state": np.ones(2)}, "state must have shape"),
        ({"form": "joseph"}, "'covariance' or 'square root'"),
        ({"space": 3}, "is a StateSpace"),
    ],
)
def test_k9_rows_that_do_not_fit_are_refused(options: dict[str, Any], message: str) -> None:
    given = {"y": np.ones(3), "space": local_level(), **options}
    with pytest.raises(InputError, match=message):
        run_filter(**given)


def test_k9_a_missing_sample_never_spreads(rng: np.random.Generator) -> None:
    y = with_gaps(rng.standard_normal(200), rng, part=0.5)
    result = run_filter(y, local_level(), readout=[[1.0]])
    assert np.isfinite(result.readout[np.isfinite(y).argmax() :]).all()
    assert np.array_equal(np.isnan(result.variances), np.isnan(y))


# -- the steady gain ------------------------------------------------------------------------------------------------


def test_steady_gain_is_where_the_filter_settles() -> None:
    model = NoiseModel.of(
        White(N=1.0), Flicker(B=0.5), Quantisation(Q=0.2), Sinusoid(amplitude=1.0, frequency=0.1)
    )
    space = merged(model.state_space(1.0, record=2000.0).with_constant())
    steady = steady_state(space)
    p = steady.predicted
    on = np.outer(np.diag(p) > 0, np.diag(p) > 0)
    again = space.transition @ steady.covariance @ space.transition.T + space.process
    size = np.sqrt(np.outer(np.diag(p), np.diag(p)))
    assert np.abs(again - p)[on].max() < 1e-12 * size.max()
    assert np.abs((again - p)[on] / size[on]).max() < 1e-12
    constants = [label in ("level", "sinusoid") for label in space.labels]
    assert (steady.gain[constants] == 0).all()
    # the recursion itself, from a covariance of zero, in the states that are driven
    run = FilterRun(
        replace(space, initial=np.zeros_like(space.initial), diffuse=np.zeros(space.size, dtype=bool))
    )
    _, variances, _, _ = run.feed(np.zeros(200_000))
    assert variances[-1] == pytest.approx(steady.innovation_variance, rel=1e-9)


def test_walks_that_no_sample_tells_apart_are_merged(rng: np.random.Generator) -> None:
    model = NoiseModel.of(White(N=1.0), Flicker(B=0.5), RandomWalk(K=0.01))
    for sampling in ("mean", "point"):
        space = model.state_space(1.0, sampling=sampling, record=500.0).with_constant()
        small = merged(space)
        assert small.size == space.size - 1
        y = np.cumsum(rng.standard_normal(400))
        one, other = run_filter(y, space), run_filter(y, small)
        assert other.innovations == pytest.approx(one.innovations, rel=1e-9, abs=1e-9, nan_ok=True)
        assert other.log_likelihood == pytest.approx(one.log_likelihood, rel=1e-12)
        with pytest.raises(FitError, match="merged"):
            steady_state(space)
        assert steady_state(small).gain.shape == (small.size,)
    assert merged(small) is small


def test_a_steady_gain_needs_white_noise() -> None:
    with pytest.raises(InputError, match="white noise above zero"):
        steady_state(replace(local_level(), noise=0.0))
