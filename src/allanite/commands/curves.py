# SPDX-License-Identifier: BSD-3-Clause
"""Curves and noise models out of files, and into them; records made from models."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.commands.option import BENCH_FILE
from allanite.commands.recordings import is_lossy, noise_channels, ready_log
from allanite.commands.study import study_of
from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.regular_file import open_regular

if TYPE_CHECKING:
    from allanite.fitting.sensor_curves import OverFloor
    from allanite.noise import NoiseModel
    from allanite.noise.allan import AllanCurve
    from allanite.noise.allan.interval_error import IntervalError
    from allanite.recording.records import Recording, Sampling
    from allanite.study.results import ChannelModels

__all__ = [
    "FittedModels",
    "fit_file",
    "interval_errors_of",
    "over_floor_of",
    "plain_curves",
    "save_curve",
    "simulate_to",
]

_CURVE_MARK = "# format: allanite-curve"


def _is_saved_curve(place: Path) -> bool:
    if not place.is_file():
        return False
    with open_regular(place) as file:
        return file.read(len(_CURVE_MARK)) == _CURVE_MARK.encode()


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedModels:
    """Models of a curve or of a log.

    Attributes
    ----------
    channels : tuple of ChannelModels
        Those of a study, where the curve was fitted to a log.
    lossy : bool
        Whether samples or rows of the log did not take part; False for a curve.
    remarks : tuple of str
        What was concluded about a curve of another program, in words.
    """

    channels: tuple[ChannelModels, ...]
    lossy: bool
    remarks: tuple[str, ...] = ()

    @property
    def models(self) -> dict[str, NoiseModel]:
        """By channel, with its `alternative` where the record cannot decide."""
        from allanite.study.results import models_by_channel

        return models_by_channel(self.channels)


#: Options of a log that say how a table is written, or what its values are; the others mean nothing for a curve.
_OF_TABLES = ("unit", "rate", "channels", "sampling", "delimiter", "decimal", "variable")


def fit_file(
    path: str | os.PathLike[str],
    *,
    curve: bool = False,
    samples: int | None = None,
    statistic: str | None = None,
    method: str = "moments",
    terms: str | None = None,
    lines: Sequence[float] | str | None = None,
    accept: Collection[str] = (),
    floor: str | os.PathLike[str] | None = None,
    progress: Callable[[float, str], None] | None = None,
    **options: Any,
) -> FittedModels:
    """Fit the channels of a curve that `AllanCurve.to_csv` wrote, of a `curve` of another program, or of a log.

    Faults of a log are refused. By moments it is characterised, so that spectral lines and the band limit are kept out
    of the fit. Options are those of `read_part`. `lines` [Hz] are fitted with the noise by likelihood; by default the
    steady ones of the spectrum. `floor` is the log of the shorted input, for a log by moments. `samples` and
    `statistic` are those of `allanite.files.foreign_curves.read_curve`.

    Raises
    ------
    InputError
        Letters of terms, lines or a floor for a method that takes none; a floor for a curve; options of a log for
        a curve.
    """
    from allanite.fitting import fit
    from allanite.noise.allan import allan_curve

    place = Path(path)
    of_samples = method in ("likelihood", "spectral")
    saved = _is_saved_curve(place)
    if not curve and (samples is not None or statistic is not None):
        raise InputError(
            "--samples and --statistic describe a curve from another program: use them with --curve"
        )
    if curve or saved:
        if terms is not None or lines is not None or floor is not None or of_samples or accept:
            raise InputError(
                "a curve is fitted by --method moments or slopes, without --terms, --lines, --floor or "
                "--accept: these need the samples"
            )
        return _fit_curve(place, saved, method, samples=samples, statistic=statistic, **options)
    if terms is not None and not of_samples:
        raise InputError(f"--method {method} takes no terms: use --method likelihood or spectral")
    if lines is not None and method != "likelihood":
        raise InputError(f"--method {method} takes no lines: use --method likelihood")
    if floor is not None and method != "moments":
        raise InputError("--floor goes with the log of the sensor and --method moments, which fits both")
    if method == "moments":
        study = study_of(place, accept=accept, floor=floor, progress=progress, **options)
        return FittedModels(channels=study.channels, lossy=is_lossy(f.to_json() for f in study.findings))
    prepared, findings = ready_log(place, accept=accept, by_averages=not of_samples, **options)
    if of_samples:
        asked: dict[str, Any] = {} if lines is None else {"lines": lines}
        # Of a single channel that lost nothing a second look would find the same.
        same = len(prepared.channels) == 1 and not any(f.excludes for f in findings)
        models = {
            name: fit(
                prepared, method=method, channel=name, terms=terms, screen=findings if same else True, **asked
            )
            for name in noise_channels(prepared)
        }
    else:
        made = allan_curve(prepared)
        models = {name: fit(made[name], method=method) for name in made.names}
    return FittedModels(channels=_channels(models), lossy=is_lossy(f.to_json() for f in findings))


def _fit_curve(place: Path, saved: bool, method: str, **options: Any) -> FittedModels:
    from allanite.files.foreign_curves import ForeignCurve, read_curve
    from allanite.fitting import fit
    from allanite.noise.allan import AllanCurve

    if options.get("config") == BENCH_FILE:  # it states how logs are read
        del options["config"]
    unfit = [
        k
        for k, v in options.items()
        if k not in (*_OF_TABLES, "samples", "statistic") and v not in (None, ())
    ]
    if unfit:
        names = {"start": "from", "stop": "to"}
        raise InputError(
            f"--{', --'.join(names.get(k, k).replace('_', '-') for k in unfit)} has no meaning for a curve"
        )
    if saved:
        stated = [k for k in ("samples", "statistic", "rate", "unit") if options.get(k) is not None]
        if stated:
            options_said = " and ".join(f"--{k}" for k in stated)
            raise InputError(
                f"{place.name} is a curve of allanite and contains this: leave out {options_said}"
            )
        read = ForeignCurve(curve=AllanCurve.from_csv(place), remarks=())
    else:
        given = {k: options[k] for k in (*_OF_TABLES, "samples", "statistic") if options.get(k) is not None}
        read = read_curve(place, **given)
    models = {name: fit(read.curve[name], method=method) for name in read.curve.names}
    return FittedModels(channels=_channels(models), lossy=False, remarks=read.remarks)


def _channels(models: Mapping[str, NoiseModel]) -> tuple[ChannelModels, ...]:
    from allanite.study.results import ChannelModels

    return tuple(
        ChannelModels(name=name, kind=model.kind, unit=model.unit, models=model.families)
        for name, model in models.items()
    )


def save_curve(curve: AllanCurve | OverFloor, path: str, *, force: bool = False) -> None:
    """Write a curve as CSV; to stdout for "-"."""
    if path != "-":
        curve.to_csv(path, force=force)
        return
    with tempfile.TemporaryDirectory() as folder:
        sys.stdout.write(curve.to_csv(Path(folder) / "allan.csv").read_text(encoding="utf-8"))


def over_floor_of(
    curve: AllanCurve, recording: Recording, floor: str | os.PathLike[str], **options: Any
) -> OverFloor:
    """A curve without the instrument's own noise, from the log of its shorted input; options as for `read_floor`."""
    from allanite.commands.recordings import read_floor
    from allanite.fitting.instrument_floor import floor_of, over_floor

    return over_floor(curve, floor_of(recording, read_floor(floor, **options)))


def interval_errors_of(
    path: str | os.PathLike[str], *, statistic: str, taus: Any = "octave", **options: Any
) -> tuple[IntervalError, ...]:
    """Maximum or rms time interval error of a clock's log; options are those of `read_part`."""
    from allanite.commands.recordings import read_part
    from allanite.noise.allan.interval_error import interval_error

    return interval_error(read_part(path, **options), statistic=statistic, taus=taus)


def plain_curves(curve: AllanCurve | OverFloor) -> dict[str, Any]:
    """Plain data of each channel."""
    from allanite.noise.allan import AllanCurve

    if isinstance(curve, AllanCurve):
        return {name: curve[name].to_json() for name in curve.names}
    return {
        name: {
            "measured": curve.measured[name].to_json(),
            "instrument": curve.floor[name].to_json(),
            "sensor": curve.to_json(name),
        }
        for name in curve.names
    }


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
    from allanite.files.recording_file import refuse_recording, summary, write_recording
    from allanite.filtering.simulation import simulate
    from allanite.study.model_file import load_models

    models, own_rate = load_models(model)
    if rate is None and own_rate is None:
        raise InputError(f"{model} does not state a sample rate: pass --rate (rate=)")
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
