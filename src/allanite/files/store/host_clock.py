# SPDX-License-Identifier: BSD-3-Clause
"""The clock of a run: that of its samples, of the blocks of instruments, and of the lines of its manifest."""

from __future__ import annotations

import time

__all__ = ["host_ns"]


def host_ns() -> int:
    """Clock of the host [ns] that passes evenly, also while the host sleeps, where the system knows such a clock."""
    boot = getattr(time, "CLOCK_BOOTTIME", None)
    return time.monotonic_ns() if boot is None else time.clock_gettime_ns(boot)
