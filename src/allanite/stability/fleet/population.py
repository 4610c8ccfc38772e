# SPDX-License-Identifier: BSD-3-Clause
"""describe_fleet(table): from the rows of a fleet to its population, and to the units that stand out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.quantities.probabilities import require_probabilities
from allanite.quantities.quantity import Quantity, QuantityStatus
from allanite.stability.fleet.capability import capability_of
from allanite.stability.fleet.correlations import correlated_pairs
from allanite.stability.fleet.densities import density_of
from allanite.stability.fleet.draws import Draws
from allanite.stability.fleet.drifts import DatedLogs, dated_logs
from allanite.stability.fleet.evidence import Design
from allanite.stability.fleet.posterior import Posterior, posterior_of
from allanite.stability.fleet.profile_table import ProfileTable
from allanite.stability.fleet.results import (
    CoefficientPopulation,
    CovariateEffect,
    FleetPopulation,
    LotRatio,
    StandingOut,
    UnitDrift,
)
from allanite.stability.fleet.rows import FleetRows, read_rows
from allanite.stability.fleet.standing_out import RESOLVED, Departures, departures, discoveries, simes
from allanite.stability.fleet.words import counted

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["CoefficientRows", "describe_fleet", "population_of"]

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

#: Fewer units that resolve a coefficient say next to nothing of their kind.
_FEWEST = 3
_LARGEST = 700.0
_UNITS_OF_MEASURE = {"temperature": "degC", "date": "year"}
_LEAST_SPAN = {"date": 30 / 365.25}
_SYMBOLS = ("Q", "N", "B", "K", "R")


class CoefficientRows:
    """One coefficient of a channel, ready for its population."""

    def __init__(
        self, rows: FleetRows, channel: str, symbol: str, conditions: Sequence[str], *, by_lot: bool
    ) -> None:
        index = rows.where(channel, symbol)
        for name in conditions:
            index = index[np.isfinite(rows.conditions[name][index])]
        self.channel, self.symbol = channel, symbol
        self.rows, self.index = rows, index
        self.lot_names, lot = _numbered(rows.lot[index] if by_lot else np.full(len(index), ""))
        units = [f"{a}\0{b}" for a, b in zip(rows.lot[index], rows.unit[index], strict=True)]
        keys, unit = _numbered(np.array(units, dtype=object))
        self.unit_names = tuple(key.split("\0", 1)[1] for key in keys)
        first = np.flatnonzero(np.diff(unit, prepend=-1))
        self.lot_of_unit = tuple(rows.lot[index[first]])
        values = [rows.conditions[name][index] for name in conditions]
        varies = [len(v) > 0 and float(np.ptp(v)) > 0 for v in values]
        self.conditions = tuple(name for name, there in zip(conditions, varies, strict=True) if there)
        varying = [v for v, there in zip(values, varies, strict=True) if there]
        self.references = tuple(float(v.mean()) for v in varying)
        z = np.column_stack([np.ones(len(index)), *(v - v.mean() for v in varying)])
        profiles = ProfileTable.of(rows.knots[index], rows.root_at_zero[index])
        self.design = Design(profiles, z, unit, lot[first])
        self.resolved = rows.root_at_zero[index] < -RESOLVED

    @property
    def enough(self) -> bool:
        """There are units to speak of."""
        resolved = np.unique(self.design.unit[self.resolved]).size if len(self.index) else 0
        return bool(resolved >= max(_FEWEST, self.design.covariates.shape[1] + 2))


def _numbered(names: NDArray[np.object_]) -> tuple[tuple[str, ...], NDArray[np.intp]]:
    """Distinct names in their order, and the number of each."""
    distinct, number = np.unique(names.astype(str), return_inverse=True)
    return tuple(map(str, distinct)), number.astype(np.intp)


def describe_fleet(
    table: str | Path | pa.Table,
    *,
    confidence: float = 0.95,
    false_discovery_rate: float = 0.05,
    content: float = 0.99,
    conditions: Sequence[str] | None = None,
    by_lot: bool = True,
    limits: Mapping[tuple[str, str], float] | None = None,
    progress: Progress | None = None,
) -> FleetPopulation:
    """What is the population of a fleet, and which units stand out?

    Every log takes part with its profile, an upper limit included, but for those in which the unit was turned. Per
    coefficient the logarithm follows a hierarchy of lots, units and repeats, with effects of the conditions; tails are
    normal unless the units reject that.

    Parameters
    ----------
    table : path or pyarrow.Table
        As ``allanite fleet run`` writes it.
    confidence : float
        Of the intervals.
    false_discovery_rate : float
        Expected share of false alarms among the units that stand out.
    content : float
        Share of the units within a tolerance bound.
    conditions : sequence of str, optional
        Numeric columns whose effect is estimated; logs without them are left out. By default "temperature" and "date"
        where all logs have them; a date where they span 30 days.
    by_lot : bool
        Tell the lots apart.
    limits : mapping of (str, str) to float, optional
        Upper limits [SI] by channel and symbol: at most the share 1 - `content` of all units may lie above.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Raises
    ------
    InputError
        No table of a fleet, a condition that it does not have, fewer than three units, shares outside (0, 1).
    """
    require_probabilities(confidence=confidence, false_discovery_rate=false_discovery_rate, content=content)
    bounds = limits or {}
    for (channel, symbol), limit in bounds.items():
        if not 0 < limit < math.inf:
            raise InputError(f"the limit of {symbol} of {channel} must be a positive number, not {limit!r}")
    rows = read_rows(table)
    chosen = _chosen(rows, conditions)
    pairs = [
        (c, s)
        for c in dict.fromkeys(rows.channel)
        for s in _SYMBOLS
        if ((rows.channel == c) & (rows.symbol == s)).any()
    ]
    every, left_out = [], []
    for i, (channel, symbol) in enumerate(pairs):
        if progress:
            progress(i / len(pairs), f"{symbol} of {channel}")
        coefficient = CoefficientRows(rows, channel, symbol, chosen, by_lot=by_lot)
        if not coefficient.enough:
            left_out.append(f"{symbol} of {channel}")
            continue
        posterior = posterior_of(coefficient.design)
        if not posterior.bounded:
            left_out.append(f"{symbol} of {channel}")
            continue
        every.append((coefficient, posterior, departures(coefficient.design, posterior)))
    if not every:
        turned = (
            f" ({counted(len(rows.turned), 'log')} of a unit that was turned left out)" if rows.turned else ""
        )
        raise InputError(
            f"no coefficient is resolved by {_FEWEST} units or more; a fleet needs as many{turned}"
        )
    units = _UnitTable([c for c, _, _ in every])
    correlations, tested = correlated_pairs(
        [(c.channel, c.symbol) for c, _, _ in every],
        units.filled([d.ratio for _, _, d in every]),
        confidence,
    )
    drifts, repeated = _drifts([(c, p) for c, p, _ in every], confidence, false_discovery_rate)
    return FleetPopulation(
        logs=rows.logs,
        failed=rows.failed,
        units=len({*zip(rows.lot, rows.unit, strict=True)}),
        coefficients=tuple(
            population_of(c, p, confidence, content, bounds.get((c.channel, c.symbol))) for c, p, _ in every
        ),
        left_out=tuple(left_out),
        standing_out=_standing_out([(c, d) for c, _, d in every], units, false_discovery_rate),
        false_discovery_rate=false_discovery_rate,
        confidence=confidence,
        correlations=correlations,
        pairs=tested,
        drifts=drifts,
        repeated=repeated,
        turned=rows.turned,
    )


def _chosen(rows: FleetRows, conditions: Sequence[str] | None) -> tuple[str, ...]:
    if conditions is None:
        known = (name for name in _UNITS_OF_MEASURE if name in rows.conditions)
        return tuple(name for name in known if _serves(rows.conditions[name], _LEAST_SPAN.get(name, 0.0)))
    for name in conditions:
        if name not in rows.conditions:
            there = ", ".join(rows.conditions) or "none"
            raise InputError(f"the table has no numeric column {name!r}; columns that it has: {there}")
    return tuple(conditions)


def _serves(values: Array, span: float) -> bool:
    """All logs have it, and it varies."""
    return bool(len(values) and np.isfinite(values).all() and np.ptp(values) > span)


# -- one coefficient --------------------------------------------------------------------------------------


def population_of(
    coefficient: CoefficientRows,
    posterior: Posterior,
    confidence: float,
    content: float,
    limit: float | None = None,
) -> CoefficientPopulation:
    """What a posterior says of one coefficient, and of the limit that it has."""
    draws, rows, design = Draws(posterior), coefficient.rows, coefficient.design
    one = coefficient.index[0]
    unit_of_measure = str(rows.unit_of_measure[one])
    tails = [0.5 - confidence / 2, 0.5 + confidence / 2]

    def between(values: Array) -> tuple[float, float]:
        low, high = np.quantile(values, tails)
        return float(low), float(high)

    def spread(level: str) -> Quantity:
        values = draws.scale(level)
        if level in posterior.resolved:
            return Quantity.of(float(np.median(values)), between(values), "1")
        upper = float(np.quantile(values, confidence))
        return Quantity(value=math.nan, lower=0.0, upper=upper, unit="1", status=QuantityStatus.UPPER_LIMIT)

    middle = draws.location[:, 0]
    wide = draws.scale("wide")
    low, high = between(draws.next_unit())
    bounds = (
        float(np.quantile(draws.quantile_of_units(1 - content), 1 - confidence)),
        float(np.quantile(draws.quantile_of_units(content), confidence)),
    )
    effects = [
        CovariateEffect(
            name=name,
            unit_of_measure=_UNITS_OF_MEASURE.get(name, "1"),
            reference=reference,
            change=Quantity.of(float(np.median(values)), between(values), "1"),
        )
        for name, reference, values in zip(
            coefficient.conditions, coefficient.references, draws.location[:, 1:].T, strict=True
        )
    ]
    return CoefficientPopulation(
        channel=coefficient.channel,
        kind=str(rows.kind[one]),
        symbol=coefficient.symbol,
        logs=len(coefficient.index),
        units=design.units,
        lots=design.lots,
        resolved=int(coefficient.resolved.sum()),
        middle=_exponential(float(np.median(middle)), between(middle), unit_of_measure),
        spread=spread("unit"),
        between_lots=spread("lot") if design.lots > 1 else None,
        between_repeats=spread("repeat") if design.repeats else None,
        wide_share=Quantity.of(float(np.median(wide)), between(wide), "1") if wide.max() > 0 else None,
        next_unit=(_exp(low), _exp(high)),
        content=content,
        tolerance=(_exp(bounds[0]), _exp(bounds[1])),
        effects=tuple(effects),
        of_lots=tuple(_of_lots(coefficient, draws, between)),
        capability=None if limit is None else capability_of(draws, limit, confidence, content),
        density=density_of(design, draws),
    )


def _exponential(value: float, ends: tuple[float, float], unit: str) -> Quantity:
    return Quantity.of(_exp(value), (_exp(ends[0]), _exp(ends[1])), unit)


def _exp(x: float) -> float:
    """A coefficient from its logarithm; a few units bound it by nothing, which is infinite."""
    return math.exp(x) if x < _LARGEST else math.inf


def _of_lots(
    coefficient: CoefficientRows, draws: Draws, between: Callable[[Array], tuple[float, float]]
) -> list[LotRatio]:
    design = coefficient.design
    if design.lots < 2:
        return []
    values, units = draws.lots(), design.per_lot(np.ones(design.units))
    return [
        LotRatio(lot=name, units=int(n), ratio=_exponential(float(np.median(column)), between(column), "1"))
        for name, n, column in zip(coefficient.lot_names, units, values.T, strict=True)
    ]


# -- units that stand out ---------------------------------------------------------------------------------


class _UnitTable:
    """Units by coefficients: a column for each, NaN where a unit has no log of it."""

    def __init__(self, every: Sequence[CoefficientRows]) -> None:
        of_each = [[*zip(c.lot_of_unit, c.unit_names, strict=True)] for c in every]
        self.keys = sorted({key for keys in of_each for key in keys})
        place = {key: i for i, key in enumerate(self.keys)}
        self.at = [np.array([place[key] for key in keys], dtype=np.intp) for keys in of_each]

    def filled(self, columns: Sequence[Array]) -> Array:
        """Values of the units of each coefficient, shape (n_units, n_coefficients)."""
        table = np.full((len(self.keys), len(columns)), np.nan)
        for column, (at, values) in enumerate(zip(self.at, columns, strict=True)):
            table[at, column] = values
        return table


def _standing_out(
    every: Sequence[tuple[CoefficientRows, Departures]], units: _UnitTable, rate: float
) -> tuple[StandingOut, ...]:
    p, keys = units.filled([d.p for _, d in every]), units.keys
    where = [dict(zip(at.tolist(), range(len(at)), strict=True)) for at in units.at]
    chosen = np.flatnonzero(discoveries(simes(p), rate))
    left = rate * len(chosen) / len(keys)
    out = []
    for i in chosen[np.argsort(np.nanmin(p[chosen], axis=1))]:
        columns = np.flatnonzero(np.isfinite(p[i]))
        for column in columns[discoveries(p[i][columns], left)]:
            c, d = every[column]
            u = where[column][int(i)]
            out.append(
                StandingOut(
                    unit=keys[i][1],
                    lot=keys[i][0],
                    channel=c.channel,
                    symbol=c.symbol,
                    ratio=float(d.ratio[u]),
                    deviations=float(d.deviations[u]),
                    p=float(d.p[u]),
                )
            )
    return tuple(out)


# -- units that drift -------------------------------------------------------------------------------------


def _drifts(
    every: Sequence[tuple[CoefficientRows, Posterior]], confidence: float, rate: float
) -> tuple[tuple[UnitDrift, ...], int]:
    """Those that differ from zero, the surest first, and how many were tested."""
    tested = []
    for coefficient, posterior in every:
        logs = _dated(coefficient, posterior)
        if logs is not None:
            tested.append((coefficient, logs, logs.probability()))
    if not tested:
        return (), 0
    p = np.concatenate([of_units for _, _, of_units in tested])
    chosen = np.split(discoveries(p, rate), np.cumsum([len(of_units) for _, _, of_units in tested])[:-1])
    drifts = [
        _drift(coefficient, logs.of_units(np.array([i])), float(of_units[i]), confidence)
        for (coefficient, logs, of_units), which in zip(tested, chosen, strict=True)
        for i in np.flatnonzero(which)
    ]
    return tuple(sorted(drifts, key=lambda drift: drift.p)), len(p)


def _dated(coefficient: CoefficientRows, posterior: Posterior) -> DatedLogs | None:
    years = coefficient.rows.conditions.get("date")
    if years is None or not coefficient.design.repeats:
        return None
    names = coefficient.conditions
    column = names.index("date") + 1 if "date" in names else None
    return dated_logs(coefficient.design, Draws(posterior), years[coefficient.index], column)


def _drift(coefficient: CoefficientRows, logs: DatedLogs, p: float, confidence: float) -> UnitDrift:
    unit = int(logs.numbers[0])
    median, low, high = logs.slope(confidence)
    return UnitDrift(
        unit=coefficient.unit_names[unit],
        lot=coefficient.lot_of_unit[unit],
        channel=coefficient.channel,
        symbol=coefficient.symbol,
        logs=len(logs.years),
        slope=Quantity.of(median, (low, high), "1/year"),
        p=p,
    )
