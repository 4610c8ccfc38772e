# SPDX-License-Identifier: BSD-3-Clause
"""Planning: against published tables, closed forms, a longer pass and simulation."""

from __future__ import annotations

import json
import math
import time

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.experiments.planning import LONGEST, plan
from allanite.filtering.block_means import _white_reach as white_reach
from allanite.filtering.block_means import longest_block
from allanite.filtering.regression import covariance_of, regress
from allanite.noise import SIGMA_PER_B, Flicker, GaussMarkov, NoiseModel, Quantisation, RandomWalk, White
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.setup_uncertainty import SetupUncertainty

DEG = math.pi / 180
DEG_H = DEG / 3600
LONDRINA = -23.3 * DEG


def gyro(N: float, B: float, T: float, K: float) -> NoiseModel:
    """N [deg/sqrt(h)], B [deg/h], T [s], K [deg/h/sqrt(h)]."""
    sigma = SIGMA_PER_B * B * DEG_H
    return NoiseModel.of(
        White(N=N * DEG / 60), GaussMarkov.from_sigma(sigma, T), RandomWalk(K=K * DEG_H / 60)
    )


WHITE = White(N=0.0122 * DEG)
SEED = NoiseModel.of(
    WHITE, GaussMarkov.from_sigma(SIGMA_PER_B * 0.0027 * DEG, 238.1), RandomWalk(K=6.8314e-5 * DEG)
)
FLICKER = NoiseModel.of(WHITE, Flicker(B=0.0027 * DEG), RandomWalk(K=6.8314e-5 * DEG))

#: sd of the Earth rate after 2 h [deg/h], by a filter over samples of 1 s: no dead time, 2 s at each turn.
TABLE = {
    (
        0.3,
        5,
        100,
        5,
    ): """.2125/.2744 .2137/.2392 .2184/.2308 .2258/.2346 .2585/.2648 .333/.340 .486/.494 .623/.631
        .939/.946""",
    (
        0.3,
        5,
        300,
        5,
    ): """.2123/.2740 .2127/.2379 .2144/.2261 .2171/.2250 .2308/.2354 .274/.277 .410/.414 .573/.579
        .982/.991""",
    (0.05, 1, 100, 1): """.0355/.0458 .0357/.0400 .0368/.0390 .0386/.0401 .0457/.0470 .0607/.0621 .0898/.0916
        .117/.119 .180/.182""",
    (0.3, 20, 100, 30): """.2185/.2828 .2357/.2673 .287/.313 .342/.371 .480/.519 .676/.729 1.06/1.13 1.47/1.57
        2.63/2.79""",
}


@pytest.mark.parametrize("sensor", TABLE)
@pytest.mark.parametrize("dead", [0, 1])
def test_dwell_table_of_four_sensors(sensor: tuple[float, ...], dead: int) -> None:
    """Every entry within 1 % (its last digit, of three, is up to 0.5 %)."""
    expected = np.array([float(cell.split("/")[dead]) for cell in TABLE[sensor].split()])
    found = plan(gyro(*sensor), latitude=0.0, dead_time=2.0 * dead, durations=[7200.0])
    np.testing.assert_allclose(found.sd[:, 0] / DEG_H, expected, rtol=0.01)
    # neighbours of the table differ by less than its last digit here and there
    at_best = expected[found.dwells.tolist().index(found.best[0])]
    assert at_best <= 1.002 * expected.min()


def test_relative_sd_of_the_seed_paper() -> None:
    """60 s, 12, 25, 60, 120 min, 30 s dwells, no time lost: to the digits of the published table."""
    times = [60.0, 720.0, 1500.0, 3600.0, 7200.0]

    def percent(model: NoiseModel) -> list[float]:
        found = plan(model, latitude=LONDRINA, dead_time=0.0, dwells=[30.0], durations=times)
        return [float(f"{x:.2g}") if x > 20 else round(x, 1) for x in 100 * found.sd[0] / EARTH_RATE]

    assert percent(SEED) == [44.0, 12.1, 8.4, 5.4, 3.8]
    assert percent(NoiseModel.of(WHITE)) == [41.0, 11.8, 8.2, 5.3, 3.7]
    # dense generalised least squares with the exact covariance of 1/f noise: 52.28, 14.043, 9.690 at 1 s
    assert percent(FLICKER) == [52.0, 14.0, 9.7, 6.2, 4.4]


def test_time_lost_in_turning() -> None:
    """2 s of 30 s in white noise are sqrt(30/28), 3.5 %; 3 s are 5.4 %."""
    sd = [
        plan(NoiseModel.of(WHITE), latitude=0.0, dead_time=d, dwells=[30.0], durations=[864000.0]).sd[0, 0]
        for d in (0.0, 2.0, 3.0)
    ]
    assert sd[1] / sd[0] == pytest.approx(math.sqrt(30 / 28), rel=1e-4)
    assert sd[2] / sd[0] == pytest.approx(math.sqrt(30 / 27), rel=1e-4)


@pytest.mark.parametrize("positions", [2, 4, 12])
def test_e2_azimuth_of_two_axes_in_white_noise(positions: int) -> None:
    model = NoiseModel.of(White(N=0.001 * DEG / 60))
    found = plan(
        model,
        latitude=45 * DEG,
        what="north",
        axes=2,
        positions=positions,
        dead_time=0.0,
        dwells=[60.0],
        durations=[3600.0],
    )
    assert math.degrees(found.sd[0, 0]) * 3600 == pytest.approx(19.393736, rel=1e-6)


def test_e2_one_axis_in_white_noise_needs_twice_the_time() -> None:
    model = NoiseModel.of(White(N=0.001 * DEG / 60))
    kw = {"latitude": 45 * DEG, "what": "north", "dead_time": 0.0, "dwells": [60.0], "durations": [3600.0]}
    for positions in (4, 12):
        found = plan(model, positions=positions, **kw)
        assert math.degrees(found.sd[0, 0]) * 3600 == pytest.approx(19.393736 * math.sqrt(2), rel=1e-6)


def test_e3_azimuth_against_latitude() -> None:
    model = NoiseModel.of(White(N=0.001 * DEG / 60))
    expected = {0: 0.0038092895, 60: 0.0076185790, 80: 0.0219368240, 89: 0.2182672933, 89.99: 21.8256213}
    for latitude, sd in expected.items():
        found = plan(
            model,
            latitude=latitude * DEG,
            what="north",
            axes=2,
            dead_time=0.0,
            dwells=[60.0],
            durations=[3600.0],
        )
        assert math.degrees(found.sd[0, 0]) == pytest.approx(sd, rel=1e-7)
    with pytest.raises(InputError, match="undefined at latitude 90"):
        plan(model, latitude=math.pi / 2, what="north")


@pytest.mark.parametrize("model", [SEED, FLICKER], ids=["gauss-markov", "flicker"])
def test_long_records_follow_from_short_passes(model: NoiseModel) -> None:
    """The straight line beyond 480 dwells against a pass over all 1440, another dead time in the first dwell."""
    dwell, n = 30.0, 1440
    block = np.arange(24 * n)
    sign = np.where((block // 24) % 2 == 0, 1.0, -1.0) * math.cos(LONDRINA)
    part = np.clip(((block % 24) + 1) * 1.25 - 2.0, 0.0, 1.25) / 1.25
    exact = covariance_of(np.column_stack([sign, np.ones(24 * n)]), model, dt=1.25, counts=part)
    found = plan(model, latitude=LONDRINA, dwells=[dwell], durations=[dwell * n])
    assert found.sd[0, 0] == pytest.approx(math.sqrt(exact[0, 0]), rel=1e-3)


def test_blocks_are_short_enough_where_dwells_are_long() -> None:
    """Noise with a corner of 10 s and dwells of half an hour: blocks of dwell/24 would lose half; these lose 0.1 %."""
    model = gyro(0.3, 20, 100, 30)
    n = 4 * 1800 * 4
    sign = np.where((np.arange(n) // 7200) % 2 == 0, 1.0, -1.0)
    exact = covariance_of(np.column_stack([sign, np.ones(n)]), model, dt=0.25)
    found = plan(model, latitude=0.0, dead_time=0.0, dwells=[1800.0], durations=[7200.0])
    assert found.sd[0, 0] == pytest.approx(math.sqrt(exact[0, 0]), rel=1e-3)


def test_how_far_white_noise_reaches() -> None:
    """White and walk meet where N^2/tau = K^2 tau/3; quantisation is no slow noise."""
    model = NoiseModel.of(White(N=3.0), RandomWalk(K=0.1), Quantisation(Q=5.0))
    assert white_reach(model) == pytest.approx(math.sqrt(3) * 30.0, rel=0.03)
    assert white_reach(NoiseModel.of(WHITE)) == math.inf
    assert longest_block(model, 30.0) == 30.0 / 24
    assert longest_block(model, 1800.0) == pytest.approx(white_reach(model) / 10)


@pytest.mark.long
def test_agrees_with_simulation() -> None:
    """Root mean square of 300 simulated estimates: 99.9 % bounds of chi-square, and the mean is the truth."""
    runs, dwell, duration, dead = 300, 20.0, 600.0, 2.0
    time_of = np.arange(int(duration)) + 0.5
    into, number = time_of % dwell, time_of // dwell
    sign = np.where(number % 2 == 0, 1.0, -1.0) * math.cos(LONDRINA)
    used = (into > dead) | (number == 0)
    errors = []
    for seed in range(runs):
        noise = al.simulate(FLICKER, rate=1.0, duration=duration, seed=seed).values("gyro")
        y = np.where(used, noise + EARTH_RATE * sign, np.nan)
        fit = regress(
            y, np.column_stack([sign, np.ones(len(sign))]), FLICKER, dt=1.0, names=["rate", "level"]
        )
        errors.append(fit["rate"][0] - EARTH_RATE)
    sd = plan(FLICKER, latitude=LONDRINA, dwells=[dwell], durations=[duration]).sd[0, 0]
    ratio = float(np.mean(np.square(errors))) / sd**2
    bound = 3.29 * math.sqrt(2 / runs)
    assert 1 - bound < ratio < 1 + bound
    assert abs(np.mean(errors)) < 3.29 * sd / math.sqrt(runs)


def test_goal_is_met_when_the_plan_says() -> None:
    found = plan(SEED, latitude=LONDRINA, goal=0.05)
    again = plan(SEED, latitude=LONDRINA, dwells=[found.dwell], durations=[found.duration])
    assert again.total[0, 0] == pytest.approx(0.05 * EARTH_RATE, rel=1e-4)
    assert found.duration == found.reached.min()
    assert (
        "5 % (one standard deviation) is reached after" in found.says
        and f"dwells of {found.dwell:g} s" in found.says
    )


def test_best_dwell_of_a_gyro_with_two_seconds_lost_is_20_to_30_s() -> None:
    found = plan(gyro(0.3, 5, 100, 5), latitude=0.5)
    assert found.dwell in (20.0, 30.0)
    assert set(found.best[found.durations >= 720.0]) <= {20.0, 30.0}


def test_a_model_without_white_noise_is_doubted() -> None:
    bare = NoiseModel.of(*(t for t in SEED.terms if not isinstance(t, White)))
    options = {"latitude": LONDRINA, "dwells": [30.0], "durations": [3600.0]}
    (note,) = plan(bare, **options).notes
    assert "no white noise" in note
    assert plan(SEED, **options).notes == ()


def test_goal_below_the_stated_uncertainties_is_never_reached() -> None:
    found = plan(SEED, latitude=LONDRINA, goal=0.03, stated=SetupUncertainty(scale=0.04, tilt=0.01))
    assert found.dwell is None and found.duration is None
    assert found.floor == pytest.approx(math.hypot(0.04, 0.01 * math.tan(LONDRINA)), rel=1e-12)
    np.testing.assert_allclose(found.total, np.hypot(found.sd, found.floor * EARTH_RATE), rtol=1e-9)
    assert "never reached" in found.says and "scale factor (4 %)" in found.says
    assert np.isinf(found.reached).all()


def test_goal_beyond_thirty_days_says_what_is_left() -> None:
    found = plan(SEED, latitude=LONDRINA, goal=1e-4)
    left = plan(SEED, latitude=LONDRINA, durations=[LONGEST]).sd.min() / EARTH_RATE
    assert f"leave {100 * left:.3g} % then" in found.says


def test_heading_budget_of_north() -> None:
    """One axis: its direction counts one to one, its scale not at all; two at right angles share both."""
    stated = SetupUncertainty(scale=1e-3, tilt=2e-3)
    kw = {"latitude": 45 * DEG, "what": "north", "stated": stated, "misalignment": 3e-3}
    one = plan(SEED, axes=1, **kw).budget
    assert one["misalignment"] == pytest.approx(3e-3) and one["tilt"] == pytest.approx(2e-3)
    assert one.get("scale factor", 0.0) < 1e-15
    fixed = plan(SEED, axes=2, positions=2, **kw).budget
    assert fixed["scale factor"] == pytest.approx(math.sin(math.pi / 2) / 2 * math.sqrt(2) * 1e-3)


def test_short_records_tell_nothing() -> None:
    """Before the first turn rate and bias are one; the table holds infinity there and JSON null."""
    found = plan(SEED, latitude=0.0, dwells=[60.0, 120.0], durations=[50.0, 130.0])
    assert np.isinf(found.sd[:, 0]).all() and np.isfinite(found.sd[:, 1]).all()
    assert math.isnan(found.best[0])
    data = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert data["sd"][0][0] is None and data["best"][0] is None
    assert len(found.table()) == 4


def test_dwells_within_the_dead_time_are_left_out() -> None:
    found = plan(SEED, latitude=0.0, dead_time=6.0, durations=[3600.0])
    assert np.isinf(found.sd[0, 0]) and np.isfinite(found.sd[1:, 0]).all()
    with pytest.raises(InputError, match="longer than the dead time"):
        plan(SEED, latitude=0.0, dead_time=10.0, dwells=[5.0, 10.0])


def test_rescaling_changes_the_scale_alone() -> None:
    tiny = NoiseModel.of(White(N=1e-12), RandomWalk(K=1e-15))
    large = NoiseModel.of(White(N=1e4), RandomWalk(K=1e1))
    a, b = (plan(m, latitude=0.3, dwells=[30.0, 600.0]).sd for m in (tiny, large))
    finite = np.isfinite(a)
    np.testing.assert_allclose(b[finite] / a[finite], 1e16, rtol=1e-9)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"latitude": 1.5708}, "undefined at latitude 90"),
        ({"what": "south"}, "'rate' or 'north'"),
        ({"goal": 0.0}, "goal must be positive"),
        ({"dead_time": -1.0}, "dead time"),
        ({"dwells": [0.0]}, "dwells must be positive"),
        ({"durations": []}, "durations must be positive"),
        ({"positions": 4}, "one axis and two positions"),
        ({"what": "north", "positions": 2}, "two axes are required"),
        ({"what": "north", "axes": 3}, "one axis or two"),
        ({"misalignment": math.nan}, "misalignment"),
        ({"model": NoiseModel.of(White(N=1.0), kind="acceleration")}, "sensor of rates"),
        ({"model": NoiseModel.of(RandomWalk(K=0.0))}, "no noise"),
    ],
)
def test_refuses(change: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        plan(**{"model": SEED, "latitude": 0.3, **change})  # type: ignore[arg-type]


def test_the_default_plan_is_quick() -> None:
    """Nine dwells in 1/f noise: a fraction of a second, far from the 5 s allowed."""
    start = time.process_time()
    plan(FLICKER, latitude=LONDRINA)
    assert time.process_time() - start < 5.0
