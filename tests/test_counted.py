# SPDX-License-Identifier: BSD-3-Clause
"""Nouns and verbs agree with the counts beside them."""

from __future__ import annotations

from pathlib import Path

import pytest

from allanite.errors import DataQualityError
from allanite.noise.allan import allan_curve
from allanite.plain_files.counted import plural
from allanite.recording.records import Recording
from shell import Run


@pytest.mark.parametrize(
    ("count", "noun", "verb", "said"),
    [
        (1, "position", "determine", "1 position determines"),
        (2, "position", "determine", "2 positions determine"),
        (0, "batch", "", "0 batches"),
        (1, "channel", "have no model", "1 channel has no model"),
        (1, "row", "are left out", "1 row is left out"),
        (3, "row", "were left out", "3 rows were left out"),
        (1, "window", "teach", "1 window teaches"),
        (1, "lag", "can be used", "1 lag can be used"),
    ],
)
def test_noun_and_verb_agree_with_their_count(count: int, noun: str, verb: str, said: str) -> None:
    assert plural(count, noun, verb) == said


def test_short_records_and_few_positions_are_counted_in_english(run: Run, tmp_path: Path) -> None:
    """One of each, through the commands that refuse it or say how little it tells."""
    log = tmp_path / "log.csv"
    log.write_text("acc_x [g],acc_y [g],acc_z [g]\n0.01,0.02,0.999\n", encoding="utf-8")
    model = ["--model", "N=0.1 mg/√Hz", "--averaging", "60s"]
    done = run("calibrate", str(log), "--means", *model)
    assert "1 position determines" in done.out or "1 position" in done.err, (done.out, done.err)
    with pytest.raises(DataQualityError, match=r"has 1 sample;"):
        allan_curve(Recording.from_rate([1.0], rate=1.0, unit="deg/s"))
