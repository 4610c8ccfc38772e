# SPDX-License-Identifier: BSD-3-Clause
"""A sum of sinusoids against sines that are computed sample by sample."""

import numpy as np
import pytest

from allanite.noise.sinusoid_sum import SinusoidSum


@pytest.mark.parametrize(("first", "count"), [(0, 1), (0, 1024), (5, 3000), (19_000_001, 2048), (7, 0)])
def test_it_is_the_sum_of_sines(first, count, rng):
    f, a, b = rng.uniform(0, 0.5, 7), rng.standard_normal(7), rng.standard_normal(7)
    k = np.arange(first, first + count)[:, None]
    angle = 2 * np.pi * (f * k % 1.0)
    expected = (a * np.cos(angle) + b * np.sin(angle)).sum(axis=1)
    found = SinusoidSum(frequencies=f, cosines=a, sines=b).samples(first, count)
    assert found.shape == (count,)
    wider = SinusoidSum(frequencies=f, cosines=a, sines=b).samples(max(first - 3, 0), count + 70_000)
    assert np.array_equal(wider[min(first, 3) :][:count], found)
    # f k is rounded to half a unit of its last place, once here and once there
    assert np.abs(found - expected).max(initial=0.0) <= 1e-13 + 7 * 4 * np.pi * np.spacing(
        0.5 * (first + count)
    )
