# SPDX-License-Identifier: BSD-3-Clause
"""A study as one self-contained HTML file: opens offline, prints, and reads without JavaScript.

``content``   what the page says, as plain data
``page.html`` how it is laid out; ``page.css`` and ``page.js`` are put into it
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from allanite.atomic_file import fresh

__all__ = ["html_of", "render"]

_HERE = Path(__file__).parent


def render(study: Any, path: str | os.PathLike[str], *, force: bool = False) -> Path:
    """Write the report of a study.

    Parameters
    ----------
    study : Study
        Or its document, as `Study.to_json` gives it.
    path : path
        Of the HTML file.
    force : bool
        Replace a file that is there.

    Returns
    -------
    Path
        Where the report is.

    Raises
    ------
    StorageError
        The file exists and `force` is not given, or the disk refuses.
    """
    with fresh(path, force=force) as place:
        place.write_text(html_of(study), encoding="utf-8")
    return Path(path)


def html_of(study: Any) -> str:
    """The page as text."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    from allanite.report import content

    document = study if isinstance(study, Mapping) else study.to_json()
    environment = Environment(
        loader=FileSystemLoader(_HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["power"] = content.with_powers
    return environment.get_template("page.html").render(
        **content.page(document),
        style=Markup((_HERE / "page.css").read_text(encoding="utf-8")),  # noqa: S704 - our own files
        script=Markup((_HERE / "page.js").read_text(encoding="utf-8")),  # noqa: S704
        plotly=Markup(_plotly_script()),  # noqa: S704
    )


def _plotly_script() -> str:
    """Plotly's script out of the installed package; text that would close its element is broken up."""
    import plotly

    script = (Path(plotly.__file__).parent / "package_data" / "plotly.min.js").read_text(encoding="utf-8")
    return script.replace("</script", "<\\/script")
