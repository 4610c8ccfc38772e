# SPDX-License-Identifier: BSD-3-Clause
"""The seven noise terms. One term is one class with every view of one process.

References
----------
.. [1] IEEE Std 952-1997, annex C (terms and their Allan variance).
.. [2] N. F. Zhang, "Allan variance of time series models for measurement data", Metrologia 45 (2008) 549.
.. [3] C. Greenhall, W. Riley, "Uncertainty of stability variances based on finite differences", PTTI 2003.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise.markov import MarkovForm, MarkovState, gauss_markov_form, random_walk_form
from allanite.noise.state_space import StateSpace, states

__all__ = [
    "BY_LETTER",
    "FLICKER_FLOOR",
    "GM_PEAK_DEVIATION",
    "GM_PEAK_TAU",
    "SIGMA_PER_B",
    "TERMS",
    "Flicker",
    "GaussMarkov",
    "Quantisation",
    "Ramp",
    "RandomWalk",
    "Sinusoid",
    "Term",
    "TermType",
    "White",
    "gauss_markov_shape",
    "sinh_minus",
    "term_of",
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
#: Beyond this a = Ts/T a state forgets within a sample: exp(-a) < 5e-5.
FORGETFUL = 10.0
#: A state with T beyond so many records is a random walk to the record: 0.1 % of the flicker floor at its end.
SLOW_RECORDS = 5.0


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


def _positive(term: Any, *names: str) -> None:
    for name in names:
        value = getattr(term, name)
        if not (
            isinstance(value, (int, float, np.floating, np.integer)) and math.isfinite(value) and value >= 0
        ):
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
        if self.dt == 0:
            raise InputError("Quantisation: the sample interval dt must be positive")

    def psd(self, f: ArrayLike) -> Array:
        return (2 * np.sin(np.pi * _tau(f) * self.dt) * self.Q) ** 2 / self.dt

    def avar(self, tau: ArrayLike) -> Array:
        return 3 * self.Q**2 / _tau(tau) ** 2

    def avar_sampled(self, m: ArrayLike, dt: float, sampling: str) -> Array:
        return self.avar(_tau(m) * dt)

    def phase_covariance(self, t: Array, dt: float, sampling: str) -> Array:
        return np.where(np.asarray(t) == 0, (self.Q / dt) ** 2, 0.0)

    def markov(self, dt: float, *, sampling: str, record: float, ratio: float) -> MarkovForm:
        """The difference of white angle errors."""
        state = MarkovState(
            phi=0.0, step=self.Q, start=self.Q, now=-1 / dt, later=1 / dt, label=self.type, rate=0.0
        )
        return MarkovForm(states=(state,))


@dataclass(frozen=True, slots=True, kw_only=True)
class White:
    """White rate noise (angle random walk): S = N^2, AVAR = N^2/tau [1, C.1.2].

    Attributes
    ----------
    N : float [rad/s/sqrt(Hz) = rad/sqrt(s)]
        Angle (or velocity) random walk.
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
        return -(self.N**2) / dt / 2 * np.abs(t)

    def markov(self, dt: float, *, sampling: str, record: float, ratio: float) -> MarkovForm:
        """White noise has no state."""
        return MarkovForm(white=self.N**2 / dt)


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

    def gauss_markov_sum(
        self, shortest: float, longest: float, ratio: float = math.sqrt(10)
    ) -> tuple[GaussMarkov, ...]:
        """Gauss-Markov terms, correlation times a ratio apart, whose sum is 1/f over a band.

        Parameters
        ----------
        shortest, longest : float [s]
            Ends of the span of correlation times; [Ts/30, 30 x record] keeps the Allan variance of interval
            means within 1 % of the floor at every m.
        ratio : float
            sqrt(10): density +-0.08 %, Allan variance +-0.01 %. 10: +-5.5 %, +-2 %.
        """
        if not (0 < shortest <= longest < math.inf and ratio > 1):
            raise InputError(
                f"no correlation times from {shortest!r} to {longest!r} s, a ratio {ratio!r} apart"
            )
        count = math.ceil(math.log(longest / shortest) / math.log(ratio)) + 1
        sigma = self.B * math.sqrt(math.log(ratio) / math.pi)
        times = shortest * ratio ** np.arange(count)
        return tuple(GaussMarkov.from_sigma(sigma, float(t)) for t in times)

    def markov(self, dt: float, *, sampling: str, record: float, ratio: float) -> MarkovForm:
        """A sum of Gauss-Markov states over the band of a record [s].

        States that forget everything within one sample share one state; states slower than the record share one
        random walk. With ratio sqrt(10) the Allan variance of interval means is within 0.01 % of the floor for m to
        a tenth of the record, and within 0.5 % at the last, half of it; with ratio 10 it is within 2 %.
        """
        longest = SLOW_RECORDS * max(record, dt)
        # correlation times lie half a step on both sides of the longest: the variance below it, which is that of the
        # level of a record, does not jump with the number of samples
        steps = math.ceil(math.log(longest / dt * FORGETFUL**10) / math.log(ratio))
        parts = self.gauss_markov_sum(longest * ratio ** (0.5 - steps), longest * FORGETFUL**10, ratio)
        middle = [g for g in parts if dt / FORGETFUL < g.T <= longest]
        fast = [
            gauss_markov_form(g.sigma, g.T, dt, "mean", self.type) for g in parts if dt / FORGETFUL >= g.T
        ]
        shared = math.sqrt(sum((p.states[0].now * p.states[0].start) ** 2 for p in fast))
        ends = MarkovState(phi=0.0, step=shared, start=shared, now=1.0, later=1.0, label=self.type, rate=0.0)
        slow = random_walk_form(math.sqrt(sum(g.q**2 for g in parts if longest < g.T)), dt, "mean", self.type)
        quick = MarkovForm(states=(ends,), white=sum(p.white for p in fast))
        forms = (gauss_markov_form(g.sigma, g.T, dt, "mean", self.type) for g in middle)
        return sum(forms, start=quick + slow)


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomWalk:
    """Rate random walk: S = (K/(2 pi f))^2, AVAR = K^2 tau/3 [1, C.1.4].

    Attributes
    ----------
    K : float [rad/s^2/sqrt(Hz) = rad/s/sqrt(s)]
        Rate random walk.
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

    def markov(self, dt: float, *, sampling: str, record: float, ratio: float) -> MarkovForm:
        """One state, which starts at zero."""
        return random_walk_form(self.K, dt, sampling, self.type)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ramp:
    """Rate ramp: AVAR = R^2 tau^2/2 [1, C.1.5]. Deterministic, so it has no density.

    Attributes
    ----------
    R : float [rad/s^2]
        Rate ramp.
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

    def steady_space(self, dt: float, *, sampling: str) -> StateSpace:
        """The ramp and its slope; of the slope only the size is known."""
        first = dt / 2 if sampling == "mean" else 0.0  # the mean over an interval is the value at its middle
        initial = self.R**2 * np.array([[first**2, first], [first, 1.0]])
        return states([[1.0, dt], [0.0, 1.0]], np.zeros((2, 2)), [1, 0], initial, label=self.type)


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
        if not T > 0:
            raise InputError(f"GaussMarkov: the correlation time T must be positive, not {T!r}")
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
        top = 2 * m * sinh_minus(a) + 2 * x**2 * gauss_markov_shape(x)
        return self.sigma**2 * top / (4 * m**2 * math.sinh(a / 2) ** 2)

    def phase_covariance(self, t: Array, dt: float, sampling: str) -> Array:
        """S(t) of numbers [3], less the even polynomial ``1 + u^2/2`` (``u = a|t|, a = dt/T``) that would cancel.

        Points: ``-sigma^2 [e^-u/(4 sinh^2(a/2)) + |t| coth(a/2)/2]``; means: ``-(sigma/a)^2 (e^-u + u)``.
        """
        parts, size = self.phase_parts(dt, sampling), np.abs(t)
        rest = parts["exponential"] * _exp_rest(parts["rate"] * size) if parts["exponential"] else 0.0
        return np.asarray(rest + parts["linear"] * size)

    def phase_parts(self, dt: float, sampling: str) -> dict[str, float]:
        """The same as coefficients: ``linear |t| + exponential (e^-u + u)``, ``u = rate |t|``, less a constant."""
        a = dt / self.T
        if sampling == "mean":
            return {"linear": 0.0, "exponential": -((self.sigma / a) ** 2), "rate": a}
        if a > 300:  # exp(-a) is nothing: white samples
            return {"linear": -(self.sigma**2) / 2, "exponential": 0.0, "rate": a}
        slope = a / 6 - a**3 / 180 + a**5 / 5040
        half = math.sinh(a / 2)
        if a > 0.1:
            slope = 1 / (2 * math.tanh(a / 2)) - a / (4 * half**2)
        return {
            "linear": -(self.sigma**2) * slope,
            "exponential": -(self.sigma**2) / (4 * half**2),
            "rate": a,
        }

    def markov(self, dt: float, *, sampling: str, record: float, ratio: float) -> MarkovForm:
        """One stationary state."""
        return gauss_markov_form(self.sigma, self.T, dt, sampling, self.type)


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
    return np.asarray(np.where(small, s / 3 * np.polynomial.polynomial.polyval(s, _SHAPE_SERIES), plain))


_SHAPE_SERIES = np.array([-3 * (-1) ** n * (2**n - 4) / (2 * math.factorial(n)) for n in range(3, 20)])
_EXP_SERIES = np.array([(-1) ** n / math.factorial(n) for n in range(3, 16)])  # to 4e-17 at u = 0.5


def _exp_rest(u: Array) -> Array:
    """e^-u - 1 + u - u^2/2 without cancellation: a series below u = 0.5."""
    u = np.asarray(u, dtype=np.float64)
    rest = np.asarray(np.exp(-u) - 1 + u - u**2 / 2)
    small = u < 0.5
    s = u[small]
    series = np.full_like(s, _EXP_SERIES[-1])
    for coefficient in _EXP_SERIES[-2::-1]:  # Horner, in place: this is the inner loop of a covariance
        series *= s
        series += coefficient
    rest[small] = s**3 * series
    return rest


def sinh_minus(a: float) -> float:
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
        Amplitude of the sinusoid, before a sample averages it over its interval.
    frequency : float [Hz]
        Frequency of the sinusoid.
    phase : float [rad]
        Phase at the first sample instant.
    """

    amplitude: float
    frequency: float
    phase: float = 0.0
    type: ClassVar[str] = "sinusoid"
    symbols: ClassVar[tuple[str, ...]] = ("amplitude", "frequency")

    def __post_init__(self) -> None:
        _positive(self, "amplitude", "frequency")
        if self.frequency == 0 or not math.isfinite(self.phase):
            raise InputError("Sinusoid: the frequency must be positive and the phase finite")

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
        return np.asarray(self.amplitude**2 * (np.sin(m * x) ** 2 / (m * np.sin(x))) ** 2)

    def phase_covariance(self, t: Array, dt: float, sampling: str) -> Array:
        """That of a sinusoid of random phase."""
        x = np.pi * self.frequency * dt
        shape = math.sin(x) if sampling == "point" else x
        return self.amplitude**2 / (8 * shape**2) * np.cos(2 * x * np.asarray(t))

    def steady_space(self, dt: float, *, sampling: str) -> StateSpace:
        """Two states that turn at the frequency; the phase is not known."""
        angle = 2 * math.pi * self.frequency * dt
        c, s = math.cos(angle), math.sin(angle)
        size = self.amplitude * (float(np.sinc(self.frequency * dt)) if sampling == "mean" else 1.0)
        initial = np.eye(2) * size**2 / 2
        return states([[c, s], [-s, c]], np.zeros((2, 2)), [1, 0], initial, label=self.type)


TermType = Quantisation | White | Flicker | RandomWalk | Ramp | GaussMarkov | Sinusoid
#: Registry: tests run over it, and JSON names its types.
TERMS: Mapping[str, type[TermType]] = {
    t.type: t for t in (Quantisation, White, Flicker, RandomWalk, Ramp, GaussMarkov, Sinusoid)
}


#: Terms with one coefficient, by its IEEE letter.
BY_LETTER: Mapping[str, type[TermType]] = {
    "Q": Quantisation,
    "N": White,
    "B": Flicker,
    "K": RandomWalk,
    "R": Ramp,
}


def term_of(letter: str, value: float, *, dt: float) -> TermType:
    """The term with one IEEE letter and this coefficient (SI). `dt` is the sample interval [s], which Q needs.

    Raises
    ------
    InputError
        Another letter than Q, N, B, K or R.
    """
    if letter not in BY_LETTER:
        raise InputError(f"no noise term has the letter {letter!r}; there are {', '.join(BY_LETTER)}")
    return BY_LETTER[letter](**{letter: value}, **({"dt": dt} if letter == "Q" else {}))
