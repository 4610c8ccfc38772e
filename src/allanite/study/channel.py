# SPDX-License-Identifier: BSD-3-Clause
"""What a study says of one channel: its curve without steady lines, the models, what was found on the way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from allanite.errors import AllaniteError, DataQualityError, FitError
from allanite.fitting.instrument_floor import floor_findings, over_floor, quiet_curve
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.allan import AllanCurve, allan_curve
from allanite.noise.allan.channel_curve import ChannelCurve
from allanite.recording.cleaning.renewed import held_samples
from allanite.recording.health.finding import Finding, Severity, finding
from allanite.recording.health.tails import law_of
from allanite.recording.records import Channel, Recording
from allanite.study.request import Request
from allanite.study.results import Aliasing, ChannelFloor, ChannelStudy, SlopeReading
from allanite.study.sample_pass import SamplePass

if TYPE_CHECKING:
    from allanite.fitting.contamination import Contamination
    from allanite.fitting.record_lengths import Advice
    from allanite.noise.spectrum.exclusion import Exclusion
    from allanite.noise.spectrum.results import Spectrum
    from allanite.noise.terms import Sinusoid
    from allanite.stability.environment.results import EnvironmentEstimate

__all__ = ["Curves", "channel_study"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Curves:
    """A channel as it is looked at.

    Attributes
    ----------
    recording : Recording
        That holds it, at its own rate.
    name : str
    shown, fitted : AllanCurve
        One object where the curve that is shown is fitted.
    """

    recording: Recording
    name: str
    shown: AllanCurve
    fitted: AllanCurve


@dataclass(frozen=True, slots=True, kw_only=True)
class _Lines:
    """The spectrum, and the record without its steady lines: they are known, and what is left is fitted."""

    spectrum: Spectrum
    steady: tuple[Sinusoid, ...]
    rest: Recording
    rest_spectrum: Spectrum

    @classmethod
    def of(cls, recording: Recording, name: str, gathered: SamplePass) -> _Lines:
        from allanite.noise.spectrum.estimation import power_spectrum, spectrum_of_pass
        from allanite.noise.spectrum.stability import sinusoids, without_stable_lines

        spectrum = spectrum_of_pass(recording, name, gathered.cascade)
        steady = sinusoids(spectrum)
        if not steady:
            return cls(spectrum=spectrum, steady=(), rest=recording.select(name), rest_spectrum=spectrum)
        rest = without_stable_lines(recording, spectrum)
        return cls(spectrum=spectrum, steady=steady, rest=rest, rest_spectrum=power_spectrum(rest, name))


@dataclass(frozen=True, slots=True, kw_only=True)
class _ChannelModels:
    """Models of a channel, the likeliest first; none where no fit was possible, of which a finding says why."""

    models: tuple[NoiseModel, ...] = ()
    contamination: Contamination | None = None
    findings: tuple[Finding, ...]


def channel_study(
    curves: Curves, request: Request, environment: EnvironmentEstimate | None, floor: Recording | None
) -> tuple[ChannelStudy, list[Finding]]:
    """What a study says of a channel, and its findings.

    Parameters
    ----------
    environment : EnvironmentEstimate, optional
        Effects that were removed from the channel.
    floor : Recording, optional
        Of the instrument alone, looked through for faults.
    """
    from allanite.fitting.spectral.remarks import spectral_findings

    recording, name = curves.recording, curves.name
    gathered = SamplePass.of(recording, name)
    lines = _Lines.of(recording, name, gathered)
    curves = _without_environment(_without_lines(curves, lines, request), environment, request)
    bent = _bent_lags(curves, lines, request)
    below = None if floor is None else quiet_curve(floor, name, request.confidence)
    fitted = _fit(curves, lines, None if lines.steady else gathered, bent, below, request)
    over_its_floor, floor_remarks = _over_floor(curves.fitted, floor, below, name, bent)
    mean, sd, overview = gathered.overview.result()
    slopes, no_slopes = _slopes(curves.fitted, bent.excluded)
    channel = ChannelStudy(
        name=name,
        kind=recording[name].kind.value,
        unit=recording[name].unit,
        models=tuple(replace(m, terms=(*m.terms, *lines.steady)) for m in fitted.models),
        mean=mean,
        sd=sd,
        overview=overview,
        curve=_shown_curve(curves, fitted.models, bent, below, request),
        spectrum=lines.spectrum,
        slopes=slopes,
        no_slopes=no_slopes,
        advice=_advice(curves, fitted.models, request) if below is None else (),
        environment=None if environment is None else environment.facts,
        aliasing=_aliasing(recording[name], recording.dt),
        held=held_samples(recording),
        contamination=fitted.contamination,
        floor=over_its_floor,
    )
    remarks = [*spectral_findings(lines.spectrum, bent.reasons, name), *fitted.findings, *floor_remarks]
    if environment is None and floor is None:
        remarks += _warm_up(recording, name)
    return channel, remarks


def _warm_up(recording: Recording, name: str) -> list[Finding]:
    """A warm-up that nobody asked about."""
    from allanite.stability.environment.estimation import warm_up_left_in
    from allanite.stability.environment.remarks import warm_up_remark

    warm = warm_up_left_in(recording, name)
    return [] if warm is None else [warm_up_remark(name, warm, recording.n_samples)]


# -- curves ------------------------------------------------------------------------------------------------


def _without_lines(curves: Curves, lines: _Lines, request: Request) -> Curves:
    """The fitted curve without steady lines, at lags of whole periods of the others, which do not see these."""
    from allanite.noise.spectrum.exclusion import quiet_lags

    shown, fitted, confidence = curves.shown, curves.fitted, request.confidence
    if lines.steady:
        engine: Literal["exact", "decimated"] = "exact" if fitted.engine == "exact" else "decimated"
        fitted = allan_curve(lines.rest, taus=fitted.tau, engine=engine, confidence=confidence)
    if lines.rest_spectrum.lines and fitted.engine == "exact":  # whose sums fit into memory
        taus = np.union1d(fitted.lags, quiet_lags(lines.rest_spectrum, fitted.lags)) * fitted.dt
        fitted = allan_curve(lines.rest, taus=taus, confidence=confidence)
        if request.shows_what_is_fitted and lines.steady:
            shown = allan_curve(curves.recording.select(curves.name), taus=taus, confidence=confidence)
    if request.shows_what_is_fitted and not lines.steady:
        shown = fitted
    return replace(curves, shown=shown, fitted=fitted)


def _without_environment(curves: Curves, environment: EnvironmentEstimate | None, request: Request) -> Curves:
    """Curves with what the effects that were removed held of the noise, too."""
    if environment is None or environment.correction is None:
        return curves
    fitted = shown = environment.correction.applied(curves.fitted)
    if curves.shown is not curves.fitted:
        shown = environment.correction.applied(curves.shown) if request.shows_what_is_fitted else curves.shown
    return replace(curves, shown=shown, fitted=fitted)


def _bent_lags(curves: Curves, lines: _Lines, request: Request) -> Exclusion:
    """Lags that lines or the rounding of an angle bend, and those that the caller leaves out."""
    from allanite.noise.spectrum.exclusion import lags_to_exclude, without_spans
    from allanite.study.rounding import without_rounded_lags

    fitted = curves.fitted
    bent = lags_to_exclude(lines.rest_spectrum, fitted.tau, avar=fitted.variance[:, 0], edf=fitted.edf[:, 0])
    bent = without_rounded_lags(bent, fitted, curves.recording, curves.name)
    return without_spans(bent, fitted.tau, request.exclude)


def _shown_curve(
    curves: Curves,
    models: Sequence[NoiseModel],
    bent: Exclusion,
    below: AllanCurve | None,
    request: Request,
) -> ChannelCurve:
    """The curve that is shown, its intervals by the model where that is of this curve."""
    from allanite.fitting.moments import lags_used

    shown, used = curves.shown, np.zeros(len(curves.shown.lags), dtype=bool)
    if request.shows_what_is_fitted:
        used = lags_used(curves.fitted, bent.excluded)
        if models:
            seen_by_curve = models[0] if below is None else models[0] + _instrument(below, models[0], request)
            shown = shown.with_model(seen_by_curve) if seen_by_curve.terms else shown
            used &= shown.tau >= models[0].goodness["shortest_tau"] * (1 - 1e-9)
    return ChannelCurve.of(shown, used, _reasons(shown, bent.reasons) if used.any() else ())


def _reasons(curve: AllanCurve, reasons: Sequence[str]) -> list[str]:
    """Why lags are not in the fit: the spectrum's reasons, and the environment's for the others."""
    out = curve.excluded[:, 0].tolist()
    return [r or ("the removed signal includes it" if o else "") for r, o in zip(reasons, out, strict=True)]


def _instrument(below: AllanCurve, sensor: NoiseModel, request: Request) -> NoiseModel:
    """Terms of the instrument's own noise, as its record supports them."""
    from allanite.fitting import fit

    try:
        terms = fit(below, confidence=request.confidence).terms
    except (DataQualityError, FitError):
        terms = ()
    return NoiseModel(terms=terms, kind=sensor.kind, unit=sensor.unit)


# -- models ------------------------------------------------------------------------------------------------


def _fit(
    curves: Curves,
    lines: _Lines,
    gathered: SamplePass | None,
    bent: Exclusion,
    below: AllanCurve | None,
    request: Request,
) -> _ChannelModels:
    """The models; `gathered` is of the record without its steady lines, where that has been read."""
    from allanite.fitting import fit
    from allanite.fitting.spectral.remarks import agreement_findings
    from allanite.fitting.tails import contamination_of, with_tails

    name, shown, rest = curves.name, curves.shown, lines.rest
    try:
        if request.method == "likelihood":
            model = fit(rest, method="likelihood", lines=(), confidence=request.confidence, screen=False)
        else:
            model = fit(
                curves.fitted, exclude=bent.excluded, confidence=request.confidence, floor=below, screen=False
            )
        tails = law_of(rest, name, None if gathered is None else gathered.probes.stretches)
        model = with_tails(model, tails, shown.n_samples - int(np.diff(shown.missing[0], axis=1).sum()))
        contamination = contamination_of(model, tails, curves.recording[name].scale, shown.dt)
    except (DataQualityError, FitError) as refusal:
        return _ChannelModels(findings=(_not_fitted(name, str(refusal)),))
    remarks = _misfit_findings(model.families[0], name)
    # The other fit has judged its model by the samples already; with a floor the model is not of all of the record.
    if request.method == "moments" and below is None:
        means = None if gathered is None else gathered.means
        remarks += agreement_findings(model, rest, lines.rest_spectrum, means)
    return _ChannelModels(models=tuple(model.families), contamination=contamination, findings=tuple(remarks))


def _misfit_findings(model: NoiseModel, name: str) -> list[Finding]:
    findings = []
    left_out, discrepancy = int(model.goodness["left_out"]), float(model.goodness["discrepancy"])
    if left_out:
        shortest = f"{model.goodness['shortest_tau']:.3g} s"
        what = f"the shortest {left_out} lags, below {shortest}, fit no sum of noise terms and are"
        if model.goodness.get("method") == "likelihood":
            what = f"the noise within {shortest} fits no sum of noise terms and is"
        findings.append(
            finding(
                "short_lags_left_out",
                f"{name}: {what} excluded from the fit",
                severity=Severity.WARNING,
                channel=name,
                count=left_out,
            )
        )
    if discrepancy:
        findings.append(
            finding(
                "model_discrepancy",
                f"{name}: no sum of noise terms explains the curve better than to {discrepancy:.1%} in variance; "
                "the intervals are widened by that",
                severity=Severity.WARNING,
                channel=name,
                count=1,
            )
        )
    return findings


def _not_fitted(name: str, why: str) -> Finding:
    return finding(
        "not_fitted", f"{name}: no noise model: {why}", severity=Severity.WARNING, channel=name, count=1
    )


def _slopes(curve: AllanCurve, excluded: ArrayLike) -> tuple[tuple[SlopeReading, ...], str]:
    """The reading by slopes, and why there is none."""
    from allanite.fitting import fit

    try:
        estimates = fit(curve, method="slopes", exclude=excluded).estimates
    except AllaniteError as refusal:
        return (), str(refusal)
    nothing = math.nan
    return tuple(
        SlopeReading(symbol=e.symbol, value=nothing if e.value is None else e.value, note=e.note)
        for e in estimates
    ), ""


def _advice(curves: Curves, models: Sequence[NoiseModel], request: Request) -> tuple[Advice, ...]:
    """How long to record; of an instrument's noise beside it, it would be another.

    Where gaps end the curve early, it would in a longer record too.
    """
    from allanite.fitting.advice import advise

    shown = curves.shown
    if not models or (request.method == "moments" and _ends_early(curves.fitted)):
        return ()
    sampling = curves.recording[curves.name].sampling
    return advise(models[0], n_samples=shown.n_samples, dt=shown.dt, sampling=sampling)


def _ends_early(curve: AllanCurve) -> bool:
    """Gaps leave no average at the longest lags, by two octaves or more."""
    there = curve.lags[curve.count[:, 0] > 0]
    return len(curve.missing[0]) > 0 and 4 * int(there.max(initial=1)) <= int(curve.lags[-1])


# -- facts -------------------------------------------------------------------------------------------------


def _over_floor(
    fitted: AllanCurve, floor: Recording | None, below: AllanCurve | None, name: str, bent: Exclusion
) -> tuple[ChannelFloor | None, list[Finding]]:
    from allanite.fitting.moments import lags_used

    if floor is None or below is None:
        return None, []
    above = over_floor(fitted, floor.select(name))
    used = lags_used(fitted, bent.excluded)
    return ChannelFloor.of(above, name, below), list(floor_findings(above, floor, used))


def _aliasing(channel: Channel, interval: float) -> Aliasing | None:
    """What an aperture shorter than the interval does to N, where it is; nothing is divided by it."""
    if channel.aperture is None or channel.aperture >= interval * (1 - 1e-9):
        return None
    factor = math.sqrt(interval / channel.aperture)
    return Aliasing(aperture=channel.aperture, interval=interval, factor=factor)
