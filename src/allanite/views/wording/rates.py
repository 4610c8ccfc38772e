# SPDX-License-Identifier: BSD-3-Clause
"""Earth rate, filter and plan in people's words: deg/h and deg/s, degrees, percent.

Everything here reads the plain documents of the results (`to_json`). Numbers that do not exist are null in them, and
an en dash here.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, Protocol

from allanite.lazy_dataclasses import dataclass
from allanite.noise import GaussMarkov, NoiseModel, Sinusoid
from allanite.quantities.display_units import display_unit
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.number_words import interval, number, probability
from allanite.recording.health.finding import Finding
from allanite.views.wording.findings import own_words
from allanite.views.wording.study import COLUMNS

__all__ = [
    "DEG",
    "DEG_H",
    "CheckWording",
    "EarthRateWording",
    "angle",
    "budget_lines",
    "capitalised",
    "check_wordings",
    "contradictions",
    "estimate_of",
    "known_rate",
    "model_words",
    "sentence",
    "share",
    "signed",
]

Json = Mapping[str, Any]

DEG = math.pi / 180
DEG_H = DEG / 3600

_CONTRADICTIONS = ("turn_not_listed", "turn_not_seen")


# -- small things -----------------------------------------------------------------------------------------


def angle(radians: float | None, digits: int = 6) -> str:
    """An angle in degrees.

    >>> angle(-0.40683625), angle(None)
    ('-23.31°', '–')
    """
    return "–" if radians is None else f"{radians / DEG:.{digits}g}°"


def signed(value: float | None, factor: float, decimals: int) -> str:
    """A value over a factor with so many decimals; an en dash where there is none."""
    return "–" if value is None or not math.isfinite(value) else f"{value / factor:.{decimals}f}"


def sentence(text: str, names: Iterable[str] = ()) -> str:
    """Words as a sentence: a capital letter before, unless one of `names` stands there, and a full stop after.

    >>> sentence("not resolved"), sentence("Done."), sentence("x: not resolved", ["x"])
    ('Not resolved.', 'Done.', 'x: not resolved.')
    """
    text = text.replace("+-", "±")
    named = any(text.startswith(name) and not text[len(name) :][:1].isalnum() for name in names)
    begun = text if named else capitalised(text)
    return begun + ("" if text.endswith((".", "!", "?", ":")) else ".")


def capitalised(text: str) -> str:
    """The first letter large, the others as they are."""
    return text[:1].upper() + text[1:]


def contradictions(findings: Iterable[Finding]) -> list[str]:
    """Where the signal contradicts the turns that were given: nothing below it counts until that is settled."""
    return [sentence(own_words(f)) for f in findings if f.code in _CONTRADICTIONS]


def model_words(model: NoiseModel | Json) -> str:
    """The terms of a noise model with their values in people's units.

    >>> model_words({"kind": "rate", "terms": [{"type": "white", "N": 2.1e-4}]})
    'N 0.722 deg/√h'
    """
    made = model if isinstance(model, NoiseModel) else NoiseModel.from_json(model)
    values: dict[str, float] = {}
    lines: list[str] = []
    for term in made.terms:
        if isinstance(term, Sinusoid):
            name, factor = display_unit(made.kind, "mean", made.unit)
            lines.append(f"line {number(term.frequency, 4)} Hz of {number(term.amplitude / factor)} {name}")
        elif isinstance(term, GaussMarkov):
            values |= {"B": term.B_equiv, "T": term.T}
        else:
            values |= {s: getattr(term, s) for s in COLUMNS if hasattr(term, s)}
    noise = [_coefficient(made.kind, made.unit, s, values[s]) for s in COLUMNS if s in values]
    return ", ".join([*noise, *lines]) or "no noise"


def _coefficient(kind: str, unit: str, symbol: str, value: float) -> str:
    name, factor = display_unit(kind, symbol, unit)
    return f"{'T_b' if symbol == 'T' else symbol} {number(value / factor)} {name}"


# -- estimates --------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class EarthRateWording:
    """One estimate of the Earth rate as people read it.

    Attributes
    ----------
    name, note : str
    value, range : str
        In deg/h.
    seconds, seconds_range : str
        The same in deg/s.
    kept : bool
        The estimate of this report, not one beside it.
    """

    name: str
    note: str
    value: str
    range: str
    seconds: str
    seconds_range: str
    kept: bool = False


def estimate_of(
    rate: float | None,
    low: float | None,
    high: float | None,
    *,
    name: str = "",
    note: str = "",
    kept: bool = False,
) -> EarthRateWording:
    """A rate [rad/s] and the ends of its interval in both units."""
    shown = [_scaled(rate, low, high, factor) for factor in (DEG_H, DEG)]
    return EarthRateWording(
        name=name,
        note=note,
        value=shown[0][0],
        range=shown[0][1],
        seconds=shown[1][0],
        seconds_range=shown[1][1],
        kept=kept,
    )


def _scaled(rate: float | None, low: float | None, high: float | None, factor: float) -> tuple[str, str]:
    if rate is None:
        return "–", ""
    if low is None or high is None:
        return number(rate / factor, 5), ""
    middle, lower, upper = interval(rate / factor, low / factor, high / factor)
    return middle, f"[{lower}, {upper}]"


def known_rate(value: float) -> EarthRateWording:
    """The rotation of the Earth as it is known."""
    return EarthRateWording(
        name="known",
        note="sidereal rotation of the Earth",
        value=f"{value / DEG_H:.3f}",
        range="",
        seconds=f"{value / DEG:.6f}",
        seconds_range="",
    )


def budget_lines(budget: Mapping[str, float | None]) -> list[tuple[str, str, str]]:
    """Source, standard uncertainty in deg/h, and its share of the Earth's rotation; the sum last.

    Empty where nothing but the noise is in it.
    """
    known = {k: v for k, v in budget.items() if v is not None and math.isfinite(v)}
    if not any(value for name, value in known.items() if name != "noise"):
        return []
    rows = [*known.items(), ("together", math.sqrt(sum(v**2 for v in known.values())))]
    return [
        (
            name,
            number(value / DEG_H, 3) if value else "not stated",
            f"{100 * value / EARTH_RATE:.2g} %" if value else "",
        )
        for name, value in rows
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckWording:
    """One question put to the residuals, and the answer."""

    name: str
    passed: bool
    measure: str
    chance: str
    says: str


class _Answered(Protocol):
    """A question put to residuals, with its answer."""

    @property
    def name(self) -> str: ...

    @property
    def passed(self) -> bool: ...

    @property
    def statistic(self) -> float: ...

    @property
    def dof(self) -> float: ...

    @property
    def p(self) -> float: ...

    @property
    def tries(self) -> int: ...

    @property
    def two_sided(self) -> bool: ...

    @property
    def says(self) -> str: ...


def check_wordings(checks: Iterable[_Answered]) -> list[CheckWording]:
    """Checks, those that did not pass first."""
    lines = [
        CheckWording(
            name=c.name,
            passed=c.passed,
            measure=f"{number(c.statistic, 3)} ({round(c.dof, 1):g})",
            chance=_chance(c),
            says="" if c.passed else sentence(c.says),
        )
        for c in checks
    ]
    return sorted(lines, key=lambda line: line.passed)


def _chance(check: _Answered) -> str:
    """p, and what was done to the probability that belongs to the chi-square beside it."""
    p = probability(check.p)
    if check.tries > 1:
        return f"{p}, multiplied by {check.tries} tries"
    return f"{p}, two-sided" if check.two_sided else p


def share(rate: float | None) -> str:
    """A rate [rad/s] as a part of the Earth's.

    >>> share(3.2e-5)
    '44 %'
    """
    return "–" if rate is None else f"{100 * rate / EARTH_RATE:.2g} %"
