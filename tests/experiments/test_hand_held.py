# SPDX-License-Identifier: BSD-3-Clause
"""Calibration of a unit that a hand holds: rests found, intervals that repeat, and verdicts that contradict.

Coverage over 1200 records: `python -m verification "hand-held calibration"`.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom, chi2

from allanite.errors import DataQualityError
from allanite.experiments.calibration import adjustment, calibrate, estimation
from allanite.experiments.calibration.adjustment import solution
from allanite.experiments.static_spans import StaticSpans, find_held_spans, find_rests
from allanite.recording.records import Recording
from allanite.recording.sample_columns import ArrayColumn

verification = pytest.importorskip("verification.hand_held", reason="not in the source package")
from verification.hand_held import LATITUDE, G, Hand, HeldRecord, held_record  # noqa: E402
from verification.hand_held_calibration import repeats  # noqa: E402

PLACE: dict[str, Any] = {"latitude": LATITUDE, "gravity": G}
#: Short records: a dozen rests of 2 to 3.5 s.
SHORT = Hand(rests=(12, 12), length=(2.0, 3.5), drops=2)
#: The same put down: nothing moves between the turns.
DOWN = replace(SHORT, wander=0.0, tremor=0.0, sway=0.0, shake=0.0, unsteady=0.0, length=(3.0, 4.0))


def changed(made: HeldRecord, name: str, start: int, stop: int, by: float) -> Recording:
    """The record with something added to a channel."""
    record = made.recording
    k = record.index(name)
    samples = np.array(record.values(name))
    samples[start:stop] += by
    return replace(record, columns=(*record.columns[:k], ArrayColumn(samples), *record.columns[k + 1 :]))


def within(found: StaticSpans, made: HeldRecord) -> list[int]:
    """Number of the rest that holds each span; -1: none does."""
    slack = round(0.1 * found.rate)
    inside = (found.array[:, None, 0] >= made.rests[None, :, 0] - slack) & (
        found.array[:, None, 1] <= made.rests[None, :, 1] + slack
    )
    return [int(row.argmax()) if row.any() else -1 for row in inside]


# -- rests ------------------------------------------------------------------------------------------------------


def test_steady_rests_are_found_with_gyros_as_well_as_without() -> None:
    """With gyros every steady rest of 1.2 s and more, none held eight times worse, no turn; without hardly fewer."""
    count = steady = 0
    for seed in range(4):
        made = held_record(seed)
        wanted = set(np.flatnonzero(made.steady).tolist()) - _cut_by_drops(made)
        found = {
            name: within(find_held_spans(made.recording, **without), made)
            for name, without in (("both", {}), ("gyros", {"accelerometer": ()}), ("forces", {"gyro": ()}))
        }
        assert wanted <= set(found["both"]), seed
        assert all(k >= 0 and made.steady[k] for k in found["both"]), seed
        for name in ("gyros", "forces"):
            assert sum(k < 0 or not made.steady[k] for k in found[name]) <= 1, (name, seed)
            count, steady = count + len(wanted & set(found[name])), steady + len(wanted)
    assert count >= 0.95 * steady


def _cut_by_drops(made: HeldRecord) -> set[int]:
    """Rests of which lost samples leave no piece long enough."""
    lost = np.isnan(made.recording.values("acc_x"))
    return {k for k, (a, b) in enumerate(made.rests) if lost[a:b].any() and b - a < 2 * made.recording.rate}


def test_the_threshold_is_that_of_the_record_and_is_said() -> None:
    restless = replace(SHORT, wander=2 * SHORT.wander, tremor=2 * SHORT.tremor)
    low, high = (find_rests(held_record(3, hand).recording) for hand in (SHORT, restless))
    assert high.floor["gyro_x"] / low.floor["gyro_x"] == pytest.approx(2, rel=0.15)
    assert f"{math.degrees(low.floor['gyro_x']):.2g} deg/s" in low.findings[0]
    assert "times as much as the usual rest of this record" in low.findings[0]
    assert StaticSpans.from_json(low.to_json()).held


def test_what_was_put_down_is_not_taken_for_held() -> None:
    for seed in range(3):
        made = held_record(seed, DOWN)
        found = find_rests(made.recording)
        assert not found.held and set(within(found, made)) == set(range(len(made.rests)))
        assert find_rests(held_record(seed, SHORT).recording).held


# -- what comes out -----------------------------------------------------------------------------------------------


def test_records_of_one_unit_agree_within_their_intervals() -> None:
    """Chi-square about the mean and coverage of the truth, each at 99.9 % for all parameters together.

    Eight records; twenty of each of sixty units: `verification`. One in eight may be taken away by its verdict.
    """
    hand = replace(SHORT, length=(1.5, 2.5))
    made = [held_record(seed, hand, unit=7) for seed in range(8)]
    found = [calibrate(m.recording, **PLACE) for m in made]
    standing = [f for f in found if f.verdict in ("calibrated", "partly calibrated")]
    assert len(standing) >= 7
    names = standing[0].calibration.names
    inside = 0
    for name in names:
        own = [p for f in standing for p in f.parameters if p.name == name and p.status == "estimated"]
        value, sd, dof = np.array([(p.value, p.sd, p.dof) for p in own]).T
        limit = chi2.ppf(1 - 1e-3 / len(names), len(own) - 1)
        assert repeats(value, sd, dof) < limit, name
        truth = made[0].values[name]
        hits = sum(p.interval[0] <= truth <= p.interval[1] for p in own)
        assert hits >= binom.ppf(1e-3 / len(names), len(own), 0.95), name
        inside += hits / len(own) / len(names)
    assert inside > 0.85  # parameters of one record go together: no law of their own


def test_a_direction_that_no_rest_covers_is_not_resolved() -> None:
    made = held_record(2, replace(SHORT, avoided=((0.0, 0.0, -1.0),)))
    found = calibrate(made.recording, **PLACE)
    assert made.up[:, 2].min() > -0.5
    assert found.verdict == "partly calibrated" and "no position has z down" in found.reason
    assert found.add == ("z down",)
    for kind in ("bias", "scale"):
        p = found[f"accelerometer.{kind}_z"]
        assert p.status == "not resolved" and p.advice == ("z down",)
        assert p.sd > 2 * found[f"accelerometer.{kind}_x"].sd
    assert found["accelerometer.bias_x"].status == "estimated"


@pytest.mark.parametrize("held", [True, False])
def test_a_position_that_contradicts_the_others_is_the_verdict(held: bool) -> None:
    made = held_record(4, SHORT if held else DOWN)
    a, b = made.rests[5]
    found = calibrate(changed(made, "acc_x", a, b, 0.6), **PLACE)
    assert found.verdict == "inconsistent" and "position" in found.reason
    assert any(
        f"position {p.number}" in found.reason for p in found.positions if a / 50 - 1 < p.start < b / 50
    )


def test_accelerometers_that_alone_say_something_else_are_the_verdict(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A bias moved by 0.1 m/s², which twenty rests tell by the length of gravity; not moved: no alarm."""
    made = held_record(5)
    sound = calibrate(made.recording, **PLACE)
    assert sound.verdict == "calibrated"
    assert [c.name for c in sound.checks] == ["accelerometers alone"] and sound.checks[0].passed

    def moved(*arguments: Any, **options: Any) -> adjustment.Adjustment:
        fit = adjustment.adjust(*arguments, **options)
        values = fit.solution.state.values.copy()
        values[fit.observed.names.index("accelerometer.bias_z")] += 0.1
        state = replace(fit.solution.state, values=values)
        return replace(fit, solution=replace(fit.solution, state=state))

    monkeypatch.setattr(estimation, "adjust", moved)
    found = calibrate(made.recording, **PLACE)
    assert not found.checks[0].passed
    assert found.verdict == "inconsistent" and "accelerometers alone" in found.reason


def test_a_fit_that_does_not_settle_gives_no_parameters(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solution, "STEPS", 1)
    with pytest.raises(DataQualityError, match="does not settle, so there are no parameters"):
        calibrate(held_record(6, SHORT).recording, **PLACE)
