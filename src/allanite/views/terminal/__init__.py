# SPDX-License-Identifier: BSD-3-Clause
"""Results as text in a terminal: findings and tables on stdout, a progress bar on stderr."""

from allanite.views.terminal.capture import journal, show_captured
from allanite.views.terminal.console import listen, progress
from allanite.views.terminal.exporting import show_consumers
from allanite.views.terminal.monitor import monitoring, show_monitor
from allanite.views.terminal.page import show_document, show_models, show_page
from allanite.views.terminal.recovery import show_compaction, show_recovery
from allanite.views.terminal.study import (
    show_curve,
    show_findings,
    show_interval_errors,
    show_recording,
)
from allanite.views.terminal.style import TerminalStyle

__all__ = [
    "TerminalStyle",
    "journal",
    "listen",
    "monitoring",
    "progress",
    "show_captured",
    "show_compaction",
    "show_consumers",
    "show_curve",
    "show_document",
    "show_findings",
    "show_interval_errors",
    "show_models",
    "show_monitor",
    "show_page",
    "show_recording",
    "show_recovery",
]
