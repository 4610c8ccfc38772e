# SPDX-License-Identifier: BSD-3-Clause
"""Writes allantools.csv: deviations of a record that anybody can generate, from an independent package.

    pip install allantools && python tests/published/make_allantools.py

Record: the first 100 000 numbers of the generator of NIST SP 1065, section 12.4 (n <- 16807 n mod 2147483647 from
1234567890, divided by 2147483647), read as fractional frequency at 1 Hz.
Package: allantools (A. Wallin and others), LGPL-3; its error bars are not used.
"""

from __future__ import annotations

import csv
from importlib.metadata import version
from pathlib import Path

import allantools
import numpy as np

STATISTICS = ("adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "totdev")
LAGS = (1, 2, 3, 10, 99, 1000, 9999, 33_000)


def generator(n: int) -> np.ndarray:
    values, state = np.empty(n), 1234567890
    for i in range(n):
        values[i] = state / 2147483647
        state = 16807 * state % 2147483647
    return values


def main() -> None:
    y = generator(100_000)
    with Path(__file__).with_name("allantools.csv").open("w", newline="") as file:
        file.write(f"# allantools {version('allantools')}, written by make_allantools.py\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["statistic", "m", "deviation", "terms"])
        for name in STATISTICS:
            tau, deviation, _, terms = getattr(allantools, name)(
                y, rate=1.0, data_type="freq", taus=list(LAGS)
            )
            writer.writerows(
                [name, round(m), repr(float(d)), int(n)]
                for m, d, n in zip(tau, deviation, terms, strict=True)
            )


if __name__ == "__main__":
    main()
