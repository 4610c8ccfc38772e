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
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from allanite import __version__
from allanite.allan import AllanCurve, allan_curve
from allanite.atomic_file import fresh
from allanite.errors import AllaniteError, DataQualityError, FitError, FormatError, InputError
from allanite.health import Finding, Severity, check, prepare
from allanite.health.finding import finding
from allanite.noise import NoiseModel
from allanite.recording import Channel, Kind, Recording

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
        from allanite.study_schema import faults

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
        FormatError
            Not JSON, or not a study.
        """
        try:
            document = json.loads(Path(path).read_text(encoding="utf-8"))
        except (UnicodeDecodeError, json.JSONDecodeError) as error:
            raise FormatError(f"{path} is not JSON: {error}") from None
        if not isinstance(document, dict):
            raise FormatError(f"{path} is not a study: it holds a {type(document).__name__}")
        return cls.from_json(document)


def characterize(
    recording: Recording,
    *,
    accept: Collection[str] = (),
    statistic: str = "oadev",
    taus: str | int | ArrayLike = "octave",
    confidence: float = 0.95,
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
    statistic : str
        Of the curve that is shown; the fit always uses oadev.
    taus : "octave", "decade", "all", int or array_like [s]
    confidence : float
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
        An unknown finding code, statistic or grid.
    """
    report = _Steps(progress)
    report(0.0, "looking for faults")
    found = check(recording, progress=report.part(0.0, 0.25))
    prepared, findings = prepare(recording, found, accept=accept)
    names = [c.name for c in prepared.channels if c.kind.noise_bearing]
    if not names:
        raise InputError(
            "no channel of the recording carries sensor noise (only temperature or other companions)"
        )
    whole = prepared.select(*names)
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
    parts = _channels(whole, curve, fitted, confidence, threads, report)
    extra = [f for _, fs in parts for f in fs]
    document = {
        "format": FORMAT,
        "version": VERSION,
        "provenance": _provenance(recording, provenance or {}),
        "recording": _facts(prepared, curve),
        "findings": [f.to_json() for f in _by_severity([*findings, *extra])],
        "channels": [part for part, _ in parts],
    }
    report(1.0, "done")
    return Study(_finite(document))


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
    recording: Recording,
    curve: AllanCurve,
    fitted: AllanCurve,
    confidence: float,
    threads: int | None,
    report: _Steps,
) -> list[tuple[Json, list[Finding]]]:
    done = 0

    def one(name: str) -> tuple[Json, list[Finding]]:
        nonlocal done
        shown = curve[name]
        result = _channel(recording, name, shown, shown if fitted is curve else fitted[name], confidence)
        done += 1
        report(0.4 + 0.6 * done / len(curve.names), f"fitting {name}")
        return result

    with ThreadPoolExecutor(threads or 2) as pool:
        return list(pool.map(one, curve.names))


def _channel(
    recording: Recording, name: str, curve: AllanCurve, fitted: AllanCurve, confidence: float
) -> tuple[Json, list[Finding]]:
    from allanite.fitting import fit
    from allanite.fitting.advice import advise
    from allanite.fitting.moments import lags_used
    from allanite.spectrum import lags_to_exclude, power_spectrum, quiet_lags

    channel = recording[name]
    spectrum = power_spectrum(recording, name)
    # Lags of whole periods do not see a line: they are added, where the exact sums fit into memory.
    if spectrum.lines and fitted.engine == "exact":
        more = np.union1d(fitted.lags, quiet_lags(spectrum, fitted.lags)) * fitted.dt
        same = curve is fitted
        fitted = allan_curve(recording.select(name), taus=more, confidence=confidence)
        curve = fitted if same else curve
    bent = lags_to_exclude(spectrum, fitted.tau, avar=fitted.variance[:, 0], edf=fitted.edf[:, 0])
    findings = _spectral_findings(spectrum, bent.reasons, name)
    models: list[NoiseModel] = []
    try:
        model = fit(fitted, exclude=bent.excluded, confidence=confidence)
        models = list(model.families)
    except (DataQualityError, FitError) as refusal:
        findings.append(_not_fitted(name, str(refusal)))
    if models and curve is fitted:
        curve = curve.with_model(models[0]) if models[0].terms else curve
    used = np.zeros(len(curve.lags), dtype=bool)
    if curve.statistic == "oadev":
        used = lags_used(fitted, bent.excluded)
    if models:
        used &= curve.tau >= models[0].goodness["shortest_tau"] * (1 - 1e-9)
        findings += _misfit_findings(models[0], name)
    advice = (
        advise(models[0], n_samples=curve.n_samples, dt=curve.dt, sampling=channel.sampling) if models else ()
    )
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
            "excluded": list(bent.reasons) if used.any() else [],
        },
        "spectrum": spectrum.to_json(),
        "models": [m.to_json() for m in models],
        "slopes": _slopes(fitted, bent.excluded),
        "advice": [asdict(a) for a in advice],
    }, findings


def _slopes(curve: AllanCurve, excluded: ArrayLike) -> Json:
    from allanite.fitting import fit

    try:
        read = fit(curve, method="slopes", exclude=excluded)
    except AllaniteError as refusal:
        return {"note": str(refusal)}
    return {e.symbol: {"value": e.value, "note": e.note} for e in read.estimates}


def _spectral_findings(spectrum: Any, reasons: Sequence[str], name: str) -> list[Finding]:
    found = []
    lags = sum("line" in r for r in reasons)
    if spectrum.lines:
        listed = ", ".join(f"{line.frequency:.4g} Hz" for line in spectrum.lines[:5])
        more = f" and {len(spectrum.lines) - 5} more" if len(spectrum.lines) > 5 else ""
        found.append(
            finding(
                "spectral_line",
                f"{name}: spectral line{'s' if len(spectrum.lines) > 1 else ''} at {listed}{more}; "
                f"{lags} lag{'s' if lags != 1 else ''} kept out of the fit",
                severity=Severity.WARNING,
                channel=name,
                count=len(spectrum.lines),
            )
        )
    if spectrum.corner is not None:
        lags = sum("low-pass" in r for r in reasons)
        found.append(
            finding(
                "band_limited",
                f"{name}: the density falls above {spectrum.corner:.3g} Hz (the sensor's own filter); "
                f"{lags} lag{'s' if lags != 1 else ''} kept out of the fit",
                severity=Severity.INFO,
                channel=name,
                count=lags,
            )
        )
    return found


def _misfit_findings(model: NoiseModel, name: str) -> list[Finding]:
    found = []
    left_out, discrepancy = int(model.goodness["left_out"]), float(model.goodness["discrepancy"])
    if left_out:
        found.append(
            finding(
                "short_lags_left_out",
                f"{name}: the shortest {left_out} lags, below {model.goodness['shortest_tau']:.3g} s, follow no sum of "
                "noise terms and are left out of the fit",
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
    sd = math.sqrt(max(square / count - middle**2, 0.0)) * abs(scale) if count else math.nan
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
