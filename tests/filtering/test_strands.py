# SPDX-License-Identifier: BSD-3-Clause
"""The likelihood in strands: the kernel against its NumPy twin, the whole against the filter that goes row by row."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

import reference
from allanite import _kernels
from allanite.errors import InputError
from allanite.filtering.kalman import FilterResult, log_likelihood, run_filter
from allanite.filtering.kalman.strands import Joined, joined
from allanite.noise import GaussMarkov, NoiseModel, RandomWalk, StateSpace, White
from reference import Floats

FORMS = ("covariance", "square root")
LANES = 4

# ---- the kernel -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Stretches:
    """A model and four stretches of samples with their guesses."""

    transition: Floats
    process: Floats
    output: Floats  # (4, 1 or rows, n)
    noise: Floats  # (4, 1 or rows)
    y: Floats  # (4, rows)
    guess: Floats  # (4, n)

    def run(
        self, *, square_root: bool, portable: bool = False, cuts: tuple[int, ...] = ()
    ) -> tuple[Floats, Floats] | None:
        n, rows = len(self.transition), self.y.shape[1]
        numbers, counters = (
            np.zeros((1 + n + 2 * n * n + (n + 1) ** 2, LANES)),
            np.zeros(2 * LANES, dtype=np.int64),
        )
        numbers[:n], numbers[n + n * n : n + 2 * n * n : n + 1], numbers[-1] = self.guess.T, 1.0, 1.0
        for start, stop in zip((0, *cuts), (*cuts, rows), strict=True):
            output, noise = (a if a.shape[1] == 1 else a[:, start:stop] for a in (self.output, self.noise))
            if not _kernels.kalman_strands(
                self.transition, self.process, list(output), list(noise), list(self.y[:, start:stop]), numbers,
                counters, square_root, portable,
            ):  # fmt: skip
                return None
        return numbers, counters


def random_stretches(seed: int, n: int, *, rows: int = 200) -> Stretches:
    """Diagonal transitions, those with one dense row, full ones; noise of few states or of all; samples missing."""
    rng = np.random.default_rng([seed, n])
    transition = np.diag(rng.uniform(0.5, 1.0, n))
    if seed % 3 == 1:
        transition[-1] = rng.uniform(0.1, 0.5, n)
    if seed % 3 == 2:
        transition += np.triu(rng.normal(size=(n, n)) * 0.1, 1)
    root = rng.normal(size=(n, n)) * 0.3
    process = root @ root.T if seed % 2 else np.diag(rng.uniform(0, 1, n) * (rng.random(n) < 0.6))
    y = rng.normal(size=(LANES, rows)) * 2
    y[rng.random(y.shape) < 0.1] = np.nan
    y[1, :20], y[2, 5] = np.nan, np.inf
    noise = rng.uniform(0.1, 2.0, (LANES, rows if seed % 4 < 2 else 1))
    if noise.shape[1] > 1:
        noise[3, 7] = np.nan
    return Stretches(
        transition=transition, process=process, output=rng.normal(size=(LANES, rows if seed % 5 else 1, n)),
        noise=noise, y=y, guess=rng.normal(size=(LANES, n)),
    )  # fmt: skip


@pytest.mark.parametrize("square_root", [False, True], ids=["covariance", "square-root"])
@pytest.mark.parametrize("n", [1, 2, 3, 4])
@pytest.mark.parametrize("seed", range(6))
def test_strands_equal_their_twin(seed: int, n: int, square_root: bool) -> None:
    given = random_stretches(seed, n)
    found = given.run(square_root=square_root)
    assert found is not None
    numbers, counters = found
    state, covariance, effects, moments, mantissa = np.split(
        numbers, np.cumsum([n, n * n, n * n, (n + 1) ** 2])
    )
    rows = given.y.shape[1]
    for lane in range(LANES):
        noise = np.broadcast_to(given.noise[lane], rows)
        twin = reference.strand(
            given.transition, given.process, np.broadcast_to(given.output[lane], (rows, n)), noise, given.y[lane],
            given.guess[lane],
        )  # fmt: skip
        p = covariance[:, lane].reshape(n, n).copy()
        if square_root:
            _kernels.kalman_compose(p)
        upper = np.triu_indices(n + 1)
        sums = moments[:, lane].reshape(n + 1, n + 1)
        for ours, theirs in (
            (state[:, lane], twin[0]),
            (p, twin[1]),
            (effects[:, lane].reshape(n, n).T, twin[2]),
            (sums[upper], twin[3][upper]),
        ):
            np.testing.assert_allclose(ours, theirs, rtol=1e-11, atol=1e-12)
        logs = math.log(mantissa[0, lane]) + counters[lane] * math.log(2)
        assert logs == pytest.approx(twin[4], rel=1e-12, abs=1e-12)
        assert counters[LANES + lane] == (np.isfinite(given.y[lane]) & np.isfinite(noise)).sum()


@pytest.mark.parametrize("square_root", [False, True], ids=["covariance", "square-root"])
@pytest.mark.parametrize("seed", range(6))
def test_every_processor_gives_the_same_digits(seed: int, square_root: bool) -> None:
    given = random_stretches(seed, 1 + seed % 4)
    one, other = (given.run(square_root=square_root, portable=portable) for portable in (False, True))
    assert one is not None
    assert other is not None
    for a, b in zip(one, other, strict=True):
        assert np.array_equal(a, b)


def test_cuts_of_strands_change_the_rounding_of_sums_alone() -> None:
    given = random_stretches(1, 3)
    one, other = given.run(square_root=False), given.run(square_root=False, cuts=(1, 1, 90))
    assert one is not None
    assert other is not None
    sums = slice(21, 37)
    np.testing.assert_allclose(other[0][sums], one[0][sums], rtol=1e-13)
    assert np.array_equal(np.delete(other[0], np.arange(21, 37), 0), np.delete(one[0], np.arange(21, 37), 0))
    assert np.array_equal(one[1], other[1])


@pytest.mark.parametrize("fault", ["no noise", "negative noise", "output", "process"])
def test_what_strands_cannot_treat_they_leave_to_the_filter(fault: str) -> None:
    given = random_stretches(0, 2)
    noise, output, y = given.noise.copy(), given.output.copy(), given.y.copy()
    process = -np.eye(2) if fault == "process" else given.process
    y[0, 50] = np.nan if fault in ("negative noise", "output") else 1.0  # even where nothing is measured
    noise[0, 50] = {"no noise": 0.0, "negative noise": -1.0}.get(fault, 1.0)
    if fault == "output":
        output[:, 0] = np.nan
    assert replace(given, noise=noise, output=output, y=y, process=process).run(square_root=True) is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"transition": np.eye(5)}, "states must be 1 to 4"),
        ({"process": np.eye(3)}, "process"),
        ({"y": [np.zeros(3)] * 3 + [np.zeros(2)]}, "y: must be of one length"),
        ({"output": [np.zeros((1, 2))] * 3 + [np.zeros((3, 2))]}, "output"),
        ({"noise": [np.ones(2)] * 4}, "noise"),
        ({"numbers": np.zeros((1, 4))}, "numbers"),
    ],
)
def test_shapes_that_do_not_agree_are_refused(change: dict[str, Any], message: str) -> None:
    given = {
        "transition": np.eye(2), "process": np.eye(2), "output": [np.zeros((1, 2))] * 4, "noise": [np.ones(1)] * 4,
        "y": [np.zeros(3)] * 4, "numbers": np.zeros((20, 4)), "counters": np.zeros(8, dtype=np.int64),
        "square_root": False,
    }  # fmt: skip
    with pytest.raises(ValueError, match=message):
        _kernels.kalman_strands(**given | change)


# ---- the likelihood -------------------------------------------------------------------------------------------------


@pytest.fixture
def joins(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Strands in short records too; whether each of them could be joined."""
    done: list[bool] = []

    def join(*given: Any, **options: Any) -> Joined | None:
        result = joined(*given, **options)
        done.append(result is not None)
        return result

    monkeypatch.setattr("allanite.filtering.kalman.filtering.LONG", 1000)
    monkeypatch.setattr("allanite.filtering.kalman.filtering.joined", join)
    return done


def one_by_one(y: Floats, space: StateSpace, **options: Any) -> FilterResult:
    """Blocks are filtered row by row."""
    return run_filter(iter([y]), space, store=False, **options)


def random_space(rng: np.random.Generator, n: int, *, n_diffuse: int, kind: str) -> StateSpace:
    """States whose units differ by up to sixteen powers of ten."""
    transition = np.diag(rng.uniform(0.9, 1.0, n))
    if kind == "slow":
        transition = np.diag(1 - 10.0 ** rng.uniform(-9, -1, n))
    if kind == "dense":
        transition = rng.normal(size=(n, n))
        transition *= rng.uniform(0.5, 0.98) / np.abs(np.linalg.eigvals(transition)).max()
    root, prior = rng.normal(size=(n, n)), rng.normal(size=(n, n))
    process = root @ root.T / n if kind == "dense" else np.diag(10.0 ** rng.uniform(-6, 0, n))
    if kind == "slow":
        process[-1, -1] = 0.0
    known = np.arange(n) < n - n_diffuse
    units = 10.0 ** rng.uniform(-8, 8, n)
    scale = np.outer(units, units)
    return StateSpace(
        transition=transition * np.outer(units, 1 / units), process=process * scale, output=rng.normal(size=n) / units,
        noise=float(rng.uniform(0.1, 3)), initial=prior @ prior.T * np.outer(known, known) * scale, rate=np.zeros(n),
        labels=("x",) * n, diffuse=~known,
    )  # fmt: skip


def simulated(space: StateSpace, outputs: Floats, noise: Floats, rng: np.random.Generator) -> Floats:
    """Samples with single ones, and a stretch of 1500, missing."""
    rows, n = outputs.shape
    units = np.where(np.diag(space.process) > 0, np.sqrt(np.diag(space.process)), 1.0)
    root = np.linalg.cholesky(space.process / np.outer(units, units) + 1e-30 * np.eye(n)) * units[:, None]
    s, y = np.zeros(n), np.empty(rows)
    for k, (v, w) in enumerate(zip(rng.standard_normal(rows), rng.standard_normal((rows, n)), strict=True)):
        y[k] = outputs[k] @ s + math.sqrt(noise[k]) * v
        s = space.transition @ s + root @ w
    y[rng.random(rows) < 0.1] = np.nan
    y[rows // 2 : rows // 2 + 1500] = np.nan
    return y


def assert_same(result: FilterResult, expected: FilterResult, *, states: float = 1e-8) -> None:
    sd = np.sqrt(np.diag(expected.covariance))
    scale = np.where(sd > 0, sd, 1.0)
    assert result.log_likelihood == pytest.approx(expected.log_likelihood, rel=1e-12)
    assert np.abs((result.state - expected.state) / scale).max() < states
    assert np.abs((result.covariance - expected.covariance) / np.outer(scale, scale)).max() < states
    for name in ("count", "diffuse_rows", "unresolved", "skipped"):
        assert getattr(result, name) == getattr(expected, name), name


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", ["fast", "slow", "dense"])
@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_strands_equal_the_filter(
    n: int, kind: str, form: Any, joins: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Any number of strands and of rows in a block; diffuse states; outputs and variances of their own for each row."""
    rng = np.random.default_rng([n, len(kind)])
    monkeypatch.setattr("allanite.filtering.kalman.strands.N_STRANDS", 4 * int(rng.integers(1, 6)))
    monkeypatch.setattr("allanite.filtering.kalman.strands.BLOCK", int(rng.choice([100, 1 << 15])))
    space, rows = random_space(rng, n, n_diffuse=n % 2, kind=kind), 6000
    outputs, noise = space.output * rng.normal(size=(rows, n)), rng.uniform(0.5, 2.0, rows)
    y = simulated(space, outputs, noise, rng)
    beside = {"outputs": outputs, "noise": noise, "form": form}
    assert_same(run_filter(y, space, store=False, **beside), one_by_one(y, space, **beside))
    assert len(joins) >= 4
    assert all(joins)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("sampling", ["point", "mean"])
def test_models_of_noise(sampling: Any, form: Any, joins: list[bool]) -> None:
    """With a level that is nothing like zero; the states of means have a dense row in their transition."""
    model = NoiseModel.of(White(N=1.0), GaussMarkov.from_sigma(0.5, 300.0), RandomWalk(K=0.01))
    for space in (
        model.state_space(1.0, sampling=sampling, record=20_000.0),
        NoiseModel.of(White(N=1.0), RandomWalk(K=0.01)).state_space(1.0, sampling=sampling).with_constant(),
    ):
        y = np.random.default_rng(5).standard_normal(20_000) + 100.0 * space.diffuse.any()
        assert_same(run_filter(y, space, form=form, store=False), one_by_one(y, space, form=form))
    assert len(joins) == 32
    assert all(joins)


def reversed_sensor(rows: int) -> tuple[Floats, StateSpace, Floats]:
    """The model of the benchmark: flicker, walk, and a rate that changes its sign."""
    space = StateSpace(
        transition=np.diag([0.999, 1.0, 1.0]), process=np.diag([1e-3, 1e-5, 0.0]), output=np.array([1.0, 1.0, 0.0]),
        noise=1.0, initial=np.diag([0.5, 0.0, 1.0]), rate=np.zeros(3), labels=("x",) * 3, diffuse=np.zeros(3, bool),
    )  # fmt: skip
    outputs = np.ones((rows, 3))
    outputs[:, 2] = np.where(np.arange(rows) // 960 % 2, -1.0, 1.0)
    return np.random.default_rng(9).standard_normal(rows) + 0.3 * outputs[:, 2], space, outputs


@pytest.mark.parametrize("form", FORMS)
def test_long_records_take_the_strands_by_themselves(form: Any) -> None:
    y, space, outputs = reversed_sensor(300_000)
    result = run_filter(y, space, outputs=outputs, form=form, store=False)
    expected = one_by_one(y, space, outputs=outputs, form=form)
    assert result.log_likelihood != expected.log_likelihood or not np.array_equal(
        result.state, expected.state
    )
    assert_same(result, expected)
    for threads in (1, 3):
        again = log_likelihood(y, space, outputs=outputs, form=form, threads=threads)
        assert again == result.log_likelihood, "as many digits with any number of threads"
    made = log_likelihood(y, space, outputs=lambda start, stop: outputs[start:stop], form=form)
    assert made == result.log_likelihood, "rows that are made as they are wanted"
    short = y.astype(np.float32)
    assert log_likelihood(short, space, outputs=outputs, form=form) == pytest.approx(
        result.log_likelihood, rel=1e-6
    )


def test_what_is_carried_on_after_the_strands_is_the_state_of_the_filter(joins: list[bool]) -> None:
    """A later record goes on from it: the likelihood is that of both."""
    y, space, outputs = reversed_sensor(30_000)
    first = run_filter(y[:20_000], space, outputs=outputs[:20_000], store=False)
    start = replace(space, initial=first.covariance)
    second = run_filter(y[20_000:], start, outputs=outputs[20_000:], state=first.state, store=False)
    whole = one_by_one(y, space, outputs=outputs)
    assert first.log_likelihood + second.log_likelihood == pytest.approx(whole.log_likelihood, rel=1e-12)
    assert joins == [True] * 32


@pytest.mark.parametrize(
    "case",
    [
        "no noise",
        "far from the guess",
        "all missing",
        "nothing at first",
        "unknown to the end",
        "known drive",
    ],
)
def test_where_strands_do_not_go_the_filter_does(case: str, joins: list[bool]) -> None:
    """To the last digit where no strand was joined; the answer is never worse than that of the filter."""
    y, space, outputs = reversed_sensor(6000)
    beside: dict[str, Any] = {"outputs": outputs}
    if case == "no noise":
        beside["noise"] = np.where(np.arange(6000) == 100, 0.0, 1.0)
    elif case == "far from the guess":
        outputs[:1000, 2] = 0.0
        y += 1e6 * outputs[:, 2]
        space = replace(space, initial=np.diag([0.5, 0.0, 1e12]))
    elif case == "all missing":
        y[:] = np.nan
    elif case == "nothing at first":
        y[:2000] = np.nan
        space = replace(space, diffuse=np.ones(3, dtype=bool))
    elif case == "unknown to the end":
        beside = {}
        space = replace(space, diffuse=np.ones(3, dtype=bool))
    else:
        beside["drive"] = np.full((6000, 3), 1e-3)
    result, expected = run_filter(y, space, store=False, **beside), one_by_one(y, space, **beside)
    if case in ("no noise", "unknown to the end", "known drive"):
        assert result.log_likelihood == expected.log_likelihood
        assert np.array_equal(result.covariance, expected.covariance)
    assert_same(result, expected)
    assert all(joins) == (case != "far from the guess")


@pytest.mark.usefixtures("joins")
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"noise": np.where(np.arange(6000) == 4000, -1.0, 1.0)}, "negative variance, -1 in row 4000"),
        (
            {"outputs": np.where(np.arange(18_000) == 16_000, np.nan, 1.0).reshape(6000, 3)},
            "outputs holds numbers",
        ),
        ({"outputs": np.ones((6001, 3))}, "have 6001 rows, the samples have 6000"),
        ({"outputs": np.ones((5999, 3))}, "have 5999 rows, the samples have more"),
        ({"outputs": np.ones((6000, 2))}, r"outputs must have shape \(6000, 3\)"),
        ({"outputs": lambda start, stop: np.ones((stop - start, 2))}, "outputs must have shape"),
        ({"noise": lambda start, stop: -np.ones(stop - start)}, "negative variance, -1 in row 0"),
        ({"threads": 0}, "threads must be at least 1, not 0"),
        ({"y": np.ones((6000, 1))}, r"shape \(rows,\)"),
    ],
)
def test_long_records_are_refused_as_short_ones_are(change: dict[str, Any], message: str) -> None:
    y, space, _ = reversed_sensor(6000)
    with pytest.raises(InputError, match=message):
        log_likelihood(**{"y": y, "space": space, **change})
