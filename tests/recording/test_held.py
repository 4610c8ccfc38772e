# SPDX-License-Identifier: BSD-3-Clause
"""A sensor slower than its log: its rate from the repeats, each value once, N right; and repairs of linear work."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.commands.study import curve_of, write_results
from allanite.errors import AllaniteError, InputError
from allanite.noise.allan import AllanCurve
from allanite.recording.cleaning import REPAIRS, clean
from allanite.recording.health.examination import check
from allanite.recording.health.renewal import renewal_of
from allanite.recording.sample_columns import ArrayColumn, Samples, Spliced
from noise_records import record

LOG = 95.0
SD = 0.02


def renewed_at(t: np.ndarray, rate: float, phase: float) -> np.ndarray:
    """Which value of the sensor a log holds at these times."""
    return np.floor(t * rate + phase + 2.0).astype(np.int64)


def held(
    rng: np.random.Generator, n: int, rate: float, jitter: float, axes: int = 1, step: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """A log of `n` rows with jittering stamps, shape (n, axes), and which value of the sensor each row holds."""
    value = renewed_at((np.arange(n) + rng.uniform(-jitter, jitter, n)) / LOG, rate, rng.random())
    samples = SD * rng.standard_normal((value[-1] + 2, axes))
    samples = np.round(samples / step) * step if step else samples
    return 0.3 + samples[value], value


def messages(recording: al.Recording, code: str = "held_samples") -> list[str]:
    return [f.message for f in check(recording) if f.code == code]


@pytest.mark.long
@pytest.mark.parametrize("seed", range(4))
def test_any_ratio_jitter_step_and_gap(seed: int) -> None:
    """Twenty-five logs each: the rate within its uncertainty, the span within two values, N within chance."""
    rng = np.random.default_rng([7, seed])
    off = []
    for _ in range(25):
        rate, jitter, axes = rng.uniform(3.0, 90.0), rng.choice([0.0, 0.1, 0.2, 0.4]), int(rng.choice([1, 3]))
        n, step = int(rng.integers(2000, 5000)), SD if axes == 3 and rng.random() < 0.5 else 0.0
        samples, value = held(rng, n, rate, jitter, axes, step)
        if rng.random() < 0.5:
            gap = slice(n // 3, n // 3 + int(rng.integers(1, n // 5)))
            samples[gap] = np.nan
        log = al.Recording.from_rate(samples, rate=LOG, unit="deg/s")
        found = renewal_of(log, log.names, (step / SD / math.sqrt(4 * math.pi)) ** axes)
        assert found is not None, (rate, jitter, n, step)
        case = (rate, found.ratio * LOG, jitter, n, step)
        assert abs(found.ratio * LOG - rate) < 5.0 * found.sd * LOG, case
        once = clean(log, "drop_repeats")
        assert abs(once.n_samples - (value[-1] - value[0] + 1)) <= 2 + 2.0 * found.sd * n, case
        x = once.values(log.names[0])
        difference = np.diff(x[np.isfinite(x)])
        square = np.mean(difference**2) / 2 / (SD**2 + step**2 / 12)
        off.append((square - 1.0) / math.sqrt(3.0 / len(difference)))
    assert abs(np.mean(off)) < 3.3 / math.sqrt(len(off))  # chance exceeds it once in 1000 times
    assert np.max(np.abs(off)) < 4.5


def test_repeats_at_random_have_no_rate() -> None:
    rng = np.random.default_rng(3)
    for _ in range(60):
        fresh = rng.random(3000) < rng.uniform(0.1, 0.95)
        samples = rng.standard_normal(3000)[np.cumsum(fresh)]
        assert renewal_of(record(samples), ["signal"]) is None


def test_axes_together_and_each_at_its_own_rate(rng: np.random.Generator) -> None:
    gyro, _ = held(rng, 8000, 47.13, 0.3, axes=3)
    acc, _ = held(rng, 8000, 63.4, 0.3, axes=3, step=0.02)
    names = ["gx", "gy", "gz", "ax", "ay", "az"]
    log = al.Recording.from_rate(np.hstack([gyro, acc]), rate=LOG, unit="deg/s", names=names)
    kinds = [
        *log.channels[:3],
        *(al.Recording.from_rate(acc, rate=LOG, unit="m/s^2", names=names[3:]).channels),
    ]
    log = replace(log, channels=tuple(kinds))
    found = {f.channel: f for f in check(log) if f.code == "held_samples"}
    assert set(found) == set(names)
    assert all("updates at 47.13" in found[n].message for n in names[:3])
    assert all("updates at 63.40" in found[n].message for n in names[3:])
    assert "--channels gx,gy,gz" in found["gx"].advice
    with pytest.raises(InputError, match=r"repeat differently \(gx 2.016 times on average"):
        clean(log, "drop_repeats")
    assert clean(log.select("ax", "ay", "az"), "drop_repeats").rate == pytest.approx(63.4, abs=0.02)


def test_characterize_takes_each_value_once(rng: np.random.Generator) -> None:
    samples, _ = held(rng, 16_000, 63.0, 0.3)  # the weights of the values alone raise N by 5 %
    study = al.characterize(al.Recording.from_rate(samples, rate=LOG, unit="deg/s", names="gyro"))
    (n,) = [e for e in study.models["gyro"].estimates if e.symbol == "N"]
    truth = math.radians(SD) / math.sqrt(63.0)
    assert n.lower < truth < n.upper
    assert n.upper / n.lower < 1.06
    channel = study["gyro"]
    assert channel.held is not None and channel.held.rate == pytest.approx(63.0, abs=0.02)
    assert channel.curve.dt == pytest.approx(1 / 63.0, rel=1e-3)
    assert al.Study.from_json(study.to_json()).findings


def test_a_sensor_whose_clock_drifts_is_followed(rng: np.random.Generator) -> None:
    t = np.arange(200_000) / LOG
    value = renewed_at(t * (1.0 + 2e-4 * t / t[-1]), 47.0, 0.0)
    once = clean(record(rng.standard_normal(value[-1] + 1)[value], rate=LOG), "drop_repeats")
    assert once.n_samples == value[-1] - value[0] + 1
    assert np.isfinite(once.values("signal")).all()


@pytest.mark.long
def test_curves_of_two_rates_are_two_files(rng: np.random.Generator, tmp_path: Path) -> None:
    parts = [held(rng, 4000, rate, 0.2)[0] for rate in (31.0, 63.0)]
    study = al.characterize(
        al.Recording.from_rate(np.hstack(parts), rate=LOG, unit="deg/s", names=["a", "b"])
    )
    write_results(study, tmp_path)
    for name, rate, channel in (("allan.csv", 31.0, "a"), ("allan-2.csv", 63.0, "b")):
        curve = AllanCurve.from_csv(tmp_path / name)
        assert curve.names == (channel,)
        assert curve.tau[0] == pytest.approx(1 / rate, rel=1e-3)
    with pytest.raises(InputError, match="different rates"):
        curve_of(study)


# -- work -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Counted:
    """A column that counts the samples read of it."""

    of: ArrayColumn
    reads: list[int] = field(default_factory=list)
    origin = 0.0

    @property
    def dtype(self) -> np.dtype[Any]:
        return self.of.dtype

    def __len__(self) -> int:
        return len(self.of)

    def read(self, start: int, stop: int) -> Samples:
        block = self.of.read(start, stop)
        self.reads.append(16 + len(block))
        return block


def work(repair: str, n: int) -> int:
    """Samples and reads that a repair, and reading what it left, take of a log of `n` rows with a gap every ten."""
    rng = np.random.default_rng(1)
    samples, _ = held(rng, n, 47.0, 0.2)
    begins = np.arange(0, n, 10)
    column = Counted(ArrayColumn(samples[:, 0]))
    grid = begins + 2 * np.arange(len(begins))
    spliced = Spliced(column, np.append(begins, n), grid, int(grid[-1]) + 10)
    log = replace(record(np.zeros(len(spliced)), rate=LOG), columns=(spliced,))
    value = {"swap": "=a,b", "drop_spikes": "=5"}.get(repair, "")
    with suppress(AllaniteError):  # another fault than its own: what it read to find that counts
        clean(log, repair + value).values("signal")
    return sum(column.reads)


@pytest.mark.parametrize("repair", [r for r in REPAIRS if r != "swap"])
def test_the_work_of_every_repair_is_linear(repair: str) -> None:
    assert work(repair, 8000) < 2.6 * work(repair, 4000)


def test_runs_on_a_longer_grid_read_alike_in_any_blocks() -> None:
    rng = np.random.default_rng(0)
    for _ in range(200):
        lengths, gaps = rng.integers(1, 6, 6), rng.integers(0, 4, 6)
        source = np.append(0, np.cumsum(lengths))
        grid = np.cumsum(gaps) + source[:-1]
        x, whole = rng.standard_normal(source[-1]), np.full(int(grid[-1] + lengths[-1]) + 2, np.nan)
        for r in range(6):
            whole[grid[r] : grid[r] + lengths[r]] = x[source[r] : source[r + 1]]
        column = Spliced(ArrayColumn(x), source, grid, len(whole))
        start = int(rng.integers(0, len(whole)))
        stop = int(rng.integers(start, len(whole) + 3))
        np.testing.assert_array_equal(column.read(start, stop), whole[start:stop])
