# SPDX-License-Identifier: BSD-3-Clause
"""Phase and frequency of clocks: the tables of SP 1065, units, and a phase that is not taken for time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import allanite as al
from allanite.errors import InputError
from allanite.noise.allan.interval_error import interval_error
from allanite.recording.clock_channels import clock_recording
from allanite.recording.records import Kind
from shell import Run

#: NBS Monograph 140: nine frequencies, ten points of phase (their mean taken off).
TEN = np.concatenate(([0.0], np.cumsum(np.array([892, 809, 823, 798, 671, 644, 883, 903, 677]) - 7100 / 9)))


def thousand() -> NDArray[np.float64]:
    """The thousand frequencies of SP 1065, section 12.4."""
    n, y = 1234567890, []
    for _ in range(1000):
        y.append(n / 2147483647)
        n = 16807 * n % 2147483647
    return np.array(y)


#: SP 1065, section 12 (Tables 30 and 31), recomputed to ten digits.
PUBLISHED: dict[str, tuple[dict[int, float], dict[int, float]]] = {
    "adev": ({1: 91.22944974, 2: 115.8082107}, {1: 0.2922318781, 10: 0.09965736063, 100: 0.03897804331}),
    "oadev": ({1: 91.22944974, 2: 85.95286984}, {1: 0.2922318781, 10: 0.09159953420, 100: 0.03241343026}),
    "mdev": ({1: 91.22944974, 2: 74.78849343}, {1: 0.2922318781, 10: 0.06172376382, 100: 0.02170920914}),
    "tdev": ({1: 52.67134737, 2: 86.35831363}, {1: 0.1687201535, 10: 0.3563623166, 100: 1.253381774}),
    "hdev": ({1: 70.80607319, 2: 116.7979916}, {1: 0.2943883291, 10: 0.1052754194, 100: 0.03910860560}),
    "ohdev": ({1: 70.80607319, 2: 85.61487166}, {1: 0.2943883291, 10: 0.09581083173, 100: 0.03237638253}),
    "totdev": ({1: 91.22944974, 2: 93.90379053}, {1: 0.2922318781, 10: 0.09134743262, 100: 0.03406530252}),
}
UNITS = (
    ("s", 1.0, None),
    ("ns", 1e-9, None),
    ("ps", 1e-12, None),
    ("cycles", 1e-7, 1e7),
    ("rad", 1e-7 / 2 / np.pi, 1e7),
)


@pytest.mark.parametrize("statistic", PUBLISHED)
def test_published_tables_from_phase_and_from_frequency(statistic: str) -> None:
    ten, long = PUBLISHED[statistic]
    y = thousand()
    x = np.concatenate(([0.0], np.cumsum(y)))
    for unit, second, carrier in UNITS:
        phase = clock_recording(TEN / second, rate=1.0, kind="phase", unit=unit, carrier=carrier)
        found = al.allan_curve(phase, statistic=statistic, taus=[float(m) for m in ten])
        np.testing.assert_allclose(found.deviation[:, 0], list(ten.values()), rtol=1e-8)
        phase = clock_recording(x / second, rate=1.0, kind="phase", unit=unit, carrier=carrier)
        found = al.allan_curve(phase, statistic=statistic, taus=[float(m) for m in long])
        np.testing.assert_allclose(found.deviation[:, 0], list(long.values()), rtol=1e-8)
        assert found.n_samples == 1000
    for samples, unit, carrier in ((y, "1", None), (y * 1e6, "ppm", None), (y * 1e9, "ppb", None),
                                   (y * 1e12, "1e-12", None), (1e3 * (1 + y), "Hz", 1e3)):  # fmt: skip
        recording = clock_recording(samples, rate=1.0, kind="frequency", unit=unit, carrier=carrier)
        found = al.allan_curve(recording, statistic=statistic, taus=[float(m) for m in long])
        np.testing.assert_allclose(found.deviation[:, 0], list(long.values()), rtol=1e-8)
    assert recording.values("frequency") * recording["frequency"].scale == pytest.approx(y, abs=1e-12)


@pytest.mark.parametrize(
    ("kind", "unit", "says"),
    [
        ("phase", "ns", "phase of a clock"),
        (None, "deg", "an angle that changes"),
        (None, "m/s", "a velocity that"),
        (None, "deg/s", ""),
    ],
)
def test_stamps_that_scatter_are_spoken_of_in_the_terms_of_the_record(
    kind: str | None, unit: str, says: str, tmp_path: Path
) -> None:
    rng = np.random.default_rng(4)
    rows = np.column_stack([np.arange(900) + rng.normal(0, 0.1, 900), np.cumsum(rng.normal(0, 1, 900))])
    path = tmp_path / "log.csv"
    np.savetxt(path, rows, delimiter=",", header=f"time [s],y [{unit}]", comments="", fmt="%.12g")
    found = al.check(al.read(path, unit=unit, **({"kind": kind} if kind else {})))
    (jitter,) = (f for f in found if f.code == "rate_jitter")
    assert says in jitter.message and ("shows this as noise" in jitter.message) == bool(says)
    assert ("sensor" in jitter.advice) == (kind is None)


def test_a_steady_rise_is_not_taken_for_steps_of_the_counter() -> None:
    for noise in (0.03, 1.0):
        x = 40.0 * np.arange(2000) + noise * np.random.default_rng(2).standard_normal(2000)
        found = al.check(clock_recording(x, rate=1.0, kind="phase", unit="ns"))
        assert not {"quantisation_not_white", "resolution_step"} & {f.code for f in found}
    steps = np.round(0.1 * x / 10.0) * 10.0  # a counter that does have steps
    found = al.check(clock_recording(steps, rate=1.0, kind="phase", unit="ns"))
    assert "quantisation_not_white" in {f.code for f in found}


def test_the_column_of_time_may_be_named(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    x = np.random.default_rng(1).standard_normal(50)
    rows = [f"{40.0 * i + v:.6f},{20 * i},{v:.6f}" for i, v in enumerate(x)]
    path.write_text("\n".join(["a,cnt,b", *rows]) + "\n")
    both = al.read(path, kind="phase", unit="ns", time="cnt:ms")
    assert both.names == ("a", "b") and both.rate == pytest.approx(50.0)
    assert len(al.read(path, kind="phase", unit="ns", time="2:ms").names) == 2
    assert len(al.read(path, kind="phase", unit="ns", time="none", rate=1.0).names) >= 2


HEADINGS = ["phase [ns]", "time interval (ns)", "TIE_ns", "x", "time_error [ns]"]
COLUMNS = [
    ("", ""),
    ("first", ""),
    *((t, h) for t in ("none", "time", "MJD", "Time (UTC)") for h in HEADINGS),
]


@pytest.mark.parametrize(("time", "heading"), COLUMNS)
def test_a_phase_that_rises_is_not_taken_for_time(time: str, heading: str, tmp_path: Path) -> None:
    x = 40.0 * np.arange(300) + np.random.default_rng(1).standard_normal(
        300
    )  # 4e-8 of drift: as even as time
    seconds = np.arange(300) * 10.0
    dates = np.datetime64("2026-01-01T00:00:00") + seconds.astype("timedelta64[s]")
    first = {"MJD": 60000 + seconds / 86400, "Time (UTC)": dates}.get(time, seconds)
    timed = time not in ("", "none")
    lines = [",".join([time, heading] if timed else [heading])] if heading else []
    times = [f"{t:.9f}" if isinstance(t, float) else str(t) for t in first] if timed else [None] * 300
    lines += [f"{v:.9f}" if t is None else f"{t},{v:.9f}" for t, v in zip(times, x, strict=True)]
    path = tmp_path / "x.csv"
    path.write_text("\n".join(lines) + "\n")
    rate = None if timed else 0.1
    known = heading.endswith(("]", ")")) or (
        timed and "ns" in heading
    )  # a header of one column needs its brackets
    recording = al.read(path, kind="phase", unit=None if known else "ns", rate=rate)
    assert len(recording.channels) == 1 and recording.channels[0].kind is Kind.PHASE
    assert recording.rate == pytest.approx(0.1, rel=1e-5) and recording.n_samples == 300
    scale = recording.channels[0].scale
    np.testing.assert_allclose(recording.values(recording.names[0]) * scale, x * 1e-9, rtol=1e-9)


def test_interval_errors_of_the_published_set(tmp_path: Path, run: Run) -> None:
    wanted = {"tierms": ([95.20205932, 135.4697873], [9, 8]), "mtie": ([144.8888889, 262.7777778], [9, 8])}
    phase = clock_recording(TEN, rate=1.0, kind="phase", unit="s")
    for statistic, (values, terms) in wanted.items():
        (found,) = interval_error(phase, statistic=statistic, taus=[1.0, 2.0])
        np.testing.assert_allclose(found.error, values, rtol=1e-8)
        assert found.count.tolist() == terms
    path = tmp_path / "x.txt"
    np.savetxt(path, TEN)
    done = run("allan", str(path), "--kind", "phase", "--unit", "s", "--rate", "1", "--statistic", "mtie")
    assert done.code == 0 and "144.89" in done.out
    assert run("allan", str(path), "--unit", "deg/s", "--rate", "1", "--statistic", "mtie").code == 1


def test_interval_errors_are_those_of_their_definition_with_gaps() -> None:
    rng = np.random.default_rng(5)
    for _ in range(40):
        x = np.cumsum(rng.standard_normal(int(rng.integers(5, 60))))
        x[rng.random(len(x)) < 0.05] = np.nan
        x[0] = 0.0
        record = clock_recording(x, rate=2.0, kind="phase", unit="s")
        lags = np.arange(1, len(x))
        (most,) = interval_error(record, statistic="mtie", taus=lags / 2.0)
        (rms,) = interval_error(record, statistic="tierms", taus=lags / 2.0)
        for m, peak, root in zip(lags, most.error, rms.error, strict=True):
            windows = [np.ptp(x[i : i + m + 1]) for i in range(len(x) - m)]
            whole = [w for w in windows if np.isfinite(w)]
            assert peak == pytest.approx(max(whole)) if whole else np.isnan(peak)
            steps = (x[m:] - x[:-m])[np.isfinite(x[m:] - x[:-m])]
            assert root == pytest.approx(np.sqrt(np.mean(steps**2))) if len(steps) else np.isnan(root)


def refused() -> dict[str, Callable[[Path], object]]:
    return {
        "the unit of the phase": lambda p: al.read(p, kind="phase", rate=1.0),
        "frequency of the carrier": lambda p: al.read(p, kind="phase", rate=1.0, unit="cycles"),
        "a phase is in s, ns": lambda p: al.read(p, kind="phase", rate=1.0, unit="V"),
        "a fractional frequency is in": lambda p: al.read(p, kind="frequency", rate=1.0, unit="g"),
        "kind must be": lambda p: al.read(p, kind="rate", rate=1.0, unit="s"),
        "goes with --kind": lambda p: al.read(p, carrier=1e7, rate=1.0),
        "above zero": lambda p: al.read(p, kind="phase", carrier=-1.0, rate=1.0, unit="cycles"),
        "no scale factor": lambda p: al.read(p, kind="phase", rate=1.0, unit="s", scale_factor="1 V/g"),
    }


@pytest.mark.parametrize("words", refused())
def test_what_is_not_known_is_asked_for(words: str, tmp_path: Path) -> None:
    path = tmp_path / "x.txt"
    path.write_text("\n".join(f"{v:.6f}" for v in np.random.default_rng(1).standard_normal(50)))
    with pytest.raises(InputError, match=words):
        refused()[words](path)


@pytest.mark.long
def test_terms_have_the_names_of_time_and_frequency(tmp_path: Path, run: Run) -> None:
    rng = np.random.default_rng(4)
    x = 1e-10 * rng.standard_normal(8001) + 3e-12 * np.concatenate(
        ([0.0], np.cumsum(rng.standard_normal(8000)))
    )
    path = tmp_path / "x.txt"
    np.savetxt(path, x * 1e9)
    model = al.fit(al.allan_curve(al.read(path, kind="phase", unit="ns", rate=1.0)))
    found = {e.symbol: e for e in model.estimates}
    assert found["Q"].lower < 1e-10 < found["Q"].upper and found["N"].lower < 3e-12 < found["N"].upper
    done = run(
        "characterize",
        str(path),
        "--kind",
        "phase",
        "--unit",
        "ns",
        "--rate",
        "1",
        "--out",
        str(tmp_path / "r"),
    )
    assert done.code == 0, done.err
    for words in ("Clock", "N, WFM [1/√Hz]", "Q, WPM [s]", "FPM"):
        assert words in " ".join(done.out.split()), done.out
    report = (tmp_path / "r" / "report.html").read_text(encoding="utf-8")
    assert (
        "white phase noise" in report
        and "angle" not in report.split("<body", 1)[1].split("<script", 1)[0].lower()
    )


def test_a_counter_of_one_pulse_a_second(real_data: Callable[[str], Path]) -> None:
    path = real_data("allantools_stable32/Keysight53230A_ti_noise_floor/tic_phase.txt")
    recording = al.read(path, kind="phase", unit="s", rate=1.0)
    curve = al.allan_curve(recording, taus=[1.0, 2.0, 4.0])
    np.testing.assert_allclose(curve.deviation[:, 0], [1.7702e-11, 8.9106e-12, 4.4374e-12], rtol=1e-4)
