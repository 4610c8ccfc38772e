# SPDX-License-Identifier: BSD-3-Clause
"""The contenders: how each is asked for N, B, K and T_b, at its best, with the error bars it gives.

A contender sees what its user would have: the samples, the rate, and (where it takes a list of terms) which terms are
there. `None` is "no such answer"; an interval is given only where the tool gives one, or the means to it.
"""

from __future__ import annotations

import contextlib
import io
import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import metadata, util
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.noise import FLICKER_FLOOR, SIGMA_PER_B
from verification.scoreboard import rules

__all__ = ["INSTALL", "LEVELS", "TOOLS", "Answer", "Question", "Tool", "present"]

Array = NDArray[np.float64]

#: Nominal coverage of the two intervals.
LEVELS = (0.6827, 0.95)
#: Peak of a Gauss-Markov term's Allan deviation, over its correlation time.
PEAK = 1.892617832925
INSTALL = "python -m pip install allantools==2024.6 avar==1.0.4 allan-variance==1.0"


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """One record: three axes of the same sensor, of which all but one rule see the first alone.

    Attributes
    ----------
    axes : ndarray, shape (3, n) [rad/s]
    rate : float [Hz]
    terms : frozenset of str
        Symbols of the terms in it (N, B, B_equiv, T, K), for tools whose user places them by hand.
    """

    axes: Array
    rate: float
    terms: frozenset[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """A parameter as a tool states it: SI value, None for "not resolved", and intervals by nominal level."""

    value: float | None
    intervals: dict[float, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tool:
    """A contender.

    Attributes
    ----------
    name, version : str
    how : str
        Which options, and what its user is assumed to do.
    ask : callable
    package, module : str
        That have to be installed; empty: none.
    commit : str
        Of a program whose rule alone is here.
    """

    name: str
    how: str
    ask: Callable[[Question], dict[str, Answer]]
    package: str = ""
    module: str = ""
    commit: str = ""

    @property
    def version(self) -> str:
        return metadata.version(self.package) if self.package else self.commit


def present() -> list[Tool]:
    """The tools that are installed."""
    found = []
    for tool in TOOLS:
        with contextlib.suppress(metadata.PackageNotFoundError):
            if tool.version and (not tool.module or util.find_spec(tool.module)):
                found.append(tool)
    return found


def _plain(values: dict[str, float]) -> dict[str, Answer]:
    """Numbers without a bar; NaN is no number."""
    return {symbol: Answer(value=None if math.isnan(v) else v) for symbol, v in values.items()}


# -- reading rules ---------------------------------------------------------------------------------------------


def _allan_variance_ros(q: Question) -> dict[str, Answer]:
    return _plain(rules.allan_variance_ros(q.axes[0], q.rate))


def _imu_utils(q: Question) -> dict[str, Answer]:
    return _plain(rules.imu_utils(q.axes[0], q.rate))


def _kalibr_allan(q: Question) -> dict[str, Answer]:
    return _plain(rules.kalibr_allan(q.axes, q.rate))


# -- packages --------------------------------------------------------------------------------------------------


def _allantools(q: Question) -> dict[str, Answer]:
    """Overlapping deviation at octaves; each parameter where the slope is nearest to its own; Greenhall's interval."""
    import allantools

    y = q.axes[0]
    tau, sigma, _, _ = allantools.oadev(y, rate=q.rate, data_type="freq", taus="octave")
    keep = tau * q.rate <= len(y) / 5
    tau, sigma = tau[keep], sigma[keep]
    found = {}
    for symbol, place, factor, alpha in _by_slope(tau, sigma):
        m = round(float(tau[place]) * q.rate)
        edf = allantools.edf_greenhall(alpha, 2, m, len(y) + 1, overlapping=True, modified=False)
        bars = {}
        for level in LEVELS if factor else ():
            low, high = allantools.confidence_interval(float(sigma[place]), edf, level)
            bars[level] = (float(low) * factor, float(high) * factor)
        value = float(sigma[place]) * factor if factor else float(tau[place]) / PEAK
        found[symbol] = Answer(value=value, intervals=bars)
    return found


def _by_slope(tau: Array, sigma: Array) -> list[tuple[str, int, float, int]]:
    """Symbol, lag of the reading, parameter over deviation there, power of frequency of the density."""
    slope = np.gradient(np.log(sigma), np.log(tau))
    n, b, k = (int(np.argmin(np.abs(slope - wanted))) for wanted in (-0.5, 0.0, 0.5))
    return [
        ("N", n, math.sqrt(tau[n]), 0),
        ("B", b, 1 / FLICKER_FLOOR, -1),
        ("K", k, math.sqrt(3 / tau[k]), -2),
        ("T", b, 0.0, -1),
    ]


def _allan_variance(q: Question) -> dict[str, Answer]:
    """As documented: lags to a tenth of the record, non-negative least squares on all five terms."""
    import allan_variance

    tau, variance = allan_variance.compute_avar(q.axes[0], dt=1 / q.rate)
    found, _ = allan_variance.estimate_parameters(tau, variance)
    return _plain({"N": float(found["white"]), "B": float(found["flicker"]), "K": float(found["walk"])})


def _avar(q: Question) -> dict[str, Answer]:
    """The terms that are there, placed on the curve where its slope says, up to a tenth of the record; then "o"."""
    os.environ.setdefault("MPLBACKEND", "Agg")
    import avar
    import matplotlib.pyplot as plt

    y = q.axes[0] - q.axes[0].mean()
    with contextlib.redirect_stdout(io.StringIO()):
        lags = avar.windows(len(y) // 5, density=10)
        variance = avar.variance(y, lags)
    tau, sigma = lags / q.rate, np.sqrt(variance)
    at = {symbol: place for symbol, place, _, _ in _by_slope(tau, sigma)}
    time = float(tau[at["B"]]) / PEAK
    terms = [[-1, float(variance[at["N"]] * tau[at["N"]])]]
    if q.terms & {"B", "B_equiv"}:
        terms.append([0, float(variance[at["B"]]) / 0.381139, time])
    if "K" in q.terms:
        terms.append([1, 3 * float(variance[at["K"]] / tau[at["K"]])])
    # Its optimiser stops at variances of 1e-12: it works in a unit in which they are near one.
    unit = float(variance.min())
    fit = avar.fit(tau, variance / unit, 1 / q.rate, [[k[0], k[1] / unit, *k[2:]] for k in terms])
    fit.on_key_press(SimpleNamespace(key="o"))
    plt.close("all")
    found = {int(k[0]): math.sqrt(k[1] * unit) for k in fit.ks}
    out = {"N": found[-1]}
    if 0 in found:
        out |= {"B": found[0] / SIGMA_PER_B, "T": time}
    if 1 in found:
        out["K"] = found[1]
    return _plain(out)


# -- ours ------------------------------------------------------------------------------------------------------


def _moments(q: Question) -> dict[str, Answer]:
    """Nothing but the record: terms and family are found by the tool."""
    import allanite as al

    record = al.Recording.from_rate(q.axes[0], rate=q.rate, unit="rad/s")
    curve = al.allan_curve(record, threads=1)
    return _stated([al.fit(curve, confidence=level) for level in LEVELS], q)


def _likelihood(q: Question) -> dict[str, Answer]:
    import allanite as al

    record = al.Recording.from_rate(q.axes[0], rate=q.rate, unit="rad/s")
    fit: Any = al.fit
    return _stated([fit(record, method="likelihood", confidence=level) for level in LEVELS], q)


def _stated(models: list[Any], q: Question) -> dict[str, Answer]:
    """Estimates and sets; of the true family where the record leaves it open, as both are shown."""
    found: dict[str, Answer] = {}
    for symbol in ("N", "B", "K", "T"):
        name = "B_equiv" if symbol == "B" and "B_equiv" in q.terms else symbol
        bars, value = {}, None
        for level, model in zip(LEVELS, models, strict=True):
            e = _estimate(model, name) or (_estimate(model, "B_equiv") if symbol == "B" else None)
            if e is not None:
                value = e.value if e.supported else None
                bars[level] = (e.lower, e.upper)
        if bars:
            found[symbol] = Answer(value=value, intervals=bars)
    return found


def _estimate(model: Any, symbol: str) -> Any:
    for one in (model, model.alternative):
        e = None if one is None else one.estimate(symbol)
        if e is not None:
            return e
    return None


TOOLS = (
    Tool(
        name="allantools",
        package="allantools",
        how="oadev at octaves to a fifth of the record, read where the slope is -1/2, 0, +1/2; edf_greenhall "
        "for the noise that is read, confidence_interval",
        ask=_allantools,
    ),
    Tool(
        name="avar",
        package="avar",
        how="variance of the record without its mean; the true list of terms placed by the slope, strengths by its "
        "optimiser",
        ask=_avar,
    ),
    Tool(
        name="allan-variance",
        package="allan-variance",
        how="compute_avar and estimate_parameters with their defaults",
        ask=_allan_variance,
    ),
    Tool(name="allan_variance_ros", commit="1d54b60", how="its rule, rewritten", ask=_allan_variance_ros),
    Tool(name="imu_utils", commit="afd5cae", how="rule of the corrected fork, rewritten", ask=_imu_utils),
    Tool(
        name="kalibr_allan",
        commit="9d38ea9",
        how="its rule, rewritten, on the mean of three axes",
        ask=_kalibr_allan,
    ),
    Tool(name="allanite, moments", package="allanite", how="fit(allan_curve(record))", ask=_moments),
    Tool(
        name="allanite, likelihood",
        package="allanite",
        module="allanite.fitting.likelihood",
        how='fit(record, method="likelihood")',
        ask=_likelihood,
    ),
)
