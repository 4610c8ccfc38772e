# SPDX-License-Identifier: BSD-3-Clause
"""Every fault against every detector: how often the right cause is said, what else is, and what is wrong of it."""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from allanite.recording.health.catalogue import CATALOGUE, LOOK_ALIKES
from allanite.recording.health.examination import check
from allanite.recording.records import Recording

__all__ = ["look_alikes_page", "run_look_alikes"]

Json = dict[str, Any]

SAMPLES = 4000
RESULTS = Path(__file__).parent / "results" / "findings.json"
TITLE = "Faults of a channel over random parameters"
_HEAD = """# Findings and what looks like them

What may be mistaken for each [finding](findings.md), and what tells the two apart.

| finding | looks like it | told apart by |
| --- | --- | --- |"""
_MEASURED = """
## Measured

Each fault was made {records} times over random parameters ({samples} samples, seed {seed}) and given to every detector.
"named": records in which the finding of the fault is reported; "also reported": other findings, true of the same
record; "wrong": findings that are not true of it. `python -m verification findings` makes the table.

| fault | its finding | named | also reported | wrong |
| --- | --- | --- | --- | --- |"""


def run_look_alikes(
    records: int, seed: int, say: Callable[[str], None] = print, only: str | None = None
) -> list[Json]:
    """One row for each fault: records in which its own code is said, others that are true of it, and wrong ones.

    `only` makes the row of one fault, with the records that it has among all.
    """
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))  # the faults are those of the tests
    from channel_faults import FAULTS

    rows = []
    for i, (name, fault) in enumerate(FAULTS.items()):
        if only is not None and name != only:
            continue
        named, besides, wrong = 0, Counter[str](), Counter[str]()
        for case in range(records):
            samples = fault.make(np.random.default_rng([seed, i, case]), SAMPLES)
            codes = {f.code for f in check(Recording.from_rate(samples, rate=100.0, unit="m/s^2"))}
            named += fault.code in codes or not (fault.code or codes - fault.besides - {"resolution_step"})
            true = fault.besides | {fault.code, "resolution_step"}
            besides.update(codes & (true - {fault.code}))
            wrong.update(codes - true)
        rows.append(
            {
                "fault": name,
                "records": records,
                "finding": fault.code or "none",
                "named": named,
                "also_said": dict(sorted(besides.items())),
                "wrong": dict(sorted(wrong.items())),
                "passes": not wrong and (named == records or not fault.always or bool(besides)),
            }
        )
        say(f"{name}: {named} of {records}, besides {dict(besides)}, wrong {dict(wrong)}")
    return rows


def look_alikes_page() -> str:
    """docs/reference/look-alikes.md: the catalogue's words, and the committed measurement."""
    lines = [_HEAD]
    lines += [f"| `{code}` | {LOOK_ALIKES[code][0]} | {LOOK_ALIKES[code][1]} |" for code in CATALOGUE]
    document = json.loads(RESULTS.read_text(encoding="utf-8"))
    rows = document[TITLE]
    lines.append(_MEASURED.format(records=rows[0]["records"], samples=SAMPLES, seed=document["seed"]))
    for row in rows:
        finding = "none" if row["finding"] == "none" else f"`{row['finding']}`"
        said = [_counts(row[key]) for key in ("also_said", "wrong")]
        lines.append(f"| {row['fault']} | {finding} | {row['named']} | {' | '.join(said)} |")
    return "\n".join(lines) + "\n"


def _counts(said: Json) -> str:
    return ", ".join(f"`{code}` {count}" for code, count in said.items()) or "–"
