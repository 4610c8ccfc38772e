# SPDX-License-Identifier: BSD-3-Clause
"""What one log says of each coefficient, in the terms that all logs of a fleet share.

K is told apart from a ramp R by the longest lags alone. R is never negative, so that with R free a log without a ramp
reads K low, the lower the less it resolves; over many logs that widens the spread and shifts the middle. A log
therefore speaks of Q, N, B and K without R, unless it shows a ramp itself; of R it speaks beside all of them.
"""

from __future__ import annotations

from collections.abc import Mapping

from allanite.fitting.families import FLICKER
from allanite.stability.record_comparison.evidence import evidence_of
from allanite.stability.record_comparison.profiles import Profile
from allanite.stability.record_comparison.series import FittedChannel

__all__ = ["profiles_of"]

_WITHOUT_RAMP = tuple(symbol for symbol in FLICKER if symbol != "R")


def profiles_of(series: FittedChannel, confidence: float) -> Mapping[str, Profile]:
    """Profiles of Q, N, B, K and R.

    Parameters
    ----------
    series : FittedChannel
    confidence : float
        Of the critical values.

    Raises
    ------
    DataQualityError, FitError
        A curve with too few lags, or that no noise terms describe.
    """
    of_ramp = evidence_of(series, FLICKER, confidence, traced=("R",))
    symbols = FLICKER if "R" in of_ramp.present else _WITHOUT_RAMP
    return {**of_ramp.profiles, **evidence_of(series, symbols, confidence).profiles}
