# SPDX-License-Identifier: BSD-3-Clause
"""Two and three sensors taken apart: sums against the definition, variances against theory, intervals by simulation."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import allanite as al
from allanite.errors import DataQualityError, InputError
from allanite.experiments.redundancy.shared import allan_covariance
from allanite.noise import Flicker, NoiseModel, RandomWalk, White
from allanite.noise.allan.covariance import covariance, lag_pairs
from allanite.noise.allan.matrix import allan_matrix, allan_products
from allanite.recording.records import Channel, Recording
from allanite.stability.shared_noise import separate_noise
from allanite.stability.shared_noise.fiducial import _chi_square, _evenly, interval_of
from allanite.stability.shared_noise.quadratic import (
    Products,
    common_form,
    covariance_of,
    own_basis,
    own_form,
)
from allanite.stability.shared_noise.terms import fit_terms
from allanite.stability.shared_noise.verdict import SeparationVerdict
from noise_records import binomial_bound

OWN = NoiseModel.of(White(N=1.0))
WALK = NoiseModel.of(RandomWalk(K=0.03))
NO_GAPS = np.zeros((0, 2), dtype=np.int64)


def noise(model: NoiseModel, n: int, seed: int) -> np.ndarray:
    made = al.simulate(model, rate=1.0, duration=float(n), seed=seed)
    return made.values(made.names[0])


def sensors(count: int, n: int, seed: int, shared: np.ndarray | float = 0.0) -> np.ndarray:
    white = np.random.default_rng(seed).standard_normal((n, count))
    return white + np.reshape(shared, (-1, 1))


def record(y: np.ndarray, names: str = "abc") -> Recording:
    return Recording.from_rate(y, rate=1.0, unit="rad/s", names=list(names)[: y.shape[1]])


def matrix_by_hand(y: np.ndarray, m: int) -> np.ndarray:
    x = np.concatenate([np.zeros((1, y.shape[1])), np.cumsum(np.nan_to_num(y), axis=0)])
    bad = np.concatenate(([0], np.cumsum(np.isnan(y).any(axis=1))))
    d = x[2 * m :] - 2 * x[m:-m] + x[: -2 * m]
    d = d[bad[2 * m :] == bad[: -2 * m]] / (m * math.sqrt(2))
    return d.T @ d / len(d)


def test_matrix_is_that_of_the_definition_with_gaps() -> None:
    y = sensors(3, 500, 1, noise(WALK, 500, 2))
    y[40:44, 1] = np.nan
    y[0, 2] = np.nan
    missing = np.array([[0, 1], [40, 44]])
    phases = np.concatenate([np.zeros((3, 1)), np.cumsum(np.nan_to_num(y), axis=0).T], axis=1)
    found = allan_matrix(phases, missing, np.array([1, 5, 60]))
    for k, m in enumerate((1, 5, 60)):
        np.testing.assert_allclose(found.covariance[k], matrix_by_hand(y, m), rtol=1e-10)
    covariance, count = allan_products(np.ascontiguousarray(phases), missing, np.array([1, 5, 60, 249]))
    np.testing.assert_allclose(covariance[:3], found.covariance, rtol=1e-10)
    assert count[:3].tolist() == found.count.tolist()
    assert np.isnan(covariance[3]).all() and count[3] == 0


def test_own_noise_a_millionth_of_the_common_part_is_not_lost_in_rounding() -> None:
    shared = 1e6 * noise(WALK, 4096, 3)
    y = np.random.default_rng(4).standard_normal((4096, 3)) + shared[:, None]
    for names in ("ab", "abc"):
        found = separate_noise(record(y[:, : len(names)], names))
        reach = 6 / math.sqrt(4096 / 3)
        assert found["a"].deviation[0] == pytest.approx(1.0, rel=reach) or len(names) == 2
        if len(names) == 3:
            exact = 0.5 * (
                matrix_by_hand(y[:, [0]] - y[:, [1]], 1)
                + matrix_by_hand(y[:, [0]] - y[:, [2]], 1)
                - matrix_by_hand(y[:, [1]] - y[:, [2]], 1)
            )
            assert found["a"].variance[0] == pytest.approx(float(exact[0, 0]), rel=1e-6)


@pytest.mark.parametrize("n", [2, 3])
def test_forms_give_the_parts_of_a_matrix_that_has_them(n: int) -> None:
    own, common = np.array([1.0, 2.0, 5.0])[:n], 0.7
    C = np.diag(own) + common
    for i in range(n):
        basis = own_basis(n, i)
        assert np.trace(own_form(n, i) @ C) == pytest.approx(own[i])
        assert basis[0] @ C @ basis[1] == pytest.approx(own[i])
    assert np.trace(common_form(n) @ C) == pytest.approx(common)


def test_covariance_of_one_channel_is_that_of_its_allan_variance() -> None:
    lags, model = [1, 4, 64], NoiseModel.of(White(N=1.0), Flicker(B=0.2))
    pairs = lag_pairs(lags, 1024)
    units = np.stack([pairs.cross(White(N=1.0), "mean"), pairs.cross(Flicker(B=1.0), "mean")])
    parts = np.array([[1.0, 0.04], [0.0, 0.0], [0.0, 0.0]])  # own noise of the first of two channels alone
    form = np.array([[1.0, 0.0], [0.0, 0.0]])
    found = covariance_of([form], Products(pairs, units).of(parts))[0, :, 0, :]
    np.testing.assert_allclose(found, covariance(model, pairs, 1.0, "mean"), rtol=1e-10)


def test_exact_variance_of_own_and_common_part_is_that_of_simulated_records() -> None:
    """Two white sensors with a common walk: variances of the estimates over records, within five standard errors."""
    n, lags, runs = 512, np.array([1, 8, 32]), 400
    pairs = lag_pairs(lags.tolist(), n)
    units = np.stack([pairs.cross(White(N=1.0), "mean"), pairs.cross(RandomWalk(K=1.0), "mean")])
    parts = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 0.03**2]])
    forms = [own_form(2, 0), common_form(2)]
    expected = np.einsum("alal->al", covariance_of(forms, Products(pairs, units).of(parts)))
    rng, found = np.random.default_rng(5), []
    for _ in range(runs):
        walk = np.cumsum(0.03 * rng.standard_normal(8 * n)).reshape(n, 8).mean(axis=1) / math.sqrt(8)
        y = rng.standard_normal((n, 2)) + walk[:, None]
        phases = np.concatenate([np.zeros((2, 1)), np.cumsum(y - y.mean(axis=0), axis=0).T], axis=1)
        C = allan_matrix(phases, NO_GAPS, lags).covariance
        found.append([[np.trace(form @ c) for c in C] for form in forms])
    ratio = np.var(found, axis=0) / expected
    assert np.all(
        np.abs(ratio - 1) < 5 * math.sqrt(2 / runs) + 0.1
    )  # tails are heavier than normal at long lags


@pytest.mark.parametrize(("rho", "edf"), [(0.0, 4), (0.95, 6), (0.7, 80)])
def test_interval_of_a_covariance_has_its_coverage(rho: float, edf: int) -> None:
    runs, form = 80, np.array([[0.0, 0.5], [0.5, 0.0]])
    root = np.linalg.cholesky(np.array([[1.0, rho], [rho, 1.0]]))
    rng, missed = np.random.default_rng([edf, round(100 * rho)]), 0
    for _ in range(runs):
        z = root @ rng.standard_normal((2, edf))
        low, high = interval_of(form, z @ z.T / edf, float(edf), 0.95)
        missed += not low <= rho <= high
    assert missed <= binomial_bound(runs, 0.0665)


def test_terms_of_every_part_are_recovered() -> None:
    n = 8192
    y = sensors(3, n, 6, noise(WALK, n, 7))
    phases = np.concatenate([np.zeros((3, 1)), np.cumsum(y - y.mean(axis=0), axis=0).T], axis=1)
    lags = 2 ** np.arange(11)
    found = fit_terms(allan_matrix(phases, NO_GAPS, lags).covariance, lag_pairs(lags.tolist(), n), "mean")
    white, walk = found.free[:, 1], found.free[:, 3]
    assert np.all(np.abs(white[:3] - 1.0) < 4 * found.sd[:3, 1]) and found.sd[0, 1] < 0.06
    assert abs(walk[3] - 0.03**2) < 4 * found.sd[3, 3]
    assert np.all(np.abs(walk[:3]) < 4 * found.sd[:3, 3])


@pytest.mark.long
def test_common_walk_is_seen_and_where_nothing_is_shared_limits_are_told() -> None:
    n = 8192
    found = separate_noise(record(sensors(3, n, 8, noise(WALK, n, 9))))
    assert found.verdict is SeparationVerdict.SHARED and found.common.resolved[-3:].all()
    truth = np.sqrt(WALK.avar(found.tau))
    inside = (found.common.lower <= truth) & (truth <= found.common.upper)
    assert inside.sum() >= len(truth) - 2  # neighbours hang together
    assert found.agreement is not None and found.agreement.p > 1e-3
    alone = separate_noise(record(sensors(2, n, 10)))
    assert alone.verdict is SeparationVerdict.NOT_SHARED
    assert np.isnan(alone.common.deviation[~alone.common.resolved]).all()
    assert (alone.common.upper > 0).all() and alone.common.resolved.sum() <= 2
    assert alone.common.model.estimate("K").value is None  # type: ignore[union-attr]


@pytest.mark.long
def test_negative_estimates_have_limits_that_cover_zero() -> None:
    runs, negative, missed = 8, 0, 0
    for i in range(runs):
        common = separate_noise(record(sensors(2, 256, 100 + i))).common
        negative += int((common.variance < 0).sum())
        missed += common.lower[0] > 0
        assert np.isfinite(common.upper).all() and (common.upper > 0).all()
    assert negative > 3 and missed <= binomial_bound(runs, 0.025)


def test_sensor_mounted_the_other_way_is_named_and_turned() -> None:
    y = sensors(2, 4096, 11, noise(WALK, 4096, 12))
    y[:, 1] *= -1
    found = separate_noise(record(y))
    assert found.verdict is SeparationVerdict.OPPOSITE and "--opposite" in found.reason
    turned = separate_noise(record(y), opposite=["b"])
    assert turned.verdict is SeparationVerdict.SHARED and turned.opposite == ("b",)


def test_pairs_that_share_more_than_the_third_are_found_out() -> None:
    n = 4096
    y = sensors(3, n, 13, noise(WALK, n, 14))
    y[:, :2] += np.random.default_rng(15).standard_normal((n, 1))
    found = separate_noise(record(y))
    assert found.agreement is not None and found.agreement.p < 1e-6
    assert any("do not share the same part" in remark for remark in found.remarks)


def test_common_part_that_one_sensor_feels_later_is_told_with_its_delay() -> None:
    n, delay = 8192, 32
    walk = noise(NoiseModel.of(RandomWalk(K=0.2)), n + delay, 16)
    rng = np.random.default_rng(17)
    y = np.stack([walk[delay:], walk[:-delay]], axis=1) + 0.3 * rng.standard_normal((n, 2))
    told = [r for r in separate_noise(record(y)).remarks if "later" in r]
    assert len(told) == 1 and told[0].startswith("b receives") and "later than a" in told[0]
    same = np.stack([walk[:n], walk[:n]], axis=1) + 0.3 * rng.standard_normal((n, 2))
    assert not any("later" in r for r in separate_noise(record(same)).remarks)


@pytest.mark.long
def test_scale_of_the_data_does_not_matter_and_gaps_of_one_are_gaps_of_all() -> None:
    y = sensors(2, 2000, 18, noise(WALK, 2000, 19))
    y[300:340, 0] = np.nan
    one, small = separate_noise(record(y)), separate_noise(record(1e-8 * y))
    np.testing.assert_allclose(small.own[0].upper, 1e-8 * one.own[0].upper, rtol=1e-6)
    both = y.copy()
    both[300:340, 1] = np.nan
    np.testing.assert_allclose(one.own[1].variance, separate_noise(record(both)).own[1].variance, rtol=1e-9)
    assert one.missing == 40
    json.dumps(one.to_json(), allow_nan=False)


def test_what_cannot_be_taken_apart_is_refused() -> None:
    y = sensors(3, 300, 20)
    with pytest.raises(InputError, match="two or three sensors, not 1"):
        separate_noise(record(y), channels=["a"])
    with pytest.raises(InputError, match="have the same samples"):
        separate_noise(record(np.stack([y[:, 0], y[:, 0]], axis=1)))
    with pytest.raises(InputError, match="cannot be opposite"):
        separate_noise(record(y), opposite=["d"])
    two = record(y[:, :2])
    mixed = replace(two, channels=(two.channels[0], Channel.of("b", "m/s^2", sampling="mean")))
    with pytest.raises(InputError, match="of one kind and unit"):
        separate_noise(mixed)
    y[10:, 1] = np.nan
    with pytest.raises(DataQualityError, match="samples in common"):
        separate_noise(record(y))
    with pytest.raises(InputError, match="no part 'x'"):
        separate_noise(record(sensors(2, 300, 1)))["x"]


def test_advice_for_one_channel_is_not_what_was_asked() -> None:
    y = record(sensors(3, 200, 1))
    with pytest.raises(InputError, match=r"not 1: b; name them, for instance --channels b,a,c$"):
        separate_noise(y, channels=["b"])
    with pytest.raises(InputError, match=r"not 1: a; name a and at least one more channel of the log"):
        separate_noise(y.select("a"))
    with pytest.raises(InputError, match=r"b is named twice; name them, for instance --channels b,a,c$"):
        separate_noise(y, channels=["b", "b"])


def test_redundant_sensors_have_the_same_covariance_as_before() -> None:
    means = sensors(4, 1000, 21)
    means[100:103, 2] = np.nan
    found = allan_covariance(means, 0.5, NoiseModel.of(White(N=1.0)))
    for k, tau in enumerate(found.tau[:6]):
        np.testing.assert_allclose(found.matrix[k], matrix_by_hand(means, round(tau / 0.5)), rtol=1e-9)


def test_few_lags_do_not_determine_terms_and_that_is_said() -> None:
    y = sensors(2, 4000, 22)
    y[np.random.default_rng(1).random(4000) < 0.4] = np.nan
    found = separate_noise(record(y))
    assert len(found.tau) <= 3
    told = [e for part in found.parts for e in part.model.estimates]
    assert any(e.note == "not determined" and e.upper == math.inf for e in told)
    assert all(e.value is None for e in found.common.model.estimates)
    assert found["a"].lower[0] <= 1.0 <= found["a"].upper[0]


def test_quantiles_of_many_degrees_of_freedom_are_those_of_chi_square() -> None:
    from scipy.special import chdtri

    uniform, normal = _evenly(2)
    told = _chi_square(uniform[0], normal[0], 60.0)
    middle = (uniform[0] > 0.005) & (uniform[0] < 0.995)
    np.testing.assert_allclose(told[middle], chdtri(60.0, 1 - uniform[0])[middle], rtol=1e-3)


def test_interval_of_a_coefficient_is_the_set_that_its_estimate_does_not_contradict() -> None:
    n = 4096
    y = sensors(2, n, 23, noise(WALK, n, 24))
    phases = np.concatenate([np.zeros((2, 1)), np.cumsum(y - y.mean(axis=0), axis=0).T], axis=1)
    lags = 2 ** np.arange(10)
    found = fit_terms(allan_matrix(phases, NO_GAPS, lags).covariance, lag_pairs(lags.tolist(), n), "mean")
    for row, k in ((0, 1), (2, 3)):
        x, (q0, q1, q2) = found.free[row, k], found.spread[row, k]
        low, high = found.interval(row, k, 1.96)
        for end in (low, high):
            assert (x - end) ** 2 == pytest.approx(1.96**2 * (q0 + q1 * end + q2 * end**2), rel=1e-6)
        assert low < x < high and high - x > x - low
    c = found.coefficients[2, 3]  # under which the standard deviations are stated
    assert q0 + q1 * c + q2 * c**2 == pytest.approx(found.sd[2, 3] ** 2, rel=1e-3)


@pytest.mark.parametrize("seed", [59, 151, 160])
def test_lags_at_which_a_channel_holds_rounding_alone_are_left_out(seed: int) -> None:
    """A count now and then, of which no complete window sees any: sums of it are rounded, and no noise."""
    rng = np.random.default_rng(seed)
    coarse = 1e-12 * np.round(0.25 * rng.standard_normal(300))
    coarse[1::2][rng.random(150) < 0.9] = np.nan
    y = np.column_stack([coarse, 1e-13 * rng.standard_normal(300), 1e-13 * rng.standard_normal(300)])
    with pytest.raises(DataQualityError, match="no lag with noise"):
        separate_noise(Recording.from_rate(y, rate=10.0, unit="rad/s", names=["a", "b", "c"]))
