# SPDX-License-Identifier: BSD-3-Clause
"""Power spectral density of a channel, its lines, and the band limit of a filtered sensor.

Densities are two-sided, in SI^2/Hz: white noise stands at N^2 (a one-sided density, twice as large, stands at
sqrt(2) N in root density).

Lines and a band limit bend the Allan variance without being noise terms of a model: they imitate quantisation and
shift N. `lags_to_exclude` says which lags of a curve they reach.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.recording import Recording, Sampling

from .band_limit import BandLimit, find_band_limit, short_lag_bend
from .lines import SpectralLine, find_lines, without_lines
from .periodogram import Periodogram, equivalent_dof, periodograms
from .sampled import sampled_psd

__all__ = [
    "Exclusion",
    "SpectralLine",
    "Spectrum",
    "lags_to_exclude",
    "power_spectrum",
    "quiet_lags",
    "sampled_psd",
]

Array = NDArray[np.float64]

#: Points of a spectrum per decade of frequency.
PER_DECADE = 30
#: A lag is bent when a line or the band limit moves its AVAR by this share of its own standard deviation.
TOLERANCE = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Spectrum:
    """Power spectral density of one channel, log-binned.

    Attributes
    ----------
    channel : str
    frequency : ndarray, shape (n,) [Hz]
    density : ndarray, shape (n,) [SI^2/Hz]
        Two-sided, lines included.
    lower, upper : ndarray, shape (n,)
        95 % chi-square interval of the density with `edf` degrees of freedom.
    edf : ndarray, shape (n,)
    background : ndarray, shape (n,)
        The density with its lines taken out.
    lines : tuple of SpectralLine
        By frequency.
    band_limit : BandLimit or None
        The low-pass of a filtered sensor.
    dt : float [s]
    n_samples : int
    sampling : "mean" or "point"
    segments, skipped : int
        Segments averaged and skipped (for missing samples), over all rates of the cascade.
    """

    channel: str
    frequency: Array
    density: Array
    lower: Array
    upper: Array
    edf: Array
    background: Array
    lines: tuple[SpectralLine, ...] = ()
    band_limit: BandLimit | None = None
    dt: float
    n_samples: int
    sampling: Sampling
    segments: int = 0
    skipped: int = 0

    def __post_init__(self) -> None:
        for name in _ARRAYS:
            array = np.array(getattr(self, name), dtype=np.float64)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def corner(self) -> float | None:
        """Frequency [Hz] where the filter halves the density; None for a sensor without one."""
        return None if self.band_limit is None else self.band_limit.corner

    @property
    def shortest_trusted_tau(self) -> float:
        """Averaging time [s] from which on the filter leaves the Allan variance alone; 0 without a filter."""
        if self.band_limit is None:
            return 0.0
        m = np.unique(np.geomspace(1, max(self.n_samples // 8, 2), 200).astype(int))
        bent = _filter_bend(self, m) > TOLERANCE * _deviation(self, m)
        last = int(np.flatnonzero(bent)[-1]) if bent.any() else -1
        return float(m[min(last + 1, len(m) - 1)] * self.dt)

    def __repr__(self) -> str:
        span = f"{self.frequency[0]:.3g} to {self.frequency[-1]:.3g} Hz" if len(self.frequency) else "empty"
        corner = "" if self.corner is None else f", corner {self.corner:.3g} Hz"
        return f"<Spectrum {self.channel}: {span}, {len(self.lines)} lines{corner}>"

    def to_json(self) -> dict[str, Any]:
        """Plain data; `from_json` gives back an equal spectrum."""
        return {
            "channel": self.channel,
            **{name: getattr(self, name).tolist() for name in _ARRAYS},
            "lines": [asdict(line) for line in self.lines],
            "corner": self.corner,
            "band_limit": None if self.band_limit is None else asdict(self.band_limit),
            "shortest_trusted_tau": self.shortest_trusted_tau,
            "dt": self.dt,
            "n_samples": self.n_samples,
            "sampling": self.sampling,
            "segments": self.segments,
            "skipped": self.skipped,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Spectrum:
        """Inverse of `to_json`."""
        given = {key: value for key, value in data.items() if key not in ("corner", "shortest_trusted_tau")}
        limit = data.get("band_limit")
        given["lines"] = tuple(SpectralLine(**line) for line in data["lines"])
        given["band_limit"] = None if limit is None else BandLimit(**limit)
        return cls(**given)


_ARRAYS = ("frequency", "density", "lower", "upper", "edf", "background")


def power_spectrum(
    recording: Recording, name: str, *, progress: Callable[[float], None] | None = None
) -> Spectrum:
    """Power spectral density of a channel, in one pass and bounded memory.

    Parameters
    ----------
    recording : Recording
    name : str
        A channel. Angles and velocities are differenced: the spectrum is that of the rate.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    Spectrum
        Empty where the record, or what its gaps leave of it, is too short (64 samples).

    Raises
    ------
    InputError
        No such channel.

    References
    ----------
    .. [1] P. D. Welch, "The use of fast Fourier transform for the estimation of power spectra", IEEE Trans. Audio
       Electroacoust. 15 (1967) 70.
    """
    channel = recording[name]
    streams = [_scaled(p, channel.scale**2) for p in periodograms(recording, name, progress)]
    lines = find_lines(streams)
    clean = [without_lines(p, lines) for p in streams]
    frequency, density, edf = _binned(streams)
    background = _binned(clean)[1]
    lower, upper = _interval(density, edf)
    return Spectrum(
        channel=name,
        frequency=frequency,
        density=density,
        lower=lower,
        upper=upper,
        edf=edf,
        background=background,
        lines=lines,
        band_limit=find_band_limit(frequency, background, edf, recording.rate / 2),
        dt=1 / recording.rate,
        n_samples=recording.n_samples,
        sampling=channel.sampling,
        segments=sum(p.segments for p in streams),
        skipped=sum(p.skipped for p in streams),
    )


def _scaled(stream: Periodogram, factor: float) -> Periodogram:
    return replace(stream, density=stream.density * factor)


def _binned(streams: Sequence[Periodogram]) -> tuple[Array, Array, Array]:
    """Means over bins of equal log width: frequency, density, equivalent degrees of freedom; frequency ascending."""
    rows: list[tuple[float, float, float]] = []
    for stream in streams[::-1]:
        f, density = stream.frequency[stream.first : stream.last], stream.density[stream.first : stream.last]
        if not len(f):
            continue
        place = np.floor(PER_DECADE * np.log10(f))
        starts = np.flatnonzero(np.diff(place, prepend=-np.inf))
        counts = np.diff(starts, append=len(f))
        middles = np.exp(np.add.reduceat(np.log(f), starts) / counts)
        means = np.add.reduceat(density, starts) / counts
        dofs = [equivalent_dof(int(n), stream.segments, stream.pairs) for n in counts]
        rows += zip(middles.tolist(), means.tolist(), dofs, strict=True)
    table = np.array(rows, dtype=np.float64).reshape(-1, 3)
    return table[:, 0], table[:, 1], table[:, 2]


def _interval(density: Array, edf: Array) -> tuple[Array, Array]:
    from scipy.special import gammaincinv

    half = edf / 2
    return density * half / gammaincinv(half, 0.975), density * half / gammaincinv(half, 0.025)


# -- what bends a curve -----------------------------------------------------------------------------------


class Exclusion(NamedTuple):
    """Lags that are not the noise model's.

    Attributes
    ----------
    excluded : ndarray of bool, shape (n_lags,)
    reasons : tuple of str
        Per lag; "" where it is kept.
    """

    excluded: NDArray[np.bool_]
    reasons: tuple[str, ...]


def lags_to_exclude(
    spectrum: Spectrum,
    tau: ArrayLike,
    *,
    avar: ArrayLike | None = None,
    edf: ArrayLike | None = None,
    tolerance: float = TOLERANCE,
) -> Exclusion:
    """Lags of an Allan curve that a line or the band limit moves noticeably.

    Parameters
    ----------
    spectrum : Spectrum
    tau : array_like, shape (n_lags,) [s]
        Whole multiples of the sample interval.
    avar, edf : array_like, shape (n_lags,), optional
        Allan variance [SI^2] and its equivalent degrees of freedom; by default what the spectrum and the length of
        the record give.
    tolerance : float
        A lag is excluded when its variance is moved by more than `tolerance` of its standard deviation.

    Notes
    -----
    A line of amplitude A adds A^2 [sin^2(pi f tau)/(m sin(pi f Ts))]^2, the worst case within its width.
    """
    m = np.rint(np.asarray(tau, dtype=np.float64) / spectrum.dt)
    noise = tolerance * _deviation(spectrum, m, avar, edf)
    reasons = [""] * len(m)
    for i in np.flatnonzero(_filter_bend(spectrum, m) > noise):
        reasons[i] = f"bent by the low-pass at {spectrum.corner:.3g} Hz"
    if spectrum.lines:
        added = np.array([_line_avar(line, m, spectrum.dt) for line in spectrum.lines])
        for i in np.flatnonzero(added.sum(axis=0) > noise):
            line = spectrum.lines[int(np.argmax(added[:, i]))]
            reasons[i] = reasons[i] or f"bent by the spectral line at {line.frequency:.4g} Hz"
    return Exclusion(np.array([bool(r) for r in reasons], dtype=bool), tuple(reasons))


def quiet_lags(spectrum: Spectrum, lags: ArrayLike, *, reach: float = 1.2) -> NDArray[np.int64]:
    """Lags near the given ones that the lines disturb least.

    A line has no part in averages over whole periods of it: a curve read there goes on through the line. Lags that
    no line reaches stay as they are.

    Parameters
    ----------
    spectrum : Spectrum
    lags : array_like of int, shape (n_lags,)
        Samples.
    reach : float
        A lag may be moved up or down by this factor.

    Returns
    -------
    ndarray of int64
        Ascending, without duplicates.
    """
    chosen = set()
    for lag in np.asarray(lags, dtype=np.int64).tolist():
        near = np.unique(np.rint(np.linspace(lag / reach, lag * reach, 401)).astype(np.int64))
        near = np.concatenate([[lag], near[near >= 1]])
        added = sum(
            (_line_avar(line, near.astype(np.float64), spectrum.dt) for line in spectrum.lines),
            np.zeros(len(near)),
        )
        moved = added / _deviation(spectrum, near)
        chosen.add(lag if moved[0] <= TOLERANCE else int(near[np.argmin(moved)]))
    return np.array(sorted(chosen), dtype=np.int64)


def _line_avar(line: SpectralLine, m: Array, dt: float) -> Array:
    cycles = line.frequency * m * dt
    off = np.abs(cycles % 1.0 - 0.5)  # from the frequency at which sin^2 is 1
    sine = np.cos(np.pi * np.maximum(off - line.width / 2 * m * dt, 0.0))
    return np.asarray(line.amplitude**2 * (sine**2 / (m * math.sin(math.pi * line.frequency * dt))) ** 2)


def _filter_bend(spectrum: Spectrum, m: ArrayLike) -> Array:
    m = np.asarray(m, dtype=np.float64)
    if spectrum.band_limit is None:
        return np.zeros_like(m)
    return np.abs(
        short_lag_bend(spectrum.band_limit, spectrum.frequency, spectrum.background, m, spectrum.dt)
    )


def _deviation(
    spectrum: Spectrum, m: ArrayLike, avar: ArrayLike | None = None, edf: ArrayLike | None = None
) -> Array:
    """Standard deviation of the Allan variance at m samples."""
    m = np.asarray(m, dtype=np.float64)
    variance = _avar(spectrum, m) if avar is None else np.asarray(avar, dtype=np.float64)
    dof = np.maximum(np.minimum(0.67, 1.2 / m) * spectrum.n_samples, 1.0) if edf is None else np.asarray(edf)
    return np.asarray(variance * np.sqrt(2 / dof))


def _avar(spectrum: Spectrum, m: Array) -> Array:
    """Allan variance of the background: 4 * integral of S(f) [sin^2(pi f m Ts)/(m sin(pi f Ts))]^2 df over its bins."""
    f = spectrum.frequency
    if len(f) < 2:
        return np.zeros_like(m)
    edges = np.concatenate([[0.0], np.sqrt(f[1:] * f[:-1]), [0.5 / spectrum.dt]])
    width, turns = np.diff(edges), np.outer(m, f * spectrum.dt)
    blur = np.outer(m, np.diff(edges) * spectrum.dt)  # sin^4 averaged over each bin
    fourth = (
        3 / 8
        - np.cos(2 * np.pi * turns) * np.sinc(blur) / 2
        + np.cos(4 * np.pi * turns) * np.sinc(2 * blur) / 8
    )
    shape = fourth / (m[:, None] * np.sin(np.pi * f * spectrum.dt)) ** 2
    return np.asarray(4 * shape @ (spectrum.background * width))
