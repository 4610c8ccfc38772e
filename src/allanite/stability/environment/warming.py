# SPDX-License-Identifier: BSD-3-Clause
"""A warm-up after power-on: exponentials in time, told from slow noise by a test.

A random walk often looks like a warm-up. The test therefore asks whether an exponential is larger than the noise of
the record allows, where the noise, a walk among it, is fitted beside exponentials of several time constants at once:
a warm-up then cannot pass for a walk, nor a walk for a warm-up. Of the exponentials that are tried the best one
counts, at the price of having tried all of them (Bonferroni).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.filtering.regression import Whitener
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.distributions import chi_square_tail
from allanite.stability.environment.climate import Climate
from allanite.stability.environment.design import WarmUpDecay
from allanite.stability.environment.noise_left_open import Noise
from allanite.stability.environment.results import WarmUpTerm

__all__ = ["FOUND", "Look", "look_for_warm_up", "offered", "refined", "settled_after", "settles"]

Array = NDArray[np.float64]

#: Below this probability a warm-up is found.
FOUND = 0.05
#: Shortest time constant [blocks], and longest one [records]: slower ones are a drift.
SHORTEST, LONGEST = 4.0, 1 / 3
#: Ratio of the time constants that are tried, and which of them stand beside each other while the noise is fitted.
RATIO, TOGETHER = 2.0, 3
#: The warm-up is over where what is left of it is below this part of the smallest Allan deviation.
OVER = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """What the test says.

    Attributes
    ----------
    p : float
        Of the best exponential, charged for all.
    best : WarmUpDecay
    tries : int
        How many those are.
    """

    p: float
    best: WarmUpDecay
    tries: int

    @property
    def found(self) -> bool:
        return self.p < FOUND


def offered(climate: Climate) -> tuple[WarmUpDecay, ...]:
    """Time constants that a record of this length can show."""
    length = climate.size * climate.dt
    count = int(math.log(LONGEST * length / (SHORTEST * climate.dt)) / math.log(RATIO)) + 1
    return tuple(WarmUpDecay(T=LONGEST * length / RATIO**k) for k in range(count))


def settles(climate: Climate, level: float) -> bool:
    """Whether an exponential stands out of what is left beside it, were that white noise.

    Slow noise makes this far too easy. It is asked first because it costs nothing: where the answer is no, the noise
    need not be fitted.
    """
    part = climate.blocks.part
    present = part > 0
    decays = offered(climate)
    weight = np.sqrt(part[present])
    columns = np.exp(-climate.middle[present, None] / [d.T for d in decays]) * weight[:, None]
    flat = (weight / np.linalg.norm(weight))[:, None]
    y = climate.blocks.mean[present] * weight
    y, columns = (x - flat @ (flat.T @ x) for x in (y[:, None], columns))
    total = float((y**2).sum())
    if total == 0 or len(y) < 3:
        return False
    explained = (columns.T @ y)[:, 0] ** 2 / (columns**2).sum(axis=0)
    best = float(explained.max())
    left = max(total - best, 1e-12 * total) / (len(y) - 2)
    return chi_square_tail(best / left, 1) * len(decays) < level


def together(decays: Sequence[WarmUpDecay]) -> list[str]:
    """Names of those beside which the noise is fitted."""
    return [d.name for d in decays[::TOGETHER]]


def look_for_warm_up(noise: Noise, base: Sequence[str], decays: Sequence[WarmUpDecay]) -> Look:
    """The exponential that is least likely under noise alone.

    Parameters
    ----------
    noise : Noise
        With the columns of all decays.
    base : sequence of str
        Other columns of the regression.
    """
    beside = [*base, *together(decays)]
    weights, sizes = noise.weights(beside), noise.sizes(beside)
    chances = [noise.fit([*base, d.name], weights=weights, sizes=sizes).chance(d.name) for d in decays]
    best = int(np.argmin(chances))
    return Look(p=min(chances[best] * len(decays), 1.0), best=decays[best], tries=len(decays))


def refined(
    climate: Climate, columns: Array, model: NoiseModel, start: Sequence[WarmUpDecay]
) -> tuple[WarmUpDecay, ...]:
    """Time constants that leave the smallest residuals, one after the other, thrice where there are several.

    Parameters
    ----------
    columns : ndarray, shape (n, k)
        Other columns of the regression, the level among them.
    """
    from scipy.optimize import minimize_scalar

    whitener = Whitener.of(model, dt=climate.dt, counts=climate.blocks.part, sampling=climate.sampling)
    present = climate.blocks.part > 0
    y = np.where(present, climate.blocks.mean, 0.0)
    white = whitener(np.column_stack([columns, y - y[present].mean()]))[0][present]
    q = np.linalg.qr(white[:, :-1])[0]
    left = white[:, -1] - q @ (q.T @ white[:, -1])
    constants = [d.T for d in start]

    def chi2(at: Sequence[float]) -> float:
        decays = np.column_stack([np.exp(-climate.middle / T) for T in at])
        whitened = whitener(decays)[0][present]
        whitened = whitened - q @ (q.T @ whitened)
        return float(np.linalg.lstsq(whitened, left, rcond=None)[1].sum())

    for _ in range(1 if len(constants) == 1 else 3):
        for i, T in enumerate(constants):
            others = constants[:i] + constants[i + 1 :]
            span = (
                math.log(T) - 1.0,
                min(math.log(T) + 1.0, math.log(2 * LONGEST * climate.size * climate.dt)),
            )
            whitened = minimize_scalar(
                lambda x, others=others: chi2([*others, math.exp(x)]),
                bounds=span,
                method="bounded",
                options={"xatol": 1e-3},
            )
            constants[i] = math.exp(float(whitened.x))
    return tuple(WarmUpDecay(T=T, slope=True) for T in sorted(constants))


def terms_of(noise: Noise, base: Sequence[str], decays: Sequence[WarmUpDecay]) -> tuple[WarmUpTerm, ...]:
    """Amplitudes and time constants with their standard deviations."""
    names = [*base, *(n for d in decays for n in d.names)]
    fit = noise.fit(names)
    mean, sd = (
        dict(zip(names, fit.mean, strict=True)),
        dict(zip(names, np.sqrt(np.diag(fit.covariance)), strict=True)),
    )
    return tuple(
        WarmUpTerm(
            amplitude=float(mean[d.name]),
            amplitude_sd=float(sd[d.name]),
            T=d.T,
            # the column of the derivative has the coefficient amplitude times the relative error of T
            T_sd=d.T * float(sd[d.names[-1]] / abs(mean[d.name])),
        )
        for d in decays
    )


def settled_after(terms: Sequence[WarmUpTerm], model: NoiseModel, length: float) -> float:
    """When what is left of a warm-up is lost in the noise [s]."""
    floor = math.sqrt(float(np.min(model.avar(np.geomspace(length / 1e4, length / 2, 60)))))
    t = np.linspace(0.0, length, 4001)
    size = sum(
        (abs(w.amplitude) + 2 * w.amplitude_sd) * np.exp(-t / (w.T + 2 * min(w.T_sd, w.T / 2))) for w in terms
    )
    over = np.flatnonzero(np.asarray(size) < OVER * floor)
    return float(t[over[0]]) if len(over) else length
