# SPDX-License-Identifier: BSD-3-Clause
"""The phase of a long record lies in a temporary file: the same numbers, and memory that does not grow with it."""

import tracemalloc
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.errors import StorageError
from allanite.noise import NoiseModel, White
from allanite.noise.allan.lags import octave_lags
from allanite.noise.allan.statistics import STATISTICS, phase_of, sums_of_squares
from allanite.recording.block_series import BlockSeries, made_by_blocks
from allanite.recording.records import Recording
from allanite.stability.shared_noise import separate_noise
from allanite.stability.variation import examine_variation
from resident_memory import needs_resident_bytes, resident_bytes

WHITE = NoiseModel.of(White(N=1e-2))
USES: dict[str, Callable[[Recording], Any]] = {
    "allan": lambda given: al.allan_curve(given.select("x")),
    "common": separate_noise,
    "variation": partial(examine_variation, channels=["x"], models=WHITE, windows=16),
}


@pytest.fixture
def in_files(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("allanite.recording.block_series.IN_MEMORY", 0)


def record(n: int) -> Recording:
    """Two channels of whole numbers, without what a tenth of a per cent would hold."""
    rng = np.random.default_rng(7)
    samples = rng.integers(-100, 100, (n, 2), dtype=np.int16)
    samples[:, 1] += samples[:, 0] // 2
    whole = Recording.from_rate(samples, rate=100.0, unit="deg/h", names=["x", "y"])
    return whole.excluding({"x": [(n // 3, n // 3 + n // 1000)]}, "test")


@pytest.mark.parametrize("use", USES)
def test_numbers_are_those_of_a_phase_in_memory(use: str, monkeypatch: pytest.MonkeyPatch) -> None:
    known = USES[use](record(50_000)).to_json()
    monkeypatch.setattr("allanite.recording.block_series.IN_MEMORY", 0)
    assert USES[use](record(50_000)).to_json() == known


@pytest.mark.long
@pytest.mark.usefixtures("in_files")
@pytest.mark.parametrize("use", USES)
def test_memory_does_not_grow_with_the_record(use: str) -> None:
    """A sample more takes less than a byte; one float64 of it takes eight."""
    sizes, peaks = (1 << 20, 1 << 22), []
    for n in sizes:
        given = record(n)
        tracemalloc.start()
        USES[use](given)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] - peaks[0] < sizes[1] - sizes[0]


@pytest.mark.usefixtures("in_files")
@needs_resident_bytes
def test_pages_of_the_file_are_given_back() -> None:
    """They count as memory of the process as long as they are mapped."""
    n = 1 << 23
    phase = phase_of(Recording.from_rate(np.zeros(n, dtype=np.int8), rate=1.0, unit="V"), "signal")
    before, most = resident_bytes(), 0

    def looked(_: float) -> None:
        nonlocal most
        most = max(most, resident_bytes() - before)

    sums_of_squares(phase, STATISTICS["oadev"], octave_lags(n, window=4), threads=1, progress=looked)
    assert isinstance(phase.x, np.memmap)
    assert 0 < most < phase.x.nbytes / 4


@pytest.mark.usefixtures("in_files")
def test_no_folder_for_temporary_files_is_a_refusal(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(**_: object) -> None:
        raise FileNotFoundError(2, "No usable temporary directory found in ['/tmp']")

    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.setattr("tempfile.TemporaryFile", refused)
    with pytest.raises(StorageError, match=r"any folder: No usable .*set TMPDIR"):
        al.allan_curve(record(1000))


@pytest.mark.parametrize("limit", [0, 1 << 20])
def test_a_series_is_what_was_put_into_it(limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """In any order, and made of others."""
    monkeypatch.setattr("allanite.recording.block_series.IN_MEMORY", limit)
    rng = np.random.default_rng(3)
    given = rng.standard_normal(1000)
    series = BlockSeries(len(given))
    for start in rng.permutation(range(0, 1000, 100)):
        series.put(int(start), given[start : start + 100])
    whole = series.finish()
    assert isinstance(whole, np.memmap) is (limit == 0)
    assert np.array_equal(whole, given) and not whole.flags.writeable
    assert np.array_equal(made_by_blocks(np.subtract, whole, given[::-1]), given - given[::-1])
