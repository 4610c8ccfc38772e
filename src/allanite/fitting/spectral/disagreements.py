# SPDX-License-Identifier: BSD-3-Clause
"""Where a model of the lags and a spectrum part, as `allanite.fitting.spectral.agreement` finds it."""

from __future__ import annotations

import math

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.result import Result

__all__ = ["Disagreement", "Parted"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Parted(Result):
    """A parameter that the two fits do not agree on.

    Attributes
    ----------
    symbol : str
        Its name.
    lags, frequencies : float [SI]
        The two estimates.
    """

    symbol: str
    lags: float
    frequencies: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Disagreement(Result):
    """Where a model of the curve and the spectrum part.

    Attributes
    ----------
    p : float
        Probability of a spectrum as unlike the model in all, or in its worst band.
    band : (float, float) [Hz]
        The band that is least like the model.
    ratio : float
        Density of that band over the model's.
    parameters : tuple of Parted
        Those that the two fits do not agree on.
    whole : bool
        The spectrum is unlike the model, apart from any parameter.
    """

    p: float
    band: tuple[float, float]
    ratio: float
    parameters: tuple[Parted, ...]
    whole: bool

    @property
    def size(self) -> float:
        """The largest relative change of a root density, or of a parameter, that it amounts to."""
        factors = [math.sqrt(self.ratio)] if self.whole else []
        factors += [each.frequencies / each.lags for each in self.parameters]
        return max((max(f, 1 / f) - 1 if f > 0 else math.inf for f in factors), default=0.0)

    @property
    def words(self) -> str:
        """One sentence."""
        parts = []
        if self.whole:
            low, high = self.band
            parts.append(
                f"from {low:.3g} to {high:.3g} Hz the density is {self.ratio:.3g} times that of the curve's model "
                f"(p = {self.p:.1g})"
            )
        parts += [
            f"{each.symbol} from the frequencies is {each.frequencies / each.lags:.3g} times {each.symbol} from the "
            "lags, outside its interval"
            for each in self.parameters
        ]
        return "; ".join(parts)
