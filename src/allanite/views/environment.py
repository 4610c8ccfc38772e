# SPDX-License-Identifier: BSD-3-Clause
"""What the environment does to a sensor: coefficients, lag, branches, warm-up, and what was removed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from allanite.plain_files.counted import listed
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, interval, number, probability, upper_limit
from allanite.stability.environment.results import Environment, EnvironmentFacts, Hysteresis, Lag, WarmUp
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Cell, Page, PageBlock, References, Text, drawn, pairs, table
from allanite.views.result_page import advice, findings_of, result_page, verdict_banner
from allanite.views.wording.rates import model_words, sentence

__all__ = [
    "coefficient_table",
    "effect_table",
    "environment_picture",
    "environment_sentences",
    "known_facts",
    "view",
]

_REFERENCES = (
    "D. A. Harville, “Maximum likelihood approaches to variance component estimation”, JASA 72 (1977) 320.",
    "E. C. Fieller, “Some problems in interval estimation”, J. R. Statist. Soc. B 16 (1954) 175.",
    "M. A. Krasnosel’skii, A. V. Pokrovskii, “Systems with hysteresis”, Springer (1989), chapter 1.",
)
_PICTURE = (
    "The signal against the temperature, with warming and cooling separated; the Allan deviation before "
    "and after; the signal over time."
)
#: Averaging times at which a table tells what was removed, at most.
_ROWS = 6


def view(document: ResultDocument[Environment]) -> Page:
    """The page of the environment of a log."""
    result = document.result
    return result_page(
        document,
        title=(document.provenance.source if document.provenance else "") or "Environment",
        kicker="Effects of the environment",
        facts=[
            ("Channels", ", ".join(c.channel for c in result.channels)),
            ("Length", duration(result.duration)),
        ],
        sections={
            "verdict": ("Verdict", [block for c in result.channels for block in _verdict(c)]),
            "pictures": ("Pictures", [block for c in result.channels for block in environment_picture(c)]),
            "effect": ("What was removed", [block for c in result.channels for block in _effect(c)]),
            "findings": ("Findings", findings_of(document)),
            "method": ("Method", _method()),
        },
    )


def _verdict(estimate: EnvironmentFacts) -> Iterator[PageBlock]:
    names = [estimate.channel]
    yield verdict_banner(estimate.verdict, f"{estimate.channel}: {estimate.reason}", names)
    yield from advice(estimate.advice, names)
    yield from coefficient_table(estimate)
    yield known_facts(estimate)


def _effect(estimate: EnvironmentFacts) -> list[PageBlock]:
    caption = (
        f"{estimate.channel}: Allan deviation of the block means, of the removed signal with one standard "
        "deviation, and the remaining fraction of the noise, by which the curve is corrected."
    )
    return effect_table(estimate, caption)


# -- parts that a study shows, too ------------------------------------------------------------------------


def coefficient_table(estimate: EnvironmentFacts, *, brief: bool = True) -> list[PageBlock]:
    """The coefficients with their intervals."""
    rows = [
        (name, value, status, Cell(text=words) if brief else Cell(text="", below=words))
        for name, value, status, words in _coefficient_lines(estimate)
    ]
    return table(("Bias by", f"{100 * estimate.confidence:g} % interval", "", ""), rows, brief=brief)


def effect_table(estimate: EnvironmentFacts, caption: str = "", *, brief: bool = True) -> list[PageBlock]:
    """What was removed, by averaging time."""
    heads = ("Averaging", "Before", "Removed", "Share of the curve", "Noise left")
    return table(heads, _effect_lines(estimate), caption=caption, brief=brief)


def known_facts(estimate: EnvironmentFacts, *, brief: bool = True) -> PageBlock:
    """Thermometer, lag, hysteresis, warm-up, noise."""
    return pairs(_facts(estimate), brief=brief)


def environment_picture(estimate: EnvironmentFacts) -> list[PageBlock]:
    """The figure of one channel."""
    name = estimate.channel
    return drawn(f"environment-{name}", estimate, f"{name}. {_PICTURE}", _PICTURE)


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
        name, value, status, note = _coefficient_lines(estimate)[0]
        resolved = status == "resolved"
        words.append(
            f"{name} {value}" + ("" if resolved else f", {status}" + (f": {note}" if first.note else ""))
        )
    warm = estimate.warm_up
    if warm.found and warm.action != "modelled":
        words.append(f"warm-up {_warm_up_words(estimate)}")
    return sentence("; ".join([*words, *estimate.advice]))


# -- words ------------------------------------------------------------------------------------------------


def _temperature_unit(estimate: EnvironmentFacts) -> str:
    """What the coefficients are per: a kelvin, a volt, or the unit of a column that is neither."""
    thermometer = estimate.thermometer
    return "K" if thermometer is None else thermometer.si or "unit"


def _per(estimate: EnvironmentFacts, name: str) -> tuple[str, float]:
    """People's unit of a coefficient, and what one of it is in SI."""
    unit, factor = display_unit(estimate.kind, "adev", estimate.unit)
    one = _temperature_unit(estimate)
    return {
        "temperature": (f"{unit}/{one}", factor),
        "temperature squared": (f"{unit}/{one}²", factor),
        "rate of temperature": (f"{unit}/({one}/min)", 60 * factor),
    }[name]


def _coefficient_lines(estimate: EnvironmentFacts) -> list[tuple[str, str, str, str]]:
    """Name, value with its interval and unit, status, chance of each coefficient."""
    rows: list[tuple[str, str, str, str]] = []
    for c in estimate.coefficients:
        unit, factor = _per(estimate, c.name)
        if c.value is None or c.lower is None or c.upper is None:
            rows.append((c.name, "–", c.status, c.note))
            continue
        middle, low, high = interval(c.value / factor, c.lower / factor, c.upper / factor)
        words = f"{middle} [{low}, {high}] {unit}"
        if c.status != "resolved" and c.limit is not None:
            words = f"{upper_limit(c.limit / factor)} {unit} [{low}, {high}]"
        rows.append((c.name, words, c.status, c.note or probability(c.p)))
    return rows


def _facts(estimate: EnvironmentFacts) -> list[tuple[str, str]]:
    """Thermometer, lag, hysteresis, warm-up, noise."""
    facts = []
    thermometer = estimate.thermometer
    if thermometer is not None:
        unit = thermometer.unit or "units"
        span = f"{thermometer.low:.4g} to {thermometer.high:.4g} {unit}"
        smooth = f"smoothed over {duration(thermometer.window)}"
        facts.append(("Temperature", f"{thermometer.channel}, {span}; {smooth}"))
        facts.append(("Coefficients at", f"{estimate.reference:.4g} {unit}"))
    if estimate.lag is not None:
        facts.append(("Lag", _lag_words(estimate.lag)))
    if estimate.hysteresis is not None:
        facts.append(("Hysteresis", _hysteresis_words(estimate, estimate.hysteresis)))
    facts.append(("Warm-up", _warm_up_words(estimate)))
    source = "given" if estimate.model_given else "fitted with the effects"
    facts.append(("Noise of the regression", f"{model_words(estimate.model)} ({source})"))
    return facts


def _lag_words(lag: Lag) -> str:
    if lag.value is None or lag.lower is None or lag.upper is None:
        return f"not resolved: {lag.says}"
    middle, low, high = interval(lag.value, lag.lower, lag.upper)
    return f"{middle} s [{low}, {high}]: {lag.says}"


def _hysteresis_words(estimate: EnvironmentFacts, branch: Hysteresis) -> str:
    if branch.gap is None or branch.lower is None or branch.upper is None:
        return f"not tested: {branch.status.words}"
    unit, factor = display_unit(estimate.kind, "adev", estimate.unit)
    middle, low, high = interval(*(end / factor for end in (branch.gap, branch.lower, branch.upper)))
    return f"{middle} [{low}, {high}] {unit} between the branches ({probability(branch.p)}): {branch.status.words}"


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


def _effect_lines(estimate: EnvironmentFacts) -> list[tuple[str, str, str, str, str]]:
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


# -- method -----------------------------------------------------------------------------------------------


def _method() -> list[PageBlock]:
    return [
        Text(
            "The means of about 1500 blocks are fitted by generalized least squares with a level, a "
            "drift, the temperature, its square, its rate and, if a warm-up is modeled, exponentials in "
            "time. White noise, flicker and random walk are fitted by the restricted likelihood; "
            "intervals are averaged over their uncertainty. All columns contribute to every interval. "
            "Only resolved effects are removed, from every sample, with the temperature smoothed and "
            "interpolated. The drift stays: it may be that of the sensor."
        ),
        Text(
            "A lag of the thermometer and a bias proportional to the rate of temperature share one "
            "column; the lag is their ratio, with Fieller’s interval. Hysteresis is tested together with "
            "the rate, with the play operator as its column. A warm-up is detected if the best of several "
            "exponentials exceeds the noise, allowing for the number of trials."
        ),
        Text(
            "A regression also removes noise that looks like the effect. The covariance of its "
            "coefficients gives the loss, and the Allan variance of the residual is divided by the "
            "remaining fraction. Lags with a loss of more than a quarter do not enter a noise model."
        ),
        References(_REFERENCES),
    ]
