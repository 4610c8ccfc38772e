# SPDX-License-Identifier: BSD-3-Clause
"""Which headings, how long each, for a wanted heading: one position, two, four, or a rotation.

From the covariance of an alignment. The heading of a unit at rest holds the bias of its gyros; half a turn about the
vertical takes it out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.alignment.prediction import AlignmentPlan, predict_alignment
from allanite.experiments.alignment.results import AlignmentPrediction
from allanite.experiments.position_planning.results import PlannedPosition, PositionPlan, Scheme
from allanite.experiments.position_planning.verdict import PositionPlanVerdict
from allanite.noise import NoiseModel

__all__ = ["heading_plan"]

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

#: Longest record [s].
LONGEST = 21600.0
#: Rate of the rotation [rad/s].
ROTATION = math.radians(6.0)
#: Lengths of record that are told, up to so many times that of the plan.
LENGTHS, STRETCHED = 8, 10.0
#: A scheme with more positions must be shorter by this part to be preferred.
WORTH = 0.05
#: Headings of the schemes, in the order in which they are preferred.
SCHEMES: dict[str, tuple[float, ...]] = {
    "1 position": (0.0,),
    "2 positions, half a turn apart": (0.0, math.pi),
    "4 positions, quarter turns": (0.0, math.pi / 2, math.pi, 3 * math.pi / 2),
    "rotation at 6 deg/s": (),
}


def heading_plan(
    models: Mapping[str, NoiseModel],
    *,
    goal: float,
    latitude: float,
    time: float | None,
    turn: float,
    shortest: float,
    rate: float,
    axes: str,
    progress: Progress,
) -> PositionPlan:
    """The scheme that reaches a standard deviation of the heading first; see `plan_positions`."""
    setting = _Setting(models=models, latitude=latitude, turn=turn, shortest=shortest, rate=rate, axes=axes)
    reached = {}
    for i, name in enumerate(SCHEMES):
        progress(0.7 * i / len(SCHEMES), "looking for headings")
        reached[name] = setting.time_of(name, goal)
    best = _best(setting, reached, time)
    total = time or (reached[best] if math.isfinite(reached[best]) else LONGEST)
    prediction = setting.predicted(best, total)
    totals = np.geomspace(
        max(setting.least(best), 0.2 * prediction.duration), STRETCHED * prediction.duration, LENGTHS
    )
    progress(0.75, "comparing the schemes")
    curves = {name: np.array([setting.heading(name, float(t)) for t in totals]) for name in SCHEMES}
    now = {name: setting.heading(name, prediction.duration) / goal for name in SCHEMES}
    compared = {"this plan": curves[best] / goal, **{n: c / goal for n, c in curves.items() if n != best}}
    angle_sds = {"heading": prediction.heading_sd}
    if "accelerometer" in models:
        angle_sds |= {"roll": prediction.roll_sd, "pitch": prediction.pitch_sd}
    sd = np.array(list(angle_sds.values()))
    return PositionPlan(
        verdict=_verdict(prediction.heading_sd, goal),
        what="heading",
        positions=setting.positions(best, total),
        turn=turn,
        total=prediction.duration,
        given=time is not None,
        shortest=shortest,
        worst=_finite(prediction.heading_sd / goal),
        goals={"heading": goal},
        names=tuple(angle_sds),
        sd=sd,
        covariance=np.diag(np.where(np.isfinite(sd), sd, 0.0) ** 2),
        open=tuple(name for name, s in angle_sds.items() if not math.isfinite(s)),
        earth=prediction.resolves,
        totals=totals,
        groups=("heading",),
        running=curves[best][:, None],
        schemes=tuple(
            Scheme(
                name=name,
                positions=max(len(headings), 1),
                total=_finite(reached[name]),
                dwell=_finite(setting.dwell(name, reached[name])),
                worst=_finite(now[name]),
            )
            for name, headings in SCHEMES.items()
        ),
        compared=compared,
        latitude=latitude,
        rate=rate,
        models=dict(models),
    )


class _Setting:
    """What does not depend on the scheme; predictions are kept."""

    def __init__(
        self,
        *,
        models: Mapping[str, NoiseModel],
        latitude: float,
        turn: float,
        shortest: float,
        rate: float,
        axes: str,
    ) -> None:
        self.models, self.latitude, self.axes = models, latitude, axes
        self.turn, self.shortest, self.rate = turn, shortest, rate
        self._kept: dict[tuple[str, float], AlignmentPrediction] = {}

    def least(self, name: str) -> float:
        """Shortest record of a scheme."""
        n = len(SCHEMES[name])
        return 2 * math.tau / ROTATION if not n else n * self.shortest + (n - 1) * self.turn

    def dwell(self, name: str, total: float) -> float:
        """Rest in each position."""
        n = max(len(SCHEMES[name]), 1)
        return (total - (n - 1) * self.turn) / n

    def predicted(self, name: str, total: float) -> AlignmentPrediction:
        """Of a record of this length."""
        key = name, total
        if key not in self._kept:
            headings = SCHEMES[name]
            plan = (
                AlignmentPlan.positions(headings, dwell=self.dwell(name, total), turn=self.turn)
                if headings
                else AlignmentPlan.rotation(ROTATION, total)
            )
            self._kept[key] = predict_alignment(
                model=self.models, plan=plan, latitude=self.latitude, rate=self.rate, axes=self.axes
            )
        return self._kept[key]

    def heading(self, name: str, total: float) -> float:
        """Standard deviation [rad]; not a number where the record is too short for the scheme."""
        return math.nan if total < self.least(name) else self.predicted(name, total).heading_sd

    def time_of(self, name: str, goal: float) -> float:
        """When the goal is reached [s]; infinite beyond six hours."""
        high = self.least(name)
        if self.heading(name, high) <= goal:
            return high
        low = high
        while not self.heading(name, high) <= goal:  # long records cost most: they are asked for last
            if high >= LONGEST or self.heading(name, high) > goal * LONGEST / high:
                return math.inf  # nothing falls faster than with the time
            low, high = high, min(2 * high, LONGEST)
        while high > 1.03 * low:
            middle = math.sqrt(low * high)
            low, high = (low, middle) if self.heading(name, middle) <= goal else (middle, high)
        return high

    def positions(self, name: str, total: float) -> tuple[PlannedPosition, ...]:
        """In words."""
        headings = SCHEMES[name] or (0.0,)
        up = (0.0, 0.0, -1.0) if self.axes.upper().endswith("D") else (0.0, 0.0, 1.0)
        words = (
            [f"level, {math.degrees(h):.0f} deg from the first" if h else "level" for h in headings]
            if SCHEMES[name]
            else ["level, turning about the vertical at 6 deg/s"]
        )
        return tuple(
            PlannedPosition(number=i, words=w, up=up, attitude=(0.0, 0.0, h), dwell=self.dwell(name, total))
            for i, (h, w) in enumerate(zip(headings, words, strict=True), 1)
        )


def _best(setting: _Setting, reached: Mapping[str, float], time: float | None) -> str:
    """The first scheme that is not much slower than the fastest; in a given time, not much worse than the best."""
    cost = (
        dict(reached)
        if time is not None or any(map(math.isfinite, reached.values()))
        else {name: setting.heading(name, LONGEST) for name in SCHEMES}
    )
    if time is not None:
        cost = {name: setting.heading(name, time) for name in SCHEMES}
    known = {name: c if math.isfinite(c) else math.inf for name, c in cost.items()}
    least = min(known.values())
    return next(name for name, c in known.items() if c <= (1 + WORTH) * least)


def _verdict(sd: float, goal: float) -> PositionPlanVerdict:
    if sd <= goal * (1 + 1e-9):
        return PositionPlanVerdict.REACHED
    return PositionPlanVerdict.NOT_REACHED if math.isfinite(sd) else PositionPlanVerdict.NOT_DETERMINED


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
