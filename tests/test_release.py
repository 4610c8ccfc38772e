# SPDX-License-Identifier: BSD-3-Clause
"""What a release states is true, and is stated once: versions, licenses, addresses, workflows, recipe, image, forms."""

from __future__ import annotations

import fnmatch
import importlib.metadata
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jinja2
import pytest
import release_check
import release_notes
from project_urls import addresses, repository
from ruamel.yaml import YAML

import allanite

_ROOT = Path(__file__).parents[1]
_FACTS = tomllib.loads((_ROOT / "pyproject.toml").read_text(encoding="utf-8"))
_PROJECT = _FACTS["project"]
_GITHUB = _ROOT / ".github"
_WORKFLOWS = sorted((_GITHUB / "workflows").glob("*.yml"))
_FORMS = sorted((_GITHUB / "ISSUE_TEMPLATE").glob("[0-9]*.yml"))
_PINNED = re.compile(
    r"uses: (?P<action>[\w-]+/[\w-]+)@(?P<commit>[0-9a-f]{40}) # (?P<version>v\d+\.\d+\.\d+)$", re.M
)

pytestmark = pytest.mark.skipif(not _GITHUB.is_dir(), reason="the source package has no workflows")


def loaded(path: Path) -> dict[str, Any]:
    """A YAML file; "on" is a key, as in YAML 1.2."""
    document: dict[str, Any] = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
    return document


# -- versions and systems ----------------------------------------------------------------------------------------------


def test_the_pythons_of_the_classifiers_are_those_that_the_page_calls_tested() -> None:
    wheels = release_check.wanted_versions()
    assert _PROJECT["requires-python"] == f">={wheels[0]}"
    assert wheels == [f"3.{minor}" for minor in range(11, 11 + len(wheels))]
    page = (_ROOT / "docs/reference/systems.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (3\.\d+)(?:\.\d+)? \| (.*?) \|$", page, re.M)
    assert [version for version, _ in rows] == wheels
    tested = [version for version, state in rows if not state.startswith("untested")]
    assert tested == re.findall(r"Python :: (3\.\d+)", "\n".join(_PROJECT["classifiers"]))


def test_no_system_is_a_classifier_that_the_page_calls_untested() -> None:
    page = (_ROOT / "docs/reference/systems.md").read_text(encoding="utf-8")
    untested = re.findall(r"^\| (\w+).*\| untested", page, re.M)
    assert {"Windows", "macOS"} <= set(untested)
    systems = [c for c in _PROJECT["classifiers"] if c.startswith("Operating System")]
    assert systems == ["Operating System :: POSIX :: Linux"]


def test_the_stable_abi_begins_where_the_wheel_for_later_pythons_is_built() -> None:
    api = _FACTS["tool"]["scikit-build"]["wheel"]["py-api"]
    assert api == f"cp{release_check.BUILT_ON[-1].replace('.', '')}"
    assert release_check.BUILT_ON[0] == release_check.wanted_versions()[0]


# -- said once ---------------------------------------------------------------------------------------------------------


def test_citation_and_archive_say_what_the_package_says() -> None:
    citation = loaded(_ROOT / "CITATION.cff")
    archive = json.loads((_ROOT / ".zenodo.json").read_text(encoding="utf-8"))
    (author,) = _PROJECT["authors"]
    assert citation["title"] == archive["title"]
    assert citation["abstract"] == archive["description"] == _PROJECT["description"]
    assert citation["keywords"] == archive["keywords"] == _PROJECT["keywords"]
    assert citation["authors"] == archive["creators"] == [author]
    assert citation["version"] == allanite.__version__
    assert citation["license"] == archive["license"] == _PROJECT["license"].split(" AND ")[0]
    assert citation.get("repository-code", "") == repository()


def test_addresses_of_the_project_come_from_one_line() -> None:
    stated = importlib.metadata.metadata("allanite").get_all("Project-URL") or []
    assert stated == [", ".join(pair) for pair in addresses(repository()).items()], "make .venv/.dev"
    made = addresses("https://example.org/x")
    assert set(made) == {"Source", "Documentation", "Changelog", "Issues"}
    assert all(address.startswith("https://example.org/x") for address in made.values())
    assert not addresses("")
    shipped = [
        *_GITHUB.rglob("*.yml"),
        *(_ROOT / "packaging").rglob("*.*"),
        _ROOT / "Dockerfile",
        _ROOT / ".zenodo.json",
    ]
    for path in shipped:
        if path.suffix != ".pyc":
            assert "/allanite" not in re.sub(
                r"src/allanite|wheels/allanite|dist/allanite", "", path.read_text("utf-8")
            ), path


# -- ready for a tag ---------------------------------------------------------------------------------------------------

_HEAD = "# Changelog\n\n## [Unreleased]\n\n"
_READY = {
    "CHANGELOG.md": _HEAD + "## [1.2.3] - 2026-12-01\n\n* News.\n\n## [1.2.2] - 2026-11-01\n\n* Old.\n",
    "CITATION.cff": "version: 1.2.3\n",
    "pyproject.toml": '[tool.allanite]\nrepository = "https://example.org/a"\n',
    "src/allanite/__init__.py": '__version__ = "1.2.3"\n',
}


def tree(folder: Path, **changed: str) -> Path:
    files = {**_READY, **changed}
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content, encoding="utf-8")
    return folder


def test_a_tree_that_is_ready_has_no_obstacle_and_its_notes_are_the_section_of_its_version(
    tmp_path: Path,
) -> None:
    place = tree(tmp_path)
    assert list(release_notes.obstacles("v1.2.3", "https://example.org/a/", place)) == []
    assert release_notes.notes(place) == "* News.\n"


@pytest.mark.parametrize(
    ("file", "content", "words"),
    [
        ("CHANGELOG.md", _HEAD + "* News.\n", "has no section"),
        ("CHANGELOG.md", _HEAD + "## [1.2.3]\n", "has no section"),
        ("CHANGELOG.md", _HEAD + "## [1x2.3] - 2026-12-01\n", "has no section"),
        ("CITATION.cff", "version: 1.2.2\n", "cites version 1.2.2"),
        ("CITATION.cff", "title: x\n", "cites version ,"),
        ("pyproject.toml", '[tool.allanite]\nrepository = ""\n', "repository in [tool.allanite]"),
        ("pyproject.toml", '[tool.allanite]\nrepository = "https://example.org/b"\n', "example.org/b"),
    ],
)
def test_each_obstacle_is_named_alone(tmp_path: Path, file: str, content: str, words: str) -> None:
    place = tree(tmp_path, **{file: content})
    (obstacle,) = release_notes.obstacles("v1.2.3", "https://example.org/a", place)
    assert words in obstacle


@pytest.mark.parametrize("tag", ["v1.2.4", "1.2.3", "v1.2.3rc1", ""])
def test_another_tag_is_refused(tmp_path: Path, tag: str) -> None:
    (obstacle,) = release_notes.obstacles(tag, None, tree(tmp_path))
    assert obstacle.startswith(f"the tag is {tag}, the package 1.2.3")


def test_the_program_refuses_with_every_obstacle() -> None:
    command = [
        sys.executable,
        _ROOT / "packaging/release_notes.py",
        "v0",
        "--repository",
        "https://example.org/none",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "the tag is v0" in done.stderr and "example.org/none" in done.stderr


# -- workflows ---------------------------------------------------------------------------------------------------------


def steps(workflow: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for job in workflow["jobs"].values():
        yield from job.get("steps", ())


def missing_from(command: str, targets: set[str]) -> set[str]:
    """Targets of make and files of this repository that a command names and that are not there."""
    made = set(re.findall(r"^make ([a-z-]+)", command, re.M)) - targets
    named = re.findall(r"(?:^|\s)(packaging/[\w.-]+|\.ci/\w+)", command)
    return made | {name for name in named if not (_ROOT / name).exists()}


@pytest.mark.parametrize("path", _WORKFLOWS, ids=lambda path: path.stem)
def test_a_workflow_runs_what_is_there(path: Path) -> None:
    makefile = (_ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([a-z-]+):.*## ", makefile, re.M))
    commands = [step["run"] for step in steps(loaded(path)) if "run" in step]
    assert commands
    assert not {name for command in commands for name in missing_from(command, targets)}
    assert missing_from("make tset", targets) == {"tset"}
    assert missing_from("python packaging/none.py x", targets) == {"packaging/none.py"}


@pytest.mark.parametrize("path", _WORKFLOWS, ids=lambda path: path.stem)
def test_a_workflow_may_read_alone_and_ends_in_time(path: Path) -> None:
    workflow = loaded(path)
    assert workflow["permissions"] == {"contents": "read"}
    more = {name: job["permissions"] for name, job in workflow["jobs"].items() if "permissions" in job}
    assert more == (
        {"publish": {"id-token": "write"}, "page": {"contents": "write"}} if path.stem == "release" else {}
    )
    assert all("timeout-minutes" in job or "uses" in job for job in workflow["jobs"].values())
    assert "secrets." not in path.read_text(encoding="utf-8")


def test_actions_are_pinned_to_one_commit_each() -> None:
    texts = [path.read_text(encoding="utf-8") for path in _WORKFLOWS]
    used = [line for text in texts for line in re.findall(r"uses: .*", text) if "uses: ./" not in line]
    pins = {match["action"]: match.groups() for text in texts for match in _PINNED.finditer(text)}
    assert len(used) == sum(len(_PINNED.findall(text)) for text in texts) > 10
    assert len(pins) == len({line.partition("@")[0] for line in used}) == len(set(used))


def test_what_is_published_is_what_the_wheels_make() -> None:
    wheels, release = (loaded(_GITHUB / "workflows" / f"{name}.yml") for name in ("wheels", "release"))
    (taken,) = (
        s["with"]["pattern"] for s in release["jobs"]["publish"]["steps"] if "pattern" in s.get("with", {})
    )
    made = {
        name: step["with"]["name"]
        for name, job in wheels["jobs"].items()
        for step in job["steps"]
        if "upload-artifact" in step.get("uses", "")
    }
    published = {name for name, artifact in made.items() if fnmatch.fnmatch(artifact, taken)}
    assert published == {"source", "wheels"} and set(made) == published | {"emscripten"}
    assert release["jobs"]["publish"]["needs"] == "wheels" and release["jobs"]["wheels"]["needs"] == "ready"


# -- recipe, image, forms ----------------------------------------------------------------------------------------------


def recipe() -> dict[str, Any]:
    """The recipe as conda-build reads it; its functions do what their documentation says."""
    place = _ROOT / "packaging" / "conda"

    def load_file_data(name: str, *, from_recipe_dir: bool) -> dict[str, Any]:
        assert from_recipe_dir
        return tomllib.loads((place / name).read_text(encoding="utf-8"))

    def load_file_regex(*, load_file: str, regex_pattern: str, from_recipe_dir: bool) -> re.Match[str] | None:
        assert from_recipe_dir
        return re.search(regex_pattern, (place / load_file).read_text(encoding="utf-8"))

    names = {"load_file_data": load_file_data, "load_file_regex": load_file_regex, "PYTHON": "python"}
    names |= {"compiler": "{}_compiler".format, "stdlib": "{}_stdlib".format}
    text = jinja2.Template((place / "meta.yaml").read_text(encoding="utf-8")).render(names)
    document: dict[str, Any] = YAML(typ="safe").load(text)
    return document


def test_the_recipe_takes_its_facts_from_the_package() -> None:
    made = recipe()
    assert made["package"] == {"name": "allanite", "version": allanite.__version__}
    assert made["build"]["entry_points"] == ["allanite = allanite.__main__:main"]
    assert made["requirements"]["run"] == ["python", *_PROJECT["dependencies"]]
    host = {requirement.replace(" ", "") for requirement in made["requirements"]["host"]}
    assert set(_FACTS["build-system"]["requires"]) <= host
    licenses = [
        str(p.relative_to(_ROOT))
        for pattern in _PROJECT["license-files"]
        for p in sorted(_ROOT.glob(pattern))
    ]
    assert made["about"]["license_file"] == licenses and made["about"]["license"] == _PROJECT["license"]
    assert all((_ROOT / name).is_file() for name in made["test"]["source_files"])
    assert made["source"]["path"] == os.path.relpath(_ROOT, _ROOT / "packaging" / "conda")


def instructions() -> list[tuple[str, str]]:
    """Of the Dockerfile, lines joined."""
    text = re.sub(r"\\\n\s*", "", (_ROOT / "Dockerfile").read_text(encoding="utf-8"))
    return [
        (line.split()[0], line.partition(" ")[2]) for line in text.splitlines() if line and line[0] != "#"
    ]


def test_the_image_has_no_compiler_and_runs_without_rights() -> None:
    last = max(i for i, (word, _) in enumerate(instructions()) if word == "FROM")
    final = instructions()[last:]
    assert final[0][1].endswith("-slim") and not any("g++" in rest for _, rest in final)
    users = [rest for word, rest in final if word == "USER"]
    assert users == ["allanite"] and final.index(("USER", "allanite")) > max(
        i for i, (word, _) in enumerate(final) if word == "RUN"
    )
    (installed,) = re.findall(
        r"allanite-\*\.whl\)\[(.*?)\]", (_ROOT / "Dockerfile").read_text(encoding="utf-8")
    )
    assert set(installed.split(",")) <= set(_PROJECT["optional-dependencies"])


def test_the_image_serves_nothing_without_a_token(tmp_path: Path) -> None:
    (command,) = (json.loads(rest) for word, rest in instructions() if word == "CMD")
    words = [str(tmp_path) if word == "/data" else word for word in command]
    environment = {name: value for name, value in os.environ.items() if name != "ALLANITE_TOKEN"}
    done = subprocess.run(
        [sys.executable, "-m", "allanite", *words],
        env=environment, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 1 and "pass your own --token" in done.stderr and not done.stdout


def test_the_image_is_made_of_all_that_the_build_reads() -> None:
    kept = {
        line[1:]
        for line in (_ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
        if line[0] == "!"
    }
    tools = _FACTS["tool"]["scikit-build"]
    read = {
        "pyproject.toml", "CMakeLists.txt", "README.md", *tools["wheel"]["packages"], *_PROJECT["license-files"],
        *(m["provider-path"] for m in tools["metadata"].values() if "provider-path" in m),
        *re.findall(r"kernels/[\w./]*", (_ROOT / "CMakeLists.txt").read_text(encoding="utf-8")),
    }  # fmt: skip
    assert not {name for name in read if not any(name == k or name.startswith(f"{k}/") for k in kept)}
    assert all((_ROOT / name).exists() for name in kept)


@pytest.mark.parametrize("path", _FORMS, ids=lambda path: path.stem)
def test_a_form_asks_what_is_needed(path: Path) -> None:
    form = loaded(path)
    assert {"name", "description", "body"} <= set(form)
    asked = [field for field in form["body"] if field["type"] != "markdown"]
    assert len({field["id"] for field in asked}) == len(asked) > 2
    assert all(field["type"] in ("input", "textarea") and field["attributes"]["label"] for field in asked)
    assert all(field["validations"]["required"] is True for field in asked)
    commands = re.findall(r"`allanite ([\w-]+)", path.read_text(encoding="utf-8"))
    known = {*importlib.import_module("allanite.commands.cli").cli.commands, "--version"}
    assert set(commands) <= known


# -- the check of a release --------------------------------------------------------------------------------------------


def test_an_environment_with_a_compiler_is_not_empty(tmp_path: Path) -> None:
    release_check.refuse_compilers(str(tmp_path))
    (tmp_path / "g++").touch(mode=0o755)
    with pytest.raises(SystemExit, match=r"g\+\+"):
        release_check.refuse_compilers(str(tmp_path))


def test_a_clean_environment_has_nothing_that_compilers_read(monkeypatch: pytest.MonkeyPatch) -> None:
    read = (
        "CXXFLAGS",
        "CFLAGS",
        "LDFLAGS",
        "CC",
        "CXX",
        "CMAKE_ARGS",
        "SKBUILD_CMAKE_ARGS",
        "PYTHONPATH",
        "VIRTUAL_ENV",
    )
    for name in read:
        monkeypatch.setenv(name, "x")
    monkeypatch.setenv("PIP_CERT", "kept")
    assert not set(read) & set(release_check.clean())
    assert release_check.clean()["PIP_CERT"] == "kept"


def test_a_python_of_another_version_is_not_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("HOME", str(tmp_path))
    other = tmp_path / "python3.14"
    other.symlink_to(shutil.which("true", path="/bin:/usr/bin") or "/bin/true")
    monkeypatch.setenv("RELEASE_PYTHONS", f"{other}:{sys.executable}")
    here, missing = release_check.found_pythons()
    own = f"3.{sys.version_info.minor}"
    assert here == {own: Path(sys.executable)} and own not in missing


def test_the_first_result_is_as_expected(tmp_path: Path) -> None:
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    command = [sys.executable, _ROOT / "packaging" / "first_result.py"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0 and done.stdout.endswith("first result: as expected\n"), (
        done.stdout + done.stderr
    )
