# SPDX-License-Identifier: BSD-3-Clause
"""What noise in motion says: its inflation by term and by band, its lines, and what a filter is to be told."""

from __future__ import annotations

from collections.abc import Iterator

from allanite.noise import NoiseModel
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, number, probability
from allanite.quantities.quantity import interval_words
from allanite.stability.in_motion import ChannelInMotion, InMotion, words
from allanite.stability.in_motion.lines import MotionLine
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Page, PageBlock, References, Text, table
from allanite.views.result_page import advice, findings_of, pictures, result_page, verdict_banner

__all__ = ["band_rows", "line_rows", "view"]

_METHOD = (
    "Each density is divided by that of the model at rest as the log would show it. The ratio of two levels is "
    "F-distributed for Gaussian noise; lines are left out of it. If the eight parts of a log in motion scatter more "
    "than those of one steady log in a thousand, the interval is that of their scatter. N in motion is the density "
    "weighted by 1/f², as integration to an angle or a velocity weights it. A verdict is wrong for 5 % of logs without "
    "inflation."
)
_REFERENCES = (
    (
        "F. E. Satterthwaite, “An approximate distribution of estimates of variance components”, Biometrics Bull. 2 "
        "(1946) 110."
    ),
)
_PICTURES = {
    "inflation": "Root density in motion over that at rest, with intervals, lines left out.",
    "spectra": "Root of the two-sided density at rest and in motion, with intervals.",
}


def view(document: ResultDocument[InMotion]) -> Page:
    """The page of noise in motion."""
    result = document.result
    return result_page(
        document,
        title=result.rest.name or "Noise in motion",
        kicker="Noise in motion",
        facts=[
            ("At rest", duration(result.rest.duration)),
            ("In motion", ", ".join(f"{log.name} ({duration(log.duration)})" for log in result.logs)),
            ("Noise", f"{number(result.above)} to {number(result.below)} Hz"),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "told": ("What to tell a filter", [*_told(result)]),
            "bands": ("Bands", [*_bands(result), *pictures(result, _PICTURES)]),
            "lines": ("Lines", [*_lines(result)]),
            "findings": ("Findings", findings_of(document)),
            "method": ("Method", [Text(_METHOD), References(_REFERENCES)]),
        },
    )


def _verdict(result: InMotion) -> Iterator[PageBlock]:
    names = [c.name for c in result.channels]
    yield verdict_banner(result.verdict, result.reason, names)
    yield from table(
        ("Channel", "In motion", "Inflation of N", "With lines", "Inflation of K", "Chance"),
        [_row(c) for c in result.channels],
        caption=f"In motion over at rest, with {100 * result.confidence:g} % intervals.",
    )
    yield from advice(_remarks(result), [*names, *(log.name for log in result.logs)])


def _remarks(result: InMotion) -> Iterator[str]:
    """What a reader must know besides."""
    yield words.UPPER_LIMIT
    if not result.fixed:
        yield words.moving_sentence(result.above)
    for log in result.logs:
        yield from (f"{log.name}: {fault}" for fault in log.faults)
    several = len(result.logs) > 1
    if unsteady := [f"{c.name} in {c.log}" if several else c.name for c in result.channels if not c.steady]:
        yield words.unsteady_sentence(unsteady)
    for channel in result.channels:
        for comb in channel.combs:
            yield f"{channel.name}: {words.comb_sentence(comb.fundamental, comb.orders)}"
    if any(line.aliases for c in result.channels for line in c.lines if not line.at_rest):
        yield words.MAY_BE_ALIAS


def _row(channel: ChannelInMotion) -> tuple[str, ...]:
    facts = channel.model.in_motion
    return (
        channel.name,
        channel.log,
        str(channel.inflation),
        number(facts.noise) if facts is not None and facts.lines else "the same",
        str(channel.slow) if channel.slow.resolved else "not resolved",
        probability(channel.p),
    )


def _told(result: InMotion) -> Iterator[PageBlock]:
    """Numbers for a filter, and why."""
    kinds = {c.name: (c.kind, c.unit) for c in result.channels}
    models = result.models
    yield from table(
        ("Channel", "N", "B", "K"),
        [
            (name, *(_parameter(model, s, *kinds[name]) for s in ("N", "B", "K")))
            for name, model in models.items()
        ],
        caption="Continuous densities. imu.yaml takes N and K in SI units: allanite export kalibr.",
    )
    reasons = {m.in_motion: name for name, m in models.items() if m.in_motion is not None}
    for facts, name in reasons.items():
        yield Text(f"{name}: {'; '.join(facts.reasons)}.", note=True)


def _parameter(model: NoiseModel, symbol: str, kind: str, unit: str) -> str:
    """A parameter with its interval, its limit, or as a bare number."""
    words, factor = display_unit(kind, symbol, unit)
    estimate = model.estimate(symbol) or (model.estimate("B_equiv") if symbol == "B" else None)
    if estimate is not None:
        value = estimate.value if estimate.supported else None
        return f"{interval_words(value, estimate.lower, estimate.upper, factor)} {words}"
    amplitudes = [getattr(t, symbol) for t in model.terms if symbol in t.symbols]
    return f"{number(amplitudes[0] / factor)} {words}" if amplitudes else "–"


def _bands(result: InMotion) -> Iterator[PageBlock]:
    yield from table(
        ("Channel", "In motion", "Band", "Inflation", "Through the log"),
        [
            (
                channel.name,
                channel.log,
                f"{number(band.lower)} to {number(band.upper)} Hz",
                str(band.inflation),
                "steady" if band.steady else "changes",
            )
            for channel in result.channels
            for band in channel.bands
        ],
        caption="Root density in motion over that at rest, lines left out.",
        brief=False,
    )


def _lines(result: InMotion) -> Iterator[PageBlock]:
    rows = [(c, line) for c in result.channels for line in c.lines]
    yield from table(
        ("Channel", "In motion", "Line", "RMS", "What"),
        [_line(channel, line) for channel, line in rows],
        caption="Lines in motion with 95 % intervals where they are known.",
    )


def _line(channel: ChannelInMotion, line: MotionLine) -> tuple[str, ...]:
    unit, factor = display_unit(channel.kind, "sd", channel.unit)
    return (
        channel.name,
        channel.log,
        f"{number(line.frequency, 4)} Hz",
        f"{interval_words(line.rms.value, line.rms.lower, line.rms.upper, factor)} {unit}",
        _nature(channel, line),
    )


def _nature(channel: ChannelInMotion, line: MotionLine) -> str:
    """What is known of a line."""
    if line.at_rest:
        return "at rest as well"
    parts = ["steady"] if line.steady else []
    if line.comb is not None and line.order is not None:
        of = f"{line.order} × {number(channel.combs[line.comb].fundamental, 4)} Hz"
        parts.append(f"{of}, seen at its alias" if line.folded else of)
    elif line.aliases:
        parts.append(f"may be an alias of {' or '.join(number(f, 4) for f in line.aliases)} Hz")
    return ", ".join(parts) or "new"


def band_rows(result: InMotion) -> Iterator[dict[str, object]]:
    """One row of a table for each band."""
    for channel in result.channels:
        for band in channel.bands:
            yield {
                "channel": channel.name,
                "log": channel.log,
                "lower_hz": f"{band.lower:.6g}",
                "upper_hz": f"{band.upper:.6g}",
                "inflation": f"{band.inflation.value:.6g}",
                "inflation_lower": f"{band.inflation.lower:.6g}",
                "inflation_upper": f"{band.inflation.upper:.6g}",
                "steady": band.steady,
            }


def line_rows(result: InMotion) -> Iterator[dict[str, object]]:
    """One row of a table for each line, in SI."""
    for channel in result.channels:
        for line in channel.lines:
            comb = None if line.comb is None else channel.combs[line.comb]
            yield {
                "channel": channel.name,
                "log": channel.log,
                "frequency_hz": f"{line.frequency:.9g}",
                "rms": f"{line.rms.value:.6g}",
                "rms_lower": f"{line.rms.lower:.6g}",
                "rms_upper": f"{line.rms.upper:.6g}",
                "at_rest": line.at_rest,
                "steady": line.steady,
                "fundamental_hz": "" if comb is None else f"{comb.fundamental:.9g}",
                "order": "" if line.order is None else line.order,
                "folded": line.folded,
            }
