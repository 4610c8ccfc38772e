# SPDX-License-Identifier: BSD-3-Clause
"""Agilent / HP / Keysight 3458A: direct voltage at an even pace, for a week.

Written from the manual and tried against the simulator of this folder only: on no instrument. The how-to
`first-light-3458a` lists what to look at first.
"""

from __future__ import annotations

from allanite.acquisition.instruments.hp3458a.commands import MeterSettings
from allanite.acquisition.instruments.hp3458a.driver import HP3458A

__all__ = ["HP3458A", "MeterSettings"]
