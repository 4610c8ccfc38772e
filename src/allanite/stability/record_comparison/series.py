# SPDX-License-Identifier: BSD-3-Clause
"""One channel of one record, ready to be compared: out of a study or of a curve; and which channels belong together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, FitError, FormatError, InputError
from allanite.fitting.families import Family
from allanite.fitting.misfit import LagChoice, best_explained, candidate
from allanite.fitting.moments import lags_used
from allanite.fitting.objective import CurveSolution
from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan import AllanCurve
from allanite.plain_files.counted import plural
from allanite.recording.records import Channel, Kind

__all__ = ["FittedChannel", "Record", "UnfittedChannel", "matched", "record_of", "refuse_other_kinds"]

Json = Mapping[str, Any]

#: What the curve of a channel of angles or velocities is the curve of.
_FEWEST = 3  # lags that a fit needs


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedChannel:
    """One channel of one record.

    Attributes
    ----------
    record, channel : str
    curve : AllanCurve
        Of this channel alone; oadev.
    fit : LagChoice
        The lags that are fitted, and the best fit of both families.
    mean : float or None [SI]
        Mean of the samples; None where only the curve is known.
    present : int
        Samples that are not missing.
    """

    record: str
    channel: str
    curve: AllanCurve
    fit: LagChoice
    mean: float | None
    present: int

    def best(self, symbols: tuple[str, ...]) -> CurveSolution:
        """The best fit of a family, or of some of its terms."""
        whole = self.fit.markov if "G" in symbols else self.fit.flicker
        if symbols == whole.symbols:
            return whole
        near = replace(whole, symbols=symbols, c=np.array([whole.coefficient(s) for s in symbols]))
        return Family(self.fit.data, symbols)({}, near)

    @property
    def kind(self) -> Kind:
        """Of the curve: that of a channel of angles is a curve of rates."""
        return self.curve.channels[0].kind.rate

    @property
    def unit(self) -> str:
        """The channel's own unit where it has no SI unit, else ""."""
        channel = self.curve.channels[0]
        return "" if channel.kind.has_si else channel.unit

    @property
    def sampling(self) -> str:
        """ "mean" or "point"."""
        return self.curve.channels[0].sampling

    @property
    def duration(self) -> float:
        """Length of the record [s]."""
        return self.curve.n_samples * self.curve.dt


@dataclass(frozen=True, slots=True, kw_only=True)
class UnfittedChannel:
    """One channel before it is fitted.

    Attributes
    ----------
    curve : AllanCurve
    used : ndarray of bool, shape (n_lags,), or None
        Lags that a fit takes; None: not chosen yet.
    mean : float or None [SI]
    discrepancy : float
        Relative model error at every lag, where no sum of terms explains the curve.
    """

    curve: AllanCurve
    used: NDArray[np.bool_] | None = None
    mean: float | None = None
    discrepancy: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """One record with its channels.

    Attributes
    ----------
    name : str
    channels : dict of str to UnfittedChannel
    sha256 : str or None
        Of the log behind it.
    source : str
        Its name.
    """

    name: str
    channels: Mapping[str, UnfittedChannel] = field(repr=False)
    sha256: str | None = None
    source: str = ""

    def series(self, channel: str) -> FittedChannel:
        """One channel, fitted.

        Raises
        ------
        DataQualityError, FitError
            The curve holds too few lags or nothing that noise terms describe.
        """
        part = self.channels[channel]
        curve = part.curve
        try:
            fit = _fitted(part)
        except (DataQualityError, FitError) as refusal:
            raise type(refusal)(f"{self.name}, channel {channel!r}: {refusal}") from None
        return FittedChannel(
            record=self.name,
            channel=channel,
            curve=curve,
            fit=fit,
            mean=None if curve.channels[0].kind.integrated else part.mean,
            present=curve.n_samples - int(np.diff(curve.missing[0], axis=1).sum()),
        )


def _fitted(part: UnfittedChannel) -> LagChoice:
    chosen = lags_used(part.curve) if part.used is None else part.used
    if int(chosen.sum()) < _FEWEST:
        raise DataQualityError(
            f"{plural(int(chosen.sum()), 'lag')} can be fitted, at least {_FEWEST} are needed"
        )
    if part.used is None:
        return best_explained(part.curve, chosen)
    return candidate(part.curve, chosen, part.discrepancy)


# -- out of studies and curves ------------------------------------------------------------------------------------


def record_of(source: object, name: str | None = None) -> Record:
    """A record out of a study (or its document) or a curve.

    Raises
    ------
    InputError
        Something else, or a curve that is not oadev.
    FormatError
        A document that is no study.
    """
    if isinstance(source, AllanCurve):
        return _of_curve(source, name or "curve")
    document = getattr(source, "document", source)
    if not isinstance(document, Mapping):
        raise InputError(
            f"compare takes studies and curves, not a {type(source).__name__}; make a study of a recording by "
            "al.characterize(recording)"
        )
    if document.get("format") != "allanite-study":
        raise FormatError(f"not a study: its format is {document.get('format')!r}, not 'allanite-study'")
    return _of_study(document, name)


def _of_curve(curve: AllanCurve, name: str) -> Record:
    _refuse_other(curve.statistic, name)
    return Record(
        name=name, channels={channel: UnfittedChannel(curve=curve[channel]) for channel in curve.names}
    )


def _of_study(document: Json, name: str | None) -> Record:
    origin = document["provenance"]
    label = name or origin["source"] or "study"
    known = {c["name"]: c for c in document["recording"]["channels"]}
    parts = {}
    for entry in document["channels"]:
        _refuse_other(entry["curve"]["statistic"], f"{label}, channel {entry['name']!r}")
        curve = _curve_of(entry["curve"], Channel.from_json(known[entry["name"]]))
        discrepancy = max((m["goodness"].get("discrepancy", 0.0) for m in entry["models"]), default=0.0)
        used = np.array(entry["curve"]["used"], dtype=bool) if entry["models"] else None
        parts[entry["name"]] = UnfittedChannel(
            curve=curve, used=used, mean=entry["mean"], discrepancy=float(discrepancy)
        )
    return Record(name=label, channels=parts, sha256=origin.get("sha256"), source=origin["source"])


def _refuse_other(statistic: str, where: str) -> None:
    if statistic != "oadev":
        raise InputError(
            f"{where}: its curve is {statistic}; records are compared by oadev: characterize it with that"
        )


def _curve_of(part: Json, channel: Channel) -> AllanCurve:
    def column(key: str) -> NDArray[np.float64]:
        return np.array(part[key], dtype=np.float64)[:, None]

    count = np.nan_to_num(column("count")).astype(np.int64)
    return AllanCurve(
        statistic=part["statistic"],
        lags=np.array(part["lags"], dtype=np.int64),
        tau=np.array(part["tau"], dtype=np.float64),
        count=count,
        confidence=part["confidence"],
        channels=(channel,),
        dt=part["dt"],
        n_samples=part["n_samples"],
        missing=(np.array(part.get("missing") or [], dtype=np.int64).reshape(-1, 2),),
        engine=part["engine"],
        interval_basis=part["interval_basis"],
        deviation=column("deviation"),
        lower=column("lower"),
        upper=column("upper"),
        edf=column("edf"),
    )


# -- which channels belong together -------------------------------------------------------------------------------


def matched(
    records: Sequence[Record], channels: Sequence[str | Sequence[str]] | None = None
) -> list[tuple[str, tuple[str, ...]]]:
    """The channels to compare: the name of the comparison, and the channel's name in each record.

    By name; records of one channel each belong together whatever their channels are called.

    Parameters
    ----------
    channels : sequence, optional
        Names wanted; or for each comparison one name for each record.

    Raises
    ------
    InputError
        No common name, a name that is not there, or channels of different kinds or units.
    """
    if channels is not None:
        return [_given(records, wanted) for wanted in channels]
    if all(len(r.channels) == 1 for r in records):
        names = tuple(next(iter(r.channels)) for r in records)
        return [(names[0] if len(set(names)) == 1 else "signal", names)]
    common = [c for c in records[0].channels if all(c in r.channels for r in records)]
    if not common:
        held = "; ".join(f"{r.name}: {', '.join(r.channels)}" for r in records)
        raise InputError(
            f"the records have no common channel name ({held}); state the matching channels, one name for each record"
        )
    return [(name, (name,) * len(records)) for name in common]


def _given(records: Sequence[Record], wanted: str | Sequence[str]) -> tuple[str, tuple[str, ...]]:
    names = (wanted,) * len(records) if isinstance(wanted, str) else tuple(wanted)
    if len(names) != len(records):
        raise InputError(
            f"{len(names)} channels ({', '.join(names)}) for {len(records)} records; give one name, or one for each"
        )
    for record, name in zip(records, names, strict=True):
        if name not in record.channels:
            raise InputError(f"no channel {name!r} in {record.name}; there are: {', '.join(record.channels)}")
    return names[0] if len(set(names)) == 1 else " / ".join(dict.fromkeys(names)), names


def refuse_other_kinds(series: Sequence[FittedChannel]) -> None:
    """Rates are compared with rates; counts only with counts of the same name.

    Raises
    ------
    InputError
    """
    first = series[0]
    for other in series[1:]:
        if (other.kind, other.unit) != (first.kind, first.unit):
            raise InputError(
                f"{other.record} ({other.channel!r}: {_measured(other)}) and {first.record} ({first.channel!r}: "
                f"{_measured(first)}) measure different quantities; state both units (--unit)"
            )


def _measured(series: FittedChannel) -> str:
    return f"{series.kind.value} in {series.unit}" if series.unit else series.kind.value
