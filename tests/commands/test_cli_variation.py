# SPDX-License-Identifier: BSD-3-Clause
"""The commands variation and common from end to end: what they print, files, report, pictures, loss."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.files.recording_file import write_recording
from allanite.noise import NoiseModel, White
from allanite.recording.health.examination import check
from allanite.recording.records import Recording
from allanite.stability.shared_noise import Separation, separate_noise
from allanite.stability.variation import Variation, examine_variation
from allanite.views.blocks import Pairs, TableBlock
from allanite.views.figures import sheet_of
from allanite.views.report import html_of, page_of
from pages import Balance, document_of, text_of
from shell import Run

N = 6000


@pytest.fixture(scope="module")
def gyro() -> Recording:
    """White noise that grows by a half after two thirds of ten minutes."""
    y = np.random.default_rng(1).standard_normal(N) * 1e-4
    y[4000:] *= 1.5
    return Recording.from_rate(y, rate=10.0, unit="rad/s", names=["gyro"])


@pytest.fixture(scope="module")
def pair() -> Recording:
    rng = np.random.default_rng(2)
    walk = np.cumsum(rng.standard_normal(N)) * 2e-6
    y = 1e-4 * rng.standard_normal((N, 3)) + walk[:, None]
    return Recording.from_rate(y, rate=10.0, unit="rad/s", names=["a", "b", "c"])


@pytest.fixture(scope="module")
def varied(gyro: Recording) -> Variation:
    return examine_variation(gyro, models=NoiseModel.of(White(N=1e-4)), windows=32)


@pytest.fixture(scope="module")
def separated(pair: Recording) -> Separation:
    return separate_noise(pair)


def test_variation_prints_the_change_and_leaves_files(run: Run, gyro: Recording, tmp_path: Path) -> None:
    log = write_recording(gyro, tmp_path / "gyro.parquet")
    options = ("--windows", "16", "--model", "N=0.344 deg/√h")
    done = run("variation", log, *options, "--out", tmp_path / "out", "--plot", tmp_path / "map.svg")
    assert done.code == 0, done.err
    assert done.out.startswith("The noise changes. N grew by")
    assert " 1.492 [" in done.out and "p < 0.001" in done.out
    rows = list(csv.DictReader((tmp_path / "out" / "variation.csv").open()))
    assert {"channel", "tau", "start", "stop", "deviation", "lower", "upper", "significant"} <= set(rows[0])
    document = json.loads((tmp_path / "out" / "variation.json").read_text())
    assert len(rows) == sum(len(lag["start"]) for lag in document["channels"][0]["lags"])
    assert (tmp_path / "map.svg").stat().st_size > 10_000
    assert run("variation", log, "--out", tmp_path / "out").code == 1  # files are there


@pytest.mark.long
def test_common_prints_every_part_and_gaps_are_loss(run: Run, pair: Recording, tmp_path: Path) -> None:
    y = np.column_stack([pair.values(n) for n in pair.names])
    y[100:200, 1] = np.nan
    gappy = Recording.from_rate(y, rate=10.0, unit="rad/s", names=["a", "b", "c"])
    log = write_recording(gappy, tmp_path / "gyros.parquet")
    done = run("common", log, "--channels", "a,b", "--json")
    assert done.code == 3, done.err
    document = json.loads(done.out)
    assert document["format"] == "allanite-separation" and document["missing"] == 100
    assert [part["name"] for part in document["own"]] == ["a", "b"]
    shown = run("common", log, "--out", tmp_path / "out")
    assert shown.code == 3 and shown.out.startswith("Noise is shared. The common part is resolved at")
    assert "a alone" in shown.out and "100 samples missing in at least one sensor" in shown.out
    assert (tmp_path / "out" / "separation.csv").exists()
    refused = run("common", log, "--channels", "a")
    assert refused.code == 1 and "two or three sensors" in refused.err


@pytest.mark.long
def test_reports_are_whole_pages(varied: Variation, separated: Separation) -> None:
    for result, words in (
        (varied, ("The noise changes.", "Constancy of every lag", "Andrews", "gyro: some averaging times")),
        (separated, ("Noise is shared.", "upper limit", "three-cornered hat", "a alone", "common")),
    ):
        page = html_of(result)
        balance = Balance()
        balance.feed(document_of(page))
        assert not balance.wrong and len(balance.ids) == len(set(balance.ids))
        text = text_of(page)
        assert all(word in text for word in words), [word for word in words if word not in text]


def test_map_marks_the_significant_windows_and_the_change(varied: Variation) -> None:
    channel = varied["gyro"]
    (panel,) = sheet_of(varied, view="map").panels
    assert panel.drawing is not None
    marked = sum(int(lag.significant.sum()) for lag in channel.lags)
    assert marked > 5 and len(panel.drawing.named("significant")) == marked
    assert len(panel.drawing.named("change")) == 1
    assert any(words.startswith("N × 1.") for words in panel.drawing.words)
    lines = sheet_of(varied, view="lines").panels
    assert 1 <= len(lines) <= 3 and lines[0].curves[0].lower is not None
    with pytest.raises(InputError, match="no view"):
        sheet_of(varied, view="surface")
    with pytest.raises(InputError, match="no channel 'x'"):
        sheet_of(varied, channels=["x"])


def test_pictures_of_both_are_drawn_by_both_libraries(varied: Variation, separated: Separation) -> None:
    for result in (varied, separated):
        assert al.plot(result).axes
        assert al.plot(result.to_json(), interactive=True, dark=True).sheet.panels
    parts, correlation = sheet_of(separated).panels
    assert sum("upper limit" in curve.label for curve in parts.curves) >= 1
    assert sum(curve.marker is not None for curve in correlation.curves) == 3


def test_words_of_a_level_stand_in_the_legend_and_not_on_the_data(
    varied: Variation, separated: Separation
) -> None:
    for panels, words, height in (
        (sheet_of(varied, view="lines").panels, "whole record", 1.0),
        (sheet_of(separated, view="correlation").panels, "nothing shared", 0.0),
    ):
        for panel in panels:
            (line,) = (c for c in panel.curves if c.label == words)
            assert panel.key == "above" and words in panel.entries
            assert panel.x.limits == (line.x[0], line.x[1]) and (line.y == height).all()
            assert not any(label.place == "level" for label in panel.labels)


def test_words_say_values_with_intervals_and_limits(varied: Variation, separated: Separation) -> None:
    blocks = list(page_of(varied).blocks())
    changes = next(block for block in blocks if isinstance(block, TableBlock))
    name, what, when, size, chance = (cell.text for cell in changes.rows[0][0])
    assert (name, what, chance) == ("gyro", "N", "p < 0.001")
    assert when.startswith("6.") and "min [" in when and size.startswith("1.")
    facts = next(block for block in blocks if isinstance(block, Pairs))
    assert "5 % of channels" in dict(facts.rows)["False alarms"]
    blocks = list(page_of(separated).blocks())
    parts, terms = (block for block in blocks if isinstance(block, TableBlock))
    assert list(parts.heads[1:]) == [
        "a alone [deg/h]",
        "b alone [deg/h]",
        "c alone [deg/h]",
        "common [deg/h]",
    ]
    rows = [[cell.text for cell in cells] for cells, _ in parts.rows]
    assert "[" in rows[0][1] and any(row[4].startswith("< ") for row in rows)
    first, *_, last = ([cell.text for cell in cells] for cells, _ in terms.rows)
    assert last[0] == "common" and first[3].startswith("< ")
    facts = next(block for block in blocks if isinstance(block, Pairs))
    assert "All pairs share the same" in dict(facts.rows)


def test_findings_warn_of_noise_that_changes_and_not_of_noise_that_does_not(gyro: Recording) -> None:
    (found,) = [f for f in check(gyro) if f.code == "noise_changes"]
    assert found.severity.value == "warning" and "larger than that of the quietest" in found.message
    rng = np.random.default_rng(4)
    for _ in range(20):
        y = rng.standard_normal(N) + 0.02 * np.cumsum(rng.standard_normal(N))
        still = Recording.from_rate(y, rate=10.0, unit="deg/s", names=["gyro"])
        assert not [f for f in check(still) if f.code == "noise_changes"]
