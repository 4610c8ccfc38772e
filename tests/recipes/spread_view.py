# SPDX-License-Identifier: BSD-3-Clause
"""What a toy analysis says."""

from __future__ import annotations

from collections.abc import Iterator

from allanite.stability.spread import Spread
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Page, PageBlock, table
from allanite.views.result_page import result_page, verdict_banner

__all__ = ["rows", "view"]


def view(document: ResultDocument[Spread]) -> Page:
    """The page of a toy analysis."""
    return result_page(
        document,
        title="Scatter of the samples",
        kicker="Toy",
        facts=[("Channels", str(len(document.result.channels)))],
        sections={"verdict": ("Verdict", [*_verdict(document.result)])},
    )


def _verdict(result: Spread) -> Iterator[PageBlock]:
    yield verdict_banner(result.verdict, "")
    yield from table(("Channel", "Scatter"), [(c.name, str(c.sd)) for c in result.channels])


def rows(result: Spread) -> Iterator[dict[str, object]]:
    """One row of a table for each channel."""
    for channel in result.channels:
        yield {"channel": channel.name, "sd": channel.sd.value}
