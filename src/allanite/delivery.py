# SPDX-License-Identifier: BSD-3-Clause
"""What the commands hand over: the files of a study, the facts of a recording, curves and models.

Each function is one line of a command, and can be called as well without the command line.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.atomic_file import fresh, make_folder, refuse_existing
from allanite.errors import DataQualityError, InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from allanite.allan import AllanCurve
    from allanite.health import Finding
    from allanite.recording import Recording, Sampling
    from allanite.study import Study

__all__ = [
    "RESULTS",
    "Delivered",
    "curve_of",
    "describe",
    "file_sha256",
    "fit_file",
    "has_gaps",
    "is_lossy",
    "joined",
    "read_part",
    "refuse_figure",
    "refuse_results",
    "save_curve",
    "save_figure",
    "simulate_to",
    "study_of",
    "write_results",
]

Json = Mapping[str, Any]

RESULTS = ("report.html", "study.json", "allan.csv", "imu.yaml")
"""Files that a study leaves in its folder."""

_CURVE_MARK = "# format: allanite-curve"
_FIGURES = (".pdf", ".svg", ".png")
_LOSSES = frozenset(
    {
        "missing",
        "broken_up",
        "overload",
        "ragged_rows",
        "cells_missing",
        "duplicate_stamps",
        "unterminated_last_line",
    }
)


# -- recordings -------------------------------------------------------------------------------------------


def read_part(
    path: str | os.PathLike[str], *, start: float | None = None, stop: float | None = None, **options: Any
) -> Recording:
    """A log, or the part of it between two times [s] since its first sample; options are those of `read`."""
    from allanite.readers import read

    recording = read(path, **options)
    return recording if start is None and stop is None else recording.window(start, stop)


def describe(recording: Recording, findings: Iterable[Finding]) -> dict[str, Any]:
    """Facts of a recording and what was found in it, as plain data."""
    found = [f.to_json() for f in findings]
    gaps = [f for f in found if f["code"] == "missing"]
    return {
        "source": recording.source,
        "rate": recording.rate,
        "samples": recording.n_samples,
        "duration": recording.duration,
        "start": recording.start,
        "missing": max((f["count"] for f in gaps), default=0),
        "gaps": [place for f in gaps for place in f["places"]],
        "channels": [c.to_json() for c in recording.channels],
        "history": [dict(step) for step in recording.history],
        "findings": found,
    }


def is_lossy(findings: Iterable[Json]) -> bool:
    """True when samples or rows of the record did not take part: gaps, overloads, dropped rows, exclusions."""
    return any(f["count"] > 0 and (f.get("excludes") or f["code"] in _LOSSES) for f in findings)


def has_gaps(recording: Recording) -> bool:
    """True when a sample of any channel is missing."""
    import numpy as np

    return any(np.isnan(block).any() for name in recording.names for _, block in recording.blocks(name))


def file_sha256(path: str | os.PathLike[str]) -> str | None:
    """SHA-256 of a file in hexadecimal; None for a folder."""
    place = Path(path)
    if not place.is_file():
        return None
    with place.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


# -- results of a study -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Delivered:
    """Files that were written, and why others were not.

    Attributes
    ----------
    files : tuple of Path
    notes : tuple of str
        One sentence for each file that could not be made.
    """

    files: tuple[Path, ...]
    notes: tuple[str, ...]


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
    statistic: str = "oadev",
    progress: Callable[[float, str], None] | None = None,
    command: str | None = None,
    source: str | None = None,
    **options: Any,
) -> Study:
    """Read a log and characterise it; the study names the file, its SHA-256 and the command.

    Options are those of `read_part`; `source` replaces the name of the file.
    """
    from allanite.study import characterize

    recording = read_part(log, **options)
    if source is not None:
        recording = replace(recording, source=source)
    origin = {"sha256": file_sha256(log), "command": command}
    return characterize(recording, accept=accept, statistic=statistic, progress=progress, provenance=origin)


def write_results(
    study: Study,
    folder: str | os.PathLike[str] | None,
    figure: str | os.PathLike[str] | None = None,
    *,
    force: bool = False,
) -> Delivered:
    """Leave report.html, study.json, allan.csv and imu.yaml in a folder, and the paper figure where it is wanted.

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
    from allanite.report import render

    place = Path(folder)
    make_folder(place)
    report, document, curve, yaml = (place / name for name in RESULTS)
    study.save(document, force=force)
    curve_of(study).to_csv(curve, force=force)
    render(study, report, force=force)
    files = (report, document, curve)
    try:
        export("kalibr", study, yaml, force=force)
    except (InputError, DataQualityError) as refusal:
        return Delivered(files=files + drawn, notes=(f"no {yaml.name}: {refusal}",))
    return Delivered(files=(*files, yaml, *drawn), notes=())


def curve_of(study: Study) -> AllanCurve:
    """The curves of all channels of a study as one `AllanCurve`, NaN at lags that a channel does not have."""
    import numpy as np

    from allanite.allan import AllanCurve
    from allanite.recording import Channel

    document = study.document
    parts = [c["curve"] for c in document["channels"]]
    known = {c["name"]: c for c in document["recording"]["channels"]}
    lags = np.unique(np.concatenate([p["lags"] for p in parts])).astype(np.int64)
    table = {
        k: np.full((lags.size, len(parts)), np.nan) for k in ("deviation", "lower", "upper", "edf", "count")
    }
    for i, part in enumerate(parts):
        rows = np.searchsorted(lags, part["lags"])
        for key, values in table.items():
            values[rows, i] = np.array(part[key], dtype=np.float64)
    count = np.nan_to_num(table.pop("count")).astype(np.int64)
    bases = {p["interval_basis"] for p in parts}
    first = parts[0]
    return AllanCurve(
        statistic=first["statistic"],
        lags=lags,
        tau=lags * first["dt"],
        count=count,
        confidence=first["confidence"],
        channels=tuple(Channel.from_json(known[c["name"]]) for c in document["channels"]),
        dt=first["dt"],
        n_samples=first["n_samples"],
        missing=tuple(np.array(p.get("missing") or [], dtype=np.int64).reshape(-1, 2) for p in parts),
        engine=first["engine"],
        excluded=np.stack([_bent(lags, part) for part in parts], axis=1),
        interval_basis=bases.pop() if len(bases) == 1 else "exact under the model of each channel",
        **table,
    )


def _bent(lags: NDArray[np.int64], part: Json) -> NDArray[np.bool_]:
    """Lags of a channel's curve that a line or the filter bends."""
    import numpy as np

    return np.isin(
        lags, [m for m, reason in zip(part["lags"], part.get("excluded") or [], strict=False) if reason]
    )


# -- figures ----------------------------------------------------------------------------------------------


def refuse_figure(path: str | os.PathLike[str], *, force: bool) -> None:
    """Raise, before hours are spent, if a figure cannot be written there.

    Raises
    ------
    InputError
        A suffix that is no picture.
    StorageError
        The file exists and `force` is not given.
    """
    if Path(path).suffix.lower() not in _FIGURES:
        raise InputError(f"{path}: a figure is written as {', '.join(_FIGURES)}; give one of these suffixes")
    refuse_existing(path, force=force)


def save_figure(result: object, path: str | os.PathLike[str], *, force: bool = False, **options: Any) -> Path:
    """Draw a result on paper; the suffix of the path says how. Options are those of `plot`."""
    from allanite.figures import plot

    refuse_figure(path, force=force)
    drawn = plot(result, **options)
    with fresh(path, force=force) as place:
        drawn.savefig(place, dpi=200)
    return Path(path)


# -- curves and models ------------------------------------------------------------------------------------


def _is_saved_curve(place: Path) -> bool:
    if not place.is_file():
        return False
    with place.open("rb") as file:
        return file.read(len(_CURVE_MARK)) == _CURVE_MARK.encode()


def fit_file(
    path: str | os.PathLike[str],
    *,
    method: str = "moments",
    accept: Collection[str] = (),
    progress: Callable[[float, str], None] | None = None,
    **options: Any,
) -> tuple[list[dict[str, Any]], bool]:
    """Fit the channels of a curve that `AllanCurve.to_csv` wrote, or of a log.

    Faults of a log are refused. By moments it is characterised, so that spectral lines and the band limit are kept out
    of the fit. Options are those of `read_part`.

    Returns
    -------
    channels : list of dict
        Entries with "name", "kind", "unit" and "models", like those of a study's "channels".
    lossy : bool
        Whether samples or rows of the log did not take part; False for a curve.
    """
    from allanite.allan import AllanCurve, allan_curve
    from allanite.fitting import fit
    from allanite.health import check, prepare

    place = Path(path)
    if not _is_saved_curve(place) and method == "moments":
        document = study_of(place, accept=accept, progress=progress, **options).document
        return list(document["channels"]), is_lossy(document["findings"])
    lossy = False
    if _is_saved_curve(place):
        curve = AllanCurve.from_csv(place)
    else:
        recording = read_part(place, **options)
        prepared, findings = prepare(recording, check(recording), accept=accept)
        curve, lossy = allan_curve(prepared), is_lossy(f.to_json() for f in findings)
    models = {name: fit(curve[name], method=method) for name in curve.names}
    channels = [
        {
            "name": name,
            "kind": model.kind,
            "unit": model.unit,
            "models": [m.to_json() for m in model.families],
        }
        for name, model in models.items()
    ]
    return channels, lossy


def joined(models: Sequence[Json]) -> Json:
    """The models of a channel as one: the first, with the other family as its "alternative" where there is one."""
    return {**models[0], "alternative": models[1]} if len(models) > 1 else models[0]


def save_curve(curve: AllanCurve, path: str, *, force: bool = False) -> None:
    """Write a curve as CSV; to stdout for "-"."""
    if path != "-":
        curve.to_csv(path, force=force)
        return
    with tempfile.TemporaryDirectory() as folder:
        sys.stdout.write(curve.to_csv(Path(folder) / "allan.csv").read_text(encoding="utf-8"))


def simulate_to(
    model: str | os.PathLike[str],
    path: str | os.PathLike[str],
    *,
    rate: float | None,
    duration: float,
    seed: int,
    sampling: Sampling = "mean",
    unit: str | Mapping[str, str] | None = None,
    force: bool = False,
    progress: Callable[[float], None] | None = None,
) -> str:
    """Simulate the models of a file into a recording file; what was done, in one sentence.

    Raises
    ------
    InputError
        No rate, neither given nor in the file.
    """
    from allanite.model_file import load_models
    from allanite.recording_file import refuse_recording, summary, write_recording
    from allanite.simulation import simulate

    models, own_rate = load_models(model)
    if rate is None and own_rate is None:
        raise InputError(f"{model} does not say how often to sample: give --rate (rate=)")
    refuse_recording(path, force=force)
    step = None if progress is None else lambda fraction: progress(0.8 * fraction)
    chosen: Any = models if len(models) > 1 else next(iter(models.values()))
    recording = simulate(
        chosen,
        rate=own_rate if rate is None else rate,  # type: ignore[arg-type]
        duration=duration,
        seed=seed,
        sampling=sampling,
        unit=unit,
        progress=step,
        name=None if len(models) > 1 else next(iter(models)),
    )
    return summary(recording, write_recording(recording, path, force=force)) + f", seed {seed}"
