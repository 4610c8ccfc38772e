# SPDX-License-Identifier: BSD-3-Clause
"""characterize(): from a recording of a sensor at rest to its study. No formulas here: other modules hold them."""

from __future__ import annotations

import platform
from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from allanite import __version__
from allanite.fitting.instrument_floor import ready_floor
from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan import AllanCurve
from allanite.recording.cleaning.rows import at_own_rates
from allanite.recording.clock_channels import without_noise
from allanite.recording.health.examination import check, prepare
from allanite.recording.health.finding import Finding
from allanite.recording.health.run import missing_because
from allanite.recording.records import Recording, checked_recording
from allanite.study.channel import Curves, channel_study
from allanite.study.request import Progress, ProgressSteps, Request
from allanite.study.result_document import Provenance
from allanite.study.results import ChannelStudy, FloorRecord, MissingSamples, StudiedRecord
from allanite.study.study import Study

if TYPE_CHECKING:
    from allanite.stability.environment.results import EnvironmentEstimate

__all__ = ["characterize"]

_GAPS = 100


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
    provenance: Mapping[str, str | None] | None = None,
) -> Study:
    """From a recording of a sensor at rest to its noise models, with everything needed to judge them.

    Parameters
    ----------
    recording : Recording
        Recording of the sensor at rest.
    accept : collection of str
        Codes of fatal findings to go on in spite of.
    method : "moments" or "likelihood"
        Fit of the curve, or of the samples themselves (`allanite.fitting.fit`): the latter has smaller errors, takes
        two Gauss-Markov terms where one does not explain the record, and needs no unbroken stretches where samples are
        missing. It knows nothing of `temperature`, of a modelled warm-up, of `floor` and `exclude`.
    statistic : str
        Statistic of the displayed curve; the fit always uses oadev.
    taus : "octave", "decade", "all", int or array_like [s]
        Averaging times of the curve.
    confidence : float
        Confidence level of the intervals.
    temperature : str or mapping of channel to str, optional
        Thermometer, one for all channels or one for each, whose effect is removed where the record resolves it.
    warm_up : "model", "cut" or None
        Treatment of a warm-up; with a temperature it is always tested and reported.
    floor : Recording, optional
        Record of the instrument alone with a shorted input and the settings of `recording`: the models are those of the
        sensor without it (`allanite.fitting.instrument_floor`).
    exclude : sequence of (float, float) [s]
        Averaging times, from and to, to leave out of the fit; the curve states them.
    threads : int, optional
        Number of threads.
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
    request = Request(
        accept=accept, method=method, statistic=statistic, taus=taus, confidence=confidence, temperature=temperature,
        warm_up=warm_up, floor=floor, exclude=exclude, threads=threads,
    )  # fmt: skip
    report = ProgressSteps(progress)
    report(0.0, "looking for faults")
    ready = _without_faults(recording, request, report)
    if request.environment:
        report(0.2, "effects of the environment")
        ready = _without_environment(recording, ready, request)
    quiet_floor, floor_findings = (
        (None, ()) if floor is None else ready_floor(ready.noise, floor, accept=accept)
    )
    curve, channels = _curves(ready, request, report)
    report(0.4, "fitting")
    studied = _studied(channels, ready, quiet_floor, request, report)
    findings = [*ready.findings, *(remark for _, remarks in studied for remark in remarks)]
    report(1.0, "done")
    return Study(
        provenance=_provenance(recording, provenance or {}),
        recording=_facts(ready.recording, curve),
        findings=tuple(sorted(findings, key=lambda f: f.severity.rank)),
        channels=tuple(channel for channel, _ in studied),
        floor=None if floor is None else FloorRecord.seen(floor, floor_findings),
    )


# -- the steps ---------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Ready:
    """A recording that can be characterized.

    Attributes
    ----------
    recording : Recording
        Without its faults.
    noise : Recording
        Of it, the channels that bear noise, without the effects of the environment that were asked for.
    findings : tuple of Finding
    environment : mapping of str to EnvironmentEstimate
        By channel.
    """

    recording: Recording
    noise: Recording
    findings: tuple[Finding, ...]
    environment: Mapping[str, EnvironmentEstimate]


def _without_faults(recording: Recording, request: Request, report: ProgressSteps) -> _Ready:
    findings = check(recording, progress=report.part(0.0, 0.25))
    prepared, findings = _prepared(recording, findings, request)
    names = [c.name for c in prepared.channels if c.kind.noise_bearing and c.name not in request.thermometers]
    if not names:
        raise without_noise(prepared)
    return _Ready(recording=prepared, noise=prepared.select(*names), findings=findings, environment={})


def _prepared(
    recording: Recording, findings: Sequence[Finding], request: Request
) -> tuple[Recording, tuple[Finding, ...]]:
    return prepare(recording, findings, accept=request.accept, by_averages=request.method != "likelihood")


def _without_environment(recording: Recording, ready: _Ready, request: Request) -> _Ready:
    """Without the effects of the environment; a record that is cut is looked at anew, so that places agree."""
    from allanite.stability.environment.estimation import free_of_environment, warm_ups_to_cut
    from allanite.stability.environment.remarks import remarks

    names, prepared, findings = ready.noise.names, ready.recording, ready.findings
    warm_ups = partial(
        warm_ups_to_cut, channels=names, temperature=request.temperature, confidence=request.confidence
    )
    cuts = warm_ups(prepared) if request.warm_up == "cut" else None
    last = max((w.cut or 0.0 for w in (cuts or {}).values()), default=0.0)
    if last > 0:
        after_warm_up = recording.window(last)
        prepared, findings = _prepared(after_warm_up, check(after_warm_up), request)
    freed = free_of_environment(
        prepared,
        warm_up=request.warm_up,
        cuts=cuts,
        channels=names,
        temperature=request.temperature,
        confidence=request.confidence,
    )
    return _Ready(
        recording=freed.residual,
        noise=freed.residual.select(*names),
        findings=(*findings, *(remark for e in freed.estimates for remark in remarks(e))),
        environment={e.channel: e for e in freed.estimates},
    )


def _curves(ready: _Ready, request: Request, report: ProgressSteps) -> tuple[AllanCurve, list[Curves]]:
    """The curve of all channels, and those of each; of a channel that holds its samples, at its own rate."""
    shown, fitted = request.curves(ready.noise, report.part(0.25, 0.4))
    channels = {}
    for name in ready.noise.names:
        alone = shown[name]
        channels[name] = Curves(
            recording=ready.noise,
            name=name,
            shown=alone,
            fitted=alone if request.shows_what_is_fitted else fitted[name],
        )
    held = any(f.code == "held_samples" for f in ready.findings)
    if request.floor is None and not ready.environment and held:
        for name, once in at_own_rates(ready.noise).items():
            own_shown, own_fitted = request.curves(once)
            channels[name] = Curves(recording=once, name=name, shown=own_shown, fitted=own_fitted)
    return shown, list(channels.values())


def _studied(
    channels: Sequence[Curves],
    ready: _Ready,
    floor: Recording | None,
    request: Request,
    report: ProgressSteps,
) -> list[tuple[ChannelStudy, list[Finding]]]:
    done = 0

    def one(curves: Curves) -> tuple[ChannelStudy, list[Finding]]:
        nonlocal done
        made = channel_study(curves, request, ready.environment.get(curves.name), floor)
        done += 1
        report(0.4 + 0.6 * done / len(channels), f"fitting {curves.name}")
        return made

    with ThreadPoolExecutor(request.threads or 2) as pool:
        return list(pool.map(one, channels))


# -- facts -------------------------------------------------------------------------------------------------


def _provenance(recording: Recording, given: Mapping[str, str | None]) -> Provenance:
    return Provenance(
        allanite=__version__,
        created=datetime.now(UTC).replace(microsecond=0).isoformat().replace("+00:00", "Z"),
        source=recording.source,
        sha256=given.get("sha256"),
        command=given.get("command"),
        python=platform.python_version(),
        numpy=np.__version__,
    )


def _facts(recording: Recording, curve: AllanCurve) -> StudiedRecord:
    missing = max((int(np.diff(m, axis=1).sum()) for m in curve.missing), default=0)
    gaps = max(curve.missing, key=len)[:_GAPS].tolist()
    return StudiedRecord(
        rate=recording.rate,
        samples=recording.n_samples,
        duration=recording.duration,
        channels=recording.channels,
        history=recording.history,
        start=_utc(recording.start),
        missing=missing,
        missing_because=tuple(MissingSamples(**entry) for entry in missing_because(recording, missing)),
        gaps=tuple((int(a), int(b)) for a, b in gaps),
    )


def _utc(ns: int | None) -> str | None:
    if ns is None:
        return None
    try:
        moment = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=ns // 1000)
    except OverflowError:
        return None
    return moment.isoformat().replace("+00:00", "Z")
