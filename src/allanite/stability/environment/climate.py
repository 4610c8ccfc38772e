# SPDX-License-Identifier: BSD-3-Clause
"""A signal and the temperature beside it, as means over equal blocks: what the regression works on.

A thermometer is noisy, and noise in a column of a regression makes its coefficient too small. Its readings are
therefore smoothed as far as they allow: by local parabolas over the longest window after which what was smoothed away
is still no more than the thermometer's own noise [1]. What noise is left, and how much it takes off the coefficient,
is stated (`Climate.noise_left`).

References
----------
.. [1] V. A. Morozov, "On the solution of functional equations by the method of regularization", Soviet Math. Dokl. 7
   (1966) 414: the discrepancy principle.
.. [2] A. Savitzky, M. J. E. Golay, Analytical Chemistry 36 (1964) 1627: local parabolas.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError
from allanite.filtering.block_means import BlockMeans, block_means
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural
from allanite.quantities.result import Result
from allanite.recording.records import Kind, Recording, Sampling
from allanite.recording.thermometers import checked_thermometer

__all__ = ["Climate", "Thermometer", "smoothed"]

Array = NDArray[np.float64]

#: Blocks in a record: short against every temperature that a room or a chamber makes.
BLOCKS = 1500
#: Fewer blocks with samples than this tell no noise from an effect.
FEWEST = 60
#: A temperature that spans less than so many times its own noise is called constant.
CONSTANT = 3.0
#: What is smoothed away may be so many times the thermometer's noise.
DISCREPANCY = 1.03
#: SI unit of the columns that may be one; the others stay in their own unit.
_SI = {Kind.TEMPERATURE: "K", Kind.VOLTAGE: "V"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Thermometer(Result):
    """What a channel of temperature is like.

    Attributes
    ----------
    channel, unit : str
        Name of the temperature channel, and its unit.
    scale : float
        Kelvins in one unit; of a column that is no temperature the SI value of one unit (volts in a millivolt).
    si : str
        Unit of `noise` and of the coefficients: "K", "V", or the unit of the column; "" if it has none.
    mean, low, high : float [unit]
        Mean and extremes of the smoothed temperature.
    noise : float [si]
        Standard deviation of the mean of a block around the smoothed temperature.
    window : float [s]
        Length of the smoothing.
    missing : float
        Share of the blocks without a reading; they are interpolated.
    constant : bool
        The temperature spans no more than the noise of its readings.
    """

    channel: str
    unit: str
    scale: float
    si: str
    mean: float
    low: float
    high: float
    noise: float
    window: float
    missing: float
    constant: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Climate:
    """Block means of one channel, and the temperature in the same blocks.

    Attributes
    ----------
    blocks : BlockMeans
        Of the signal [SI].
    sampling : "mean" or "point"
        Of the blocks.
    middle : ndarray, shape (n,) [s]
        Middle of each block, since the first sample.
    thermometer : Thermometer or None
    warmth : ndarray, shape (n,) [K, or `Thermometer.si`]
        Smoothed temperature less its mean; empty without one.
    width : int
        Blocks of the smoothing.
    """

    blocks: BlockMeans
    sampling: Sampling
    middle: Array
    thermometer: Thermometer | None
    warmth: Array
    width: int

    @classmethod
    def of(cls, recording: Recording, channel: str, temperature: str | None) -> Climate:
        """Blocks of a recording.

        Raises
        ------
        InputError
            A channel of angles, or a temperature that is the channel itself or a channel of another kind.
        DataQualityError
            Too few samples, or no reading of the thermometer.
        """
        size = max(1, recording.n_samples // BLOCKS)
        whole = np.array([[0, recording.n_samples]])
        blocks = block_means(recording, channel, size, whole)
        present = int(np.count_nonzero(blocks.part))
        if present < FEWEST:
            raise DataQualityError(
                f"channel {channel!r} has samples in {plural(present, 'block')} of {blocks.dt:.3g} s; at least "
                f"{FEWEST} are needed to separate an effect of the environment from noise"
            )
        sampling = recording[channel].sampling if size == 1 else "mean"
        middle = np.asarray((np.arange(blocks.size) + 0.5) * blocks.dt, dtype=np.float64)
        thermometer, warmth, width = None, np.zeros(0), 1
        if temperature is not None:
            thermometer, warmth, width = _temperature(recording, temperature, channel, size, middle)
        return cls(
            blocks=blocks,
            sampling=sampling,
            middle=middle,
            thermometer=thermometer,
            warmth=warmth,
            width=width,
        )

    @property
    def dt(self) -> float:
        """Length of a block [s]."""
        return self.blocks.dt

    @property
    def size(self) -> int:
        """Number of blocks."""
        return self.blocks.size

    @property
    def noise_left(self) -> Array:
        """A draw of the noise that is left in the smoothed temperature [K], shape (n,); the same every time."""
        noise = 0.0 if self.thermometer is None else self.thermometer.noise
        drawn = np.random.default_rng(1).standard_normal(self.size)
        return noise * smoothed(drawn, self.width)


def _temperature(
    recording: Recording, name: str, channel: str, size: int, middle: Array
) -> tuple[Thermometer, Array, int]:
    facts = recording[name]
    checked_thermometer(recording, name, (channel,))
    # a column without an SI unit of its own stays in its unit, as everywhere
    scale, factor = (facts.scale, 1.0) if facts.kind in _SI else (1.0, facts.scale)
    means = block_means(recording, name, size, np.array([[0, recording.n_samples]])).mean / factor
    present = np.isfinite(means)
    if np.count_nonzero(present) < FEWEST:
        raise DataQualityError(
            f"the temperature {name!r} has readings in {plural(int(present.sum()), 'block')} only"
        )
    readings = np.interp(middle, middle[present], means[present])
    noise = _noise_of(readings)
    width = _widest(readings, noise)
    smooth = smoothed(readings, width)
    span = float(smooth.max() - smooth.min())
    left = noise * math.sqrt(_leverage(width))
    thermometer = Thermometer(
        channel=name,
        unit=facts.unit,
        scale=scale,
        si=_SI.get(facts.kind, facts.unit),
        mean=float(smooth.mean()) / scale,
        low=float(smooth.min()) / scale,
        high=float(smooth.max()) / scale,
        noise=noise,
        window=width * size / recording.rate,
        missing=1 - float(present.mean()),
        constant=span <= max(CONSTANT * 2 * left, 1e-12 * abs(float(smooth.mean()))),
    )
    return thermometer, smooth - smooth.mean(), width


def _noise_of(readings: Array) -> float:
    """Standard deviation of one reading, from third differences: blind to what is a parabola over four of them."""
    third = np.abs(np.diff(readings, 3))
    middle = float(np.quantile(third, 0.6827))  # one standard deviation of a normal law
    return (middle or float(np.sqrt((third**2).mean()))) / math.sqrt(20)


def _widest(readings: Array, noise: float) -> int:
    """The longest window that smooths nothing but noise away [1]."""
    best, width = 1, 5
    while width <= len(readings) // 8:
        away = float(np.sqrt(np.mean((readings - smoothed(readings, width)) ** 2)))
        if away > DISCREPANCY * noise * math.sqrt(1 - _leverage(width)):
            break
        best, width = width, 2 * width - 1
    return best


def _leverage(width: int) -> float:
    """Share of the variance of white noise that local parabolas leave (leading order in 1/width)."""
    return 1.0 if width < 5 else min(9 / (4 * width), 1.0)


def smoothed(values: Array, width: int) -> Array:
    """Local parabolas over an odd number of values [2]; fewer than five stay as they are."""
    if width < 5:
        return values
    half = width // 2
    i = np.arange(-half, half + 1)
    weights = (3 * (3 * half**2 + 3 * half - 1) - 15 * i**2) / (
        (2 * half - 1) * (2 * half + 1) * (2 * half + 3)
    )
    out = np.empty_like(values)
    out[half : len(values) - half] = np.convolve(values, weights, mode="valid")
    for ends, part in ((slice(0, half), values[:width]), (slice(len(values) - half, None), values[-width:])):
        x = np.linspace(-1.0, 1.0, width)
        curve = np.polynomial.polynomial.polyval(x, np.polynomial.polynomial.polyfit(x, part, 2))
        out[ends] = curve[:half] if ends.start == 0 else curve[-half:]
    return out
