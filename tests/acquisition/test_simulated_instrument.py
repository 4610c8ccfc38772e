# SPDX-License-Identifier: BSD-3-Clause
"""The instrument that is none: one process without seams, at any speed."""

from __future__ import annotations

import json
import math
import threading
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

import allanite as al
import sample_study
from allanite.acquisition.instruments import Instrument, InstrumentTimeout
from allanite.acquisition.instruments.simulated import SimulatedInstrument
from allanite.errors import InputError, InstrumentError
from allanite.noise import Flicker, GaussMarkov, NoiseModel, Quantisation, Ramp, RandomWalk, Sinusoid, White

MODELS = {
    "gyro_x": NoiseModel.of(
        White(N=1e-4),
        Flicker(B=1e-5),
        RandomWalk(K=1e-6),
        GaussMarkov.from_sigma(1e-4, 10.0),
        Ramp(R=1e-8),
        Sinusoid(amplitude=1e-4, frequency=0.3),
    ),
    "gyro_y": NoiseModel.of(Quantisation(Q=1e-5)),
}


class Clock:
    """Time that stands still but for those who wait."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 1000.0
        monkeypatch.setattr(time, "monotonic", lambda: self.now)
        monkeypatch.setattr(time, "monotonic_ns", lambda: round(self.now * 1e9))
        monkeypatch.setattr(threading.Event, "wait", lambda event, seconds: self.sleep(seconds))

    def sleep(self, seconds: float) -> None:
        self.now += seconds


def started(**options: object) -> SimulatedInstrument:
    sensor = SimulatedInstrument(MODELS, **options)  # type: ignore[arg-type]
    sensor.open()
    sensor.start()
    return sensor


@pytest.mark.parametrize("sampling", ["mean", "point"])
def test_blocks_are_the_simulated_record_cut_in_pieces(
    sampling: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = Clock(monkeypatch)
    options = {"rate": 50.0, "seed": 3, "sampling": sampling, "unit": "deg/h", "duration": 200.0}
    whole = al.simulate(MODELS, **options)  # type: ignore[arg-type]
    sensor = started(**options)
    blocks = []
    for seconds in (0.02, 1.0, 0.3, 50.0, 148.68):
        clock.sleep(seconds)
        blocks.append(sensor.read(1.0))
    values = np.concatenate([block.values for block in blocks])[: whole.n_samples]
    assert len(values) == whole.n_samples
    for i, name in enumerate(MODELS):
        wanted = whole.values(name)
        np.testing.assert_allclose(values[:, i], wanted, rtol=0, atol=1e-13 * np.abs(wanted).max())
    counter = np.concatenate([block.counter for block in blocks if block.counter is not None])
    assert counter.tolist() == list(range(len(counter)))
    assert sensor.channels == whole.channels


def test_the_samples_do_not_depend_on_how_they_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    found = []
    for pace in (0.1, 0.77):
        sensor, parts = started(rate=100.0, seed=1), []
        while sum(map(len, parts)) < 1000:
            clock.sleep(pace)
            parts.append(sensor.read(1.0).values)
        found.append(np.concatenate(parts)[:1000])
    np.testing.assert_array_equal(*found)


def test_it_runs_at_its_rate_times_its_speed(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    sensor = started(rate=32.0, speed=10.0)
    begin = clock.now
    blocks = [sensor.read(1.0) for _ in range(50)]
    given = sum(map(len, blocks))
    assert given == pytest.approx((clock.now - begin) * 320, abs=2)
    # the clock of the samples is that of the sensor: their rate is 32 Hz, not 320
    gone = (blocks[-1].received_ns - blocks[0].received_ns) * 1e-9
    assert (given - len(blocks[0])) / gone == pytest.approx(32.0, rel=1e-9)


def test_a_late_reader_gets_all_in_blocks_of_bounded_size(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    sensor = SimulatedInstrument(NoiseModel.of(White(N=1.0)), rate=1e5)
    sensor.open()
    sensor.start()
    clock.sleep(7.0)
    sizes = [len(sensor.read(1.0)) for _ in range(3)]
    assert max(sizes) <= 1 << 18 and sum(sizes) >= 699_999


def test_stop_and_start_go_on_with_the_process(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    sensor = started(rate=100.0)
    first = sensor.read(1.0)
    sensor.stop()
    clock.sleep(3600.0)
    with pytest.raises(InstrumentError, match="not started"):
        sensor.read(1.0)
    sensor.start()
    second = sensor.read(1.0)
    assert first.counter is not None and second.counter is not None
    assert second.counter[0] == first.counter[-1] + 1 and len(second) < 20


def test_nothing_due_is_a_timeout() -> None:
    sensor = SimulatedInstrument(NoiseModel.of(White(N=1.0)), rate=0.1)
    with pytest.raises(InstrumentError, match=r"call open\(\)"):
        sensor.start()
    sensor.open()
    sensor.start()
    with pytest.raises(InstrumentTimeout, match=r"no sample was due within 0\.01 s"):
        sensor.read(0.01)
    sensor.close()
    sensor.close()


@pytest.mark.long
def test_as_fast_as_one_reads_memory_stays_the_same() -> None:
    sensor = started(rate=32.0, speed=math.inf)
    sensor.read(1.0)
    tracemalloc.start()
    sensor.read(1.0)
    _, one = tracemalloc.get_traced_memory()
    tracemalloc.reset_peak()
    for _ in range(5):
        sensor.read(1.0)
    left, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < one + 4_500_000 and left < 5_000_000  # one block of two channels more at most


def test_from_the_file_of_a_study_or_a_model(tmp_path: Path) -> None:
    document = sample_study.build()
    place = tmp_path / "study.json"
    place.write_text(json.dumps(document), encoding="utf-8")
    sensor = SimulatedInstrument.from_file(place, speed=1000.0)
    assert isinstance(sensor, Instrument)
    assert sensor.rate == document["recording"]["rate"]
    assert [c.name for c in sensor.channels] == [c["name"] for c in document["channels"]]
    words = SimulatedInstrument.from_file("N=0.3 deg/√h, B=5 deg/h", rate=5.0, unit="deg/h")
    assert words.channels[0].unit == "deg/h" and words.settings["seed"] == 0
    with pytest.raises(InputError, match="does not state a rate"):
        SimulatedInstrument.from_file("N=0.3 deg/√h")


def test_settings_make_the_same_samples_again() -> None:
    sensor = SimulatedInstrument(MODELS, rate=10.0, seed=7, speed=math.inf)
    told = json.loads(json.dumps(sensor.settings))
    models = {name: NoiseModel.from_json(model) for name, model in told["models"].items()}
    again = SimulatedInstrument(models, rate=told["rate"], seed=told["seed"], speed=math.inf)
    for one in (sensor, again):
        one.open()
        one.start()
    np.testing.assert_array_equal(sensor.read(1.0).values, again.read(1.0).values)


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan, True, "fast"])
def test_a_speed_that_makes_no_sense_is_refused(speed: object) -> None:
    with pytest.raises(InputError, match="speed must be a positive multiple"):
        SimulatedInstrument(MODELS, rate=1.0, speed=speed)  # type: ignore[arg-type]
