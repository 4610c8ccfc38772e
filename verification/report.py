# SPDX-License-Identifier: BSD-3-Clause
"""The committed results of the verification: one table (Markdown and JSON) and one picture."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from verification.gates import within

__all__ = ["write_curves", "write_report"]

Json = dict[str, Any]


def write_report(name: str, title: str, rows: list[Json], folder: Path, *, seed: int, date: str) -> None:
    """Write <name>.json, <name>.md and <name>.png."""
    folder.mkdir(exist_ok=True)
    document = {"date": date, "seed": seed, "scenarios": rows}
    (folder / f"{name}.json").write_text(json.dumps(document, indent=1) + "\n")
    (folder / f"{name}.md").write_text(_table(title, rows, seed, date))
    _picture(rows, folder / f"{name}.png")


def write_curves(rows: list[Json], lags: list[int], folder: Path, *, seed: int, date: str) -> None:
    """Write curves.json and curves.md."""
    folder.mkdir(exist_ok=True)
    document = {"date": date, "seed": seed, "lags": lags, "rows": rows}
    (folder / "curves.json").write_text(json.dumps(document, indent=1) + "\n")
    head = [f"m = {m}" for m in lags]
    lines = [
        "# Coverage of the intervals of the curve",
        "",
        f"{date}, root seed {seed}; `make verify`. Share of records of 1024 samples whose 68.27 % interval holds the",
        "true Allan deviation, with the exact degrees of freedom of the model and of the record's gaps. Empty: no",
        "window is left. *Rejects*: true shares that the row would reject with 90 % probability.",
        "",
        f"| noise | missing | records | {' | '.join(head)} | rejects |",
        "|---|---|---|" + "---|" * (len(head) + 1),
    ]
    for r in rows:
        cells = ["" if c is None else f"{c:.3f}" for c in r["coverage"]]
        fails = "" if r["passes"] else " (fails)"
        named = f"{r['model']}{fails} | {r['missing']} | {r['records']}"
        lines.append(f"| {named} | {' | '.join(cells)} | {r['rejects']} |")
    (folder / "curves.md").write_text("\n".join(lines) + "\n")


def _table(title: str, rows: list[Json], seed: int, date: str) -> str:
    lines = [
        f"# {title}",
        "",
        f"{date}, root seed {seed}; `make verify`. Every record counts, supported or not. *Bound*: relative standard",
        "deviation that the record allows at best. *rms*: relative root-mean-square error of the estimate, linear",
        "scale, an unsupported parameter counted as zero. One-sided (truth zero or below three bounds): only the lower",
        "gate applies. *Rejects*: true shares that the gate rejects with 90 % probability.",
        "",
        "| scenario | record | parameter | truth | bound | coverage | gate | rejects | supported | rms | rms/bound |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        for p in r["parameters"]:
            low, high = p["gate"]
            gate = f"≥ {low:.3f}" if p["one_sided"] else f"{low:.3f} to {high:.3f}"
            ratio = (
                p["rms"] / p["bound"] if p["rms"] is not None and p["bound"] and not p["one_sided"] else None
            )
            lines.append(
                f"| {r['name']} | {_record(r)} | {_name(p['symbol'])} | {_value(p['truth'])} | "
                f"{_percent(p['bound'])} | "
                f"**{p['coverage']:.3f}**{'' if p['passes'] else ' (fails)'} | {gate} | {p['rejects']} | "
                f"{p['supported']:.3f} | "
                f"{_percent(p['rms'])} | {'' if ratio is None else f'{ratio:.2f}'} |"
            )
    lines += [
        "",
        "## Absent terms declared",
        "",
        "| scenario | share of records | both families shown |",
        "|---|---|---|",
    ]
    for r in rows:
        shares = ", ".join(f"{_name(k)} {v:.3f}" for k, v in r["false"].items())
        lines.append(f"| {r['name']} | {shares} | {r['undecided']:.3f} |")
    return "\n".join(lines) + "\n"


def _record(r: Json) -> str:
    hours = r["duration"] / 3600
    span = f"{hours:.0f} h" if hours <= 24 else f"{hours / 24:.0f} d"
    told = f"; {r['given']} given" if r["given"] else ""
    return f"{span} at {r['rate']:g} Hz, {r['records']} records{told}"


def _name(symbol: str) -> str:
    return symbol.replace("T", "T_b")


def _value(x: float) -> str:
    return "0" if x == 0 else f"{x:.4g}"


def _percent(x: float | None) -> str:
    return "" if x is None or not math.isfinite(x) else f"{100 * x:.3g} %"


def _picture(rows: list[Json], path: Path) -> None:
    from matplotlib.figure import Figure

    labels = [(r, p) for r in rows for p in r["parameters"]]
    figure = Figure(figsize=(8, 0.24 * len(labels) + 1.4), layout="constrained")
    axes = figure.subplots()
    axes.axvline(0.95, color="0.4", lw=0.8)
    for i, (r, p) in enumerate(labels):
        gate = within(r["records"])
        axes.barh(-i, gate.high - gate.low, left=gate.low, height=1.0, color="#d5e5f5", zorder=0)
        marker, face = ("^", "white") if p["one_sided"] else ("o", "#1f5a96" if p["passes"] else "#c0392b")
        axes.plot(p["coverage"], -i, marker, color="#1f5a96" if p["passes"] else "#c0392b", mfc=face, ms=5)
    axes.barh(0, 0, color="#d5e5f5", label="99.9 % band of as many records")
    axes.plot([], [], "o", color="#1f5a96", label="two-sided set")
    axes.plot(
        [], [], "^", color="#1f5a96", mfc="white", label="truth zero or below three bounds: at least the band"
    )
    axes.set_yticks(
        [-i for i in range(len(labels))],
        [f"{r['name']}: {_name(p['symbol'])}" for r, p in labels],
        fontsize=7,
    )
    axes.set_xlim(0.88, 1.003)
    axes.set_ylim(-len(labels) + 0.3, 0.7)
    axes.set_xlabel("share of records whose 95 % set contains the truth")
    axes.legend(
        fontsize=7, loc="upper center", bbox_to_anchor=(0.4, 1.0 + 2.2 / len(labels)), ncols=3, frameon=False
    )
    figure.savefig(path, dpi=130)
