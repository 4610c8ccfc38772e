# SPDX-License-Identifier: BSD-3-Clause
"""Plugin of pytest: `allanite` is the copy beside these tests, and what became of each test is written down."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[2] / "src"
_REPORT = os.environ.get("ALLANITE_FAULTS_REPORT", "")

# An editable install finds its own tree before all paths.
sys.meta_path[:] = [
    finder for finder in sys.meta_path if type(finder).__name__ != "ScikitBuildRedirectingFinder"
]
sys.path.insert(0, str(SOURCE))


def pytest_sessionstart() -> None:
    import allanite

    if not Path(allanite.__file__).is_relative_to(SOURCE):
        raise pytest.UsageError(f"the tests import {allanite.__file__}, not the copy in {SOURCE}")


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if _REPORT and (report.when == "call" or report.failed or report.skipped):
        with open(_REPORT, "a", encoding="utf-8") as file:  # noqa: PTH123
            file.write(json.dumps([report.nodeid, report.outcome, round(report.duration, 3)]) + "\n")
