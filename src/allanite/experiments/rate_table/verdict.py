# SPDX-License-Identifier: BSD-3-Clause
"""The verdict on a run on the rate table with its reason and advice, and what was found on the way, in sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from allanite.experiments.rate_table.motion import RateSteps, RateTable
from allanite.experiments.rate_table.record.clipping import Clipped
from allanite.experiments.rate_table.record.rows import LAG, RATE
from allanite.experiments.rate_table.record.timing import CoarseOffset
from allanite.experiments.rate_table.residual_checks import AGREEMENT
from allanite.plain_files.counted import plural
from allanite.quantities.residual_tests import FOREIGN, SEEN, ResidualTest
from allanite.recording.records import Channel

if TYPE_CHECKING:
    from allanite.experiments.rate_table.results import RateTableEstimate

__all__ = ["clipped_words", "clock_words", "judge", "repeat_words"]

Verdict = tuple[str, str, tuple[str, ...]]

#: The clocks are known so much worse than the edges are: the steps leave gaps.
BETWEEN = 5.0
#: Offsets that are listed.
LISTED = 3


def judge(estimate: RateTableEstimate, *, unbounded: Sequence[str]) -> Verdict:
    """Verdict, reason and advice."""
    rates = {s.rate for s in estimate.steps if s.used}
    if RATE in unbounded and len(rates) < 2:
        return (
            "not separable",
            "scale factor and bias cannot be told apart: the table turned at one rate only",
            ("record at two rates at least, of both signs, and at rest",),
        )
    if unbounded:
        return (
            "not separable",
            f"{plural(len(rates), 'rate', 'do') if rates else 'these rates do'} not determine a curve of this degree",
            ("record at more rates, or fit a lower degree (--nonlinearity 1)",),
        )
    failed = [c for c in estimate.checks if not c.passed]
    advice = tuple(c.says for c in failed)
    scale = estimate["scale factor"]
    if not scale.resolved:
        size = abs(scale.value) / scale.total_sd if scale.total_sd else math.inf
        reason = (
            f"the response to the table is {size:.1f} standard deviations from none, {SEEN:g} are needed: is it the "
            "channel on the axis of the table, and the table of this record?"
        )
        return "not resolved", reason, advice
    grave = [c for c in failed if _grave(c)]
    if grave:
        return (
            "inconsistent",
            f"the residuals contradict the noise model or the table: {grave[0].says}",
            advice,
        )
    ppm = 1e6 * scale.total_sd / abs(scale.value)
    words = f"the scale factor is known to {_ppm(ppm)} (1 sd)"
    if estimate.inflation > 1:
        words += f", widened {estimate.inflation:.2f} times"
    if failed:
        words += f"; not passed: {', '.join(c.name for c in failed)}"
    return "resolved", words, advice


def _grave(check: ResidualTest) -> bool:
    """A table of another record, or a model of another sensor; all else widens, or is said."""
    return check.name == AGREEMENT or (check.name == "size of the noise" and check.ratio > FOREIGN)


def _ppm(value: float) -> str:
    return f"{value:.2g} ppm" if value < 1000 else f"{value / 1e4:.2g} %"


# -- on the way ----------------------------------------------------------------------------------------------


def clipped_words(clipped: Clipped, table: RateTable, facts: Channel) -> str:
    """What is left out because the sensor is at the end of its range."""
    if not clipped.any:
        return ""
    ends = " and ".join(_end(value, facts) for value in clipped.ends if value is not None)
    if isinstance(table, RateSteps):
        rates = sorted({round(math.degrees(r), 6) for r in table.rate[clipped.steps].tolist()})
        listed = ", ".join(f"{r:g}" for r in rates)
        count = int(np.count_nonzero(clipped.steps))
        return f"the range ends at {ends}: {count} step{'s' * (count > 1)} at {listed} deg/s clip, and are left out"
    sides = [x for x in (clipped.below, clipped.above) if math.isfinite(x)]
    listed = " and ".join(f"{math.degrees(x):.4g}" for x in sides)
    return f"the range ends at {ends}: rates beyond {listed} deg/s clip, and are left out"


def repeat_words(coarse: CoarseOffset) -> str:
    """That the motion of the table fits the record at other offsets, too."""
    if not coarse.others:
        return ""
    listed = ", ".join(f"{x:.4g}" for x in coarse.others[:LISTED])
    more = ", …" if len(coarse.others) > LISTED else ""
    sign = ", at some of them with the other sign of the scale factor" if coarse.either_sign else ""
    return (
        f"the motion of the table repeats itself, and fits the record by a clock offset of {listed}{more} s as well"
        f"{sign}: give the offset (--offset) where it is known"
    )


def _end(value: float, facts: Channel) -> str:
    return f"{value / facts.scale:.6g} {facts.unit}".strip()


def clock_words(estimate: RateTableEstimate, lags: Sequence[str]) -> str:
    """How the clocks were compared."""
    if estimate.clock == "not seen":
        return "no change of the rate can be seen in the record: the clocks of table and record are taken for one"
    if "delay" in estimate.names:
        delay = estimate["delay"]
        half = (delay.interval[1] - delay.interval[0]) / 2
        size = f"{_seconds(abs(delay.value))} (± {_seconds(half)})"
        words = f"the output is {size} behind the table"
        if delay.value < 0:
            words = f"the output comes {size} before the table, which no sensor does"
        return f"{words}, by the clock that was given" if delay.resolved else ""
    if "clock offset" not in estimate.names:
        return ""
    offset = estimate["clock offset"]
    half = (offset.interval[1] - offset.interval[0]) / 2
    words = f"the table's zero is at {_seconds(offset.value)} of the record (± {_seconds(half)})"
    if estimate.table["kind"] == "steps" and half > BETWEEN * estimate.dead_time + offset.sd * BETWEEN:
        words += ", for what the table does between its steps is not known"
    else:
        words += ", the delay of the sensor included"
    if "clock drift" in estimate.names:
        words += f"; its clock runs {1e6 * estimate['clock drift'].value:+.0f} ppm against the table's"
    if LAG in lags and estimate.table["kind"] == "samples":
        words += "; a hysteresis of a steady sweep would look the same"
    return words


def _seconds(value: float) -> str:
    return f"{1e3 * value:.3g} ms" if abs(value) < 0.9995 else f"{value:.4g} s"
