# SPDX-License-Identifier: BSD-3-Clause
"""Each ask of the page has its thread and a command, which `test_docs` runs."""

from __future__ import annotations

import re

from document_steps import ROOT

PAGE = ROOT / "docs" / "howto" / "asked-most.md"
#: Tools whose users ask.
TOOLS = {"allantools", "allan_variance_ros", "imu_utils", "kalibr", "kalibr_allan"}


def test_every_ask_has_a_thread_and_a_command() -> None:
    asks = re.split(r"^## ", PAGE.read_text(encoding="utf-8"), flags=re.M)[1:]
    assert len(asks) >= 15
    threads: set[str] = set()
    for ask in asks:
        title = ask.partition("\n")[0]
        cited = re.findall(
            r"\[([\w.-]+) #(\d+)\]\(https://github\.com/([\w.-]+/[\w.-]+)/(?:issues|pull)/(\d+)\)", ask
        )
        assert cited, f"{title}: no thread"
        for name, number, repository, numbered in cited:
            assert (repository.partition("/")[2], numbered) == (name, number)
            threads.add(f"{repository}#{number}")
        assert re.search(r"^\$ allanite ", ask, re.M), f"{title}: no command"
    assert {thread.partition("/")[2].partition("#")[0] for thread in threads} >= TOOLS
