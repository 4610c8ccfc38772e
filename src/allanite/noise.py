# SPDX-License-Identifier: BSD-3-Clause
"""Noise terms and their sum.

One term is one class with every view of one process: ``psd(f)``, ``avar(tau)``, ``avar_sampled(m, dt, sampling)``,
``phase_covariance(t, dt, sampling)`` and ``state_space(dt)``. Models add with ``+``.

Conventions (whole package): rate in rad/s (acceleration in m/s^2, ...), two-sided density S(f) over frequency in Hz,

    AVAR(tau) = 4 * integral from 0 to infinity of S(f) sin^4(pi f tau) / (pi f tau)^2 df.

Coefficients carry the letters of IEEE Std 952: Q, N, B, K, R. Samples are interval means ("mean") or
instantaneous values ("point"); the two differ at small m.

References
----------
.. [1] IEEE Std 952-1997, annex C (terms and their Allan variance).
.. [2] N. F. Zhang, "Allan variance of time series models for measurement data", Metrologia 45 (2008) 549.
.. [3] C. Greenhall, W. Riley, "Uncertainty of stability variances based on finite differences", PTTI 2003.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError

__all__ = [
    "FLICKER_FLOOR",
    "GM_PEAK_DEVIATION",
    "GM_PEAK_TAU",
    "SIGMA_PER_B",
    "TERMS",
    "Estimate",
    "Flicker",
    "GaussMarkov",
    "NoiseModel",
    "Quantisation",
    "Ramp",
    "RandomWalk",
    "Sinusoid",
    "StateSpace",
    "Term",
    "White",
]

Array = NDArray[np.float64]

#: Floor of the Allan deviation of flicker noise over B: sqrt(2 ln 2 / pi).
FLICKER_FLOOR = 0.664282470267960019
#: tau of the maximum of a Gauss-Markov term's Allan deviation over its correlation time T.
GM_PEAK_TAU = 1.89261783292501877
#: Height of that maximum over the stationary standard deviation sigma.
GM_PEAK_DEVIATION = 0.617364283144241369
#: sigma of the Gauss-Markov term whose maximum equals the floor of a flicker term B, over B.
SIGMA_PER_B = FLICKER_FLOOR / GM_PEAK_DEVIATION


@dataclass(frozen=True, slots=True, kw_only=True)
class StateSpace:
    """Discrete linear model of point samples: s' = F s + w, y = h s + v.

    Attributes
    ----------
    transition : ndarray, shape (n, n)
        F over one sample interval.
    process : ndarray, shape (n, n)
        Covariance of w.
    output : ndarray, shape (n,)
        h.
    noise : float
        Variance of v.
    initial : ndarray, shape (n, n)
        Covariance of the first state; zero where the state starts at zero.
    """

    transition: Array
    process: Array
    output: Array
    noise: float
    initial: Array

    def __add__(self, other: StateSpace) -> StateSpace:
        return StateSpace(
            transition=_block_diagonal(self.transition, other.transition),
            process=_block_diagonal(self.process, other.process),
            output=np.concatenate([self.output, other.output]),
            noise=self.noise + other.noise,
            initial=_block_diagonal(self.initial, other.initial),
        )


def _block_diagonal(a: Array, b: Array) -> Array:
    out = np.zeros((len(a) + len(b),) * 2)
    out[: len(a), : len(a)] = a
    out[len(a) :, len(a) :] = b
    return out


def _states(transition: ArrayLike, process: ArrayLike, output: ArrayLike, initial: ArrayLike) -> StateSpace:
    square = [np.atleast_2d(np.asarray(x, dtype=np.float64)) for x in (transition, process, initial)]
    return StateSpace(
        transition=square[0],
        process=square[1],
        output=np.atleast_1d(np.asarray(output, dtype=np.float64)),
        noise=0.0,
        initial=square[2],
    )


def _stateless(noise: float) -> StateSpace:
    none = np.zeros((0, 0))
    return StateSpace(transition=none, process=none, output=np.zeros(0), noise=noise, initial=none)


@runtime_checkable
class Term(Protocol):
    """What every noise term answers."""

    type: ClassVar[str]
    symbols: ClassVar[tuple[str, ...]]

    def psd(self, f: ArrayLike) -> Array:
        """Two-sided density at f [Hz], in unit^2/Hz."""
        ...

    def avar(self, tau: ArrayLike) -> Array:
        """Allan variance at tau [s] of the continuous process, which interval means share at every m."""
        ...

    def avar_sampled(self, m: ArrayLike, dt: float, sampling: str) -> Array:
        """Exact Allan variance of samples at interval dt [s], averaged over m of them."""
        ...

    def phase_covariance(self, t: Array, dt: float, sampling: str) -> Array:
        """Generalised autocovariance of the phase (running sum of samples) at a distance of t samples.

        Defined up to a polynomial of degree three in t, which no second difference sees.
        """
        ...

    def state_space(self, dt: float) -> StateSpace:
        """Exact discrete model of point samples at interval dt [s]."""
        ...


def _positive(term: Any, *names: str) -> None:
    for name in names:
        value = getattr(term, name)
        if not (isinstance(value, (int, float, np.floating, np.integer)) and math.isfinite(value) and value >= 0):
            raise InputError(f"{type(term).__name__}: {name} must be finite and not negative, not {value!r}")
        object.__setattr__(term, name, float(value))


def _tau(tau: ArrayLike) -> Array:
    return np.asarray(tau, dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantisation:
    """Angle quantisation: S(f) = (2 pi f)^2 Q^2 Ts at low f, AVAR = 3 Q^2/tau^2 [1, C.1.1].

    Attributes
    ----------
    Q : float [rad]
        Standard deviation of the white angle error; LSB/sqrt(12) for a well dithered quantiser.
    dt : float [s]
        Sample interval, which the density (not the Allan variance) depends on.
    """

    Q: float
    dt: float = 1.0
    type: ClassVar[str] = "quantisation"
    symbols: ClassVar[tuple[str, ...]] = ("Q",)

    def __post_init__(self) -> None:
        _positive(self, "Q", "dt")

    def psd(self, f: ArrayLike) -> Array:
        return (2 * np.sin(np.pi * _tau(f) * self.dt) * self.Q) ** 2 / self.dt

    def avar(self, tau: ArrayLike) -> Array:
        return 3 * self.Q**2 / _tau(tau) ** 2

    def avar_sampled(self, m: ArrayLike, dt: float, sampling: str) -> Array:
        return self.avar(_tau(m) * dt)

    def phase_covariance(self, t: Array, dt: float, sampling: str) -> Array:
        return np.where(np.asarray(t) == 0, (self.Q / dt) ** 2, 0.0)

    def state_space(self, dt: float) -> StateSpace:
        variance = (self.Q / dt) ** 2
        both = np.diag([variance, variance])
        return _states([[0, 0], [1, 0]], np.diag([variance, 0]), [1, -1], both)


@dataclass(frozen=True, slots=True, kw_only=True)
class White:
    """White rate noise (angle random walk): S = N^2, AVAR = N^2/tau [1, C.1.2].

    Attributes
    ----------
    N : float [rad/s/sqrt(Hz) = rad/sqrt(s)]
    """

    N: float
    type: ClassVar[str] = "white"
    symbols: ClassVar[tuple[str, ...]] = ("N",)

    def __post_init__(self) -> None:
        _positive(self, "N")

    def psd(self, f: ArrayLike) -> Array:
        return np.full_like(_tau(f), self.N**2)

    def avar(self, tau: ArrayLike) -> Array:
        return self.N**2 / _tau(tau)

    def avar_sampled(self, m: ArrayLike, dt: float, sampling: str) -> Array:
        return self.avar(_tau(m) * dt)

    def phase_covariance(self, t: Array, dt: float, sampling: str) -> Array:
        return -self.N**2 / dt / 2 * np.abs(t)

    def state_space(self, dt: float) -> StateSpace:
        return _stateless(self.N**2 / dt)


@dataclass(frozen=True, slots=True, kw_only=True)
class Flicker:
    """Flicker rate noise (bias instability): S = B^2/(2 pi f), AVAR = (2 ln 2/pi) B^2 [1, C.1.3].

    The instantaneous value of 1/f noise has no variance, so the term is taken as interval means under both
    sampling conventions.

    Attributes
    ----------
    B : float [rad/s]
        The IEEE 952 coefficient: floor of the Allan deviation over 0.664.
    """

    B: float
    type: ClassVar[str] = "flicker"
    symbols: ClassVar[tuple[str, ...]] = ("B",)

    def __post_init__(self) -> None:
        _positive(self, "B")

    def psd(self, f: ArrayLike) -> Array:
        return self.B**2 / (2 * np.pi * np.abs(_tau(f)))

    def avar(self, tau: ArrayLike) -> Array:
        return np.full_like(_tau(tau), (FLICKER_FLOOR * self.B) ** 2)

    def avar_sampled(self, m: ArrayLike, dt: float, sampling: str) -> Array:
        return self.avar(_tau(m) * dt)

    def phase_covariance(self, t: Array, dt: float, sampling: str) -> Array:
        size = np.abs(t)
        return self.B**2 / (2 * np.pi) * size**2 * np.log(np.where(size == 0, 1.0, size))

    def gauss_markov_sum(self, shortest: float, longest: float, ratio: float = math.sqrt(10)) -> tuple[GaussMarkov, ...]:
        """Gauss-Markov terms, correlation times a ratio apart, whose sum is 1/f over a band.

        Parameters
        ----------
        shortest, longest : float [s]
            Ends of the span of correlation times; [Ts/30, 30 x record] keeps the Allan variance of interval
            means within 1 % of the floor at every m.
        ratio : float
            sqrt(10): density +-0.08 %, Allan variance +-0.01 %. 10: +-5.5 %, +-2 %.
        """
        count = math.ceil(math.log(longest / shortest) / math.log(ratio)) + 1
        sigma = self.B * math.sqrt(math.log(ratio) / math.pi)
        times = shortest * ratio ** np.arange(count)
        return tuple(GaussMarkov.from_sigma(sigma, float(t)) for t in times)

    def state_space(self, dt: float, record: float | None = None, ratio: float = 10.0) -> StateSpace:
        """Sum of Gauss-Markov states from Ts to the record's length (default: 1e7 Ts)."""
        longest = 1e7 * dt if record is None else record
        parts = [term.state_space(dt) for term in self.gauss_markov_sum(dt, 3 * longest, ratio)]
        total = parts[0]
        for part in parts[1:]:
            total = total + part
        return total


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomWalk:
    """Rate random walk: S = (K/(2 pi f))^2, AVAR = K^2 tau/3 [1, C.1.4].

    Attributes
    ----------
    K : float [rad/s^2/sqrt(Hz) = rad/s/sqrt(s)]
    """

    K: float
    type: ClassVar[str] = "random_walk"
    symbols: ClassVar[tuple[str, ...]] = ("K",)

    def __post_init__(self) -> None:
        _positive(self, "K")

    def psd(self, f: ArrayLike) -> Array:
        return (self.K / (2 * np.pi * _tau(f))) ** 2

    def avar(self, tau: ArrayLike) -> Array:
        return self.K**2 * _tau(tau) / 3

    def avar_sampled(self, m: ArrayLike, dt: float, sampling: str) -> Array:
        m = _tau(m)
        if sampling == "mean":
            return self.avar(m * dt)
        return self.K**2 * dt * (2 * m**2 + 1) / (6 * m)

    def phase_covariance(self, t: Array, dt: float, sampling: str) -> Array:
        size = np.abs(t)
        cube = size**3 if sampling == "mean" else size**3 - size
        return self.K**2 * dt / 12 * cube

    def state_space(self, dt: float) -> StateSpace:
        return _states(1.0, self.K**2 * dt, 1.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ramp:
    """Rate ramp: AVAR = R^2 tau^2/2 [1, C.1.5]. Deterministic, so it has no density.

    Attributes
    ----------
    R : float [rad/s^2]
    """

    R: float
    type: ClassVar[str] = "ramp"
    symbols: ClassVar[tuple[str, ...]] = ("R",)

    def __post_init__(self) -> None:
        _positive(self, "R")

    def psd(self, f: ArrayLike) -> Array:
        return np.zeros_like(_tau(f))

    def avar(self, tau: ArrayLike) -> Array:
        return self.R**2 * _tau(tau) ** 2 / 2

    def avar_sampled(self, m: ArrayLike, dt: float, sampling: str) -> Array:
        return self.avar(_tau(m) * dt)

    def phase_covariance(self, t: Array, dt: float, sampling: str) -> Array:
        return np.zeros_like(np.asarray(t, dtype=np.float64))

    def state_space(self, dt: float) -> StateSpace:
        none = np.zeros((2, 2))
        return _states([[1, dt], [0, 1]], none, [1, 0], np.diag([0.0, self.R**2]))


@dataclass(frozen=True, slots=True, kw_only=True)
class GaussMarkov:
    """First-order Gauss-Markov rate noise: S = (qT)^2/(1 + (2 pi f T)^2) [1, C.1.6].

    Its Allan deviation peaks at 1.8926 T with 0.6174 sigma.

    Attributes
    ----------
    q : float [rad/s^2/sqrt(Hz)]
        Root density of the driving noise.
    T : float [s]
        Correlation time.
    """

    q: float
    T: float
    type: ClassVar[str] = "gauss_markov"
    symbols: ClassVar[tuple[str, ...]] = ("q", "T")

    def __post_init__(self) -> None:
        _positive(self, "q", "T")
        if self.T == 0:
            raise InputError("GaussMarkov: the correlation time T must be positive")

    @classmethod
    def from_sigma(cls, sigma: float, T: float) -> GaussMarkov:
        """The term with stationary standard deviation sigma [rad/s] and correlation time T [s]."""
        return cls(q=sigma * math.sqrt(2 / T), T=T)

    @property
    def sigma(self) -> float:
        """Stationary standard deviation [rad/s]: q sqrt(T/2)."""
        return self.q * math.sqrt(self.T / 2)

    @property
    def B_equiv(self) -> float:
        """B of the flicker term whose floor is this term's maximum [rad/s]: sigma/1.0760."""
        return self.sigma / SIGMA_PER_B

    def psd(self, f: ArrayLike) -> Array:
        return (self.q * self.T) ** 2 / (1 + (2 * np.pi * _tau(f) * self.T) ** 2)

    def avar(self, tau: ArrayLike) -> Array:
        return self.q**2 * self.T * gauss_markov_shape(_tau(tau) / self.T)

    def avar_sampled(self, m: ArrayLike, dt: float, sampling: str) -> Array:
        """Means: the continuous form. Points: the AR(1) form of [2], written as a sum of positive terms."""
        m = _tau(m)
        if sampling == "mean":
            return self.avar(m * dt)
        a = dt / self.T
        x = m * a
        if a > 300:  # exp(-a) is nothing: white samples
            return self.sigma**2 / m
        top = 2 * m * _sinh_minus(a) + 2 * x**2 * gauss_markov_shape(x)
        return self.sigma**2 * top / (4 * m**2 * math.sinh(a / 2) ** 2)

    def phase_covariance(self, t: Array, dt: float, sampling: str) -> Array:
        """S(t) of numbers [3], less the even polynomial 1 + u^2/2 (u = a|t|, a = dt/T) that would cancel.

        Points: -sigma^2 [e^-u/(4 sinh^2(a/2)) + |t| coth(a/2)/2]; means: -(sigma/a)^2 (e^-u + u).
        """
        a = dt / self.T
        size = np.abs(t)
        if a > 300:  # exp(-a) is nothing: white samples, or white means of a process whiter still
            white = self.sigma**2 if sampling == "point" else 2 * (self.sigma / a) ** 2 * (a - 1)
            return -white / 2 * size
        if sampling == "mean":
            return -((self.sigma / a) ** 2) * _exp_rest(a * size)
        slope = a / 6 - a**3 / 180 + a**5 / 5040
        half = math.sinh(a / 2)
        if a > 0.1:
            slope = 1 / (2 * math.tanh(a / 2)) - a / (4 * half**2)
        return -(self.sigma**2) * (_exp_rest(a * size) / (4 * half**2) + slope * size)

    def state_space(self, dt: float) -> StateSpace:
        phi = math.exp(-dt / self.T)
        return _states(phi, -(self.sigma**2) * math.expm1(-2 * dt / self.T), 1.0, self.sigma**2)


def gauss_markov_shape(x: ArrayLike) -> Array:
    """V(x) = AVAR/(q^2 T) of a Gauss-Markov term at x = tau/T.

    Notes
    -----
    V(x) = (1/x) [1 - (3 - 4 e^-x + e^-2x)/(2x)] loses all digits below x = 1e-5, so the series
    (x/3) sum c_n x^(n-3), c_n = -3 (-1)^n (2^n - 4)/(2 n!), serves below 0.5: relative error < 5e-15.
    """
    x = np.asarray(x, dtype=np.float64)
    small = x < 0.5
    safe = np.where(small, 1.0, x)
    plain = (1 - (3 - 4 * np.exp(-safe) + np.exp(-2 * safe)) / (2 * safe)) / safe
    s = np.where(small, x, 0.0)
    return np.where(small, s / 3 * np.polynomial.polynomial.polyval(s, _SHAPE_SERIES), plain)


_SHAPE_SERIES = np.array([-3 * (-1) ** n * (2**n - 4) / (2 * math.factorial(n)) for n in range(3, 20)])
_EXP_SERIES = np.array([(-1) ** n / math.factorial(n) for n in range(3, 20)])


def _exp_rest(u: Array) -> Array:
    """e^-u - 1 + u - u^2/2 without cancellation: a series below u = 0.5."""
    u = np.asarray(u, dtype=np.float64)
    small = u < 0.5
    s = np.where(small, u, 0.0)
    return np.where(small, s**3 * np.polynomial.polynomial.polyval(s, _EXP_SERIES), np.exp(-u) - 1 + u - u**2 / 2)


def _sinh_minus(a: float) -> float:
    """sinh(a) - a without cancellation."""
    if a < 0.5:
        return float(sum(a ** (2 * n + 1) / math.factorial(2 * n + 1) for n in range(1, 10)))
    return math.sinh(a) - a


@dataclass(frozen=True, slots=True, kw_only=True)
class Sinusoid:
    """A line A sin(2 pi f0 t + phase): AVAR = A^2 [sin^2(pi f0 tau)/(pi f0 tau)]^2 [1, C.1.7].

    Deterministic; it has lines instead of a density, so `psd` is zero.

    Attributes
    ----------
    amplitude : float [rad/s]
    frequency : float [Hz]
    phase : float [rad]
        At the first sample instant.
    """

    amplitude: float
    frequency: float
    phase: float = 0.0
    type: ClassVar[str] = "sinusoid"
    symbols: ClassVar[tuple[str, ...]] = ("amplitude", "frequency")

    def __post_init__(self) -> None:
        _positive(self, "amplitude", "frequency")
        if self.frequency == 0:
            raise InputError("Sinusoid: the frequency must be positive")

    def psd(self, f: ArrayLike) -> Array:
        return np.zeros_like(_tau(f))

    def avar(self, tau: ArrayLike) -> Array:
        x = np.pi * self.frequency * _tau(tau)
        return self.amplitude**2 * (np.sin(x) ** 2 / x) ** 2

    def avar_sampled(self, m: ArrayLike, dt: float, sampling: str) -> Array:
        m = _tau(m)
        if sampling == "mean":
            return self.avar(m * dt)
        x = np.pi * self.frequency * dt
        return self.amplitude**2 * (np.sin(m * x) ** 2 / (m * np.sin(x))) ** 2

    def phase_covariance(self, t: Array, dt: float, sampling: str) -> Array:
        """That of a sinusoid of random phase."""
        x = np.pi * self.frequency * dt
        shape = math.sin(x) if sampling == "point" else x
        return self.amplitude**2 / (8 * shape**2) * np.cos(2 * x * np.asarray(t))

    def state_space(self, dt: float) -> StateSpace:
        angle = 2 * math.pi * self.frequency * dt
        c, s = math.cos(angle), math.sin(angle)
        return _states([[c, s], [-s, c]], np.zeros((2, 2)), [1, 0], np.eye(2) * self.amplitude**2 / 2)


TermType = Quantisation | White | Flicker | RandomWalk | Ramp | GaussMarkov | Sinusoid
#: Registry: tests run over it, and JSON names its types.
TERMS: Mapping[str, type[TermType]] = {
    t.type: t for t in (Quantisation, White, Flicker, RandomWalk, Ramp, GaussMarkov, Sinusoid)
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """One parameter with its set of values that the record does not contradict.

    Attributes
    ----------
    symbol : str
        Q, N, B, K, R, q, T, sigma or B_equiv.
    value : float or None
        Point estimate in SI; None when only a limit is known.
    lower, upper : float
        Ends of the confidence set; lower is 0 (T: also 0) and upper may be infinite.
    supported : bool
        The set excludes zero (T: the set is bounded on both sides).
    note : str
        What a reader must know besides.
    """

    symbol: str
    value: float | None
    lower: float
    upper: float
    supported: bool
    note: str = ""

    def to_json(self) -> dict[str, Any]:
        """Plain data; infinity is written as null."""
        return {**asdict(self), "upper": self.upper if math.isfinite(self.upper) else None}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Estimate:
        """Inverse of `to_json`."""
        return cls(**{**data, "upper": math.inf if data["upper"] is None else data["upper"]})


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseModel:
    """A sum of independent noise terms; when it was fitted, with the uncertainty of its parameters.

    Attributes
    ----------
    terms : tuple of Term
    family : str
        "flicker" or "gauss-markov" for a fitted model: what stands in the place of the bias instability.
    estimates : tuple of Estimate
        Every parameter of the candidate family, supported or not.
    confidence : float
        Level of the sets in `estimates`.
    covariance : dict
        {"symbols": [...], "matrix": [[...]]} of the natural logarithms of the supported parameters.
    goodness : dict
        {"chi2", "dof", "p"}: does the model explain the curve?
    verdict : str
        One sentence.
    alternative : NoiseModel or None
        The other family, when the record cannot decide.
    kind, unit : str
        Kind of the channel, and its own unit where it has no SI unit.
    """

    terms: tuple[TermType, ...]
    family: str = ""
    estimates: tuple[Estimate, ...] = ()
    confidence: float = 0.95
    covariance: Mapping[str, Any] = field(default_factory=dict, repr=False)
    goodness: Mapping[str, Any] = field(default_factory=dict)
    verdict: str = ""
    alternative: NoiseModel | None = field(default=None, repr=False)
    kind: str = "rate"
    unit: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "terms", tuple(self.terms))
        for term in self.terms:
            if not isinstance(term, Term):
                raise InputError(f"a noise model is a sum of terms ({', '.join(TERMS)}), not of {term!r}")

    @classmethod
    def of(cls, *terms: TermType, kind: str = "rate") -> NoiseModel:
        """The sum of these terms."""
        return cls(terms=terms, kind=kind)

    def __add__(self, other: NoiseModel | TermType) -> NoiseModel:
        terms = other.terms if isinstance(other, NoiseModel) else (other,)
        return NoiseModel(terms=self.terms + terms, kind=self.kind, unit=self.unit)

    def psd(self, f: ArrayLike) -> Array:
        """Two-sided density at f [Hz], in SI^2/Hz."""
        return _sum(f, (term.psd(f) for term in self.terms))

    def avar(self, tau: ArrayLike) -> Array:
        """Allan variance at tau [s] (continuous process = interval means), in SI^2."""
        return _sum(tau, (term.avar(tau) for term in self.terms))

    def adev(self, tau: ArrayLike) -> Array:
        """Allan deviation at tau [s]."""
        return np.sqrt(self.avar(tau))

    def avar_sampled(self, m: ArrayLike, dt: float, sampling: str = "mean") -> Array:
        """Exact Allan variance of samples at interval dt [s] averaged over m of them."""
        return _sum(m, (term.avar_sampled(m, dt, sampling) for term in self.terms))

    def state_space(self, dt: float) -> StateSpace:
        """Exact discrete model of point samples at interval dt [s]."""
        total = _stateless(0.0)
        for term in self.terms:
            total = total + term.state_space(dt)
        return total

    def term(self, type_: str) -> TermType | None:
        """The first term of a type ("white", "flicker", ...), or None."""
        return next((t for t in self.terms if t.type == type_), None)

    def estimate(self, symbol: str) -> Estimate | None:
        """The estimate of a parameter, or None."""
        return next((e for e in self.estimates if e.symbol == symbol), None)

    def to_json(self) -> dict[str, Any]:
        """Plain data; `from_json` gives back an equal model."""
        return {
            "family": self.family,
            "kind": self.kind,
            "unit": self.unit,
            "verdict": self.verdict,
            "confidence": self.confidence,
            "terms": [{"type": t.type, **{f.name: getattr(t, f.name) for f in fields(t)}} for t in self.terms],
            "estimates": [e.to_json() for e in self.estimates],
            "covariance": dict(self.covariance),
            "goodness": dict(self.goodness),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> NoiseModel:
        """Inverse of `to_json`.

        Raises
        ------
        InputError
            An unknown term, or a missing or superfluous coefficient.
        """
        try:
            terms = tuple(_term_from_json(t) for t in data["terms"])
        except (KeyError, TypeError) as error:
            raise InputError(f"not a noise model: {error}; expected {{'terms': [{{'type': 'white', 'N': ...}}]}}") from None
        known = {f.name for f in fields(cls)} - {"terms", "estimates", "alternative"}
        rest = {k: v for k, v in data.items() if k in known}
        return cls(terms=terms, estimates=tuple(Estimate.from_json(e) for e in data.get("estimates", ())), **rest)

    def __str__(self) -> str:
        parts = (" ".join(f"{s}={getattr(t, s):.4g}" for s in t.symbols) for t in self.terms)
        return f"NoiseModel({'; '.join(parts)})"


def _sum(x: ArrayLike, parts: Iterable[Array]) -> Array:
    total = np.zeros_like(np.asarray(x, dtype=np.float64))
    for part in parts:
        total = total + part
    return total


def _term_from_json(data: Mapping[str, Any]) -> TermType:
    kind = TERMS.get(data["type"])
    if kind is None:
        raise InputError(f"unknown noise term {data['type']!r}; there are: {', '.join(TERMS)}")
    return kind(**{k: v for k, v in data.items() if k != "type"})
