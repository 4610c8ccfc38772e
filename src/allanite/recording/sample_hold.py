# SPDX-License-Identifier: BSD-3-Clause
"""A sensor that is slower than its log, as a study describes it."""

from __future__ import annotations

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.result import Result

__all__ = ["HeldSamples"]


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldSamples(Result):
    """A sensor that renews its values less often than the log has rows; each value was taken once.

    Attributes
    ----------
    rate : float [Hz]
        Output rate of the sensor.
    rate_sd : float or None [Hz]
        Standard uncertainty of the rate; None if the rate of the log is a whole multiple.
    log_rate : float [Hz]
        Sample rate of the log.
    values : int
        Number of values on the sensor's grid.
    """

    rate: float
    rate_sd: float | None
    log_rate: float
    values: int
