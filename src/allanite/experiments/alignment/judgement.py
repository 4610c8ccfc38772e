# SPDX-License-Identifier: BSD-3-Clause
"""What may be said of an alignment, and which headings are hidden because there is none."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from allanite.experiments.alignment.results import AlignmentEstimate, fixed
from allanite.experiments.alignment.verdict import AlignmentVerdict, NoNorth
from allanite.experiments.north.circle import CIRCLE
from allanite.quantities.residual_tests import SEEN

__all__ = ["CERTAIN", "SMALL_BIAS", "judge"]

#: Confidence at which a horizontal rate that is not the Earth's takes the heading away: of good records one in a
#: thousand.
CERTAIN = 0.999
#: Biases that show to be below the Earth's horizontal rate over this may point by it without their being known.
SMALL_BIAS = 10.0


def judge(bare: AlignmentEstimate, *, excluded: bool, assumed: bool = False) -> AlignmentEstimate:
    """The same with its verdict; no heading where there is none.

    Parameters
    ----------
    excluded : bool
        The horizontal rate is not that of the Earth, at `CERTAIN`.
    assumed : bool
        The biases were taken to be as large as they show, for nothing was known of them.
    """
    verdict, cause = _verdict(bare, excluded=excluded, assumed=assumed)
    parts = {name: v for name, v in bare.budget.items() if name != "together"}
    judged = replace(
        bare,
        verdict=verdict,
        no_north=cause,
        largest_source=max(parts, key=parts.__getitem__, default="gyro noise"),
    )
    hidden = cause is not None or bare.interval.full or _refuted(bare, excluded=excluded)
    return _without_heading(judged) if hidden else judged


def _verdict(
    bare: AlignmentEstimate, *, excluded: bool, assumed: bool
) -> tuple[AlignmentVerdict, NoNorth | None]:
    if cause := _no_north(bare, excluded=excluded):
        return AlignmentVerdict.NO_NORTH, cause
    if bare.contradictions:
        return AlignmentVerdict.INCONSISTENT, None
    if excluded:
        return AlignmentVerdict.CONTRADICTS, None
    return AlignmentVerdict.BIAS_UNKNOWN if assumed else AlignmentVerdict.RESOLVED, None


def _no_north(bare: AlignmentEstimate, *, excluded: bool) -> NoNorth | None:
    """Why there is no heading."""
    if math.isinf(bare.largest_sd):
        return NoNorth.BIASES
    if _hides(bare, excluded=excluded):
        return NoNorth.HIDDEN
    if not (bare.interval.full or bare.signal_to_noise < SEEN or bare.expected_signal < SEEN):
        return None
    # what widened everything until nothing is left is the reason, not the noise: could the sensors tell by that?
    if bare.contradictions and bare.expected_signal * bare.inflation >= SEEN:
        return NoNorth.TORN
    return NoNorth.UNSEEN if bare.expected_signal >= SEEN else NoNorth.WEAK


def _hides(bare: AlignmentEstimate, *, excluded: bool) -> bool:
    """Is what the gyros show beside the Earth as large as the Earth?"""
    if bare.one_attitude:
        return (excluded or bool(bare.contradictions)) and bare.apparent_bias >= bare.expected_rate
    return excluded and bare.horizontal_length.lower > 2 * bare.expected_rate


def _refuted(bare: AlignmentEstimate, *, excluded: bool) -> bool:
    """One attitude points by what is known of the biases: that is wrong, and they are too large to do without."""
    wrong = excluded or bool(bare.contradictions)
    return bare.one_attitude and wrong and SMALL_BIAS * bare.apparent_bias >= bare.expected_rate


def _without_heading(estimate: AlignmentEstimate) -> AlignmentEstimate:
    """Nor one among what stands beside it, where somebody would take it from."""
    ends = {
        name: replace(getattr(estimate, name), heading=math.nan, heading_sd=math.inf, interval=CIRCLE)
        for name in ("first", "last")
    }
    coarse = tuple(replace(c, heading=math.nan) for c in estimate.coarse)
    naive = None if estimate.naive is None else replace(estimate.naive, heading=math.nan)
    n = len(estimate.running.time)
    nothing = {name: fixed(np.full(n, math.nan)) for name in ("heading", "start")}
    wide = {"sd": fixed(np.full(n, math.inf)), "width": fixed(np.full(n, CIRCLE.width))}
    running = replace(estimate.running, **nothing, **wide)
    return replace(estimate, **ends, coarse=coarse, naive=naive, running=running, budget={})
