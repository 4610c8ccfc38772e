# SPDX-License-Identifier: BSD-3-Clause
"""The same simulated records through every contender: how far off is each parameter, and do its error bars hold?"""

from __future__ import annotations

import contextlib
import io
import json
import math
import warnings
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

import allanite as al
from allanite.noise import FLICKER_FLOOR
from verification.scenarios import SCENARIOS, Scenario
from verification.scoreboard.contenders import LEVELS, Answer, Question, Tool, present

__all__ = ["COUNTS", "SYMBOLS", "run_accuracy"]

Json = dict[str, Any]
Say = Callable[[str], None]

SYMBOLS = ("N", "B", "K", "T")
#: Records of each scenario in a full run.
COUNTS = {
    "white": 80,
    "white + walk": 80,
    "white + flicker + walk, long": 80,
    "white + Gauss-Markov": 80,
    "seed's sensor, 24 h": 60,
}


def question(scenario: Scenario, seed: int, number: int) -> Question:
    """Three axes of one sensor, simulated."""
    index = SCENARIOS.index(scenario)
    states = np.random.SeedSequence([seed, 5, index, number]).generate_state(3, np.uint64)
    axes = [
        al.simulate(scenario.model, rate=scenario.rate, duration=scenario.duration, seed=int(s)).values(
            "gyro"
        )
        for s in states
    ]
    terms = frozenset(symbol for symbol, value in scenario.truth().items() if value)
    return Question(axes=np.stack(axes), rate=scenario.rate, terms=terms)


def _one(job: tuple[int, int, int]) -> Json:
    """Every tool's answer on one record."""
    seed, index, number = job
    asked = question(SCENARIOS[index], seed, number)
    answers: Json = {}
    for tool in present():
        try:
            with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
                warnings.simplefilter("ignore")
                found = tool.ask(asked)
        except Exception as failure:  # noqa: BLE001 (what a contender raises is a result)
            answers[tool.name] = {"failure": f"{type(failure).__name__}: {failure}"}
            continue
        answers[tool.name] = {symbol: _plain(answer) for symbol, answer in found.items()}
    return {"index": number, "answers": answers}


def _plain(answer: Answer) -> Json:
    return {
        "value": answer.value,
        "bars": [list(answer.intervals[level]) if level in answer.intervals else None for level in LEVELS],
    }


def run_accuracy(count: Callable[[int], int], seed: int, say: Say, workers: int, folder: Path) -> list[Json]:
    """One row for each scenario, parameter and tool; finished records are kept in `folder`."""
    rows = []
    for name, full in COUNTS.items():
        scenario = next(s for s in SCENARIOS if s.name == name)
        done = _records(scenario, count(full), seed, workers, folder)
        rows += evaluate(scenario, done, present())
        say(f"scoreboard, {name}: {len(done)} records{_failures(done)}")
    return rows


def _failures(records: list[Json]) -> str:
    """Who failed, how often and with what, in words for whoever watches."""
    failed: dict[str, list[str]] = {}
    for record in records:
        for tool, answer in record["answers"].items():
            if "failure" in answer:
                failed.setdefault(tool, []).append(answer["failure"])
    return "".join(f"; {tool} failed on {len(texts)}: {texts[0][:100]}" for tool, texts in failed.items())


def _records(scenario: Scenario, records: int, seed: int, workers: int, folder: Path) -> list[Json]:
    index = SCENARIOS.index(scenario)
    path = folder / f"scoreboard-{index}.jsonl"
    done = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    names = {tool.name for tool in present()}
    # another set of contenders, or one that failed: once more
    done = [
        d
        for d in done
        if set(d["answers"]) == names and not any("failure" in a for a in d["answers"].values())
    ]
    todo = [(seed, index, i) for i in range(records) if i not in {d["index"] for d in done}]
    with ProcessPoolExecutor(workers) as pool, path.open("a") as out:
        for result in pool.map(_one, todo):
            out.write(json.dumps(result) + "\n")
            done.append(result)
    return sorted(done, key=lambda d: d["index"])[:records]


def evaluate(scenario: Scenario, records: list[Json], tools: list[Tool]) -> list[Json]:
    """Bias, error and coverage of every parameter by every tool; where the truth is zero, false declarations."""
    truth = scenario.truth()
    true = {
        "N": truth["N"],
        "B": truth.get("B", truth.get("B_equiv", 0.0)),
        "K": truth["K"],
        "T": truth.get("T", 0.0),
    }
    rows = []
    for symbol in SYMBOLS:
        if symbol == "T" and not true["T"]:
            continue
        for tool in tools:
            answers = [r["answers"][tool.name].get(symbol) for r in records]
            if any(answers):
                row = (
                    _present(answers, true[symbol])
                    if true[symbol]
                    else _absent(answers, _negligible(scenario, symbol))
                )
                rows.append({"scenario": scenario.name, "parameter": symbol, "tool": tool.name, **row})
    return rows


def _present(answers: list[Json | None], truth: float) -> Json:
    """A parameter that is there. Ratios are of the records that were answered; the others count in the rms as zero."""
    ratios = np.array([a["value"] / truth for a in answers if a and a["value"] is not None])
    every = np.concatenate([ratios, np.zeros(len(answers) - len(ratios))])
    quantiles = np.quantile(ratios, [0.1, 0.5, 0.9]).tolist() if len(ratios) else [None] * 3
    return {
        "records": len(answers),
        "answered": len(ratios) / len(answers),
        "median": quantiles[1],
        "p10": quantiles[0],
        "p90": quantiles[2],
        "rms": float(np.sqrt(np.mean((every - 1) ** 2))),
        **_covers(answers, truth),
    }


def _negligible(scenario: Scenario, symbol: str) -> float:
    """The parameter that makes one hundredth of the true Allan variance at a tenth of the record."""
    tau = scenario.duration / 10
    unit = {"B": FLICKER_FLOOR**2, "K": tau / 3}[symbol]
    return math.sqrt(0.01 * float(scenario.model.avar(tau)) / unit)


def _absent(answers: list[Json | None], negligible: float) -> Json:
    """A parameter that is not there: how often is it stated all the same?"""
    values = np.array([a["value"] if a and a["value"] else 0.0 for a in answers])
    return {
        "records": len(answers),
        "stated": float(np.mean(values > negligible)),
        "median_value": float(np.median(values)),
        **_covers(answers, 0.0),
    }


def _covers(answers: list[Json | None], truth: float) -> Json:
    return {
        f"{round(100 * level)} % bar holds": _coverage(answers, i, truth) for i, level in enumerate(LEVELS)
    }


def _coverage(answers: list[Json | None], level: int, truth: float) -> float | None:
    """Share of records whose interval holds the truth; None where the tool gives none."""
    bars = [a["bars"][level] for a in answers if a]
    if not any(bars):
        return None
    return float(np.mean([bool(b) and b[0] <= truth <= (math.inf if b[1] is None else b[1]) for b in bars]))
