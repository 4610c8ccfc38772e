# SPDX-License-Identifier: BSD-3-Clause
"""Every option and every command that an error suggests is carried out, as its reader copies it."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from copied_advice import COMMANDS, ways_in, with_way
from raised_texts import raised_texts
from refusals import Refusal, numbers, table
from refused_commands import COMMANDS as MEASUREMENTS
from refused_commands import TRIAD, models
from refused_commands import T as TIMES
from refused_curves import CURVES
from refused_logs import LOGS
from refused_records import RECORDS
from shell import Run

REFUSALS = (*LOGS, *CURVES, *MEASUREMENTS, *RECORDS)
FOLDER = "my logs"
#: Advice that another test carries out: its file, and words in it; or why nothing can be carried out.
ELSEWHERE: dict[str, tuple[str, str]] = {
    "Take it out of this sheet; allanite datasheet compares": (
        "commands/test_fleet_check.py",
        'measure("datasheet", sheet',
    ),
    "Run the logs of the wrong unit again, alone": (
        "commands/test_fleet_runs.py",
        '"--unit", "gyro_z=deg/s"',
    ),
    "is no fleet; make one": ("commands/test_fleet_watch.py", '"fleet", "run", "logs/*"'),
    "is for one log; with --positions": (
        "experiments/test_positions_kept_apart.py",
        "--spans is for one log",
    ),
    "the unit is never at rest": (
        "experiments/test_positions_kept_apart.py",
        "is never at rest",
    ),
    "Subsystem for Linux": ("test_other_systems.py", "Subsystem for Linux"),
    "is the horizon of a bound": ("fitting/test_overbound.py", "bound_until=100.0"),
    "one log: state the log at rest": ("commands/test_cli_in_motion.py", '*logs, "--channels"'),
    "state pairs, --match": ("commands/test_cli_in_motion.py", '"--match", "first,a")'),
    "state the units of both (--unit)": ("commands/test_cli_in_motion.py", '"--unit", f"{raw}=rad/s"'),
    "name both, --innovations and --variances": (
        "commands/test_cli_innovations.py",
        '"--innovations", "a,b", "--variances", "c,d").code == 0',
    ),
    "--variances and --deviations state one thing": (
        "commands/test_cli_innovations.py",
        '"--variances", "c,d").code == 0',
    ),
    "admits other machines": ("commands/test_page_guard.py", '"--token" in done.err'),
    "the three axes were turned by about half a turn": (
        "commands/test_cli_rate_vector.py",
        '*PLACE, "--vector")',
    ),
    "the fit does not settle": (
        "experiments/test_hand_held.py",
        "does not settle, so there are no parameters",
    ),
    "need at least four positions that do not lie": (
        "experiments/test_calibration.py",
        "at least four positions",
    ),
    "files of one sensor have the same": ("experiments/test_north.py", "files of one sensor have the same"),
    "--gyro {} (or --accelerometer)": (
        "test_advice.py",
        'options_copied(refused.err, "--gyro", "--accelerometer")',
    ),
    "leads out of itself": ("files/test_readers_hdf5.py", 'variable="good"'),
    "samples with the same time": ("files/test_readers_ros.py", 'topic="/all.samples[1]"'),
    "It is a fraction: {} % is": ("quantities/test_scale_uncertainty.py", "10 % is 0"),
    "state to which side of": ("experiments/test_north.py", '"--second-axis left" in asked.err'),
    "the rate changes from {} Hz to {} Hz": ("files/test_rate_change.py", "al.read(log, start=1.05 * at)"),
    "--second-axis needs two channels": ("experiments/test_north.py", "needs two channels of rates"),
    "--heading needs --latitude": ("experiments/test_position_planning.py", "depends on the latitude"),
    "--variable {} (every {} s)": ("files/test_readers_labview.py", "--variable '[^']+'"),
}
#: Advice of which nothing can be carried out by one command and its files, and why.
NOT_ALONE = {
    "more than a MATLAB file of version 5 takes": "samples of gigabytes",
    "state the positions of the table: in one log": "of the library: the command asks before",
    "needs the noise model of the sensor": "of the library: the command asks before",
    "raw binary files need layout=": "of the library: without a layout this reader is never taken",
    "takes a calibration, the output": "of the library: the command reads a calibration",
    "only a run that": "of the page",
    "--port": "of the page: it would go on serving",
    "here all rows need the same time": "the logs of the positions are other files",
    "the channels have different rates": "of a picture: the report of the study shows them",
    "files with the time between them are": "files of gigabytes",
    "OpenVINS reads": "the log is calibrated anew, by another command",
    "These are frames of a CAN bus": "a command of another program",
    "but change of place in the course": "the rows are lost at places that no renewal explains",
}


def placed(refusal: Refusal) -> None:
    """The files of a refusal, in a folder of the working folder."""
    Path(FOLDER).mkdir()
    for name, content in refusal.files.items():
        path = Path(FOLDER, name)
        if callable(content):
            content(path)
        elif isinstance(content, bytes):
            path.write_bytes(content)
        else:
            path.write_text(content, encoding="utf-8")


def typed(words: list[str], refusal: Refusal) -> list[str]:
    """Words in which the name of a file, bare or with what is said of it (=0deg), is its path."""
    paths = {name: str(Path(FOLDER, name)) for name in refusal.files}
    parts = (word.partition("=") for word in words)
    return ["".join((paths.get(file, file), *rest)) for file, *rest in parts]


@pytest.mark.parametrize("refusal", REFUSALS, ids=lambda r: r.says[0][:40])
def test_every_way_that_an_error_names_is_one(
    refusal: Refusal, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Copied, it ends the refusal, and the command runs."""
    monkeypatch.chdir(tmp_path)
    placed(refusal)
    line = typed(shlex.split(refusal.line), refusal)
    refused = run(*line)
    assert refused.code in (1, 2), refused.out + refused.err
    said = refused.err.partition("Error: ")[2] or refused.err
    first = refusal.says[0].partition("{")[0]
    for part in refusal.says:
        for fixed in part.split("{}"):
            assert fixed in said, (fixed, said)
    name = " ".join(line[:2]) if line[0] == "plan" and line[1:2] == ["positions"] else line[0]
    ways = ways_in(said, name, refusal.adds)
    tried = [line]
    for way in ways:
        again = with_way(line, way._replace(words=tuple(typed(list(way.words), refusal))), refusal.instead)
        if again in tried:  # an option that is to be left out, where it is given
            continue
        tried.append(again)
        done = run(*again)
        assert first not in done.err, (again, done.err)
        later = refusal.later.get(" ".join(way.words)) or refusal.later.get(way.key)
        if later is None:
            assert done.code in (0, 3), (again, done.err)
        else:
            assert done.code in (1, 2) and later in done.err, (again, done.code, done.err)
    assert len(tried) > 1, said


@pytest.mark.parametrize(
    ("command", "heads"), [("earth-rate", "gyro [deg/s]"), ("earth-rate", TRIAD.split("\n")[0])]
)
def test_names_of_models_are_mapped_where_the_command_has_the_option(
    command: str, heads: str, run: Run, tmp_path: Path
) -> None:
    """`--model-channels` is of align, calibrate and north."""
    log, model = tmp_path / "a log.csv", tmp_path / "models.json"
    axes = heads.count("deg/s")
    log.write_text(
        table(heads if axes > 1 else f"t [s],{heads}", TIMES, y=numbers(600, axes)), encoding="utf-8"
    )
    models("gyro x", "gyro y")(model)
    refused = run(command, log, "--latitude", "48", "--model", model)
    assert refused.code == 1 and "has no model of channel" in refused.err
    assert "--model-channels" not in refused.err


ADVICE = re.compile(rf"(?<![\w-])--[a-z{{]|allanite (?:{'|'.join(map(re.escape, COMMANDS))})\b")


def advising() -> list[tuple[str, str]]:
    """Texts of errors that name an option or a command, and say more than its name."""
    bare = re.compile(r"--\S+|\{\}|\W")
    return [(place, text) for place, text in raised_texts(ADVICE) if bare.sub("", text)]


def test_every_error_that_advises_is_in_the_table() -> None:
    said = {part for refusal in REFUSALS for part in refusal.says}
    for place, text in advising():
        carried_out = any(part in text for part in said)
        named = [part for part in (*ELSEWHERE, *NOT_ALONE) if part in text]
        assert carried_out or named, f"{place}: no case carries out {text!r}"


def test_what_is_not_in_the_table_is_said_and_looked_after() -> None:
    texts = [text for _, text in advising()]
    for part in (*ELSEWHERE, *NOT_ALONE):
        assert any(part in text for text in texts), f"no error says {part!r}"
    for part, (name, words) in ELSEWHERE.items():
        assert words in (Path(__file__).parent / name).read_text(encoding="utf-8"), (part, name)
