# SPDX-License-Identifier: BSD-3-Clause
"""What a reader of static spans must know, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.static_spans.axes import UnitAxes
from allanite.experiments.static_spans.cells import ChannelCells
from allanite.experiments.static_spans.results import WHY, MovingSpan
from allanite.experiments.static_spans.scan import RestScan
from allanite.experiments.static_spans.scrutiny import FLAT

__all__ = ["remarks"]

#: Noise of the quietest parts beyond so many times that of the model: the model is not that of this record.
FOREIGN = 2.0


def remarks(
    cells: ChannelCells, rest_scan: RestScan, axes: UnitAxes, moving: Sequence[MovingSpan], has_rest: bool
) -> tuple[str, ...]:
    """Findings about the spans of a record, the gravest first."""
    names = np.array(axes.names)
    out = [] if has_rest else [_nothing(cells, moving)]
    empty = cells.count.sum(axis=0) == 0
    dead = ~empty & ~np.isfinite(cells.step)
    if empty.any():
        out.append(
            f"{_listed(names, empty)} {'have' if empty.sum() > 1 else 'has'} no samples, and without them rest cannot "
            "be detected"
        )
    if dead.any():
        out.append(
            f"{_listed(names, dead)} {'repeat' if dead.sum() > 1 else 'repeats'} one value throughout: not connected?"
        )
    dead |= empty
    foreign = rest_scan.over_model > FOREIGN
    if foreign.any():
        out.append(
            f"the quietest parts of {_listed(names, foreign)} move {np.nanmax(rest_scan.over_model):.3g} times as "
            "much from sample to sample as the model predicts: is it the model of this sensor, in this unit? Without a "
            "model the noise floor of the record is used"
        )
    kinds = {m.why for m in moving}
    if "turning" in kinds:
        out.append(
            f"{_count(moving, 'turning')} left out despite a steady rate: the mean differs from that of the other "
            "spans, so the unit turned or its bias jumped"
        )
    if "frozen" in kinds:
        out.append(f"{_count(moving, 'frozen')} left out: {WHY['frozen']}")
    flat = (rest_scan.fall > FLAT) & ~rest_scan.counted
    if has_rest and flat.any():
        out.append(
            f"the noise of {_listed(names, flat)} does not fall over means of 0.05 to 0.8 s as it does in most sensors "
            "at rest: the unit may have been held by hand. A noise model decides"
        )
    counted = rest_scan.counted & ~dead
    if counted.any():
        out.append(
            f"the noise of {_listed(names, counted)} is below one count: smaller motion is not detected"
        )
    if not axes.gyro:
        out.append("without gyros, a rotation about the vertical is not detected")
    if not axes.accelerometer:
        out.append(
            "without accelerometers, a rotation that is slow compared with the gyro noise is not detected"
        )
    return tuple(out)


def _nothing(cells: ChannelCells, moving: Sequence[MovingSpan]) -> str:
    if any(m.why == "held" for m in moving):
        return (
            "nothing is at rest: in the quietest parts the accelerometers tilt as the gyros turn, so the unit was held "
            "by hand or lay on something that sways. What looks like the noise floor is motion"
        )
    parts = {m.why: _length(moving, m.why) for m in moving}
    size = cells.size * cells.n
    words = [f"{100 * n / size:.3g} % {WHY[why]}" for why, n in sorted(parts.items(), key=lambda p: -p[1])]
    statement = f"nothing is at rest for long enough: {'; '.join(words) or 'no samples'}"
    return statement + (
        "; a noise model of the sensors (--model) tells rest from slow motion" if "smooth" in parts else ""
    )


def _length(moving: Sequence[MovingSpan], why: str) -> int:
    return sum(m.stop - m.start for m in moving if m.why == why)


def _count(moving: Sequence[MovingSpan], why: str) -> str:
    n = sum(m.why == why for m in moving)
    return f"{n} span{'s' * (n != 1)}"


def _listed(names: NDArray[np.str_], chosen: NDArray[np.bool_]) -> str:
    return ", ".join(names[chosen].tolist())
