# SPDX-License-Identifier: BSD-3-Clause
"""From a recording and its temperature to coefficients, a warm-up, and a residual whose noise is the sensor's own."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, FitError, InputError
from allanite.filtering.regression import LEVEL
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.probabilities import require_probabilities
from allanite.recording.records import Recording
from allanite.stability.environment.climate import Climate
from allanite.stability.environment.correction import correction_of
from allanite.stability.environment.design import (
    BRANCH,
    DRIFT,
    QUADRATIC,
    RATE,
    TEMPERATURE,
    EnvironmentDesign,
    WarmUpDecay,
)
from allanite.stability.environment.effect import Effect, Freed
from allanite.stability.environment.noise_left_open import Noise, Weighed
from allanite.stability.environment.questions import coefficient_of, hysteresis_of, lag_of
from allanite.stability.environment.results import (
    Coefficient,
    EnvironmentEstimate,
    EnvironmentSeries,
    FreedRecording,
    Hysteresis,
    Lag,
    WarmUp,
)
from allanite.stability.environment.verdict import CoefficientCause
from allanite.stability.environment.warming import (
    look_for_warm_up,
    offered,
    refined,
    settled_after,
    settles,
    terms_of,
    together,
)

__all__ = ["free_of_environment", "regress_environment", "warm_up_left_in", "warm_ups_to_cut"]

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]
Treatment = Literal["model", "cut"] | None

#: A column that makes the interval of the temperature's coefficient so many times longer is left out, and it is said.
MOST_INFLATION = 2.0
#: From so many times longer an interval on, by a drift beside it, the temperature went with time.
WENT_WITH_TIME = 1.5
#: Part of the noise of the thermometer that is left in its smoothed readings; see `Climate.noise_left`.
LEFT = "noise of the thermometer"
#: Part of a record that a cut has to leave.
REMAINING = 0.25
#: Curvature and rate are removed below this probability: a record has both of them to try.
SURE = 0.01
#: A second exponential is fitted below this probability.
SECOND = 0.01
#: A warm-up that was not asked about is found below this probability: every record is looked through for it.
UNASKED = 1e-3
#: Instants of the picture.
INSTANTS = 800


def regress_environment(
    recording: Recording,
    *,
    temperature: str | None = None,
    warm_up: Treatment = None,
    channel: str | None = None,
    model: NoiseModel | None = None,
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> EnvironmentEstimate:
    """What temperature and warm-up do to one channel, and the channel without it.

    Parameters
    ----------
    recording : Recording
        Recording to analyze.
    temperature : str, optional
        Channel of a thermometer.
    warm_up : "model", "cut" or None
        Treatment of a warm-up. With None it is tested and reported, and stays in the record.
    channel : str, optional
        Needed where several channels carry sensor noise.
    model : NoiseModel, optional
        Noise model of the sensor from another source; by default white noise, flicker and random walk are fitted to
        this record.
    confidence : float
        Confidence level of the intervals.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Returns
    -------
    EnvironmentEstimate

    Raises
    ------
    InputError
        Channels that are not there or of the wrong kind, another word for `warm_up`, a confidence outside 0 to 1.
    DataQualityError
        Too few samples, or a warm-up that is to be cut and fills the record.

    Notes
    -----
    Generalised least squares on the means of some 1500 blocks (`allanite.filtering.regression`) of level, drift, T,
    T^2, dT/dt and, with `warm_up` "model", exponentials; see `allanite.stability.environment.design`. All of them take
    part in every interval; only what is resolved is removed, curvature and rate where p < 0.01. The noise is averaged
    over what the record leaves open of it; see `allanite.stability.environment.noise_left_open`. The drift is a
    nuisance and stays: a sensor may drift by itself.
    """
    if warm_up not in (None, "model", "cut"):
        raise InputError(f"warm_up must be 'model', 'cut' or None, not {warm_up!r}")
    require_probabilities(confidence=confidence)
    name = _channel(recording, channel, temperature)
    advance = progress or (lambda fraction, what: None)
    case = _Case(
        recording=recording, channel=name, temperature=temperature, model=model, confidence=confidence
    )
    advance(0.0, f"warm-up of {name}")
    warming, decays, near = case.warming(warm_up)
    if warming.action == "cut" and warming.cut is not None:
        case = replace(case, recording=recording.window(warming.cut))
    advance(0.5, f"temperature of {name}")
    return case.estimate(warming, decays, near)


def free_of_environment(
    recording: Recording,
    *,
    channels: Sequence[str],
    temperature: str | Mapping[str, str] | None = None,
    warm_up: Treatment = None,
    cuts: Mapping[str, WarmUp] | None = None,
    models: Mapping[str, NoiseModel] | None = None,
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> FreedRecording:
    """Several channels of one recording without the effects of their environment.

    Parameters
    ----------
    temperature : str or mapping of channel to str, optional
        One thermometer for all, or one for each; a channel without one is left alone but for its warm-up.
    warm_up : "model", "cut" or None
        A cut is one for all channels: that of the one that takes longest.
    cuts : mapping of channel to WarmUp, optional
        What `warm_ups_to_cut` said of a record that was cut already.

    Returns
    -------
    FreedRecording
    """
    advance = progress or (lambda fraction, what: None)
    thermometers = {c: _thermometer(recording, temperature, c) for c in channels}
    if isinstance(temperature, Mapping):
        _refuse_strangers(temperature, recording)
    known = models or {}
    if warm_up == "cut" and cuts is None:
        cuts = warm_ups_to_cut(
            recording, channels=channels, temperature=temperature, models=models, confidence=confidence
        )
        last = max((w.cut or 0.0 for w in cuts.values()), default=0.0)
        recording = recording.window(last) if last > 0 else recording
    estimates: dict[str, EnvironmentEstimate] = {}
    for i, name in enumerate(channels):
        advance(i / len(channels), f"environment of {name}")
        environment = regress_environment(
            recording,
            channel=name,
            temperature=thermometers[name],
            warm_up="model" if warm_up == "model" else None,
            model=known.get(name),
            confidence=confidence,
        )
        if cuts is not None:
            environment = replace(environment, warm_up=cuts[name])
        estimates[name] = environment
        recording = environment.residual
    return FreedRecording(residual=recording, estimates=tuple(estimates.values()))


def warm_ups_to_cut(
    recording: Recording,
    *,
    channels: Sequence[str],
    temperature: str | Mapping[str, str] | None = None,
    models: Mapping[str, NoiseModel] | None = None,
    confidence: float = 0.95,
) -> dict[str, WarmUp]:
    """The warm-up of each channel, all with the latest time from which none of them warms up any more.

    Raises
    ------
    DataQualityError
        A warm-up that fills the record.
    """
    warm_ups = {}
    for name in channels:
        case = _Case(
            recording=recording,
            channel=name,
            temperature=_thermometer(recording, temperature, name),
            model=(models or {}).get(name),
            confidence=confidence,
        )
        warm_ups[name] = case.warming("cut")[0]
    last = max((w.cut or 0.0 for w in warm_ups.values()), default=0.0)
    if last == 0:
        return warm_ups
    return {n: replace(w, action="cut", cut=last) for n, w in warm_ups.items()}


def warm_up_left_in(recording: Recording, channel: str) -> WarmUp | None:
    """The warm-up of a channel whose environment nobody asked about; None without one.

    It stays in the record. A record that is too short to show one has none, nor has a channel of running sums (angles,
    phases).
    """
    case = _Case(recording=recording, channel=channel, temperature=None, model=None, confidence=0.95)
    try:
        if not settles(Climate.of(recording, channel, None), UNASKED):
            return None
        warm = case.warming(None)[0]
    except (InputError, DataQualityError, FitError):
        return None
    return warm if warm.found and (warm.p or 0.0) < UNASKED else None


def _channel(recording: Recording, channel: str | None, temperature: str | None) -> str:
    if channel is not None:
        recording.index(channel)
        return channel
    able = [c.name for c in recording.channels if c.kind.noise_bearing and c.name != temperature]
    if len(able) != 1:
        raise InputError(
            f"choose a channel: there are {', '.join(able)}" if able else "no channel carries sensor noise"
        )
    return able[0]


def _thermometer(recording: Recording, given: str | Mapping[str, str] | None, channel: str) -> str | None:
    name = given.get(channel) if isinstance(given, Mapping) else given
    if name is not None:
        recording.index(name)
    return name


def _refuse_strangers(given: Collection[str], recording: Recording) -> None:
    for name in given:
        recording.index(name)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Case:
    """One channel with its thermometer."""

    recording: Recording
    channel: str
    temperature: str | None
    model: NoiseModel | None
    confidence: float

    # -- warm-up ------------------------------------------------------------------------------------------

    def warming(self, treatment: Treatment) -> tuple[WarmUp, tuple[WarmUpDecay, ...], NoiseModel | None]:
        """The warm-up, the exponentials of the regression, and the noise that was found on the way."""
        climate = Climate.of(self.recording, self.channel, self.temperature)
        decays = offered(climate)
        design = EnvironmentDesign(climate=climate, decays=decays)
        names = _names_of(climate)
        noise = Noise.of(
            climate, design.blocks, design.names, design=[*names, *together(decays)], model=self.model
        )
        base = _base(noise, names)
        look = look_for_warm_up(noise, base, decays)
        if not look.found:
            none = WarmUp(found=False, p=look.p, terms=(), action="none found", cut=None, tries=look.tries)
            return none, (), noise.best
        fitted = self._exponentials(climate, noise, base, look.best)
        design = EnvironmentDesign(climate=climate, decays=fitted)
        noise = Noise.of(
            climate,
            design.blocks,
            design.names,
            design=[*base, *(n for d in fitted for n in d.names)],
            model=self.model,
            near=noise.best,
        )
        terms = terms_of(noise, base, fitted)
        length = climate.size * climate.dt
        cut = settled_after(terms, noise.best, length)
        made = WarmUp(
            found=True, p=look.p, terms=terms, action="left in", cut=None, settled=cut, tries=look.tries
        )
        if treatment is None:
            return made, (), noise.best
        if treatment == "model":
            return replace(made, action="modelled"), fitted, noise.best
        if cut > (1 - REMAINING) * length:
            raise DataQualityError(
                f"{self.channel}: the warm-up takes {cut:.3g} s of a record of {length:.3g} s: the rest "
                "is too short to characterize; model it (--warm-up model), or record longer"
            )
        return replace(made, action="cut", cut=cut), (), noise.best

    def _exponentials(
        self, climate: Climate, noise: Noise, base: Sequence[str], first: WarmUpDecay
    ) -> tuple[WarmUpDecay, ...]:
        """One exponential with its time constant fitted, or two where the record asks for a second one."""
        plain = EnvironmentDesign(climate=climate)
        columns = np.column_stack(
            [np.ones(climate.size), plain.blocks[:, [plain.names.index(n) for n in base]]]
        )
        one = refined(climate, columns, noise.best, [first])
        more = [d for d in offered(climate) if not 1 / 3 < d.T / one[0].T < 3]
        design = EnvironmentDesign(climate=climate, decays=(*one, *more))
        beside = [*base, *(n for d in one for n in d.names)]
        again = Noise.of(
            climate, design.blocks, design.names, design=[*beside, *together(more)], model=self.model, near=noise.best
        )  # fmt: skip
        if more:
            look = look_for_warm_up(again, beside, more)
            if look.p < SECOND:
                return refined(climate, columns, again.best, [*one, look.best])
        return one

    # -- temperature --------------------------------------------------------------------------------------

    def estimate(
        self, warming: WarmUp, decays: tuple[WarmUpDecay, ...], near: NoiseModel | None
    ) -> EnvironmentEstimate:
        """Coefficients, what is removed, and the residual."""
        climate = Climate.of(self.recording, self.channel, self.temperature)
        design = EnvironmentDesign(climate=climate, decays=decays)
        tails = [n for d in decays for n in d.names]
        columns = np.column_stack([design.blocks, climate.noise_left])
        noise = Noise.of(
            climate,
            columns,
            (*design.names, LEFT),
            design=[*_names_of(climate), *tails],
            model=self.model,
            near=near,
        )
        base = _base(noise, _names_of(climate), tails)
        noise, design = _at_best_reference(noise, design, [*base, *tails])
        hysteresis: Hysteresis | None = None
        lag: Lag | None = None
        if TEMPERATURE in base:
            hysteresis = hysteresis_of(climate, noise, [*base, *tails], self.confidence)
            if hysteresis.status == "found":
                base.append(BRANCH)
        names = [*base, *tails]
        fit = noise.fit(names)
        coefficients = self._coefficients(noise, fit, base, tails, climate)
        if TEMPERATURE in base:
            lag = lag_of(fit, self.confidence)
        taken = [c.name for c in coefficients if _worth_taking(c)] + tails
        effect, correction, residual = self._freed(noise, fit, design, taken, climate)
        return EnvironmentEstimate(
            channel=self.channel,
            kind=self.recording[self.channel].kind.value,
            unit=self.recording[self.channel].unit,
            confidence=self.confidence,
            thermometer=climate.thermometer,
            reference=_reference(climate, design),
            coefficients=coefficients,
            attenuation=_attenuation(noise, base),
            lag=lag,
            hysteresis=hysteresis,
            warm_up=warming,
            model=replace(noise.best, kind=self._kind),
            model_given=self.model is not None,
            taken_off=tuple(taken),
            correction=correction,
            effect=effect,
            residual=residual,
            series=_series(climate, effect),
        )

    @property
    def _kind(self) -> str:
        return self.recording[self.channel].kind.value

    def _coefficients(
        self, noise: Noise, fit: Weighed, base: Sequence[str], tails: Sequence[str], climate: Climate
    ) -> tuple[Coefficient, ...]:
        if climate.thermometer is None:
            return ()
        coefficients = []
        for name in (TEMPERATURE, QUADRATIC, RATE):
            if name in base:
                coefficients.append(coefficient_of(fit, name, self.confidence))
            else:
                coefficients.append(_unknown(name, _why(name, climate)))
        first = coefficients[0]
        others = [n for n in (*base, *tails) if n not in (TEMPERATURE, DRIFT)]
        if first.status == "not resolved" and noise.inflation(TEMPERATURE, others, DRIFT) > WENT_WITH_TIME:
            alone = noise.fit([TEMPERATURE, *others])
            given = coefficient_of(alone, TEMPERATURE, self.confidence)
            if given.status == "resolved":
                coefficients[0] = replace(first, status="not separable", cause=CoefficientCause.DRIFT)
        return tuple(coefficients)

    def _freed(
        self, noise: Noise, fit: Weighed, design: EnvironmentDesign, taken: Sequence[str], climate: Climate
    ) -> tuple[Effect | None, Any, Recording]:
        if not taken:
            return None, None, self.recording
        i = self.recording.index(self.channel)
        facts = self.recording.channels[i]
        which = np.array([fit.names.index(n) for n in taken])
        values = fit.mean[which]
        effect = Effect(design=design, names=tuple(taken), values=values)
        columns = design.blocks[:, [design.names.index(n) for n in fit.names]]
        correction = correction_of(
            columns, fit.covariance, which, values, noise.best, climate.blocks.mean, climate.dt
        )
        freed = Freed(
            of=self.recording.columns[i],
            effect=effect,
            scale=facts.scale,
            dt=self.recording.dt,
            delay=0.5 if facts.sampling == "mean" else 0.0,
        )
        step = {
            "step": "environment",
            "channel": self.channel,
            "temperature": self.temperature,
            "taken_off": {n: float(v) for n, v in zip(taken, values, strict=True)},
        }
        columns_now = (*self.recording.columns[:i], freed, *self.recording.columns[i + 1 :])
        return (
            effect,
            correction,
            replace(self.recording, columns=columns_now, history=(*self.recording.history, step)),
        )


def _worth_taking(c: Coefficient) -> bool:
    """The coefficient of the temperature where it is resolved, those beside it where there is hardly a doubt."""
    return c.status == "resolved" and (c.name == TEMPERATURE or (c.p is not None and c.p < SURE))


def _names_of(climate: Climate) -> list[str]:
    """Columns that are tried: of a temperature that is constant, none."""
    if climate.thermometer is None or climate.thermometer.constant:
        return [DRIFT]
    return [DRIFT, TEMPERATURE, RATE, QUADRATIC]


def _base(noise: Noise, names: Sequence[str], tails: Sequence[str] = ()) -> list[str]:
    """Columns that the record can tell apart, and that do not drown the coefficient of the temperature."""
    base = [DRIFT]
    if TEMPERATURE not in names:
        return base
    if not noise.separable(TEMPERATURE, [*base, *tails]):
        return base
    base.append(TEMPERATURE)
    if (
        noise.separable(RATE, [*base, *tails])
        and noise.inflation(TEMPERATURE, [DRIFT, *tails], RATE) < MOST_INFLATION
    ):
        base.append(RATE)
    if noise.separable(QUADRATIC, [*base, *tails]):
        base.append(QUADRATIC)
    return base


def _at_best_reference(
    noise: Noise, design: EnvironmentDesign, names: Sequence[str]
) -> tuple[Noise, EnvironmentDesign]:
    """The reference temperature at which slope and curvature are not correlated: the slope is best known there."""
    if QUADRATIC not in names:
        return noise, design
    others = [n for n in names if n not in (TEMPERATURE, QUADRATIC)]
    products = noise.products([TEMPERATURE, QUADRATIC], others)
    warmth = design.climate.warmth
    r = float(np.clip(products[0, 1] / (2 * products[0, 0]), warmth.min(), warmth.max()))
    every = noise.names
    level, first, second = (every.index(n) for n in (LEVEL, TEMPERATURE, QUADRATIC))
    change = np.eye(len(every))
    change[level, first] = -r
    change[first, second] = -2 * r
    change[level, second] = r**2
    return noise.with_columns(change), replace(design, reference=r)


def _reference(climate: Climate, design: EnvironmentDesign) -> float | None:
    if climate.thermometer is None:
        return None
    return climate.thermometer.mean + design.reference / climate.thermometer.scale


def _attenuation(noise: Noise, base: Sequence[str]) -> float | None:
    """Share of the whitened temperature that is noise of its thermometer."""
    if TEMPERATURE not in base:
        return None
    others = [n for n in base if n not in (TEMPERATURE, QUADRATIC)]
    signal = float(noise.products([TEMPERATURE], others)[0, 0])
    left = float(noise.products([LEFT], others)[0, 0])
    return left / signal


def _unknown(name: str, cause: CoefficientCause) -> Coefficient:
    return Coefficient(
        name=name, value=None, sd=None, lower=None, upper=None, p=None, status="not separable", cause=cause
    )


def _why(name: str, climate: Climate) -> CoefficientCause:
    if climate.thermometer is not None and climate.thermometer.constant:
        return CoefficientCause.CONSTANT
    return CoefficientCause.STRAIGHT if name == TEMPERATURE else CoefficientCause.COLLINEAR


def _series(climate: Climate, effect: Effect | None) -> EnvironmentSeries:
    """Means over neighbouring blocks, few enough for a picture."""
    from allanite.stability.environment.design import play

    join = -(-climate.size // INSTANTS)
    off = settling = np.zeros(climate.size)
    if effect is not None:
        off = effect(climate.middle)
        settling = effect.part(n for d in effect.design.decays for n in d.names)(climate.middle)
    signal = climate.blocks.mean

    def joined(values: Array) -> Array:
        padded = np.full(-(-climate.size // join) * join, np.nan)
        padded[: climate.size] = values
        rows = padded.reshape(-1, join)
        count = np.isfinite(rows).sum(axis=1)
        return np.where(count > 0, np.nansum(rows, axis=1) / np.maximum(count, 1), np.nan)

    thermometer = climate.thermometer
    warm = np.zeros(0) if thermometer is None else thermometer.mean + climate.warmth / thermometer.scale
    return EnvironmentSeries(
        time=joined(climate.middle),
        signal=joined(signal),
        residual=joined(signal - off),
        settling=joined(settling),
        temperature=joined(warm) if len(warm) else warm,
        branch=joined(play(climate.warmth)) if len(warm) else warm,
    )
