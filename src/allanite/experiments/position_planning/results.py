# SPDX-License-Identifier: BSD-3-Clause
"""PositionPlan: the positions, what they will tell, and how other schemes compare."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import ClassVar, Literal, TypedDict

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.position_planning import words
from allanite.experiments.position_planning.verdict import PositionPlanRemark, PositionPlanVerdict
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, White
from allanite.quantities.earlier_documents import entries, first_match, texts
from allanite.quantities.result import Result
from allanite.recording.calibration import ACCELEROMETER, GYRO

__all__ = ["Candidates", "PlannedPosition", "PositionPlan", "PositionRow", "Scheme"]

Array = NDArray[np.float64]
Candidates = Literal["faces", "edges", "all"]

#: Rests within this factor of the shortest are as short as they may be.
SHORTEST = 1.01
#: A length of record that was given, and further positions that were not, in sentences of version 1.
_GIVEN = re.compile(r"^\d+ positions? in .+: (\S+) comes to|: a heading to \S+ deg$")
_ALLOW = re.compile(r": allow (edges|corners)")


class PositionRow(TypedDict):
    """A row of the table of positions."""

    number: int
    start: float
    stop: float
    position: str
    roll: float
    pitch: float
    heading: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedPosition(Result):
    """One position.

    Attributes
    ----------
    number : int
        From 1, in order.
    words : str
        What it is called.
    up : tuple of float, shape (3,)
        What points up, in the axes of the unit.
    attitude : tuple of float, shape (3,) [rad]
        Roll, pitch, heading of the axes of the unit as forward, right, down.
    dwell : float [s]
        How long it rests.
    """

    number: int
    words: str
    up: tuple[float, float, float]
    attitude: tuple[float, float, float]
    dwell: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Scheme(Result):
    """A usual scheme beside the plan.

    Attributes
    ----------
    name : str
        What it is called.
    positions : int
        How many it has.
    total, dwell : float or None [s]
        When it reaches the goals, and with which dwell; None where it does not.
    worst : float or None
        Largest standard deviation over its goal in the time of the plan; None where that is too short for it.
    open : tuple of str
        Parameters that it does not determine.
    """

    name: str
    positions: int
    total: float | None
    dwell: float | None
    worst: float | None
    open: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class PositionPlan(Result):
    """Which positions, how long each.

    Attributes
    ----------
    remarks : tuple of PositionPlanRemark
        What a reader must know: "parameters not determined" (see `open`), "no white noise" in a model, "no latitude",
        "Earth not seen" by the gyros; of a heading "no north", "no accelerometers" among the models.
    verdict : PositionPlanVerdict
        "reached"; "not reached", for slow noise or a length of record that was given; or "not determined": no position
        that may be chosen tells what was wanted.
    what : "calibration" or "heading"
        What is planned.
    positions : tuple of PlannedPosition
        In their order.
    turn : float [s]
        From the end of one rest to the beginning of the next.
    total : float [s]
        Length of the record.
    given : bool
        That length was given.
    shortest : float [s]
        Rest that is allowed; 0 where a document of version 1 does not tell.
    candidates : "faces", "edges" or "all"
        Positions that the unit can take.
    worst : float or None
        Largest standard deviation over its goal; None where one is infinite.
    goals : mapping of str to float
        Wanted standard deviations: by parameter or kind of parameter ("gyro.scale"), or "heading" [rad].
    names : tuple of str
        Of the parameters; "heading", "roll", "pitch" of an alignment.
    sd : ndarray, shape (k,)
        Predicted; infinite where the positions do not determine it.
    covariance : ndarray, shape (k, k)
        Of the parameters of a calibration; of an alignment the diagonal.
    open : tuple of str
        Parameters that the positions do not determine.
    earth : bool
        The gyros see the Earth's rotation.
    totals : ndarray, shape (m,) [s]
        Lengths of record, all dwells stretched alike.
    groups : tuple of str
        Kinds of parameters.
    running : ndarray, shape (m, g)
        Largest standard deviation of each kind, by length of record.
    schemes : tuple of Scheme
        The usual ones.
    compared : mapping of str to ndarray, shape (m,)
        Largest standard deviation over its goal, by length of record: of the plan ("this plan") and of each scheme.
    latitude : float or None [rad]
        Where it will be recorded.
    rate : float [Hz]
        Samples per second.
    models : mapping of str to NoiseModel
        Of the gyros and the accelerometers.
    """

    FORMAT: ClassVar[str] = "allanite-position-plan"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("remarks",)

    verdict: PositionPlanVerdict
    what: Literal["calibration", "heading"]
    positions: tuple[PlannedPosition, ...]
    turn: float
    total: float
    given: bool = False
    shortest: float
    candidates: Candidates = "all"
    worst: float | None
    goals: Mapping[str, float]
    names: tuple[str, ...]
    sd: Array
    covariance: Array = field(repr=False)
    open: tuple[str, ...] = ()
    earth: bool = False
    totals: Array = field(repr=False)
    groups: tuple[str, ...] = field(repr=False)
    running: Array = field(repr=False)
    schemes: tuple[Scheme, ...] = field(repr=False)
    compared: Mapping[str, Array] = field(repr=False)
    latitude: float | None
    rate: float
    models: Mapping[str, NoiseModel] = field(repr=False)

    @property
    def reached(self) -> bool:
        """The goals are reached."""
        return self.verdict is PositionPlanVerdict.REACHED

    def goal(self, name: str) -> float | None:
        """Of a parameter: the smaller of its own and that of its kind; None where nothing is wanted of it."""
        wanted = [self.goals[key] for key in (name, name.rpartition("_")[0]) if key in self.goals]
        return min(wanted) if wanted else None

    @property
    def last(self) -> str:
        """The parameter that lies farthest from its goal."""
        ratios = self.sd / [self.goal(name) or np.inf for name in self.names]
        return self.names[int(np.argmax(ratios))]

    @property
    def says(self) -> str:
        """The plan in a sentence."""
        ratio, count = self.worst or 0.0, len(self.positions)
        if self.what == "heading":
            goal, sd = self.goals["heading"], float(self.sd[0])
            if not (self.reached or self.given):
                return words.heading_not_reached(goal, sd)
            scheme = next((s.name for s in self.schemes if s.name not in self.compared), "this plan")
            return words.heading(goal, sd, self.total, scheme, given=self.given)
        if self.given:
            return words.given_time(count, self.total, self.last, ratio)
        if self.reached:
            brief = max(p.dwell for p in self.positions) <= SHORTEST * self.shortest
            return words.reached(count, self.total, self.last, shortest=brief)
        if self.verdict is PositionPlanVerdict.NOT_DETERMINED:
            return words.not_determined(self.last)
        return words.not_reached(self.last, ratio)

    @property
    def remarks(self) -> tuple[PositionPlanRemark, ...]:
        """What a reader must know."""
        return tuple(self._remarked())

    @property
    def notes(self) -> tuple[str, ...]:
        """The same in sentences."""
        listed = words.open_parameters(self.open, self.candidates)
        return tuple(words.REMARKS.get(code, listed) for code in self.remarks)

    def _remarked(self) -> Iterator[PositionPlanRemark]:
        if self.what == "heading":
            if not self.earth:
                yield PositionPlanRemark.NO_NORTH
            if ACCELEROMETER not in self.models:
                yield PositionPlanRemark.NO_FORCE
            return
        if self.open:
            yield PositionPlanRemark.OPEN
        if any(not any(isinstance(t, White) for t in m.terms) for m in self.models.values()):
            yield PositionPlanRemark.NO_WHITE
        if GYRO in self.models and self.latitude is None:
            yield PositionPlanRemark.NO_LATITUDE
        if GYRO in self.models and not self.earth:
            yield PositionPlanRemark.EARTH_UNSEEN

    def table(self) -> list[PositionRow]:
        """One row for each position: number, start, stop [s], what points up, roll, pitch, heading [rad]."""
        rows, start = list[PositionRow](), 0.0
        for p in self.positions:
            roll, pitch, heading = p.attitude
            rows.append(
                {
                    "number": p.number,
                    "start": start,
                    "stop": start + p.dwell,
                    "position": p.words,
                    "roll": roll,
                    "pitch": pitch,
                    "heading": heading,
                }
            )
            start += p.dwell + self.turn
        return rows

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        """Version 1 held sentences for the verdict, for what was given and for remarks."""
        if data.get("version") != 1:
            return data
        says, notes = str(data.get("says")), texts(data.get("notes"))
        given = _GIVEN.search(says)
        undetermined = "that may be chosen tells" in says or "hides the Earth" in says
        undetermined |= given is not None and given[1] in texts(data.get("open"))
        verdict = PositionPlanVerdict.NOT_DETERMINED if undetermined else PositionPlanVerdict.NOT_REACHED
        allow = first_match(_ALLOW, notes)
        brief = says.endswith("with the shortest rests")
        return {
            **data,
            "version": 2,
            "verdict": PositionPlanVerdict.REACHED if data.get("reached") is True else verdict,
            "given": given is not None,
            "shortest": _longest_rest(data) if brief else 0.0,
            "candidates": "all" if allow is None else {"edges": "faces", "corners": "edges"}[allow[1]],
        }


def _longest_rest(data: Mapping[str, object]) -> float:
    """Of a document of version 1."""
    rests = [p.get("dwell") for p in entries(data.get("positions"))]
    return max((float(r) for r in rests if isinstance(r, (int, float))), default=0.0)
