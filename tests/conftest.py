# SPDX-License-Identifier: BSD-3-Clause
"""Fixtures that every test may use."""

from __future__ import annotations

import gc
import os

# Before NumPy, and for all commands that tests start: several processes with small matrices, whose threads would only
# wait for one another.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from shell import Done, Run

ROOT = Path(__file__).resolve().parent.parent

# Looking for cycles after every 700 objects, as is usual, takes a fortieth of the time of all tests.
gc.set_threshold(50_000, 20, 50)


def pytest_collection_finish() -> None:
    """What is loaded and collected by now stays: nobody looks for cycles in it again, and again, and at the end."""
    gc.freeze()


# How long an example takes says how busy the machine is.
settings.register_profile("allanite", deadline=None)
settings.load_profile("allanite")


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
