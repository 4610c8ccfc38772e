# SPDX-License-Identifier: BSD-3-Clause
"""The pictures of docs/explanation/what-the-data-can-tell.md."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw"]

Json = dict[str, Any]

BLUE, RED, GREEN, ORANGE, GREY = "#1f5a96", "#c0392b", "#2e7d4f", "#c77400", "#777777"
COLOURS = (BLUE, ORANGE, RED)
SIZE = (8.6, 3.5)


def draw(document: Json, series: Json, folder: Path) -> None:
    """Write the four pictures."""
    pictures = {
        "circular-reference": _circular(document, series),
        "bound": _bound(document),
        "reading-the-minimum": _reading(document, series["curves"]),
        "one-in-twenty": _one_in_twenty(document, series["intervals"]),
    }
    for name, figure in pictures.items():
        figure.savefig(folder / f"{name}.png", dpi=130, metadata={"Software": None})


def _figure(columns: int, width_ratios: tuple[float, ...] | None = None) -> tuple[Figure, list[Axes]]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE, layout="constrained")
    made = figure.subplots(1, columns, width_ratios=width_ratios)
    axes = list(np.atleast_1d(made))
    for one in axes:
        one.spines[["top", "right"]].set_visible(False)
        one.tick_params(labelsize=8)
        one.grid(color="0.92", lw=0.7)
        one.set_axisbelow(True)
    return figure, axes


def _circular(document: Json, series: Json) -> Figure:
    """Cumulative means of one record with three references, both readings."""
    figure, axes = _figure(2)
    earth = document["earth_rate_deg_s"]
    for colour, (reference, (plain, none, signed)) in zip(COLOURS, series["circular"].items(), strict=True):
        label = f"reference {reference:+.6f}".replace("-", "−")
        for one in axes:
            one.axhline(reference, color=colour, lw=0.8, ls=":")
        axes[0].semilogx(*plain, color=colour, lw=1.4, label=label)
        axes[0].semilogx(*none, color=colour, lw=0.9, ls=(0, (4, 2)))
        axes[1].semilogx(*signed, color=colour, lw=1.4)
    told = next(iter(series["circular"]))
    course = series["scatter"]
    for one, reading in zip(axes, ("unsigned", "demodulated"), strict=True):
        sd = told * course[reading]
        one.fill_between(course["time"], told - sd, told + sd, color=BLUE, alpha=0.13, lw=0)
    axes[0].fill_between([], [], [], color=BLUE, alpha=0.13, lw=0, label="±1 sd of many records")
    axes[0].plot([], [], color="0.3", lw=0.9, ls=(0, (4, 2)), label="without the Earth's rotation")
    axes[0].plot([], [], color="0.3", lw=0.8, ls=":", label="reference")
    axes[1].text(6800, earth + 0.0012, "Earth", fontsize=8, ha="right", color="0.2")
    axes[0].set_title("unsigned: the reference, and noise", fontsize=9)
    axes[1].set_title("demodulated: first the reference, then the sensor", fontsize=9)
    for one in axes:
        one.axvspan(30, 60, color="0.5", alpha=0.15, lw=0)
        one.set_xlabel("time", fontsize=8.5)
        one.set_xticks([5, 30, 60, 300, 1500, 7200], ["5 s", "30 s", "1 min", "5 min", "25 min", "2 h"])
        one.minorticks_off()
        one.set_xlim(4, 7200)
        one.set_ylim(-0.012, 0.018)
    axes[0].set_ylabel("cumulative mean of the corrected rate [deg/s]", fontsize=8.5)
    axes[0].legend(fontsize=7, frameon=False, ncols=2, loc="upper right")
    return figure


def _bound(document: Json) -> Figure:
    """The bound against the length of the record, and the published takes with it."""
    figure, axes = _figure(2, (1.15, 1.0))
    left, right = axes
    length = np.array([_minutes(r["length"]) for r in document["bound"]])
    looks = {"published": (BLUE, "-", "noise as published"), "flicker": (ORANGE, "-", "true 1/f flicker"),
             "white": (GREY, "--", "white noise alone")}  # fmt: skip
    for name, (colour, style, label) in looks.items():
        percent = [100 * r[name] for r in document["bound"]]
        left.loglog(length, percent, style, color=colour, lw=1.4, marker="o", ms=3.5, label=label)
    left.axvspan(0.5, 1.0, color=RED, alpha=0.12, lw=0)
    left.text(1.08, 2.75, "“converged in 30 to 60 s”", fontsize=7.5, color=RED, ha="left", va="bottom")
    left.set_xticks([0.5, 1, 12, 25, 60, 120], ["0.5", "1", "12", "25", "60", "120"])
    left.set_yticks([3, 5, 10, 20, 50], ["3", "5", "10", "20", "50"])
    left.minorticks_off()
    left.set_xlim(0.45, 150)
    left.set_ylim(2.5, 70)
    left.set_xlabel("length of the record [min]", fontsize=8.5)
    left.set_ylabel("best possible sd(Ω)/Ω [%]", fontsize=8.5)
    left.legend(fontsize=7.5, frameon=False)
    rows = sorted(document["takes"]["rows"], key=lambda r: r["take"])
    right.axhline(document["earth_rate_deg_s"], color="0.2", lw=0.9)
    for i, r in enumerate(rows):
        right.errorbar(i, r["published"], yerr=1.96 * r["sd"], color=BLUE, fmt="o", ms=5, capsize=4, lw=1.4)
        beside = (i + 0.13, r["published"]) if i < 4 else (i - 0.13, r["published"])
        right.text(*beside, f"{r['off']:.1f} sd", fontsize=8, ha="left" if i < 4 else "right", va="center")
    right.text(4.45, document["earth_rate_deg_s"] + 0.00012, "Earth", fontsize=8, ha="right", color="0.2")
    right.set_xticks(range(len(rows)), [_take_name(r) for r in rows], fontsize=7.5)
    right.set_xlim(-0.5, 4.5)
    right.set_ylabel("published Ω [deg/s]", fontsize=8.5)
    right.set_title("bars: ±1.96 of the best possible sd", fontsize=9)
    return figure


def _reading(document: Json, curves: dict[str, Any]) -> Figure:
    """The curve of the published model with its minimum, and the errors of both readings."""
    figure, axes = _figure(2, (1.2, 1.0))
    left, right = axes
    for name in [n for n in curves if n.startswith("part")]:
        left.loglog(*curves[name], color="0.75", lw=0.9)
    for name, colour, label in (("published", BLUE, "Gauss-Markov"), ("flicker", ORANGE, "true flicker")):
        tau, deviation = curves[name]
        left.loglog(tau, deviation, color=colour, lw=1.6, label=f"published values, {label}")
        at = document["minimum"][name]["tau"]
        y = float(np.interp(at, tau, deviation))
        left.plot(at, y, "v", color=colour, ms=6)
        side = -13 if name == "published" else 6
        left.annotate(
            f"{at:.0f} s",
            (at, y),
            (0, side),
            textcoords="offset points",
            ha="center",
            fontsize=8,
            color=colour,
        )
    expected = document["minimum"]["expected"]
    left.axvline(expected, color=RED, lw=0.9, ls="--")
    left.text(expected * 1.1, 0.006, f"1.89 T_b = {expected:.0f} s", fontsize=8, color=RED)
    left.set_xlim(1, 2e4)
    left.set_ylim(4e-4, 2e-2)
    left.set_xlabel("τ [s]", fontsize=8.5)
    left.set_ylabel("Allan deviation [deg/s]", fontsize=8.5)
    left.legend(fontsize=7.5, frameon=False, loc="upper right")
    _errors(right, document["slopes"])
    return figure


def _errors(axes: Axes, found: Json) -> None:
    spread = np.random.default_rng(0)
    names = ("T_b", "B", "K")
    for i, name in enumerate(names):
        axes.bar(
            i + 0.17, 400 * found[name]["bound"], 0.26, -200 * found[name]["bound"], color=GREEN, alpha=0.22, lw=0,
            label="±2 of the best possible sd" if i == 0 else None,
        )  # fmt: skip
        for j, (how, colour, label) in enumerate(
            (("slopes", RED, "read off the slopes"), ("fit", GREEN, "fitted"))
        ):
            errors = 100 * np.array(found[name][how]["errors"])
            x = i - 0.17 + 0.34 * j + spread.uniform(-0.07, 0.07, len(errors))
            axes.plot(x, errors, "o", color=colour, ms=2.8, alpha=0.75, label=label if i == 0 else None)
    axes.axhline(0, color="0.2", lw=0.9)
    axes.set_xticks(range(3), names)
    axes.set_ylim(-100, 60)
    axes.set_ylabel("error [%]", fontsize=8.5)
    axes.set_title(f"{found['weeks']} simulated weeks", fontsize=9)
    axes.legend(fontsize=7.5, frameon=False, loc="lower right")


def _one_in_twenty(document: Json, intervals: Any) -> Figure:
    """Intervals of records with nothing wrong."""
    figure, axes = _figure(1)
    one, truth = axes[0], document["earth_rate_deg_s"]
    for i, (rate, low, high) in enumerate(intervals):
        colour = BLUE if low <= truth <= high else RED
        one.plot([i, i], [low, high], color=colour, lw=1.3)
        one.plot(i, rate, "o", color=colour, ms=2.2)
    missed = sum(not low <= truth <= high for _, low, high in intervals)
    one.axhline(truth, color="0.2", lw=0.9)
    one.set_xlim(-1, len(intervals))
    one.set_xlabel("record, 25 min each, nothing wrong", fontsize=8.5)
    one.set_ylabel("Ω with its 95 % interval [deg/s]", fontsize=8.5)
    one.set_title(f"{missed} of {len(intervals)} intervals exclude the truth; 5 are expected", fontsize=9)
    return figure


def _minutes(length: str) -> float:
    number, unit = length.split()
    return float(number) / (60 if unit == "s" else 1)


def _take_name(row: Json) -> str:
    name = "take 4,\nlast 13 min" if "last" in row["take"] else f"take {row['take']}"
    return name if "last" in row["take"] else f"{name}\n{row['length'] / 60:g} min"
