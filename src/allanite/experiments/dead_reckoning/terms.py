# SPDX-License-Identifier: BSD-3-Clause
"""The terms of noise models as entries of the budget, each with the ends that its estimates give."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.dead_reckoning.intervals import VariancePart
from allanite.experiments.dead_reckoning.results import QUANTITIES
from allanite.experiments.dead_reckoning.sources import AxisProcess, StartingPoint, term_processes, variances
from allanite.lazy_dataclasses import dataclass
from allanite.noise import BY_LETTER, Estimate, GaussMarkov, NoiseModel, TermType, term_of
from allanite.noise.parameters import amplitude_of, estimate_of

__all__ = ["SENSORS", "AxisTerm", "ReckoningSetting", "entries", "told"]

Array = NDArray[np.float64]

#: Kinds of models by sensor.
SENSORS = {"gyro": "rate", "accelerometer": "acceleration"}
_LETTERS = {kind: letter for letter, kind in BY_LETTER.items()}
#: A correlation time whose set has no upper end is put in at so many times the whole length: a constant.
_ENDLESS = 1e4


@dataclass(frozen=True, slots=True, kw_only=True)
class ReckoningSetting:
    """What all sources share.

    Attributes
    ----------
    place : StartingPoint
    times : ndarray, shape (m,) [s]
    axes : ndarray, shape (3, 3)
        Of the sensors, as rows, along north, east, down.
    dt, span : float [s]
        Sample interval, and the whole length with the rest before it.
    """

    place: StartingPoint
    times: Array
    axes: Array
    dt: float
    span: float

    def variances(self, groups: Sequence[Sequence[AxisProcess]]) -> list[Array]:
        """Of the quantities over time, shape (m, n_quantities), for each group of processes."""
        states = variances(groups, self.place, self.times)
        return [
            np.stack([v[:, list(rows)].sum(axis=1) for rows in QUANTITIES.values()], axis=1) for v in states
        ]


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisTerm:
    """One term of one model, on the axes that have this model.

    Attributes
    ----------
    sensor : "gyro" or "accelerometer"
    symbol : str
        Letter; "GM", "line".
    model : str
        Name of its model.
    which : tuple of int
        Axes.
    term : Term or None
        None: the record does not resolve it.
    limit : Term or None
        The term at its upper limit where there is no term; None without one: the limit is infinite.
    size, time : Estimate or None
        Of its amplitude and its correlation time.
    has_intervals : bool
        The model states intervals at all.
    """

    sensor: str
    symbol: str
    model: str
    which: tuple[int, ...]
    term: TermType | None
    limit: TermType | None = None
    size: Estimate | None = None
    time: Estimate | None = None
    has_intervals: bool = True

    @property
    def name(self) -> str:
        """Of its row."""
        return f"{self.sensor} {self.symbol}"

    def processes(self, term: TermType, setting: ReckoningSetting) -> list[AxisProcess]:
        """On all its axes."""
        return [
            made
            for i in self.which
            for made in term_processes(
                term, gyro=self.sensor == "gyro", along=setting.axes[i], dt=setting.dt, span=setting.span
            )
        ]


def entries(
    sensor: str, names: Sequence[str], given: Mapping[str, NoiseModel], setting: ReckoningSetting
) -> Iterator[AxisTerm]:
    """The terms of the models of a sensor, and what their records do not resolve."""
    for axis, name in enumerate(names):
        which = (0, 1, 2) if len(names) == 1 else (axis,)
        model = given[name]
        yield from _resolved(sensor, name, which, model)
        yield from _open(sensor, name, which, model, setting)


def _resolved(sensor: str, name: str, which: tuple[int, ...], model: NoiseModel) -> Iterator[AxisTerm]:
    for term in model.terms:
        symbol = "GM" if isinstance(term, GaussMarkov) else _LETTERS.get(type(term), "line")
        size = estimate_of(term, model)
        if _amplitude(term, size) > 0:
            yield AxisTerm(
                sensor=sensor, symbol=symbol, model=name, which=which, term=term, size=size,
                time=_time_of(term, size, model),
                has_intervals=bool(model.estimates),
            )  # fmt: skip


def _time_of(term: TermType, size: Estimate | None, model: NoiseModel) -> Estimate | None:
    """The estimate of the correlation time of a Gauss-Markov term, beside that of its sigma (or q)."""
    if size is None or not isinstance(term, GaussMarkov):
        return None
    return model.estimate("T" + size.symbol.removeprefix("sigma").removeprefix("q"))


def _open(
    sensor: str, name: str, which: tuple[int, ...], model: NoiseModel, setting: ReckoningSetting
) -> Iterator[AxisTerm]:
    """Terms of the family that the record does not resolve, by their upper limits.

    A Gauss-Markov term that is not resolved has no correlation time: it counts as the flicker of the same floor.
    """
    there = {_LETTERS.get(type(term), "GM") for term in model.terms if _amplitude(term, None) > 0}
    for e in model.estimates:
        letter = "B" if e.symbol == "B_equiv" and "GM" not in there else e.symbol
        if e.supported or letter in there or letter not in BY_LETTER:
            continue
        there.add(letter)
        limit = term_of(letter, e.upper, dt=setting.dt) if math.isfinite(e.upper) else None
        yield AxisTerm(
            sensor=sensor, symbol=letter, model=name, which=which, term=None, limit=limit, size=e
        )  # fmt: skip


def _amplitude(term: TermType, size: Estimate | None) -> float:
    """What the estimate `size` is of."""
    if isinstance(term, GaussMarkov) and size is not None and size.symbol.startswith("q"):
        return term.q
    return amplitude_of(term)


# -- their ends -----------------------------------------------------------------------------------------------------


def told(entry: AxisTerm, setting: ReckoningSetting) -> tuple[Array, list[VariancePart] | None]:
    """Variance of the quantities over time, and what the parameters' intervals make of it; None without intervals."""
    nothing = np.zeros((len(setting.times), len(QUANTITIES)))
    if entry.term is None:
        limit = np.full_like(nothing, np.inf)
        if entry.limit is not None:
            (limit,) = setting.variances([entry.processes(entry.limit, setting)])
        return nothing, [_part(entry, entry.size, nothing, nothing, limit)]
    others = _other_times(entry, setting)
    value, *ends = setting.variances([entry.processes(t, setting) for t in (entry.term, *others)])
    if not entry.has_intervals:
        return value, None
    parts = []
    if entry.size is not None:
        amplitude = _amplitude(entry.term, entry.size)
        low, high = (value * (end / amplitude) ** 2 for end in (entry.size.lower, entry.size.upper))
        parts.append(_part(entry, entry.size, value, low, high))
    if ends:
        parts.append(
            VariancePart(
                key=(entry.model, "" if entry.time is None else entry.time.symbol),
                value=value,
                lower=np.minimum(value, np.minimum(*ends)),
                upper=np.maximum(value, np.maximum(*ends)),
                direction=np.sign(ends[1] - ends[0]),
            )
        )
    return value, parts


def _part(entry: AxisTerm, size: Estimate | None, value: Array, low: Array, high: Array) -> VariancePart:
    return VariancePart(
        key=(entry.model, "" if size is None else size.symbol),
        value=value,
        lower=np.minimum(low, value),
        upper=np.fmax(high, value),
        direction=np.ones_like(value),
    )


def _other_times(entry: AxisTerm, setting: ReckoningSetting) -> list[GaussMarkov]:
    """A Gauss-Markov term with the shortest and the longest time of its set, its estimated size being kept."""
    if entry.time is None or not isinstance(entry.term, GaussMarkov):
        return []
    low = max(entry.time.lower, setting.dt / 10)
    high = min(max(entry.time.upper, low), _ENDLESS * setting.span)
    if entry.size is not None and entry.size.symbol.startswith("q"):
        return [GaussMarkov(q=entry.term.q, T=t) for t in (low, high)]
    return [GaussMarkov.from_sigma(entry.term.sigma, t) for t in (low, high)]
