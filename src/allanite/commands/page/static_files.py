# SPDX-License-Identifier: BSD-3-Clause
"""The page itself: its template, its few files, and what draws figures in reports as well.

What can be served is read into a table when the server starts; a request only looks up a name in it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path

from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

from allanite.commands.page.settings import Settings
from allanite.lazy_dataclasses import dataclass
from allanite.views.figures import screen

__all__ = ["StaticFiles"]

_HERE = Path(__file__).parent
_TYPES: Mapping[str, str] = {
    ".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8", ".svg": "image/svg+xml",
    ".png": "image/png", ".woff2": "font/woff2", ".ico": "image/x-icon",
}  # fmt: skip


@dataclass(slots=True)
class StaticFiles:
    """All files of the page."""

    settings: Settings
    _files: dict[str, tuple[bytes, str, str]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        paths = [
            path for path in sorted((_HERE / "static").glob("*")) if path.is_file() and path.suffix in _TYPES
        ]
        contents = {path.name: path.read_bytes() for path in paths}
        contents |= {"chart.js": screen.script().encode(), "chart.css": screen.style().encode()}
        self._files = {name: _entry(name, content) for name, content in contents.items()}

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


def _entry(name: str, content: bytes) -> tuple[bytes, str, str]:
    """What is served of a file: content, type, and the mark of this version."""
    return content, _TYPES[Path(name).suffix], f'"{hashlib.sha256(content).hexdigest()[:24]}"'
