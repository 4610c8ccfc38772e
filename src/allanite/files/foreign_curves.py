# SPDX-License-Identifier: BSD-3-Clause
"""Allan curves that other programs wrote: any table of averaging times and deviations or variances.

A curve alone does not say how certain it is. Its intervals need the number of samples N behind it, the sample interval
and the estimator. A column of counts gives all three: the overlapping Allan deviation [1] has N - 2m + 1 terms at lag
m, the non-overlapping one about N/m - 1. Without counts the caller states N and the rate.

References
----------
.. [1] W. Riley, NIST SP 1065 (2008), sections 5.2.2 and 5.2.4.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from itertools import permutations
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, InputError
from allanite.files.readers import read_table
from allanite.files.readers.headings import Heading, canonical_group, read_heading
from allanite.files.readers.table import Table
from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan.curve import AllanCurve, curve_of_sums
from allanite.noise.allan.statistics import STATISTICS, longest_lag
from allanite.plain_files.counted import plural
from allanite.plain_files.limits import refuse_more
from allanite.quantities.units import QuantityKind, parse_unit
from allanite.recording.channel_names import for_shell
from allanite.recording.checked_samples import checked_rate
from allanite.recording.records import Channel, Sampling

__all__ = ["STATED", "ForeignCurve", "read_curve"]

Array = NDArray[np.float64]

_NO_LENGTH = "the length of the record is unknown: pass --samples (samples=), its duration times its rate"
_NAMES: Final = ("oadev", "adev", "mdev", "tdev", "hdev", "ohdev", "totdev")
#: What the values of a column may be said to be: a deviation, or its square.
STATED: Final = (*_NAMES, *(name.replace("dev", "var") for name in _NAMES))
_MOST_ROWS: Final = 100_000
#: A printed averaging time is a whole number of samples to this: part of a sample, and relative.
_WHOLE: Final = (0.02, 2e-3)
#: Counts that imply lengths of the record within so many samples agree (programs differ in where they begin).
_SAME_LENGTH: Final = 2.5
#: Least part of the windows that the counts must hold: a record with more gaps is a case for its samples.
_COMPLETE: Final = 0.9

# What a heading says, first match wins; names are lower case, every run of other signs is one underscore.
_ROLES: Final = tuple(
    (role, re.compile(rf"(^|_)({pattern})(_|$)"))
    for role, pattern in (
        ("bound", r"err\w*|lo|low|lower|hi|high|upper|min|max|ci\w*|conf\w*|bounds?|edf|alpha|slope|unc\w*|sem|u"),
        ("tau", r"taus?|τ|averaging_?times?|cluster_?times?|integration_?times?|correlation_?times?|gate_?time"),
        ("lag", r"m|af|lags?|averaging_?factor|cluster_?size|samples_per_cluster|window"),
        ("count", r"n|ns|num\w*|counts?|terms|pairs|n_?terms|n_?pairs|windows|clusters|points|samples"),
        ("value", r"\w*dev|\w*var|\w*deviations?|\w*variances?|sigma\w*|σ\w*|std|allan|hadamard"),
        ("tau", r"t|time|times|dt|period"),
    )
)  # fmt: skip
_TIME_SUFFIX: Final = re.compile(r"_(s|ms|us|µs|ns|min|h|d)$")
_VARIANCE: Final = re.compile(r"var|σ_?2|sigma_?2|²")
_KIND_OF_VALUE: Final = tuple(
    (name, re.compile(pattern))
    for name, pattern in (
        ("totdev", r"tot(al|dev|var)"),
        ("ohdev", r"oh(dev|var)|overl\w*_?hadamard"),
        ("hdev", r"h(dev|var)|hadamard"),
        ("tdev", r"(^|_)t(dev|var)|(^|_)time_(dev|var)"),
        ("mdev", r"(^|_)m(dev|var)|(^|_)mod"),
        ("oadev", r"oa(dev|var)|overl"),
        ("allan", r"a(dev|var)|allan"),
    )
)
_NO_NAME: Final = re.compile(
    r"(^|_)(o?a|m|t|o?h|tot)?(dev|var)(?=_|$)|(^|_)(overlapping|modified|allan|hadamard|total|time|root|square|"
    r"deviations?|variances?|sigma2?|σ2?|std)(?=_|$)"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ForeignCurve:
    """A curve of another program.

    Attributes
    ----------
    curve : AllanCurve
    remarks : tuple of str
        What was concluded or left out, in words.
    """

    curve: AllanCurve
    remarks: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Column:
    """A column of the file: its heading as it stands there, what the heading says, and the numbers."""

    number: int
    text: str
    heading: Heading
    values: Array

    @property
    def plain(self) -> str:
        return _plain(self.heading.name)

    @property
    def shown(self) -> str:
        return self.text.strip() or f"column {self.number}"

    @property
    def role(self) -> str:
        if self.text.strip() in ("#", "# "):
            return "count"
        return next((role for role, pattern in _ROLES if pattern.search(self.plain)), "")


@dataclass(frozen=True, slots=True)
class _Shape:
    """How long the record behind the curve was, and what the counts say of the estimator ("" without counts)."""

    n_samples: int
    dt: float
    statistic: str


def read_curve(
    path: str | os.PathLike[str],
    *,
    samples: int | None = None,
    rate: float | None = None,
    unit: str | Mapping[str, str] | None = None,
    statistic: str | None = None,
    channels: Sequence[str] | None = None,
    sampling: Sampling = "mean",
    confidence: float = 0.95,
    **options: Any,
) -> ForeignCurve:
    """Read an Allan curve that another program computed.

    Parameters
    ----------
    path : path
        A table in any format of `allanite.files.readers.read`: averaging times (or lags in samples) and one or several
        columns of deviations or variances, in any order, with or without headings.
    samples : int, optional
        Length of the record behind the curve; follows from a column of counts where there is one.
    rate : float, optional [Hz]
        Sample rate of that record; follows from counts, or from lags together with averaging times.
    unit : str or mapping, optional
        Unit of the deviation (that of the rate or acceleration) where no heading gives it; also for variances.
    statistic : str, optional
        Statistic of the values if no heading states it: "oadev" or its square "oavar", "adev", "avar", "mdev", ...
    channels : sequence of str, optional
        Columns to take.
    sampling : "mean" or "point"
        Whether a sample is the mean over its interval or a point value.
    confidence : float
        Confidence level of the intervals.
    **options
        `delimiter`, `decimal` and `variable` of `allanite.files.readers.read`.

    Raises
    ------
    InputError
        Something that the intervals need is not known (the message says what to give), or two statements disagree.
    FormatError
        The file is no table.
    DataQualityError
        No averaging times, or values that are no deviations.
    """
    name, table = Path(path).name, read_table(path, **options)
    columns = _columns(table, name)
    roles, remarks = _roles(columns, channels, name), []
    tau = roles.get("tau")
    quantity, squared, chosen, notes = _quantity(roles["value"], statistic, name, channels)
    remarks += notes
    grid = _grid(tau, roles.get("lag"), name)
    shape, notes = _shape(
        grid, roles.get("count"), quantity, samples, rate or (table.rate if tau is not None else rate), name
    )
    remarks += notes
    if quantity == "allan":
        quantity = shape.statistic or "oadev"
        remarks.append(
            f"taken as the {'overlapping' if quantity == 'oadev' else 'non-overlapping'} Allan "
            + (
                "deviation, from its counts"
                if shape.statistic
                else "deviation, without counts to confirm it. If its windows do not overlap, use --statistic adev"
            )
        )
    lags, first, notes = _lags(grid, shape, name)
    remarks += notes
    known = _channels(chosen, unit, squared, sampling, remarks)
    counted = _terms(quantity, lags, shape.n_samples, name)
    variances = [c.values[first] ** (1.0 if squared else 2.0) for c in chosen]
    if quantity == "tdev":  # TVAR = tau² MVAR/3
        variances = [3.0 * v / (lags * shape.dt) ** 2 for v in variances]
    curve = curve_of_sums(
        STATISTICS[quantity],
        lags,
        [(v, np.where(np.isfinite(v), counted, 0)) for v in variances],
        [np.zeros((0, 2), dtype=np.int64)] * len(chosen),
        channels=known,
        dt=shape.dt,
        n_samples=shape.n_samples,
        confidence=confidence,
        engine="elsewhere",
    )
    return ForeignCurve(curve=curve, remarks=tuple(remarks))


def _plain(text: str) -> str:
    text = re.sub(r"(?<=[a-z])(?=[A-Z][a-z])", "_", text)
    return re.sub(r"[^0-9a-zτσµ²]+", "_", text.lower()).strip("_")


def _columns(table: Table, name: str) -> list[_Column]:
    if not table.columns or len(table.columns[0]) == 0:
        raise DataQualityError(f"{name}: this table is empty")
    refuse_more(
        len(table.columns[0]), _MOST_ROWS, "rows", name, "A curve has one row for each averaging time"
    )
    columns = []
    for i, (text, column) in enumerate(zip(table.headings, table.columns, strict=True)):
        heading = read_heading(text)
        stated = table.units[i] if i < len(table.units) and table.units[i] else heading.unit
        values = column.read(0, len(column)).astype(np.float64) + column.origin
        columns.append(_Column(i + 1, text, Heading(heading.name, stated, heading.group), values))
    return columns


# -- which column is which ---------------------------------------------------------------------------------------


def _roles(columns: Sequence[_Column], channels: Sequence[str] | None, name: str) -> dict[str, Any]:
    """tau, lag, count: a column each, where there is one; value: those that may be deviations."""
    roles: dict[str, Any] = {}
    free = []
    for column in columns:
        role = column.role
        if role in ("tau", "lag", "count") and role not in roles and _possible(role, column.values):
            roles[role] = column
        elif role != "bound":
            free.append(column)
    unnamed = [c for c in free if not c.text.strip()]
    if unnamed:
        free = [c for c in free if c.text.strip()]
        free += _by_content(unnamed, roles)
    if "tau" not in roles and "lag" not in roles:
        rising = [c for c in free if _possible("tau", c.values)]
        if not rising:
            raise DataQualityError(
                f"{name}: no column contains averaging times (positive, increasing); columns: "
                + ", ".join(c.shown for c in columns)
            )
        roles["tau"] = rising[0]
        free.remove(rising[0])
    roles["value"] = _asked(free, channels, name)
    return roles


def _possible(role: str, values: Array) -> bool:
    """Can these numbers be averaging times or lags (rising), or counts (whole, not negative)?"""
    if not np.all(np.isfinite(values)):
        return False
    if role == "count":
        return bool(np.all(values >= 0) and np.all(values == np.round(values)))
    rising = bool(np.all(values > 0) and np.all(np.diff(values) > 0))
    return rising and (role == "tau" or bool(np.all(values == np.round(values))))


def _by_content(unnamed: list[_Column], roles: dict[str, Any]) -> list[_Column]:
    """Columns without headings by what they hold: lags and times that rise together, counts, exponents, bounds."""
    rising = [c for c in unnamed if _possible("tau", c.values)]
    rest = [c for c in unnamed if c not in rising]
    if "tau" not in roles and "lag" not in roles and rising:
        if len(rising) > 1 and _possible("lag", rising[0].values) and _proportional(rising[0], rising[1]):
            roles["lag"], roles["tau"], rising = rising[0], rising[1], rising[2:]
        else:
            roles["tau"], rising = rising[0], rising[1:]
    few = [c for c in rest if len(c.values) > 2 and np.all(np.isin(c.values, range(-4, 5)))]
    rest = [c for c in rest if c not in few]
    counts = [c for c in rest if _possible("count", c.values) and np.all(np.diff(c.values) <= 0)]
    if "count" not in roles and counts:
        roles["count"] = counts[0]
        rest.remove(counts[0])
    return rising + _between_bounds(rest)


def _proportional(one: _Column, other: _Column) -> bool:
    ratio = other.values / one.values
    return bool(np.ptp(ratio) <= 1e-3 * np.abs(ratio).max())


def _between_bounds(columns: list[_Column]) -> list[_Column]:
    """The middle of three columns that are in the same order in every row; all of them, if they are not."""
    if len(columns) != 3:
        return columns
    for low, middle, high in permutations(columns):
        rows = np.isfinite(low.values) & np.isfinite(high.values) & (high.values > 0)
        if (
            rows.sum() > 2
            and np.all(low.values[rows] < middle.values[rows])
            and np.all(middle.values[rows] < high.values[rows])
            and np.all(high.values[rows] < 100 * middle.values[rows])
            and np.all(low.values[rows] > 0.01 * middle.values[rows])
        ):
            return [middle]
    return [c for c in columns if np.any(c.values != 0)]  # bounds that were not computed are zeros


def _asked(free: list[_Column], channels: Sequence[str] | None, name: str) -> list[_Column]:
    if channels is not None:
        words = [channels] if isinstance(channels, str) else list(channels)
        shown = ", ".join(c.shown for c in free)
        for word in words:
            if not any(_called(c, word) for c in free):
                raise InputError(f"{name}: no column {word!r} of deviations; there are: {shown}")
        return [c for c in free if any(_called(c, word) for word in words)]
    named = [c for c in free if c.role == "value"]
    if not named and sum(not c.text.strip() for c in free) > 1:
        raise InputError(
            f"{name}: {', '.join(c.shown for c in free)} have no headings, and any of them may be the deviation: "
            f"choose, as in --channels {for_shell(free[0].shown)} (channels= in Python)"
        )
    if not (named or free):
        raise DataQualityError(f"{name}: no column of deviations in addition to the averaging times")
    return named or free


def _called(column: _Column, word: str) -> bool:
    text, group = word.strip().lower(), canonical_group(word)
    return text in (column.shown.lower(), column.heading.name.lower(), f"column {column.number}") or (
        group != "" and column.heading.group == group
    )


# -- what the values are -----------------------------------------------------------------------------------------


def _quantity(
    values: list[_Column], statistic: str | None, file: str, channels: Sequence[str] | None
) -> tuple[str, bool, list[_Column], list[str]]:
    """Statistic ("allan" where overlapping or not is open), whether squared, the columns of it, and remarks."""
    if statistic is not None:
        wanted = statistic.lower()
        if wanted not in STATED:
            raise InputError(f"statistic must be one of {', '.join(STATED)}, not {statistic!r}")
        name, squared = wanted.replace("var", "dev"), wanted.endswith("var")
        fitting = [c for c in values if _stated(c) in (name, "allan", "")] if channels is None else values
        fitting = [c for c in fitting if _is_squared(c.plain) in (squared, None)] or fitting
        return name, squared, *_without(values, fitting or values)
    best = min(values, key=lambda c: (_rank(c), c.number))
    title, remarks = _plain(file), []
    name = _stated(best) or next((kind for kind, p in _KIND_OF_VALUE if p.search(title)), "")
    squared_by = _is_squared(best.plain)
    if squared_by is None:
        squared_by = _is_squared(title)
        if squared_by is None:
            raise InputError(
                f"{file}: it is undetermined whether {best.shown!r} contains deviations or variances: use "
                "--statistic oadev (overlapping Allan deviation) or oavar (its square); statistic= in Python"
            )
        remarks = [f"{'variances' if squared_by else 'deviations'}, from the file name"]
    alike = [
        c for c in values if _stated(c) == _stated(best) and _is_squared(c.plain) == _is_squared(best.plain)
    ]
    chosen, left = _without(values, alike)
    return name or "allan", squared_by, chosen, [*remarks, *left]


def _without(values: list[_Column], chosen: list[_Column]) -> tuple[list[_Column], list[str]]:
    others = [c.shown for c in values if c not in chosen]
    return chosen, [f"columns left out: {', '.join(others)}"] if others else []


def _rank(column: _Column) -> int:
    """Best is the overlapping Allan deviation, then its square, then what may be it."""
    stated = _stated(column)
    order = {"oadev": 0, "allan": 1, "": 2}.get(stated, 3)
    return 2 * order + bool(_is_squared(column.plain))


def _stated(column: _Column) -> str:
    return next((name for name, pattern in _KIND_OF_VALUE if pattern.search(column.plain)), "")


def _is_squared(plain: str) -> bool | None:
    if _VARIANCE.search(plain):
        return True
    return False if re.search(r"dev|sigma|std|σ", plain) else None


# -- lengths -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _LagGrid:
    """Averaging times [s] or None, lags [samples] or None; one value a row."""

    tau: Array | None
    lags: Array | None

    @property
    def either(self) -> Array:
        return self.lags if self.tau is None else self.tau  # type: ignore[return-value]


def _grid(tau: _Column | None, lag: _Column | None, name: str) -> _LagGrid:
    if tau is None:
        return _LagGrid(None, None if lag is None else lag.values)
    suffix = _TIME_SUFFIX.search(tau.plain)
    unit = tau.heading.unit or (suffix[1] if suffix else "s")
    seconds = tau.values * parse_unit(unit, QuantityKind.TIME).factor
    if not np.all(np.isfinite(seconds) & (seconds > 0)):
        row = int(np.flatnonzero(~(np.isfinite(seconds) & (seconds > 0)))[0]) + 1
        raise DataQualityError(f"{name}: row {row} of {tau.shown!r} has no averaging time; remove the row")
    return _LagGrid(seconds, None if lag is None else lag.values)


def _shape(
    grid: _LagGrid, count: _Column | None, quantity: str, samples: int | None, rate: float | None, name: str
) -> tuple[_Shape, list[str]]:
    """Length and interval of the record, from what was said and from lags and counts; both must agree."""
    if samples is not None and (isinstance(samples, bool) or int(samples) != samples or samples < 3):
        raise InputError(f"samples is the number of samples of the record, at least 3, not {samples!r}")
    dt = None if rate is None else 1.0 / checked_rate(rate)
    remarks: list[str] = []
    if grid.tau is not None and grid.lags is not None:
        ratio = float(np.median(grid.tau / grid.lags))
        if dt is None:
            dt = ratio
            remarks.append(f"rate {1 / dt:.6g} Hz, from averaging times and lags")
        elif abs(ratio / dt - 1) > 1e-3:
            raise InputError(
                f"{name}: averaging times and lags imply {1 / ratio:.6g} Hz, but the stated rate is {1 / dt:.6g} Hz"
            )
    counts = None if count is None or quantity not in ("allan", "oadev", "adev") else count.values
    if dt is None and counts is not None and grid.tau is not None:
        dt = _interval_by(counts, grid.tau)
        if dt is not None:
            remarks.append(f"rate {1 / dt:.6g} Hz, from the counts")
    if dt is None:
        besides = "" if samples is not None or counts is not None else f". Besides, {_NO_LENGTH}"
        raise InputError(
            f"{name}: the sample rate of the record is not in the file, and the intervals need it: pass "
            f"--rate (rate=); the shortest averaging time, {grid.either[0]:.6g} s, is a whole number of "
            f"intervals{besides}"
            if grid.tau is not None
            else f"{name}: the lags are in samples: pass the sample rate, --rate (rate=){besides}"
        )
    lags = grid.lags if grid.lags is not None else grid.either / dt
    if counts is not None:
        if (counted := _length_by(counts, lags, quantity, samples, name)) is not None:
            length, by, notes = counted
            return _Shape(length, dt, by), [*remarks, *notes]
        remarks.append(f"counts in {count.shown!r} ignored: they are not those of Allan deviations")  # type: ignore[union-attr]
    if samples is None:
        raise InputError(f"{name}: {_NO_LENGTH}")
    return _Shape(int(samples), dt, ""), remarks


def _interval_by(counts: Array, tau: Array) -> float | None:
    """Ts of N - 2 tau/Ts + 1 terms; None where counts do not fall along that line."""
    use = counts > 0
    if use.sum() < 3:
        return None
    slope, at = np.polyfit(tau[use], counts[use], 1)
    if slope >= 0 or np.abs(at + slope * tau[use] - counts[use]).max() > 1.0:
        return None
    dt = -2.0 / float(slope)
    exact = float(tau[0]) / max(
        round(float(tau[0]) / dt), 1
    )  # the printed times are more exact than the line
    return exact if abs(exact / dt - 1) < 0.01 else dt


def _length_by(
    counts: Array, lags: Array, quantity: str, samples: int | None, name: str
) -> tuple[int, str, list[str]] | None:
    """(N, statistic, remarks) from counts of terms; None where they are counts of something else."""
    use = counts > 0
    if not use.any():
        return None
    m, n = np.round(lags[use]), counts[use]
    apart = _length_apart(m, n)
    if apart is not None and quantity != "oadev" and len(m) > 2:
        return _agreed(apart, samples, name), "adev", [f"{apart} samples, from the counts"]
    if quantity == "adev":
        return None
    implied = n + 2 * m - 1
    least, most = int(implied.min()), int(implied.max())
    if most - least <= _SAME_LENGTH:
        return _agreed(most, samples, name), "oadev", [f"{most} samples, from the counts"]
    whole = samples if samples is not None else most
    if least >= _COMPLETE * whole and most <= whole + _SAME_LENGTH:
        remark = (
            f"the counts are up to {1 - least / whole:.1%} below those of {whole} samples without gaps: the intervals "
            f"are those of {least} samples"
        )
        return least, "oadev", [remark]
    if samples is None:
        raise InputError(
            f"{name}: the counts fit no record without gaps ({least} to {most} samples): its intervals "
            "cannot be computed. Compute it here from the log, or pass --samples if the column counts something else"
        )
    return None


def _length_apart(m: Array, n: Array) -> int | None:
    """N of floor(N/m) - 1 terms of windows side by side, or None."""
    low, high = ((n + 1) * m).max(), ((n + 2) * m - 1).min()
    if len(m) < 2 or low > high + 2 or np.ptp(n + 2 * m) <= _SAME_LENGTH:
        return None
    return int(low)


def _agreed(counted: int, samples: int | None, name: str) -> int:
    if samples is None or abs(counted - samples) <= _SAME_LENGTH:
        return counted if samples is None else int(samples)
    raise InputError(
        f"{name}: the counts imply {counted} samples, but --samples says {samples}: correct it, or leave it out"
    )


def _lags(grid: _LagGrid, shape: _Shape, name: str) -> tuple[NDArray[np.int64], NDArray[np.intp], list[str]]:
    """Whole lags, ascending, and the row of each."""
    exact = grid.lags if grid.lags is not None else grid.either / shape.dt
    whole = np.maximum(np.rint(exact), 1)
    off = np.abs(exact - whole) > np.minimum(_WHOLE[0] + _WHOLE[1] * exact, 0.501)
    if off.any():
        worst = float(exact[off][0])
        raise InputError(
            f"{name}: averaging time {worst * shape.dt:.6g} s is {worst:.3f} samples at {1 / shape.dt:.6g} Hz, and "
            "must be a whole number: correct --rate (the shortest averaging time would be one sample at "
            f"{1 / (float(exact.min()) * shape.dt):.6g} Hz)"
        )
    lags, first = np.unique(whole.astype(np.int64), return_index=True)
    remarks = []
    if len(lags) < len(whole):
        again = plural(len(whole) - len(lags), "row")
        remarks.append(f"{again} with repeated averaging times left out")
    if lags[0] > 1:
        remarks.append(f"the shortest averaging time is {lags[0]} samples at {1 / shape.dt:.6g} Hz")
    return lags, first, remarks


def _terms(quantity: str, lags: NDArray[np.int64], n: int, name: str) -> NDArray[np.int64]:
    """Terms in the sum of each lag of a record without gaps."""
    statistic = STATISTICS[quantity]
    longest = longest_lag(statistic, n)
    if statistic.total:
        return np.full(len(lags), n - 1)
    if lags[-1] > longest:
        raise InputError(
            f"{name}: a lag of {lags[-1]} samples is too long for {n} samples (at most {longest}): correct --samples "
            "or --rate"
        )
    terms = n + 1 - np.array([statistic.window(int(m)) for m in lags])
    return terms if statistic.overlapping else terms // lags + (terms % lags > 0)


# -- channels ----------------------------------------------------------------------------------------------------


def _channels(
    columns: Sequence[_Column],
    unit: str | Mapping[str, str] | None,
    squared: bool,
    sampling: Sampling,
    remarks: list[str],
) -> tuple[Channel, ...]:
    names = _channel_names(columns)
    given = _given_units(unit, columns, names)
    made = []
    for column, name in zip(columns, names, strict=True):
        bad = ~(np.isnan(column.values) | (np.isfinite(column.values) & (column.values >= 0)))
        if bad.any() or not np.isfinite(column.values).any():
            row = int(np.flatnonzero(bad)[0]) + 1 if bad.any() else 1
            raise DataQualityError(
                f"row {row} of {column.shown!r} is {column.values[row - 1]:g}, not a deviation: "
                "deviations are finite and not negative; choose the columns with --channels"
            )
        stated = given.get(name) or _root_of(column.heading.unit, squared)
        if not stated:
            remarks.append(f"the unit of {name} is unknown: pass it with --unit")
        channel = Channel.of(name, stated, sampling=sampling)
        if channel.kind.integrated or not channel.kind.noise_bearing:
            raise InputError(
                f"{name}: a deviation has the unit of the rate or acceleration, such as deg/h or µg, not {stated!r}"
            )
        made.append(channel)
    return tuple(made)


def _channel_names(columns: Sequence[_Column]) -> list[str]:
    bare = [_NO_NAME.sub("", _plain(c.heading.name)).strip("_") or "signal" for c in columns]
    return [
        n if bare.count(n) == 1 else (c.heading.name or f"ch{c.number}")
        for n, c in zip(bare, columns, strict=True)
    ]


def _given_units(
    unit: str | Mapping[str, str] | None, columns: Sequence[_Column], names: Sequence[str]
) -> dict[str, str]:
    if unit is None:
        return {}
    if isinstance(unit, str):
        if len({c.heading.group for c in columns} & {"gyro", "acc"}) == 2:
            raise InputError(
                f"unit {unit!r} cannot be that of gyros and accelerometers: write --unit gyro=deg/s,acc=g"
            )
        return dict.fromkeys(names, unit)
    units = {}
    for key, text in unit.items():
        fitting = [
            n
            for n, c in zip(names, columns, strict=True)
            if n.lower().startswith(str(key).lower()) or _called(c, str(key))
        ]
        if not fitting:
            raise InputError(f"unit for {key!r}: there is no such channel; channels: {', '.join(names)}")
        units.update(dict.fromkeys(fitting, str(text)))
    return units


def _root_of(unit: str, squared: bool) -> str:
    """The unit of the deviation from that of its column; "" where it is unknown."""
    if not unit:
        return ""
    if squared:
        plain = re.fullmatch(r"\(?([^()]+(?:\([^()]*\))?[^()]*)\)?(\^2|²|\*\*2)", unit.strip())
        unit = plain[1] if plain else f"√({unit})"
    try:
        parse_unit(unit)
    except InputError:
        return ""
    return unit
