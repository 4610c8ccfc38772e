# SPDX-License-Identifier: BSD-3-Clause
"""The page itself: its template, its few files, and the script of Plotly out of the installed package.

What can be served is read into a table when the server starts; a request only looks up a name in it.
"""

from __future__ import annotations

import gzip
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

from allanite.commands.page.settings import Settings

__all__ = ["StaticFiles"]

_HERE = Path(__file__).parent
_TYPES: Mapping[str, str] = {
    ".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8", ".svg": "image/svg+xml",
    ".png": "image/png", ".woff2": "font/woff2", ".ico": "image/x-icon",
}  # fmt: skip
_FOR_EVER = "private, max-age=31536000, immutable"


@dataclass(slots=True)
class StaticFiles:
    """All files of the page."""

    settings: Settings
    plotly: str = field(init=False)
    _files: dict[str, tuple[bytes, str, str]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        from importlib.metadata import version

        self.plotly = f"/plotly-{version('plotly')}.min.js"
        self._files = {}
        for path in sorted((_HERE / "static").glob("*")):
            if path.is_file() and path.suffix in _TYPES:
                content = path.read_bytes()
                mark = f'"{hashlib.sha256(content).hexdigest()[:24]}"'
                self._files[path.name] = (content, _TYPES[path.suffix], mark)

    def page(self) -> Response:
        """The page, with the secret that its requests need."""
        from jinja2 import Environment, FileSystemLoader, StrictUndefined

        from allanite import __version__

        environment = Environment(
            loader=FileSystemLoader(_HERE / "templates"), autoescape=True, undefined=StrictUndefined
        )
        text = environment.get_template("index.html").render(
            version=__version__,
            csrf=self.settings.csrf,
            plotly=self.plotly,
            static=lambda name: f"/static/{name}",
        )
        return HTMLResponse(text)

    def file(self, request: Request) -> Response | None:
        """One file by its name; None where there is none."""
        entry = self._files.get(request.path_params["name"])
        if entry is None:
            return None
        content, kind, mark = entry
        headers = {"ETag": mark, "Cache-Control": "private, no-cache"}
        if request.headers.get("if-none-match") == mark:
            return Response(status_code=304, headers=headers)
        return Response(content, headers={**headers, "Content-Type": kind})

    def script(self, request: Request) -> Response:
        """Plotly's, packed where the browser unpacks it: its address names the version, so it is fetched once."""
        headers: dict[str, Any] = {
            "Cache-Control": _FOR_EVER, "Vary": "Accept-Encoding", "Content-Type": "text/javascript; charset=utf-8"
        }  # fmt: skip
        if "gzip" in request.headers.get("accept-encoding", ""):
            return Response(_packed(), headers={**headers, "Content-Encoding": "gzip"})
        return Response(_plotly().read_bytes(), headers=headers)


@cache
def _packed() -> bytes:
    return gzip.compress(_plotly().read_bytes(), 6, mtime=0)


def _plotly() -> Path:
    from importlib.util import find_spec

    spec = find_spec("plotly")  # its files, without importing it
    assert spec is not None and spec.origin is not None  # noqa: S101 - the package needs it
    return Path(spec.origin).parent / "package_data" / "plotly.min.js"
