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
from allanite.experiments.calibration import adjustment, calibrate, calibrate_means, estimation
from allanite.experiments.calibration.adjustment import solution
from allanite.experiments.calibration.adjustment.interval_noise import model_beside_motion
from allanite.experiments.calibration.adjustment.scatter import Contrasts, Sizes, _upper_sizes
from allanite.experiments.calibration.adjustment.turning import TurningSamples
from allanite.experiments.calibration.results import CalibrationEstimate
from allanite.experiments.calibration.verdict import ParameterNeed
from allanite.experiments.static_spans import PositionMeans, StaticSpans, find_held_spans, find_rests
from allanite.noise import White
from allanite.recording.calibration import GYRO, errors_of
from allanite.recording.records import Recording
from allanite.recording.sample_columns import ArrayColumn

verification = pytest.importorskip("verification.hand_held", reason="not in the source package")
from verification.hand_held import LATITUDE, NAMES, G, Hand, HeldRecord, held_record  # noqa: E402
from verification.hand_held_calibration import repeats  # noqa: E402

PLACE: dict[str, Any] = {"latitude": LATITUDE, "gravity": G}
#: Short records: a dozen rests of 2 to 3.5 s.
SHORT = Hand(rests=(12, 12), length=(2.0, 3.5), drops=2)
#: Ten rests, of some of which lost samples take the turns away.
TEN = replace(SHORT, rests=(10, 10), length=(2.0, 3.0))
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


@pytest.mark.long
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


@pytest.mark.long
def test_what_was_put_down_is_not_taken_for_held() -> None:
    for seed in range(3):
        made = held_record(seed, DOWN)
        found = find_rests(made.recording)
        assert not found.held and set(within(found, made)) == set(range(len(made.rests)))
        assert find_rests(held_record(seed, SHORT).recording).held


# -- noise ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("seconds", "within"), [(0.4, 0.4), (1.2, 0.1), (4.0, 0.05)])
def test_a_tremor_is_not_taken_for_white_noise(seconds: float, within: float) -> None:
    """Of 8 to 12 Hz and 25 times the noise, at 50 Hz; spans of 20 samples tell N as well, if less sharply."""
    rng, noise, dt = np.random.default_rng(5), 8e-4, 0.02
    t = np.arange(round(seconds / dt)) * dt
    spans = []
    for _ in range(100):
        wave = np.sin(2 * np.pi * (rng.uniform(8, 12, (6, 1)) * t + rng.uniform(size=(6, 1)))).sum(axis=0)
        spans.append(0.012 * wave + noise * rng.standard_normal(len(t)))
    model = model_beside_motion(spans, dt)
    assert model is not None
    white = model.terms[0]
    assert isinstance(white, White)
    assert white.N == pytest.approx(noise * math.sqrt(dt), rel=within)


def test_turns_that_share_a_rest_share_its_noise() -> None:
    """Two turns one after the other have the noise of one turn from the first rest to the last, exactly."""
    rest, turn = 40, 25
    rise = (np.arange(rest) + 0.5) / rest
    still, moves = np.zeros((rest, 3)), np.tile([1.0, -0.7, 2.0], (turn, 1))
    y = [still, moves, still, 1.5 * moves[:, ::-1], still]
    ones = np.ones(turn)
    apart = TurningSamples(
        y=np.concatenate([*y[:3], *y[2:]]),
        warmer=np.zeros(4 * rest + 2 * turn),
        edges=np.array([0, 2 * rest + turn, 4 * rest + 2 * turn]),
        dt=np.full(2, 0.02),
        weight=np.concatenate([rise, ones, 1 - rise, rise, ones, 1 - rise]),
        shared=np.array([0, rest]),
    )
    whole = TurningSamples(
        y=np.concatenate(y),
        warmer=np.zeros(3 * rest + 2 * turn),
        edges=np.array([0, 3 * rest + 2 * turn]),
        dt=np.array([0.02]),
        weight=np.concatenate([rise, ones, np.ones(rest), ones, 1 - rise]),
    )
    errors, density = errors_of({}, GYRO), np.array([1.0, 2.0, 5.0])
    both = np.hstack([np.eye(3), apart.integrate(errors).rotation[0]])
    np.testing.assert_allclose(
        both @ apart.white(errors, density) @ both.T, whole.white(errors, density), rtol=1e-9, atol=1e-12
    )


@pytest.mark.long
def test_samples_are_shared_by_turns_that_follow_each_other_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    caught: list[adjustment.Adjustment] = []

    def kept(*arguments: Any, **options: Any) -> adjustment.Adjustment:
        caught.append(adjustment.adjust(*arguments, **options))
        return caught[-1]

    monkeypatch.setattr(estimation, "adjust", kept)
    for hand in (SHORT, DOWN):
        calibrate(held_record(1, hand).recording, **PLACE)
    held, down = (fit.observed for fit in caught)
    turning = held.turning
    assert isinstance(turning, TurningSamples) and turning.shared is not None
    follows = np.append(False, held.before[1:] == held.after[:-1])
    assert follows.any() and not follows[1:].all()  # lost samples have taken turns away
    np.testing.assert_array_equal(turning.shared > 0, follows)
    for begin, count in zip(turning.edges[:-1], turning.shared, strict=True):
        np.testing.assert_array_equal(
            turning.y[begin : begin + count], turning.y[begin - count : begin] if count else turning.y[:0]
        )
    assert isinstance(down.turning, TurningSamples) and down.turning.shared is None


# -- what comes out -----------------------------------------------------------------------------------------------


@pytest.mark.long
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


@pytest.mark.long
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


@pytest.mark.long
def test_few_rests_give_intervals_that_are_numbers_and_hold() -> None:
    """Ten rests hardly tell how far they scatter: Student's law then has next to no degrees of freedom.

    No interval is wider than what is known of any unit, none of that width counts as estimated, and they
    cover at 99.9 %.
    """
    limits = dict(zip(NAMES, 1.96 * adjustment.plausible_of(NAMES), strict=True))
    hits = count = hardly = 0
    for seed in range(1, 7):
        made = held_record(seed, TEN)
        found = calibrate(made.recording, **PLACE)
        for p in found.parameters:
            half = (p.interval[1] - p.interval[0]) / 2
            assert half <= 1.001 * limits[p.name], (seed, p)
            assert half < 0.999 * limits[p.name] or p.status != "estimated", (seed, p)
            hardly += p.status == "estimated" and p.dof < 0.3
            if p.status == "estimated":
                hits, count = hits + (p.interval[0] <= made.values[p.name] <= p.interval[1]), count + 1
        if any(p.status == "not resolved" for p in found.parameters):
            assert found.verdict == "partly calibrated"
            assert ParameterNeed.POSITIONS.words in found.advice or "no position has" in found.reason
    assert hardly > 5  # else these records test nothing
    assert hits >= binom.ppf(1e-3, count, 0.95)


def test_upper_limit_of_a_scatter_is_where_the_likelihood_has_fallen() -> None:
    """Of c contrasts with one size beyond a noise of one: (c log v + S / v) / 2 in closed form."""
    rng = np.random.default_rng(3)
    for c, sd in ((3, 1.0), (12, 2.0), (40, 5.0)):
        seen = sd * rng.standard_normal(c)
        contrasts = Contrasts(basis=np.eye(c), noise=np.eye(c), values=seen)
        size = 0.7 * sd
        limit = _upper_sizes(contrasts, {"x": np.eye(c)}, Sizes(values={"x": size}), 0.95)["x"]
        begin, end = 1 + size**2, 1 + limit**2
        fall = 0.5 * (c * math.log(end / begin) + float(seen @ seen) * (1 / end - 1 / begin))
        assert fall == pytest.approx(chi2.ppf(0.9, 1) / 2, rel=5e-3)


# -- rounding ---------------------------------------------------------------------------------------------------

#: Ten short records, some of which lack turns, so that headings depend on each other; and ordinary ones.
DISTURBED = [
    *((TEN, seed) for seed in range(1, 5)),
    (replace(SHORT, rests=(7, 7), avoided=((0.0, 0.0, 1.0),)), 2),
    (SHORT, 1),
    (Hand(), 1),
    (DOWN, 1),
    (DOWN, 2),
]


def disturbed(record: Recording, seed: int) -> Recording:
    """Every sample times one and some 1e-14."""
    rng = np.random.default_rng(seed)
    samples = (np.array(record.values(c.name)) for c in record.channels)
    return replace(
        record,
        columns=tuple(ArrayColumn(v * (1 + 1e-14 * rng.standard_normal(len(v)))) for v in samples),
    )


def table_of(record: Recording, rests: np.ndarray) -> PositionMeans:
    """The means over the rests, without the turns."""
    means = (
        np.array([np.nanmean(record.values(c.name)[a:b]) for a, b in rests.tolist()]) for c in record.channels
    )
    return PositionMeans(rows=replace(record, columns=tuple(ArrayColumn(v) for v in means)))


def assert_same(before: CalibrationEstimate, after: CalibrationEstimate) -> None:
    """Verdict, what is determined, and every number to 1e-6 of the width of its interval."""
    assert after.verdict == before.verdict and after.reason == before.reason
    assert [p.status for p in after.parameters] == [p.status for p in before.parameters]
    for p, q in zip(before.parameters, after.parameters, strict=True):
        numbers = np.array([[x.value, x.sd, *x.interval] for x in (p, q)])
        assert np.abs(np.diff(numbers, axis=0)).max() < 1e-6 * (p.interval[1] - p.interval[0]), p.name


@pytest.mark.long
@pytest.mark.parametrize(("hand", "seed"), DISTURBED)
def test_rounding_decides_nothing(hand: Hand, seed: int) -> None:
    record = held_record(seed, hand).recording
    assert_same(calibrate(record, **PLACE), calibrate(disturbed(record, seed), **PLACE))


@pytest.mark.parametrize("seed", [1, 2])
def test_rounding_decides_nothing_of_a_table(seed: int) -> None:
    """No turn links the positions: no heading but the first means anything."""
    made = held_record(seed, DOWN)
    before, after = (
        calibrate_means(table_of(record, made.rests), **PLACE)
        for record in (made.recording, disturbed(made.recording, seed))
    )
    assert_same(before, after)


def test_columns_that_depend_on_each_other_take_no_contrast_away() -> None:
    """Contrasts are those of the independent columns alone, in whatever basis."""
    rng = np.random.default_rng(4)
    columns, noise, residual = (
        rng.standard_normal((9, 4)),
        np.diag(rng.uniform(1, 4, 9)),
        rng.standard_normal(9),
    )
    several = np.column_stack([columns, columns @ rng.standard_normal((4, 2)), np.zeros(9)])
    alone, together = (Contrasts.of(noise, residual, table) for table in (columns, several))
    assert together.basis.shape == (5, 9)
    np.testing.assert_allclose(together.basis.T @ together.basis, alone.basis.T @ alone.basis, atol=1e-13)
    np.testing.assert_allclose(together.basis @ several, 0, atol=1e-13)


@pytest.mark.long
@pytest.mark.parametrize("avoided", [(0.0, 0.0, 1.0), (-1.0, 1.0, 0.0), (1.0, 1.0, 1.0)])
def test_no_position_is_asked_for_that_is_there(avoided: tuple[float, float, float]) -> None:
    for seed in (1, 8):
        made = held_record(seed, replace(SHORT, rests=(7, 9), avoided=(avoided,)))
        found = calibrate(made.recording, **PLACE)
        there = {p.words for p in found.positions if p.used}
        assert found.add and not there & set(found.add), (there, found.add)
        assert len(set(found.add)) == len(found.add)


@pytest.mark.parametrize("held", [True, False])
def test_a_position_that_contradicts_the_others_is_the_verdict(held: bool) -> None:
    made = held_record(4, SHORT if held else DOWN)
    a, b = made.rests[5]
    found = calibrate(changed(made, "acc_x", a, b, 0.6), **PLACE)
    assert found.verdict == "inconsistent" and "position" in found.reason
    assert any(
        f"position {p.number}" in found.reason for p in found.positions if a / 50 - 1 < p.start < b / 50
    )


@pytest.mark.long
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
