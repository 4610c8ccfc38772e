# SPDX-License-Identifier: BSD-3-Clause
"""What the residuals of the regression say: the size of the noise, and what the noise model does not know."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from allanite.earth_rate.dwell_means import ALARM
from allanite.earth_rate.results import Check
from allanite.earth_rate.take import Decay, Take
from allanite.laws import chi_square_tail
from allanite.noise import NoiseModel
from allanite.recording import Kind
from allanite.regression import Regression

__all__ = ["residual_checks"]

_SAYS = {
    "warm-up": "the level drifts as after power-on, beyond what the noise model allows: wait longer before the record "
    "begins, or fit the warm-up beside the rate (--warm-up)",
    "settling": "a rotation in the direction of the turn goes on after it and adds to the rate: leave out more time "
    "after each turn (--dead-time), or fit it beside the rate (--settling)",
}


def residual_checks(
    fit: Regression, take: Take, model: NoiseModel, decays: Sequence[Decay]
) -> tuple[Check, ...]:
    """Size of the noise; a warm-up, a rotation that settles after each turn, a temperature, unless fitted already."""
    checks = [_size(fit.chi2, fit.dof)]
    for kind, says in _SAYS.items():
        offered = take.offered(kind)  # type: ignore[arg-type]
        if offered and not any(d.kind == kind for d in decays):
            gains = [fit.chi2 - take.fit(model, [*decays, d]).chi2 for d in offered]
            checks.append(_gain(kind, gains, says))
    for channel in take.recording.channels:
        if channel.kind is Kind.TEMPERATURE and channel.name != take.temperature:
            table, names = take.design(decays)
            more = take.regress(
                np.column_stack([table, take.warmth(channel.name)]), (*names, channel.name), model
            )
            says = f"the level follows the temperature: fit it beside the rate (--temperature {channel.name})"
            checks.append(_gain(channel.name, [fit.chi2 - more.chi2], says))
    return tuple(checks)


def _size(chi2: float, dof: int) -> Check:
    p = chi_square_tail(chi2, dof)
    return Check(
        name="size of the noise",
        statistic=chi2,
        dof=dof,
        p=p,
        passed=p >= ALARM,
        says=f"the noise of this record is {math.sqrt(chi2 / dof):.3f} times that of the model",
    )


def _gain(name: str, gains: list[float], says: str) -> Check:
    """The candidate column that takes most off the residuals, at the price of having looked at all of them."""
    best = max([*gains, 0.0])
    p = min(chi_square_tail(best, 1) * max(len(gains), 1), 1.0)
    return Check(name=name, statistic=best, dof=1, p=p, passed=p >= ALARM, says=says)
