# SPDX-License-Identifier: BSD-3-Clause
"""Effects of the environment in people's words: coefficients, lag, branches, warm-up, and what was removed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from allanite.plain_files.counted import listed
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, interval, number, probability
from allanite.views.wording.rates import model_words, sentence

if TYPE_CHECKING:
    from allanite.stability.environment.results import EnvironmentFacts, Hysteresis, Lag, WarmUp

__all__ = [
    "coefficient_lines",
    "effect_lines",
    "environment_facts",
    "environment_sentences",
    "temperature_unit",
]

#: Averaging times at which a table tells what was removed, at most.
_ROWS = 6


def temperature_unit(estimate: EnvironmentFacts) -> str:
    """What the coefficients are per: a kelvin, a volt, or the unit of a column that is neither."""
    thermometer = estimate.thermometer
    return "K" if thermometer is None else thermometer.si or "unit"


def _per(estimate: EnvironmentFacts, name: str) -> tuple[str, float]:
    """People's unit of a coefficient, and what one of it is in SI."""
    unit, factor = display_unit(estimate.kind, "adev", estimate.unit)
    one = temperature_unit(estimate)
    return {
        "temperature": (f"{unit}/{one}", factor),
        "temperature squared": (f"{unit}/{one}²", factor),
        "rate of temperature": (f"{unit}/({one}/min)", 60 * factor),
    }[name]


def coefficient_lines(estimate: EnvironmentFacts) -> list[tuple[str, str, str, str]]:
    """Name, value with its interval and unit, status, chance of each coefficient."""
    rows = []
    for c in estimate.coefficients:
        unit, factor = _per(estimate, c.name)
        if c.value is None or c.lower is None or c.upper is None:
            rows.append((c.name, "–", c.status, c.note))
            continue
        middle, low, high = interval(c.value / factor, c.lower / factor, c.upper / factor)
        words = f"{middle} [{low}, {high}] {unit}"
        if c.status != "resolved" and c.limit is not None:
            words = f"< {number(c.limit / factor, 2)} {unit} [{low}, {high}]"
        rows.append((c.name, words, c.status, c.note or probability(c.p)))
    return rows


def environment_facts(estimate: EnvironmentFacts) -> list[tuple[str, str]]:
    """Thermometer, lag, hysteresis, warm-up, noise."""
    facts = []
    thermometer = estimate.thermometer
    if thermometer is not None:
        unit = thermometer.unit or "units"
        span = f"{thermometer.low:.4g} to {thermometer.high:.4g} {unit}"
        smooth = f"smoothed over {duration(thermometer.window)}"
        facts.append(("temperature", f"{thermometer.channel}, {span}; {smooth}"))
        facts.append(("coefficients at", f"{estimate.reference:.4g} {unit}"))
    if estimate.lag is not None:
        facts.append(("lag", _lag_words(estimate.lag)))
    if estimate.hysteresis is not None:
        facts.append(("hysteresis", _hysteresis_words(estimate, estimate.hysteresis)))
    facts.append(("warm-up", _warm_up_words(estimate)))
    source = "given" if estimate.model_given else "fitted beside the effects"
    facts.append(("noise of the regression", f"{model_words(estimate.model)} ({source})"))
    return facts


def _lag_words(lag: Lag) -> str:
    if lag.value is None or lag.lower is None or lag.upper is None:
        return f"not resolved: {lag.says}"
    middle, low, high = interval(lag.value, lag.lower, lag.upper)
    return f"{middle} s [{low}, {high}]: {lag.says}"


def _hysteresis_words(estimate: EnvironmentFacts, branch: Hysteresis) -> str:
    if branch.gap is None or branch.lower is None or branch.upper is None:
        return f"not tested: {branch.says}"
    unit, factor = display_unit(estimate.kind, "adev", estimate.unit)
    middle, low, high = interval(*(end / factor for end in (branch.gap, branch.lower, branch.upper)))
    return f"{middle} [{low}, {high}] {unit} between the branches ({probability(branch.p)}): {branch.says}"


def _warm_up_words(estimate: EnvironmentFacts) -> str:
    warm = estimate.warm_up
    if not warm.found:
        chance = "" if warm.p is None else f" ({_chance(warm)})"
        return f"{warm.says}{chance}"
    unit, factor = display_unit(estimate.kind, "adev", estimate.unit)
    parts = []
    for term in warm.terms:
        size, sd = term.amplitude / factor, term.amplitude_sd / factor
        middle, _, _ = interval(size, size - sd, size + sd)
        constant, _, _ = interval(term.T, term.T - term.T_sd, term.T + term.T_sd)
        parts.append(f"{middle} ± {number(sd, 2)} {unit} with {constant} ± {number(term.T_sd, 2)} s")
    done = {
        "modelled": "modeled and removed",
        "cut": f"cut: the first {duration(warm.cut or 0.0)} are not used",
        "left in": "left in the record",
    }[warm.action]
    return f"{' and '.join(parts)} ({_chance(warm)}); {done}"


def _chance(warm: WarmUp) -> str:
    tries = warm.tries
    return probability(warm.p) + (f", multiplied by {tries} time constants tried" if tries > 1 else "")


def effect_lines(estimate: EnvironmentFacts) -> list[tuple[str, str, str, str, str]]:
    """By averaging time: deviation before, of what was removed, its error, share of the curve, noise left."""
    correction = estimate.correction
    if correction is None:
        return []
    unit, factor = display_unit(estimate.kind, "adev", estimate.unit)
    columns = (correction.tau, correction.before, correction.deviation, correction.error, correction.share,
               correction.left)  # fmt: skip
    rows = list(zip(*(column.tolist() for column in columns), strict=True))
    step = max(1, -(-len(rows) // _ROWS))
    return [
        (
            duration(tau),
            f"{number(before / factor, 3)} {unit}",
            f"{number(off / factor, 3)} ± {number(error / factor, 2)} {unit}",
            f"{number(100 * share, 3)} %",
            f"{number(100 * left, 3)} %",
        )
        for tau, before, off, error, share, left in rows[::-1][::step][::-1]
    ]


def environment_sentences(estimates: Iterable[EnvironmentFacts | None]) -> list[str]:
    """What a study has to say before its numbers: whose noise they are."""
    return [f"{estimate.channel}: {_summary(estimate)}" for estimate in estimates if estimate is not None]


def _summary(estimate: EnvironmentFacts) -> str:
    words = []
    taken = [n for n in estimate.taken_off if not n.endswith("time constant")]
    if taken:
        words.append(f"the noise model is that of the residual, without {listed(taken)}")
    else:
        words.append("nothing was removed")
    if taken and estimate.correction is not None:
        share, tau = max(
            zip(estimate.correction.share.tolist(), estimate.correction.tau.tolist(), strict=True)
        )
        words.append(f"together {100 * share:.0f} % of the Allan variance at {duration(tau)}")
    first = next(iter(estimate.coefficients), None)
    if first is not None:
        name, value, status, note = coefficient_lines(estimate)[0]
        resolved = status == "resolved"
        words.append(
            f"{name} {value}" + ("" if resolved else f", {status}" + (f": {note}" if first.note else ""))
        )
    warm = estimate.warm_up
    if warm.found and warm.action != "modelled":
        words.append(f"warm-up {_warm_up_words(estimate)}")
    return sentence("; ".join([*words, *estimate.advice]))
