# SPDX-License-Identifier: BSD-3-Clause
"""Columns that number the samples: gaps by jumps, numbers that begin anew, columns that only have such a name."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from allanite.errors import InputError
from allanite.files.readers import read
from allanite.recording.records import Recording


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
    assert "the name of a sample number but does not number the rows" in said(found)


def test_a_jump_beyond_the_record_is_not_filled_and_it_is_said(tmp_path: Path) -> None:
    found = read(log(tmp_path, [*range(500), *range(100_500, 101_000)]), rate=10)
    assert (found.n_samples, found.names) == (1000, ("wx",))
    assert "jump beyond the length of the record: they do not show the gaps" in said(found)


def test_numbers_tell_what_stamps_of_receipt_hide(tmp_path: Path) -> None:
    """Even stamps, given by the computer, and five numbers that nobody received."""
    hidden = read(log(tmp_path, [*range(100), *range(105, 400)], "seq", "{0}e-2,"))
    assert (hidden.n_samples, hidden.rate) == (395, pytest.approx(100.0))
    assert "by its numbers, column seq, 5 samples are missing, by the time stamps 0" in said(hidden)
    assert "missing" not in said(read(log(tmp_path, range(395), "seq", "{0}e-2,")))


def test_time_in_samples_is_no_time(tmp_path: Path) -> None:
    place = log(tmp_path, range(200), "time [samples]")
    with pytest.raises(InputError, match=r"row numbers is not used as time.*--rate RATE"):
        read(place)
    assert read(place, rate=50).names == ("wx",)
    with pytest.raises(InputError, match=r"the unit .fortnights., which is unknown.*--time 1:s \(1 Hz\)"):
        read(log(tmp_path, range(200), "time [fortnights]"))


@pytest.mark.parametrize("name", ["Scan", "loopIteration", "field.header.seq", "Nummer", ""])
@pytest.mark.parametrize("stride", [1, 2, 7])
def test_whole_numbers_that_go_on_by_one_step_are_no_channel(name: str, stride: int, tmp_path: Path) -> None:
    """Whatever the column is called, wherever it stands, and where rows are lost."""
    rng = np.random.default_rng([47, stride, len(name)])
    kept = np.flatnonzero(rng.random(400) > 0.005)
    rows = [(f"{k / 50:.2f}", f"{17 + stride * k}", f"{rng.normal():.5f}") for k in kept.tolist()]
    order = rng.permutation([1, 2])
    lines = [",".join((row[0], *(row[i] for i in order))) for row in rows]
    heads = ["t [s]", name, "wx [deg/s]" if name else ""]
    head = ",".join(heads[i] for i in (0, *order)) + "\n" if name else ""
    path = tmp_path / "a.csv"
    path.write_text(head + "\n".join(lines) + "\n")
    recording = read(path, **({} if name else {"time": "1:s"}))
    assert len(recording.names) == 1 and recording.rate == pytest.approx(50.0)
    said = " ".join(recording.notes["text"]["guesses"])
    assert "counts rows: it is no channel" in said


def test_a_signal_that_grows_is_left_to_be_judged(tmp_path: Path) -> None:
    """An angle that turns with the Earth, counts that wander, and rows of which nothing else would be left."""
    rng = np.random.default_rng(48)
    t = np.arange(400) / 50
    angle = np.cumsum(1000 + np.round(3 * rng.standard_normal(400))).astype(int)
    path = tmp_path / "a.csv"
    np.savetxt(path, np.column_stack([t, angle]), "%.2f,%d", header="t [s],angle", comments="")
    assert read(path).names == ("angle",)
    np.savetxt(path, np.column_stack([t, np.arange(400)]), "%.2f,%d", header="t [s],value", comments="")
    assert read(path).names == ("value",)


@pytest.mark.parametrize(("factor", "form"), [(1.0, "%.4f"), (1e3, "%.1f"), (1e6, "%d"), (1e9, "%d")])
def test_the_same_time_once_more_is_no_channel(factor: float, form: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(49)
    t = np.arange(300) / 100 + rng.uniform(0, 2e-3, 300)
    again = (t + rng.uniform(0, 1e-3, 300) + 12.5) * factor
    rows = np.column_stack([t, rng.standard_normal(300), again])
    path = tmp_path / "a.csv"
    np.savetxt(path, rows, f"%.5f,%.4f,{form}", header="t [s],wx [deg/s],host", comments="")
    recording = read(path)
    assert recording.names == ("wx",)
    assert "left out: host (the same time again)" in recording.notes["text"]["guesses"]


@pytest.mark.long
def test_one_unit_for_a_file_is_not_that_of_a_sensor_of_another_kind(tmp_path: Path) -> None:
    """Gravity read in deg/s would be a rate of 9.8 deg/s, with a density to go with it."""
    from scipy.io import savemat

    rng = np.random.default_rng(50)
    gyro, acc = rng.standard_normal((300, 3)), rng.standard_normal((300, 3))
    for unit, kinds in (
        ("deg/s", {"rate": "gyro", "unknown": "acc"}),
        ("g", {"acceleration": "acc", "unknown": "gyro"}),
    ):
        savemat(tmp_path / "a.mat", {"gyro": gyro, "acc": acc, "fs": 50.0, "units": unit})
        head = f"# units: {unit}\nt [s],gyro_x,acc_x\n"
        rows = "".join(
            f"{k / 50:.2f},{g:.4f},{a:.4f}\n"
            for k, (g, a) in enumerate(zip(gyro[:, 0], acc[:, 0], strict=True))
        )
        (tmp_path / "a.csv").write_text(head + rows)
        for place in ("a.mat", "a.csv"):
            recording = read(tmp_path / place)
            assert {c.kind.value: c.name[: len(kinds[c.kind.value])] for c in recording.channels} == kinds
            part = recording.notes["source" if place == "a.mat" else "text"]
            assert any(
                f"the unit {unit} of the file contradicts the names of" in words for words in part["guesses"]
            )


@pytest.mark.parametrize(
    "line", ["OutputRate:,60Hz", '"Output Rate:";"60"', "Sample Rate = , 60 Hz", "ODR:\t60"]
)
def test_a_rate_stands_behind_several_signs(line: str) -> None:
    from allanite.files.readers.delimited.preamble import rate_in

    assert rate_in([line]).rate == 60.0


def test_channels_that_stand_still_are_left_out_by_the_advice(tmp_path: Path) -> None:
    from allanite.recording.health.examination import check

    rng = np.random.default_rng(51)
    rows = np.column_stack(
        [np.arange(300) / 50, np.zeros(300), rng.standard_normal((300, 2)), np.full(300, 7)]
    )
    path = tmp_path / "a.csv"
    np.savetxt(path, rows, "%.4f", delimiter=",", header="t [s],a,b c [deg/s],d [deg/s],e", comments="")
    found = [f for f in check(read(path)) if f.code == "no_noise_resolved"]
    assert [f.channel for f in found] == ["a", "e"]
    assert {f.advice.rpartition(": ")[2] for f in found} == {"--channels b_c,d"}
