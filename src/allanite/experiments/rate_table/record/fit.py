# SPDX-License-Identifier: BSD-3-Clause
"""The regression of a record on the rates of the table, and what its coefficients are called.

    y = bias + k x + k x_F (c_2 u^2 + c_3 u^3 + ...) + noise,    u = x / x_F                                  (1)

x is the rate of the table and x_F the largest of them. The powers enter less their best straight lines over u, so that
the slope of the fit, the scale factor, is that of the best straight line through the response, and the coefficients
are those of (1). In place of the powers |u| may stand: two straight lines that meet at zero.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.rate_table.motion import RateTable, TableClock
from allanite.experiments.rate_table.record.rows import (
    ABSOLUTE,
    LAG,
    LATE,
    RATE,
    TEMPERATURE,
    WARM_RATE,
    RegressionRows,
    SampleSelection,
    power,
)
from allanite.filtering.regression import LEVEL, Regression
from allanite.lazy_dataclasses import dataclass
from allanite.noise import Flicker, NoiseModel, White
from allanite.recording.records import Recording

__all__ = [
    "Shape",
    "TableChannel",
    "TableSolution",
    "companions",
    "design",
    "fit_clock",
    "fit_noise",
    "shape_of",
    "solve",
]

Array = NDArray[np.float64]

#: Names of the shape columns that stand for the deviation from a straight line.
Shape = tuple[str, ...]
#: Steps of the search for the clock, and the change below which it stands still [s].
MOST_STEPS, STILL = 12, 1e-9
#: No clock runs this wrong: the search was led astray.
MOST_DRIFT = 0.01
#: Most rows of the search for the noise.
MOST_ROWS = 20_000


def shape_of(nonlinearity: int | str) -> Shape:
    """Columns beside the straight line."""
    return (ABSOLUTE,) if nonlinearity == "sign" else tuple(power(k) for k in range(2, int(nonlinearity) + 1))


@dataclass(frozen=True, slots=True, kw_only=True)
class TableSolution:
    """A fit with the rows that it was made of.

    Attributes
    ----------
    rows : RegressionRows
    fit : Regression
    shape : tuple of str
        Columns of the deviation from the straight line.
    """

    rows: RegressionRows
    fit: Regression
    shape: Shape

    @property
    def scale(self) -> tuple[float, float]:
        """Slope of the best straight line and its standard deviation, SI of the channel per rad/s."""
        value, sd = self.fit[RATE]
        return value / self.rows.full_scale, sd / self.rows.full_scale

    @property
    def bias(self) -> tuple[float, float]:
        """The response at rest and its standard deviation."""
        gradient = self.gradients(np.zeros(1))[0]
        gradient[self.fit.names.index(LEVEL)] = 1.0
        return self.combined(gradient)

    def combined(self, gradient: Array) -> tuple[float, float]:
        """A linear combination of the coefficients with its standard deviation."""
        touched = gradient != 0
        covariance = self.fit.covariance[np.ix_(touched, touched)]
        part = gradient[touched]
        return float(self.fit.coefficients[touched] @ part), math.sqrt(
            max(float(part @ covariance @ part), 0.0)
        )

    def of_scale(self, name: str) -> tuple[float, float]:
        """A coefficient over that of the rate, with its standard deviation."""
        i, j = self.fit.names.index(name), self.fit.names.index(RATE)
        c, k = self.fit.coefficients[i], self.fit.coefficients[j]
        if not (math.isfinite(c) and k):
            return math.nan, math.inf
        gradient = np.zeros(len(self.fit.names))
        gradient[i], gradient[j] = 1 / k, -c / k**2
        return float(c / k), self.combined(gradient)[1]

    def gradients(self, u: Array) -> Array:
        """Of the deviation from the straight line at rates over full scale, one row for each."""
        out = np.zeros((len(u), len(self.fit.names)))
        for name in self.shape:
            column = np.abs(u) if name == ABSOLUTE else u ** int(name.rpartition("^")[2])
            level, slope = self.rows.line(name)
            out[:, self.fit.names.index(name)] = column - level - slope * u
        return out

    def deviation(self, u: Array) -> tuple[Array, Array]:
        """Deviation from the best straight line over the scale factor times full scale, and standard deviation."""
        k = self.fit[RATE][0]
        at = [self.fit.names.index(name) for name in self.shape]
        part = self.gradients(u)[:, at]
        variance = np.einsum("ij,jk,ik->i", part, self.fit.covariance[np.ix_(at, at)], part)
        return part @ self.fit.coefficients[at] / k, np.sqrt(np.maximum(variance, 0.0)) / abs(k)

    def predicted(self, columns: dict[str, Array] | None = None) -> Array:
        """Response by the fit, of the blocks, or of other means of the columns."""
        of = self.rows.columns if columns is None else columns
        out = np.zeros_like(np.asarray(of[RATE], dtype=np.float64))
        for name, value in zip(self.fit.names, np.nan_to_num(self.fit.coefficients), strict=True):
            if name == LEVEL:
                out += value
            elif name in self.shape:
                level, slope = self.rows.line(name)
                out += value * (of[name] - level - slope * of[RATE])
            else:
                out += value * of[name]
        return out


def design(rows: RegressionRows, shape: Shape, others: Sequence[str]) -> tuple[Array, tuple[str, ...]]:
    """Columns of the regression with their names."""
    columns = [np.ones_like(rows.mean), rows.column(RATE), *(rows.straight(name) for name in shape)]
    columns += [rows.column(name) for name in others]
    return np.column_stack(columns), (LEVEL, RATE, *shape, *others)


def solve(rows: RegressionRows, model: NoiseModel, shape: Shape, others: Sequence[str] = ()) -> TableSolution:
    """The regression with these columns beside level and rate."""
    table, names = design(rows, shape, others)
    return TableSolution(rows=rows, fit=rows.regress(table, names, model), shape=shape)


def companions(temperature: str | None) -> tuple[str, ...]:
    """Columns that a temperature brings."""
    return () if temperature is None else (TEMPERATURE, WARM_RATE)


# -- the clock of a rate that changes all the time --------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class TableChannel:
    """A channel, the table that it follows, its noise where that is known, and the shape of its response."""

    recording: Recording
    channel: str
    table: RateTable
    model: NoiseModel | None
    shape: Shape

    def solved(self, window: SampleSelection, lags: tuple[str, ...]) -> TableSolution:
        """The fit with these columns for the clock."""
        noise = self.model or NoiseModel.of(White(N=1.0))
        rows = RegressionRows.of(self.recording, self.channel, self.table, window, model=noise)
        return solve(rows, noise, self.shape, lags)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockFit:
    """What the regression says of the clocks.

    Attributes
    ----------
    window : SampleSelection
        With the clock that was found.
    lags : tuple of str
        Columns that keep its uncertainty in the covariance.
    """

    window: SampleSelection
    lags: tuple[str, ...]


def fit_clock(follower: TableChannel, window: SampleSelection, alarm: float) -> ClockFit:
    """Offset of the clocks by Gauss and Newton; and their drift, where it takes more than `alarm` off chi-square."""
    window = _converged(follower, window, (LAG,))
    with_drift = follower.solved(window, (LAG, LATE))
    scale = with_drift.fit.chi2 / max(with_drift.fit.dof, 1) if follower.model is None else 1.0
    value, sd = with_drift.fit[LATE]
    if math.isfinite(sd) and (value / sd) ** 2 > alarm * max(scale, 1.0 if follower.model else 0.0):
        drifting = _converged(follower, window, (LAG, LATE))
        if abs(drifting.clock.drift) < MOST_DRIFT:
            return ClockFit(window=drifting, lags=(LAG, LATE))
    return ClockFit(window=window, lags=(LAG,))


def _converged(follower: TableChannel, window: SampleSelection, lags: tuple[str, ...]) -> SampleSelection:
    dt, duration = follower.recording.dt, follower.recording.duration
    for _ in range(MOST_STEPS):
        solution = follower.solved(window, lags)
        k = solution.fit[RATE][0]
        moved = [-solution.fit[name][0] / k for name in lags]
        if not all(map(math.isfinite, moved)):
            raise InputError(
                "the clocks of record and table cannot be compared: the rate hardly changes; give their offset "
                "(offset=0.0 where table and record share a clock)"
            )
        clock = window.clock
        # The lag at the record's time t is offset + drift t, to first order in both.
        drift = moved[1] if len(moved) > 1 else 0.0
        window = replace(window, clock=TableClock(offset=clock.offset + moved[0], drift=clock.drift + drift))
        still = max(STILL, min(1e-3 * abs(solution.fit[LAG][1] / k), 1e-2 * dt))
        if abs(moved[0]) < still and abs(drift) * duration < still:
            break
    return window


# -- noise of the record itself ---------------------------------------------------------------------------------


def fit_noise(rows: RegressionRows, shape: Shape, others: Sequence[str], kind: str) -> NoiseModel:
    """White noise and flicker from the record, by restricted maximum likelihood (Harville 1977).

    The contrasts in which no coefficient appears carry the likelihood: fitting the response does not make the noise
    look smaller.
    """
    from scipy.optimize import minimize

    part = slice(0, MOST_ROWS)
    short = replace(
        rows,
        mean=rows.mean[part],
        part=rows.part[part],
        trust=rows.trust[part],
        span=rows.span[part],
        time=rows.time[part],
        columns={name: column[part] for name, column in rows.columns.items()},
    )
    table, names = design(short, shape, others)
    steps = np.diff(short.mean)[
        (short.part[1:] == 1) & (short.part[:-1] == 1) & (short.span[1:] == short.span[:-1])
    ]
    steps = steps - np.median(steps) if len(steps) else steps
    spread = float(np.median(np.abs(steps))) if len(steps) >= 10 else 0.0
    if spread == 0:
        raise InputError(
            "the noise cannot be fitted to this record: it is too short, or its samples do not vary; give the noise "
            "model of the sensor at rest (--model)"
        )

    def model(logs: Array) -> NoiseModel:
        return NoiseModel.of(White(N=math.exp(logs[0])), Flicker(B=math.exp(logs[1])), kind=kind)

    def cost(logs: Array) -> float:
        fit = short.regress(table, names, model(logs))
        return math.inf if fit.log_likelihood is None else -fit.log_likelihood

    start = spread / 0.9539 * math.sqrt(rows.dt)
    guess = np.log([start, start / math.sqrt(100.0)])
    optimum = minimize(
        cost, guess, method="Nelder-Mead", options={"xatol": 0.01, "fatol": 0.02, "maxfev": 150}
    )
    return model(optimum.x)
