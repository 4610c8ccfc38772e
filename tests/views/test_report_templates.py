# SPDX-License-Identifier: BSD-3-Clause
"""The code of templates is kept between processes, and never the wrong one."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jinja2
import pytest

from allanite.views.report import templates as module

NAMES = sorted(path.name for path in Path(module.__file__).parent.glob("*.html"))
Compiled = Callable[[], list[str]]


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Compiled:
    """Loads all templates as a new process does, with a folder for compiled code; names those that it compiled."""
    monkeypatch.setattr(sys, "pycache_prefix", str(tmp_path / "cache"))
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    names: list[str] = []
    generate = jinja2.Environment._generate

    def noted(environment: jinja2.Environment, source: Any, name: str, *others: Any, **more: Any) -> str:
        names.append(name)
        return generate(environment, source, name, *others, **more)

    monkeypatch.setattr(jinja2.Environment, "_generate", noted)

    def loaded() -> list[str]:
        names.clear()
        environment = module.templates.__wrapped__()
        for name in NAMES:
            environment.get_template(name)
        return sorted(names)

    return loaded


def kept(tmp_path: Path) -> list[Path]:
    return sorted(path for path in (tmp_path / "cache").rglob("*") if path.is_file())


def test_templates_are_compiled_once(compiled: Compiled, tmp_path: Path) -> None:
    assert compiled() == NAMES
    assert len(kept(tmp_path)) == len(NAMES)
    assert compiled() == []


@pytest.mark.parametrize("place", [0, 40, -9])
def test_damaged_code_is_compiled_again(compiled: Compiled, tmp_path: Path, place: int) -> None:
    compiled()
    file = kept(tmp_path)[1]
    whole = file.read_bytes()
    changed = bytearray(whole)
    changed[place] ^= 1
    for content in (whole[:place], bytes(changed), b""):
        file.write_bytes(content)
        assert len(compiled()) == 1
        assert file.read_bytes() == whole
        assert compiled() == []


@pytest.mark.parametrize("changed", ["jinja", "settings", "template"])
def test_code_of_another_version_is_replaced(
    compiled: Compiled, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, changed: str
) -> None:
    compiled()
    if changed == "jinja":
        monkeypatch.setattr(jinja2, "__version__", "another")
    elif changed == "settings":
        other = tmp_path / "templates.py"
        other.write_text(Path(module.__file__).read_text() + "# another\n")
        monkeypatch.setattr(module, "__file__", str(other))
    else:
        source = jinja2.FileSystemLoader.get_source
        monkeypatch.setattr(
            jinja2.FileSystemLoader,
            "get_source",
            lambda *given: (source(*given)[0] + " ", *source(*given)[1:]),
        )
    assert compiled() == NAMES
    assert compiled() == []


def test_nothing_is_kept_where_python_keeps_nothing(
    compiled: Compiled, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    assert compiled() == NAMES
    assert kept(tmp_path) == []


def test_a_folder_that_cannot_be_written_is_no_error(compiled: Compiled, tmp_path: Path) -> None:
    (tmp_path / "cache").write_text("a file in its place")
    assert compiled() == NAMES
    assert compiled() == NAMES
