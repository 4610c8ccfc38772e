# SPDX-License-Identifier: BSD-3-Clause
"""What a budget of dead reckoning says: errors over time, and what each source makes of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from allanite.experiments.dead_reckoning import DeadReckoning, Source
from allanite.experiments.dead_reckoning.words import time_words
from allanite.quantities.number_words import duration, number, upper_limit
from allanite.quantities.quantity import interval_words
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Hero, Page, PageBlock, References, Text, pairs, table
from allanite.views.result_page import advice, pictures, result_page
from allanite.views.wording.dead_reckoning import BUDGET_QUANTITIES, quantity_words
from allanite.views.wording.rates import DEG, angle, model_words, sentence

__all__ = ["rows", "view"]

#: Less than this part of the whole is nothing: what a rest takes off leaves rounding.
_NOTHING = 1e-6
#: Ends that are so close stand for no interval.
_SAME = 1e-9
#: Less of a variance has no number.
_SMALL_SHARE = 1e-4
_INITIAL = {
    "position": ("m", 1.0),
    "velocity": ("m/s", 1.0),
    "tilt": ("deg", DEG),
    "heading": ("deg", DEG),
    "gyro_bias": ("deg/h", DEG / 3600),
    "accelerometer_bias": ("mg", 9.80665e-3),
    "gyro_scale": ("ppm", 1e-6),
    "accelerometer_scale": ("ppm", 1e-6),
    "gyro_misalignment": ("mrad", 1e-3),
    "accelerometer_misalignment": ("mrad", 1e-3),
}
_PICTURES = {
    "position": "position_horizontal",
    "velocity": "velocity_horizontal",
    "height": "position_down",
    "tilt": "tilt",
    "heading": "heading",
}
_METHOD = (
    (
        "Covariance of the linear error model of a level navigator at rest on the rotating ellipsoid, with Schuler and "
        "Foucault oscillations. Each noise term drives it as an exact process, without time steps. Flicker is the sum "
        "of Gauss-Markov states that the filter uses, from one sample to five times the whole length; its constant "
        "level belongs to the turn-on bias. The axes are independent."
    ),
    (
        "Each parameter of a noise model contributes a part of the variance, and its interval gives the ends of that "
        "part; the distances to the ends add with the correlations of the estimates. A term that the record does not "
        "resolve has only an upper limit, and enters the upper end."
    ),
)
_REFERENCES = (
    "D. H. Titterton, J. L. Weston, “Strapdown Inertial Navigation Technology”, 2nd ed., IET (2004).",
    (
        "G. Y. Zou, A. Donner, “Construction of confidence limits about effect measures”, Statistics in Medicine 27 "
        "(2008) 1693."
    ),
)


def view(document: ResultDocument[DeadReckoning]) -> Page:
    """The page of a budget of dead reckoning."""
    result = document.result
    captions = {
        name: f"{BUDGET_QUANTITIES[quantity][0]} error over time: the total and its largest sources."
        for name, quantity in _PICTURES.items()
        if quantity in _quantities(result)
    }
    return result_page(
        document,
        title="Dead-reckoning error",
        kicker="Error budget",
        facts=[
            ("Length", duration(result.duration)),
            ("Latitude", angle(result.latitude)),
            ("At rest before", _rest(result)),
            ("Height", _height(result)),
        ],
        sections={
            "verdict": ("Errors", [*_errors(result)]),
            "pictures": ("Pictures", pictures(result, captions)),
            "sources": ("By source", [*_sources(result)]),
            "method": ("Method", [*map(Text, _METHOD), pairs(_facts(result)), References(_REFERENCES)]),
        },
    )


def _quantities(result: DeadReckoning) -> list[str]:
    return [q for q in BUDGET_QUANTITIES if not (result.held and q == "position_down")]


def _errors(result: DeadReckoning) -> Iterator[PageBlock]:
    column, last = result.column("position_horizontal"), result.last
    low, high = float(result.lower[last, column]), float(result.upper[last, column])
    end = number(high) if math.isfinite(high) else "∞"
    yield Hero(
        f"{number(float(result.sd[last, column]))} m",
        f"horizontal position after {time_words(float(result.times[last]))}",
        f"[{number(low)}, {end}] m" if math.isfinite(low) else "no interval: a model states none",
        "one standard deviation, unaided; root sum of squares of north and east",
        "good",
    )
    yield Text(sentence(result.says), brief=True)
    wanted = _quantities(result)
    caption = (
        f"One standard deviation; in brackets the {100 * result.confidence:g} % interval that follows from those of "
        "the noise models. Horizontal errors and tilt combine the north and east components (root sum of squares)."
    )
    lines = [
        (duration(time), *(_cell(result, result, at, q) for q in wanted))
        for time, at in zip(result.shown, result.rows, strict=True)
    ]
    yield from table(("After", *map(quantity_words, wanted)), lines, caption=caption)
    yield from advice(result.notes)


def _sources(result: DeadReckoning) -> Iterator[PageBlock]:
    wanted = _quantities(result)
    kept = [*(False for _ in result.sources), True]
    end = f"after {time_words(float(result.times[result.last]))}"
    position = [(s.name, _end(result, s, "position_horizontal"), _share(result, s)) for s in result.sources]
    whole = ("total", _cell(result, result, result.last, "position_horizontal"), "")
    yield from table(
        ("Source", f"Horizontal position {end} [m]", "Share of variance"), [*position, whole], kept=kept
    )
    lines = [(s.name, *(_end(result, s, q) for q in wanted)) for s in result.sources]
    total = ("total", *(_cell(result, result, result.last, q) for q in wanted))
    heads = ("Source", *map(quantity_words, wanted))
    caption = f"All errors {end}."
    yield from table(heads, [*lines, total], caption=caption, kept=kept, brief=False)
    for quantity in wanted:
        yield from table(
            (quantity_words(quantity), *map(duration, result.shown)),
            _over_time(result, quantity),
            caption="One standard deviation, by source.",
            kept=kept,
            brief=False,
        )


def _share(result: DeadReckoning, source: Source) -> str:
    """Of the variance of the horizontal position, in percent."""
    column = result.column("position_horizontal")
    whole = float(result.sd[result.last, column])
    if source.is_limit or not whole > 0:
        return "–"
    share = (float(source.sd[result.last, column]) / whole) ** 2
    if share < _SMALL_SHARE:
        return "< 0.01 %"
    return f"{100 * share:.0f} %" if share > 0.1 else f"{100 * share:.2g} %"


def _over_time(result: DeadReckoning, quantity: str) -> Sequence[Sequence[str]]:
    """The part of each source in one quantity at the shown times, the total last."""
    factor = BUDGET_QUANTITIES[quantity][2]
    lines = [(s.name, *(_short(result, s, at, quantity) for at in result.rows)) for s in result.sources]
    return [*lines, ("total", *(number(float(result[quantity][at]) / factor) for at in result.rows))]


def _end(result: DeadReckoning, source: Source, quantity: str) -> str:
    """What a source makes of a quantity at the end, with its interval."""
    last = result.last
    small = source.sd[last, result.column(quantity)] <= _NOTHING * result[quantity][last]
    if source.is_limit or small:
        return _short(result, source, last, quantity)
    return _cell(result, source, last, quantity)


def _short(result: DeadReckoning, source: Source, at: int, quantity: str) -> str:
    column, factor = result.column(quantity), BUDGET_QUANTITIES[quantity][2]
    if at > result.last:
        return "–"
    if source.is_limit:
        high = float(source.upper[at, column])
        return upper_limit(high / factor) if math.isfinite(high) else "no limit"
    value = float(source.sd[at, column])
    return "0" if value <= _NOTHING * result.sd[at, column] else number(value / factor)


def _cell(result: DeadReckoning, part: DeadReckoning | Source, at: int, quantity: str) -> str:
    if at > result.last:
        return "not resolved" if quantity == "position_horizontal" else "–"
    column, factor = result.column(quantity), BUDGET_QUANTITIES[quantity][2]
    value, low, high = (float(ends[at, column]) for ends in (part.sd, part.lower, part.upper))
    if math.isfinite(low) and not math.isfinite(high):
        return f"{number(value / factor)} [{number(low / factor)}, ∞]"
    if not math.isfinite(low) or high - low <= _SAME * high:
        return number(value / factor)
    return interval_words(value, low, high, factor)


# -- what the budget rests on -------------------------------------------------------------------------------


def _rest(result: DeadReckoning) -> str:
    """How long the unit rested before, and what became of the vertical accelerometer's bias."""
    if result.rest is None:
        return "no"
    return f"{duration(result.rest)}; vertical accelerometer bias {'removed' if result.vertical else 'kept'}"


def _height(result: DeadReckoning) -> str:
    return "aided" if result.held else "unaided"


def _facts(result: DeadReckoning) -> list[tuple[str, str]]:
    sizes = {name: float(getattr(result.initial, name)) for name in _INITIAL}
    stated = [
        f"{name.replace('_', ' ')} {number(size / _INITIAL[name][1])} {_INITIAL[name][0]}"
        for name, size in sizes.items()
        if size
    ]
    return [
        ("Latitude", angle(result.latitude)),
        ("Heading of the x axis", angle(result.heading)),
        ("At rest before", _rest(result)),
        ("Height", _height(result)),
        ("Initial errors", ", ".join(stated) or "none"),
        ("Sample rate", f"{number(result.rate)} Hz"),
        *((f"Noise of {name or 'the sensor'}", model_words(model)) for name, model in result.models.items()),
    ]


def rows(result: DeadReckoning) -> Iterator[dict[str, object]]:
    """One row of a table for each shown time, source and quantity, in SI."""
    for row in result.table():
        ends = {end: f"{row[end]:.6g}" for end in ("sd", "lower", "upper")}
        yield {**row, "time_s": f"{row['time_s']:g}", **ends}
