# SPDX-License-Identifier: BSD-3-Clause
"""What a combination comes to, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.experiments.redundancy.verdict import FaultKind
from allanite.quantities.quantity import Quantity

__all__ = [
    "EVERYWHERE",
    "MOTION",
    "MOVED",
    "STAYS",
    "fault_sentence",
    "isolation_sentence",
    "left_out",
    "more_pairs",
    "no_contradiction",
    "shared_sentence",
    "unusual",
]

MOTION = "parity cannot see noise that looks like motion to all sensors: if the record was not at rest, use --moving"
MOVED = "the record was not at rest: the weights come from the models alone, and no gain is measured"
EVERYWHERE = "every window contains part of a fault: shared noise and gain include the faults"
STAYS = "a fault of an unidentified sensor stays in the recording"

_DOES = {
    FaultKind.STEP: "steps",
    FaultKind.DRIFT: "drifts",
    FaultKind.SPIKE: "jumps for a moment",
    FaultKind.NOISE: "is noisier",
}


def no_contradiction(false_alarm: float) -> str:
    """What was looked for and is not there."""
    return f"no parity window contradicts the noise models ({100 * false_alarm:g} % false alarms)"


def fault_sentence(kind: FaultKind, sensor: str | None, who: str, duration: float, parities: int) -> str:
    """What happened, and why its sensor is not named where it is not; `who` did it, for so long [s]."""
    if kind is FaultKind.STUCK:
        return f"{who} repeats one value for {duration:g} s"
    if kind is FaultKind.OTHER:
        return "no single fault explains how the sensors contradict each other"
    if sensor is not None:
        return f"{who} {_DOES[kind]}"
    alone = parities == 1
    return f"{who} {_DOES[kind]}: " + (
        "one parity cannot tell which" if alone else "their faults look too much alike to tell which"
    )


def isolation_sentence(sensors: int, parities: int, alike: Sequence[Sequence[str]]) -> str:
    """What the geometry lets the parity tell."""
    if parities == 1:
        axes = f"{sensors - 1} axes" if sensors > 2 else "one axis"
        return f"{sensors} sensors of {axes} have one parity: a fault is detected, but its sensor is not identified"
    if alike:
        groups = "; ".join(" and ".join(group) for group in alike)
        return f"a fault is detected and its sensor identified, except between {groups}"
    return "a fault is detected and its sensor identified"


# -- remarks ------------------------------------------------------------------------------------------------


def shared_sentence(first: str, second: str, tau: float, correlation: Quantity) -> str:
    """That two sensors share noise."""
    r = correlation
    return (
        f"noise is shared by {first} and {second}: correlation {r.value:.2f} [{r.lower:.2f}, {r.upper:.2f}] of means "
        f"over {tau:.3g} s; the weights account for it"
    )


def more_pairs(count: int) -> str:
    """That other pairs do as well."""
    return f"{count} more pairs share noise"


def unusual(ratio: float) -> str:
    """That the parity has another noise than the models say."""
    word = (
        "the tests allow for it, but the stated noise of the combination does not: pass a study of all sensors as "
        "--model"
        if ratio > 1
        else "the tests are stricter than necessary"
    )
    return f"the sensors disagree {ratio:.2f} times as much as the models predict: {word}"


def left_out(names: Sequence[str], *, at_rest: bool) -> str:
    """What the recording is without."""
    whole = "; deviation and gain describe the whole recording" if at_rest else ""
    return (
        f"the recording continues without {', '.join(names)} in the spans above and is noisier there{whole}"
    )
