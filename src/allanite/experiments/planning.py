# SPDX-License-Identifier: BSD-3-Clause
"""How well will it be known? The standard deviation of an Earth rate or a heading before a sample is taken.

The covariance of a regression depends on the noise, the turns and the clock, not on the data. So it is computed from
the columns alone, by the filter that would whiten the record (`allanite.filtering.regression`): one pass for each dwell
gives the information after any time.

After some dwells the gain of the filter repeats from one round of positions to the next. From then on every round
brings the same information, and longer records follow by a straight line.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from enum import StrEnum
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.north.budget import axis_terms
from allanite.filtering.block_means import longest_block
from allanite.filtering.regression import Whitener
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, White
from allanite.quantities.earlier_documents import texts
from allanite.quantities.earth import EARTH_RATE, checked_latitude
from allanite.quantities.result import Result
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.quantities.verdict import Tone, Verdict

__all__ = ["DURATIONS", "DWELLS", "LONGEST", "Plan", "PlanRemark", "PlanVerdict", "plan"]

Array = NDArray[np.float64]
What = Literal["rate", "north"]

#: Times from turn to turn that are compared [s].
DWELLS = (5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1800.0)
#: Lengths of record that are tabulated [s].
DURATIONS = (60.0, 300.0, 720.0, 1500.0, 3600.0, 7200.0, 14400.0, 28800.0, 86400.0)
#: Beyond it a goal counts as not reached [s].
LONGEST = 30 * 86400.0
#: Goals unless told otherwise: relative for the rate, an angle for north.
GOALS = {"rate": 0.03, "north": math.radians(1.0)}
#: Dwells and blocks in a pass, roughly: what lies beyond follows by a straight line.
PASS, ROWS = 480, 60_000
#: Directions in which the worst is looked for.
HEADINGS = np.arange(72) * (math.pi / 36)
#: Information below this part of what the columns hold by themselves is rounding.
RANK = 1e-9


#: What is left of a goal that is not reached in time, in sentences of version 1.
_LEFT = re.compile(r"uncertainties leave (\S+) (%|deg) then$")


class PlanVerdict(Verdict):
    """Is the goal reached?"""

    NEVER = "never reached", "goal never reached", Tone.WARNING
    LATE = "not within 30 days", "goal not reached within 30 days", Tone.WARNING
    REACHED = "reached", "goal reached", Tone.GOOD


class PlanRemark(StrEnum):
    """What makes a plan doubtful."""

    NO_WHITE = "no white noise"
    UNDECIDED = "noise not decided"


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan(Result):
    """Standard deviations to be expected, by dwell and length of record.

    Attributes
    ----------
    remarks : tuple of PlanRemark
        What makes the plan doubtful: "no white noise" in the model, or "noise not decided" (see `undecided`).
    verdict : PlanVerdict
        "reached"; "not within 30 days" (see `left`); or "never reached", for the stated uncertainties.
    what : "rate" or "north"
        What is planned.
    dwells : ndarray, shape (n,) [s]
        From the beginning of one turn to the beginning of the next.
    durations : ndarray, shape (m,) [s]
        Lengths of record.
    sd : ndarray, shape (n, m) [rad/s or rad]
        Of the Earth rate, or of the heading (the largest over all headings; linear, so meaningful below some 20
        deg), by the noise alone; infinite where that record cannot tell it.
    total : ndarray, shape (n, m) [rad/s or rad]
        With the stated uncertainties.
    best : ndarray, shape (m,) [s]
        The dwell with the smallest standard deviation; NaN where no dwell gives one.
    goal : float
        Relative for the rate, in rad for north.
    reached : ndarray, shape (n,) [s]
        When `total` comes down to the goal; infinite where it does not within 30 days.
    dwell, duration : float or None [s]
        The dwell that reaches the goal first, and when; None where none does.
    floor : float
        What no record comes below, for the stated uncertainties; like `goal`.
    left : float
        What noise and stated uncertainties leave after 30 days, like `goal`.
    budget : mapping of str to float
        The stated uncertainties that make up the floor, like `goal`.
    dead_time : float [s]
        Lost at each turn.
    latitude : float [rad]
        Where it will be measured.
    positions : int
        Gone through in turn, evenly around.
    axes : int
        Horizontal axes.
    model : NoiseModel
        Of the sensor.
    undecided : bool
        The record at rest leaves another model open, which needs less time.
    """

    FORMAT: ClassVar[str] = "allanite-plan"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("remarks",)

    verdict: PlanVerdict
    what: What
    dwells: Array
    durations: Array
    sd: Array = field(repr=False)
    total: Array = field(repr=False)
    best: Array = field(repr=False)
    goal: float
    reached: Array = field(repr=False)
    dwell: float | None
    duration: float | None
    floor: float
    left: float
    budget: Mapping[str, float] = field(default_factory=dict)
    dead_time: float
    latitude: float
    positions: int
    axes: int
    model: NoiseModel = field(repr=False)
    undecided: bool = False

    @property
    def says(self) -> str:
        """The plan in a sentence or two."""
        aim = f"{self.amount(self.goal)} (one standard deviation)"
        match self.verdict:
            case PlanVerdict.NEVER:
                worst = max(self.budget, key=lambda name: self.budget[name])
                return (
                    f"{aim} is never reached: the stated uncertainties leave {self.amount(self.floor)}, most of it by "
                    f"{worst} ({self.amount(self.budget[worst])})"
                )
            case PlanVerdict.LATE:
                return (
                    f"{aim} is not reached within 30 days: noise and stated uncertainties leave "
                    f"{self.amount(self.left)} then"
                )
        return f"{aim} is reached after {self._when()}"

    def _when(self) -> str:
        first = int(np.nanargmin(self.reached))
        near = self.dwells[self.reached <= 1.05 * self.reached[first]]
        others = (
            f"; dwells of {near.min():g} to {near.max():g} s need at most 5 % longer" if len(near) > 1 else ""
        )
        lost = (
            f"{self.dead_time:g} s are lost at each turn" if self.dead_time else "no time is lost in turning"
        )
        return f"{_time(float(self.reached[first]))} with dwells of {self.dwells[first]:g} s, when {lost}{others}"

    def amount(self, value: float) -> str:
        """A goal, or what is compared with it, in people's units: 3 %, or 1 deg."""
        return f"{100 * value:.3g} %" if self.what == "rate" else f"{math.degrees(value):.3g} deg"

    @property
    def remarks(self) -> tuple[PlanRemark, ...]:
        """Codes of what makes the plan doubtful."""
        return tuple(code for code, _ in self._doubts())

    @property
    def notes(self) -> tuple[str, ...]:
        """What makes the plan doubtful, in sentences."""
        return tuple(says for _, says in self._doubts())

    def _doubts(self) -> Iterator[tuple[PlanRemark, str]]:
        if not any(isinstance(term, White) for term in self.model.terms):
            yield (
                PlanRemark.NO_WHITE,
                "the model has no white noise, but every sensor does: the plan is optimistic, its dwells too short",
            )
        if self.undecided:
            family = "flicker" if self.model.family == "flicker" else "the Gauss-Markov term"
            says = (
                "the record at rest cannot separate flicker from a Gauss-Markov term; the plan assumes "
                f"{family}, which needs the longer record"
            )
            yield PlanRemark.UNDECIDED, says

    @property
    def unit(self) -> float:
        """What `goal` and `floor` are relative to: the rate of the Earth [rad/s], or 1 rad."""
        return EARTH_RATE if self.what == "rate" else 1.0

    def table(self) -> list[dict[str, float]]:
        """One row for each dwell and duration: dwell [s], duration [s], sd, total [rad/s or rad]."""
        return [
            {"dwell": float(d), "duration": float(t), "sd": float(s), "total": float(u)}
            for d, sd, total in zip(self.dwells, self.sd, self.total, strict=True)
            for t, s, u in zip(self.durations, sd, total, strict=True)
        ]

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        """Version 1 held sentences for the verdict, for what is left and for doubts."""
        if data.get("version") != 1:
            return data
        says = str(data.get("says"))
        verdict = PlanVerdict.LATE if "not reached within" in says else PlanVerdict.REACHED
        left = _LEFT.search(says)
        return {
            **data,
            "version": 2,
            "verdict": PlanVerdict.NEVER if "is never reached" in says else verdict,
            "left": None if left is None else float(left[1]) * (0.01 if left[2] == "%" else math.radians(1)),
            "undecided": any("cannot tell flicker" in note for note in texts(data.get("notes"))),
        }


def plan(
    model: NoiseModel,
    *,
    latitude: float,
    what: What = "rate",
    goal: float | None = None,
    dead_time: float = 2.0,
    dwells: Sequence[float] = DWELLS,
    durations: Sequence[float] = DURATIONS,
    stated: SetupUncertainty | None = None,
    misalignment: float = 0.0,
    positions: int | None = None,
    axes: int = 1,
) -> Plan:
    """The standard deviation of the Earth rate or of north against dwell and length of record.

    Parameters
    ----------
    model : NoiseModel
        Noise model of a rate sensor at rest, in SI.
    latitude : float [rad]
        Latitude of the place.
    what : "rate" or "north"
        The Earth rate from one horizontal axis turned between north and south, or the heading of a table.
    goal : float, optional
        Relative standard deviation of the rate (default 0.03), or that of the heading in rad (default 1 deg).
    dead_time : float [s]
        Lost at each turn: the turn itself and what is left out after it.
    dwells : sequence of float [s]
        Times from the start of one turn to the start of the next; the part used of each is shorter by `dead_time`.
    durations : sequence of float [s]
        Lengths of the record.
    stated : SetupUncertainty, optional
        Uncertainties that no length of record reduces.
    misalignment : float [rad]
        Standard uncertainty of the direction of each axis on the table; for north only.
    positions : int, optional
        Gone through in turn, evenly around: 2 for the rate; 4 by default for north, at least 3 with one axis.
    axes : int
        Horizontal axes: 1, or 2 at right angles; for the rate 1.

    Raises
    ------
    InputError
        A latitude at a pole (undefined), times that are not positive, no dwell longer than the dead time, positions
        on one line for one axis, a model without noise.

    Notes
    -----
    Blocks are as long as `allanite.filtering.block_means` allows, 24 in a dwell or more. The information, the inverse
    of the covariance, is interpolated between blocks; beyond 480 dwells (fewer where the noise asks for many blocks) it
    follows the straight line of the last half, within 0.1 % of what a longer pass gives.
    """
    grid, spans = _times("dwells", dwells), _times("durations", durations)
    count = _layout(model, latitude, what, goal, dead_time, positions, axes, misalignment)
    aim = GOALS[what] if goal is None else float(goal)
    if not np.any(grid > dead_time):
        raise InputError(f"no dwell is longer than the dead time of {dead_time:g} s: give longer dwells")
    settings = [
        _PlanSetting(
            model=family,
            latitude=latitude,
            what=what,
            dead_time=dead_time,
            positions=count,
            axes=axes,
            stated=stated or SetupUncertainty(),
            misalignment=misalignment,
        )
        for family in model.families
    ]
    return _cautious([_of_family(setting, aim, grid, spans) for setting in settings])


@dataclass(frozen=True, slots=True, kw_only=True)
class _PlanSetting:
    """What does not depend on dwell and duration."""

    model: NoiseModel
    latitude: float
    what: What
    dead_time: float
    positions: int
    axes: int
    stated: SetupUncertainty
    misalignment: float

    @property
    def unit(self) -> float:
        return EARTH_RATE if self.what == "rate" else 1.0

    @property
    def projection(self) -> float:
        return math.cos(self.latitude)

    def headings(self, dwell: NDArray[np.int64]) -> Array:
        """Of the first axis, relative to the mark."""
        return np.asarray((dwell % self.positions) * (2 * math.pi / self.positions))

    def budget(self) -> dict[str, float]:
        """Stated uncertainties that do not average: relative, or in rad."""
        if self.what == "rate":
            return self.stated.budget(self.latitude)
        even = [np.eye(2)] * self.axes
        if self.axes == 2 and self.positions == 2:  # each axis sees one component
            even = [np.diag([1.0, 0.0]), np.diag([0.0, 1.0])]
        worst = np.max([axis_terms(even, psi) for psi in HEADINGS], axis=0)
        return {
            "scale factor": float(worst[0]) * self.stated.scale,
            "misalignment": float(worst[1]) * self.misalignment,
            "tilt": abs(math.tan(self.latitude)) * self.stated.tilt,
        }

    def wander(self) -> float:
        """Variance of north from n dwells whose headings are off at random, times n; for the worst heading.

        One axis weighs dwell d by (2/n) sin(psi + theta_d), two together by 1/n.
        """
        if self.what == "rate" or self.axes == 2:
            return 0.0 if self.what == "rate" else self.stated.heading**2
        angles = HEADINGS[:, None] + self.headings(np.arange(self.positions))
        return float(4 * (np.sin(angles) ** 4).mean(axis=1).max()) * self.stated.heading**2


@dataclass(frozen=True, slots=True, kw_only=True)
class _Growth:
    """Information over time, for one dwell.

    `products` holds the sums of products of the whitened columns (signal..., level) of each axis after each block:
    shape (n + 1, axes, k + 1, k + 1). `steady` is what the stated uncertainties leave for ever, `wander` the variance
    that errors of heading leave after one dwell.
    """

    setting: _PlanSetting
    dwell: float
    blocks: int
    products: Array
    steady: float
    wander: float

    @classmethod
    def of(cls, setting: _PlanSetting, dwell: float, floor: float) -> _Growth:
        blocks = math.ceil(dwell / longest_block(setting.model, dwell) - 1e-9)
        dt = dwell / blocks
        most = max(min(PASS, ROWS // blocks), 4 * setting.positions)
        rows = blocks * most
        number = np.arange(rows) // blocks
        into = (np.arange(rows) % blocks) * dt  # since the beginning of the dwell
        part = np.where(number == 0, 1.0, np.clip((into + dt - setting.dead_time) / dt, 0.0, 1.0))
        heading = setting.headings(number)
        columns = [np.ones(rows)]
        for axis in range(setting.axes):
            a = heading + axis * math.pi / 2
            axis_columns = [np.cos(a)] if setting.what == "rate" else [np.cos(a), -np.sin(a)]
            columns += [setting.projection * column for column in axis_columns]
        white, _ = Whitener.of(setting.model, dt=dt, counts=part)(np.column_stack(columns))
        white = np.nan_to_num(white)
        k = (len(columns) - 1) // setting.axes
        per_axis = [white[:, [*range(1 + i * k, 1 + (i + 1) * k), 0]] for i in range(setting.axes)]
        single = np.stack([w[:, :, None] * w[:, None, :] for w in per_axis], axis=1)
        start = np.zeros((1, *single.shape[1:]))
        return cls(
            setting=setting,
            dwell=dwell,
            blocks=blocks,
            products=np.concatenate([start, np.cumsum(single, axis=0)]),
            steady=floor * setting.unit,
            wander=setting.wander(),
        )

    @property
    def dt(self) -> float:
        """Length of a block [s]."""
        return self.dwell / self.blocks

    def information(self, time: float) -> Array:
        """After `time` [s], the levels taken out: shape (k, k); in units of (rad/s)^-2 of the Earth rate."""
        last = len(self.products) - 1
        if time <= last * self.dt:
            return self._at(time / self.dt)
        period = self.blocks * self.setting.positions
        whole = last // period * period
        back = whole // (2 * period) * period
        gain = (self._at(whole) - self._at(whole - back)) / (back * self.dt)
        return self._at(whole) + gain * (time - whole * self.dt)

    def _at(self, row: float) -> Array:
        k = self.products.shape[-1] - 1
        low = min(int(row), len(self.products) - 1)
        high = min(low + 1, len(self.products) - 1)
        p = self.products[low] + (row - low) * (self.products[high] - self.products[low])
        signal, cross, level = p[:, :k, :k], p[:, :k, k], p[:, k, k]
        safe = np.where(level > 0, level, 1.0)
        left = signal - cross[:, :, None] * cross[:, None, :] / safe[:, None, None]
        known = np.linalg.norm(left) > RANK * np.linalg.norm(signal)
        return np.asarray(left.sum(axis=0) * known)

    def sd(self, time: float) -> float:
        """Of the Earth rate [rad/s] or of the heading [rad], by noise; infinite where it cannot be told."""
        least, most = np.linalg.eigvalsh(self.information(time))[[0, -1]]
        if not least > RANK * most:
            return math.inf
        # the columns carry cos(latitude): the vector is Omega (cos psi, sin psi), so its tangential part is Omega dpsi
        return float(1 / math.sqrt(least)) / (1.0 if self.setting.what == "rate" else EARTH_RATE)

    def total(self, time: float) -> float:
        """With the stated uncertainties."""
        return math.sqrt(self.sd(time) ** 2 + self.steady**2 + self.wander / max(time / self.dwell, 1.0))

    def time_of(self, goal: float) -> float:
        """When `total` comes down to the goal [s]; infinite beyond 30 days."""
        if not self.total(LONGEST) <= goal:
            return math.inf
        low, high = 0.0, LONGEST
        while high - low > 1e-6 * high:
            middle = 0.5 * (low + high) if low == 0 else math.sqrt(low * high)
            low, high = (low, middle) if self.total(middle) <= goal else (middle, high)
        return high


def _of_family(setting: _PlanSetting, aim: float, grid: Array, spans: Array) -> Plan:
    """The plan for one noise model."""
    budget = setting.budget()
    floor = math.sqrt(sum(v**2 for v in budget.values()))
    sd, total = (np.full((len(grid), len(spans)), math.inf) for _ in range(2))
    reached, left = (np.full(len(grid), math.inf) for _ in range(2))
    for i in np.flatnonzero(grid > setting.dead_time):
        growth = _Growth.of(setting, float(grid[i]), floor)
        sd[i] = [growth.sd(float(t)) for t in spans]
        total[i] = [growth.total(float(t)) for t in spans]
        reached[i], left[i] = growth.time_of(aim * setting.unit), growth.total(LONGEST) / setting.unit
    return _plan(setting, aim, grid, spans, sd, total, reached, budget, float(left.min()))


def _cautious(plans: Sequence[Plan]) -> Plan:
    """Of the noise models that a record at rest leaves open, the plan for the one that needs longer."""
    if len(plans) == 1:
        return plans[0]
    worst = max(plans, key=lambda p: (p.duration or math.inf, float(np.min(p.total))))
    return replace(worst, undecided=True)


def _plan(
    setting: _PlanSetting,
    goal: float,
    dwells: Array,
    durations: Array,
    sd: Array,
    total: Array,
    reached: Array,
    budget: dict[str, float],
    left: float,
) -> Plan:
    budget = {name: value for name, value in budget.items() if value > 0}
    floor = math.sqrt(sum(v**2 for v in budget.values()))
    first = int(np.argmin(reached))
    known = bool(np.isfinite(reached[first]))
    best = np.where(np.isfinite(sd).any(axis=0), dwells[np.argmin(sd, axis=0)], np.nan)
    verdict = PlanVerdict.NEVER if floor >= goal else PlanVerdict.LATE
    return Plan(
        verdict=PlanVerdict.REACHED if known else verdict,
        what=setting.what,
        dwells=dwells,
        durations=durations,
        sd=sd,
        total=total,
        best=best,
        goal=goal,
        reached=reached,
        dwell=float(dwells[first]) if known else None,
        duration=float(reached[first]) if known else None,
        floor=floor,
        left=left,
        budget=budget,
        dead_time=setting.dead_time,
        latitude=setting.latitude,
        positions=setting.positions,
        axes=setting.axes,
        model=setting.model,
    )


def _time(seconds: float) -> str:
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"


# -- refusals ---------------------------------------------------------------------------------------------


def _times(name: str, given: Sequence[float]) -> Array:
    times = np.atleast_1d(np.asarray(given, dtype=np.float64))
    if times.ndim != 1 or not len(times) or not (np.isfinite(times) & (times > 0)).all():
        raise InputError(f"{name} must be positive seconds, not {given!r}")
    return np.unique(times)


def _layout(
    model: NoiseModel,
    latitude: float,
    what: str,
    goal: float | None,
    dead_time: float,
    positions: int | None,
    axes: int,
    misalignment: float,
) -> int:
    """Number of positions; refuses what makes no sense."""
    if model.kind != "rate":
        raise InputError(f"a plan needs the noise of a sensor of rates, not of {model.kind}")
    if what not in ("rate", "north"):
        raise InputError(f"what must be 'rate' or 'north', not {what!r}")
    checked_latitude(latitude)
    if goal is not None and not (math.isfinite(goal) and goal > 0):
        raise InputError(
            f"the goal must be positive, a part of the Earth rate or an angle for north, not {goal!r}"
        )
    if not (math.isfinite(dead_time) and dead_time >= 0):
        raise InputError(f"dead time must be finite and not negative [s], not {dead_time!r}")
    if not (math.isfinite(misalignment) and misalignment >= 0):
        raise InputError(f"misalignment must be finite and not negative [rad], not {misalignment!r}")
    count = (2 if what == "rate" else 4) if positions is None else positions
    if what == "rate" and (count, axes) != (2, 1):
        raise InputError("the Earth rate is planned for one axis and two positions, north and south")
    if axes not in (1, 2) or not 2 <= count <= 360:
        raise InputError(f"north needs one axis or two, and 2 to 360 positions, not {axes} and {count}")
    if what == "north" and axes == 1 and count == 2:
        raise InputError(
            "two positions of one axis lie on a line and see one component of the Earth's rotation only: two axes "
            "are required, or at least three positions around"
        )
    return count
