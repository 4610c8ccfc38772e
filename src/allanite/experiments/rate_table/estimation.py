# SPDX-License-Identifier: BSD-3-Clause
"""From a recording on a rate table to the response of the sensor: clocks, range, regression, checks, verdict."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.earth_rate.verdict import NoiseOrigin
from allanite.experiments.rate_table.checks import TableCheck
from allanite.experiments.rate_table.earth_part import EarthPart, not_whole
from allanite.experiments.rate_table.motion import RateSteps, RateTable, Sampled, Sinusoids, TableClock
from allanite.experiments.rate_table.parameters import Wide, curve, parameters_of
from allanite.experiments.rate_table.record.aided import aided_of
from allanite.experiments.rate_table.record.bandwidth import frequency_response
from allanite.experiments.rate_table.record.channels import channels_of, refuse_still, unit_of
from allanite.experiments.rate_table.record.clipping import Clipped, find_clipped
from allanite.experiments.rate_table.record.clocks import ClockComparison, Timing
from allanite.experiments.rate_table.record.fit import (
    Shape,
    TableChannel,
    TableSolution,
    companions,
    fit_noise,
    shape_of,
    solve,
)
from allanite.experiments.rate_table.record.rows import ABSOLUTE, LAG, LATE, POWERS, RATE, RegressionRows
from allanite.experiments.rate_table.record.timing import CoarseOffset, coarse_offset
from allanite.experiments.rate_table.residual_checks import (
    agreement_checks,
    noise_by_rate,
    noise_checks,
    regression_checks,
    trust_by_rate,
)
from allanite.experiments.rate_table.results import (
    Aided,
    Clipping,
    FrequencyPoint,
    NoiseAtRate,
    RateTableEstimate,
    ResponseParameter,
    StepResult,
    TableMotion,
    TableUncertainty,
)
from allanite.experiments.rate_table.shown import response_points, step_results
from allanite.experiments.rate_table.step_means import StepMeans
from allanite.experiments.rate_table.verdict import TableCheckKind, TableVerdict
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.given_models import models_of
from allanite.quantities.residual_tests import FOREIGN
from allanite.recording.records import Kind, Recording
from allanite.recording.thermometers import checked_thermometer

__all__ = ["measure_rate_table"]

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

_SCATTERS = (TableCheckKind.STEPS, TableCheckKind.REPEATS, TableCheckKind.SHAPE, TableCheckKind.POWERS)


def measure_rate_table(
    recording: Recording,
    *,
    table: RateTable,
    channel: str | None = None,
    model: NoiseModel | Mapping[str, NoiseModel] | None = None,
    nonlinearity: int | str = 2,
    cross_axes: Sequence[str] | None = None,
    temperature: str | None = None,
    offset: float | None = None,
    dead_time: float | None = None,
    axis: str = "vertical",
    latitude: float | None = None,
    stated: TableUncertainty | None = None,
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> RateTableEstimate:
    """Scale factor, bias, nonlinearity, asymmetry and misalignment of a sensor on a rate table.

    Parameters
    ----------
    recording : Recording
        Rates, or volts or counts: the scale factor is then in the unit of the channel per rad/s.
    table : RateSteps, Sampled or Sinusoids
        Motion of the table, by its own clock (`read_rate_table`).
    channel : str, optional
        The channel on the table's axis; of several the one that responds most.
    model : NoiseModel or mapping of channel name to NoiseModel, optional
        Noise at rest, in the unit of the channel. Without it white noise and flicker are fitted to this very record,
        and the intervals are widened for that.
    nonlinearity : int or "sign"
        Degree of the polynomial, 1 (a straight line) to 5; or two straight lines that meet at zero.
    cross_axes : sequence of str, optional
        Other channels on the table, whose response is a misalignment; by default all of the same kind.
    temperature : str, optional
        Name of a temperature channel: scale factor and bias may follow it.
    offset : float, optional [s]
        Time of the record when the table's clock shows zero; by default found. 0.0: one clock for both.
    dead_time : float, optional [s]
        Time left out after each change of the rate; by default as long as the sensor needs to settle.
    axis : "vertical", "up", "down", "horizontal" or "unknown"
        Axis of the table, for the Earth's part.
    latitude : float, optional [rad]
        Latitude, for the Earth's part.
    stated : TableUncertainty, optional
        Uncertainties of the table's rate, and of the axis on it.
    confidence : float
        Confidence level of the intervals.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Returns
    -------
    RateTableEstimate

    Raises
    ------
    InputError
        No channel, or no choice; a model of another kind of sensor; times of table and record that do not overlap.

    Notes
    -----
    y = bias + k x + k x_F (c_2 u^2 + ...) + X c + noise, by `allanite.filtering.regression.regress` on block means.
    Scatter of repeats or of rates beyond the noise model widens the intervals by the root of chi-square over its
    expectation; noise that grows with the rate takes weight off the samples at such rates. A rate that changes all the
    time carries the offset of the clocks as a coefficient, whose uncertainty is in all the others.
    """
    _refuse(nonlinearity, confidence, offset, dead_time)
    advance = progress or (lambda fraction, what: None)
    earth, sure = EarthPart(axis, latitude), stated or TableUncertainty()
    advance(0.0, "looking for the channel")
    name, others = channels_of(recording, table, channel, cross_axes)
    if temperature is not None:
        checked_thermometer(recording, temperature, (name, *others))
    refuse_still(recording, name)
    given = models_of(model, {name: recording[name].kind}).get(name)
    used = _fitted_part(table)
    shape = shape_of(nonlinearity)
    advance(0.1, "comparing the clocks")
    coarse = coarse_offset(recording, name, table) if offset is None else CoarseOffset(offset=offset)
    follower = TableChannel(recording=recording, channel=name, table=used, model=given, shape=shape)
    clocks = ClockComparison(start=coarse.offset, offset=offset, dead_time=dead_time)
    timing = clocks.timing(follower)
    clipped = find_clipped(recording, name, used, timing.window)
    if clipped.any:
        timing = clocks.without(clipped, follower, timing)
    advance(0.4, "averaging")
    made = _Measurement(
        recording=recording,
        channel=name,
        table=used,
        whole=table,
        timing=timing,
        coarse=coarse,
        clipped=clipped,
        shape=shape,
        temperature=temperature,
        earth=earth,
        stated=sure,
        confidence=confidence,
        given=given,
        nonlinearity=nonlinearity,
        offset=offset,
    )
    return made.estimate(others, model, advance)


def _refuse(
    nonlinearity: int | str,
    confidence: float,
    offset: float | None,
    dead_time: float | None,
) -> None:
    highest = POWERS - 2
    if nonlinearity != "sign" and (
        isinstance(nonlinearity, (str, bool)) or not 1 <= int(nonlinearity) <= highest
    ):
        raise InputError(f"nonlinearity is a degree from 1 to {highest}, or 'sign', not {nonlinearity!r}")
    if not 0.5 <= confidence < 1:
        raise InputError(f"confidence must be from 0.5 to below 1, not {confidence!r}")
    if dead_time is not None and not (math.isfinite(dead_time) and dead_time >= 0):
        raise InputError(f"dead_time must be finite and not negative [s], not {dead_time!r}")
    if offset is not None and not math.isfinite(offset):
        raise InputError(f"offset must be finite [s], not {offset!r}")


def _fitted_part(table: RateTable) -> RateTable:
    """What the response is fitted to: of sinusoids the lowest frequency, for what is above may be beyond the sensor's
    bandwidth; of what an encoder saw the stretches of constant rate, where nearly all of it is such.
    """
    if isinstance(table, Sinusoids):
        return table.of(table.frequency <= float(table.frequency.min()) * (1 + 1e-9))
    return (table.plateaus() or table) if isinstance(table, Sampled) else table


# -- the measurement --------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Measurement:
    """What was chosen and found before the fit."""

    recording: Recording
    channel: str
    table: RateTable
    whole: RateTable
    timing: Timing
    coarse: CoarseOffset
    clipped: Clipped
    shape: Shape
    temperature: str | None
    earth: EarthPart
    stated: TableUncertainty
    confidence: float
    given: NoiseModel | None
    nonlinearity: int | str
    offset: float | None

    @property
    def others(self) -> tuple[str, ...]:
        """Columns beside level, rate and shape."""
        return (*companions(self.temperature), *self.timing.lags)

    def rows(self, channel: str, model: NoiseModel | None) -> RegressionRows:
        return RegressionRows.of(
            self.recording, channel, self.table, self.timing.window, model=model, temperature=self.temperature
        )

    def estimate(
        self, cross: Sequence[str], models: NoiseModel | Mapping[str, NoiseModel] | None, advance: Progress
    ) -> RateTableEstimate:
        facts = self.recording[self.channel]
        rows = self.rows(self.channel, self.given)
        if self.given is None:
            advance(0.5, "fitting the noise of this record")
            model = fit_noise(rows, self.shape, self.others, facts.kind)
        else:
            model = self._wider(rows, self.given)
        advance(0.6, "fitting the response")
        solution, by_rate = self._solved(rows, model)
        steps = self._steps(solution, model)
        checks = (
            *agreement_checks(solution),
            *noise_checks(by_rate),
            *(steps.checks() if steps is not None else ()),
            *self._regression_checks(solution, model),
        )
        wide = self._wide(solution, checks, steps)
        budget, bias_stated = self._budget(solution, wide, steps, model)
        parameters = self._parameters(solution, model, wide, budget, bias_stated)
        advance(0.8, "other channels")
        parameters += [self._misalignment(name, models, solution, wide) for name in cross]
        parameters += self._clocks(solution, wide)
        aided = aided_of(self.recording, self.channel, self.table, solution, model)
        estimate = self._result(solution, model, wide, checks, budget, tuple(parameters), aided, steps)
        return replace(
            estimate,
            noise_by_rate=by_rate,
            frequencies=self._frequencies(model),
            verdict=_verdict(estimate, separable=not solution.fit.unbounded),
        )

    # -- fit ----------------------------------------------------------------------------------------------

    def _wider(self, rows: RegressionRows, model: NoiseModel) -> NoiseModel:
        """Of the families that the record at rest leaves open, the one with the wider interval."""
        families = model.families
        if len(families) == 1:
            return model
        return max(families, key=lambda m: solve(rows, m, self.shape, self.others).fit[RATE][1])

    def _solved(
        self, rows: RegressionRows, model: NoiseModel
    ) -> tuple[TableSolution, tuple[NoiseAtRate, ...]]:
        """The fit, and the noise by rate; where that depends on the rate, fitted again with weights for it."""
        solution = solve(rows, model, self.shape, self.others)
        by_rate = noise_by_rate(solution, model)
        trust = trust_by_rate(rows, by_rate)
        if trust is not None:
            solution = solve(rows.trusting(trust), model, self.shape, self.others)
        return solution, by_rate

    def _steps(self, solution: TableSolution, model: NoiseModel) -> StepMeans | None:
        if not isinstance(self.table, RateSteps) or solution.fit.unbounded:
            return None
        sampling = self.recording[self.channel].sampling
        return StepMeans.of(self.table, solution, model, self.recording.rate, sampling)

    def _regression_checks(self, solution: TableSolution, model: NoiseModel) -> tuple[TableCheck, ...]:
        if solution.fit.unbounded:
            return ()
        steps = self.table if isinstance(self.table, RateSteps) else None
        return regression_checks(solution, model, self.others, steps=steps)

    def _wide(self, solution: TableSolution, checks: Sequence[TableCheck], steps: StepMeans | None) -> Wide:
        """Factor and law of the intervals: Student's where the scatter of the record decides how wide they are."""
        failed = [c for c in checks if c.widens and not c.passed]
        inflation = max([1.0, *(c.ratio for c in failed)])
        dof = math.inf
        scatter = [c for c in checks if c.kind in _SCATTERS]
        if steps is not None and self.given is None:
            inflation = max([inflation, *(c.ratio for c in scatter)])
            dof = max([c.dof for c in scatter], default=1.0)
        elif self.given is None:
            dof = max(len(self.table.spans) * 2.0, 10.0)
        elif inflation > FOREIGN:
            dof = min([c.dof for c in failed if c.ratio == inflation], default=math.inf)
        return Wide(confidence=self.confidence, inflation=inflation, dof=dof)

    # -- numbers ------------------------------------------------------------------------------------------

    def _budget(
        self, solution: TableSolution, wide: Wide, steps: StepMeans | None, model: NoiseModel
    ) -> tuple[dict[str, float], float]:
        """Standard uncertainties of the scale factor, relative; and the Earth's in the bias, in SI of the channel."""
        k, sd = solution.scale
        if not (math.isfinite(k) and k):
            return {"noise": math.inf}, 0.0
        noise = sd * wide.inflation / abs(k)
        budget = {"noise": noise}
        if self.timing.lags:
            alone = (
                solve(solution.rows, model, self.shape, companions(self.temperature)).scale[1]
                * wide.inflation
                / abs(k)
            )
            budget = {"noise": min(alone, noise), "clock": math.sqrt(max(noise**2 - alone**2, 0.0))}
        budget |= self.stated.budget()
        bias = 0.0
        if steps is not None and isinstance(self.table, RateSteps) and self.stated.misalignment:
            length = solution.rows.steps[steps.number, 3] - solution.rows.steps[steps.number, 2]
            wobble, level = self.earth.wobble(
                self.table, steps.number, length / self.recording.rate, self.stated.misalignment
            )
            budget["Earth, turns that are not whole"] = wobble
            bias = level * abs(k)
        return budget, bias

    def _parameters(
        self,
        solution: TableSolution,
        model: NoiseModel,
        wide: Wide,
        budget: Mapping[str, float],
        bias_stated: float,
    ) -> list[ResponseParameter]:
        facts = self.recording[self.channel]
        unit = unit_of(facts)
        stated = {name: value for name, value in budget.items() if name not in ("noise", "clock")}
        nominal = 1.0 if facts.kind is Kind.RATE else None
        out = parameters_of(
            solution,
            wide,
            unit=unit,
            budget=stated,
            nominal=self._nominal(solution, nominal),
            bias_stated=bias_stated,
        )
        if self.earth.along is not None and self.earth.axis != "vertical":
            k, sd = solution.scale
            level, coefficient_sd = solution.bias
            moved = (level - k * self.earth.along, math.hypot(coefficient_sd, sd * self.earth.along))
            out.append(wide.parameter("bias without the Earth", moved, unit, stated=bias_stated))
        if ABSOLUTE not in self.shape:
            rows = solution.rows
            odd = tuple(n for n in self.shape if int(n.rpartition("^")[2]) % 2)
            both = solve(rows, model, (ABSOLUTE, *odd), self.others)
            if out[0].resolved:
                value, coefficient_sd = both.of_scale(ABSOLUTE)
                out.append(wide.parameter("asymmetry", (2 * value, 2 * coefficient_sd), "1"))
        return out

    def _nominal(self, solution: TableSolution, nominal: float | None) -> float | None:
        """Of a sensor that is mounted the other way round, minus what its unit says."""
        return None if nominal is None else math.copysign(nominal, solution.scale[0])

    def _misalignment(
        self,
        name: str,
        models: NoiseModel | Mapping[str, NoiseModel] | None,
        solution: TableSolution,
        wide: Wide,
    ) -> ResponseParameter:
        """Response of another channel to the table, over that which it would have along the axis."""
        facts = self.recording[name]
        given_model = models_of(models, {name: facts.kind}).get(name)
        rows = self.rows(name, given_model)
        others = companions(self.temperature)
        noise = (
            fit_noise(rows, self.shape, others, facts.kind)
            if given_model is None
            else self._wider(rows, given_model)
        )
        other, by_rate = self._solved(rows, noise)
        checks = noise_checks(by_rate)[:1]
        k, sd = other.scale
        along = abs(solution.scale[0]) if facts.kind is not Kind.RATE else 1.0
        inflation = max([1.0, *(c.ratio for c in checks if not c.passed)])
        limits = replace(wide, inflation=inflation)
        return limits.parameter(f"misalignment of {name}", (k / along, sd / along), "rad")

    def _clocks(self, solution: TableSolution, wide: Wide) -> list[ResponseParameter]:
        """Offset and drift of the clocks where they were found: from the edges, or by the coefficients of the fit."""
        timing = self.timing
        if not math.isfinite(timing.observed_offset):
            return []
        clock, sd, drift_sd = timing.window.clock, timing.offset_sd, timing.drift_sd
        if timing.lags:
            sd, drift_sd = (
                abs(solution.fit[n][1] / solution.fit[RATE][0]) if n in timing.lags else math.inf
                for n in (LAG, LATE)
            )
        limits = replace(wide, inflation=wide.inflation if timing.lags else 1.0)
        given = self.offset
        name, value = (
            ("clock offset", timing.observed_offset)
            if given is None
            else ("delay", timing.observed_offset - given)
        )
        out = [limits.parameter(name, (value, sd), "s", stated=timing.between)]
        if math.isfinite(drift_sd) and clock.drift:
            out.append(limits.parameter("clock drift", (clock.drift, drift_sd), "1"))
        return out

    def _frequencies(self, model: NoiseModel) -> tuple[FrequencyPoint, ...]:
        if not isinstance(self.whole, Sinusoids) or len(self.whole.start) < 2:
            return ()
        window = replace(self.timing.window, chosen=None)
        if self.offset is not None:  # the phase is the sensor's own
            window = replace(window, clock=TableClock(offset=self.offset))
        return frequency_response(self.recording, self.channel, self.whole, window, model)

    # -- result -------------------------------------------------------------------------------------------

    def _result(
        self,
        solution: TableSolution,
        model: NoiseModel,
        wide: Wide,
        checks: tuple[TableCheck, ...],
        budget: dict[str, float],
        parameters: tuple[ResponseParameter, ...],
        aided: tuple[Aided, Array] | None,
        steps: StepMeans | None,
    ) -> RateTableEstimate:
        facts, rows = self.recording[self.channel], solution.rows
        u = rows.column(RATE)[rows.used]
        answers = parameters[0].resolved  # to the table: else nothing can be said relative to it
        results: tuple[StepResult, ...] = ()
        if isinstance(self.table, RateSteps):
            results = step_results(
                self.table, rows, steps, self.timing.window, self.clipped, None if aided is None else aided[1],
                self.recording,
            )  # fmt: skip
        return RateTableEstimate(
            channel=self.channel,
            source=self.recording.source,
            kind=facts.kind.value,
            unit=facts.unit,
            channel_scale=facts.scale,
            verdict=TableVerdict.NOT_SEPARABLE,
            parameters=parameters,
            confidence=self.confidence,
            inflation=wide.inflation,
            budget=budget,
            nonlinearity=str(self.nonlinearity),
            nominal=self._nominal(solution, 1.0 if facts.kind is Kind.RATE else None),
            full_scale=rows.full_scale,
            span=float(np.ptp(u)) * rows.full_scale,
            checks=checks,
            steps=results,
            points=response_points(solution, steps, model) if answers else (),
            fitted=curve(solution, wide) if answers else np.zeros((0, 3)),
            aided=None if aided is None else aided[0],
            table=TableMotion.from_json(self.whole.to_json()),
            clock=self.timing.source,
            clipped=_clipping(self.clipped, self.table),
            other_offsets=self.coarse.others,
            either_sign=self.coarse.either_sign,
            loop_alike=LAG in self.timing.lags and isinstance(self.whole, Sampled),
            settled=self.timing.settles,
            not_whole=self._not_whole(rows),
            dead_time=self.timing.window.dead_time,
            guard=self.timing.window.guard,
            axis=self.earth.axis,
            earth=self.earth.along,
            model=model,
            model_source=NoiseOrigin.RECORD if self.given is None else NoiseOrigin.GIVEN,
            duration=self.recording.duration,
            block=rows.dt,
        )

    def _not_whole(self, rows: RegressionRows) -> int:
        """Steps over which the Earth across the axis does not average, where it matters."""
        if not (isinstance(self.table, RateSteps) and self.earth.axis in ("horizontal", "unknown")):
            return 0
        used = np.flatnonzero(rows.steps[:, 0] > 0)
        length = (rows.steps[used, 3] - rows.steps[used, 2]) / self.recording.rate
        return not_whole(self.table, used, length)


def _clipping(clipped: Clipped, table: RateTable) -> Clipping | None:
    if not clipped.any:
        return None
    ends = tuple(end for end in clipped.ends if end is not None)
    if isinstance(table, RateSteps):
        rates = table.rate[clipped.steps].tolist()
        distinct = {round(math.degrees(rate), 6): rate for rate in rates}
        return Clipping(ends=ends, steps=len(rates), rates=tuple(distinct[r] for r in sorted(distinct)))
    sides = tuple(x for x in (clipped.below, clipped.above) if math.isfinite(x))
    return Clipping(ends=ends, steps=0, rates=sides)


def _verdict(estimate: RateTableEstimate, *, separable: bool) -> TableVerdict:
    if not separable:
        return TableVerdict.NOT_SEPARABLE
    if not estimate["scale factor"].resolved:
        return TableVerdict.NOT_RESOLVED
    return TableVerdict.INCONSISTENT if any(c.grave for c in estimate.checks) else TableVerdict.RESOLVED
