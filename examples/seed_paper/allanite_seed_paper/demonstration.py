# SPDX-License-Identifier: BSD-3-Clause
"""The experiment of the seed paper on a twin: the week at rest, the four takes, every figure, and what is true of it.

The twin is simulated, so that the truth is known; everything after that is done as with a log. The noise model comes
from the twin's own week, never from the truth.

`run_week` does the first half in some ten seconds: a week of the gyro, characterised, beside the published values.
`run_seed_paper` does all of it.
"""

from __future__ import annotations

import json
import math
import os
import platform
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.plain_files.atomic_file import fresh, make_folder, refuse_existing
from allanite.plain_files.extras import require
from allanite.plain_files.json_values import plain as plain_values
from allanite_seed_paper import twin

if TYPE_CHECKING:
    from allanite.experiments.earth_rate import EarthRateEstimate
    from allanite.experiments.reference_aided import ReferenceAided
    from allanite.experiments.reversals import Reversals
    from allanite.noise import NoiseModel
    from allanite.noise.allan.channel_curve import ChannelCurve
    from allanite.recording.records import Recording
    from allanite.study.study import Study
    from allanite_seed_paper.figures import PaperFigure

__all__ = ["FAULT_OF", "Demonstration", "run_seed_paper", "run_week"]

Json = dict[str, Any]
Progress = Callable[[float, str], None]

FAULT_OF: Mapping[int, str] = {2: "coherent", 3: "settling", 4: "drift"}
"""The fault of `twin.FAULTS` that would explain each take's published miss; the first take needs none."""

#: Typed into the reference-aided filter, in units of the Earth's rate: right, twice, and the wrong way round.
TOLD = (1.0, 2.0, -1.0)
#: Lengths of record for which the bound is tabulated [s].
BOUND_AT = (60.0, 720.0, 1500.0, 3600.0, 7200.0)
_WEEK_FILES = ("report.html", "study.json", "allan.csv", "imu.yaml")


@dataclass(frozen=True, slots=True, kw_only=True)
class Demonstration:
    """What a demonstration found and left.

    Attributes
    ----------
    document : dict
        Plain data: "week" with the parameters beside the truth and, of the whole experiment, "takes", "aided" and
        "bound".
    files : tuple of Path
    """

    document: Json = field(repr=False)
    files: tuple[Path, ...]

    def to_json(self) -> Json:
        """The document."""
        return dict(self.document)


# -- the week ---------------------------------------------------------------------------------------------


def run_week(
    out: str | os.PathLike[str],
    *,
    seed: int = 1,
    duration: float = twin.WEEK,
    force: bool = False,
    progress: Progress | None = None,
) -> Demonstration:
    """Simulate the week of the seed paper's gyro, characterise it, and leave the files of a study in a folder.

    Parameters
    ----------
    out : path
        Folder for report.html, study.json, allan.csv and imu.yaml.
    seed : int
    duration : float [s]
        In place of the week.
    force : bool
        Replace files that are there.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Raises
    ------
    StorageError
        A file exists and `force` is not given, or the disk refuses.
    """
    place = Path(out)
    refuse_existing(*(place / name for name in _WEEK_FILES), force=force)
    advance = progress or (lambda fraction, what: None)
    study, files = _week(place, seed, duration, force, advance)
    document = {**_head(seed), "week": _week_part(study, duration)}
    return Demonstration(document=document, files=files)


def _week(
    place: Path, seed: int, duration: float, force: bool, advance: Progress
) -> tuple[Study, tuple[Path, ...]]:
    """The study of a simulated week, and its files."""
    from allanite.exporters import export
    from allanite.noise.allan import allan_curve
    from allanite.study.characterization import characterize
    from allanite.views.report import render

    record = twin.week(seed, duration=duration, progress=lambda f: advance(0.35 * f, "simulating the week"))
    study = characterize(record, progress=lambda f, what: advance(0.35 + 0.5 * f, what))
    advance(0.9, "writing the study")
    make_folder(place)
    report, document, curve, yaml = (place / name for name in _WEEK_FILES)
    study.save(document, force=force)
    allan_curve(record).to_csv(curve, force=force)
    export("kalibr", study, yaml, force=force)
    render(study, report, force=force, beside=_WEEK_FILES[1:])
    return study, (report, document, curve, yaml)


def _head(seed: int) -> Json:
    import numpy as np

    from allanite import __version__

    return {
        "format": "allanite-demonstration",
        "version": 1,
        "seed": seed,
        "provenance": {
            "allanite": __version__,
            "created": datetime.now(UTC).replace(microsecond=0).isoformat().replace("+00:00", "Z"),
            "python": platform.python_version(),
            "numpy": np.__version__,
        },
    }


def _week_part(study: Study, duration: float) -> Json:
    """Parameters beside the published values, in SI."""
    (model,) = study.models.values()
    (channel,) = study.channels
    slopes = {read.symbol: plain_values(read.value) for read in channel.slopes}
    truth = {"N": twin.N, "B": twin.B, "T": twin.T_B, "K": twin.K}
    rows = []
    for symbol, published in truth.items():
        estimate = model.estimate("B_equiv" if symbol == "B" else symbol) or model.estimate(symbol)
        plain = {} if estimate is None else estimate.to_json()
        rows.append(
            {
                "symbol": symbol,
                "published": published,
                **{key: plain.get(key) for key in ("value", "lower", "upper")},
                "supported": bool(plain.get("supported")),
                "slope": slopes.get(symbol),
            }
        )
    return {
        "duration": duration,
        "samples": study.recording.samples,
        "parameters": rows,
        "verdict": channel.models[0].verdict,
        "model": model.to_json(),
        "minimum": _minimum(channel.curve),
        "minimum_of_model": _minimum_of(twin.sensor()),
        "minimum_of_flicker": _minimum_of(twin.sensor(flicker=True)),
    }


def _minimum(curve: ChannelCurve) -> float:
    """Averaging time of the lowest point of a measured curve [s]."""
    import numpy as np

    return float(curve.tau[np.nanargmin(curve.deviation)])


def _minimum_of(model: NoiseModel) -> float:
    """Averaging time at which the Allan deviation of a model is lowest [s]."""
    import numpy as np

    tau = np.geomspace(1.0, 1e4, 4001)
    return float(tau[np.argmin(model.avar(tau))])


# -- the whole experiment ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Run:
    """One take of the twin and what was made of it."""

    record: Recording
    reversals: Reversals
    estimate: EarthRateEstimate


def run_seed_paper(
    out: str | os.PathLike[str],
    *,
    seed: int = 1,
    duration: float = twin.WEEK,
    force: bool = False,
    progress: Progress | None = None,
) -> Demonstration:
    """The whole experiment of the seed paper on a twin.

    Leaves report.html and demonstration.json in the folder, the study of the week in ``week``, the four takes as
    Parquet in ``takes``, and all figures as PDF and PNG in ``figures``.

    Parameters
    ----------
    out : path
    seed : int
        The same seed gives the same samples.
    duration : float [s]
        In place of the week.
    force : bool
        Replace files that are there.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Raises
    ------
    InputError
        Matplotlib, which draws the figures, is not installed.
    StorageError
        A file exists and `force` is not given, or the disk refuses.
    """
    from allanite.files.recording_file import write_recording
    from allanite.views.report import render
    from allanite_seed_paper.report import page

    require("matplotlib", "plot", "the whole experiment, with its figures as PDF and PNG,")
    place, advance = Path(out), progress or (lambda fraction, what: None)
    report, plain = place / "report.html", place / "demonstration.json"
    refuse_existing(report, plain, force=force)
    make_folder(place)
    for name in ("week", "takes", "figures"):
        make_folder(place / name)
    study, files = _week(place / "week", seed, duration, force, lambda f, what: advance(0.35 * f, what))
    (model,) = study.models.values()
    runs, faulty = {}, {}
    for i, n in enumerate(twin.TAKES):
        advance(0.36 + 0.02 * i, f"take {n}")
        runs[n] = _measured(n, seed, model)
    for i, (n, fault) in enumerate(FAULT_OF.items()):
        advance(0.44 + 0.02 * i, f"take {n} with a fault")
        faulty[n] = _measured(n, seed, model, fault)
    warm = _again(runs[4], model, warm_up=True)
    end = _end_of_take_4(runs[4], model)
    advance(0.5, "filter that is told the rate")
    aided = {n: _aided(run) for n, run in runs.items()}
    document = {
        **_head(seed),
        "week": _week_part(study, duration),
        "takes": [
            *(_take_part(n, run.estimate) for n, run in runs.items()),
            {**_take_part(4, warm), "remark": "warm-up fitted beside the rate"},
            {**_take_part(4, end), "published": twin.TAKE_4_END.published, "remark": "last 13 min"},
        ],
        "faulty": [{**_take_part(n, run.estimate), "fault": FAULT_OF[n]} for n, run in faulty.items()],
        "aided": [
            {"take": n, **_short(reading)} for n, both in aided.items() for which in both for reading in which
        ],
        "bound": _bound(),
    }
    advance(0.55, "drawing")
    figures = _figures(study, runs, warm, faulty, aided)
    takes = [
        write_recording(run.record, place / "takes" / f"take-{n}.parquet", force=force)
        for n, run in runs.items()
    ]
    drawn = _draw(figures, place / "figures", force, lambda f, what: advance(0.6 + 0.3 * f, what))
    advance(0.9, "writing the report")
    made = (plain, *files, *takes, *drawn)
    beside = [path.relative_to(place).as_posix() for path in made]
    render(page({**document, "figures": figures}), report, force=force, beside=beside)
    with fresh(plain, force=force) as spot:
        spot.write_text(
            json.dumps(document, ensure_ascii=False, indent=1, allow_nan=False) + "\n", encoding="utf-8"
        )
    advance(1.0, "done")
    return Demonstration(document=document, files=(report, *made))


def _measured(number: int, seed: int, model: NoiseModel, *faults: str) -> _Run:
    """A take of the twin, its turns read off the signal, and the Earth rate from it."""
    from allanite.experiments.reversals import find_reversals

    # A fault is shown alone: the drift of take 4 stands in place of its warm-up, not beside it.
    record = twin.take(number, seed, faults=faults, warm_up=None if faults else twin.WARM_UP)
    reversals = find_reversals(record, first="north")
    return _Run(record=record, reversals=reversals, estimate=_estimate(record, reversals, model))


def _estimate(
    record: Recording, reversals: Reversals, model: NoiseModel, **options: Any
) -> EarthRateEstimate:
    from allanite.experiments.earth_rate import measure_earth_rate

    return measure_earth_rate(record, latitude=twin.LATITUDE, model=model, reversals=reversals, **options)


def _again(run: _Run, model: NoiseModel, **options: Any) -> EarthRateEstimate:
    return _estimate(run.record, run.reversals, model, **options)


def _end_of_take_4(run: _Run, model: NoiseModel) -> EarthRateEstimate:
    """Its last 13 min, which the paper evaluates by themselves. They begin with a dwell to the north or the south."""
    from allanite.experiments.reversals import find_reversals

    begin = run.record.duration - twin.TAKE_4_END.duration
    part, offset = run.record.window(begin, None), round(begin * run.record.rate)
    reversals = find_reversals(part, first="north")
    dwell = reversals.dwells[0]
    if run.reversals.signs()[offset + (dwell.start + dwell.stop) // 2] != dwell.sign:
        reversals = find_reversals(part, first="south")
    return _estimate(part, reversals, model)


def _take_part(number: int, estimate: EarthRateEstimate) -> Json:
    """A take's estimate without its long series, with its sentences: this document holds what is said of it."""
    document = estimate.to_json()
    for name in ("running", "dwells", "dead_times", "reversals"):
        del document[name]
    spoken = {
        "rate": estimate.rate,
        "interval": estimate.interval,
        "reason": estimate.reason,
        "advice": estimate.advice,
        "checks": [{**c.to_json(), "name": c.name, "says": c.says} for c in estimate.checks],
    }
    return {
        "take": number,
        "published": twin.TAKES[number].published,
        "turns": len(estimate.reversals.turns),
        "bound": _least_sd(estimate.duration),
        **document,
        **plain_values(spoken),
    }


@cache
def _least_sd(duration: float, dead_time: float = 0.0, *, flicker: bool = False) -> float | None:
    """Standard deviation of the Earth rate that the published noise allows in so long a record [rad/s].

    With dwells of 30 s; None where such a record cannot tell. No estimate enters: it is a bound to hold them against.
    """
    from allanite.experiments.planning import plan

    made = plan(
        twin.sensor(flicker=flicker),
        latitude=twin.LATITUDE,
        dead_time=dead_time,
        dwells=[twin.DWELL],
        durations=[duration],
    )
    sd = float(made.sd[0, 0])
    return sd if math.isfinite(sd) else None


def _aided(run: _Run) -> tuple[list[ReferenceAided], list[ReferenceAided]]:
    """The paper's filter with its published parameters, told each of `TOLD`: unsigned, and demodulated."""
    import numpy as np

    from allanite.experiments.reference_aided import reference_aided
    from allanite.quantities.earth import EARTH_RATE

    sensor, signs = twin.sensor(), run.reversals.signs()
    (channel,) = run.record.names
    idle = np.flatnonzero(np.diff(np.concatenate([[0], (signs == 0).astype(np.int8), [0]]))).reshape(-1, 2)
    still = run.record.excluding({channel: idle}, "turns")
    rates = [share * EARTH_RATE for share in TOLD]
    return (
        [reference_aided(still, sensor, reference=rate) for rate in rates],
        [reference_aided(run.record, sensor, reference=rate, signs=signs) for rate in rates],
    )


def _short(reading: ReferenceAided) -> Json:
    """A reading without its series."""
    (plain,) = (r.to_json() for r in reading.result.readings)
    shown = {k: v for k, v in plain.items() if k not in ("corrected", "running", "states")}
    return {**shown, "statement": reading.statement}


def _bound() -> list[Json]:
    """What the noise of the published sensor allows, with dwells of 30 s: without and with 2 s lost per turn."""
    return [
        {
            "flicker": flicker,
            "dead_time": dead,
            "durations": list(BOUND_AT),
            "sd": [_least_sd(duration, dead, flicker=flicker) for duration in BOUND_AT],
        }
        for flicker in (False, True)
        for dead in (0.0, 2.0)
    ]


# -- figures ----------------------------------------------------------------------------------------------


def _figures(
    study: Study,
    runs: Mapping[int, _Run],
    warm: EarthRateEstimate,
    faulty: Mapping[int, _Run],
    aided: Mapping[int, tuple[list[ReferenceAided], list[ReferenceAided]]],
) -> dict[str, PaperFigure]:
    """The thirteen figures of the paper by file name, and two that compare."""
    from allanite_seed_paper.figures import all_figures, four_takes

    made = all_figures(
        study=study,
        takes={n: run.record for n, run in runs.items()},
        reversals={n: run.reversals for n, run in runs.items()},
        unsigned={n: both[0] for n, both in aided.items()},
        demodulated={n: both[1] for n, both in aided.items()},
    )
    figures = {f"figure-{figure.number:02}": figure for figure in made}
    least = {n: _least_sd(run.estimate.duration) for n, run in runs.items()}
    bounds = {n: sd for n, sd in least.items() if sd is not None}
    figures["four-takes"] = four_takes(
        {**{n: run.estimate for n, run in runs.items()}, 4: warm}, bounds=bounds
    )
    figures["four-takes-with-faults"] = four_takes(
        {1: runs[1].estimate, **{n: run.estimate for n, run in faulty.items()}}, bounds=bounds
    )
    return figures


def _draw(
    figures: Mapping[str, PaperFigure], folder: Path, force: bool, advance: Progress
) -> tuple[Path, ...]:
    """Every figure as PDF and PNG."""
    from allanite.views.figures import plot

    done: list[Path] = []
    for i, (name, figure) in enumerate(figures.items(), 1):
        drawn = plot(figure.sheet)
        for suffix in (".pdf", ".png"):
            file = folder / f"{name}{suffix}"
            with fresh(file, force=force) as place:
                drawn.savefig(place, dpi=150)
            done.append(file)
        advance(i / len(figures), "drawing")
    return tuple(done)
