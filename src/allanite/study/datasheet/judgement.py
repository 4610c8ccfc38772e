# SPDX-License-Identifier: BSD-3-Clause
"""Does a sensor keep what its data sheet promises?

Each statement is held against the interval of the same quantity in the study: "meets" where the whole interval lies at
or below the stated value, "does not meet" where it lies above, "not resolved" where the stated value is inside, or the
record only bounds the quantity from above and not low enough. Both ends are those of a 95 % interval, so each verdict
is wrong in at most 2.5 % of records.

A minimum of the Allan deviation is measured at the lag where the fitted model has its own: the lowest of the measured
values would be lower than the truth, because it is picked. Where the model still falls at the longest lag, the
minimum is bounded: from above by the deviations, from below by the floor of the flicker that the record shows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from enum import StrEnum
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise import FLICKER_FLOOR, NoiseModel
from allanite.noise.allan.channel_curve import ChannelCurve
from allanite.noise.datasheet import SheetEntry
from allanite.noise.given_models import models_of
from allanite.noise.quick_terms import with_quick_terms_white
from allanite.quantities.display_units import si_unit
from allanite.quantities.quantity import Quantity, QuantityStatus
from allanite.quantities.result import Result
from allanite.quantities.verdict import Tone, Verdict, WordedCode
from allanite.recording.channel_names import ways_to_units
from allanite.recording.records import Kind
from allanite.study.datasheet.sheet import Datasheet
from allanite.study.datasheet.version_1 import upgraded
from allanite.study.study import Study

__all__ = [
    "ChannelJudgement",
    "DatasheetJudgement",
    "DatasheetVerdict",
    "StatementJudgement",
    "StatementNote",
    "StatementVerdict",
    "hold_against",
]

Array = NDArray[np.float64]

#: Symbols of statements whose unit is that of another.
_SYMBOLS = {"minimum": "B"}
#: Statements that a reason names.
_NAMED = 6


class DatasheetVerdict(Verdict):
    """Does the sensor keep what the sheet promises?"""

    FAILS = "does not meet the data sheet", "does not meet the data sheet", Tone.FATAL
    OPEN = "not resolved", "not resolved", Tone.WARNING
    NOTHING = "nothing measured", "nothing measured", Tone.WARNING
    MEETS = "meets the data sheet", "meets the data sheet", Tone.GOOD


class StatementVerdict(StrEnum):
    """Is one statement met?"""

    MEETS = "meets"
    FAILS = "does not meet"
    OPEN = "not resolved"


#: What one statement makes of the whole, the worst first.
_WHOLE = {
    StatementVerdict.FAILS: DatasheetVerdict.FAILS,
    StatementVerdict.OPEN: DatasheetVerdict.OPEN,
    StatementVerdict.MEETS: DatasheetVerdict.MEETS,
}


class StatementNote(WordedCode):
    """What is to be known of a measured value."""

    NO_MODEL = "no model", "the study holds no noise model of this channel"
    NO_MARKOV = "no Gauss-Markov term", "the fitted model holds no Gauss-Markov term"
    NO_TERM = "no such term", "the fitted model holds no such term"
    LIMIT = "upper limit", "upper limit: the record does not show it"
    SAME_PEAK = "B with the same peak", "of the Gauss-Markov term: the B with the same peak"
    NO_LAG = "no lag was fitted", "no lag of the curve was fitted"
    STILL_FALLS = "still falls", "the curve still falls at"
    MINIMUM = "minimum", "at"


@dataclass(frozen=True, slots=True, kw_only=True)
class StatementJudgement(Result):
    """One statement of the sheet and what was measured.

    Attributes
    ----------
    verdict : StatementVerdict or None
        "meets", "does not meet" or "not resolved"; None of a correlation time, which is no promise.
    entry : SheetEntry
        What is stated.
    measured : Quantity
        An upper limit has a lower end above zero where the record shows that much.
    remark : StatementNote or None
        What is to be known of it.
    tau : float or None [s]
        Averaging time of the minimum, or at which the curve still falls.
    """

    STATED: ClassVar[tuple[str, ...]] = ("verdict",)

    entry: SheetEntry
    measured: Quantity
    remark: StatementNote | None = None
    tau: float | None = None

    @property
    def verdict(self) -> StatementVerdict | None:
        """Where the interval lies; a limit that nobody knows leaves the statement open."""
        if self.entry.symbol == "T":
            return None
        if self.measured.upper <= self.entry.value:
            return StatementVerdict.MEETS
        return StatementVerdict.FAILS if self.measured.lower > self.entry.value else StatementVerdict.OPEN

    @property
    def note(self) -> str:
        """The remark in words; "" for none."""
        place = "" if self.tau is None else f" {self.tau:.4g} s"
        return "" if self.remark is None else f"{self.remark.words}{place}"

    @property
    def ratio(self) -> Quantity:
        """Measured over stated."""
        m, stated = self.measured, self.entry.value
        return replace(m, value=m.value / stated, lower=m.lower / stated, upper=m.upper / stated, unit="1")


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelJudgement(Result):
    """A channel beside its section of the sheet.

    Attributes
    ----------
    name, kind, unit : str
        Of the channel.
    section : str
        Of the sheet.
    statements : tuple of StatementJudgement
        All of the section.
    sheet : NoiseModel
        What the section states, as a model.
    curve : ChannelCurve
        The study's curve of the channel.
    stated : ndarray, shape (n_lags,) [SI]
        Allan deviation of the sheet at the lags, as these samples would show it.
    """

    name: str
    kind: str
    unit: str
    section: str
    statements: tuple[StatementJudgement, ...]
    sheet: NoiseModel
    curve: ChannelCurve = field(repr=False)
    stated: Array = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasheetJudgement(Result):
    """A data sheet, and how a study stands to it.

    Attributes
    ----------
    verdict : DatasheetVerdict
        "meets the data sheet", "does not meet the data sheet", "not resolved", or "nothing measured": one failure is
        one too many, one statement that is open leaves the whole open.
    datasheet : Datasheet
        What is stated.
    channels : tuple of ChannelJudgement
        Empty where nothing was measured.
    """

    FORMAT: ClassVar[str] = "allanite-datasheet"
    VERSION: ClassVar[int] = 2
    STATED: ClassVar[tuple[str, ...]] = ("verdict",)

    datasheet: Datasheet
    channels: tuple[ChannelJudgement, ...]

    def __repr__(self) -> str:
        return f"<DatasheetJudgement: {self.verdict}: {self.reason}>"

    @property
    def verdict(self) -> DatasheetVerdict:
        """One failure is one too many; one that is open leaves the whole open."""
        verdicts = [verdict for _, verdict in self._promises()]
        if not self.channels:
            return DatasheetVerdict.NOTHING
        return next((whole for one, whole in _WHOLE.items() if one in verdicts), DatasheetVerdict.MEETS)

    @property
    def reason(self) -> str:
        """Which statements decide it, and how many others there are."""
        if not self.channels:
            return "the data sheet alone"
        promises = [*self._promises()]
        if self.verdict is DatasheetVerdict.MEETS:
            return f"all {len(promises)} statements are met"
        names = [name for name, verdict in promises if _WHOLE[verdict] is self.verdict]
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        counts = {v: sum(v is verdict for _, verdict in promises) for v in StatementVerdict}
        others = ", ".join(f"{n} {v}" for v, n in counts.items() if n and _WHOLE[v] is not self.verdict)
        return f"{', '.join(names[:_NAMED])}{more}" + (f" ({others})" if others else "")

    def _promises(self) -> list[tuple[str, StatementVerdict]]:
        """What is promised of each channel, and whether it is met."""
        return [
            (f"{c.name}: {s.entry.name.replace('_', ' ')}", s.verdict)
            for c in self.channels
            for s in c.statements
            if s.verdict is not None
        ]

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        return upgraded(data) if data.get("version") == 1 else data


def hold_against(study: Study | None, datasheet: Datasheet) -> DatasheetJudgement:
    """Hold a study against a data sheet.

    Parameters
    ----------
    study : Study, optional
        Study to compare with; None: the sheet alone, to be drawn.
    datasheet : Datasheet
        Channels go with the section of their name, or that of their kind.

    Returns
    -------
    DatasheetJudgement

    Raises
    ------
    InputError
        No section for any channel, one for a channel that is of another kind, or a curve that is not oadev.
    """
    if study is None:
        return DatasheetJudgement(datasheet=datasheet, channels=())
    kinds = {c.name: Kind(c.kind).rate for c in study.channels}
    known = [name for name in datasheet.sections if name not in ("gyro", "accelerometer", *kinds)]
    if known:
        raise InputError(
            f"the data sheet has a section {known[0]!r}, and the study no such channel; there are: {', '.join(kinds)}"
        )
    models = models_of(datasheet.models, kinds, needed=False)
    if not models:
        there = ", ".join(f"{name} ({kind.value})" for name, kind in kinds.items())
        way = ways_to_units([(name, kind.value) for name, kind in kinds.items()])
        raise InputError(
            f"the data sheet has sections {', '.join(datasheet.sections)}, none of which is for a channel of the "
            f"study: {there}{f'. Characterize again: {way}' if way else ''}"
        )
    channels = tuple(_channel(study, name, model, datasheet) for name, model in models.items())
    return DatasheetJudgement(datasheet=datasheet, channels=channels)


def _channel(study: Study, name: str, sheet: NoiseModel, datasheet: Datasheet) -> ChannelJudgement:
    channel = study[name]
    curve = channel.curve
    if curve.statistic != "oadev":
        raise InputError(
            f"the study shows {curve.statistic}: a data sheet is held against the Allan deviation (oadev)"
        )
    section = next(name for name, model in datasheet.models.items() if model is sheet)
    fitted = study.models[name].families if name in study.models else ()
    models = [with_quick_terms_white(m, curve.dt) for m in fitted]
    return ChannelJudgement(
        name=name,
        kind=channel.kind,
        unit=channel.unit,
        section=section,
        statements=tuple(
            _statement(
                e, models, curve, si_unit(channel.kind, _SYMBOLS.get(e.symbol, e.symbol), channel.unit)
            )
            for e in datasheet.sections[section].entries
        ),
        sheet=sheet,
        curve=curve,
        stated=np.sqrt(sheet.avar_sampled(curve.lags.astype(np.float64), curve.dt, curve.sampling)),
    )


# -- one statement ----------------------------------------------------------------------------------------------


def _statement(
    entry: SheetEntry, models: Sequence[NoiseModel], curve: ChannelCurve, unit: str
) -> StatementJudgement:
    def of(
        value: float = math.nan,
        ends: tuple[float, float] = (math.nan, math.nan),
        remark: StatementNote | None = None,
        tau: float | None = None,
    ) -> StatementJudgement:
        known = QuantityStatus.UPPER_LIMIT if math.isfinite(ends[1]) else QuantityStatus.NOT_RESOLVED
        status = known if math.isnan(value) else QuantityStatus.RESOLVED
        measured = Quantity(value=value, lower=ends[0], upper=ends[1], unit=unit, status=status)
        return StatementJudgement(entry=entry, measured=measured, remark=remark, tau=tau)

    if not models:
        return of(remark=StatementNote.NO_MODEL)
    return of(*(_minimum(models, curve) if entry.symbol == "minimum" else _estimate(entry.symbol, models)))


_Measured = tuple[float, tuple[float, float], StatementNote | None, float | None]
_UNKNOWN = (math.nan, math.nan)


def _estimate(symbol: str, models: Sequence[NoiseModel]) -> _Measured:
    """A coefficient over all families that the record cannot tell apart: the first one's value, all their intervals."""
    names = ("B", "B_equiv") if symbol == "B" else (symbol,)
    estimates = [e for m in models for e in m.estimates if e.symbol in names]
    if not estimates:
        missing = StatementNote.NO_MARKOV if symbol in ("sigma", "T") else StatementNote.NO_TERM
        return math.nan, _UNKNOWN, missing, None
    first = estimates[0]
    ends = min(e.lower for e in estimates), max(e.upper for e in estimates)
    value = first.value if all(e.supported for e in estimates) else None
    remark = StatementNote.LIMIT if value is None else None
    if symbol == "B" and first.symbol == "B_equiv":
        remark = StatementNote.SAME_PEAK
    return math.nan if value is None else value, ends, remark, None


def _minimum(models: Sequence[NoiseModel], curve: ChannelCurve) -> _Measured:
    """The Allan deviation where the fitted model has its minimum, over all families.

    No minimum lies above the deviation at any lag: the upper end is taken where the model says that it will be lowest.
    """
    places = np.flatnonzero(curve.used)
    known = [m for m in models if m.terms]
    if not len(places) or not known:
        return math.nan, _UNKNOWN, StatementNote.NO_LAG, None
    low, deviation, high = (column[places] for column in (curve.lower, curve.deviation, curve.upper))
    m, tau = curve.lags[places].astype(np.float64), curve.tau[places]
    expected = [np.sqrt(model.avar_sampled(m, curve.dt, curve.sampling)) for model in known]
    lowest = [int(np.argmin(e)) for e in expected]
    upper = max(high[int(np.argmin(e * high / deviation))] for e in expected)
    if max(lowest) == len(m) - 1:
        lower = min(_floor(model) for model in known)
        return math.nan, (lower, float(upper)), StatementNote.STILL_FALLS, float(tau[-1])
    lower = min(float(low[i]) for i in lowest)
    return float(deviation[lowest[0]]), (lower, float(upper)), StatementNote.MINIMUM, float(tau[lowest[0]])


def _floor(model: NoiseModel) -> float:
    """What the deviation of a model cannot fall below at any time: the floor of flicker that the record shows."""
    flicker = model.estimate("B")
    return FLICKER_FLOOR * flicker.lower if flicker is not None and flicker.supported else 0.0
