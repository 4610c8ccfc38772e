# SPDX-License-Identifier: BSD-3-Clause
"""Cells that begin with a number and go on: the number is read, what follows is the unit or is reported."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from allanite.errors import AllaniteError, FormatError
from allanite.files.readers import read
from allanite.recording.health.examination import check
from allanite.recording.health.finding import Severity

UNITS = {
    "deg/s": "rate",
    "V": "voltage",
    "mV": "voltage",
    "m/s2": "acceleration",
    "°/h": "rate",
    "mg": "acceleration",
}
MARKS = ("*", "!", "%%", "x", "ok", "dB")


def table(path: Path, cells: list[str], head: str = "time [s],y", more: str = "") -> Path:
    rows = [f"{k / 10:.1f},{cell}{more}" for k, cell in enumerate(cells)]
    path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.mark.long
def test_every_number_is_read(tmp_path: Path) -> None:
    for seed in range(100):  # a fault of 2.3 % of them is found with 90 %
        rng = np.random.default_rng(seed)
        suffix = str(rng.choice([*UNITS, *MARKS]))
        share = float(rng.choice([1.0, 1.0, 0.7, 0.02]))
        gap, comma = str(rng.choice(["", " "])), bool(rng.random() < 0.3)
        values = np.round(rng.normal(scale=10.0 ** rng.integers(-2, 4), size=60), int(rng.integers(1, 5)))
        marked = rng.random(60) < share
        cells = [f"{v:.5f}" + (gap + suffix if m else "") for v, m in zip(values, marked, strict=True)]
        rows = [f"{k / 10:.1f};{cell}" for k, cell in enumerate(cells)]
        text = "\n".join(["time [s];y", *rows]) + "\n"
        path = tmp_path / "log.csv"
        path.write_text(text.replace(".", ",") if comma else text, encoding="utf-8")
        got = read(path)
        np.testing.assert_array_equal(got.values("y"), values, err_msg=str(seed))
        assert got.rate == pytest.approx(10.0)
        if marked.any():
            assert got.channels[0].kind.value == UNITS.get(suffix, "unknown"), seed
            [found] = [f for f in check(got) if f.code == "cell_suffix"]
            assert "y: " in found.message
            assert repr(suffix) in found.message
            assert found.count == marked.sum()
            assert (found.severity is Severity.WARNING) == (suffix in MARKS)


@pytest.mark.parametrize(
    ("other", "says"),
    [("mV", "'V' .* and 'mV' .*one unit"), ("*", "one unit"), ("k", "one unit")],
)
def test_two_units_in_a_column_are_refused(other: str, says: str, tmp_path: Path) -> None:
    cells = [f"{k}.5V" for k in range(40)]
    cells[33] = f"7.5{other}"
    with pytest.raises(FormatError, match=says):
        read(table(tmp_path / "log.csv", cells))


def test_letters_that_multiply_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="'k'"):
        read(table(tmp_path / "log.csv", [f"{k % 7}.5k" for k in range(40)]))


def test_a_heading_of_another_unit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"the heading says 'V', but 'mV' \(first in line 2\)"):
        read(table(tmp_path / "log.csv", [f"{k % 7}.5mV" for k in range(40)], head="time [s],y [V]"))


def test_words_that_begin_with_digits_are_no_numbers(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    words = ["".join(rng.choice(list("0123456789ABCDEF"), size=8)) for _ in range(60)]
    got = read(table(tmp_path / "log.csv", words, head="time [s],id,wx [deg/s]", more=",0.5"))
    assert got.names == ("wx",)


def test_a_column_without_a_heading(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text("".join(f"{k % 5}.25V\n" for k in range(30)), encoding="utf-8")
    got = read(path, rate=10.0)
    assert got.channels[0].unit == "V"
    np.testing.assert_array_equal(got.values("ch0"), np.arange(30) % 5 + 0.25)


def test_a_word_in_a_column_of_numbers_is_still_refused(tmp_path: Path) -> None:
    cells = [f"{k % 7}.5" for k in range(40)]
    cells[20] = "1.2.3"
    with pytest.raises(AllaniteError, match=r"line 22, column 2 \(y\): '1.2.3' is not a number"):
        read(table(tmp_path / "log.csv", cells))


@pytest.mark.parametrize(("head", "cell"), [("T", "{}°C"), ("T [°C]", "{}"), ("T (K)", "{}")])
def test_a_t_in_degrees_is_a_temperature(head: str, cell: str, tmp_path: Path) -> None:
    cells = [cell.format(20 + k % 7 / 10) for k in range(40)]
    got = read(table(tmp_path / "log.csv", cells, head=f"time [s],{head}"))
    assert [c.kind.value for c in got.channels] == ["temperature"]


def beside(path: Path, rows: list[list[str]], gap: str = ",", head: str = "") -> Path:
    path.write_text(
        "\n".join([*filter(None, [head]), *(gap.join(row) for row in rows)]) + "\n", encoding="utf-8"
    )
    return path


@pytest.mark.long
def test_a_unit_in_a_column_of_its_own(tmp_path: Path) -> None:
    """Random units, delimiters, decimal commas, empty cells, headings: it is the unit of the number before it."""
    for seed in range(60):
        rng = np.random.default_rng([21, seed])
        units = [str(u) for u in rng.choice([u for u in UNITS if u != "°/h"], size=int(rng.integers(1, 4)))]
        gap = str(rng.choice([",", ";", "\t", " | ", " "]))
        comma, stamped = gap != "," and rng.random() < 0.4, rng.random() < 0.5
        edges = ("[", "]") if rng.random() < 0.2 else ("", "")
        values = np.round(rng.normal(size=(60, len(units))), 3)
        rows = []
        for k, row in enumerate(values):
            cells = [f"{k / 10:.1f}", "s"] if stamped else []
            for value, unit in zip(row, units, strict=True):
                cells += [f"{value:.3f}", unit.join(edges) if gap == " " or k % 9 else ""]
            rows.append([c.replace(".", ",") if comma and c[:1] in "-0123456789" else c for c in cells])
        names = [f"n{i},unit" for i in range(len(units))]
        head = gap.join(
            [*(["t", "unit"] if stamped else []), *(part for n in names for part in n.split(","))]
        )
        headed = rng.random() < 0.5
        if len(rows[0]) == 2 and gap == " ":
            continue  # one cell with a unit behind its number
        path = beside(tmp_path / "log.txt", rows, gap, head if headed else "")
        got = read(path) if stamped else read(path, rate=10.0)
        assert got.rate == pytest.approx(10.0), seed
        assert [c.kind.value for c in got.channels] == [UNITS[u] for u in units], seed
        np.testing.assert_array_equal(
            np.column_stack([got.values(n) for n in got.names]), values, err_msg=str(seed)
        )
        assert not any("text columns left out" in guess for guess in got.notes["text"]["guesses"]), seed
        found = [f for f in check(got) if f.code == "cell_suffix"]
        assert len(found) == len(units) + stamped, (seed, rows[0], [f.message for f in found])
        assert all(f.severity is Severity.INFO for f in found)


@pytest.mark.parametrize("row", [5, 39, 3990])
def test_a_unit_that_changes_along_its_column_is_refused(row: int, tmp_path: Path) -> None:
    rows = [[f"{k % 7}.5", "V", "24.1", "degC"] for k in range(4000)]
    rows[row][1] = "mV"
    with pytest.raises(FormatError, match=rf"'mV' \(first in line {row + 1}\).*one unit"):
        read(beside(tmp_path / "log.txt", rows), rate=10.0)


def test_words_beside_numbers_and_ranges_of_a_meter(tmp_path: Path) -> None:
    rows = [[f"{k % 7}.5", "V"] for k in range(40)]
    assert read(beside(tmp_path / "log.txt", rows, head="y,status"), rate=10.0).channels[0].unit == ""
    rows = [[f"{k % 7}.5", "V" if k % 3 else "mV"] for k in range(40)]
    with pytest.raises(FormatError, match=r"'mV'.*'V'.*one unit"):
        read(beside(tmp_path / "log.txt", rows), rate=10.0)


@pytest.mark.parametrize(("point", "comma"), [(".", ","), (",", ".")])
@pytest.mark.parametrize("delimiter", [";", "\t", "|", '"'])
def test_a_sign_between_thousands_is_never_guessed(
    point: str, comma: str, delimiter: str, tmp_path: Path
) -> None:
    """Neither as a decimal sign, nor as the end of a cell: the number that is right is in the error."""
    path = tmp_path / "log.csv"
    numbers = np.random.default_rng(3).uniform(1100, 9_900_000, 50)
    between = "\t" if delimiter == '"' else delimiter
    cells = [f"{x:,.2f}".replace(",", "_").replace(".", comma).replace("_", point) for x in numbers]
    quote = '"' if delimiter == '"' else ""
    rows = [f"{k}{between}{quote}{cell}{quote}" for k, cell in enumerate(cells)]
    path.write_text("\n".join([f"time [s]{between}rate [deg/h]", *rows]) + "\n", encoding="utf-8")
    with pytest.raises(FormatError, match="thousands separator"):
        read(path)
    path.write_text(path.read_text().replace(point, ""), encoding="utf-8")
    assert read(path).values("rate") == pytest.approx(numbers.round(2))
