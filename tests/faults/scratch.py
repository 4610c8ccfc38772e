# SPDX-License-Identifier: BSD-3-Clause
"""A copy of the tree, with the compiled module, in which faults are put and taken away again."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

__all__ = ["Fault", "Scratch", "faults", "place_of"]

ROOT = Path(__file__).resolve().parents[2]
_TABLE = Path(__file__).with_name("faults.toml")
_SECONDS = 300.0
_LEFT_OUT = ("golden", "__pycache__", ".*", "build", "dist", "demo", "cache")


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """A wrong change of one file.

    Attributes
    ----------
    id : str
    file : str
        Relative to the root.
    before, after : str
        The first stands once in the file.
    breaks : str
        What is wrong then, in a sentence.
    caught_by : tuple of str
        Tests that fail then: file::test.
    """

    id: str
    file: str
    before: str
    after: str
    breaks: str
    caught_by: tuple[str, ...]


def faults(path: Path = _TABLE) -> dict[str, Fault]:
    """All faults by their ids."""
    rows = tomllib.loads(path.read_text(encoding="utf-8"))["fault"]
    found = [Fault(**{**row, "caught_by": tuple(row["caught_by"])}) for row in rows]
    twice = {f.id for f in found if sum(g.id == f.id for g in found) > 1}
    if twice:
        raise ValueError(f"ids that stand twice in {path.name}: {', '.join(sorted(twice))}")
    return {f.id: f for f in found}


def place_of(fault: Fault, root: Path = ROOT) -> str | None:
    """Why a fault cannot be put into a tree; None where it can."""
    path = root / fault.file
    if not path.exists():
        return f"{fault.file} is not there"
    count = path.read_text(encoding="utf-8").count(fault.before)
    if count != 1 or fault.before == fault.after:
        return f"`before` stands {count} times in {fault.file}: it must stand once, and `after` must differ"
    return None


class Scratch:
    """A copy of the tree in a folder that is empty so far."""

    def __init__(self, folder: Path) -> None:
        self.root = folder / "tree"
        for part in ("src", "tests", "docs", "verification", "kernels", "firmware", "benchmarks", "examples"):
            if (ROOT / part).exists():
                shutil.copytree(ROOT / part, self.root / part, ignore=shutil.ignore_patterns(*_LEFT_OUT))
        for file in ROOT.iterdir():
            if file.is_file():
                shutil.copy(file, self.root)
        compiled = importlib.util.find_spec("allanite._kernels")
        if compiled is None or compiled.origin is None:
            raise FileNotFoundError("the compiled module of allanite is not installed: make test")
        shutil.copy(compiled.origin, self.root / "src" / "allanite")
        self._report = folder / "report.jsonl"

    @contextmanager
    def holding(self, fault: Fault) -> Iterator[None]:
        """The fault is in the tree meanwhile."""
        why = place_of(fault, self.root)
        if why:
            raise ValueError(f"{fault.id}: {why}")
        path = self.root / fault.file
        sound = path.read_text(encoding="utf-8")
        self._put(path, sound.replace(fault.before, fault.after))
        try:
            yield
        finally:
            self._put(path, sound)

    @staticmethod
    def _put(path: Path, text: str) -> None:
        """Write a file, and forget what was compiled of it: a change within the same second may not be noticed."""
        path.write_text(text, encoding="utf-8")
        for compiled in (path.parent / "__pycache__").glob(f"{path.stem}.*"):
            compiled.unlink()

    def outcomes(self, tests: Sequence[str], *options: str) -> tuple[dict[str, tuple[str, float]], str]:
        """Outcome and duration [s] of each test that ran, and what pytest printed."""
        self._report.unlink(missing_ok=True)
        environment = {**os.environ, "ALLANITE_FAULTS_REPORT": str(self._report), "OMP_NUM_THREADS": "1"}
        for name in ("PYTHONPATH", "PYTEST_ADDOPTS", "PYTHONDONTWRITEBYTECODE"):
            environment.pop(name, None)
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-p",
            "tests.faults.copied",
            "-p",
            "no:cacheprovider",
            "-q",
        ]
        try:
            done = subprocess.run(
                [*command, *options, *tests],
                cwd=self.root,
                env=environment,
                capture_output=True,
                text=True,
                timeout=_SECONDS,
                check=False,
            )
            said = done.stdout + done.stderr
        except subprocess.TimeoutExpired:
            said = f"no end after {_SECONDS:g} s"
        lines = self._report.read_text(encoding="utf-8").splitlines() if self._report.exists() else []
        found: dict[str, tuple[str, float]] = {}
        for node, outcome, seconds in map(json.loads, lines):
            if found.get(node, ("passed", 0.0))[0] != "failed":
                found[node] = (outcome, seconds)
        return found, said
