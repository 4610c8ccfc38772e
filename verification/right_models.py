# SPDX-License-Identifier: BSD-3-Clause
"""What the doubt about models costs where a family is right: is slow noise still said, and how wide is N?

White noise alone or with what the families of a fit hold, by the fit of the curve. *Slow noise is said* where the
record supports a random walk, flicker or a Gauss-Markov term, or needs one of them and cannot tell which. The stated
correlation time of a supported K, *X*, holds if it lies below that of the true Gauss-Markov term. *Another slope than
1*: the set of power laws leaves flicker out, as it should beside a random walk and should not beside flicker.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.fitting import fit
from allanite.noise.allan import allan_curve
from allanite.recording.records import Recording
from verification.simulators import flicker, gauss_markov, random_walk
from verification.spread import Say, place_of, spread
from verification.wrong_models import LENGTHS

__all__ = ["RIGHT", "run_right_models"]

Json = dict[str, Any]
Draw = Callable[[np.random.Generator, int], NDArray[np.float64]]

_UNIT = 1e-4  # rad/s
_SLOW = {"B", "K", "sigma", "sigma_2"}

#: What stands beside white noise, and the correlation time of its slowest Gauss-Markov term.
RIGHT: dict[str, tuple[Draw, float | None]] = {
    "nothing": (lambda _, n: np.zeros(n), None),
    "random walk, corner at 577": (lambda rng, n: random_walk(rng, n, 0.003), None),
    "random walk, corner at 173": (lambda rng, n: random_walk(rng, n, 0.01), None),
    "flicker": (lambda rng, n: flicker(rng, n, 0.05), None),
    "flicker and random walk": (lambda rng, n: flicker(rng, n, 0.05) + random_walk(rng, n, 0.002), None),
    "Gauss-Markov of 100": (lambda rng, n: gauss_markov(rng, n, 0.15, 100.0), 100.0),
    "Gauss-Markov of 4000": (lambda rng, n: gauss_markov(rng, n, 0.4, 4000.0), 4000.0),
    "Gauss-Markov of 100 and random walk": (
        lambda rng, n: gauss_markov(rng, n, 0.15, 100.0) + random_walk(rng, n, 0.002),
        None,
    ),
}


def _one(root: int, case: int, n: int, i: int) -> Json:
    draw, T = list(RIGHT.values())[case]
    rng = np.random.default_rng([root, 62, case, n, i])
    y = _UNIT * (rng.standard_normal(n) + draw(rng, n))
    model = fit(allan_curve(Recording.from_rate(y, rate=1.0, unit="rad/s", names=["x"]), threads=1)["x"])
    named = [e for m in model.families for e in m.estimates]
    facts = model.goodness
    white = next(e for e in model.estimates if e.symbol == "N")
    low, high = (white.lower or 0.0) / _UNIT, white.upper / _UNIT
    walk = any(e.symbol == "K" and e.supported for e in named)
    return {
        "slow": any(e.symbol in _SLOW and (e.supported or e.needed) for e in named),
        "walk": walk,
        "X": None if T is None or not walk else facts.get("slow_time", np.inf) < T,
        "slope": not facts.get("slope_lower", 1.0) <= 1 <= facts.get("slope_upper", 1.0),
        "held": low <= 1 <= high,
        "width": high - low,
    }


def run_right_models(
    root: int, say: Say, records: int, workers: int, cache: Path | None = None
) -> list[Json]:
    """Every sum at every length."""
    return [_row(root, say, records, workers, cache, case, n) for case in range(len(RIGHT)) for n in LENGTHS]


def _row(root: int, say: Say, records: int, workers: int, cache: Path | None, case: int, n: int) -> Json:
    name = list(RIGHT)[case]
    place = place_of(cache, "right-models", name, n)
    results = spread(partial(_one, root, case, n), range(records), workers=workers, place=place)
    below = [r["X"] for r in results if r["X"] is not None]
    row = {
        "beside white noise": name,
        "samples": n,
        "records": records,
        "slow noise said": float(np.mean([r["slow"] for r in results])),
        "K supported": float(np.mean([r["walk"] for r in results])),
        "X below T": float(np.mean(below)) if below else None,
        "another slope than 1": float(np.mean([r["slope"] for r in results])),
        "N covered": float(np.mean([r["held"] for r in results])),
        "width of N, median": float(np.median([r["width"] for r in results])),
    }
    say(f"right {row}")
    return row
