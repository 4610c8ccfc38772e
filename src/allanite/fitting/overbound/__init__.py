# SPDX-License-Identifier: BSD-3-Clause
"""A noise model above the truth, for users who must not be optimistic.

``bounding``    overbound(curve, model): what a user calls.
``plausible``   curves that the record does not contradict.
``ensemble``    how they are drawn.
``envelope``    the least sum of terms above them.
``results``     bound_channels(curve, models): all channels of a study.
"""

from allanite.fitting.overbound.bounding import LETTERS, overbound
from allanite.fitting.overbound.results import BoundedChannel, BoundedTerm, Bounds, bound_channels

__all__ = ["LETTERS", "BoundedChannel", "BoundedTerm", "Bounds", "bound_channels", "overbound"]
