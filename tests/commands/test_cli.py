# SPDX-License-Identifier: BSD-3-Clause
"""The command line, from end to end on small simulated logs: what it leaves, what it prints, how it ends."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import click
import numpy as np
import pytest

import allanite as al
import sample_study
from allanite.commands.cli import ByChannel, Duration, Lags, cli, main
from allanite.commands.cli.options import Renamed
from allanite.commands.option import STATISTICS
from allanite.commands.study import RESULTS, curve_of
from allanite.errors import InputError
from allanite.study.model_file import load_models, model_of
from remade import without_links
from shell import Run

MODEL = "N=0.3 deg/√h, B=5 deg/h, K=20 deg/h/√h"


@pytest.fixture(autouse=True)
def wide(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody says how wide the terminal is."""
    monkeypatch.delenv("COLUMNS", raising=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of half an hour, and what characterising it leaves."""
    place = tmp_path_factory.mktemp("cli")
    log, out = place / "gyro.csv", place / "results"
    for arguments in (
        ["simulate", MODEL, "--rate", "10", "--duration", "30min", "--unit", "deg/s", "-o", str(log)],
        ["characterize", str(log), "--out", str(out), "--plot", str(place / "curve.pdf")],
    ):
        with pytest.raises(SystemExit) as left:
            main(arguments)
        assert left.value.code == 0
    return place


@pytest.fixture
def gap_log(tmp_path: Path, rng: np.random.Generator) -> Path:
    samples = rng.normal(1.0, 0.01, 4000)
    samples[1000:1100] = np.nan
    path = tmp_path / "gap.csv"
    rows = (f"{i / 10:.1f},{'' if np.isnan(v) else repr(float(v))}" for i, v in enumerate(samples))
    path.write_text("time [s],gyro [deg/s]\n" + "\n".join(rows) + "\n")
    return path


# -- help, usage, errors ------------------------------------------------------------------------------------


def test_help_is_quick_and_loads_no_numpy() -> None:
    code = (
        "import sys\nfrom allanite.__main__ import main\n"
        "sys.argv = ['allanite', '--help']\n"
        "try:\n    main()\nexcept SystemExit as left:\n    assert not left.code, left.code\n"
        "assert not {'numpy', 'scipy', 'rich', 'pyarrow', 'matplotlib'} & set(sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=30
    )
    for name in cli.commands:
        assert f"  {name} " in done.stdout


def test_version(run: Run) -> None:
    assert run("--version").out == f"allanite, version {al.__version__}\n"


@pytest.mark.parametrize(
    "arguments",
    [
        ["caracterise"],
        ["info"],
        ["info", "x.csv", "--rote", "3"],
        ["info", "x.csv", "--rate", "fast"],
        ["characterize", "x.csv", "--from", "soon"],
        ["characterize", "x.csv", "--unit", "gyro=deg/s,acc"],
        ["simulate", "m.json", "--duration", "1h"],
        ["allan", "x.csv", "--taus", "hexade"],
        ["fit", "x.csv", "--method", "guess"],
    ],
)
def test_wrong_usage_ends_with_two_and_says_why(run: Run, arguments: list[str]) -> None:
    done = run(*arguments)
    assert done.code == 2
    assert done.out == ""
    assert "Error:" in done.err


@pytest.mark.parametrize(
    ("command", "option", "choice"),
    [
        ("characterize", "--statistic", "totdev"),
        ("allan", "--statistic", "totdev"),
        ("allan", "--engine", "decimated"),
        ("fit", "--method", "slopes"),
        ("fit", "--accept", "clipping"),
        ("characterize", "--accept", "clipping"),
    ],
)
def test_a_wrong_choice_is_wrong_usage_and_the_choices_are_named(
    run: Run, folder: Path, command: str, option: str, choice: str
) -> None:
    done = run(command, folder / "gyro.csv", option, "everything")
    assert (done.code, done.out) == (2, "")
    assert "everything" in done.err
    assert choice in done.err


def test_the_choices_are_those_of_the_library() -> None:
    from allanite.noise.allan.statistics import STATISTICS as known

    assert set(STATISTICS) == set(known)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["info", "absent.csv"], "absent.csv"),
        (["report", "gyro.csv", "-o", "r.html"], "not JSON"),
        (
            ["simulate", "gyro.csv", "--rate", "10", "--duration", "9", "-o", "x.csv"],
            "expected a study (study.json of",
        ),
        (["simulate", "N=0.3 deg/h", "--rate", "10", "--duration", "9", "-o", "x.csv"], "deg/√h"),
        (["simulate", "N=0.3 deg/√h", "--duration", "9", "-o", "x.csv"], "--rate"),
        (["simulate", "N=0.3 deg/√h", "--rate", "10", "--duration", "9", "-o", "x.doc"], ".parquet"),
        (["allan", "gyro.csv", "--taus", "0.123"], "0.123"),
        (["export", "excel", "study.json"], "excel"),
        (["characterize", "gyro.csv", "--plot", "curve.doc"], ".pdf"),
        (["characterize", "gyro.csv", "--to", "9h"], "1800 s"),
    ],
)
def test_a_failure_ends_with_one_and_one_block_on_stderr(
    run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: str
) -> None:
    monkeypatch.chdir(folder)
    if "study.json" in arguments:
        arguments = [str(folder / "results" / "study.json") if a == "study.json" else a for a in arguments]
    before = sorted(folder.iterdir())
    done = run(*arguments)
    assert done.code == 1
    assert done.out == ""
    assert done.err.startswith("allanite: ")
    assert words in done.err
    assert "Traceback" not in done.err
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize("text", ["3600", "3600s", "60min", "1h", " 1 h", "3.6e3", "3600000ms"])
def test_time_spans(text: str) -> None:
    assert Duration()(text) == pytest.approx(3600.0)


def test_days_and_weeks() -> None:
    assert (Duration()("7d"), Duration()("1w")) == (604800.0, 604800.0)


def test_units_by_channel_and_lags() -> None:
    assert ByChannel()("deg/s") == "deg/s"
    assert ByChannel()("gyro=deg/s, acc = g") == {"gyro": "deg/s", "acc": "g"}
    assert [Lags()(text) for text in ("octave", "10", "0.5,1,2", "0.5")] == [
        "octave",
        10,
        [0.5, 1.0, 2.0],
        [0.5],
    ]


def test_a_channel_is_renamed_once() -> None:
    assert Renamed()("wx=gyro_x, wy = gyro_y") == {"wx": "gyro_x", "wy": "gyro_y"}
    with pytest.raises(click.BadParameter, match="twice"):
        Renamed()("wx=gyro_x,wx=gyro_y")


# -- characterize -------------------------------------------------------------------------------------------


def test_characterize_leaves_what_it_promises(folder: Path) -> None:
    assert {p.name for p in (folder / "results").iterdir()} == set(RESULTS)
    assert (folder / "curve.pdf").read_bytes().startswith(b"%PDF")
    study = al.Study.load(folder / "results" / "study.json")
    assert study.provenance.source == "gyro.csv"
    assert len(study.provenance.sha256 or "") == 64
    white = study.models["gyro"].estimate("N")
    assert white is not None
    assert white.supported
    assert white.lower < np.radians(0.3) / 60 < white.upper
    assert "gyroscope_noise_density: " in (folder / "results" / "imu.yaml").read_text()


@pytest.mark.long
def test_the_answer_comes_first_then_the_table_and_what_comes_next(
    run: Run, folder: Path, tmp_path: Path
) -> None:
    done = run("characterize", folder / "gyro.csv", "--out", tmp_path / "again")
    lines = done.out.splitlines()
    assert lines[0] == "No problems found. 1 channel, 30 min at 10 Hz." and not lines[1]
    assert lines[2].startswith("Gyroscope")
    for part in ("N [deg/√h]", "B [deg/h]", "K [deg/h/√h]", "95 % intervals"):
        assert part in done.out
    assert "SI" not in done.out
    assert lines[-1].startswith(f"wrote {tmp_path / 'again' / 'report.html'}, ")
    assert all(name in lines[-1] for name in RESULTS)
    assert "Next: gyro: " in done.out
    assert done.err == ""


@pytest.mark.long
def test_si_units_and_nothing_but_the_files_when_asked(run: Run, folder: Path, tmp_path: Path) -> None:
    log, out = folder / "gyro.csv", tmp_path / "again"
    in_si = run("characterize", log, "--out", out, "--si").out
    assert "Gyroscope, SI" in in_si and "N [rad/s/√Hz]" in in_si and "N [deg/√h]" not in in_si
    assert run("fit", log, "--si").out.startswith("Gyroscope, SI")
    quiet = run("characterize", log, "--out", out, "--force", "--quiet").out
    assert quiet.startswith("wrote ") and len(quiet.splitlines()) == 1


@pytest.mark.long
def test_six_axes_fit_a_screen_and_details_unfold_what_was_found(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    y = rng.standard_normal((12_000, 6)) * ([0.05] * 3 + [0.01] * 3) + [0.1, -0.2, 0.3, 0.1, -0.2, 9.78]
    head = ",".join(["t [s]", *(f"gyro_{x} [deg/s]" for x in "xyz"), *(f"acc_{x} [m/s^2]" for x in "xyz")])

    def written(name: str) -> Path:
        table = np.column_stack([np.arange(len(y)) / 100, y])
        np.savetxt(tmp_path / name, table, fmt="%.7g", delimiter=",", header=head, comments="")
        return tmp_path / name

    clean = run("characterize", written("clean.csv"), "--out", tmp_path / "clean").out.splitlines()
    assert clean[0].startswith("No problems found. 6 channels, ") and clean[2].startswith("Gyroscope")
    assert len(clean) <= 30 and all(len(line) <= 80 for line in clean[:-1])
    y[1000:1400, :3] = y[1000, :3]
    y[9000, 4] += 1
    log = written("faults.csv")
    brief = run("characterize", log, "--out", tmp_path / "faults").out
    assert brief.startswith("2 warnings: stuck, spikes. 6 channels, ")
    assert (
        "\nwarning stuck: 3 channels, e.g. " in brief
        and "\nwarning spikes: acc_y: " in brief
        and "--repair" not in brief
    )
    full = run("characterize", log, "--out", tmp_path / "faults", "--force", "--details").out
    flat = " ".join(full.split())
    assert "--repair drop_padding" in flat and "--repair drop_spikes" in flat


@pytest.mark.long
def test_a_narrow_terminal_hides_nothing(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "70")
    customary, si = (run("fit", folder / "results" / "allan.csv", *more).out for more in ([], ["--si"]))
    assert "…" not in customary + si
    assert max(map(len, (customary + si).splitlines())) <= 70
    model = al.Study.load(folder / "results" / "study.json")["gyro"].models[0]
    from allanite.views.wording.study import reading

    for estimate in model.estimates:
        found = reading("rate", "", estimate)
        assert found.symbol not in "QNBKR" or (found.value in customary and found.si in si)


def test_json_prints_the_study_alone_and_writes_no_file(
    run: Run, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = run("characterize", folder / "gyro.csv", "--json")
    assert al.Study.from_json(json.loads(done.out)).names == ("gyro",)
    assert done.err == ""
    assert list(tmp_path.iterdir()) == []


def test_results_are_not_replaced_and_the_refusal_comes_before_the_work(run: Run, folder: Path) -> None:
    before = (folder / "results" / "study.json").read_bytes()
    start = time.process_time()
    done = run("characterize", folder / "gyro.csv", "--out", folder / "results")
    assert time.process_time() - start < 1.0
    assert done.code == 1
    assert "--force" in done.err
    assert (folder / "results" / "study.json").read_bytes() == before


def test_a_log_comes_through_stdin(
    run: Run, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Stdin:
        buffer = io.BytesIO((folder / "gyro.csv").read_bytes())

    monkeypatch.setattr(sys, "stdin", Stdin())
    done = run("info", "-", "--json")
    assert json.loads(done.out)["samples"] == 18_000


def test_a_name_that_the_file_system_refuses_is_a_failure_with_words(run: Run, folder: Path) -> None:
    for name in ("g" * 300 + ".csv", "g" * 300 + "/a.csv"):
        done = run("convert", folder / "gyro.csv", name, "--to", "1s", "--rate", "100")
        assert (done.code, done.out) == (1, "")
        assert "File name too long" in done.err


def test_a_part_of_a_log(run: Run, folder: Path) -> None:
    facts = json.loads(run("info", folder / "gyro.csv", "--from", "5min", "--to", "15min", "--json").out)
    assert (facts["samples"], facts["duration"]) == (6000, pytest.approx(600.0))
    assert facts["history"][-1]["step"] == "window"


# -- info, and the end with loss ----------------------------------------------------------------------------


def test_info_shows_channels_rate_span_and_gaps(run: Run, gap_log: Path) -> None:
    done = run("info", gap_log)
    assert done.code == 3
    for part in (
        "gap.csv: 6.67 min at 10 Hz, 4000 samples, 100 missing",
        "gyro",
        "rate",
        "deg/s",
        "Gaps: 100 s to 110 s",
    ):
        assert part in " ".join(done.out.split())


@pytest.mark.long
def test_a_gap_ends_every_command_that_reads_it_with_three(run: Run, gap_log: Path, tmp_path: Path) -> None:
    assert run("convert", gap_log, tmp_path / "gap.parquet").code == 3
    back = al.read(tmp_path / "gap.parquet")
    assert int(np.isnan(back.values("gyro")).sum()) == 100
    assert back["gyro"].unit == "deg/s"
    assert run("allan", tmp_path / "gap.parquet", "--json").code == 3
    assert run("characterize", tmp_path / "gap.parquet", "--json").code == 3
    for method in ("moments", "slopes"):
        assert run("fit", tmp_path / "gap.parquet", "--method", method, "--json").code == 3


def test_a_dropped_last_line_is_a_loss(run: Run, folder: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.csv"
    cut.write_text((folder / "gyro.csv").read_text().rstrip("\n"))
    assert run("info", cut, "--json").code == 3
    assert run("info", folder / "gyro.csv", "--json").code == 0


def test_a_fatal_finding_is_refused_with_its_risk_and_goes_on_when_accepted(
    run: Run, tmp_path: Path, rng: np.random.Generator
) -> None:
    samples = np.clip(rng.normal(0.1, 0.01, 6000), 0.09, 0.11)  # clipped at one sigma
    np.save(tmp_path / "clipped.npy", samples)
    options = ["--rate", "10", "--unit", "deg/s", "--json"]
    done = run("characterize", tmp_path / "clipped.npy", *options)
    assert done.code == 1
    assert "clipping" in done.err
    assert "--accept" in done.err
    study = json.loads(run("characterize", tmp_path / "clipped.npy", *options, "--accept", "clipping").out)
    assert any(f["code"] == "clipping" and f["accepted"] for f in study["findings"])


# -- curve and fit ------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_saved_curve_is_fitted_like_the_log(run: Run, folder: Path, tmp_path: Path) -> None:
    curve = tmp_path / "allan.csv"
    assert run("allan", folder / "gyro.csv", "-o", curve).code == 0
    assert run("allan", folder / "gyro.csv", "-o", "-").out == curve.read_text()
    from_curve = json.loads(run("fit", curve, "--json").out)
    from_log = json.loads(run("fit", folder / "gyro.csv", "--json").out)
    assert from_curve["gyro"]["terms"] == from_log["gyro"]["terms"]
    assert "N [deg/√h]" in run("fit", curve).out
    assert "slopes" in json.loads(run("fit", curve, "--method", "slopes", "--json").out)["gyro"]["family"]
    read_off = run("fit", curve, "--method", "slopes").out
    assert "not bounded" not in read_off
    assert "for comparison only" in read_off
    assert "is an Allan curve" in run("characterize", curve).err


@pytest.mark.parametrize("words", ["N=1..5 deg/√h", "N=0.7", "N=1 deg/√h, N=2 deg/√h", "B=7 deg/h, T=0 s"])
def test_words_that_are_no_model_are_refused(run: Run, tmp_path: Path, words: str) -> None:
    done = run("simulate", words, "--rate", 3, "--duration", 10, "-o", tmp_path / "x.npy")
    assert done.code == 1
    assert done.err.startswith("allanite: ")


def test_a_faulty_log_is_not_fitted_unless_accepted(
    run: Run, tmp_path: Path, rng: np.random.Generator
) -> None:
    np.save(tmp_path / "clipped.npy", np.clip(rng.normal(0.1, 0.01, 6000), 0.09, 0.11))
    options = ["--rate", "10", "--unit", "deg/s"]
    assert run("fit", tmp_path / "clipped.npy", *options).code == 1
    assert run("fit", tmp_path / "clipped.npy", *options, "--accept", "clipping").code == 0


def test_allan_shows_saves_and_draws(run: Run, folder: Path, tmp_path: Path) -> None:
    shown = run("allan", folder / "gyro.csv", "--taus", "1,10", "--statistic", "mdev").out
    assert "gyro [deg/h]" in shown
    assert "mdev, 95 % intervals" in shown
    plain = json.loads(run("allan", folder / "gyro.csv", "--taus", "1,10", "--json").out)
    assert plain["gyro"]["lags"] == [10, 100]
    picture = tmp_path / "curve.svg"
    assert run("allan", folder / "gyro.csv", "--plot", picture).code == 0
    assert ElementTree.parse(picture).getroot().tag == "{http://www.w3.org/2000/svg}svg"


def test_lags_that_one_channel_lacks_are_empty_in_the_common_curve() -> None:
    document = sample_study.build()
    short = document["channels"][1]["curve"]
    for key in ("lags", "tau", "deviation", "lower", "upper", "edf", "count", "used"):
        short[key] = short[key][1:]
    made = curve_of(al.Study.from_json(document))
    assert made.lags[0] == 1
    assert np.isnan(made.deviation[0, 1])
    assert made.count[0, 1] == 0
    np.testing.assert_array_equal(made.deviation[1:, 1], short["deviation"])


def test_the_curve_of_a_study_is_that_of_its_csv(folder: Path) -> None:
    made = curve_of(al.Study.load(folder / "results" / "study.json"))
    read = al.AllanCurve.from_csv(folder / "results" / "allan.csv")
    np.testing.assert_array_equal(made.deviation, read.deviation)
    assert (made.dt, made.n_samples, made.channels) == (read.dt, read.n_samples, read.channels)


# -- models, simulation, export -----------------------------------------------------------------------------


def test_simulate_takes_a_study_and_is_reproducible(run: Run, folder: Path, tmp_path: Path) -> None:
    study = folder / "results" / "study.json"
    for name in ("a.npy", "b.npy"):
        done = run("simulate", study, "--duration", "1min", "--seed", "7", "-o", tmp_path / name)
        assert "600 samples of gyro at 10 Hz" in done.out
        assert "seed 7" in done.out
    np.testing.assert_array_equal(np.load(tmp_path / "a.npy"), np.load(tmp_path / "b.npy"))


def test_models_out_of_fit_are_models_for_simulate(run: Run, folder: Path, tmp_path: Path) -> None:
    model = tmp_path / "model.json"
    assert run("fit", folder / "results" / "allan.csv", "-o", model).code == 0
    models, rate = load_models(model)
    assert (list(models), rate) == (["gyro"], None)
    done = run("simulate", model, "--rate", "10", "--duration", "10", "-o", tmp_path / "x.parquet")
    assert done.code == 0
    assert al.read(tmp_path / "x.parquet").names == ("gyro",)


def test_a_model_in_words() -> None:
    model = model_of("Q=0.5 arcsec, N=0.3 deg/√h, B=5 deg/h, K=5 deg/h/√h, R=1 deg/h/h")
    assert [t.type for t in model.terms] == ["quantisation", "white", "flicker", "random_walk", "ramp"]
    assert model.kind == "rate"
    assert model_of("N=100 µg/√Hz").kind == "acceleration"
    gauss_markov = model_of("B=5 deg/h, T=240 s").terms[0]
    assert gauss_markov.type == "gauss_markov"
    assert gauss_markov.B_equiv == pytest.approx(np.radians(5) / 3600)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    "text", ["N=0.3", "N=0.3 deg/h", "X=1 deg/h", "N=0.3 deg/√h, B=1 mg", "T=3 s", "T=3 s, N=1 deg/√h"]
)
def test_a_model_in_wrong_words_is_refused(text: str) -> None:
    with pytest.raises(InputError):
        model_of(text)


def test_export_goes_to_stdout_or_a_file_and_keeps_what_is_there(
    run: Run, folder: Path, tmp_path: Path
) -> None:
    study = folder / "results" / "study.json"
    printed = run("export", "kalibr", study, "--walk", "upper-bound", "--rostopic", "/imu9").out
    assert "rostopic: /imu9" in printed
    target = tmp_path / "imu.yaml"
    assert run("export", "kalibr", study, "-o", target, "--rostopic", "/imu9").code == 0
    assert target.read_text(encoding="utf-8") == printed
    assert run("export", "kalibr", study, "-o", target).code == 1
    assert run("export", "kalibr", study, "-o", target, "--force").code == 0


def test_report_writes_the_report_once_more(run: Run, folder: Path, tmp_path: Path) -> None:
    assert run("report", folder / "results" / "study.json", "-o", tmp_path / "r.html").code == 0
    assert without_links(tmp_path / "r.html") == without_links(folder / "results" / "report.html")


# -- as a process -------------------------------------------------------------------------------------------


@pytest.mark.skipif(os.name != "posix", reason="pipes of a shell")
@pytest.mark.parametrize("words", ["allan {} -o -", "info {}", "--help"])
def test_a_reader_of_stdout_that_leaves_is_no_error(folder: Path, words: str) -> None:
    command = [sys.executable, "-m", "allanite", *words.format(folder / "gyro.csv").split()]
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, timeout=60, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, b"")


def test_a_broken_pipe_of_something_else_is_an_error(monkeypatch: pytest.MonkeyPatch, run: Run) -> None:
    def gone(*_: Any, **__: Any) -> None:
        raise BrokenPipeError(32, "Broken pipe", "socket")

    monkeypatch.setattr("allanite.commands.recordings.read_part", gone)
    done = run("info", "log.csv")
    assert done.code == 1
    assert "Broken pipe" in done.err


def test_info_ends_as_characterize_would(run: Run, tmp_path: Path) -> None:
    y = np.random.default_rng(3).standard_normal(2000) + 5.0
    for name, samples, code in (("good", y, 0), ("clipped", np.clip(y, 4.0, 6.0), 1)):
        log = tmp_path / f"{name}.csv"
        np.savetxt(log, samples, header="y [deg/s]", comments="", fmt="%.5f")
        assert run("info", log, "--rate", "100").code == code
        assert run("characterize", log, "--rate", "100", "--json").code == code


@pytest.mark.long
def test_a_plain_terminal_does_no_harm(folder: Path) -> None:
    ascii_only = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    shown = subprocess.run(
        [sys.executable, "-m", "allanite", "fit", str(folder / "results" / "allan.csv")],
        capture_output=True, env=ascii_only, timeout=60, check=True,
    )  # fmt: skip
    assert b"N [deg/?h]" in shown.stdout
