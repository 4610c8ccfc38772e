# SPDX-License-Identifier: BSD-3-Clause
"""What records are like: one NaN, an overload, float32 on a level, holes. Deviation against that of the clean record.

Only the Python packages are asked: the programs of the Robot Operating System read messages of doubles. Each outcome is
the largest relative error over the lags, or what the tool said instead; ours is told nothing and warned of nothing.
"""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import allanite as al
from verification.scoreboard.contenders import TOOLS

__all__ = ["run_hardships"]

Json = dict[str, Any]
Array = NDArray[np.float64]
Deviation = Callable[[NDArray[Any]], Array]

N = 200_000
LAGS = np.array([1, 10, 100, 1000, 10_000])


# -- contenders: samples in, deviation at LAGS out ---------------------------------------------------------------


def _allantools(y: NDArray[Any]) -> Array:
    import allantools

    tau, sigma, _, _ = allantools.oadev(y, rate=1.0, data_type="freq", taus=LAGS.astype(float))
    return _at_lags(tau, sigma)


def _gradev(y: NDArray[Any]) -> Array:
    """Its deviation for records with holes, on the phase, whose holes are those of the samples."""
    import allantools

    phase = np.concatenate([[0.0], np.nancumsum(y - np.nanmean(y))])
    phase[1:][np.isnan(y)] = np.nan
    tau, sigma, _, _ = allantools.gradev(phase, rate=1.0, data_type="phase", taus=LAGS.astype(float))
    return _at_lags(tau, sigma)


def _at_lags(tau: Array, sigma: Array) -> Array:
    """A tool may leave lags out."""
    out = np.full(len(LAGS), np.nan)
    out[np.searchsorted(LAGS, np.rint(tau))] = sigma
    return out


def _avar(y: NDArray[Any]) -> Array:
    import avar

    return np.asarray(np.sqrt(avar.variance(y, LAGS)))


def _allan_variance(y: NDArray[Any]) -> Array:
    """It chooses its own lags: one call for each of ours."""
    import allan_variance

    each = [allan_variance.compute_avar(y, tau_min=m, tau_max=m, n_clusters=1)[1][0] for m in LAGS.tolist()]
    return np.sqrt(each)


def _allanite(y: NDArray[Any]) -> Array:
    """As `characterize` goes: the record is checked, what is no sample is left out, and what is fatal refuses."""
    record = al.Recording.from_rate(y, rate=1.0, unit="V")
    study = al.characterize(record, taus=LAGS.astype(float), threads=1)
    curve = study["signal"].curve
    out = np.full(len(LAGS), np.nan)
    out[np.searchsorted(LAGS, curve.lags)] = curve.deviation
    return out


CONTENDERS: dict[str, tuple[str, Deviation]] = {
    "allantools, oadev": ("allantools", _allantools),
    "allantools, gradev": ("allantools", _gradev),
    "avar": ("avar", _avar),
    "allan-variance": ("allan-variance", _allan_variance),
    "allanite": ("allanite", _allanite),
}


# -- records -----------------------------------------------------------------------------------------------------


def _records(seed: int) -> dict[str, tuple[NDArray[Any], Array]]:
    """Damaged record and clean record, by the name of the damage."""
    rng = np.random.default_rng([seed, 7])
    white = rng.standard_normal(N)
    both = white + np.cumsum(rng.standard_normal(N)) * 0.01
    one, overload = both.copy(), both.copy()
    one[777], overload[777] = np.nan, 9.9e37
    stuck = both + 20.0
    stuck[50_000:51_000] = 0.0
    level = 2.5 + 1e-6 * white
    counts = np.round(20.0 * white + 1000.0)
    scattered, blocks = both.copy(), both.copy()
    scattered[rng.random(N) < 0.1] = np.nan
    for start in rng.choice(N // 2000, 40, replace=False) * 2000:
        blocks[start : start + 2000] = np.nan
    return {
        "one NaN": (one, both),
        "one overload, 9.9e37": (overload, both),
        "a thousand zeros at a level of 20 sigma": (stuck, both + 20.0),
        "float32, 1 µV on 2.5 V": (level.astype(np.float32), level),
        "uint16 counts": (counts.astype(np.uint16), counts),
        "10 % missing here and there": (scattered, both),
        "40 % missing in blocks": (blocks, both),
        "40 % missing in blocks, closed up": (blocks[~np.isnan(blocks)], both),
    }


def run_hardships(seed: int) -> list[Json]:
    """One row for each damage; a column for each contender that is installed."""
    from importlib.metadata import PackageNotFoundError

    able = {}
    for name, (package, call) in CONTENDERS.items():
        with contextlib.suppress(PackageNotFoundError):
            if next(t for t in TOOLS if t.package == package).version:
                able[name] = call
    rows = []
    for damage, (y, clean) in _records(seed).items():
        truth = _exact(clean)
        row: Json = {"record": damage}
        for name, call in able.items():
            row[name] = _outcome(call, y, truth)
        rows.append(row)
    return rows


def _exact(y: Array) -> Array:
    """Of the clean record, in extended precision."""
    x = np.concatenate([[0.0], np.cumsum(y.astype(np.longdouble) - y.astype(np.longdouble).mean())])
    return np.array(
        [float(np.sqrt(np.mean((x[2 * m :] - 2 * x[m:-m] + x[: -2 * m]) ** 2) / 2) / m) for m in LAGS]
    )


def _outcome(call: Deviation, y: NDArray[Any], truth: Array) -> str:
    try:
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            sigma = call(y)
    except al.AllaniteError as refusal:
        return f"refuses: {_first_sentence(str(refusal))}"
    except Exception as failure:  # noqa: BLE001 (what a contender raises is a result)
        return f"{type(failure).__name__}: {_first_sentence(str(failure))}"
    error = sigma / truth - 1
    if np.isnan(error).all():
        return "none at any lag (NaN)"
    worst = int(np.nanargmax(np.abs(error)))
    text = f"{error[worst]:+.1%}" if abs(error[worst]) < 10 else f"×{sigma[worst] / truth[worst]:.1e}"
    text += f" at m = {LAGS[worst]}"
    return text + (
        f", none at {int(np.isnan(error).sum())} of {len(LAGS)} lags" if np.isnan(error).any() else ""
    )


def _first_sentence(text: str) -> str:
    return text.split("\n")[0].split(". ")[0][:90].replace("|", "/") or "no text"
