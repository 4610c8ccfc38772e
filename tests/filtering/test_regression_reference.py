# SPDX-License-Identifier: BSD-3-Clause
"""R7: the linear least-squares sets of the NIST Statistical Reference Datasets through the regression.

Certified coefficients are those of exact arithmetic on the printed data: they are computed here anew with fractions.
LRE = -log10 of the relative error, of the worst coefficient.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from allanite.filtering.regression import RANK, Regression, regress
from allanite.noise import NoiseModel, White

WHITE = NoiseModel.of(White(N=1.0))

LONGLEY = """
60323 83.0 234289 2356 1590 107608 1947
61122 88.5 259426 2325 1456 108632 1948
60171 88.2 258054 3682 1616 109773 1949
61187 89.5 284599 3351 1650 110929 1950
63221 96.2 328975 2099 3099 112075 1951
63639 98.1 346999 1932 3594 113270 1952
64989 99.0 365385 1870 3547 115094 1953
63761 100.0 363112 3578 3350 116219 1954
66019 101.2 397469 2904 3048 117388 1955
67857 104.6 419180 2822 2857 118734 1956
68169 108.4 442769 2936 2798 120445 1957
66513 110.8 444546 4681 2637 121950 1958
68655 112.6 482704 3813 2552 123366 1959
69564 114.2 502601 3931 2514 125368 1960
69331 115.7 518173 4806 2572 127852 1961
70551 116.9 554894 4007 2827 130081 1962
"""
FILIP_Y = """
0.8116 0.9072 0.9052 0.9039 0.8053 0.8377 0.8667 0.8809 0.7975 0.8162 0.8515 0.8766 0.8885 0.8859 0.8959 0.8913 0.8959
0.8971 0.9021 0.909 0.9139 0.9199 0.8692 0.8872 0.89 0.891 0.8977 0.9035 0.9078 0.7675 0.7705 0.7713 0.7736 0.7775
0.7841 0.7971 0.8329 0.8641 0.8804 0.7668 0.7633 0.7678 0.7697 0.77 0.7749 0.7796 0.7897 0.8131 0.8498 0.8741 0.8061
0.846 0.8751 0.8856 0.8919 0.8934 0.894 0.8957 0.9047 0.9129 0.9209 0.9219 0.7739 0.7681 0.7665 0.7703 0.7702 0.7761
0.7809 0.7961 0.8253 0.8602 0.8809 0.8301 0.8664 0.8834 0.8898 0.8964 0.8963 0.9074 0.9119 0.9228
"""
FILIP_X = """
-6.860120914 -4.324130045 -4.358625055 -4.358426747 -6.955852379 -6.661145254 -6.355462942 -6.118102026 -7.115148017
-6.815308569 -6.519993057 -6.204119983 -5.853871964 -6.109523091 -5.79832982 -5.482672118 -5.171791386 -4.851705903
-4.517126416 -4.143573228 -3.709075441 -3.499489089 -6.300769497 -5.953504836 -5.642065153 -5.031376979 -4.680685696
-4.329846955 -3.928486195 -8.56735134 -8.363211311 -8.107682739 -7.823908741 -7.522878745 -7.218819279 -6.920818754
-6.628932138 -6.323946875 -5.991399828 -8.781464495 -8.663140179 -8.473531488 -8.247337057 -7.971428747 -7.676129393
-7.352812702 -7.072065318 -6.774174009 -6.478861916 -6.159517513 -6.835647144 -6.53165267 -6.224098421 -5.910094889
-5.598599459 -5.290645224 -4.974284616 -4.64454848 -4.290560426 -3.885055584 -3.408378962 -3.13200249 -8.726767166
-8.66695597 -8.511026475 -8.165388579 -7.886056648 -7.588043762 -7.283412422 -6.995678626 -6.691862621 -6.392544977
-6.067374056 -6.684029655 -6.378719832 -6.065855188 -5.752272167 -5.132414673 -4.811352704 -4.098269308 -3.66174277
-3.2644011
"""
#: What Wampler3 adds to a polynomial; Wampler4 and 5 add 100 and 10 000 times as much. It is orthogonal to the columns.
WAMPLER = [759, *(-2048, 2048, -2048, 2523, -2048, 2048, -2048, 1838, -2048)]
WAMPLER = [*WAMPLER, 2048, *WAMPLER[::-1]]
#: Published by NIST for Longley: the computation in fractions has to give them.
CERTIFIED = [-3482258.63459582, 15.0618722713733, -0.0358191792925910, -2.02022980381683, -1.03322686717359,
             -0.0511041056535807, 1829.15146461355]  # fmt: skip


def solved(columns: list[list[Fraction]], y: list[Fraction]) -> list[Fraction]:
    """Least squares in exact arithmetic: the normal equations by elimination."""
    k = len(columns)
    table = [
        [sum(a * b for a, b in zip(p, q, strict=True)) for q in columns]
        + [sum(a * b for a, b in zip(p, y, strict=True))]
        for p in columns
    ]
    for i in range(k):
        for j in range(k):
            if j != i:
                ratio = table[j][i] / table[i][i]
                table[j] = [a - ratio * b for a, b in zip(table[j], table[i], strict=True)]
    return [table[i][k] / table[i][i] for i in range(k)]


def fitted(columns: list[list[Fraction]], y: list[Fraction]) -> Regression:
    table = np.array([[float(v) for v in column] for column in columns]).T
    return regress(
        [float(v) for v in y], table, WHITE, dt=1.0, names=[f"B{i}" for i in range(table.shape[1])]
    )


def lre(found: np.ndarray, exact: list[Fraction]) -> float:
    """Digits of the worst coefficient."""
    off = [abs(Fraction(float(f)) - e) / abs(e) for f, e in zip(found, exact, strict=True)]
    return min(-math.log10(float(o)) if o else 17.0 for o in off)


def powers(x: list[Fraction], order: int) -> list[list[Fraction]]:
    return [[v**k for v in x] for k in range(order + 1)]


def wampler(number: int) -> tuple[list[list[Fraction]], list[Fraction]]:
    columns = powers([Fraction(i) for i in range(21)], 5)
    weights = [Fraction(1, 10**k) if number == 2 else Fraction(1) for k in range(6)]
    size = {1: 0, 2: 0, 3: 1, 4: 100, 5: 10_000}[number]
    y = [sum(w * c[i] for w, c in zip(weights, columns, strict=True)) + size * WAMPLER[i] for i in range(21)]
    return columns, y


@pytest.mark.parametrize("number", [1, 2, 3, 4, 5])
def test_r7_wampler(number: int) -> None:
    columns, y = wampler(number)
    exact = [Fraction(1, 10**k) if number == 2 else Fraction(1) for k in range(6)]
    assert solved(columns, y) == exact  # what is added is orthogonal to the columns, as NIST says
    fit = fitted(columns, y)
    if number <= 3 or np.finfo(np.longdouble).nmant > np.finfo(np.float64).nmant:
        assert lre(fit.coefficients, exact) >= 9
    else:  # coefficients 1e3 to 1e7 times smaller than their own standard deviations: digits of those count
        sd = fit.sd * math.sqrt(fit.chi2 / fit.dof)
        assert (sd > 100).any()
        assert np.max(np.abs(fit.coefficients - 1) / sd) < 1e-12


def test_r7_longley() -> None:
    rows = [[Fraction(v) for v in line.split()] for line in LONGLEY.split("\n") if line]
    columns = [[Fraction(1)] * len(rows), *([row[i] for row in rows] for i in range(1, 7))]
    y = [row[0] for row in rows]
    exact = solved(columns, y)
    assert [float(e) for e in exact] == pytest.approx(CERTIFIED, rel=1e-13)
    assert lre(fitted(columns, y).coefficients, exact) >= 9


@pytest.mark.long
def test_r7_filip() -> None:
    """A polynomial of tenth order: its columns are one plane to ten digits, and that is what is said of them."""
    x, y = ([Fraction(v) for v in text.split()] for text in (FILIP_X, FILIP_Y))
    assert len(x) == len(y) == 82
    columns = powers(x, 10)
    exact = solved(columns, y)
    assert float(exact[0]) == pytest.approx(-1467.48961422980, rel=1e-13)  # as NIST certifies
    assert float(exact[10]) == pytest.approx(-0.402962525080404e-4, rel=1e-13)
    fit = fitted(columns, y)
    unit = np.array([[float(v) for v in c] for c in columns]).T
    condition = np.linalg.cond(unit / np.linalg.norm(unit, axis=0))
    if fit.unbounded:
        assert condition > 1 / RANK  # refused, and rightly
        assert set(fit.unbounded) == set(fit.names)
    else:
        assert lre(fit.coefficients, exact) >= 7
    # as a polynomial around its middle, the same regression has all its digits
    middle = sum(x) / len(x)
    shifted = powers([v - middle for v in x], 10)
    assert lre(fitted(shifted, y).coefficients, solved(shifted, y)) >= 7
