# SPDX-License-Identifier: BSD-3-Clause
"""Sums over samples have the same digits whatever the number of threads of linear algebra."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

SCRIPT = """
import hashlib
import numpy as np
import allanite as al
from allanite.files.readers.filled_stamps import ArrayStamps
from allanite.files.readers.timebase import fit_grid

rng = np.random.default_rng(5)
n = 400_000
stamps = ArrayStamps((np.arange(n) + 0.02 * rng.standard_normal(n)) / 97.3)
y = rng.standard_normal(n)
y[1000:1003] = np.nan
record = al.Recording.from_rate(y, rate=97.3, unit="deg/s", names="gyro")
grid = fit_grid(stamps, source="t", unit="s")
curve = al.allan_curve(record, statistic="adev")
spectrum = al.power_spectrum(record, "gyro", method="welch")
print(grid.rate, sorted(grid.facts.items()))
print(hashlib.sha256(curve.deviation.tobytes()).hexdigest(), hashlib.sha256(spectrum.density.tobytes()).hexdigest())
print(hashlib.sha256(spectrum.edf.tobytes()).hexdigest())
"""


@pytest.mark.long
def test_digits_do_not_depend_on_threads() -> None:
    printed = []
    for threads in ("1", "2"):
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": threads, "OMP_NUM_THREADS": threads}
        run = subprocess.run(
            [sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, check=True
        )
        printed.append(run.stdout)
    assert printed[0] == printed[1]
