# SPDX-License-Identifier: BSD-3-Clause
"""Error bars of the Allan deviation itself: how often do they hold the truth? Records of 1024 samples."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import allanite as al
from allanite.noise import Flicker, NoiseModel, RandomWalk, White
from verification.scoreboard.contenders import LEVELS

__all__ = ["LAGS", "run_bars"]

Json = dict[str, Any]
Array = NDArray[np.float64]
Bars = Callable[[Array, NoiseModel], Array]

N = 1024
LAGS = (1, 4, 16, 64, 256)
MODELS = {
    "white": NoiseModel.of(White(N=1.0)),
    "flicker": NoiseModel.of(Flicker(B=1.0)),
    "random walk": NoiseModel.of(RandomWalk(K=1.0)),
}


def _allantools_default(y: Array, _: NoiseModel) -> Array:
    """What oadev returns as its error, taken as one standard deviation."""
    import allantools

    _, sigma, error, _ = allantools.oadev(y, rate=1.0, data_type="freq", taus=LAGS)
    factor = np.array([1.0, 1.959964])[:, None]
    return np.stack([sigma - factor * error, sigma + factor * error], axis=-1)


def _allantools_best(y: Array, _: NoiseModel) -> Array:
    """Noise identified by its own function, Greenhall's degrees of freedom, chi-square interval.

    Where fewer than 30 points are left it identifies nothing: the noise of the longest lag that was identified stays.
    """
    import allantools

    tau, sigma, _, _ = allantools.oadev(y, rate=1.0, data_type="freq", taus=LAGS)
    phase = allantools.frequency2phase(y, 1.0)
    out, alpha = np.empty((len(LEVELS), len(LAGS), 2)), 0
    for i, m in enumerate(np.rint(tau).astype(int)):
        with contextlib.suppress(NotImplementedError):
            found = allantools.autocorr_noise_id(phase, int(m), data_type="phase", dmin=0, dmax=2)[0]
            alpha = min(max(found, -2), 2)  # beyond, edf_greenhall stops
        edf = allantools.edf_greenhall(alpha, 2, int(m), len(phase), overlapping=True, modified=False)
        for k, level in enumerate(LEVELS):
            out[k, i] = allantools.confidence_interval(float(sigma[i]), edf, level)
    return out


def _allanite_curve(y: Array, _: NoiseModel) -> Array:
    """As it comes: the degrees of freedom of the power law that the curve follows locally."""
    record = al.Recording.from_rate(y, rate=1.0, unit="rad/s")
    curves = [al.allan_curve(record, taus=LAGS, confidence=level, threads=1) for level in LEVELS]
    return np.stack([np.column_stack([c.lower[:, 0], c.upper[:, 0]]) for c in curves])


def _allanite_model(y: Array, model: NoiseModel) -> Array:
    """With the model that made the record: exact degrees of freedom (a fitted model comes near it)."""
    record = al.Recording.from_rate(y, rate=1.0, unit="rad/s")
    curves = [
        al.allan_curve(record, taus=LAGS, confidence=level, threads=1).with_model(model) for level in LEVELS
    ]
    return np.stack([np.column_stack([c.lower[:, 0], c.upper[:, 0]]) for c in curves])


BARS: dict[str, Bars] = {
    "allantools, error of oadev": _allantools_default,
    "allantools, noise id + edf_greenhall": _allantools_best,
    "allanite, curve alone": _allanite_curve,
    "allanite, with model": _allanite_model,
}


def run_bars(records: int, seed: int, say: Callable[[str], None]) -> list[Json]:
    """Coverage of both levels at each lag, one row for each noise and kind of bar."""
    rows = []
    for number, (name, model) in enumerate(MODELS.items()):
        truth = np.sqrt(model.avar_sampled(np.array(LAGS), 1.0))
        inside = {kind: np.zeros((len(LEVELS), len(LAGS))) for kind in BARS}
        for i in range(records):
            made = int(np.random.SeedSequence([seed, 6, number, i]).generate_state(1, np.uint64)[0])
            y = al.simulate(model, rate=1.0, duration=float(N), seed=made).values("gyro")
            for kind, bars in BARS.items():
                with contextlib.redirect_stdout(io.StringIO()):
                    low, high = np.moveaxis(bars(y, model), -1, 0)
                inside[kind] += (low <= truth) & (truth <= high)
        for kind, held in inside.items():
            share = held / records
            row = {"noise": name, "bar": kind, "records": records}
            for k, level in enumerate(LEVELS):
                row |= {
                    f"{round(100 * level)} %, m = {m}": float(s) for m, s in zip(LAGS, share[k], strict=True)
                }
            rows.append(row)
        say(f"scoreboard, bars of the curve, {name}: {records} records")
    return rows
