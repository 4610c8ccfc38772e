# SPDX-License-Identifier: BSD-3-Clause
"""A record whose rate changes is told so, with both rates, and is offered no mean rate."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import DataQualityError


@pytest.mark.parametrize(
    ("share", "before", "after"),
    [
        (0.2, 10.0, 5.0),
        (0.2, 100.0, 37.0),
        (0.2, 200.0, 50.0),
        (0.5, 5.0, 10.0),
        (0.5, 100.0, 37.0),
        (0.7, 5.0, 10.0),
        (0.9, 5.0, 10.0),
        (0.8, 100.0, 130.0),
        (0.3, 100.0, 102.0),
    ],
)
@pytest.mark.parametrize("jitter", [0.0, 0.02])
@pytest.mark.parametrize("pauses", [0, 3])
def test_both_rates_and_the_place_are_named(
    share: float,
    before: float,
    after: float,
    jitter: float,
    pauses: int,
    tmp_path: Path,
    rng: np.random.Generator,
) -> None:
    n = 6000
    change = int(share * n)
    intervals = np.where(np.arange(n) < change, 1 / before, 1 / after)
    intervals[rng.choice(n, pauses, replace=False)] *= 40
    times = np.cumsum(intervals) + jitter * np.minimum(
        intervals, 1 / min(before, after)
    ) * rng.standard_normal(n)
    log = tmp_path / "log.csv"
    rows = np.column_stack([times, rng.standard_normal(n)])
    np.savetxt(log, rows, delimiter=",", header="time [s],gyro [deg/h]", comments="", fmt="%.9g")
    with pytest.raises(DataQualityError) as refused:
        al.read(log)
    words = str(refused.value)
    assert "--rate" not in words and "fit no even grid" in words
    found = re.search(r"from ([\d.]+) Hz to ([\d.]+) Hz about ([\d.]+) s", words)
    assert found is not None
    assert float(found[1]) == pytest.approx(before, rel=0.01)
    assert float(found[2]) == pytest.approx(after, rel=0.01)
    at = float(found[3])
    assert at == pytest.approx(times[change] - times[0], abs=n // 128 / min(before, after))
    assert al.read(log, stop=0.95 * at).rate == pytest.approx(before, rel=0.001)
    assert al.read(log, start=1.05 * at).rate == pytest.approx(after, rel=0.001)


@pytest.mark.parametrize("share", [0.7, 0.9])
def test_every_second_sample_lost_from_some_row_on_is_no_change_of_the_rate(
    share: float, tmp_path: Path, rng: np.random.Generator
) -> None:
    times, n = np.arange(6000.0) / 10, 6000
    kept = (np.arange(n) < share * n) | (np.arange(n) % 2 == 0)
    log = tmp_path / "log.csv"
    rows = np.column_stack([times, rng.standard_normal(n)])[kept]
    np.savetxt(log, rows, delimiter=",", header="time [s],gyro [deg/h]", comments="", fmt="%.9g")
    record = al.read(log)
    assert record.rate == pytest.approx(10.0)
    assert np.isnan(record.values("gyro")).sum() == record.n_samples - kept.sum()
    assert record.n_samples in (n - 1, n)
