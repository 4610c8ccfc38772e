# SPDX-License-Identifier: BSD-3-Clause
"""Kalman kernels: NumPy twins, batch solutions, published numbers, exact invariances, rounding at its worst."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

import reference
from allanite import _kernels
from reference import Floats

FORMS = pytest.mark.parametrize("square_root", [False, True], ids=["covariance", "square-root"])


@dataclass(kw_only=True)
class Problem:
    """A model, what is known of the first state, and measurements, in the shapes of the kernels."""

    transition: Floats
    process: Floats
    output: Floats
    noise: Floats
    y: Floats
    covariance: Floats
    directions: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    drive: Floats | None = None
    readout: Floats | None = None

    def __post_init__(self) -> None:
        n = len(self.transition)
        self.y = self.y if self.y.ndim == 2 else self.y[:, None]
        p = self.y.shape[1]
        if self.output.ndim == 1:
            self.output = self.output.reshape(1, p, n)
        self.noise = self.noise.reshape(-1, p, p)
        if not len(self.directions):
            self.directions = np.zeros((0, n))
        self.drive = np.zeros((0, n)) if self.drive is None else self.drive
        self.readout = np.eye(n) if self.readout is None else self.readout

    def rows(self, block: slice) -> Problem:
        def cut(array: Floats) -> Floats:
            return array if len(array) != len(self.y) else array[block]

        return replace(
            self, output=cut(self.output), noise=cut(self.noise), y=self.y[block], drive=cut(self.drive)
        )

    def every_row(self) -> dict[str, Floats]:
        """As the twins want it: nothing is constant."""
        k, p, n = len(self.y), self.y.shape[1], len(self.transition)
        return {
            "transition": self.transition,
            "process": self.process,
            "output": np.broadcast_to(self.output, (k, p, n)),
            "noise": np.broadcast_to(self.noise, (k, p, p)),
            "y": self.y,
            "drive": self.drive if len(self.drive) else np.zeros((k, n)),
        }

    def model(self) -> tuple[Floats, ...]:
        return self.transition, self.process, self.output, self.noise, self.y, self.drive, self.readout


class Filter:
    """The kernel with all that it carries, and the results of the last block."""

    def __init__(self, problem: Problem, *, square_root: bool) -> None:
        n = len(problem.transition)
        self.square_root = square_root
        self.state = np.zeros(n)
        self.covariance = problem.covariance.copy()
        self.directions = np.zeros((n, n))
        self.directions[: len(problem.directions)] = problem.directions
        self.sums = np.array([1.0, 0.0, 0.0, 1.0])
        self.counts = np.array([0, 0, len(problem.directions), 0, 0, 0])
        if square_root:
            assert _kernels.kalman_factor(self.covariance)

    def run(self, problem: Problem) -> Filter:
        rows, p = problem.y.shape
        g = len(problem.readout)
        self.means, self.sds = np.empty((rows, g)), np.empty((rows, g))
        self.innovations, self.variances = np.empty((rows, p)), np.empty((rows, p))
        carried = (self.state, self.covariance, self.directions, self.sums, self.counts)
        results = (self.means, self.sds, self.innovations, self.variances)
        _kernels.kalman_filter(*problem.model(), *carried, *results, self.square_root)
        return self

    def checkpoint(self) -> tuple[Floats, Floats, Floats, int]:
        return self.state.copy(), self.covariance.copy(), self.directions.copy(), int(self.counts[2])

    @property
    def log_likelihood(self) -> float:
        return _kernels.kalman_likelihood(self.sums, self.counts)[0]

    @property
    def log_diffuse(self) -> float:
        return _kernels.kalman_likelihood(self.sums, self.counts)[1]

    def composed(self) -> Floats:
        p = self.covariance.copy()
        if self.square_root:
            _kernels.kalman_compose(p)
        return p


def run(problem: Problem, *, square_root: bool = False) -> Filter:
    return Filter(problem, square_root=square_root).run(problem)


def smooth(problem: Problem, *, square_root: bool, block: int | None = None) -> tuple[Floats, Floats]:
    rows, n = len(problem.y), len(problem.transition)
    step = block or rows
    blocks = [slice(k, min(k + step, rows)) for k in range(0, rows, step)]
    forward, checkpoints = Filter(problem, square_root=square_root), []
    for part in blocks:
        checkpoints.append(forward.checkpoint())
        forward.run(problem.rows(part))
    means, sds = np.empty((rows, len(problem.readout))), np.empty((rows, len(problem.readout)))
    gradient, information = np.zeros(n), np.zeros((n, n))
    for part, (*start, rank) in zip(blocks[::-1], checkpoints[::-1], strict=True):
        _kernels.kalman_smooth(
            *problem.rows(part).model(), *start, rank, int(forward.counts[2]),
            gradient, information, means[part], sds[part], square_root,
        )  # fmt: skip
    return means, sds


def local_level() -> Problem:
    """Koopman (1997)."""
    y = np.ones(10)
    y[0] = 10.2394
    return Problem(
        transition=np.eye(1), process=np.full((1, 1), 8.253), output=np.ones(1), noise=np.array([1.993]), y=y,
        covariance=np.zeros((1, 1)), directions=np.eye(1),
    )  # fmt: skip


def random_problem(seed: int, *, rows: int = 40) -> Problem:
    """Stationary states, constants and walks among them unknown at the start; every kind of input."""
    rng = np.random.default_rng(seed)
    n, p = int(rng.integers(0, 7)), int(rng.integers(1, 4))
    transition = np.diag(rng.uniform(0.5, 0.99, n))
    root = rng.normal(size=(n, n)) * 0.3
    process = root @ root.T
    unknown = np.flatnonzero(rng.random(n) < 0.4)
    transition[unknown, unknown] = 1.0
    if seed % 3 == 1 and n > 1 and n - 1 not in unknown:  # the mean over an interval: one dense row
        transition[-1] = rng.uniform(0.1, 0.5, n)
    if seed % 3 == 2:
        transition += np.triu(rng.normal(size=(n, n)) * 0.1, 1)
    if seed % 4 == 0:
        process = np.diag(np.diag(process) * (rng.random(n) < 0.6))
    root = rng.normal(size=(n, n))
    covariance = root @ root.T
    covariance[unknown] = covariance[:, unknown] = 0.0
    root = rng.normal(size=(p, p))
    noise = root @ root.T + 0.1 * np.eye(p) if seed % 2 else np.diag(rng.uniform(0.1, 1, p))
    noise = noise * rng.uniform(0.5, 2, (rows, 1, 1)) if seed % 5 < 3 else noise[None]
    y = rng.normal(size=(rows, p)) * 2
    y[rng.random((rows, p)) < 0.2] = np.nan
    if seed % 5 == 0:
        y[:6] = np.nan
    return Problem(
        transition=transition, process=process, output=rng.normal(size=(rows if seed % 7 else 1, p, n)), noise=noise,
        y=y, covariance=covariance, directions=np.eye(n)[unknown],
        drive=rng.normal(size=(rows, n)) if seed % 2 else None, readout=rng.normal(size=(2, n)),
    )  # fmt: skip


# ---- against the twins ----------------------------------------------------------------------------------------------


@FORMS
@pytest.mark.parametrize("seed", range(40))
def test_filter_equals_its_twin(seed: int, square_root: bool) -> None:
    problem = random_problem(seed)
    states, covariances, remaining, log_likelihood, log_diffuse = reference.kalman_filter(
        **problem.every_row(), state=np.zeros(len(problem.transition)), covariance=problem.covariance,
        diffuse=problem.directions.T @ problem.directions,
    )  # fmt: skip
    result = run(problem, square_root=square_root)
    g = problem.readout
    known = np.einsum("gi,kij,gj->kg", g, np.abs(remaining), g) < 1e-9
    variances = np.einsum("gi,kij,gj->kg", g, covariances, g)
    assert np.array_equal(np.isfinite(result.sds), known)
    assert np.array_equal(np.isnan(result.means), ~known)
    scale = 1 + np.abs(states).max(initial=0.0)
    np.testing.assert_allclose(result.means[known], (states @ g.T)[known], rtol=0, atol=1e-11 * scale)
    np.testing.assert_allclose(result.sds[known] ** 2, variances[known], rtol=1e-10)
    assert result.log_likelihood == pytest.approx(log_likelihood, rel=1e-12)
    if result.counts[2] == 0:  # before that it depends on the units of the states
        assert result.log_diffuse == pytest.approx(log_diffuse, rel=1e-10, abs=1e-10)
    finite = np.isfinite(result.innovations)
    assert finite.sum() == result.counts[0]
    assert result.counts[3] == np.isinf(result.variances).sum() == len(problem.directions) - result.counts[2]
    assert result.counts[5] == 0
    nis = result.innovations[finite] ** 2 / result.variances[finite]
    by_hand = -0.5 * np.sum(np.log(2 * np.pi * result.variances[finite]) + nis)
    assert result.log_likelihood == pytest.approx(by_hand, rel=1e-12)


@pytest.mark.parametrize("c", [1, 4])
@pytest.mark.parametrize("n", [0, 1, 3, 6])
def test_whiten_equals_its_twin(n: int, c: int) -> None:
    rng = np.random.default_rng(n)
    root, rows = rng.normal(size=(n, n)) * 0.3, 100
    transition = np.diag(rng.uniform(0.5, 1, n))
    transition[n - 1 :] = rng.uniform(0, 0.5, n)
    noise, columns = rng.uniform(0.1, 2, rows), rng.normal(size=(rows, c))
    noise[[0, 50, 51]], columns[70, 0] = np.nan, np.nan
    model = (transition, root @ root.T, rng.normal(size=n), noise)
    covariance, state, out = np.eye(n) * 3, rng.normal(size=(n, c)), np.empty((rows, c))
    expected = reference.whiten(*model, covariance, state, columns)
    total = _kernels.whiten(*model, covariance, state, columns, out)
    assert total == pytest.approx(expected[1], rel=1e-12)
    for ours, twin in ((out, expected[0]), (covariance, expected[2]), (state, expected[3])):
        np.testing.assert_allclose(ours, twin, rtol=1e-12, atol=1e-13)
    assert np.array_equal(covariance, covariance.T)


def test_whiten_is_the_filter_and_may_work_in_place() -> None:
    given, rng = random_problem(12), np.random.default_rng(1)
    n = len(given.transition)
    problem = Problem(
        transition=given.transition, process=given.process, output=given.output[0, 0],
        noise=rng.uniform(0.5, 2, 40), y=given.y[:, 0], covariance=np.eye(n),
    )  # fmt: skip
    filtered = run(problem)
    y = problem.y.copy()
    total = _kernels.whiten(
        problem.transition, problem.process, problem.output[0, 0], problem.noise[:, 0, 0].copy(), np.eye(n),
        np.zeros((n, 1)), y, y,
    )  # fmt: skip
    np.testing.assert_allclose(y, filtered.innovations / np.sqrt(filtered.variances), rtol=1e-12)
    assert total == pytest.approx(np.nansum(np.log(filtered.variances)), rel=1e-12)


@pytest.mark.parametrize("fault", ["negative noise", "no variance"])
def test_whiten_says_when_a_row_has_no_variance(fault: str) -> None:
    noise = np.array([1.0, -1.0 if fault == "negative noise" else 0.0, 1.0])
    output = np.array([2.0 if fault == "negative noise" else 0.0])
    out = np.empty((3, 1))
    total = _kernels.whiten(
        np.eye(1), np.eye(1), output, noise, np.eye(1), np.zeros((1, 1)), np.ones((3, 1)), out
    )
    assert math.isnan(total)
    assert np.isfinite(out[[0, 2]]).all()


# ---- published numbers and closed forms -----------------------------------------------------------------------------


@FORMS
def test_k1_local_level(square_root: bool) -> None:
    result = run(local_level(), square_root=square_root)
    assert result.log_likelihood == pytest.approx(-23.01632185093656111, rel=1e-12)
    assert result.log_diffuse == 0.0
    assert result.counts.tolist()[:4] == [9, 0, 0, 1]
    np.testing.assert_allclose(result.means[:3, 0], [10.2394, 2.50454483, 1.25167384], rtol=4e-9)
    assert result.means[-1, 0] == pytest.approx(1.000000927215463497, rel=1e-12)
    assert result.sds[-1, 0] ** 2 == pytest.approx(1.659364779788760324, rel=1e-12)
    assert result.sds[0, 0] ** 2 == pytest.approx(1.993, rel=1e-14)
    assert smooth(local_level(), square_root=square_root)[0][0, 0] == pytest.approx(8.692691894822, rel=1e-12)


@FORMS
def test_k2_steady_state(square_root: bool) -> None:
    result = run(replace(local_level(), y=np.ones(60)), square_root=square_root)
    assert result.composed()[0, 0] == pytest.approx(9.912364779788756868, rel=1e-12)
    assert result.sds[-1, 0] ** 2 == pytest.approx(1.659364779788756868, rel=1e-12)
    assert result.sds[-1, 0] ** 2 / 1.993 == pytest.approx(0.8325964775658589401, rel=1e-12)


@FORMS
def test_k12_constant_and_white_is_the_mean(square_root: bool) -> None:
    y = np.random.default_rng(5).normal(size=10_000) + 3e5
    result = run(
        Problem(
            transition=np.eye(1), process=np.zeros((1, 1)), output=np.ones(1), noise=np.array([4.0]), y=y,
            covariance=np.zeros((1, 1)), directions=np.eye(1),
        ),
        square_root=square_root,
    )  # fmt: skip
    assert result.means[-1, 0] == pytest.approx(y.mean(), rel=1e-12)
    assert result.sds[-1, 0] == pytest.approx(2 / 100, rel=1e-12)


# ---- scale ----------------------------------------------------------------------------------------------------------


def ramp_with_turns() -> Problem:
    """Level and slope unknown, a constant seen through a sign that changes, Gauss-Markov noise, gaps."""
    rng = np.random.default_rng(8)
    rows = 200
    output = np.ones((rows, 1, 4))
    output[:, 0, 1], output[:, 0, 2] = 0.0, np.where(np.arange(rows) // 30 % 2, -1.0, 1.0)
    transition = np.diag([1.0, 1.0, 1.0, 0.97])
    transition[0, 1] = 1e-3
    y = np.cumsum(rng.normal(size=rows)) + rng.normal(size=rows)
    y[[0, 1, 40, 41, 42]] = np.nan
    covariance = np.diag([0.0, 0.0, 0.0, 2.0])
    return Problem(
        transition=transition, process=np.diag([1e-2, 1e-7, 0.0, 0.1]), output=output, noise=np.array([0.7]), y=y,
        covariance=covariance, directions=np.eye(4)[:3],
    )  # fmt: skip


@FORMS
@pytest.mark.parametrize("scale", [1e-8, 1e-5, 1e-3, 1e3, 1e8, 2.0**-30, 2.0**200])
def test_k3_rescaled_data_rescale_the_result(scale: float, square_root: bool) -> None:
    plain = ramp_with_turns()
    scaled = replace(
        plain, y=plain.y * scale, noise=plain.noise * scale**2, process=plain.process * scale**2,
        covariance=plain.covariance * scale**2,
    )  # fmt: skip
    a, b = run(plain, square_root=square_root), run(scaled, square_root=square_root)
    exact = math.frexp(scale)[0] == 0.5  # a power of two changes no digit
    for ours, theirs in (
        (b.means / scale, a.means),
        (b.sds / scale, a.sds),
        (b.composed() / scale**2, a.composed()),
    ):
        if exact:
            assert np.array_equal(ours, theirs, equal_nan=True)
        else:
            np.testing.assert_allclose(ours, theirs, rtol=1e-11, atol=1e-12)
    per_sample = b.log_likelihood / b.counts[0] + math.log(scale)
    assert per_sample == pytest.approx(a.log_likelihood / a.counts[0], rel=1e-12)
    assert b.log_diffuse == a.log_diffuse
    smoothed = smooth(plain, square_root=square_root)
    for ours, theirs in zip(smooth(scaled, square_root=square_root), smoothed, strict=True):
        np.testing.assert_allclose(ours / scale, theirs, rtol=1e-9, atol=1e-12)


@FORMS
@pytest.mark.parametrize("units", [(1e-8, 1e5, 1e8, 1e-3), (1e9, 1e-9, 1.0, 1e6)])
def test_k3_units_of_the_states_do_not_matter(units: tuple[float, ...], square_root: bool) -> None:
    plain, c = ramp_with_turns(), np.array(units)
    outer = np.outer(c, c)
    scaled = replace(
        plain, output=plain.output / c, transition=plain.transition * np.outer(c, 1 / c),
        process=plain.process * outer, covariance=plain.covariance * outer, readout=np.diag(1 / c),
    )  # fmt: skip
    a, b = run(plain, square_root=square_root), run(scaled, square_root=square_root)
    np.testing.assert_allclose(b.means, a.means, rtol=1e-10, atol=1e-11)
    np.testing.assert_allclose(b.sds, a.sds, rtol=1e-10)
    assert b.log_likelihood == pytest.approx(a.log_likelihood, rel=1e-12)
    assert np.array_equal(b.counts[[0, 2, 3, 5]], a.counts[[0, 2, 3, 5]])


def test_likelihood_of_a_thousand_tiny_variances() -> None:
    y = np.random.default_rng(2).normal(size=1000) * 1e-150
    result = run(replace(local_level(), y=y, noise=np.array([1e-300]), process=np.zeros((1, 1))))
    assert result.log_likelihood == pytest.approx(
        -0.5 * np.nansum(np.log(2 * np.pi * result.variances[1:]) + (result.innovations[1:] / 1e-150) ** 2
                         * (1e-300 / result.variances[1:])), rel=1e-12,
    )  # fmt: skip


# ---- rounding -------------------------------------------------------------------------------------------------------


def chain(start: float, noise: float, rows: int) -> Problem:
    """Position, velocity, acceleration; the position is measured."""
    transition = np.array([[1.0, 0.1, 0.005], [0.0, 1.0, 0.1], [0.0, 0.0, 1.0]])
    y = np.sin(np.arange(rows) * 0.01)
    return Problem(
        transition=transition, process=np.diag([0.0, 0.0, 1e-6]), output=np.array([1.0, 0.0, 0.0]),
        noise=np.array([noise]), y=y, covariance=np.eye(3) * start,
    )  # fmt: skip


@pytest.mark.parametrize("noise", [1e-4, 1e-10, 1e-12])
@pytest.mark.parametrize("start", [1e2, 1e6, 1e12, 1e20])
def test_k4_square_root_form_stays_definite(start: float, noise: float) -> None:
    problem = chain(start, noise, 2000)
    result, worst = Filter(problem, square_root=True), 0.0
    for k in range(len(problem.y)):
        result.run(problem.rows(slice(k, k + 1)))
        eigenvalues = np.linalg.eigvalsh(result.composed())
        worst = min(worst, eigenvalues[0] / eigenvalues[-1])
    assert worst >= -1e-12
    exact = run(replace(problem, covariance=np.zeros((3, 3)), directions=np.eye(3)), square_root=True)
    np.testing.assert_allclose(result.composed(), exact.composed(), rtol=1e-8)
    np.testing.assert_allclose(result.state, exact.state, rtol=1e-8)


@pytest.mark.parametrize("square_root", [False, True])
def test_k11_a_million_steps_leave_a_sound_covariance(square_root: bool) -> None:
    rows = 1_000_000
    problem = Problem(
        transition=np.diag([0.999, 1.0, 0.9]), process=np.diag([1e-4, 1e-6, 1e-2]), output=np.ones(3),
        noise=np.array([1.0]), y=np.ones(rows), covariance=np.eye(3), readout=np.zeros((0, 3)),
    )  # fmt: skip
    p = run(problem, square_root=square_root).composed()
    assert np.array_equal(p, p.T)
    assert np.linalg.eigvalsh(p)[0] > 0
    f, h = problem.transition, problem.output[0]
    after = f @ (p - p @ h.T @ h @ p / (h @ p @ h.T + 1.0)) @ f.T + problem.process
    np.testing.assert_allclose(after, p, rtol=1e-9)


# ---- gaps, vectors, blocks ------------------------------------------------------------------------------------------


@FORMS
def test_k8_gaps_are_prediction(square_root: bool) -> None:
    problem = random_problem(7)
    problem.y[10:25] = np.nan
    before = run(problem.rows(slice(0, 10)), square_root=square_root)
    state, p = before.state.copy(), before.composed()
    after = before.run(problem.rows(slice(10, 25)))
    for k in range(10, 25):
        state = problem.transition @ state + problem.drive[k]
        p = problem.transition @ p @ problem.transition.T + problem.process
    np.testing.assert_allclose(after.state, state, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(after.composed(), p, rtol=1e-12, atol=1e-14)
    assert np.isnan(after.innovations).all()


@FORMS
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_k9_what_is_not_finite_is_missing(bad: float, square_root: bool) -> None:
    problem = random_problem(7)
    there = replace(problem, y=np.where(np.isnan(problem.y), bad, problem.y))
    a, b = run(problem, square_root=square_root), run(there, square_root=square_root)
    assert np.array_equal(a.means, b.means)
    assert np.isfinite(b.state).all()
    noise = np.broadcast_to(problem.noise, (40, *problem.noise.shape[1:])).copy()
    noise[np.isnan(problem.y).any(axis=1)] = bad
    c = run(replace(problem, noise=noise), square_root=square_root)
    assert np.isfinite(c.state).all()
    assert c.counts[5] == 0


@FORMS
def test_k9_no_noise_and_negative_noise(square_root: bool) -> None:
    still = replace(local_level(), process=np.zeros((1, 1)), noise=np.zeros(1), y=np.full(5, 0.1))
    exact = run(still, square_root=square_root)
    assert (exact.means == 0.1).all()
    assert (exact.sds == 0.0).all()
    assert exact.counts[5] == 4, "a state that is known exactly is measured again: nothing to learn"
    moving = run(replace(local_level(), noise=np.zeros(1)), square_root=square_root)
    assert np.array_equal(moving.means[:, 0], local_level().y[:, 0])
    negative = run(replace(local_level(), noise=np.full(1, -1.0)), square_root=square_root)
    assert negative.counts[5] == 10
    assert negative.counts[2] == 1
    assert np.isnan(negative.innovations).all()


def test_k9_matrices_that_are_no_covariances() -> None:
    assert not _kernels.kalman_factor(np.array([[1.0, 2.0], [2.0, 1.0]]))
    assert not _kernels.kalman_factor(np.array([[-1.0]]))
    assert not _kernels.kalman_factor(np.array([[np.nan]]))
    with pytest.raises(ValueError, match="process: not positive semidefinite"):
        run(replace(local_level(), process=np.full((1, 1), -1.0)), square_root=True)


@pytest.mark.parametrize("n", [0, 1, 2, 5, 9])
def test_factors_compose_to_their_matrix(n: int) -> None:
    root = np.random.default_rng(n).normal(size=(n, n + 1))
    root[: n // 3] = 0.0
    matrix = root @ root.T
    factors = matrix.copy()
    assert _kernels.kalman_factor(factors)
    assert (np.diag(factors) >= 0).all()
    assert np.array_equal(np.tril(factors, -1), np.zeros((n, n)))
    _kernels.kalman_compose(factors)
    np.testing.assert_allclose(factors, matrix, rtol=1e-12, atol=1e-13)


@FORMS
@pytest.mark.parametrize("correlated", [False, True])
def test_vector_measurement_equals_least_squares(correlated: bool, square_root: bool) -> None:
    rng = np.random.default_rng(4)
    n, p, rows = 3, 4, 30
    root = rng.normal(size=(p, p))
    noise = root @ root.T + 0.1 * np.eye(p) if correlated else np.diag(rng.uniform(0.1, 2, p))
    output, y = rng.normal(size=(rows, p, n)), rng.normal(size=(rows, p))
    y[rng.random((rows, p)) < 0.3] = np.nan
    problem = Problem(
        transition=np.eye(n), process=np.zeros((n, n)), output=output, noise=noise, y=y,
        covariance=np.zeros((n, n)), directions=np.eye(n),
    )  # fmt: skip
    result, information, moment = run(problem, square_root=square_root), np.zeros((n, n)), np.zeros(n)
    for k in range(rows):
        use = np.isfinite(y[k])
        weight = np.linalg.inv(noise[np.ix_(use, use)])
        information += output[k][use].T @ weight @ output[k][use]
        moment += output[k][use].T @ weight @ y[k][use]
    np.testing.assert_allclose(result.composed(), np.linalg.inv(information), rtol=1e-11, atol=1e-14)
    np.testing.assert_allclose(result.state, np.linalg.solve(information, moment), rtol=1e-11, atol=1e-12)


@FORMS
@pytest.mark.parametrize("seed", [3, 7, 10, 16, 19, 22, 26])
def test_block_cuts_leave_no_trace(seed: int, square_root: bool) -> None:
    problem = random_problem(seed)
    whole, rng = run(problem, square_root=square_root), np.random.default_rng(seed)
    cuts = [0, *sorted(rng.integers(0, 41, 6)), 40]
    parts = Filter(problem, square_root=square_root)
    means = []
    for start, stop in zip(cuts, cuts[1:], strict=False):
        means.append(parts.run(problem.rows(slice(start, stop))).means)
    assert np.array_equal(np.concatenate(means), whole.means, equal_nan=True)
    for name in ("state", "covariance", "sums", "counts"):
        assert np.array_equal(getattr(parts, name), getattr(whole, name)), name


@FORMS
@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_fixed_size_equals_free_size(n: int, square_root: bool) -> None:
    """The same model with idle states is beyond the sizes that are fixed."""
    rng = np.random.default_rng(n)
    small = Problem(
        transition=np.diag(rng.uniform(0.5, 1, n)), process=np.diag(rng.uniform(0.1, 1, n)), output=rng.normal(size=n),
        noise=np.array([0.5]), y=rng.normal(size=300), covariance=np.eye(n), readout=np.zeros((0, n)),
    )  # fmt: skip
    idle = np.eye(5)
    transition, process, covariance = idle.copy(), idle.copy(), idle.copy()
    transition[:n, :n], process[:n, :n], covariance[:n, :n] = (
        small.transition,
        small.process,
        small.covariance,
    )
    large = replace(
        small, transition=transition, process=process, covariance=covariance, readout=np.zeros((0, 5)),
        output=np.concatenate([small.output[0, 0], np.zeros(5 - n)]), directions=np.zeros((0, 5)),
        drive=np.zeros((0, 5)),
    )  # fmt: skip
    a, b = run(small, square_root=square_root), run(large, square_root=square_root)
    np.testing.assert_allclose(b.state[:n], a.state, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(b.composed()[:n, :n], a.composed(), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(b.innovations, a.innovations, rtol=1e-11, atol=1e-13)
    assert b.log_likelihood == pytest.approx(a.log_likelihood, rel=1e-13)


# ---- the smoother ---------------------------------------------------------------------------------------------------


def smoother_errors(problem: Problem, means: Floats, sds: Floats) -> tuple[Floats, Floats]:
    """Against batch conditioning: of the mean in sds, of the sd relative; the largest of each row."""
    states, covariances = reference.condition(
        **problem.every_row(), covariance=problem.covariance, directions=problem.directions
    )
    expected = np.sqrt(np.einsum("gi,kij,gj->kg", problem.readout, covariances, problem.readout))
    mean_errors = np.abs(means - states @ problem.readout.T) / expected
    return mean_errors.max(axis=1), np.abs(sds / expected - 1).max(axis=1)


@FORMS
@pytest.mark.parametrize("block", [None, 1, 64])
def test_k10_smoother_equals_batch_conditioning(block: int | None, square_root: bool) -> None:
    problem = ramp_with_turns()
    errors = smoother_errors(problem, *smooth(problem, square_root=square_root, block=block))
    assert max(error.max() for error in errors) < 1e-10


@FORMS
@pytest.mark.parametrize(
    "seed", sorted(set(range(24)) - {0, 11, 23})
)  # 0 leaves something unknown; no states
def test_k10_smoother_of_any_model(seed: int, square_root: bool) -> None:
    problem = random_problem(seed)
    assert int(run(problem).counts[2]) == 0
    means, sds = smooth(problem, square_root=square_root, block=[None, 7, 1, 64][seed % 4])
    mean_error, sd_error = smoother_errors(problem, means, sds)
    assert mean_error.max() < 1e-10
    filtered = run(replace(problem, readout=np.eye(len(problem.transition))), square_root=square_root)
    known = np.isfinite(filtered.sds).all(axis=1)
    assert sd_error[known].max() < 1e-10
    # Where the first sample to see a state hardly saw it, its variance falls by a factor of a million afterwards.
    assert sd_error.max() < 1e-8


@FORMS
def test_smoother_of_what_the_record_never_tells(square_root: bool) -> None:
    """Two constants that are only ever seen together: their sum is known, neither of them is."""
    y = np.random.default_rng(1).normal(size=50)
    y[:3] = np.nan
    together = Problem(
        transition=np.eye(2), process=np.zeros((2, 2)), output=np.array([1.0, 0.3]), noise=np.ones(1), y=y,
        covariance=np.zeros((2, 2)), directions=np.eye(2), readout=np.array([[1.0, 0.3], [1.0, 0.0], [2.0, 0.6]]),
    )  # fmt: skip
    filtered = run(together, square_root=square_root)
    assert filtered.counts[2] == 1
    assert np.array_equal(np.isinf(filtered.sds[10]), [False, True, False])
    for block in (None, 10):
        means, sds = smooth(together, square_root=square_root, block=block)
        np.testing.assert_allclose(means[:, 0], np.nanmean(y), rtol=1e-12)
        np.testing.assert_allclose(sds[:, 0], 1 / math.sqrt(47), rtol=1e-12)
        np.testing.assert_allclose(sds[:, 2], 2 / math.sqrt(47), rtol=1e-12)
        assert np.isnan(means[:, 1]).all()
        assert np.isinf(sds[:, 1]).all()


@FORMS
def test_reversals_separate_a_constant_from_the_bias(square_root: bool) -> None:
    """Seen together until the sensor is turned; from there on both are known, and the smoother knows from the start."""
    rows, turn = 60, 25
    output = np.ones((rows, 1, 2))
    output[turn:, 0, 1] = -1.0
    problem = Problem(
        transition=np.eye(2), process=np.zeros((2, 2)), output=output, noise=np.ones(1),
        y=output[:, 0] @ np.array([5.0, 0.25]), covariance=np.zeros((2, 2)), directions=np.eye(2),
    )  # fmt: skip
    filtered = run(problem, square_root=square_root)
    assert np.isinf(filtered.sds[:turn]).all()
    np.testing.assert_allclose(filtered.means[turn:], np.tile([5.0, 0.25], (rows - turn, 1)), rtol=1e-13)
    means, sds = smooth(problem, square_root=square_root, block=10)
    np.testing.assert_allclose(means, np.tile([5.0, 0.25], (rows, 1)), rtol=1e-12)
    np.testing.assert_allclose(sds, 0.5 * math.sqrt(1 / turn + 1 / (rows - turn)), rtol=1e-12)


# ---- an independent package -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(8))
def test_statsmodels_agrees(seed: int) -> None:
    api = pytest.importorskip("statsmodels.tsa.statespace.mlemodel", reason="statsmodels is not installed")
    rng = np.random.default_rng(seed)
    n, p, rows = int(rng.integers(1, 5)), int(rng.integers(1, 3)), 200
    root, start, error = (rng.normal(size=(k, k)) for k in (n, n, p))
    problem = Problem(
        transition=np.diag(rng.uniform(0.5, 0.99, n)) + np.triu(rng.normal(size=(n, n)) * 0.1, 1),
        process=root @ root.T, output=rng.normal(size=(rows, p, n)), noise=error @ error.T + 0.1 * np.eye(p),
        y=rng.normal(size=(rows, p)), covariance=start @ start.T,
    )  # fmt: skip
    problem.y[rng.random((rows, p)) < 0.2] = np.nan
    theirs: Any = api.MLEModel(problem.y, k_states=n, k_posdef=n, tolerance=0)
    theirs["design"] = np.moveaxis(problem.output, 0, -1)
    theirs["obs_cov"], theirs["transition"] = problem.noise[0], problem.transition
    theirs["selection"], theirs["state_cov"] = np.eye(n), problem.process
    theirs.initialize_known(np.zeros(n), problem.covariance)
    expected = theirs.ssm.smooth()
    ours = run(problem)
    assert ours.log_likelihood == pytest.approx(expected.llf, rel=1e-9)
    np.testing.assert_allclose(ours.means, expected.filtered_state.T, rtol=1e-9, atol=1e-9)
    means, sds = smooth(problem, square_root=False)
    np.testing.assert_allclose(means, expected.smoothed_state.T, rtol=1e-9, atol=1e-9)
    variances = np.diagonal(expected.smoothed_state_cov, axis1=0, axis2=1)
    np.testing.assert_allclose(sds**2, variances, rtol=1e-9)


# ---- refusals -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"transition": np.eye(2)}, "process|output|transition"),
        ({"output": np.ones((3, 1, 1))}, "output"),
        ({"noise": np.ones((3, 1, 1))}, "noise"),
        ({"drive": np.ones((3, 1))}, "drive"),
        ({"readout": np.ones((1, 2))}, "readout"),
        ({"y": np.zeros((10, 0))}, "y: must"),
    ],
)
def test_shapes_that_do_not_agree_are_refused(change: dict[str, Floats], message: str) -> None:
    problem = local_level()
    state = Filter(problem, square_root=False)
    for name, value in change.items():
        setattr(problem, name, value)
    none = np.empty((0, 1))
    carried = (state.state, state.covariance, state.directions, state.sums, state.counts)
    with pytest.raises(ValueError, match=message):
        _kernels.kalman_filter(*problem.model(), *carried, none, none, none, none, False)


@pytest.mark.parametrize("rank", [-1, 2])
def test_impossible_diffuse_rank_is_refused(rank: int) -> None:
    state = Filter(local_level(), square_root=False)
    state.counts[2] = rank
    with pytest.raises(ValueError, match="rank"):
        state.run(local_level())
