# SPDX-License-Identifier: BSD-3-Clause
"""The notes of a release, if the tree is ready for it: python packaging/release_notes.py v1.2.3

Prints the section of the version in CHANGELOG.md. Refuses a tag that is not the version of the package, a version
without a dated section, a citation of another version, and a repository that is not the one in pyproject.toml.
"""

from __future__ import annotations

import argparse
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

__all__ = ["notes", "obstacles"]

ROOT = Path(__file__).resolve().parent.parent


def obstacles(tag: str, repository: str | None, root: Path = ROOT) -> Iterator[str]:
    """What has to be done before the tag can be released, in words."""
    version = _version(root)
    if tag != f"v{version}":
        yield f"the tag is {tag}, the package {version}: set __version__ in src/allanite/__init__.py, or tag v{version}"
    if not re.search(rf"^## \[{re.escape(version)}\] - \d{{4}}-\d\d-\d\d$", _changes(root), re.M):
        yield f"CHANGELOG.md has no section '## [{version}] - YYYY-MM-DD': rename [Unreleased]"
    cited = re.findall(r"^version: (.*)$", (root / "CITATION.cff").read_text(encoding="utf-8"), re.M)
    if cited != [version]:
        yield f"CITATION.cff cites version {', '.join(cited)}, the package is {version}"
    stated = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["allanite"][
        "repository"
    ]
    if repository is not None and stated.rstrip("/") != repository.rstrip("/"):
        yield f"repository in [tool.allanite] of pyproject.toml is {stated!r}, the tag was pushed to {repository!r}"


def notes(root: Path = ROOT) -> str:
    """The section of the package's version in CHANGELOG.md, without its heading."""
    begin = re.search(rf"^## \[{re.escape(_version(root))}\].*\n", _changes(root), re.M)
    if begin is None:
        return ""
    rest = _changes(root)[begin.end() :]
    return re.split(r"^## \[", rest, maxsplit=1, flags=re.M)[0].strip() + "\n"


def _version(root: Path) -> str:
    code = (root / "src/allanite/__init__.py").read_text(encoding="utf-8")
    (version,) = re.findall(r'^__version__ = "(.*)"$', code, re.M)
    return str(version)


def _changes(root: Path) -> str:
    return (root / "CHANGELOG.md").read_text(encoding="utf-8")


def main() -> None:
    """Print the notes, or what is missing."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tag", help="as pushed: v1.2.3")
    parser.add_argument("--repository", help="where it was pushed: https://...")
    given = parser.parse_args()
    if found := list(obstacles(given.tag, given.repository)):
        raise SystemExit("not ready for a release:\n" + "\n".join(f"* {words}" for words in found))
    print(notes(), end="")


if __name__ == "__main__":
    main()
