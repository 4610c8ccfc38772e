# SPDX-License-Identifier: BSD-3-Clause
"""A spectrum: densities with their intervals, its lines, and what a model would show in its place."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, field
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.spectrum.band_limit import BandLimit, short_lag_bend
from allanite.noise.spectrum.expected import Sight, sight_of
from allanite.noise.spectrum.holes import Bridged
from allanite.noise.spectrum.lines import SpectralLine
from allanite.noise.spectrum.sampled import sampled_psd
from allanite.noise.spectrum.windows import window_of
from allanite.recording.records import Sampling

__all__ = ["METHODS", "TOLERANCE", "Method", "Spectrum"]

Array = NDArray[np.float64]
Method = Literal["log", "welch"]
METHODS: tuple[Method, ...] = ("log", "welch")
#: A lag is bent when a line or the band limit moves its AVAR by this share of its own standard deviation.
TOLERANCE = 0.3
_ARRAYS = ("frequency", "density", "lower", "upper", "edf", "background", "resolution")


def _no_bins() -> NDArray[np.int64]:
    return np.zeros((0, 2), dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Spectrum:
    """Power spectral density of one channel.

    Attributes
    ----------
    channel : str
        Name of the channel.
    frequency : ndarray, shape (n,) [Hz]
        Frequency of each point.
    density : ndarray, shape (n,) [SI^2/Hz]
        Two-sided, lines included.
    lower, upper : ndarray, shape (n,)
        Interval of the density: chi-square with `edf` degrees of freedom, about the part put back for bridged samples.
    edf : ndarray, shape (n,)
        Degrees of freedom of the density less `bridged.put_back`.
    background : ndarray, shape (n,)
        The density with its lines taken out.
    lines : tuple of SpectralLine
        Spectral lines by frequency.
    band_limit : BandLimit or None
        The low-pass of a filtered sensor.
    dt : float [s]
        Sample interval.
    n_samples : int
        Number of samples.
    sampling : "mean" or "point"
        Whether a sample is the mean over its interval or a point value.
    segments, skipped : int
        Segments averaged and skipped (for missing samples), over all rates of the cascade.
    method : "log" or "welch"
        Bins of equal width in the logarithm, or every bin of segments of one length.
    window : str
        Window of the segments.
    overlap : float
        Part of a segment that it shares with the next.
    confidence : float
        Level of the intervals.
    resolution : ndarray, shape (n,) [Hz]
        Distance of the periodogram bins behind each point.
    bins : ndarray of int64, shape (n, 2)
        Each point is the mean of periodogram bins [first, last).
    bridged : Bridged
        Part of the density from isolated missing samples.
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
    method: Method = "log"
    window: str = "hann"
    overlap: float = 0.5
    confidence: float = 0.95
    resolution: Array = field(default_factory=lambda: np.zeros(0), repr=False)
    bins: NDArray[np.int64] = field(default_factory=_no_bins, repr=False)
    bridged: Bridged = field(default_factory=Bridged, repr=False)

    def __post_init__(self) -> None:
        for name in _ARRAYS:
            array = np.array(getattr(self, name), dtype=np.float64)
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        bins = np.array(self.bins, dtype=np.int64).reshape(-1, 2)
        bins.flags.writeable = False
        object.__setattr__(self, "bins", bins)

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
        bent = self.filter_bend(m) > TOLERANCE * self.deviation_of_variance(m)
        last = int(np.flatnonzero(bent)[-1]) if bent.any() else -1
        return float(m[min(last + 1, len(m) - 1)] * self.dt)

    def filter_bend(self, m: ArrayLike) -> Array:
        """What the filter takes from or adds to the Allan variance at m samples, without its sign."""
        m = np.asarray(m, dtype=np.float64)
        if self.band_limit is None:
            return np.zeros_like(m)
        return np.abs(short_lag_bend(self.band_limit, self.frequency, self.background, m, self.dt))

    def deviation_of_variance(
        self, m: ArrayLike, avar: ArrayLike | None = None, edf: ArrayLike | None = None
    ) -> Array:
        """Standard deviation of the Allan variance at m samples; by default of that of the background."""
        m = np.asarray(m, dtype=np.float64)
        given = _avar(self.frequency, self.background, m, self.dt) if avar is None else avar
        dof = np.maximum(np.minimum(0.67, 1.2 / m) * self.n_samples, 1.0) if edf is None else np.asarray(edf)
        return np.asarray(np.asarray(given, dtype=np.float64) * np.sqrt(2 / dof))

    @property
    def sight(self) -> Sight:
        """The map from a folded density to what the points of this spectrum hold on average."""
        return sight_of(self.bins, self.resolution, 0.5 / self.dt, window_of(self.window))

    def expected(self, model: NoiseModel) -> Array:
        """What a model would show here, shape (n,) [SI^2/Hz]: folded by sampling, seen through the window.

        Sinusoids and ramps add nothing: they have lines, and no density.
        """
        if len(self.bins) != len(self.frequency):  # a document of an earlier version
            return sampled_psd(model, self.frequency, self.dt, self.sampling)
        return self.sight(lambda f: sampled_psd(model, f, self.dt, self.sampling))

    def __repr__(self) -> str:
        span = f"{self.frequency[0]:.3g} to {self.frequency[-1]:.3g} Hz" if len(self.frequency) else "empty"
        corner = "" if self.corner is None else f", corner {self.corner:.3g} Hz"
        return f"<Spectrum {self.channel}: {span}, {len(self.lines)} lines{corner}>"

    def to_json(self) -> dict[str, Any]:
        """Plain data; `from_json` gives back an equal spectrum."""
        return {
            "channel": self.channel,
            **{name: getattr(self, name).tolist() for name in _ARRAYS},
            "bins": self.bins.tolist(),
            "lines": [_plain(line) for line in self.lines],
            "corner": self.corner,
            "band_limit": None if self.band_limit is None else asdict(self.band_limit),
            "shortest_trusted_tau": self.shortest_trusted_tau,
            "dt": self.dt,
            "n_samples": self.n_samples,
            "sampling": self.sampling,
            "segments": self.segments,
            "skipped": self.skipped,
            "method": self.method,
            "window": self.window,
            "overlap": self.overlap,
            "confidence": self.confidence,
            "bridged": asdict(self.bridged),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Spectrum:
        """Inverse of `to_json`."""
        given = {key: value for key, value in data.items() if key not in ("corner", "shortest_trusted_tau")}
        limit = data.get("band_limit")
        given["lines"] = tuple(_line(line) for line in data["lines"])
        given["band_limit"] = None if limit is None else BandLimit(**_numbers(limit))
        given["bridged"] = _bridged(data.get("bridged", {}))  # none in a document of an earlier version
        return cls(**given)


def _avar(f: Array, density: Array, m: Array, dt: float) -> Array:
    """Allan variance of a density: 4 * integral of S(f) [sin^2(pi f m Ts)/(m sin(pi f Ts))]^2 df over its bins."""
    if len(f) < 2:
        return np.zeros_like(m)
    width = np.diff(np.concatenate([[0.0], np.sqrt(f[1:] * f[:-1]), [0.5 / dt]]))
    turns, blur = np.outer(m, f * dt), np.outer(m, width * dt)  # sin^4 averaged over each bin
    fourth = (
        3 / 8
        - np.cos(2 * np.pi * turns) * np.sinc(blur) / 2
        + np.cos(4 * np.pi * turns) * np.sinc(2 * blur) / 8
    )
    shape = fourth / (m[:, None] * np.sin(np.pi * f * dt)) ** 2
    return np.asarray(4 * shape @ (density * width))


def _bridged(data: Mapping[str, Any]) -> Bridged:
    lacking = data.get("lacking", ())
    white = (lacking,) if isinstance(lacking, (int, float)) else lacking  # a number in an earlier version
    return Bridged(**{**data, "lacking": tuple(white), "errors": tuple(map(tuple, data.get("errors", ())))})


def _plain(line: SpectralLine) -> dict[str, Any]:
    """Inverse of `_line`."""
    return {
        key: None if value != value else value for key, value in asdict(line).items()
    }  # NaN alone is not itself


def _line(data: Mapping[str, Any]) -> SpectralLine:
    """A line out of plain data, where null stands for a number that does not exist."""
    return SpectralLine(**_numbers(data))


def _numbers(data: Mapping[str, Any]) -> dict[str, Any]:
    return {key: math.nan if value is None else value for key, value in data.items()}
