# SPDX-License-Identifier: BSD-3-Clause
"""Attitudes against each other, against closed forms and, with noise, against the theory of their covariance."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from allanite.errors import InputError
from allanite.quantities.attitude import (
    accumulated,
    angles_of,
    attitude_of,
    axes_matrix,
    quest,
    rotation,
    rotation_vector,
    skew,
    triad,
    with_coning,
)

X, Y, Z = np.eye(3)
HALF = math.pi / 2
direction = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 1e-3)


def drawn(rng: np.random.Generator, count: int) -> np.ndarray:
    """Attitudes, all equally likely."""
    q = rng.standard_normal((count, 4))
    length = np.linalg.norm(q[:, 1:], axis=1)
    return rotation((2 * np.arctan2(length, q[:, 0]) / length)[:, None] * q[:, 1:])


# -- rotations --------------------------------------------------------------------------------------------


def test_skew_is_the_cross_product(rng: np.random.Generator) -> None:
    u, v = rng.standard_normal((2, 10, 3))
    np.testing.assert_allclose(np.einsum("kij,kj->ki", skew(u), v), np.cross(u, v), atol=1e-15)


@given(direction, st.floats(0.0, math.pi))
def test_rotation_and_its_vector(axis: tuple[float, float, float], angle: float) -> None:
    v = np.array(axis) / np.linalg.norm(axis) * angle
    c = rotation(v)
    np.testing.assert_allclose(c @ c.T, np.eye(3), atol=4e-16 * 4)
    assert np.linalg.det(c) == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(c @ v, v, atol=1e-14)
    found = rotation_vector(c)
    if angle > math.pi - 1e-7:  # there the sense of the axis is open
        found = math.copysign(1.0, found @ v) * found
    np.testing.assert_allclose(found, v, atol=1e-14)


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-12, 0.99e-4, 1e-4, 1.01e-4])
def test_small_turns_lose_no_digits(angle: float) -> None:
    v = angle * np.array([0.6, 0.0, -0.8])
    np.testing.assert_allclose(rotation_vector(rotation(v)), v, rtol=1e-11, atol=0)
    np.testing.assert_allclose(rotation(v), rotation(v / 8) @ rotation(7 * v / 8), atol=4e-16)


def test_rotation_is_right_handed() -> None:
    np.testing.assert_allclose(rotation([0, 0, HALF]) @ X, Y, atol=3e-16)
    np.testing.assert_allclose(rotation([HALF, 0, 0]) @ Y, Z, atol=3e-16)


# -- roll, pitch, heading ---------------------------------------------------------------------------------


def test_what_roll_pitch_and_heading_mean() -> None:
    np.testing.assert_allclose(attitude_of(0, 0, HALF) @ X, Y, atol=1e-16)  # heading 90: the nose points east
    np.testing.assert_allclose(attitude_of(HALF, 0, 0) @ Y, Z, atol=1e-16)  # roll 90: the right wing down
    np.testing.assert_allclose(attitude_of(0, HALF, 0) @ X, -Z, atol=1e-16)  # pitch 90: the nose up
    turned = rotation([0, 0, 0.7]) @ rotation([0, -0.4, 0]) @ rotation([2.0, 0, 0])
    np.testing.assert_allclose(attitude_of(2.0, -0.4, 0.7), turned, atol=1e-15)


@given(st.floats(-math.pi, math.pi), st.floats(-1.57, 1.57), st.floats(0.0, 6.28))
def test_angles_of_is_the_inverse_of_attitude_of(roll: float, pitch: float, heading: float) -> None:
    got = angles_of(attitude_of(roll, pitch, heading))
    assert 0 <= got[2] < 2 * math.pi
    for a, b in zip(
        got, (roll, pitch, heading), strict=True
    ):  # 1/cos(pitch) loses digits near the pole of angles
        assert abs(math.remainder(a - b, 2 * math.pi)) < 1e-15 * 20 / math.cos(pitch)


@pytest.mark.parametrize("pitch", [HALF, -HALF])
def test_nose_up_or_down_keeps_the_attitude(pitch: float) -> None:
    c = attitude_of(0.3, pitch, 1.2)
    roll, up, heading = angles_of(c)
    assert (roll, up) == (0.0, pytest.approx(pitch, abs=1e-15))
    assert heading == pytest.approx(1.2 - math.copysign(0.3, pitch), abs=1e-12)
    np.testing.assert_allclose(attitude_of(roll, up, heading), c, atol=1e-15)


# -- axes -------------------------------------------------------------------------------------------------


def test_axes_of_ros_and_of_ships() -> None:
    np.testing.assert_array_equal(axes_matrix("FRD"), np.eye(3))
    np.testing.assert_array_equal(axes_matrix("flu") @ [1, 2, 3], [1, -2, -3])
    np.testing.assert_array_equal(axes_matrix("RFU") @ [1, 2, 3], [2, 1, -3])


def test_of_all_triples_24_are_right_handed() -> None:
    good = 0
    for triple in product("FBRLDU", repeat=3):
        try:
            c = axes_matrix("".join(triple))
        except InputError:
            continue
        good += 1
        np.testing.assert_array_equal(c @ c.T, np.eye(3))
    assert good == 24


@pytest.mark.parametrize("axes", ["", "FL", "FLUU", "FLX", "FBU", "FLD", "xyz"])
def test_b11_axes_that_make_no_sense_are_refused(axes: str) -> None:
    with pytest.raises(InputError, match="FLU"):
        axes_matrix(axes)


# -- turns added up ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [0, 1, 2, 3, 8, 100])
def test_accumulated_is_the_running_product(count: int, rng: np.random.Generator) -> None:
    turns = rng.standard_normal((count, 3))
    got = accumulated(turns)
    assert got.shape == (count + 1, 3, 3)
    at = np.eye(3)
    np.testing.assert_array_equal(got[0], at)
    for turn, c in zip(turns, got[1:], strict=True):
        at = at @ rotation(turn)
        np.testing.assert_allclose(c, at, atol=1e-15 * max(count, 10))


def test_accumulated_turns_about_one_axis_add_up() -> None:
    steps = np.full((10_000, 1), 1e-3) * [0.6, 0.0, 0.8]
    got = accumulated(steps)
    np.testing.assert_allclose(got[-1], rotation(10.0 * np.array([0.6, 0, 0.8])), atol=1e-12)


# -- two and more directions ------------------------------------------------------------------------------


def test_coning_comes_out_of_the_means_of_the_rate() -> None:
    """A rate of 2 rad/s whose axis goes round once in 3 s, as means over 25 ms, against a two hundredth of that."""

    def after(steps: int, *, coning: bool) -> np.ndarray:
        fine = np.linspace(0, 3, 24_000, endpoint=False) + 3 / 48_000
        rate = 2 * np.stack([np.cos(2.1 * fine), np.sin(2.1 * fine), 0.3 * np.ones_like(fine)], axis=1)
        means = rate.reshape(steps, -1, 3).mean(axis=1) * 3 / steps
        return accumulated(with_coning(means) if coning else means)[-1]

    exact = after(24_000, coning=False)
    plain, better = (np.abs(after(120, coning=c) - exact).max() for c in (False, True))
    assert plain > 1e-4
    assert (
        better < 0.05 * plain
    )  # what is left are the first and the last sample, 2 of 120, and the third order
    both = np.random.default_rng(2).standard_normal((30, 3))
    parts = [with_coning(both[:12]), with_coning(both[12:])]
    assert np.array_equal(with_coning(both, [0, 12, 30]), np.concatenate(parts))


def test_triad_and_quest_without_noise(rng: np.random.Generator) -> None:
    for c in drawn(rng, 50):
        known = rng.standard_normal((3, 3))
        seen = known @ c
        np.testing.assert_allclose(triad(*seen[:2], *known[:2]), c, atol=1e-12)
        np.testing.assert_allclose(quest(seen, known, [1.0, 2.0, 0.5]), c, atol=1e-12)


def test_triad_meets_its_first_direction_and_quest_shares_out(rng: np.random.Generator) -> None:
    c, known = drawn(rng, 1)[0], np.array([Z, X])
    seen = known @ c + 0.02 * rng.standard_normal((2, 3))
    seen[0] /= np.linalg.norm(seen[0])
    exact = triad(*seen, *known)
    np.testing.assert_allclose(exact @ seen[0], Z, atol=1e-15)
    np.testing.assert_allclose(exact @ exact.T, np.eye(3), atol=1e-15)
    heavy = quest(seen, known, [1e9, 1.0])
    np.testing.assert_allclose(heavy, exact, atol=1e-7)
    assert np.abs(quest(seen, known, [1.0, 1.0]) - exact).max() > 1e-3


@pytest.mark.long
def test_covariances_of_triad_and_quest_are_those_of_theory(rng: np.random.Generator) -> None:
    """Shuster and Oh (1981); 2000 draws give a variance to 3.2 %."""
    count, sds = 2000, np.array([1e-3, 3e-3])
    known = np.array([Z, np.array([math.cos(0.5), 0.0, -math.sin(0.5)])])
    c = attitude_of(0.4, -0.3, 2.0)
    noise = sds[:, None] * rng.standard_normal((count, 2, 3))  # its part along the direction plays no role
    errors: dict[str, list[np.ndarray]] = {"triad": [], "quest": []}
    for e in noise:
        seen = known @ c + e
        errors["triad"].append(rotation_vector(triad(*seen, *known) @ c.T))
        errors["quest"].append(rotation_vector(quest(seen, known, sds**-2) @ c.T))
    information = sum((np.eye(3) - np.outer(r, r)) / s**2 for r, s in zip(known, sds, strict=True))
    theory = {"quest": np.linalg.inv(information), "triad": triad_covariance(known, sds)}
    for name, found in errors.items():
        e = np.array(found)
        root = np.linalg.cholesky(np.linalg.inv(theory[name]))
        whitened = np.cov((e @ root).T)
        np.testing.assert_allclose(whitened, np.eye(3), atol=4.5 * math.sqrt(2 / count))
        assert np.abs(e.mean(axis=0)).max() < 4.5 * sds.max() / math.sqrt(count)


def triad_covariance(known: np.ndarray, sds: np.ndarray) -> np.ndarray:
    """Across the first direction its own error; about it that of both, seen under the angle between them."""
    a, b = known
    level = np.cross(a, b) / np.linalg.norm(np.cross(a, b))
    sine, cosine = np.linalg.norm(np.cross(a, b)), a @ b
    frame = np.column_stack([a, level, np.cross(a, level)])
    # An error e of a along `level` is turned back by -e about a x level, which takes b out of the plane by
    # e cos: e cot about a brings it back.
    about = (sds[1] ** 2 + (cosine * sds[0]) ** 2) / sine**2
    local = np.diag([about, sds[0] ** 2, sds[0] ** 2])
    local[0, 2] = local[2, 0] = -(sds[0] ** 2) * cosine / sine
    return frame @ local @ frame.T


@pytest.mark.parametrize("second", [[0.0, 0.0, 2.0], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])
def test_b11_parallel_directions_are_refused(second: list[float]) -> None:
    with pytest.raises(InputError, match="parallel"):
        triad(Z, second, Z, X)
    if any(second):
        with pytest.raises(InputError, match="parallel"):
            quest([Z, second], [Z, second], [1.0, 1.0])
