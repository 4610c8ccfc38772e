# SPDX-License-Identifier: BSD-3-Clause
"""What the pages of measurements of rates share: estimates, checks, budget, contradicted turns, and who they cite."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from allanite.quantities.number_words import number
from allanite.recording.health.finding import Finding
from allanite.views.blocks import Banner, Cell, PageBlock, table
from allanite.views.wording.rates import DEG, CheckWording, EarthRateWording, capitalised, contradictions

__all__ = [
    "BIRGE",
    "ROSENBERG",
    "SEED",
    "TOGETHER",
    "angle_budget",
    "checks_table",
    "contradiction_banners",
    "estimates_table",
    "rate_budget",
]

SEED = (
    "F. O. Silva, R. R. Jeronymo, F. A. Pavan, R. T. Tosin, Caracterização de sensores MEMS através da variância de "
    "Allan para a filtragem de ruídos estocásticos."
)
ROSENBERG = (
    "B. Rosenberg, Random coefficients models, Annals of Economic and Social Measurement 2 (1973) 399: regression by "
    "the filter of the noise."
)
BIRGE = (
    "R. T. Birge, The calculation of errors by the method of least squares, Phys. Rev. 40 (1932) 207: the ratio that "
    "widens."
)


TOGETHER = "together"
"""What the whole of a budget is called."""
_NEGLIGIBLE = 1e-3  # part of the whole below which an angle has no line in a budget
_QUESTIONS = (
    "Checks of the residuals. Chance: the probability of so large a value if the noise model is right."
)


def contradiction_banners(findings: Iterable[Finding]) -> list[PageBlock]:
    """Where the signal contradicts the turns that were given."""
    return [Banner("fatal", "Signal and list disagree.", words) for words in contradictions(findings)]


def estimates_table(lines: Iterable[EarthRateWording], caption: str, interval: str = "") -> list[PageBlock]:
    """Estimates in deg/h and deg/s; the one that counts stands out. `interval` goes into the heads."""
    rows, kept = [], []
    for line in lines:
        rows.append(
            (
                Cell(text=capitalised(line.name), below=line.note),
                Cell(text=line.value, below=line.range, look="value"),
                Cell(text=line.seconds, below=line.seconds_range, look="value"),
            )
        )
        kept.append(line.kept)
    heads = ("Estimator", f"deg/h{interval}", f"deg/s{interval}")
    return table(heads, rows, caption=caption, kept=kept)


def checks_table(checks: Iterable[CheckWording], caption: str = _QUESTIONS) -> list[PageBlock]:
    """Each question put to the residuals, with its answer."""
    rows = [
        (
            Cell(text=capitalised(line.name), below=line.says),
            Cell(text="passed" if line.passed else "not passed", look="good" if line.passed else "fatal"),
            line.measure,
            line.chance,
        )
        for line in checks
    ]
    return table(("Check", "Answer", "χ² (expected)", "Chance"), rows, caption=caption)


def rate_budget(rows: Sequence[tuple[str, str, str]]) -> list[PageBlock]:
    """Where the interval of a rate comes from; the sum stands out."""
    return table(
        ("Source", "Standard uncertainty, deg/h", "Of the Earth rate"),
        rows,
        caption="Origin of the interval.",
        kept=[name == TOGETHER for name, _, _ in rows],
    )


def angle_budget(budget: Mapping[str, float], what: str) -> list[PageBlock]:
    """Where the uncertainty of an angle comes from, in degrees; the sum stands out. `what` names the angle."""
    whole = budget.get(TOGETHER) or math.sqrt(sum(value**2 for value in budget.values()))
    rows = [
        (name, value) for name, value in budget.items() if name != TOGETHER and value > _NEGLIGIBLE * whole
    ]
    rows += [(TOGETHER, whole)] if len(rows) > 1 else []
    return table(
        ("Source", f"Standard uncertainty of the {what}, deg"),
        [(name, number(value / DEG, 3)) for name, value in rows],
        caption="Uncertainty budget.",
        kept=[name == TOGETHER for name, _ in rows],
    )
