# SPDX-License-Identifier: BSD-3-Clause
"""What the residuals of the regression say: the size of the noise, and what the noise model does not know."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from allanite.experiments.earth_rate.checks import RateCheck
from allanite.experiments.earth_rate.take import Take, Transient
from allanite.experiments.earth_rate.verdict import RateCheckKind
from allanite.filtering.regression import Regression
from allanite.noise import NoiseModel, White
from allanite.quantities.residual_tests import alarm, size_check
from allanite.recording.records import Kind

__all__ = ["residual_checks"]

_DECAYS = (RateCheckKind.WARM_UP, RateCheckKind.SETTLING)


def residual_checks(
    fit: Regression, take: Take, model: NoiseModel, decays: Sequence[Transient]
) -> tuple[RateCheck, ...]:
    """Size of the noise; a warm-up, a rotation that settles after each turn, a temperature, unless fitted already."""
    checks = [_size(take, model)]
    for kind in _DECAYS:
        offered = take.offered(kind.value)  # type: ignore[arg-type]
        if offered and not any(d.kind == kind for d in decays):
            gains = [fit.chi2 - take.fit(model, [*decays, d]).chi2 for d in offered]
            checks.append(_gain(kind, gains))
    for channel in take.recording.channels:
        if channel.kind is Kind.TEMPERATURE and channel.name != take.temperature:
            table, names = take.design(decays)
            more = take.regress(
                np.column_stack([table, take.warmth(channel.name)]), (*names, channel.name), model
            )
            checks.append(_gain(RateCheckKind.TEMPERATURE, [fit.chi2 - more.chi2], channel.name))
    return tuple(checks)


def _size(take: Take, model: NoiseModel) -> RateCheck:
    """The Allan variance of the record at the length of a block against the model's: blind to drift and to turns.

    Differences of neighbouring blocks, each block in one difference only, have twice that variance; blocks that were
    measured in part have more white noise.
    """
    blocks = take.blocks
    early, late = slice(0, blocks.size - 1, 2), slice(1, blocks.size, 2)
    together = (blocks.span[early] == blocks.span[late]) & (blocks.span[early] >= 0)
    part = np.minimum(blocks.part[early], blocks.part[late])[together]
    step = (blocks.mean[late] - blocks.mean[early])[together]
    white = sum(t.N**2 for t in model.terms if isinstance(t, White)) / blocks.dt
    partly = white * (1 / blocks.part[early][together] + 1 / blocks.part[late][together] - 2)
    variance = 2 * float(model.avar_sampled(1, blocks.dt, take.sampling)) + partly
    test = size_check(float((step**2 / variance)[part > 0].sum()), int(np.count_nonzero(part > 0)))
    return RateCheck.of(RateCheckKind.SIZE, test)


def _gain(kind: RateCheckKind, gains: list[float], channel: str = "") -> RateCheck:
    """The candidate column that takes most off the residuals, at the price of having looked at all of them."""
    return RateCheck.of(kind, alarm(kind, max([*gains, 0.0]), 1, looks=len(gains)), channel=channel)
