# SPDX-License-Identifier: BSD-3-Clause
"""AllanCurve: deviations with intervals, and allan_curve(recording), which makes one."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import DataQualityError, DataQualityWarning, FormatError, InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.allan import degrees
from allanite.noise.allan.lags import choose_lags
from allanite.noise.allan.local_degrees import Degrees, RecordOfCurve, degrees_by_local_law, degrees_under
from allanite.noise.allan.online import decimable, decimated_sums
from allanite.noise.allan.robust import m_estimates
from allanite.noise.allan.soundness import check_channels, check_lags, check_record, check_values
from allanite.noise.allan.statistics import (
    STATISTICS,
    Statistic,
    complete_runs,
    longest_lag,
    phase_of,
    sums_of_squares,
)
from allanite.noise.allan.tails import phase_kurtosis
from allanite.noise.allan.theo import hybrid_lags, is_heavy, sums_of_inner_squares, theo_lags
from allanite.plain_files.atomic_file import fresh
from allanite.plain_files.counted import plural
from allanite.plain_files.csv_cells import heading_cell
from allanite.plain_files.json_values import parse_plain
from allanite.plain_files.loggers import logger_of
from allanite.plain_files.regular_file import read_regular_text
from allanite.quantities.display_units import si_unit
from allanite.quantities.probabilities import require_probabilities
from allanite.quantities.tabular import Columns, Tabular
from allanite.recording.clock_channels import without_noise
from allanite.recording.records import Channel, Recording, Sampling, checked_recording

__all__ = ["AllanCurve", "allan_curve"]

_LOG = logger_of(__name__)
Array = NDArray[np.float64]
Spans = NDArray[np.int64]
Engine = Literal["auto", "exact", "decimated"]

LOCAL = "local power law at each lag; curve.with_model(model) gives the exact one"
#: What an interval by the local power law does not hold.
_NOTES = {
    "theo1": "; the interval is that of Theo1, which is not the Allan deviation unless the noise is white",
    "theobr": "; assumes the same type of noise beyond a tenth of the record",
    "theoh": "; beyond a fifth of the record, assumes the same type of noise",
}
#: A full-length phase above this many bytes makes "auto" take the decimated engine.
_EXACT_BYTES = 2 << 30


@dataclass(frozen=True, slots=True, kw_only=True)
class AllanCurve(Tabular):
    """Deviations of one or several channels over lag, with intervals.

    Attributes
    ----------
    statistic : str
        adev, oadev, hdev, ohdev, mdev, tdev, totdev, haar, robust, theo1, theobr or theoh.
    lags : ndarray of int64, shape (n_lags,)
        Averaging times in samples.
    tau : ndarray, shape (n_lags,) [s]
        lags * dt, for Theo1 0.75 lags * dt: what was computed, never what was asked for.
    deviation, lower, upper : ndarray, shape (n_lags, n_channels) [SI unit of the rate or acceleration]
        Estimate and its equal-tailed chi-square interval; NaN where no term is complete, or no robust one is found.
    edf : ndarray, shape (n_lags, n_channels)
        Equivalent degrees of freedom of the variance.
    count : ndarray of int64, shape (n_lags, n_channels)
        Terms in the sum.
    confidence : float
        Confidence level of the intervals.
    channels : tuple of Channel
        Curve of each channel.
    dt : float [s]
        Sample interval Ts.
    n_samples : int
        Samples of the record, missing ones included (N).
    missing : tuple of ndarray of int64, shape (n_runs, 2)
        Runs of missing samples of each channel.
    engine : str
        "exact" (every window) or "decimated" (every 2^k-th window at long lags, fixed memory).
    interval_basis : str
        Noise that the degrees of freedom assume.
    excluded : ndarray of bool, shape (n_lags, n_channels)
        Lags bent by a spectral line or by the sensor's filter: shown, but kept out of a fit.
    excess_kurtosis : tuple of float
        Excess kurtosis of the samples of each channel; 0 if slight, possibly chance, or unknown.

    Notes
    -----
    The mean of a deviation with few degrees of freedom lies below the truth (0.798 of it at edf = 1), while the
    variance is unbiased: the interval is the answer, not the dot.
    """

    statistic: str
    lags: NDArray[np.int64]
    tau: Array
    deviation: Array
    lower: Array = field(repr=False)
    upper: Array = field(repr=False)
    edf: Array = field(repr=False)
    count: NDArray[np.int64] = field(repr=False)
    confidence: float
    channels: tuple[Channel, ...]
    dt: float
    n_samples: int
    missing: tuple[Spans, ...] = field(repr=False)
    engine: str = "exact"
    interval_basis: str = LOCAL
    excluded: NDArray[np.bool_] = field(default_factory=lambda: np.zeros((0, 0), dtype=bool), repr=False)
    excess_kurtosis: tuple[float, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        if not self.excess_kurtosis:
            object.__setattr__(self, "excess_kurtosis", (0.0,) * len(self.channels))
        if self.excluded.size == 0:
            object.__setattr__(self, "excluded", np.zeros(np.shape(self.deviation), dtype=bool))
        for name in ("lags", "tau", "deviation", "lower", "upper", "edf", "count", "excluded"):
            view = np.asarray(getattr(self, name)).view()
            view.flags.writeable = False
            object.__setattr__(self, name, view)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(c.name for c in self.channels)

    def to_columns(self) -> Columns:
        """One row for each channel and lag: channel, lag, tau, deviation, lower, upper, edf, count, excluded, unit."""
        shape = (len(self.channels), len(self.lags))
        units = [si_unit(c.kind.rate, "deviation", c.unit) for c in self.channels]
        by_lag = {
            name: np.broadcast_to(array, shape).ravel()
            for name, array in (("lag", self.lags), ("tau", self.tau))
        }
        numbers = {
            k: getattr(self, k).T.ravel() for k in ("deviation", "lower", "upper", "edf", "count", "excluded")
        }
        return {
            "channel": np.repeat(self.names, shape[1]),
            **by_lag,
            **numbers,
            "unit": np.repeat(units, shape[1]),
        }

    def __repr__(self) -> str:
        tau = f"{self.tau[0]:.4g} to {self.tau[-1]:.4g} s" if len(self.tau) else "no lag"
        return f"<AllanCurve {self.statistic} of {', '.join(self.names)}: {len(self.lags)} lags, {tau}>"

    @property
    def variance(self) -> Array:
        """deviation squared, shape (n_lags, n_channels)."""
        return self.deviation**2

    def __getitem__(self, name: str) -> AllanCurve:
        """The curve of one channel.

        Raises
        ------
        InputError
            No such channel.
        """
        if name not in self.names:
            raise InputError(f"no channel {name!r} in the curve; there are: {', '.join(self.names)}")
        i = self.names.index(name)
        part = {
            k: getattr(self, k)[:, [i]] for k in ("deviation", "lower", "upper", "edf", "count", "excluded")
        }
        tails = (self.excess_kurtosis[i],)
        return replace(
            self, channels=(self.channels[i],), missing=(self.missing[i],), excess_kurtosis=tails, **part
        )

    def starts(self, i: int = 0) -> list[Spans] | None:
        """Runs of complete windows at each lag of channel i; None if no samples are missing."""
        missing, pointwise = self.missing[i], self.channels[i].kind.integrated
        if len(missing) == 0:
            return None
        statistic = STATISTICS[self.statistic]
        return [complete_runs(statistic, int(m), missing, self.n_samples, pointwise) for m in self.lags]

    def _record(self, i: int) -> RecordOfCurve:
        return RecordOfCurve(
            statistic=STATISTICS[self.statistic],
            lags=self.lags,
            count=self.count[:, i],
            n_samples=self.n_samples,
            sampling=self.channels[i].sampling,
            starts=self.starts(i),
        )

    def with_model(self, model: NoiseModel) -> AllanCurve:
        """The same deviations with degrees of freedom and intervals under a model.

        Exact for oadev and haar, to 1 % for theo1, to first order in their inverse for robust, theobr and theoh.
        The interval of theo1 is that of Theo1: its bias stays (`allan.theo_covariance.theo1_bias`).

        Raises
        ------
        InputError
            Several channels, or a statistic whose degrees of freedom are a published formula.
        """
        if len(self.channels) != 1:
            raise InputError("with_model needs the curve of one channel: curve['x'].with_model(model)")
        if not STATISTICS[self.statistic].has_exact_degrees:
            raise InputError(
                f"the degrees of freedom of {self.statistic} under a model are unknown; use oadev, haar, robust, "
                "theo1, theobr or theoh"
            )
        how = "exact" if self.statistic in ("oadev", "haar") else "degrees of freedom"
        return _with_degrees(self, [degrees_under(self._record(0), model, self.dt)], f"{how} under {model}")

    @classmethod
    def from_arrays(
        cls,
        tau: ArrayLike,
        deviation: ArrayLike,
        *,
        dt: float,
        n_samples: int,
        unit: str,
        name: str = "signal",
        sampling: Sampling = "mean",
        confidence: float = 0.95,
    ) -> AllanCurve:
        """An overlapping Allan deviation that another program computed, so that it can be fitted here.

        Parameters
        ----------
        tau : array_like, shape (n_lags,) [s]
            Taken to the nearest whole number of samples; doubles are dropped.
        deviation : array_like, shape (n_lags,)
            Deviation at each lag, in `unit`.
        dt : float [s]
            Sample interval of the record behind the curve.
        n_samples : int
            Length of the record in samples; the intervals depend on it.
        unit : str
            Unit of the deviation, which is that of the rate or acceleration.

        Raises
        ------
        InputError
            Shapes that differ, numbers that are no lags or deviations, a unit of another quantity, or lags longer
            than half of the record.
        """
        t = np.asarray(tau, dtype=np.float64)
        sigma = np.asarray(deviation, dtype=np.float64)
        if t.ndim != 1 or t.shape != sigma.shape:
            raise InputError(
                f"tau has shape {t.shape} and the deviation {sigma.shape}; one value per lag is needed"
            )
        if not (t.size and np.all(np.isfinite(t) & (t > 0) & np.isfinite(sigma) & (sigma >= 0)) and dt > 0):
            raise InputError(
                "tau and dt must be positive, deviations finite and not negative, one lag at least"
            )
        channel = Channel.of(name, unit, sampling=sampling)
        if channel.kind.integrated or not channel.kind.noise_bearing:
            raise InputError(f"the deviation has the unit of the rate or acceleration, not {unit!r}")
        lags, first = np.unique(np.maximum(np.rint(t / dt), 1).astype(np.int64), return_index=True)
        if lags[-1] > n_samples // 2:
            raise InputError(
                f"lag {t.max():g} s is longer than half of {n_samples} samples at {dt:g} s; pass the true "
                "length of the record"
            )
        count = n_samples - 2 * lags + 1
        sigma = sigma[first] * abs(channel.scale)
        empty = np.full((len(lags), 1), np.nan)
        bare = cls(
            statistic="oadev",
            lags=lags,
            tau=lags.astype(np.float64) * dt,
            deviation=sigma[:, None],
            lower=empty,
            upper=empty,
            edf=empty,
            count=count[:, None],
            confidence=confidence,
            channels=(channel,),
            dt=float(dt),
            n_samples=int(n_samples),
            missing=(np.zeros((0, 2), dtype=np.int64),),
            engine="elsewhere",
        )
        return _local(bare, sigma[:, None] ** 2)

    # -- files ------------------------------------------------------------------------------------------------

    def to_json(self) -> dict[str, Any]:
        """Plain data of a one-channel curve, as it is in a study."""
        if len(self.channels) != 1:
            raise InputError("to_json takes the curve of one channel: curve['x'].to_json()")
        columns = {k: _plain(getattr(self, k)[:, 0]) for k in ("deviation", "lower", "upper", "edf", "count")}
        facts = {
            k: getattr(self, k)
            for k in ("statistic", "engine", "confidence", "dt", "n_samples", "interval_basis")
        }
        return {
            **facts,
            "sampling": self.channels[0].sampling,
            "missing": self.missing[0].tolist(),
            "lags": self.lags.tolist(),
            "tau": self.tau.tolist(),
            **columns,
        }

    def to_csv(self, path: str | Path, *, force: bool = False) -> Path:
        """Write the curve with everything a later fit needs: N, Ts, sampling convention, missing runs.

        Raises
        ------
        StorageError
            The file exists and `force` is not set.
        """
        header = {
            "format": "allanite-curve 1",
            "statistic": self.statistic,
            "engine": self.engine,
            "confidence": self.confidence,
            "N": self.n_samples,
            "Ts": self.dt,
            "interval basis": self.interval_basis,
            "channels": json.dumps([c.to_json() for c in self.channels], ensure_ascii=False),
            "missing": json.dumps([runs.tolist() for runs in self.missing]),
            "excluded": json.dumps([self.lags[column].tolist() for column in self.excluded.T]),
            "units": "m in samples, tau in s, deviations in SI (or the channel's own unit where it has none)",
        }
        if any(self.excess_kurtosis):
            header["excess kurtosis"] = json.dumps(self.excess_kurtosis)
        fields = ("deviation", "lower", "upper", "edf", "count")
        names = ["m", "tau", *(f"{c.name}.{k}" for c in self.channels for k in fields)]
        lines = [f"# {key}: {value}" for key, value in header.items()]
        lines.append(",".join(heading_cell(n) for n in names))
        for i, m in enumerate(self.lags):
            row = [str(int(m)), repr(float(self.tau[i]))]
            for j in range(len(self.channels)):
                row += [repr(float(getattr(self, k)[i, j])) for k in fields[:4]] + [
                    str(int(self.count[i, j]))
                ]
            lines.append(",".join(row))
        with fresh(path, force=force) as place:
            place.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return Path(path)

    @classmethod
    def from_csv(cls, path: str | Path) -> AllanCurve:
        """Read what `to_csv` wrote.

        Raises
        ------
        FormatError
            Not such a file, or one that was cut.
        """
        try:
            text = read_regular_text(path)
        except UnicodeDecodeError as error:
            raise FormatError(f"{path} is not a curve written by allanite: {error}") from None
        head: dict[str, str] = {}
        lines = text.split("\n")  # no other line ends: a name may hold them
        for line in lines:
            if line.startswith("# ") and ": " in line:
                key, value = line[2:].split(": ", 1)
                head[key] = value
        if head.get("format") != "allanite-curve 1":
            raise FormatError(
                f"{path} is not a curve written by allanite (no '# format: allanite-curve 1' line)"
            )
        try:
            channels = tuple(Channel.from_json(c) for c in parse_plain(head["channels"]))
            missing = tuple(np.array(r, dtype=np.int64).reshape(-1, 2) for r in parse_plain(head["missing"]))
            rows = [r for r in lines if r and not r.startswith("#")][1:]
            table = np.array([[float(c) for c in r.split(",")] for r in rows])
            grid = table[:, 2:].reshape(len(table), len(channels), 5)
            whole = np.column_stack([table[:, 0], grid[:, :, 4]])
            if not np.all((whole == np.floor(whole)) & (np.abs(whole) < 2.0**62)):
                raise ValueError("lags m and counts must be whole numbers")
            bent = [np.isin(table[:, 0], lags) for lags in parse_plain(head.get("excluded", "[]"))]
            curve = cls(
                statistic=head["statistic"],
                engine=head["engine"],
                confidence=float(head["confidence"]),
                n_samples=int(head["N"]),
                dt=float(head["Ts"]),
                interval_basis=head["interval basis"],
                channels=channels,
                missing=missing,
                lags=table[:, 0].astype(np.int64),
                tau=table[:, 1],
                deviation=grid[:, :, 0],
                lower=grid[:, :, 1],
                upper=grid[:, :, 2],
                edf=grid[:, :, 3],
                count=grid[:, :, 4].astype(np.int64),
                excluded=np.stack(bent, axis=1) if bent else np.zeros(grid.shape[:2], dtype=bool),
                excess_kurtosis=_kurtoses(head.get("excess kurtosis", "[]"), len(channels)),
            )
            if curve.excluded.shape != curve.deviation.shape:
                raise ValueError("excluded must hold one list of lags for each channel")
            _check_sound(curve)
        except (IndexError, KeyError, OverflowError, TypeError, ValueError) as error:
            raise FormatError(f"{path}: damaged curve file: {_one_line(error)}") from None
        return curve


def _check_sound(curve: AllanCurve) -> None:
    """Raise if the parts of a curve cannot belong to one record."""
    n, dt = curve.n_samples, curve.dt
    check_record(curve.statistic, curve.confidence, n, dt)
    check_channels(curve.names, curve.missing, n)
    check_lags(curve.statistic, curve.lags, curve.tau, n, dt)
    check_values({k: getattr(curve, k) for k in ("deviation", "lower", "upper", "edf")}, curve.count, n)


def _kurtoses(text: str, count: int) -> tuple[float, ...]:
    values = tuple(float(v) for v in parse_plain(text))
    if values and (len(values) != count or not all(0.0 <= v < np.inf for v in values)):
        raise ValueError("excess kurtosis must be one number, not negative, for each channel")
    return values


def _one_line(error: Exception) -> str:
    """What is wrong, short: a key that is not there is named as that."""
    return f"{error} is missing" if isinstance(error, KeyError) else str(error)[:300]


def _plain(values: NDArray[Any]) -> list[float | int | None]:
    return [v if v == v and abs(v) != np.inf else None for v in values.tolist()]


def allan_curve(
    recording: Recording,
    *,
    statistic: str = "oadev",
    taus: str | int | ArrayLike = "octave",
    engine: Engine = "auto",
    confidence: float = 0.95,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> AllanCurve:
    """The Allan curve of every noise-bearing channel of a recording.

    Parameters
    ----------
    recording : Recording
        Recording to analyze.
    statistic : str
        "oadev" (overlapping Allan deviation) unless there is a reason: adev, hdev, ohdev, mdev, tdev, totdev; "haar"
        (Haar wavelet deviation, oadev/sqrt 2), "robust" (under outliers), "theo1", "theobr", "theoh" (beyond half of
        the record; see `allanite.noise.allan.theo`).
    taus : "octave", "decade", "all", int or array_like [s]
        See `allanite.noise.allan.lags.choose_lags`. Lags the record does not support are refused, never rounded.
    engine : "auto", "exact" or "decimated"
        "decimated" needs fixed memory and one pass (oadev, octave and per-decade grids); "auto" takes it when the phase
        would not fit in 2 GiB. For the forms of Theo1 it means block means in long windows, "auto" where the exact
        sums would take long; the memory is that of the phase.
    confidence : float
        Level of the intervals.
    threads : int, optional
        The digits do not depend on it.
    progress : callable, optional
        Called with the fraction done.

    Raises
    ------
    InputError
        No recording; an unknown statistic, grid or engine; a lag the record does not support; a confidence outside
        (0, 1).
    DataQualityError
        Fewer than three samples, or none present.
    """
    checked_recording(recording, "allan_curve")
    chosen = _chosen(statistic)
    require_probabilities(confidence=confidence)
    names = [c.name for c in recording.channels if c.kind.noise_bearing]
    if not names:
        raise without_noise(recording)
    n = recording.n_samples - int(recording[names[0]].kind.integrated)
    if n < 3:
        raise DataQualityError(f"the recording has {plural(n, 'sample')}; an Allan variance needs at least 3")
    lags = _lags(chosen, taus, n, recording.dt)
    way = _engine(engine, chosen, recording, taus, lags)
    lags = decimable(lags) if way == "decimated" and not chosen.theo else lags
    _LOG.info("%s of %s: %d averaging times, engine %s", chosen.name, ", ".join(names), len(lags), way)
    columns, missing, tails = [], [], []
    for i, name in enumerate(names):
        step = None if progress is None else _scaled(progress, i, len(names))
        variance, count, gaps, kurtosis = _channel(recording, name, chosen, lags, way, threads, step)
        columns.append((variance, count))
        missing.append(gaps)
        tails.append(kurtosis)
    return curve_of_sums(
        chosen,
        lags,
        columns,
        missing,
        channels=tuple(recording[n] for n in names),
        dt=recording.dt,
        n_samples=n,
        confidence=confidence,
        engine=way,
        excess_kurtosis=tuple(tails),
    )


def curve_of_sums(
    statistic: Statistic,
    lags: NDArray[np.int64],
    columns: Sequence[tuple[Array, NDArray[np.int64]]],
    missing: Sequence[Spans],
    *,
    channels: tuple[Channel, ...],
    dt: float,
    n_samples: int,
    confidence: float,
    engine: str,
    excess_kurtosis: tuple[float, ...] = (),
) -> AllanCurve:
    """A curve whose variances are known, with the intervals of its local power law.

    Parameters
    ----------
    columns : sequence of (ndarray, ndarray of int64), each of shape (n_lags,)
        Of each channel, variance [own unit^2] and windows.
    missing : sequence of ndarray of int64, shape (n_runs, 2)
        Of each channel.
    """
    scale = np.array([abs(c.scale) for c in channels])
    variance = np.stack([v for v, _ in columns], axis=1)
    deviation = np.sqrt(variance) * scale
    tau = statistic.averaging(lags, n_samples) * dt
    if statistic.time:
        deviation = deviation * tau[:, None] / np.sqrt(3.0)
    bare = AllanCurve(
        statistic=statistic.name,
        lags=lags,
        tau=tau,
        deviation=deviation,
        lower=np.full_like(deviation, np.nan),
        upper=np.full_like(deviation, np.nan),
        edf=np.full_like(deviation, np.nan),
        count=np.stack([c for _, c in columns], axis=1),
        confidence=confidence,
        channels=channels,
        dt=dt,
        n_samples=n_samples,
        missing=tuple(missing),
        engine=engine,
        excess_kurtosis=excess_kurtosis,
    )
    return _local(bare, variance)


def _chosen(statistic: str) -> Statistic:
    try:
        return STATISTICS[statistic]
    except (KeyError, TypeError):
        raise InputError(f"unknown statistic {statistic!r}; there are: {', '.join(STATISTICS)}") from None


def _lags(statistic: Statistic, taus: str | int | ArrayLike, n: int, dt: float) -> NDArray[np.int64]:
    if statistic.hybrid:
        return hybrid_lags(taus, n, dt)
    return theo_lags(taus, n, dt) if statistic.theo else choose_lags(taus, n, dt, longest_lag(statistic, n))


def _engine(
    engine: str, statistic: Statistic, recording: Recording, taus: object, lags: NDArray[np.int64]
) -> str:
    if engine not in ("auto", "exact", "decimated"):
        raise InputError(f"engine must be 'auto', 'exact' or 'decimated', not {engine!r}")
    if statistic.theo:
        heavy = engine == "decimated" or (engine == "auto" and is_heavy(lags, recording.n_samples))
        return "decimated" if heavy else "exact"
    grid = isinstance(taus, (int, np.integer)) or (isinstance(taus, str) and taus != "all")
    able = statistic.name == "oadev" and grid
    able = able and not any(c.kind.integrated for c in recording.channels)
    if engine == "decimated" and not able:
        raise InputError(
            "the decimated engine computes oadev of rates on the grids 'octave', 'decade' or a count per decade"
        )
    if engine == "auto":
        return "decimated" if able and 8 * recording.n_samples > _EXACT_BYTES else "exact"
    return engine


def _scaled(progress: Callable[[float], None], i: int, of: int) -> Callable[[float], None]:
    return lambda fraction: progress((i + fraction) / of)


def _channel(
    recording: Recording,
    name: str,
    statistic: Statistic,
    lags: NDArray[np.int64],
    engine: str,
    threads: int | None,
    progress: Callable[[float], None] | None,
) -> tuple[Array, NDArray[np.int64], Spans, float]:
    if engine == "decimated" and not statistic.theo:
        return *decimated_sums(recording, name, lags, progress), 0.0  # of so many samples tails do not matter
    halves = (None, None) if progress is None else (_scaled(progress, 0, 2), _scaled(progress, 1, 2))
    phase = phase_of(recording, name, halves[0])
    if statistic.theo:
        thinned = engine == "decimated"
        sums = sums_of_inner_squares(phase, statistic, lags, threads, thinned=thinned, progress=halves[1])
    elif statistic.robust:
        sums = m_estimates(phase, lags, threads, halves[1])
    else:
        sums = sums_of_squares(phase, statistic, lags, threads, halves[1])
    tails = 0.0 if recording[name].kind.integrated else phase_kurtosis(phase.x, phase.missing)
    return *sums, phase.missing, tails


def _local(curve: AllanCurve, variance: Array) -> AllanCurve:
    """The curve with the degrees of freedom of the power law that each channel follows locally."""
    columns = [degrees_by_local_law(curve._record(i), variance[:, i]) for i in range(len(curve.channels))]
    return _with_degrees(curve, columns, LOCAL + _NOTES.get(curve.statistic, ""))


def _with_degrees(curve: AllanCurve, columns: list[Degrees], basis: str) -> AllanCurve:
    edf, shape = (np.stack([getattr(c, k) for c in columns], axis=1) for k in ("edf", "shape"))
    none = ~np.isfinite(curve.deviation)
    edf, shape = np.where(none, np.nan, edf), np.where(none, np.nan, shape)
    low, high = degrees.chi_square_factors(edf, curve.confidence)
    if not np.array_equal(edf, shape, equal_nan=True):
        low, high = degrees.shifted_factors(edf, shape, curve.confidence)
    zero = np.any(curve.deviation == 0)
    if zero:
        warnings.warn(
            "the deviation is exactly zero at some lags: the record does not resolve any noise there",
            DataQualityWarning,
            stacklevel=4,
        )
    return replace(
        curve, edf=edf, lower=curve.deviation * low, upper=curve.deviation * high, interval_basis=basis
    )
