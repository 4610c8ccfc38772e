# SPDX-License-Identifier: BSD-3-Clause
"""The unit of time stamps that name none, told from their values; where several units fit, the caller is asked.

Values tell a unit in two ways: counts since a known epoch are large and narrow in range, and the interval must be that
of a log. Inertial sensors are logged at 1 Hz to 20 kHz; of other channels (a bench meter) slower logs are as likely.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass

__all__ = ["EPOCH", "FACTORS", "StampSteps", "StampUnit", "candidates", "tell"]

#: Seconds since 1970 between 2001 and 2052; later ones are those of another epoch (1904, 1900).
EPOCH: Final = (1e9, 2.6e9)
#: Units that stamps may be in [s].
FACTORS: Final = {
    "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "100 ns": 1e-7, "0.1 ms": 1e-4, "d": 86400.0, "h": 3600.0, "min": 60.0
}  # fmt: skip
#: Seconds since 1900 or 1904, today; which of both is not told.
_OLDER_EPOCH = (2.6e9, 5e9)
#: Counts since another epoch: unit, and seconds from that epoch to 1970 (FILETIME, .NET, spreadsheets, MATLAB).
_OTHER_EPOCHS = (
    ("100 ns", 11_644_473_600), ("100 ns", 62_135_596_800), ("d", 25_569 * 86_400), ("d", 719_529 * 86_400)
)  # fmt: skip
_WHOLE, _FRACTIONS = ("s", "ms", "us", "ns"), ("s", "ms", "min", "h", "d")
_SENSOR = (0.9, 2e4)  # rates of inertial sensors [Hz]
_FASTEST = 1e7  # of a converter whose stamps are in s [Hz]
_SLOWEST = 1.0 / 3600.0  # of a meter that is read by a script [Hz]
_LONGEST_UPTIME = 1e6  # stamps in s that begin later, and at no epoch, are in a smaller unit
_RECENT = 1e5  # stamps of a clock that was begun with the log are smaller [s]
_PLAIN = 0.5  # rate above which stamps with decimals are in s [Hz]
_PAUSE = 20.0  # typical steps; what is longer tells nothing of the rate
_CLOSE = 0.05  # relative distance from the rate that the file states elsewhere


@dataclass(frozen=True, slots=True)
class StampSteps:
    """What lies between stamps that follow each other, in their unit.

    Attributes
    ----------
    mean : float
        Pauses and falls left out.
    whole : bool
        All are whole numbers.
    """

    mean: float
    whole: bool

    @classmethod
    def of(cls, differences: NDArray[np.float64]) -> StampSteps | None:
        """None where no stamp is later than the one before."""
        differences = differences[np.isfinite(differences) & (differences >= 0)]
        if not differences.any():
            return None
        typical = float(np.median(differences[differences > 0]))
        ordinary = differences[differences <= _PAUSE * typical]
        return cls(float(ordinary.mean()), bool(np.all(ordinary == np.round(ordinary))))

    def rate_text(self, unit: str) -> str:
        """The rate that stamps of a unit mean, in words."""
        return f"{1.0 / (self.mean * FACTORS[unit]):.4g} Hz"


@dataclass(frozen=True, slots=True)
class StampUnit:
    """A unit that the values tell.

    Attributes
    ----------
    unit : str
    factor : float [s]
    epoch : int or None [s]
        What to take off the stamps for seconds since 1970; None where the stamps are not absolute.
    """

    unit: str
    factor: float
    epoch: int | None = None


def tell(steps: StampSteps, first: float, nominal: float | None, inertial: bool) -> StampUnit | None:
    """The unit of stamps, or None where several fit.

    Parameters
    ----------
    steps : StampSteps
    first : float
        The first stamp.
    nominal : float or None [Hz]
        Rate that the file states elsewhere.
    inertial : bool
        The log is one of gyros or accelerometers.
    """
    absolute = _absolute(first, steps.mean)
    if absolute is not None and _sure(absolute, steps, first):
        return absolute
    if nominal is not None:
        for unit, factor in FACTORS.items():
            if abs(steps.mean * factor * nominal - 1.0) < _CLOSE:
                return StampUnit(unit, factor)
    fitting = candidates(steps, first, inertial)
    return StampUnit(fitting[0], FACTORS[fitting[0]]) if len(fitting) == 1 else None


def candidates(steps: StampSteps, first: float, inertial: bool) -> list[str]:
    """Units that give the interval of a log."""
    step = steps.mean
    if not steps.whole and _PLAIN <= 1.0 / step <= _SENSOR[1]:
        return ["s"]
    fitting = [
        unit
        for unit in (_WHOLE if steps.whole else _FRACTIONS)
        if _SENSOR[0] <= 1.0 / (step * FACTORS[unit]) <= _SENSOR[1]
    ]
    if not steps.whole and _SENSOR[1] < 1.0 / step <= _FASTEST:
        fitting.insert(0, "s")
    slow = not inertial and _SLOWEST <= 1.0 / step < _SENSOR[0] and abs(first) < _LONGEST_UPTIME
    absolute = _absolute(first, step)
    return list(dict.fromkeys([*(["s"] if slow else []), *([absolute.unit] if absolute else []), *fitting]))


def _sure(absolute: StampUnit, steps: StampSteps, first: float) -> bool:
    """False for a slow log whose stamps may as well be those of a fast one, a short while after a start."""
    return 1.0 / (steps.mean * absolute.factor) >= _SENSOR[0] or not any(
        _SENSOR[0] <= 1.0 / (steps.mean * factor) <= _SENSOR[1] and first * factor < _RECENT
        for factor in (FACTORS[unit] for unit in _WHOLE)
    )


def _absolute(first: float, step: float) -> StampUnit | None:
    """The unit of stamps that count from a known epoch."""
    for unit in ("s", "ms", "us", "ns", "100 ns"):
        if EPOCH[0] <= first * FACTORS[unit] <= EPOCH[1]:
            return StampUnit(unit, FACTORS[unit], 0)
    if _OLDER_EPOCH[0] <= first <= _OLDER_EPOCH[1]:
        return StampUnit("s", 1.0)
    for unit, epoch in _OTHER_EPOCHS:
        factor = FACTORS[unit]
        fast = 1.0 / step > _SENSOR[1]  # for seconds: days since 1900 are no larger than an uptime
        if EPOCH[0] <= first * factor - epoch <= EPOCH[1] and (fast or unit != "d"):
            return StampUnit(unit, factor, epoch)
    return None
