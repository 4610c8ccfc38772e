# SPDX-License-Identifier: BSD-3-Clause
"""Hostile inputs made by hand: small files whose shape, depth, numbers or claims cost time, memory or a traceback.

Each is one entry of a table: a name, the file, how it is opened, and what the refusal says. Those with a limit are just
beyond it, or, for the long run, as wide as `wide` says.
"""

from __future__ import annotations

from tests.hostile_shapes import arrays, logs, runs, texts
from tests.hostile_shapes.shape import HostileShape

__all__ = ["HostileShape", "hostile_shapes"]


def hostile_shapes(wide: int = 5000) -> list[HostileShape]:
    """All of them.

    Parameters
    ----------
    wide : int
        Columns, groups, channels, sheets or types of those that have too many.
    """
    return [
        *arrays.npy(wide),
        *texts.text(wide),
        *arrays.arrow(wide),
        *arrays.hdf5(wide),
        *arrays.matlab(wide),
        *arrays.tdms(wide),
        *logs.flight_logs(wide),
        *logs.bags(wide),
        *logs.ros2(wide),
        *logs.spreadsheets(wide),
        *texts.documents(),
        *texts.json_documents(),
        *runs.changed_runs(wide),
    ]
