# SPDX-License-Identifier: BSD-3-Clause
"""Which view shows which result. To add a result: one line here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module

from allanite.quantities.result import Result
from allanite.study.result_document import ResultDocument, read_document
from allanite.views.blocks import Page

__all__ = ["VIEWS", "document_of", "view_of"]

#: Format of a document -> where its result is defined, its name there, and the module whose `view` shows it.
VIEWS: Mapping[str, tuple[str, str, str]] = {
    "allanite-variation": ("allanite.stability.variation", "Variation", "allanite.views.variation"),
    "allanite-earth-rate": (
        "allanite.experiments.earth_rate",
        "EarthRateEstimate",
        "allanite.views.earth_rate",
    ),
}


def document_of(data: Mapping[str, object]) -> ResultDocument[Result]:
    """The document of a result that has a view, out of plain data.

    Raises
    ------
    FormatError
        As for `Result.from_json`.
    """
    module, name, _ = VIEWS[str(data["format"])]
    kind: type[Result] = getattr(import_module(module), name)
    return read_document(kind, data)


def view_of(document: ResultDocument[Result]) -> Page:
    """The page of a result."""
    view: Callable[[ResultDocument[Result]], Page] = import_module(VIEWS[document.result.FORMAT][2]).view
    return view(document)
