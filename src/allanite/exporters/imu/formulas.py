# SPDX-License-Identifier: BSD-3-Clause
"""What a file makes of a number: its formula, by which the number is written and which the documents show."""

from __future__ import annotations

from dataclasses import replace
from typing import Final, Literal

from allanite.lazy_dataclasses import dataclass

__all__ = ["DRIVE", "SIGMA", "TIME", "WALK", "B", "Formula", "K", "N"]

#: Which number: the name of an attribute of the numbers, `WalkImu` or `MarkovImu`.
Of = Literal["noise", "walk", "sigma", "time", "K", "density", "B"]

_SYMBOLS = {
    "noise": "N",
    "walk": "K",
    "sigma": "σ",
    "time": "T",
    "K": "K",
    "density": "σ √(2/T)",
    "B": "B",
}


@dataclass(frozen=True, slots=True)
class Formula:
    """factor * number^power * f^rate_power, with f the rate of the samples.

    Attributes
    ----------
    of : str
        Which number.
    power : int
        2 for a variance.
    rate_power : float
        1/2 for the standard deviation of a sample of white noise.
    factor : float
    factor_text : str
        The factor in words; empty for 1.
    """

    of: Of
    power: int = 1
    rate_power: float = 0.0
    factor: float = 1.0
    factor_text: str = ""

    def __call__(self, value: float, rate: float) -> float:
        """The number of the file, in SI."""
        return self.factor * float(value**self.power) * float(rate**self.rate_power)

    def __str__(self) -> str:
        number = _SYMBOLS[self.of] + ("²" if self.power == 2 else "")
        rate = {0.0: "", 0.5: " √f", -0.5: "/√f", 1.0: " f"}[self.rate_power]
        return f"{self.factor_text} {number}{rate}".strip()

    @property
    def squared(self) -> Formula:
        """Its square: a density of variance of a root density, a variance of a standard deviation."""
        return replace(
            self, power=2 * self.power, rate_power=2 * self.rate_power, factor=self.factor**2, factor_text=""
        )

    @property
    def of_a_sample(self) -> Formula:
        """Of one sample, of a root density: times the root of the rate."""
        return replace(self, rate_power=0.5)

    def times(self, factor: float, text: str) -> Formula:
        """With a factor, which is called `text`."""
        return replace(self, factor=factor, factor_text=text)

    @property
    def convention(self) -> str:
        """What kind of number it is of white noise, in words."""
        if self.rate_power:
            return "variance of a sample" if self.power == 2 else "standard deviation of a sample"
        return "continuous, squared" if self.power == 2 else "continuous"


N: Final = Formula("noise")
WALK: Final = Formula("walk")
SIGMA: Final = Formula("sigma")
TIME: Final = Formula("time")
K: Final = Formula("K")
DRIVE: Final = Formula("density")
B: Final = Formula("B")
