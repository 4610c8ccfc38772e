# SPDX-License-Identifier: BSD-3-Clause
"""A device that is set to another rate than the stated one is reported, and a busy host is not taken for one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from allanite.acquisition.capture import Stop, capture
from allanite.acquisition.capture.rate_watch import RateWatch
from allanite.commands.capture import captured_document
from allanite.files.store import open_run
from allanite.views.terminal.capture import show_captured
from scripted_instrument import QUICK, RATE, Scripted, block

SECONDS = 90


def taken(rate: float, numbers: np.ndarray, stamps: np.ndarray) -> float | None:
    stated = RateWatch(rate)
    for number, stamp in zip(numbers.tolist(), stamps.tolist(), strict=True):
        stated.take(number, round(stamp * 1e9))
    return stated.contradicted


@pytest.mark.parametrize("stated", [0.5, 32.0, 2000.0])
@pytest.mark.parametrize("ratio", [0.5, 0.98, 1.0, 1.005, 1.02, 2.0])
def test_another_rate_is_told_and_the_error_of_an_oscillator_is_not(stated: float, ratio: float) -> None:
    each = max(round(stated / 50), 1)  # samples of a block
    numbers = np.arange(each, 1 + max(SECONDS * stated * ratio, 60.0), each)
    jitter = np.random.default_rng(1).uniform(0.0, 0.03, len(numbers))
    found = taken(stated, numbers, numbers / (stated * ratio) + jitter)
    if abs(ratio - 1) < 0.01:
        assert found is None
    else:
        assert found == pytest.approx(stated * ratio, rel=0.005)


@pytest.mark.parametrize("stall", [0.2, 1.0, 5.0, 15.0])
@pytest.mark.parametrize("spread", [0.0, 0.002])
def test_a_stall_of_the_host_and_the_burst_after_it_contradict_no_rate(stall: float, spread: float) -> None:
    """`spread` [s]: from block to block of the burst."""
    numbers = np.arange(2, 100 * SECONDS, 2)
    due = numbers / 100.0
    for begun in np.arange(0.0, 40.0, 1.7):
        held = (due >= begun) & (due < begun + stall)
        stamps = np.where(held, begun + stall + spread * np.cumsum(held), due)
        assert taken(100.0, numbers, np.maximum.accumulate(stamps)) is None, begun


def test_an_interruption_begins_a_window_of_its_own() -> None:
    stated = RateWatch(100.0)
    for k in range(200):
        stated.take(100 * k, k * 500_000_000)
        if k % 30 == 29:
            stated.interrupt()
    assert stated.contradicted is None


@pytest.mark.parametrize("speed", [1.0, 0.5])
def test_a_run_at_another_rate_is_not_whole(
    speed: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    n = round(0.5 * RATE)
    arrived = [10**9 + round(k * 0.5 / speed * 1e9) for k in range(60)]
    script = [replace(block(n * k, n), received_ns=at) for k, at in enumerate(arrived)]
    events: list[str] = []
    done = capture(
        Scripted(script),
        tmp_path / "run",
        duration=30.0,
        patience=QUICK,
        happened=lambda kind, _: events.append(kind),
    )
    noted = [e for e in open_run(tmp_path / "run").manifest if e["kind"] == "rate"]
    show_captured(captured_document(done))
    said = " ".join(capsys.readouterr().out.split())
    if speed == 1.0:
        assert done.is_whole and not noted and "rate" not in events and "host's clock" not in said
        return
    assert not done.is_whole and events.count("rate") == 1
    assert [(e["stated"], e["measured"]) for e in noted] == [(100.0, 50.0)]
    assert said.startswith("Nothing is missing, but the rate is not the stated one.")
    assert "50 Hz by the host's clock, 100 Hz stated" in said


def test_a_run_that_is_stopped_without_a_sample_is_not_whole(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stop = Stop()
    stop.ask("SIGTERM")
    done = capture(Scripted([]), tmp_path / "run", patience=QUICK, stop=stop)
    assert (done.samples, done.is_whole, done.status) == (0, False, "abort")
    show_captured(captured_document(done))
    assert capsys.readouterr().out.startswith("No sample was recorded. Stopped by SIGTERM.")
