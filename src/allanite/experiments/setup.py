# SPDX-License-Identifier: BSD-3-Clause
"""What is known of a setup, from the caller and from the channels that are measured."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.recording.records import Channel

__all__ = ["setup_of"]


def setup_of(stated: SetupUncertainty | None, channels: Iterable[Channel]) -> SetupUncertainty:
    """What is stated; where that has no uncertainty of the scale factor, the largest that the channels carry."""
    given = stated or SetupUncertainty()
    if given.scale > 0:
        return given
    return replace(given, scale=max((c.scale_uncertainty or 0.0 for c in channels), default=0.0))
