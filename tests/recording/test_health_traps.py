# SPDX-License-Identifier: BSD-3-Clause
"""Units mixed up, a clock that drifts, gravity that is gone: each is found, and honest records raise no alarm."""

from __future__ import annotations

import math
from contextlib import suppress

import numpy as np
import pytest

from allanite.errors import AllaniteError
from allanite.files.readers.timebase import ArrayStamps, fit_grid
from allanite.recording.health.examination import check
from allanite.recording.health.finding import Finding
from allanite.recording.health.log import drift
from allanite.recording.health.meaning import GYRO_STEPS, STEP_AGREES
from allanite.recording.records import Recording
from noise_records import binomial_bound, white

N = 6000


def found(recording: Recording) -> dict[str, Finding]:
    return {f.code: f for f in check(recording)}


# -- 57.3 -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("step", [250.0 / 32768.0, 1.0 / 131.0, 1.0 / 16.4, 8.75e-3])
@pytest.mark.parametrize(
    ("numbers", "label", "meant"), [("deg", "rad/s", "deg/s"), ("rad", "deg/s", "rad/s")]
)
def test_b18_a_step_of_a_known_range_in_the_other_unit(
    rng: np.random.Generator, step: float, numbers: str, label: str, meant: str
) -> None:
    counts = np.round(3.0 * white(rng, N) + 40.0)
    y = counts * (step if numbers == "deg" else math.radians(step))
    trap = found(Recording.from_rate(y, rate=100.0, unit=label, names="gx"))["unit_trap"]
    assert f"are these {meant} labeled '{label}'?" in trap.message or "divided by 57.3" in trap.message
    right = "deg/s" if numbers == "deg" else "rad/s"
    assert "unit_trap" not in found(Recording.from_rate(y, rate=100.0, unit=right, names="gx"))


@pytest.mark.parametrize(
    ("label", "size", "question"),
    [
        ("deg/s", 160.0, "counts, volts or millidegrees labeled 'deg/s'?"),
        ("rad/s", 160.0, "counts, volts or millidegrees labeled 'rad/s'?"),
    ],
)
def test_too_much_noise_is_asked_about_in_words_that_fit_the_unit(
    rng: np.random.Generator, label: str, size: float, question: str
) -> None:
    """16 deg/s per root Hz are no degrees called degrees; nor would radians that are degrees explain so much."""
    y = size * white(rng, N) + 3.0 * size
    trap = found(Recording.from_rate(y, rate=100.0, unit=label, names="gx"))["unit_trap"]
    assert question in trap.message
    assert "57.3" not in trap.message
    assert f"--unit gx={label}" not in trap.advice and "--unit gx=LSB" in trap.advice


@pytest.mark.long
def test_steps_of_no_known_range_raise_no_alarm() -> None:
    """Any step of eight decades agrees by chance in 17 x 2e-4/ln(10)/8 = 2e-4 of records."""
    rng = np.random.default_rng(20261121)
    trials = 150
    alarms = 0
    for step in 10.0 ** rng.uniform(-8.0, -3.0, trials):
        y = np.round(5.0 * white(rng, 800) + 200.0) * step
        alarms += "unit_trap" in found(Recording.from_rate(y, rate=100.0, unit="rad/s"))
    chance = len(GYRO_STEPS) * 2 * STEP_AGREES / math.log(10.0) / 5.0
    assert alarms <= binomial_bound(trials, chance)


def test_gravity_that_was_subtracted_is_named(rng: np.random.Generator) -> None:
    y = 0.003 * rng.standard_normal((N, 3)) + [1e-4, -2e-4, 3e-4]
    gone = found(Recording.from_rate(y, rate=100.0, unit="g"))["gravity"]
    assert "gravity was subtracted before logging" in gone.message
    milli = found(Recording.from_rate(1e-3 * (y + [0.0, 0.0, 1.0]), rate=100.0, unit="g"))["gravity"]
    assert "g labeled as mg" in milli.message


# -- a clock that drifts ----------------------------------------------------------------------------------


def stamped(seconds: np.ndarray, y: np.ndarray) -> Recording:
    """A recording with the notes that a reader leaves."""
    base = fit_grid(ArrayStamps(seconds), source="t", unit="s")
    recording = Recording.from_rate(y, rate=base.rate, unit="m/s^2")
    object.__setattr__(recording, "notes", {"timebase": base.facts})
    return recording


@pytest.mark.parametrize("ppm", [-2000.0, 300.0, 5000.0])
def test_b14_a_clock_that_drifts_is_named_with_its_size(rng: np.random.Generator, ppm: float) -> None:
    n = 20_000
    t = np.arange(n) / 100.0
    faster = t - 0.5e-6 * ppm * t**2 / t[-1]  # the rate grows by so much from end to end
    late = faster + 1e-4 * rng.exponential(1.0, n)
    clock = found(stamped(late, white(rng, n)))["clock_drift"]
    said = float(clock.message.split("changes by ")[1].split()[0])
    assert said == pytest.approx(ppm, rel=0.03)


def test_a_clock_that_wanders_says_how_far_samples_lie_from_their_stamps(rng: np.random.Generator) -> None:
    """No drift from end to end, and no even grid."""
    n = 20_000
    wave = 0.03 * np.sin(4 * np.pi * np.arange(n) / n)  # s; three intervals of 10 ms
    clock = found(stamped(np.arange(n) / 100.0 + wave, white(rng, n)))["clock_drift"]
    intervals = float(clock.message.rpartition(" intervals")[0].split()[-1])
    assert intervals == pytest.approx(3.0, rel=0.2)
    assert "wanders" in clock.message


@pytest.mark.long
def test_honest_stamps_raise_no_alarm() -> None:
    """Jitter, bursts of a host and coarse stamps of an even clock: never more than chance, 1e-6 a record."""
    rng = np.random.default_rng(20261121)
    alarms = []
    for seed in range(8):
        n = int(rng.integers(1000, 4000))
        t = np.arange(n) / 100.0
        for name, stamps in (
            ("late", t + rng.exponential(2e-3, n)),
            ("bursts", np.floor(np.arange(n) / 7) * 0.07 + np.arange(n) % 7 * 1e-4),
            ("coarse", np.round(t, 1)),
            ("steady offset", t * (1.0 + 4e-4) + 1e-4 * rng.standard_normal(n)),
        ):
            alarms += [(seed, name) for _ in drift(stamped(stamps, np.zeros(n)))]
    assert not alarms


@pytest.mark.long
def test_records_of_few_values_are_looked_through_whatever_their_size() -> None:
    """Mostly one value, or values at the ends of the range of float64: no scale that is divided by may be 0."""
    rng = np.random.default_rng(1)
    ends = [0.0, -1.0, 32767.0, 1e300, 1e-300, 5e-324, -999.0, np.nan, 1 / 3]
    looked_through = 0
    for _ in range(400):
        n = int(rng.integers(1, 120))
        few = rng.choice(rng.choice(ends, int(rng.integers(1, 4))), n)
        walk = np.cumsum(rng.standard_normal(n))
        noise = [walk, np.round(1000 * walk), 1e-9 * walk][int(rng.integers(3))]
        values = np.where(rng.random(n) < rng.choice([0.0, 0.05, 0.3, 0.6]), noise, few)
        with suppress(AllaniteError):
            check(Recording.from_rate(values, rate=100.0, unit="LSB"))
            looked_through += 1
    assert looked_through > 300
