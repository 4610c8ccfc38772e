# SPDX-License-Identifier: BSD-3-Clause
"""Noise that the families of the fits do not hold: what is called supported all the same, and is it warned of?

Twelve kinds of noise beside or in place of white noise, three lengths each, drawn by `verification.simulators`. A
term is *false* where the record holds none such: true are white noise and, where there are some, Gauss-Markov terms.
Flicker that is shown beside a Gauss-Markov term, undecided, is not false beside a true one. A record is *warned of*
where the fit says that its model does not explain the data, that lags are left out, that a discrepancy is held, or
what else explains the record as well; fits of samples and studies also where they find fault with these. A row
passes if no more than `FALSE` of its records hold a false term unwarned, or at least `WARNED` are warned of; and if N
is covered, or warned of, in at least `COVERED`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.fitting import fit
from allanite.noise import NoiseModel
from allanite.noise.allan import allan_curve
from allanite.recording.health.finding import Severity
from allanite.recording.records import Recording
from allanite.study.characterization import characterize
from verification.simulators import gauss_markov, power_law, telegraph
from verification.spread import Say, place_of, spread

__all__ = ["LENGTHS", "METHODS", "WRONG", "WrongModel", "run_wrong_models", "symbols_of"]

Json = dict[str, Any]
Samples = NDArray[np.float64]
Draw = Callable[[np.random.Generator, int], Samples]

LENGTHS = (7_200, 28_800, 115_200)
METHODS = ("study", "curve", "samples")
#: The 99.9 % point of 5 % of 300 records; the share that a warning must reach instead; and that of N.
FALSE, WARNED, COVERED = 0.09, 0.95, 0.93
_OF_MARKOV = {"sigma", "T", "B_equiv", "sigma_2", "T_2", "B_equiv_2"}
_UNIT = 1e-4  # rad/s: of a sensor that nothing but its noise is remarkable of
_DOUBTFUL = 0.01  # p below which a verdict says that the model does not explain the data


@dataclass(frozen=True, slots=True, kw_only=True)
class WrongModel:
    """One kind of noise at a unit interval; `markov`, `line`: Gauss-Markov terms, or a line, are part of it."""

    name: str
    draw: Draw
    N: float = 1.0
    markov: bool = False
    line: bool = False


def _beside_white(*parts: Draw) -> Draw:
    return lambda rng, n: sum((part(rng, n) for part in parts), start=rng.standard_normal(n))


def _markov(sigma: float, T: float) -> Draw:
    return lambda rng, n: gauss_markov(rng, n, sigma, T)


def _power(slope: float, corner: float) -> Draw:
    """As strong as the white noise at a frequency of 1 / corner."""
    return lambda rng, n: power_law(rng, n, corner**-slope, slope)


def _line(rng: np.random.Generator, n: int) -> Samples:
    phase = rng.uniform(0, 2 * np.pi)
    return np.asarray(0.3 * np.sin(2 * np.pi * 0.497 * np.arange(n) + phase))


def _day(rng: np.random.Generator, n: int) -> Samples:
    phase = rng.uniform(0, 2 * np.pi)
    return np.asarray(0.1 * np.sin(2 * np.pi * np.arange(n) / (6 * LENGTHS[1]) + phase))


def _student(rng: np.random.Generator, n: int) -> Samples:
    return np.asarray(rng.standard_t(4, n) / np.sqrt(2.0))


def _swinging(rng: np.random.Generator, n: int) -> Samples:
    return np.asarray((1 + 0.5 * np.sin(6 * np.pi * np.arange(n) / n)) * rng.standard_normal(n))


WRONG: tuple[WrongModel, ...] = (
    WrongModel(
        name="Gauss-Markov of 60 and 1200",
        draw=_beside_white(_markov(0.3, 60.0), _markov(0.15, 1200.0)),
        markov=True,
    ),
    WrongModel(name="f^-1.3", draw=_beside_white(_power(1.3, 200.0))),
    WrongModel(name="Gauss-Markov of 6", draw=_beside_white(_markov(0.5, 6.0)), markov=True),
    WrongModel(
        name="Gauss-Markov of 32, below the white noise",
        draw=_beside_white(_markov(0.088, 32.0)),
        markov=True,
    ),
    WrongModel(name="line aliased to 0.497 of the rate", draw=_beside_white(_line), line=True),
    WrongModel(name="Student, 4 degrees of freedom", draw=_student),
    WrongModel(name="sine of six times 28 800", draw=_beside_white(_day)),
    WrongModel(
        name="Gauss-Markov of 10, 100 and 1000",
        draw=_beside_white(_markov(0.5, 10.0), _markov(0.25, 100.0), _markov(0.12, 1000.0)),
        markov=True,
    ),
    WrongModel(name="f^-0.7", draw=_beside_white(_power(0.7, 200.0))),
    WrongModel(
        name="telegraph, dwells of 300",
        draw=_beside_white(lambda rng, n: telegraph(rng, n, 0.3, 300.0)),
        markov=True,
    ),
    WrongModel(name="white, of a spread that swings by half", draw=_swinging, N=float(np.sqrt(1.125))),
    WrongModel(
        name="warm-up over a fifth of the record",
        draw=_beside_white(lambda _, n: 0.3 * np.exp(-5 * np.arange(n) / n)),
    ),
)


def _one(root: int, method: str, case: int, n: int, i: int) -> Json:
    truth = WRONG[case]
    rng = np.random.default_rng([root, 61, case, n, i])
    record = Recording.from_rate(_UNIT * truth.draw(rng, n), rate=1.0, unit="rad/s", names=["x"])
    model, findings = _fitted(record, method)
    return {
        "false": sorted(_false(model, truth)),
        "N": all(_holds(m, _UNIT * truth.N) for m in model.families),
        "warned": findings or _warned(model),
    }


def _fitted(record: Recording, method: str) -> tuple[NoiseModel, bool]:
    """The model, and whether the samples were found fault with: only a study looks."""
    if method != "study":
        return fit(allan_curve(record, threads=1)["x"]) if method == "curve" else fit(record), False
    study = characterize(record, threads=1)
    return study.models["x"], any(f.severity is not Severity.INFO for f in study.findings)


def _false(model: NoiseModel, truth: WrongModel) -> set[str]:
    """Symbols of the terms that are called supported and are not there."""
    named = {e.symbol for m in model.families for e in m.estimates if e.supported}
    named -= symbols_of(truth, undecided=len(model.families) > 1)
    return named - {s for s in _OF_MARKOV if not s.startswith("sigma")}


def symbols_of(truth: WrongModel, *, undecided: bool) -> set[str]:
    """Of the terms that a model of such a noise may hold; flicker where it stands beside a Gauss-Markov term."""
    markov = _OF_MARKOV | ({"B"} if undecided else set()) if truth.markov else set()
    return {"N"} | markov | ({"amplitude", "frequency"} if truth.line else set())


def _holds(model: NoiseModel, N: float) -> bool:
    return any(e.symbol == "N" and (e.lower or 0.0) <= N <= (e.upper or np.inf) for e in model.estimates)


def _warned(model: NoiseModel) -> bool:
    facts = model.goodness
    doubts = facts["p"] < _DOUBTFUL or facts.get("discrepancy") or facts.get("left_out")
    # By `fit`: what the samples hold beside noise, and what a curve hides.
    told = {"findings", "unseen", "slow_time", "drift_span", "slope_lower"}
    return bool(doubts or told & set(facts))


def run_wrong_models(
    root: int,
    say: Say,
    records: int,
    workers: int,
    cache: Path | None = None,
    methods: tuple[str, ...] = METHODS,
) -> dict[str, list[Json]]:
    """Every kind of noise at every length, by every method."""
    return {
        f"By the {method}": [
            _row(root, say, records, workers, cache, method, case, n)
            for case in range(len(WRONG))
            for n in LENGTHS
        ]
        for method in methods
    }


def _row(
    root: int, say: Say, records: int, workers: int, cache: Path | None, method: str, case: int, n: int
) -> Json:
    name = WRONG[case].name
    place = place_of(cache, "wrong-models", method, name, n)
    results = spread(partial(_one, root, method, case, n), range(records), workers=workers, place=place)
    letters = Counter(letter for r in results for letter in r["false"])
    unwarned = sum(bool(r["false"]) and not r["warned"] for r in results) / records
    warned = sum(r["warned"] for r in results) / records
    covered = sum(r["N"] or r["warned"] for r in results) / records
    row = {
        "noise": name,
        "samples": n,
        "records": records,
        "false terms": " ".join(f"{k} {v / records:.2f}" for k, v in sorted(letters.items())) or "none",
        "false, unwarned": unwarned,
        "warned": warned,
        "N covered or warned": covered,
        "passes": bool((unwarned <= FALSE or warned >= WARNED) and covered >= COVERED),
    }
    say(f"{method} {row}")
    return row
