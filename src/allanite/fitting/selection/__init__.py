# SPDX-License-Identifier: BSD-3-Clause
"""Which sum of terms does a record support, and how sure is that?

``search``      sets of terms, what a term costs, and the best set by steps.
``lines``       which spectral lines pay their price.
``averaging``   parameters with what is open about the set.
``results``     Selection and its candidates; TermSelection, what a document holds; ``verdict`` what it may come to.
``estimation``  select(recording): what a user calls.
"""

from __future__ import annotations

from allanite.fitting.likelihood.lines import line_price
from allanite.fitting.selection.estimation import select
from allanite.fitting.selection.results import Candidate, ChosenLine, Selection, TermSelection
from allanite.fitting.selection.search import PRICE

__all__ = ["PRICE", "Candidate", "ChosenLine", "Selection", "TermSelection", "line_price", "select"]
