# SPDX-License-Identifier: BSD-3-Clause
"""Every finding by its code: how grave it can be, what it means, what accepting it risks, what is done.

`docs/reference/findings.md` is this table in print (`findings_page`); a test keeps the two equal.
"""

from __future__ import annotations

from collections.abc import Iterable

from allanite.recording.health.catalogue.entry import FindingKind
from allanite.recording.health.catalogue.log import LOG
from allanite.recording.health.catalogue.look_alikes import LOOK_ALIKES
from allanite.recording.health.catalogue.samples import SAMPLES
from allanite.recording.health.catalogue.sensor import SENSOR

__all__ = ["CATALOGUE", "LOOK_ALIKES", "MOVES", "FindingKind", "findings_page"]

#: Code -> what it means. The order is the order of the printed table.
CATALOGUE: dict[str, FindingKind] = SAMPLES | LOG | SENSOR

#: Findings of a log that moves: they come before all others, since nothing else then means what it says.
MOVES = ("not_at_rest", "motion")

_HEADINGS = (
    "code",
    "severity",
    "what it means",
    "what accepting it risks",
    "what is done",
    "what to do",
    "repair",
)


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def findings_page() -> str:
    """The catalogue as the reference page ``docs/reference/findings.md``."""
    lines = [
        "# Findings",
        "",
        "Faults that `allanite info` and `allanite characterize` report, and findings about turns (last table).",
        "allanite repairs nothing unless you name the repair (`--repair`, last column): samples are kept, or left out",
        "and reported. A *fatal* finding stops the analysis; `--accept CODE` continues despite it, and the result",
        "reports this. A *warning* means that a result is affected. An *info* is worth knowing. Samples that are left",
        "out keep their place in time: they become gaps.",
        "",
        "False alarms: with simulated white noise, flicker and random walk, fewer than 1 record in 100 has any",
        "finding except `resolution_step` and those about the file.",
        "[Look-alikes](look-alikes.md): what each finding may be mistaken for, and how to distinguish the two.",
    ]
    group = ""
    for code, entry in CATALOGUE.items():
        if entry.group != group:
            group = entry.group
            lines += ["", f"## {group}", "", _row(_HEADINGS), _row(("---",) * len(_HEADINGS))]
        risk = entry.risk or "nothing"
        repair = f"`{entry.repair}`" if entry.repair else "–"
        lines.append(_row((f"`{code}`", entry.severity, entry.means, risk, entry.done, entry.advice, repair)))
    return "\n".join(lines) + "\n"
