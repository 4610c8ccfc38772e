# SPDX-License-Identifier: BSD-3-Clause
"""A noise model above the truth: see `overbound`."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.fitting.moments import lags_used
from allanite.fitting.overbound.envelope import band_above, least_above, reach
from allanite.fitting.overbound.plausible import plausible_variances
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, Sinusoid, TermType, term_of
from allanite.noise.allan.curve import AllanCurve
from allanite.noise.inflation import Inflation
from allanite.noise.parameters import amplitude_symbols, louder
from allanite.plain_files.counted import plural

__all__ = ["LETTERS", "overbound"]

Array = NDArray[np.float64]

#: Terms that a bound may be made of; quantisation and a ramp only where the fit holds them.
LETTERS = ("Q", "N", "B", "K", "R")
_ALWAYS = ("N", "B", "K")
#: Places of the curve at which the bound is held up, per octave.
_PLACES = 6
_SEED = 952
#: A term that the fit does not hold is left out where it adds less than this share of the variance everywhere.
_NOTHING = 1e-6
#: The way to the sum above the band may be gone this many times over, where the band is a little too low.
_FURTHEST = 1.5


def overbound(
    curve: AllanCurve,
    model: NoiseModel,
    *,
    probability: float = 0.95,
    horizon: float | None = None,
    terms: Collection[str] | None = None,
    above_measured: bool = True,
    exclude: ArrayLike | None = None,
) -> NoiseModel:
    """The smallest sum of noise terms whose Allan deviation is above the sensor's everywhere, with a given probability.

    Everywhere is from the shortest averaging time that the fit explains to `horizon`, at all of them together: the
    true curve is below the bound at every one with the stated probability. What the record does not show (a random
    walk beyond its length, say) enters with all that it cannot exclude, and so does the standard uncertainty of the
    scale factor where one is stated.

    Parameters
    ----------
    curve : AllanCurve
        The oadev curve of one channel that the model was fitted to.
    model : NoiseModel
        Model that was fitted to it. If the record could not decide between two families, the bound holds under each.
    probability : float
        Between 0.5 and 1.
    horizon : float, optional [s]
        Longest averaging time; the longest lag that the fit used by default. Beyond the record a bound is an
        extrapolation of what the record does not exclude, and grows fast.
    terms : collection of str, optional
        Letters of the terms that the bound may consist of: ("N", "K") for a consumer that knows no other. By default
        those of the fitted model with N, B and K. Spectral lines of the model stay as they are.
    above_measured : bool
        Keep the bound above the measured deviations too, also of lags that the fit left out at the short end; not of
        those that a spectral line or the sensor's filter bends.
    exclude : array_like of bool, shape (n_lags,), optional
        Lags kept out of the fit besides `curve.excluded`.

    Returns
    -------
    NoiseModel
        Model of which no term is smaller than in the fit, if it may be present at all. Its `overbound` states its
        promise and its inflation.

    Raises
    ------
    InputError
        Another statistic, several channels, a model without terms or of another kind, a probability or horizon that
        makes no sense, unknown letters, or letters that cannot hold the curve up.
    FitError
        No sum of these terms lies above.
    """
    _refuse(curve, model, probability, horizon)
    letters = _allowed(terms)
    used = lags_used(curve, exclude)
    used &= curve.tau >= float(model.goodness.get("shortest_tau", 0.0)) * (1 - 1e-9)
    if used.sum() < 3:
        raise InputError(f"{plural(int(used.sum()), 'lag')} of the curve can be used, at least 3 are needed")
    shortest, end = float(curve.tau[used][0]), horizon or float(curve.tau[used][-1])
    if end < shortest:
        raise InputError(f"the horizon of {end:g} s is shorter than the shortest lag, {shortest:g} s")
    places = _places(shortest, end, curve.dt)
    rng = np.random.default_rng(_SEED)
    drawn = [
        plausible_variances(
            curve,
            used,
            family,
            places,
            fitted_terms_only=only,
            discrepancy=float(model.goodness.get("discrepancy", 0.0)),
            rng=rng,
        )
        for family in model.families
        if family.terms
        for only in (False, True)
    ]
    relative = model.scale_uncertainty or curve.channels[0].scale_uncertainty
    if relative is not None:
        drawn = [scale_open(curves, relative, rng) for curves in drawn]
    shown = _shown(curve, end) if above_measured else np.zeros(len(curve.lags), dtype=bool)
    ground = _Ground(
        m=np.concatenate([places, curve.lags[shown].astype(np.float64)]),
        dt=curve.dt,
        sampling=curve.channels[0].sampling,
        measured=curve.variance[shown, 0],
        drawn=drawn,
        probability=probability,
    )
    return _bound(ground, model, letters, shortest, end)


def _refuse(curve: AllanCurve, model: NoiseModel, probability: float, horizon: float | None) -> None:
    if len(curve.channels) != 1 or curve.statistic != "oadev":
        raise InputError("a bound takes the oadev curve of one channel: overbound(curve['x'], model)")
    if not model.terms:
        raise InputError("the model has no terms: nothing to put a bound above")
    kind = curve.channels[0].kind.rate
    if model.kind != kind:
        raise InputError(f"the model is of {model.kind}, the curve of {kind}")
    if isinstance(probability, bool) or not (
        isinstance(probability, (int, float)) and 0.5 <= probability <= 0.999
    ):
        raise InputError(f"probability must lie between 0.5 and 0.999 (0.95 for 95 %), not {probability!r}")
    if horizon is not None and not (
        isinstance(horizon, (int, float)) and math.isfinite(horizon) and horizon > 0
    ):
        raise InputError(f"horizon must be a positive number of seconds, not {horizon!r}")


def scale_open(curves: Array, relative: float, rng: np.random.Generator) -> Array:
    """The drawn variances, each with its own error of the scale factor: one factor for all averaging times."""
    return np.asarray(curves * np.exp(2 * relative * rng.standard_normal((len(curves), 1))))


def _places(shortest: float, end: float, dt: float) -> Array:
    """Averaging times [samples] at which the bound is held up."""
    octaves = math.log2(end / shortest)
    return np.asarray(np.geomspace(shortest, end, max(math.ceil(octaves * _PLACES), 1) + 1) / dt)


def _shown(curve: AllanCurve, end: float) -> NDArray[np.bool_]:
    """Lags whose measured deviation the bound has to be above."""
    shown = np.isfinite(curve.deviation[:, 0]) & (curve.deviation[:, 0] > 0) & ~curve.excluded[:, 0]
    return np.asarray(shown & (curve.count[:, 0] >= curve.lags) & (curve.tau <= end * (1 + 1e-9)))


def _allowed(terms: Collection[str] | None) -> tuple[str, ...] | None:
    """Letters; None for those of the model with N, B and K."""
    if terms is None:
        return None
    wanted = tuple(terms)
    unknown = [letter for letter in wanted if letter not in LETTERS]
    if unknown or not wanted:
        named = repr(unknown[0]) if unknown else "none"
        raise InputError(f"a bound is made of terms out of {', '.join(LETTERS)}, not of {named}")
    if "N" not in wanted or not {"K", "B", "R"} & set(wanted):
        raise InputError("a bound needs N for short and K or B for long averaging times")
    return wanted


@dataclass(frozen=True, slots=True, kw_only=True)
class _Ground:
    """What a bound has to lie above: averaging times m [samples], the last of them those of `measured`."""

    m: Array
    dt: float
    sampling: str
    measured: Array
    drawn: list[Array]
    probability: float

    def avar(self, term: NoiseModel | TermType) -> Array:
        return term.avar_sampled(self.m, self.dt, self.sampling)

    @property
    def n_places(self) -> int:
        return len(self.m) - len(self.measured)

    def floor(self) -> Array:
        """The bands of all families together, and what was measured."""
        bands = np.max([band_above(curves, self.probability) for curves in self.drawn], axis=0)
        return np.concatenate([bands, self.measured])

    def needed(self, start: Array, end: Array) -> float:
        """How far to go from `start` to `end`."""
        n = self.n_places
        shares = [
            float(np.quantile(reach(curves, start[:n], end[:n]), self.probability)) for curves in self.drawn
        ]
        if len(self.measured):
            shares.append(float(reach(self.measured[None], start[n:], end[n:])[0]))
        return max(shares)


def _bound(
    ground: _Ground, model: NoiseModel, letters: tuple[str, ...] | None, shortest: float, end: float
) -> NoiseModel:
    noise = [t for t in model.terms if not isinstance(t, Sinusoid)]
    fitted = [t for t in noise if letters is None or t.symbols[0] in letters]
    added = [
        term_of(letter, 1.0, dt=ground.dt)
        for letter in letters or _ALWAYS
        if not any(t.symbols[0] == letter for t in fitted)
    ]
    columns = np.stack([ground.avar(t) for t in (*fitted, *added)], axis=1)
    least = np.array([1.0] * len(fitted) + [0.0] * len(added))
    factors = _least(ground, columns, least)
    share = (columns * factors / (columns @ factors)[:, None]).max(axis=0)
    amplitudes = np.where((share > _NOTHING) | (least > 0), np.sqrt(factors), 0.0)
    made = [louder(t, a) for t, a in zip((*fitted, *added), amplitudes, strict=True) if a > 0]
    below = sum(ground.avar(t) for t in noise)
    ratio = np.sqrt(columns @ factors / below)[: ground.n_places]
    inflation = Inflation(
        probability=ground.probability,
        shortest=shortest,
        horizon=end,
        factors={
            **dict(zip(amplitude_symbols(fitted), amplitudes.tolist(), strict=False)),
            **dict.fromkeys(amplitude_symbols(made[len(fitted) :])),
        },
        mean=float(np.exp(np.log(ratio).mean())),
        greatest=float(ratio.max()),
        fitted=tuple(NoiseModel(terms=tuple(noise), kind=model.kind).to_json()["terms"]),
    )
    lines = tuple(t for t in model.terms if isinstance(t, Sinusoid))
    return NoiseModel(
        terms=(*made, *lines),
        family=model.family,
        kind=model.kind,
        unit=model.unit,
        overbound=inflation,
        verdict=inflation.verdict,
    )


def _least(ground: _Ground, columns: Array, least: Array) -> Array:
    """Coefficients of the bound, none smaller than `least`.

    The floor is held up by a sum of few shapes, which lies above it almost everywhere: the whole way is too far.
    """
    start = columns @ least
    target = least_above(columns, least, np.maximum(ground.floor(), start))
    share = ground.needed(start, columns @ (target * (1 + 1e-9)))
    return np.asarray(least + min(share, _FURTHEST) * (target - least))
