# SPDX-License-Identifier: BSD-3-Clause
"""Faults that look alike: of each the right cause is said, and no other; what all channels show is one entry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from allanite.recording.cleaning import clean
from allanite.recording.health.catalogue import CATALOGUE, LOOK_ALIKES
from allanite.recording.health.examination import check
from allanite.recording.health.finding import Finding, Severity
from allanite.recording.records import Channel, Recording
from allanite.views.wording.findings import movement, said_of
from channel_faults import FAULTS
from noise_records import record

N = 2500
CASES = 5
HARMLESS = {"resolution_step"}


@pytest.mark.long
@pytest.mark.parametrize("name", FAULTS)
def test_the_right_cause_is_said_and_no_other(name: str) -> None:
    fault = FAULTS[name]
    for case in range(CASES):
        rng = np.random.default_rng([case, list(FAULTS).index(name)])
        said = {f.code for f in check(record(fault.make(rng, N)))}
        others = said - {fault.code} - fault.besides
        assert not others, (case, said)
        if fault.always:
            assert not fault.code or said & ({fault.code} | fault.besides), (case, said)


def test_codes_of_the_faults_are_in_the_catalogue() -> None:
    codes = {c for f in FAULTS.values() for c in (f.code, *f.besides) if c}
    assert codes <= set(CATALOGUE)


def test_every_finding_says_what_looks_like_it() -> None:
    assert set(LOOK_ALIKES) == set(CATALOGUE)


# -- six axes ---------------------------------------------------------------------------------------------

AXES = ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")
LEVELS = np.array([0.0, 0.0, 0.0, 0.0, 0.2, 9.78])


def six(rng: np.random.Generator, n: int = N) -> np.ndarray:
    return rng.standard_normal((n, 6)) * [0.05, 0.05, 0.05, 0.02, 0.02, 0.02] + LEVELS + 0.01


def of_six(y: np.ndarray) -> Recording:
    mixed = Recording.from_rate(y, rate=100.0, unit="deg/s", names=list(AXES))
    channels = tuple(Channel.of(name, "deg/s" if name.startswith("gyro") else "m/s^2") for name in AXES)
    return replace(mixed, channels=channels)


def codes(recording: Recording) -> dict[str, list[Finding]]:
    found: dict[str, list[Finding]] = {}
    for f in check(recording):
        if f.code not in HARMLESS:
            found.setdefault(f.code, []).append(f)
    return found


@pytest.mark.long
@pytest.mark.parametrize("isolated", [True, False])
@pytest.mark.parametrize("step", [0.0, 0.02])
def test_rows_of_zeros_go_from_all_channels_by_one_repair(
    rng: np.random.Generator, isolated: bool, step: float
) -> None:
    y = np.round(six(rng) / step) * step if step else six(rng)
    rows = rng.choice(N, 45, replace=False) if isolated else np.arange(900, 1200)
    y[rows] = 0.0
    found = codes(of_six(y))
    assert set(found) <= {"zero_filled", "quantisation"}
    assert {f.channel for f in found["zero_filled"]} in ({None}, set(AXES))
    fixed = clean(of_six(y), "drop_padding")
    for name in AXES:
        gone = np.flatnonzero(np.isnan(fixed.values(name)))
        assert set(rows) <= set(gone)
        assert len(gone) <= len(rows) + (20 if step and name != "acc_z" else 0), name
    assert set(codes(fixed)) <= {"missing", "repaired", "quantisation"}


def test_a_frozen_tail_a_tail_of_zeros_and_lost_rows_need_one_repair(rng: np.random.Generator) -> None:
    y = six(rng)
    y[rng.choice(1500, 30, replace=False)] = 0.0
    y[1600:] = y[1600]
    y[2200:] = 0.0
    found = codes(of_six(y))
    assert set(found) == {"zero_filled", "stuck"}
    fixed = clean(of_six(y), ["drop_padding"])
    assert set(codes(fixed)) == {"missing", "repaired"}
    assert all(np.isnan(fixed.values(name)[1600:]).all() for name in AXES)


def test_a_coarse_axis_that_froze_with_the_others_is_cut_with_them(rng: np.random.Generator) -> None:
    y = six(rng)
    y[:, 0] = np.round(y[:, 0] / 0.04) * 0.04
    y[-9:] = y[-9]  # too short a run to tell on the coarse axis by itself
    frozen = codes(of_six(y))["stuck"]
    assert {f.channel for f in frozen} == set(AXES)


def test_zeros_of_one_axis_are_no_rows_of_zeros(rng: np.random.Generator) -> None:
    y = np.round(six(rng) / 0.05) * 0.05  # the gyros are 0 in a third of the rows
    y[rng.choice(N, 40, replace=False), 5] = 0.0
    found = codes(of_six(y))
    assert [f.channel for f in found["zero_filled"]] == ["acc_z"]


def test_one_wild_first_row_is_a_wild_first_row(rng: np.random.Generator) -> None:
    y = six(rng)
    y[0] = [1e5, -3e4, 2e6, 1e4, 5e3, 7e3]
    found = codes(of_six(y))
    assert set(found) == {"spikes"}
    assert all(f.message.startswith("the first sample is far from those after it") for f in found["spikes"])
    (entry,) = said_of(found["spikes"])
    assert entry.startswith("gyro_x, gyro_y, gyro_z, acc_x, acc_y and acc_z; gyro_")


def test_a_time_among_the_signals_is_named_and_the_way_out_is_the_other_channels(
    rng: np.random.Generator,
) -> None:
    y = six(rng)
    y[:, 0] = 0.01 * np.arange(N)
    (finding,) = codes(of_six(y))["only_grows"]
    assert finding.channel == "gyro_x"
    assert finding.advice == "read the log without it: --channels gyro_y,gyro_z,acc_x,acc_y,acc_z"
    y[:, 4] = np.nan  # an empty channel is no way out
    (finding,) = codes(of_six(y))["only_grows"]
    assert finding.advice == "read the log without it: --channels gyro_y,gyro_z,acc_x,acc_z"


@pytest.mark.parametrize("seed", range(4))
def test_a_unit_that_turned_has_no_short_gravity(seed: int) -> None:
    """The mean over attitudes is shorter than each: a wrong unit shows in the usual second, and is still named."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.15, 1.5) * np.clip((np.arange(N) / N - 0.3) * rng.uniform(2, 8), 0.0, 1.0)
    y = six(rng)
    y[:, 3:] = 0.02 * rng.standard_normal((N, 3))
    y[:, 3] += 9.80665 * np.sin(angle)
    y[:, 5] += 9.80665 * np.cos(angle)
    found = codes(of_six(y))
    assert set(found) & {"motion", "not_at_rest"} and "gravity" not in found
    y[:, 3:] /= 9.80665
    wrong = codes(of_six(y))
    if "not_at_rest" not in wrong:
        (finding,) = wrong["gravity"]
        assert "g labeled as m/s² would explain it" in finding.message


@pytest.mark.parametrize("name", ["x", "s", "gyro z", "the", "1"])
def test_what_is_said_of_one_channel_names_it(name: str) -> None:
    """Whatever it is called, a word of the sentence, a letter of it, and whether the message began with it or not."""
    for message in ("the samples are still", f"{name}: the samples are still"):
        one = Finding(
            code="stuck",
            severity=Severity.WARNING,
            channel=name,
            message=message,
            advice="",
            risk="",
            count=1,
        )
        assert said_of([one]) == [f"{name}: the samples are still"]


def test_motion_comes_before_everything_else(rng: np.random.Generator) -> None:
    y = six(rng)
    y[:, 0] = np.clip(y[:, 0], -0.05, 0.05)
    y[1200:, 3:] = np.roll(y[1200:, 3:], 1, axis=1)
    found = check(of_six(y))
    assert found[0].code in ("motion", "not_at_rest")
    assert "clipping" in {f.code for f in found}
    words = movement(found)
    assert words is not None
    assert words.startswith("The unit moved during this log")
    assert movement(check(of_six(six(rng)))) is None
