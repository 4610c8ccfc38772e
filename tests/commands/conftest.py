# SPDX-License-Identifier: BSD-3-Clause
"""Fixtures of the tests of the page."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import pytest

from warmed_children import Nest


@pytest.fixture(scope="session", autouse=True)
def warmed_children() -> Iterator[None]:
    """Children of a page in the process of the tests are forks, where the system can."""
    if sys.platform != "linux":
        yield
        return
    from allanite.commands.page import children

    nest = Nest()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(children, "subprocess", nest.subprocess)
        yield
    nest.close()


@pytest.fixture
def real_children(monkeypatch: pytest.MonkeyPatch) -> None:
    """Children are started as in the program: for tests of processes."""
    from allanite.commands.page import children

    monkeypatch.setattr(children, "subprocess", subprocess)
