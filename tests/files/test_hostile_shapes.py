# SPDX-License-Identifier: BSD-3-Clause
"""Hostile inputs made by hand, and those that once failed: an error that says so, soon, in little memory."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import numpy as np
import pytest
from tests.fuzz.__main__ import attempted, lot, stored
from tests.fuzz.seeds import FORMATS
from tests.hostile_files import MOST_MEMORY, MOST_SECONDS, Attempt, Outcome, fault_of, measured
from tests.hostile_shapes import HostileShape, hostile_shapes

REGRESSIONS = Path(__file__).parents[1] / "fuzz" / "regressions"


def outcomes_of(shapes: list[HostileShape], folder: Path) -> list[Outcome]:
    attempts = []
    for i, shape in enumerate(shapes):
        place = folder / str(i)
        place.mkdir()
        shape.write(place / shape.file)
        attempts.append(Attempt(path=place / shape.file, role=shape.role, options=shape.options))
    return measured(attempts)


#: How a limit is named: what there is, how many are read, and what to do.
LIMIT = re.compile(r"LimitError: \S+ has \d+ [\w ,()]+; at most \d+ are read\. [A-Z].{10,}")
TOO_MANY = re.compile("too many (columns|variables|groups|connections|topics|sheets|row groups)$")


def test_hand_made_inputs(tmp_path: Path) -> None:
    shapes = [shape for shape in hostile_shapes() if not shape.long]
    assert len(shapes) >= 92
    wrong, limits = {}, 0
    for shape, found in zip(shapes, outcomes_of(shapes, tmp_path), strict=True):
        fault = fault_of(found)
        if not fault and shape.says and not (found.code == 11 and re.search(shape.says, found.message)):
            fault = f"says {found.message!r}, not {shape.says!r}"
        if not fault and TOO_MANY.search(shape.name):
            limits += 1
            fault = "" if LIMIT.fullmatch(found.message) else f"names no limit: {found.message}"
        if fault:
            wrong[shape.name] = fault
    assert wrong == {}
    assert limits >= 10


def test_what_once_failed(tmp_path: Path) -> None:
    places = sorted(p for p in REGRESSIONS.iterdir() if p.is_dir())
    assert places
    found = attempted([stored(place) for place in places], tmp_path)
    assert {p.name: fault for p, one in zip(places, found, strict=True) if (fault := fault_of(one))} == {}


def test_wide_files_within_the_limits_are_read(tmp_path: Path) -> None:
    """A few hundred columns, groups, channels, variables, sheets and topics are no attack."""
    widths = ("columns", "variables", "objects", "channels", "arrays")
    never = ("npy, thirty thousand columns", "HDF5, many groups", "text, too many columns in one line only")
    shapes = [s for s in hostile_shapes(240) if s.says in widths and s.name not in never]
    assert len(shapes) >= 12
    for shape, found in zip(shapes, outcomes_of(shapes, tmp_path), strict=True):
        assert (found.code, found.message) == (10, ""), shape.name


# -- the fuzz itself ---------------------------------------------------------------------------------------


@pytest.mark.long
def test_every_format_is_mutated_and_the_seed_decides_how() -> None:
    for name in FORMATS:
        one, same, other = (lot(name, np.random.default_rng(seed), 6) for seed in (5, 5, 6))
        assert one == same, name
        assert one != other, name


def test_a_fault_is_seen() -> None:
    """What counts as a failure: an error that is none of ours, a signal, time, memory."""
    sound = {"code": 11, "message": "", "seconds": 1.0, "memory": 1 << 20}
    assert fault_of(Outcome(**sound)) == ""  # type: ignore[arg-type]
    for worse in ({"code": 12}, {"code": -11}, {"seconds": MOST_SECONDS + 1.0}, {"memory": MOST_MEMORY + 1}):
        assert fault_of(Outcome(**{**sound, **worse})), worse  # type: ignore[arg-type]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "a.json"
        place.write_text("{}")
        (found,) = measured([Attempt(path=place, role="none")])
        assert "KeyError" in fault_of(found)
