# SPDX-License-Identifier: BSD-3-Clause
"""Are the turns found? Random twins of the four takes, and twins at rest.

Bar: at least 99.5 % of the turns found, and no turn in 99 % of the twins at rest. One turn that is lost or invented
reverses all that follows, which the Earth rate's own check of the order of the turns has to see; takes with a wrong
direction are counted.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from allanite.experiments.reversals import Reversals, find_reversals
from allanite.filtering.simulation import Motion, simulate
from allanite.recording.records import Recording
from allanite_seed_paper import twin as seed_paper

__all__ = ["compared", "random_take", "run"]

Json = dict[str, Any]
DEGREE = math.pi / 180
FAULTS = ("settling", "coherent", "drift")
RECALL, STATIC = 0.995, 0.99


def run(count: int, seed: int) -> Json:
    """Find the turns of `count` twins of takes 1 to 4 in turn, and of `count` twins at rest."""
    takes = [compared(random_take(1 + i % 4, (seed, i))) for i in range(count)]
    static = [find_reversals(_at_rest(i, seed + i)) for i in range(count)]
    turns, found = sum(t["turns"] for t in takes), sum(t["found"] for t in takes)
    quiet = sum(r.static for r in static)
    row = {
        "takes": count,
        "turns": turns,
        "found": found,
        "false": sum(t["false"] for t in takes),
        "takes_with_wrong_direction": sum(t["wrong"] > 0 for t in takes),
        "takes_with_moving_samples_used": sum(t["moving"] > 0 for t in takes),
        "share_used": round(float(np.mean([t["used"] for t in takes])), 4),
        "static": count,
        "static_without_turns": quiet,
    }
    row["passes"] = bool(found >= RECALL * turns and quiet >= STATIC * count)
    return row


def random_take(number: int, seed: tuple[int, int]) -> Recording:
    """A take whose operator, converter and faults are drawn anew: turns that clip or do not, dwells that vary, turns
    that are forgotten or made twice."""
    chance = np.random.default_rng(seed)
    full_scale = chance.choice([30.0, 60.0, 110.0, 1000.0]) * DEGREE
    even = np.full(60, 30.0)
    doubled = np.where(np.arange(60) == chance.integers(5, 20), 8.0, 30.0)
    uneven = np.exp(chance.uniform(math.log(10.0), math.log(120.0), size=60))
    missed = (int(chance.integers(3, 20)),) if chance.integers(3) == 0 else ()
    return seed_paper.take(
        number,
        int(chance.integers(1 << 30)),
        flicker=bool(chance.integers(2)),
        faults=[f for f in FAULTS if chance.integers(2)],
        dwell=[even, even, doubled, uneven][int(chance.integers(4))],
        dwell_sd=float(chance.choice([0.0, 1.0])),
        missed=missed,
        overload=str(chance.choice(["clip", "nan", "1e38"])),
        full_scale=float(full_scale),
        onward=bool(chance.integers(2)),
        pointing_sd=0.03,
        knocks_per_hour=float(chance.choice([0.0, 10.0])),
        unsteadiness=float(chance.choice([0.03, 0.1])),
    )


def compared(recording: Recording, found: Reversals | None = None) -> Json:
    """Turns and directions found against the truth in the recording's history.

    Returns
    -------
    dict
        turns: true ones; found: those that a single found turn covers, but for 0.1 s at each end; false: turns found
        that touch no true one; wrong: samples counted against their direction; moving: samples of a true turn that
        are used; used: share of the record that is used.
    """
    reversals = find_reversals(recording) if found is None else found
    truth, rate = recording.history[-1]["motion"], recording.rate
    signs = reversals.signs()
    spans = np.array([(t.start, t.stop) for t in reversals.turns], dtype=np.float64).reshape(-1, 2) / rate
    true = np.array([(t["start"], t["stop"]) for t in truth["turns"]]).reshape(-1, 2)
    wrong = moving = 0
    for p in truth["positions"]:
        part = signs[round(p["start"] * rate) : round(p["stop"] * rate)]
        wrong += int((part * math.cos(p["heading"]) < 0.0).sum())
    for a, b in true:
        moving += int((signs[math.floor(a * rate) : math.ceil(b * rate)] != 0).sum())
    return {
        "turns": len(true),
        "found": sum(bool(((spans[:, 0] <= a + 0.1) & (spans[:, 1] >= b - 0.1)).any()) for a, b in true),
        "false": sum(not ((true[:, 0] < b) & (true[:, 1] > a)).any() for a, b in spans),
        "wrong": wrong,
        "moving": moving,
        "used": float((signs != 0).mean()),
    }


def _at_rest(index: int, seed: int) -> Recording:
    """As long as one of the takes, with its noise, a warm-up and a knock now and then, but never turned."""
    return simulate(
        seed_paper.sensor(flicker=bool(index % 2)),
        rate=seed_paper.RATE,
        duration=seed_paper.TAKES[1 + index % 4].duration,
        seed=seed,
        unit="deg/s",
        motion=Motion.still(knocks_per_hour=5.0 * (index % 3)),
        latitude=seed_paper.LATITUDE,
        warm_up=(1.0 * DEGREE, 300.0),
    )
