# SPDX-License-Identifier: BSD-3-Clause
"""What commands say of logs with gaps, a dead channel or too few samples: all of it, and in words of the program."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import allanite as al
from allanite.commands import recordings
from allanite.commands.recordings import describe
from shell import Run

RATE = 100.0


def written(path: Path, samples: NDArray[np.float64]) -> Path:
    names = ["gx", "gy", "gz"][: samples.shape[1]]
    heading = ",".join(["time [s]", *(f"{n} [deg/s]" for n in names)])
    table = np.column_stack([np.arange(len(samples)) / RATE, samples])
    np.savetxt(path, table, delimiter=",", header=heading, comments="", fmt="%.8f")
    return path


@pytest.fixture
def dead(tmp_path: Path, rng: np.random.Generator) -> Path:
    """Three gyros: one with a gap of its own, one dead, and 30 ms that all of them lack."""
    y = 0.01 * rng.standard_normal((20_000, 3)) + 0.1
    y[5000:5400, 0] = np.nan
    y[:, 1] = 0.5
    y[12_000:12_003] = np.nan
    return written(tmp_path / "dead.csv", y)


def one_line(text: str) -> str:
    return " ".join(text.split())


# -- gaps ---------------------------------------------------------------------------------------------------


def test_a_gap_is_listed_once_with_its_channels_and_ends_that_differ(run: Run, dead: Path) -> None:
    said = one_line(run("info", dead).out)
    assert "Gaps in gx: 50 s to 54 s" in said
    assert "Gaps in all channels: 120 s to 120.03 s" in said
    facts = json.loads(run("info", dead, "--json").out)
    assert facts["gaps"] == [
        {"channels": ["gx"], "start": 5000, "stop": 5400},
        {"channels": ["gx", "gy", "gz"], "start": 12_000, "stop": 12_003},
    ]
    assert (facts["gap_count"], facts["gaps_cut"], facts["missing"]) == (2, False, 403)


def test_all_gaps_are_there_and_what_is_cut_says_so(
    run: Run, tmp_path: Path, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    y = rng.standard_normal((4000, 1)) + 10.0
    starts = np.arange(50, 3950, 100)
    for start in starts:
        y[start : start + 2] = np.nan
    log = written(tmp_path / "holes.csv", y)
    facts = json.loads(run("info", log, "--json").out)
    assert [(g["start"], g["stop"]) for g in facts["gaps"]] == [(s, s + 2) for s in starts]
    assert sum(g["stop"] - g["start"] for g in facts["gaps"]) == facts["missing"] == 2 * len(starts)
    said = one_line(run("info", log).out)
    assert "Gaps: 0.5 s to 0.52 s; 1.5 s to 1.52 s;" in said
    assert f"… {len(starts) - 12} more" in said
    monkeypatch.setattr(recordings, "GAPS", 10)
    cut = json.loads(run("info", log, "--json").out)
    assert (len(cut["gaps"]), cut["gap_count"], cut["gaps_cut"]) == (10, len(starts), True)
    assert f"at least {len(starts) - 10} more" in one_line(run("info", log).out)


def test_real_log_lists_as_many_gaps_as_its_finding_counts(real_data) -> None:
    recording = al.read(real_data("formats_misc/xio_fusion_sensor_data.csv"))
    facts = describe(recording, al.check(recording))
    assert facts["gap_count"] == len(facts["gaps"]) == 10
    assert sum(g["stop"] - g["start"] for g in facts["gaps"]) == facts["missing"] == 20


# -- words of the command line --------------------------------------------------------------------------------


@pytest.mark.long
def test_a_dead_channel_is_left_out_by_an_option_that_there_is(run: Run, dead: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = run("characterize", dead, "--accept", "no_noise_resolved", "--out", out)
    said = one_line(done.out)
    assert (
        "imu.yaml was not written: channel 'gy' has no noise model: leave it out, with --channels gx,gz"
        in said
    )
    refused = run("export", "kalibr", out / "study.json")
    assert refused.code == 1
    assert "--gyroscope gx,gz of `allanite export`" in one_line(refused.err)
    assert (
        "gyroscope_noise_density" in run("export", "kalibr", out / "study.json", "--gyroscope", "gx,gz").out
    )
    again = run("characterize", dead, "--channels", "gx,gz", "--out", tmp_path / "again")
    assert again.code == 3 and (tmp_path / "again" / "imu.yaml").exists()


def test_no_footer_below_no_table(run: Run, tmp_path: Path, rng: np.random.Generator) -> None:
    log = written(tmp_path / "ten.csv", 0.01 * rng.standard_normal((10, 3)) + 0.1)
    done = run("characterize", log, "--accept", "too_short", "--out", tmp_path / "out")
    assert "95 % intervals" not in done.out
    assert "the channels gx, gy, gz have no noise model, nor has any other" in one_line(done.out)


@pytest.mark.parametrize("rate", ["1e300", "1e-300"])
def test_a_rate_of_no_sensor_ends_with_words(
    run: Run, tmp_path: Path, rng: np.random.Generator, rate: str
) -> None:
    np.save(tmp_path / "w.npy", rng.standard_normal(2000))
    done = run("characterize", tmp_path / "w.npy", "--rate", rate, "--unit", "deg/s", "--out", tmp_path / "o")
    assert done.code in (1, 2) and "between 1e-09 and 1e+12 Hz" in one_line(done.err)
