# SPDX-License-Identifier: BSD-3-Clause
"""What the file of a consumer says of white noise that aliasing made larger."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.exporters.triads import plain_line

__all__ = ["aliasing_comments"]


def aliasing_comments(channel: Mapping[str, Any]) -> list[str]:
    """Lines on a channel whose samples average a part of their interval; none where they average all of it."""
    facts = channel.get("aliasing")
    if not facts:
        return []
    name, times = plain_line(channel["name"]), f"{facts['aperture']:.6g} s of its {facts['interval']:.6g} s"
    return [
        f"{name}: ALIASED: each sample averages {times}; N is that of the samples,",
        f"{name}: that of a sensor of wide-band white noise is {facts['factor']:.4g} times smaller",
    ]
