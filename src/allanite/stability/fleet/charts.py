# SPDX-License-Identifier: BSD-3-Clause
"""The control chart of a coefficient over the logs of a fleet: every point with its interval, limits of each its own.

With the center m and the spread s of the logs of phase I (the population without what comes later), the logarithm x of
a log with standard deviation u, and the spread r between logs of one unit, the chart shows

    z = (x - m) / sqrt(s^2 + r^2 + u^2),

for which the limits of a Shewhart chart hold whatever u is: a short log has a wide interval and wide limits. s is that
of the prediction interval of the next unit, so that it covers lots, tails and how little phase I says of itself.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.quantity import Quantity
from allanite.quantities.result import Result
from allanite.quantities.verdict import Tone, Verdict
from allanite.stability.fleet.chart_words import chart_sentence
from allanite.stability.fleet.control_rules import (
    EWMA_LIMIT,
    NELSON,
    WESTERN_ELECTRIC,
    ControlRule,
    ewma,
    signals,
)
from allanite.stability.fleet.population import describe_fleet
from allanite.stability.fleet.results import CoefficientPopulation
from allanite.stability.fleet.rows import FleetRows, at_rest, read_rows, read_table

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["RULES", "ControlChart", "ControlSignal", "ControlVerdict", "control_chart"]

Array = NDArray[np.float64]

RULES: Mapping[str, tuple[ControlRule, ...]] = {
    "individuals": (ControlRule.BEYOND_3,),
    "western-electric": WESTERN_ELECTRIC,
    "nelson": NELSON,
}
_BEST, _LEFT, _RIGHT = 4, 3, 5  # knots at roots 0, -0.75, 0.75
_STEP, _FEWEST = 0.75, 3
_SIDE = 1.96


class ControlVerdict(Verdict):
    """Is the coefficient in control?"""

    SIGNALS = "signals", "out of control", Tone.WARNING
    IN_CONTROL = "in control", "in control", Tone.GOOD


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlSignal(Result):
    """A point at which a rule signals.

    Attributes
    ----------
    number : int
        Of the point, from 1.
    log, unit : str
        Its names.
    rule : ControlRule
        The pattern that is complete at this point.
    z : float
        The point, in standard deviations.
    """

    number: int
    log: str
    unit: str
    rule: ControlRule
    z: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlChart(Result):
    """The logs of a coefficient in their order.

    Attributes
    ----------
    channel, kind, symbol : str
        The coefficient.
    unit_of_measure : str
        Of SI.
    by_date : bool
        In the order of the dates; otherwise in that of the table.
    logs, units : tuple of str
        Of each point.
    dates : ndarray, shape (n,)
        Years; NaN without dates.
    value, lower, upper : ndarray, shape (n,) [SI]
        Of each log, with an interval of 95 %.
    z : ndarray, shape (n,)
        Each point in standard deviations from the center, its own uncertainty included.
    mean, mean_limit : ndarray, shape (n,)
        Exponentially weighted mean of z, and its limit on either side.
    low, high : ndarray, shape (n,) [SI]
        Three standard deviations from the center, for the uncertainty of each point.
    first : int
        Points of phase I; the others are judged by it.
    center : Quantity [SI]
        Median of the population of phase I.
    limits_only : int
        Logs that give an upper limit only, and are no points.
    rules : tuple of ControlRule
        Those that were asked for.
    signals : tuple of ControlSignal
        In the order of the points.
    """

    FORMAT: ClassVar[str] = "allanite-control-chart"
    STATED: ClassVar[tuple[str, ...]] = ("verdict",)

    channel: str
    kind: str
    symbol: str
    unit_of_measure: str
    by_date: bool
    logs: tuple[str, ...]
    units: tuple[str, ...]
    dates: Array
    value: Array
    lower: Array
    upper: Array
    z: Array
    mean: Array
    mean_limit: Array
    low: Array
    high: Array
    first: int
    center: Quantity
    limits_only: int
    rules: tuple[ControlRule, ...]
    signals: tuple[ControlSignal, ...]

    @property
    def verdict(self) -> ControlVerdict:
        """Does any rule signal?"""
        return ControlVerdict.SIGNALS if self.signals else ControlVerdict.IN_CONTROL

    @property
    def reason(self) -> str:
        """In a sentence."""
        signalled = len({s.number for s in self.signals})
        rules = tuple(dict.fromkeys(s.rule.words for s in self.signals))
        return chart_sentence(self.symbol, self.channel, len(self.logs), self.first, signalled, rules)


def control_chart(
    table: str | Path | pa.Table,
    *,
    channel: str,
    term: str,
    phase_two: str | None = None,
    rules: str = "western-electric",
    weighted: bool = True,
) -> ControlChart:
    """Draw up the control chart of a coefficient.

    Parameters
    ----------
    table : path or pyarrow.Table
        As ``allanite fleet run`` writes it.
    channel, term : str
        The coefficient: "gyro_x", "N".
    phase_two : str, optional
        Date ("2026-03-01") or number of the first log that is judged by the ones before it; by default all logs are
        judged by all.
    rules : {"individuals", "western-electric", "nelson"}
        Patterns of individual points.
    weighted : bool
        Also the exponentially weighted mean, which shows small shifts.

    Raises
    ------
    InputError
        No such coefficient, a phase I of fewer than three units, or a date where the logs have none.
    """
    if rules not in RULES:
        raise InputError(f"no rules {rules!r}; there are: {', '.join(RULES)}")
    ordered, by_date = _ordered(at_rest(read_table(table))[0], channel, term)
    rows = read_rows(ordered)
    dates = rows.conditions["date"] if by_date else np.full(len(rows), np.nan)
    first = len(rows) if phase_two is None else _first(dates, phase_two, by_date=by_date)
    chosen = (*RULES[rules], *((ControlRule.EWMA,) if weighted else ()))
    population = describe_fleet(ordered.slice(0, first), conditions=()).coefficients[0]
    return _chart(rows, dates, first, population, chosen, by_date=by_date)


def _ordered(table: pa.Table, channel: str, term: str) -> tuple[pa.Table, bool]:
    """The rows of a coefficient in the order of their dates, if all of them have one, or as they are."""
    import pyarrow.compute as pc

    of_profile = table.filter(pc.is_valid(table["profile"]))
    here = of_profile.filter(
        pc.and_(pc.equal(of_profile["channel"], channel), pc.equal(of_profile["term"], term))
    )
    if not len(here):
        named = zip(of_profile["channel"].to_pylist(), of_profile["term"].to_pylist(), strict=True)
        pairs = dict.fromkeys(f"{t} of {c}" for c, t in named)
        raise InputError(f"the fleet has no {term} of {channel}; there are: {', '.join(pairs)}")
    by_date = "date" in here.column_names and here["date"].null_count == 0
    return (here.sort_by([("date", "ascending"), ("log", "ascending")]) if by_date else here), by_date


def _first(dates: Array, phase_two: str, *, by_date: bool) -> int:
    """Logs of phase I."""
    if phase_two.isdigit():
        first = int(phase_two) - 1
    elif by_date:
        first = int(np.searchsorted(dates, _year(phase_two)))
    else:
        raise InputError(f"phase II cannot begin at {phase_two!r}: not every log has a date; give a number")
    if not _FEWEST <= first < len(dates):
        raise InputError(
            f"phase II begins at log {first + 1} of {len(dates)}; it needs one, and phase I {_FEWEST} or more"
        )
    return first


def _year(text: str) -> float:
    try:
        return 1970.0 + datetime.fromisoformat(f"{text}T00:00:00+00:00").timestamp() / 86400 / 365.25
    except ValueError:
        raise InputError(f"phase II begins at {text!r}: write a date as 2026-03-01, or a number") from None


def _chart(
    rows: FleetRows,
    dates: Array,
    first: int,
    population: CoefficientPopulation,
    chosen: Sequence[ControlRule],
    *,
    by_date: bool,
) -> ControlChart:
    points = np.flatnonzero(np.isfinite(rows.knots[:, [_LEFT, _RIGHT]]).all(axis=1))
    center = math.log(population.middle.value)
    low, high = (math.log(end) for end in population.next_unit)
    repeats = population.between_repeats.value if population.between_repeats else 0.0
    within = 0.0 if math.isnan(repeats) else repeats
    knots = rows.knots[points]
    x, u = knots[:, _BEST], (knots[:, _RIGHT] - knots[:, _LEFT]) / (2 * _STEP)
    sd = np.sqrt(((high - low) / (2 * _SIDE)) ** 2 + within**2 + u**2)
    z = (x - center) / sd
    mean, spread = ewma(z)
    marked = [(int(i), rule) for rule in chosen for i in np.flatnonzero(signals(z, rule))]
    logs, units = (tuple(map(str, names[points])) for names in (rows.log, rows.unit))
    return ControlChart(
        channel=population.channel,
        kind=population.kind,
        symbol=population.symbol,
        unit_of_measure=population.middle.unit,
        by_date=by_date,
        logs=logs,
        units=units,
        dates=dates[points],
        value=np.exp(x),
        lower=np.exp(x - _SIDE * u),
        upper=np.exp(x + _SIDE * u),
        z=z,
        mean=mean,
        mean_limit=EWMA_LIMIT * spread,
        low=np.exp(center - 3 * sd),
        high=np.exp(center + 3 * sd),
        first=int((points < first).sum()),
        center=population.middle,
        limits_only=len(rows) - len(points),
        rules=tuple(chosen),
        signals=tuple(
            ControlSignal(number=i + 1, log=logs[i], unit=units[i], rule=rule, z=float(z[i]))
            for i, rule in sorted(marked, key=lambda mark: mark[0])
        ),
    )
