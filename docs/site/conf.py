# SPDX-License-Identifier: BSD-3-Clause
"""The documentation site: `make docs` builds build/site out of the Markdown as it is, and of the docstrings."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from numpydoc.xref import DEFAULT_LINKS
from sphinx.application import Sphinx

SITE = Path(__file__).resolve().parent
ROOT = SITE.parent.parent
sys.path.insert(0, str(SITE))

from cards import PAGES, for_sphinx  # noqa: E402
from notebook_pages import markdown_of  # noqa: E402
from python_pages import MODULES, index_page, names_of, write_pages  # noqa: E402

import allanite  # noqa: E402

project = "allanite"
author = "the allanite authors"
version = release = allanite.__version__

root_doc = "docs/index"
include_patterns = [*(pattern.replace("**/*", "**") for pattern in PAGES), "docs/reference/python/*.rst"]
exclude_patterns = [".*", "build", "dist", "demo", "src", "tests", "kernels", "docs/site"]

extensions = ["myst_parser", "numpydoc", "sphinx.ext.autodoc", "sphinx_copybutton", "mathml"]
source_suffix = {".md": "markdown", ".ipynb": "markdown", ".rst": "restructuredtext"}
default_role = "code"
suppress_warnings = [
    "misc.highlighting_failure",  # console output below a command is not always shell
]

myst_enable_extensions = ["attrs_block", "strikethrough"]
myst_fence_as_directive = ["math"]  # as GitHub draws it
myst_heading_anchors = 6  # anchors as GitHub makes them

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # they stand in the docstrings, in words
python_maximum_signature_line_length = 88
toc_object_entries_show_parents = "hide"
numpydoc_show_class_members = False
numpydoc_xref_param_type = True
DEFAULT_LINKS.clear()  # to the pages of Python and NumPy, which are elsewhere
numpydoc_xref_aliases = {name: f"{module}.{name}" for module in MODULES for name in names_of(module)}
numpydoc_xref_ignore = "all"  # but these

copybutton_prompt_text = "$ "
copybutton_line_continuation_character = "\\"

html_theme = "furo"
pygments_dark_style = "github-dark"
html_title = "allanite"
html_static_path = ["static"]
html_css_files = ["allanite.css"]
html_js_files = [("allanite.js", {"defer": "defer"})]
html_math_renderer = "mathml"
html_copy_source = False
html_show_copyright = html_show_sphinx = False
html_theme_options = {
    "navigation_with_keys": True,
    "light_css_variables": {
        "color-brand-primary": "#0b5fa5",
        "color-brand-content": "#0b5fa5",
        "color-brand-visited": "#5b4a9c",
    },
    "dark_css_variables": {
        "color-brand-primary": "#6cb4f5",
        "color-brand-content": "#6cb4f5",
        "color-brand-visited": "#b3a4f0",
    },
}


def prepare(app: Sphinx, document: str, source: list[str]) -> None:
    """What Sphinx reads in place of the Markdown on disk."""
    if document == "docs/reference/python":
        source[0] = index_page(source[0])
    if app.env.doc2path(document).suffix == ".ipynb":
        source[0] = markdown_of(source[0])
    if app.env.doc2path(document).suffix == ".md":
        source[0] = for_sphinx(source[0], document)


EMPTY_HEAD = re.compile(r'<th class="head([^"]*)"><p></p></th>')
SIGNATURE = re.compile(r"<dl>\n((?:<dd>(?:(?!</?dl>|</?dd>).)*</dd>\n?)+)</dl>", re.DOTALL)


def mend(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: object) -> None:
    """A corner of a table is no heading, and lines of a signature are no definitions: programs that read aloud ask."""
    if body := context.get("body"):
        body = EMPTY_HEAD.sub(r'<td class="head\1"></td>', body)
        context["body"] = SIGNATURE.sub(
            lambda lines: re.sub("<(/?)d[ld]>", r"<\1span>", lines[0]).replace(
                "<span>", '<span class="sig-line">'
            ),
            body,
        )


def write_entrance(app: Sphinx, failure: Exception | None) -> None:
    """The top of the site leads to its first page."""
    if failure is None and app.builder.format == "html":
        page = f'<!doctype html><title>allanite</title><meta http-equiv="refresh" content="0; url={root_doc}.html">\n'
        (Path(app.outdir) / "index.html").write_text(page, encoding="utf-8")


def write_python(app: Sphinx) -> None:
    """The pages of the docstrings, where Sphinx finds them."""
    folder = ROOT / "docs" / "reference"
    write_pages((folder / "python.md").read_text(encoding="utf-8"), folder / "python")


def setup(app: Sphinx) -> None:
    app.connect("builder-inited", write_python)
    app.connect("source-read", prepare)
    app.connect("html-page-context", mend)
    app.connect("build-finished", write_entrance)
