# SPDX-License-Identifier: BSD-3-Clause
"""What a record supports, in a sentence: the same words whatever the estimator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from allanite.noise import Estimate, NoiseModel
from allanite.noise.quick_terms import with_quick_terms_white
from allanite.plain_files.counted import listed
from allanite.quantities.number_words import duration

__all__ = [
    "CONTRADICTED",
    "power_law_words",
    "quick_words",
    "stand_in_words",
    "supported_words",
    "with_fact",
    "with_slow_notes",
]

_NAMES = {
    "Q": "quantization",
    "N": "white noise",
    "B": "flicker",
    "sigma": "a Gauss-Markov term",
    "sigma_2": "a second Gauss-Markov term",
    "K": "random walk",
    "R": "ramp",
}
#: Probability of so poor a fit below which a model does not explain its record.
CONTRADICTED = 0.01


def supported_words(models: Sequence[NoiseModel]) -> str:
    """Terms that are supported, those that are needed but not resolved, and whether the family is open.

    Parameters
    ----------
    models : sequence of NoiseModel
        One, or both families where the record cannot decide.
    """
    named = [e for e in models[0].estimates if e.symbol in _NAMES]
    supported = [_NAMES[e.symbol] for e in named if e.supported]
    text = f"the record supports {listed(supported)}." if supported else "the record resolves no single term."
    needed = [_NAMES[e.symbol] for e in named if e.needed]
    if needed:
        text += f" It needs {listed(needed)} or a similar term, but cannot decide which."
    if len(models) == 2:
        text += " It cannot distinguish flicker from a single Gauss-Markov term: both are shown."
    return text


def stand_in_words(facts: Mapping[str, float], seen_in: str = "the record") -> str:
    """What the record allows in the place of its slow terms; empty where it allows nothing else.

    Parameters
    ----------
    facts : mapping
        `goodness` of a model: "slow_time" [s], "drift_span" [s], "slope_lower", "slope_upper" and "slope_better", where
        they are known.
    seen_in : str
        Of what the power laws are said.
    """
    text = ""
    if "slow_time" in facts:
        text += (
            f" A Gauss-Markov term with T above {duration(facts['slow_time'])} explains the record as well as the "
            "random walk; K is then its drive, σ√(2/T)."
        )
    if "drift_span" in facts:
        span = duration(facts["drift_span"])
        text += f" R is the drift over these {span}: an oscillation with a longer period looks the same."
    law = power_law_words(facts)
    if not law:
        return text
    if (
        facts["slope_lower"] <= 1 <= facts["slope_upper"]
        and not facts["slope_better"]
        and "slow_time" not in facts
    ):
        return text + f" The density of its slow noise falls as {law}."
    if facts["slope_better"]:
        return text + (
            f" White noise and a density of {law} explain {seen_in} better than flicker, Gauss-Markov noise and a "
            "random walk do: N, B, T and K describe this curve, not the sensor."
        )
    return text + (
        f" White noise and a density of {law} explain {seen_in} as well: the record does not prove flicker, "
        "Gauss-Markov noise or a random walk."
    )


def quick_words(model: NoiseModel, dt: float) -> str:
    """What Gauss-Markov terms of a few samples mean for N; empty without one."""
    white = with_quick_terms_white(model, dt)
    if white is model:
        return ""
    alone, together = model.estimate("N"), white.estimate("N")
    assert together is not None and together.value is not None  # the term makes it so  # noqa: S101
    words = " At averaging times well above the Gauss-Markov term of a few samples, it looks like white noise"
    if alone is None or not alone.supported or not alone.value:
        return f"{words}."
    return f"{words}: N is {together.value / alone.value:.3g} times larger there."


def power_law_words(facts: Mapping[str, float]) -> str:
    """The power laws that the record allows, as in "f^-0.9 to f^-1.1"; empty where it allows none.

    Beside a model that the record contradicts, to do as well means nothing.
    """
    if "slope_lower" not in facts or (facts.get("p", 1.0) < CONTRADICTED and not facts["slope_better"]):
        return ""
    low, high = facts["slope_lower"], facts["slope_upper"]
    return f"f^-{low:g}" if low == high else f"f^-{low:g} to f^-{high:g}"


def with_slow_notes(estimates: Sequence[Estimate], facts: Mapping[str, float]) -> list[Estimate]:
    """Estimates of which a supported K says what else explains the record as well."""
    notes = (
        [f"drive of slow noise with T above {duration(facts['slow_time'])}"] if "slow_time" in facts else []
    )
    if power_law_words(facts):
        notes.append(f"a density of {power_law_words(facts)} does as well")
    if not notes:
        return list(estimates)
    note = "; ".join([*notes, "a random walk is not excluded"])
    return [replace(e, note=note) if e.symbol == "K" and e.supported else e for e in estimates]


def with_fact(model: NoiseModel, fact: Mapping[str, Any], text: str) -> NoiseModel:
    """The model, with a fact in the `goodness` and a text in the verdict of each of its families."""
    families = [replace(m, goodness={**m.goodness, **fact}, verdict=m.verdict + text) for m in model.families]
    return families[0] if len(families) == 1 else replace(families[0], alternative=families[1])
