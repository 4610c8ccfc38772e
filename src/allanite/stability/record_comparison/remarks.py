# SPDX-License-Identifier: BSD-3-Clause
"""What a reader of a comparison must know besides its numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator

from allanite.quantities.distributions import normal_quantile
from allanite.recording.health.finding import percent
from allanite.stability.record_comparison.results import ChannelComparison, Comparison

__all__ = ["remarks"]

#: Factor between the shortest lags of records beyond which some of them are not compared.
_LATER = 1.5


def remarks(result: Comparison) -> list[str]:
    """Differences of the records that were allowed for, and limits of what they can say."""
    return [
        *_of_records(result),
        *(words for c in result.channels for words in _of_channel(result, c)),
        *_of_means(result),
    ]


def _of_records(result: Comparison) -> Iterator[str]:
    rates = sorted({round(r.rate, 6) for r in result.records})
    if len(rates) > 1:
        listed = ", ".join(f"{r:g}" for r in rates)
        yield f"the sample rates differ ({listed} Hz): curves are interpolated to common lags"
    if len({r.sampling for r in result.records}) > 1:
        yield "some records hold interval means, others point samples: each is analyzed as such"


def _of_channel(result: Comparison, channel: ChannelComparison) -> Iterator[str]:
    name, sure = channel.name, {f for f in channel.families if f != "both"}
    if len(sure) > 1 or "neither" in sure:
        listed = ", ".join(f"{r.name}: {f}" for r, f in zip(result.records, channel.families, strict=True))
        yield f"{name}: the records do not follow one family ({listed}); slow terms are compared as {channel.family}"
    if channel.apertures_differ:
        yield f"{name}: the averaging time within a sample (aperture) differs, and the white noise with it"
    if channel.scale_uncertainty is not None:
        apart = math.sqrt(2) * normal_quantile(0.975) * channel.scale_uncertainty
        yield (
            f"{name}: tests and intervals do not include the standard uncertainty of the scale factor, "
            f"{percent(channel.scale_uncertainty)}. If the records have separate calibrations, these alone may set two "
            f"records apart by {percent(apart)} of any amplitude or mean (95 %)"
        )
    if channel.unexplained:
        yield (
            f"{name}: no sum of terms explains the curve of {', '.join(channel.unexplained)}; the intervals of the "
            "parameters include that, and the test of the curves does not depend on it"
        )
    firsts = [float(c.tau[c.used][0]) for c in channel.curves]
    if max(firsts) > _LATER * min(firsts):
        yield (
            f"{name}: the shortest lags do not follow noise terms in all records, or their rates differ; curves are "
            f"compared from {max(firsts):.3g} s on"
        )


def _of_means(result: Comparison) -> Iterator[str]:
    if any(c.bias is not None and c.kind in ("rate", "acceleration") for c in result.channels):
        yield (
            "the mean of a record includes what the sensor measures (the Earth's rate, gravity): means compare biases "
            "only of sensors in one orientation"
        )
