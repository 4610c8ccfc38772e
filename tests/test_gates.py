# SPDX-License-Identifier: BSD-3-Clause
"""The gates of the verification: their probability at the stated share, and what they reject."""

import numpy as np
import pytest
from scipy.stats import binom
from verification.gates import HOLDS, REJECTS, Ends, Gate

GATES = [
    Gate(stated=stated, records=records, ends=ends)
    for stated in (0.05, 0.6827, 0.95)
    for records in (60, 300, 1200, 10_000)
    for ends in Ends
]


def passing(gate: Gate, truth: float) -> float:
    """Probability that the gate holds, summed over all counts."""
    counts = np.arange(gate.records + 1)
    share, slack = counts / gate.records, 1e-9
    holds = (gate.low - slack <= share) & (share <= gate.high + slack)
    return float(binom.pmf(counts[holds], gate.records, truth).sum())


@pytest.mark.parametrize("gate", GATES, ids=str)
def test_a_gate_holds_at_the_stated_share(gate):
    assert passing(gate, gate.stated) >= HOLDS


@pytest.mark.parametrize("gate", GATES, ids=str)
def test_what_a_gate_rejects_is_rejected_with_the_stated_probability(gate):
    below, above = gate.rejects
    for truth, side in ((below, gate.ends is not Ends.UPPER), (above, gate.ends is not Ends.LOWER)):
        if truth is None:
            # one end has no claim, or even a share of all or none is not told from the stated one
            assert not side or passing(gate, 0.0 if gate.stated < 0.5 else 1.0) > 1 - REJECTS
        else:
            assert side
            assert passing(gate, truth) == pytest.approx(1 - REJECTS, abs=1e-3)


def test_more_records_reject_more():
    few, many = (Gate(stated=0.95, records=n).rejects for n in (300, 1200))
    assert few[0] < many[0] < 0.95 < many[1] < few[1]


def test_cells_say_what_is_rejected():
    gate = Gate(stated=0.95, records=60)
    assert gate.columns() == {"gate": [50 / 60, 1.0], "rejects": "below 0.755"}  # 60 of 60 hold
    assert gate.holds(50 / 60, 1.0) and not gate.holds(49 / 60)
