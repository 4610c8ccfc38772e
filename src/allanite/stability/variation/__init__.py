# SPDX-License-Identifier: BSD-3-Clause
"""Does the noise change during the record? The Allan deviation over time and lag (dynamic Allan variance).

``estimation``  examine_variation(recording): what a user calls.
``constancy``   cube roots of the windows' variances, whitened: one lag, all lags, one window.
``changes``     the search for changes, and how often chance makes one as clear.
``sizes``       time and size of a change by maximum likelihood.
``shapes``      steps and drifts of one noise term, and what they do to every window.
``results``     Variation and what it is made of; ``verdict`` what it may come to, ``words`` says it in a sentence.
``remarks``     what a reader must know besides.
"""

from allanite.stability.variation.estimation import examine_variation
from allanite.stability.variation.results import Change, ChannelVariation, LagTest, Variation
from allanite.stability.variation.verdict import VariationVerdict

__all__ = ["Change", "ChannelVariation", "LagTest", "Variation", "VariationVerdict", "examine_variation"]
