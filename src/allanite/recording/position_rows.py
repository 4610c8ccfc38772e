# SPDX-License-Identifier: BSD-3-Clause
"""Whether the rows of a short table are positions, each the mean of its readings, and not samples of a log.

Three accelerometers that were put down in one attitude after the other read gravity each time: one length, and
directions that jump from row to row and fill the sphere. No log of a sensor at rest does that, nor one that turns
steadily (its readings lie in a plane, like three phases of a current), nor noise (its length varies by 42 %).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["MOST", "are_positions"]

Array = NDArray[np.float64]

#: Fewest rows that are looked at, and most rows of a table of means: more are samples of a log.
FEWEST, MOST = 6, 200
#: Part by which the lengths scatter, at most: biases and scale errors of MEMS accelerometers reach some 50 mg.
SCATTER = 0.05
#: Turn from one row to the next that is a jump, and the part of the rows that begin with one: six faces of four rows.
JUMP, JUMPS = np.radians(15.0), 0.2
#: Least extent of the directions over their largest: in a plane it is zero, on a whole sphere one.
EXTENT = 0.2


def are_positions(columns: Sequence[Array]) -> bool:
    """True where three columns that stand side by side show gravity from many sides.

    Parameters
    ----------
    columns : sequence of ndarray, shape (n_rows,)
        In the order of the table, in any unit; those of no sensor left out.
    """
    if len(columns) < 3 or not FEWEST <= len(columns[0]) <= MOST:
        return False
    return any(_shows_gravity(np.column_stack(columns[k : k + 3])) for k in range(len(columns) - 2))


def _shows_gravity(rows: Array) -> bool:
    with np.errstate(over="ignore", invalid="ignore"):
        length = np.sqrt((rows**2).sum(axis=1))
    if not (np.isfinite(length).all() and length.min() > 0) or length.std() > SCATTER * length.mean():
        return False
    directions = rows / length[:, None]
    turns = np.arccos(np.clip((directions[1:] * directions[:-1]).sum(axis=1), -1.0, 1.0))
    if np.count_nonzero(turns > JUMP) < JUMPS * len(turns):
        return False
    extent = np.linalg.svd(directions - directions.mean(axis=0), compute_uv=False)
    return bool(extent[2] > EXTENT * extent[0])
