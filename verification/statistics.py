# SPDX-License-Identifier: BSD-3-Clause
"""Intervals of Theo1, TheoBR, ThêoH, Haar and the robust variance: 68.27 % coverage, what they gain, what they resist.

Records of 1024 samples. Theo1 is held against its own expectation, the others against the Allan variance.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import allanite as al
from allanite.noise import NoiseModel, White
from allanite.noise.allan import covariance, robust, theo_covariance
from allanite.noise.allan.degrees import shifted_factors
from allanite.noise.allan.robust import m_estimates
from allanite.noise.allan.statistics import STATISTICS, complete_runs, phase_of, sums_of_squares
from allanite.noise.allan.theo import sums_of_inner_squares
from allanite.recording.records import Recording
from verification.curves import LEVEL, MODELS, N
from verification.gates import at_least, at_most

__all__ = ["run_alone", "run_bias", "run_coverage", "run_gain", "run_gaps", "run_outliers"]

Json = dict[str, Any]
Array = NDArray[np.float64]
Lags = NDArray[np.int64]
Say = Callable[[str], None]

#: TheoBR takes the ratio of long windows, so its short lags keep the bias of theirs: they are not shown.
LAGS = {
    "haar": (1, 4, 16, 64, 128),
    "robust": (1, 4, 16, 64, 128),
    "theo1": (10, 32, 128, 512, 1024),
    "theobr": (64, 128, 256, 512, 1024),
}
#: Row U3: chi-square is never narrow, and at most so much too wide.
_WIDE = 0.0118


def _records(model: NoiseModel, runs: int, seed: int) -> Array:
    drawn = al.simulate(model, rate=1.0, duration=float(N * runs), seed=seed)
    return drawn.values("gyro").reshape(runs, N)


def _estimates(name: str, y: Array, lags: Lags) -> Array:
    """Variance of each record at each lag, shape (runs, n_lags)."""
    of = STATISTICS[name]
    out = np.empty((len(y), len(lags)))
    for row, samples in zip(out, y, strict=True):
        phase = phase_of(Recording.from_rate(samples, rate=1.0, unit="rad/s"), "signal")
        if of.theo:
            row[:] = sums_of_inner_squares(phase, of, lags, 1)[0]
        elif of.robust:
            row[:] = m_estimates(phase, lags, 1)[0]
        else:
            row[:] = sums_of_squares(phase, of, lags, 1)[0]
    return out


def _law(name: str, model: NoiseModel, lags: Lags) -> tuple[Array, Array, Array]:
    """True variance, degrees of freedom and shape under the model."""
    of, args = STATISTICS[name], (model, lags, N, 1.0, "mean")
    if not of.theo:
        truth = model.avar_sampled(lags, 1.0) * (0.5 if of.halved else 1.0)
        edf = robust.edf(*args) if of.robust else covariance.edf(*args)
        return truth, edf, edf
    edf = theo_covariance.edf_theobr(*args) if of.unbiased else theo_covariance.edf_theo1(*args)
    shape = edf * theo_covariance.shapes(*args)
    if of.unbiased:
        return np.array([model.avar_sampled(0.75 * float(m), 1.0) for m in lags]), edf, shape
    return theo_covariance.mean(model, lags, 1.0, "mean"), edf, shape


def run_coverage(name: str, seed: int, say: Say, runs: int) -> list[Json]:
    """Coverage of the intervals of one statistic under the true model, a row for each noise."""
    rows, lags = [], np.array(LAGS[name], dtype=np.int64)
    low, high = at_least(runs, LEVEL), at_most(runs, LEVEL + _WIDE)
    cells = {
        "gate": [low.low, high.high],
        "rejects": f"{low.columns()['rejects']}, {high.columns()['rejects']}",
    }
    for k, (noise, model) in enumerate(MODELS.items()):
        truth, edf, shape = _law(name, model, lags)
        found = _estimates(name, _records(model, runs, seed + 100 * k), lags)
        factors = shifted_factors(edf, shape, LEVEL)
        there = np.isfinite(found)
        inside = (found * factors[0] ** 2 <= truth) & (truth <= found * factors[1] ** 2)
        share = inside.sum(axis=0) / there.sum(axis=0)
        # The ratio of the short lags is not that of the long ones where the noise changes its kind.
        gated = not (name == "theobr" and noise.startswith("Gauss"))
        passes = low.holds(*share) and high.holds(*share) if gated else None
        row = {
            "noise": noise,
            "records": runs,
            **{f"m = {m}": round(float(s), 4) for m, s in zip(lags, share, strict=True)},
        }
        row["mean over truth"] = [round(float(v), 3) for v in np.nanmean(found, axis=0) / truth]
        if not there.all():
            row["without a value"] = [round(float(v), 4) for v in 1 - there.mean(axis=0)]
        rows.append({**row, **(cells if gated else {}), "passes": passes})
        say(f"{name}, {noise}: {share.round(4).tolist()}")
    return rows


def run_gaps(seed: int, say: Say, runs: int) -> list[Json]:
    """Coverage under the model with a tenth of the samples missing, in blocks of 51 (row U13)."""
    missing = np.array([[128 * i + 40, 128 * i + 91] for i in (1, 6)], dtype=np.int64)
    rows, gate = [], at_least(runs, LEVEL)
    for k, (noise, model) in enumerate(MODELS.items()):
        y = _records(model, runs, seed + 100 * k + 25).copy()
        for first, last in missing:
            y[:, first:last] = np.nan
        for name, lags in (("robust", np.array([1, 4, 16, 64])), ("theo1", np.array([10, 32, 64, 128]))):
            of = STATISTICS[name]
            starts = [complete_runs(of, int(m), missing, N, False) for m in lags]
            if of.theo:
                truth = theo_covariance.mean(model, lags, 1.0, "mean")
                edf = theo_covariance.edf_theo1(model, lags, N, 1.0, "mean", starts)
                shape = edf * theo_covariance.shapes(model, lags, N, 1.0, "mean")
            else:
                truth = model.avar_sampled(lags, 1.0)
                shape = edf = robust.edf(model, lags, N, 1.0, "mean", starts)
            found = _estimates(name, y, lags)
            low, high = shifted_factors(edf, shape, LEVEL)
            inside = (found * low**2 <= truth) & (truth <= found * high**2)
            share = inside.sum(axis=0) / np.isfinite(found).sum(axis=0)
            rows.append(
                {"noise": noise, "statistic": name, "records": runs,
                 **{f"m = {m}": round(float(s), 4) for m, s in zip(lags, share, strict=True)},
                 **gate.columns(), "passes": gate.holds(*share)}
            )  # fmt: skip
            say(f"gaps, {noise}, {name}: {share.round(3).tolist()}")
    return rows


def run_alone(seed: int, say: Say, runs: int) -> list[Json]:
    """Coverage of the intervals that a curve has by itself, from the power law it follows: all lags together."""
    rows = []
    for k, (noise, model) in enumerate(MODELS.items()):
        y = _records(model, runs, seed + 100 * k + 50)
        for name in ("oadev", "haar", "robust", "theo1", "theobr", "theoh"):
            inside = tau = None
            for samples in y:
                curve = al.allan_curve(
                    Recording.from_rate(samples, rate=1.0, unit="rad/s"),
                    statistic=name, confidence=LEVEL, threads=1,
                )  # fmt: skip
                if inside is None:
                    tau, inside = curve.tau, np.zeros(len(curve.tau))
                    truth = np.sqrt(_truth(name, model, curve.lags, curve.tau))
                inside += (curve.lower[:, 0] <= truth) & (truth <= curve.upper[:, 0])
            assert inside is not None
            assert tau is not None
            share = inside / runs
            rows.append(
                {"noise": noise, "statistic": name, "records": runs, "least": float(share.min()),
                 "at tau": float(tau[share.argmin()]), "most": float(share.max()), "mean": float(share.mean())}
            )  # fmt: skip
            say(f"alone, {noise}, {name}: {share.min():.3f} to {share.max():.3f}")
    return rows


def _truth(name: str, model: NoiseModel, lags: Lags, tau: Array) -> Array:
    if name == "theo1":
        return theo_covariance.mean(model, lags, 1.0, "mean")
    half = 0.5 if name == "haar" else 1.0
    return half * np.array([model.avar_sampled(float(t), 1.0) for t in tau])


def run_gain() -> list[Json]:
    """Degrees of freedom at equal averaging time."""
    rows = []
    for noise, model in MODELS.items():
        for m in (32, 128, 512, 1024):
            tau = round(0.75 * m)
            plain = covariance.edf(model, [tau], N, 1.0, "mean")[0] if tau <= N // 2 else None
            args = (model, [m], N, 1.0, "mean")
            rows.append(
                {"noise": noise, "tau over record": 0.75 * m / N, "oadev": plain,
                 "theo1": theo_covariance.edf_theo1(*args)[0], "theobr": theo_covariance.edf_theobr(*args)[0]}
            )  # fmt: skip
    return rows


def run_bias() -> list[Json]:
    """Allan variance over the expected Theo1 at equal averaging time."""
    rows = []
    for noise, model in MODELS.items():
        lags = (10, 32, 100, 1000, 100_000)
        bias = theo_covariance.theo1_bias(model, lags, 1.0, "mean")
        rows.append(
            {"noise": noise, **{f"m = {m}": round(float(b), 4) for m, b in zip(lags, bias, strict=True)}}
        )
    return rows


def run_outliers(seed: int, say: Say, runs: int) -> list[Json]:
    """White noise of which some samples are displaced: variance over truth."""
    rng, rows, size = np.random.default_rng(seed), [], 10_000
    lags = np.array([1, 4, 16, 64], dtype=np.int64)
    truth = NoiseModel.of(White(N=1.0)).avar_sampled(lags, 1.0)
    for share in (0.0, 0.001, 0.01):
        for height in (5.0, 50.0) if share else (0.0,):
            y = rng.standard_normal((runs, size))
            hit = rng.random(y.shape) < share
            y[hit] += height * rng.choice([-1.0, 1.0], size=int(hit.sum()))
            row: Json = {"displaced": f"{share:.1%}", "by (sd)": height}
            for name in ("oadev", "robust"):
                ratio = np.nanmean(_estimates(name, y, lags), axis=0) / truth
                row |= {f"{name}, m = {m}": round(float(r), 3) for m, r in zip(lags, ratio, strict=True)}
            rows.append(row)
            say(f"outliers: {row}")
    return rows
