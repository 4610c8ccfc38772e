# SPDX-License-Identifier: BSD-3-Clause
"""What a run on a rate table comes to, in sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence

from allanite.experiments.rate_table.checks import TableCheck
from allanite.experiments.rate_table.verdict import TableRemark
from allanite.plain_files.counted import plural
from allanite.quantities.residual_tests import SEEN

__all__ = [
    "AIDED",
    "FEW_RATES",
    "NO_SIGN",
    "ONE_CLOCK",
    "ONE_RATE",
    "REMARKS",
    "before_or_behind",
    "clipped",
    "contradicted",
    "degree_too_high",
    "earth_in_bias",
    "known_to",
    "lowest",
    "not_whole",
    "offset_of_clocks",
    "plateaus",
    "repeats",
    "too_small",
]

#: Offsets that are listed.
LISTED = 3

ONE_RATE = "scale factor and bias cannot be separated: the table turned at only one rate"
NO_SIGN = {sign: f"not determined: no {sign} rates" for sign in ("negative", "positive")}
"""Why there is no asymmetry, by the sign that is missing."""
FEW_RATES = "not determined: too few rates"
ONE_CLOCK = "the record shows no change of the rate: the clocks of table and record are assumed to agree"
AIDED = (
    "the seed paper's filter, given the fitted response to the table, removes slow noise from the record; its output "
    "agrees with the given response by construction and is no measurement"
)
REMARKS = {
    TableRemark.RATES: "record at two or more rates, of both signs, and at rest",
    TableRemark.DEGREE: "record at more rates, or fit a lower degree (--nonlinearity 1)",
    TableRemark.UNSETTLED: (
        "the sensor or the table has not settled within half of a step: make the steps longer"
    ),
    TableRemark.REVERSED: (
        "the channel reads negative where the table turns positive: sensor and table have opposite signs"
    ),
}


# -- the reason ---------------------------------------------------------------------------------------------


def degree_too_high(rates: int) -> str:
    """Why a curve is not determined."""
    which = plural(rates, "rate", "do") if rates else "these rates do"
    return f"{which} not determine a curve of this degree"


def too_small(value: float, sd: float) -> str:
    """Why the response is not seen."""
    size = abs(value) / sd if sd else math.inf
    return (
        f"the response to the table is {size:.1f} standard deviations from zero; {SEEN:g} are required: is this the "
        "channel on the table's axis, and the table of this record?"
    )


def contradicted(check: TableCheck) -> str:
    """Which check contradicts the model or the table."""
    return f"the residuals contradict the noise model or the table: {check.says}"


def known_to(relative: float, inflation: float, failed: Sequence[TableCheck]) -> str:
    """How well the scale factor is known, relative to it."""
    ppm = 1e6 * relative
    size = f"{ppm:.2g} ppm" if ppm < 1000 else f"{ppm / 1e4:.2g} %"
    widened = f", widened {inflation:.2f} times" if inflation > 1 else ""
    names = f"; failed checks: {', '.join(c.name for c in failed)}" if failed else ""
    return f"the scale factor is known to {size} (1 sd){widened}{names}"


# -- on the way ---------------------------------------------------------------------------------------------


def clipped(ends: Sequence[str], rates: Sequence[float], steps: int) -> str:
    """What is left out because the sensor is at the end of its range: steps at these rates, or rates beyond them."""
    head = f"the range ends at {' and '.join(ends)}"
    degrees = [math.degrees(rate) for rate in rates]
    if steps:
        listed = ", ".join(f"{round(r, 6):g}" for r in degrees)
        verbs = "clips and is" if steps == 1 else "clip and are"
        return f"{head}: {plural(steps, 'step')} at {listed} deg/s {verbs} left out"
    return f"{head}: rates beyond {' and '.join(f'{r:.4g}' for r in degrees)} deg/s clip and are left out"


def repeats(offsets: Sequence[float], *, either_sign: bool) -> str:
    """That the motion of the table fits the record at other offsets, too."""
    listed = ", ".join(f"{x:.4g}" for x in offsets[:LISTED])
    more = ", …" if len(offsets) > LISTED else ""
    sign = ", some with the opposite sign of the scale factor" if either_sign else ""
    return (
        f"the motion of the table is periodic: clock offsets of {listed}{more} s fit the record as well{sign}. Give "
        "the offset (--offset) if you know it"
    )


def before_or_behind(delay: float, half: float) -> str:
    """The delay of the output, by a clock that was given."""
    size = f"{_seconds(abs(delay))} (± {_seconds(half)})"
    words = f"the output lags the table by {size}"
    if delay < 0:
        words = f"the output leads the table by {size}, which no sensor does"
    return f"{words}, with the given clock offset"


def offset_of_clocks(
    offset: float, half: float, drift: float | None, *, between: bool, loop_alike: bool
) -> str:
    """How the clocks were compared; whether the edges lie `between` steps, and a hysteresis would look the same."""
    words = f"the table's zero is at {_seconds(offset)} of the record (± {_seconds(half)})"
    if between:
        words += "; the motion between the steps is unknown"
    else:
        words += ", sensor delay included"
    if drift is not None:
        words += f"; its clock runs {1e6 * drift:+.0f} ppm relative to the table's"
    return words + ("; hysteresis of a steady sweep would look the same" if loop_alike else "")


def _seconds(value: float) -> str:
    return f"{1e3 * value:.3g} ms" if abs(value) < 0.9995 else f"{value:.4g} s"


def earth_in_bias(along: float | None, axis: str, *, relative: bool) -> str:
    """What the bias holds of the Earth; "" where it is not known."""
    if along is None:
        if axis == "horizontal":
            return "the bias includes the Earth's rotation along the table's axis, which depends on where that points"
        return ""
    size = math.degrees(along) * 3600
    of = "" if relative else ", times the scale factor"
    if axis == "vertical":
        return (
            f"the bias includes the Earth's rotation about the vertical axis, {abs(size):.3f} deg/h{of}; its sign "
            "depends on which way the axis points: state it (--axis up or down)"
        )
    return f"the bias includes {size:+.3f} deg/h of the Earth's rotation{of}"


def not_whole(count: int, used: int) -> str:
    """That the Earth and gravity do not average over the steps."""
    return (
        f"{count} of {plural(used, 'step')} {'does' if count == 1 else 'do'} not turn by whole revolutions: what the "
        "Earth and gravity add across the axis does not average out; state the misalignment to include it in the "
        "interval"
    )


def plateaus(count: int) -> str:
    """That the encoder shows steps."""
    return (
        f"the record of the table shows {plural(count, 'stretch')} of constant rate: each is used as a step"
    )


def lowest(frequency: float) -> str:
    """Which of several sinusoids tells the scale factor."""
    return f"the scale factor is the one at the lowest frequency, {frequency:.4g} Hz"
