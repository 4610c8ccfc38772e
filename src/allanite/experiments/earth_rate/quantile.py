# SPDX-License-Identifier: BSD-3-Clause
"""Half widths of intervals of an Earth rate, in standard deviations."""

from __future__ import annotations

from allanite.experiments.earth_rate.verdict import NoiseOrigin
from allanite.quantities.distributions import normal_quantile, student_quantile
from allanite.quantities.residual_tests import SEEN

__all__ = ["needed_quantile", "needs_more", "quantile_of"]

#: Probability of being less than three standard deviations above, in the normal law.
_THREE_SD = 0.99865


def quantile_of(p: float, source: NoiseOrigin, pairs: int) -> float:
    """Of the normal law; of Student's, by the number of pairs, where the noise comes from the record itself."""
    return normal_quantile(p) if source is NoiseOrigin.GIVEN else student_quantile(p, max(pairs - 1, 1))


def needed_quantile(source: NoiseOrigin, pairs: int) -> float:
    """Distance from zero from which a rate is seen."""
    return quantile_of(_THREE_SD, source, pairs)


def needs_more(source: NoiseOrigin, pairs: int) -> bool:
    """The noise is known from so few dwells that three standard deviations are not enough."""
    return needed_quantile(source, pairs) > 1.001 * SEEN
