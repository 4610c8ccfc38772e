# SPDX-License-Identifier: BSD-3-Clause
"""Every option and command that a finding or an error suggests is one: it runs, and the finding is gone."""

from __future__ import annotations

import ast
import json
import re
import shlex
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import allanite
from allanite.commands.cli import cli
from allanite.commands.cli.in_options import in_options
from allanite.recording.cleaning import REPAIRS
from allanite.recording.health.catalogue import CATALOGUE
from copied_advice import CHOICES, COMMANDS, OPTIONS
from shell import Run

PACKAGE = Path(allanite.__file__).parent
N = 4000
Samples = np.ndarray
Rng = np.random.Generator


# -- findings, each from a file that shows it -------------------------------------------------------------


def at_rest(rng: Rng) -> Samples:
    return rng.standard_normal((N, 3)) * 0.05 + [0.3, -0.2, 9.78]


def zeros(rng: Rng) -> Samples:
    y = at_rest(rng)
    y[rng.choice(N, 70, replace=False)] = 0.0
    y[-500:] = 0.0
    return y


def fill_values(rng: Rng) -> Samples:
    y = at_rest(rng)
    y[rng.choice(N, 70, replace=False), 1] = -999.0
    return y


def frozen(rng: Rng) -> Samples:
    y = at_rest(rng)
    y[-700:] = y[-700]
    return y


def spikes(rng: Rng) -> Samples:
    y = at_rest(rng)
    y[[0, 900, 1700]] += [[1e5], [30.0], [2e3]]
    return y


def overload(rng: Rng) -> Samples:
    y = at_rest(rng)
    y[1000:1050] = 9.9e37
    return y


def held(rng: Rng) -> Samples:
    return np.repeat(at_rest(rng)[: N // 2], 2, axis=0)


def interleaved(rng: Rng) -> Samples:
    y = at_rest(rng)
    y[::2] += 2.0
    return y


def half_before_gap(rng: Rng) -> Samples:
    y = 40.0 + at_rest(rng)
    y[1970:2000] *= 0.5
    y[2000:2100] = np.nan
    return y


def some_in_every_third_row(rng: Rng) -> Samples:
    y = at_rest(rng)
    y[np.arange(N) % 3 != 0, 1:] = np.nan
    return y


def moved(rng: Rng) -> Samples:
    y = at_rest(rng)
    y[2500:3200] += 2000.0 * np.hanning(700)[:, None]
    return y


def disturbed(rng: Rng) -> Samples:
    y = at_rest(rng)
    y[2500:3200] += 0.4 * np.sin(0.05 * np.arange(700))[:, None]
    return y


def a_time(rng: Rng) -> Samples:
    y = at_rest(rng)
    y[:, 1] = 0.01 * np.arange(N)
    return y


def no_unit(rng: Rng) -> Samples:
    return at_rest(rng)


UNIT = "deg/s"
CASES: list[tuple[Callable[[Rng], Samples], str, str, str]] = [
    # what is in the file, unit of the columns, the finding, the option that its advice must hold
    (zeros, UNIT, "zero_filled", "--repair drop_padding"),
    (fill_values, UNIT, "fill_value", "--repair drop_padding"),
    (frozen, UNIT, "stuck", "--repair drop_padding"),
    (spikes, UNIT, "spikes", "--repair drop_spikes"),
    (overload, UNIT, "overload", "--repair drop_saturated"),
    (held, UNIT, "held_samples", "--repair drop_repeats"),
    (interleaved, UNIT, "interleaved", "--repair split_interleaved"),
    (half_before_gap, UNIT, "half_before_gap", "--repair drop_cut_blocks"),
    (some_in_every_third_row, UNIT, "broken_up", "--channels"),
    (moved, UNIT, "not_at_rest", "--to|--repair cut_motion"),
    (disturbed, UNIT, "disturbance", "--to|--repair cut_motion"),
    (a_time, UNIT, "only_grows", "--channels"),
    (no_unit, "", "unit_missing", "--unit"),
]


def written(place: Path, y: Samples, unit: str) -> Path:
    unit = f" [{unit}]" if unit else ""
    head = "t," + ",".join(f"u{k}{unit}" for k in range(y.shape[1]))
    table = np.column_stack([np.arange(len(y)) / 100, y])
    np.savetxt(place, table, fmt="%.9g", delimiter=",", header=head, comments="")
    return place


def advised(out: str, code: str) -> str:
    """The arrows under a finding, as printed, on one line."""
    lines = out.splitlines()
    first = next(
        i for i, line in enumerate(lines) if re.fullmatch(rf"(fatal|warning|info)[^:]* {code}", line)
    )
    under = []
    for line in lines[first + 1 :]:
        if not line.startswith("  "):
            break
        under.append(line)
    return " ".join(" ".join(under).split("→")[1:])


def options_in(words: str) -> list[list[str]]:
    """Ways out that a text offers: repairs by name, parts and channels; each as arguments."""
    ways = [["--repair", name] for name in re.findall(r"--repair (\w+)", words)]
    for option in ("--channels", "--unit"):
        ways += [[option, value] for value in re.findall(rf"{option} ([^\s;)]+)", words)]
    part = [arg for pair in re.findall(r"(--from|--to) (\d[\d.]*)", words) for arg in pair]
    return ways + ([part] if part else [])


@pytest.mark.parametrize(("fault", "unit", "code", "wanted"), CASES, ids=[c[2] for c in CASES])
def test_every_way_out_that_is_printed_ends_the_finding(
    fault: Callable[[Rng], Samples], unit: str, code: str, wanted: str, rng: Rng, run: Run, tmp_path: Path
) -> None:
    log = written(tmp_path / "log.csv", fault(rng), unit)
    shown = run("info", str(log))
    ways = options_in(advised(shown.out, code))
    for option in wanted.split("|"):
        assert any(" ".join(way).startswith(option) or option in way for way in ways), (option, shown.out)
    for way in ways:
        done = run("info", str(log), "--json", *way)
        assert done.code in (0, 3), done.err
        left = {f["code"] for f in json.loads(done.out)["findings"] if f["severity"] != "info"}
        assert code not in left, (way, left)


def test_every_repair_is_tried_here_or_needs_a_second_fact() -> None:
    tried = {word.split()[-1] for *_, wanted in CASES for word in wanted.split("|") if "--repair" in word}
    assert set(REPAIRS) - tried == {
        "drop_duplicate_rows",
        "keep_run",
        "swap",
    }  # of stamps, of names: test_cleaning


# -- findings whose advice is a command, or an option with what the user knows ------------------------------


def a_step_back(rng: Rng) -> str:
    t = np.arange(N) / 100
    t[2000:] -= 3
    return table_of(t, at_rest(rng), "deg/s")


def stamps_twice(rng: Rng) -> str:
    rows = np.sort(np.r_[np.arange(N), [100, 200, 300]])
    return table_of(rows / 100, at_rest(rng)[rows], "deg/s")


def marks_behind_numbers(rng: Rng) -> str:
    head, *lines = table_of(np.arange(N) / 100, at_rest(rng), "deg/s").splitlines()
    return "\n".join([head, *(f"{line}*" for line in lines), ""])


def lost_at_random(rng: Rng) -> str:
    keep = rng.random(N) > 0.02
    return table_of(np.arange(N)[keep] / 100, at_rest(rng)[keep], "deg/s")


def ends_of_the_word(rng: Rng) -> str:
    y = np.round(at_rest(rng) * 1000)
    y[:, 0] = np.clip(np.round(rng.normal(20_000, 9000, N)), -32768, 32767)
    return table_of(np.arange(N) / 100, y, "LSB")


def turned_slowly(rng: Rng) -> str:
    y = 0.02 * rng.standard_normal((N, 3))
    angle = 0.4 * np.clip((np.arange(N) - 2500) / 1000, 0, 1)
    y[:, 0] += 9.8 * np.sin(angle)
    y[:, 2] += 9.8 * np.cos(angle)
    return table_of(np.arange(N) / 100, y, "m/s^2", "a")


def noisier_by_half(rng: Rng) -> str:
    y = rng.standard_normal((4 * N, 1)) * 0.05
    y[2 * N :] *= 1.4
    return table_of(np.arange(4 * N) / 100, y, "deg/s")


def whole_numbers(rng: Rng) -> str:
    return table_of(np.arange(N) / 100, np.round(rng.normal(30, 40, (N, 3))), "", "gyro_")


def a_wrong_unit(rng: Rng) -> str:
    return table_of(np.arange(N) / 100, rng.normal(300, 60, (N, 3)), "deg/s", "gyro_")


def a_line_that_wanders(rng: Rng) -> str:
    t = np.arange(4 * N) / 100
    wave = 0.03 * np.sin(2 * np.pi * np.cumsum(3 + 1.5 * np.sin(t / 7)) / 100)
    return table_of(t, (0.05 * rng.standard_normal(len(t)) + wave)[:, None], "deg/s")


def table_of(t: np.ndarray, y: Samples, unit: str, stem: str = "u") -> str:
    unit = f" [{unit}]" if unit else ""
    head = ",".join(["t [s]", *(f"{stem}{k}{unit}" for k in range(y.shape[1]))])
    return "\n".join([head, *(",".join(f"{v:.9g}" for v in row) for row in np.column_stack([t, y])), ""])


def batches_of_five_and_six(rng: Rng) -> str:
    """A sensor of 1250 Hz whose logger takes five samples together, and sometimes six."""
    t = np.cumsum(rng.choice([4.0e-3, 4.8e-3], N, p=[0.93, 0.07]))
    return table_of(t, 0.05 * rng.standard_normal((N, 1)), "deg/s")


RUNS: list[tuple[Callable[[Rng], str], str, list[str], list[list[str]]]] = [
    # what is in the file, its finding, words that its advice must hold, what the user adds to its options
    (a_step_back, "time_stamps", ["--rate"], [["--rate", "100"]]),
    (batches_of_five_and_six, "off_grid", ["--rate"], []),
    (stamps_twice, "duplicate_stamps", ["--repair drop_duplicate_rows"], []),
    (marks_behind_numbers, "cell_suffix", ["--unit"], [["--unit", "u2=deg/s"]]),
    (lost_at_random, "missing", ["allanite characterize LOG --method likelihood"], []),
    (ends_of_the_word, "saturated", ["--repair drop_saturated"], []),
    (turned_slowly, "motion", ["--to", "--repair cut_motion"], []),
    (noisier_by_half, "noise_changes", ["allanite variation LOG", "--from, --to"], [["--to", "75"]]),
    (whole_numbers, "raw_counts", ["--scale-factor"], []),
    (a_wrong_unit, "unit_trap", ["--unit", "--scale-factor"], []),
    (a_line_that_wanders, "lag_and_frequency_disagree", ["allanite fit LOG --method spectral"], []),
]
#: Advice with an option that is carried out elsewhere.
ELSEWHERE = {
    "rows_of_means": "test_position_rows.py",
    "warm_up": "stability/test_environment.py",
    "coarse_stamps": "files/test_readers_kinds.py",
}


#: Findings of which each channel has an advice of its own, and what is true of the text of the file however it is read.
SINGLE = {"unit_trap": ("gyro_0", "gyro_1", "gyro_2")}
STAYS = {"cell_suffix"}


def ways_of(words: str) -> list[list[str]]:
    """The options of an advice, as a shell reads them; those of one sentence that belong together, together."""
    ways = [way for way in options_in(words) if way[0] != "--unit" or "=" in way[1]]
    for factor in re.findall(r"--scale-factor '([^']*)'", words):
        counts = ["--unit", f"{factor.partition('=')[0]}=LSB"]
        ways.append([*(counts if counts in ways else []), "--scale-factor", factor])
    return [way for way in ways if len(way) > 2 or not way[1].endswith("=LSB")]


@pytest.mark.parametrize(("made", "code", "wanted", "known"), RUNS, ids=[r[1] for r in RUNS])
def test_every_advice_that_is_printed_runs(
    made: Callable[[Rng], str], code: str, wanted: list[str], known: list[list[str]], run: Run, tmp_path: Path
) -> None:
    """Its options end the finding, its commands end well."""
    log = tmp_path / "log.csv"
    log.write_text(made(np.random.default_rng(2)), encoding="utf-8")
    study = code in ("lag_and_frequency_disagree",)
    shown = run(
        *(
            ["characterize", str(log), "--out", str(tmp_path / "out"), "--details"]
            if study
            else ["info", str(log)]
        )
    )
    words = advised(shown.out, code)
    assert words and all(w in words for w in wanted), (words, shown.out)
    for line in re.findall(r"allanite (\w+) LOG((?: --[a-z]+ [a-z]+)*)", words):
        done = run(line[0], str(log), *line[1].split(), "--json")
        assert done.code in (0, 3), (line, done.err)
    for way in [*ways_of(words), *known]:
        done = run("info", str(log), "--json", *way)
        assert done.code in (0, 3), (way, done.err)
        channel = way[1].partition("=")[0]  # an option of one channel is for the finding of this one
        found = [f for f in json.loads(done.out)["findings"] if f["code"] == code and f["severity"] != "info"]
        left = [f for f in found if channel not in SINGLE.get(code, ()) or f["channel"] == channel]
        assert not left or code in STAYS, (way, left)


def test_every_finding_whose_advice_can_be_carried_out_is_tried() -> None:
    able = {
        code
        for code, entry in CATALOGUE.items()
        if entry.severity != "info"  # no advice is printed of mere information
        and (entry.repair or "--" in entry.advice or re.search(r"allanite \w", entry.advice))
    }
    tried = {case[2] for case in CASES} | {r[1] for r in RUNS}
    assert able <= tried | set(ELSEWHERE), able - tried - set(ELSEWHERE)
    assert not tried & set(ELSEWHERE)
    for code, name in ELSEWHERE.items():
        option = re.findall(r"--[a-z-]+", CATALOGUE[code].advice)[0]
        assert option in (Path(__file__).parent / name).read_text(encoding="utf-8"), code


@pytest.mark.parametrize("fault", [zeros, held, moved, frozen])
def test_a_refusal_names_ways_that_run(
    fault: Callable[[Rng], Samples], rng: Rng, run: Run, tmp_path: Path
) -> None:
    y = fault(rng)
    y[1000:1050] = 9.9e37
    log = written(tmp_path / "log.csv", y, UNIT)
    refused = run("characterize", str(log), "--json")
    assert refused.code == 1
    accepted = re.findall(r"--accept (\w+)", refused.err)
    assert accepted
    done = run(
        "info", str(log), "--json", *[a for way in options_in(refused.err) for a in way if "--repair" in way]
    )
    assert done.code in (0, 3)
    assert not [f for f in json.loads(done.out)["findings"] if f["severity"] == "fatal"]


HEADS = [
    ("wx", "wy", "wz", "ax", "ay", "az"),
    ("X", "Y", "Z"),
    ("gyro x, body", "gyro y, body", "gyro z, body"),
    ("rot's 1", "rot's 2", "rot's 3", "boardtmp"),
    ("k=1", "p", "omega;z", "a1"),
    ("gyro x [LSB]", "gyro y [LSB]", "gyro z [LSB]", "a_x [V]", "a_y [V]", "a_z [V]", "boardtemp [LSB]"),
]


def options_copied(words: str, *names: str) -> list[str]:
    """The options of these names in a text, as a shell reads them."""
    found = re.findall(rf"({'|'.join(names)}) ('(?:[^']|'\"'\"')*'|[^\s;)]+)", words)
    return [word for option, value in found for word in (option, *shlex.split(value))]


@pytest.mark.parametrize("heads", HEADS, ids=lambda h: h[0])
@pytest.mark.parametrize(
    ("command", "refusal"),
    [(["earth-rate", "--latitude", "47"], "no channel of rates"), (["calibrate"], "neither three")],
)
def test_units_that_a_refusal_asks_for_are_understood(
    heads: tuple[str, ...], command: list[str], refusal: str, rng: Rng, run: Run, tmp_path: Path
) -> None:
    """Copied, its options end the refusal, and leave no channel without a unit."""
    log = tmp_path / "log.csv"
    rows = ([f"{k / 100:.2f}", *(f"{v:.0f}" for v in rng.normal(0, 90, len(heads)))] for k in range(500))
    quoted = (f'"{head}"' for head in ("time [s]", *heads))
    log.write_text("\n".join(map(",".join, (quoted, *rows))) + "\n", encoding="utf-8")
    refused = run(command[0], str(log), *command[1:])
    assert refused.code == 1 and refusal in refused.err
    way = options_copied(refused.err, "--unit", "--scale-factor")
    assert way, refused.err
    again = run(command[0], str(log), *command[1:], *way)
    assert refusal not in again.err and "no such channel" not in again.err and again.code != 2
    told = run("info", str(log), "--json", *way)
    channels = {c["name"]: c["kind"] for c in json.loads(told.out)["channels"]}
    assert "unknown" not in channels.values()
    assert {k for n, k in channels.items() if "temp" in n or "tmp" in n} <= {"temperature", "counts"}


def test_names_of_axes_that_a_refusal_offers_are_taken(rng: Rng, run: Run, tmp_path: Path) -> None:
    """Counts calibrate without a scale factor, by the names of the axes."""
    log = written(tmp_path / "log.csv", at_rest(rng), "LSB")
    refused = run("calibrate", str(log))
    way = options_copied(refused.err, "--gyro", "--accelerometer")
    assert way[0] == "--gyro" and "neither three" not in run("calibrate", str(log), *way).err


# -- every sentence of the package ------------------------------------------------------------------------


@cache
def sentences() -> tuple[tuple[str, str], ...]:
    """The texts of the package that hold an option, with the place of each."""
    return tuple(sentences_of_modules())


def sentences_of_modules() -> Iterator[tuple[str, str]]:
    """Place and text of each."""
    for path in sorted(PACKAGE.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        if not re.search(r"(?<![\w-])--[a-z]", source):
            continue
        tree = ast.parse(source)
        if ast.get_docstring(tree) is not None:
            del tree.body[0]
        for node in ast.walk(tree):
            if isinstance(node, ast.JoinedStr):
                text = "".join(str(v.value) if isinstance(v, ast.Constant) else "{}" for v in node.values)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                text = node.value
            else:
                continue
            if " --" in f" {text}" and re.search(r"(?<![\w-])--[a-z]", text):
                yield f"{path.relative_to(PACKAGE)}:{node.lineno}", text


def test_options_in_sentences_exist() -> None:
    of_program = {option for parameter in cli.params for option in parameter.opts}
    every = of_program.union(*OPTIONS.values()) | {"--now"}  # the last one is systemctl's
    for place, text in sentences():
        for option in re.findall(r"(?<![\w-])(--[a-z][a-z-]*[a-z])(?![\w{-])", text):
            assert option in every, f"{place}: {option} in {text!r}"


def test_commands_in_sentences_have_their_options() -> None:
    names = "|".join(sorted(COMMANDS, key=len, reverse=True))
    for place, text in sentences():
        for name, rest in re.findall(rf"allanite ({names})\b([^`;:]*)", text):
            for option, value in re.findall(r"(?<![\w-])(--[a-z][a-z-]*[a-z])(?:[ =]([a-z]+)\b)?", rest):
                assert option in OPTIONS[name], f"{place}: {name} has no {option}: {text!r}"
                wrong = value and option in CHOICES[name] and value not in CHOICES[name][option]
                assert not wrong, f"{place}: {name} {option} does not take {value}: {text!r}"


def test_methods_in_the_catalogue_belong_to_a_command() -> None:
    for code, entry in CATALOGUE.items():
        for words in (entry.advice, entry.done):
            if "--method" in words:
                assert re.search(r"allanite (fit|characterize) LOG --method \w+", words), code
            assert "--accept" not in words
            assert shlex.split(words.replace("'", "")), code


# -- advice of the library, which does not know of options ------------------------------------------------


@cache
def advice_in_arguments() -> tuple[tuple[str, str], ...]:
    """Errors that the library raises, which name one of its arguments and no option."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(source)) if "raise " in source else ():
            if not isinstance(node, ast.Raise) or node.exc is None:
                continue
            parts = [c.value for c in ast.walk(node.exc) if isinstance(c, ast.Constant)]
            words = " ".join(part for part in parts if isinstance(part, str))
            if re.search(r"(?<![\w-])[a-z_]+=(?:'|\W|$)", words) and "--" not in words:
                found.append((f"{path.relative_to(PACKAGE)}:{node.lineno}", words))
    return tuple(found)


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_argument_that_is_an_option_of_the_command_is_said_as_one(name: str) -> None:
    """Whatever error a command passes on: no argument of Python is left that the command has as an option."""
    command = COMMANDS[name]
    options = {p.name: max(p.opts, key=len) for p in command.params if max(p.opts, key=len).startswith("--")}
    for place, words in advice_in_arguments():
        said = in_options(words, command)
        for argument in re.findall(r"(?<![\w(-])([a-z_]+)=(?:'[^' ]+'|\d+)?(?=[\s;:,)]|\.\s|$)", said):
            assert options.get(argument) in (None, *re.findall(r"--[a-z-]+", words)), (place, said)
    for argument, option in options.items():
        assert in_options(f"give {argument}='x', please", command) == f"give {option} x, please"
        assert in_options(f"give {argument}=.", command) == f"give {option}."
        assert in_options(f"give {option} ({argument}=)", command) == f"give {option} ({argument}=)"
        assert in_options(f"the file x{argument}=3.csv", command) == f"the file x{argument}=3.csv"


def test_advice_of_an_exporter_runs(run: Run, tmp_path: Path) -> None:
    """Flicker without a correlation time: each way that the refusal offers, copied, writes the file."""
    model = tmp_path / "model.json"
    made = run(
        "simulate", "N=0.3 deg/√h, B=5 deg/h", "--rate", "10", "--duration", "600", "-o", tmp_path / "x.npz"
    )
    assert made.code == 0, made.err
    fitted = run("fit", str(tmp_path / "x.npz"), "--method", "likelihood", "--terms", "NBK", "--json")
    assert fitted.code == 0, fitted.err
    model.write_text(fitted.out, encoding="utf-8")
    for consumer in ("kf-gins", "gazebo", "psins", "navego"):
        refused = run("export", consumer, str(model), "--rate", "10", "-o", tmp_path / "file")
        assert refused.code == 1 and "needs the correlation time" in refused.err
        ways = re.findall(r"--[a-z-]+(?: (?!\()[^\s,]+)?", refused.err)
        assert ways == ["--correlation-time", "--walk upper-bound"], refused.err
        for k, way in enumerate(("--correlation-time 240s", ways[1])):
            done = run(
                "export",
                consumer,
                str(model),
                "--rate",
                "10",
                "-o",
                tmp_path / f"f{k}",
                "--force",
                *way.split(),
            )
            assert done.code == 0, (way, done.err)
