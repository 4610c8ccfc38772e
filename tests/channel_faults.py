# SPDX-License-Identifier: BSD-3-Clause
"""Every fault of a channel over random parameters, and what may be said of it: the right cause, and nothing else.

A fault is a function (rng, n) -> samples. `FAULTS` holds with each the code that names it, and the codes that are true
of it as well. `verification.findings` counts over many draws which codes are said.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from noise_records import walk, white

Rng = np.random.Generator
Samples = NDArray[np.float64]

NOTHING = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """A fault, the code that names it (NOTHING: none does), and other codes that are true of it.

    `always` is False where the fault may be too small to be found.
    """

    make: Callable[[Rng, int], Samples]
    code: str
    besides: frozenset[str]
    always: bool


FAULTS: dict[str, Fault] = {}


def fault(code: str, *besides: str, always: bool = True) -> Callable[[Callable[[Rng, int], Samples]], None]:
    def keep(make: Callable[[Rng, int], Samples]) -> None:
        name = make.__name__.replace("_", " ")
        FAULTS[name] = Fault(make=make, code=code, besides=frozenset(besides), always=always)

    return keep


def log_uniform(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def noise(rng: Rng, n: int, level: float | None = None) -> Samples:
    """White noise of sd 1, in two of five cases with a walk, at a level of 12 to 300 on either side, or at this one."""
    y = white(rng, n)
    if rng.random() < 0.4:
        y = y + walk(rng, n, log_uniform(rng, 1e-3, 2e-2))
    return y + (sign(rng) * log_uniform(rng, 12.0, 300.0) if level is None else level)


def somewhere(rng: Rng, n: int) -> Samples:
    return noise(rng, n, None if rng.random() < 0.5 else 0.0)


# -- nothing wrong ----------------------------------------------------------------------------------------


@fault(NOTHING)
def noise_alone(rng: Rng, n: int) -> Samples:
    return somewhere(rng, n)


@fault(NOTHING)
def uniform_noise(rng: Rng, n: int) -> Samples:
    return rng.uniform(-1.0, 1.0, n) + 20.0


@fault(NOTHING)
def a_ramp(rng: Rng, n: int) -> Samples:
    return noise(rng, n) + np.arange(n) * sign(rng) * log_uniform(rng, 1e-3, 1.0)


@fault(NOTHING, "disturbance", "noise_changes")
def a_line(rng: Rng, n: int) -> Samples:
    f = rng.uniform(0.02, 0.48)
    return (
        white(rng, n)
        + 20.0
        + log_uniform(rng, 3.0, 100.0) * np.sin(2 * np.pi * f * np.arange(n) + rng.uniform(0, 6))
    )


@fault(NOTHING, "disturbance", "noise_changes", "amplitude_drop", "heavy_tails", "spikes")
def a_line_near_half_the_rate(rng: Rng, n: int) -> Samples:
    f = 0.5 - rng.uniform(1.5, 40.0) / n  # turns over at least three times in the record
    return (
        white(rng, n)
        + 20.0
        + log_uniform(rng, 3.0, 20.0) * np.sin(2 * np.pi * f * np.arange(n) + rng.uniform(0, 6))
    )


# -- samples ----------------------------------------------------------------------------------------------


@fault("spikes")
def one_spike(rng: Rng, n: int) -> Samples:
    y = somewhere(rng, n)
    y[rng.integers(1, n - 1)] += sign(rng) * log_uniform(rng, 20.0, 1e30)
    return y


@fault("spikes")
def a_few_spikes(rng: Rng, n: int) -> Samples:
    y = somewhere(rng, n)
    k = rng.integers(2, 1 + max(2, min(7, n // 1000)))
    y[rng.choice(np.arange(1, n - 1), k, replace=False)] += log_uniform(rng, 20.0, 1e5) * rng.choice(
        [-1, 1], k
    )
    return y


@fault("spikes")
def one_wild_first_sample(rng: Rng, n: int) -> Samples:
    y = somewhere(rng, n)
    y[0] += sign(rng) * log_uniform(rng, 20.0, 1e12)
    return y


@fault("zero_filled")
def a_first_sample_of_0(rng: Rng, n: int) -> Samples:
    y = noise(rng, n, sign(rng) * log_uniform(rng, 16.0, 300.0))
    y[0] = 0.0
    return y


@fault("zero_filled")
def zeros_here_and_there(rng: Rng, n: int) -> Samples:
    y = noise(rng, n, sign(rng) * log_uniform(rng, 16.0, 300.0))
    y[rng.choice(n, rng.integers(2, n // 10), replace=False)] = 0.0
    return y


@fault("zero_filled")
def a_block_of_zeros(rng: Rng, n: int) -> Samples:
    y = noise(rng, n, sign(rng) * log_uniform(rng, 16.0, 300.0))
    k = rng.integers(5, n // 4)
    start = rng.integers(0, n - k + 1)
    y[start : start + k] = 0.0
    return y


@fault("fill_value")
def a_word_here_and_there(rng: Rng, n: int) -> Samples:
    y = noise(rng, n, 0.0)
    y[rng.choice(n, rng.integers(3, n // 10), replace=False)] = sign(rng) * float(
        rng.choice([99, 999, 9999, 65534])
    )
    return y


@fault("stuck")
def a_frozen_stretch(rng: Rng, n: int) -> Samples:
    y = somewhere(rng, n)
    k = rng.integers(20, n // 3)
    start = rng.integers(0, n - k + 1)
    y[start : start + k] = y[start]
    return y


@fault("stuck")
def a_frozen_tail(rng: Rng, n: int) -> Samples:
    y = somewhere(rng, n)
    k = rng.integers(20, n // 3)
    y[-k:] = y[-k]
    return y


@fault("missing")
def missing_here_and_there(rng: Rng, n: int) -> Samples:
    y = somewhere(rng, n)
    y[rng.choice(n, rng.integers(1, n // 50), replace=False)] = np.nan
    return y


@fault("broken_up")
def a_value_in_every_kth_row(rng: Rng, n: int) -> Samples:
    y = np.full(n, np.nan)
    k = int(rng.integers(2, 6))
    y[::k] = somewhere(rng, n)[::k]
    return y


# -- steps and ranges -------------------------------------------------------------------------------------


@fault("resolution_step", "quantisation")
def fine_steps(rng: Rng, n: int) -> Samples:
    step = log_uniform(rng, 0.05, 0.5)
    return np.round(somewhere(rng, n) / step) * step


@fault("quantisation", "resolution_step")
def coarse_steps_about_zero(rng: Rng, n: int) -> Samples:
    step = log_uniform(rng, 0.6, 1.9)
    return np.round((white(rng, n) + step * rng.integers(-6, 6)) / step) * step


@fault("quantisation", "quantisation_limited")
def a_log_of_five_levels(rng: Rng, n: int) -> Samples:
    step = rng.uniform(0.9, 1.9)
    y = white(rng, n) if rng.random() < 0.5 else rng.uniform(-2.4, 2.4, n) * step
    return np.clip(np.round(y / step), -2, 2) * step + step * rng.integers(-3, 4)


@fault("quantisation_limited", "no_noise_resolved")
def steps_beyond_the_noise(rng: Rng, n: int) -> Samples:
    step = log_uniform(rng, 3.0, 30.0)
    return np.round((white(rng, n) + rng.uniform(-10, 10) * step) / step) * step


@fault("clipping")
def a_clipped_range(rng: Rng, n: int) -> Samples:
    limit = rng.uniform(0.5, 2.0)
    low = -limit if rng.random() < 0.5 else -np.inf
    return np.clip(white(rng, n), low, limit) + sign(rng) * log_uniform(rng, 12.0, 300.0)


@fault("clipping", "resolution_step", "quantisation", always=False)
def a_clipped_range_in_steps(rng: Rng, n: int) -> Samples:
    step, limit = log_uniform(rng, 0.05, 0.3), rng.uniform(1.0, 2.0)
    return np.round(np.clip(white(rng, n), -limit, limit) / step) * step


@fault("saturated", "resolution_step")
def words_at_the_end_of_the_range(rng: Rng, n: int) -> Samples:
    y = np.round(rng.uniform(5.0, 60.0) * white(rng, n) + 900.0)
    y[rng.choice(n, 5, replace=False)] = float(rng.choice([32767, -32768]))
    return y


@fault("float_step", "quantisation_limited", "no_noise_resolved")
def float32_at_a_high_level(rng: Rng, n: int) -> Samples:
    level = log_uniform(rng, 5.0, 500.0)
    spacing = float(np.spacing(np.float32(level)))
    return (
        (level + log_uniform(rng, 0.5, 5.0) * spacing * white(rng, n)).astype(np.float32).astype(np.float64)
    )


@fault("implausible_exponents")
def the_wrong_byte_order(rng: Rng, n: int) -> Samples:
    return noise(rng, n).astype(">f8").view("<f8")


# -- repeats ----------------------------------------------------------------------------------------------


@fault("held_samples", "heavy_tails")
def values_held_k_times(rng: Rng, n: int) -> Samples:
    return np.repeat(somewhere(rng, n), rng.integers(2, 9))[:n]


@fault("held_samples", "heavy_tails", "noise_changes", "disturbance")
def values_held_now_and_then(rng: Rng, n: int) -> Samples:
    return somewhere(rng, n)[np.floor(np.arange(n) * rng.uniform(0.3, 0.9)).astype(int)]


@fault("interleaved")
def two_levels_in_turn(rng: Rng, n: int) -> Samples:
    y = noise(rng, n)
    y[:: rng.integers(2, 5)] += sign(rng) * log_uniform(rng, 5.0, 100.0)
    return y


@fault("interleaved", "spikes", "heavy_tails")
def two_noises_in_turn(rng: Rng, n: int) -> Samples:
    y = white(rng, n)
    y[::2] *= log_uniform(rng, 2.5, 10.0)
    return y + 20.0


# -- clocks -----------------------------------------------------------------------------------------------


@fault("only_grows")
def a_time_column(rng: Rng, n: int) -> Samples:
    interval = log_uniform(rng, 1e-4, 10.0)
    return rng.uniform(0, 1e4) + interval * (np.arange(n) + rng.uniform(0.0, 0.3) * rng.uniform(-1, 1, n))


@fault("only_grows")
def a_rounded_time_column(rng: Rng, n: int) -> Samples:
    return np.round(rng.uniform(0, 1e4) + 0.01 * log_uniform(rng, 1.0, 300.0) * np.arange(n), 2)


@fault("only_grows")
def a_counter_that_wraps(rng: Rng, n: int) -> Samples:
    return np.asarray(
        (np.arange(n) + rng.integers(0, 99)) % rng.choice([16, 100, 256, 65536]), dtype=np.float64
    )


# -- rest -------------------------------------------------------------------------------------------------


@fault("disturbance", "noise_changes", "heavy_tails", "spikes", always=False)
def a_shift_of_the_level(rng: Rng, n: int) -> Samples:
    y = noise(rng, n)
    y[rng.integers(n // 10, n - n // 10) :] += sign(rng) * log_uniform(rng, 8.0, 100.0)
    return y


@fault("not_at_rest")
def a_unit_that_was_moved(rng: Rng, n: int) -> Samples:
    y = white(rng, n) + 20.0
    width = n // 40
    for start in range(n // 10, n - 2 * width, n // 5):
        y[start : start + width] += log_uniform(rng, 3000.0, 30_000.0) * np.hanning(width)
    return y


@fault("noise_changes", "spikes")
def a_noisier_stretch(rng: Rng, n: int) -> Samples:
    """Of a tenth to half of the record: the sensor rests, and its noise is another."""
    y = noise(rng, n, 20.0)
    length = int(rng.uniform(0.1, 0.5) * n)
    start = rng.integers(0, n - length)
    y[start : start + length] += (log_uniform(rng, 2.0, 3.5) - 1.0) * (y[start : start + length] - 20.0)
    return y


@fault("disturbance", "spikes")
def a_stretch_far_noisier(rng: Rng, n: int) -> Samples:
    y = white(rng, n) + 20.0
    start = rng.integers(0, n // 2)
    y[start : start + n // 4] += log_uniform(rng, 8.0, 15.0) * white(rng, n // 4)
    return y
