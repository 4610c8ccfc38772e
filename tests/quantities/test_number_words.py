# SPDX-License-Identifier: BSD-3-Clause
"""Numbers as they are shown: an interval around zero is as readable as another."""

from __future__ import annotations

import numpy as np
import pytest

from allanite.quantities.number_words import interval


@pytest.mark.parametrize("value", [0.0, 1e-19, -3e-8, 7e-5, -1e-4, 0.02, 1.0, 250.0, 2e6])
@pytest.mark.parametrize("below", [1e-9, 2.5e-4, 0.03, 5.6e2, 3e7])
@pytest.mark.parametrize("above", [1e-9, 3.3e-4, 0.9, 7.1e5])
def test_the_three_numbers_of_an_interval_share_a_layout(value: float, below: float, above: float) -> None:
    """One exponent, or none; at most seven digits before it; each number as it is but for its last shown digit."""
    ends = value, value - below, value + above
    shown = interval(*ends)
    if all(e > 0 for e in ends) and ends[2] > 30 * ends[1]:
        return  # each has two digits of its own
    parts = [s.partition("e") for s in shown]
    assert len({p[2] for p in parts}) == 1
    assert len({len(p[0].partition(".")[2]) for p in parts}) == 1
    step = 10.0 ** (int(parts[0][2] or 0) - len(parts[0][0].partition(".")[2]))
    np.testing.assert_allclose([float(s) for s in shown], ends, rtol=1e-12, atol=0.5001 * step)
    if parts[0][2]:
        assert max(abs(float(p[0])) for p in parts) < 10.01
