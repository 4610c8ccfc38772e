# SPDX-License-Identifier: BSD-3-Clause
"""A browser for tests: the one without windows, which needs four fifths of the other's time, where it is installed."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

__all__ = ["opened_browser"]

PROGRAMS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
QUIET = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update")


@contextmanager
def opened_browser(*arguments: str) -> Iterator[Any]:
    """A running browser; the test skips without one."""
    api = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed: pip install playwright"
    )
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        pytest.skip("no browser: sudo apt-get install chromium-headless-shell")
    with api.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=program, args=[*QUIET, *arguments])
        yield browser
        browser.close()
