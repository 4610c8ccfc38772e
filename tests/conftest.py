# SPDX-License-Identifier: BSD-3-Clause
"""Fixtures that every test may use."""

from __future__ import annotations

import gc
import os
import pickle

# Before NumPy, and for all commands that tests start: several processes with small matrices, whose threads would only
# wait for one another.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import settings

from shell import Done, Run

if TYPE_CHECKING:
    from allanite.views.figures.panel import Sheet

ROOT = Path(__file__).resolve().parent.parent

# Looking for cycles after every 700 objects, as is usual, takes a fortieth of the time of all tests.
gc.set_threshold(50_000, 20, 50)


def pytest_collection_finish() -> None:
    """What is loaded and collected by now stays: nobody looks for cycles in it again, and again, and at the end."""
    gc.freeze()


# How long an example takes says how busy the machine is.
settings.register_profile("allanite", deadline=None)
settings.load_profile("allanite")


class Stills:
    """Pictures of reports. One that has nothing new in it for the renderer is not drawn again, but gets an earlier one.

    Nearly every test that writes a report draws curves, axes and bands as others do; they look at words, tables and
    files. What a picture shows is what `test_figures` and its like look at, which draw themselves.

    Attributes
    ----------
    every : bool
        Each is drawn, after all.
    pictures : dict
        By the sheet: equal sheets have equal pictures.
    met : set
        What the renderer has met so far in this process: marks by their looks, and axes.
    """

    def __init__(self) -> None:
        self.every = False
        self.pictures: dict[bytes, str] = {}
        self.met: set[object] = set()

    def svg(self, sheet: Sheet) -> str:
        """A picture of a sheet, or of one before it that holds all that this one does."""
        from allanite.views.figures import matplotlib

        key = sha256(pickle.dumps(sheet)).digest()
        if key not in self.pictures:
            parts = {*_looks(sheet.rows), ("columns", sheet.columns > 1)}
            if self.every or not self.pictures or parts - self.met:
                self.pictures[key] = matplotlib.svg(sheet)
            else:
                self.pictures[key] = next(iter(self.pictures.values()))
            self.met |= parts
        return self.pictures[key]


def _looks(value: object) -> Iterator[object]:
    """How each part of a sheet looks, whatever it shows: the parts within parts, too."""
    if isinstance(value, tuple):
        for part in value:
            yield from _looks(part)
    elif is_dataclass(value) and not isinstance(value, type):
        members = [getattr(value, f.name) for f in fields(value)]
        yield type(value), tuple(map(_look, members))
        for member in members:
            yield from _looks(member)


def _look(value: object) -> object:
    """What a renderer goes by in a member of a mark: a word, whether there is anything, whether numbers exist."""
    if isinstance(value, np.ndarray):
        numbers = np.isfinite(value) if value.dtype.kind == "f" else value
        return value.dtype.kind, value.size > 1, bool(numbers.any()), bool(numbers.all())
    if isinstance(value, str):
        return value if value.isidentifier() and value.islower() else bool(value)
    if value is None or isinstance(value, bool):
        return value
    return type(value), bool(value)


@pytest.fixture(scope="session", autouse=True)
def stills() -> Iterator[Stills]:
    """Pictures of reports in this process."""
    from allanite.views import pieces

    known = Stills()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pieces, "matplotlib", SimpleNamespace(svg=known.svg))
        yield known


@pytest.fixture(scope="module")
def every_still(stills: Stills) -> Iterator[Stills]:
    """Pictures of reports, each drawn from its own sheet: for modules that look at files as a whole."""
    stills.pictures.clear()
    stills.every = True
    yield stills
    stills.every = False


@pytest.fixture
def rng() -> np.random.Generator:
    """A generator with a fixed seed: a test that fails once fails always."""
    return np.random.default_rng(20261121)


@pytest.fixture
def real_data() -> Callable[[str], Path]:
    """Path of a file or folder of the real recordings; the test skips where they are absent.

    They are not part of the repository. They are looked for in the folder that the environment variable
    ALLANITE_TEST_DATA names, else in ``shared/data`` beside the repository.
    """
    folder = Path(os.environ.get("ALLANITE_TEST_DATA") or ROOT.parent / "shared" / "data")

    def locate(name: str) -> Path:
        path = folder / name
        if not path.exists():
            pytest.skip(f"no real recording {name!r}: set ALLANITE_TEST_DATA to the folder that holds it")
        return path

    return locate


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Run:
    """Call the program as a shell would that does not say how wide the terminal is."""
    from allanite.commands.cli import main

    monkeypatch.delenv("COLUMNS", raising=False)

    def call(*arguments: object) -> Done:
        capsys.readouterr()
        with pytest.raises(SystemExit) as left:
            main([str(a) for a in arguments])
        said = capsys.readouterr()
        return Done(int(left.value.code or 0), said.out, said.err)

    return call
