# SPDX-License-Identifier: BSD-3-Clause
"""What gravity tells of a unit that is meant to rest: whether it was turned, and whether its unit and scale are right.

The test of rest (`disturbance`) compares windows of a record with one another, axis by axis. It does not see what
moves evenly, and it cannot say by how much the unit turned. The direction of the mean specific force can. Its length
is 1 g, of a unit that turned in each second only: the mean over many attitudes is shorter.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.recording.health.disturbance import moved
from allanite.recording.health.finding import Finding, Severity, finding, percent
from allanite.recording.health.meaning import GRAVITY, triads
from allanite.recording.health.survey import ChannelSurvey
from allanite.recording.records import Kind

__all__ = ["gravity", "motion"]

Samples = NDArray[np.float64]

#: Length of gravity over 1 g: within so much of 1 at rest, and in the usual second of a unit that turned, where a part
#: of its seconds may be motion.
AGREES, TURNING_AGREES = 0.01, 0.03
#: Length of the means whose directions are compared [s], and the fewest samples in one.
LENGTH, LEAST = 1.0, 8
#: Angle that no drift of the bias explains: 2 deg are 34 mg.
TURNED = math.radians(2.0)
#: Attitudes that are tried as the usual one.
CANDIDATES = 256
#: Angles below so many standard deviations of a mean are noise: of 64 probes of 4096 samples, never one.
NOISE = 7.0


def motion(surveys: Sequence[ChannelSurvey]) -> Iterator[Finding]:
    """The direction of gravity changes: the unit was turned."""
    for triad in triads([s for s in surveys if s.channel.kind is Kind.ACCELERATION and s.present]):
        starts, means, size = _means(triad)
        if len(means) < 2:
            continue
        angle = _angles(means)
        out = angle > max(_bar(triad, means, size), TURNED)
        if not out.any():
            continue
        names, first = ", ".join(s.name for s in triad), int(np.argmax(out))
        spans = np.stack([starts[out], starts[out] + size], axis=1)
        yield finding(
            "motion",
            f"the direction of gravity in {names} is up to {math.degrees(float(angle.max())):.3g} deg "
            f"from its usual direction, first at {triad[0].seconds(int(starts[first]))}: the unit was turned",
            severity=Severity.WARNING,
            spans=spans,
            weight=angle[out],
        )


def _means(triad: Sequence[ChannelSurvey]) -> tuple[NDArray[np.int64], Samples, int]:
    """First samples and mean vectors [m/s^2] of blocks of a second in the probes of the three channels."""
    size = max(round(LENGTH / triad[0].dt), LEAST)
    starts, means = [], []
    for probes in zip(*(s.probes for s in triad), strict=True):
        rows = min(len(values) for _, values in probes) // size
        if rows == 0:
            continue
        cut = np.stack([values[: rows * size].reshape(rows, size) for _, values in probes], axis=-1)
        starts.append(probes[0][0] + size * np.arange(rows))
        means.append(cut.mean(axis=1))  # a block with a missing sample is no block
    if not means:
        return np.zeros(0, dtype=np.int64), np.zeros((0, 3)), size
    scale = np.array([s.channel.scale for s in triad])
    vectors = (np.concatenate(means) + [s.origin for s in triad]) * scale
    known = np.isfinite(vectors).all(axis=1) & (np.abs(vectors).max(axis=1) > 0)
    return np.concatenate(starts)[known].astype(np.int64), vectors[known], size


def _angles(means: Samples) -> Samples:
    """Angle of each vector to the attitude in which the unit spends most of the time [rad]."""
    unit = means / np.maximum(np.linalg.norm(means, axis=1, keepdims=True), 1e-300)
    candidates = unit[:: -(-len(unit) // CANDIDATES)]
    # a chord tells small angles apart, a cosine does not
    near = [np.count_nonzero(np.linalg.norm(unit - one, axis=1) < TURNED / 2) for one in candidates]
    usual = candidates[int(np.argmax(near))]
    return np.asarray(2 * np.arcsin(np.minimum(0.5 * np.linalg.norm(unit - usual, axis=1), 1.0)))


def _bar(triad: Sequence[ChannelSurvey], means: Samples, size: int) -> float:
    """Angle that noise makes of a mean [rad]."""
    noise = max(abs(s.channel.scale) * s.sigma for s in triad) / math.sqrt(size)
    length = float(np.median(np.linalg.norm(means, axis=1)))
    return NOISE * noise / length


def gravity(surveys: Sequence[ChannelSurvey]) -> Iterator[Finding]:
    """The mean of an accelerometer triad is not 1 g long (battery B18)."""
    if any(moved(s) for s in surveys):
        return
    for triad in triads([s for s in surveys if s.channel.kind is Kind.ACCELERATION and s.present]):
        turned = next(motion(triad), None) is not None
        norm = _usual_length(triad) if turned else math.hypot(*(s.mean * s.channel.scale for s in triad))
        ratio = norm / GRAVITY
        if abs(ratio - 1.0) <= (TURNING_AGREES if turned else AGREES):
            continue
        names = ", ".join(s.name for s in triad)
        yield finding(
            "gravity",
            f"gravity measured by {names} is {norm:.4g} m/s² ({_beside_one_g(ratio)}){_mix_up(ratio)}",
            severity=Severity.WARNING,
            count=sum(s.present for s in triad),
        )


def _beside_one_g(ratio: float) -> str:
    """A length of so many g, in percent where that is the shorter way."""
    if 0.5 < ratio < 2.0:
        return f"{percent(abs(ratio - 1.0))} {'high' if ratio > 1.0 else 'low'}"
    return f"{ratio:.4g} g"


def _usual_length(triad: Sequence[ChannelSurvey]) -> float:
    """Median length of the means over a second [m/s^2]."""
    return float(np.median(np.linalg.norm(_means(triad)[1], axis=1)))


def _mix_up(ratio: float) -> str:
    """What would explain a length of so many g."""
    if ratio < 0.02 and abs(ratio / 1e-3 - 1.0) >= 0.03:
        return ": gravity was subtracted before logging, and the bias is not separable from the remainder"
    for factor, text in (
        (GRAVITY, "m/s² labeled as g"),
        (1.0 / GRAVITY, "g labeled as m/s²"),
        (1e3, "mg labeled as g"),
        (1e-3, "g labeled as mg"),
        (math.degrees(1.0), "a factor 57.3 between degrees and radians"),
        (math.radians(1.0), "a factor 57.3 between degrees and radians"),
    ):
        if abs(ratio / factor - 1.0) < 0.03:
            return f": {text} would explain it"
    return ""
