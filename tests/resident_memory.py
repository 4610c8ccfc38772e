# SPDX-License-Identifier: BSD-3-Clause
"""Memory of this process as Linux counts it: pages of files that are mapped included."""

import mmap
from pathlib import Path

import pytest

__all__ = ["needs_resident_bytes", "resident_bytes"]

_ACCOUNT = Path("/proc/self/statm")

needs_resident_bytes = pytest.mark.skipif(not _ACCOUNT.exists(), reason="counts pages as Linux does")


def resident_bytes() -> int:
    """Now."""
    return int(_ACCOUNT.read_text().split()[1]) * mmap.PAGESIZE
