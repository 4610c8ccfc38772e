# SPDX-License-Identifier: BSD-3-Clause
"""How a run ended, in words."""

from __future__ import annotations

from collections.abc import Mapping

__all__ = ["RUN_STATES"]

RUN_STATES: Mapping[str, tuple[str, str]] = {
    "recording": ("recording", "good"),
    "success": ("finished as planned", "good"),
    "abort": ("stopped", "good"),
    "fail": ("ended by a failure", "fatal"),
    "unfinished": ("interrupted: the recorder died", "fatal"),
}
"""Words and tone of each status of a run on disk. What was recorded before a stop is kept."""
