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
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.noise import FLICKER_FLOOR, NoiseModel
from allanite.noise.allan.channel_curve import ChannelCurve
from allanite.noise.datasheet import SheetEntry
from allanite.noise.given_models import models_of
from allanite.noise.quick_terms import with_quick_terms_white
from allanite.plain_files.json_values import plain
from allanite.recording.channel_names import ways_to_units
from allanite.recording.records import Kind
from allanite.study.datasheet.sheet import Datasheet
from allanite.study.study import Study

__all__ = ["ChannelVerdict", "DatasheetVerdict", "StatementVerdict", "hold_against"]

Json = Mapping[str, Any]
Array = NDArray[np.float64]

FORMAT = "allanite-datasheet"
VERSION = 1

MEETS, FAILS, OPEN = "meets", "does not meet", "not resolved"
WHOLE = {
    MEETS: "meets the data sheet",
    FAILS: "does not meet the data sheet",
    OPEN: "not resolved",
}
#: Kinds whose noise is that of the rate behind them.
_RATES = {Kind.ANGLE: Kind.RATE, Kind.VELOCITY: Kind.ACCELERATION}


@dataclass(frozen=True, slots=True, kw_only=True)
class StatementVerdict:
    """One statement of the sheet and what was measured.

    Attributes
    ----------
    entry : SheetEntry
    measured : float or None
        Estimate in SI; None where the record gives a limit only, or nothing.
    lower, upper : float
        Interval of it; infinite `upper` where nothing is known.
    verdict : "meets", "does not meet", "not resolved" or "" (a correlation time is no promise)
    note : str
    """

    entry: SheetEntry
    measured: float | None
    lower: float
    upper: float
    verdict: str
    note: str = ""

    @property
    def ratio(self) -> tuple[float | None, float, float]:
        """Measured over stated, with its interval."""
        stated = self.entry.value
        return (
            None if self.measured is None else self.measured / stated,
            self.lower / stated,
            self.upper / stated,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelVerdict:
    """A channel beside its section of the sheet.

    Attributes
    ----------
    name, kind, unit, section : str
    statements : tuple of StatementVerdict
    sheet : NoiseModel
    curve : ChannelCurve
        The study's curve of the channel.
    stated : ndarray, shape (n_lags,) [SI]
        Allan deviation of the sheet at the lags, as these samples would show it.
    """

    name: str
    kind: str
    unit: str
    section: str
    statements: tuple[StatementVerdict, ...]
    sheet: NoiseModel
    curve: ChannelCurve
    stated: Array

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        ratios = {
            f"ratio_{key}": plain(getattr(self.curve, key) / self.stated)
            for key in ("deviation", "lower", "upper")
        }
        return {
            "name": self.name,
            "kind": self.kind,
            "unit": self.unit,
            "section": self.section,
            "statements": [
                {
                    **plain(s.entry),
                    **{k: v for k, v in plain(s).items() if k != "entry"},
                    "ratio": plain(s.ratio),
                }
                for s in self.statements
            ],
            "model": self.sheet.to_json(),
            "curve": self.curve.to_json(),
            "stated": self.stated.tolist(),
            **ratios,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasheetVerdict:
    """A data sheet, and how a study stands to it.

    Attributes
    ----------
    datasheet : Datasheet
    channels : tuple of ChannelVerdict
        Empty where nothing was measured.
    verdict, reason : str
    """

    datasheet: Datasheet
    channels: tuple[ChannelVerdict, ...]
    verdict: str
    reason: str

    def __repr__(self) -> str:
        return f"<DatasheetVerdict: {self.verdict}: {self.reason}>"

    def to_json(self) -> dict[str, Any]:
        """Plain data, from which figures and reports are made."""
        return {
            "format": FORMAT,
            "version": VERSION,
            **self.datasheet.to_json(),
            "verdict": self.verdict,
            "reason": self.reason,
            "channels": [c.to_json() for c in self.channels],
        }


def hold_against(study: Study | None, datasheet: Datasheet) -> DatasheetVerdict:
    """Hold a study against a data sheet.

    Parameters
    ----------
    study : Study, optional
        None: the sheet alone, to be drawn.
    datasheet : Datasheet
        Channels go with the section of their name, or that of their kind.

    Returns
    -------
    DatasheetVerdict

    Raises
    ------
    InputError
        No section for any channel, one for a channel that is of another kind, or a curve that is not oadev.
    """
    if study is None:
        return DatasheetVerdict(
            datasheet=datasheet, channels=(), verdict="nothing measured", reason="the data sheet alone"
        )
    kinds = {c.name: _RATES.get(Kind(c.kind), Kind(c.kind)) for c in study.channels}
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
    return DatasheetVerdict(datasheet=datasheet, channels=channels, **_together(channels))


def _channel(study: Study, name: str, sheet: NoiseModel, datasheet: Datasheet) -> ChannelVerdict:
    channel = study[name]
    curve = channel.curve
    if curve.statistic != "oadev":
        raise InputError(
            f"the study shows {curve.statistic}: a data sheet is held against the Allan deviation (oadev)"
        )
    section = next(name for name, model in datasheet.models.items() if model is sheet)
    fitted = study.models[name].families if name in study.models else ()
    models = [with_quick_terms_white(m, curve.dt) for m in fitted]
    return ChannelVerdict(
        name=name,
        kind=channel.kind,
        unit=channel.unit,
        section=section,
        statements=tuple(_statement(e, models, curve) for e in datasheet.sections[section].entries),
        sheet=sheet,
        curve=curve,
        stated=np.sqrt(sheet.avar_sampled(curve.lags.astype(np.float64), curve.dt, curve.sampling)),
    )


# -- one statement ----------------------------------------------------------------------------------------------


def _statement(entry: SheetEntry, models: Sequence[NoiseModel], curve: ChannelCurve) -> StatementVerdict:
    if not models:
        return _open(entry, "the study holds no noise model of this channel")
    if entry.symbol == "minimum":
        value, lower, upper, note = _minimum(models, curve)
    else:
        value, lower, upper, note = _estimate(entry.symbol, models)
    verdict = _judged(entry.value, lower, upper)
    if entry.symbol == "T":
        verdict = ""
    return StatementVerdict(entry=entry, measured=value, lower=lower, upper=upper, verdict=verdict, note=note)


def _judged(stated: float, lower: float, upper: float) -> str:
    if upper <= stated:
        return MEETS
    return FAILS if lower > stated else OPEN


def _open(entry: SheetEntry, note: str) -> StatementVerdict:
    return StatementVerdict(
        entry=entry,
        measured=None,
        lower=0.0,
        upper=math.inf,
        verdict="" if entry.symbol == "T" else OPEN,
        note=note,
    )


def _estimate(symbol: str, models: Sequence[NoiseModel]) -> tuple[float | None, float, float, str]:
    """A coefficient over all families that the record cannot tell apart: the first one's value, all their intervals."""
    names = ("B", "B_equiv") if symbol == "B" else (symbol,)
    estimates = [e for m in models for e in m.estimates if e.symbol in names]
    if not estimates:
        words = "no Gauss-Markov term" if symbol in ("sigma", "T") else "no such term"
        return None, 0.0, math.inf, f"the fitted model holds {words}"
    first = estimates[0]
    lower, upper = min(e.lower for e in estimates), max(e.upper for e in estimates)
    value = first.value if all(e.supported for e in estimates) else None
    note = "" if value is not None else "upper limit: the record does not show it"
    if symbol == "B" and first.symbol == "B_equiv":
        note = "of the Gauss-Markov term: the B with the same peak"
    return value, lower, upper, note


def _minimum(models: Sequence[NoiseModel], curve: ChannelCurve) -> tuple[float | None, float, float, str]:
    """The Allan deviation where the fitted model has its minimum, over all families.

    No minimum lies above the deviation at any lag: the upper end is taken where the model says that it will be lowest.
    """
    places = np.flatnonzero(curve.used)
    known = [m for m in models if m.terms]
    if not len(places) or not known:
        return None, 0.0, math.inf, "no lag of the curve was fitted"
    low, deviation, high = (column[places] for column in (curve.lower, curve.deviation, curve.upper))
    m, tau = curve.lags[places].astype(np.float64), curve.tau[places]
    expected = [np.sqrt(model.avar_sampled(m, curve.dt, curve.sampling)) for model in known]
    lowest = [int(np.argmin(e)) for e in expected]
    upper = max(high[int(np.argmin(e * high / deviation))] for e in expected)
    if max(lowest) == len(m) - 1:
        lower = min(_floor(model) for model in known)
        return None, lower, float(upper), f"the curve still falls at {tau[-1]:.4g} s"
    lower = min(float(low[i]) for i in lowest)
    return float(deviation[lowest[0]]), lower, float(upper), f"at {tau[lowest[0]]:.4g} s"


def _floor(model: NoiseModel) -> float:
    """What the deviation of a model cannot fall below at any time: the floor of flicker that the record shows."""
    flicker = model.estimate("B")
    return FLICKER_FLOOR * flicker.lower if flicker is not None and flicker.supported else 0.0


# -- all statements ---------------------------------------------------------------------------------------------


def _together(channels: Sequence[ChannelVerdict]) -> dict[str, str]:
    """One failure is one too many; one that is open leaves the whole open."""
    named = [
        (f"{c.name}: {s.entry.name.replace('_', ' ')}", s.verdict)
        for c in channels
        for s in c.statements
        if s.verdict
    ]
    worst = next((v for v in (FAILS, OPEN) if any(v == verdict for _, verdict in named)), MEETS)
    if worst == MEETS:
        return {"verdict": WHOLE[MEETS], "reason": f"all {len(named)} statements are met"}
    there = [name for name, verdict in named if verdict == worst]
    more = f" and {len(there) - 6} more" if len(there) > 6 else ""
    counts = {v: sum(v == verdict for _, verdict in named) for v in (MEETS, FAILS, OPEN)}
    others = ", ".join(f"{n} {v}" for v, n in counts.items() if n and v != worst)
    return {
        "verdict": WHOLE[worst],
        "reason": f"{', '.join(there[:6])}{more}" + (f" ({others})" if others else ""),
    }
