# SPDX-License-Identifier: BSD-3-Clause
"""By how much a noise model is larger than that at rest because the sensor is in motion, and why."""

from __future__ import annotations

from collections.abc import Iterator

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.number_words import number
from allanite.quantities.result import Result

__all__ = ["MotionInflation"]


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionInflation(Result):
    """Factors of a model for a sensor in motion over the model at rest.

    Attributes
    ----------
    log : str
        Name of the log in motion.
    above, below : float [Hz]
        Frequencies that the white noise stands for.
    noise, noise_lower, noise_upper : float
        Factor of N with its interval, lines included.
    lines : float
        Share of the white noise's variance that spectral lines make.
    slow : float
        Factor of the slow terms (B, K).
    fixed : bool
        The body was held still in that log, so that slow changes are noise of the sensor.
    """

    log: str
    above: float
    below: float
    noise: float
    noise_lower: float
    noise_upper: float
    lines: float
    slow: float
    fixed: bool

    @property
    def reasons(self) -> Iterator[str]:
        """What was changed and why, sentence by sentence."""
        if self.noise == 1:
            yield f"N as at rest: {self.log} shows no more noise from {number(self.above)} to {number(self.below)} Hz"
        else:
            ends = f"[{number(self.noise_lower)}, {number(self.noise_upper)}]"
            yield f"N IN MOTION ({self.log}): {number(self.noise)} {ends} times that at rest"
            yield (
                f"N leaves the same error after integration as the signal from {number(self.above)} to "
                f"{number(self.below)} Hz (density weighted by 1/f^2); {number(100 * self.lines, 2)} % of N^2 is lines"
            )
            yield "a log cannot tell vibration of the body from noise: this N is an upper limit of the sensor's own"
        if self.slow != 1:
            yield f"B and K: {number(self.slow)} times those at rest, from a log with the body held still"
        elif self.fixed:
            yield "B and K as at rest: with the body held still, slow changes are no larger"
        else:
            yield f"B and K as at rest: slow changes in {self.log} may be movement of the body"
