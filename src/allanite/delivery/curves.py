# SPDX-License-Identifier: BSD-3-Clause
"""Curves and noise models out of files, and into them; records made from models."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.delivery.recordings import is_lossy, noise_channels, ready_log
from allanite.delivery.study import study_of
from allanite.errors import InputError
from allanite.regular_file import open_regular

if TYPE_CHECKING:
    from allanite.allan import AllanCurve
    from allanite.instrument_floor import OverFloor
    from allanite.recording import Recording, Sampling

__all__ = ["fit_file", "joined", "over_floor_of", "plain_curves", "save_curve", "simulate_to"]

Json = Mapping[str, Any]

_CURVE_MARK = "# format: allanite-curve"


def _is_saved_curve(place: Path) -> bool:
    if not place.is_file():
        return False
    with open_regular(place) as file:
        return file.read(len(_CURVE_MARK)) == _CURVE_MARK.encode()


def fit_file(
    path: str | os.PathLike[str],
    *,
    method: str = "moments",
    terms: str | None = None,
    lines: Sequence[float] | str = (),
    accept: Collection[str] = (),
    floor: str | os.PathLike[str] | None = None,
    progress: Callable[[float, str], None] | None = None,
    **options: Any,
) -> tuple[list[dict[str, Any]], bool]:
    """Fit the channels of a curve that `AllanCurve.to_csv` wrote, or of a log.

    Faults of a log are refused. By moments it is characterised, so that spectral lines and the band limit are kept out
    of the fit. Options are those of `read_part`. `lines` [Hz] are fitted with the noise by likelihood. `floor` is the
    log of the shorted input, for a log by moments.

    Returns
    -------
    channels : list of dict
        Entries with "name", "kind", "unit" and "models", like those of a study's "channels".
    lossy : bool
        Whether samples or rows of the log did not take part; False for a curve.

    Raises
    ------
    InputError
        Letters of terms, lines or a floor for a method that takes none; a floor for a curve.
    """
    from allanite.allan import AllanCurve, allan_curve
    from allanite.fitting import fit

    place = Path(path)
    of_samples = method in ("likelihood", "spectral")
    if terms is not None and not of_samples:
        raise InputError(f"--method {method} takes no terms: give them with --method likelihood or spectral")
    if len(lines) and (method != "likelihood" or isinstance(lines, str) or _is_saved_curve(place)):
        raise InputError(
            "--lines of a fit are frequencies in Hz, for --method likelihood and a log; `allanite select --lines auto` "
            "finds them"
        )
    if floor is not None and (method != "moments" or _is_saved_curve(place)):
        raise InputError("--floor goes with the log of the sensor and --method moments, which fits both")
    if not _is_saved_curve(place) and method == "moments":
        document = study_of(place, accept=accept, floor=floor, progress=progress, **options).document
        return list(document["channels"]), is_lossy(document["findings"])
    lossy = False
    if _is_saved_curve(place):
        curve = AllanCurve.from_csv(place)
        models = {name: fit(curve[name], method=method) for name in curve.names}
    else:
        prepared, findings = ready_log(place, accept=accept, **options)
        lossy = is_lossy(f.to_json() for f in findings)
        if of_samples:
            asked: dict[str, Any] = {"lines": lines} if len(lines) else {}
            models = {
                name: fit(prepared, method=method, channel=name, terms=terms, **asked)
                for name in noise_channels(prepared)
            }
        else:
            curve = allan_curve(prepared)
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
    from allanite.delivery.recordings import read_floor
    from allanite.instrument_floor import floor_of, over_floor

    return over_floor(curve, floor_of(recording, read_floor(floor, **options)))


def plain_curves(curve: AllanCurve | OverFloor) -> dict[str, Any]:
    """Plain data of each channel."""
    from allanite.allan import AllanCurve

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
