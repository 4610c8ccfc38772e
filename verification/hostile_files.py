# SPDX-License-Identifier: BSD-3-Clause
"""Row F4 of the test battery: thousands of damaged and hostile files of each format, and what becomes of each.

Sound files are changed by `tests.fuzz.mutations`: bytes, numbers that say a length, pieces, words, checksums. Shapes
are those of `tests.hostile_shapes`: small files that are wide, deep, or claim much. Each is opened with the limits of a
reader's child; what ends that child by a signal is a `FormatError` for the caller. The parent lives, or this run does
not end.
"""

from __future__ import annotations

import tempfile
import zlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from tests.fuzz.__main__ import FAILURES, attempted, lot, saved
from tests.fuzz.seeds import FORMATS
from tests.hostile_files import Attempt, Outcome, fault_of, measured
from tests.hostile_shapes import HostileShape, hostile_shapes

Json = dict[str, Any]

_BATCH = 1000  # files on the disk at once
_WIDE = 20_000  # columns, groups, topics of a file that has too many
_DIED = "the parser died by signal"


def run_mutations(
    records: int = 2000, seed: int = 20261122, say: Callable[[str], None] = print
) -> list[Json]:
    """Mutated files of every format, and how many were read, refused, or ended the process that parsed them.

    Parameters
    ----------
    records : int
        Files of each format.

    Returns
    -------
    list of dict
        One per format: format, files, read, refused, by_signal (of the refused: their parser died in its child),
        other_errors, seconds (the most of processor time), mib (the most of resident memory), passes.
    """
    rows: list[Json] = []
    for name in FORMATS:
        rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
        found: list[Outcome] = []
        while len(found) < records:
            seeds = lot(name, rng, min(_BATCH, records - len(found)))
            with tempfile.TemporaryDirectory(prefix="allanite-") as place:
                outcomes = attempted(seeds, Path(place))
            for one, outcome in zip(seeds, outcomes, strict=True):
                if why := fault_of(outcome):
                    say(f"{name}: {why}: {saved(one, outcome, name, why, FAILURES)}")
            found += outcomes
        rows.append(_row(name, found))
        say(str(rows[-1]))
    return rows


def run_shapes(say: Callable[[str], None] = print, wide: int = _WIDE) -> list[Json]:
    """Files made by hand, by format; the columns are those of `run_mutations`."""
    by_format: dict[str, list[HostileShape]] = {}
    for shape in hostile_shapes(wide):
        by_format.setdefault(shape.name.partition(",")[0], []).append(shape)
    rows = []
    for name, shapes in by_format.items():
        with tempfile.TemporaryDirectory(prefix="allanite-") as place:
            rows.append(_row(name, measured(list(_written(shapes, Path(place))))))
        say(str(rows[-1]))
    return rows


def _written(shapes: Iterable[HostileShape], folder: Path) -> Iterable[Attempt]:
    for i, shape in enumerate(shapes):
        place = folder / str(i) / shape.file
        place.parent.mkdir()
        shape.write(place)
        yield Attempt(path=place, role=shape.role, options=shape.options)


def _row(name: str, found: list[Outcome]) -> Json:
    faults = [fault for one in found if (fault := fault_of(one))]
    return {
        "format": name,
        "files": len(found),
        "read": sum(one.code == 10 for one in found),
        "refused": sum(one.code == 11 for one in found),
        "by_signal": sum(_DIED in one.message for one in found),
        "other_errors": sum(one.code not in (10, 11) for one in found),
        "seconds": round(max(one.seconds for one in found), 2),
        "mib": max(one.memory for one in found) >> 20,
        "passes": not faults,
    }
