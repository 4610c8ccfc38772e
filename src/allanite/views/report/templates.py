# SPDX-License-Identifier: BSD-3-Clause
"""The templates of reports, compiled once for an installation.

Jinja takes longer to compile a template than to fill it. Its code is kept where Python keeps that of modules: in
``__pycache__``, unless the folder is read-only or `sys.dont_write_bytecode` is set.
"""

from __future__ import annotations

import functools
import hashlib
import sys
from contextlib import suppress
from importlib.util import cache_from_source
from pathlib import Path
from typing import Any

import jinja2
from jinja2 import BytecodeCache, Environment, FileSystemLoader, StrictUndefined, pass_context
from jinja2.bccache import Bucket
from jinja2.runtime import Context
from markupsafe import Markup

from allanite.errors import StorageError
from allanite.plain_files.atomic_file import fresh, make_folder
from allanite.plain_files.printable import printable
from allanite.views.pieces import finding_rows
from allanite.views.report.powers import with_links, with_powers

__all__ = ["templates"]

_HERE = Path(__file__).parent
_DIGEST = 32  # bytes before the code: damage is noticed


class KeptCode(BytecodeCache):
    """The code of templates in files beside that of modules; what is damaged, or of another version, is replaced."""

    def load_bytecode(self, bucket: Bucket) -> None:
        with suppress(OSError):  # there is none
            content = _place(bucket).read_bytes()
            if content.startswith(_digest(content[_DIGEST:])):
                bucket.bytecode_from_string(content[_DIGEST:])

    def dump_bytecode(self, bucket: Bucket) -> None:
        if sys.dont_write_bytecode:
            return
        place, code = _place(bucket), bucket.bytecode_to_string()
        with suppress(StorageError):  # a folder that is not ours to write into
            make_folder(place.parent)
            with fresh(place, force=True) as file:
                file.write_bytes(_digest(code) + code)

    def get_cache_key(self, name: str, filename: str | None = None) -> str:
        return name

    def get_source_checksum(self, source: str) -> str:
        """Of all that the code follows from: the template, Jinja, and the settings below."""
        versions = f"{jinja2.__version__}\n{Path(__file__).read_text(encoding='utf-8')}"
        return hashlib.sha256(f"{versions}\n{source}".encode()).hexdigest()


def _digest(code: bytes) -> bytes:
    return hashlib.sha256(code).digest()


def _place(bucket: Bucket) -> Path:
    return Path(cache_from_source(str(_HERE / bucket.key))).with_suffix(".jinja")


@functools.cache
def templates() -> Environment:
    """All of them, each loaded once in a process."""
    environment = Environment(
        loader=FileSystemLoader(_HERE),
        autoescape=True,
        finalize=_shown,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        bytecode_cache=KeptCode(),
    )
    environment.filters["power"] = pass_context(_linked)
    environment.globals["finding_rows"] = finding_rows
    return environment


def _linked(context: Context, text: str) -> Markup:
    """Text with its powers, and with links to the files beside the report."""
    return with_links(with_powers(text), context.get("beside", ()))


def _shown(value: Any) -> Any:
    """Text out of a record, which may hold what turns a line around; markup is ours."""
    return printable(value, lines=True) if type(value) is str else value
