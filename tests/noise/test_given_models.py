# SPDX-License-Identifier: BSD-3-Clause
"""Which noise model belongs to which channel: one for a kind, by name, by role."""

from __future__ import annotations

from typing import Any

import pytest

from allanite.errors import InputError
from allanite.noise import NoiseModel, White
from allanite.noise.given_models import models_of
from allanite.recording.records import Kind

GYRO, OTHER = NoiseModel.of(White(N=1e-4)), NoiseModel.of(White(N=2e-4))
ACC = NoiseModel.of(White(N=1e-3), kind="acceleration")
KINDS = {"g": Kind.RATE, "h": Kind.RATE, "a": Kind.ACCELERATION}
COUNTS = dict.fromkeys(("c", "d"), Kind.UNKNOWN)


@pytest.mark.parametrize(
    ("model", "expected"),
    [
        (None, {}),
        (GYRO, {"g": GYRO, "h": GYRO}),
        ({"gyro": GYRO, "accelerometer": ACC}, {"g": GYRO, "h": GYRO, "a": ACC}),
        ({"gyro": GYRO, "h": OTHER, "a": ACC, "unused": ACC}, {"g": GYRO, "h": OTHER, "a": ACC}),
        ({"a": ACC}, {"a": ACC}),
    ],
)
def test_a_channel_has_its_own_model_else_that_of_its_role(model: Any, expected: Any) -> None:
    assert models_of(model, KINDS, needed=False) == expected
    if model is None or len(expected) == len(KINDS):
        assert models_of(model, KINDS) == expected


def test_roles_may_be_told_where_the_kinds_do_not_say() -> None:
    roles = {"gyro": ("c",), "accelerometer": ("d",)}
    given = {"gyro": GYRO, "accelerometer": ACC}
    assert models_of(given, COUNTS, roles=roles) == {"c": GYRO, "d": ACC}
    assert models_of(ACC, {"c": Kind.UNKNOWN}, roles=roles) == {"c": ACC}
    assert models_of(given, COUNTS, needed=False) == {}


@pytest.mark.parametrize(
    ("model", "kinds", "said"),
    [
        ({"gyro": GYRO}, KINDS, "no noise model for a; there are: gyro"),
        ({}, KINDS, "no noise model for g, h, a; there are: none"),
        (GYRO, KINDS, "no noise model for a: the given one is of rate, not of acceleration"),
        ({"gyro": ACC, "a": ACC}, KINDS, "the noise model of 'g' is of acceleration, not of rate"),
        (GYRO, COUNTS, "one noise model cannot apply to accelerometers and gyros"),
    ],
)
def test_what_is_missing_or_of_another_sensor_is_named(model: Any, kinds: Any, said: str) -> None:
    roles = {"gyro": ("c",), "accelerometer": ("d",)} if kinds is COUNTS else None
    with pytest.raises(InputError, match=said):
        models_of(model, kinds, roles=roles)
