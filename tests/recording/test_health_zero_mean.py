# SPDX-License-Identifier: BSD-3-Clause
"""Gyro means of zero: what the record can tell of a bias that was subtracted, and how often chance says so."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from allanite.recording.health import meaning
from allanite.recording.health.examination import check
from allanite.recording.health.finding import Finding
from allanite.recording.health.survey import survey
from allanite.recording.health.tallies import PartSums
from allanite.recording.records import Recording
from noise_records import binomial_bound, flicker

DEG_H = math.radians(1.0) / 3600.0
EARTH = 7.292115e-5


def gyros(
    rng: np.random.Generator, n: int, duration: float, noise: float, mean: NDArray[np.float64]
) -> Recording:
    """White gyros, one for each mean [rad/s], with N of `noise` [deg/sqrt(h)]."""
    sigma = math.radians(noise) / 60.0 * math.sqrt(n / duration)
    samples = sigma * rng.standard_normal((n, len(mean))) + mean
    return Recording.from_rate(samples, rate=n / duration, unit="rad/s")


def removed(recording: Recording) -> list[Finding]:
    return list(meaning.bias_removed([survey(recording, name) for name in recording.names]))


@pytest.mark.parametrize(
    ("duration", "noise", "mean"), [(200.0, 0.06, 10.6), (200.0, 0.06, 15.0), (3600.0, 0.3, 30.0)]
)
def test_a_gyro_that_sees_its_bias_or_the_earth_is_not_called_bias_free(
    rng: np.random.Generator, duration: float, noise: float, mean: float
) -> None:
    """The means lie 40 to 100 standard errors from zero."""
    for _ in range(5):
        recording = gyros(rng, 20_000, duration, noise, np.array([mean * DEG_H]))
        error = noise / math.sqrt(duration / 3600.0)
        assert abs(float(recording.values("signal").mean())) / DEG_H > 30.0 * error
        assert not [f for f in check(recording) if f.code == "bias_removed"]


@pytest.mark.long
@pytest.mark.parametrize(
    ("axes", "duration", "noise"),
    [(1, 36_000.0, 0.3), (1, 3_600.0, 0.06), (3, 3_600.0, 0.3), (3, 600.0, 0.06), (1, 36_000.0, 1.0)],
)
def test_false_findings_are_no_more_frequent_than_stated(axes: int, duration: float, noise: float) -> None:
    """The Earth in an orientation evenly spread, and biases of the least size: one record of 100 at the most.

    One in ten fails with 90 %.
    """
    rng = np.random.default_rng(20261121)
    trials, alarms = 100, 0
    spread = meaning.BIAS_OVER_NOISE * math.radians(noise) / 60.0
    for _ in range(trials):
        direction = rng.standard_normal(3)
        rotation = EARTH * direction / np.linalg.norm(direction)
        bias = rng.uniform(-spread, spread, 3)
        alarms += bool(removed(gyros(rng, 512, duration, noise, (rotation + bias)[:axes])))
    assert alarms <= binomial_bound(trials, meaning.BY_CHANCE)


@pytest.mark.parametrize(
    ("axes", "duration", "noise", "words"),
    [
        (3, 3_600.0, 0.3, "the Earth's rotation, 15 deg/h, with it"),
        (1, 36_000.0, 0.06, "no more than 0."),
        (3, 3_600.0, 12.0, "was subtracted, too"),
    ],
)
def test_a_mean_that_was_subtracted_is_found_and_the_earth_spoken_of_as_the_record_allows(
    axes: int, duration: float, noise: float, words: str
) -> None:
    """In the last, the standard error is 12 deg/h: 35 deg/h might be hidden."""
    rng = np.random.default_rng(7)
    for _ in range(20):
        recording = gyros(rng, 2048, duration, noise, np.zeros(axes))
        y = np.stack([recording.values(name) for name in recording.names], axis=1)
        said = removed(Recording.from_rate(y - y.mean(axis=0), rate=recording.rate, unit="rad/s"))
        assert len(said) == axes
        assert all(words in f.message for f in said)


def test_the_error_of_a_mean_holds_slow_noise() -> None:
    """Flicker makes the means of parts scatter more than white noise would: a mean known to 1 deg/h tells nothing."""
    rng = np.random.default_rng(11)
    sigma = math.radians(0.06) / 60.0 * 10.0
    for _ in range(5):
        y = sigma * (rng.standard_normal(65_536) + flicker(rng, 65_536))
        white = sigma / math.sqrt(len(y))
        zero = meaning._zero_of(survey(Recording.from_rate(y - y.mean(), rate=100.0, unit="rad/s"), "signal"))
        assert zero is not None
        assert zero.error > 8.0 * white
        assert not removed(Recording.from_rate(y - y.mean(), rate=100.0, unit="rad/s"))


def test_one_axis_of_a_triad_at_right_angles_to_the_earth_is_no_bias_removed(
    rng: np.random.Generator,
) -> None:
    level = np.array([EARTH * math.cos(0.9), 0.0, EARTH * math.sin(0.9)])
    assert not removed(gyros(rng, 4096, 36_000.0, 0.002, level))
    alone = removed(gyros(rng, 4096, 36_000.0, 0.002, level[1:2]))
    assert len(alone) == 1 and "is gone" not in alone[0].message


# -- second witnesses ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("dof", [7, 10, 15])
def test_the_quantile_is_students(dof: int) -> None:
    assert meaning._student(dof) == pytest.approx(stats.t.ppf(0.995, dof), rel=0.012)


def test_the_chance_of_so_many_bounds_that_of_independent_events() -> None:
    chances = (0.02, 0.3, 0.1, 0.25)
    for count in range(1, 5):
        exact = sum(
            math.prod(p if hit else 1.0 - p for p, hit in zip(chances, hits, strict=True))
            for hits in itertools.product((False, True), repeat=4)
            if sum(hits) >= count
        )
        bound = meaning._chance_of_so_many(chances, count)
        every = sum(math.prod(some) for some in itertools.combinations(chances, count))
        assert bound == pytest.approx(every, rel=1e-12)
        assert bound >= exact


@pytest.mark.parametrize("n", [1, 15, 16, 100, 4099])
def test_means_of_parts_are_those_of_numpy_however_the_stream_is_cut(
    rng: np.random.Generator, n: int
) -> None:
    y = rng.standard_normal(n)
    y[n // 4 : n // 2] = np.nan
    sums, at = PartSums(n), 0
    while at < n:
        size = int(rng.integers(1, 700))
        block = y[at : at + size]
        sums.add(block, not np.isnan(block).any())
        at += size
    edges = [math.ceil(k * n / 16) for k in range(17)]
    for k, found in enumerate(sums.means()):
        part = y[edges[k] : edges[k + 1]]
        there = part[~np.isnan(part)]
        if len(there) and 2 * len(there) >= len(part):
            assert found == pytest.approx(there.mean(), rel=1e-12)
        else:
            assert np.isnan(found)
    assert int(sums.count.sum()) == int(np.count_nonzero(~np.isnan(y)))
