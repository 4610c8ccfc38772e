# SPDX-License-Identifier: BSD-3-Clause
"""The recipes of CONTRIBUTING.md, carried out: a toy analysis, an option and a field in a copy of the package.

Each recipe names the places that it touches; the test touches no other, and finds the result at every door.
"""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite

TOY = Path(__file__).with_name("recipes")
PACKAGE = Path(allanite.__file__).parent
#: Three files, and one line of the registry.
ANALYSIS = {
    "stability/spread.py": TOY / "spread.py",
    "views/spread.py": TOY / "spread_view.py",
    "commands/spread.py": TOY / "spread_command.py",
}
REGISTRY = "views/registry.py"
LINE = """    "allanite-spread": Analysis(
        "allanite.stability.spread:Spread",
        "allanite.views.spread",
        "allanite.commands.spread:SPREAD",
    ),
"""
TRIM = "Share of the samples to trim at each end."


class Copy:
    """A copy of the package, and which of its files were changed since."""

    def __init__(self, folder: Path) -> None:
        self.package = folder / "allanite"
        shutil.copytree(PACKAGE, self.package)
        compiled = importlib.util.find_spec("allanite._kernels")
        assert compiled is not None and compiled.origin is not None
        shutil.copy(compiled.origin, self.package)
        self.touched: dict[str, int] = {}

    def new(self, file: str, source: Path) -> None:
        assert not (self.package / file).exists()
        shutil.copy(source, self.package / file)
        self.touched[file] = 0

    def put(self, file: str, before: str, lines: str) -> None:
        """Put lines before the one place of a text; counts places by file."""
        text = (self.package / file).read_text(encoding="utf-8")
        assert text.count(before) == 1, (file, before)
        (self.package / file).write_text(text.replace(before, lines + before), encoding="utf-8")
        self.touched[file] = self.touched.get(file, 0) + 1


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Copy:
    return Copy(tmp_path_factory.mktemp("recipes"))


def touched(copy: Copy, recipe: Callable[[Copy], None]) -> dict[str, int]:
    """Places that a recipe touches, by file; new files count none."""
    copy.touched.clear()
    recipe(copy)
    return dict(copy.touched)


def analysis(copy: Copy) -> None:
    for file, source in ANALYSIS.items():
        copy.new(file, source)
    copy.put(REGISTRY, '    "allanite-plan": ', LINE)


def file_format(copy: Copy) -> None:
    copy.new("files/readers/toy.py", TOY / "toy_reader.py")
    copy.put("files/readers/__init__.py", '    "text",\n)', '    "toy",\n')


def exporter(copy: Copy) -> None:
    copy.new("exporters/toy.py", TOY / "toy_exporter.py")
    copy.put("exporters/__init__.py", '    "cpp",\n)', '    "toy",\n')


def option(copy: Copy) -> None:
    copy.put(
        "commands/spread.py",
        "        ACCEPT,\n",
        f'        option("share", "--trim", "{TRIM}", default=0.0),\n',
    )


def field(copy: Copy) -> None:
    """The class, with what fills it; the view, where it is shown."""
    science = "stability/spread.py"
    copy.put(science, '    """\n\n    name: str\n', "    used : int\n        Samples that are left.\n")
    copy.put(
        science, "\n\n@dataclass(frozen=True, slots=True, kw_only=True)\nclass Spread(", "    used: int\n"
    )
    copy.put(science, ", sd=quantity))", ", used=samples.size")
    copy.put("views/spread.py", ") for c in result.channels])", ', f"{c.used} samples"')
    copy.put("views/spread.py", "), [(c.name", ', "Used"')


@pytest.fixture(scope="module")
def doors(copy: Copy, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What all doors say of the analysis with its new option and its new field."""
    assert touched(copy, analysis) == {**dict.fromkeys(ANALYSIS, 0), REGISTRY: 1}
    assert touched(copy, option) == {"commands/spread.py": 1}
    assert set(touched(copy, field)) == {"stability/spread.py", "views/spread.py"}
    assert touched(copy, file_format) == {"files/readers/toy.py": 0, "files/readers/__init__.py": 1}
    assert touched(copy, exporter) == {"exporters/toy.py": 0, "exporters/__init__.py": 1}
    folder = tmp_path_factory.mktemp("doors")
    rows = np.random.default_rng(1).normal(0, [1.0, 3.0], (1000, 2))
    log = folder / "log.csv"
    np.savetxt(log, rows, fmt="%.6f", delimiter=",", header="gyro_x_rad_s,gyro_y_rad_s", comments="")
    np.savetxt(folder / "toy.dat", rows, header="TOY", comments="")
    arguments = (copy.package.parent, folder)
    done = subprocess.run(
        [sys.executable, TOY / "doors.py", *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    said: dict[str, Any] = json.loads(done.stdout)
    return said


def test_an_analysis_is_at_every_door(doors: dict[str, Any]) -> None:
    assert re.search(r"^  spread +Test whether the samples of all channels scatter", doors["commands"], re.M)
    assert "allanite spread gyro.parquet --out spread" in doors["help"]
    says = "Some channels scatter more than others"
    for door in ("terminal", "report", "report of the file"):
        assert says in doors[door], door
    for door in ("document", "printed", "python"):
        assert doors[door]["format"] == "allanite-spread" and doors[door]["verdict"] == "uneven", door
    assert doors["table"].splitlines()[0] == "channel,sd" and len(doors["table"].splitlines()) == 3
    assert doors["page"]["title"] == "Do channels scatter alike?" and doors["page"]["takes"] == "recording"
    assert "allanite-spread" in doors["formats"] and doors["read again"]
    assert doors["reference"]["Spread"][0] == ["verdict", "", "Do all channels scatter alike?"]


def test_an_option_is_at_every_door(doors: dict[str, Any]) -> None:
    assert "--trim" in doors["help"] and TRIM in " ".join(doors["help"].split())
    assert doors["page"]["options"]["trim"]["help"].startswith(TRIM[:-1])
    assert doors["page"]["options"]["trim"]["default"] == 0.0
    # 10 % are trimmed at each end, from the command line and from Python: so the field says
    for door in ("document", "printed", "python"):
        assert [channel["used"] for channel in doors[door]["channels"]] == [800, 800], door


def test_a_field_is_at_every_door(doors: dict[str, Any]) -> None:
    for door in ("terminal", "report", "report of the file"):
        assert "800 samples" in doors[door] and "Used" in doors[door], door
    assert ["used", "", "Samples that are left."] in doors["reference"]["ChannelSpread"]


def test_a_format_is_read_and_a_consumer_served(doors: dict[str, Any]) -> None:
    assert doors["toy file"] == ["toy", [1000, 2]]
    assert re.search(r"^ *toy .*the names of the channels", doors["consumers"], re.M)
    assert doors["exported"] == "good day\ngyro\n"


def test_the_recipes_of_the_document_are_these() -> None:
    recipes = (PACKAGE.parents[1] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| (an? [a-z ]+) \| (.*) \|$", recipes, re.M))
    for words, place in {
        "an analysis": f"one line in `{REGISTRY}`",
        "a field of a result": "the view, where it is shown",
        "an option of a command": "its `Command`",
        "a file format": "one word in `READERS`",
        "an exporter": "one word in `EXPORTERS`",
    }.items():
        assert place in rows[words]
