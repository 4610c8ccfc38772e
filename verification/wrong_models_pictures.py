# SPDX-License-Identifier: BSD-3-Clause
"""The pictures of docs/explanation/when-the-model-is-wrong.md: eight kinds of noise that no family holds.

    python -m verification.wrong_models_pictures NOW.json           fit the records
    python -m verification.wrong_models_pictures NOW.json --draw    and draw them beside those of BEFORE

What was said before was written by the same lines with the package of 2026-11-24 (commit d3c4231).
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import allanite as al
from verification.wrong_models import WRONG, symbols_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw", "fitted"]

Json = dict[str, Any]

SEED, RECORDS = 20261126, 24
HERE = Path(__file__).parent
BEFORE = HERE / "results" / "wrong_models_before.json"
IMAGES = HERE.parent / "docs" / "images"
BLUE, RED, GREY = "#1f5a96", "#c0392b", "#777777"
_TOLD = {"findings", "unseen", "slow_time", "drift_span", "slope_lower", "rivals"}


@dataclass(frozen=True, slots=True)
class Row:
    """A kind of noise of the battery, with the way in which it is fitted."""

    picture: str
    noise: str  # its name in the battery
    samples: int
    rate: float
    way: str


ROWS = (
    Row("two-gauss-markov", "Gauss-Markov of 60 and 1200", 28_800, 2.0, "samples"),
    Row("power-law", "f^-1.3", 28_800, 1.0, "curve"),
    Row("quick-gauss-markov", "Gauss-Markov of 6", 28_800, 1.0, "curve"),
    Row("hidden-gauss-markov", "Gauss-Markov of 32, below the white noise", 115_200, 400.0, "curve"),
    Row("aliased-line", "line aliased to 0.497 of the rate", 28_800, 1.0, "samples"),
    Row("student", "Student, 4 degrees of freedom", 28_800, 1.0, "samples"),
    Row("slow-sine", "sine of six times 28 800", 115_200, 1.0, "samples"),
    Row("three-gauss-markov", "Gauss-Markov of 10, 100 and 1000", 28_800, 1.0, "select"),
)
_WAYS: dict[str, Callable[[al.Recording], Any]] = {
    "samples": lambda record: al.fit(record),
    "curve": lambda record: al.fit(al.allan_curve(record)["x"]),
    "select": lambda record: _selected(record),
}


def _selected(record: al.Recording) -> Any:
    """The best set; "rivals" where its terms are said to be open, flicker beside a Gauss-Markov term among them."""
    found = al.select(record)
    told = not found.sure or "further Gauss-Markov terms" in found.verdict
    facts = {**found.model.goodness, **({"rivals": len(found.rivals)} if told else {})}
    return replace(found.model, goodness=facts)


def fitted(row: Row) -> Json:
    """What is said of the records of a row, and the curves of the first."""
    case = next(i for i, truth in enumerate(WRONG) if truth.name == row.noise)
    said, squares, first = [], [], None
    for i in range(RECORDS):
        rng = np.random.default_rng([SEED, case, i])
        # White noise of 1 in sample units is 1/sqrt(rate) in those of N.
        y = WRONG[case].draw(rng, row.samples)
        record = al.Recording.from_rate(y, rate=row.rate, unit="rad/s", names=["x"])
        model = _WAYS[row.way](record)
        curve = al.allan_curve(record)["x"]
        squares.append(curve.variance[:, 0])
        first = model if first is None else first
        said.append([_estimates(m) | {"facts": _facts(m)} for m in model.families])
    assert first is not None
    lines = [np.sqrt(sum(t.avar(curve.tau) for t in m.terms)).tolist() for m in first.families if m.terms]
    return {
        "tau": curve.tau.tolist(),
        "first": np.sqrt(squares[0]).tolist(),
        "mean": np.sqrt(np.mean(squares, axis=0)).tolist(),
        "models": lines,
        "said": said,
        "verdict": first.verdict,
    }


def _estimates(model: Any) -> Json:
    return {
        "supported": [e.symbol for e in model.estimates if e.supported],
        "N": next(([e.lower, e.upper] for e in model.estimates if e.symbol == "N"), [0.0, None]),
    }


def _facts(model: Any) -> list[str]:
    facts = model.goodness
    doubts = [k for k in ("discrepancy", "left_out") if facts.get(k)]
    return sorted({*doubts, *(_TOLD & set(facts)), *(["p"] if facts.get("p", 1.0) < 0.01 else [])})


# -- drawing ------------------------------------------------------------------------------------------------


def draw(before: Json, now: Json, folder: Path) -> None:
    """One picture per row: the same record, what was said before and what is said now."""
    from matplotlib.figure import Figure

    for row in ROWS:
        figure = Figure(figsize=(8.6, 3.4), layout="constrained")
        left, right = figure.subplots(1, 2, sharex=True, sharey=True)
        _panel(left, row, before[row.picture], "before")
        _panel(right, row, now[row.picture], "now")
        left.set_ylabel("Allan deviation [white noise of one sample = 1]", fontsize=8)
        figure.savefig(folder / f"wrong-{row.picture}.png", dpi=110, metadata={"Software": None})


def _panel(axes: Axes, row: Row, data: Json, when: str) -> None:
    tau = np.array(data["tau"])
    axes.loglog(tau, data["mean"], color=GREY, lw=4, alpha=0.35, label=f"mean of {RECORDS} records")
    axes.loglog(tau, data["first"], ".", color="0.2", ms=4, label="one record")
    for k, line in enumerate(data["models"]):
        axes.loglog(tau, line, color=BLUE, lw=1.3, ls="-" if k == 0 else "--", label="" if k else "its model")
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8)
    axes.grid(color="0.92", lw=0.7)
    axes.set_axisbelow(True)
    axes.set_xlabel("averaging time [s]", fontsize=8)
    false, silent, held = _counts(row, data)
    axes.set_title(
        f"{when}: a false term in {false} of {RECORDS}, without a word in {silent};\nN held or warned of in {held}",
        fontsize=8.5,
        color=RED if silent > 0.1 * RECORDS or held < 0.9 * RECORDS else "0.15",
    )
    axes.legend(fontsize=7, frameon=False)


def _counts(row: Row, data: Json) -> tuple[int, int, int]:
    """Records with a term that is not there, those of them without a warning, and those whose N is held or doubted."""
    truth = next(t for t in WRONG if t.name == row.noise)
    N = truth.N / np.sqrt(row.rate)
    false = silent = held = 0
    for families in data["said"]:
        true = symbols_of(truth, undecided=len(families) > 1) | {"B_equiv", "T", "B_equiv_2", "T_2"}
        wrong = bool({s for m in families for s in m["supported"]} - true)
        warned = any(m["facts"] for m in families)
        inside = all(
            (m["N"][0] or 0.0) <= N <= (np.inf if m["N"][1] is None else m["N"][1]) for m in families
        )
        false, silent, held = false + wrong, silent + (wrong and not warned), held + (inside or warned)
    return false, silent, held


def main(arguments: list[str]) -> None:
    """Fit or draw."""
    place = Path(arguments[0])
    if not place.exists():
        place.write_text(json.dumps({row.picture: fitted(row) for row in ROWS}) + "\n", encoding="utf-8")
    if "--draw" in arguments:
        before, now = (json.loads(p.read_text(encoding="utf-8")) for p in (BEFORE, place))
        draw(before, now, IMAGES)


if __name__ == "__main__":
    main(sys.argv[1:])
