# SPDX-License-Identifier: BSD-3-Clause
"""The command select from end to end: what it prints, files, report, pictures, loss."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.files.recording_file import write_recording
from allanite.fitting.selection import Selection, select
from allanite.recording.records import Recording
from allanite.views.blocks import TableBlock
from allanite.views.figures import sheet_of
from allanite.views.report import html_of, page_of
from allanite.views.wording.selection import weight_words
from pages import Balance, document_of, text_of
from shell import Run

N = 3000


def samples(seed: int, walk: float) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return 1e-4 * (rng.standard_normal(N) + walk * np.cumsum(rng.standard_normal(N)))


@pytest.fixture(scope="module")
def found() -> Selection:
    y = samples(1, 0.1) + 1e-4 * np.sin(2 * np.pi * 0.21 * np.arange(N))
    return select(Recording.from_rate(y, rate=10.0, unit="rad/s", names=["gyro"]), lines=[2.1, 4.0])


def test_select_prints_sets_and_leaves_files(run: Run, tmp_path: Path) -> None:
    y = np.column_stack([samples(2, 0.0), samples(5, 0.1)])
    y[50:60, 0] = np.nan
    log = write_recording(
        Recording.from_rate(y, rate=10.0, unit="rad/s", names=["x", "y"]), tmp_path / "gyros.parquet"
    )
    done = run("select", log, "--lines", "none", "--out", tmp_path / "out", "--plot", tmp_path / "sets.svg")
    assert done.code == 3, done.err  # missing samples
    assert done.out.startswith("The terms are clear. x: white noise; y: white noise and random walk")
    assert "█" in done.out and "deg/√h" in done.out
    rows = list(csv.DictReader((tmp_path / "out" / "selection.csv").open()))
    assert {"channel", "terms", "weight", "score", "N", "K"} <= set(rows[0])
    document = json.loads((tmp_path / "out" / "selection.json").read_text())
    assert [c["name"] for c in document["channels"]] == ["x", "y"]
    assert len(rows) == sum(len(c["candidates"]) for c in document["channels"])
    assert (tmp_path / "sets.svg").stat().st_size > 10_000
    assert run("select", log, "--out", tmp_path / "out").code == 1  # files are there
    refused = run("select", log, "--lines", "often")
    assert refused.code == 2 and "auto, none, or frequencies" in refused.err


@pytest.mark.parametrize("columns", [60, 80, 130])
def test_a_narrow_terminal_cuts_nothing_off(columns: int) -> None:
    from rich.console import Console

    from allanite.views.terminal.console import table_of

    rows = [
        (
            "white noise, Gauss-Markov and random walk",
            "67 %",
            "N 0.732 deg/√h, sigma 11.1 deg/h, T_b 232 s",
            "p = 0.61",
        ),
        ("white noise", "< 1 %", "N 0.732 deg/√h", "p = 0.0004"),
    ]
    table = table_of(("gyro", "weight", "parameters", "goodness"))
    for row in rows:
        table.add_row(*row)
    out = Console(width=columns, record=True, force_terminal=False, file=io.StringIO())
    out.print(table)
    lines = out.export_text().splitlines()
    assert max(map(len, lines)) <= columns
    for word in " ".join(cell for row in rows for cell in row).split():
        assert word in " ".join(lines)
    assert all("67 %" not in line or "p = 0.61" in line for line in lines)  # numbers stay whole, in one line
    assert "…" not in "".join(lines)


@pytest.mark.long
def test_select_prints_its_document(run: Run, tmp_path: Path) -> None:
    log = write_recording(
        Recording.from_rate(samples(4, 0.0), rate=10.0, unit="rad/s", names=["x"]), tmp_path / "x.parquet"
    )
    done = run("select", log, "--lines", "1.5", "--json")
    assert done.code == 0, done.err
    document = json.loads(done.out)
    assert document["format"] == "allanite-selection" and document["version"] == 2
    (channel,) = document["channels"]
    assert channel["lines"][0]["kept"] is False and channel["candidates"][0]["letters"] == ["N"]


def test_report_is_a_whole_page(found: Selection) -> None:
    page = html_of(found)
    balance = Balance()
    balance.feed(document_of(page))
    assert not balance.wrong and len(balance.ids) == len(set(balance.ids))
    text = text_of(page)
    wanted = (
        "The terms are clear.",
        "white noise and random walk",
        "Gain and price",
        "Buckland",
    )
    assert all(word in text for word in wanted), [w for w in wanted if w not in text]


def test_bars_are_as_long_as_the_weights(found: Selection) -> None:
    (panel,) = sheet_of(found, view="weights").panels
    assert panel.drawing is not None
    bars = panel.drawing.named("weight")
    length = [max(x for x, _ in bar.points) - min(x for x, _ in bar.points) for bar in bars]
    weights = [c.weight for c in found.candidates]
    assert length[1] / length[0] == pytest.approx(weights[1] / weights[0], rel=1e-6)
    (curves,) = sheet_of(found, view="curves").panels
    assert curves.curves[0].label == "measured" and curves.curves[0].lower is not None
    # the model passes through the band at the shortest averaging time
    model = curves.curves[1]
    assert curves.curves[0].lower[0] < model.y[0] < curves.curves[0].upper[0]  # type: ignore[index]
    with pytest.raises(InputError, match="no view"):
        sheet_of(found, view="surface")
    with pytest.raises(InputError, match="no channel 'x'"):
        sheet_of(found, channels=["x"])


def test_pictures_are_drawn_by_both_libraries(found: Selection) -> None:
    assert al.plot(found).axes
    assert al.plot(found.to_json(), interactive=True, dark=True).sheet.panels


def test_words_say_values_with_intervals(found: Selection) -> None:
    blocks = [block for block in page_of(found).blocks() if isinstance(block, TableBlock)]
    sets, terms, lines = ([[cell.text for cell in cells] for cells, _ in block.rows] for block in blocks)
    words, _, score, parameters, _ = sets[0]
    assert words == "white noise and random walk" and score == "best"
    assert parameters.startswith("N ") and "K " in parameters
    shares = [cells[1].share for cells, _ in blocks[0].rows]
    assert shares == [c.weight for c in found.candidates[:8]] and shares[0] is not None and shares[0] > 0.5
    by_term = {name: (share, words) for name, share, words in terms}
    assert by_term["N"][0] == "> 99 %" and "[" in by_term["K"][1] and by_term["B"][1] == "–"
    kept, left_out = lines
    assert (
        kept[0] in ("2.10000 Hz", "2.09999 Hz", "2.10001 Hz")
        and kept[3] == "a term"
        and left_out[3] == "not supported"
    )
    assert weight_words(0.004) == "< 1 %"
