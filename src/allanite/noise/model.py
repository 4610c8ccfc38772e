# SPDX-License-Identifier: BSD-3-Clause
"""A sum of noise terms, and what a fit knows of their parameters."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, field, fields, replace
from functools import lru_cache
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise.datasheet import DatasheetEntries, SensorSheet, sensor_sheet
from allanite.noise.inflation import Inflation
from allanite.noise.markov import MarkovForm
from allanite.noise.motion import MotionInflation
from allanite.noise.state_space import StateSpace, stateless
from allanite.noise.terms import TERMS, Ramp, Sinusoid, Term, TermType
from allanite.quantities.display_units import si_unit
from allanite.quantities.quantity import QuantityStatus
from allanite.quantities.tabular import Columns, Tabular
from allanite.recording.records import RATE_OF

__all__ = ["Estimate", "NoiseModel"]

Array = NDArray[np.float64]

_TERM_TYPES = frozenset(TERMS.values())


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
        Remark on the estimate.
    statistical : (float, float) or None
        Ends of the set without the uncertainty of the scale factor; None if `lower` and `upper` do not include it.
    """

    symbol: str
    value: float | None
    lower: float
    upper: float
    supported: bool
    note: str = ""
    statistical: tuple[float, float] | None = None

    @property
    def status(self) -> QuantityStatus:
        """What the record says of the parameter."""
        if self.supported:
            return QuantityStatus.RESOLVED
        limited = math.isfinite(self.upper)
        return QuantityStatus.UPPER_LIMIT if limited else QuantityStatus.NOT_RESOLVED

    @property
    def needed(self) -> bool:
        """True for a limit of a term that the model has all the same: it needs this term or one like it."""
        return self.note.endswith("or one like it")

    def to_json(self) -> dict[str, Any]:
        """Plain data; infinity is written as null."""
        data = {**asdict(self), "upper": _finite(self.upper)}
        ends = data.pop("statistical")
        return data if ends is None else {**data, "statistical": [ends[0], _finite(ends[1])]}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Estimate:
        """Inverse of `to_json`.

        Raises
        ------
        TypeError
            A number that is none, or another form.
        """
        ends = data.get("statistical")
        numbers = (data.get("value"), data.get("lower"), data["upper"], *(() if ends is None else ends))
        if any(isinstance(n, bool) or not isinstance(n, (int, float, type(None))) for n in numbers):
            raise TypeError(f"an estimate holds numbers, not {numbers!r:.60}")
        if not isinstance(data["symbol"], str) or not isinstance(data["supported"], bool):
            raise TypeError(f"an estimate has a symbol, and is supported or not: {dict(data)!r:.60}")
        return cls(
            **{
                **data,
                "upper": _limit(data["upper"]),
                "statistical": None if ends is None else (ends[0], _limit(ends[1])),
            }
        )


def _finite(limit: float) -> float | None:
    return limit if math.isfinite(limit) else None


def _limit(written: float | None) -> float:
    return math.inf if written is None else written


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseModel(Tabular):
    """A sum of independent noise terms; when it was fitted, with the uncertainty of its parameters.

    Attributes
    ----------
    terms : tuple of Term
        Noise terms of the model.
    family : str
        "flicker" or "gauss-markov" for a fitted model: the term for the bias instability.
    estimates : tuple of Estimate
        Every parameter of the candidate family, supported or not.
    confidence : float
        Level of the sets in `estimates`.
    covariance : dict
        {"symbols": [...], "matrix": [[...]]} of the natural logarithms of the supported parameters; what terms that
        are not resolved may be is in it.
    goodness : dict
        {"chi2", "dof", "p"}: does the model explain the curve?
    verdict : str
        Summary in one sentence.
    alternative : NoiseModel or None
        The other family, when the record cannot decide.
    kind, unit : str
        Kind of the channel, and its own unit where it has no SI unit. Angles have noise of the rate, velocities of the
        acceleration, phases of the frequency.
    overbound : Inflation or None
        Inflation of an inflated model and its promise (`allanite.fitting.overbound`); None for any other.
    in_motion : MotionInflation or None
        What motion adds to the model at rest and why (`allanite.stability.in_motion`); None for any other.
    scale_uncertainty : float or None
        Relative standard uncertainty of the scale factor, which the intervals of `estimates` include besides the
        statistical one; None if not stated. `covariance` is always statistical.
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
    overbound: Inflation | None = field(default=None, repr=False)
    in_motion: MotionInflation | None = field(default=None, repr=False)
    scale_uncertainty: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "terms", tuple(self.terms))
        object.__setattr__(self, "kind", str(RATE_OF.get(self.kind, self.kind)))
        for term in self.terms:
            if type(term) not in _TERM_TYPES and not isinstance(term, Term):  # to ask a protocol takes 10 µs
                raise InputError(f"a noise model is a sum of terms ({', '.join(TERMS)}), not of {term!r}")

    def to_columns(self) -> Columns:
        """One row for each parameter of a fitted model: term, value, lower, upper, unit, status, note."""
        return {
            "term": [e.symbol for e in self.estimates],
            "value": [math.nan if e.value is None else e.value for e in self.estimates],
            "lower": [e.lower for e in self.estimates],
            "upper": [e.upper for e in self.estimates],
            "unit": [si_unit(self.kind, e.symbol, self.unit) for e in self.estimates],
            "status": [str(e.status) for e in self.estimates],
            "note": [e.note for e in self.estimates],
        }

    @classmethod
    def of(cls, *terms: TermType, kind: str = "rate") -> NoiseModel:
        """The sum of these terms."""
        return cls(terms=terms, kind=kind)

    @classmethod
    def from_datasheet(cls, **entries: Unpack[DatasheetEntries]) -> NoiseModel:
        """The model that a data sheet states; ambiguous statements need their reading.

        Parameters
        ----------
        **entries : str
            Numbers with their units: angle_random_walk or velocity_random_walk, noise_density (with density_is),
            rms_noise (with bandwidth and bandwidth_is), bias_instability (with bias_instability_is, and maybe
            bias_instability_tau), bias_stability, correlation_time, rate_random_walk or acceleration_random_walk,
            rate_ramp or acceleration_ramp, quantisation.

        Raises
        ------
        InputError
            An entry that is not known, has no unit or the wrong one, is ambiguous, or contradicts another.

        Examples
        --------
        >>> sheet = NoiseModel.from_datasheet(
        ...     noise_density="0.005 deg/s/√Hz", density_is="one-sided",
        ...     bias_instability="2 deg/h", bias_instability_is="minimum",
        ... )
        >>> str(sheet)
        'NoiseModel(N=6.171e-05; B=1.46e-05)'
        """
        return cls.of_sheet(sensor_sheet(entries))

    @classmethod
    def of_sheet(cls, sheet: SensorSheet) -> NoiseModel:
        """The model that the statements of a data sheet make; its `verdict` says how they were read."""
        return cls(terms=sheet.terms, kind=sheet.kind, verdict=sheet.verdict)

    def __add__(self, other: NoiseModel | TermType) -> NoiseModel:
        terms = other.terms if isinstance(other, NoiseModel) else (other,)
        if isinstance(other, NoiseModel) and (other.kind, other.unit) != (self.kind, self.unit):
            raise InputError(f"noise of a sensor of {self.kind} and of one of {other.kind} do not add")
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
        if sampling not in ("mean", "point"):
            raise InputError(f"sampling must be 'mean' or 'point', not {sampling!r}")
        return _sum(m, (term.avar_sampled(m, dt, sampling) for term in self.terms))

    def state_space(
        self, dt: float, *, sampling: str = "mean", record: float | None = None, ratio: float = 10.0
    ) -> StateSpace:
        """Discrete model of samples at interval dt [s]: exact, flicker as a sum of Gauss-Markov states.

        Parameters
        ----------
        dt : float [s]
            Sample interval.
        sampling : "mean" or "point"
            Samples are means over their interval, or values at an instant.
        record : float, optional [s]
            Length of the record, which ends the band of flicker; 1e7 samples by default.
        ratio : float
            Ratio of the correlation times of flicker: 10 (Allan variance within 2 %) or sqrt(10) (0.01 %).

        Raises
        ------
        InputError
            Another word for the sampling, or an interval or record that is not positive.
        """
        if sampling not in ("mean", "point"):
            raise InputError(f"sampling must be 'mean' or 'point', not {sampling!r}")
        longest = 1e7 * dt if record is None else record
        if not (0 < dt < math.inf and 0 < longest < math.inf):
            raise InputError(f"interval and record must be positive seconds, not {dt!r} and {record!r}")
        return _state_space(tuple(self.terms), dt, sampling, longest, ratio)

    def term(self, type_: str) -> TermType | None:
        """The first term of a type ("white", "flicker", ...), or None."""
        return next((t for t in self.terms if t.type == type_), None)

    def estimate(self, symbol: str) -> Estimate | None:
        """The estimate of a parameter, or None."""
        return next((e for e in self.estimates if e.symbol == symbol), None)

    @property
    def families(self) -> tuple[NoiseModel, ...]:
        """This model and, where the record cannot decide, its alternative: each by itself."""
        return (self,) if self.alternative is None else (replace(self, alternative=None), self.alternative)

    def cautious(self, tau: float) -> NoiseModel:
        """The family that has the larger Allan deviation at tau [s], with the other as its alternative.

        For what runs one model where the record cannot decide: a filter that trusts the steadier one may be wrong.
        """
        if self.alternative is None or self.adev(tau) >= self.alternative.adev(tau):
            return self
        return replace(self.alternative, alternative=replace(self, alternative=None))

    def to_json(self) -> dict[str, Any]:
        """Plain data; `from_json` gives back an equal model."""
        other = {} if self.alternative is None else {"alternative": self.alternative.to_json()}
        return {
            "family": self.family,
            "kind": self.kind,
            "unit": self.unit,
            "verdict": self.verdict,
            "confidence": self.confidence,
            "terms": [
                {"type": t.type, **{f.name: getattr(t, f.name) for f in fields(t)}} for t in self.terms
            ],
            "estimates": [e.to_json() for e in self.estimates],
            "covariance": dict(self.covariance),
            "goodness": dict(self.goodness),
            **({} if self.overbound is None else {"overbound": self.overbound.to_json()}),
            **({} if self.in_motion is None else {"in_motion": self.in_motion.to_json()}),
            **({} if self.scale_uncertainty is None else {"scale_uncertainty": self.scale_uncertainty}),
            **other,
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
            estimates = tuple(Estimate.from_json(e) for e in data.get("estimates", ()))
            parts: dict[str, Any] = {name: dict(data.get(name) or {}) for name in ("covariance", "goodness")}
            parts["overbound"] = Inflation.from_json(data["overbound"]) if data.get("overbound") else None
            motion = data.get("in_motion")
            parts["in_motion"] = MotionInflation.from_json(motion) if motion else None
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            form = "{'terms': [{'type': 'white', 'N': ...}]}"
            raise InputError(f"not a noise model: {error}; expected {form}") from None
        texts = ("family", "verdict", "kind", "unit")
        wrong = [name for name in texts if not isinstance(data.get(name, ""), str)]
        if wrong:
            raise InputError(f"not a noise model: its {wrong[0]} is a text, not {data[wrong[0]]!r:.40}")
        known = {f.name for f in fields(cls)} - {"terms", "estimates", "alternative", *parts}
        rest = {k: v for k, v in data.items() if k in known} | parts
        other = data.get("alternative")
        alternative = None if other is None else cls.from_json(other)
        return cls(terms=terms, estimates=estimates, alternative=alternative, **rest)

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


@lru_cache(maxsize=64)
def _state_space(
    terms: tuple[TermType, ...], dt: float, sampling: str, longest: float, ratio: float
) -> StateSpace:
    """Kept, with arrays that cannot be written to: a series of fits asks for the same one each time."""
    form, steady = MarkovForm(), stateless(0.0)
    for term in terms:
        if isinstance(term, (Ramp, Sinusoid)):
            steady = steady + term.steady_space(dt, sampling=sampling)
        else:
            form = form + term.markov(dt, sampling=sampling, record=longest, ratio=ratio)
    space = form.state_space() + steady
    for array in (space.transition, space.process, space.output, space.initial, space.rate, space.diffuse):
        array.flags.writeable = False
    return space
