# SPDX-License-Identifier: BSD-3-Clause
"""The recorder as a process among others: stopped by the system in mid-run, and going on (row Q10 of the test battery).

The program itself records a simulated 3458A, whose readings tell which one they are. A bare socket keeps what is sent
meanwhile, and nothing may be missing; an adapter keeps one reading, and what is missing is a gap as long as the stop.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Literal

import numpy as np
from tests.virtual_meter import virtual_wire

from allanite.acquisition.instruments.hp3458a import HP3458A, MeterSettings
from allanite.acquisition.instruments.hp3458a.commands import LONGEST_COUNT
from allanite.acquisition.instruments.hp3458a.simulated_meter import SimulatedMeter
from allanite.acquisition.instruments.hp3458a.simulator import MeterSimulator
from allanite.files.store import open_run

__all__ = ["run_drift", "run_stopped"]

Json = dict[str, Any]
RATE = 32.0


def run_stopped(seconds: float = 3.0) -> list[Json]:
    """A recorder that stands still for so long [s], behind a socket and behind an adapter."""
    return [_stopped("socket", seconds), _stopped("prologix", seconds)]


def run_drift(parts: tuple[float, ...] = (-1e-4, -2e-5, 0.0, 2e-5, 1e-4), share: float = 1.0) -> list[Json]:
    """A full count of a 3458A (six days at 32 Hz) whose clock is off by these parts, armed again at its end.

    The real driver and the simulated meter in a time that is only counted. `missing` is the gap by the counter, `true`
    by the instants of the readings around it.
    """
    return [_drifted(error, round(LONGEST_COUNT * share)) for error in parts]


def _drifted(error: float, readings: int) -> Json:
    with virtual_wire(error) as wire:
        settings = MeterSettings(rate=RATE, readings_per_arm=readings)
        meter = HP3458A(lambda: wire, settings, block=10.0)
        meter.open()
        meter.start()
        before = after = meter.read(20.0)
        unasked = 0
        while not any("armed again" in remark for remark in after.remarks):
            before, after = after if len(after) else before, meter.read(20.0)
            unasked += bool(after.remarks) and "armed again" not in after.remarks[0]
    assert before.counter is not None and after.counter is not None
    elapsed = (after.received_ns - before.received_ns) * 1e-9
    return {
        "clock_off_ppm": 1e6 * error,
        "readings": readings,
        "missing": int(after.counter[-1] - before.counter[-1]) - len(after),
        "true": elapsed * RATE * (1 + error) - len(after),
        "uncertainty": after.gap_uncertainty,
        "false_gaps": unasked,
    }


def _stopped(door: Literal["socket", "prologix"], seconds: float) -> Json:
    with tempfile.TemporaryDirectory() as name, MeterSimulator(SimulatedMeter(), door) as simulator:
        words = ["record", "3458a", "--resource", simulator.resource, "--rate", f"{RATE:g}", "--out", name]
        length = ["--duration", f"{seconds + 6:g}", "--json"]
        program = subprocess.Popen(
            [sys.executable, "-m", "allanite", *words, *length], stdout=subprocess.DEVNULL
        )
        deadline = time.monotonic() + 60
        while simulator.meter.index < 2 * RATE and time.monotonic() < deadline:
            time.sleep(0.01)
        os.kill(program.pid, signal.SIGSTOP)
        time.sleep(seconds)
        os.kill(program.pid, signal.SIGCONT)
        code = program.wait(60)
        (folder,) = Path(name).iterdir()
        run = open_run(folder)
        batches = list(run.batches())
    counter = np.concatenate([b.counter for b in batches])
    made = np.round(np.concatenate([b.values[:, 0] for b in batches]) * 1e6).astype(np.int64)
    gaps = [event for event in run.manifest if event["kind"] == "gap"]
    return {
        "door": door,
        "stopped_s": seconds,
        "exit_code": code,
        "samples": len(counter),
        "missing": sum(gap["samples"] for gap in gaps),
        "missing_s": sum(gap["samples"] for gap in gaps) / RATE,
        "repeated": int(np.count_nonzero(np.diff(made) <= 0)),
        "farthest_from_its_number": int(np.abs(counter - made).max()),
        "reasons": "; ".join(sorted({gap["reason"] for gap in gaps})),
    }
