# SPDX-License-Identifier: BSD-3-Clause
"""record and monitor: a run from the command line, a log like any other."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import allanite as al
from allanite.cli import cli
from allanite.log_store import Batch, Header, LogStore
from allanite.recording import Channel, Kind


def run(*arguments: str) -> Result:
    return CliRunner().invoke(cli, arguments, standalone_mode=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    runs = tmp_path_factory.mktemp("runs")
    words = (
        "record",
        "simulated",
        "--model",
        "N=0.3 deg/√h, K=20 deg/h/√h",
        "--rate",
        "32",
        "--speed",
        "20000",
    )
    done = run(
        *words, "--duration", "20min", "--unit", "deg/s", "--out", str(runs), "--name", "Gyro 1", "--json"
    )
    assert done.return_value == 0, done.output
    document = json.loads(done.stdout)
    assert (document["samples"], document["missing"], document["status"]) == (38_400, 0, "success")
    (made,) = runs.iterdir()
    assert made == Path(document["folder"]) and made.name.startswith("Gyro-1_0_")
    return made


def test_a_run_is_a_log_with_the_samples_of_the_simulation(folder: Path) -> None:
    record = al.read(folder)
    assert (record.n_samples, record.rate) == (38_400, 32.0)
    curve = al.allan_curve(record)
    same = al.allan_curve(al.Recording.from_rate(record.values(record.names[0]), rate=32.0, unit="deg/s"))
    assert np.array_equal(curve.deviation, same.deviation)  # bit for bit: a run and an array


def test_monitor_shows_the_run_and_its_curve(folder: Path) -> None:
    text = run("monitor", "--once", str(folder)).stdout
    assert "finished as planned" in text and "38400 (20 min)" in text and "none" in text
    document = json.loads(run("monitor", "--json", str(folder)).stdout)
    assert document["measured_rate"] == pytest.approx(32.0, rel=1e-6)
    curve = al.allan_curve(al.read(folder), taus="octave", engine="decimated")
    found = document["curves"][curve.names[0]]
    assert found["deviation"][:8] == pytest.approx(curve.deviation[:8, 0].tolist(), rel=1e-9)


def test_monitor_counts_gaps_and_overloads(tmp_path: Path) -> None:
    channel = Channel(name="gyro", kind=Kind.RATE, unit="rad/s", scale=1.0, sampling="mean")
    with LogStore.create(tmp_path / "run", Header(channels=(channel,), rate=10.0)) as store:
        for first in (0, 100, 300):
            number = np.arange(first, first + 100)
            values = np.random.default_rng(first).standard_normal((100, 1))
            flags = np.zeros(100, dtype=np.uint8)
            if first == 300:
                values[5], flags[5] = np.nan, 1
            store.append(
                Batch(counter=number, monotonic_ns=number * 10**8, values=values, flags=flags, utc_ns=10**18)
            )
    document = json.loads(run("monitor", "--json", str(tmp_path / "run")).stdout)
    assert (document["samples"], document["missing"], document["gaps"], document["overloads"]) == (
        300,
        100,
        1,
        1,
    )
    assert document["curves"]["gyro"]["n_samples"] == 400


def test_what_is_missing_is_asked_for(tmp_path: Path) -> None:
    from allanite.errors import AllaniteError

    done = run("record", "simulated", "--model", "N=0.3 deg/√h", "--out", str(tmp_path))
    assert isinstance(done.exception, AllaniteError) and "give one [Hz]" in str(done.exception)
    done = run("monitor", str(tmp_path))
    assert isinstance(done.exception, AllaniteError)
