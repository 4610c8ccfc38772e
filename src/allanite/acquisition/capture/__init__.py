# SPDX-License-Identifier: BSD-3-Clause
"""Instrument -> log store: a run that survives silence, unplugging, a stalling disk and clocks that are set.

``session``    the run: one thread listens, one writes.
``writer``     samples into batches (``gathering``), up to the planned end (``plan``); all else into the manifest.
``surroundings`` looks at clocks and disk.
``listener``   asks again, connects again, checks who answers.
``numbering``  every sample gets its number; where some are missing the numbers jump, with the reason.
``ring``       room for what the disk has not taken yet.
``clock``      intervals from a clock that goes on while the host sleeps; what the wall clock does is written down.
``device_lock`` one recorder for each device.
``space``      how much room a run needs; ``stopping`` signals.
"""

from __future__ import annotations

from allanite.acquisition.capture.clock import HostClock
from allanite.acquisition.capture.listener import Patience
from allanite.acquisition.capture.session import capture
from allanite.acquisition.capture.space import Space, space_of
from allanite.acquisition.capture.stopping import Stop, stopping_on_signals
from allanite.acquisition.capture.writer import Captured, Progress

__all__ = [
    "Captured",
    "HostClock",
    "Patience",
    "Progress",
    "Space",
    "Stop",
    "capture",
    "space_of",
    "stopping_on_signals",
]
