# SPDX-License-Identifier: BSD-3-Clause
"""Coverage of the 95 % sets, false declarations and efficiency, over many simulated records.

Every record counts, supported or not. Where the truth is zero, or smaller than three of the bounds of its record, a set
is one-sided and only its lower gate applies: see `verification.gates`.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

import allanite as al
from allanite.fitting.likelihood import fit_problem
from allanite.noise import NoiseModel
from verification.gates import at_least, within
from verification.scenarios import HARDER, SCENARIOS, Scenario
from verification.short_chain import FROM, short_chain
from verification.spread import spread

__all__ = ["evaluate", "printed", "printed_set", "relative_rms", "run", "share_covered"]

Json = dict[str, Any]
ROOT_SEED = 20261121


def one(method: str, name: str, index: int) -> Json:
    """Simulate one record of a scenario and fit it."""
    chosen = _named(name)
    number = (*SCENARIOS, *HARDER).index(chosen)
    seed = int(np.random.SeedSequence([ROOT_SEED, number, index]).generate_state(1, np.uint64)[0])
    model = _by_likelihood(chosen, seed) if method == "likelihood" else _by_moments(chosen, seed)
    return {"index": index, "printed": printed(model)}


def printed(model: NoiseModel) -> list[Json]:
    """What a fit prints: its families, the first one first, with the sets of their parameters."""
    return [
        {
            "family": m.family,
            "p": m.goodness["p"],
            "estimates": {e.symbol: [e.value, e.lower, e.upper, e.supported] for e in m.estimates},
        }
        for m in model.families
    ]


def _named(name: str) -> Scenario:
    return next(s for s in (*SCENARIOS, *HARDER) if s.name == name)


def _by_moments(scenario: Scenario, seed: int) -> NoiseModel:
    return al.fit(al.allan_curve(scenario.record(seed), threads=1))


def _by_likelihood(scenario: Scenario, seed: int) -> NoiseModel:
    """The long ones of the seed's sensor by their means over a second: see `short_chain`."""
    if scenario.n_samples > FROM and not scenario.missing:
        return fit_problem(short_chain(scenario, seed))
    return al.fit(scenario.record(seed), lines=scenario.lines, terms=scenario.terms or None)


def _worker(task: tuple[str, str, int]) -> Json:
    return one(*task)


def run(name: str, runs: int, workers: int, folder: Path, method: str = "moments") -> list[Json]:
    """All records of one scenario; those already in `folder` are not simulated again."""
    number = (*SCENARIOS, *HARDER).index(_named(name))
    place = folder / (f"scenario-{number}.jsonl" if method == "moments" else f"{method}-{number}.jsonl")
    tasks = [(method, name, i) for i in range(runs)]
    return spread(_worker, tasks, workers=workers, say=print, place=place)


def evaluate(scenario: Scenario, results: list[Json]) -> Json:
    """Coverage of every parameter, declarations of absent terms, and efficiency."""
    truth, bounds = scenario.truth(), scenario.bounds()
    rows = []
    for symbol, value in truth.items():
        sets = [printed_set(r["printed"], symbol) for r in results]
        weak = not scenario.shows(symbol)
        share = share_covered(sets, value)
        gate = (at_least if weak else within)(len(results))
        rows.append(
            {
                "symbol": symbol,
                "truth": value,
                "bound": bounds.get(symbol),
                "coverage": share,
                "one_sided": weak,
                **gate.columns(),
                "passes": gate.holds(share),
                "supported": float(np.mean([e is not None and e[3] for e in sets])),
                "rms": relative_rms(sets, value),
            }
        )
    return {
        "name": scenario.name,
        "rate": scenario.rate,
        "duration": scenario.duration,
        "records": len(results),
        "given": scenario.given,
        "parameters": rows,
        "false": _false(scenario, results, truth),
        "undecided": float(np.mean([len(r["printed"]) == 2 for r in results])),
        "goodness_below_0.01": float(np.mean([r["printed"][0]["p"] < 0.01 for r in results])),
    }


def printed_set(families: list[Json], symbol: str) -> list[Any] | None:
    """The set of a parameter in what was printed: of the first family that has it, whichever is the true one."""
    return next((m["estimates"][symbol] for m in families if symbol in m["estimates"]), None)


def share_covered(sets: list[list[Any] | None], truth: float) -> float:
    """Share of sets that hold the truth; one that was not printed does not."""
    return float(
        np.mean([e is not None and e[1] <= truth <= (math.inf if e[2] is None else e[2]) for e in sets])
    )


def relative_rms(sets: list[list[Any] | None], truth: float) -> float | None:
    """Relative root-mean-square error on a linear scale; an unsupported parameter counts as zero."""
    if truth == 0:
        return None
    values = np.array([0.0 if e is None or e[0] is None else e[0] for e in sets])
    return float(np.sqrt(np.mean((values / truth - 1) ** 2)))


def _false(scenario: Scenario, results: list[Json], truth: dict[str, float]) -> dict[str, float]:
    """Share of records in which an absent term is declared."""
    absent = [s for s in ("Q", "K", "R") if truth[s] == 0]
    out = {s: float(np.mean([bool(_primary(r, s)) for r in results])) for s in absent}
    slot = truth.get("B", truth.get("B_equiv", 0.0))
    if slot == 0:
        out["B"] = float(np.mean([bool(_primary(r, "B") or _primary(r, "B_equiv")) for r in results]))
    else:
        wrong = "flicker" if scenario.family == "gauss-markov" else "gauss-markov"
        out[f"{wrong} instead"] = float(np.mean([_only(r, wrong) for r in results]))
    return out


def _primary(result: Json, symbol: str) -> bool:
    estimate = result["printed"][0]["estimates"].get(symbol)
    return bool(estimate is not None and estimate[3])


def _only(result: Json, family: str) -> bool:
    printed = result["printed"]
    if len(printed) != 1 or printed[0]["family"] != family:
        return False
    slot = "B" if family == "flicker" else "B_equiv"
    return bool(printed[0]["estimates"][slot][3])
