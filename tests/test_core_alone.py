# SPDX-License-Identifier: BSD-3-Clause
"""Without an extra, every line of the README runs, and what needs one says which."""

from __future__ import annotations

import ast
import re
import shlex
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path
from xml.etree import ElementTree

import pytest
from packaging.utils import canonicalize_name

from core_alone import CoreAlone, brought_by, project
from document_steps import ROOT, shown, steps

README = ROOT / "README.md"
#: Of those who develop allanite, and of clusters, whose machines install it by itself.
APART = {"all", "cluster", "dev", "docs", "test"}


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> CoreAlone:
    folder = tmp_path_factory.mktemp("core")
    made = CoreAlone(folder / "work", folder / "site")
    made.folder.mkdir()
    done = made.run(
        "simulate", "N=0.7 deg/√h", "--rate", "10", "--duration", "10min", "--unit", "deg/s", "-o", "gyro.csv"
    )
    assert done.returncode == 0, done.stderr
    return made


def test_the_extras_are_hidden_from_the_interpreter_and_from_its_children(core: CoreAlone) -> None:
    assert {"matplotlib", "starlette", "uvicorn", "h5py", "rosbags", "pandas", "pytest"} <= core.hidden
    assert not {"numpy", "scipy", "pyarrow", "click", "rich", "allanite"} & core.hidden
    code = (
        "import importlib.util, subprocess, sys\n"
        "print(importlib.util.find_spec('matplotlib'), importlib.util.find_spec('numpy').name)\n"
        "subprocess.run([sys.executable, '-c', 'import matplotlib'])\n"
    )
    done = core.python(code)
    assert done.stdout == "None numpy\n" and "No module named 'matplotlib'" in done.stderr


@pytest.mark.long
def test_the_readme_runs(tmp_path: Path) -> None:
    alone = CoreAlone(tmp_path / "work", tmp_path / "site")
    alone.folder.mkdir()
    told = steps(README)
    for step in (step for step in told if step.command):
        program, *words = shlex.split(step.command, comments=True)
        assert program == "allanite"
        done = alone.run(*words)
        assert done.returncode == step.code, done.stderr
        for wanted in step.output:
            assert shown(wanted, done.stdout + done.stderr), wanted
    blocks = [step.python for step in told if step.python]
    assert blocks
    done = alone.python("\n".join(blocks))
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("words", "extra"),
    [
        ("characterize gyro.csv --plot curve.png", "plot"),
        ("allan gyro.csv --plot curve.pdf", "plot"),
        ("demo --seed-paper --out demo", "plot"),
        ("serve . --no-browser", "page"),
        ("record 3458a --resource GPIB0::22::INSTR --rate 32 --out runs", "instruments"),
        ("record 3458a --resource prologix:///dev/ttyUSB0/22 --rate 32 --out runs", "instruments"),
        ("fleet run s3://bucket/*.csv --out fleet", "cluster"),
        ("fleet run gyro.csv --out fleet --scheduler tcp://127.0.0.1:9", "cluster"),
    ],
)
def test_a_command_says_which_extra_it_needs(core: CoreAlone, words: str, extra: str) -> None:
    done = core.run(*shlex.split(words))
    assert (done.returncode, done.stdout) == (1, "")
    assert re.fullmatch(
        rf'allanite: .* needs \w+, which is not installed: pip install "allanite\[{extra}\]".*\n', done.stderr
    )
    assert not (core.folder / "demo").exists(), "nothing was done"


def test_a_figure_as_svg_needs_no_extra(core: CoreAlone) -> None:
    for command in ("allan", "characterize"):
        done = core.run(command, "gyro.csv", "--plot", f"{command}.svg")
        assert done.returncode == 0, done.stderr
        assert ElementTree.parse(core.folder / f"{command}.svg").getroot().tag.endswith("}svg")


def test_plot_says_which_extra_it_needs_and_draws_on_screen_without_it(core: CoreAlone) -> None:
    code = (
        "import allanite as al\n"
        "curve = al.allan_curve(al.read('gyro.csv'))\n"
        "al.plot(curve, interactive=True).save('curve.html')\n"
        "try:\n"
        "    al.plot(curve)\n"
        "except al.InputError as error:\n"
        "    print(error)\n"
    )
    done = core.python(code)
    assert done.returncode == 0, done.stderr
    assert 'pip install "allanite[plot]", or draw it with interactive=True' in done.stdout
    assert (core.folder / "curve.html").stat().st_size > 10_000


# -- what the sources and the documents say of extras ---------------------------------------------------------


def requirements_in_the_sources() -> Iterator[tuple[str, str]]:
    """Package and extra of each place that asks for one."""
    for folder in ("src", "examples"):
        for path in (ROOT / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "require":
                    package, extra = (ast.literal_eval(argument) for argument in node.args[:2])
                    yield package, extra


@pytest.mark.long
def test_the_extra_that_is_named_brings_the_package() -> None:
    asked = set(requirements_in_the_sources())
    extras, installed = project()["optional-dependencies"], packages_distributions()
    for package, extra in asked:
        distributions = {canonicalize_name(name) for name in installed[package]}
        assert distributions & brought_by(extras[extra]), f"{extra} does not bring {package}"
    assert {extra for _, extra in asked} == {*extras} - APART | {"cluster"}


def test_all_is_every_extra_of_one_machine() -> None:
    extras = project()["optional-dependencies"]
    assert brought_by(extras["all"]) == brought_by(f"allanite[{name}]" for name in {*extras} - APART)


def test_the_guide_names_every_extra_with_what_it_brings() -> None:
    text = (ROOT / "docs" / "howto" / "install.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \| ([^|]*)\|", text, re.M))
    extras = project()["optional-dependencies"]
    assert rows.keys() == {*extras} - {"dev", "docs", "test"}
    for name in rows.keys() - {"all"}:
        brought = {re.split(r"[>=]", words)[0] for words in extras[name]}
        assert {word.strip() for word in rows[name].split(",")} == brought
