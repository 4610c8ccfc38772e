# SPDX-License-Identifier: BSD-3-Clause
"""docs/proof.md out of the committed results: what is claimed, what was measured, what fails."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from textwrap import wrap
from typing import Any

from verification.hand_held_calibration import SCATTER_OF_TURNS
from verification.tables import is_verdict

__all__ = ["draw", "proof_page"]

Json = Mapping[str, Any]

RESULTS = Path(__file__).parent / "results"
#: Runs in the order of the page: what each of them claims.
CLAIMS = {
    "curves": "68 % intervals of the Allan curve cover the truth in 68 % of records, with and without gaps",
    "statistics": "the same for Theo1, ThêoBR, Haar and the robust variance",
    "likelihood_coverage": "95 % sets of the fit of the samples cover the truth: short, long, gappy, rounded, "
    "disturbed records",
    "coverage": "the same for the fit of the curve",
    "default_fits": "errors of both at most 1.35 (samples) and 1.6 (curve) times the Cramér-Rao bound, or at most 1.1 "
    "times once the terms are given",
    "likelihood": "the same where the terms are given: likelihood at most 1.10, moments 1.25",
    "selection": "the right terms rank first where they are resolvable; absent ones reported in at most 5 %",
    "spectrum": "intervals of a density and of a line",
    "spectral_fits": "95 % sets of the fit of the spectrum; noise reported as different in lag and in frequency in at "
    "most 5 % of records",
    "variation": "constant noise is reported to change in at most 5 % of records; changes are detected, with intervals",
    "held": "a sensor slower than its log: its rate, and N of its values without repeats",
    "contaminated": "contaminated noise (a few percent of samples scatter more): N with and without them; no false "
    "reports",
    "shared_noise": "the noise of each of two or three sensors, without the common part, with intervals",
    "environment": "temperature coefficients and warm-ups; noise reported as warm-up in at most 5 % of records",
    "comparison": "equal noise reported as different in at most 5 % of comparisons",
    "kind_of_sensor": "several sensors compared: center and spread of their kind, and the next sensor",
    "overbound": "a bound is above the true curve everywhere with the stated probability",
    "battery": "rows of the test battery that need many records",
    "wrong_models": "noise of no family: absent terms reported without a warning in at most 9 %, N covered",
    "earth_rate": "the Earth's rate: coverage of its intervals, faults detected",
    "north": "direction and plan, budget against simulation",
    "sensors": "sets at 50, 68, 90, 95 and 99 % of sensors drawn from a prior: terms, sizes, lengths, gaps, rounding",
    "fleet": "population of a fleet, and the units that stand out",
    "fleet_check": "a unit at its limits passes in at most 5 % of records, and fails in at most 5 %",
    "rate_vector": "length of the rate vector of a vehicle at rest",
    "rate_table": "scale factor, nonlinearity and misalignment on a rate table",
    "calibration": "calibration and alignment of a unit, every parameter",
    "hand_held": "calibration of a unit held by hand: coverage and repeatability, or a verdict that withdraws the "
    "numbers",
    "alignment": "alignment against the test battery",
    "position_planning": "a planned calibration reaches the planned uncertainty",
    "redundancy": "combined sensors, faults detected",
    "recording": "no acknowledged sample is lost",
    "findings": "every fault is reported by its name, and by no other",
    "hostile_files": "changed, cut and crafted files: a result or an error, never a crash or bytes of another file",
    "floor": "sensor noise without instrument noise, with intervals",
    "dead_reckoning": "growth of navigation errors within 5 % of strapdown simulations",
    "firmware": "the compiled filter has the states of the Python filter over a day",
}
#: How records of a claim are made and analyzed, where not as a user would.
_AS_A_USER = "as a user"
HOW = {
    "curves": "parts; the true model given",
    "statistics": "parts; the true model given",
    "likelihood_coverage": "as a user, but the terms given in one scenario",
    "default_fits": "as a user, and again with the terms given",
    "likelihood": "parts; the terms given; likelihood by law",
    "spectrum": "parts",
    "spectral_fits": "parts",
    "held": "parts",
    "contaminated": "parts",
    "battery": "parts",
    "fleet": "by law; three rows from samples",
    "fleet_check": "parts",
    "rate_vector": "parts",
    "north": "parts; plan and budget as a user",
    "recording": "a simulated multimeter",
    "firmware": "the exported filter, compiled",
}
_HEAD = """# The proof

No hardware so far: allanite has been tested with simulated records, a simulated multimeter and a simulated IMU,
and with [published recordings](real-recordings.md) and [calibrations](real-units.md) of other people's sensors.

**{claims} claims are tested by {rows} rows, of which {failing} {do} not hold**: see
[below](#what-does-not-hold). Every record counts, whether or not a parameter was reported present. A row holds if it
is within the statistical bounds stated in its table (99.9 % for most), so about one row in a thousand fails by
chance. *Rejects* is the power of the test: true shares that even the weakest row of the claim would reject with 90 %
probability. *How* says how the records were made and analyzed:

* **as a user**: sample by sample, by public functions with their defaults;
* **parts**: by internal functions;
* **by law**: records or profiles drawn from the law that the method assumes. This tests the numerics, not whether
  sensors obey that law.

Not covered: turn-on to turn-on repeatability, aging, vibration and radiation are not simulated, and temperature only
in the rows on temperature coefficients. Noise that no model describes is simulated in the kinds that
[a page of its own](explanation/when-the-model-is-wrong.md) lists, and in no others. No method can tell what
[the data do not contain](explanation/what-the-data-can-tell.md#what-a-tool-can-see-by-itself).

![Rows of each claim, and those that do not hold](../verification/results/proof.png)

`make verify` repeats everything, `python -m verification likelihood --share 0.1` a tenth of one part, from fixed
seeds. This page is made from the results in `verification/results`, and a test compares it with them.

<!-- cards -->
* **[Scoreboard](scoreboard.md)** The same records through other tools.
* **[Real recordings](real-recordings.md)** Published recordings, compared with their data sheets.
* **[Real units](real-units.md)** Published calibrations and headings, repeated from the recordings.

## Claims

<!-- pages -->"""
_SPEED = """## Speed

Each page names its machine; `make bench` measures yours.

<!-- pages -->
* [The jobs that users wait for](../benchmarks/results/jobs.md): time and memory, beside what is wanted and other tools
* [Growth](../benchmarks/results/growth.md): time and memory of the commands by samples, channels and records
* [Allan deviation](../benchmarks/results/allan_speed.md): a week at 32 Hz, beside AllanTools and plain NumPy
* [Kalman filter](../benchmarks/results/kalman_speed.md): a week at 32 Hz, beside statsmodels and FilterPy
* [Table of a fleet](../benchmarks/results/fleet_table.md): 100 000 logs written, and 10 of them again
* [Reading logs](../benchmarks/results/read_speed.md): each format
* [A billion samples](../benchmarks/results/billion_samples.md): from disk, one thread
* [A long series on the page](../benchmarks/results/page_speed.md), and [its bounds](../verification/results/page.md)
* [Decimated engine](../benchmarks/results/decimation_loss.md): the degrees of freedom that it loses
* [Other tools](../verification/results/scoreboard.md): every row of the scoreboard

![Processor time and memory of each command by samples and channels](images/growth.png)"""
#: Gates whose lower end is below this are those of false alarms.
_ALARM = 0.3
#: Columns that hold a row by being zero.
_NONE = (
    "acknowledged_lost",
    "torn",
    "recover_wrong",
    "not_the_exact_prefix",
    "not_recovered",
    "without_an_error",
    "not_in_order",
    "differ_when_cut",
    "false_gaps",
)


def proof_page() -> str:
    """The text of docs/proof.md."""
    done = {name: _read(name) for name in CLAIMS if (RESULTS / f"{name}.json").exists()}
    judged = {name: list(_judged(document)) for name, document in done.items()}
    failing = [(name, words) for name, rows in judged.items() for words, good in rows if not good]
    counts = {"claims": len(done), "rows": sum(map(len, judged.values())), "failing": len(failing)}
    lines = [
        *_HEAD.format(**counts, do="does" if len(failing) == 1 else "do").splitlines(),
        "| claim | how | records of each row | rejects | rows | hold | run of | table |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, document in done.items():
        rows, records, how = judged[name], _records(document), HOW.get(name, _AS_A_USER)
        held = sum(good for _, good in rows)
        lines.append(
            f"| {CLAIMS[name]} | {how} | {records} | {_power(document)} | {len(rows)} | {held} | {document['date']} | "
            f"[{name.replace('_', ' ')}](../verification/results/{name}.md) |"
        )
    lines += ["", "## What does not hold", ""]
    lines += [f"* {name.replace('_', ' ')}: {words}" for name, words in failing] or ["Every row holds."]
    if "hand_held" in dict(failing):
        lines += ["", *wrap(_wide_in_the_hand(done["hand_held"]), 120)]
    waiting = [name for name in CLAIMS if name not in done]
    if waiting:
        lines += ["", "## Not run in full yet", ""]
        lines += [f"* `python -m verification {name.replace('_', '-')}`: {CLAIMS[name]}" for name in waiting]
    pictures = [
        name
        for name in ("likelihood_coverage", "coverage", "sensors", "scoreboard")
        if (RESULTS / f"{name}.png").exists()
    ]
    for name in pictures:
        lines += ["", f"![{_PICTURES[name]}](../verification/results/{name}.png)"]
    lines += ["", *_SPEED.splitlines()]
    return "\n".join(lines) + "\n"


def draw(path: Path) -> None:
    """The picture at the head of the page: how many rows each claim has, and how many of them do not hold."""
    from matplotlib.figure import Figure

    names = [name for name in CLAIMS if (RESULTS / f"{name}.json").exists()][::-1]
    judged = [[good for _, good in _judged(_read(name))] for name in names]
    holding = [sum(rows) for rows in judged]
    failing = [len(rows) - sum(rows) for rows in judged]
    figure = Figure(figsize=(8, 0.2 * len(names) + 0.8), layout="constrained")
    axes = figure.subplots()
    axes.barh(range(len(names)), holding, color="#9dbbd8", label="hold")
    axes.barh(range(len(names)), failing, left=holding, color="#c0392b", label="do not hold")
    for i, (good, bad) in enumerate(zip(holding, failing, strict=True)):
        axes.text(good + bad + 1, i, f"{bad} of {good + bad}" if bad else f"{good}", va="center", fontsize=7)
    axes.set_yticks(range(len(names)), [name.replace("_", " ") for name in names], fontsize=7)
    axes.set_ylim(-0.6, len(names) - 0.4)
    axes.set_xlabel("rows")
    axes.legend(fontsize=7, frameon=False, loc="center right", bbox_to_anchor=(1.0, 0.65))
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=130, metadata={"Software": None})


def _wide_in_the_hand(document: Json) -> str:
    """Why intervals of a calibration in the hand are wide."""
    found, none = document[SCATTER_OF_TURNS]
    return (
        "Hand held: the intervals of the gyros' misalignments are too wide, not too narrow. What turns scatter beyond "
        "the noise is looked for in every record, few turns tell it, and it cannot come out negative: where some is "
        f"found, in {found['share']:.0%} of the records, the intervals hold in {found['coverage']:.1%}, elsewhere in "
        f"{none['coverage']:.1%}."
    ).replace("%", " %")


_PICTURES = {
    "likelihood_coverage": "Fit of the samples: share of records whose 95 % set holds the truth",
    "coverage": "Fit of the curve: share of records whose 95 % set holds the truth",
    "sensors": "Sensors drawn from a prior: where the truth lies in the sets of a coefficient",
    "scoreboard": "The same records through other tools",
}


def _read(name: str) -> dict[str, Any]:
    found = json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))
    if not isinstance(found, dict):
        raise TypeError(f"{name}.json is not a document of results")
    return found


def _rows(value: Any, words: str = "") -> Iterator[tuple[str, Json]]:
    """Every row of a document with the words that tell it from the others; rows within rows as their own."""
    if isinstance(value, Mapping):
        own = ", ".join(
            str(v) for key, v in value.items() if isinstance(v, str) and v and not key.startswith("rejects")
        )
        within = [v for v in value.values() if isinstance(v, list) and v and isinstance(v[0], Mapping)]
        yield f"{words}: {own}" if words and own else own or words, value
        for inner in within:
            yield from _rows(inner, f"{words}: {own}" if words and own else own or words)
    elif isinstance(value, list):
        for each in value:
            if isinstance(each, Mapping):
                yield from _rows(each, words)


def _judged(document: Json) -> Iterator[tuple[str, bool]]:
    """Words and verdict of every row that has one."""
    for heading, part in document.items():
        if not isinstance(part, (list, Mapping)):
            continue
        for words, row in _rows(part, "" if heading in ("scenarios", "rows") else heading):
            verdicts = [v for key, v in row.items() if is_verdict(key) and isinstance(v, bool)]
            verdicts += [row[key] == 0 for key in _NONE if key in row]
            if verdicts:
                yield words + ("" if all(verdicts) else _way_off(row)), all(verdicts)


def _way_off(row: Json) -> str:
    """On which side a coverage lies outside its gate."""
    if "coverage" not in row or not isinstance(row.get("gate"), list):
        return ""
    share, (low, high) = row["coverage"], row["gate"]
    side = "more" if share > high else "less"
    return (
        f" (covers {side} often than stated: {100 * share:.4g} %, gate {100 * low:.4g} to {100 * high:.4g} %)"
    )


def _power(document: Json) -> str:
    """Of shares that should be large and of false alarms: what the weakest row rejects."""
    gates = [
        (row["gate"], str(row["rejects"]))
        for part in document.values()
        for _, row in _rows(part)
        if isinstance(row.get("gate"), list) and "rejects" in row
    ]
    below = [float(share) for _, words in gates for share in re.findall(r"below ([\d.]+)", words)]
    above = [
        float(share)
        for (low, _), words in gates
        if not low or low < _ALARM
        for share in re.findall(r"above ([\d.]+)", words)
    ]
    words = [f"coverage below {min(below):.3g}"] if below else []
    return "; ".join(words + ([f"alarms above {max(above):.3g}"] if above else []))


def _records(document: Json) -> str:
    """How many records a row has, from the least to the most."""
    counts = [
        row[key]
        for part in document.values()
        for _, row in _rows(part)
        for key in ("records", "twins", "comparisons", "fleets", "runs")
        if isinstance(row.get(key), int) and row[key] > 12  # smaller: how many records a comparison has
    ]
    if not counts:
        return ""
    return str(min(counts)) if min(counts) == max(counts) else f"{min(counts)} to {max(counts)}"
