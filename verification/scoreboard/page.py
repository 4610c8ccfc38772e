# SPDX-License-Identifier: BSD-3-Clause
"""docs/scoreboard.md, whole, from the rows of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from verification.scoreboard.accuracy import SYMBOLS
from verification.scoreboard.bars import LAGS
from verification.scoreboard.contenders import INSTALL, present

__all__ = ["write_page"]

Json = dict[str, Any]
NAMES = {"N": "N", "B": "B", "K": "K", "T": "T_b"}

HEAD = """# Scoreboard

The same simulated records, with known truth, analyzed by the common tools and by allanite. Each tool is used in the way
that suits it best, and with the right choice of everything that it leaves to its user (conversion, terms, where to read
the curve). Written by `python -m verification scoreboard` on {date}, root seed
{seed}; every row with its numbers is in [the table](../verification/results/scoreboard.md).

![Parameters over their truth by tool; coverage of the bars of the curve](../verification/results/scoreboard.png)

| tool | version | how it is used |
|---|---|---|
"""

TAIL = """
## Run it yourself

Only this comparison needs the other packages; those that are not installed are left out. The programs of the Robot
Operating System are not run: their published reading rules are rewritten as functions of one record
(`verification/scoreboard/rules.py`), so their speed is not compared.

<!-- skip: twenty minutes, and packages of others -->
```console
$ {install}
$ python -m verification scoreboard
```
"""


def write_page(document: Json, path: Path, *, seed: int, date: str) -> None:
    """Write the page; `document` maps the headings of the run to their rows."""
    lines = [HEAD.format(date=date, seed=seed).rstrip("\n")]
    lines += [f"| {t.name} | {t.version} | {t.how} |" for t in present()]
    lines += _parameters(document["Parameters"])
    lines += _absent(document["Parameters"])
    lines += _bars(document["Bars of the curve"])
    lines += _hardships(document["What records are like"])
    lines += _cost(document["A week at 32 Hz"], document["A billion samples"])
    path.write_text("\n".join(lines) + "\n" + TAIL.format(install=INSTALL), encoding="utf-8")


def _parameters(rows: list[Json]) -> list[str]:
    """Median ratio and its spread; the share that was answered and the coverage where there are bars."""
    lines = [
        "",
        "## Parameters",
        "",
        "Estimate over truth: median, in brackets the 10th and 90th percentile. *holds*: share of the 68 % and of the",
        "95 % bars that contain the truth, for tools that give or allow a bar; all others print a number without one.",
        "A dash: the tool has no such answer. B of a Gauss-Markov term is the flicker with the same highest deviation.",
    ]
    for scenario in dict.fromkeys(r["scenario"] for r in rows):
        here = [r for r in rows if r["scenario"] == scenario and "median" in r]
        symbols = [s for s in SYMBOLS if any(r["parameter"] == s for r in here)]
        lines += ["", f"### {scenario[0].upper()}{scenario[1:]}: {here[0]['records']} records", ""]
        lines += [f"| tool | {' | '.join(NAMES[s] for s in symbols)} |", "|---|" + "---|" * len(symbols)]
        for tool in dict.fromkeys(r["tool"] for r in here):
            found = {r["parameter"]: r for r in here if r["tool"] == tool}
            lines.append(f"| {tool} | {' | '.join(_ratio(found.get(s)) for s in symbols)} |")
    return lines


def _ratio(row: Json | None) -> str:
    if row is None:
        return "–"
    if row["median"] is None:
        return "never a value"
    text = f"{_short(row['median'])} [{_short(row['p10'])}, {_short(row['p90'])}]"
    holds = [row["68 % bar holds"], row["95 % bar holds"]]
    if holds[0] is not None:
        text += f"; holds {holds[0]:.0%}, {holds[1]:.0%}"
    return text if row["answered"] == 1 else f"{text}; a value in {row['answered']:.0%}"


def _short(x: float) -> str:
    return f"{x:.3f}" if abs(x - 1) < 0.02 else f"{x:.2f}"


def _absent(rows: list[Json]) -> list[str]:
    lines = [
        "",
        "## Terms that are not there",
        "",
        "Share of records in which a tool reports the absent term, at a size that makes more than a hundredth of",
        "the Allan variance at a tenth of the record.",
        "",
    ]
    gone = [r for r in rows if "stated" in r]
    columns = list(dict.fromkeys((r["scenario"], r["parameter"]) for r in gone))
    lines += [
        f"| tool | {' | '.join(f'{p} in {s}' for s, p in columns)} |",
        "|---|" + "---|" * len(columns),
    ]
    for tool in dict.fromkeys(r["tool"] for r in gone):
        found = {(r["scenario"], r["parameter"]): f"{r['stated']:.0%}" for r in gone if r["tool"] == tool}
        lines.append(f"| {tool} | {' | '.join(found.get(c, '–') for c in columns)} |")
    return lines


def _bars(rows: list[Json]) -> list[str]:
    records = rows[0]["records"] if rows else 0
    lines = [
        "",
        "## Error bars of the deviation",
        "",
        f"Share of {records} records of 1024 samples whose 68 % bar holds the true deviation at m samples, and whose",
        "95 % bar does. avar and allan-variance give none.",
        "",
        f"| noise | bar | {' | '.join(f'm = {m}' for m in LAGS)} |",
        "|---|---|" + "---|" * len(LAGS),
    ]
    for r in rows:
        cells = [f"{r[f'68 %, m = {m}']:.0%}, {r[f'95 %, m = {m}']:.0%}" for m in LAGS]
        lines.append(f"| {r['noise']} | {r['bar']} | {' | '.join(cells)} |")
    return lines


def _hardships(rows: list[Json]) -> list[str]:
    tools = [key for key in rows[0] if key != "record"]
    lines = [
        "",
        "## Damaged records",
        "",
        "Records of 200 000 samples of white noise and random walk, damaged and passed on as is: the largest error",
        "of the deviation at m = 1, 10, 100, 1000 and 10 000, over that of the undamaged record. With missing samples",
        "part of this error is random, since fewer windows remain. Closed up: the gaps are cut out before the tool",
        "gets the record, so no tool can detect them. With scattered missing samples allanite's curve has no long",
        'stretch to average: it ends early instead of bending, and the fit of the record (`method="likelihood"`)',
        "still works.",
        "",
        f"| record | {' | '.join(tools)} |",
        "|---|" + "---|" * len(tools),
    ]
    return lines + [f"| {r['record']} | {' | '.join(r[t] for t in tools)} |" for r in rows]


def _cost(week: list[Json], billion: list[Json]) -> list[str]:
    lines = [
        "",
        "## Cost",
        "",
        f"{_thousands(week[0]['samples'])} samples (a week at 32 Hz has 19 353 600), 100 log-spaced lags to a tenth of",
        "the record, duplicates dropped; each in a separate process, best of two rounds. Memory: the most that the",
        "process allocates, over the size of the samples.",
        "",
        "| tool | lags | seconds | memory / samples |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {r['tool']} | {r['lags']} | {r['seconds']:.2f} | {r['memory_over_samples']:.1f} |"
        if r["lags"]
        else f"| {r['tool']} | | failed | |"
        for r in week
    ]
    lines += [
        "",
        f"{_thousands(billion[0]['samples'])} float32 samples in a file that is mapped (2.5 V, 1 mV of white noise),",
        "octave lags; the process may allocate 16 GiB.",
        "",
        "| tool | outcome | seconds | memory allocated, GiB | largest error at short lags |",
        "|---|---|---|---|---|",
    ]
    for r in billion:
        numbers = (
            ("", "")
            if r["memory_GiB"] is None
            else (f"{r['memory_GiB']:.2f}", f"{r['largest_error_at_short_lags']:.2%}")
        )
        lines.append(f"| {r['tool']} | {r['outcome']} | {r['seconds']:.0f} | {numbers[0]} | {numbers[1]} |")
    return lines


def _thousands(n: int) -> str:
    return f"{n:,}".replace(",", " ")
