# SPDX-License-Identifier: BSD-3-Clause
"""Limits that a process sets itself before it opens what it does not trust."""

from __future__ import annotations

import os
import sys

__all__ = ["limit_memory", "limit_processor_time", "memory_of_machine"]


def memory_of_machine() -> int:
    """Physical memory [bytes], on systems with `sysconf`."""
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def limit_memory(most: int | None = None) -> None:
    """Limit the address space of this process, and leave no core file.

    Windows has no such limit, macOS does not keep it, and refuses one below what is mapped: without effect there.

    Parameters
    ----------
    most : int, optional [bytes]
        By default the memory of the machine.
    """
    try:
        import resource
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform == "darwin":
        return
    most = memory_of_machine() if most is None else most
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    soft = most if hard == resource.RLIM_INFINITY else min(most, hard)
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def limit_processor_time(seconds: int, *, grace: int) -> None:
    """End this process by a signal after so many seconds of processor time, and at the latest `grace` seconds later.

    Without effect on Windows.
    """
    try:
        import resource
    except ImportError:
        return
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    longest = seconds + grace
    longest = longest if hard == resource.RLIM_INFINITY else min(longest, hard)
    resource.setrlimit(resource.RLIMIT_CPU, (max(longest - grace, 1), longest))
