# SPDX-License-Identifier: BSD-3-Clause
"""The committed results of the Earth-rate runs: takes, turns, faults and warm-up, as tables and one picture."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from verification.earth_rate import CALIBRATED, CONFIDENT, EFFICIENT, INVISIBLE

__all__ = ["write_earth"]

Json = dict[str, Any]


def write_earth(parts: dict[str, Any], folder: Path, *, seed: int, date: str) -> None:
    """Write earth_rate.json, earth_rate.md and earth_rate.png."""
    folder.mkdir(exist_ok=True)
    document = {"date": date, "seed": seed, **parts}
    (folder / "earth_rate.json").write_text(json.dumps(document, indent=1) + "\n")
    lines = [*_takes(parts["takes"], seed, date), *_turns(parts["turns"]), *_faults(parts["faults"])]
    (folder / "earth_rate.md").write_text("\n".join([*lines, *_warm_up(parts["warm_up"])]) + "\n")
    _picture(parts["takes"], folder / "earth_rate.png")


def _takes(rows: list[Json], seed: int, date: str) -> list[str]:
    low, high = rows[0]["gate"]
    lines = [
        "# The Earth rate: does its interval hold?",
        "",
        f"{date}, root seed {seed}; `make verify`. {rows[0]['twins']} twins of each take of the seed's bench, each",
        "with its own week at rest, from which its noise model is fitted; the turns are found from the signal. *sd*:",
        "as stated, relative to the Earth's rate. *Bound*: generalised least squares with the true noise of the twin",
        "and the same dwells. All twins count, whatever their verdict.",
        "",
        f"Bars: coverage of the 95 % interval {low:.3f} to {high:.3f} (true coverage {rows[0]['rejects']} is rejected",
        "with 90 % probability), rms error over stated",
        f"sd {CALIBRATED[0]} to {CALIBRATED[1]},",
        f"rms error at most {EFFICIENT} times the bound.",
        "",
        "| noise | dwells | take | sd | coverage | rms/sd | rms/bound | pairs: rms/bound | turns all found | bars |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        lines.append(
            f"| {r['noise']} | {r['dwells']} | {r['length']} | {100 * r['sd']:.1f} % | **{r['coverage']:.3f}** | "
            f"{r['rms_over_sd']:.3f} | {r['rms_over_bound']:.3f} | {r['pairs_rms_over_bound']:.3f} | "
            f"{100 * r['turns_right']:.1f} % | {'hold' if r['passes'] else '**fail**'} |"
        )
    names = sorted({v for r in rows for v in r["verdicts"]})
    lines += ["", "Verdicts, in per cent:", "", f"| noise | dwells | take | {' | '.join(names)} |"]
    lines.append("|---|---|---|" + "---|" * len(names))
    for r in rows:
        cells = [f"{100 * r['verdicts'].get(v, 0) / r['twins']:.1f}" for v in names]
        lines.append(f"| {r['noise']} | {r['dwells']} | {r['length']} | {' | '.join(cells)} |")
    return [*lines, ""]


def _turns(row: Json) -> list[str]:
    return [
        "## Turns",
        "",
        f"{row['takes']} random takes (turns that clip or do not, overloads as missing samples, uneven dwells,",
        f"knocks, residual rotation, turns forgotten and made twice) hold {row['turns']} turns: {row['found']} found",
        f"({100 * row['found'] / row['turns']:.2f} %), {row['false']} false,",
        f"{row['takes_with_wrong_direction']} takes with a wrong direction. Of {row['static']} records at rest,",
        f"with warm-up and knocks, {row['static_without_turns']} show no turn.",
        "",
    ]


def _faults(rows: list[Json]) -> list[str]:
    records, wrong = sum(r["records"] for r in rows), sum(r["wrong"] for r in rows)
    visible = [r for r in rows if r["fault"] not in INVISIBLE]
    own, of = sum(r["wrong_without_earth"] for r in visible), sum(r["records"] for r in visible)
    bar = f"{100 * own / of:.1f} %; bar {100 * CONFIDENT:g} %, {_word(own <= CONFIDENT * of)}"
    lines = [
        "## Faults",
        "",
        f"Of {of} takes with a fault that residuals can show, {own} ({bar}) gave a wrong answer with confidence:",
        "off by more than 3 stated standard deviations, nothing against it but the comparison with the known rate.",
        f'With that comparison there are {wrong} of {records}: "resolved" asks for agreement with the Earth, so it can',
        "hardly be wrong. A bias that follows the turns is an Earth rate to every estimator; it is listed, and no bar",
        "is set for it.",
        "",
        "| fault | takes | confident and wrong | without the known rate | verdicts |",
        "|---|---|---|---|---|",
    ]
    for r in rows:
        verdicts = ", ".join(f"{v} {n}" for v, n in r["verdicts"].items())
        numbers = f"{r['records']} | {r['wrong']} | {r['wrong_without_earth']}"
        lines.append(f"| {r['fault']} | {numbers} | {verdicts} |")
    return [*lines, ""]


def _word(holds: bool) -> str:
    return "holds" if holds else "**fails**"


def _warm_up(rows: list[Json]) -> list[str]:
    sizes = sorted({r["amplitude_deg_s"] for r in rows})
    lines = [
        "## Warm-up",
        "",
        f"Share of takes whose warm-up is named, by amplitude [deg/s] and time constant; {rows[0]['records']} each.",
        "",
        f"| take | time constant | {' | '.join(f'{a:g}' for a in sizes)} | at least 99 % from |",
        "|---|---|" + "---|" * (len(sizes) + 1),
    ]
    for length, T in dict.fromkeys((r["length"], r["time_constant"]) for r in rows):
        own = {
            r["amplitude_deg_s"]: r["named"] for r in rows if (r["length"], r["time_constant"]) == (length, T)
        }
        sure = next((a for a in sizes if all(own[b] >= 0.99 for b in sizes if b >= a)), None)
        cells = " | ".join(f"{100 * own[a]:.1f} %" for a in sizes)
        first = "above the largest tried" if sure is None else f"{sure:g} deg/s"
        lines.append(f"| {length} | {T:g} s | {cells} | {first} |")
    return [*lines, ""]


def _picture(rows: list[Json], path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 0.3 * len(rows) + 1.5), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    bands = (
        (rows[0]["gate"], "share of 95 % intervals that hold the truth"),
        (CALIBRATED, "rms error over stated sd"),
    )
    for ax, (band, label) in zip(axes, bands, strict=True):
        ax.axvspan(*band, color="#d5e5f5", label="bar")
        ax.set_xlabel(label)
    axes[0].axvline(0.95, color="0.4", lw=0.8)
    axes[1].axvline(1.0, color="0.4", lw=0.8)
    for i, r in enumerate(rows):
        colour, marker = ("#0868ac", "o") if r["noise"] == "flicker" else ("#c8442c", "s")
        axes[0].plot(r["coverage"], -i, marker, color=colour)
        axes[1].plot(r["rms_over_sd"], -i, marker, color=colour)
        axes[1].plot(r["pairs_rms_over_bound"], -i, "x", color="0.5")
    axes[1].plot([], [], "x", color="0.5", label="plain pairs: rms error over the bound")
    axes[1].plot([], [], "s", color="#c8442c", label="Gauss-Markov bias")
    axes[1].plot([], [], "o", color="#0868ac", label="flicker")
    axes[1].legend(fontsize=7, frameon=False, loc="upper right")
    names = [f"{r['length']}, dwells {r['dwells']}" for r in rows]
    axes[0].set_yticks([-i for i in range(len(rows))], names, fontsize=7)
    figure.savefig(path, dpi=130)
