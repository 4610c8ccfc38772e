# SPDX-License-Identifier: BSD-3-Clause
"""The population of a fleet: against closed forms, against integrals by quadrature, and where it must refuse."""

from __future__ import annotations

import math

import numpy as np
import pyarrow as pa
import pytest

from allanite.errors import InputError
from allanite.stability.fleet.evidence import Design, Scales, evidence
from allanite.stability.fleet.levels import LEVELS
from allanite.stability.fleet.population import describe_fleet
from allanite.stability.fleet.posterior import Posterior, posterior_of
from allanite.stability.fleet.profile_table import ProfileTable
from allanite.stability.fleet.results import FleetPopulation
from allanite.stability.fleet.standing_out import departures, discoveries, simes
from allanite.stability.fleet.verdict import FleetVerdict

LEVEL = np.array(LEVELS)


def straight(y, sd):
    """Profiles of normal estimates."""
    return np.asarray(y)[:, None] + np.asarray(sd)[:, None] * LEVEL, np.full(len(y), -np.inf)


def of_squares(y):
    """Profiles of estimates y of c^2 with unit variance, c never negative: limits where y is small."""
    y = np.asarray(y, dtype=float)
    best = np.maximum(y, 0.0)[:, None]
    beyond = np.where(LEVEL > 0, np.hypot(LEVEL, y[:, None]) - np.abs(y[:, None]), 0.0)
    square = np.where(y[:, None] < 0, beyond, LEVEL + best)
    with np.errstate(divide="ignore"):
        knots = np.where(square > 0, 0.5 * np.log(np.maximum(square, 1e-300)), -np.inf)
    return knots, -best[:, 0]


def design(profiles, unit=None, lot=None, covariates=None):
    table = ProfileTable.of(*profiles)
    unit = np.arange(len(table)) if unit is None else np.asarray(unit)
    units = unit[-1] + 1
    z = np.ones((len(table), 1)) if covariates is None else covariates
    return Design(table, z, unit, np.zeros(units, dtype=np.intp) if lot is None else np.asarray(lot))


# -- profiles ---------------------------------------------------------------------------------------------


@pytest.mark.long
def test_what_a_profile_says_beside_an_expectation_is_its_integral():
    rng = np.random.default_rng(1)
    knots = np.vstack(
        [straight(rng.normal(size=40), rng.uniform(0.05, 1, 40))[0], of_squares(rng.normal(1, 2, 40))[0]]
    )
    floor = np.concatenate([np.full(40, -np.inf), of_squares(np.random.default_rng(1).normal(1, 2, 40))[1]])
    floor[40:] = np.where(np.isfinite(knots[40:, 0]), -np.inf, floor[40:])
    table = ProfileTable.of(knots, floor)
    m, v = rng.normal(size=80), rng.uniform(0.01, 2, 80)
    tilted = table.tilted(m, v)
    x = m[:, None] + np.sqrt(v)[:, None] * np.linspace(-12, 12, 20_001)
    dx = (x[:, 1] - x[:, 0])[:, None]
    root = np.array([table.root(column) for column in x.T]).T
    density = np.exp(-0.5 * root**2 - 0.5 * (x - m[:, None]) ** 2 / v[:, None]) / np.sqrt(
        2 * np.pi * v[:, None]
    )
    mass = (density * dx).sum(axis=1)
    mean = (density * x * dx).sum(axis=1) / mass
    variance = (density * (x - mean[:, None]) ** 2 * dx).sum(axis=1) / mass
    inside = np.abs(mean - m) < 6 * np.sqrt(v)  # where the grid reaches
    assert inside.sum() > 60
    np.testing.assert_allclose(tilted.log_mass[inside], np.log(mass[inside]), atol=2e-3)
    np.testing.assert_allclose(tilted.mean[inside], mean[inside], atol=2e-3)
    np.testing.assert_allclose(tilted.variance[inside], variance[inside], rtol=1e-2)


def test_straight_profiles_are_normal_densities():
    table = ProfileTable.of(*straight([0.3, -1.0], [0.1, 2.0]))
    assert table.straight.all()
    tilted = table.tilted(np.array([0.0, 1.0]), np.array([0.5, 0.7]))
    s2, v = np.array([0.01, 4.0]), np.array([0.5, 0.7])
    d = np.array([0.3, -2.0])
    np.testing.assert_allclose(
        tilted.log_mass, -0.5 * d**2 / (s2 + v) + 0.5 * np.log(s2 / (s2 + v)), rtol=1e-9
    )
    np.testing.assert_allclose(tilted.variance, s2 * v / (s2 + v), rtol=1e-9)


# -- evidence ---------------------------------------------------------------------------------------------


@pytest.mark.long
def test_evidence_of_censored_units_is_the_integral_of_each():
    """One log a unit: differences of the evidence between scales, every unit by quadrature, the middle by Laplace."""
    rng = np.random.default_rng(5)
    d = design(of_squares(np.exp(2 * 0.4 * rng.normal(size=30)) + rng.normal(size=30)))
    x = np.linspace(-20, 12, 6401)
    likelihood = np.exp(-0.5 * np.array([d.profiles.root(np.full(30, value)) for value in x]).T ** 2)
    middles = np.linspace(-1.0, 1.0, 401)

    def exact(scales):
        narrow, wide = (
            np.exp(-0.5 * ((x - middles[:, None]) / t) ** 2) / t for t in (scales.unit, 5 * scales.unit)
        )
        prior = ((1 - scales.wide) * narrow + scales.wide * wide) * (x[1] - x[0]) / math.sqrt(2 * math.pi)
        log = np.log(likelihood @ prior.T).sum(axis=0)
        i, h = int(log.argmax()), 5
        bend = (2 * log[i] - log[i - h] - log[i + h]) / (h * (middles[1] - middles[0])) ** 2
        return float(log[i] - 0.5 * math.log(bend / (2 * math.pi)))

    every = [Scales(lot=0.0, unit=t, repeat=0.0, wide=w) for t in (0.15, 0.4, 0.8) for w in (0.0, 0.1)]
    ours = np.array([evidence(d, s).value for s in every])
    theirs = np.array([exact(s) for s in every])
    np.testing.assert_allclose(ours - ours[0], theirs - theirs[0], atol=0.01)


def contradictory():
    """Sensors of five types in one fleet: limits, and five units of one type that agree with nobody."""
    none = [-math.inf] * 4
    knots = [
        [*none, -math.inf, -11.46, -10.75, -10.19, -9.67], [*none, -math.inf, -12.53, -11.77, -11.02, -10.22],
        [*none, -math.inf, -10.58, -9.86, -9.2, -8.39], [0.19, 0.38, 0.48, 0.55, 0.6, 0.65, 0.71, 0.77, 0.87],
        [-0.76, -0.38, -0.22, -0.14, -0.08, -0.02, 0.05, 0.13, 0.26],
        [0.29, 0.44, 0.51, 0.55, 0.6, 0.65, 0.7, 0.76, 0.86],
        [-0.86, -0.45, -0.28, -0.18, -0.09, -0.02, 0.05, 0.14, 0.26],
        [-1.01, -0.54, -0.34, -0.23, -0.14, -0.06, 0.01, 0.11, 0.24],
        [*none, -math.inf, -3.81, -3.51, -3.29, -3.18], [*none, -11.98, -11.72, -11.47, -10.72, -9.95],
    ]  # fmt: skip
    floor = [0.0, 0.0, 0.0, -math.inf, -5.79, -math.inf, -5.6, -5.43, 0.0, -0.756]
    return design((np.array(knots), np.array(floor)), lot=[0, 1, 1, 2, 2, 2, 2, 2, 3, 4])


@pytest.mark.long
def test_logs_that_contradict_each_other_have_an_evidence_near_the_integral():
    """Factors that hold nearby are not followed far away: the value stays that of the integral over all levels."""
    d = contradictory()
    x = np.arange(-35.0, 10.0, 0.05)
    log_likelihood = -0.5 * np.array([d.profiles.root(np.full(10, value)) for value in x]).T ** 2

    def spread(log, sd):
        kernel = -0.5 * ((x[:, None] - x) / sd) ** 2
        kernel -= np.logaddexp.reduce(kernel, axis=1)[:, None]
        return np.logaddexp.reduce(kernel + log, axis=1)

    start = evidence(d, Scales(lot=9.788, unit=0.462, repeat=0.0, wide=0.0))
    for lot, unit in ((1.398, 0.08), (3.0, 0.3), (5.0, 1.0)):
        of_units = [spread(log, unit) for log in log_likelihood]
        of_lots = [spread(sum(of_units[u] for u in np.flatnonzero(d.lot == j)), lot) for j in range(5)]
        exact = float(np.logaddexp.reduce(sum(of_lots))) + math.log(0.05)
        scales = Scales(lot=lot, unit=unit, repeat=0.0, wide=0.0)
        assert exact - 10.0 < evidence(d, scales, start).value < exact + 2.0, scales
        assert evidence(d, scales).value < exact + 2.0, scales


@pytest.mark.long
def test_logs_that_contradict_each_other_leave_more_than_one_draw(monkeypatch):
    monkeypatch.setattr("allanite.stability.fleet.posterior._DRAWS", 96)
    posterior = posterior_of(contradictory())
    assert 1.0 / float(posterior.weight @ posterior.weight) > 10
    unit = np.array([s.unit for s in posterior.scales])
    assert 0.1 < np.average(unit, weights=posterior.weight) < 3.0
    middle = np.average(posterior.location[:, 0], weights=posterior.weight)
    assert -13.0 < middle < 0.0


def test_scales_of_a_balanced_fleet_are_those_of_the_analysis_of_variance():
    """Exact data, so that the restricted likelihood has its maximum at the mean squares."""
    rng = np.random.default_rng(11)
    lots, units, repeats = 12, 8, 3
    a, b = 0.3 * rng.normal(size=lots), 0.2 * rng.normal(size=(lots, units))
    x = a[:, None, None] + b[:, :, None] + 0.1 * rng.normal(size=(lots, units, repeats))
    of_unit, of_lot = x.mean(axis=2), x.mean(axis=(1, 2))
    within = ((x - of_unit[..., None]) ** 2).sum() / (lots * units * (repeats - 1))
    between = repeats * ((of_unit - of_lot[:, None]) ** 2).sum() / (lots * (units - 1))
    above = repeats * units * ((of_lot - of_lot.mean()) ** 2).sum() / (lots - 1)
    best = Scales(
        lot=math.sqrt((above - between) / (repeats * units)),
        unit=math.sqrt((between - within) / repeats),
        repeat=math.sqrt(within),
        wide=0.0,
    )
    unit = np.repeat(np.arange(lots * units), repeats)
    d = design(straight(x.ravel(), np.full(x.size, 1e-4)), unit, np.repeat(np.arange(lots), units))
    top = evidence(d, best)
    assert top.location[0] == pytest.approx(x.mean(), abs=1e-6)
    assert top.covariance[0, 0] == pytest.approx(above / x.size, rel=1e-3)
    for change in (0.9, 1.1):
        for level in ("lot", "unit", "repeat"):
            near = {name: getattr(best, name) for name in ("lot", "unit", "repeat")} | {"wide": 0.0}
            near[level] *= change
            assert evidence(d, Scales(**near)).value < top.value


def test_posterior_without_uncertainty_is_students_and_chi_squares():
    """Units known exactly: the middle has Student's interval, the spread that of a standard deviation."""
    from scipy import stats

    rng = np.random.default_rng(4)
    x = 0.2 * rng.normal(size=12)
    p = posterior_of(design(straight(x, np.full(12, 1e-4))))
    spread = np.array([s.unit for s in p.scales])
    order = np.argsort(spread)
    share = np.cumsum(p.weight[order])
    quantiles = spread[order][np.searchsorted(share, [0.05, 0.5, 0.95])]
    expected = np.sqrt(11 * x.var(ddof=1) / stats.chi2(11).ppf([0.95, 0.5, 0.05]))
    np.testing.assert_allclose(quantiles, expected, rtol=0.08)
    assert p.resolved == {"unit"}
    assert p.mode.location[0] == pytest.approx(x.mean(), abs=1e-6)


@pytest.mark.long
def test_a_large_fleet_is_climbed_in_a_part_of_it():
    rng = np.random.default_rng(3)
    n = 6000
    d = design(straight(np.hypot(0.3, 0.1) * rng.normal(size=n), np.full(n, 0.1)))
    p = posterior_of(d)
    spread = np.array([s.unit for s in p.scales])
    assert np.mean(spread) == pytest.approx(0.3, abs=4 * 0.3 / math.sqrt(2 * n) * 1.2)
    assert len(d.thinned(1000).unit) == 1000


# -- who stands out ---------------------------------------------------------------------------------------


def test_step_up_procedure_of_the_paper():
    """Benjamini and Hochberg 1995, section 3.2: fifteen probabilities, of which the step-up procedure rejects four."""
    p = [
        0.0001,
        0.0004,
        0.0019,
        0.0095,
        0.0201,
        0.0278,
        0.0298,
        0.0344,
        0.0459,
        0.3240,
        0.4262,
        0.5719,
        0.6528,
        0.7590,
    ]
    assert discoveries([*p, 1.0], 0.05).sum() == 4


@pytest.mark.long
def test_a_bent_profile_far_off_is_as_far_as_its_best_value():
    rng = np.random.default_rng(17)
    y = 4.0 * np.exp(2 * 0.1 * rng.normal(size=40)) + rng.normal(size=40)
    y[7] = 36.0  # three times the middle
    d = design(of_squares(y))
    posterior = posterior_of(d)
    far = departures(d, posterior)
    middle = math.exp(posterior.mode.location[0])
    assert far.ratio[7] == pytest.approx(6.0 / middle, rel=0.05)
    assert 2 < far.deviations[7] < 40
    assert far.p[7] == far.p.min()


def limit(below, floor=0.0):
    """A profile whose root rises from its floor by one every factor e, and has risen by one at exp(below)."""
    rise = LEVEL - floor
    return np.where(rise > 0, below + np.log(np.where(rise > 0, rise, 1.0)), -np.inf), floor


def of_scales(d, scales):
    """The posterior of scales that are known."""
    mode = evidence(d, scales)
    root = np.linalg.cholesky(mode.covariance)
    return Posterior(
        scales=(scales,), weight=np.ones(1), location=mode.location[None], root=root[None], lots=mode.lots[None],
        lot_sd=np.sqrt(mode.lot_variance)[None], lot_lean=mode.lot_lean[None], mode=mode,
        resolved=frozenset(), tails=0.0,
    )  # fmt: skip


def test_a_limit_stands_out_only_below_the_population():
    """A log of a second bounds flicker a hundred times above what the others resolve, and says nothing of it."""
    floors, above = (a.ravel() for a in np.meshgrid([0.0, -0.3, -0.6, -1.2, -1.9], [2.0, 5.0, 20.0]))
    limits = [*map(limit, above, floors), limit(-3.0)]
    resolved = straight(0.2 * np.random.default_rng(31).normal(size=30), np.full(30, 0.05))
    profiles = (
        np.vstack([[k for k, _ in limits], resolved[0]]),
        np.append([f for _, f in limits], resolved[1]),
    )
    d = design(profiles)
    far = departures(d, of_scales(d, Scales(0.0, 0.2, 0.0, 0.0)))
    least = np.exp(-above) - floors  # at the middle of the population
    assert (np.abs(far.deviations[:15]) < 1.1 * least + 0.02).all()
    assert (far.p[:15] > 0.05).all() and np.isnan(far.ratio[:16]).all()
    assert -25 < far.deviations[15] < -5 and far.p[15] == far.p.min() < 1e-4


def test_where_a_profile_meets_an_expectation_no_other_value_is_nearer():
    rng = np.random.default_rng(5)
    profiles = ProfileTable.of(*of_squares(rng.normal(2.0, 3.0, 30)))
    m, v = rng.normal(0.5, 2.0, 30), np.exp(rng.normal(-1.0, 1.0, 30))

    def loss(x):
        return profiles.root(x) ** 2 + (x - m) ** 2 / v

    least = loss(profiles.nearest(m, v))
    for step in np.linspace(-8.0, 8.0, 401):
        assert (least <= loss(m + step) + 1e-9).all()


@pytest.mark.long
def test_a_unit_of_one_of_two_lots_stands_out_as_it_would_alone():
    """Two lots leave the spread between lots open, not what a unit of either lot is expected to be."""
    rng = np.random.default_rng(18)
    x = 0.1 * rng.normal(size=24)
    x[5] = 1.2
    exact = straight(x, np.full(24, 0.01))
    of_lots = design(exact, lot=np.repeat([0, 1], 12))
    alone = design(exact)
    p = [departures(d, posterior_of(d)).p[5] for d in (of_lots, alone)]
    assert max(p) < 1e-6


def test_simes_of_one_is_itself_and_of_several_the_smallest_adjusted():
    p = np.array([[0.01, np.nan, np.nan], [0.01, 0.02, 0.9], [np.nan, np.nan, np.nan]])
    np.testing.assert_allclose(simes(p), [0.01, 0.03, 1.0])


# -- the whole --------------------------------------------------------------------------------------------


def table(rng, units=60, *, lots=1, temperature=0.0, outlier=None, symbol="N"):
    """A fleet of spread 0.2 with middle exp(-5), as a table."""
    lot = np.sort(rng.integers(0, lots, units))
    degrees = rng.uniform(10, 30, units)
    x = -5 + 0.2 * rng.normal(size=units) + temperature * (degrees - 20) + 0.1 * (lot == 0) * (lots > 1)
    if outlier is not None:
        x[outlier] = -5 + 2.0
    knots, floor = straight(x + 0.02 * rng.normal(size=units), np.full(units, 0.02))
    return pa.table(
        {
            "log": [f"{i}.csv" for i in range(units)],
            "unit": [f"sn{i}" for i in range(units)],
            "lot": [f"L{i}" for i in lot],
            "temperature": degrees,
            "channel": ["gx"] * units,
            "kind": ["rate"] * units,
            "term": [symbol] * units,
            "unit_of_measure": ["rad/s^0.5"] * units,
            "profile": pa.FixedSizeListArray.from_arrays(pa.array(knots.astype(np.float32).ravel()), 9),
            "root_at_zero": pa.array(floor.astype(np.float32)),
        }
    )


@pytest.mark.long
def test_the_unit_that_stands_out_is_named_and_the_document_comes_back():
    result = describe_fleet(table(np.random.default_rng(2), outlier=7))
    assert result.verdict is FleetVerdict.STAND_OUT
    assert result.names_standing_out == ("sn7",)
    assert result.standing_out[0].ratio == pytest.approx(math.exp(2.0), rel=0.2)
    assert FleetPopulation.from_json(result.to_json()).to_json() == result.to_json()


@pytest.mark.long
def test_logs_in_which_the_unit_was_turned_are_left_out_and_named():
    rows = table(np.random.default_rng(8), outlier=3)
    turned = np.array(rows["log"].to_pylist()) == rows["log"][3].as_py()
    codes = pa.array([["gravity", "motion"] if t else ["gravity"] for t in turned])
    population = describe_fleet(rows.append_column("findings", codes))
    assert population.turned == (rows["log"][3].as_py(),)
    assert population.units == describe_fleet(rows).units - 1
    assert not population.standing_out
    assert FleetPopulation.from_json(population.to_json()).turned == population.turned
    with pytest.raises(InputError, match="60 logs of a unit that was turned left out"):
        describe_fleet(rows.append_column("findings", pa.array([["motion"]] * 60)))


@pytest.mark.long
def test_an_effect_of_temperature_has_its_interval_and_the_middle_its_reference():
    result = describe_fleet(table(np.random.default_rng(6), 200, temperature=0.02))
    (c,) = result.coefficients
    (effect,) = c.effects
    assert (effect.name, effect.unit_of_measure) == ("temperature", "degC")
    assert effect.change.lower < 0.02 < effect.change.upper
    assert effect.change.lower > 0.01
    assert effect.reference == pytest.approx(20, abs=1)
    assert describe_fleet(table(np.random.default_rng(6), 200), conditions=()).coefficients[0].effects == ()


@pytest.mark.long
def test_lots_have_their_ratio():
    (c,) = describe_fleet(table(np.random.default_rng(8), 240, lots=4)).coefficients
    assert [r.lot for r in c.of_lots] == ["L0", "L1", "L2", "L3"]
    assert sum(r.units for r in c.of_lots) == c.units == 240
    assert c.between_lots is not None
    assert (
        describe_fleet(table(np.random.default_rng(8), 240, lots=4), by_lot=False).coefficients[0].lots == 1
    )


@pytest.mark.long
def test_bounds_are_in_order():
    (c,) = describe_fleet(table(np.random.default_rng(9))).coefficients
    assert (
        c.tolerance[0]
        < c.next_unit[0]
        < c.middle.lower
        < c.middle.value
        < c.middle.upper
        < c.next_unit[1]
        < c.tolerance[1]
    )


@pytest.mark.long
def test_three_units_bound_nothing_and_say_so():
    (c,) = describe_fleet(table(np.random.default_rng(12), 3), conditions=()).coefficients
    assert c.next_unit[1] > 1.5 * c.middle.value
    assert c.tolerance[1] > c.next_unit[1]


@pytest.mark.long
def test_a_coefficient_whose_spread_nothing_bounds_is_left_out():
    rows = table(np.random.default_rng(12), 12)
    knots = np.vstack([straight([-9.0, -2.2, -7.0], [0.2, 0.3, 0.2])[0], of_squares(np.zeros(2))[0] - 12.0])
    few = table(np.random.default_rng(12), 5, lots=5, symbol="K")
    few = few.set_column(
        few.column_names.index("profile"),
        "profile",
        pa.FixedSizeListArray.from_arrays(pa.array(knots.astype(np.float32).ravel()), 9),
    )
    floor = pa.array(np.array([-np.inf, -3.4, -np.inf, 0.0, 0.0], dtype=np.float32))
    few = few.set_column(few.column_names.index("root_at_zero"), "root_at_zero", floor)
    population = describe_fleet(pa.concat_tables([rows, few], promote_options="permissive"))
    assert [c.symbol for c in population.coefficients] == ["N"]
    assert population.left_out == ("K of gx",)


def test_refusals():
    t = table(np.random.default_rng(1))
    with pytest.raises(InputError, match="no numeric column 'humidity'"):
        describe_fleet(t, conditions=["humidity"])
    with pytest.raises(InputError, match="resolved by 3 units"):
        describe_fleet(table(np.random.default_rng(1), 2))
    with pytest.raises(InputError, match="resolved by 3 units"):
        describe_fleet(t.slice(0, 0))
    with pytest.raises(InputError, match="lacks the columns profile"):
        describe_fleet(t.drop_columns(["profile"]))
    with pytest.raises(InputError, match="content must lie between 0 and 1"):
        describe_fleet(t, content=1.0)
    with pytest.raises(InputError, match="no table of a fleet"):
        describe_fleet("no/such/folder")


def test_logs_in_counts_are_not_mixed_with_those_in_units():
    """A log without a unit states N in counts, whatever its channel is called."""
    whole = table(np.random.default_rng(3), 12)
    units = whole["unit_of_measure"].to_pylist()
    units[4] = units[9] = "units/√Hz"
    mixed = whole.set_column(whole.column_names.index("unit_of_measure"), "unit_of_measure", pa.array(units))
    with pytest.raises(InputError, match=r"10 logs and in units/√Hz in 2 logs, such as 4\.csv"):
        describe_fleet(mixed)
