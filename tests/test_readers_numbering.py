# SPDX-License-Identifier: BSD-3-Clause
"""Columns that number the samples: gaps by jumps, numbers that begin anew, columns that only have such a name."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from allanite.errors import InputError
from allanite.readers import read
from allanite.recording import Recording


def log(folder: Path, numbers: Iterable[int], head: str = "counter", more: str = "") -> Path:
    """A log whose value is the place of the sample on the grid, and whose number is given."""
    place = folder / "log.csv"
    rows = (f"{number},{more.format(k)}{k}.5\n" for k, number in enumerate(numbers))
    place.write_text(f"{head}{',t' if more else ''},wx [deg/s]\n" + "".join(rows))
    return place


def said(recording: Recording) -> str:
    return "; ".join(recording.notes["text"]["guesses"])


@pytest.mark.parametrize(("turn", "stride"), [(256, 1), (1000, 1), (65_536, 1), (256, 4)])
def test_numbers_that_begin_anew_or_go_on_by_more_place_the_gap(
    tmp_path: Path, turn: int, stride: int
) -> None:
    there = np.delete(np.arange(2 * turn // stride + 30), slice(100, 105))
    found = read(log(tmp_path, there * stride % turn), rate=10)
    assert found.names == ("wx",)
    assert (found.n_samples, found.rate) == (there[-1] + 1, 10.0)
    assert found.notes["timebase"]["gap_places"] == [[100, 105]]
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(found.values("wx"))), np.arange(100, 105))
    assert f"wraps at {turn}, 2 times" in said(found)
    assert ("goes on by 4 from row to row" in said(found)) == (stride == 4)


def test_many_samples_may_be_missing(tmp_path: Path, rng: np.random.Generator) -> None:
    there = np.flatnonzero(rng.random(4000) > 0.3)
    found = read(log(tmp_path, there), rate=10)
    assert (found.names, found.n_samples) == (("wx",), there[-1] - there[0] + 1)
    np.testing.assert_array_equal(np.flatnonzero(np.isfinite(found.values("wx"))), there - there[0])


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("begun anew by itself", [*range(300), *range(200)]),
        ("out of order", [*range(50), 49, 48, *range(52, 400)]),
        ("mostly the same", [k // 20 for k in range(400)]),
        ("by differing amounts", [k * k for k in range(400)]),
    ],
)
def test_what_does_not_number_the_rows_is_a_channel_and_it_is_said(
    tmp_path: Path, name: str, numbers: list[int]
) -> None:
    found = read(log(tmp_path, numbers), rate=10)
    assert found.names == ("counter", "wx"), name
    assert found.n_samples == len(numbers)
    assert "named like a sample number and does not number the rows" in said(found)


def test_a_jump_beyond_the_record_is_not_filled_and_it_is_said(tmp_path: Path) -> None:
    found = read(log(tmp_path, [*range(500), *range(100_500, 101_000)]), rate=10)
    assert (found.n_samples, found.names) == (1000, ("wx",))
    assert "jump beyond the length of the record: gaps cannot be told" in said(found)


def test_numbers_tell_what_stamps_of_receipt_hide(tmp_path: Path) -> None:
    """Even stamps, given by the computer, and five numbers that nobody received."""
    hidden = read(log(tmp_path, [*range(100), *range(105, 400)], "seq", "{0}e-2,"))
    assert (hidden.n_samples, hidden.rate) == (395, pytest.approx(100.0))
    assert "by its numbers, column seq, 5 samples are missing, by the time stamps 0" in said(hidden)
    assert "missing" not in said(read(log(tmp_path, range(395), "seq", "{0}e-2,")))


def test_time_in_samples_is_no_time(tmp_path: Path) -> None:
    place = log(tmp_path, range(200), "time [samples]")
    with pytest.raises(InputError, match=r"row numbers is not taken for time.*--rate RATE"):
        read(place)
    assert read(place, rate=50).names == ("wx",)
    with pytest.raises(InputError, match=r"the unit .fortnights., which is not known.*--time 1:s \(1 Hz\)"):
        read(log(tmp_path, range(200), "time [fortnights]"))
