# SPDX-License-Identifier: BSD-3-Clause
"""What a reader of a comparison must know besides its numbers."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.recording.records import Kind
from allanite.stability.record_comparison.results import ChannelComparison
from allanite.stability.record_comparison.series import FittedChannel

__all__ = ["remarks_of"]


def remarks_of(
    groups: Sequence[Sequence[FittedChannel]], channels: Sequence[ChannelComparison]
) -> tuple[str, ...]:
    """Differences of the records that were allowed for, and limits of what they can say."""
    made: list[str] = []
    first = groups[0]
    rates = sorted({round(1 / s.curve.dt, 6) for s in first})
    if len(rates) > 1:
        listed = ", ".join(f"{r:g}" for r in rates)
        made.append(
            f"the rates differ ({listed} Hz): curves are compared between their lags by interpolation"
        )
    if len({s.sampling for s in first}) > 1:
        made.append(
            "some records hold interval means and others point samples: each is read by its own formulas"
        )
    for series, channel in zip(groups, channels, strict=True):
        made += _of_channel(series, channel)
    if any(g[0].kind in (Kind.RATE, Kind.ACCELERATION) and g[0].mean is not None for g in groups):
        made.append(
            "the mean of a record holds what the sensor measures (the Earth's rate, gravity): means compare biases "
            "only of a sensor that stood the same way"
        )
    return tuple(made)


def _of_channel(series: Sequence[FittedChannel], channel: ChannelComparison) -> list[str]:
    made = []
    name = channel.name
    sure = {f for f in channel.families if f != "both"}
    if len(sure) > 1 or "neither" in sure:
        listed = ", ".join(f"{s.record}: {f}" for s, f in zip(series, channel.families, strict=True))
        made.append(
            f"{name}: the records do not follow one family ({listed}); slow terms are compared as {channel.family}"
        )
    apertures = {s.curve.channels[0].aperture for s in series}
    if len(apertures) > 1:
        made.append(
            f"{name}: the averaging time within a sample (aperture) differs, and the white noise with it"
        )
    odd = [s.record for s in series if s.fit.data.discrepancy > 0]
    if odd:
        made.append(
            f"{name}: no sum of terms explains the curve of {', '.join(odd)}; the parameters' intervals hold that, and "
            "the test of the curves does not need it"
        )
    firsts = [float(s.curve.tau[s.fit.used][0]) for s in series]
    if max(firsts) > 1.5 * min(firsts):
        made.append(
            f"{name}: the shortest lags do not follow noise terms in all records, or their rates differ; curves are "
            f"compared from {max(firsts):.3g} s on"
        )
    return made
