# SPDX-License-Identifier: BSD-3-Clause
"""What is shipped: the bill of materials, the licenses of what is linked, and the hashes of the files.

Of the installed package; of a wheel too where ALLANITE_WHEEL names one (`make dist`).
"""

from __future__ import annotations

import base64
import csv
import hashlib
import importlib.metadata
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path
from typing import Any

import pytest

import allanite

_ROOT = Path(__file__).parents[1]
_WHEEL = os.environ.get("ALLANITE_WHEEL", "")
#: Exports a filter in an empty folder; compiles it against nothing.
_EXPORT = """
import allanite as al
from allanite.noise import Flicker, NoiseModel, RandomWalk, White
model = NoiseModel.of(White(N=1e-4), Flicker(B=1e-5), RandomWalk(K=1e-7))
al.export("cpp", {"gyro": model}, "model.hpp", rate=100.0)
print(al.__file__)
"""
_MAIN = """#include "model.hpp"
int main() {
    sensor::BiasFilter filter;
    sensor::begin(filter);
    sensor::on_sample(filter, 0.5F);
    return sensor::bias(filter) == 0.5F ? 0 : 1;
}
"""
_KINDS = {".py", ".pyi", ".typed", ".so", ".js", ".css", ".html", ".svg", ".hpp", ".json", ".txt", ".yaml"}


def bill_of(text: str) -> dict[str, Any]:
    """A bill of materials, looked through."""
    bill: dict[str, Any] = json.loads(text)
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.6")
    own = bill["metadata"]["component"]
    assert (own["name"], own["version"]) == ("allanite", allanite.__version__)
    parts = {part["name"]: part for part in bill["components"]}
    for part in (own, *parts.values()):
        assert re.fullmatch(r"\d+(\.\d+)+", part["version"]), part
        assert part["purl"].endswith(part["version"]) and part["licenses"][0]["license"]["id"]
    assert {d["ref"] for d in bill["dependencies"]} <= {p["bom-ref"] for p in (own, *parts.values())}
    return parts


def test_the_bill_of_materials_is_installed_and_names_what_is_linked() -> None:
    files = importlib.metadata.files("allanite")
    assert files is not None
    (place,) = [f for f in files if f.match("*.dist-info/sboms/*.cdx.json")]
    parts = bill_of(place.read_text())
    assert set(parts) == {"nanobind", "robin-map"}
    shipped = {f.name for f in files if "licenses" in f.parts}
    assert shipped == {"LICENSE", *(f"{name}.txt" for name in parts)}


def test_each_license_is_that_of_what_is_linked() -> None:
    nanobind = pytest.importorskip("nanobind", reason="nanobind is needed to build, not to run")
    files = importlib.metadata.files("nanobind")
    assert files is not None
    (theirs,) = [f for f in files if f.name == "LICENSE"]
    assert theirs.read_text() == (_ROOT / "LICENSES" / "nanobind.txt").read_text(encoding="utf-8")
    header = Path(nanobind.include_dir()).parent / "ext" / "robin_map" / "include" / "tsl" / "robin_map.h"
    comment = re.sub(r"^ \*[ /]?", "", header.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert (_ROOT / "LICENSES" / "robin-map.txt").read_text(encoding="utf-8").strip() in comment


def test_the_license_of_the_package_names_all_of_them() -> None:
    said = importlib.metadata.metadata("allanite")["License-Expression"]
    assert set(said.split(" AND ")) == {"BSD-3-Clause", "MIT"}


@pytest.mark.skipif(not _WHEEL, reason="ALLANITE_WHEEL names no wheel: make dist")
def test_a_wheel_holds_what_its_hashes_say_and_nothing_else() -> None:
    with zipfile.ZipFile(_WHEEL) as wheel:
        names = {n for n in wheel.namelist() if not n.endswith("/")}
        (record,) = [n for n in names if n.endswith(".dist-info/RECORD")]
        rows = {row[0]: row[1] for row in csv.reader(wheel.read(record).decode().splitlines())}
        assert set(rows) == names
        for name in names - {record}:
            digest = base64.urlsafe_b64encode(hashlib.sha256(wheel.read(name)).digest()).rstrip(b"=").decode()
            assert rows[name] == f"sha256={digest}", name
        ours = [n for n in names if ".dist-info/" not in n]
        assert {n.split("/")[0] for n in ours} == {"allanite", "allanite_seed_paper"}
        assert {Path(n).suffix for n in ours} <= _KINDS
        assert str(_ROOT).encode() not in b"".join(wheel.read(n) for n in ours)
        (bill,) = [n for n in names if n.endswith(".cdx.json")]
        assert set(bill_of(wheel.read(bill).decode())) == {"nanobind", "robin-map"}


@pytest.mark.skipif(not _WHEEL, reason="ALLANITE_WHEEL names no wheel: make dist")
@pytest.mark.skipif(not shutil.which("g++"), reason="needs g++")
def test_an_installed_wheel_exports_a_filter_that_compiles_in_an_empty_folder(tmp_path: Path) -> None:
    def run(*command: str | Path) -> str:
        done = subprocess.run(command, cwd=work, capture_output=True, text=True, timeout=120, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    place, work = tmp_path / "venv", tmp_path / "work"
    work.mkdir()
    run(sys.executable, "-m", "venv", "--without-pip", place)
    python = place / "bin" / "python"
    site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('platlib'))").strip())
    with zipfile.ZipFile(_WHEEL) as wheel:
        wheel.extractall(site)
    # NumPy and SciPy of this environment, behind the wheel and without the hooks of an editable install
    (site / "theirs.pth").write_text(sysconfig.get_path("platlib"), encoding="utf-8")
    assert Path(run(python, "-c", _EXPORT).strip()).is_relative_to(site)
    (work / "main.cpp").write_text(_MAIN, encoding="utf-8")
    run("g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", "main.cpp", "-o", "main")
    run(work / "main")
    headers = Path(run(python, "-m", "allanite", "include-path").strip())
    assert headers.is_relative_to(site)
    (work / "online.cpp").write_text(
        "#include <allanite/online_allan.hpp>\nint main() {}\n", encoding="utf-8"
    )
    run("g++", "-std=c++17", "-Werror", f"-I{headers}", "online.cpp", "-o", "online")


def relative_links(text: str) -> list[str]:
    return re.findall(r"\]\((?!https://|#)[^)]*\)", text)


def test_the_description_of_the_package_has_no_relative_link() -> None:
    from long_description import dynamic_metadata

    text = dynamic_metadata("readme", {})["text"]
    assert text.startswith("# allanite\n") and "```console" in text
    place = importlib.metadata.distribution("allanite").locate_file("")
    (installed,) = Path(str(place)).glob("allanite-*.dist-info/METADATA")
    assert installed.read_text(encoding="utf-8").partition("\n\n")[2].startswith("# allanite\n"), installed
    assert not relative_links(text) and "<!--" not in text, "if it is installed from before: make .venv/.dev"


def test_links_of_the_readme_lead_into_the_repository_that_is_stated() -> None:
    from long_description import absolute

    page = (_ROOT / "README.md").read_text(encoding="utf-8")
    assert relative_links(page)
    stated = absolute(page, "https://example.org/allanite/", "v1.2.3")
    assert not relative_links(stated)
    assert "[The proof](https://example.org/allanite/blob/v1.2.3/docs/proof.md)" in stated
    assert "](https://example.org/allanite/raw/v1.2.3/docs/images/report.png)" in stated
    without = absolute(page, "", "v1.2.3")
    assert not relative_links(without) and "The proof" in without and "![" not in without
    assert absolute("[a](https://x.org) [b](#c)\n", "", "v1") == "[a](https://x.org) [b](#c)\n"
