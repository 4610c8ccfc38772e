# SPDX-License-Identifier: BSD-3-Clause
"""An interpreter that has the core of allanite and nothing else, made of the one that runs the tests.

The extras are there, and are hidden: nobody finds their modules, neither the program nor the children that it starts.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

__all__ = ["CoreAlone", "brought_by", "project"]

ROOT = Path(__file__).resolve().parent.parent
#: Of the interpreter: a finder of modules that finds none of these.
_SITE = """
import sys
from importlib.machinery import PathFinder

HIDDEN = {hidden!r}


class CoreAlone(PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        return None if name.partition(".")[0] in HIDDEN else super().find_spec(name, path, target)


sys.meta_path[:] = [CoreAlone if finder is PathFinder else finder for finder in sys.meta_path]
"""


def project() -> Mapping[str, Any]:
    """The table of the project in pyproject.toml."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    table: dict[str, Any] = tomllib.loads(text)["project"]
    return table


def brought_by(requirements: Iterable[str]) -> set[str]:
    """Distributions that requirements install, with all that these require in turn."""
    brought: set[str] = set()
    asked = [(Requirement(words), frozenset[str]()) for words in requirements]
    while asked:
        wanted, of_extras = asked.pop()
        name = canonicalize_name(wanted.name)
        if wanted.marker and not any(wanted.marker.evaluate({"extra": e}) for e in of_extras or {""}):
            continue
        if name == "allanite":
            extras = project()["optional-dependencies"]
            asked += [(Requirement(words), frozenset()) for e in wanted.extras for words in extras[e]]
        elif name not in brought:
            brought.add(name)
            asked += [(Requirement(words), frozenset(wanted.extras)) for words in _requires(name)]
    return brought


@cache
def _requires(name: str) -> tuple[str, ...]:
    try:
        return tuple(requires(name) or ())
    except PackageNotFoundError:  # of another system
        return ()


class CoreAlone:
    """The interpreter; `folder` is where it works."""

    def __init__(self, folder: Path, site: Path) -> None:
        core = brought_by(project()["dependencies"]) | {"allanite"}
        installed = packages_distributions()
        self.hidden = {
            module
            for module, names in installed.items()
            if not core & {canonicalize_name(name) for name in names}
        }
        self.folder = folder
        site.mkdir()
        (site / "sitecustomize.py").write_text(_SITE.format(hidden=self.hidden), encoding="utf-8")
        self._environment = {
            **os.environ,
            "PYTHONPATH": str(site),
            "COLUMNS": "120",
            "NO_COLOR": "1",
            "XDG_CACHE_HOME": str(site),
        }

    def run(self, *words: str | Path) -> subprocess.CompletedProcess[str]:
        """The program allanite."""
        return self._started("-m", "allanite", *words)

    def python(self, code: str) -> subprocess.CompletedProcess[str]:
        """Lines of Python."""
        return self._started("-c", code)

    def _started(self, *words: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, *map(str, words)],
            cwd=self.folder,
            env=self._environment,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
