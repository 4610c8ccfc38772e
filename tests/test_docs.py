# SPDX-License-Identifier: BSD-3-Clause
"""Every command and every Python block of the documents runs, page by page, in an empty folder.

What a page tells to do is read by `document_steps`, whose docstring lists the comments that steer the test.

The pages in `GENERATED` and the pictures of the gallery are written by this file: ``make docs`` brings them up to date.
"""

from __future__ import annotations

import importlib
import inspect
import os
import re
import shlex
import shutil
import typing
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest
from verification.findings import look_alikes_page
from verification.proof import proof_page

from allanite.quantities.result import Result, entries_of
from allanite.recording.health.catalogue import findings_page
from consumers import MARKOVS, WALKERS, WHITES
from document_steps import PAGES, ROOT, Step, shown, steps
from shell import Run
from which_number import which_number_page


def assert_command_runs(step: Step, where: str, run: Run) -> None:
    program, *words = shlex.split(step.command, comments=True)
    assert program == "allanite", (
        f"{where}: only allanite itself is run here; put a skip comment before the block"
    )
    done = run(*words)
    report = f"{where}: $ {step.command}\n{done.out}\n{done.err}"
    assert done.code == step.code, report
    for wanted in step.output:
        assert shown(wanted, done.out + done.err), f"{report}\ndoes not contain: {wanted}"


def assert_python_runs(step: Step, page: Path, names: dict[str, object]) -> None:
    # Empty lines put the block on its own line numbers, so that a traceback points into the page.
    exec(compile("\n" * step.line + step.python, str(page), "exec"), names)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_page_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Run) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setenv("NO_COLOR", "1")
    names: dict[str, object] = {"__name__": "__main__"}
    for step in steps(page):
        if step.file:
            Path(step.file).write_text(step.content, encoding="utf-8")
        elif step.command:
            assert_command_runs(step, f"{page.name}:{step.line}", run)
        else:
            assert_python_runs(step, page, names)
    if page.name == "gallery.md":
        for picture in re.findall(r"\]\((images/[^)]+)\)", page.read_text(encoding="utf-8")):
            assert_picture_was_saved(page.parent / picture, tmp_path)


def assert_picture_was_saved(picture: Path, folder: Path) -> None:
    """A picture of the gallery is one that the lines of its page have saved; ``make docs`` keeps it."""
    assert (folder / picture.name).exists(), f"no line saves {picture.name}"
    if os.environ.get("ALLANITE_WRITE_DOCS"):
        picture.parent.mkdir(exist_ok=True)
        shutil.copyfile(folder / picture.name, picture)


def test_the_reader_of_pages_sees_commands_output_and_comments(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "<!-- run: allanite a -->\n```console\n$ allanite b \\\n    --c\nout … 1\n$ allanite d\n```\n"
        "<!-- skip: slow -->\n```console\n$ make demo\n```\n```python\nx = 1\n```\n"
        "<!-- exit: 1 -->\n```console\n$ allanite e\n```\n<!-- python:\ny = 2\n-->\n"
        "<!-- file: f.csv -->\n```text\n1,2\n```\n",
        encoding="utf-8",
    )
    *found, hidden, file = [
        (step.command.split(), step.output, step.python, step.code) for step in steps(page)
    ]
    assert hidden == ([], (), "y = 2", 0)
    assert file == ([], (), "", 0)
    assert (steps(page)[-1].file, steps(page)[-1].content) == ("f.csv", "1,2\n")
    assert found == [
        (["allanite", "a"], (), "", 0),
        (["allanite", "b", "--c"], ("out … 1",), "", 0),
        (["allanite", "d"], (), "", 0),
        ([], (), "x = 1\n", 0),
        (["allanite", "e"], (), "", 1),
    ]
    assert shown("out … 1", "a\nout  put   1\n")
    assert not shown("out … 1", "out\n1\n")


#: Pages that show the inside to those who change it.
INSIDE = ("CONTRIBUTING.md", "docs/contributing/", "docs/explanation/how-it-is-built.md")
PUBLIC_MODULES = ("allanite", "allanite.compat", "allanite.instruments")


def inner_names(text: str) -> Iterator[str]:
    """What a page, less the comments that no reader sees, names deeper than the public modules."""
    import allanite

    seen = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    for module, names in re.findall(r"^ *(?:from|import) (allanite[\w.]*)(?: import (.+))?$", seen, re.M):
        if module not in PUBLIC_MODULES:
            yield module
        elif names:
            public = set(importlib.import_module(module).__all__) | {"compat", "instruments"}
            yield from (
                f"{module}.{name}"
                for name in re.findall(r"\w+", names.partition(" as ")[0])
                if name not in public
            )
    rooms = "|".join(
        {home.partition(".")[0] for home in allanite._HOMES.values()} | {"acquisition", "commands"}
    )
    yield from re.findall(rf"\ballanite\.(?:{rooms})\b[\w.]*", seen)
    public = set(allanite.__all__)
    yield from (f"al.{name}" for name in re.findall(r"(?<![\w./-])al\.(\w+)", seen) if name not in public)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_page_uses_public_names_alone(page: Path) -> None:
    if not page.relative_to(ROOT).as_posix().startswith(INSIDE):
        found = sorted(set(inner_names(page.read_text(encoding="utf-8"))))
        assert not found, f"{page.name} uses {found}: make them public, or write the example without them"


def test_the_rule_of_public_names_sees_what_it_forbids() -> None:
    text = "from allanite.fitting.x import y\nimport allanite.noise\nfrom allanite import fit, _HOMES\n"
    text += "al.secret al.fit `allanite.views.pages` allanite.compat\n<!-- python:\nfrom allanite.files import z\n-->\n"
    assert set(inner_names(text)) == {
        "allanite.fitting.x", "allanite.noise", "allanite._HOMES", "al.secret", "allanite.views.pages"
    }  # fmt: skip


def command_reference() -> str:
    """docs/reference/cli.md: the help of every command, as it is shown."""
    from click.testing import CliRunner

    from allanite.commands.cli import cli
    from allanite.commands.cli.program import EXIT_CODES

    def shown_help(*arguments: str) -> str:
        shown = CliRunner().invoke(cli, [*arguments, "--help"], prog_name="allanite", terminal_width=100)
        return f"```text\n{shown.output.rstrip()}\n```\n"

    head = """# Commands

Made from the program's own help by `make docs`. Results go to stdout, everything else to stderr; `-` stands for stdin
or stdout.

| exit code | meaning | |
| --- | --- | --- |
"""
    for code, (means, more) in EXIT_CODES.items():
        escaped = more.replace("|", "\\|")
        head += f"| {code} | {means} | {escaped} |\n"
    names = [
        words
        for name, found in cli.commands.items()
        for words in ((name,), *((name, inner) for inner in getattr(found, "commands", ())))
    ]
    parts = [head, shown_help(), *(f"## {' '.join(words)}\n\n{shown_help(*words)}" for words in names)]
    return "\n".join(parts)


def signature(function: Callable[..., object]) -> str:
    """One parameter a line."""
    found = inspect.signature(function)
    first = next((i for i, p in enumerate(found.parameters.values()) if p.kind is p.KEYWORD_ONLY), None)
    parts = [re.sub(r": '(.*?)'(?= =|$)", r": \1", str(p)) for p in found.parameters.values()]
    if first is not None:
        parts.insert(first, "*")
    listed = "".join(f"    {part},\n" for part in parts)
    return f"{function.__name__}(\n{listed}) -> {found.return_annotation}"


#: Rooms of the package, in the words of the table of public names.
TOPICS = {
    "files": "files",
    "recording": "recordings",
    "noise": "noise",
    "study": "studies, models, data sheets",
    "fitting": "fitting",
    "stability": "several sensors or records, temperature",
    "experiments": "experiments",
    "filtering": "filter and simulation",
    "exporters": "export",
    "views": "reports and figures",
    "quantities": "units and uncertainties",
    "commands": "many logs",
    "errors": "errors",
}


def described(name: str, thing: object) -> list[str]:
    """Name, first sentence, and signature or methods of a public name."""
    first = " ".join((inspect.getdoc(thing) or "").split("\n\n")[0].split())
    lines = ["", f"## {name}", "", first, ""]
    if inspect.isfunction(thing):
        return [*lines, "```text", signature(thing), "```"]
    for key, member in vars(thing).items():
        if not key.startswith("_") and callable(getattr(thing, key)) and inspect.getdoc(member):
            function = getattr(member, "__func__", member)
            sentence = (inspect.getdoc(function) or "").split("\n\n")[0]
            lines.append(f"* `{key}`: {' '.join(sentence.split())}")
    return lines if lines[-1] else lines[:-1]


def python_reference() -> str:
    """docs/reference/python.md: the public names with signature and first sentence."""
    import allanite
    from allanite import compat, instruments

    def linked(names: Iterable[str]) -> str:
        return " · ".join(f"[`{n}`](#{n.lower()})" for n in sorted(names, key=str.lower))

    lines = [
        "# Python",
        "",
        "The public names of `import allanite as al`, and below them those of `allanite.instruments` and",
        "`allanite.compat`, made from their docstrings by `make docs`; `help(al.fit)` shows all of one.",
        "[What is public, and for how long](public.md). [Conventions](../explanation/conventions.md).",
        "",
        "| for | names |",
        "|---|---|",
    ]
    rooms = [home.partition(".")[0] for home in allanite._HOMES.values()]
    assert set(rooms) == set(TOPICS)
    for room, topic in TOPICS.items():
        own = (name for name, at in zip(allanite._HOMES, rooms, strict=True) if at == room)
        lines.append(f"| {topic} | {linked(own)} |")
    for module, short in ((instruments, "instruments"), (compat, "compat")):
        own = " · ".join(
            f"[`{name}`](#{short}{name.lower()})" for name in sorted(module.__all__, key=str.lower)
        )
        lines.append(f"| `allanite.{short}` | {own} |")
    for module, before in ((allanite, ""), (instruments, "instruments."), (compat, "compat.")):
        for name in sorted(set(module.__all__) - {"__version__"}, key=str.lower):
            lines += described(f"{before}{name}", getattr(module, name))
    return "\n".join(lines) + "\n"


def exports_reference() -> str:
    """docs/reference/exports.md: what `allanite export --list` shows, with the file and the options of each."""
    from allanite.exporters import exporter, options_of
    from allanite.exporters.imu import NoiseOptions
    from allanite.views.terminal.exporting import consumer_rows

    shared = list(NoiseOptions.__annotations__)
    lines = [
        "# Exports",
        "",
        "The consumers of `allanite export --list`, made by `make docs`; [how to choose](../howto/export.md);",
        "[which number goes where](which-number-goes-where.md).",
        "Options are those of `al.export` (`--filter-rate` of the command is `filter_rate`). *Noise* stands for",
        f"{', '.join(f'`{o}`' for o in shared)}.",
        "",
        "| consumer | takes | file | options | what it gets |",
        "|---|---|---|---|---|",
    ]
    for name, takes, summary in consumer_rows():
        module = exporter(name)
        options = options_of(module)
        whole = set(shared) <= {*options}
        own = ", ".join(["*noise*"] * whole + [f"`{o}`" for o in options if not (whole and o in shared)])
        file = ", ".join(f"`{f}`" for f in module.FILE_NAME.split(", "))
        lines.append(f"| `{name}` | {takes} | {file} | {own} | {summary} |")
    return "\n".join(lines) + "\n"


def documents_page() -> str:
    """The documents of results that have a view, by the docstrings of their classes."""
    from allanite.study.result_document import Origin
    from allanite.views.registry import VIEWS, kind_of

    about = (
        "What `--json` prints and `--out` leaves of these results, key by key, in SI units; a number that does not "
        "exist is null. Beside the keys of the result stand those of its [origin](#origin). Documents of an earlier "
        "version are read. Other documents: [study-format](study-format.md)."
    )
    lines = ["# Documents of results", "", about, ""]
    listed: list[type[Result]] = []
    for name in VIEWS:
        listed += [kind for kind in parts_of(kind_of({"format": name})) if kind not in listed]
    for kind in [*listed, *parts_of(Origin)]:
        heading = f"{kind.FORMAT}, version {kind.VERSION}" if kind.FORMAT else kind.__name__
        lines += [f"## {heading}", "", f"{inspect.getdoc(kind).partition(chr(10))[0]}", ""]  # type: ignore[union-attr]
        lines += ["| key | | unit | |", "|---|---|---|---|"]
        lines += [f"| `{e.name}` | {e.type} | {e.unit} | {e.meaning} |" for e in entries_of(kind)]
        lines += [""]
    return "\n".join(lines)


def fleet_table_page() -> str:
    """docs/reference/fleet-table.md: the columns of the table of a fleet."""
    from allanite.commands.fleet.table import COLUMNS, LABEL_END

    lines = [
        "# The table of a fleet",
        "",
        "Columns of `fleet.parquet`, which [`allanite fleet run`](../howto/fleet.md) writes, in their order; made by",
        "`make docs`. One row for each log, channel and coefficient. A log that failed is one row, whose channel and",
        "term are null. A number that does not exist is null. Columns may be added; read them by name.",
        "",
        *STORED_AS.splitlines(),
        "",
        "| column | type | meaning |",
        "|---|---|---|",
    ]
    for column in COLUMNS:
        lines.append(f"| `{column.name}` | {ARROW_NAMES.get(column.type, column.type)} | {column.meaning} |")
        if column.name == LABEL_END:
            lines.append(
                "| … | string or double | Every other placeholder of the pattern and column of the metadata |"
            )
    return "\n".join(lines) + "\n" + PROFILE_OF_A_ROW


STORED_AS = """\
`fleet.parquet` is a folder of Parquet files of one schema, such as `003-of-008.parquet`; pandas, polars, DuckDB and
pyarrow read it by its name. Their number is a power of two, 1 up to 500 logs, 256 at most. All rows of a log are in one
file, which the CRC-32 of its name determines; inside a file rows are sorted by log. A run writes only the files whose
logs or labels changed. Each file is replaced as a whole, and the whole folder if the number of files changes: a reader
never sees a part of a log. A table that is one file is read as well; the next run makes a folder of it."""

#: What a table calls the types of its columns.
ARROW_NAMES = {
    "float64": "double", "float32": "float", "timestamp": "timestamp (µs)", "strings": "list of string",
    "levels": "list of 9 float",
}  # fmt: skip
PROFILE_OF_A_ROW = """
## The profile

`profile` says all that a record knows of a coefficient, not only an estimate and its interval. The loss at a value is
how much worse the fit gets with the coefficient held there and all others free: minus twice the logarithm of the
likelihood ratio. Its signed root, negative below the best value, is a straight line for a normal estimate. The nine
numbers are where the root takes the values −4, −2.5, −1.5, −0.75, 0, 0.75, 1.5, 2.5 and 4, as the natural logarithm
of the coefficient; ±1.96 stands for 95 %.

An upper limit has −inf for the first five, and a root of 0 at zero. Between the levels a monotone cubic restores the
root within 2 % of it, or 0.02: x against the root where zero is excluded beyond all levels, else x against ln(root −
root at zero), which goes on as a straight line below the lowest level.

Profiles are those of the flicker family (Q, N, B, K, R) for every log, so that all units speak of the same
coefficients; estimates and intervals are those of the study, which may prefer a Gauss-Markov term.
"""


def parts_of(kind: type[Result]) -> list[type[Result]]:
    """A result and the results that it is made of, each once."""
    found = [kind]
    stated = (typing.get_type_hints(getattr(kind, name).fget)["return"] for name in kind.STATED)
    for hint in (*typing.get_type_hints(kind).values(), *stated):
        for inner in (hint, *typing.get_args(hint)):
            if isinstance(inner, type) and issubclass(inner, Result):
                found += [part for part in parts_of(inner) if part not in found]
    return found


GENERATED = {
    "docs/reference/documents.md": documents_page,
    "docs/reference/cli.md": command_reference,
    "docs/reference/exports.md": exports_reference,
    "docs/reference/which-number-goes-where.md": which_number_page,
    "docs/reference/findings.md": findings_page,
    "docs/reference/fleet-table.md": fleet_table_page,
    "docs/reference/look-alikes.md": look_alikes_page,
    "docs/reference/python.md": python_reference,
    "docs/proof.md": proof_page,
}


def test_thirty_programs_are_told_which_number_goes_where() -> None:
    """Every file of noise says so, and every one of them has a step of the consumer in the tests."""
    from allanite.exporters import EXPORTERS, exporter

    files = [name for name in EXPORTERS if hasattr(exporter(name), "USAGE")]
    assert set(EXPORTERS) - set(files) == {"imu_tk", "cpp"}
    assert set(files) == {*WALKERS, *MARKOVS, *WHITES, "matlab"}
    programs = [program.name for name in files for program in exporter(name).USAGE.programs]
    assert len(set(programs)) == len(programs) >= 30


@pytest.mark.parametrize("page", GENERATED)
def test_generated_page_is_up_to_date(page: str) -> None:
    wanted = GENERATED[page]()
    if os.environ.get("ALLANITE_WRITE_DOCS"):
        (ROOT / page).write_text(wanted, encoding="utf-8")
    # Blanks are left out: they differ between versions of the library that wraps the help.
    assert (ROOT / page).read_text(encoding="utf-8").split() == wanted.split(), "out of date: make docs"


def test_units_of_the_reference_are_understood_and_alike() -> None:
    from allanite.quantities.units import parse_unit

    page = (ROOT / "docs" / "reference" / "units.md").read_text(encoding="utf-8")
    rows = [row.split("|")[1:4] for row in re.findall(r"^\| .* \|$", page, re.M) if row.count("|") == 4]
    rows = [row for row in rows if row[1].strip() not in ("", "SI unit") and "," not in row[0]]
    assert len(rows) == 13
    for name, si, others in rows:
        canonical = parse_unit(si.strip())
        assert canonical.factor == 1.0, si
        for text in others.split(","):
            assert parse_unit(text.strip()).quantity is canonical.quantity, f"{text} is not a unit of {name}"


def keys(value: object) -> Iterator[str]:
    """Every key of a document, those of free-form parts left out."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield key
            if key not in ("history", "slopes", "terms"):
                yield from keys(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from keys(inner)


def test_the_reference_names_every_key_of_a_study(rng: np.random.Generator) -> None:
    import allanite as al

    y = rng.standard_normal(6000) + 3 * np.sin(2 * np.pi * 0.1 * np.arange(6000))
    y[2000:2100] = np.nan
    study = al.characterize(al.Recording.from_rate(y, rate=1.0, unit="deg/h", names=["gyro"]))
    pages = [ROOT / "docs" / "reference" / name for name in ("study-format.md", "documents.md")]
    described = "".join(page.read_text(encoding="utf-8") for page in pages)
    unnamed = sorted({key for key in keys(study.to_json()) if f"`{key}`" not in described})
    assert not unnamed, f"neither study-format.md nor documents.md says what {unnamed} are"


def test_what_the_data_can_tell_says_the_numbers_of_its_script() -> None:
    import importlib.util
    import json

    script = ROOT / "verification" / "what_the_data_can_tell.py"
    if not script.exists():
        pytest.skip("the verification scripts are not in the source package")
    spec = importlib.util.spec_from_file_location("what_the_data_can_tell", script)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    page = (ROOT / "docs" / "explanation" / "what-the-data-can-tell.md").read_text(encoding="utf-8")
    said = module.quotes(json.loads(module.RESULT.read_text(encoding="utf-8")))
    unsaid = [text for text in said if " ".join(text.split()) not in " ".join(page.split())]
    assert not unsaid, f"docs/explanation/what-the-data-can-tell.md does not say {unsaid}"
    rows = re.findall(r"^\| .*[0-9] ?%? \|$", page, re.M)
    assert len(rows) > 20 and not set(rows) - set(said), "a row of numbers that the script does not make"


def test_the_reference_names_every_key_of_documents() -> None:
    import math

    import allanite as al
    from allanite.experiments.earth_rate import measure_earth_rate
    from allanite.experiments.north import Rotation, find_north
    from allanite.experiments.planning import plan
    from allanite.experiments.reference_aided import reference_aided
    from allanite.filtering.kalman import filter_recording
    from allanite.filtering.simulation import Motion
    from allanite_seed_paper import twin as seed_paper

    model, latitude = seed_paper.sensor(), seed_paper.LATITUDE
    take, spin = seed_paper.take(2, seed=1), math.radians(6.0)
    table = al.simulate(
        model, rate=8.0, duration=600.0, seed=1, unit="deg/s", motion=Motion.rotation(spin), latitude=latitude
    )
    described = (ROOT / "docs" / "reference" / "documents.md").read_text(encoding="utf-8")
    results = [
        measure_earth_rate(take, model=model, latitude=latitude),
        find_north(table, model=model, latitude=latitude, rotation=Rotation(rate=spin)),
        plan(model, latitude=latitude, dwells=[30.0], durations=[600.0]),
        filter_recording(table, model).result,
        reference_aided(table, model, reference=0.0).result,
    ]
    keys = {key for result in results for key in result.to_json()} - {"format", "version"}
    assert not [key for key in keys if f"| `{key}` |" not in described]
