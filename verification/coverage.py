# SPDX-License-Identifier: BSD-3-Clause
"""Coverage of the 95 % sets, false declarations and efficiency, over many simulated records.

Every record counts, supported or not. Where the truth is zero, or smaller than three of the bounds of its record, a set
is one-sided and only its lower gate applies: see `verification.gates`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from allanite.noise import NoiseModel
from verification.gates import at_least, within
from verification.scenarios import Scenario

__all__ = ["ROOT_SEED", "evaluate", "printed", "printed_set", "relative_rms", "share_covered"]

Json = dict[str, Any]
ROOT_SEED = 20261121


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


def evaluate(scenario: Scenario, results: list[list[Json]]) -> Json:
    """Coverage of every parameter, declarations of absent terms, and efficiency, by what each record's fit prints."""
    truth, bounds = scenario.truth(), scenario.bounds()
    rows = []
    for symbol, value in truth.items():
        sets = [printed_set(r, symbol) for r in results]
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
        "given": "terms" if scenario.terms else "",
        "parameters": rows,
        "false": _false(scenario, results, truth),
        "undecided": float(np.mean([len(r) == 2 for r in results])),
        "goodness_below_0.01": float(np.mean([r[0]["p"] < 0.01 for r in results])),
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


def _false(scenario: Scenario, results: list[list[Json]], truth: dict[str, float]) -> dict[str, float]:
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


def _primary(printed: list[Json], symbol: str) -> bool:
    estimate = printed[0]["estimates"].get(symbol)
    return bool(estimate is not None and estimate[3])


def _only(printed: list[Json], family: str) -> bool:
    if len(printed) != 1 or printed[0]["family"] != family:
        return False
    slot = "B" if family == "flicker" else "B_equiv"
    shown = printed[0]["estimates"].get(slot)  # a bandwidth has no equivalent flicker
    return shown is not None and bool(shown[3])
