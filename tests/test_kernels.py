# SPDX-License-Identifier: BSD-3-Clause
"""Compiled kernels against their NumPy twins, exact arithmetic, an independent package, and bad input."""

from __future__ import annotations

import csv
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import reference
from allanite import _kernels
from reference import Floats, Integers

ROOT = Path(__file__).resolve().parent.parent
KERNELS = ROOT / "kernels"


def phase_of(y: Floats, offset: float = 0.0) -> Floats:
    x = np.zeros(len(y) + 1)
    _kernels.integrate(y, offset, 0.0, x[1:])
    return x


def starts_of(y: Floats, lags: Integers, order: int) -> tuple[Integers, Integers]:
    """Runs of complete starts, lag after lag, and where each lag's runs begin."""
    runs = [reference.runs_where(reference.complete(y, order * m)) for m in lags]
    return np.concatenate(runs), np.cumsum([0] + [len(r) for r in runs])


def squares(y: Floats, lags: Integers, order: int = 2, offset: float = 0.0, block: int = 512) -> Floats:
    runs, run_offsets = starts_of(y, lags, order)
    n_blocks = -(-len(y) // block)
    return _kernels.difference_squares(
        phase_of(y, offset), order, lags, runs, run_offsets, 0, n_blocks, block
    ).sum(axis=0)


class Online:
    """The online kernel with its state."""

    def __init__(self, lags: Integers, order: int = 2, positions: int = 64, block: int = 1024) -> None:
        self.plan = (lags, order, positions, block)
        n_numbers, n_counters = _kernels.online_allan_size(*self.plan)
        self.state = (np.zeros(n_numbers), np.zeros(n_counters, np.int64))

    def feed(self, y: Floats, offset: float = 0.0) -> Online:
        _kernels.online_allan_feed(*self.state, *self.plan, y, offset)
        return self

    def read(self) -> tuple[Floats, Integers]:
        return _kernels.online_allan_read(*self.state, *self.plan)


def fitting_lags(longest: int, positions: int) -> Integers:
    """Every lag that the online kernel can serve, up to the longest."""
    lags = list(range(1, 2 * positions))
    stride = 2
    while positions * stride <= longest:
        lags += [q * stride for q in range(positions, 2 * positions)]
        stride *= 2
    return np.array([m for m in lags if m <= longest])


def with_gaps(rng: np.random.Generator, n: int) -> Floats:
    """White noise whose first sample, a block, the last sample and some single ones are missing."""
    y = rng.standard_normal(n)
    y[rng.integers(0, n, 3)] = [np.nan, np.inf, -9.9e37]
    y[n // 3 : n // 3 + n // 20] = np.nan
    y[0] = y[-1] = np.nan
    return y


# ---- missing samples: the first one is the test to write first ------------------------------------------------------


@pytest.mark.parametrize("order", [2, 3])
def test_b1_first_sample_missing(rng: np.random.Generator, order: int) -> None:
    y = rng.standard_normal(2000)
    y[0] = np.nan
    lags = np.array([1, 2, 3, 10, 100, 127])
    expected = squares(y[1:], lags, order)
    np.testing.assert_allclose(squares(y, lags, order), expected, rtol=1e-12)
    sums, counts = Online(lags, order).feed(y).read()
    np.testing.assert_allclose(sums, expected, rtol=1e-12)
    np.testing.assert_array_equal(counts, len(y) - 1 - order * lags + 1)


def test_b1_every_sample_missing() -> None:
    y = np.full(300, np.nan)
    lags = np.array([1, 5])
    assert squares(y, lags).tolist() == [0.0, 0.0]
    sums, counts = Online(lags).feed(y).read()
    assert sums.tolist() == [0.0, 0.0]
    assert counts.tolist() == [0, 0]


def test_b2_overload_words_are_missing() -> None:
    words = np.array([np.nan, np.inf, -np.inf, 9.9e37, -9.9e37, 9.91e37, 1e38, -1e38, 1.7e308])
    np.testing.assert_array_equal(_kernels.missing_runs(words, 5), [[5, 5 + len(words)]])
    kept = np.array([0.0, -0.0, 9.8e37, -9.8e37, 5e-324, 32767.0])
    assert _kernels.missing_runs(kept, 0).shape == (0, 2)
    x = phase_of(np.concatenate([words, [1.0], words, [2.0]]))
    assert x[-1] == 3.0


def test_missing_runs_against_twin(rng: np.random.Generator) -> None:
    for share in (0.01, 0.5, 0.99):
        y = np.where(rng.random(500) < share, np.nan, 1.0)
        expected = reference.runs_where(reference.missing(y))
        np.testing.assert_array_equal(_kernels.missing_runs(y, 0), expected)
        np.testing.assert_array_equal(_kernels.missing_runs(y, 10**12), expected + 10**12)


# ---- twins ----------------------------------------------------------------------------------------------------------


def test_integrate_against_twin(rng: np.random.Generator) -> None:
    y = with_gaps(rng, 5000)
    np.testing.assert_allclose(phase_of(y, 0.3)[1:], reference.integrate(y, 0.3, 0.0), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("gaps", [False, True])
def test_difference_squares_against_twin(rng: np.random.Generator, order: int, gaps: bool) -> None:
    y = with_gaps(rng, 3001) if gaps else rng.standard_normal(3001)
    lags = np.array([1, 2, 3, 7, 8, 9, 64, 333, 1000])
    found = squares(y, lags, order, offset=0.1, block=256)
    expected = [reference.difference_squares(y, order, int(m), offset=0.1)[0] for m in lags]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("gaps", [False, True])
def test_modified_squares_against_twin(rng: np.random.Generator, gaps: bool) -> None:
    y = with_gaps(rng, 14_000) if gaps else rng.standard_normal(14_000)
    for m in (1, 2, 5, 100, 1500, 4667):
        runs = reference.runs_where(reference.complete(y, 3 * m - 1))
        expected, _ = reference.modified_squares(y, m)
        assert _kernels.modified_squares(phase_of(y), m, runs) == pytest.approx(expected, rel=1e-12)


def test_total_squares_against_twin(rng: np.random.Generator) -> None:
    y = rng.standard_normal(5001)
    for m in (1, 2, 17, 2500, 2501, 5000, 5001):
        expected = reference.total_squares(y, m)
        assert _kernels.total_squares(phase_of(y), m) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("positions", [1, 4, 64])
@pytest.mark.parametrize("gaps", [False, True])
def test_online_allan_against_twin(rng: np.random.Generator, order: int, positions: int, gaps: bool) -> None:
    y = with_gaps(rng, 6007) if gaps else rng.standard_normal(6007)
    lags = fitting_lags(6007 // order, positions)
    sums, counts = Online(lags, order, positions, block=128).feed(y, offset=0.1).read()
    twins = [reference.online_squares(y, order, int(m), positions, 0.1) for m in lags]
    np.testing.assert_array_equal(counts, [count for _, count in twins])
    np.testing.assert_allclose(sums, [s for s, _ in twins], rtol=1e-11, atol=1e-12)


def test_online_allan_equals_the_exact_sums_below_two_windows_of_positions(rng: np.random.Generator) -> None:
    y = with_gaps(rng, 20_000)
    lags = np.arange(1, 128)
    np.testing.assert_allclose(Online(lags).feed(y).read()[0], squares(y, lags), rtol=1e-12)


def test_s1_a_large_offset_costs_no_digits(rng: np.random.Generator) -> None:
    """2.5 V in steps of 0.1 uV with 1 uV of noise, the offset known roughly: against sums of whole numbers."""
    counts = np.rint(10 * rng.standard_normal(200_000))
    lags = np.ascontiguousarray(fitting_lags(60_000, 64)[::9])
    exact = [reference.online_squares(counts, 2, int(m))[0] for m in lags]
    y = counts + 25_000_000
    for offset in (0.0, float(y[:1000].mean())):
        np.testing.assert_allclose(Online(lags).feed(y, offset).read()[0], exact, rtol=1e-12)
    few = np.array([1, 10, 100, 10_000])
    whole = [reference.difference_squares(counts, 2, int(m))[0] for m in few]
    np.testing.assert_allclose(squares(y, few, offset=float(y[:1000].mean())), whole, rtol=1e-12)


def test_online_allan_pieces_add(rng: np.random.Generator) -> None:
    """Two records, and one with a hole between them, give the same sums where the grids coincide."""
    y = rng.standard_normal(30_000)
    lags = fitting_lags(5000, 64)
    hole = np.concatenate([y[:16384], np.full(16384, np.nan), y[16384:]])
    first, second = Online(lags).feed(y[:16384]).read(), Online(lags).feed(y[16384:]).read()
    sums, counts = Online(lags).feed(hole).read()
    np.testing.assert_array_equal(first[1] + second[1], counts)
    np.testing.assert_allclose(first[0] + second[0], sums, rtol=1e-11)


def test_markov_noise_against_twin(rng: np.random.Generator) -> None:
    normals = rng.standard_normal((1000, 3))
    phi, step_sd = np.array([1.0, 0.99, 0.1]), np.array([0.1, 0.2, 0.3])
    now, following = np.array([0.5, 0.25, 1.0]), np.array([0.5, 0.25, 0.0])
    state, out = np.array([1.0, 2.0, 3.0]), np.full(1000, 7.0)
    added, last = reference.markov_noise(normals, phi, step_sd, now, following, state.copy())
    _kernels.markov_noise(normals, phi, step_sd, now, following, state, out)
    np.testing.assert_allclose(out - 7.0, added, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(state, last, rtol=1e-12)


# ---- exact and independent oracles ----------------------------------------------------------------------------------


def test_r10_exact_rational_arithmetic(rng: np.random.Generator) -> None:
    """OADEV of 200 integer vectors at every lag, against fractions: nothing is rounded but the square root."""
    for _ in range(200):
        n = int(rng.integers(2, 301))
        y = rng.integers(-1000, 1001, n)
        lags = np.arange(1, n // 2 + 1)
        x = np.concatenate([[0], np.cumsum(y)])
        found = squares(y.astype(float), lags, offset=float(y[0]))
        for m, value in zip(lags.tolist(), found.tolist(), strict=True):
            d = x[2 * m :] - 2 * x[m : -m or None] + x[: -2 * m]
            exact = Fraction(int(np.sum(d * d)), 2 * m * m * len(d))
            oadev = (value / (2 * m * m * len(d))) ** 0.5
            assert oadev == pytest.approx(float(exact) ** 0.5, rel=1e-13, abs=0.0)


def lehmer(n: int) -> Floats:
    """The generator of NIST SP 1065, section 12.4."""
    values, state = np.empty(n), 1234567890
    for i in range(n):
        values[i] = state / 2147483647
        state = 16807 * state % 2147483647
    return values


def test_r13_three_independent_codes() -> None:
    """Kernel, twin and an independent package (its results are on file; the script that wrote them lies beside)."""
    y = lehmer(100_000)
    offset = float(y.mean())
    phase = phase_of(y, offset)
    checked = 0
    with (ROOT / "tests" / "published" / "allantools.csv").open() as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            name, m, other, terms = (
                row["statistic"],
                int(row["m"]),
                float(row["deviation"]),
                int(row["terms"]),
            )
            order = 3 if name == "ohdev" else 2
            if name in ("oadev", "ohdev"):
                value = float(squares(y, np.array([m]), order, offset)[0])
                twin, count = reference.difference_squares(y, order, m, offset)
            elif name == "mdev":
                count = len(y) - 3 * m + 2
                value = _kernels.modified_squares(phase, m, np.array([[0, count]]))
                twin, count = reference.modified_squares(y, m, offset) if m < 10_000 else (value, count)
            elif name == "totdev":
                value, twin, count = (
                    _kernels.total_squares(phase, m),
                    reference.total_squares(y, m, offset),
                    len(y) - 1,
                )
            else:
                continue  # built from the others in Python
            norm = {2: 2, 3: 6}[order] * m * m * count
            assert count == terms
            assert (value / norm) ** 0.5 == pytest.approx(other, rel=1e-11), (name, m)
            assert (twin / norm) ** 0.5 == pytest.approx(other, rel=1e-11), (name, m)
            checked += 1
    assert checked == 32


# ---- the same digits, however the work is cut -----------------------------------------------------------------------


@pytest.mark.parametrize("chunk", [1, 7, 4096, 20_000])
def test_m10_chunks_give_the_same_bits(rng: np.random.Generator, chunk: int) -> None:
    y = with_gaps(rng, 20_000)
    whole = phase_of(y, 0.3)
    pieces, end = np.zeros_like(whole), 0.0
    for i in range(0, len(y), chunk):
        block = y[i : i + chunk]
        end = _kernels.integrate(block, 0.3, end, pieces[i + 1 : i + 1 + len(block)])
    np.testing.assert_array_equal(pieces, whole)

    lags = fitting_lags(6000, 64)
    expected = Online(lags).feed(y, 0.3).read()
    online = Online(lags)
    for i in range(0, len(y), chunk):
        online.feed(y[i : i + chunk], 0.3)
        if i % 1000 == 0:
            online.read()  # reading changes nothing
    np.testing.assert_array_equal(online.read()[0], expected[0])
    np.testing.assert_array_equal(online.read()[1], expected[1])


@pytest.mark.parametrize("threads", [2, 3, 16])
def test_m10_threads_give_the_same_bits(rng: np.random.Generator, threads: int) -> None:
    y = with_gaps(rng, 50_000)
    lags = np.unique(np.geomspace(1, 20_000, 40).astype(np.int64))
    runs, run_offsets = starts_of(y, lags, 2)
    phase, block, n_blocks = phase_of(y), 1000, 50
    whole = _kernels.difference_squares(phase, 2, lags, runs, run_offsets, 0, n_blocks, block)
    cuts = np.linspace(0, n_blocks, threads + 1).astype(int)
    with ThreadPoolExecutor(threads) as pool:
        parts = pool.map(
            lambda a, b: _kernels.difference_squares(phase, 2, lags, runs, run_offsets, a, b, block),
            cuts[:-1].tolist(),
            cuts[1:].tolist(),
        )
    np.testing.assert_array_equal(np.concatenate(list(parts)), whole)


def test_m10_markov_noise_in_chunks_gives_the_same_bits(rng: np.random.Generator) -> None:
    normals, out, pieces = rng.standard_normal((1000, 2)), np.zeros(1000), np.zeros(1000)
    parameters = (np.array([1.0, 0.9]), np.ones(2), np.full(2, 0.5), np.full(2, 0.5))
    _kernels.markov_noise(normals, *parameters, np.zeros(2), out)
    state = np.zeros(2)
    for i in range(0, 1000, 7):
        _kernels.markov_noise(normals[i : i + 7], *parameters, state, pieces[i : i + 7])
    np.testing.assert_array_equal(pieces, out)


# ---- refusals -------------------------------------------------------------------------------------------------------

F, I = np.zeros, lambda *values: np.array(values, dtype=np.int64)  # noqa: E741
NO_RUNS = np.zeros((0, 2), dtype=np.int64)


@pytest.mark.parametrize(
    ("kernel", "arguments"),
    [
        ("integrate", (F(0), 0.0, 0.0, F(0))),
        ("integrate", (F(3), 0.0, 0.0, F(2))),
        ("integrate", (F((2, 2)), 0.0, 0.0, F(4))),
        ("integrate", (F(4)[::2], 0.0, 0.0, F(2))),
        ("integrate", (F(3, dtype=np.float32), 0.0, 0.0, F(3))),
        ("integrate", (F(3), 0.0, 0.0, np.broadcast_to(0.0, 3))),
        ("missing_runs", (F(0), 0)),
        ("difference_squares", (F(0), 2, I(1), NO_RUNS, I(0, 0), 0, 1, 8)),
        ("difference_squares", (F(9), 1, I(1), NO_RUNS, I(0, 0), 0, 1, 8)),
        ("difference_squares", (F(9), 4, I(1), NO_RUNS, I(0, 0), 0, 1, 8)),
        ("difference_squares", (F(9), 2, I(), NO_RUNS, I(0), 0, 1, 8)),
        ("difference_squares", (F(9), 2, I(0), NO_RUNS, I(0, 0), 0, 1, 8)),
        ("difference_squares", (F(9), 2, I(-1), NO_RUNS, I(0, 0), 0, 1, 8)),
        ("difference_squares", (F(9), 2, I(2**62), NO_RUNS, I(0, 0), 0, 1, 8)),
        ("difference_squares", (F(9), 2, I(1), NO_RUNS, I(0), 0, 1, 8)),
        ("difference_squares", (F(9), 2, I(1), np.array([[0, 7]]), I(0, 2), 0, 1, 8)),
        ("difference_squares", (F(9), 2, I(1, 2), np.array([[0, 3]]), I(0, 9, 1), 0, 1, 8)),
        ("difference_squares", (F(9), 2, I(1), np.array([[0, 8]]), I(0, 1), 0, 1, 8)),
        ("difference_squares", (F(9), 2, I(1), np.array([[-1, 3]]), I(0, 1), 0, 1, 8)),
        ("difference_squares", (F(9), 2, I(1), np.array([[3, 3]]), I(0, 1), 0, 1, 8)),
        ("difference_squares", (F(9), 2, I(1), np.array([[4, 5], [0, 2]]), I(0, 2), 0, 1, 8)),
        ("difference_squares", (F(9), 2, I(1), NO_RUNS, I(0, 0), 1, 0, 8)),
        ("difference_squares", (F(9), 2, I(1), NO_RUNS, I(0, 0), -1, 0, 8)),
        ("difference_squares", (F(9), 2, I(1), NO_RUNS, I(0, 0), 0, 1, 0)),
        ("difference_squares", (F(9), 2, I(1), NO_RUNS, I(0, 0), 0, 2**62, 2**10)),
        ("modified_squares", (F(9), 0, NO_RUNS)),
        ("modified_squares", (F(9), 2, np.array([[0, 5]]))),
        ("total_squares", (F(2), 1)),
        ("total_squares", (F(9), 9)),
        ("total_squares", (F(9), 0)),
        ("online_allan_size", (I(),)),
        ("online_allan_size", (I(0),)),
        ("online_allan_size", (I(129),)),
        ("online_allan_size", (I(-128),)),
        ("online_allan_size", (I(2**62),)),
        ("online_allan_size", (I(2, 1),)),
        ("online_allan_size", (I(1), 2, 0)),
        ("online_allan_size", (I(1), 2, 64, 7)),
        ("online_allan_size", (I(1), 1)),
        ("online_allan_feed", (F(3), I(0, 0), I(1), 2, 64, 1024, F(5), 0.0)),
        ("markov_noise", (F((5, 2)), F(2), F(2), F(2), F(2), F(2), F(4))),
        ("markov_noise", (F((5, 2)), F(1), F(2), F(2), F(2), F(2), F(5))),
        ("markov_noise", (F((5, 0)), F(0), F(0), F(0), F(0), F(0), F(5))),
    ],
)
def test_bad_arguments_are_refused(kernel: str, arguments: tuple[object, ...]) -> None:
    with pytest.raises((ValueError, TypeError)):
        getattr(_kernels, kernel)(*arguments)


def test_online_state_that_was_tampered_with_is_refused() -> None:
    for filled in ([5000, 0, 0], [0, -1, 0], [0, 511, 0], [1023, 1023, 0]):
        online = Online(np.array([1, 128, 256])).feed(np.zeros(10_000))
        online.state[1][:3] = filled
        with pytest.raises(ValueError, match="not a state"):
            online.feed(np.zeros(10))


# ---- the C++ side ---------------------------------------------------------------------------------------------------


def test_stub_is_fresh(tmp_path: Path) -> None:
    pytest.importorskip("nanobind", reason="nanobind, which writes the stub, is not installed")
    fresh = tmp_path / "_kernels.pyi"
    command = [sys.executable, "-m", "nanobind.stubgen", "-q", "-m", "allanite._kernels", "-o", str(fresh)]
    subprocess.run(command, check=True)
    committed = ROOT / "src" / "allanite" / "_kernels.pyi"
    assert fresh.read_text() == committed.read_text(), "write it anew: " + " ".join(command[1:])


@pytest.mark.long
def test_cpp_program_under_sanitizers(tmp_path: Path) -> None:
    if not (shutil.which("make") and shutil.which("g++")):
        pytest.skip("needs make and g++")
    done = subprocess.run(
        ["make", "-C", str(KERNELS), "test", f"BUILD={tmp_path}", "ROUNDS=500"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 failed" in done.stdout


@pytest.mark.long
def test_headers_are_firmware_safe(tmp_path: Path) -> None:
    if not (shutil.which("make") and shutil.which("arm-none-eabi-g++")):
        pytest.skip("needs make and arm-none-eabi-g++ (Debian: gcc-arm-none-eabi)")
    done = subprocess.run(
        ["make", "-C", str(KERNELS), "freestanding", f"BUILD={tmp_path}"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
