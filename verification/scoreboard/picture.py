# SPDX-License-Identifier: BSD-3-Clause
"""results/scoreboard.png: how far off every tool is, and which bars hold."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from verification.scoreboard.accuracy import SYMBOLS
from verification.scoreboard.bars import LAGS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw"]

Json = dict[str, Any]
COLOURS = ("#1f5a96", "#c77400", "#2e7d4f", "#7b4ea3", "#c0392b")
TITLES = {"N": "white noise N", "B": "flicker B", "K": "random walk K", "T": "correlation time T_b"}
#: Ratios beyond are drawn at the edge, as arrows.
EDGE = (0.1, 10.0)


def draw(document: Json, path: Path) -> None:
    """Write the picture."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.5, 8.2), layout="constrained")
    places: Any = figure.subfigures(2, 1, height_ratios=[1.55, 1.0])
    upper, lower = places
    _ratios(upper, document["Parameters"])
    _bars(lower, document["Bars of the curve"])
    figure.savefig(path, dpi=120, metadata={"Software": None})


def _ratios(place: Any, rows: list[Json]) -> None:
    """One panel for each parameter; a row for each tool, a mark and a spread for each scenario."""
    rows = [r for r in rows if r.get("median") is not None]
    tools = list(dict.fromkeys(r["tool"] for r in rows))[::-1]
    scenarios = list(dict.fromkeys(r["scenario"] for r in rows))
    axes = place.subplots(1, len(SYMBOLS), sharey=True)
    place.suptitle("estimate over truth: median, and 10th to 90th percentile over the records", fontsize=10)
    for one, symbol in zip(axes, SYMBOLS, strict=True):
        _plain(one)
        one.axvline(1.0, color="0.35", lw=0.9)
        one.set_xscale("log")
        for r in rows:
            if r["parameter"] == symbol:
                k = scenarios.index(r["scenario"])
                y = tools.index(r["tool"]) + 0.3 - 0.15 * k
                _mark(one, r, y, COLOURS[k % len(COLOURS)])
        wide = (0.5, 2.5) if symbol == "N" else EDGE
        one.set_xlim(*wide)
        ticks = [t for t in (0.1, 0.2, 0.5, 1, 2, 5, 10) if wide[0] <= t <= wide[1]]
        one.set_xticks(ticks, [f"{t:g}" for t in ticks])
        one.minorticks_off()
        one.set_title(TITLES[symbol], fontsize=9)
        one.set_ylim(-0.6, len(tools) - 0.4)
    axes[0].set_yticks(range(len(tools)), tools)
    for k, name in enumerate(scenarios):
        axes[0].plot([], [], "o-", ms=4, color=COLOURS[k % len(COLOURS)], label=name)
    place.legend(
        *axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize=8, frameon=False
    )


def _mark(one: Axes, r: Json, y: float, colour: str) -> None:
    low, middle, high = (float(np.clip(r[k], *EDGE)) for k in ("p10", "median", "p90"))
    beyond = ">" if r["median"] > EDGE[1] else "<" if r["median"] < EDGE[0] else "o"
    one.plot([low, high], [y, y], color=colour, lw=1.6, alpha=0.55, solid_capstyle="butt")
    one.plot([middle], [y], beyond, ms=4, color=colour, clip_on=False)


def _bars(place: Any, rows: list[Json]) -> None:
    """Coverage of the 95 % bar of the deviation, by lag."""
    noises = list(dict.fromkeys(r["noise"] for r in rows))
    axes = place.subplots(1, max(len(noises), 1), sharey=True)
    place.suptitle("error bars of the deviation, 1024 samples: coverage of the 95 % bars", fontsize=10)
    kinds = list(dict.fromkeys(r["bar"] for r in rows))
    colours = dict(zip(kinds, ("#c0392b", "#c77400", "#7fa8d1", "#1f5a96"), strict=False))
    for one, noise in zip(np.atleast_1d(axes), noises, strict=True):
        _plain(one)
        one.axhline(0.95, color="0.35", lw=0.9)
        for r in rows:
            if r["noise"] == noise:
                share = [r[f"95 %, m = {m}"] for m in LAGS]
                aside = np.array(LAGS) * 1.08 ** (kinds.index(r["bar"]) - 1.5)  # equal ones stay visible
                one.semilogx(aside, share, "o-", ms=4, lw=1.2, color=colours[r["bar"]], label=r["bar"])
        one.set_xticks(LAGS, [str(m) for m in LAGS])
        one.minorticks_off()
        one.set_ylim(0, 1.03)
        one.set_yticks([0, 0.25, 0.5, 0.75, 0.95], ["0", "25 %", "50 %", "75 %", "95 %"])
        one.set_title(noise, fontsize=9)
        one.set_xlabel("lag [samples]", fontsize=8.5)
    handles = np.atleast_1d(axes)[0].get_legend_handles_labels()
    place.legend(*handles, loc="outside lower center", ncols=4, fontsize=8, frameon=False)


def _plain(one: Axes) -> None:
    one.spines[["top", "right"]].set_visible(False)
    one.tick_params(labelsize=8)
    one.grid(color="0.92", lw=0.7)
    one.set_axisbelow(True)
