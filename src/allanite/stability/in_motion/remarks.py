# SPDX-License-Identifier: BSD-3-Clause
"""What a reader must know of noise in motion besides the verdict."""

from __future__ import annotations

from collections.abc import Iterator

from allanite.stability.in_motion import words
from allanite.stability.in_motion.results import InMotion

__all__ = ["remarks"]


def remarks(result: InMotion) -> Iterator[str]:
    """Sentences, the most important first."""
    yield words.UPPER_LIMIT
    if not result.fixed:
        yield words.moving_sentence(result.above)
    for log in result.logs:
        yield from (f"{log.name}: {fault}" for fault in log.faults)
    if unsteady := [f"{c.name} in {c.log}" for c in result.channels if not c.steady]:
        yield words.unsteady_sentence(unsteady)
    for channel in result.channels:
        for comb in channel.combs:
            yield f"{channel.name}: {words.comb_sentence(comb.fundamental, comb.orders)}"
    if any(line.aliases for c in result.channels for line in c.lines if not line.at_rest):
        yield words.MAY_BE_ALIAS
