# SPDX-License-Identifier: BSD-3-Clause
"""What a record supports, in a sentence: the same words whatever the estimator."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.noise import NoiseModel
from allanite.plain_files.counted import listed

__all__ = ["supported_words"]

_NAMES = {
    "Q": "quantisation",
    "N": "white noise",
    "B": "flicker",
    "sigma": "a Gauss-Markov term",
    "sigma_2": "a second Gauss-Markov term",
    "K": "random walk",
    "R": "ramp",
}


def supported_words(models: Sequence[NoiseModel]) -> str:
    """Terms that are supported, those that are needed but not resolved, and whether the family is open.

    Parameters
    ----------
    models : sequence of NoiseModel
        One, or both families where the record cannot decide.
    """
    named = [e for e in models[0].estimates if e.symbol in _NAMES]
    supported = [_NAMES[e.symbol] for e in named if e.supported]
    text = (
        f"the record supports {listed(supported)}." if supported else "the record supports no term by itself."
    )
    needed = [_NAMES[e.symbol] for e in named if e.needed]
    if needed:
        text += f" It needs {listed(needed)} or a term like it, and cannot tell which."
    if len(models) == 2:
        text += " It cannot tell flicker from a single Gauss-Markov term: both are shown."
    return text
