# SPDX-License-Identifier: BSD-3-Clause
"""allanite.toml: what it states is what the options would, it is stated in every result, and nothing else is taken."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.commands import read_part
from allanite.commands.bench_file import FILE_NAME, bench_of, read_bench
from allanite.commands.option import READING
from shell import Run

TABLE = """
time = "clock:ms"

[unit]
gx = "deg/s"
ay = "g"

[names]
gx = "gyro_x"
"""


@pytest.fixture
def bench(tmp_path: Path, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a log of three channels without units; the working folder is another one."""
    folder, elsewhere = tmp_path / "bench", tmp_path / "elsewhere"
    folder.mkdir()
    elsewhere.mkdir()
    rows = np.column_stack([np.arange(4000) * 10, rng.normal(0.2, 0.01, (4000, 3))])
    np.savetxt(folder / "log.csv", rows, "%.9g", ",", header="clock,gx,ay,u", comments="")
    monkeypatch.chdir(elsewhere)
    monkeypatch.delenv("ALLANITE_CONFIG", raising=False)
    return folder


def state(folder: Path, text: str = TABLE) -> Path:
    place = folder / FILE_NAME
    place.write_text(text, encoding="utf-8")
    return place


def info(run: Run, *words: object) -> dict[str, Any]:
    done = run("info", *words, "--json")
    assert done.code in (0, 3), done.err
    facts: dict[str, Any] = json.loads(done.out)
    return facts


def units(facts: dict[str, Any]) -> dict[str, str]:
    return {channel["name"]: channel["unit"] for channel in facts["channels"]}


def test_the_file_is_the_options(bench: Path, run: Run) -> None:
    by_options = info(run, bench / "log.csv", "--time", "clock:ms", "--unit", "gx=deg/s,ay=g")
    state(bench)
    by_file = info(run, bench / "log.csv")
    assert units(by_file) == {"gyro_x": "deg/s", "ay": "g", "u": ""}
    assert [*units(by_file).values()] == [*units(by_options).values()]
    assert (
        (by_file["rate"], by_file["samples"]) == (by_options["rate"], by_options["samples"]) == (100.0, 4000)
    )


@pytest.mark.long
def test_what_was_taken_is_in_every_result_and_on_the_terminal(bench: Path, run: Run, tmp_path: Path) -> None:
    place = state(bench)
    said = f"from {place}: time clock:ms; unit gx = deg/s, ay = g; names gx = gyro_x"
    out = tmp_path / "out"
    done = run("characterize", bench / "log.csv", "--out", out)
    assert f"allanite: note: log.csv: {said}\n" in done.err
    study = json.loads((out / "study.json").read_text(encoding="utf-8"))
    assert said in [f["message"] for f in study["findings"] if f["code"] == "bench_file"]
    (step,) = [s for s in study["recording"]["history"] if s["step"] == "bench_file"]
    assert step["stated"]["names"] == {"gx": "gyro_x"} and len(step["sha256"]) == 64
    assert str(place) in (out / "report.html").read_text(encoding="utf-8")
    for command in ("allan", "spectrum"):
        assert said in run(command, bench / "log.csv", "--json").err


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--unit", "gx=rad/s"), {"gyro_x": "rad/s", "ay": "g", "u": ""}),
        (("--unit", "gyro_x=rad/s"), {"gyro_x": "rad/s", "ay": "g", "u": ""}),
        (("--unit", "gx=rad/s,ay=mg"), {"gyro_x": "rad/s", "ay": "mg", "u": ""}),
        (("--unit", "V"), {"gyro_x": "V", "ay": "V", "u": "V"}),
        (("--channels", "gyro_x"), {"gyro_x": "deg/s"}),
        (("--channels", "ay"), {"ay": "g"}),
        (("--config", "none", "--time", "clock:ms"), {"gx": "", "ay": "", "u": ""}),
    ],
)
def test_an_option_goes_before_the_file_channel_by_channel(
    bench: Path, run: Run, words: tuple[str, ...], expected: dict[str, str]
) -> None:
    state(bench, TABLE)
    facts = info(run, bench / "log.csv", *words)
    assert units(facts) == expected
    stated = next((s["stated"] for s in facts["history"] if s["step"] == "bench_file"), {})
    given = dict(part.split("=") for part in words[1].split(",")) if "=" in words[1] else {}
    for name in (*given, *({"gx", "ay"} if words == ("--unit", "V") else ())):
        assert {"gyro_x": "gx"}.get(name, name) not in stated.get("unit", {}), (
            "it is not said to be of the file"
        )


def test_the_file_beside_the_log_is_taken_before_that_of_the_working_folder(bench: Path, run: Run) -> None:
    assert bench_of(bench / "log.csv", "auto") is None
    state(Path.cwd(), 'time = "clock:ms"\nunit = "V"\n')
    assert set(units(info(run, bench / "log.csv")).values()) == {"V"}
    state(bench)
    assert units(info(run, bench / "log.csv"))["gyro_x"] == "deg/s"
    other = Path("other.toml")
    other.write_text('time = "clock:ms"\nunit = "mV"\n', encoding="utf-8")
    assert set(units(info(run, bench / "log.csv", "--config", other)).values()) == {"mV"}


def test_the_environment_names_a_file_or_none(bench: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    state(bench)
    monkeypatch.setenv("ALLANITE_CONFIG", "none")
    assert units(info(run, bench / "log.csv")) == {"gx": "", "ay": "", "u": ""}
    other = bench / "other.toml"
    other.write_text('unit = "mV"\n', encoding="utf-8")
    monkeypatch.setenv("ALLANITE_CONFIG", str(other))
    assert set(units(info(run, bench / "log.csv")).values()) == {"mV"}


def test_python_reads_no_file_that_is_not_named(bench: Path) -> None:
    state(bench)
    recording = al.read(bench / "log.csv", time="clock:ms")
    assert recording.names == ("gx", "ay", "u")
    assert read_part(bench / "log.csv", time="clock:ms").names == ("gx", "ay", "u")
    with pytest.warns(al.DataQualityWarning, match="from .*toml"):
        assert read_part(bench / "log.csv", config=bench / FILE_NAME).names == ("gyro_x", "ay", "u")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("units = 'g'", "unknown key 'units'; did you mean unit?"),
        ("start = 3", "unknown key 'start'"),
        ("[unit]\ngx = 3", "unit.gx must be a text, not 3"),
        ("unit = 3", "unit must be a text or a table of texts by channel, not 3"),
        ("rate = '100'", "rate must be a positive number, not '100'"),
        ("rate = true", "rate must be a positive number, not True"),
        ("rate = -1", "rate must be a positive number"),
        ("channels = 'gx'", "channels must be a list of names"),
        ("kind = 'rate'", "kind must be one of phase, frequency"),
        ("names = 'gx'", "names must be a table"),
        ("[names]\ngx = 'a'\nay = 'a'", "names gives one name to two channels"),
        ("[unit\n", "is no TOML: .*line 1"),
        ("[names]\ngz = 'gyro_z'", "no channel gz in log.csv; there are: gx, ay, u"),
        ("[unit]\ngz = 'g'", "gz"),
    ],
)
def test_a_fault_is_named_with_its_place(bench: Path, run: Run, text: str, said: str) -> None:
    place = state(bench, f"{text}\n" if text.startswith(("[", "time")) else f'{text}\ntime = "clock:ms"\n')
    done = run("info", bench / "log.csv", *(("--time", "clock:ms") if text.startswith("[") else ()))
    assert done.code == 1
    assert re.search(said, done.err) and str(place) in done.err, done.err


def test_a_command_that_reads_no_log_takes_no_file(bench: Path, run: Run) -> None:
    """A data sheet alone, a curve: a file that is there states nothing of them, and one that is named is refused."""
    Path("sheet.yaml").write_text("sensor: X\ngyro:\n  angle_random_walk: 0.3 deg/√h\n", encoding="utf-8")
    assert (
        run("allan", bench / "log.csv", "--unit", "gx=deg/s", "--channels", "gx", "-o", "curve.csv").code == 0
    )
    state(Path.cwd())
    for line in (("datasheet", "sheet.yaml"), ("fit", "curve.csv")):
        done = run(*line)
        assert (done.code, done.err) == (0, ""), done.err
        assert run(*line, "--config", FILE_NAME).code == 1


def test_a_place_where_no_file_can_be_has_none() -> None:
    assert bench_of(Path("x" * 300) / "log.csv", "auto") is None
    assert bench_of(Path("nowhere") / "log.csv", "auto") is None


def test_a_file_that_is_not_there_is_refused(bench: Path, run: Run) -> None:
    done = run("info", bench / "log.csv", "--config", "nowhere.toml")
    assert done.code == 1 and "nowhere.toml cannot be read" in done.err


def test_every_option_of_reading_without_a_default_is_a_key(tmp_path: Path) -> None:
    """A new option of reading is one of the bench, unless it is one of a single log."""
    values: dict[str, str] = {"number": "2", "names": '["a"]', "choice": "", "by-channel": '"g"'}
    for option in READING:
        value = values.get(option.type, '"x"') or f'"{option.choices[0]}"'
        place = tmp_path / FILE_NAME
        place.write_text(f"{option.python} = {value}\n", encoding="utf-8")
        if option.python in ("start", "stop", "repair", "sampling"):
            with pytest.raises(al.InputError, match="unknown key"):
                read_bench(place)
        else:
            assert option.python in read_bench(place).options
