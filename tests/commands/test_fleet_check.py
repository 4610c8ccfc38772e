# SPDX-License-Identifier: BSD-3-Clause
"""`allanite fleet check`: exit codes of a production line, limits from three sources."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from allanite.commands import measure
from allanite.commands.fleet.sheet_limits import limits_of_fleet
from allanite.errors import InputError
from allanite.files.recording_file import write_recording
from allanite.filtering.simulation import simulate
from allanite.noise import NoiseModel, White
from allanite.views.registry import document_of
from allanite.views.result_page import view_of
from fleet_tables import MIDDLE, fleet_table
from shell import Run


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """good.parquet and bad.parquet, and a fleet whose N is about MIDDLE."""
    folder = tmp_path_factory.mktemp("bench")
    for name, n in (("good", MIDDLE), ("bad", 3 * MIDDLE)):
        record = simulate(NoiseModel.of(White(N=n)), rate=10.0, duration=400.0, seed=1, unit="deg/s")
        write_recording(record, folder / f"{name}.parquet")
    (folder / "fleet").mkdir()
    table = fleet_table(symbols=("N",))
    channel = pa.array(["gyro"] * len(table))
    table = table.set_column(table.column_names.index("channel"), "channel", channel)
    (folder / "fleet" / "fleet.parquet").mkdir()
    for i in range(2):  # as a run writes it
        half = len(table) // 2
        pq.write_table(
            table.slice(i * half, half), folder / "fleet" / "fleet.parquet" / f"{i:03d}-of-002.parquet"
        )
    return folder


@pytest.mark.parametrize(("name", "code", "words"), [("good", 0, "Pass."), ("bad", 10, "Fail.")])
def test_the_population_is_the_limit(bench: Path, run: Run, name: str, code: int, words: str) -> None:
    fleet = bench / "fleet"
    if not (fleet / "population.json").exists():
        assert run("fleet", "report", fleet, "--out", fleet).code == 0
    done = run("fleet", "check", bench / f"{name}.parquet", "--against", fleet)
    assert done.code == code, done.err
    assert done.out.startswith(words) and "population" in done.out and "gyro N [deg/√h]" in done.out


def test_it_cannot_tell_and_says_how_long_a_record_decides(bench: Path, run: Run, tmp_path: Path) -> None:
    limit = f"N={math.degrees(MIDDLE) * 60 * 1.001:.6f} deg/√h"
    done = run("fleet", "check", bench / "good.parquet", "--limit", limit, "--out", tmp_path / "out")
    assert done.code == 11 and done.out.startswith("Cannot tell.") and "decides" in done.out
    data = json.loads((tmp_path / "out" / "check.json").read_text(encoding="utf-8"))
    assert data["verdict"] == "cannot tell" and data["coefficients"][0]["duration"] >= 800
    document = document_of(data)
    assert document.to_json() == data
    assert [s.id for s in view_of(document).sections][:1] == ["verdict"]
    assert (tmp_path / "out" / "check.csv").read_text(encoding="utf-8").startswith("channel,symbol,unit,")


@pytest.mark.parametrize(
    "statement",
    [
        "bias_instability: 5 deg/h\n  bias_instability_is: minimum",
        "bias_stability: 5 deg/h\n  correlation_time: 100 s",
    ],
)
def test_no_unit_passes_with_a_limit_of_its_sheet_that_is_not_looked_at(
    bench: Path, tmp_path: Path, statement: str
) -> None:
    sheet = tmp_path / "sheet.yaml"
    sheet.write_text(f"gyro:\n  angle_random_walk: 9 deg/√h\n  {statement}\n", encoding="utf-8")
    for made in (
        lambda: measure("fleet check", bench / "good.parquet", sheet=sheet),
        lambda: limits_of_fleet(sheet, bench / "fleet"),
    ):
        with pytest.raises(InputError, match=r"sheet\.yaml: bias_.* cannot be checked.*allanite datasheet"):
            made()
    assert measure("datasheet", sheet, log=bench / "good.parquet").result.channels  # as the message advises
    sheet.write_text("gyro:\n  angle_random_walk: 9 deg/√h\n", encoding="utf-8")
    assert measure("fleet check", bench / "good.parquet", sheet=sheet).result.verdict == "pass"


def test_a_given_limit_goes_before_the_sheet_and_the_sheet_before_the_fleet(
    bench: Path, tmp_path: Path
) -> None:
    sheet = tmp_path / "sheet.yaml"
    sheet.write_text(
        "gyro:\n  angle_random_walk: 0.1 deg/√h\n  rate_random_walk: 900 deg/h/√h\n", encoding="utf-8"
    )
    log, fleet = bench / "good.parquet", bench / "fleet"
    result = measure("fleet check", log, against=fleet, sheet=sheet).result
    assert [(c.limit.symbol, c.limit.source) for c in result.coefficients] == [
        ("N", "data sheet"),
        ("K", "data sheet"),
    ]
    result = measure("fleet check", log, sheet=sheet, limits=["gyro:N=2 deg/√h"]).result
    assert [c.limit.source for c in result.coefficients] == ["given", "data sheet"]
    assert result.coefficients[0].limit.value == pytest.approx(np.radians(2) / 60)


@pytest.mark.parametrize(
    ("limits", "says"),
    [
        ([], "there is no limit"),
        (["N=0.15"], "write a coefficient with its unit"),
        (["N=0.15 m/s/√h"], "no such channel, or another unit"),
        (["gyro_z:N=0.15 deg/√h"], "no such channel"),
        (["N=0 deg/√h"], "a positive number"),
    ],
)
def test_a_limit_that_says_nothing_is_refused(bench: Path, limits: list[str], says: str) -> None:
    with pytest.raises(InputError, match=says):
        measure("fleet check", bench / "good.parquet", limits=limits)


@pytest.mark.long
def test_a_fleet_of_other_channels_is_refused(bench: Path, tmp_path: Path) -> None:
    pq.write_table(fleet_table(symbols=("N",)), tmp_path / "fleet.parquet")
    with pytest.raises(InputError, match="the fleet has the channels gyro_x, and the log gyro"):
        measure("fleet check", bench / "good.parquet", against=tmp_path)


@pytest.mark.long
def test_it_loads_no_other_analysis(bench: Path) -> None:
    """A production line pays for the imports of each check."""
    code = (
        "import atexit, sys, allanite.__main__ as a; atexit.register(lambda: print(*sys.modules)); a.main()"
    )
    arguments = ("fleet", "check", bench / "good.parquet", "--limit", "N=900 deg/√h")
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True
    )
    loaded = done.stdout.rpartition("\n\n")[2].split()
    assert "allanite.stability.fleet.checking" in loaded
    others = (
        "experiments",
        "acquisition",
        "study.study",
        "study.characterization",
        "stability.environment",
        "fitting.spectral",
        "views.study",
    )
    of_others = tuple(f"allanite.{name}" for name in others)
    assert not [name for name in loaded if name.startswith((*of_others, "matplotlib"))]
