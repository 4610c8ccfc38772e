# SPDX-License-Identifier: BSD-3-Clause
"""Records that are compared: logs, saved studies and curves, read and characterised side by side."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Lock
from typing import Any

from allanite.commands.measurement import MeasurementResult, provenance
from allanite.commands.recordings import is_lossy
from allanite.commands.study import study_of
from allanite.errors import FormatError, InputError
from allanite.plain_files.regular_file import open_regular
from allanite.recording.channel_names import for_shell

__all__ = ["comparison_of"]

Advance = Callable[[float, str], None]

#: Part of the work that reading and characterising take.
_READING = 0.7
_STUDY, _CURVE = "study.json", "# format: allanite-curve"


def comparison_of(
    places: Sequence[str | os.PathLike[str]],
    *,
    names: Sequence[str] | None = None,
    match: Sequence[str] = (),
    accept: Sequence[str] = (),
    confidence: float = 0.95,
    level: float = 0.05,
    command: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """Logs, studies (study.json, or the folder that holds one) and curves (allan.csv), compared.

    Parameters
    ----------
    places : sequence of path
    names : sequence of str, optional
        Of the records; by default those of the files.
    match : sequence of str
        Channels to compare, each by one name, or by one for each record with commas between.
    accept : sequence of str
        Codes of fatal findings of logs to go on in spite of.
    confidence, level : float
        As for `allanite.compare`.
    **options
        Those of `read_part`, for the logs.

    Raises
    ------
    InputError
        Fewer than two places, one that is not there, or what `compare` refuses.
    """
    from allanite.stability.record_comparison.estimation import compare
    from allanite.study.result_document import Provenance, ResultDocument

    if len(places) < 2:
        raise InputError(f"{len(places)} record; a comparison needs two at least")
    files, advance = [Path(p) for p in places], progress or (lambda fraction, what: None)
    reading = _Reading(len(places), advance)
    with ThreadPoolExecutor(min(len(places), os.cpu_count() or 1)) as pool:
        records = list(
            pool.map(lambda task: _record(task[1], accept, options, reading.part(task[0])), enumerate(files))
        )
    _refuse_unknown_units(files, [record for record, _ in records])
    result = compare(
        [record for record, _ in records],
        names=list(names) if names else _names(files),
        channels=[m.split(",") if "," in m else m for m in match] or None,
        confidence=confidence,
        level=level,
        progress=lambda fraction, what: advance(_READING + (1 - _READING) * fraction, what),
    )
    made = provenance(", ".join(map(str, places)), None, command)
    return MeasurementResult(
        result=result,
        document=ResultDocument(result=result, provenance=Provenance(**made)),
        name="comparison",
        tables={},
        lossy=any(lossy for _, lossy in records),
    )


class _Reading:
    """One bar for several logs that are read at a time."""

    def __init__(self, count: int, advance: Advance) -> None:
        self._parts, self._advance, self._lock = [0.0] * count, advance, Lock()

    def part(self, i: int) -> Advance:
        def step(fraction: float, what: str) -> None:
            with self._lock:
                self._parts[i] = fraction
                self._advance(_READING * sum(self._parts) / len(self._parts), what)

        return step


def _record(
    place: Path, accept: Sequence[str], options: Mapping[str, Any], advance: Advance
) -> tuple[Any, bool]:
    """A study or curve, and whether samples of it did not take part."""
    if place.is_dir() and (place / _STUDY).is_file():
        place = place / _STUDY
    if not place.exists():
        raise InputError(f"no such file: {place}")
    if _is_curve(place):
        from allanite.noise.allan import AllanCurve

        curve = AllanCurve.from_csv(place)
        return curve, any(len(runs) for runs in curve.missing)
    if place.suffix == ".json":
        from allanite.study.study import Study

        try:
            study = Study.load(place)
        except FormatError as fault:
            raise FormatError(f"{place}: {fault}") from None
    else:
        study = study_of(place, accept=accept, progress=advance, **options)
    advance(1.0, place.name)
    return study, is_lossy(f.to_json() for f in study.findings)


def _refuse_unknown_units(places: Sequence[Path], records: Sequence[Any]) -> None:
    """Refuse logs whose unit is unknown where another log of the same channel has one.

    Raises
    ------
    InputError
        With the option that states the units that the other log has.
    """
    studied = [
        (p, {c["name"]: c for c in getattr(r, "document", {}).get("channels", ())})
        for p, r in zip(places, records, strict=True)
    ]
    known = {
        name: c["unit"] for _, held in reversed(studied) for name, c in held.items() if c["kind"] != "unknown"
    }
    lacking = {
        place: names
        for place, held in studied
        if (names := [n for n, c in held.items() if c["kind"] == "unknown" and n in known])
    }
    if not lacking:
        return
    units = ",".join(
        f"{place}={known[names[0]]}"
        if len({known[n] for n in names}) == 1 and len(names) == len(studied[places.index(place)][1])
        else ",".join(f"{place}:{name}={known[name]}" for name in names)
        for place, names in lacking.items()
    )
    which = "; ".join(f"{place}: {', '.join(names)}" for place, names in lacking.items())
    raise InputError(
        f"the unit of channels is unknown ({which}), where another record has one: state it, as in --unit "
        f"{for_shell(units)}; a study saved without units must be made again from its log"
    )


def _is_curve(place: Path) -> bool:
    if place.suffix != ".csv":
        return False
    with open_regular(place) as file:
        return file.read(len(_CURVE)) == _CURVE.encode()


def _names(places: Sequence[Path]) -> list[str] | None:
    """What tells the files apart: their names, or where those are alike the folders they are in."""
    for made in (
        [p.name if p.is_dir() else p.stem for p in places],
        [p.name if p.is_dir() else p.resolve().parent.name for p in places],
    ):
        if len(set(made)) == len(made):
            return made
    return None
