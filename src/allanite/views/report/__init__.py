# SPDX-License-Identifier: BSD-3-Clause
"""A result as one self-contained HTML file: opens offline, prints, and reads without JavaScript.

What the page of a result says, its view says.

``frame.html``
    How every page is laid out; ``sections.html`` fills it, ``page.css`` and ``page.js`` are put into it.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from allanite.errors import AllaniteError, FormatError, InputError
from allanite.plain_files.atomic_file import fresh
from allanite.plain_files.json_values import load_plain
from allanite.quantities.result import Result
from allanite.study.result_document import ResultDocument
from allanite.study.study import Study
from allanite.views.blocks import Page, figures_of
from allanite.views.figures import screen
from allanite.views.registry import VIEWS, document_of
from allanite.views.result_page import view_of

__all__ = ["html_of", "page_of", "render", "render_file"]

_HERE = Path(__file__).parent


def render(
    result: Any, path: str | os.PathLike[str], *, force: bool = False, beside: Sequence[str] = ()
) -> Path:
    """Write the report of a result.

    Parameters
    ----------
    result : Study, EarthRateEstimate, RateVector, NorthEstimate, CalibrationEstimate, Filtered, Plan, ...
        Or its document, as `to_json` gives it, or a `Page` of your own.
    path : path
        Path of the HTML file.
    force : bool
        Replace a file that is there.
    beside : sequence of str
        Names of files in the folder of the report, or below it; the report links to them.

    Returns
    -------
    Path
        Path of the report.

    Raises
    ------
    InputError
        Nothing that has a report.
    StorageError
        The file exists and `force` is not given, or the disk refuses.
    """
    with fresh(path, force=force) as place:
        place.write_text(html_of(result, beside), encoding="utf-8")
    return Path(path)


def html_of(result: Any, beside: Sequence[str] = ()) -> str:
    """The page as text, with links to the files `beside` it."""
    files = [name for name in beside if "/" not in name]
    return _filled("sections.html", {**_content(page_of(result)), "beside": beside, "files": files})


def page_of(result: Any) -> Page:
    """What the report of a result says.

    Raises
    ------
    InputError
        Nothing that has a report.
    """
    if isinstance(result, Page):
        return result
    if isinstance(result, (ResultDocument, Study)):
        return view_of(result)
    held = getattr(result, "result", result)  # what computes may hold more than its document
    if isinstance(held, Result):
        return view_of(ResultDocument(result=held))
    document = result if isinstance(result, Mapping) else _document(result)
    name = document.get("format")
    if name not in VIEWS:
        raise InputError(f"no report of {name!r}; there are those of {', '.join(VIEWS)}")
    return view_of(document_of(document))


def _content(page: Page) -> dict[str, Any]:
    """What ``sections.html`` needs."""
    figures = {f.id: f.spec for f in figures_of(page.blocks())}
    return {
        "title": page.title,
        "kicker": page.kicker,
        "facts": page.facts,
        "sections": page.sections,
        "figures": figures,
    }


def render_file(source: str | os.PathLike[str], path: str | os.PathLike[str], *, force: bool = False) -> Path:
    """Write the report of a document that allanite wrote: a study, or the JSON of any other result.

    Raises
    ------
    InputError
        No such file.
    FormatError
        Not JSON, no document of a result, a later version, or parts that are missing.
    StorageError
        As for `render`.
    """
    document = _loaded(Path(source))
    try:
        page = html_of(document)
    except AllaniteError:
        raise
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise FormatError(f"{source}: this {document['format']} is damaged: {what}") from error
    with fresh(path, force=force) as place:
        place.write_text(page, encoding="utf-8")
    return Path(path)


def _loaded(path: Path) -> Mapping[str, Any]:
    document = load_plain(
        path, "a result of allanite, study.json of 'allanite characterize LOG' or what another --out holds"
    )
    name = document.get("format") if isinstance(document, Mapping) else None
    if name not in VIEWS:
        names = ", ".join(known.removeprefix("allanite-") for known in VIEWS)
        stated = "it names no format" if name is None else f"its format is {name!r}"
        raise FormatError(f"{path} is no result of allanite: {stated}; there are reports of {names}")
    return dict(document)


def _document(result: Any) -> Mapping[str, Any]:
    if not hasattr(result, "to_json"):
        raise InputError(f"no report of a {type(result).__name__}: give a result, or its document")
    return dict(result.to_json())


def _filled(template: str, content: Mapping[str, Any]) -> str:
    from markupsafe import Markup

    from allanite.views.report.templates import templates

    return (
        templates()
        .get_template(template)
        .render(
            **content,
            style=Markup(screen.style() + (_HERE / "page.css").read_text(encoding="utf-8")),  # noqa: S704 - our own files
            script=Markup((_HERE / "page.js").read_text(encoding="utf-8")),  # noqa: S704 - as above
            chart=Markup(screen.script()),  # noqa: S704 - as above
        )
    )
