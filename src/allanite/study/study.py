# SPDX-License-Identifier: BSD-3-Clause
"""Study: everything one recording says, as one result with a versioned document; characterize() makes it.

No formulas here: it is put together from the modules that hold them. Reports, figures and exporters
see it and nothing else.
"""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from allanite import __version__
from allanite.errors import FormatError
from allanite.fitting.instrument_floor import ready_floor
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.allan import AllanCurve
from allanite.plain_files.atomic_file import fresh
from allanite.plain_files.json_values import load_plain
from allanite.quantities.result import Result, read_result
from allanite.recording.channel_names import channel_called
from allanite.recording.cleaning.rows import at_own_rates
from allanite.recording.clock_channels import without_noise
from allanite.recording.health import Finding, check, prepare
from allanite.recording.health.run import missing_because
from allanite.recording.records import Recording, checked_recording
from allanite.study.channel import Curves, channel_study
from allanite.study.request import Progress, ProgressSteps, Request
from allanite.study.result_document import Provenance
from allanite.study.results import ChannelStudy, FloorRecord, MissingSamples, StudiedRecord, models_by_channel
from allanite.study.version_1 import upgraded

if TYPE_CHECKING:
    from allanite.stability.environment.results import EnvironmentEstimate

__all__ = ["Study", "characterize"]

_GAPS, _FAULTS = 100, 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Study(Result):
    """One recording's study.

    Attributes
    ----------
    provenance : Provenance
        Program, command and time that made the study.
    recording : StudiedRecord
        The record.
    findings : tuple of Finding
        Findings about the record, the worst first.
    channels : tuple of ChannelStudy
        Those that bear noise.
    floor : FloorRecord or None
        The record of the shorted input, where one was given.
    """

    FORMAT: ClassVar[str] = "allanite-study"
    VERSION: ClassVar[int] = 2

    provenance: Provenance
    recording: StudiedRecord
    findings: tuple[Finding, ...]
    channels: tuple[ChannelStudy, ...]
    floor: FloorRecord | None = None

    @property
    def result(self) -> Study:
        """Itself: a study is its own document."""
        return self

    @property
    def document(self) -> Mapping[str, object]:
        """The plain document (docs/reference/study-format.md). SI units; numbers that do not exist are null."""
        return self.to_json()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels studied."""
        return tuple(c.name for c in self.channels)

    @property
    def models(self) -> dict[str, NoiseModel]:
        """The noise model of each channel that has one, with its `alternative` where the record cannot decide."""
        return models_by_channel(self.channels)

    def __getitem__(self, name: str) -> ChannelStudy:
        """One channel.

        Raises
        ------
        InputError
            No such channel.
        """
        return channel_called(name, self.channels)

    def __repr__(self) -> str:
        return f"<Study of {self.provenance.source or 'samples in memory'}: {', '.join(self.names)}>"

    @classmethod
    def from_json(cls, data: Mapping[str, object]) -> Study:
        """A study from its document.

        Raises
        ------
        FormatError
            Not a study, a later version, or a part that is missing: all faults at once.
        """
        if data.get("format") != cls.FORMAT:
            raise FormatError(f"not a study: 'format' is {data.get('format')!r}, not {cls.FORMAT!r}")
        if data.get("version") not in (1, cls.VERSION):
            raise FormatError(
                f"this is version {data.get('version')!r} of the study format; this allanite reads versions 1 and "
                f"{cls.VERSION}"
            )
        try:
            return read_result(cls, upgraded(data) if data["version"] == 1 else data)
        except FormatError as faults:
            lines = str(faults).split("\n")[:_FAULTS]
            raise FormatError("the study is damaged:\n" + "\n".join(f"  {line}" for line in lines)) from None

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> Path:
        """Write the document as JSON.

        Raises
        ------
        StorageError
            The file exists and `force` is not set.
        """
        text = json.dumps(self.to_json(), ensure_ascii=False, indent=1, allow_nan=False)
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
            raise FormatError(f"{path} is not a study: it contains a {type(document).__name__}")
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
    prepared, findings = prepare(recording, findings, accept=request.accept)
    names = [c.name for c in prepared.channels if c.kind.noise_bearing and c.name not in request.thermometers]
    if not names:
        raise without_noise(prepared)
    return _Ready(recording=prepared, noise=prepared.select(*names), findings=findings, environment={})


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
        prepared, findings = prepare(after_warm_up, check(after_warm_up), accept=request.accept)
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
