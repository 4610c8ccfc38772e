# SPDX-License-Identifier: BSD-3-Clause
"""Do the residuals scatter as the noise says? If not, how much more, and is there one span that stands out?

What is there beyond the noise is added to it: one standard deviation for each kind of observation (spans of the
accelerometers, spans of the gyros, turns), and a random walk of the biases of each triad, estimated by restricted
maximum likelihood [1]. That weighs the kinds of
observation against each other by what they are worth, which a common factor would not: a hand-held unit whose
accelerometers scatter thirty times as much as their noise may have gyros that are as good as it.

References
----------
.. [1] D. A. Harville, "Maximum likelihood approaches to variance component estimation", JASA 72 (1977) 320: the
   likelihood of the contrasts that no unknown enters, and its scoring.
.. [2] F. E. Satterthwaite, "An approximate distribution of estimates of variance components", Biometrics Bulletin 2
   (1946) 110.
.. [3] F. A. Graybill, C.-M. Wang, "Confidence intervals on nonnegative linear combinations of variances", JASA 75
   (1980) 869: what a sum exceeds its estimate by is the root of the sum of the squares of what its addends do.
.. [4] M. G. Kenward, J. H. Roger, "Small sample inference for fixed effects from restricted maximum likelihood",
   Biometrics 53 (1997) 983, section 2: weights that are estimates leave more variance than known ones.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.calibration.adjustment.solution import CalibrationSolution
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import chi_square_quantile, chi_square_tail

__all__ = [
    "Contrasts",
    "Deletion",
    "ScatterGroup",
    "Sizes",
    "deletion",
    "f_tail",
    "group_of",
    "parameter_dof",
    "satterthwaite",
    "shift",
    "sizes_of",
    "spanned",
    "upper_variance",
    "weighing_covariance",
]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Rounds at most and, of these, those before scoring; longest step, and the step below which a variance has settled,
#: both of its logarithm.
ROUNDS, WARM, STRIDE, SETTLED = 30, 3, 2.0, 0.01
#: Largest upper limit of a variance over its estimate, or over what doubles the noise, as a power of e.
FARTHEST = 40.0
#: Beyond the noise by less than this part of its variance is nothing.
NOTHING = 1e-3
#: Directions of a design below this part of the largest are rounding: in records they are below 1e-15, the others above
#: 1e-3.
RANK = 1e-9
#: A direction of an observation counts from this part of its weight on that the other observations control.
CONTROLLED = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class ScatterGroup:
    """Chi-square of one kind of observation by the noise, in the residuals.

    Attributes
    ----------
    chi2, dof : float
        Scaled so that chi2 has the law of dof degrees of freedom in mean and variance [2].
    """

    chi2: float
    dof: float

    @property
    def p(self) -> float:
        """Probability of more."""
        return chi_square_tail(self.chi2, self.dof) if self.dof > 0 else 1.0

    @property
    def ratio(self) -> float:
        """Scatter over the noise."""
        return math.sqrt(self.chi2 / self.dof) if self.dof > 0 else 1.0


def group_of(solution: CalibrationSolution, rows: Index) -> ScatterGroup:
    """Of the rows of one kind, under the noise of the solution."""
    place = np.ix_(rows, rows)
    return _group(
        solution.projector[place], solution.noise[place], (solution.projector @ solution.residual)[rows]
    )


def _group(projector: Array, noise: Array, weighted_residual: Array) -> ScatterGroup:
    product = projector @ noise
    mean, square = float(np.trace(product)), float(np.einsum("ij,ji->", product, product))
    if mean < 0.05:  # nothing controls these observations
        return ScatterGroup(chi2=0.0, dof=0.0)
    return ScatterGroup(
        chi2=float(weighted_residual @ noise @ weighted_residual) * mean / square, dof=mean**2 / square
    )


def spanned(table: Array) -> tuple[Array, int]:
    """An orthonormal basis of all rows, shape (r, r), and how many of its columns the columns of a table span."""
    scaled = table / np.maximum(np.linalg.norm(table, axis=0), 1e-300)
    left, values, _ = np.linalg.svd(scaled, full_matrices=True)
    return left, int((values > RANK * values[0]).sum()) if len(values) else 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Contrasts:
    """The combinations of observations that no unknown enters; restricted likelihood is theirs.

    Attributes
    ----------
    basis : ndarray, shape (c, r)
        Of the combinations, independent and of variance one under the noise.
    noise : ndarray, shape (r, r)
        By the models.
    values : ndarray, shape (c,)
    """

    basis: Array
    noise: Array
    values: Array

    @classmethod
    def of(cls, noise: Array, residual: Array, unknowns: Array) -> Contrasts:
        """Of residuals; `noise`, shape (r, r), is that of the models, `unknowns`, shape (r, u), the design.

        Columns may depend on each other: the heading of positions that no turn links to the first changes nothing, and
        each of them takes no contrast away.
        """
        inverse = np.linalg.inv(np.linalg.cholesky(noise))
        left, rank = spanned(inverse @ unknowns)
        basis = left[:, rank:].T @ inverse
        return cls(basis=basis, noise=noise, values=basis @ residual)

    def of_shape(self, shape: Array) -> Array:
        """Covariance of the contrasts, shape (c, c)."""
        return np.asarray(self.basis @ shape @ self.basis.T)

    def group(self, rows: Index, beyond: Array) -> ScatterGroup:
        """Chi-square of rows with something beyond the noise, shape (r, r)."""
        inverse = np.linalg.inv(np.eye(len(self.values)) + self.of_shape(beyond))
        part = self.basis[:, rows]
        noise = self.noise + beyond
        return _group(part.T @ inverse @ part, noise[np.ix_(rows, rows)], part.T @ (inverse @ self.values))


@dataclass(frozen=True, slots=True, kw_only=True)
class Sizes:
    """What is there beyond the noise.

    Attributes
    ----------
    values : dict of str to float
        Standard deviations, of unit `shapes`.
    spread : ndarray, shape (k, k)
        Covariance of the logarithms of their squares, in the order of `values`.
    """

    values: dict[str, float] = field(default_factory=dict)
    spread: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def dof(self) -> dict[str, float]:
        """Degrees of freedom of the squares."""
        return {n: 2 / float(v) for n, v in zip(self.values, np.diag(self.spread), strict=True) if v > 0}


def sizes_of(
    contrasts: Contrasts,
    shapes: Mapping[str, Array],
    before: Mapping[str, float],
    certain: Collection[str] = (),
) -> Sizes:
    """Sizes of what is there beyond the noise.

    Parameters
    ----------
    contrasts : Contrasts
    shapes : mapping of str to ndarray, shape (r, r)
        Covariances of unit size; what comes out as nothing is left out of the answer.
    before : mapping of str to float
        Sizes to start from.
    certain : collection of str
        What is there however small it comes out: few contrasts often say nothing, which is no more certain than
        anything else that they say.
    """
    names = list(shapes)
    if not names or not len(contrasts.values):
        return Sizes()
    parts = [contrasts.of_shape(shapes[n]) for n in names]
    # in units of what would double the noise of a contrast
    unit = np.array([len(p) / float(np.trace(p)) for p in parts])
    parts = [u * p for u, p in zip(unit, parts, strict=True)]
    chi2 = float(contrasts.values @ contrasts.values) / len(contrasts.values)
    x = np.array([before.get(n, 0.0) ** 2 / u or max(chi2, 1.0) for n, u in zip(names, unit, strict=True)])
    least = np.array([NOTHING if n in certain else NOTHING**2 for n in names])
    slope, curve = _scores(contrasts, parts, x)
    for turn in range(ROUNDS):
        # first by what is found over what is expected, then by scoring, both in the logarithm
        step = slope[1] if turn < WARM else np.linalg.solve(curve + 1e-9 * np.eye(len(x)), slope[0])
        x = np.maximum(x * np.exp(np.clip(step, -STRIDE, STRIDE)), least)
        slope, curve = _scores(contrasts, parts, x)
        if np.all((np.abs(step) < SETTLED) | (x <= NOTHING)):
            break
    kept = [k for k in range(len(names)) if x[k] >= NOTHING]
    return Sizes(
        values={names[k]: math.sqrt(float(x[k] * unit[k])) for k in kept},
        spread=np.asarray(np.linalg.pinv(curve[np.ix_(kept, kept)], hermitian=True)),
    )


def _scores(contrasts: Contrasts, parts: list[Array], x: Array) -> tuple[tuple[Array, Array], Array]:
    """Slope of the likelihood by the logarithms of the variances; logarithms of found over expected; information."""
    v = np.eye(len(contrasts.values)) + sum(a * p for a, p in zip(x, parts, strict=True))
    inverse = np.linalg.inv(v)
    weighted_contrasts = inverse @ contrasts.values
    products = [inverse @ p for p in parts]
    observed = np.array([float(weighted_contrasts @ p @ weighted_contrasts) for p in parts])
    expected = np.array([float(np.trace(p)) for p in products])
    curve = np.array([[float(np.einsum("ij,ji->", a, b)) for b in products] for a in products])
    ratio = np.log(np.maximum(observed, 1e-300) / expected)
    return (0.5 * (observed - expected) * x, ratio), 0.5 * curve * np.outer(x, x)


def parameter_dof(solution: CalibrationSolution, shapes: Mapping[str, Array], sizes: Sizes) -> Array:
    """Degrees of freedom of the variance of each parameter, infinite where nothing beyond the noise was found."""
    gain = solution.gain
    parts = [np.einsum("ki,ij,kj->k", gain, shapes[n], gain) * v**2 for n, v in sizes.values.items()]
    return satterthwaite(np.diag(solution.covariance), np.array(parts).reshape(-1, len(gain)), sizes.spread)


def weighing_covariance(solution: CalibrationSolution, shapes: Mapping[str, Array], sizes: Sizes) -> Array:
    """What the covariance of the parameters lacks because the sizes are estimates, shape (p, p).

    Their errors weigh the observations wrongly, and those that are found fit too well: each adds half of this. The
    adjusted covariance of [4], section 2, where the covariance of the observations is linear in the estimates.
    """
    gain = solution.gain
    parts = [gain @ shapes[n] * v**2 for n, v in sizes.values.items()]
    total = np.zeros((len(gain), len(gain)))
    for i, first in enumerate(parts):
        for j, second in enumerate(parts):
            total += 2 * sizes.spread[i, j] * first @ solution.projector @ second.T
    return total


def satterthwaite(variance: Array, parts: Array, spread: Array) -> Array:
    """Degrees of freedom of sums of variances [2].

    Parameters
    ----------
    variance : ndarray, shape (n,)
        The sums.
    parts : ndarray, shape (k, n)
        The addends that are estimates; the others are known.
    spread : ndarray, shape (k, k)
        Covariance of their logarithms.
    """
    uncertain = np.einsum("in,ij,jn->n", parts, spread, parts) / 2
    with np.errstate(divide="ignore"):
        return np.asarray(np.where(uncertain > 0, variance**2 / uncertain, math.inf))


def upper_variance(
    solution: CalibrationSolution,
    shapes: Mapping[str, Array],
    sizes: Sizes,
    contrasts: Contrasts,
    confidence: float,
) -> Array:
    """Upper limits of the variance of each parameter, over the variance that is stated, shape (p,).

    Where a size is hardly known, the law of Student has so few degrees of freedom that its quantiles mean nothing. A
    parameter is not less certain than its variance is large, and that has an upper limit: by the restricted
    likelihood for each size, and for their sum after [3].

    Parameters
    ----------
    confidence : float
        Of each limit: a single contrast without noise gives 12.3 standard deviations, Student's law 12.7.
    """
    stated = np.diag(solution.covariance)
    gain, excess = solution.gain, np.zeros(len(stated))
    limits = _upper_sizes(contrasts, shapes, sizes, confidence)
    for name, size in sizes.values.items():
        part = np.einsum("ki,ij,kj->k", gain, shapes[name], gain)
        excess += (part * (limits[name] ** 2 - size**2)) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(stated > 0, 1 + np.sqrt(excess) / stated, 1.0))


def _upper_sizes(
    contrasts: Contrasts, shapes: Mapping[str, Array], sizes: Sizes, confidence: float
) -> dict[str, float]:
    """Sizes at which the restricted likelihood has fallen as far as the confidence lets it, the others as found."""
    from scipy.optimize import brentq

    parts = {n: contrasts.of_shape(shapes[n]) * v**2 for n, v in sizes.values.items()}
    whole = np.eye(len(contrasts.values)) + sum(parts.values())
    least = _likelihood(contrasts, whole) - chi_square_quantile(2 * confidence - 1, 1) / 2  # one end of it
    limits = {}
    for name, part in parts.items():

        def fallen(power: float, part: Array = part) -> float:
            return least - _likelihood(contrasts, whole + math.expm1(power) * part)

        top = 1.0
        while top < FARTHEST and fallen(top) < 0:
            top *= 2
        power = float(brentq(fallen, 0.0, top, xtol=1e-3)) if top < FARTHEST else FARTHEST
        limits[name] = sizes.values[name] * math.exp(power / 2)
    return limits


def _likelihood(contrasts: Contrasts, covariance: Array) -> float:
    """Logarithm of the restricted likelihood, but for a constant."""
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, contrasts.values)
    return -float(np.log(np.diag(factor)).sum()) - 0.5 * float(white @ white)


@dataclass(frozen=True, slots=True, kw_only=True)
class Deletion:
    """What all other observations predict of some rows, against what was seen.

    Attributes
    ----------
    chi2 : float
    dof : int
        Combinations of the rows that the others predict at all.
    p : float
    """

    chi2: float
    dof: int
    p: float

    @property
    def misfit(self) -> float:
        """In standard deviations; NaN where nothing else says anything about these rows."""
        return math.sqrt(self.chi2 / self.dof) if self.dof else math.nan


def shift(solution: CalibrationSolution, rows: Index) -> tuple[float, int]:
    """By how much chi-square falls if these rows are left out, and how many combinations of them are controlled."""
    projector = solution.projector[np.ix_(rows, rows)]
    factor = np.linalg.cholesky(solution.noise[np.ix_(rows, rows)])
    control, turned = np.linalg.eigh(factor.T @ projector @ factor)
    components = turned.T @ (factor.T @ (solution.projector[rows] @ solution.residual))
    used = control > CONTROLLED
    return float((components[used] ** 2 / control[used]).sum()), int(used.sum())


def deletion(
    solution: CalibrationSolution, rows: Index, kind: tuple[float, int], beyond_dof: float
) -> Deletion:
    """The deletion residual of rows of one kind.

    Parameters
    ----------
    solution : CalibrationSolution
    rows : ndarray of int64
    kind : (float, int)
        The `shift` of all rows of their kind.
    beyond_dof : float
        Degrees of freedom of what was estimated beyond the noise; infinite for nothing. It was estimated from the same
        residuals: an F law, with these rows left out of it, in place of chi-square.
    """
    chi2, k = shift(solution, rows)
    if k == 0:
        return Deletion(chi2=0.0, dof=0, p=1.0)
    if math.isinf(beyond_dof):
        return Deletion(chi2=chi2, dof=k, p=chi_square_tail(chi2, k))
    total, count = kind
    if count <= k:
        return Deletion(chi2=chi2, dof=0, p=1.0)
    others = max((total - chi2) / (count - k), 1e-6)
    rest = max(min(count, beyond_dof) - k, 1.0)
    return Deletion(chi2=chi2 / others, dof=k, p=f_tail(chi2 / k / others, k, rest))


def f_tail(f: float, numerator: float, denominator: float) -> float:
    """Probability of more than f under Fisher's law."""
    from scipy.special import fdtrc

    return float(fdtrc(numerator, denominator, f))
