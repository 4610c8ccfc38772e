# SPDX-License-Identifier: BSD-3-Clause
"""The files of a study."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from allanite.commands.measurement import MeasurementResult
from allanite.commands.pictures import Delivered, refuse_figure, save_figure
from allanite.commands.recordings import is_lossy, read_floor, read_part
from allanite.errors import DataQualityError, InputError
from allanite.plain_files.atomic_file import make_folder, refuse_existing
from allanite.plain_files.regular_file import file_sha256

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from allanite.noise.allan import AllanCurve
    from allanite.noise.allan.channel_curve import ChannelCurve
    from allanite.study.results import ChannelStudy
    from allanite.study.study import Study

__all__ = ["RESULTS", "characterized", "curve_of", "refuse_results", "study_of", "write_results"]

RESULTS = ("report.html", "study.json", "allan.csv", "imu.yaml")
"""Files that a study leaves in its folder."""


def refuse_results(
    folder: str | os.PathLike[str] | None, figure: str | os.PathLike[str] | None = None, *, force: bool
) -> None:
    """Raise, before hours are spent, if a result is in the way or the figure is no picture.

    Raises
    ------
    InputError
        A suffix that is no picture.
    StorageError
        Names the files that exist.
    """
    if folder is not None:
        refuse_existing(*(Path(folder) / name for name in RESULTS), force=force)
    if figure is not None:
        refuse_figure(figure, force=force)


def study_of(
    log: str | os.PathLike[str],
    *,
    accept: Collection[str] = (),
    method: str = "moments",
    statistic: str = "oadev",
    temperature: str | Mapping[str, str] | None = None,
    warm_up: Literal["model", "cut"] | None = None,
    floor: str | os.PathLike[str] | None = None,
    exclude: Sequence[tuple[float, float]] = (),
    progress: Callable[[float, str], None] | None = None,
    command: str | None = None,
    source: str | None = None,
    **options: Any,
) -> Study:
    """Read a log and characterise it; the study names the file, its SHA-256 and the command.

    Options are those of `read_part`; `source` replaces the name of the file. `floor` is the log of the shorted input,
    `exclude` are averaging times [s] left out of the fit.
    """
    from allanite.study.characterization import characterize

    if progress is not None:
        progress(0.0, "reading")
    recording = read_part(log, source=source, **options)
    origin = {"sha256": file_sha256(log), "command": command}
    below = None if floor is None else read_floor(floor, **options)
    return characterize(
        recording,
        accept=accept,
        method=method,
        statistic=statistic,
        temperature=temperature,
        warm_up=warm_up,
        floor=below,
        exclude=exclude,
        progress=progress,
        provenance=origin,
    )


def characterized(
    log: str | os.PathLike[str], *, progress: Callable[[float, str], None] | None = None, **options: Any
) -> MeasurementResult:
    """The study of a log, with its files; options are those of `study_of`."""
    study = study_of(log, progress=progress, **options)
    return MeasurementResult(
        result=study,
        document=study,
        name="study",
        tables={},
        lossy=is_lossy(f.to_json() for f in study.findings),
        write=partial(write_results, study),
    )


def write_results(
    study: Study,
    folder: str | os.PathLike[str] | None,
    figure: str | os.PathLike[str] | None = None,
    *,
    force: bool = False,
) -> Delivered:
    """Leave report.html, study.json, allan.csv and imu.yaml in a folder, and the paper figure where it is wanted.

    Channels of other sample intervals than the first have their curves in allan-2.csv and so on.

    The folder is made if it is not there. A record from which no imu.yaml can be made (unknown units, no model)
    still gets the other files, and a note that says why.

    Raises
    ------
    StorageError
        One of the files exists and `force` is not given, or the disk refuses.
    """
    refuse_results(folder, figure, force=force)
    drawn = () if figure is None else (save_figure(study, figure, force=force),)
    if folder is None:
        return Delivered(files=drawn, notes=())
    from allanite.exporters import export
    from allanite.views.report import render

    place = Path(folder)
    make_folder(place)
    report, document, curve, yaml = (place / name for name in RESULTS)
    study.save(document, force=force)
    curves = [curve, *(place / f"allan-{k}.csv" for k in range(2, len(_by_interval(study)) + 1))]
    for path, part in zip(curves, _by_interval(study), strict=True):
        _curve(study, part).to_csv(path, force=force)
    files, notes = [document, *curves], []
    try:
        export("kalibr", study, yaml, force=force)
        files.append(yaml)
    except (InputError, DataQualityError) as refusal:
        notes.append(f"{yaml.name} was not written: {refusal}")
    render(study, report, force=force, beside=[path.name for path in files])
    return Delivered(files=(report, *files, *drawn), notes=tuple(notes))


def curve_of(study: Study) -> AllanCurve:
    """The curves of all channels of a study as one `AllanCurve`, NaN at lags that a channel does not have.

    Raises
    ------
    InputError
        Channels of different sample intervals: sensors slower than the log, each at its own rate.
    """
    parts = _by_interval(study)
    if len(parts) > 1:
        groups = "; ".join(
            f"{', '.join(c.name for c in part)} at {1 / part[0].curve.dt:.6g} Hz" for part in parts
        )
        raise InputError(
            f"the channels have different rates ({groups}): choose those of one rate at a time (--channels)"
        )
    return _curve(study, parts[0])


def _by_interval(study: Study) -> list[list[ChannelStudy]]:
    """The channels of a study in groups of one sample interval, in their order."""
    groups: dict[tuple[float, int], list[ChannelStudy]] = {}
    for channel in study.channels:
        groups.setdefault((channel.curve.dt, channel.curve.n_samples), []).append(channel)
    return list(groups.values())


def _curve(study: Study, channels: Sequence[ChannelStudy]) -> AllanCurve:
    """The curves of channels of one sample interval."""
    import numpy as np

    from allanite.noise.allan import AllanCurve
    from allanite.noise.allan.statistics import STATISTICS

    known = {c.name: c for c in study.recording.channels}
    parts = [c.curve for c in channels]
    first, bases = parts[0], {p.interval_basis for p in parts}
    lags = np.unique(np.concatenate([p.lags for p in parts]))

    def column(values: NDArray[np.float64], part: ChannelCurve) -> NDArray[np.float64]:
        on_all = np.full(lags.size, np.nan)
        on_all[np.searchsorted(lags, part.lags)] = values
        return on_all

    table = {
        name: np.stack([column(getattr(p, name), p) for p in parts], axis=1)
        for name in ("deviation", "lower", "upper", "edf", "count")
    }
    return AllanCurve(
        statistic=first.statistic,
        lags=lags,
        tau=STATISTICS[first.statistic].averaging(lags, first.n_samples) * first.dt,
        count=np.nan_to_num(table.pop("count")).astype(np.int64),
        confidence=first.confidence,
        channels=tuple(known[c.name] for c in channels),
        dt=first.dt,
        n_samples=first.n_samples,
        missing=tuple(p.missing for p in parts),
        engine=first.engine,
        excluded=np.stack([_bent(lags, p) for p in parts], axis=1),
        interval_basis=bases.pop() if len(bases) == 1 else "exact under the model of each channel",
        excess_kurtosis=(),
        **table,
    )


def _bent(lags: NDArray[np.int64], part: ChannelCurve) -> NDArray[np.bool_]:
    """Lags at which one channel was kept out of the fit."""
    import numpy as np

    return np.isin(lags, [m for m, reason in zip(part.lags, part.excluded, strict=False) if reason])
