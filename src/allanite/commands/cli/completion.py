# SPDX-License-Identifier: BSD-3-Clause
"""What a shell completes beside the names of commands and options: files, consumers, codes of findings."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

__all__ = ["complete_consumers", "complete_files", "complete_findings"]


def complete_files(context: click.Context, parameter: click.Parameter, begun: str) -> list[CompletionItem]:
    """Files and folders, which the shell knows."""
    from click.shell_completion import CompletionItem

    return [CompletionItem(begun, type="file")]


def complete_consumers(
    context: click.Context, parameter: click.Parameter, begun: str
) -> list[CompletionItem]:
    """Programs that `export` writes for."""
    from allanite.exporters import EXPORTERS

    return _that_begin(begun, (name.replace("_", "-") for name in EXPORTERS))


def complete_findings(context: click.Context, parameter: click.Parameter, begun: str) -> list[CompletionItem]:
    """Codes that `--accept` takes."""
    from allanite.recording.health.catalogue import CATALOGUE

    return _that_begin(begun, (code for code, kind in CATALOGUE.items() if "fatal" in kind.severity))


def _that_begin(begun: str, names: Iterable[str]) -> list[CompletionItem]:
    from click.shell_completion import CompletionItem

    return [CompletionItem(name) for name in names if name.startswith(begun)]
