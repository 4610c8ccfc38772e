# SPDX-License-Identifier: BSD-3-Clause
"""Answers of the 3458A that come late: none is ever taken for that of another question.

In a time that is only counted. The link delays each answer by any time and keeps their order, also across a device
clear and a new link; the meter answers each question with its own words.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import pytest

from allanite.acquisition.instruments import InstrumentTimeout
from allanite.acquisition.instruments.hp3458a import HP3458A, MeterSettings, prologix
from allanite.acquisition.instruments.hp3458a.conversation import Conversation
from allanite.acquisition.instruments.hp3458a.prologix import PrologixTransport
from allanite.acquisition.instruments.hp3458a.simulated_meter import SimulatedIdentity, SimulatedMeter
from allanite.acquisition.instruments.hp3458a.simulator import SimulatedPrologix
from allanite.errors import InstrumentError
from virtual_meter import DelayingWire, VirtualAdapter, virtual_time

#: Each answer is one that no other question has.
IDENTITY = SimulatedIdentity(firmware="9,2", calibrations=104, calibration="UME 2026")
SETTINGS = MeterSettings(rate=32, readings_per_arm=64)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str]]:
    """Questions and the answers that were taken for theirs."""
    told: list[tuple[str, str]] = []
    ask = Conversation.ask

    def noted(self: Conversation, query: str, timeout: float | None = None) -> str:
        answer = ask(self, query, timeout)
        told.append((query, answer.strip()))
        return answer

    monkeypatch.setattr(Conversation, "ask", noted)
    return told


def delays_of(seed: int, count: int) -> Iterator[float]:
    """Most answers come soon, some late, some very late; then all of them soon."""
    rng = np.random.default_rng(seed)
    late = rng.random(count) < rng.choice([0.02, 0.1, 0.5])
    seconds = np.where(late, 10.0 ** rng.uniform(-1, 1.5, count), 1e-3)
    return itertools.chain(seconds.tolist(), itertools.repeat(1e-3))


def true_answers(asked: list[tuple[str, str]]) -> dict[str, str]:
    """What the meter says where nothing is late."""
    with virtual_time() as clock:
        meter = SimulatedMeter(identity=IDENTITY)
        HP3458A(lambda: DelayingWire(meter, clock, 0.0), SETTINGS).open()
    told = dict(asked)
    asked.clear()
    assert len(told) == 24 and told["ID?"] == "HP3458A" and told["TEMP?"] == "36.4"
    return told


@pytest.mark.parametrize("seed", range(60))
def test_no_answer_is_ever_that_of_another_question(seed: int, asked: list[tuple[str, str]]) -> None:
    truth = true_answers(asked)
    with virtual_time() as clock:
        wire = DelayingWire(SimulatedMeter(identity=IDENTITY), clock, 0.0, delays=delays_of(seed, 60))
        instrument = HP3458A(lambda: wire, SETTINGS)
        identity = None
        for _ in range(100):
            try:
                identity = instrument.open()
            except InstrumentError:
                continue
            break
        assert identity is not None
        assert (identity.serial, identity.firmware) in {("CALNUM 104 UME 2026", "9,2"), ("CALNUM 104", "9,2")}
        instrument.start()
        wire.delays = delays_of(seed + 1000, 40)
        opened = len(asked)
        for _ in range(200):
            if ("TEMP?", truth["TEMP?"]) in asked[opened:]:  # armed anew
                break
            try:
                instrument.read(2.0)
            except InstrumentTimeout:
                continue
            except InstrumentError:
                break
    wrong = [(query, answer) for query, answer in asked if truth[query] != answer]
    assert not wrong


@pytest.mark.parametrize("seed", range(12))
def test_no_answer_is_ever_that_of_another_question_behind_an_adapter(
    seed: int, asked: list[tuple[str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    truth = true_answers(asked)
    monkeypatch.setattr(prologix, "READ_TIMEOUT_MS", 300)
    with virtual_time() as clock:
        door = SimulatedPrologix(SimulatedMeter(identity=IDENTITY))
        adapter = VirtualAdapter(door, clock, delays=delays_of(seed, 40))
        instrument = HP3458A(lambda: PrologixTransport(adapter, 22), SETTINGS)
        opened = False
        for _ in range(100):
            try:
                opened = bool(instrument.open())
            except InstrumentError:
                continue
            break
        assert opened
    wrong = [(query, answer) for query, answer in asked if truth[query] != answer]
    assert not wrong


def test_the_late_text_of_the_laboratory_is_no_count_of_errors() -> None:
    """The one question that may go unanswered: its answer comes during the next one."""
    with virtual_time() as clock:
        soon = itertools.repeat(1e-3)
        late = itertools.chain([1e-3] * 4, [1.5], soon)  # NRDGS?, ID?, REV?, CALNUM?; then CALSTR?
        wire = DelayingWire(SimulatedMeter(identity=IDENTITY), clock, 0.0, delays=late)
        instrument = HP3458A(lambda: wire, SETTINGS)
        assert instrument.open().serial == "CALNUM 104"
        assert instrument.settings["errors"] == '0,"NO ERROR"'
        assert not wire._on_way


def test_a_link_on_which_something_else_talks_is_refused_in_time() -> None:
    class Chatter(DelayingWire):
        def read_line(self, timeout: float) -> bytes:
            self.clock.pass_by(0.1)
            return b"+1.00000000E+00\r\n"

    with virtual_time() as clock:
        began = clock.ns
        wire = Chatter(SimulatedMeter(identity=IDENTITY), clock, 0.0)
        with pytest.raises(InstrumentError, match="does another program use this line"):
            HP3458A(lambda: wire, SETTINGS).open()
        assert (clock.ns - began) * 1e-9 < 30


def test_what_another_program_left_is_not_the_name_of_an_adapter() -> None:
    with virtual_time() as clock:
        door = SimulatedPrologix(SimulatedMeter())
        adapter = VirtualAdapter(door, clock)
        adapter._on_way.append((0, b"AR488\r\n"))  # half an answer of yesterday
        transport = PrologixTransport(adapter, 22)
        assert transport.version == SimulatedPrologix.VERSION
