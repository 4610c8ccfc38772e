# SPDX-License-Identifier: BSD-3-Clause
"""Study: everything one recording says, as one plain, versioned document; characterize() makes it.

No formulas here: the document is put together from the modules that hold them. Reports, figures and exporters
read the document and nothing else.
"""

from __future__ import annotations

import copy
import json
import math
import os
import platform
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from allanite import __version__
from allanite.errors import AllaniteError, DataQualityError, FitError, FormatError, InputError
from allanite.fitting.instrument_floor import (
    floor_entry,
    floor_facts,
    floor_findings,
    over_floor,
    quiet_curve,
    ready_floor,
)
from allanite.noise import NoiseModel
from allanite.noise.allan import AllanCurve, allan_curve
from allanite.plain_files.atomic_file import fresh
from allanite.plain_files.json_values import load_plain
from allanite.recording.cleaning.renewed import held_entry
from allanite.recording.cleaning.rows import at_own_rates
from allanite.recording.clock_channels import without_noise
from allanite.recording.health import Finding, Severity, check, prepare
from allanite.recording.health.finding import finding
from allanite.recording.health.run import missing_because
from allanite.recording.health.tails import law_of
from allanite.recording.records import Channel, Kind, Recording, checked_recording

if TYPE_CHECKING:
    from allanite.fitting.advice import Advice
    from allanite.stability.environment import EnvironmentEstimate

__all__ = ["Study", "characterize"]

FORMAT = "allanite-study"
VERSION = 1
_OVERVIEW = 1500
_GAPS = 100

Progress = Callable[[float, str], None]
Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Study:
    """One recording's study.

    Attributes
    ----------
    document : dict
        The plain document (docs/reference/study-format.md). SI units; numbers that do not exist are null.
    """

    document: Mapping[str, Any]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels studied."""
        return tuple(c["name"] for c in self.document["channels"])

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was found in the recording."""
        return tuple(Finding.from_json(f) for f in self.document["findings"])

    @property
    def models(self) -> dict[str, NoiseModel]:
        """The noise model of each channel that has one, with its `alternative` where the record cannot decide."""
        found = {}
        for c in self.document["channels"]:
            if c["models"]:
                first, *rest = (NoiseModel.from_json(m) for m in c["models"])
                found[c["name"]] = replace(first, alternative=rest[0]) if rest else first
        return found

    def __getitem__(self, name: str) -> Mapping[str, Any]:
        """One channel's part of the document.

        Raises
        ------
        InputError
            No such channel.
        """
        for c in self.document["channels"]:
            if c["name"] == name:
                return c  # type: ignore[no-any-return]
        raise InputError(f"no channel {name!r} in the study; there are: {', '.join(self.names)}")

    def __repr__(self) -> str:
        return f"<Study of {self.document['provenance']['source'] or 'samples in memory'}: {', '.join(self.names)}>"

    def to_json(self) -> Json:
        """The document, as a copy."""
        return copy.deepcopy(dict(self.document))

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> Study:
        """A study from its document.

        Raises
        ------
        FormatError
            Not a study, a later version, or a part that is missing: all faults at once.
        """
        if document.get("format") != FORMAT:
            raise FormatError(f"not a study: 'format' is {document.get('format')!r}, not {FORMAT!r}")
        if document.get("version") != VERSION:
            raise FormatError(
                f"this is version {document.get('version')!r} of the study format; "
                f"this allanite reads version {VERSION}"
            )
        from allanite.study.schema import faults

        wrong = faults(document)
        if wrong:
            raise FormatError("the study is damaged:\n" + "\n".join(f"  {w}" for w in wrong[:20]))
        return cls(dict(document))

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> Path:
        """Write the document as JSON.

        Raises
        ------
        StorageError
            The file exists and `force` is not set.
        """
        text = json.dumps(self.document, ensure_ascii=False, indent=1, allow_nan=False)
        with fresh(path, force=force) as place:
            place.write_text(text + "\n", encoding="utf-8")
        return Path(path)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Study:
        """Read what `save` wrote.

        Raises
        ------
        InputError
            No such file.
        FormatError
            Not JSON, or not a study.
        """
        document = load_plain(path, "a study, study.json of 'allanite characterize LOG'")
        if not isinstance(document, dict):
            raise FormatError(f"{path} is not a study: it holds a {type(document).__name__}")
        return cls.from_json(document)


def characterize(
    recording: Recording,
    *,
    accept: Collection[str] = (),
    method: str = "moments",
    statistic: str = "oadev",
    taus: str | int | ArrayLike = "octave",
    confidence: float = 0.95,
    temperature: str | Mapping[str, str] | None = None,
    warm_up: Literal["model", "cut"] | None = None,
    floor: Recording | None = None,
    exclude: Sequence[tuple[float, float]] = (),
    threads: int | None = None,
    progress: Progress | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> Study:
    """From a recording of a sensor at rest to its noise models, with everything needed to judge them.

    Parameters
    ----------
    recording : Recording
    accept : collection of str
        Codes of fatal findings to go on in spite of.
    method : "moments" or "likelihood"
        Fit of the curve, or of the samples themselves (`allanite.fitting.fit`): the latter has smaller errors, takes
        two Gauss-Markov terms where one does not explain the record, and needs no unbroken stretches where samples are
        missing. It knows nothing of `temperature`, of a modelled warm-up, of `floor` and `exclude`.
    statistic : str
        Of the curve that is shown; the fit always uses oadev.
    taus : "octave", "decade", "all", int or array_like [s]
    confidence : float
    temperature : str or mapping of channel to str, optional
        Thermometer, one for all channels or one for each, whose effect is taken off where the record resolves it.
    warm_up : "model", "cut" or None
        What to do about a warm-up; with a temperature it is looked for in any case, and told.
    floor : Recording, optional
        Of the instrument alone, its input shorted, with the settings of `recording`: the models are those of the
        sensor without it (`allanite.fitting.instrument_floor`).
    exclude : sequence of (float, float) [s]
        Averaging times, from and to, that are left out of the fit by hand; the curve says so.
    threads : int, optional
    progress : callable, optional
        Called with the fraction done and what is being done.
    provenance : mapping, optional
        "sha256" and "command", where they are known.

    Returns
    -------
    Study

    Raises
    ------
    DataQualityError
        A fatal finding that was not accepted; the message says what accepting it would risk.
    InputError
        An unknown finding code, statistic, method or grid; a floor that does not fit; what a method knows nothing of.
    """
    checked_recording(recording, "characterize")
    asked = {
        "a temperature": temperature,
        "a modelled warm-up": warm_up == "model",
        "a floor": floor,
        "exclude": exclude,
    }
    _check_method(method, [name for name, value in asked.items() if value])
    report = _Steps(progress)
    report(0.0, "looking for faults")
    found = check(recording, progress=report.part(0.0, 0.25))
    prepared, findings = prepare(recording, found, accept=accept)
    companions = {temperature} if isinstance(temperature, str) else set((temperature or {}).values())
    names = [c.name for c in prepared.channels if c.kind.noise_bearing and c.name not in companions]
    if not names:
        raise without_noise(prepared)
    environment: dict[str, EnvironmentEstimate] = {}
    if temperature is not None or warm_up is not None:
        report(0.2, "effects of the environment")
        prepared, findings, environment = _freed(
            recording, prepared, findings, names, accept, temperature, warm_up, confidence
        )
    whole = prepared.select(*names)
    below, of_floor = (None, ()) if floor is None else ready_floor(whole, floor, accept=accept)
    curve = allan_curve(
        whole,
        statistic=statistic,
        taus=taus,
        confidence=confidence,
        threads=threads,
        progress=report.part(0.25, 0.4),
    )
    fitted = curve
    if statistic != "oadev":
        fitted = allan_curve(whole, taus="octave", confidence=confidence, threads=threads)
    report(0.4, "fitting")
    looked = {}
    for name in names:
        shown = curve[name]
        looked[name] = (whole, shown, shown if fitted is curve else fitted[name])
    if floor is None and not environment and any(f.code == "held_samples" for f in findings):
        for name, once in at_own_rates(whole).items():
            own = allan_curve(once, statistic=statistic, taus=taus, confidence=confidence, threads=threads)
            of_fit = own if statistic == "oadev" else allan_curve(once, taus="octave", confidence=confidence)
            looked[name] = (once, own, of_fit)
    parts = _channels(looked, method, confidence, threads, report, environment, below, exclude)
    extra = [f for _, fs in parts for f in fs]
    document = {
        "format": FORMAT,
        "version": VERSION,
        "provenance": _provenance(recording, provenance or {}),
        "recording": _facts(prepared, curve),
        "findings": [f.to_json() for f in _by_severity([*findings, *extra])],
        "channels": [part for part, _ in parts],
        **({} if floor is None else {"floor": floor_facts(floor, of_floor)}),
    }
    report(1.0, "done")
    return Study(_finite(document))


def _check_method(method: str, others: Sequence[str]) -> None:
    if method not in ("moments", "likelihood"):
        raise InputError(f"method must be 'moments' or 'likelihood', not {method!r}")
    if method == "likelihood" and others:
        raise InputError(
            f"the fit of the samples (likelihood) knows nothing of {' or '.join(others)}: leave that out, or fit the "
            "curve (moments)"
        )


def _freed(
    recording: Recording,
    prepared: Recording,
    findings: tuple[Finding, ...],
    names: Sequence[str],
    accept: Collection[str],
    temperature: str | Mapping[str, str] | None,
    warm_up: Literal["model", "cut"] | None,
    confidence: float,
) -> tuple[Recording, tuple[Finding, ...], dict[str, EnvironmentEstimate]]:
    """The recording without the effects of its environment; a cut one is looked at anew, so that places agree."""
    from allanite.stability.environment import free_of_environment, warm_ups_to_cut
    from allanite.stability.environment.remarks import remarks

    same: Json = {"channels": names, "temperature": temperature, "confidence": confidence}
    cuts = warm_ups_to_cut(prepared, **same) if warm_up == "cut" else None
    last = max((w.cut or 0.0 for w in (cuts or {}).values()), default=0.0)
    if last > 0:
        cut = recording.window(last)
        prepared, findings = prepare(cut, check(cut), accept=accept)
    freed = free_of_environment(prepared, warm_up=warm_up, cuts=cuts, **same)
    said = tuple(r for e in freed.estimates for r in remarks(e))
    return freed.residual, (*findings, *said), {e.channel: e for e in freed.estimates}


class _Steps:
    """Fractions of the whole work, made from fractions of its parts."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress = progress
        self._text = ""

    def __call__(self, fraction: float, text: str = "") -> None:
        self._text = text or self._text
        if self._progress is not None:
            self._progress(fraction, self._text)

    def part(self, start: float, stop: float) -> Callable[[float], None]:
        return lambda fraction: self(start + (stop - start) * min(max(fraction, 0.0), 1.0))


def _channels(
    looked: Mapping[str, tuple[Recording, AllanCurve, AllanCurve]],
    method: str,
    confidence: float,
    threads: int | None,
    report: _Steps,
    environment: Mapping[str, EnvironmentEstimate],
    floor: Recording | None,
    exclude: Sequence[tuple[float, float]],
) -> list[tuple[Json, list[Finding]]]:
    done = 0

    def one(name: str) -> tuple[Json, list[Finding]]:
        nonlocal done
        recording, shown, fitted = looked[name]
        found = environment.get(name)
        result = _channel(recording, name, shown, fitted, method, confidence, found, floor, exclude)
        done += 1
        report(0.4 + 0.6 * done / len(looked), f"fitting {name}")
        return result

    with ThreadPoolExecutor(threads or 2) as pool:
        return list(pool.map(one, looked))


def _channel(
    recording: Recording,
    name: str,
    curve: AllanCurve,
    fitted: AllanCurve,
    method: str,
    confidence: float,
    environment: EnvironmentEstimate | None = None,
    floor: Recording | None = None,
    exclude: Sequence[tuple[float, float]] = (),
) -> tuple[Json, list[Finding]]:
    from allanite.fitting import fit
    from allanite.fitting.advice import advise
    from allanite.fitting.moments import lags_used
    from allanite.fitting.spectral.remarks import agreement_findings, spectral_findings
    from allanite.fitting.tails import contamination_entry, with_tails
    from allanite.noise.spectrum import (
        lags_to_exclude,
        power_spectrum,
        quiet_lags,
        sinusoids,
        without_spans,
        without_stable_lines,
    )

    channel, alone = recording[name], recording.select(name)
    spectrum = left = power_spectrum(recording, name)
    tones, same = sinusoids(spectrum), curve is fitted
    if tones:  # steady lines are known, and go: what is left of the record is fitted
        alone = without_stable_lines(recording, spectrum)
        left = power_spectrum(alone, name)
        fitted = allan_curve(alone, taus=fitted.tau, engine=_engine(fitted), confidence=confidence)
    # Lags of whole periods do not see a line: they are added, where the exact sums fit into memory.
    if left.lines and fitted.engine == "exact":
        more = np.union1d(fitted.lags, quiet_lags(left, fitted.lags)) * fitted.dt
        fitted = allan_curve(alone, taus=more, confidence=confidence)
        if same and tones:
            curve = allan_curve(recording.select(name), taus=more, confidence=confidence)
    if environment is not None and environment.correction is not None:
        fitted = environment.correction.applied(fitted)
        if same and tones:
            curve = environment.correction.applied(curve)
    curve = fitted if same and not tones else curve
    bent = lags_to_exclude(left, fitted.tau, avar=fitted.variance[:, 0], edf=fitted.edf[:, 0])
    bent = without_spans(bent, fitted.tau, exclude)
    findings = spectral_findings(spectrum, bent.reasons, name)
    models: list[NoiseModel] = []
    mixed: Mapping[str, Any] = {}
    below = None if floor is None else quiet_curve(floor, name, confidence)
    try:
        if method == "likelihood":
            model = fit(alone, method=method, confidence=confidence)
        else:
            model = fit(fitted, exclude=bent.excluded, confidence=confidence, floor=below)
        tails = law_of(alone, name)
        model = with_tails(model, tails, curve.n_samples - int(np.diff(curve.missing[0], axis=1).sum()))
        models = list(model.families)
        mixed = contamination_entry(model, tails, channel.scale, curve.dt)
    except (DataQualityError, FitError) as refusal:
        findings.append(_not_fitted(name, str(refusal)))
    if models and same:
        seen = models[0] if below is None else models[0] + _instrument(below, models[0], confidence)
        curve = curve.with_model(seen) if seen.terms else curve
    used = np.zeros(len(curve.lags), dtype=bool)
    if curve.statistic == "oadev":
        used = lags_used(fitted, bent.excluded)
    if models:
        used &= curve.tau >= models[0].goodness["shortest_tau"] * (1 - 1e-9)
        findings += _misfit_findings(models[0], name)
    advice: Sequence[Advice] = ()
    if (
        models and below is None
    ):  # with an instrument it is not the sensor's noise alone that must be averaged
        if method == "moments":  # the other fit has judged its model by the samples already
            findings += agreement_findings(model, alone, left)
        advice = advise(models[0], n_samples=curve.n_samples, dt=curve.dt, sampling=channel.sampling)
    taken: Json = {}
    if floor is not None and below is not None:
        above = over_floor(fitted, floor.select(name))
        taken = {"floor": floor_entry(above, below)}
        findings += floor_findings(above, floor, lags_used(fitted, bent.excluded))
    mean, sd, overview = _overview(recording, channel)
    return {
        "name": name,
        "kind": channel.kind.value,
        "unit": channel.unit,
        "mean": mean,
        "sd": sd,
        "overview": overview,
        "curve": {
            **curve.to_json(),
            "used": used.tolist(),
            "excluded": _reasons(curve, bent.reasons) if used.any() else [],
        },
        **({} if environment is None else {"environment": environment.to_json()}),
        **taken,
        "spectrum": spectrum.to_json(),
        "models": [replace(m, terms=(*m.terms, *tones)).to_json() for m in models],
        "slopes": _slopes(fitted, bent.excluded),
        "advice": [asdict(a) for a in advice],
        **_aliasing(channel, recording.dt),
        **held_entry(recording),
        **mixed,
    }, findings


def _aliasing(channel: Channel, interval: float) -> Json:
    """What an aperture shorter than the interval does to N, where it is; nothing is divided by it."""
    if channel.aperture is None or channel.aperture >= interval * (1 - 1e-9):
        return {}
    factor = math.sqrt(interval / channel.aperture)
    return {
        "aliasing": {
            "aperture": channel.aperture,
            "interval": interval,
            "factor": factor,
            "applied": False,
            "assumes": "white noise of the sensor far beyond the inverse of the aperture",
        }
    }


def _instrument(below: AllanCurve, sensor: NoiseModel, confidence: float) -> NoiseModel:
    """Terms of the instrument's own noise, as its record supports them."""
    from allanite.fitting import fit

    try:
        terms = fit(below, confidence=confidence).terms
    except (DataQualityError, FitError):
        terms = ()
    return NoiseModel(terms=terms, kind=sensor.kind, unit=sensor.unit)


def _engine(curve: AllanCurve) -> Literal["exact", "decimated"]:
    return "exact" if curve.engine == "exact" else "decimated"


def _reasons(curve: AllanCurve, reasons: Sequence[str]) -> list[str]:
    """Why lags are not in the fit: the spectrum's reasons, and the environment's for the others."""
    out = curve.excluded[:, 0].tolist()
    return [
        r or ("what was taken off the record holds it" if o else "")
        for r, o in zip(reasons, out, strict=True)
    ]


def _slopes(curve: AllanCurve, excluded: ArrayLike) -> Json:
    from allanite.fitting import fit

    try:
        read = fit(curve, method="slopes", exclude=excluded)
    except AllaniteError as refusal:
        return {"note": str(refusal)}
    return {e.symbol: {"value": e.value, "note": e.note} for e in read.estimates}


def _misfit_findings(model: NoiseModel, name: str) -> list[Finding]:
    found = []
    left_out, discrepancy = int(model.goodness["left_out"]), float(model.goodness["discrepancy"])
    if left_out:
        shortest = f"{model.goodness['shortest_tau']:.3g} s"
        what = f"the shortest {left_out} lags, below {shortest}, follow no sum of noise terms and are"
        if model.goodness.get("method") == "likelihood":
            what = f"what happens within {shortest} follows no sum of noise terms and is"
        found.append(
            finding(
                "short_lags_left_out",
                f"{name}: {what} left out of the fit",
                severity=Severity.WARNING,
                channel=name,
                count=left_out,
            )
        )
    if discrepancy:
        found.append(
            finding(
                "model_discrepancy",
                f"{name}: no sum of noise terms explains the curve better than to {discrepancy:.1%} in variance; "
                "the intervals are widened by that",
                severity=Severity.WARNING,
                channel=name,
                count=1,
            )
        )
    return found


def _not_fitted(name: str, why: str) -> Finding:
    return finding(
        "not_fitted", f"{name}: no noise model: {why}", severity=Severity.WARNING, channel=name, count=1
    )


def _by_severity(findings: Sequence[Finding]) -> list[Finding]:
    return sorted(findings, key=lambda f: f.severity.rank)


def _overview(recording: Recording, channel: Channel) -> tuple[float, float, Json]:
    """Mean, standard deviation and the envelope that a picture of the whole record needs, in one pass, SI."""
    n = recording.n_samples
    size = max(1, -(-n // _OVERVIEW))
    block = size * max(1, (1 << 18) // size)
    origin, low, high, total, square, count = recording.origin(channel.name), [], [], 0.0, 0.0, 0
    reference: float | None = None
    for _, values in recording.blocks(channel.name, block):
        present = values[np.isfinite(values)]
        if reference is None and len(present):
            reference = float(present[0])
        centred = present - (reference or 0.0)
        total += float(centred.sum())
        square += float(np.dot(centred, centred))
        count += len(present)
        padded = np.full(-(-len(values) // size) * size, np.nan)
        padded[: len(values)] = values
        rows = padded.reshape(-1, size)
        empty = np.isnan(rows).all(axis=1)
        low.append(np.where(empty, np.nan, np.where(np.isnan(rows), np.inf, rows).min(axis=1)))
        high.append(np.where(empty, np.nan, np.where(np.isnan(rows), -np.inf, rows).max(axis=1)))
    scale = channel.scale
    ends = np.sort((np.stack([np.concatenate(low), np.concatenate(high)]) + origin) * scale, axis=0)
    middle = total / count if count else math.nan
    sd = math.sqrt(max(square - total * middle, 0.0) / max(count - 1, 1)) * abs(scale) if count else math.nan
    mean = ((reference or 0.0) + middle + origin) * scale
    t = (np.arange(ends.shape[1]) + 0.5) * size * recording.dt
    return mean, sd, {"t": t.tolist(), "low": ends[0].tolist(), "high": ends[1].tolist()}


def _provenance(recording: Recording, given: Mapping[str, Any]) -> Json:
    return {
        "allanite": __version__,
        "created": datetime.now(UTC).replace(microsecond=0).isoformat().replace("+00:00", "Z"),
        "source": recording.source,
        "sha256": given.get("sha256"),
        "command": given.get("command"),
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def _facts(recording: Recording, curve: AllanCurve) -> Json:
    missing = max((int(np.diff(m, axis=1).sum()) for m in curve.missing), default=0)
    gaps = max(curve.missing, key=len)[:_GAPS].tolist()
    return {
        "rate": recording.rate,
        "samples": recording.n_samples,
        "duration": recording.duration,
        "start": _utc(recording.start),
        "missing": missing,
        "missing_because": missing_because(recording, missing),
        "gaps": gaps,
        "channels": [c.to_json() for c in recording.channels],
        "history": [dict(step) for step in recording.history],
    }


def _utc(ns: int | None) -> str | None:
    if ns is None:
        return None
    try:
        moment = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=ns // 1000)
    except OverflowError:
        return None
    return moment.isoformat().replace("+00:00", "Z")


def _finite(value: Any) -> Any:
    """The document with numbers that JSON does not have (NaN, infinity) as null, and NumPy scalars as plain ones."""
    if isinstance(value, Mapping):
        return {str(k): _finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Kind):
        return value.value
    return value
