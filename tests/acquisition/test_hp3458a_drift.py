# SPDX-License-Identifier: BSD-3-Clause
"""A pause of the 3458A whose clock is not that of the host: the gap is as long as the pause, however long the run was.

The meter counts no reading, so that what is missing after a new arming or a new link comes from two clocks that
disagree by parts in ten thousand. The real driver and the simulated meter, in a time that is only counted.
"""

from __future__ import annotations

import numpy as np
import pytest

from allanite.acquisition.instruments import Block
from allanite.acquisition.instruments.hp3458a import HP3458A, MeterSettings
from allanite.errors import InstrumentError
from virtual_meter import SECOND, VirtualWire, virtual_wire

RATE = 32.0
PARTS = [-1e-4, 2e-5, 1e-4]


def opened(wire: VirtualWire, readings: int) -> HP3458A:
    meter = HP3458A(lambda: wire, MeterSettings(rate=RATE, readings_per_arm=readings), block=1.0)
    meter.open()
    meter.start()
    return meter


def around_the_mark(meter: HP3458A) -> tuple[Block, Block]:
    """The block before the first one with a mark, and that one."""
    before = after = meter.read(2.0)
    while not after.flags.any():
        before, after = after if len(after) else before, meter.read(2.0)
    return before, after


def gap_in(before: Block, after: Block) -> tuple[int, float]:
    """Readings missing by the counter, and by the instants at which the readings came."""
    assert before.counter is not None and after.counter is not None
    jump = int(after.counter[-1] - before.counter[-1]) - len(after)
    elapsed = (after.received_ns - before.received_ns) / SECOND
    return jump, elapsed * RATE - len(after)


@pytest.mark.parametrize("error", PARTS)
def test_a_new_arming_leaves_a_gap_as_long_as_it_took(error: float) -> None:
    with virtual_wire(error) as wire:
        meter = opened(wire, 60_000)  # drifts by up to six readings
        before, after = around_the_mark(meter)
        jump, true = gap_in(before, after)
        assert true > 5, "the settings are asked back meanwhile"
        assert after.gap_uncertainty is not None and 0.28 < after.gap_uncertainty < 0.4
        assert abs(jump - true) < 3 * after.gap_uncertainty
        assert any("armed again" in remark for remark in after.remarks)


@pytest.mark.parametrize("error", PARTS)
@pytest.mark.parametrize("away", [3.0, 3600.0])
def test_a_new_link_leaves_a_gap_as_long_as_it_was_away(error: float, away: float) -> None:
    with virtual_wire(error) as wire:
        meter = opened(wire, 10_000_000)
        for _ in range(1000):
            before = meter.read(2.0)
        wire.gone = True
        with pytest.raises(InstrumentError, match="the link is gone"):
            meter.read(2.0)
        meter.close()
        wire.clock.pass_by(away)
        wire.gone = False
        meter.open()
        meter.start()
        after = meter.read(2.0)
        # The meter's own clock says how many it would have made: in an hour that of the host is off by up to 12.
        jump, true = gap_in(before, after)
        true += (after.received_ns - before.received_ns) / SECOND * RATE * error
        assert after.gap_uncertainty is not None
        assert 0.28 < after.gap_uncertainty < (0.4 if away < 10 else 2.0)
        assert abs(jump - true) < 3 * after.gap_uncertainty
        assert jump == pytest.approx(away * RATE, abs=60)


def test_the_uncertainty_grows_with_the_pause_where_the_rate_is_not_known_yet() -> None:
    with virtual_wire(1e-4) as wire:
        meter = opened(wire, 10_000_000)
        for _ in range(20):  # too short to see the meter's clock drift
            before = meter.read(2.0)
        meter.close()
        wire.clock.pass_by(36_000.0)
        meter.open()
        meter.start()
        after = meter.read(2.0)
        jump, true = gap_in(before, after)
        true += 36_000.0 * RATE * 1e-4
        assert after.gap_uncertainty is not None and after.gap_uncertainty == pytest.approx(115, rel=0.1)
        assert abs(jump - true) < 2 * after.gap_uncertainty


@pytest.mark.long
def test_nothing_is_missing_while_the_clocks_drift_apart() -> None:
    for error in (-1e-4, 1e-4):
        with virtual_wire(error) as wire:
            meter = opened(wire, 10_000_000)
            blocks = [meter.read(2.0) for _ in range(1000)]
        counter = np.concatenate([b.counter for b in blocks if b.counter is not None])
        assert np.array_equal(counter, np.arange(len(counter)))
        assert not any(b.remarks or b.flags.any() for b in blocks)
