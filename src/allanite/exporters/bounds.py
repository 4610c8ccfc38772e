# SPDX-License-Identifier: BSD-3-Clause
"""What the file of a consumer says of a model that was inflated.

To lie above the sensor: `allanite.fitting.overbound`; for a sensor in motion: `allanite.stability.in_motion`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.errors import InputError
from allanite.exporters.triads import plain_line
from allanite.noise.motion import MotionInflation

__all__ = ["bound_comments", "motion_comments", "refuse_terms"]

Json = Mapping[str, Any]


def bound_comments(name: str, models: Sequence[Json]) -> list[str]:
    """Lines on the inflation of a channel's models; none where nothing is inflated."""
    lines = []
    for facts in (m["overbound"] for m in models if m.get("overbound")):
        factors = ", ".join(
            f"{symbol} ADDED, not in the fit" if factor is None else f"{symbol} x {factor:.4g}"
            for symbol, factor in facts["factors"].items()
        )
        promise = f"with probability {100 * facts['probability']:g} % the Allan deviation of these terms"
        size = f"{facts['mean']:.4g} times its deviation on average over the logarithm of time"
        lines += [
            f"{name}: INFLATED: {promise} lies above that of the sensor",
            f"{name}: everywhere from {facts['shortest']:.4g} to {facts['horizon']:.4g} s",
            f"{name}: inflation of the fit: {factors}; {size}, {facts['greatest']:.4g} times at most",
        ]
    return lines


def motion_comments(name: str, models: Sequence[Json]) -> list[str]:
    """Lines on what motion adds to a channel's models, and why; none of a model at rest."""
    facts = dict.fromkeys(MotionInflation.from_json(m["in_motion"]) for m in models if m.get("in_motion"))
    return [f"{name}: {plain_line(reason)}" for one in facts for reason in one.reasons]


def refuse_terms(name: str, models: Sequence[Json], able: Sequence[str]) -> None:
    """Raise if a bound holds a term that the file would leave out or change: it would be no bound any more.

    Raises
    ------
    InputError
        Says of which terms to make it.
    """
    letters = {"quantisation": "Q", "white": "N", "flicker": "B", "random_walk": "K", "ramp": "R"}
    for model in models:
        if not model.get("overbound"):
            continue
        wrong = [t["type"] for t in model["terms"] if letters.get(t["type"]) not in able]
        if wrong:
            raise InputError(
                f"the bound of {name!r} holds a term ({wrong[0].replace('_', ' ')}) that this file cannot: make it of "
                f"what it can, overbound(..., terms={tuple(able)!r})"
            )
