# SPDX-License-Identifier: BSD-3-Clause
"""Findings in people's words: in their order, those of one kind together, each thing said once."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from allanite.plain_files.counted import listed, plural
from allanite.recording.health.catalogue import MOVES
from allanite.recording.health.finding import Finding, Severity

__all__ = [
    "finding_kinds",
    "finding_line",
    "findings_headline",
    "movement",
    "own_words",
    "said_of",
    "severity_order",
    "worst",
]

_ORDER = (Severity.FATAL, Severity.WARNING, Severity.INFO)
#: Channels that a line names; of more it says how many.
_NAMED = 2
_NUMBER = re.compile(r"[+-]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?(?: \S+)?")  # with its unit


def severity_order(finding: Finding) -> int:
    """Sort key: motion, then the worst first, and an accepted one after those that are open."""
    if finding.code in MOVES:  # above everything: nothing else means what it says
        return -1
    return 2 * _ORDER.index(finding.severity) + finding.accepted


def finding_kinds(findings: Iterable[Finding]) -> list[list[Finding]]:
    """Findings of one code, severity and acceptance together, the worst first."""
    kinds: dict[tuple[Severity, str, bool], list[Finding]] = {}
    for finding in sorted(findings, key=severity_order):
        kinds.setdefault((finding.severity, finding.code, finding.accepted), []).append(finding)
    return list(kinds.values())


def movement(findings: Iterable[Finding]) -> str | None:
    """The sentence about a log that moves, which comes before all others; None for one at rest."""
    if not any(f.code in MOVES for f in findings):
        return None
    return "The unit moved during this log. Only its quiet parts show the noise of the sensor."


def findings_headline(findings: Iterable[Finding]) -> tuple[str, str]:
    """Whether a record is sound: the tone, and a sentence such as "2 warnings: stuck, spikes."."""
    kinds = [members[0] for members in finding_kinds(findings)]
    if accepted := [f.code for f in kinds if f.accepted]:
        return "fatal", f"Accepted despite {', '.join(accepted)}."
    for severity, tone, word in (
        (Severity.FATAL, "fatal", "fatal finding"),
        (Severity.WARNING, "warning", "warning"),
    ):
        if codes := [f.code for f in kinds if f.severity is severity]:
            return tone, f"{plural(len(codes), word)}: {', '.join(codes)}."
    return "good", "No problems found."


def finding_line(members: Sequence[Finding], width: int) -> str:
    """Findings of one kind in one line: code, channels, and as much of the message as fits, in whole clauses.

    Where the channels differ in what is found, the words are those of one, which is named.
    """
    names = [f.channel for f in members if f.channel is not None]
    most = max(members, key=lambda f: f.count)
    who = ", ".join(names) if len(names) <= _NAMED else f"{len(names)} channels"
    if len({own_words(f) for f in members}) > 1 and most.channel is not None:
        who += f", e.g. {most.channel}" if len(names) > _NAMED else f"; {most.channel}"
    who = f"{who}: " if names else ""
    first, *clauses = re.split(r"(?<=[:;,]) ", own_words(most))
    line = f"{members[0].code}: {who}{first}"
    for clause in clauses:
        if len(line) + len(clause) > width:
            break
        line += f" {clause}"
    return line.rstrip(":;,")


def said_of(findings: Sequence[Finding]) -> list[str]:
    """What findings of one kind say, once: the channels of which it is said alike together, with the numbers of one."""
    alike: dict[str, list[Finding]] = {}
    for finding in findings:
        alike.setdefault(_NUMBER.sub("#", own_words(finding)), []).append(finding)
    return [_of_alike(members) for members in alike.values()]


def _of_alike(members: Sequence[Finding]) -> str:
    names = [f.channel for f in members if f.channel is not None]
    most = max(members, key=lambda f: f.count)
    words = own_words(most)
    if not names:
        return words
    if len({own_words(f) for f in members}) == 1:
        return f"{listed(names)}: {words}"
    return f"{listed(names)}; {most.channel}: {words}"


def own_words(finding: Finding) -> str:
    """The message without its channel."""
    return finding.message.removeprefix(f"{finding.channel}: ")


def worst(findings: Iterable[Finding]) -> Finding | None:
    """The worst finding, or None; mere information is not a worst finding."""
    serious = [f for f in findings if f.severity is not Severity.INFO]
    return min(serious, key=severity_order, default=None)
