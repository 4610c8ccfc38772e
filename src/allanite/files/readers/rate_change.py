# SPDX-License-Identifier: BSD-3-Clause
"""Does the rate of a record change once? Its mean rate would then make the time axis wrong."""

from __future__ import annotations

import numpy as np

from allanite.files.readers.filled_stamps import Filled

__all__ = ["two_rates"]

#: Stamps looked at, a least number of rows, and a difference of the rates that is one.
_LOOKED_AT, _FEWEST, _DIFFERENT = 512, 16, 0.01
#: So much of the bend may be left between the stamps and two straight lines.
_LEFT = 0.05


def two_rates(stamps: Filled) -> tuple[float, float, int] | None:
    """Rates [Hz] before and after the row at which the rate changes; None where it does not, or more than once.

    The stamps are then two straight lines over the rows, and are farthest from their chord at the row of the change.
    """
    n = len(stamps)
    if n < _FEWEST:
        return None
    rows = np.unique(np.linspace(0, n - 1, _LOOKED_AT).astype(np.int64))
    times = np.array([stamps.read(row, row + 1)[0] for row in rows.tolist()])
    chord = np.interp(rows, rows[[0, -1]], times[[0, -1]])
    bend = np.abs(times - chord)
    k = int(bend.argmax())
    if not 2 <= k < len(rows) - 2:
        return None
    slopes = [float(np.polyfit(rows[part], times[part], 1)[0]) for part in (slice(k), slice(k + 1, None))]
    if not min(slopes) > 0 or abs(slopes[0] / slopes[1] - 1) < _DIFFERENT:
        return None
    lines = np.concatenate(
        [
            np.polyval(np.polyfit(rows[p], times[p], 1), rows[p]) - times[p]
            for p in (slice(k), slice(k + 1, None))
        ]
    )
    if np.abs(lines).max() > _LEFT * bend[k]:
        return None
    return 1 / slopes[0], 1 / slopes[1], int(rows[k])
